"""Straight-line functions over arrays: what the targets print.

A body is a sequence of statements. A statement that yields a number is referred to by its position in the
body, and only by later statements: every value is computed once, before it is used. Nothing branches; a
choice is the operation SELECT (branches.py finds what only one side of it needs). All functions but ``parameters`` have the signature (t, y, u, z, p) -> out.
"""

from __future__ import annotations

import re
from array import array
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from fractions import Fraction
from typing import Final, overload

from msgspec import Struct

from mechc.runtime.interface import Quantity

from ..equations.model import CompilerInterface
from ..graph import Samples, Table
from ..graph.operations import LOOKUP, OPERATIONS

Value = int
"""Position of a statement in its body."""

# statements are written as arrays that begin with the number of their class (stored.py)


class Load(Struct, frozen=True, array_like=True, tag=0):
    """The number ``array[index]``; the array is t (index 0), y, u, z, p or the workspace w; or g, what functions of crowds
    and of unknown outputs are given after u."""

    array: str
    index: int


class Literal(Struct, frozen=True, array_like=True, tag=1):
    """An exact constant; the target rounds it to its own numbers."""

    number: Fraction


class Operate(Struct, frozen=True, array_like=True, tag=2):
    """One operation of the graph (``graph/operations.py``)."""

    code: int
    operands: tuple[Value, ...]


class Lookup(Struct, frozen=True, array_like=True, tag=3):
    """The value (order 0) or a derivative of ``tables[table]`` at the operand, or what it asks of samples (graph/table.py)."""

    table: int
    order: int
    operand: Value


class Store(Struct, frozen=True, array_like=True, tag=4):
    """``array[index] = value``; the array is out, w or, in ``parameters``, p.

    ``guarded``: only where the parameter is not set from outside (set[index] == 0).
    """

    array: str
    index: int
    value: Value
    guarded: bool = False


Statement = Load | Literal | Operate | Lookup | Store
Body = Sequence[Statement]


def operands_of(statement: Statement) -> tuple[Value, ...]:
    """Return the values that a statement reads."""
    if type(statement) is Operate:  # asked of every statement of long programs, several times
        return statement.operands
    match statement:
        case Lookup(_, _, operand) | Store(_, _, operand):
            return (operand,)
        case _:
            return ()


def moved(statement: Statement, place: Mapping[Value, Value]) -> Statement:
    """Return a statement whose operands stand elsewhere."""
    if type(statement) is Operate:  # most of them
        return Operate(statement.code, tuple([place[a] for a in statement.operands]))
    match statement:
        case Lookup(table, order, operand):
            return Lookup(table, order, place[operand])
        case Store(array, index, value, guarded):
            return Store(array, index, place[value], guarded)
        case _:
            return statement


LOAD, LITERAL, STORE = -1, -2, -3
"""What ``LongBody.kinds`` says of statements that are not operations."""

ARRAYS = ("t", "y", "u", "z", "p", "w", "g", "out")


