"""Formulas whose switches read each other, as min(a, max(b, min(c, d))), are right from the start on."""

from __future__ import annotations

import re

import numpy as np
import pytest

import mechc
from mechc.runtime.outcome import Outcome

NESTED = """\
model Nested
  dimensionless;
  coordinate x = START;
  kinetic der(x)^2/2;
  contact c: x - FORMULA;
  experiment(stop = 1e-3);
end Nested;
"""


@pytest.mark.parametrize("seed", range(8))
def test_a_gap_is_right_at_the_start(seed: int) -> None:
    """Where it begins 0.1 too deep, the run says by how much."""
    a, b, c, d, e = np.round(np.random.default_rng(seed).uniform(-2, 2, 5), 3)
    value = min(a, max(b, min(c, max(d, e))))
    formula = f"min({a} + 2*time, max({b} - time, min({c} + 3*time, max({d} - 2*time, {e} + time))))"
    text = NESTED.replace("FORMULA", formula)
    run = mechc.loads(text.replace("START", f"{value - 0.1:.6f}")).simulate()
    assert run.outcome is Outcome.FAILED
    (said,) = re.findall(r"its gap is ([-0-9.e]+) \(SI\)", str(run.failure))
    assert float(said) == pytest.approx(-0.1, abs=1e-6)
    assert mechc.loads(text.replace("START", f"{value + 0.1:.6f}")).simulate().outcome is Outcome.COMPLETED


def test_a_cam_of_pieces_begins_at_its_foot() -> None:
    """The profile is 0 at the start; on it the follower falls for sqrt(2 h/g) until it meets the rise at t: h - g t^2/2 = v t."""
    run = mechc.loads("""\
model Cam
  coordinate x = 1 m;
  kinetic 1/2*1 kg*der(x)^2;
  force -9.81 N on x;
  contact c: x - min((1 m/s)*mod(time, 3 s), max(0 m, 2.3 m - (1 m/s)*mod(time, 3 s)));
  experiment(stop = 1 s, tolerance = 1e-10);
end Cam;
""").simulate()
    first = next(event for event in run.events if event.kind == "impact")
    assert first.time == pytest.approx((-1 + np.sqrt(1 + 2 * 9.81)) / 9.81, rel=1e-10)
