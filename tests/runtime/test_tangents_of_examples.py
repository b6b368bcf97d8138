"""Derivatives of every example in parameters, starts and inputs, against differences of precise runs."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from derivatives import differences, one_sided, with_uncertainty
from msgspec import Struct
from msgspec.structs import replace

import mechc
from mechc.runtime.case import SimulationOptions, inputs_at
from mechc.runtime.outcome import SimulationError
from mechc.runtime.problem import Problem
from mechc.runtime.studies.runs.simulate import plan_run
from mechc.runtime.tangent.flow import tangent_flow

EXAMPLES = sorted((Path(__file__).parents[2] / "examples").glob("*.mech"))
PARAMETERS = 2
"""Of each example, beside a given initial value and an input."""

WIDTH = 4e-3
"""Of differences where nothing switches, as a share of the value."""

LONGEST, LONGEST_WITH_EVENTS = 1.0, 3.0
"""Times of a run."""


class Special(Struct, frozen=True):
    """Why an example is looked at until ``stop`` only, or with other ``values``."""

    why: str
    stop: float | None = None
    values: dict[str, float] = {}


SPECIAL = {
    "n_four_bar": Special("passes singular positions later, where derivatives are unbounded", stop=0.6),
    "kepler_four_orbits": Special("passes so close to the centre that differences do not converge", stop=0.3),
    "touching_balls": Special("a restitution above 1 does not run", stop=1.9, values={"e": 0.9}),
    "falling_box": Special("rattles later: impacts whose order changes are refused", stop=0.76),
    "lorentz_inferred": Special("begins at the limit of its parameter", values={"side": 0.5}),
    "cart_servo": Special("differences step over lines of its encoder", values={"encoder.resolution": 10.0}),
    "geared_servo": Special("rests later, where rounding decides when teeth slip", stop=1.5),
    "crates": Special("two corners land at one instant later, whose order a change decides", stop=0.4),
    "balls_on_a_box": Special("corners come to rest at once later, whose order a change decides", stop=0.2),
    "balls_in_a_box": Special("a ball pushes the crate later, and rests on it at that instant", stop=0.3),
    "wheelset_hunting": Special("begins where its rates bend", values={"y": 5.5e-3}, stop=0.05),
    "four_wheels": Special(
        "its rack begins to move later, at a kink of time after which derivatives are wrong",
        stop=0.45,
    ),
    "beam": Special("81 states, whose differences take long", stop=0.3),
}


def constant_inputs(problem: Problem) -> list[str]:
    case = plan_run(problem, SimulationOptions()).case
    both = zip(inputs_at(case, case.begin), inputs_at(case, case.stop), strict=True)
    return [q.name for q, (a, b) in zip(problem.inputs, both, strict=True) if a == b]


def directions_of(problem: Problem) -> list[str]:
    """Parameters, an initial value that is given, and an input that is constant."""
    given = [
        q.name
        for i, (q, known) in enumerate(zip(problem.states, problem.known, strict=True))
        if known and q.kind in ("coordinate", "rate") and not any(r <= i < r + 4 for r in problem.rotations)
    ]
    return [
        *(q.name for q in problem.parameters[:PARAMETERS]),
        *given[:1],
        *constant_inputs(problem)[:1],
    ]


def stop_of(model: mechc.Model, options: SimulationOptions) -> float:
    """Where to look. A run that its model ends is looked at shortly before: differences of last states would be those at other times."""
    problem = model.problem()
    switches = problem.hybrid is not None
    stop = min(plan_run(problem, options).case.stop, LONGEST_WITH_EVENTS if switches else LONGEST)
    if switches:
        motion = model.simulate(
            stop=stop, tolerance=1e-10, method="dop853", estimate_error=False, set=dict(options.values)
        )
        if motion.time[-1] < stop:
            return 0.97 * float(motion.time[-1])
    return stop


def has_two_sides(problem: Problem, options: SimulationOptions, name: str) -> bool:
    """Whether a motion follows a change of its start to both sides alike: what is refused must not."""
    try:
        sides = one_sided(problem, options, name, 1e-5)
    except SimulationError:
        return False
    return bool(np.abs(sides[0] - sides[1]).max() <= 1e-3 * np.abs(sides).max())


@pytest.mark.slow
@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_derivatives_agree_with_differences(path: Path) -> None:
    """1e-8 of the largest derivative of a state where nothing switches, at all times; 1e-6 at the end where something does;
    beyond what the differences themselves are uncertain by (twice the change that their last halving makes)."""
    model, special = mechc.load(path), SPECIAL.get(path.stem, Special(""))
    problem = model.problem()
    options = SimulationOptions(tolerance=1e-12, points=3, method="dop853", values=special.values)
    stop = special.stop if special.stop is not None else stop_of(model, options)
    options = replace(options, stop=stop)
    plan = plan_run(problem, options)
    switches = problem.hybrid is not None
    for name in directions_of(problem):
        try:
            flow = tangent_flow(plan.case, plan.method, plan.nominal, [name], estimate_error=False)
        except SimulationError as error:
            if "on one side only" in error.message:
                assert not has_two_sides(problem, options, name)
            else:  # no start beside this one
                with pytest.raises(SimulationError):
                    differences(problem, options, name)
            continue
        assert flow.failure is None, (name, flow.failure.message)
        expected, uncertain = with_uncertainty(
            problem, options, name, *((1e-4, 3) if switches else (WIDTH, 4))
        )
        least = 1e-12 / WIDTH * plan.nominal.max()  # what differences leave of a derivative that is zero
        found, bound = flow.tangents[:, :, 0], 1e-8 * np.abs(expected).max() + least
        if switches:
            found, expected = found[-1], expected[-1]
            bound = 1e-6 * np.abs(expected).max() + 1e-9
        off = np.abs(found - expected).max()
        assert off <= bound + uncertain, (name, off, uncertain)
