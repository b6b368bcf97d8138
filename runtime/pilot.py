"""A cheap first run that tells how large the states become which nothing in the model gives a size to."""

from __future__ import annotations

import numpy as np
from msgspec.structs import replace

from .case import Case
from .functions import Functions
from .kernel_run import run_kernel
from .problem import Array, Problem
from .scipy_methods import PREFIX, run_scipy

TOLERANCE = 1e-6
POINTS = 200
MOST_STEPS = 5000
"""A motion that takes more steps at this tolerance is judged by its beginning."""


def largest_values(problem: Problem, functions: Functions, case: Case, nominal: Array) -> Array:
    """Give the largest size of each state [ny] in a run with provisional nominal values.

    Its tolerance is loose, but not too loose: the provisional values may be far too large.

    Of a run that fails, the part before. It multiplies and compares nothing of different units, so that a change of
    units changes it by their factors alone.
    """
    grid = np.linspace(case.begin, case.stop, POINTS) if case.stop > case.begin else case.grid
    pilot = replace(case, grid=grid, step=None)
    run, method = (run_kernel, "dop853") if functions.struct is not None else (run_scipy, PREFIX + "DOP853")
    done = run(
        problem,
        functions,
        pilot,
        method=method,
        tolerance=TOLERANCE,
        nominal=nominal,
        step=None,
        dense=False,
        max_steps=MOST_STEPS,
        progress=None,
    )
    if done.interrupted:
        raise KeyboardInterrupt
    if not done.y.size:
        return np.abs(case.y0)
    sizes: Array = np.nanmax(np.abs(np.where(np.isfinite(done.y), done.y, np.nan)), axis=0)
    return sizes
