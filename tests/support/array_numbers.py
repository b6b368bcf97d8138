"""Nodes evaluated with NumPy arrays, by the forms that generated Python has for them."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from mechc.compiler.graph import operations as ops
from mechc.compiler.graph.evaluate import FLOATS, Numbers
from mechc.compiler.graph.table import Table
from mechc.compiler.targets.python_forms import FUNCTIONS


def _quietly(f: Callable[..., Any]) -> Callable[..., Any]:
    def quiet(*x: Any) -> Any:
        with np.errstate(all="ignore"):
            return f(*x)

    return quiet


def _interpolate_array(table: Table, x: Any, order: int) -> Any:
    return np.vectorize(lambda s: table(s, order), otypes=[float])(x)


_INFIX = {ops.DIV: np.true_divide, ops.MODULO: np.remainder, ops.AND: np.logical_and, ops.OR: np.logical_or}
_NAMED = {
    code: eval(f.array, {"np": np, f.name: f.own or getattr(math, f.name)})
    for code, f in FUNCTIONS.items()
    if code != ops.LOOKUP
}

ARRAYS = Numbers(
    float,
    {code: _quietly(f) for code, f in {**FLOATS.functions, **_INFIX, **_NAMED}.items()},
    _interpolate_array,
)
