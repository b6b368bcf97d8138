"""Whether a motion depends on the time itself, so that only some periods are possible, or none."""

from __future__ import annotations

import numpy as np

from ...case import inputs_at
from ...native import contract
from ...problem import Array, ModelFunction
from ..runs.simulate import Plan


def depends_on_time(plan: Plan) -> bool:
    """Whether the rates at the start, or near it, or the indicators of what switches, are others at other times."""
    case, own = plan.case, list(plan.case.problem.own)

    def rates(t: float, y: Array, u: Array, z: Array, p: Array) -> Array:
        return case.functions.rhs(t, y, u, z, p)[own]

    functions: list[tuple[ModelFunction, Array]] = [(rates, case.z)]
    struct = case.functions.struct
    if struct.hybrid:
        hybrid = contract.HybridStruct.from_address(struct.hybrid)
        if hybrid.n_times or hybrid.n_clocks:
            return True
        if hybrid.indicators:
            functions.append((_compiled(hybrid.indicators, hybrid.n_switches + hybrid.n_rows), case.z))
    random = np.random.default_rng(3)
    for k in range(3):
        y = case.y0 + 0.1 * k * plan.nominal * random.standard_normal(case.y0.size)
        for function, z in functions:
            rows = []
            for share in (0.0, 0.137, 0.391, 0.734):
                t = case.begin + share * max(case.stop - case.begin, 1e-6)
                rows.append(function(t, y, inputs_at(case, t), z, case.p))
            found = np.array(rows)
            if not np.allclose(found, found[0], rtol=1e-12, atol=0.0, equal_nan=True):
                return True
    return False


def _compiled(address: int, size: int) -> ModelFunction:
    function = contract.MODEL_FUNCTION(address)

    def call(t: float, y: Array, u: Array, z: Array, p: Array) -> Array:
        out = np.empty(size)
        arrays = [np.ascontiguousarray(a) for a in (y, u, z, p)]
        function(t, *(a.ctypes.data for a in arrays), out.ctypes.data)
        return out

    return call
