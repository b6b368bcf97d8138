"""Averages over a long motion: of kinetic and potential energy, and of quantities by name (Clausius 1870).

An average over a time T is off by something like 1/T, as T is not a whole number of periods. With the weight
exp(-1/(s (1 - s))) for s = t/T, which vanishes with all derivatives at both ends, the averages of a quasi-periodic motion
converge faster than any power of 1/T (Das, Saiki, Sander, Yorke, Nonlinearity 30, 2017); those of a chaotic
one as slowly as plain means.
"""

from __future__ import annotations

from typing import Annotated

import numpy as np

from ...outcome import ENDED, Outcome, SimulationError
from ...problem import Array, Problem
from ...results.solution import Solution
from ...settings import settable
from ..findings import Curve, Findings, Panel, Value
from ..runs.simulate import run_at_two_tolerances
from ..study import Study

KINETIC, POTENTIAL = "energy.kinetic", "energy.potential"
SAMPLES_A_STEP, FEWEST, MOST = 8, 4_000, 400_000
"""Samples of the average: so many in a step of the method, within bounds."""
PARTS = ((0.0, 1.0), (0.0, 0.9), (0.1, 1.0), (0.0, 2 / 3), (1 / 3, 1.0))
"""Parts of the motion whose averages are compared: the whole first."""
SMALL = 1e-9
"""Of the largest potential energy: an average below that gives no ratio."""


class Virial(Study, frozen=True, kw_only=True):
    """Averages of the energies and of the quantities ``of``. For a bounded motion in a potential that is homogeneous of
    degree n, twice the kinetic energy is n times the potential one on average."""

    of_past = True
    of: Annotated[tuple[str, ...], settable("Quantities to average besides the energies.", "names")] = ()

    def solve(self, problem: Problem) -> Findings:
        """Run the model at two tolerances and average the tighter motion.

        Raises SimulationError for models that have neither energies nor names.
        """
        solution, first = run_at_two_tolerances(problem, self)
        names = [name for name in (KINETIC, POTENTIAL, *self.of) if name in solution]
        if not names:
            raise SimulationError(
                f"'{problem.name}' has nothing to average",
                help="it has no energies; name quantities: --of x,y, or of=('x', 'y')",
            )
        finished = solution.outcome in ENDED
        told = first if first.outcome is Outcome.DOUBTFUL and finished else solution
        averages = averaged(solution, names, first) if finished and len(solution.time) > 1 else []
        found = {value.name: value for value in averages}
        ratio = _ratio(found, float(np.abs(solution[POTENTIAL]).max()) if POTENTIAL in solution else 0.0)
        return Findings(
            study="virial",
            model=problem.name,
            outcome=told.outcome,
            message=told.message,
            values=(*averages, *ratio),
            errors_from="averages over parts of the motion, with half of the samples, and at a looser tolerance",
            remarks=solution.remarks,
            panels=tuple(_running(solution, name) for name in names),
            runs=(solution, first),
        )


def averaged(solution: Solution, names: list[str], rough: Solution) -> list[Value]:
    """Give the average of each quantity over the motion, with the largest difference of its other averages.

    ``rough``: the same motion at a looser tolerance.
    """
    count = min(max(SAMPLES_A_STEP * solution.statistics.steps, FEWEST), MOST) // 2 * 2
    begin, end = float(solution.time[0]), float(solution.time[-1])
    results: dict[str, list[float]] = {name: [] for name in names}
    for first, last in PARTS:
        times = np.linspace(begin + first * (end - begin), begin + last * (end - begin), count + 1)
        weights = _weights(count)
        columns = solution(times)
        for name in names:
            values: Array = columns[name]
            results[name].append(float(weights @ values / weights.sum()))
            if first == 0.0 and last == 1.0:
                half = weights[::2]
                results[name].append(float(half @ values[::2] / half.sum()))
    times = np.linspace(begin, float(rough.time[-1]), count + 1)
    weights, columns = _weights(count), rough(times)
    for name in names:
        results[name].append(float(weights @ columns[name] / weights.sum()))
    return [
        Value(name, solution.unit(name), found[0], max(abs(other - found[0]) for other in found[1:]))
        for name, found in results.items()
    ]


def _weights(count: int) -> Array:
    s = np.linspace(0.0, 1.0, count + 1)[1:-1]
    weights: Array = np.concatenate([[0.0], np.exp(-1.0 / (s * (1.0 - s))), [0.0]])
    return weights


def _ratio(found: dict[str, Value], largest: float) -> list[Value]:
    """Give 2 <T> / <V> where the potential energy has an average."""
    kinetic, potential = found.get(KINETIC), found.get(POTENTIAL)
    if kinetic is None or potential is None or abs(potential.value) <= SMALL * largest:
        return []
    ratio = 2 * kinetic.value / potential.value
    off = 2 * (kinetic.error or 0.0) / abs(potential.value) + abs(ratio / potential.value) * (
        potential.error or 0.0
    )
    return [Value("2 <T>/<V>", "", ratio, off)]


def _running(solution: Solution, name: str) -> Panel:
    """Give the plain average up to each time, which shows whether there is one at all."""
    t, values = solution.time, solution[name]
    areas = np.concatenate([[0.0], np.cumsum(np.diff(t) * (values[1:] + values[:-1]) / 2)])
    passed = t - t[0]
    mean = np.divide(areas, passed, out=values.astype(float).copy(), where=passed > 0)
    unit = solution.unit(name)
    curves = (Curve(name, t, values), Curve("average up to then", t, mean))
    return Panel(name, "time", solution.unit("time"), name, unit, curves)
