"""Straight-line functions over arrays: what the targets print.

A body is a sequence of statements. A statement that yields a number is referred to by its position in the
body, and only by later statements: every value is computed once, before it is used. Nothing branches; a
choice is the operation SELECT. All functions but ``parameters`` have the signature (t, y, u, z, p) -> out.
"""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction

from msgspec import Struct

from mechc.lang.source import Span

from ..equations.model import (
    AssemblyEntry,
    AssertionText,
    ConstraintEntry,
    CurvePlan,
    Entry,
    ExperimentPlan,
    HybridPlan,
    Offer,
    ScenePlan,
    Sought,
)
from ..graph import Table

Value = int
"""Position of a statement in its body."""

# statements are written as arrays that begin with the number of their class (stored.py)


class Load(Struct, frozen=True, array_like=True, tag=0):
    """The number ``array[index]``; the array is t (index 0), y, u, z, p or the workspace w; or g, what functions of crowds
    and of unknown outputs are given behind u."""

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
    """The value (order 0) or a derivative of ``tables[table]`` at the operand."""

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
Body = tuple[Statement, ...]


def operands_of(statement: Statement) -> tuple[Value, ...]:
    """Return the values that a statement reads."""
    if type(statement) is Operate:  # asked of every statement of long programs, several times
        return statement.operands
    match statement:
        case Lookup(_, _, operand) | Store(_, _, operand):
            return (operand,)
        case _:
            return ()


class ProgramFunction(Struct, frozen=True):
    """``bodies`` run one after the other; values pass from one to the next through w[0 .. workspace-1] only.

    ``made``: of a long function in one body, the positions of its operations and stores in the order in which their nodes
    were made, in which they may run as well, and in which what loops over arrays made repeats itself (loops/).
    """

    name: str
    doc: str
    n_out: int
    bodies: tuple[Body, ...]
    workspace: int = 0
    made: tuple[Value, ...] = ()

    @property
    def operations(self) -> int:
        """Count the operations: all statements but loads, literals and stores."""
        return sum(type(s) is Operate or type(s) is Lookup for body in self.bodies for s in body)


class SeriesPlan(Struct, frozen=True):
    """Of ``series_start`` and ``series_next`` (series.py): how many slots, and how many numbers are kept for the orders.
    ``refusal``: why there are no such functions."""

    n_slots: int = 0
    n_kept: int = 0
    refusal: str = ""


class Program(Struct, frozen=True):
    """``arrays`` describes t, y, u, z, p (without the hoisted constants) and out, the ordinary outputs.

    ``parameters`` writes p in place: dependent parameters, then ``n_hoisted`` constants of the run behind them.
    ``functions`` keep the order of the equations; what follows them is as in ``Equations``.
    """

    name: str
    doc: str
    nq: int
    nv: int
    nx: int
    arrays: Mapping[str, tuple[Entry, ...]]
    n_hoisted: int
    tables: tuple[Table, ...]
    parameters: ProgramFunction
    functions: tuple[ProgramFunction, ...]
    known: tuple[bool, ...]
    experiments: tuple[ExperimentPlan, ...] = ()
    rotations: tuple[int, ...] = ()
    conserved: tuple[int, ...] = ()
    energy_balance: tuple[int, ...] = ()
    assertions: tuple[AssertionText, ...] = ()
    jacobian_pattern: tuple[tuple[int, int], ...] = ()
    patterns: Mapping[str, tuple[tuple[int, int], ...]] = {}
    hybrid: HybridPlan | None = None
    dependent: tuple[int, ...] = ()
    constraints: tuple[ConstraintEntry, ...] = ()
    start_spans: tuple[Span | None, ...] = ()
    assembly: tuple[AssemblyEntry, ...] = ()
    separable: bool = False
    scene: ScenePlan | None = None
    phase: tuple[Entry, ...] = ()
    curve: CurvePlan | None = None
    matter: tuple[Entry, ...] = ()
    matter_size: int = 0
    offers: tuple[Offer, ...] = ()
    groups: tuple[int, ...] = ()
    """Of each state (connected.py); empty where all of them feel each other."""
    narrow: bool = False
    """The derivatives hold formulas that may be narrow in what they depend on (lower.py)."""
    bent: bool = False
    """The derivatives hold kinks or jumps that no event locates (lower.py)."""
    sought: tuple[Sought, ...] = ()
    series: SeriesPlan | None = None
    """None where no method asks for series."""

    @property
    def long(self) -> bool:
        """Whether some function is so long that it is looked through for loops."""
        return any(f.made for f in (self.parameters, *self.functions))

    def size(self, array: str) -> int:
        """Return how many numbers an array of the signature holds, hoisted constants included."""
        return len(self.arrays.get(array, ())) + (self.n_hoisted if array == "p" else 0)

    def function(self, name: str) -> ProgramFunction | None:
        return next((f for f in self.functions if f.name == name), None)
