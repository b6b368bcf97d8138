"""What is asked of the times of a run before it begins."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING

from msgspec import Struct
from msgspec.structs import replace

from .driving_inputs import begin_of
from .once import once
from .outcome import SimulationError, time_text
from .output_times import output_times
from .problem import Array, Problem
from .rows import AT_ONCE

if TYPE_CHECKING:
    from .case import SimulationOptions

DEFAULT_TOLERANCE = 1e-8
LOWEST_TOLERANCE = 1e-14

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


class TimeSpan(Struct, frozen=True):
    """The times of a case, and what bounds its steps."""

    begin: float
    stop: float
    grid: Array
    every: float | None
    tolerance: float
    step: float | None
    max_step: float


@once
def _spans(problem: Problem) -> dict[tuple[object, ...], TimeSpan]:
    """The times of the last run."""
    return {}


def time_span(problem: Problem, options: SimulationOptions, numbers: Mapping[str, float]) -> TimeSpan:
    """Check times, tolerance and steps, or take those of the run before, if it asked for the same."""
    start = (numbers.get("start") if options.start is None else options.start) or 0.0
    begin = begin_of(problem, options.inputs, start) if options.begin is None else options.begin
    known, own = _spans(problem), (begin, options.start, options.stop, options.every, options.points)
    asked = (*own, options.tolerance, options.step, options.max_step, *numbers.items())
    found = known.get(asked) if options.follower is None else None
    if found is not None:
        return replace(found, grid=found.grid.copy())
    made = _checked_span(problem, options, numbers, start, begin)
    if options.follower is None and made.grid.size <= AT_ONCE:
        known.clear()
        known[asked] = replace(made, grid=made.grid.copy())
    return made


def _checked_span(
    problem: Problem, options: SimulationOptions, numbers: Mapping[str, float], start: float, begin: float
) -> TimeSpan:
    """Check times, tolerance and steps. ``numbers`` are those of the experiment, behind those of the caller."""

    def number(name: str, given: float | None) -> float | None:
        return numbers.get(name) if given is None else float(given)

    every = number("every", options.every)
    stop = number("stop", options.stop)
    if stop is None:
        raise SimulationError(
            f"'{problem.name}' does not say when to stop",
            help='give a stop time: experiment(stop = 10 s); in the model, --stop "10 s" to the command, '
            'or stop="10 s" in Python',
        )
    check_finite({n: v for n, v in (("start", start), ("stop", stop)) if getattr(options, n) is None})
    if stop < start and options.start is not None and options.stop is None:
        raise SimulationError(
            f"the experiment stops at {time_text(problem, stop)}, before the start at {time_text(problem, start)}",
            help='give the stop time as well: --stop "20 s" to the command, stop="20 s" in Python',
        )
    if options.follower is None:
        check_size(problem, start, stop, every, options.points)
    grid = output_times(start, stop, every, options.points, options.storage)
    tolerance = number("tolerance", options.tolerance)
    tolerance = DEFAULT_TOLERANCE if tolerance is None else tolerance
    if not LOWEST_TOLERANCE <= tolerance < 1:
        raise SimulationError(f"the tolerance lies between {LOWEST_TOLERANCE:g} and 1, it is {tolerance:g}")
    step = number("step", options.step)
    if step is not None and not (math.isfinite(step) and step > 0):
        raise SimulationError(f"the step is positive, it is {step:g}")
    max_step = options.max_step if options.max_step is not None else (stop - begin) / 10
    if not max_step > 0 and stop > begin:
        raise SimulationError(f"the largest step is positive, it is {max_step:g}")
    return TimeSpan(begin, stop, grid, every, tolerance, step, max_step)
