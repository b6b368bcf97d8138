"""Fits driven by noisy columns: whether it is told, and how often intervals hold, against motions by SciPy."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.interpolate import make_smoothing_spline

import mechc
from mechc.runtime.fitting.input_errors import smoother
from mechc.runtime.inputs import make_table
from mechc.runtime.outcome import SimulationError
from mechc.runtime.problem import Array

SHAKEN = """\
model Shaken
  parameter k(min = 0 N/m) = 80 N/m;
  parameter c(min = 0 N.s/m) = 2 N.s/m;
  parameter a(min = 0 N.s^2/m^2) = 0.5 N.s^2/m^2;
  input Length base(interpolation = "spline") = 0 m;
  coordinate Length b;
  coordinate Length x = 0 m;
  drive b = base;
  kinetic 1/2*1 kg*(der(x)^2 + der(b)^2);
  potential 1/2*k*(x - b)^2;
  let v = der(x) - der(b);
  force -c*v - a*v*abs(v) on x;
  experiment(stop = 4 s);
end Shaken;
"""
TRUE = {"k": 100.0, "c": 1.5, "a": 1.0}
TIMES = np.linspace(0, 4, 201)
NOISE = 5e-4


def base(t: Any) -> Any:
    return 0.05 * (np.sin(7 * t) - 7 * t * np.exp(-5 * t)) + 0.02 * np.sin(13 * t) * (1 - np.exp(-3 * t)) ** 2


@pytest.fixture(scope="module")
def model() -> mechc.Model:
    return mechc.loads(SHAKEN)


@pytest.fixture(scope="module")
def motion() -> Array:
    def rates(t: float, y: Array) -> list[float]:
        v = y[1] - (base(t + 1e-6) - base(t - 1e-6)) / 2e-6
        return [y[1], -100 * (y[0] - base(t)) - 1.5 * v - v * abs(v)]

    found = solve_ivp(rates, (0, 4), [0, 0], t_eval=TIMES, rtol=1e-9, atol=1e-11, max_step=0.02)
    x: Array = found.y[0]
    return x


def data(motion: Array, seed: int, of_base: float = NOISE) -> dict[str, Array]:
    random = np.random.default_rng(seed)
    return {
        "time": TIMES,
        "base": base(TIMES) + of_base * random.normal(size=TIMES.size),
        "x": motion + NOISE * random.normal(size=TIMES.size),
    }


def off(found: Any) -> Array:
    """How far the values are from the true ones, over half the intervals."""
    return np.array([(found[n] - true) / found.details["interval"][n] for n, true in TRUE.items()])


def test_noise_of_what_drives_is_told_and_smoothed(model: mechc.Model, motion: Array) -> None:
    measured = data(motion, 501)
    plain = model.fit(measured, "k, c, a", set={"der(x)": 0})
    assert np.abs(off(plain)).max() > 1.2
    assert any("'base'" in said and "cannot be trusted; smooth = base" in said for said in plain.remarks)
    smooth = model.fit(measured, "k, c, a", smooth="base", set={"der(x)": 0})
    assert np.abs(off(smooth)).max() < 1 and not any("trusted" in said for said in smooth.remarks)
    stated = model.fit(measured, "k, c, a", noise="base = 0.5 mm", set={"der(x)": 0})
    assert np.abs(off(stated)).max() < 1
    for name in TRUE:  # the noise of the input is in the intervals
        assert stated.details["interval"][name] > 1.05 * plain.details["interval"][name]


def test_an_input_without_noise_is_not_told(model: mechc.Model, motion: Array) -> None:
    found = model.fit(data(motion, 7, of_base=0.0), "k, c, a", set={"der(x)": 0})
    assert np.abs(off(found)).max() < 1.6 and not found.remarks


@pytest.mark.slow
def test_intervals_hold_with_a_smoothed_input(model: mechc.Model, motion: Array) -> None:
    """Of 40 repetitions 95 % intervals hold in at least 33, but for one case in 500."""
    held = np.zeros(3)
    for seed in range(40):
        found = model.fit(data(motion, seed), "k, c, a", smooth="base", set={"der(x)": 0})
        held += np.abs(off(found)) <= 1
    assert held.min() >= 33


RIG = """\
model Rig "a damper that is moved by a measured stroke"
  parameter c_low(min = 0 N.s/m) = 3000 N.s/m;
  parameter c_high(min = 0 N.s/m) = 1000 N.s/m;
  parameter vk(min = 10 mm/s, max = 1 m/s) = 0.15 m/s;
  parameter F0 = 100 N "of the gas";
  input Length stroke(interpolation = "spline") = 0 mm;
  coordinate Length x;
  kinetic 1/2*1 kg*der(x)^2;
  drive x = stroke;
  let v = der(x);
  output force = F0 + c_high*v + (c_low - c_high)*vk*tanh(v/vk);
  experiment(stop = 4 s);
