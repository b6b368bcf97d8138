"""Sticking and sliding beside smooth laws that come close to them, in random mechanisms.

The modes of dry friction and the smooth law share no code that decides what sticks. A law that is smooth below a speed
v differs from Coulomb's by what bodies creep, in proportion to v: two runs at v and 4 v tell how much that is.
"""

from __future__ import annotations

from collections.abc import Callable
from random import Random

import pytest
from random_friction import ROUGH, RoughModel
from slow_params import slow_but

import mechc
from mechc.runtime.outcome import Outcome
from mechc.solution import Solution

CREEP = 3e-5
"""[m/s], [rad/s]"""

STEPPED_OVER = 1e-4
"""What the runs of the smooth laws lose where a step goes over a reversal: up to 2e-5 in 24 models at this tolerance."""


def followed(text: str, tolerance: float) -> Solution:
    solution = mechc.loads(text).simulate(stop=1.5, tolerance=tolerance, estimate_error=False)
    assert solution.outcome is Outcome.COMPLETED, f"{solution.message}\n{text}"
    return solution


def check(drawn: RoughModel) -> None:
    dry = followed(drawn.dry(), 1e-8)
    smooth, smoother = (followed(drawn.smooth(speed), 1e-9) for speed in (4 * CREEP, CREEP))
    for name in drawn.watched:
        creep = abs(smooth[name][-1] - smoother[name][-1])
        assert abs(dry[name][-1] - smoother[name][-1]) < 2 * creep + STEPPED_OVER, drawn.text


@pytest.mark.parametrize("family", slow_but(ROUGH[2:], ROUGH), ids=lambda family: family.__name__)
def test_random_mechanisms(family: Callable[[Random], RoughModel]) -> None:
    check(family(Random(1)))


@pytest.mark.slow
@pytest.mark.parametrize("family", ROUGH, ids=lambda family: family.__name__)
def test_many_random_mechanisms(family: Callable[[Random], RoughModel]) -> None:
    for seed in range(2, 10):
        check(family(Random(seed)))
