"""Python: one row for each operation, with the function that does it for numbers and for arrays."""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction
from typing import Final

from msgspec import Struct

from ..graph import operations as ops
from ..program.model import Store
from .expressions import (
    ATOM,
    BITWISE,
    COMPARISON,
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

_BOTH: Final = (True, True)


class Named(Struct, frozen=True):
    """A function by which an operation is called in the text: its name, and where it comes from.

    ``own``: it stands in ``scalar_functions.py``, not in ``math``. ``array``: the NumPy form. ``condition``:
    it yields a truth value.
    """

    name: str
    arity: int
    array: str
    own: bool = False
    condition: bool = False


FUNCTIONS: Final[Mapping[int, Named]] = {
    ops.SIN: Named("sin", 1, "np.sin"),
    ops.COS: Named("cos", 1, "np.cos"),
    ops.TAN: Named("tan", 1, "np.tan"),
    ops.ASIN: Named("asin", 1, "np.arcsin"),
    ops.ACOS: Named("acos", 1, "np.arccos"),
    ops.ATAN: Named("atan", 1, "np.arctan"),
    ops.SINH: Named("sinh", 1, "np.sinh"),
    ops.COSH: Named("cosh", 1, "np.cosh"),
    ops.TANH: Named("tanh", 1, "np.tanh"),
    ops.ASINH: Named("asinh", 1, "np.arcsinh"),
    ops.ACOSH: Named("acosh", 1, "np.arccosh"),
    ops.ATANH: Named("atanh", 1, "np.arctanh"),
    ops.EXP: Named("exp", 1, "np.exp"),
    ops.LOG: Named("log", 1, "np.log"),
    ops.SQRT: Named("sqrt", 1, "np.sqrt"),
    ops.ATAN2: Named("atan2", 2, "np.arctan2"),
    ops.POW: Named("pow", 2, "np.power"),
    ops.FLOOR: Named("floor", 1, "np.floor", own=True),
    ops.SIGN: Named("sign", 1, "np.sign", own=True),
    ops.MINIMUM: Named("minimum", 2, "np.minimum", own=True),
    ops.MAXIMUM: Named("maximum", 2, "np.maximum", own=True),
    ops.SELECT: Named("select", 3, "np.where", own=True),
    ops.NOT: Named("negation", 1, "np.logical_not", own=True, condition=True),
    ops.LOOKUP: Named("lookup", 3, "np.vectorize(lookup, otypes=[float], excluded=[0, 1])", own=True),
}

FORMS: Final[Mapping[int, Form]] = {
    ops.ADD: infix("+", SUM),
    ops.SUB: infix("-", SUM),
    ops.MUL: infix("*", PRODUCT),
    ops.DIV: infix("/", PRODUCT),
    ops.MODULO: infix("%", PRODUCT),
    ops.NEG: Form("-{}", UNARY, (UNARY + 1,)),
    ops.ABS: call("abs", 1),
    ops.LESS: infix("<", COMPARISON, condition=True),
    ops.LESS_EQUAL: infix("<=", COMPARISON, condition=True),
    ops.EQUAL: infix("==", COMPARISON, condition=True),
    # these hold for arrays of truth values as well
    ops.AND: Form("{} & {}", BITWISE, (BITWISE + 1, BITWISE + 1), True, _BOTH),
    ops.OR: Form("{} | {}", BITWISE, (BITWISE + 1, BITWISE + 1), True, _BOTH),
    **{code: call(f.name, f.arity) for code, f in FUNCTIONS.items() if code not in (ops.SELECT, ops.NOT)},
    ops.SELECT: Form("select({}, {}, {})", ATOM, (0, 0, 0), False, (True, False, False)),
    ops.NOT: Form("negation({})", ATOM, (0,), True, (True,)),
}


def literal(number: Fraction) -> tuple[str, int]:
    """Return a constant as Python text, and how strongly it binds."""
    c = constant(number)
    match c.form:
        case LiteralForm.DOUBLE | LiteralForm.DECIMAL:
            text = repr(float(c.text))
        case LiteralForm.RATIO:
            return f"{c.text} / {c.divisor}", PRODUCT
        case LiteralForm.PI:
            return multiple_of_pi(c, "pi")
    return text, UNARY if text[0] == "-" else ATOM


def _declare(name: str, expression: str, condition: bool) -> str:
    return f"{name} = {expression}"


def _store(statement: Store, expression: str) -> str:
    line = f"{statement.array}[{statement.index}] = {expression}"
    return f"if not given[{statement.index}]:\n        {line}" if statement.guarded else line


def _lookup(table: int, order: int, argument: str) -> str:
    return f"lookup(TABLE_{table}, {order}, {argument})"


DIALECT: Final = Dialect(
    FORMS,
    literal,
    _lookup,
    _declare,
    _store,
    as_condition=Form("{} != 0.0", COMPARISON, (COMPARISON + 1,), True),
    as_number=Form("1.0 * {}", PRODUCT, (PRODUCT + 1,)),
)
