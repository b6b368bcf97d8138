"""JAX: one row for each operation, with the function of ``jax.numpy`` that does it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from msgspec.structs import replace

from ..graph import operations as ops
from . import python_forms
from .expressions import ATOM, Dialect, Form, call

FUNCTIONS: Final[Mapping[int, str]] = {
    ops.SIN: "sin",
    ops.COS: "cos",
    ops.TAN: "tan",
    ops.ASIN: "arcsin",
    ops.ACOS: "arccos",
    ops.ATAN: "arctan",
    ops.SINH: "sinh",
    ops.COSH: "cosh",
    ops.TANH: "tanh",
    ops.ASINH: "arcsinh",
    ops.ACOSH: "arccosh",
    ops.ATANH: "arctanh",
    ops.EXP: "exp",
    ops.LOG: "log",
    ops.SQRT: "sqrt",
    ops.ABS: "abs",
    ops.ATAN2: "arctan2",
    ops.POW: "power",
    ops.FLOOR: "floor",
    ops.SIGN: "sign",
    ops.MINIMUM: "minimum",
    ops.MAXIMUM: "maximum",
    ops.MODULO: "mod",
    ops.SELECT: "where",
    ops.NOT: "logical_not",
    ops.AND: "logical_and",
    ops.OR: "logical_or",
}
"""Functions of the library."""

OWN: Final[Mapping[int, str]] = {ops.LOOKUP: "lookup"}
"""Functions that ``jax_module.py`` holds."""

ARITHMETIC: Final = (ops.ADD, ops.SUB, ops.MUL, ops.DIV, ops.NEG, ops.LESS, ops.LESS_EQUAL, ops.EQUAL)
"""Written with the signs of Python, which the library reads."""

_CONDITIONS: Final = {
    ops.SELECT: Form("where({}, {}, {})", ATOM, (0, 0, 0), False, (True, False, False)),
    ops.NOT: Form("logical_not({})", ATOM, (0,), True, (True,)),
    ops.AND: Form("logical_and({}, {})", ATOM, (0, 0), True, (True, True)),
    ops.OR: Form("logical_or({}, {})", ATOM, (0, 0), True, (True, True)),
}

FORMS: Final[Mapping[int, Form]] = {
    **{code: python_forms.FORMS[code] for code in ARITHMETIC},
    **{code: call(name, ops.OPERATIONS[code].arity) for code, name in {**FUNCTIONS, **OWN}.items()},
    **_CONDITIONS,
}

DIALECT: Final[Dialect] = replace(python_forms.DIALECT, forms=FORMS)
