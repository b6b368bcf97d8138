"""What holds within a loop, a part or a file alone: indices that hide others, rests of one part, values that a part is given or not, models
called as those of a library, shapes on frames by other names, filters of inputs, and states that begin as inputs.

Each statement holds what it means in plain words, which a twin says in its place.
"""

from __future__ import annotations

from dataclasses import replace

from random_models.lists import Chain
from random_models.scope import Scope
from random_models.tree import statement

SHARE = 0.05
"""Of the models."""
SIZED = 0.02
LIBRARY = ("Motor", "TorsionDamper", "SpeedMotor", "TorsionSpring", "Weld", "Damper")
"""Parts in the plane and in space, after which a model of the file is called where nothing else uses them."""


def within(s: Scope, seed: int) -> None:
    """Write some of it. The random numbers are its own: models keep all else, and those that are known to catch a mutant have none."""
    with s.apart(f"within 1142 of {seed}"):
        if s.chance(SHARE):
            _Within(s).write()


def sized(s: Scope, seed: int) -> None:
    """Write parts whose sizes the experiment says. The random numbers are its own, as above."""
    with s.apart(f"sized 5 of {seed}"):
        if s.chance(SIZED):
            _Within(s).size()


def resting(s: Scope) -> None:
    """Write a part that begins at rest."""
    _Within(s).rest()


