"""Nominal values of a case: by the rules, and by a cheap first run where nothing in the model gives a state a size."""

from __future__ import annotations

import ctypes
from collections.abc import Callable

import numpy as np
from msgspec.structs import replace

from ..case import Case, inputs_at
from ..native import kernel as native
from ..nominal import nominal_values, sizes_of
from ..problem import Array
from .kernel_run import run_kernel
from .kernel_sizes import kernel_sizes
from .scipy_methods import PREFIX, run_scipy
from .solver import table_structs
from .solver_options import SolverOptions
from .trajectory import Trajectory

TOLERANCE = 1e-6
POINTS = 200
MOST_STEPS = 5000
"""A motion that takes more steps at this tolerance is judged by its beginning."""


def nominal_of(case: Case) -> Array:
    """Give the nominal value [ny] of each state in a case (nominal.py).

    What switches needs the kernel: without it such a case makes no first run. The kernel knows the rules (start/nominal.c); they
    are gone through here where it cannot, and where a first run has to tell more.
    """
    found = _by_kernel(case) if case.functions.struct is not None else None
    if found is not None:
        return found
    runs = case.functions.struct is not None or case.problem.hybrid is None
    return _nominal(case, (lambda provisional: largest_values(case, provisional)) if runs else None)


def _by_kernel(case: Case) -> Array | None:
    """Give the nominal values as the kernel's rules have them; None where these need a first run."""
    problem, model = case.problem, case.functions.struct
    assert model is not None
    tables, _alive = table_structs(case.tables)
    stated, ny = _stated(case), problem.ny
    numbers = np.concatenate([stated, stated, case.y0, case.z, case.p])  # the first are overwritten
    at = numbers.ctypes.data
    options = native.OptionsStruct(
        t0=case.begin,
        n_tables=len(case.tables),
        tables=ctypes.addressof(tables),
        y0=at + 16 * ny,
        z=at + 24 * ny,
        p=at + 8 * (3 * ny + case.z.size),
    )
    kernel = native.kernel_for(model, bool(case.asked and case.asked.reproducible))
    more = kernel.mech_nominal_at_start(
        ctypes.addressof(model),
        ctypes.addressof(kernel_sizes(problem)[0]),
        ctypes.byref(options),
        case.stop,
        at + 8 * ny,
        at,
    )
    return numbers[:ny].copy() if more == 0 else None


def takes_pilot(case: Case) -> bool:
    """Tell whether nominal values need a first run."""
    asked = []

    def pilot(provisional: Array) -> Array:
        asked.append(True)
        return np.ones_like(provisional)

    _nominal(case, pilot)
    return bool(asked)


def _nominal(case: Case, pilot: Callable[[Array], Array] | None) -> Array:
    problem, functions = case.problem, case.functions
    u = inputs_at(case, case.begin)
    rates = functions.rhs(case.begin, case.y0, u, case.z, case.p)
    outputs = functions.outputs(case.begin, case.y0, u, case.z, case.p) if functions.outputs else np.empty(0)
    energies = [float(v) for v, q in zip(outputs, problem.outputs, strict=True) if q.kind == "energy"]
    return nominal_values(
        sizes_of(problem),
        _stated(case),
        rates,
        case.p,
        energies,
        case.stop - case.begin,
        pilot,
    )


def _stated(case: Case) -> Array:
    """Give the initial state [ny] without what its assembly has rounded."""
    if case.assembled is None:
        return case.y0
    from ..start.initial import unmoved

    return unmoved(case.problem, case.assembled, case.wanted)


def largest_values(case: Case, nominal: Array) -> Array:
    """Give the largest size of each state [ny] in a run with provisional nominal values.

    Its tolerance is loose, but not too loose: the provisional values may be far too large.

    Of a run that fails, the part before. It multiplies and compares nothing of different units, so that a change of
    units changes it by their factors alone.
    """
    done = _pilot(case, nominal, POINTS)
    if not done.y.size:
        return np.abs(case.y0)
    sizes: Array = np.nanmax(np.abs(np.where(np.isfinite(done.y), done.y, np.nan)), axis=0)
    return sizes


def pilot_rows(case: Case, nominal: Array, count: int) -> Array:
    """Give [n, 1 + ny]: times and states at up to ``count`` points of such a run."""
    done = _pilot(case, nominal, count)
    return np.column_stack([done.t, done.y])


def _pilot(case: Case, nominal: Array, count: int) -> Trajectory:
    grid = np.linspace(case.begin, case.stop, count) if case.stop > case.begin else case.grid
    pilot = replace(case, grid=grid, step=None)
    run, method = (
        (run_kernel, "dop853") if case.functions.struct is not None else (run_scipy, PREFIX + "DOP853")
    )
    reproducible = case.asked is not None and case.asked.reproducible
    options = SolverOptions(method, TOLERANCE, nominal, max_steps=MOST_STEPS, reproducible=reproducible)
    done = run(pilot, options)
    if done.interrupted:
        raise KeyboardInterrupt
    return done