end Rig;
"""
DAMPER = {"c_low": 4200.0, "c_high": 900.0, "vk": 0.12, "F0": 140.0}
RASTER = np.arange(0, 2, 2e-3)
SPEED = 0.05 * 3 * np.pi * np.cos(3 * np.pi * RASTER)
FORCE_NOISE = 8.0


@pytest.fixture(scope="module")
def rig() -> mechc.Model:
    return mechc.loads(RIG)


def logged(seed: int) -> dict[str, Array]:
    """Rows whose time stamps jitter by 0.1 ms: noise of the stroke where it moves, and none where it turns back."""
    random = np.random.default_rng(seed)
    stamps = RASTER + random.normal(0, 1e-4, RASTER.size)
    stamps[0] = 0
    stroke = 0.05 * np.sin(3 * np.pi * RASTER) + random.normal(0, 2e-5, RASTER.size)
    force = DAMPER["F0"] + 900 * SPEED + 3300 * 0.12 * np.tanh(SPEED / 0.12)
    return {"time": stamps, "stroke": stroke, "force": force + random.normal(0, FORCE_NOISE, RASTER.size)}


def fit_of_rig(rig: mechc.Model, seed: int, **more: Any) -> tuple[Any, Array]:
    """Return the fit, and how far its values are from the true ones, over half the intervals."""
    found: Any = rig.fit(logged(seed), ",".join(DAMPER), **more)
    return found, np.array([(found[n] - true) / found.details["interval"][n] for n, true in DAMPER.items()])


def test_noise_of_time_stamps_is_that_of_each_row(rig: mechc.Model) -> None:
    """What the stroke adds to the noise of the force is small, as c_low shows where it turns back: with one size of noise for all rows
    the interval of c_low was a quarter too wide. All numbers of the force alone are a linear problem."""
    plain, _ = fit_of_rig(rig, 100)
    assert any("'stroke'" in said and "cannot be trusted" in said for said in plain.remarks)
    knee = np.tanh(SPEED / 0.12)
    slopes = [
        0.12 * knee,
        SPEED - 0.12 * knee,
        3300 * (knee - SPEED / 0.12 * (1 - knee**2)),
        np.ones(SPEED.size),
    ]
    alone = 1.96 * FORCE_NOISE * np.sqrt(np.diag(np.linalg.inv(np.inner(slopes, slopes))))
    for seed in (100, 101):
        found, off = fit_of_rig(rig, seed, smooth="stroke")
        half = np.array([found.details["interval"][name] for name in DAMPER])
        assert (half > 0.95 * alone).all() and (half < 1.15 * alone).all() and not found.remarks
        assert np.abs(off).max() < 1.5


@pytest.mark.slow
def test_intervals_hold_with_time_stamps_that_jitter(rig: mechc.Model) -> None:
    """Of 40 repetitions 95 % intervals hold in at least 33, but for one case in 500; of 200 they held in 193, 190, 193, 191."""
    off = np.array([fit_of_rig(rig, 100 + k, smooth="stroke")[1] for k in range(40)])
    assert (np.abs(off) <= 1).sum(axis=0).min() >= 33


def test_smoothing_is_that_of_scipy_and_can_be_repeated() -> None:
    """Where SciPy's own search finds a minimum, 150 rows that are 150 s apart; noise is told in any unit of the time."""
    random = np.random.default_rng(3)
    t = np.sort(random.uniform(0, 150, 150))
    values = np.sin(4 * t / 75) + 0.01 * random.normal(size=150)
    expected = make_smoothing_spline(t, values)(t)
    found = smoother(make_table(t, values, "spline"), "'u'")
    assert np.abs(found.table.values - expected).max() < 0.003  # a third of the noise: the minimum is flat
    assert found.noise == pytest.approx(0.01, rel=0.15)
    assert np.abs(found.of(values).values - found.table.values).max() < 1e-12
    given = make_smoothing_spline((t - t[0]) * (149 / np.ptp(t)), values, lam=found.stiffness)
    assert np.abs(given((t - t[0]) * (149 / np.ptp(t))) - found.table.values).max() < 1e-9
    again = found.of(2 * values + 3 + 5 * t).values  # linear in the values, and straight lines stay
    assert np.abs(again - (2 * found.table.values + 3 + 5 * t)).max() < 1e-7
    soon = smoother(make_table(t / 1e4, values, "spline"), "'u'")
    assert np.abs(soon.table.values - found.table.values).max() < 1e-9
    exact = smoother(make_table(TIMES, base(TIMES), "spline"), "'u'")
    assert exact.noise < 1e-5 * 0.05


@pytest.mark.parametrize(
    ("times", "kind", "words"),
    [
        (np.linspace(0, 2, 8), "spline", "10 rows"),
        (np.linspace(0, 2, 50), "step", "no steps"),
        (np.repeat(np.linspace(0, 2, 25), 2), "linear", "times that rise"),
    ],
)
def test_what_cannot_be_smoothed(times: Array, kind: str, words: str) -> None:
    values = 0.05 * np.sin(3 * np.pi * times)
    with pytest.raises(SimulationError, match=words):
        smoother(make_table(times, values, kind), "'u'")


def test_only_measured_inputs_are_smoothed(model: mechc.Model, motion: Array) -> None:
    with pytest.raises(SimulationError, match="'x' is to be smoothed, and is not a measured input"):
        model.fit(data(motion, 1), "k", smooth="x")
