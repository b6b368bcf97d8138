"""Nominal values of a case: by the rules, and by a cheap first run where nothing in the model gives a state a size."""

from __future__ import annotations

import ctypes

import numpy as np
from msgspec.structs import replace

from ..case import Case
from ..native import kernel as native
from ..nominal import kernel_sizes
from ..problem import Array
from .kernel_run import run_kernel
from .solver import SolverOptions, kink_times, method_of, table_structs

TOLERANCE = 1e-6
MOST_STEPS = 5000
"""A motion that takes more steps at this tolerance is judged by its beginning."""


def nominal_of(case: Case) -> Array:
    """Give the nominal value [ny] of each state in a case, by the rules of the kernel (``start/nominal.c``)."""
    nominal, status = _by_kernel(case, "mech_nominal_values")
    if status:
        raise MemoryError("the kernel could not allocate what nominal values take")
    return nominal


def takes_pilot(case: Case) -> bool:
    """Tell whether nominal values need a first run."""
    return _by_kernel(case, "mech_nominal_at_start")[1] != 0


def _by_kernel(case: Case, function: str) -> tuple[Array, int]:
    """Call a function of the kernel that gives nominal values; return these and its status."""
    problem, model = case.problem, case.functions.struct
    kernel = native.kernel_for(model, bool(case.asked and case.asked.reproducible))
    tables, _alive = table_structs(case.tables)
    stated, ny = _stated(case), problem.ny
    stops = kink_times(case)
    numbers = np.concatenate([stated, stated, case.y0, case.z, case.p, stops])  # the first are overwritten
    at = numbers.ctypes.data
    options = native.OptionsStruct(
        method=method_of(kernel, "dop853")[0],
        t0=case.begin,
        dt_max=case.max_step if case.max_step > 0 else 1.0,
        n_tables=len(case.tables),
        tables=ctypes.addressof(tables),
        n_stops=len(stops),
        stops=at + 8 * (numbers.size - len(stops)) if stops else None,
        y0=at + 16 * ny,
        z=at + 24 * ny,
        p=at + 8 * (3 * ny + case.z.size),
    )
    status: int = getattr(kernel, function)(
        ctypes.addressof(model),
        ctypes.addressof(kernel_sizes(problem)[0]),
        ctypes.byref(options),
        case.stop,
        at + 8 * ny,
        at,
    )
    return numbers[:ny].copy(), status


def _stated(case: Case) -> Array:
    """Give the initial state [ny] without what its assembly has rounded."""
    if case.assembled is None:
        return case.y0
    from ..start.initial import unmoved

    return unmoved(case.problem, case.assembled, case.wanted)


def pilot_rows(case: Case, nominal: Array, count: int) -> Array:
    """Give [n, 1 + ny]: times and states at up to ``count`` points of a cheap first run with provisional nominal values."""
    grid = np.linspace(case.begin, case.stop, count) if case.stop > case.begin else case.grid
    reproducible = case.asked is not None and case.asked.reproducible
    options = SolverOptions("dop853", TOLERANCE, nominal, max_steps=MOST_STEPS, reproducible=reproducible)
    done = run_kernel(replace(case, grid=grid, step=None), options)
    if done.interrupted:
        raise KeyboardInterrupt
    return np.column_stack([done.t, done.y])
