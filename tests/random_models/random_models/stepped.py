"""Ranges with steps, falling ones too, wherever a range may stand; grids of components one element of which is another.

Each statement holds what it means element by element, which a twin says in its place.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from random_models.lists import Chain
from random_models.scope import Scope
from random_models.tree import statement

SHARE = 0.1
"""Of the models."""


def stepped(s: Scope, seed: int) -> None:
    """Write a chain, a grid, or both. Their random numbers are their own: models keep all else."""
    with s.apart(f"stepped of {seed}"):
        if s.chance(SHARE):
            kinds = s.pick(((True, False), (False, True), (True, True)))
            for wanted, write in zip(kinds, (_Ranges, _Grid), strict=True):
                if wanted:
                    write(s).write()


class _Ranges(Chain):
    """Writes what goes through some of a chain of masses, in an order of its own."""

    def write(self) -> None:
        s = self.s
        self.n = s.pick((3, 4, 5))
        text = f"structural parameter Integer {self.N} = {self.n};"
        self.say(text, text, name=self.N)
        self.m = s.fresh("p")
        self.masses = self.array(f"parameter Mass {self.m}", "kg")
        self.array(f"coordinate Length {self.x}", "m", -0.5, 0.5)
        self.array(f"initial der({self.x})", "m/s", -1, 1)
        self._energies()
        every = [self._sum, self._loop, self._made, self._slice, self._product, self._largest, self._pairs]
        for part in s.random.sample(every, s.pick((3, 4, 5))):
            part()

    def range(self) -> tuple[str, list[int]]:
        """Return a range with a step, and its numbers."""
        s, n, N = self.s, self.n, self.N
        first, last = s.random.randint(1, n), s.random.randint(1, n)
        if s.chance(0.3):
            first, last = s.pick(((1, n), (n, 1)))
        step = s.pick((1, 2, 3)) * (1 if last > first or (last == first and s.chance(0.5)) else -1)
        texts = {1: ("1",), n: (N, str(n))}
        begin, end = (s.pick(texts.get(k, (str(k),))) for k in (first, last))
        return f"{begin}:{step}:{end}", list(range(first, last + (1 if step > 0 else -1), step))

    def _sum(self) -> None:
        text, ks = self.range()
        c = self.numbers(1, 0.2, 1)[0]
        terms = " + ".join(f"{c * k:.17g} N/m*{self.x}[{k}]^2" for k in ks)
        self.say(
            f"potential 1/2*sum({c:g} N/m*{self.i}*{self.x}[{self.i}]^2 for {self.i} in {text});",
            f"potential 1/2*({terms});",
        )

    def _loop(self) -> None:
        text, ks = self.range()
        c = self.numbers(1, -0.8, 0.8)[0]
        self.say(
            f"for {self.i} in {text} loop force {c:g} N*{self.i} on {self.x}[{self.i}]; end for;",
            *(f"force {c * k:.17g} N on {self.x}[{k}];" for k in ks),
        )

    def _made(self) -> None:
        """A vector that is made along a range, and a force of its first element."""
        text, ks = self.range()
        o, name, x, i = self.s.fresh("o"), self.s.fresh("l"), self.x, self.i
        made, written = f"{{{i}*{x}[{i}] for {i} in {text}}}", f"{{{', '.join(f'{k}*{x}[{k}]' for k in ks)}}}"
        self.say(f"output {o} = {made};", f"output {o} = {written};", name=o)
        self.say(f"let {name} = {made};", f"let {name} = {written};", name=name)
        self.say(f"force -0.3 N/m*{name}[1] on {x}[2];", f"force -0.3 N/m*{ks[0]}*{x}[{ks[0]}] on {x}[2];")

    def _slice(self) -> None:
        text, ks = self.range()
        o, x, m = self.s.fresh("o"), self.x, self.m
        places = ", ".join(f"{x}[{k}]" for k in ks)
        self.say(f"output {o} = {x}[{text}];", f"output {o} = {{{places}}};", name=o)
        o = self.s.fresh("o")
        whole = " + ".join(f"{self.masses[k - 1]:.17g} kg*der({x}[{k}])" for k in ks)
        self.say(f"output {o} = dot({m}[{text}], der({x})[{text}]);", f"output {o} = {whole};", name=o)

    def _product(self) -> None:
        text, ks = self.range()
        o, x, i = self.s.fresh("o"), self.x, self.i
        self.say(f"output {o} = product({x}[{i}] + {i}*1 m for {i} in {text});",
                 f"output {o} = {'*'.join(f'({x}[{k}] + {k} m)' for k in ks)};", name=o)  # fmt: skip

    def _largest(self) -> None:
        text, ks = self.range()
        o, x, i = self.s.fresh("o"), self.x, self.i
        what = self.s.pick(("min", "max"))
        self.say(f"output {o} = {what}({x}[{i}]*{i} for {i} in {text});",
                 f"output {o} = {what}({', '.join(f'{x}[{k}]*{k}' for k in (ks if len(ks) > 1 else ks * 2))});", name=o)  # fmt: skip

    def _pairs(self) -> None:
        """A loop inside of a loop, whose range follows the outer index."""
        i, j, x, c = self.i, self.j, self.x, self.numbers(1, -0.3, 0.3)[0]
        plain = [
            f"force {c * (a + 2 * b):.17g} N on {x}[{b}] from {x}[{a}];"
            for a in range(self.n, 1, -1)
            for b in range(a - 1, 0, -2)
        ]
        inner = (
            f"for {j} in {i} - 1:-2:1 loop force {c:g} N*({i} + 2*{j}) on {x}[{j}] from {x}[{i}]; end for;"
        )
        self.say(f"for {i} in {self.N}:-1:2 loop {inner} end for;", *plain)


@dataclass(frozen=True)
class _Said:
    """The values of a grid, and the modifications that say them: by a base, and by what is nearer."""

    values: list[list[float]]
    inner: list[str]
    outer: list[str]


_CELL = (("m", "kg", 7.0), ("k", "N/m", 9.0), ("x", "m", 3.0))
"""What a component of a grid can be given: name, unit, default."""


class _Grid(Chain):
    """Writes components in a grid, some of whose values are given element by element."""

    def write(self) -> None:
        s = self.s
        self.rows, self.columns = s.pick(((2, 2), (2, 3), (3, 2)))
        cell, grid, name = (s.fresh(k) for k in ("Cell", "Grid", "g"))
        self._model(
            f"model {cell} parameter Mass m = 7 kg; parameter Stiffness k = 9 N/m; coordinate Length x = 3 m; "
            f"initial der(x) = 0 m/s; kinetic 1/2*m*der(x)^2; potential 1/2*k*x^2; end {cell};",
            cell,
        )
        self._model(f"model {grid} {cell} c[{self.rows}, {self.columns}]; end {grid};", grid)
        said = [self._given(*row) for row in _CELL]
        full = ", ".join(
            f"c.{key} = {self._written(v.values, u)}" for (key, u, _), v in zip(_CELL, said, strict=True)
        )
        inner, outer = ([m for v in said for m in v.inner], [m for v in said for m in v.outer])
        base = grid
        if inner:  # what a base says of all is overruled by what its heir, or the component, says of some
            base = s.fresh("Heir")
            self._model(f"model {base} extends {grid}({', '.join(inner)}); end {base};", base)
        if outer and s.chance(0.5):
            heir = s.fresh("Heir")
            self._model(f"model {heir} extends {base}({', '.join(outer)}); end {heir};", heir)
            base, outer = heir, []
        call = f"({', '.join(outer)})" if outer else ""
        self.say(f"{base} {name}{call};", f"{grid} {name}({full});", name=name)
        r, c = s.random.randint(1, self.rows), s.random.randint(1, self.columns)
        for text in (f"{name}.c[{r}, {c}].m", f"{name}.c[{r}, {c}].k", f"{name}.c[{r}, {c}].x"):
            o = s.fresh("o")
            self.say(f"output {o} = {text};", f"output {o} = {text};", name=o)
        push = f"force 0.3 N on {name}.c[{c if c <= self.rows else 1}, 1].x from {name}.c[{r}, {self.columns}].x;"
        self.say(push, push)

    def _model(self, text: str, name: str) -> None:
        self.s.file.items.append(statement("class", text, name=name))

    def _given(self, key: str, unit: str, first: float) -> _Said:
        """Choose values, and say them: as a whole, one by one, or some over a whole, over one value for all or over nothing."""
        s, low, high = self.s, (-0.6 if key == "x" else 0.5), (0.6 if key == "x" else 2.0)
        values = [self.numbers(self.columns, low, high) for _ in range(self.rows)]
        each = [(r, c) for r in range(self.rows) for c in range(self.columns)]
        kind = s.pick(("whole", "each", "over a whole", "over one value", "over nothing"))
        if kind == "whole":
            return _Said(values, [], [f"c.{key} = {self._written(values, unit)}"])
        some = s.random.sample(each, len(each) if kind == "each" else s.random.randint(1, len(each) - 1))
        outer = [f"c[{r + 1}, {c + 1}].{key} = {values[r][c]:.17g} {unit}" for r, c in some]
        if kind == "over a whole":
            other = [
                [v + 1 if (r, c) in some else v for c, v in enumerate(row)] for r, row in enumerate(values)
            ]
            return _Said(values, [f"c.{key} = {self._written(other, unit)}"], outer)
        same = self.numbers(1, low, high)[0] if kind == "over one value" else first
        values = [[v if (r, c) in some else same for c, v in enumerate(row)] for r, row in enumerate(values)]
        return _Said(values, [f"c.{key} = {same:.17g} {unit}"] if kind == "over one value" else [], outer)

    def _written(self, values: Sequence[Sequence[float]], unit: str) -> str:
        rows = ("{" + ", ".join(f"{v:.17g}" for v in row) + "}" for row in values)
        return "{" + ", ".join(rows) + "} " + unit
