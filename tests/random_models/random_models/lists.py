"""Arrays of everything: parameters, coordinates, states, inputs, discrete variables, unknowns; loops, slices, cases by the index.

Each statement holds what it means element by element, which a twin says in its place.
"""

from __future__ import annotations

from collections.abc import Sequence
from random import Random

from random_models.scope import Scope, rare
from random_models.tree import LENGTH, Model, reference, statement
from random_models.twins import Twin

SHARE = 0.07
"""Of the models."""
Row = Sequence[float]


@rare(SHARE)
def lists(s: Scope) -> None:
    """Write a chain."""
    Chain(s).write()


def element_by_element(model: Model, random: Random) -> Twin | None:
    """Say what arrays, loops and cases mean without them."""
    items = model.top.seq().items
    told = [s.data["plain"] if s.data and "plain" in s.data else (s,) for s in items]
    if not any(s.data and "plain" in s.data for s in items):
        return None
    top = tuple(one for group in told for one in group)
    return Twin("element by element", model.with_top(top))


def _row(values: Row, unit: str) -> str:
    """Write numbers, each with its unit."""
    return "{" + ", ".join(f"{v:.17g} {unit}".strip() for v in values) + "}"


class Chain:
    """Writes what belongs to one chain of masses; ``mark`` says in the data of its statements of what kind it is."""

    mark = ""

    def __init__(self, s: Scope) -> None:
        self.s = s
        self.n = s.pick((2, 3, 3, 4))
        self.N, self.i, self.j = (s.fresh(letter) for letter in ("N", "i", "i"))
        self.x = s.fresh("q")

    def say(
        self,
        text: str,
        *plain: str,
        name: str = "",
        wrong: tuple[str, str, str] | None = None,
        kind: str = "list",
    ) -> None:
        """Write a statement, and what it means; ``wrong``: an element, what it is, and a declaration that says otherwise."""
        meaning = tuple(statement(kind, line, name=name) for line in plain)
        data: dict[str, object] = {"plain": meaning} | ({self.mark: True} if self.mark else {})
        if wrong is not None:
            data["wrong"] = wrong
        self.s.add(kind, text, name=name, data=data)

    def same(self, *texts: str) -> None:
        """Write statements whose twin says the same."""
        for text in texts:
            self.say(text, text)

    def output(self, text: str, plain: str) -> None:
        """Write an output, and what it is."""
        o = self.s.fresh("o")
        self.say(f"output {o} = {text};", f"output {o} = {plain};", name=o)

    def numbers(self, n: int, low: float = 0.4, high: float = 2.0) -> list[float]:
        """Return random numbers of two digits."""
        return [float(self.s.number(low, high)) for _ in range(n)]

    def array(self, head: str, unit: str, low: float = 0.4, high: float = 2.0) -> list[float]:
        """Declare an array of n numbers in one of the ways there are; return its values. ``head`` ends with the name."""
        s, n, i = self.s, self.n, self.i
        name = head.split()[-1] if not head.startswith("initial") else ""
        size = "" if head.startswith("initial") else f"[{s.pick((self.N, str(n)))}]"
        kind = s.pick(("written", "one unit", "made", "by cases", "even", "times"))
        values = self.numbers(n, low, high)
        one = f"1 {unit}" if unit else "1"
        a, b = self.numbers(2, low, high)
        if kind == "written" or not a:
            e = _row(values, unit)
        elif kind == "one unit":
            e = "{" + ", ".join(f"{v:g}" for v in values) + f"}} {unit}".rstrip()
        elif kind == "made":
            values = [a + b * k for k in range(1, n + 1)]
            e = f"{{({a:g} + {b:g}*{i})*{one} for {i} in 1:{self.N}}}"
        elif kind == "by cases":
            values = [a if k == 2 else b * k for k in range(1, n + 1)]
            e = f"{{(if {i} <> 2 then {b:g}*{i} else {a:g})*{one} for {i} in 1:{self.N}}}"
        elif kind == "even":
            values = [a + (b - a) * k / (n - 1) for k in range(n)]
            e = f"linspace({a:g} {unit}".rstrip() + f", {b:g} {unit}".rstrip() + f", {self.N})"
        else:
            values = [v * a for v in values]
            e = f"{a:g}*" + _row([v / a for v in values], unit)
        k = s.random.randrange(n)
        other = [v if m != k else 3.0 + v for m, v in enumerate(values)]
        wrong = f"{name}[{k + 1}]", f"{values[k]:.17g} {unit}".strip(), f"{head}{size} = {_row(other, unit)};"
        plain = f"{head}{size.replace(self.N, str(n))} = {_row(values, unit)};"
        self.say(f"{head}{size} = {e};", plain, name=name, wrong=wrong if name else None)
        return values

    def write(self) -> None:
        """Write the chain and some of what may look at it."""
        s, n, N = self.s, self.n, self.N
        self.say(
            f"structural parameter Integer {N} = {s.pick((str(n), f'{n - 1} + 1', f'div({2 * n + 1}, 2)'))};",
            name=N,
        )
        self.m = s.fresh("p")
        self.masses = self.array(f"parameter {s.pick(('', 'Mass '))}{self.m}", "kg")
        self.places = self.array(f"coordinate Length {self.x}", "m", -0.5, 0.5)
        if s.chance(0.8):
            self.array(f"initial der({self.x})", "m/s", -1, 1)
        self._energies()
        every = [self._matrix, self._loop, self._cases, self._steps, self._state, self._input, self._let, self._discrete, self._outputs,
                 self._unknown, self._function, self._nested]  # fmt: skip
        for part in s.random.sample(every, s.pick((4, 5, 6, 7))):
            part()
        for k in range(1, n + 1):
            s.coordinates.append(reference(f"{self.x}[{k}]", "coordinate", LENGTH, level="q"))

    def _energies(self) -> None:
        s, n, i, x = self.s, self.n, self.i, self.x
        terms = [f"1/2*{m:.17g} kg*der({x}[{k}])^2" for k, m in enumerate(self.masses, 1)]
        text = f"kinetic sum(1/2*{self.m}[{i}]*der({x}[{i}])^2 for {i} in 1:{self.N});"
        if s.chance(0.3):
            text = f"kinetic 1/2*dot({self.m}, {{der({x}[{i}])^2 for {i} in 1:{self.N}}});"
        self.say(text, f"kinetic {' + '.join(terms)};")
        c = f"{self.numbers(1)[0]:g} N/m"
        ends = s.pick(("+ 1", "- 1"))
        first, last = ("1", f"{self.N} - 1") if ends == "+ 1" else ("2", self.N)
        pairs = [f"({x}[{k + 1}] - {x}[{k}])^2" for k in range(1, n)]
        self.say(f"potential 1/2*{c}*sum(({x}[{i} {ends}] - {x}[{i}])^2 for {i} in {first}:{last});",
                 f"potential 1/2*{c}*({' + '.join(pairs)});")  # fmt: skip
        self.say(
            f"potential 1/2*{c}*dot({x}, {x});",
            f"potential 1/2*{c}*({' + '.join(f'{x}[{k}]^2' for k in range(1, n + 1))});",
        )

    def _matrix(self) -> None:
        """A matrix of parameters, of which rows, columns and products are asked."""
        s, n, x = self.s, self.n, self.x
        rows, p, o = [self.numbers(n, -1, 1) for _ in range(2)], s.fresh("p"), s.fresh("o")
        text = "{" + ", ".join(_row(r, "") for r in rows) + "}"
        r, k = s.random.randint(1, 2), s.random.randint(1, n)
        other = [
            [v + 2 if (a, b) == (r - 1, k - 1) else v for b, v in enumerate(row)]
            for a, row in enumerate(rows)
        ]
        wrong = "{" + ", ".join(_row(row, "") for row in other) + "}"
        declared = f"parameter {s.pick(('', 'Real '))}{p}[2, {self.N}]"
        plain = declared.replace(self.N, str(n))
        self.say(
            f"{declared} = {text};",
            f"{plain} = {text};",
            name=p,
            wrong=(f"{p}[{r}, {k}]", f"{rows[r - 1][k - 1]:.17g}", f"{declared} = {wrong};"),
        )
        sums = [" + ".join(f"{v:.17g}*{x}[{b}]" for b, v in enumerate(row, 1)) for row in rows]
        self.say(f"output {o} = {p}*{x};", f"output {o} = {{{', '.join(sums)}}};", name=o)
        self.say(f"force {p}[{r}, {k}]*1 N on {x}[{k}];", f"force {rows[r - 1][k - 1]:.17g} N on {x}[{k}];")
        o = s.fresh("o")
        text, values = s.pick(
            ((f"transpose({p})[{k}]", [row[k - 1] for row in rows]), (f"{p}[{r}]", rows[r - 1]))
        )
        self.say(f"output {o} = {text};", f"output {o} = {_row(values, '')};", name=o)

    def _loop(self) -> None:
        c = self.numbers(1, 0.05, 0.4)[0]
        plain = [f"damping {c * k:.17g} kg/s on {self.x}[{k}];" for k in range(1, self.n + 1)]
        self.say(
            f"for {self.i} in 1:{self.N} loop damping {c:g} kg/s*{self.i} on {self.x}[{self.i}]; end for;",
            *plain,
        )

    def _steps(self) -> None:
        first = self.s.pick((1, 2))
        c = self.numbers(1, -0.8, 0.8)[0]
        plain = [f"force {c * k:.17g} N on {self.x}[{k}];" for k in range(first, self.n + 1, 2)]
        self.say(
            f"for {self.i} in {first}:2:{self.N} loop force {c:g} N*{self.i} on {self.x}[{self.i}]; end for;",
            *plain,
        )

    def _nested(self) -> None:
        i, j, x, c = self.i, self.j, self.x, self.numbers(1, -0.3, 0.3)[0]
        plain = [
            f"force {c * (a + 2 * b):.17g} N on {x}[{b}] from {x}[{a}];"
            for a in range(1, self.n)
            for b in range(a + 1, self.n + 1)
        ]
        inner = f"for {j} in {i} + 1:{self.N} loop force {c:g} N*({i} + 2*{j}) on {x}[{j}] from {x}[{i}]; end for;"
        self.say(f"for {i} in 1:{self.N} - 1 loop {inner} end for;", *plain)

    def _cases(self) -> None:
        """Statements of which the index chooses."""
        i, x, n = self.i, self.x, self.n
        a, b, c = (f"{v:g}" for v in self.numbers(3, -0.8, 0.8))
        second = self.s.pick(
            (f"{i} <> 2", f"{i} == {self.N}", f"mod({i}, 2) == 1", f"not {i} < 3", f"{i} > 1 and {i} < 3")
        )
        holds = {
            "<>": lambda k: k != 2,
            "==": lambda k: k == n,
            "mod": lambda k: k % 2 == 1,
            "not": lambda k: k >= 3,
            "and": lambda k: k == 2,
        }
        key = next(key for key in ("mod", "not", "and", "<>", "==") if key in second)
        text = (f"for {i} in 1:{self.N} loop if {i} == 1 then force {a} N on {x}[{i}]; elseif {second} then force {b} N*sin({x}[{i}]/1 m) on "
                f"{x}[{i} - 1]; else force {c} N on {x}[{i}] from {x}[1]; end if; end for;")  # fmt: skip
        plain = [f"force {a} N on {x}[1];"]
        for k in range(2, n + 1):
            plain.append(
                f"force {b} N*sin({x}[{k}]/1 m) on {x}[{k - 1}];"
                if holds[key](k)
                else f"force {c} N on {x}[{k}] from {x}[1];"
            )
        self.say(text, *plain)

    def _state(self) -> None:
        """An array of states, by one equation."""
        s, n, x, w = self.s, self.n, self.x, self.s.fresh("x")
        first, tau = self.numbers(n, -1, 1), f"{self.numbers(1)[0]:g} s"
        start = f"state Real {w}[{n}] = {_row(first, '')};"
        if s.chance(0.5):
            law = [f"equation der({w}) = ({x}/(1 m) - {w})/({tau});"]
        else:
            law = [
                f"for {self.i} in 1:{self.N} loop equation der({w}[{self.i}]) = ({x}[{self.i}]/(1 m) - {w}[{self.i}])/({tau}); end for;"
            ]
        plain = [f"equation der({w}[{k}]) = ({x}[{k}]/(1 m) - {w}[{k}])/({tau});" for k in range(1, n + 1)]
        k = s.random.randint(1, n)
        other = [v + 1 if m == k else v for m, v in enumerate(first, 1)]
        self.say(
            start,
            start,
            name=w,
            wrong=(f"{w}[{k}]", f"{first[k - 1]:.17g}", f"state Real {w}[{n}] = {_row(other, '')};"),
        )
        self.say(law[0], *plain)
        self.say(f"force {w}[{self.N}]*0.3 N on {x}[1];", f"force {w}[{n}]*0.3 N on {x}[1];")

    def _input(self) -> None:
        """An array of inputs, some of which go on with time."""
        s, u, n = self.s, self.s.fresh("u"), self.n
        a, b = self.numbers(2, -1, 1)
        parts = [f"{a:g} N*sin({k + 1} rad/s*time)" if k % 2 else f"{b + k:.17g} N" for k in range(n)]
        text = f"input Force {u}[{n}] = {{{', '.join(parts)}}};"
        self.say(text, text, name=u)
        way = f"{self.i} in 1:{self.N}"
        self.say(f"for {way} loop force {u}[{self.i}] on {self.x}[{self.N} + 1 - {self.i}]; end for;",
                 *(f"force {u}[{k}] on {self.x}[{n + 1 - k}];" for k in range(1, n + 1)))  # fmt: skip
        o = s.fresh("o")
        self.say(
            f"output {o} = sum({u});",
            f"output {o} = {' + '.join(f'{u}[{k}]' for k in range(1, n + 1))};",
            name=o,
        )

    def _let(self) -> None:
        """A slice, and what is made of it."""
        s, n, x, y, o = self.s, self.n, self.x, self.s.fresh("l"), self.s.fresh("o")
        k = s.random.randint(1, n - 1)
        c = self.numbers(2, -0.5, 0.5)
        part = s.pick((f"{x}[{k}:{k + 1}]", f"{{{x}[{k}], {x}[{k + 1}]}}"))
        self.say(f"let {s.pick((f'Length {y}[2]', y))} = {part} + {_row(c, 'm')};",
                 f"let {y} = {{{x}[{k}] + {c[0]:g} m, {x}[{k + 1}] + {c[1]:g} m}};", name=y)  # fmt: skip
        one, two = f"{x}[{k}] + {c[0]:g} m", f"{x}[{k + 1}] + {c[1]:g} m"
        self.say(
            f"potential 0.3 N/m*(norm({y})^2 + {y}[1]*{y}[2]);",
            f"potential 0.3 N/m*(({one})^2 + ({two})^2 + ({one})*({two}));",
        )
        rows = ", ".join(
            f"{{({a})*({b})" + ", " + f"({a})*({d})}}" for a, b, d in ((one, one, two), (two, one, two))
        )
        self.say(f"output {o} = outer({y}, {y});", f"output {o} = {{{rows}}};", name=o)

    def _discrete(self) -> None:
        """An array of discrete variables, each of whose elements an event sets, one after the other."""
        s, d, x = self.s, self.s.fresh("n"), self.x
        a, b = self.numbers(2, 0.1, 0.9)
        text = f"discrete Real {d}[2] = {{{a:g}, {b:g}}};"
        self.say(text, text, name=d)
        late = f"{float(s.number(0.05, 0.3)):g}"
        deeds = f"{d}[1] := {d}[2] + {x}[1]/(1 m); {d}[2] := pre({d}[1]) + {d}[1];"
        when = f"when time > {late} s then {deeds} end when;"
        self.say(when, when, kind="when")
        o = s.fresh("o")
        self.say(f"output {o} = {d}*0.5;", f"output {o} = {{{d}[1]*0.5, {d}[2]*0.5}};", name=o)
        self.say(f"force {d}[2]*0.4 N on {x}[1];", f"force 0.4 N*{d}[2] on {x}[1];")

    def _outputs(self) -> None:
        """Things of a whole array."""
        s, n, x, i = self.s, self.n, self.x, self.i
        xs = [f"{x}[{k}]" for k in range(1, n + 1)]
        texts = [
            (f"sum({x})", " + ".join(xs)), (f"max({x})", f"max({', '.join(xs)})"), (f"{x}[{self.N}]", xs[-1]),
            (f"product({x}[{i}] for {i} in 1:{self.N})", "*".join(xs)), (f"identity({self.N})*{x}", f"{{{', '.join(xs)}}}"),
            (f"{x}[1] <> {x}[2]", f"not {x}[1] == {x}[2]"), (f"{x}[1] < {x}[2]", f"{x}[2] > {x}[1]"),
            (f"{{{x}[{self.N} + 1 - {i}] for {i} in 1:{self.N}}}", f"{{{', '.join(xs[::-1])}}}"), (f"diag({x})*{x}", f"{{{', '.join(f'{q}^2' for q in xs)}}}"),
            (f"min({x}[{i}]^2 for {i} in 1:{self.N})", f"min({', '.join(f'{q}^2' for q in xs)})"), (f"der({x})", f"{{{', '.join(f'der({q})' for q in xs)}}}"),
            (f"-{x}", f"{{{', '.join('-' + q for q in xs)}}}"), (f"{x}[2:{self.N}]", f"{{{', '.join(xs[1:])}}}"), (f"2^3^0.5*{x}[1]", f"2^(3^0.5)*{x}[1]"),
        ]  # fmt: skip
        for text, plain in s.random.sample(texts, 5):
            o = s.fresh("o")
            self.say(f"output {o} = {text};", f"output {o} = {plain};", name=o)

    def _unknown(self) -> None:
        """An array that equations determine."""
        x, z = self.x, self.s.fresh("y")
        a, b = self.numbers(2, -0.5, 0.5)
        text = f"output Length {z}[2] ~ {{1, 0.5}} m;"
        self.say(text, text, name=z)
        self.say(f"equation {{{z}[1] + {a:g}*{z}[2], {z}[2] - {b:g}*{z}[1]}} = {x}[1:2];",
                 f"equation {z}[1] + {a:g}*{z}[2] = {x}[1];", f"equation {z}[2] - {b:g}*{z}[1] = {x}[2];")  # fmt: skip

    def _function(self) -> None:
        """Functions of arrays, one of which calls the other."""
        s, n, x = self.s, self.n, self.x
        f, g, a = s.fresh("f"), s.fresh("f"), self.numbers(1, -0.6, 0.6)[0]
        s.file.items.append(
            statement(
                "function",
                f"function {f}(Length v[{n}], Real c) -> Area = c*dot(v, v) + v[1]*v[{n}];",
                name=f,
            )
        )
        s.file.items.append(
            statement(
                "function", f"function {g}(Length v[{n}], Stiffness k) -> Energy = k*{f}(v, 0.5);", name=g
            )
        )
        plain = f"0.5*({' + '.join(f'{x}[{k}]^2' for k in range(1, n + 1))}) + {x}[1]*{x}[{n}]"
        self.say(f"potential {g}({x}, {a:g} N/m);", f"potential {a:g} N/m*({plain});")
        h, one, other = (s.fresh(k) for k in ("f", "l", "l"))
        b, c = self.numbers(2, 0.1, 0.6)
        body = (
            f"function {h}(Length v[m], Stiffness k) -> (Energy U, Force F) var s = 0; var last = {c:g} N; "
            "for i in 1:m loop let u = v[i] + 0.1 m; s := s + k*u^2/i; "
            "if u > 0.3 m then last := k*u; end if; end for; return (s, last); "
            f"end {h};"
        )
        s.file.items.append(statement("function", body, name=h))
        squares = " + ".join(f"{b:g} N/m*({x}[{k}] + 0.1 m)^2/{k}" for k in range(1, n + 1))
        last = f"{c:g} N"
        for k in range(1, n + 1):
            last = f"(if {x}[{k}] + 0.1 m > 0.3 m then {b:g} N/m*({x}[{k}] + 0.1 m) else {last})"
        self.say(
            f"let ({one}, {other}) = {h}({x}, {b:g} N/m);",
            f"let {one} = {squares};",
            f"let {other} = {last};",
            name=one,
        )
        self.output(f"{one}/(1 J)", f"{one}/(1 J)")
        self.output(f"{other}/(1 N)", f"{other}/(1 N)")
