"""Spectra against closed forms: tones of known frequency and amplitude, the harmonics of a pendulum, the power of a process."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy.special import ellipk

import mechc
from mechc.runtime.outcome import SimulationError

TONES = """\
model Tones
  parameter k1 = 39 N/m;
  coordinate Length x = 1 m;
  coordinate Length y = 0 m;
  coordinate Length z = 2 mm;
  initial der(y) = 3 m/s;
  kinetic 1/2*(1 kg)*(der(x)^2 + der(y)^2 + der(z)^2);
  potential 1/2*k1*x^2 + 1/2*(900 N/m)*y^2 + 1/2*(2e4 N/m)*z^2;
  output all = 0.3 m + x + y + z;
  experiment(stop = 60 s, tolerance = 1e-10);
end Tones;
"""

PENDULUM = """\
model Pendulum
  dimensionless;
  coordinate theta = 2;
  kinetic 1/2*der(theta)^2;
  potential -cos(theta);
  experiment(stop = 400, tolerance = 1e-11);
end Pendulum;
"""

DAMPED = """\
model Damped
  dimensionless;
  parameter w = 1.3;
  coordinate x = 1;
  kinetic 1/2*der(x)^2;
  potential 1/2*x^2;
  damping 0.2 on x;
  force cos(w*time) on x;
  experiment(stop = 500, tolerance = 1e-10);
end Damped;
"""


def lines(text: str, **settings: Any) -> list[dict[str, float]]:
    found = mechc.loads(text).spectrum(**settings).summary()["lines"]
    assert isinstance(found, list)
    return found


@pytest.mark.parametrize("window", ["blackmanharris", "hann"])
def test_tones_are_found_within_their_errors(window: str) -> None:
    """Frequencies sqrt(k/m)/2pi and amplitudes 1 m, 0.1 m, 2 mm; errors are no larger than a thousandth of a step of frequency."""
    known = [(math.sqrt(k) / (2 * math.pi), a) for k, a in ((39, 1.0), (900, 0.1), (2e4, 0.002))]
    found = lines(TONES, of="all", window=window)
    assert len(found) == 3
    for line, (frequency, amplitude) in zip(found, known, strict=True):
        assert abs(line["frequency"] - frequency) <= line["error"] + 1e-9
        assert abs(line["amplitude"] - amplitude) <= line["amplitude_error"] + 1e-8
        assert line["error"] < 1e-3 and line["amplitude_error"] < 1e-2 * amplitude + 2e-4


def test_mean_and_rms() -> None:
    found = mechc.loads(TONES).spectrum(of="all")
    assert found["mean"] == pytest.approx(0.3, abs=5e-3)
    assert found["rms"] == pytest.approx(math.sqrt(0.09 + 0.5 + 0.005 + 2e-6), rel=1e-2)


def test_harmonics_of_a_pendulum() -> None:
    """theta = 8 sum q^(n + 1/2)/((2n + 1) (1 + q^(2n + 1))) cos((2n + 1) w t), with the nome q of sin(theta0/2)."""
    m = math.sin(1.0) ** 2
    w, q = math.pi / (2 * ellipk(m)), math.exp(-math.pi * ellipk(1 - m) / ellipk(m))
    for n, line in enumerate(lines(PENDULUM, count=3)):
        odd = 2 * n + 1
        assert line["frequency"] == pytest.approx(odd * w / (2 * math.pi), abs=1e-6)
        assert line["amplitude"] == pytest.approx(8 * q ** (n + 0.5) / (odd * (1 + q**odd)), abs=1e-5)


def test_what_settles_is_left_out() -> None:
    """After 200 the free oscillation has died out to exp(-20); the line of the force remains."""
    (line,) = lines(DAMPED, settling=200)
    assert line["frequency"] == pytest.approx(1.3 / (2 * math.pi), abs=1e-8)
    assert line["amplitude"] == pytest.approx(1 / math.hypot(1 - 1.69, 0.26), rel=1e-6)


def test_a_later_start_of_the_results_is_that_of_the_record() -> None:
    (line,) = lines(DAMPED, start=200)
    assert line["frequency"] == pytest.approx(1.3 / (2 * math.pi), abs=1e-8)
    assert "the record is 300 long" in mechc.loads(DAMPED).spectrum(start=200).remarks[0]


def test_power_integrates_to_the_mean_square() -> None:
    """Parseval: the integral of the power over the frequency is the variance."""
    found = mechc.loads(TONES).spectrum(of="all", power=True)
    f, p = found.arrays["frequency"], found.arrays["power"]
    assert np.trapezoid(p, f) == pytest.approx(0.5 + 0.005 + 2e-6, rel=2e-2)


def test_amplitudes_in_files_are_those_of_the_lines() -> None:
    found = mechc.loads(TONES).spectrum(of="all")
    assert found.arrays["amplitude"].max() == pytest.approx(1.0, rel=0.2)
    top = found.arrays["frequency"][found.arrays["amplitude"].argmax()]
    assert top == pytest.approx(math.sqrt(39) / (2 * math.pi), abs=1 / 60)


@pytest.mark.parametrize(
    ("settings", "says"),
    [
        (
            {"window": "kaiser"},
            "the window is one of blackmanharris, hann, rectangular, not 'kaiser'",
        ),
        ({"settling": 600}, "600 are left out of a run over 500: nothing remains"),
        ({"settling": -1}, "the time that is left out is positive, it is -1"),
    ],
)
def test_what_has_no_spectrum_is_refused(settings: dict[str, Any], says: str) -> None:
    with pytest.raises(SimulationError, match=says):
        mechc.loads(DAMPED).spectrum(**settings)
