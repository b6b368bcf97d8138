"""What is narrow and met on the way is seen, where steps would go over it."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq

import mechc
from mechc.runtime.native.build import find_compiler
from mechc.runtime.outcome import Outcome
from mechc.runtime.studies.runs import missed_feature_scan

pytestmark = pytest.mark.skipif(find_compiler() is None, reason="needs the kernel")

MOVING = (
    "coordinate x = -5 m;initial der(x) = {v} m/s;coordinate y = 1 m;kinetic 1/2*1 kg*(der(x)^2 + der(y)^2);"
    "potential 1/2*3 N/m*y^2;"
)


def remarks(run: mechc.Solution) -> list[str]:
    return [remark for remark in run.remarks if "passed over" in remark]


@pytest.mark.parametrize("width", [5e-3, 1e-3, 2e-4])
def test_a_hump_throws_back_what_comes_slowly(width: float) -> None:
    """1 J against half a joule; the time of the way back by quadrature, with x = a + s^2 from the turning point a."""
    text = MOVING.format(v=1) + f"potential 1 J*exp(-(x/({width} m))^2);experiment(stop = 10 s);"
    run = mechc.loads(text).simulate()
    a = width * math.sqrt(math.log(2))
    half = quad(lambda s: 2 * s / math.sqrt(-math.expm1((a**2 - (a + s**2) ** 2) / width**2)), 0, math.sqrt(5 - a), limit=500, points=[math.sqrt(width), 3 * math.sqrt(width)])[0]  # fmt: skip
    assert run.outcome is Outcome.COMPLETED, run.message
    assert run["der(x)"][-1] == pytest.approx(-1, rel=1e-6)
    assert run["x"][-1] == pytest.approx(-5 - (10 - 2 * half), rel=1e-6)
    assert any("looked for what is narrow every" in remark for remark in run.remarks)


def test_a_push_in_the_middle_of_a_swing() -> None:
    """100 N for some milliseconds upon an oscillator: the transform of a Gaussian gives what is left of it."""
    text = (
        "coordinate x = 1 m;kinetic 1/2*1 kg*der(x)^2;potential 1/2*4 N/m*x^2;"
        "force 100 N*exp(-((time - 5.5 s)/(1 ms))^2) on x;experiment(stop = 10 s);"
    )
    run = mechc.loads(text).simulate()
    w, width = 2.0, 1e-3
    push = 100 * width * math.sqrt(math.pi) * math.exp(-((w * width) ** 2) / 4)
    end = math.cos(w * 10) + push / w * math.sin(w * 4.5)
    assert run["x"][-1] == pytest.approx(end, abs=1e-6)
    (remark,) = remarks(run)
    assert remark.startswith("something narrow was passed over at t = 5.")


def test_a_tooth_in_a_table() -> None:
    text = MOVING.format(v=1) + "force table(x, {-90, -0.002, 0, 0.002, 90} m, {0, 0, 20, 0, 0} N) on x;"
    run = mechc.loads(text).simulate(stop=10)
    work = 2 * 0.002 * 10  # the curve is a cubic with slopes of zero on each side
    assert run["der(x)"][-1] == pytest.approx(math.sqrt(1 + 2 * work), rel=1e-6)
    assert remarks(run)


@pytest.mark.parametrize(
    "text",
    [
        MOVING.format(v=1) + "potential 1 J*exp(-(x/(1 m))^2);",
        MOVING.format(v=1) + "force 1 N*tanh(x/(1 m)) on x;contact wall: 3 m - x restitution 0.5;",
        MOVING.format(v=1) + "force -max(x, 0 m)*exp(1)*5 N/m on x;",
        "coordinate Rotation R;initial der(R) = {0.1, 3, 0} rad/s;inertia diag({1, 2, 3} kg.m^2) on world*R;"
        "state s = 0;equation der(s) = exp(-R[1]^2)*1 Hz;",
    ],
)
@pytest.mark.parametrize("tolerance", [1e-4, 1e-8, 1e-12])
def test_where_nothing_is_passed_over_nothing_is_repeated(text: str, tolerance: float) -> None:
    run = mechc.loads(text).simulate(stop=10, tolerance=tolerance)
    assert run.outcome is Outcome.COMPLETED
    assert not remarks(run)


def test_models_without_such_formulas_are_not_looked_at() -> None:
    plain = mechc.loads(
        "parameter a = 2;coordinate x = 1 m;kinetic 1/2*exp(-a)*1 kg*der(x)^2;potential 1/2*4 N/m*x^2;"
    )
    assert not plain.problem().narrow
    assert not np.any(["narrow" in remark for remark in plain.simulate(stop=5).remarks])


@pytest.mark.parametrize(("rate", "level"), [(1e5, 0.5), (1e6, 0.5), (1e5, 0.9), (3e6, 0.7)])
@pytest.mark.parametrize("moves", ["time/(1 s)", "x/(1 m)"])
def test_the_first_of_very_many_waves_in_a_step_that_is_high_enough(
    rate: float, level: float, moves: str
) -> None:
    """A wave that grows, thousands of which lie in a step, passes a level on the rise of the first crest above it."""
    text = f"""
    coordinate x = 0 m; initial der(x) = 1 m/s; kinetic 1/2*1 kg*der(x)^2;
    when {moves}*sin({rate}*{moves}) > {level} then terminate("there"); end when;
    """
    solution = mechc.loads(text).simulate(stop=1)
    assert isinstance(solution, mechc.Solution) and solution.outcome.name == "TERMINATED"
    crest = (np.ceil((level * rate - np.pi / 2) / (2 * np.pi) - 0.01) * 2 * np.pi + np.pi / 2) / rate
    while crest * np.sin(rate * crest) <= level:
        crest += 2 * np.pi / rate
    first = brentq(lambda t: t * np.sin(rate * t) - level, crest - np.pi / 2 / rate, crest, xtol=1e-16)
    assert solution.time[-1] == pytest.approx(first, abs=1e-13)


@pytest.mark.parametrize(("at", "jump", "step"), [(0.69, 0.005, 0.38), (0.32, 0.007, 0.21)])
def test_what_a_run_saw_is_no_error_where_its_companion_passed_over_it(
    at: float, jump: float, step: float
) -> None:
    text = (
        f"coordinate x = 0 m;initial der(x) = 0.5 m/s;kinetic 1/2*2 kg*der(x)^2;force 300 N*exp(-((time - {at} s)/(1 ms))^2) on x;"
        f"coordinate y = 0 m;initial der(y) = 0.5 m/s;kinetic 1/2*1 kg*der(y)^2;force (if time < {jump} s then 1 N else 3 N) on y;"
        f"potential (if y < {step} m then 0 J else 0.1 J);experiment(stop = 1 s);"
    )
    run = mechc.loads(text).simulate(tolerance=1e-9)
    push = 300 * 1e-3 * math.sqrt(math.pi) / 2
    assert run["x"][-1] == pytest.approx(0.5 + push * (1 - at), abs=1e-9)
    assert run.accuracy.error is not None
    assert run.accuracy.error.largest < 1e-7


def test_a_jump_at_the_end_of_a_step_is_nothing_that_was_passed_over(monkeypatch: pytest.MonkeyPatch) -> None:
    """What seemed to be seen there asked for steps of a microsecond, with which no run came to its end, and nobody looked again."""
    seen: list[missed_feature_scan.MissedFeature | None] = []
    look = missed_feature_scan.look_between

    def looking(*given: Any) -> Any:
        seen.append(look(*given))
        return seen[-1]

    monkeypatch.setattr(missed_feature_scan, "look_between", looking)
    text = (
        "coordinate x = 0 m;initial der(x) = 0.5 m/s;kinetic 1/2*2 kg*der(x)^2;force 0.1 N*exp(-((time - 0.5 s)/(1 s))^2) on x;"
        "force (if time < 0.01 s then 0.1 N else 0.4 N) on x;experiment(stop = 1 s);"
    )
    mechc.loads(text).simulate(tolerance=1e-9)
    assert seen
    assert all(found is not None and found.step is None for found in seen)


def test_an_error_of_steps_is_no_narrow_feature() -> None:
    """At tight tolerances an error of some hundred tolerances is stated, not met by a hundred thousand steps."""
    text = """
    coordinate x = 0 m;
    kinetic 1/2*1 kg*der(x)^2;
    potential 1/2*1600 N/m*x^2;
    parameter v0 = 1 m/s;
    let v = der(x)/v0;
    force 120 N + 80 N*cos(2*pi*time/1 s) - 20 N*(1 + 0.5*exp(-abs(v)))*tanh(v/0.1) on x;
    experiment(stop = 1 s);
    """
    model = mechc.loads(text)
    run, closer = (model.simulate(tolerance=tolerance) for tolerance in (1e-12, 1e-14))
    assert not remarks(run)
    assert run.statistics.steps < 1000
    error = run.accuracy.error
    assert error is not None
    for name in ("x", "der(x)"):
        off = np.abs(run[name] - closer[name]) / (np.abs(closer[name]) + np.abs(closer[name]).max())
        assert off.max() <= 2 * error.largest < 2e-9
