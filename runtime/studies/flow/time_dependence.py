"""What of a motion depends on the time itself, so that only some periods are possible, or none; a motion after its initial events."""

from __future__ import annotations

import ctypes

import numpy as np
from msgspec.structs import replace

from ...case import inputs_at
from ...integrate.kernel_run import run_kernel
from ...integrate.solver import SolverOptions
from ...native import contract
from ...problem import Array, ModelFunction
from ..runs.simulate import Plan


def scheduled(plan: Plan) -> bool:
    """Whether something happens at set times, or at ticks that are counted from the start."""
    address = plan.case.functions.struct.hybrid
    if not address:
        return False
    hybrid = contract.HybridStruct.from_address(address)
    return bool(hybrid.n_times or hybrid.n_clocks)


def depends_on_time(plan: Plan) -> bool:
    """Whether the rates at the start, or near it, or the indicators of what switches, are others at other times."""
    case, own = plan.case, list(plan.case.problem.own)

    def rates(t: float, y: Array, u: Array, z: Array, p: Array) -> Array:
        return case.functions.rhs(t, y, u, z, p)[own]

    functions: list[tuple[ModelFunction, Array]] = [(rates, case.z)]
    struct = case.functions.struct
    if struct.hybrid:
        hybrid = contract.HybridStruct.from_address(struct.hybrid)
        if scheduled(plan):
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


LATER = 1e6
"""Ticks that count as over, so that no clock ticks at the start."""


def after_initial_events(plan: Plan) -> Plan:
    """Give a plan whose motion begins after what ``initial()`` makes act, and in which that acts no more; the same plan where
    nothing asks for it. Raises SimulationError where the start fails."""
    case, model = plan.case, plan.case.functions.struct
    if not model.hybrid:
        return plan
    hybrid = contract.HybridStruct.from_address(model.hybrid)
    if hybrid.initial < 0:
        return plan
    counts = [hybrid.clocks[2 * k + 1] for k in range(hybrid.n_clocks)]
    z = case.z.copy()
    z[counts] += LATER
    at_start = replace(case, z=z, grid=np.array([case.begin]), stop=case.begin)
    step = case.step if plan.method.fixed_step else None
    run = run_kernel(at_start, SolverOptions(plan.method.name, case.tolerance, plan.nominal, step))
    y, z = case.y0, case.z.copy()
    if run.happened is not None and run.happened.times.size:
        y, z = run.happened.after[-1, : y.size].copy(), run.happened.after[-1, y.size :].copy()
    z[counts] = case.z[counts]
    z[hybrid.initial] = 0.0
    later = contract.HybridStruct.from_buffer_copy(hybrid)
    later.initial = -1
    other = contract.ModelStruct.from_buffer_copy(model)
    other.quick, other.hybrid = model.quick, ctypes.addressof(later)
    other.kept = later  # as long as what points to it
    functions = replace(case.functions, struct=other)
    return replace(plan, case=replace(case, functions=functions, y0=y, wanted=y, z=z))
