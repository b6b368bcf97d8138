"""Dry friction that gives way to a force which grows: the slip begins without an acceleration, once, and follows the closed form."""

from __future__ import annotations

import math

import pytest

import mechc

DRAWN = """\
model Drawn "by a spring whose end moves at a constant speed"
  coordinate Length x = 0 m;
  kinetic 1/2*{m} kg*der(x)^2;
  potential 1/2*{k} N/m*(x - {v} m/s*time)^2;
  friction rub: {limit} N on x;
  experiment(stop = {stop} s);
end Drawn;
"""
STATE = """\
model State "the force of that spring as a state"
  coordinate Length x = 0 m;
  kinetic 1/2*{m} kg*der(x)^2;
  state Force F = 0 N;
  equation der(F) = {k} N/m*({v} m/s - der(x));
  force F on x;
  friction rub: {limit} N on x;
  experiment(stop = {stop} s);
end State;
"""
FLOOR = """\
model Floor "on a rough floor"
  coordinate Length x = 0 m;
  coordinate Length y = 0 m;
  kinetic 1/2*{m} kg*(der(x)^2 + der(y)^2);
  potential {weight} N*y + 1/2*{k} N/m*(x - {v} m/s*time)^2;
  contact floor: y friction 0.3 along der(x);
  experiment(stop = {stop} s);
end Floor;
"""
BLOCKS = {
    "a slide of a machine": (200.0, 2.24e7, 1.9 / 22.4, 350.0),
    "a block of 3 kg": (3.0, 8350.105, 0.285, 142.854),
    "a soft spring": (64.774, 10.32, 0.0686, 76.941),
    "a light block": (0.029, 15.285, 1.0169, 5.384),
    "a block of 1 kg": (1.0, 100.0, 0.1, 2.943),
}
"""Masses, stiffnesses, speeds and limits of friction."""


@pytest.mark.parametrize("tolerance", [1e-3, 1e-4, 1e-5, 1e-8])
@pytest.mark.parametrize("method", ["radau5", "dop853"])
@pytest.mark.parametrize("block", BLOCKS)
@pytest.mark.parametrize("text", [DRAWN, STATE, FLOOR], ids=["drawn", "state", "floor"])
def test_a_slip_begins_once(text: str, block: str, method: str, tolerance: float) -> None:
    m, k, v, limit = BLOCKS[block]
    onset, omega = limit / (k * v), math.sqrt(k / m)
    slides = min(1.5 * onset, 2 / omega)
    stop = onset + slides
    model = mechc.loads(text.format(m=m, k=k, v=v, limit=limit, weight=limit / 0.3, stop=stop))
    solution = model.simulate(method=method, tolerance=tolerance)
    (event,) = solution.events
    assert event.kind == "slip"
    assert event.time == pytest.approx(onset, rel=1e-9 if text != STATE else 1e-8)
    assert solution["x"][-1] == pytest.approx(
        v * (slides - math.sin(omega * slides) / omega), rel=100 * tolerance
    )
