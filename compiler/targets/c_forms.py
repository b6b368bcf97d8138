"""C: one row for each operation, and the functions that the C library does not have."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from fractions import Fraction
from typing import Final

from msgspec.structs import replace

from ..graph import operations as ops
from ..program.model import Store
from .expressions import (
    ATOM,
    CHOICE,
    COMPARISON,
    LOGIC,
    PRODUCT,
    SUM,
    UNARY,
    Dialect,
    Form,
    call,
    infix,
    multiple_of_pi,
)
from .literal import Form as LiteralForm
from .literal import constant
from .sincos_batch import WIDTH

_BOTH: Final = (True, True)

FORMS: Final[Mapping[int, Form]] = {
    ops.ADD: infix("+", SUM),
    ops.SUB: infix("-", SUM),
    ops.MUL: infix("*", PRODUCT),
    ops.DIV: infix("/", PRODUCT),
    ops.NEG: Form("-{}", UNARY, (UNARY + 1,)),
    ops.SIN: call("sin", 1),
    ops.COS: call("cos", 1),
    ops.TAN: call("tan", 1),
    ops.ASIN: call("asin", 1),
    ops.ACOS: call("acos", 1),
    ops.ATAN: call("atan", 1),
    ops.SINH: call("sinh", 1),
    ops.COSH: call("cosh", 1),
    ops.TANH: call("tanh", 1),
    ops.ASINH: call("asinh", 1),
    ops.ACOSH: call("acosh", 1),
    ops.ATANH: call("atanh", 1),
    ops.EXP: call("exp", 1),
    ops.LOG: call("log", 1),
    ops.SQRT: call("sqrt", 1),
    ops.ABS: call("fabs", 1),
    ops.SIGN: call("sign", 1),
    ops.FLOOR: call("floor", 1),
    ops.ATAN2: call("atan2", 2),
    ops.MINIMUM: call("minimum", 2),
    ops.MAXIMUM: call("maximum", 2),
    ops.MODULO: call("modulo", 2),
    ops.POW: call("pow", 2),
    ops.LESS: infix("<", COMPARISON, condition=True),
    ops.LESS_EQUAL: infix("<=", COMPARISON, condition=True),
    ops.EQUAL: infix("==", COMPARISON, condition=True),
    ops.AND: Form("{} && {}", LOGIC, (LOGIC + 1, LOGIC + 1), True, _BOTH),
    ops.OR: Form("{} || {}", LOGIC, (LOGIC + 1, LOGIC + 1), True, _BOTH),
    ops.NOT: Form("!{}", UNARY, (UNARY + 1,), True, (True,)),
    ops.SELECT: Form("{} ? {} : {}", CHOICE, (LOGIC, CHOICE + 1, CHOICE + 1), False, (True, False, False)),
}

OWN: Final[Mapping[int, str]] = {
    ops.SIGN: """\
static inline mech_real sign(mech_real x)
{
    return x > 0 ? 1 : x < 0 ? -1 : x;
}
""",
    ops.MINIMUM: """\
static inline mech_real minimum(mech_real a, mech_real b)
{
    return a < b || a != a ? a : b;
}
""",
    ops.MAXIMUM: """\
static inline mech_real maximum(mech_real a, mech_real b)
{
    return a > b || a != a ? a : b;
}
""",
    ops.MODULO: """\
/* a - b floor(a/b): takes the sign of b. */
static inline mech_real modulo(mech_real a, mech_real b)
{
    const mech_real r = fmod(a, b);
    return r != 0 && (r < 0) != (b < 0) ? r + b : r == 0 ? copysign(r, b) : r;
}
""",
    ops.LOOKUP: """\
/* Value (order 0) or derivative of the cubic through points {x, value, slope}; straight beyond the ends. */
static mech_real lookup(const mech_real (*points)[3], int n, int order, mech_real x)
{
    int low = 0, high = n - 1;
    if (x != x)
        return x;
    if (x < points[0][0] || x >= points[high][0]) {
        const mech_real *end = points[x < points[0][0] ? 0 : high];
        return order == 0 ? end[1] + end[2] * (x - end[0]) : order == 1 ? end[2] : 0;
    }
    while (high - low > 1) {
        const int middle = (low + high) / 2;
        if (points[middle][0] <= x)
            low = middle;
        else
            high = middle;
    }
    const mech_real *a = points[low], *b = points[high];
    const mech_real h = b[0] - a[0], s = x - a[0];
    const mech_real secant = (b[1] - a[1]) / h;
    const mech_real c2 = (3 * secant - 2 * a[2] - b[2]) / h;
    const mech_real c3 = (a[2] + b[2] - 2 * secant) / (h * h);
    switch (order) {
    case 0:
        return a[1] + s * (a[2] + s * (c2 + s * c3));
    case 1:
        return a[2] + s * (2 * c2 + s * 3 * c3);
    case 2:
        return 2 * c2 + 6 * c3 * s;
    default:
        return 6 * c3;
    }
}
""",
}
"""Functions to be written into a file that uses them."""

CALLED: Final[Mapping[int, str]] = {
    code: form.template.split("(")[0] for code, form in FORMS.items() if form.binds == ATOM
}
"""The functions that operations are written as."""

LIBRARY: Final[Mapping[int, str]] = {code: name for code, name in CALLED.items() if code not in OWN}
"""Functions of the C library, which have other names in higher precision."""

NEEDED_BY_OWN: Final[Mapping[int, tuple[str, ...]]] = {ops.MODULO: ("fmod", "copysign")}


def literal(number: Fraction) -> tuple[str, int]:
    """Return a constant as C text, and how strongly it binds."""
    c = constant(number)
    match c.form:
        case LiteralForm.DOUBLE:
            text = c.text
        case LiteralForm.DECIMAL:
            text = f"-real({c.text[1:]})" if c.text[0] == "-" else f"real({c.text})"
        case LiteralForm.RATIO:
            text = f"ratio({c.text}, {c.divisor})"
        case LiteralForm.PI:
            return multiple_of_pi(c, "PI")
    return text, UNARY if text[0] == "-" else ATOM


def _declare(name: str, expression: str, condition: bool) -> str:
    return f"const {'int' if condition else 'mech_real'} {name} = {expression};"


def _store(statement: Store, expression: str) -> str:
    line = f"{statement.array}[{statement.index}] = {expression};"
    return f"if (!set[{statement.index}]) {line}" if statement.guarded else line


def _lookup(table: int, order: int, argument: str) -> str:
    return f"lookup(table_{table}, n_table_{table}, {order}, {argument})"


DIALECT: Final = Dialect(
    FORMS,
    literal,
    _lookup,
    _declare,
    _store,
    as_condition=Form("{} != 0", COMPARISON, (COMPARISON + 1,), True),
    as_number=Form("(mech_real){}", UNARY, (UNARY + 1,)),
)


def _turns(name: str, angles: Sequence[str]) -> Iterator[str]:
    """Yield the call of ``sincos_batch.h``; a group that is not full repeats its last angle."""
    yield f"mech_real {name}[{2 * WIDTH}];"
    filled = [*angles, *[angles[-1]] * (WIDTH - len(angles))]
    yield f"mech_turns({name}, {', '.join(filled)});"


TURNING: Final = replace(DIALECT, turns=_turns)
"""With sines and cosines of several angles at once."""

TURNS_INCLUDED: Final = '#include "sincos_batch.h"\n'
