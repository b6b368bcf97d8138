"""Work that drives and belts do in a short time beside what rests: only the accounts of energy feel it.

Judges: closed forms of the integrals. A pulse A*exp(-((t - t0)/w)^2) has the integrals A*w*sqrt(pi), of its square A^2*w*sqrt(pi/2), and of
the square of its rate A^2/w*sqrt(pi/2).
"""

from __future__ import annotations

from math import pi, sqrt

import numpy as np
import pytest

import mechc
from mechc.runtime.studies.runs import simulate
from mechc.runtime.studies.runs.missed_feature_scan import ScannedRun

PULSE = "exp(-((time - 18.01 s)/(10 ms))^2)"
RESTS = "coordinate Length x = 0 m; kinetic 1/2*1 kg*der(x)^2;"
LIES = "coordinate Length y = 0 m; kinetic 1/2*1 kg*der(y)^2; potential 9.81 N*y; contact c: y;"
LIFTED = """
coordinate Length p; coordinate Length x = 5 mm;
drive p = 6 mm*exp(-((time - 7.777 s)/(10 ms))^2) + 30 mm*exp(-((time - 18 s)/(10 ms))^2);
kinetic 1/2*1 kg*der(x)^2 + 1/2*3 kg*der(p)^2; friction 2 N on x;
contact hit: x - p restitution 0.5; experiment(stop = 30 s);
"""
DAMPED = 0.03**2 / 0.01 * sqrt(pi / 2)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (
            f"{RESTS} friction 1 N on x; coordinate Length p; drive p = 30 mm*{PULSE}; damping 5 N.s/m on p;",
            5 * DAMPED,
        ),
        (f"{LIES} damping 5 N.s/m on der(y) + 1 m/s*{PULSE};", 5 * 0.01 * sqrt(pi / 2)),
        (f"{RESTS} constraint x = 0 m; damping 5 N.s/m on der(x) - 1 m/s*{PULSE};", 5 * 0.01 * sqrt(pi / 2)),
    ],
    ids=["a damped drive", "a damper on what lies", "a damper on what is held"],
)
def test_a_pulse_beside_what_rests(text: str, expected: float) -> None:
    found = mechc.loads(text + "experiment(stop = 30 s);").simulate()
    assert found["energy.dissipated"][-1] == pytest.approx(expected, rel=1e-8)
    assert found["energy.supplied"][-1] == pytest.approx(expected, rel=1e-8)
    (told,) = (remark for remark in found.remarks if "something begins at t =" in remark)
    assert "17.9" in told or "18.0" in told


def test_a_mass_on_the_drive_after_an_impact() -> None:
    """The second pulse lifts the mass on the drive and takes it back; the balance holds between."""
    found = mechc.loads(LIFTED).simulate(every="10 ms", estimate_error=False)
    balance = found["energy.total"] + found["energy.dissipated"] - found["energy.supplied"]
    assert np.abs(balance - balance[0]).max() < 1e-7
    late = found.time > 10
    since = (found.time[late] - 18) / 0.01
    rate = -2 * 0.03 / 0.01 * since * np.exp(-(since**2))
    assert found["energy.total"][late] == pytest.approx(0.5 * 3 * rate**2, abs=1e-7)


def test_a_balance_that_is_off_is_doubtful_whatever_errors_are_stated(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The companion sees the pulse, the run does not: the error that is stated is as large as the balance is off."""
    monkeypatch.setattr(simulate, "begins_unseen", lambda *_: None)
    monkeypatch.setattr(simulate, "seen_between", lambda plan, main, _: ScannedRun(plan, main))
    found = mechc.loads(LIFTED).simulate(every="1 ms")
    assert found.outcome.name == "DOUBTFUL"
    (doubt,) = found.accuracy.contradictions
    assert doubt.kind == "work"
    assert doubt.found == pytest.approx(9.93, rel=0.01)
    assert doubt.allowed < 0.1
    assert found.accuracy.error is not None
    assert found.accuracy.error.by_state["energy.supplied"] > 1
    assert "1 % of the energies is" in found.message


def test_what_a_switch_begins_is_seen_once() -> None:
    text = f"{RESTS} constraint x = 0 m; friction 5 N on der(x) - (if time > 1 s then 1 m/s else 0 m/s); experiment(stop = 2 s);"
    found = mechc.loads(text).simulate(estimate_error=False)
    assert found["energy.dissipated"][-1] == pytest.approx(5, rel=1e-9)
    assert not any("something begins" in remark for remark in found.remarks)


@pytest.mark.parametrize("width", [4e-3, 1e-3])
def test_a_pulse_beside_what_moves(width: float) -> None:
    text = (
        f"coordinate Length p; drive p = 30 mm*exp(-((time - 18.01 s)/({width!r} s))^2); damping 5 N.s/m on p;"
        "coordinate Angle a = 0.1 rad; kinetic 1/2*1 kg.m^2*der(a)^2; potential 1/2*1 N.m*a^2; experiment(stop = 30 s);"
    )
    found = mechc.loads(text).simulate(estimate_error=False)
    assert found["energy.dissipated"][-1] == pytest.approx(5 * 0.03**2 / width * sqrt(pi / 2), rel=1e-8)
    assert any("something narrow was passed over" in remark for remark in found.remarks)
