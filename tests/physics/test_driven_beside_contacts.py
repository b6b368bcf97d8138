"""What is driven by its rate goes on as it is driven where contacts beside it close and rest."""

from __future__ import annotations

import numpy as np
import pytest

import mechc

BESIDE = """
coordinate Length s = 0.3 m;
drive der(s) = 1 m/s + 0.5 m/s*cos(2 Hz*time);
kinetic 1/2*1 kg*der(s)^2;
coordinate Length x = 0 m;
coordinate Length y = 0.3 m;
initial der(x) = 1 m/s;
kinetic 1/2*1 kg*(der(x)^2 + der(y)^2);
potential 1 kg*9.81 m/s^2*y;
contact floor: y + 0.2 m*sin(x/1 m) {bounce};
experiment(stop = 1 s);
"""


@pytest.mark.parametrize("bounce", ["", "restitution 0.5", "friction 0.3 along der(x)"])
@pytest.mark.parametrize("method", ["dop853", "radau5"])
def test_a_driven_rate_beside_a_contact(bounce: str, method: str) -> None:
    """The place is the integral of the rate, s = 0.3 m + t + sin(2 t)/4, whatever lands beside it."""
    solution = mechc.loads(BESIDE.format(bounce=bounce)).simulate(every=0.1, method=method, tolerance=1e-9)
    assert {"impact", "rest"} <= {e.kind for e in solution.events}
    t = np.asarray(solution.time)
    # of a tolerance of 1e-9 a step, a hundred of them and an event each
    assert np.asarray(solution["s"]) == pytest.approx(0.3 + t + np.sin(2 * t) / 4, abs=1e-7)
    error = solution.accuracy.error
    assert error is not None and error.largest < 1e-7
