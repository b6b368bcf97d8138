"""The C text of Taylor series in numbers of 106 bits: ``series_expand`` for references, whose other functions have 113 bits.

Time is scaled by a power of two, so that high orders stay within the range of doubles; two sweeps are made, a short one
that finds it and the whole one.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from fractions import Fraction
from typing import Final

from ..graph import operations as ops
from ..graph.operation import ATOM, CHOICE, COMPARISON, Form, call
from ..program import series as taylor
from ..program.model import Literal, Load, Operate, Program, Store
from ..program.series import NEXT, padded
from ..verification import verified
from .c_series import loaded, name_of, results, sides_of
from .expressions import Dialect, lines
from .literal import with_true_pi
from .model_data import EXPAND

MOST_OPERATIONS: Final = 1300
"""Longest function that is written so: compilers take some milliseconds for each operation."""
MANY_OPERATIONS: Final = 700
"""From here on operations are calls, which the compiler has done with in half the time."""
HEADER: Final = "double_double.h"

_HEAD: Final = f"""\
/* Coefficients of the state from order 2 up to a given one, formed for time in units of 2^scale. */
static void {EXPAND}_scaled(int order, int scale, const mech_real *kept, const mech_real *p, mech_real *restrict x,
                            double *restrict rows)
{{"""


def included(program: Program) -> str:
    """Return the line that includes the header."""
    function = program.function(NEXT)
    many = function is not None and function.operations > MANY_OPERATIONS
    return ("#define MECH_DD_CALLED\n" if many else "") + f'#include "{HEADER}"\n'


def with_series(program: Program) -> Program | None:
    """Return the program with Taylor series that can be written so: they are short, and nothing but sums and products."""
    rhs = program.function("rhs")
    if rhs is None or rhs.operations > MOST_OPERATIONS:
        return None
    made = verified(taylor.with_series(program))
    function = made.function(NEXT)
    if function is None or function.operations > MOST_OPERATIONS:
        return None
    (body,) = function.bodies
    known = all(type(s) in (Load, Literal, Store) or (type(s) is Operate and s.code in FORMS) for s in body)
    return made if known else None


def expansion(program: Program) -> Iterator[str]:
    """Yield the lines of the functions that take the place of ``series_next``."""
    plan, function = program.series, program.function(NEXT)
    assert plan is not None and function is not None
    (body,) = function.bodies
    ny, slots = len(program.arrays["y"]), padded(plan.n_slots)
    stored = {s.index: s.value for s in body if type(s) is Store}
    first, second = sides_of(body, stored, plan.n_slots, ny)
    names = {("y", i): f"x{i}" for i in range(ny)} | {("u", k): f"sums[{k}]" for k in range(plan.n_slots)}
    yield _HEAD
    yield f"    enum {{ STATES = {padded(ny)}, SLOTS = {slots} }};"
    for array, name, count in (("z", "kept", plan.n_kept), ("p", "p", program.size("p"))):
        used = loaded(body, array)
        names |= {(array, i): f"{name}_dd[{i}]" for i in used}
        if not used:
            yield f"    (void){name};"
            continue
        yield f"    mech_dd {name}_dd[{count}];"
        yield f"    for (int i = 0; i < {count}; i++) {name}_dd[i] = mech_dd_of({name}[i]);"
    yield "    const double unit = mech_dd_power(scale);"
    yield "    mech_real back = (mech_real)1 / (mech_real)unit;"
    for i in range(ny):
        yield f"    mech_dd x{i} = mech_dd_scaled(mech_dd_of(x[STATES + {i}]), unit);"
    yield f"    mech_dd sums[{slots}];" if slots else "    (void)rows;"
    yield "    for (int k = 1; k < order; k++) {"
    if slots:
        yield "        mech_dd_sums(k, rows, SLOTS, sums);"
    for array, index, name, value in (
        ("t", 0, "order_k", "{k, 0}"),
        ("u", slots, "over", "mech_dd_share(1, k)"),
        ("u", slots + 1, "time", "{k == 1 ? unit : 0, 0}"),
    ):
        if index in loaded(body, array):
            names[array, index] = name
            yield f"        const mech_dd {name} = {value};"
    for line in lines(results(body, stored, ny, {*first, *second}), _DIALECT, names):
        yield f"        {line}"
    for part, sides in ((0, first), (2, second)):
        for slot, name in enumerate(map(name_of, sides)):
            at = f"(4 * k + {part}) * SLOTS + {slot}"
            yield f"        rows[{at}] = {name}.high, rows[{at} + SLOTS] = {name}.low;"
        for slot in range(len(sides), slots):
            at = f"(4 * k + {part}) * SLOTS + {slot}"
            yield f"        rows[{at}] = rows[{at} + SLOTS] = 0;"
    yield "        const mech_dd share = mech_dd_share(unit, k + 1);"
    yield "        back /= (mech_real)unit;"
    for i in range(ny):
        yield f"        x{i} = mech_dd_mul(rate{i}, share);"
        yield f"        x[STATES * (k + 1) + {i}] = mech_dd_value(x{i}, scale, back);"
    yield "    }"
    yield "}\n"
    yield from _expand(ny)


def _expand(ny: int) -> Iterator[str]:
    yield "/* Coefficients of the state from order 2 up to a given one. */"
    yield f"static void {EXPAND}(int order, const mech_real *kept, const mech_real *p, mech_real *restrict x,"
    yield "                          mech_real *restrict rows)"
    yield "{"
    yield "    for (int pass = 0, scale = 0; pass < 2; pass++) {"
    yield f"        {EXPAND}_scaled(pass ? order : MECH_DD_PILOT, scale, kept, p, x, (double *)rows);"
    yield f"        scale = mech_dd_scale(x, {ny}, {padded(ny)});"
    yield "    }"
    yield "}\n"


def _literal(number: Fraction) -> tuple[str, int]:
    number = with_true_pi(number)
    high = float(number)
    return f"(mech_dd){{{high!r}, {float(number - Fraction(high))!r}}}", ATOM


def _lookup(table: int, order: int, argument: str) -> str:
    raise AssertionError(f"a series reads table {table}, order {order}, at {argument}")


def _declare(name: str, expression: str, condition: bool) -> str:
    return f"const {'int' if condition else 'mech_dd'} {name} = {expression};"


def _store(statement: Store, expression: str) -> str:
    return f"const mech_dd {statement.array}{statement.index} = {expression};"


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
