"""What models of users say and random ones did not: labels with indices, loops with starts, constraints and contacts in them, blocks
under a condition that has a name, starts that are parameters, single elements of matrices, functions without arguments, events of two
that move, inputs without a value, powers of three halves and more.

Each statement holds what it means in plain words, which a twin says in its place.
"""

from __future__ import annotations

from random_models.lists import Chain
from random_models.scope import Scope, rare
from random_models.tree import statement

SHARE = 0.16
"""Of the models."""
MANY = 24
"""Statements of a model that is too long for constraints and contacts of a loop: its motion by definition is slow."""


@rare(SHARE)
def everyday(s: Scope) -> None:
    """Write some of it about a few masses."""
    _Everyday(s).write()


def starting(s: Scope) -> None:
    """Write a mass that begins with parameters."""
    _Everyday(s).starts(alone=True)


class _Everyday(Chain):
    """Writes what is often said of a chain of masses."""

    def write(self) -> None:
        s = self.s
        self.n = s.pick((2, 2, 3))
        text = f"structural parameter Integer {self.N} = {self.n};"
        self.say(text, text, name=self.N)
        self.m = s.fresh("p")
        long = len(s.statements) > MANY
        self.masses = self.array(f"parameter Mass {self.m}", "kg")
        self.array(f"coordinate Length {self.x}", "m", -0.5, 0.5)
        self._rates()
        self._energies()
        every = [self._labels, self.starts, self._matrix_of_coordinates, self._matrix_of_states, self._vectors, self._events, self._silent,
                 self._friction, self._powers, self._functions, self._block, self._sums, self._lets, self._index]  # fmt: skip
        if not long:
            every += [self._constraints, self._contacts]
        for part in s.random.sample(every, s.pick((4, 5, 6))):
            part()

    def each(self, text: str) -> list[str]:
        """Return a text with each index in the place of ``@``."""
        return [text.replace("@", str(k)) for k in range(1, self.n + 1)]

    def _rates(self) -> None:
        """Rates at the start, in a loop or one by one."""
        c, x = self.numbers(1, -0.7, 0.7)[0], self.x
        plain = [f"initial der({x}[{k}]) = {c * k:.17g} m/s;" for k in range(1, self.n + 1)]
        text = f"for {self.i} in 1:{self.N} loop initial der({x}[{self.i}]) = {c:g} m/s*{self.i}; end for;"
        self.say(text if self.s.chance(0.6) else " ".join(plain), *plain)

    def _repeat(self, body: str, plain: str) -> None:
        """Write a loop over all masses; ``@``: the index."""
        self.say(
            f"for {self.i} in 1:{self.N} loop {body.replace('@', self.i)} end for;",
            " ".join(self.each(plain)),
        )

    def _labels(self) -> None:
        """Forces with labels that have an index."""
        s, x, f = self.s, self.x, self.s.fresh("F")
        c = self.numbers(1, 0.05, 0.4)[0]
        kind, law = s.pick(
            (
                ("force", f"-{c:g} kg/s*@*der({x}[@])"),
                ("damping", f"{c:g} kg/s*@"),
                ("force", f"{c:g} N*sin({x}[@]/(1 m) + @)"),
            )
        )
        self._repeat(f"{kind} {f}[@]: {law} on {x}[@];", f"{kind} {f}@: {law} on {x}[@];")
        k = s.random.randint(1, self.n)
        self.output(f"power({f}[{k}])", f"power({f}{k})")
        self.output(f"power({f}[1]) + power({f}[{self.N}])", f"power({f}1) + power({f}{self.n})")

    def _constraints(self) -> None:
        """Constraints of a loop, which hold masses of their own."""
        s, x, y, h = self.s, self.x, self.s.fresh("q"), self.s.fresh("h")
        c, m = self.numbers(2, 0.3, 1.2)
        text = f"coordinate Length {y}[{self.N}] ~ 0.1 m;"
        self.say(text, text.replace(self.N, str(self.n)), name=y)
        self._repeat(f"kinetic 1/2*{m:g} kg*der({y}[@])^2;", f"kinetic 1/2*{m:g} kg*der({y}[@])^2;")
        self._repeat(f"potential 0.4 N/m*{y}[@]^2;", f"potential 0.4 N/m*{y}[@]^2;")
        row = s.pick((f"{y}[@] = {c:g}*{x}[@]", f"{c:g}*{x}[@] = {y}[@]", f"{y}[@] - {c:g}*@*{x}[@] = 0 m"))
        self._repeat(f"constraint {h}[@]: {row};", f"constraint {h}@: {row};")
        self.output(f"multiplier({h}[{self.n}])", f"multiplier({h}{self.n})")
        self.output(f"multiplier({h}[1])*{x}[1]", f"multiplier({h}1)*{x}[1]")

    def _contacts(self) -> None:
        """Contacts of a loop, of which one is asked whether it holds."""
        s, x, c = self.s, self.x, self.s.fresh("C")
        far, e = self.numbers(2, 0.55, 0.75)
        tail = s.pick(("", f" restitution {e:g}"))
        gap = s.pick((f"{x}[@] + ({far:g} m + 0.02 m*@)", f"{far:g} m + 0.02 m*@ - {x}[@]"))
        self._repeat(f"contact {c}[@]: {gap}{tail};", f"contact {c}@: {gap}{tail};")
        k = s.random.randint(1, self.n)
        self.output(f"(if closed({c}[{k}]) then 1 else 0)", f"(if closed({c}{k}) then 1 else 0)")
        self.output(f"multiplier({c}[1])", f"multiplier({c}1)")

    def starts(self, alone: bool = False) -> None:
        """Starts that are parameters, by themselves or nearly."""
        s, p, v, q = self.s, self.s.fresh("p"), self.s.fresh("p"), self.s.fresh("q")
        a, b, m = self.numbers(3, 0.2, 0.9)
        self.same(f"parameter {s.pick(('', 'Length '))}{p} = {a:g} m;", f"parameter {v} = {b:g} m/s;")
        text, value = s.pick(
            (
                (p, a),
                (p, a),
                (f"-{p}", -a),
                (f"2*{p}", 2 * a),
                (f"{p} - 0.3 m", a - 0.3),
                (f"{p}^2/(1 m)", a * a),
            )
        )
        self.say(f"coordinate Length {q} = {text};", f"coordinate Length {q} = {value:.17g} m;", name=q)
        sign = s.pick(("", "-"))
        self.say(f"initial der({q}) = {sign}{v};", f"initial der({q}) = {sign}{b:g} m/s;")
        self.same(
            f"kinetic 1/2*{m:g} kg*der({q})^2;",
            f"potential 0.3 N/m*({q} - {'0.1 m' if alone else f'0.2*{self.x}[1]'})^2;",
        )
        if alone:
            return
        if s.chance(0.6):
            z = s.fresh("q")
            self.say(f"coordinate Length {z}[2] = {{{p}, -{p}/2}};", f"coordinate Length {z}[2] = {{{a:g}, {-a / 2:.17g}}} m;", name=z)  # fmt: skip
            self.say(f"initial der({z}) = {{-{v}, {v}}};", f"initial der({z}) = {{{-b:g}, {b:g}}} m/s;")
            self.same(f"kinetic 1/2*{m:g} kg*dot(der({z}), der({z}));", f"potential 0.6 N/m*{z}[1]*{z}[2];")
        if s.chance(0.5):
            w = s.fresh("x")
            self.say(f"state Length {w} = {p};", f"state Length {w} = {a:g} m;", name=w)
            self.same(f"equation der({w}) = ({self.x}[1] - {w})/(0.7 s);")

    def _single(self, name: str, unit: str, rows: list[list[float]]) -> str:
        """State one element, or a row, of a matrix that is stated as a whole; what is in ``rows`` counts."""
        s = self.s
        i, k = s.random.randint(1, len(rows)), s.random.randint(1, len(rows[0]))
        if s.chance(0.25):
            rows[i - 1] = self.numbers(len(rows[0]), -0.8, 0.8)
            row = ", ".join(f"{v:g}" for v in rows[i - 1])
            return f"initial {name}[{i}] = {{{row}}} {unit};"
        rows[i - 1][k - 1] = self.numbers(1, -0.8, 0.8)[0]
        return f"initial {name}[{i}, {k}] = {rows[i - 1][k - 1]:g} {unit};"

    def _sizes(self) -> tuple[str, list[list[float]]]:
        size = self.s.pick(((2, 2), (2, 3), (3, 2)))
        return f"[{size[0]}, {size[1]}]", [self.numbers(size[1], -0.8, 0.8) for _ in range(size[0])]

    def _matrix_of_coordinates(self) -> None:
        """Coordinates of two indices, of which one has a start of its own."""
        s, q = self.s, self.s.fresh("q")
        size, rows = self._sizes()
        rates = [[0.0] * len(rows[0]) for _ in rows]
        start = "{" + ", ".join("{" + ", ".join(f"{v:g}" for v in row) + "}" for row in rows) + "} m"
        if s.chance(0.3):
            rows, start = [[0.2] * len(rows[0]) for _ in rows], "0.2 m"
        m, k = self.numbers(2)
        name = f"{q}{size}"
        head = f"coordinate Length {name} = {start};"
        head += f" {self._single(q, 'm', rows)}"  # in one text: the last one of several counts
        if s.chance(0.5):
            rates = [[0.1] * len(row) for row in rows]
            one = self.numbers(1, -0.8, 0.8)[0]
            rates[0][1] = one
            head += f" initial der({q}) = 0.1 m/s; initial der({q}[1, 2]) = {one:g} m/s;"
        self.say(head, name=q)
        places = [f"{q}[{a}, {b}]" for a in range(1, len(rows) + 1) for b in range(1, len(rows[0]) + 1)]
        whole = ", ".join("{" + ", ".join(f"{v:.17g}" for v in row) + "}" for row in rows)
        rate = ", ".join("{" + ", ".join(f"{v:.17g}" for v in row) + "}" for row in rates)
        energy = f"kinetic {' + '.join(f'1/2*{m:g} kg*der({p})^2' for p in places)};"
        self.say(
            energy,
            f"coordinate Length {name} = {{{whole}}} m;",
            f"initial der({q}) = {{{rate}}} m/s;",
            energy,
        )
        way = f"for {self.i} in 1:{len(rows)} for {self.j} in 1:{len(rows[0])}"
        self.say(
            f"potential sum({k:g} N/m*{q}[{self.i}, {self.j}]^2 {way});",
            f"potential {' + '.join(f'{k:g} N/m*{p}^2' for p in places)};",
        )
        self.same(f"potential 0.3 N/m*{places[-1]}*{places[1]};")

    def _matrix_of_states(self) -> None:
        """States of two indices, likewise."""
        s, w = self.s, self.s.fresh("x")
        size, rows = self._sizes()
        start = "{" + ", ".join("{" + ", ".join(f"{v:g}" for v in row) + "}" for row in rows) + "}"
        self.say(f"state Real {w}{size} = {start}; {self._single(w, '', rows)}", name=w)
        whole = ", ".join("{" + ", ".join(f"{v:.17g}" for v in row) + "}" for row in rows)
        law = f"equation der({w}) = -{w}*(0.8 Hz);"
        self.say(law, f"state Real {w}{size} = {{{whole}}};", law)
        self.same(f"force 0.3 N*{w}[1, 2] on {self.x}[1];", f"output {s.fresh('o')} = {w}[2, 1] - {w}[1, 1];")

    def _vectors(self) -> None:
        """Equations between vectors, whose right sides are written with one unit or none."""
        s, w, x = self.s, self.s.fresh("x"), self.x
        a, b, c = self.numbers(3, -0.7, 0.7)
        text = f"state Length {w}[2] = {{{a:g}, {b:g}}} m;"
        self.say(text, text, name=w)
        if s.chance(0.5):
            self.say(f"equation der({w}) = {{{b:g}, {c:g}}} m/s;", f"equation der({w}[1]) = {b:g} m/s;",
                     f"equation der({w}[2]) = {c:g} m/s;")  # fmt: skip
        else:
            self.say(f"equation der({w}) = {{-{x}[1], {w}[1]}}/(0.9 s);", f"equation der({w}[1]) = -{x}[1]/(0.9 s);",
                     f"equation der({w}[2]) = {w}[1]/(0.9 s);")  # fmt: skip
        self.same(f"force 0.4 N/m*{w}[2] on {x}[1];")

    def _events(self) -> None:
        """Events of what moves on both sides, and of what is no longer so."""
        s, x, n = self.s, self.x, self.s.fresh("n")
        a, b = self.numbers(2, -0.4, 0.4)
        self.same(f"discrete Real {n} = {a:g};")
        text, plain = s.pick(
            (
                (f"not ({x}[1] > {b:g} m)", f"{x}[1] <= {b:g} m"),
                (f"{x}[1] > {x}[2]", f"{x}[1] - {x}[2] > 0 m"),
                (f"not {x}[1] < {x}[2] + {b:g} m", f"{x}[1] - {x}[2] >= {b:g} m"),
                (f"{x}[1]*{x}[2] > {b:g} m*{x}[1]", f"{x}[1]*({x}[2] - {b:g} m) > 0 m^2"),
                (f"der({x}[1]) < der({x}[2])", f"der({x}[1]) - der({x}[2]) < 0 m/s"),
            )
        )
        deed = f"{n} := 0.5*{n} + {x}[2]/(1 m);"
        self.say(f"when {text} then {deed} end when;", f"when {plain} then {deed} end when;", kind="when")
        self.same(f"force 0.3 N*{n} on {x}[2];", f"output {s.fresh('o')} = {n};")

    def _silent(self) -> None:
        """An input without a value is zero."""
        s, u = self.s, self.s.fresh("u")
        kind, unit = s.pick((("Force", " N"), ("Real", "")))
        self.say(f"input {kind} {u};", f"input {kind} {u} = 0{unit};", name=u)
        by = u if unit else f"{u}*1 N"
        self.same(f"force {by} + 0.2 N on {self.x}[1];")

    def _friction(self) -> None:
        """Limits of dry friction as they are written by hand, or by their names."""
        s, x = self.s, self.x
        k = s.random.randint(1, self.n)
        low, high = sorted(self.numbers(2, 0.05, 0.5))
        if s.chance(0.5):
            self.same(f"friction {low:g} N static {high + 0.05:g} N on {x}[{k}];")
            return
        a, b = s.fresh("p"), s.fresh("p")
        self.same(f"parameter {a} = {low:g} N;", f"parameter {b} = {high + 0.05:g} N;")
        self.same(f"friction {a} static {b} on {x}[{k}];")

    def _powers(self) -> None:
        """Powers of halves and thirds, of what stays positive."""
        s, x = self.s, self.x
        c = self.numbers(1, 0.1, 0.6)[0]
        one = f"({x}[1] + 2 m)"
        half = f"sqrt({x}[1]/(1 m) + 2)"
        pure = f"({x}[1]/(1 m) + 2)"
        laws = (
            (f"{c:g} N/m^1.5*{one}^2.5", f"{c:g} J*{pure}^2*{half}"),
            (f"{c:g} J/m^3.5*{one}^3.5", f"{c:g} J*{pure}^3*{half}"),
            (f"{c:g} J*{pure}^(7/2)", f"{c:g} J*{pure}^3*{half}"),
            (f"{c:g} J*{pure}^-0.5", f"{c:g} J/{half}"),
            (f"{c:g} J*{pure}^-1.5", f"{c:g} J/({pure}*{half})"),
            (f"{c:g} J.m^2.5/{one}^2.5", f"{c:g} J/({pure}^2*{half})"),
            (f"{c:g} J*{pure}^(1/3)", f"{c:g} J*exp(log({pure})/3)"),
            (f"{c:g} J*{pure}^(4/3)", f"{c:g} J*{pure}*exp(log({pure})/3)"),
            (f"{c:g} J*{pure}^0.3", f"{c:g} J*exp(0.3*log({pure}))"),
        )
        for text, plain in s.random.sample(laws, 2):
            self.say(f"potential {text};", f"potential {plain};")
        self.say(f"kinetic 0.1 kg*{pure}^1.5*der({x}[2])^2;", f"kinetic 0.1 kg*{pure}*{half}*der({x}[2])^2;")
        self.say(f"force {c:g} N*{pure}^2.5 on {x}[2];", f"force {c:g} N*{pure}^2*{half} on {x}[2];")

    def _functions(self) -> None:
        """Functions without arguments, of several values, by cases."""
        s, x = self.s, self.x
        f, g, h = (s.fresh("f") for _ in range(3))
        a, b = self.numbers(2, -0.6, 0.6)
        for name, text in (
            (f, f"function {f}() -> Force = {a:g} N;"),
            (g, f"function {g}(Length z) -> Force[2] = {{{b:g} N/m*z, -{f}()}};"),
            (h, f"function {h}(Length z) -> Force = if z > 0.05 m then {a:g} N else -0.2 N/m*z;"),
        ):
            s.file.items.append(statement("function", text, name=name))
        self.say(f"force {f}() on {x}[1];", f"force {a:g} N on {x}[1];")
        self.say(f"force {g}({x}[2])[1] on {x}[1];", f"force {b:g} N/m*{x}[2] on {x}[1];")
        self.output(f"{g}({x}[1])", f"{{{b:g} N/m*{x}[1], {-a:g} N}}")
        self.say(
            f"force {h}({x}[1]) on {x}[2];",
            f"force (if {x}[1] > 0.05 m then {a:g} N else -0.2 N/m*{x}[1]) on {x}[2];",
        )

    def _block(self) -> None:
        """Statements of all kinds under a condition that has a name."""
        s, x, on, n, w, o = self.s, self.x, *(self.s.fresh(k) for k in ("on", "n", "x", "o"))
        yes = s.chance(0.5)
        self.say(f"structural parameter Boolean {on} = {str(yes).lower()};", name=on)
        a, b, late = self.numbers(3, 0.1, 0.5)
        with_it = (f"discrete Real {n} = {a:g}; when time > {late:g} s then {n} := {b:g}; end when; force {n}*1 N on {x}[1]; "
                   f"output {o} = {n} + 1;")  # fmt: skip
        without = f"state Length {w} = {a:g} m; equation der({w}) = -{w}/(0.8 s); force 0.5 N/m*{w} on {x}[2]; output {o} = {w}/(1 m);"
        condition = on if s.chance(0.7) else f"not {on}"
        one, other = (with_it, without) if condition == on else (without, with_it)
        self.say(f"if {condition} then {one} else {other} end if;", with_it if yes else without, kind="when")

    def _sums(self) -> None:
        """Sums over two indices, and loops in loops."""
        i, j, x, n = self.i, self.j, self.x, self.n
        c = self.numbers(1, 0.05, 0.3)[0]
        pairs = [(a, b) for a in range(1, n + 1) for b in range(1, n + 1)]
        self.say(f"potential sum({c:g} N/m*({x}[{i}] - 0.5*{x}[{j}])^2 for {i} in 1:{self.N} for {j} in 1:{self.N});",
                 f"potential {' + '.join(f'{c:g} N/m*({x}[{a}] - 0.5*{x}[{b}])^2' for a, b in pairs)};")  # fmt: skip
        later = [(a, b) for a, b in pairs if b <= a]
        self.say(f"for {i} in 1:{self.N} loop for {j} in 1:{i} loop potential {c:g} N/m*{j}*{x}[{i}]*{x}[{j}]; end for; end for;",
                 *(f"potential {c * b:.17g} N/m*{x}[{a}]*{x}[{b}];" for a, b in later))  # fmt: skip

    def _lets(self) -> None:
        """Names of vectors, matrices and rates."""
        x, v, w, a = self.x, *(self.s.fresh("l") for _ in range(3))
        c, d = self.numbers(2, -0.6, 0.6)
        self.say(f"let {v} = {{-{x}[1], 2*{x}[2], sin({x}[1]/(1 m))*1 m}};", name=v)
        self.say(f"let {w} = der({x}[1]) - 0.5*der({x}[2]);", name=w)
        self.say(f"let {a}[2, 2] = {{{{{c:g}, {d:g}}}, {{-{x}[1]/(1 m), 1}}}};", name=a)
        self.say(f"force 0.3 N/m*{v}[3] on {x}[2];", f"force 0.3 N/m*(sin({x}[1]/(1 m))*1 m) on {x}[2];")
        self.say(
            f"force -0.2 kg/s*{w} on {x}[1];", f"force -0.2 kg/s*(der({x}[1]) - 0.5*der({x}[2])) on {x}[1];"
        )
        self.output(f"{a}*{v}[1:2]", f"{{{c:g}*(-{x}[1]) + {d:g}*(2*{x}[2]), {x}[1]^2/(1 m) + 2*{x}[2]}}")
        self.output(f"der({w})", f"der({x}[1], 2) - 0.5*der({x}[2], 2)")

    def _index(self) -> None:
        """Indices and sizes by their names."""
        s, x, k = self.s, self.x, self.s.fresh("k")
        at = s.random.randint(1, self.n)
        self.say(f"structural parameter Integer {k} = {at};", name=k)
        c = self.numbers(1, -0.6, 0.6)[0]
        self.say(f"force {c:g} N on {x}[{k}];", f"force {c:g} N on {x}[{at}];")
        self.output(f"{x}[{k}:{self.N}]", "{" + ", ".join(f"{x}[{b}]" for b in range(at, self.n + 1)) + "}")
        o = s.fresh("o")
        self.say(f"output Length {o}[{self.N}] = 2*{x};", f"output Length {o}[{self.n}] = 2*{x};", name=o)
