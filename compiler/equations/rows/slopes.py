"""Matrices of what is affine, as numbers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from ...graph import Graph, Node
from ...graph.evaluate import FLOATS, Numbers, evaluate
from ...graph.operations import DIV

BLOCK = 64
"""Columns of a matrix that are evaluated at once."""

ARRAYS = Numbers(
    FLOATS.constant, {**FLOATS.functions, DIV: lambda a, b: a / b if b else float("nan")}, FLOATS.interpolate
)
"""Floats, and arrays of them in what is affine."""

Array = NDArray[np.float64]


def slopes(
    graph: Graph, outputs: Sequence[Node], symbols: Sequence[Node], values: Mapping[Node, float]
) -> Array:
    """Return the derivatives of outputs that are affine in the symbols: by unit changes, without new nodes."""
    known = dict.fromkeys(graph.support(*outputs), 0.0) | {n: float(x) for n, x in values.items()}
    base = evaluate(graph, outputs, known)
    found = np.zeros((len(outputs), len(symbols)))
    for begin in range(0, len(symbols), BLOCK):
        block = symbols[begin : begin + BLOCK]
        units = zip(block, np.eye(len(block)), strict=True)
        moved = evaluate(graph, outputs, known | {n: known.get(n, 0.0) + unit for n, unit in units}, ARRAYS)
        for i, (x, y) in enumerate(zip(moved, base, strict=True)):
            found[i, begin : begin + len(block)] = x - y
    return found
