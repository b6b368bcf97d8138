"""A motion after what happens once at its start (``initial()``): a period that comes later does not begin with it."""

from __future__ import annotations

import ctypes

import numpy as np
from msgspec.structs import replace

from ...integrate.kernel_run import run_kernel
from ...integrate.solver_options import SolverOptions
from ...native import contract
from ..runs.simulate import Plan

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