class LongBody(Sequence[Statement]):
    """Many statements in columns, made one by one when they are asked for.

    ``kinds``: codes of operations, or what other statements are; then of Load: array (by its place in ``ARRAYS``), index; of
    Literal: place in ``numbers``; of Operate: operands, -1 where there is none; of Lookup: operand, table, order; of Store:
    value, index, twice the array, and one more if guarded.
    """

    __slots__ = ("first", "kinds", "numbers", "second", "third")

    def __init__(
        self,
        kinds: array[int],
        first: array[int],
        second: array[int],
        third: array[int],
        numbers: tuple[Fraction, ...],
    ) -> None:
        self.kinds = kinds
        self.first = first
        self.second = second
        self.third = third
        self.numbers = numbers

    @classmethod
    def of(cls, statements: Iterable[Statement]) -> LongBody:
        kinds, columns, numbers = array("b"), (array("i"), array("i"), array("i")), list[Fraction]()
        for statement in statements:
            parts: tuple[int, ...]
            match statement:
                case Operate(kind, operands):  # most are
                    parts = operands
                case Load(name, index):
                    kind, parts = LOAD, (ARRAYS.index(name), index)
                case Literal(number):
                    kind, parts = LITERAL, (len(numbers),)
                    numbers.append(number)
                case Lookup(table, order, operand):
                    kind, parts = LOOKUP, (operand, table, order)
                case Store(name, index, value, guarded):
                    kind, parts = STORE, (value, index, 2 * ARRAYS.index(name) + guarded)
            kinds.append(kind)
            for column, part in zip(columns, (*parts, -1, -1), strict=False):
                column.append(part)
        return cls(kinds, *columns, tuple(numbers))

    def __repr__(self) -> str:
        return repr(tuple(self))

    def __len__(self) -> int:
        return len(self.kinds)

    @overload
    def __getitem__(self, at: int) -> Statement: ...
    @overload
    def __getitem__(self, at: slice) -> tuple[Statement, ...]: ...
    def __getitem__(self, at: int | slice) -> Statement | tuple[Statement, ...]:
        columns = (self.kinds, self.first, self.second, self.third)
        if isinstance(at, slice):
            return tuple(map(self._made, *(column[at] for column in columns)))
        return self._made(*(column[at] for column in columns))

    def __iter__(self) -> Iterator[Statement]:
        return map(self._made, self.kinds, self.first, self.second, self.third)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, LongBody):
            return NotImplemented
        return all(getattr(self, name) == getattr(other, name) for name in self.__slots__)

    def _made(self, kind: int, a: int, b: int, c: int) -> Statement:
        if kind == LOAD:
            return Load(ARRAYS[a], b)
        if kind == LITERAL:
            return Literal(self.numbers[a])
        if kind == STORE:
            return Store(ARRAYS[c >> 1], b, a, bool(c & 1))
        if kind == LOOKUP:
            return Lookup(b, c, a)
        return Operate(kind, (a, b, c)[: OPERATIONS[kind].arity])


def codes_of(body: Body) -> set[int]:
    """Return the codes of the operations of a body, lookups among them."""
    if isinstance(body, LongBody):
        return {kind for kind in set(body.kinds) if kind >= 0}
    return {s.code if type(s) is Operate else LOOKUP for s in body if type(s) in (Operate, Lookup)}


def places_of(body: Body, codes: Collection[int]) -> list[Value]:
    """Return where a body has operations with some codes."""
    if isinstance(body, LongBody):
        return [value for value, kind in enumerate(body.kinds) if kind in codes]
    return [
        value
        for value, s in enumerate(body)
        if (type(s) is Operate and s.code in codes) or (type(s) is Lookup and LOOKUP in codes)
    ]


_OPERATIONS: Final = bytes(range(128))
"""The kinds of statements that are operations, as bytes."""


class ProgramFunction(Struct, frozen=True):
    """``bodies`` run one after the other; values pass from one to the next through w[0 .. workspace-1] only.

    ``made``: of a long function in one body, which is a ``LongBody`` then, the positions of its operations and stores in the order in which their nodes
    were made, in which they may run as well, and in which what loops over arrays made repeats itself (loops/).
    """

    name: str
    doc: str
    n_out: int
    bodies: tuple[Body, ...]
    workspace: int = 0
    made: Sequence[Value] = ()

    @property
    def operations(self) -> int:
        """Count the operations: all statements but loads, literals and stores."""
        return sum(
            len(body) - len(body.kinds.tobytes().translate(None, _OPERATIONS))
            if isinstance(body, LongBody)
            else sum(type(s) is Operate or type(s) is Lookup for s in body)
            for body in self.bodies
        )


FEW_SLOTS: Final = 64
"""Slots up to which one loop over orders is faster than calls of the kernel (MECH_FEW_SLOTS of series.h). Measured: 62 are 1.2 times, 108 slower."""


SERIES_START: Final = "series_start"
SERIES_NEXT: Final = "series_next"
"""Functions of Taylor series (series.py)."""


