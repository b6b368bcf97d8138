"""Conditions that compare what a constraint keeps equal: their values are rounding, and a run with them ends."""

from __future__ import annotations

import math

import pytest

import mechc

PAIR = """\
coordinate Length a = 0 m;
coordinate Length b = 0 m;
kinetic 1/2*1 kg*der(a)^2 + 1/2*2 kg*der(b)^2;
force 3 N on a;
damping 0.5 N.s/m on b;
"""


@pytest.mark.parametrize(
    "text",
    [
        "constraint lock: der(b) = der(a); when der(a) > der(b) then engage lock; end when;",
        "constraint lock: der(b) = der(a); when der(a) >= der(b) then engage lock; end when;",
        "constraint lock: b = a; when a > b then engage lock; end when;",
        "constraint lock: b = a; discrete Integer n = 0; when a - b > 0 m then n := n + 1; end when;",
        "constraint lock: b = a; when 2*a > a + b then engage lock; end when;",
    ],
)
def test_a_condition_of_rounding_changes_nothing(text: str) -> None:
    """Both move as 3 kg with a drag: v = 6 m/s (1 - exp(-t/(6 s)))."""
    solution = mechc.loads(PAIR + text).simulate(stop=1)
    assert solution.time[-1] == 1
    assert solution.statistics.steps < 100
    assert solution["der(a)"][-1] == pytest.approx(6 * (1 - math.exp(-1 / 6)), rel=1e-9)
    assert solution["b"][-1] == pytest.approx(6 - 36 * (1 - math.exp(-1 / 6)), rel=1e-8)
