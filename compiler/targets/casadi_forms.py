"""CasADi: one row for each operation, with the function that does it for symbols."""

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
    ops.ASIN: "asin",
    ops.ACOS: "acos",
    ops.ATAN: "atan",
    ops.SINH: "sinh",
    ops.COSH: "cosh",
    ops.TANH: "tanh",
    ops.ASINH: "asinh",
    ops.ACOSH: "acosh",
    ops.ATANH: "atanh",
    ops.EXP: "exp",
    ops.LOG: "log",
    ops.SQRT: "sqrt",
    ops.ABS: "fabs",
    ops.ATAN2: "atan2",
    ops.POW: "power",
    ops.FLOOR: "floor",
    ops.SIGN: "sign",
    ops.MINIMUM: "fmin",
    ops.MAXIMUM: "fmax",
    ops.SELECT: "if_else",
    ops.NOT: "logic_not",
    ops.AND: "logic_and",
    ops.OR: "logic_or",
}
"""Functions of the library."""

OWN: Final[Mapping[int, str]] = {ops.MODULO: "modulo", ops.LOOKUP: "lookup"}
"""Functions that ``casadi_module.py`` holds."""

ARITHMETIC: Final = (ops.ADD, ops.SUB, ops.MUL, ops.DIV, ops.NEG, ops.LESS, ops.LESS_EQUAL, ops.EQUAL)
"""Written with the signs of Python, which the library reads."""

_CONDITIONS: Final = {
    ops.SELECT: Form("if_else({}, {}, {})", ATOM, (0, 0, 0), False, (True, False, False)),
    ops.NOT: Form("logic_not({})", ATOM, (0,), True, (True,)),
    ops.AND: Form("logic_and({}, {})", ATOM, (0, 0), True, (True, True)),
    ops.OR: Form("logic_or({}, {})", ATOM, (0, 0), True, (True, True)),
}

FORMS: Final[Mapping[int, Form]] = {
    **{code: python_forms.FORMS[code] for code in ARITHMETIC},
    **{code: call(name, ops.OPERATIONS[code].arity) for code, name in {**FUNCTIONS, **OWN}.items()},
    **_CONDITIONS,
}

DIALECT: Final[Dialect] = replace(python_forms.DIALECT, forms=FORMS)
