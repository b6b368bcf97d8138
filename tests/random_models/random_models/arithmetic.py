"""What may be said of numbers and lists beside sums of products: matrices times matrices, whole numbers, empty ranges, starts that
follow others, conditions on starts, types of one's own, parts that exist under a condition, closed solutions, what ends a run.

Each statement holds what it means in plain words, which a twin says in its place.
"""

from __future__ import annotations

from random_models.lists import Chain
from random_models.scope import Scope
from random_models.tree import statement

SHARE = 0.16
"""Of the models."""
CHOOSING = 0.4
"""Of these choose by the number of masses; as many begin with one that follows another."""
ENDING = 0.12
"""Of these end by themselves."""


def arithmetic(s: Scope, seed: int) -> None:
    """Write some of it about a few masses. Their random numbers are their own: models keep all else."""
    with s.apart(f"arithmetic of {seed}"):
        if not s.chance(SHARE):
            return
        chain = _Arithmetic(s)
        chain.write()
    with s.apart(f"choices of {seed}"):
        if s.chance(CHOOSING):
            chain.first_of()
        if s.chance(CHOOSING):
            chain.follow_once()


def following(s: Scope, seed: int) -> None:
    """Write masses that begin where others say."""
    with s.apart(f"following of {seed}"):
        once = s.chance(0.4)
    if once:
        _Arithmetic(s).follow_once()
    else:
        _Arithmetic(s).follow()


