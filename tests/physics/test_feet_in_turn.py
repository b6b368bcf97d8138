"""Feet that land, slip, stick and lift off while others do: what one does leaves the slips of the others as they are."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import mechc
from mechc.runtime.outcome import Outcome

BLOCKS = """
model Blocks
  gravity {0, 0, -9.81} m/s^2;
  coordinate Length x = 0 m;
  coordinate Length y = 0 m;
  coordinate Length z = 0 m;
  initial der(x) = -10 m/s;
  initial der(y) = 3 m/s;
  frame one = world * trans({x, y, z});
  mass 1 kg at one;
  force {0, 20, 0} N on one;
  contact floor: z friction 0.3 along {der(x), der(y)};
  coordinate Length s = 0 m;
  coordinate Length h = 0 m;
  frame other = world * trans({s, 50 m, h});
  mass 1 kg at other;
  force {(100 N/s)*time, 0, 0} on other;
  contact ground: h friction 0.4 along der(s);
  experiment(stop = 1 s);
end Blocks;
"""


def test_a_slide_keeps_its_direction_while_another_begins() -> None:
    """The one block turns under a force across its slip when the other gives way, at 0.4 m g = 100 N/s t."""
    solution = mechc.loads(BLOCKS).simulate(estimate_error=False)
    assert solution.outcome is Outcome.COMPLETED, solution.message
    assert [(e.kind, e.time) for e in solution.events] == [("slip", pytest.approx(0.03924, rel=1e-9))]

    def rates(_: float, u: np.ndarray) -> np.ndarray:
        v = u[2:]
        return np.concatenate([v, np.array([0, 20]) - 0.3 * 9.81 * v / np.hypot(*v)])

    reference = solve_ivp(rates, (0, 1), [0, 0, -10, 3], method="DOP853", rtol=1e-12, atol=1e-12).y[:2, -1]
    assert np.abs(np.array([solution["x"][-1], solution["y"][-1]]) - reference).max() < 1e-7
