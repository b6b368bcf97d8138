"""Derivatives of every example in which nothing switches, against differences of precise runs."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from derivatives import differences, with_uncertainty

import mechc
from mechc.runtime.case import SimulationOptions
from mechc.runtime.outcome import SimulationError
from mechc.runtime.problem import Problem
from mechc.runtime.studies.runs.simulate import plan_run
from mechc.runtime.tangent.flow import tangent_flow

EXAMPLES = sorted((Path(__file__).parents[2] / "examples").glob("*.mech"))
DIRECTIONS, LONGEST, LARGEST = 2, 1.0, 20
"""Of each example; time of a run; states of a model, of which larger ones are left to the tests of few."""

NOT_SMOOTH = {
    "n_four_bar": "passes singular positions, where derivatives are unbounded",
    "kepler_four_orbits": "passes so close to the centre that differences do not converge",
    "shuttlecock": "begins at rest, where the square root in its drag has no derivative: told as a failure",
}


def directions_of(problem: Problem) -> list[str]:
    """Parameters, and an initial value that is given."""
    given = [
        q.name
        for i, (q, known) in enumerate(zip(problem.states, problem.known, strict=True))
        if known and q.kind in ("coordinate", "rate") and not any(r <= i < r + 4 for r in problem.rotations)
    ]
    free = [] if problem.constraints else given[:1]
    return [*(q.name for q in problem.parameters[: DIRECTIONS - len(free)]), *free]


@pytest.mark.slow
@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_derivatives_agree_with_differences(path: Path) -> None:
    """1e-8 of the largest derivative of a state, beyond what the differences themselves are uncertain by (twice the change
    that their last halving makes)."""
    problem = mechc.load(path).problem()
    if problem.hybrid is not None or path.stem in NOT_SMOOTH or problem.ny > LARGEST:
        pytest.skip(NOT_SMOOTH.get(path.stem, "it switches, or is large"))
    options = SimulationOptions(tolerance=1e-12, points=3, method="dop853")
    try:
        plan = plan_run(problem, options)
    except SimulationError:
        pytest.skip("its experiment gives a step, or sweeps")
    if plan.case.stop > LONGEST:
        options = SimulationOptions(tolerance=1e-12, points=3, method="dop853", stop=LONGEST)
        plan = plan_run(problem, options)
    names = directions_of(problem)
    if not names:
        pytest.skip("it has no parameters, and its start is assembled")
    for name in names:
        try:
            flow = tangent_flow(plan.case, plan.method, plan.nominal, [name])
        except SimulationError:  # no start beside this one
            with pytest.raises(SimulationError):
                differences(problem, options, name)
            continue
        assert flow.failure is None
        expected, uncertain = with_uncertainty(problem, options, name, 4e-3)
        error = np.abs(flow.tangents[:, :, 0] - expected).max()
        bound = 1e-8 * np.abs(expected).max() + uncertain + 1e-12 * plan.nominal.max()
        assert error <= bound, (name, error, uncertain)


NOT_SMOOTH_AT_EVENTS = {
    "drag_reynolds": "begins at rest, where its drag has no derivative: told as a failure",
    "falling_box": "rattles: impacts a few millionths of a second apart, whose order changes: refused",
    "touching_balls": "begins with balls that touch: which hits first changes",
}


@pytest.mark.slow
@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_derivatives_across_events_agree_with_differences(path: Path) -> None:
    """1e-6 of the largest derivative of a state at the end, beyond what the differences are uncertain by. A run that its model
    ends is looked at shortly before: differences of last states would be those at other times."""
    model = mechc.load(path)
    problem = model.problem()
    if problem.hybrid is None or path.stem in NOT_SMOOTH_AT_EVENTS or problem.ny > 30:
        pytest.skip(NOT_SMOOTH_AT_EVENTS.get(path.stem, "nothing switches, or it is large"))
    options = SimulationOptions(tolerance=1e-12, points=3, method="dop853")
    try:
        stop = min(plan_run(problem, options).case.stop, 3.0)
    except SimulationError:
        pytest.skip("its experiment gives a step, or sweeps")
    motion = model.simulate(stop=stop, tolerance=1e-10, method="dop853", estimate_error=False)
    if motion.time[-1] < stop:
        stop = 0.97 * float(motion.time[-1])
    options = SimulationOptions(tolerance=1e-12, points=3, method="dop853", stop=stop)
    plan = plan_run(problem, options)
    for name in [q.name for q in problem.parameters[:2]]:
        flow = tangent_flow(plan.case, plan.method, plan.nominal, [name], estimate_error=False)
        assert flow.failure is None
        expected, uncertain = with_uncertainty(problem, options, name, 1e-4, 3)
        error = np.abs(flow.tangents[-1, :, 0] - expected[-1]).max()
        assert error <= 1e-6 * np.abs(expected[-1]).max() + uncertain + 1e-9, (name, error, uncertain)
