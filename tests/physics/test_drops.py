"""What falls on feet and corners comes to rest, with any friction and restitution: boxes, rods, tables and quadrupeds, in the plane and in
space. Loads at rest are the weight; of what stands on four feet alike, the pseudo-inverse's."""

from __future__ import annotations

import re

import numpy as np
import pytest
from drops import WEIGHT, drop, on_four_feet
from slow_params import slow_among

import mechc
from mechc.runtime.outcome import Outcome


def check(seed: int) -> bool:
    """Whether it gets to its end, at rest with the load of its weight; every jump of its energy is booked."""
    solution = mechc.loads(drop(seed)).simulate(estimate_error=False)
    if solution.outcome is not Outcome.COMPLETED:
        assert any(
            w in solution.message for w in ("Coulomb's law", "without getting on", "the motion is singular")
        )
        return False
    energy = solution.energy
    assert energy is not None and energy.dissipated is not None
    assert abs(energy.start - energy.dissipated - energy.end) < 1e-6 * energy.start, seed
    speeds = [abs(solution[q.name][-1]) for q in solution.problem.states if q.name.startswith("der(")]
    if max(speeds) < 1e-6:  # those that bounce for long, or rock, are not there yet
        assert abs(solution["total"][-1] - WEIGHT) < 1e-5 * WEIGHT, seed
    return True


@pytest.mark.parametrize(
    "seed",
    slow_among(
        [9, 27, 40, 141, 824, 873],
        [0, 1, 2, 3, 5, 9, 14, 24, 27, 33, 35, 40, 51, 141, 152, 711, 765, 824, 873, 922],
    ),
)
def test_it_comes_to_rest(seed: int) -> None:
    assert check(seed)


@pytest.mark.slow
@pytest.mark.parametrize("first", range(60, 180, 30))
def test_many_come_to_rest(first: int) -> None:
    assert [seed for seed in range(first, first + 30) if not check(seed)] == []


@pytest.mark.slow
@pytest.mark.parametrize("seed", [225, 358, 369, 405, 417, 465, 604])
def test_shocks_and_slips_of_two_feet_end(seed: int) -> None:
    """Quadrupeds whose steep slips no force holds, and boxes of which two corners begin to slip at once."""
    assert check(seed)


@pytest.mark.parametrize("seed", slow_among([9], [9, 21, 51]))
def test_forces_that_grow_without_bounds_are_shocks_at_tight_tolerances(seed: int) -> None:
    """Steps became too small where a slip turns to where no force can hold it. Tolerances agree to 5e-10, and `moreau` at small steps, which
    knows no shocks, comes to the same places: 6e-5 and 3e-5 were measured."""
    model = mechc.loads(re.sub("(contact [^;]*);", r'\1, impacts = "simultaneous";', drop(seed)))
    tight, other = (model.simulate(tolerance=t, estimate_error=False) for t in (1e-10, 1e-9))
    assert tight.outcome is other.outcome is Outcome.COMPLETED, tight.message
    places = [q.name for q in tight.problem.states[: tight.problem.nq]]
    assert max(abs(tight[n][-1] - other[n][-1]) for n in places) < 1e-8
    energy = tight.energy
    assert energy is not None and energy.dissipated is not None
    assert abs(energy.start - energy.dissipated - energy.end) < 1e-9 * energy.start
    if seed == 9:
        steps = model.simulate(method="moreau", step=5e-5, estimate_error=False)
        assert max(abs(tight[n][-1] - steps[n][-1]) for n in places) < 2e-4


@pytest.mark.parametrize("angles", [(-7.602, 12.741), (5.0, 3.0)])
def test_loads_of_what_has_fallen_are_those_of_what_stands(angles: tuple[float, float]) -> None:
    """Whichever feet came down first. Where single feet would have to carry more than their cones allow, others carry it."""
    solution = mechc.loads(on_four_feet(0.3, 1.0, angles, -0.039, -1.105)).simulate(estimate_error=False)
    assert solution.outcome is Outcome.COMPLETED, solution.message
    loads = [solution[f"load[{k}]"][-1] for k in range(1, 5)]
    assert np.abs(np.array(loads) - WEIGHT / 4).max() < 1e-6 * WEIGHT
