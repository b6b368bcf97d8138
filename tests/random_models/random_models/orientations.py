"""Rotations that random trees of joints do not have: about axes that move, by quaternions that move, stacks of frames and points;
forces and torques at points, between bodies and in axes of a third; solids of triangles.

Each statement holds what it means in other words, which a twin says in its place.
"""

from __future__ import annotations

from random_models.lists import Chain
from random_models.scope import Scope

SHARE = 0.2
"""Of the models with bodies."""


def orientations(s: Scope, seed: int) -> None:
    """Write some. Their random numbers are their own: models keep all else."""
    if not s.space:
        return
    with s.apart(f"orientations of {seed}"):
        if s.chance(SHARE):
            _Orientations(s).write()


class _Orientations(Chain):
    """Writes two angles, and what turns by them."""

    def write(self) -> None:
        s = self.s
        self.a, self.b = (s.fresh("q") for _ in range(2))
        for q in (self.a, self.b):
            start, rate = self.numbers(2, -1, 1)
            text = f"coordinate Angle {q} = {start:g} rad;"
            self.say(text, text, name=q)
            self.same(f"initial der({q}) = {rate:g} rad/s;", f"kinetic 1/2*{self.numbers(1)[0]:g} kg.m^2*der({q})^2;",
                      f"potential {self.numbers(1)[0]:g} J*(1 - cos({q}));")  # fmt: skip
        self.frames: list[str] = []
        self.turn = "rot" if s.space == 2 else "rotz"
        every = [self._plain, self._stack]
        further = [self._pull, self._turn, self._points, self._seen]
        if s.space == 3:
            every = [self._axis, self._quaternion, self._product, self._stack]
            further.append(self._solid)
        for part in s.random.sample(every, s.pick((1, 2, 2))):
            part()
        for part in s.random.sample(further, s.pick((2, 3))):
            part()

    def vector(self, unit: str, low: float = -0.6, high: float = 0.6) -> str:
        """Write the components of a vector."""
        return "{" + ", ".join(f"{v:g}" for v in self.numbers(self.s.space, low, high)) + f"}} {unit}"

    def frame(self, pose: str, plain: str) -> str:
        """Write a frame that carries mass."""
        s, f = self.s, self.s.fresh("f")
        self.say(f"frame {f} = {pose};", f"frame {f} = {plain};", name=f)
        sizes = [f"{v:g}" for v in self.numbers(3, 0.2, 0.3)]
        self.same(f"mass {self.numbers(1)[0]:g} kg at {f} * {self.vector('m')};")
        if s.chance(0.6):
            self.same(
                f"inertia {sizes[0]} kg.m^2 on {f};"
                if s.space == 2
                else f"inertia diag({{{', '.join(sizes)}}} kg.m^2) on {f};"
            )
        self.frames.append(f)
        return f

    def base(self) -> str:
        """Return where a frame begins."""
        s = self.s
        known = ["world", *self.frames, *(str(f) for f in s.bodies)]
        return s.pick(known) + (f" * trans({self.vector('m')})" if s.chance(0.5) else "")

    def angle(self) -> str:
        """Return an angle that moves."""
        return self.s.pick((self.a, self.b, f"({self.a} - 0.5*{self.b})", f"({self.b} + 0.4 rad/s*time)"))

    def _plain(self) -> None:
        """Two turns in the plane, one after the other."""
        base, one, two = self.base(), self.angle(), self.angle()
        step = self.vector("m")
        self.frame(
            f"{base} * rot({one}) * trans({step}) * rot({two})",
            f"{base} * (rot({one}) * trans({step})) * rot({two})",
        )

    def _axis(self) -> None:
        """About an axis that moves in a plane: there, about an axis of the frame, and back."""
        base, angle = self.base(), self.angle()
        by = self.s.pick((self.a, self.b, "(0.7 rad/s*time)", "0.4 rad"))
        axis, there, turn = self.s.pick((
            ("{cos(%s), sin(%s), 0}", "rotz", "rotx"), ("{0, cos(%s), sin(%s)}", "rotx", "roty"), ("{sin(%s), 0, cos(%s)}", "roty", "rotz"),
            ("{2*cos(%s), 2*sin(%s), 0}", "rotz", "rotx"),
        ))  # fmt: skip
        self.frame(
            f"{base} * axis_angle({axis % (by, by)}, {angle})",
            f"{base} * {there}({by}) * {turn}({angle}) * {there}(-{by})",
        )

    def _quaternion(self) -> None:
        """By a quaternion that moves, of any length."""
        base, angle = self.base(), self.angle()
        size = self.s.pick(("", "2*", "-", "0.3*"))
        k = self.s.pick((0, 1, 2))
        parts = [f"{size}sin({angle}/2)" if j == k else "0" for j in range(3)]
        self.frame(
            f"{base} * quat({size}cos({angle}/2), {', '.join(parts)})", f"{base} * rot{'xyz'[k]}({angle})"
        )

    def _product(self) -> None:
        """By a product of poses that stands in parentheses, or is chosen."""
        base, one, two = self.base(), self.angle(), self.angle()
        if self.s.chance(0.5):
            self.frame(f"{base} * (rotx({one}) * rotz({two}))", f"{base} * rotx({one}) * rotz({two})")
        else:
            self.frame(
                f"{base} * (if 1 < 2 then rotx({one}) else rotx({one}) * rotz(1 rad))",
                f"{base} * rotx({one})",
            )

    def _stack(self) -> None:
        """Frames in a row, each from the one before it."""
        f, i, n = self.s.fresh("f"), self.i, self.s.pick((2, 3))
        angle, step = self.angle(), self.vector("m")
        self.say(f"frame {f}[{i} in 1:{n}] = world * trans({i}*{step}) * {self.turn}({i}*{angle});",
                 *(f"frame {f}{k} = world * trans({k}*{step}) * {self.turn}({k}*{angle});" for k in range(1, n + 1)), name=f)  # fmt: skip
        offset, m = self.vector("m"), self.numbers(1)[0]
        self.say(f"for {i} in 1:{n} loop mass {m:g} kg*{i} at {f}[{i}] * {offset}; end for;",
                 *(f"mass {m * k:.17g} kg at {f}{k} * {offset};" for k in range(1, n + 1)))  # fmt: skip
        self.output(f"pos({f}[{n}] * {offset})", f"pos({f}{n} * {offset})")
        self.output(f"angvel({f}[2])", f"angvel({f}2)")

    def _some(self) -> str:
        return self.s.pick([*self.frames, *(str(f) for f in self.s.bodies)] or ["world"])

    def _pull(self) -> None:
        """A force on the material of a frame at a point of another, against a third, in axes of a fourth."""
        if not self.frames:
            return
        s, on, off, axes = self.s, self.s.pick(self.frames), self._some(), self._some()
        at, value = f"{self._some()} * {self.vector('m')}", self.vector("N", -1, 1)
        tail, name = "", s.fresh("F")
        against = s.chance(0.5)
        if against:
            tail += f" from {off}"
        inside = s.chance(0.5)
        text = f"force {name}: {value} on {on} at {at}{tail}" + (f" in {axes};" if inside else ";")
        world = f"direction({axes}, {value})" if inside else value
        plain = [f"force {name}: {world} on {on};", f"torque {self._arm(on, at, world)} on {on};"]
        if against:
            plain += [f"force -{world} on {off};", f"torque -{self._arm(off, at, world)} on {off};"]
        self.say(text, *plain, name=name)

    def _arm(self, frame: str, point: str, force: str) -> str:
        return f"cross(pos({point}) - pos({frame}), {force})"

    def _turn(self) -> None:
        """A torque on a frame, against another, in axes of a third."""
        if not self.frames:
            return
        if self.s.space == 2:
            on, off, c = self.s.pick(self.frames), self._some(), self.numbers(1, -0.5, 0.5)[0]
            self.say(
                f"torque {c:g} N.m on {on} from {off};",
                f"torque {c:g} N.m on {on};",
                f"torque -({c:g}) N.m on {off};",
            )
            return
        on, off, axes, value = (
            self.s.pick(self.frames),
            self._some(),
            self._some(),
            self.vector("N.m", -0.5, 0.5),
        )
        world = f"direction({axes}, {value})"
        self.say(
            f"torque {value} on {on} from {off} in {axes};",
            f"torque {world} on {on};",
            f"torque -{world} on {off};",
        )

    def _points(self) -> None:
        """Points in a row, of which one is pushed and one is heavy."""
        if not self.frames:
            return
        s, p, i, f = self.s, self.s.fresh("P"), self.i, self.s.pick(self.frames)
        c, offset, push = self.numbers(1, 0.2, 0.6)[0], self.vector("m"), self.vector("N")
        rest = ", 0" * (s.space - 1)
        self.say(f"point {p}[{i} in 1:3] = {f} * ({offset} + {{{c:g}*{i}{rest}}} m);",
                 *(f"point {p}{k} = {f} * ({offset} + {{{c * k:.17g}{rest}}} m);" for k in (1, 2, 3)), name=p)  # fmt: skip
        self.say(f"mass 0.4 kg at {p}[2];", f"mass 0.4 kg at {p}2;")
        self.say(f"force {push} on {p}[3] from {p}[1];", f"force {push} on {p}3 from {p}1;")
        self.output(f"pos({p}[3])", f"pos({p}3)")
        self.output(f"vel({p}[1], {f})[2] + vel({p}[2])[1]", f"vel({p}1, {f})[2] + vel({p}2)[1]")

    def _solid(self) -> None:
        """A tetrahedron of triangles, two corners of which move."""
        s, c = self.s, self.s.fresh("l")
        corners = [
            "{0, 0, 0} m",
            f"{{{1 + self.numbers(1)[0]:g}, 0, 0.1}} m",
            f"{{0.1 m, 1 m, 0.2 m*sin({self.a})}}",
            f"{{0.2 m*{self.b}, 0.1 m, 1.5 m}}",
        ]
        faces = "{{1, 3, 2}, {1, 2, 4}, {2, 3, 4}, {3, 1, 4}}"
        text = f"let {c} = {{{', '.join(corners)}}};"
        self.say(text, text, name=c)
        volume = f"dot({c}[2] - {c}[1], cross({c}[3] - {c}[1], {c}[4] - {c}[1]))/6"
        self.output(f"mesh_volume({c}, {faces})", volume)
        self.output(f"mesh_centre({c}, {faces})", f"({c}[1] + {c}[2] + {c}[3] + {c}[4])/4")
        self.same(f"output {s.fresh('o')} = mesh_inertia({c}, {faces});")
        self.say(f"potential 0.3 Pa*mesh_volume({c}, {faces});", f"potential 0.3 Pa*{volume};")

    def _seen(self) -> None:
        """Velocities and turnings, seen from frames that move."""
        f, g = self._some(), self._some()
        if "world" in (f, g) or f == g:
            return
        point = f"{g} * {self.vector('m')}"
        self.output(
            f"angvel({f}, {g})", f"angvel({f})" if self.s.space == 2 else f"components({g}, angvel({f}))"
        )
        self.output(f"vel({point}, {f})", f"components({f}, vel({point}) - vel_at({f}, {point}))")
        self.output(f"direction({f}, components({f}, vel({point})))", f"vel({point})")
        self.output(f"local({f}, {point})", f"components({f}, pos({point}) - pos({f}))")
