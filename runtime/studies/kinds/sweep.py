"""Several runs: one for each combination of the values that an experiment sweeps."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping
from typing import Any, Generic, TypeVar

from msgspec import Struct
from msgspec.structs import replace

from ...case import part_of
from ...outcome import Outcome, SimulationError, Told, worst
from ...problem import Problem
from ...results.solution import Solution
from ..runs.simulate import Run, is_as_stated, run
from ..study import swept_axes

S_co = TypeVar("S_co", bound=Solution, covariant=True)


class Runs(Struct, Told, Generic[S_co], frozen=True):
    """Runs side by side: ``points[k]`` are the swept values by name, in SI, with which ``solutions[k]`` was made."""

    points: tuple[Mapping[str, float | bool | str], ...]
    solutions: tuple[S_co, ...]
    complete: bool = True
    """Whether all runs were made: Ctrl-C leaves those that were finished."""

    @property
    def runs(self) -> tuple[S_co, ...]:
        return self.solutions

    @property
    def outcome(self) -> Outcome:
        """How the worst run ended: an interrupted one ends the sweep."""
        return worst(solution.outcome for solution in self.solutions)

    def summary(self) -> dict[str, Any]:
        rows = zip(self.points, self.solutions, strict=True)
        return {"runs": [solution.summary() | {"sweep": dict(point)} for point, solution in rows]}


class Sweep(Run, frozen=True, kw_only=True):
    """Every combination of the swept values of an experiment; one run if it sweeps nothing.

    A value that the caller gives takes the place of its sweep. The answer is ``Runs``.
    """

    sweeps = True

    def solve(self, problem: Problem) -> Runs[Solution]:
        axes = swept_axes(problem, self)
        as_stated = is_as_stated(problem, self)
        points: list[dict[str, float | bool | str]] = []
        solutions: list[Solution] = []
        count = math.prod(len(axis) for axis in axes.values())
        if self.follower is not None and axes:
            raise SimulationError(
                f"the experiment sweeps {', '.join(axes)}: it is {count} runs, and a file that grows with a run holds one",
                help="give each one value, or write the files after the runs, without --streamed",
            )
        for k, row in enumerate(itertools.product(*axes.values())):
            point = dict(zip(axes, row, strict=True))
            progress = part_of(self.progress, k / count, (k + 1) / count)
            one = replace(self, values={**self.values, **point}, progress=progress)
            try:
                solution = run(
                    problem,
                    one,
                    as_stated=as_stated,
                    sensitivity=self.sensitivity,
                    condition=self.condition,
                )
                if self.constants:
                    from .constants import with_constants  # with scipy

                    solution = with_constants(solution, problem, one)
            except KeyboardInterrupt:  # between two runs, or pressed again during one
                if not solutions:
                    raise
                break
            points.append({**point})
            solutions.append(solution)
            if solution.outcome is Outcome.INTERRUPTED:
                break
        return Runs(tuple(points), tuple(solutions), len(solutions) == count)
