"""The trees that random models are: expressions with a dimension and a value of their own, statements, sequences.

They print as ``.mech`` text, and say which construct stands where. Nothing here knows the compiler.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Any

Dim = tuple[Fraction, Fraction, Fraction, Fraction]
"""Exponents of kg, m, s, A."""


def dim(kg: int | Fraction = 0, m: int | Fraction = 0, s: int | Fraction = 0, a: int | Fraction = 0) -> Dim:
    """Return a dimension."""
    return Fraction(kg), Fraction(m), Fraction(s), Fraction(a)


NUMBER = dim()
MASS, LENGTH, TIME = dim(1), dim(0, 1), dim(0, 0, 1)
SPEED, FORCE, ENERGY = dim(0, 1, -1), dim(1, 1, -2), dim(1, 2, -2)
ACCELERATION, RATE, POWER, INERTIA = dim(0, 1, -2), dim(0, 0, -1), dim(1, 2, -3), dim(1, 2)


def times(a: Dim, b: Dim) -> Dim:
    """Return the dimension of a product."""
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2], a[3] + b[3])


def to_power(a: Dim, n: int | Fraction) -> Dim:
    """Return the dimension of a power."""
    return (a[0] * n, a[1] * n, a[2] * n, a[3] * n)


def over(a: Dim, b: Dim) -> Dim:
    """Return the dimension of a quotient."""
    return times(a, to_power(b, -1))


# how strongly a text binds: what stands inside of something stronger gets parentheses
IF, OR, AND, NOT, RELATION, SUM, PRODUCT, SIGNED, POWER_OF, ATOM = range(10)


@dataclass(frozen=True)
class E:
    """An expression. ``parts`` are texts, operands, and operands with the least binding that they need here.

    ``level`` holds one letter for each kind of thing that it depends on: p parameters, t time, u inputs, z discrete
    variables, x states, q positions, v velocities, a accelerations and multipliers, e whether a contact holds.
    ``value`` computes it from the values of the operands; ``ref`` is the dotted name of a variable.
    """

    kind: str
    parts: tuple[str | E | tuple[E, int], ...]
    dim: Dim = NUMBER
    shape: tuple[int, ...] = ()
    level: frozenset[str] = frozenset()
    binding: int = ATOM
    value: Callable[..., Any] | None = None
    ref: str = ""
    type: str = "real"  # real, boolean, frame, point, pose
    data: Any = None

    @property
    def operands(self) -> tuple[E, ...]:
        return tuple(p[0] if isinstance(p, tuple) else p for p in self.parts if not isinstance(p, str))

    def with_operands(self, operands: tuple[E, ...]) -> E:
        """Return the same with other operands."""
        rest = iter(operands)
        parts: list[str | E | tuple[E, int]] = []
        for part in self.parts:
            if isinstance(part, str):
                parts.append(part)
            elif isinstance(part, tuple):
                parts.append((next(rest), part[1]))
            else:
                parts.append(next(rest))
        return replace(self, parts=tuple(parts))

    def __str__(self) -> str:
        if self.ref:
            return self.ref
        texts = []
        for part in self.parts:
            if isinstance(part, str):
                texts.append(part)
            else:
                operand, least = part if isinstance(part, tuple) else (part, IF)
                texts.append(str(operand) if operand.binding >= least else f"({operand})")
        return "".join(texts)

    def walk(self) -> Iterator[E]:
        """Yield it and all below."""
        yield self
        for operand in self.operands:
            yield from operand.walk()


def level_of(operands: tuple[E, ...]) -> frozenset[str]:
    """Return what any of the operands depends on."""
    return frozenset().union(*(o.level for o in operands)) if operands else frozenset()


def node(
    kind: str,
    *parts: str | E | tuple[E, int],
    dim: Dim = NUMBER,
    shape: tuple[int, ...] = (),
    binding: int = ATOM,
    value: Callable[..., Any] | None = None,
    level: str = "",
    type: str = "real",
    data: Any = None,
) -> E:
    """Make an expression whose level follows from its operands."""
    operands = tuple(p[0] if isinstance(p, tuple) else p for p in parts if not isinstance(p, str))
    return E(kind, parts, dim, shape, level_of(operands) | frozenset(level), binding, value, "", type, data)


def reference(
    name: str,
    role: str,
    dim: Dim = NUMBER,
    shape: tuple[int, ...] = (),
    level: str = "",
    type: str = "real",
) -> E:
    """Make a reference to a named thing of a role."""
    return E(f"ref:{role}", (), dim, shape, frozenset(level), ATOM, None, name, type)


# ---------------------------------------------------------------- statements


@dataclass(frozen=True)
class Slot:
    """A place where an expression stands."""

    place: str
    expression: E


@dataclass(frozen=True)
class Seq:
    """Statements of a block, or modifications; ``style`` is block or list."""

    items: tuple[S, ...]
    style: str = "block"


@dataclass(frozen=True)
class S:
    """A statement, a modification, a branch or a model; ``name`` is what it declares or modifies."""

    kind: str
    parts: tuple[str | Slot | Seq, ...]
    name: str = ""
    data: Mapping[str, Any] | None = None

    @property
    def slots(self) -> tuple[Slot, ...]:
        return tuple(p for p in self.parts if isinstance(p, Slot))

    def slot(self, place: str) -> E:
        """Return the expression at a place of this statement."""
        return next(s.expression for s in self.slots if s.place == place)

    def seq(self, index: int = 0) -> Seq:
        """Return one of its sequences."""
        return [p for p in self.parts if isinstance(p, Seq)][index]

    def text(self, indent: str = "") -> str:
        """Print it."""
        texts = []
        for part in self.parts:
            if isinstance(part, str):
                texts.append(part)
            elif isinstance(part, Slot):
                texts.append(str(part.expression))
            elif part.style == "list":
                inside = ", ".join(item.text() for item in part.items)
                texts.append(f"({inside})" if inside else "")
            else:
                inner = indent + "  "
                texts.append("\n" + "".join(f"{inner}{item.text(inner)}\n" for item in part.items) + indent)
        return "".join(texts)

    def walk(self) -> Iterator[S]:
        """Yield it and all statements inside."""
        yield self
        for part in self.parts:
            if isinstance(part, Seq):
                for item in part.items:
                    yield from item.walk()

    def rebuilt(
        self, expression: Callable[[E, str], E], statement: Callable[[S], S | None] = lambda s: s
    ) -> S:
        """Return a copy with every expression exchanged, then every statement inside exchanged or left out."""
        parts: list[str | Slot | Seq] = []
        for part in self.parts:
            if isinstance(part, Slot):
                parts.append(Slot(part.place, expression(part.expression, part.place)))
            elif isinstance(part, Seq):
                inner = (statement(item.rebuilt(expression, statement)) for item in part.items)
                parts.append(Seq(tuple(i for i in inner if i is not None), part.style))
            else:
                parts.append(part)
        return replace(self, parts=tuple(parts))


@dataclass(frozen=True)
class Model:
    """A file: imports, functions, classes, and the model itself, which is the last."""

    items: tuple[S, ...]

    @property
    def top(self) -> S:
        return self.items[-1]

    def text(self) -> str:
        """Print it."""
        return "".join(item.text() + "\n" for item in self.items)

    def rebuilt(
        self, expression: Callable[[E, str], E], statement: Callable[[S], S | None] = lambda s: s
    ) -> Model:
        """Return a copy with every expression and statement exchanged."""
        items = (statement(item.rebuilt(expression, statement)) for item in self.items)
        return Model(tuple(i for i in items if i is not None))

    def statements(self) -> Iterator[S]:
        """Yield all statements of all models."""
        for item in self.items:
            yield from item.walk()

    def pairs(self) -> Iterator[tuple[str, str]]:
        """Yield (construct, place) for every expression and each of its parts."""
        for statement in self.statements():
            for slot in statement.slots:
                for e in slot.expression.walk():
                    yield e.kind, slot.place

    def with_top(self, statements: tuple[S, ...]) -> Model:
        """Return it with other statements of the model itself."""
        parts = tuple(Seq(statements) if isinstance(p, Seq) else p for p in self.top.parts)
        return Model((*self.items[:-1], replace(self.top, parts=parts)))


def map_expression(e: E, change: Callable[[E], E]) -> E:
    """Exchange every part of an expression, from the leaves up."""
    operands = e.operands
    if operands:
        e = e.with_operands(tuple(map_expression(o, change) for o in operands))
    return change(e)


def statement(
    kind: str, *parts: str | Slot | Seq, name: str = "", data: Mapping[str, Any] | None = None
) -> S:
    """Make a statement."""
    return S(kind, parts, name, data)


def whole_of(s: S) -> str:
    """Name what a statement gives an initial value, or the whole of which it is an element."""
    return s.name.partition("[")[0].removesuffix(")")


def without(items: Sequence[S], left_out: Sequence[S]) -> list[S]:
    """Leave out statements, but not others that read as they do."""
    gone = {id(s) for s in left_out}
    return [s for s in items if id(s) not in gone]


def entire(moved: list[S], rest: list[S]) -> list[S]:
    """Leave out initial values of elements of which others, or that of the whole, stay: what is nearer overrules."""
    staying = {whole_of(s) for s in without(rest, moved) if s.kind == "initial"}
    return [s for s in moved if s.kind != "initial" or whole_of(s) not in staying]


def evaluate(e: E, names: Callable[[str], Any]) -> Any:
    """Compute an expression of constants and named values; lookups go through ``names``."""
    if e.ref:
        return names(e.ref)
    if e.kind == "comprehension":  # data: variable, values of the index, what gathers them
        variable, indices, gather = e.data
        body = e.operands[0]

        def term(i: int) -> Any:
            return evaluate(body, lambda n: i if n == variable else names(n))

        return gather([term(i) for i in indices])
    if e.value is None:
        raise ValueError(f"no value of its own: {e.kind}")
    return e.value(*(evaluate(o, names) for o in e.operands))
