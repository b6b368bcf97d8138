"""``rms(e)``: against closed forms, and SciPy's response of the filters of ISO 2631-1."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lsim, zpk2tf

import mechc
from mechc.lang.diagnostics import CompileError

SHAKEN = """\
model Shaken
  coordinate Length x = 0 cm;
  parameter Frequency f = 4 Hz;
  kinetic 1/2*1 kg*der(x)^2;
  let Acceleration a = 2 m/s^2*sin(2*pi*f*time) + 1 m/s^2*cos(2*pi*2.5*f*time);
  force 1 kg*a on x;
  output one = rms(a);
  output felt = rms(der(der(x)), weighting = "ISO2631-Wk");
  output sick = rms(a, weighting = "ISO2631-Wf");
  output still = rms(0*a);
  experiment(stop = 8 s, every = 1 ms, tolerance = 1e-10);
end Shaken;
"""


def test_the_mean_begins_with_the_value_and_is_that_of_a_sine() -> None:
    """mean of (2 sin + cos)^2 up to t, integrated by hand; 1 at the start, where the mean is 0/0."""
    found = mechc.loads(SHAKEN).simulate(estimate_error=False)
    t, w = found.time[1:], 8 * np.pi
    # 2 sin(wt) cos(2.5 wt)
    mixed = (1 - np.cos(3.5 * w * t)) / (3.5 * w) - (1 - np.cos(1.5 * w * t)) / (1.5 * w)
    squares = 4 * (t / 2 - np.sin(2 * w * t) / (4 * w)) + (t / 2 + np.sin(5 * w * t) / (10 * w)) + 2 * mixed
    assert found["one"][0] == 1
    assert found["one"][1:] == pytest.approx(np.sqrt(squares / t), rel=1e-7)
    assert (found["still"] == 0).all()


def test_scipy_weights_an_acceleration_alike() -> None:
    """Filters from the corner frequencies of ISO 2631-1, Table A.1, as zeros and poles, here by scipy.signal.lsim."""
    found = mechc.loads(SHAKEN).simulate(estimate_error=False)
    t = np.linspace(0, 8, 40_001)
    w = 2 * np.pi * 4
    a = 2 * np.sin(w * t) + np.cos(2.5 * w * t)

    def pair(f: float, q: float) -> list[complex]:
        return list(np.roots([1, 2 * np.pi * f / q, (2 * np.pi * f) ** 2]))

    low = np.sqrt(0.5)
    seat = (
        [0, 0, -2 * np.pi * 12.5, *pair(2.37, 0.91)],
        [*pair(0.4, low), *pair(100, low), *pair(12.5, 0.63), *pair(3.35, 0.91)],
    )
    ship = (
        [0, 0, *pair(0.0625, 0.80)],
        [*pair(0.08, low), *pair(0.63, low), *pair(0.25, 0.86), *pair(0.1, 0.80)],
    )
    gains = (2 * np.pi * 100) ** 2 * 2 * np.pi * 12.5, (2 * np.pi * 0.63) ** 2 * (2 * np.pi * 0.25) ** 2
    for name, (zeros, poles), gain in (("felt", seat, gains[0]), ("sick", ship, gains[1])):
        _, y, _ = lsim(zpk2tf(zeros, poles, gain), a, t)
        mean = np.sqrt(
            np.concatenate([[0], np.cumsum((y[1:] ** 2 + y[:-1] ** 2) / 2)])[1:] / np.arange(1, len(t))
        )
        assert found[name][100:] == pytest.approx(mean[499::5], rel=1e-4, abs=1e-6)


def test_members_keep_it() -> None:
    keep = 'rms(a), felt = rms(der(der(x)), weighting = "ISO2631-Wk")'
    found = mechc.loads(SHAKEN).ensemble(vary={"f": [4.0, 8.0]}, keep=keep, errors="all")
    run = mechc.loads(SHAKEN).simulate(set={"f": 8.0})
    assert found["rms(a)"] == pytest.approx(np.sqrt(2.5), rel=1e-6) and found.unit("felt") == "m/s^2"
    assert found["felt"][1] == pytest.approx(run["felt"][-1], rel=1e-7)
    assert (found.error("felt") < 1e-6).all()


def test_hidden_states_move_nothing() -> None:
    """A mean follows the motion: equilibria and exponents are those without it."""
    text = SHAKEN.replace("force 1 kg*a on x", "force -4 N/m*x - 1 kg/s*der(x) on x").replace(
        "rms(a,", "rms(der(der(x)),"
    )
    found = mechc.loads(text).lyapunov(over={"f": [4.0]}, time=60)
    assert found["lyapunov(time)"][0] == pytest.approx(-0.5, abs=0.05)


@pytest.mark.parametrize(
    ("wrong", "says"),
    [
        ('rms(x, weighting = "ISO2631-Wk")', "E0304.*'rms' takes an acceleration in m/s.2 for 'ISO2631-Wk', this is a length"),
        ('rms(a, weighting = "Wk")', "E0333.*the weighting is one of ISO2631-Wk, .*, not 'Wk'"),
        ("rms(a, weighting = x)", "E0333.*the weighting is one of"),
        ("rms({a, a})", "E0321.*'rms' takes one value"),
        ("rms(a > 0)", "E0308.*'rms' takes a number"),
    ],
)  # fmt: skip
def test_what_has_no_mean(wrong: str, says: str) -> None:
    with pytest.raises(CompileError, match=says):
        mechc.loads(SHAKEN.replace("rms(a);", f"{wrong};"))
