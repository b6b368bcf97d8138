"""The curve that makes something stationary: the study of a model with a range of its independent variable."""

from __future__ import annotations

import itertools
import time
from collections.abc import Callable, Mapping
from typing import Annotated

import numpy as np
from msgspec import Struct

from ...case import find_experiment
from ...curves.conjugate_points import jumping, plain
from ...curves.deflation import further
from ...curves.diagnosis import begun, contradiction, ends_of, obstructions
from ...curves.divergence import GROWS, diverging
from ...curves.exchanged import drawn, exchange_told
from ...curves.found import CurveSolution
from ...curves.posed import Posed, pose
from ...curves.search import Failed, FoundCurve, search
from ...curves.starts import evaluate
from ...outcome import Outcome, SimulationError, worst
from ...problem import Problem
from ...settings import settable


class Stationary(Struct, frozen=True, kw_only=True):
    """Find the curve. ``values``: parameters, and constants as guesses of coordinates, in SI; ``all``: look for further ones."""

    experiment: str | None = None
    values: Mapping[str, float] = {}
    tolerance: Annotated[float | None, settable("Relative error of values (default: 1e-10).", "number")] = (
        None
    )
    all: Annotated[bool, settable("Look for further stationary curves by deflation.", "flag")] = False

    def solve(self, problem: Problem, exchanged: Callable[[], Problem] | None = None) -> Curves:
        """Find the curves, one for each combination of swept values. Raises SimulationError.

        ``exchanged`` makes the problem in which the independent variable is a coordinate, too, for slopes that are infinite.
        """
        experiment = find_experiment(problem, self.experiment)
        axes: dict[str, tuple[float, ...]] = {}
        for setting, values in experiment.sweeps if experiment else ():
            name = problem.parameters[setting.index].name
            if name not in self.values:
                axes[name] = values
        points, solutions = [], []
        for row in itertools.product(*axes.values()):
            point = dict(zip(axes, row, strict=True))
            given = {**self.values, **point}
            posed = pose(problem, given, experiment, self.tolerance)

            def other(given: Mapping[str, float] = given) -> Posed | None:
                if exchanged is None:
                    return None
                return pose(exchanged(), given, experiment, self.tolerance)

            points.append(point)
            with np.errstate(all="ignore"):  # what is not finite is looked at, and told
                solutions.append(self._found(posed, other))
        return Curves(tuple(points), tuple(solutions))

    def _found(self, posed: Posed, other: Callable[[], Posed | None]) -> tuple[CurveSolution, ...]:
        begun = time.perf_counter()
        if said := contradiction(posed):
            raise SimulationError(
                f"'{posed.problem.name}' has no curve: {said}",
                posed.problem.time.origin,
                help="give other ends, or leave one of the conditions out",
            )
        try:
            posed, first = _first(posed, other)
        except Failed as failed:
            raise SimulationError(
                f"no stationary curve of '{posed.problem.name}' was found: {failed.why}",
                posed.problem.time.origin,
                notes=(*_endless(posed, failed), *_reasons(posed), *failed.tried),
                help=f"give a guess that is nearer: 'coordinate {posed.problem.states[0].name} ~ f({posed.problem.time.name});', "
                "in an experiment too; or ask whether there is a smooth curve at all",
            ) from None
        _check_range(posed, first)
        answers = [first, *(further(posed, first) if self.all else ())]
        answers = [one for one in answers if _ascends(posed, one)]
        if plain(posed) and not posed.curve.action:
            for one in answers:
                ends = evaluate(one.discrete, one.solved, np.array([0.0, 1.0]), 0)[0]
                said = jumping(posed, (float(ends[0]), float(ends[1])), one.value)
                one.remarks += [said] if said else []
        seconds = time.perf_counter() - begun
        found = tuple(CurveSolution(posed, one, coarse=None, seconds=seconds) for one in answers)
        for one in found:
            _check_values(one)
            _check_assertions(one)
            _check_conditions(one)
            _check_corners(one)
        return found


def _ascends(posed: Posed, answer: FoundCurve) -> bool:
    low, high = posed.range(answer.solved.whole[: posed.curve.unknown])
    return low < high


