"""Every operation in WebAssembly: the bits of its definition where it is arithmetic, else those of a C library."""

from __future__ import annotations

import math

import mpmath
import numpy as np
import pytest
from all_operations import (
    ROWS,
    SPECIAL,
    in_digits,
    is_regular,
    padded,
    points,
    program_of,
    value,
)
from native_code import bits
from wasm_module import WasmModel, needs_wasmtime

from mechc.compiler.graph import operations as ops
from mechc.compiler.graph.operation import Operation
from mechc.compiler.program import lower
from mechc.compiler.targets.wasm import operations
from mechc.web.kernels import KERNELS

EVERY = pytest.mark.parametrize("row", ROWS, ids=[row.name for row in ROWS])

PAIRED = (0.0, -0.0, 1.0, -1.0, 0.5, -2.5, 1e300, -5e-324, math.inf, -math.inf, math.nan)

ULP = 2.0**-52
OF_THE_LIBRARY = 2
"""Units in the last place by which musl's functions, of values that are no smaller than their arguments' rounding, are off."""


@pytest.fixture(scope="module")
def model() -> WasmModel:
    return WasmModel(lower(program_of(ROWS)), KERNELS[0])


@needs_wasmtime
@EVERY
def test_its_values(row: Operation, model: WasmModel) -> None:
    """At zeros of both signs, edges, infinities, not-a-number; at random points against 50 digits."""
    exact = row.code == ops.LOOKUP or operations.ROWS[row.code].called not in operations.LIBRARY
    for at in points(row, SPECIAL if row.arity == 1 else PAIRED, 20):
        state = [float(x) for x in padded(at)]
        (found,) = model.call(f"op_{row.name}", 0.0, state, [], [], [])
        expected = value(row, at)
        if exact or not math.isfinite(expected):
            assert bits(np.array([found])) == bits(np.array([expected])), at
        elif is_regular(row, at) and all(abs(x) < 1e3 for x in at):
            with mpmath.workdps(50):
                off = abs(mpmath.mpf(float(found)) - in_digits(row, at))
            assert off <= OF_THE_LIBRARY * ULP * max(abs(expected), 2.0**-1022), at
