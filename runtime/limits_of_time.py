"""What is asked of the times of a run before it begins."""

from __future__ import annotations

import math
from collections.abc import Mapping

from .outcome import SimulationError
from .problem import Problem

MOST_BYTES = 2e9
"""Of the table of a result."""


def check_finite(times: Mapping[str, float]) -> None:
    """Refuse times of an experiment that have no value, as where they are divided by a parameter that is zero."""
    for name, value in times.items():
        if not math.isfinite(value):
            raise SimulationError(
                f"'{name}' of the experiment is {value:g} at the values of this run",
                help=f'change the values that it is formed of, or give the time: --{name} "10 s" to the command, '
                f'{name}="10 s" in Python',
            )


def check_size(problem: Problem, start: float, stop: float, every: float | None, points: int) -> None:
    """Refuse results that fill the memory before the run begins."""
    quantities = (problem.states, problem.outputs, problem.inputs, problem.discretes)
    columns = 1 + sum(map(len, quantities))
    rows = (stop - start) / every + 1 if every and every > 0 else float(points)
    size = 8 * rows * columns
    if size <= MOST_BYTES:  # what is no number is refused elsewhere
        return
    if math.isfinite(size):
        unit = f" {problem.time.unit}" if problem.time.unit else ""
        least = (stop - start) * 8 * columns / MOST_BYTES
        what = f"an output spacing of {every:g}{unit} gives" if every else "this is"
        raise SimulationError(
            f"{what} {rows:.3g} rows of {columns} numbers, {size / 1e9:.3g} GB",
            help=f"at most {MOST_BYTES / 1e9:g} GB are kept: every = {least:.2g}{unit} or more; a file takes all of them, "
            'with --output motion.csv --streamed, or to="motion.csv" in Python',
        )