def _check_range(posed: Posed, answer: FoundCurve) -> None:
    """Raise SimulationError where an end was found on the wrong side of the other one."""
    if _ascends(posed, answer):
        return
    over = posed.problem.time
    low, high = posed.range(answer.solved.whole[: posed.curve.unknown])
    unit = f" {over.unit}" if over.unit else ""
    raise SimulationError(
        f"no stationary curve of '{posed.problem.name}' was found but one whose range of '{over.name}' goes from {low:.6g}{unit} to "
        f"{high:.6g}{unit}: it must ascend",
        over.origin,
        help="give another guess of its end; or ask whether there is such a curve at all",
    )


def _endless(posed: Posed, failed: Failed) -> list[str]:
    """Return which integrals had no finite value along the curve that was followed last, or along the guess."""
    discrete, unknowns = failed.last or begun(posed, posed.guess, 2)
    which = "along the curve that was followed" if failed.last else "with the guess"
    ends = diverging(posed, discrete, unknowns, discrete._z(unknowns))
    return [f"{which} {GROWS.format(name, place)}" for name, place in ends.items()]


def _check_values(found: CurveSolution) -> None:
    """Raise SimulationError where what is stationary has no finite value; tell of outputs that have none."""
    ends = found.endless()
    for name, place in ends.items():
        if name in found.deciding:
            raise SimulationError(
                f"what is stationary has no finite value: {GROWS.format(name, place)}",
                found.problem.time.origin,
                help="leave the term out that decides nothing, or let the range end beside that place",
            )
        found.remarks.append(f"an output has no finite value: {GROWS.format(name, place)}")
        found.doubted = True


def _reasons(posed: Posed) -> list[str]:
    """Return what is known of why there is no curve, with one that jumps where that has a value."""
    jumps = plain(posed) and not posed.curve.action
    return list(obstructions(posed, jumping(posed, ends_of(posed), np.inf) if jumps else ""))


def _check_conditions(found: CurveSolution) -> None:
    """Doubt a curve that its own first integrals, or the conditions of Legendre and Weierstrass contradict."""
    if said := found.contradicted():
        found.remarks.append(said)
        found.doubted = True


def _check_corners(found: CurveSolution) -> None:
    """Doubt a curve with a corner where nothing of the model is: elements may have one at their borders, and choose its place."""
    places = found.corners()
    if places:
        over = found.problem.time
        unit = f" {over.unit}" if over.unit else ""
        found.remarks.append(
            f"the curve has a corner at {over.name} = {places[0]:.6g}{unit}, where nothing of the model is: its place is that of an "
            "element's border, and there may be no smooth curve that meets the conditions"
        )
        found.doubted = True


def _check_assertions(found: CurveSolution) -> None:
    """Raise SimulationError where an assertion of the model does not hold along a curve."""
    problem = found.problem
    for index, place in found.failed_assertions():
        assertion = problem.assertions[index]
        unit = f" {problem.time.unit}" if problem.time.unit else ""
        raise SimulationError(
            f"assertion failed at {problem.time.name} = {place:.6g}{unit}: {assertion.message}",
            assertion.origin,
            help="the curve was found, and this is said of it in the model",
        )


def _first(posed: Posed, other: Callable[[], Posed | None]) -> tuple[Posed, FoundCurve]:
    """Return the curve from the guess; where it is not found well, that with the variables exchanged. Raises Failed."""
    answer: FoundCurve | None = None
    failure: Failed | None = None
    try:
        answer = search(posed)
        if answer.reached:
            return posed, answer
        why = "no elements are small enough for the curve"
    except Failed as failed:
        failure, why = failed, failed.why
    swapped = other() if posed.curve.exchangeable else None
    if swapped is not None:
        last = failure.last if failure else answer and (answer.discrete, answer.solved)
        found = None
        for start in ([drawn(posed, *last)] if last else []) + [None]:
            try:
                found = search(swapped, start=start)
                break
            except Failed as failed:
                if start is None:
                    more = f"with '{posed.problem.time.name}' as a coordinate over a parameter, too: {failed.why}"
                    failure = failure and Failed(failure.why, (*failure.tried, more))
        if found is not None and (answer is None or found.value_error < answer.value_error):
            found.remarks.append(exchange_told(posed, swapped, found, why))
            return swapped, found
    if answer is None:
        assert failure is not None
        raise failure
    return posed, answer


class Curves(Struct, frozen=True, eq=False):
    """Curves side by side: ``points[k]`` are swept values by name, in SI; ``solutions[k]`` the curves found, the first from the
    guess."""

    points: tuple[Mapping[str, float], ...]
    solutions: tuple[tuple[CurveSolution, ...], ...]

    @property
    def outcome(self) -> Outcome:
        return worst(s.outcome for found in self.solutions for s in found)
