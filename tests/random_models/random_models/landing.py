"""What lands: in a groove between two floors or walls, obliquely on a rough floor with two slips, on the corners of a body that turns,
which is also pushed at a point of it.

Each statement holds what it means by coordinates alone, which a twin says in its place.
"""

from __future__ import annotations

import math

from random_models.lists import Chain
from random_models.scope import Scope

SHARE = 0.7
"""Of the models without bodies that are small and in which nothing else hits: a motion by definition is slow."""
FEW = 3
"""Coordinates that they may have."""
LONG = 40
"""Statements of a model that is too long."""


def landing(s: Scope, seed: int) -> None:
    """Write something that lands. Its random numbers are its own: models keep all else."""
    if s.space or len(s.coordinates) > FEW or len(s.statements) > LONG:
        return
    if any(st.kind == "contact" for st in s.statements):
        return
    with s.apart(f"landing of {seed}"):
        if s.chance(SHARE):
            _Landing(s).write()


class _Landing(Chain):
    """Writes a body that falls."""

    def write(self) -> None:
        s = self.s
        s.pick((self._groove, self._oblique, self._oblique, self._corners, self._pushed))()

    def coordinate(self, start: float, rate: float, angle: bool = False) -> str:
        """Write a coordinate; return its name."""
        q = self.s.fresh("q")
        kind, unit = ("Angle", "rad") if angle else ("Length", "m")
        text = f"coordinate {kind} {q} = {start:.17g} {unit};"
        self.say(text, text, name=q)
        self.same(f"initial der({q}) = {rate:.17g} {unit}/s;")
        return q

    def _groove(self) -> None:
        """A gap that is the least of two: one contact, which holds where either does."""
        s, c, n = self.s, self.s.fresh("C"), self.s.fresh("n")
        a, b, height, speed, m = self.numbers(5, 0.3, 0.9)
        x = self.coordinate(s.pick((-0.2, 0.1, 0.2)), speed * s.pick((-1, 1)))
        y = self.coordinate(0.2 * max(a, b) + 0.2 * height, 0)
        self.same(f"kinetic 1/2*{m:g} kg*(der({x})^2 + der({y})^2);", f"potential {m:g} kg*9.81 m/s^2*{y};")
        one, two = f"{y} - {a:g}*{x}", f"{y} + {b:g}*{x}"
        gap = s.pick((f"min({one}, {two})", f"min({two}, {one})", f"{y} - max({a:g}*{x}, -{b:g}*{x})"))
        tail = s.pick(("", "", f" restitution {0.5 * speed:g}"))
        self.say(
            f"contact {c}: {gap}{tail};",
            f"contact {c}a: {one}{tail};",
            f"contact {c}b: {two}{tail};",
            kind="contact",
        )
        either = f"(closed({c}a) or closed({c}b))"
        if s.chance(0.7):
            self.output(f"multiplier({c})", f"(multiplier({c}a) + multiplier({c}b))")
        self.output(f"(if closed({c}) then 1 else 0)", f"(if {either} then 1 else 0)")
        if s.chance(0.6):
            self.say(f"damping (if closed({c}) then {b:g} kg/s else 0.05 kg/s) on {x};",
                     f"damping (if {either} then {b:g} kg/s else 0.05 kg/s) on {x};")  # fmt: skip
        else:
            self.say(f"force (if not closed({c}) then {b:g} N else 0 N) on {x};",
                     f"force (if not {either} then {b:g} N else 0 N) on {x};")  # fmt: skip
        if s.chance(0.3):
            text = f"discrete Real {n} = 0;"
            self.say(text, text, name=n)
            self.say(f"when closed({c}) then {n} := {n} + 1; end when;", f"when {either} then {n} := {n} + 1; end when;",
                     kind="when")  # fmt: skip

    def _oblique(self) -> None:
        """A ball that meets a rough floor with two slips: at the edge of the cone of friction, within or beyond it."""
        s, c = self.s, self.s.fresh("C")
        u, m, height = self.numbers(3, 0.5, 1.5)
        ratio = s.pick((0.3, 0.6, 0.9, 1.0, 1.1))
        drop = 0.05 + 0.05 * height
        x, y = self.coordinate(0, u), self.coordinate(0, u * ratio * s.pick((-1, 1)))
        z = self.coordinate(drop, 0)
        self.same(
            f"kinetic 1/2*{m:g} kg*(der({x})^2 + der({y})^2 + der({z})^2);",
            f"potential {m:g} kg*9.81 m/s^2*{z};",
        )
        rebound = s.pick((0.0, 0.0, 0.4))
        whole = (1 + rebound) * math.sqrt(2 * 9.81 * drop)
        # friction beyond it sticks at once: between the larger component and the size of both lies the edge
        share = s.pick(
            (
                s.random.uniform(0.4, 0.9),
                s.random.uniform(1.05, 1.2),
                s.random.uniform(1.05, 1.2),
                s.random.uniform(1.6, 2),
            )
        )
        grip = share * u * max(1, ratio) / whole
        belt = s.pick(("", "", " - 0.05 m/s"))
        tail = f" restitution {rebound:g}" if rebound else ""
        static = f" static {1.3 * grip:.4g}" if s.chance(0.25) else ""
        text = f"contact {c}: {z}{tail} friction {grip:.4g}{static} along {{der({x}){belt}, der({y})}};"
        self.say(text, text, kind="contact")
        self.same(f"force 0.3 N - 0.4 N/m*{x} on {x};")

    def _body(self) -> tuple[str, str, str, str]:
        """Write a body in the plane; return its frame, place and angle."""
        s, f = self.s, self.s.fresh("f")
        m, inertia, height = self.numbers(3, 0.4, 1.5)
        x, y = self.coordinate(0, float(s.number(-0.8, 0.8))), self.coordinate(0.3 + 0.1 * height, 0)
        a = self.coordinate(float(s.number(-0.4, 0.4)), float(s.number(-1, 1)), angle=True)
        self.say(f"frame {f} = world * trans({{{x}, {y}}}) * rot({a});", name=f)
        self.say(f"mass {m:g} kg at {f};", f"kinetic 1/2*{m:g} kg*(der({x})^2 + der({y})^2);")
        self.say(
            f"inertia {0.1 * inertia:g} kg.m^2 on {f};", f"kinetic 1/2*{0.1 * inertia:g} kg.m^2*der({a})^2;"
        )
        self.say(f"potential {m:g} kg*9.81 m/s^2*pos({f})[2];", f"potential {m:g} kg*9.81 m/s^2*{y};")
        return f, x, y, a

    def _corners(self) -> None:
        """A box whose lower corners may touch the floor, with friction along the velocity of each."""
        s = self.s
        f, x, y, a = self._body()
        wide, high = 0.2, 0.15
        mu, e = self.numbers(2, 0.2, 0.7)
        for side in s.pick(((-wide, wide), (wide,))):
            c, p = s.fresh("C"), s.fresh("P")
            corner = f"{f} * {{{side:g}, {-high:g}}} m"
            self.say(f"point {p} = {corner};", name=p)
            where = s.pick((p, corner)) if s.chance(0.5) else p
            rough = s.chance(0.7)
            up = f"({y} + {side:g} m*sin({a}) - {high:g} m*cos({a}))"
            along = f"der({x} + {side:g} m*cos({a}) + {high:g} m*sin({a}))"
            tail = f" restitution {e:g}" if s.chance(0.5) else ""
            self.say(f"contact {c}: pos({where})[2]{tail}" + (f" friction {mu:g} along vel({p})[1];" if rough else ";"),
                     f"contact {c}: {up}{tail}" + (f" friction {mu:g} along {along};" if rough else ";"), kind="contact")  # fmt: skip
            self.output(f"pos({where})[2]", up)
            self.output(f"vel({p})[1]", along)

    def _pushed(self) -> None:
        """Impulses at a point of a body, in the axes of the world or of the body."""
        s = self.s
        f, x, y, a = self._body()
        (px, py), (jx, jy) = self.numbers(2, -0.5, 0.5), self.numbers(2, -1, 1)
        late = f"{float(s.number(0.05, 0.3)):g} s"
        arm = (f"({px:g} m*cos({a}) - {py:g} m*sin({a}))", f"({px:g} m*sin({a}) + {py:g} m*cos({a}))")
        inside = s.chance(0.5)
        push = (f"({jx:g} N.s)", f"({jy:g} N.s)")
        if inside:
            push = (
                f"({jx:g} N.s*cos({a}) - {jy:g} N.s*sin({a}))",
                f"({jx:g} N.s*sin({a}) + {jy:g} N.s*cos({a}))",
            )
        text = f"impulse {{{jx:g}, {jy:g}}} N.s on {f} at {f} * {{{px:g}, {py:g}}} m" + (
            f" in {f};" if inside else ";"
        )
        plain = f"impulse {push[0]} on {x}; impulse {push[1]} on {y}; impulse {arm[0]}*{push[1]} - {arm[1]}*{push[0]} on {a};"
        condition = f"time > {late}"
        self.say(
            f"when {condition} then {text} end when;", f"when {condition} then {plain} end when;", kind="when"
        )
        if s.chance(0.5):
            c = s.fresh("C")
            self.say(f"contact {c}: pos({f} * {{0.2, -0.1}} m)[2] restitution 0.3;",
                     f"contact {c}: {y} + 0.2 m*sin({a}) - 0.1 m*cos({a}) restitution 0.3;", kind="contact")  # fmt: skip