class _Arithmetic(Chain):
    """Writes what is seldom said of a chain of masses."""

    def write(self) -> None:
        s = self.s
        self.n = s.pick((2, 3, 4))
        text = f"structural parameter Integer {self.N} = {self.n};"
        self.say(text, text, name=self.N)
        self.m = s.fresh("p")
        self.masses = self.array(f"parameter Mass {self.m}", "kg")
        self.array(f"coordinate Length {self.x}", "m", -0.5, 0.5)
        self.array(f"initial der({self.x})", "m/s", -1, 1)
        self._energies()
        every = [self._matrices, self._along, self._whole_numbers, self._signs, self._nothing, self._of_one, self._names, self._work,
                 self._closed, self._type, self._if_there, self._followed, self._conditions, self._zero, self._rates, self._when]  # fmt: skip
        parts = s.random.sample(every, s.pick((4, 5, 6)))
        if self._zero in parts and self._when in parts:  # what is tied cannot be set
            parts.remove(self._when)
        for part in parts:
            part()
        if s.chance(ENDING):
            self._end()

    def mass(self, start: str) -> str:
        """Write a mass on a line of its own; ``start``: with = or ~."""
        q = self.s.fresh("q")
        m, k = (f"{v:g}" for v in self.numbers(2))
        self.same(f"kinetic 1/2*{m} kg*der({q})^2;", f"potential 1/2*{k} N/m*({q} - 0.1 m)^2;")
        said = f"coordinate Length {q} {start};"
        self.say(said, said, name=q)
        return q

    def _matrices(self) -> None:
        """Matrices times matrices, of which an element is asked behind the parenthesis."""
        s, x = self.s, self.x
        a, b = ([self.numbers(2, -1, 1) for _ in range(2)] for _ in range(2))
        A, B = s.fresh("p"), s.fresh("p")
        for name, rows, unit in ((A, a, " N/m"), (B, b, "")):
            text = ", ".join("{" + ", ".join(f"{v:g}" for v in row) + "}" for row in rows)
            self.same(f"parameter {name}[2, 2] = {{{text}}}{unit};")
        c = [[a[i][0] * b[0][j] + a[i][1] * b[1][j] for j in range(2)] for i in range(2)]
        forces = [" + ".join(f"{v:.17g} N/m*{x}[{j}]" for j, v in enumerate(row, 1)) for row in c]
        i = s.pick((1, 2))
        self.say(f"force ({A}*{B}*{x}[1:2])[{i}] on {x}[1];", f"force {forces[i - 1]} on {x}[1];")
        self.output(
            f"{A}*{B}", "{" + ", ".join("{" + ", ".join(f"{v:.17g}" for v in r) + "}" for r in c) + "} N/m"
        )
        self.output(f"transpose({B})[1]*1 N", "{" + ", ".join(f"{b[k][0]:.17g}" for k in range(2)) + "} N")
        self.output(f"dot({A}[2], {B}[1])", f"{a[1][0] * b[0][0] + a[1][1] * b[0][1]:.17g} N/m")

    def _along(self) -> None:
        """Values between two that move."""
        x, n = self.x, self.s.pick((2, 3, 5))
        k = self.s.random.randint(1, n)
        c = self.numbers(1)[0]
        one, two = f"{c:g} N/m*{x}[1]", f"-0.4 N/m*{x}[2]"
        part = (k - 1) / (n - 1)
        self.say(
            f"force linspace({one}, {two}, {n})[{k}] on {x}[2];",
            f"force {one} + {part:.17g}*({two} - {one}) on {x}[2];",
        )
        self.output(f"linspace({x}[2], {c:g} m, 3)", f"{{{x}[2], ({x}[2] + {c:g} m)/2, {c:g} m}}")

    def _whole_numbers(self) -> None:
        """Quotients of whole numbers, which go to zero, and rests, which have the sign of what is divided by."""
        s, x, n = self.s, self.x, self.s.fresh("n")
        first, by = s.random.randint(-9, 9), s.pick((-4, -3, 2, 3))
        late = f"{float(s.number(0.05, 0.3)):g} s"
        self.same(f"discrete Integer {n} = {first};")
        when = f"when time > {late} then {n} := {s.random.randint(-9, 9)}; end when;"
        self.say(when, when, kind="when")
        self.output(f"div({n}, {by})", f"(if {n}/({by}) < 0 then -floor(-{n}/({by})) else floor({n}/({by})))")
        self.output(f"mod({n}, {by})", f"{n} - floor({n}/({by}))*({by})")
        c, d = self.numbers(1, -1, 1)[0], s.pick((-0.3, 0.3, 0.7))
        of = f"{x}[1] + {c:g} m"
        self.output(f"mod({of}, {d:g} m)", f"({of}) - floor(({of})/({d:g} m))*({d:g} m)")
        self.output(f"ceil({x}[2]/(0.3 m))", f"-floor(-{x}[2]/(0.3 m))")
        self.say(f"force 0.1 N*mod({n}, 3) on {x}[1];", f"force 0.1 N*({n} - floor({n}/3)*3) on {x}[1];")

    def _signs(self) -> None:
        """Signs that say nothing, and conditions one part of which is known."""
        x = self.x
        a, b = (f"{v:g} N" for v in self.numbers(2, -0.8, 0.8))
        known = self.s.pick(
            (
                "true and {}",
                "{} and not false",
                "false or {}",
                "{} and 1 < 2",
                "not (1 > 2) and {}",
                "not ({} and false) and {}",
            )
        )
        plain = f"{x}[1] > 0.05 m"
        self.say(
            f"force (if {known.replace('{}', plain)} then +{a} else - +{b}) on {x}[2];",
            f"force (if {plain} then {a} else -({b})) on {x}[2];",
        )
        self.say(
            f"force (if {plain} and {x}[2] > {x}[1] or {x}[1] < -0.1 m then {a} else {b}) on {x}[1];",
            f"force (if {x}[1] < -0.1 m then {a} elseif {plain} then (if {x}[2] > {x}[1] then {a} else {b}) else {b}) on {x}[1];",
        )

    def _nothing(self) -> None:
        """Empty ranges, and what is under a condition that does not hold."""
        i, x, s = self.i, self.x, self.s
        down = s.pick(("1:0", "2:1", f"{self.N} + 1:{self.N}", "1:2:0", "1:-1:2"))
        self.output(f"1 m + sum({x}[{i}] for {i} in {down})", "1 m")
        self.output(f"product({x}[{i}]/(1 m) for {i} in {down})", "1")
        self.say(f"for {i} in {down} loop force 3 N on {x}[{i}]; end for;")
        self.say(f"if {self.N} < 2 then force 5 N on {x}[1]; elseif {self.N} > 1 and {self.N} < 9 then force 0.2 N on {x}[2]; "
                 f"else force 7 N on {x}[1]; end if;", f"force 0.2 N on {x}[2];")  # fmt: skip
        self.output(f"(if {self.N} > 1 then {x}[2] else {x}[{self.N} - 5])", f"{x}[2]")

    def first_of(self) -> None:
        """Structural conditions of which several hold, or none: the first that does counts, and before `else` all that are known."""
        s, x, N = self.s, self.x, self.N
        a, b, c = (f"{v:g}" for v in self.numbers(3, 0.2, 0.9))
        holds = [
            f"{N} > {self.n - 1}",
            f"{N} < {self.n + 2}",
            f"{N} == {self.n}",
            f"mod({N}, {self.n}) == 0",
            "true",
        ]
        fails = [f"{N} > {self.n}", f"{N} < 2", f"{N} <> {self.n}", "false"]
        for text in ("({0} N)", "({0} N/m*" + x + "[1])"):
            kinds = s.pick(("hh", "fh", "hf", "ff", "fhh", "hfh"))
            conditions = [s.pick(holds if k == "h" else fails) for k in kinds]
            values = s.random.sample((a, b, c, "1.1"), len(kinds) + 1)
            said = " elseif ".join(
                f"{k} then {text.format(v)}" for k, v in zip(conditions, values, strict=False)
            )
            chosen = values[kinds.find("h")]
            self.say(
                f"force (if {said} else {text.format(values[-1])}) on {x}[2];",
                f"force {text.format(chosen)} on {x}[2];",
            )
        kinds = s.pick(("hh", "fhh", "hfh", "fh"))
        laws = s.random.sample((f"force 0.3 N on {x}[1];", f"damping 0.2 kg/s on {x}[2];", f"force -0.4 N on {x}[2] from {x}[1];",
                                f"potential 0.2 N/m*{x}[1]*{x}[2];"), len(kinds) + 1)  # fmt: skip
        said = " elseif ".join(
            f"{s.pick(holds if k == 'h' else fails)} then {law}" for k, law in zip(kinds, laws, strict=False)
        )
        self.say(f"if {said} else {laws[-1]} end if;", laws[kinds.find("h")])
        moving = f"{x}[1] > 0.05 m"
        self.say(
            f"force (if {fails[0]} then 9 N elseif {moving} then {a} N elseif {holds[0]} then {b} N elseif {x}[2] > 0 m then 8 N else 7 N) on {x}[1];",
            f"force (if {moving} then {a} N else {b} N) on {x}[1];",
        )

    def _of_one(self) -> None:
        """Functions of arrays and of one argument."""
        x, xs = self.x, [f"{self.x}[{k}]" for k in range(1, self.n + 1)]
        every = [
            (f"min({x})", f"min({', '.join(xs)})"), (f"max({{{xs[0]}}})", xs[0]), (f"sum({{{xs[1]}}})", xs[1]),
            (f"product({x}/(1 m))", f"({'*'.join(xs)})/(1 m)^{self.n}"), (f"norm({x})", "sqrt(" + " + ".join(f"{q}^2" for q in xs) + ")"),
            (f"norm(-2*{x})", "2*sqrt(" + " + ".join(f"{q}^2" for q in xs) + ")"), (f"outer({x}, {x})[2, 1]", f"{xs[0]}*{xs[1]}"),
            (f"max({{{xs[0]}, 0.1 m}})", f"(if {xs[0]} > 0.1 m then {xs[0]} else 0.1 m)"), (f"sum({{{{1, 2}}, {{3, 4}}}}*{xs[0]})", f"10*{xs[0]}"),
            (f"max(abs({x}[{self.i}]) for {self.i} in 1:{self.N})", f"max({', '.join(f'abs({q})' for q in xs)})"),
        ]  # fmt: skip
        for text, plain in self.s.random.sample(every, 4):
            self.output(text, plain)

    def _names(self) -> None:
        """Energies and powers by their names."""
        s, x, f = self.s, self.x, self.s.fresh("F")
        c = self.numbers(1, 0.1, 0.5)[0]
        self.same(f"force {f}: -{c:g} kg/s*der({x}[1]) on {x}[1];")
        self.output("energy.total - energy.kinetic", "energy() - kinetic_energy()")
        self.output("energy.potential", "potential_energy()")
        self.output(f"{f}.power", f"power({f})")
        self.same(f"output {s.fresh('o')} = -{c:g} kg/s*der({x}[1])^2;")

    def _work(self) -> None:
        """The power of a force of one's own on a coordinate."""
        x, c = self.x, self.numbers(1, -0.6, 0.6)[0]
        e = f"{c:g} N/m*{x}[2]"
        self.output(f"power({e}, {x}[1])", f"{e}*der({x}[1])")
        self.output(f"power({e}, {x}[{self.N}])", f"{e}*der({x}[{self.n}])")

    def _closed(self) -> None:
        """A mass whose motion is known, with the closed solution, which the run compares."""
        q = self.s.fresh("q")
        m, a, b, w = self.numbers(4, 0.4, 1.6)
        k = m * w * w
        start = f"coordinate Length {q} = {a:g} m;"
        self.say(start, start, name=q)
        self.same(
            f"initial der({q}) = {b:g} m/s;",
            f"kinetic 1/2*{m:g} kg*der({q})^2;",
            f"potential 1/2*{k:.17g} N/m*{q}^2;",
        )
        self.same(f"exact {q} = {a:g} m*cos({w:g} Hz*time) + {b / w:.17g} m*sin({w:g} Hz*time);")
        self.say(f"exact der({q}) = -{a * w:.17g} m/s*sin({w:g} Hz*time) + {b:g} m/s*cos({w:g} Hz*time);",
                 f"exact der({q}) = der({a:g} m*cos({w:g} Hz*time) + {b / w:.17g} m*sin({w:g} Hz*time));")  # fmt: skip
        o = self.s.fresh("o")
        self.same(
            f"output {o}[2] = {{{q}, 2*{q}}};",
            f"exact {o} = {{1, 2}}*({a:g} m*cos({w:g} Hz*time) + {b / w:.17g} m*sin({w:g} Hz*time));",
        )

    def _type(self) -> None:
        """A quantity of one's own, and a function that gives one."""
        s, x = self.s, self.x
        t, f, p = s.fresh("Kind"), s.fresh("f"), s.fresh("p")
        s.file.items.append(
            statement(
                "class",
                f'type {t} = unit "{s.pick(("N/m", "kg/s^2", "N.mm^-1"))}" "how stiff it is";',
                name=t,
            )
        )
        s.file.items.append(statement("function", f"function {f}({t} c, Length z) -> Force = -c*z;", name=f))
        c = self.numbers(1)[0]
        self.say(f"parameter {t} {p} = {c:g} N/m;", f"parameter Stiffness {p} = {c:g} N/m;", name=p)
        self.say(f"force {f}({p}, {x}[2]) on {x}[2];", f"force -{p}*{x}[2] on {x}[2];")
        self.say(f"let {t} {p}y = 2*{p};", f"let {p}y = 2*{p};", name=f"{p}y")
        self.output(f"{p}y*{x}[1]", f"2*{p}*{x}[1]")

    def _if_there(self) -> None:
        """Parts that exist under a condition."""
        s, cell, one, two = self.s, self.s.fresh("Cell"), self.s.fresh("g"), self.s.fresh("g")
        s.file.items.append(statement("class", f"model {cell} parameter Mass m = 2 kg; coordinate Length x = 0.3 m; kinetic 1/2*m*der(x)^2; "
                                      f"potential 1/2*3 N/m*x^2; end {cell};", name=cell))  # fmt: skip
        m = self.numbers(1)[0]
        there = s.pick((f"{self.N} > 1", f"{self.N} <> 0 and true", f"not {self.N} == 1"))
        self.say(f"{cell} {one}(m = {m:g} kg) if {there};", f"{cell} {one}(m = {m:g} kg);", name=one)
        self.say(f"{cell} {two}(m = 3 kg) if not ({there});")
        self.same(f"force 0.2 N on {one}.x from {self.x}[1];", f"output {s.fresh('o')} = {one}.x*{one}.m;")

    def _followed(self) -> None:
        q = self.follow()
        self.same(f"force 0.2 N/m*{q} on {self.x}[1];")

    def follow(self) -> str:
        """Starts that are stated with others, one after the other, in any order of the text."""
        s = self.s
        first, factor, more = self.numbers(3, 0.2, 0.9)
        a, b, c = (s.fresh("q") for _ in range(3))
        starts = {
            a: (f"{first:g} m", first),
            b: (f"{factor:g}*{a}", factor * first),
            c: (f"{b} + {more:g} m", factor * first + more),
        }
        for q in s.random.sample((a, b, c), 3):
            text, value = starts[q]
            self.say(f"coordinate Length {q} = {text};", f"coordinate Length {q} = {value:.17g} m;", name=q)
            self.same(f"kinetic 1/2*{self.numbers(1)[0]:g} kg*der({q})^2;", f"force -0.7 N/m*{q} on {q};")
        rate = self.numbers(1, -0.8, 0.8)[0]
        self.say(
            f"initial der({b}) = 2*der({a}) + {b}/(1 s);",
            f"initial der({b}) = {2 * rate + factor * first:.17g} m/s;",
        )
        self.same(f"initial der({a}) = {rate:g} m/s;")
        self.same(f"potential 0.3 N/m*{a}*{c};")
        return b

    def follow_once(self) -> str:
        """One start that is stated with one other."""
        s = self.s
        first, factor = self.numbers(2, 0.2, 0.9)
        a, b = s.fresh("q"), s.fresh("q")
        for q, text, value in s.random.sample(
            ((a, f"{first:g} m", first), (b, f"{factor:g}*{a}", factor * first)), 2
        ):
            self.say(f"coordinate Length {q} = {text};", f"coordinate Length {q} = {value:.17g} m;", name=q)
            self.same(f"kinetic 1/2*{self.numbers(1)[0]:g} kg*der({q})^2;", f"force -0.7 N/m*{q} on {q};")
        self.same(f"potential 0.3 N/m*{a}*{b};")
        return b

    def _conditions(self) -> None:
        """Starts that follow from conditions on expressions, where everything else is known."""
        s = self.s
        known, total, push = self.numbers(3, 0.3, 0.9)
        a = self.mass(f"= {known:g} m")
        b = s.fresh("q")
        m = self.numbers(1)[0]
        self.same(f"kinetic 1/2*{m:g} kg*der({b})^2;", f"potential 0.8 N/m*({b} - {a})^2;")
        value = (total - known) / 2
        self.say(
            f"coordinate Length {b} ~ {s.pick(('0', '0.2', '-0.1'))} m;",
            f"coordinate Length {b} = {value:.17g} m;",
            name=b,
        )
        self.say(f"initial {a} + 2*{b} = {total:g} m;")
        self.say(f"initial momentum({b}) = {push:g} kg.m/s;", f"initial der({b}) = {push / m:.17g} m/s;")
        self.same(f"initial der({a}) = 0.2 m/s;")

    def _zero(self) -> None:
        """One zero for both components of a constraint."""
        s = self.s
        a, b = s.fresh("q"), s.fresh("q")
        for q, k in ((a, 1), (b, 2)):
            text = f"coordinate Length {q} ~ 0.1 m;"
            self.say(text, text, name=q)
            self.same(f"kinetic 1/2*{self.numbers(1)[0]:g} kg*der({q})^2;", f"potential 1/2*{k} N/m*{q}^2;")
        c = self.numbers(1, 0.5, 1.5)[0]
        zero = s.pick(("0", "{0, 0}", "0 m"))
        zero = "{0, 0} m" if zero == "0 m" else zero
        name = s.fresh("h")
        self.say(f"constraint {name}: {{{a} - {c:g}*{self.x}[1], {b} + {self.x}[2]}} = {zero};",
                 f"constraint {name}a: {a} = {c:g}*{self.x}[1];", f"constraint {name}b: {b} = -{self.x}[2];")  # fmt: skip
        self.output(f"multiplier({name})", f"{{multiplier({name}a), multiplier({name}b)}}")

    def _rates(self) -> None:
        """Derivatives of derivatives and of lists."""
        x = self.x
        self.output(f"der(der({x}[1]^2))", f"2*der({x}[1])^2 + 2*{x}[1]*der({x}[1], 2)")
        self.output(
            f"der({{{x}[1]*{x}[2], sin({x}[1]/(1 m))*1 m^2}})[2]", f"cos({x}[1]/(1 m))*der({x}[1])*1 m"
        )
        self.output(f"der({x}, 2)[2]", f"der({x}[2], 2)")
        self.output(f"(der({x}) + {x}/(1 s))[1]", f"der({x}[1]) + {x}[1]/(1 s)")

    def _when(self) -> None:
        """What an event checks, does at the start, and sees of what stood before it."""
        s, x, n, k = self.s, self.x, self.s.fresh("n"), self.s.fresh("n")
        a, b = self.numbers(2, 0.1, 0.9)
        late = f"{float(s.number(0.05, 0.3)):g} s"
        self.same(f"discrete Real {n} = {a:g};", f"discrete Real {k} = {b:g};")
        first = f"when initial() then {n} := {n} + 1; reinit(der({x}[1]), 0.5*der({x}[1])); end when;"
        if s.chance(0.5):
            self.say(first, first, kind="when")
        deeds = f'assert {n} > 0, "{n} is positive"; reinit({x}[2], 0.9*{x}[2]); {n} := {x}[2]/(1 m); {k} := pre({x}[2])/(1 m) + {n};'
        plain = f"{n} := 0.9*{x}[2]/(1 m); {k} := {x}[2]/(1 m) + {n}; reinit({x}[2], 0.9*{x}[2]);"
        self.say(
            f"when time > {late} then {deeds} end when;",
            f"when time > {late} then {plain} end when;",
            kind="when",
        )
        self.same(f"output {s.fresh('o')} = {n} + 2*{k};", f"force 0.3 N*{k} on {x}[1];")

    def _end(self) -> None:
        """A run that ends by itself, among other things that happen then. The random numbers of these are their own."""
        late = f"{float(self.s.number(0.2, 0.6)):g} s"
        last = 'terminate("enough");'
        deeds = [last]
        with self.s.apart(f"what else ends {late} {self.x}"):
            if self.s.chance(0.6):
                n = self.s.fresh("n")
                self.same(f"discrete Real {n} = 0.3;", f"output {self.s.fresh('o')} = {n};")
                deeds += self.s.pick(
                    (
                        (f"{n} := 2;",),
                        (f"{n} := {n} + 1;", f"reinit(der({self.x}[1]), 0.5*der({self.x}[1]));"),
                    )
                )
                self.s.random.shuffle(deeds)
        others = [d for d in deeds if d != last]
        plain = [*others, last] if deeds[0] == last else [last, *others]  # it does not matter where it stands
        self.say(
            *(f"when time > {late} then {' '.join(said)} end when;" for said in (deeds, plain)), kind="when"
        )
