"""The C text of Taylor series in numbers of 106 bits: ``series_next`` for references, whose other functions have 113 bits.
``double_double.h`` of the kernel forms all orders by it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from fractions import Fraction
from typing import Final

from ..graph import operations as ops
from ..graph.operation import ATOM, CHOICE, COMPARISON, Form, call
from ..program import series as taylor
from ..program.model import SERIES_NEXT, Literal, Load, Operate, Program, Store
from ..verification import verified
from .expressions import Dialect, lines
from .literal import with_true_pi
from .model_data import EXPAND

MOST_OPERATIONS: Final = 1300
"""Longest function that is written so: compilers take some milliseconds for each operation."""
MANY_OPERATIONS: Final = 700
"""From here on operations are calls, which the compiler has done with in half the time."""
HEADER: Final = "double_double.h"

_ARGUMENTS: Final = "(mech_dd t, const mech_dd *y, const mech_dd *u, const mech_dd *z, const mech_dd *p, mech_dd *restrict out)"


def included(program: Program) -> str:
    """Return the line that includes the header."""
    function = program.function(SERIES_NEXT)
    many = function is not None and function.operations > MANY_OPERATIONS
    return ("#define MECH_DD_CALLED\n" if many else "") + f'#include "{HEADER}"\n'


def with_series(program: Program) -> Program | None:
    """Return the program with Taylor series that can be written so: they are short, and nothing but sums and products."""
    rhs = program.function("rhs")
    if rhs is None or rhs.operations > MOST_OPERATIONS:
        return None
    made = verified(taylor.with_series(program))
    function = made.function(SERIES_NEXT)
    if function is None or function.operations > MOST_OPERATIONS:
        return None
    (body,) = function.bodies
    known = all(type(s) in (Load, Literal, Store) or (type(s) is Operate and s.code in FORMS) for s in body)
    return made if known else None


def expansion(program: Program) -> Iterator[str]:
    """Yield the lines of ``series_next`` in these numbers, and of the function that forms all orders by it."""
    plan, function = program.series, program.function(SERIES_NEXT)
    assert plan is not None and function is not None
    (body,) = function.bodies
    loads = {(s.array, s.index) for s in body if type(s) is Load}
    names = {(a, i): "t" if a == "t" else f"{a}[{i}]" for a, i in loads}
    yield f"static void {SERIES_NEXT}{_ARGUMENTS}"
    yield "{"
    yield "    (void)t, (void)y, (void)u, (void)z, (void)p;"
    yield from (f"    {line}" for line in lines(body, _DIALECT, names))
    yield "}\n"
    sizes = (len(program.arrays["y"]), plan.n_slots, plan.n_kept, program.size("p"))
    yield f"MECH_DD_EXPANSION({EXPAND}, {SERIES_NEXT}, {', '.join(map(str, sizes))})\n"


def _literal(number: Fraction) -> tuple[str, int]:
    number = with_true_pi(number)
    high = float(number)
    return f"(mech_dd){{{high!r}, {float(number - Fraction(high))!r}}}", ATOM


def _lookup(table: int, order: int, argument: str) -> str:
    raise AssertionError(f"a series reads table {table}, order {order}, at {argument}")


def _declare(name: str, expression: str, condition: bool) -> str:
    return f"const {'int' if condition else 'mech_dd'} {name} = {expression};"


def _store(statement: Store, expression: str) -> str:
    return f"{statement.array}[{statement.index}] = {expression};"


FORMS: Final[Mapping[int, Form]] = {
    ops.ADD: call("mech_dd_add", 2),
    ops.SUB: call("mech_dd_sub", 2),
    ops.NEG: call("mech_dd_neg", 1),
    ops.MUL: call("mech_dd_mul", 2),
    ops.SELECT: Form("({} ? {} : {})", ATOM, (0, 0, 0), False, (True, False, False)),
}

_DIALECT: Final = Dialect(
    FORMS,
    _literal,
    _lookup,
    _declare,
    _store,
    as_condition=Form("{}.high != 0", COMPARISON, (ATOM,), True),
    as_number=Form("(mech_dd){{{}, 0}}", ATOM, (CHOICE,)),
)