class _Within(Chain):
    """Writes masses that feel nothing of each other."""

    def write(self) -> None:
        s = self.s
        every = [self._indices, self._given, self._filter, self._begun]
        if s.space:
            every += [self._called_as_a_part, self._shapes]
        for part in s.random.sample(every, s.pick((1, 2, 2, 3))):
            part()

    def define(self, name: str, body: str) -> None:
        """Write a model beside that which runs."""
        self.s.file.items.append(statement("class", f"model {name} {body} end {name};", name=name))

    def _mass(self, start: str) -> str:
        """Write a mass on a spring, and return what it is called."""
        q = self.s.fresh("q")
        m, k = self.numbers(2)
        self.same(
            f"coordinate Length {q} = {start};",
            f"kinetic 1/2*{m:g} kg*der({q})^2;",
            f"potential 1/2*{k:g} N/m*{q}^2;",
        )
        return q

    def _indices(self) -> None:
        """Indices by the name of an index around them, or of a parameter."""
        s, x, i = self.s, self.x, self.i
        n, k = s.pick((2, 3)), s.pick((2, 3, 4))
        m, c = self.numbers(2)
        start = ", ".join(f"{v:g}" for v in self.numbers(n, -0.5, 0.5))
        self.same(
            f"coordinate Length {x}[{n}] = {{{start}}} m;", f"kinetic 1/2*{m:g} kg*dot(der({x}), der({x}));"
        )
        if s.chance(0.5):
            text = f"parameter {i} = {self.numbers(1)[0]:g};"
            self.same(text, f"output {s.fresh('o')} = {i}^2;")
        self.say(
            f"for {i} in 1:{n} loop force sum({c:g} N*{i} for {i} in 1:{k}) on {x}[{i}]; end for;",
            *(f"force {c * k * (k + 1) / 2:.17g} N on {x}[{j}];" for j in range(1, n + 1)),
        )
        sums = (" + ".join(f"{a}*{x}[{a}]" for a in range(1, j + 1)) for j in range(1, n + 1))
        self.output(f"{{sum({i}*{x}[{i}] for {i} in 1:{i}) for {i} in 1:{n}}}", f"{{{', '.join(sums)}}}")

    def rest(self) -> None:
        """A part that begins at rest beside one whose name begins as that of the first."""
        s, part, name = self.s, self.s.fresh("Rest"), self.s.fresh("arm")
        m, k, f = self.numbers(3)
        body = (f"coordinate Length q ~ 0.1 m; kinetic 1/2*{m:g} kg*der(q)^2; potential 1/2*{k:g} N/m*q^2 - {f:g} N*q;")  # fmt: skip
        self.define(part, f"{body} initial stationary;")
        self.define(f"{part}Plain", body)
        self.say(
            f"{part} {name};",
            f"{part}Plain {name};",
            f"initial der({name}.q) = 0 m/s;",
            f"initial der({name}.q, 2) = 0 m/s^2;",
            name=name,
        )
        start = self.numbers(1, -0.8, 0.8)[0]
        rate = s.pick(("", f", der(q) ~ {self.numbers(1, -0.8, 0.8)[0]:g} m/s"))
        self.same(f"{part}Plain {name}b(q ~ {start:g} m{rate});")

    def size(self) -> None:
        """A part, or a part of one, of which the model, what is around it and the experiment say how long it is: the experiment counts."""
        s, part, name = self.s, self.s.fresh("Row"), self.s.fresh("a")
        m, k, f = self.numbers(3)
        n, said, own = s.random.sample((1, 2, 3, 4), 3)
        self.define(
            part,
            f"structural parameter Integer n = {own}; coordinate Length q[n] ~ 0.1 m; kinetic 1/2*{m:g} kg*dot(der(q), der(q)); "
            f"for i in 1:n loop potential 1/2*{k:g} N/m*i*(q[i] - 0.1 m*i)^2; end for; "
            f"if n > 2 then force -{f:g} N on q[n]; end if; output total = sum(q);",
        )
        path = "n"
        if s.chance(0.4):
            whole, path = s.fresh("Whole"), "inside.n"
            self.define(
                whole,
                f"{part} inside{s.pick(('', f'(n = {own})'))}; output total = inside.total;",
            )
            part = whole
        mods = s.pick(("", f"({path} = {said})", f"({path} = {said})"))
        self.say(f"{part} {name}{mods};", f"{part} {name}({path} = {n});", name=name)
        s.statements[-1] = replace(
            s.statements[-1],
            data={**(s.statements[-1].data or {}), "in the experiment": f", {name}.{path} = {n}"},
        )
        self.same(f"output {s.fresh('o')} = {name}.total;")
        with s.apart(f"namesakes of {name} with {m} and {k}"):
            if s.chance(0.5):
                self._namesakes()

    def _namesakes(self) -> None:
        """A size of the whole model that the experiment says, beside parts that call their own by the same name."""
        s, n, part, name = self.s, self.s.fresh("N"), self.s.fresh("Row"), self.s.fresh("a")
        m, k = self.numbers(2)
        told, said, own = s.random.sample((1, 2, 3, 4), 3)
        self.define(
            part,
            f"structural parameter Integer {n} = {own}; coordinate Length q[{n}] ~ 0.1 m; kinetic 1/2*{m:g} kg*dot(der(q), der(q)); "
            f"potential 1/2*{k:g} N/m*dot(q, q); output total = {n}*sum(q);",
        )
        self.say(
            f"structural parameter Integer {n} = {said};",
            f"structural parameter Integer {n} = {told};",
            name=n,
        )
        s.statements[-1] = replace(
            s.statements[-1],
            data={**(s.statements[-1].data or {}), "in the experiment": f", {n} = {told}"},
        )
        mods = s.pick(("", f"({n} = {own})"))
        self.same(f"{part} {name}{mods};", f"output {s.fresh('o')} = {n}*{name}.total;")

    def _given(self) -> None:
        """A part that asks which of its values it is given."""
        s, part, name = self.s, self.s.fresh("Asks"), self.s.fresh("a")
        m, a, b, c = self.numbers(4)
        place, stiff = f"potential {a:g} N/m*(q - 0.1 m)^2;", f"force -{b:g} N on q;"
        told = {"q": s.chance(0.5), "c": s.chance(0.5)}
        values = [
            *([f"q = {a / 4:g} m"] if told["q"] else []),
            *([f"der(q) = {b / 4:g} m/s"] if s.chance(0.6) else []),
            *([f"c = {c:g} N/m"] if told["c"] else []),
        ]
        head = f"coordinate Length q ~ 0.2 m; parameter Stiffness c = 0.7 N/m; kinetic 1/2*{m:g} kg*der(q)^2; potential 1/2*c*q^2;"
        self.define(part, f"{head} if given(q) then {place} end if; if not given(c) then {stiff} end if;")
        plain = f"{place if told['q'] else ''} {'' if told['c'] else stiff}"
        self.define(f"{part}Plain", f"{head} {plain}")
        mods = f"({', '.join(values)})" if values else ""
        self.say(f"{part} {name}{mods};", f"{part}Plain {name}{mods};", name=name)

    def _called_as_a_part(self) -> None:
        """A model of the file by the name of one that is imported, with all others."""
        s = self.s
        written = "".join(one.text() for one in (*s.statements, *s.file.items))
        kind = next((k for k in s.random.sample(LIBRARY, len(LIBRARY)) if k not in written), None)
        if kind is None:
            return
        name, (m, k) = s.fresh("a"), self.numbers(2)
        body = f"parameter Mass m = 1 kg; coordinate Length q ~ 0.3 m; kinetic 1/2*m*der(q)^2; potential 1/2*{k:g} N/m*q^2;"
        self.define(kind, body)
        self.define(f"{kind}OfFile", body)
        self.say(f"{kind} {name}(m = {m:g} kg);", f"{kind}OfFile {name}(m = {m:g} kg);", name=name)

    def _shapes(self) -> None:
        """A part that touches a plane with shapes on its frames, of which one is called otherwise."""
        s = self.s
        part, name, joint, sole, floor, one, other, touch = (
            s.fresh(k) for k in ("Foot", "b", "j", "f", "P", "S", "S", "C")
        )
        planar = s.space == 2
        zero = "0 m, " * (s.space - 1)
        m, far, r, h = self.numbers(4, 0.2, 0.6)
        inertia = f"{m:g} kg.m^2" if planar else f"diag({{{m:g}, {m:g}, {m:g}}} kg.m^2)"
        self.define(
            part,
            f"frame a; frame tip = a * trans({{{zero}-{far:g} m}}); mass {m:g} kg at a; inertia {inertia} on a;",
        )
        s.file.items.insert(0, statement("import", "import mech.shapes.{Plane, Sphere};"))
        high = 1 + 4 * h
        place = f"y = {high:g} m" if planar else f"position = {{0, 0, {high:g}}} m"
        self.same(
            f"{part} {name};", f"Free {joint}(world -> {name}.a, {place});", f"frame {sole} = {name}.tip;"
        )
        self.say(
            f"shape {one}: Sphere(r = {r:g} m) on {sole};", f"shape {one}: Sphere(r = {r:g} m) on {name}.tip;"
        )
        bounce = s.pick(("", f" restitution {self.numbers(1, 0.2, 0.8)[0]:g}"))
        self.same(
            f"shape {other}: Sphere(r = {r / 2:g} m) on {name}.a;",
            f"shape {floor}: Plane on world;",
            f"contact {touch}: {name} with {floor}{bounce};",
            f"output {s.fresh('o')} = multiplier({touch});",
            f"output {s.fresh('o')} = min({touch}.gap);",
        )

    def _filter(self) -> None:
        """An input behind a filter, which pushes or drives; the twin has the two states of the filter in a part."""
        s, u, part = self.s, self.s.fresh("u"), self.s.fresh("Filter")
        tau, first, k = self.numbers(3, 0.1, 0.8)
        self.define(
            part,
            f"input Length u = {first:g} m; state Length filtered = u; state Velocity filtered_rate = 0 m/s; "
            f"equation der(filtered) = filtered_rate; equation der(filtered_rate) = (u - filtered)/({tau:g} s)^2 - 2*filtered_rate/({tau:g} s);",
        )
        self.say(f"input Length {u}(filter = {tau:g} s) = {first:g} m;", f"{part} {u};", name=u)
        x = self._mass("0.1 m")
        if s.chance(0.5):
            q = s.fresh("q")
            self.same(f"coordinate Length {q};", f"potential 1/2*{k:g} N/m*({x} - {q})^2;")
            self.say(f"drive {q} = {u};", f"drive {q} = {u}.filtered;")
            self.same(f"output {s.fresh('o')} = reaction({q});")
        else:
            self.say(f"force {k:g} N/m*{u} on {x};", f"force {k:g} N/m*{u}.filtered on {x};")
        self.output(f"{u} + 0.3 s*der({u})", f"{u}.filtered + 0.3 s*{u}.filtered_rate")

    def _begun(self) -> None:
        """A state that begins as an input says."""
        s, u, w = self.s, self.s.fresh("u"), self.s.fresh("x")
        first, a, tau = self.numbers(3, 0.2, 0.9)
        self.same(
            f"input Length {u} = {first:g} m;",
            f"state Length {w} = {s.pick((u, f'2*{u}', f'{u} - 0.4 m'))};",
            f"equation der({w}) = ({u} - {w})/({tau:g} s);",
        )
        x = self._mass(f"{a:g} m")
        self.same(f"force 0.4 N/m*{w} on {x};")
