"""The curve that makes something stationary: the study of a model with a range of its independent variable."""

from __future__ import annotations

import itertools
import time
from collections.abc import Mapping
from typing import Annotated

from msgspec import Struct

from ..case import find_experiment
from ..curves.found import CurveSolution
from ..curves.further import further
from ..curves.posed import Posed, pose
from ..curves.search import Failed, search
from ..outcome import Outcome, SimulationError, worst
from ..problem import Problem
from ..settings import settable


class Stationary(Struct, frozen=True, kw_only=True):
    """Find the curve. ``values``: parameters, and constants as guesses of coordinates, in SI; ``all``: look for further ones."""

    experiment: str | None = None
    values: Mapping[str, float] = {}
    tolerance: Annotated[float | None, settable("Relative error of values; 1e-10 without it.", "number")] = (
        None
    )
    all: Annotated[bool, settable("Look for further stationary curves by deflation.", "flag")] = False

    def solve(self, problem: Problem) -> Curves:
        """Find the curves, one for each combination of swept values. Raises SimulationError."""
        experiment = find_experiment(problem, self.experiment)
        axes: dict[str, tuple[float, ...]] = {}
        for setting, values in experiment.sweeps if experiment else ():
            name = problem.parameters[setting.index].name
            if name not in self.values:
                axes[name] = values
        points, solutions = [], []
        before: CurveSolution | None = None
        for row in itertools.product(*axes.values()):
            point = dict(zip(axes, row, strict=True))
            posed = pose(problem, {**self.values, **point}, experiment, self.tolerance)
            found = self._found(posed, before)
            points.append(point)
            solutions.append(found)
            before = found[0]
        return Curves(tuple(points), tuple(solutions))

    def _found(self, posed: Posed, before: CurveSolution | None) -> tuple[CurveSolution, ...]:
        begun = time.perf_counter()
        try:
            first = search(posed)
        except Failed as failed:
            raise SimulationError(
                f"no stationary curve of '{posed.problem.name}' was found: {failed.why}",
                notes=failed.tried,
                help=f"give a guess that is nearer: 'coordinate {posed.problem.states[0].name} ~ f({posed.problem.time.name});', "
                "in an experiment too; or ask whether there is a smooth curve at all",
            ) from None
        answers = [first, *(further(posed, first) if self.all else ())]
        seconds = time.perf_counter() - begun
        return tuple(CurveSolution(posed, one, coarse=None, seconds=seconds) for one in answers)


class Curves(Struct, frozen=True, eq=False):
    """Curves side by side: ``points[k]`` are swept values by name, in SI; ``solutions[k]`` the curves found, the first from the
    guess."""

    points: tuple[Mapping[str, float], ...]
    solutions: tuple[tuple[CurveSolution, ...], ...]

    @property
    def outcome(self) -> Outcome:
        return worst(s.outcome for found in self.solutions for s in found)