class SeriesPlan(Struct, frozen=True):
    """Of ``series_start`` and ``series_next`` (series.py): how many slots, and how many numbers are kept for the orders."""

    n_slots: int
    n_kept: int


class ProgramSolution(Struct, frozen=True):
    """Numbers that a target finds by steps: what makes rows vanish, near what ``guess`` gives. They lie in the array s, ``count`` of them from
    ``begin`` on, and so do the unknowns on which ``rows`` are asked.

    Both are functions of (t, y, u, p, s); ``rows`` gives as many numbers as there are rows, then the sum of the sizes of the terms of
    each row, then the derivatives by unknowns of rows at ``places`` (row, unknown). ``needs``: the solutions, by index, that both functions
    read, those of which this one is found excepted; ``inner``: those that read the unknowns, found for each value of these.
    """

    guess: ProgramFunction
    rows: ProgramFunction
    begin: int
    count: int
    places: tuple[tuple[int, int], ...]
    needs: tuple[int, ...]
    inner: tuple[int, ...]


class Program(CompilerInterface, frozen=True, kw_only=True):
    """``parameters_function`` writes p in place: dependent parameters, then ``nh`` constants of the run after them.
    ``functions`` keep the order of the equations.
    """

    tables: tuple[Table | Samples, ...]
    parameters_function: ProgramFunction
    functions: tuple[ProgramFunction, ...]
    series: SeriesPlan | None = None
    """None where no method asks for series, and where there are none (``no_series``)."""
    solutions: tuple[ProgramSolution, ...] = ()
    """Of what functions read in s, where steps are not written out (lower.py)."""

    @property
    def arrays(self) -> Mapping[str, tuple[Quantity, ...]]:
        """The numbers of t, y, u, z, p (without the hoisted constants) and out, the ordinary outputs."""
        arrays = {
            "t": (self.time,),
            "y": self.states,
            "u": self.inputs,
            "z": self.discretes,
            "p": self.parameters,
            "out": self.outputs,
        }
        return {**arrays, "g": self.given} if self.given else arrays

    @property
    def long(self) -> bool:
        """Whether some function is so long that it is looked through for loops."""
        return any(f.made for f in (self.parameters_function, *self.functions))

    @property
    def few_slots(self) -> bool:
        """Whether it has Taylor series of so few slots that their code is one loop over the orders (targets/c_series.py)."""
        plan = self.series
        return plan is not None and plan.n_slots <= FEW_SLOTS

    def size(self, array: str) -> int:
        """Return how many numbers an array of the signature holds, hoisted constants included."""
        return len(self.arrays.get(array, ())) + (self.nh if array == "p" else 0)

    def function(self, name: str) -> ProgramFunction | None:
        return next((f for f in self.functions if f.name == name), None)


_TEMPORARY = re.compile(r"[vkw]\d+|(sin|cos)_\w+")
"""Names that targets give to values of their own."""


def identifiers(program: Program, reserved: Collection[str]) -> Mapping[tuple[str, int], str]:
    """Return a different identifier for each (array, index); none is in ``reserved``.

    ``der(theta)`` becomes der_theta, ``arm.R[2]`` arm_R_2; hoisted constants are k0, k1, ...
    """
    names: dict[tuple[str, int], str] = {("t", 0): "t"}
    taken = {
        "t",
        "y",
        "u",
        "z",
        "p",
        "out",
        "w",
        "set",
        *reserved,
        *(("g",) if "g" in program.arrays else ()),
    }
    for kind in ("y", "u", "z", "p", "g"):
        for index, entry in enumerate(program.arrays.get(kind, ())):
            base = re.sub(r"\W+", "_", entry.name, flags=re.ASCII).strip("_") or kind
            name = f"{kind}_{base}" if base[0].isdigit() or _TEMPORARY.fullmatch(base) else base
            while name in taken:
                name += "_"
            taken.add(name)
            names[kind, index] = name
    for i in range(program.nh):
        names["p", len(program.arrays["p"]) + i] = f"k{i}"
    return names
