"""What is asked of the times of a run before it begins."""

from __future__ import annotations

import math
from collections.abc import Mapping

from msgspec import Struct

from .outcome import SimulationError, time_text
from .problem import Array, Problem

MOST_BYTES = 2e9
"""Of the table of a result."""


DEFAULT_TOLERANCE = 1e-8


def no_stop(problem: Problem) -> SimulationError:
    """Return what is said where neither the model nor the caller says when a run stops."""
    return SimulationError(
        f"'{problem.name}' does not say when to stop",
        help='give a stop time: experiment(stop = 10 s); in the model, --stop "10 s" to the command, '
        'or stop="10 s" in Python',
    )


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
    if size <= MOST_BYTES:  # what is not a number is refused elsewhere
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


def check_stated_stop(problem: Problem, start: float, stop: float) -> None:
    """Refuse a start that is given after the stop of the experiment."""
    if stop < start:
        raise SimulationError(
            f"the experiment stops at {time_text(problem, stop)}, before the start at {time_text(problem, start)}",
            help='give the stop time as well: --stop "20 s" to the command, stop="20 s" in Python',
        )


LOOKS = 20_000
"""Instants, at least, at which the whole of a run is looked at for what steps may pass over."""

PLACES_IN_A_STEP = 12
"""Instants of these that lie in the longest step which shows by itself what is narrow."""


class TimeSpan(Struct, frozen=True):
    """The times of a case, and what bounds its steps."""

    begin: float
    stop: float
    grid: Array
    every: float | None
    tolerance: float
    step: float | None
    max_step: float

    @property
    def apart(self) -> float:
        """Longest time between two looks at what may be narrow."""
        return (self.stop - self.begin) / LOOKS
