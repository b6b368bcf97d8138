"""Relations of every kind in every place: in loops, parts, arrays of parts, bases, heirs and branches, by names of what they speak of.

A part declares variables; what relates them stands in it, by its names and by an index. The twin has a part that only declares, and each
relation beside it, for each element, with numbers and by paths.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from random import Random
from types import MappingProxyType
from typing import NamedTuple

from random_models.lists import Chain
from random_models.scope import File, Scope
from random_models.tree import statement

SHARE = 0.07
"""Of the models."""
ALONE = 0.03
"""Of the models hold nothing else, so that nothing else asks for what a relation alone has to ask for."""
ROWS = 2
_IMPACTS = "contact", "reinit", "engage", "restitution", "step(", "Stop"
"""Of what cannot be combined with servo constraints."""
Write = Callable[[str], str]
"""How a name is written."""
Said = Callable[[Write, str], str]
"""A text, given how names are written and an index."""


class Relation(NamedTuple):
    """``declared``: variables and their energies; ``said``: the text, given how a name is written and an index; ``meant``: the same in plain
    words, if that is not the text itself; ``asked``: what is read of it from outside, given how a name is written and an index."""

    declared: str
    said: Said
    meant: Said | None = None
    asked: Said | None = None
    names: tuple[str, ...] = ()
    """Coordinates that may have further names."""
    once: bool = False
    """Whether it is about the part as a whole, not about each element."""
    plainly: str = ""
    """What is declared in plain words, if these are others."""


def placed(s: Scope, seed: int) -> None:
    """Write a part with some relations. The random numbers are its own: models keep all else."""
    with s.apart(f"placed 2161 of {seed}"):
        if s.chance(SHARE):
            _Placed(s).write()


def is_alone(seed: int) -> bool:
    """Whether the model of a seed holds such parts alone."""
    return Random(f"alone 199 of {seed}").random() < ALONE


def alone(seed: int) -> Scope:
    """Write a model of such parts alone."""
    random = Random(f"what is alone in {seed}")
    s = Scope(File(random), space=random.choice((0, 2, 3)))
    _Placed(s).write()
    return s


class _Placed(Chain):
    """Writes relations of every kind into places of every kind."""

    def write(self) -> None:
        s = self.s
        kinds = [self._loads, self._row_starts, self._row_states, self._first_event, self._crossing, self._tick, self._released,
                 self._driven, self._found, self._inputs, self._formula, self._alike]  # fmt: skip
        if s.space:
            kinds += [self._frames, self._opened_joint, self._asked_in_a_branch, self._asked_in_a_branch]
        if s.space == 3:
            kinds += [self._rotation, self._rotation]
        for _ in range(s.pick((1, 2))):
            chosen = s.random.sample(kinds, s.pick((2, 3, 4)))
            self._place([kind() for kind in chosen])
        written = "".join(one.text() for one in (*s.statements, *s.file.items))
        if s.chance(0.4) and not any(word in written for word in _IMPACTS):
            self._place([self._found(), self._kept()])

    # ------------------------------------------------------------ places

    def _place(self, relations: list[Relation]) -> None:
        """Put relations into a part, and the part somewhere."""
        s, part, holder, a = self.s, self.s.fresh("Cell"), self.s.fresh("Holds"), self.s.fresh("a")
        declared, plain = " ".join(r.declared for r in relations), f"{part}Plain"
        self.define(plain, " ".join(r.plainly or r.declared for r in relations))
        where = s.pick(("part", "array", "inner", "around", "heir", "base", "branch", "outside"))
        names, lets = ({}, "") if where in ("around", "outside") else self._renaming(relations)
        at = {"around": "inside.", "outside": f"{a}."}.get(where, "")
        body = f"{lets} {' '.join(self._looped(r, _after(at, names)) for r in relations)}"
        text, held, paths = f"{part} {a};", f"{plain} {a};", [f"{a}."]
        if where in ("inner", "around"):
            self.define(f"{holder}Plain", f"{plain} inside;")
            self.define(holder, f"{part} inside;" if where == "inner" else f"{plain} inside; {body}")
            text, held, paths = f"{holder} {a};", f"{holder}Plain {a};", [f"{a}.inside."]
        elif where == "base":
            self.define(holder, f"{declared} {body}")
            self.define(part, f"extends {holder};")
        elif where == "array":
            n = s.pick((1, 2))
            text, held = (f"{kind} {a}[{n}];" for kind in (part, plain))
            paths = [f"{a}[{k}]." for k in range(1, n + 1)]
        lines = [line for path in paths for r in relations for line in self._plain(r, _after(path))]
        if where == "outside":
            self.same(held)
            self.say(body, *lines)
        else:
            n = s.pick((1, 2))
            if where == "heir":
                self.define(part, f"extends {plain}; {body}")
            elif where == "branch":
                self.define(
                    part,
                    f"structural parameter Integer chosen = {3 - n}; {declared} if chosen == {n} then {body} end if;",
                )
                text = f"{part} {a}(chosen = {n});"
            elif where in ("part", "inner", "array"):
                self.define(part, f"{declared} {body}")
            self.say(text, held, *lines)
        self._ask(relations, paths, names)

    def _renaming(self, relations: list[Relation]) -> tuple[dict[str, str], str]:
        """Give some variables further names, one after the other; return the last of each, and their definitions."""
        other: dict[str, str] = {}
        lets = []
        for name in (n for r in relations for n in r.names):
            for _ in range(self.s.pick((0, 1, 2, 2))):
                new = self.s.fresh("l")
                lets.append(f"let {new} = {other.get(name, name)};")
                other[name] = new
        return other, " ".join(lets)

    def _looped(self, r: Relation, write: Write) -> str:
        return (
            r.said(write, "1")
            if r.once
            else f"for {self.i} in 1:{ROWS} loop {r.said(write, self.i)} end for;"
        )

    def _plain(self, r: Relation, write: Write) -> list[str]:
        meant = r.meant or r.said
        texts = (meant(write, str(k)) for k in range(1, 2 if r.once else ROWS + 1))
        return [line for text in texts for line in _statements(text)]

    def _ask(self, relations: list[Relation], paths: list[str], names: dict[str, str]) -> None:
        """Read from outside what the relations are about, by the further names, too."""
        path, i = self.s.pick(paths), str(self.s.random.randint(1, ROWS))
        for r in relations:
            if r.asked is not None:
                self.output(r.asked(_after(path, names), i), r.asked(_after(path), i))

    def define(self, name: str, body: str) -> None:
        """Write a model beside that which runs."""
        self.s.file.items.append(statement("class", f"model {name} {body} end {name};", name=name))

    # ------------------------------------------------------------ relations

    def _row(self) -> tuple[str, str]:
        """Declare a row of masses on springs; return its name, and the text."""
        q, (m, k) = self.s.fresh("q"), self.numbers(2)
        start = ", ".join(f"{v:g}" for v in self.numbers(ROWS, -0.5, 0.5))
        energies = f"kinetic 1/2*{m:g} kg*dot(der({q}), der({q})); potential 1/2*{k:g} N/m*dot({q}, {q});"
        return q, f"coordinate Length {q}[{ROWS}] = {{{start}}} m; {energies}"

    def _loads(self) -> Relation:
        """Springs, loads, dampings and frictions on elements."""
        (q, declared), (f, c, k, mu) = self._row(), self.numbers(4, 0.1, 0.8)
        every: tuple[Said, ...] = (
            (lambda n, i: f"force {f:g} N*{i}*cos({n(q)}[{i}]/(1 m)) on {n(q)}[{i}];"),
            (lambda n, i: f"damping {c:g} N.s/m*{i} on {n(q)}[{i}] - {i}*{n(q)}[1]/3;"),
            (lambda n, i: f"potential {k:g} N/m*({n(q)}[{i}] - {i}*0.1 m)^2;"),
            (lambda n, i: f"friction {mu:g} N*{i} on der({n(q)}[{i}]);"),
            (lambda n, i: f"dissipation {c:g} N.s/m*{i}*der({n(q)}[{i}])^2;"),
        )
        chosen = self.s.random.sample(every, self.s.pick((1, 2, 3)))
        return Relation(declared, lambda n, i: " ".join(one(n, i) for one in chosen), names=(q,))

    def _row_starts(self) -> Relation:
        """Starts of rows of a matrix; in plain words of each element."""
        q, (m, k) = self.s.fresh("q"), self.numbers(2)
        x, y, u, v = self.numbers(4, 0.1, 0.8)
        rates = self.s.chance(0.7)
        every = [f"{q}[{j}, {k}]" for j in (1, 2) for k in (1, 2)]
        declared = (
            f"coordinate Length {q}[{ROWS}, 2]; kinetic 1/2*{m:g} kg*({' + '.join(f'der({e})^2' for e in every)}); "
            f"potential 1/2*{k:g} N/m*({' + '.join(f'{e}^2' for e in every)});"
        )

        def said(n: Write, i: str) -> str:
            second = f"initial der({n(q)}[{i}]) = {{{u:g} m/s, {v:g} m/s*{i}}};" if rates else ""
            return f"initial {n(q)}[{i}] = {{{x:g} m*{i}, {y:g} m}}; {second}"

        def meant(n: Write, i: str) -> str:
            pairs = [("{}", (x * int(i), y), "m"), *([("der({})", (u, v * int(i)), "m/s")] if rates else [])]
            return " ".join(
                f"initial {form.format(f'{n(q)}[{i}, {k}]')} = {value:.17g} {unit};"
                for form, values, unit in pairs
                for k, value in enumerate(values, 1)
            )

        return Relation(declared, said, meant)

    def _row_states(self) -> Relation:
        """Equations of rows of a matrix of states; in plain words of each element."""
        w, (a, b, c) = self.s.fresh("x"), self.numbers(3, 0.2, 0.9)
        declared = f"state Real {w}[{ROWS}, 2] = {{{{{a:g}, {b:g}}}, {{{c:g}, {a:g}}}}};"

        def said(n: Write, i: str) -> str:
            return f"equation der({n(w)}[{i}]) = {{{a:g}*{i} - {n(w)}[{i}, 1], {n(w)}[{i}, 1] - {b:g}*{n(w)}[{i}, 2]}}/(1 s);"

        def meant(n: Write, i: str) -> str:
            return (
                f"equation der({n(w)}[{i}, 1]) = ({a:g}*{i} - {n(w)}[{i}, 1])/(1 s); "
                f"equation der({n(w)}[{i}, 2]) = ({n(w)}[{i}, 1] - {b:g}*{n(w)}[{i}, 2])/(1 s);"
            )

        return Relation(declared, said, meant, lambda n, i: f"{n(w)}[{i}, 1] + 2*{n(w)}[{i}, 2]")

    def _first_event(self) -> Relation:
        """Events at the start, which set what forces read."""
        (q, declared), d, (f, v) = self._row(), self.s.fresh("n"), self.numbers(2, 0.2, 0.9)
        return Relation(
            f"{declared} discrete Real {d}[{ROWS}] = {{0.5, 0.7}};",
            lambda n, i: f"when initial() then {n(d)}[{i}] := {f:g}*{i} + pre({n(d)}[{i}]); reinit(der({n(q)}[{i}]), {v:g} m/s*{i}); end when; "
            f"force 1 N*{n(d)}[{i}] on {n(q)}[{i}];",
            asked=lambda n, i: f"{n(d)}[{i}] + {n(q)}[{i}]/(1 m)",
        )  # fmt: skip

    def _crossing(self) -> Relation:
        """Events on the way, which count and push."""
        (q, declared), d, (far, v) = self._row(), self.s.fresh("n"), self.numbers(2, 0.6, 0.9)
        return Relation(
            f"{declared} discrete Integer {d}[{ROWS}] = {{0, 1}};",
            lambda n, i: f"when {n(q)}[{i}] > {far:g} m*{i} then {n(d)}[{i}] := pre({n(d)}[{i}]) + {i}; reinit(der({n(q)}[{i}]), -{v:g} m/s); "
            f"end when; force 0.2 N*{n(d)}[{i}] on {n(q)}[{i}];",
            asked=lambda n, i: f"{n(d)}[{i}]*{n(q)}[{i}]",
        )  # fmt: skip

    def _tick(self) -> Relation:
        """A clock that ticks as the run begins, and reads a row."""
        (q, declared), d, (T, f) = self._row(), self.s.fresh("n"), self.numbers(2, 0.3, 0.9)
        return Relation(
            f"{declared} discrete Length {d}[{ROWS}] = 0 m;",
            lambda n, i: (
                f"when sample({T:g} s) then {n(d)}[{i}] := {f:g}*{n(q)}[{i}] + {i}*0.1 m; end when; "
                f"force -1 N/m*{n(d)}[{i}] on {n(q)}[{i}];"
            ),
            asked=lambda n, i: f"{n(d)}[{i}]",
            names=(q,),
        )

    def _released(self) -> Relation:
        """What ties places or rates and is released as the run begins: nothing, but for a question whether it holds."""
        (q, declared), h, f = self._row(), self.s.fresh("h"), self.numbers(1)[0]
        tied = self.s.pick(("der({0}[1]) = 0.4*der({0}[2])", "{0}[1] = 0.3*{0}[2]"))
        return Relation(
            declared,
            lambda n, i: (
                f"constraint {h}: {tied.format(n(q))}; when initial() then release {h}; end when; "
                f"force (if closed({h}) then 3 N else {f:g} N) on {n(q)}[1];"
            ),
            lambda n, i: f"force {f:g} N on {n(q)}[1];",
            once=True,
        )

    def _driven(self) -> Relation:
        """A drive of a place or of its rate that is released as the run begins."""
        q, (m, k, x, v) = self.s.fresh("q"), self.numbers(4, 0.2, 0.9)
        declared = f"coordinate Length {q}; kinetic 1/2*{m:g} kg*der({q})^2; potential 1/2*{k:g} N/m*{q}^2;"

        def start(n: Write) -> str:
            return f"initial {n(q)} = {x:g} m; initial der({n(q)}) = {v:g} m/s;"

        law = self.s.pick(
            (
                f"drive der({{}}) = {v:g} m/s;",
                f"drive der({{}}) = {v:g} m/s;",
                f"drive {{}} = {x:g} m + {v:g} m/s*time;",
            )
        )
        return Relation(
            declared,
            lambda n, i: f"{start(n)} {law.format(n(q))} when initial() then release {n(q)}; end when;",
            lambda n, i: start(n),
            once=True,
        )

    def _found(self) -> Relation:
        """An unknown whose equation reads it by a name."""
        s, (q, declared), (k, f) = self.s, self._row(), self.numbers(2)
        y, u = s.fresh("y"), s.fresh("l")
        return Relation(
            declared,
            lambda n, i: (
                f"output Force {y} ~ 0 N; let {u} = 2*{y}; equation {u} = {k:g} N/m*{n(q)}[1] + {f:g} N; force {y} on {n(q)}[2];"
            ),
            lambda n, i: f"force ({k:g} N/m*{n(q)}[1] + {f:g} N)/2 on {n(q)}[2];",
            names=(q,),
            once=True,
        )

    def _kept(self) -> Relation:
        """An unknown that keeps p1 = p2 + x cos t, and pushes another coordinate; in plain words a servo constraint, and a push by its
        law: m p1'' + k p1 with m p2'' = -k p2 is (k - m/s^2) x cos t, as the force acts on p1 alone."""
        s, (q, declared), p, (m, k, x, a) = self.s, self._row(), self.s.fresh("q"), self.numbers(4, 0.3, 1.5)
        z, h, wave = s.fresh("y"), s.fresh("h"), f"{x:g} m*cos(time/(1 s))"
        energies = f"kinetic 1/2*{m:g} kg*dot(der({p}), der({p})); potential 1/2*{k:g} N/m*dot({p}, {p});"

        def equal(n: Write) -> str:
            return f"{n(p)}[1] = {n(p)}[2] + {wave}"

        def meant(n: Write, i: str) -> str:
            label = h + "".join(c for c in n("") if c.isalnum())
            law = f"0.4*({k:g} N/m - {m:g} kg/(1 s)^2)*{wave}"
            return f"constraint {label}: {equal(n)} by force on {n(p)}[1]; force {law} on {n(q)}[1];"

        return Relation(
            f"{declared} coordinate Length {p}[2] ~ {{{a:g}, {a - x:.17g}}} m; {energies}",
            lambda n, i: (
                f"output Force {z} ~ 0 N; force {z} on {n(p)}[1]; equation {equal(n)}; force 0.4*{z} on {n(q)}[1];"
            ),
            meant,
            names=(q,),
            once=True,
        )

    def _inputs(self) -> Relation:
        """Inputs, by their default, which push and damp elements."""
        (q, declared), u, (f, w) = self._row(), self.s.fresh("u"), self.numbers(2)
        return Relation(
            f"{declared} input Force {u}[{ROWS}] = {f:g} N*{{cos({w:g} rad/s*time), {w:g}}};",
            lambda n, i: f"force {i}*{n(u)}[{i}] on {n(q)}[{i}];",
            asked=lambda n, i: f"{n(u)}[{i}]",
            names=(q, u),
        )

    def _formula(self) -> Relation:
        """Parameters by formulas of others, and functions of them."""
        (q, declared), p, r, (a, b) = self._row(), self.s.fresh("p"), self.s.fresh("p"), self.numbers(2)
        return Relation(
            f"{declared} parameter Stiffness {p}[{ROWS}] = {{{a:g}, {b:g}}} N/m; parameter Force {r} = {p}[1]*{b:g} m;",
            lambda n, i: f"force {n(r)}*{i} - {n(p)}[{i}]*{n(q)}[{i}] on {n(q)}[{i}];",
            asked=lambda n, i: f"{n(p)}[{i}]*{n(q)}[{i}] + {n(r)}",
            names=(q, p, r),
        )

    def _alike(self) -> Relation:
        """States and parameters whose type, and size, is that of a formula."""
        s, (q, declared), (a, b) = self.s, self._row(), self.numbers(2)
        x, p = s.fresh("x"), s.fresh("p")
        values = f"{{{a:g}, {b:g}}} N/m"

        def text(of_x: str, of_p: str) -> str:
            return f"{declared} state {of_x} = {{{b:g}, {a:g}}} m; parameter {of_p} = {values};"

        like = text(
            f"typeof({s.pick((q, f'2*{q}', f'{q} - {{1, 2}} m'))}) {x}",
            f"typeof({{{a:g}, {b:g}}} N/{q}[1]) {p}",
        )
        return Relation(
            like,
            lambda n, i: (
                f"equation der({n(x)}[{i}]) = ({n(q)}[{i}] - {n(x)}[{i}])/(1 s); force -{n(p)}[{i}]*{n(x)}[{i}] on {n(q)}[{i}];"
            ),
            asked=lambda n, i: f"{n(p)}[{i}]*{n(x)}[{i}]",
            names=(q,),
            plainly=text(f"Length {x}[{ROWS}]", f"Stiffness {p}[{ROWS}]"),
        )

    def _asked_in_a_branch(self) -> Relation:
        """A joint whose reaction only one branch of a law asks for, which holds throughout."""
        (q, declared), b, j, (m, l, f) = (
            self._row(),
            self.s.fresh("b"),
            self.s.fresh("j"),
            self.numbers(3, 0.2, 0.9),
        )
        planar = self.s.space == 2
        body = (
            f"Bar {b}(m = {m:g} kg, l = {l:g} m);"
            if planar
            else f"Body {b}(m = {m:g} kg, J = diag({{{m:g}, {l:g}, 1}} kg.m^2), com = {{{l:g}, 0, 0.1}} m);"
        )
        laws = "if time > 9 s then {1} else {0}", "if time < 9 s then {0} else {1}", "min({0}, 9e9 N)"
        law = self.s.pick((*laws, laws[0]))
        return Relation(
            f"{declared} {body} Revolute {j}(world -> {b}.a, angle = {f:g} rad);",
            lambda n, i: f"force {law.format(f'0.3*reaction({n(j)})[1]', '0 N')} on {n(q)}[1];",
            lambda n, i: f"force 0.3*reaction({n(j)})[1] on {n(q)}[1];",
            names=(q,),
            once=True,
        )  # fmt: skip

    def _frames(self) -> Relation:
        """Masses, forces and places at frames in a row, which follow a coordinate."""
        (q, declared), f, n = self._row(), self.s.fresh("f"), self.s.space
        arm = ", ".join(("0.2 m", *(["0 m"] * (n - 1))))
        down = ", ".join((*(["0"] * (n - 1)), "-1"))
        place = ", ".join((*(f"{q}[{k}]" for k in (1, 2)), *(["0.1 m"] * (n - 2))))
        m, g = self.numbers(2)
        return Relation(
            f"{declared} frame {f} = world * trans({{{place}}});",
            lambda w, i: (
                f"mass {m:g} kg*{i} at {w(f)} * trans({i}*{{{arm}}}); force {g:g} N*{i}*{{{down}}} on {w(f)};"
            ),
            asked=lambda w, i: f"pos({w(f)} * trans({i}*{{{arm}}}))",
            names=(q, f),
        )

    def _opened_joint(self) -> Relation:
        """A joint that closes a loop and is released as the run begins."""
        b, j, k, planar = self.s.fresh("b"), self.s.fresh("j"), self.s.fresh("j"), self.s.space == 2
        m, l, x = self.numbers(3)
        body = (
            f"Bar {b}(m = {m:g} kg, l = {l:g} m);"
            if planar
            else f"Body {b}(m = {m:g} kg, J = diag({{{m:g}, {l:g}, 1}} kg.m^2));"
        )
        free = (
            f"Planar {j}(world -> {b}.a, x ~ {x:g} m);"
            if planar
            else f"Free {j}(world -> {b}.a, position ~ {{{x:g}, 0, 0}} m);"
        )
        return Relation(
            f"{body} {free}",
            lambda n, i: f"cut {'Revolute' if planar else 'Spherical'} {k}(world -> {n(b)}.a); when initial() then release {k}; end when;",
            lambda n, i: "",
            asked=lambda n, i: f"pos({n(b)}.a)",
            once=True,
        )  # fmt: skip

    def _rotation(self) -> Relation:
        """A turning body, whose rotation and its rate are read by names of names."""
        R, f = (self.s.fresh(x) for x in ("R", "f"))
        a, b, c, w = self.numbers(4, 0.3, 0.9)
        declared = (
            f"coordinate Rotation {R} = rotz({a:g} rad); initial der({R}) = {{{b:g}, {c:g}, {w:g}}} rad/s; frame {f} = world * {R}; "
            f"inertia diag({{{1 + a:g}, {1 + b:g}, {1 + c:g}}} kg.m^2) on {f};"
        )
        return Relation(
            declared,
            lambda n, i: f"potential {w:g} N.m*{n(R)}[2]^2; dissipation {a:g} N.m.s*der({n(R)})[1]^2;",
            asked=lambda n, i: f"{n(R)}[{i}] + der({n(R)})[{i}]*1 s",
            names=(R,),
            once=True,
        )


def _after(path: str, names: Mapping[str, str] = MappingProxyType({})) -> Write:
    """Return how names are written behind a path, or others in their place."""
    return lambda name: f"{path}{names.get(name, name)}"


def _statements(text: str) -> list[str]:
    """Split plain words into statements; events keep what is in them."""
    found, depth, now = [], 0, ""
    for word in text.split(" "):
        depth += word == "when"
        now = f"{now} {word}".strip()
        if word == "when;":
            depth = 0
        if word.endswith(";") and depth == 0:
            found.append(now)
            now = ""
    return found
