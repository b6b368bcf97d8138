"""Nodes evaluated with NumPy arrays: an arithmetic of its own, to compare that of floats with."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from mechc.compiler.graph import operations as ops
from mechc.compiler.graph.evaluate import ARITHMETIC, Numbers
from mechc.compiler.graph.table import Table


def _quietly(f: Callable[..., Any]) -> Callable[..., Any]:
    def quiet(*x: Any) -> Any:
        with np.errstate(all="ignore"):
            return f(*x)

    return quiet


def _interpolate_array(table: Table, x: Any, order: int) -> Any:
    return np.vectorize(lambda s: table(s, order), otypes=[float])(x)


ARRAYS = Numbers(
    float,
    {
        code: _quietly(f)
        for code, f in (
            ARITHMETIC
            | {
                ops.DIV: np.true_divide,
                ops.SIN: np.sin,
                ops.COS: np.cos,
                ops.TAN: np.tan,
                ops.ASIN: np.arcsin,
                ops.ACOS: np.arccos,
                ops.ATAN: np.arctan,
                ops.SINH: np.sinh,
                ops.COSH: np.cosh,
                ops.TANH: np.tanh,
                ops.ASINH: np.arcsinh,
                ops.ACOSH: np.arccosh,
                ops.ATANH: np.arctanh,
                ops.EXP: np.exp,
                ops.LOG: np.log,
                ops.SQRT: np.sqrt,
                ops.ABS: np.abs,
                ops.SIGN: np.sign,
                ops.FLOOR: np.floor,
                ops.ATAN2: np.arctan2,
                ops.MINIMUM: np.minimum,
                ops.MAXIMUM: np.maximum,
                ops.MODULO: lambda a, b: a - b * np.floor(np.true_divide(a, b)),
                ops.POW: np.float_power,
                ops.AND: np.logical_and,
                ops.OR: np.logical_or,
                ops.NOT: np.logical_not,
                ops.SELECT: np.where,
            }
        ).items()
    },
    _interpolate_array,
)
