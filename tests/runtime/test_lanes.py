"""Members of an ensemble side by side: against single runs, and the same bits wherever a member runs."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from shared_models import BALL, STIFF, WHIRL
from slow_params import slow_among

import mechc
from mechc.compiler import lanes as compiled_lanes
from mechc.compiler.program import Program
from mechc.compiler.targets.lanes import emit_lanes
from mechc.runtime.ensembles import lanes as chosen
from mechc.runtime.ensembles import run as ensemble_run
from mechc.runtime.ensembles.result import Ensemble

ROOT = Path(__file__).parents[2]

DRIVEN = """\
model Driven
  parameter l = 1 m;
  parameter k = 0.2;
  input Torque push = 0.1 N.m*cos(2 rad/s*time);
  input Force steady = 0 N;
  coordinate theta = 60 deg;
  coordinate x = 10 cm;
  kinetic 1/2*1 kg*(l*der(theta))^2 + 1/2*(1 + k*sin(theta)^2)*1 kg*der(x)^2;
  potential -9.81 N*l*cos(theta) + 1/2*40 N/m*x^2*exp(-k*cos(theta));
  damping 0.1 N.s/m on x;
  force push on theta;
  force steady on x;
  assert x < 30 cm, "too far";
  experiment(stop = 3 s, tolerance = 1e-9);
end Driven;
"""


ORBIT = """\
model Orbit
  dimensionless;
  parameter e = 0.5;
  coordinate x = 1 - e;
  coordinate y = 0;
  initial der(y) = sqrt((1 + e)/(1 - e));
  kinetic 1/2*(der(x)^2 + der(y)^2);
  potential -1/sqrt(x^2 + y^2);
  experiment(stop = 2*pi, tolerance = 1e-12);
end Orbit;
"""
WHIRL_ASKED: dict[str, Any] = {
    "vary": "m ~ uniform(0.4, 0.6 kg), a ~ normal(1 rad, 0.2 rad)",
    "keep": "final(a), max(b), min(der(a)), mean(a*b), first(a < 0 rad), a, energy.total",
    "samples": 60,
    "every": "0.25 s",
    "errors": "0.4",
    "lanes": "on",
}

KEEP = (
    "final(x), max(theta), min(energy.total), mean(x^2), first(theta < 0 rad), last = final(theta + x/(1 m))"
)
ARRAYS = ("numbers", "number_errors", "rows", "errors", "steps", "outcomes", "ends")


@pytest.fixture(scope="module")
def driven() -> mechc.Model:
    return mechc.loads(DRIVEN)


@pytest.fixture(scope="module")
def asked() -> dict[str, Any]:
    return {
        "vary": "l ~ uniform(0.8, 1.2 m), k ~ uniform(0, 0.4), steady ~ normal(0 N, 0.2 N), theta ~ normal(1 rad, 0.2 rad)",
        "keep": KEEP + ", x, energy.total",
        "samples": 60,
        "every": "0.5 s",
        "errors": "0.4",
    }


@pytest.fixture(scope="module")
def beside(driven: mechc.Model, asked: dict[str, Any]) -> Ensemble:
    return driven.ensemble(**asked, lanes="on", threads=1)


def test_members_are_the_runs_of_their_values(
    driven: mechc.Model, asked: dict[str, Any], beside: Ensemble
) -> None:
    alone = driven.ensemble(**asked, lanes="off")
    assert "lanes" in beside.build and alone.build == "compiled C"
    assert beside.counts() == alone.counts() == {"completed": 60}
    # steps of 1e-9, some 60 of them, in motions that keep their errors; both are off by that much
    np.testing.assert_allclose(beside.numbers, alone.numbers, rtol=2e-7, atol=2e-7)
    np.testing.assert_allclose(beside.rows, alone.rows, rtol=2e-7, atol=2e-7)
    assert abs(beside.steps.sum() / alone.steps.sum() - 1) < 0.02
    estimated = np.isfinite(alone.errors)
    np.testing.assert_array_equal(np.isfinite(beside.errors), estimated)
    np.testing.assert_allclose(beside.errors[estimated], alone.errors[estimated], rtol=0.5)
    single = driven.simulate(
        set={name: beside[name][7] for name in ("l", "k", "steady", "theta")}, tolerance=1e-13, every="0.5 s"
    )
    np.testing.assert_allclose(beside["x"][7], single["x"], atol=2e-7)


def test_threads_batches_and_neighbours_change_no_bit(
    driven: mechc.Model, asked: dict[str, Any], beside: Ensemble, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(ensemble_run, "LARGEST", 13)
    other = driven.ensemble(**asked, lanes="on", threads=3)
    for name in ARRAYS:
        np.testing.assert_array_equal(getattr(other, name), getattr(beside, name), err_msg=name)
    names = ("l", "k", "steady", "theta")
    rows = np.stack([beside[name] for name in names], axis=1)[[41, 7, 23]]
    few = driven.ensemble(**{**asked, "vary": {names: rows}, "samples": None, "errors": "none"}, lanes="on")
    np.testing.assert_array_equal(few.numbers, beside.numbers[[41, 7, 23]])


@pytest.mark.parametrize("method", slow_among(["taylor"], ["dop853", "taylor"]))
def test_all_widths_give_the_same_bits(method: str, monkeypatch: pytest.MonkeyPatch) -> None:
    asked = {**WHIRL_ASKED, "method": method}
    beside = mechc.loads(WHIRL).ensemble(**asked)
    if "not fused" in beside.build:
        pytest.skip("this processor does not fuse products and sums")
    whole, builds = compiled_lanes.build_lanes, set()
    for width in (2, 4, 8):
        monkeypatch.setattr(compiled_lanes, "build_lanes", partial(whole, width=width))
        other = mechc.loads(WHIRL).ensemble(**asked)  # a model remembers its lanes
        builds.add(other.build)
        for name in ARRAYS:
            np.testing.assert_array_equal(
                getattr(other, name), getattr(beside, name), err_msg=f"{name} {width}"
            )
    assert len(builds) == 3


def test_series_of_few_slots_in_lanes() -> None:
    """Six slots fill no vector of sums: an orbit of the period 2 pi comes back to where it began, whatever its eccentricity."""
    orbit = mechc.loads(ORBIT)
    runs = orbit.ensemble(
        "e ~ uniform(0.1, 0.7)", "final(x), final(y)", samples=24, method="taylor", lanes="on", errors="none"
    )
    np.testing.assert_allclose(runs["final(x)"], 1 - runs["e"], rtol=0, atol=1e-9)
    np.testing.assert_allclose(runs["final(y)"], 0, rtol=0, atol=1e-9)
    assert runs.steps.max() < 60


def test_taylor_series_in_lanes() -> None:
    """Lanes of members and of their companions, which have other orders, side by side."""
    model = mechc.loads(WHIRL)
    on = model.ensemble(**WHIRL_ASKED, method="taylor")
    exact = model.ensemble(
        **{**WHIRL_ASKED, "tolerance": 1e-14, "lanes": "off", "errors": "none"}, method="taylor"
    )
    assert "lanes" in on.build and on.counts() == {"completed": 60}
    # steps of 1e-10, some 25 of them
    np.testing.assert_allclose(on.numbers, exact.numbers, rtol=1e-8, atol=1e-8)
    np.testing.assert_allclose(on.rows, exact.rows, rtol=1e-8, atol=1e-8)
    estimated = np.isfinite(on.errors)
    assert 10 < estimated.sum() < 40 and 1e-14 < np.median(on.errors[estimated]) < 1e-8
    alone = model.ensemble(**{**WHIRL_ASKED, "lanes": "off"}, method="taylor")
    # exp(1/0.9 - 1): orders are 0.9 and 1.0 for each factor e of the tolerance
    assert 1 < on.steps.sum() / alone.steps.sum() < 1.25
    again = model.ensemble(**WHIRL_ASKED, method="taylor", threads=3)
    without = model.ensemble(**{**WHIRL_ASKED, "errors": "none"}, method="taylor")
    np.testing.assert_array_equal(again.rows, on.rows)
    np.testing.assert_array_equal(without.numbers, on.numbers)


SIZES = """\
model Sizes
  dimensionless;
  parameter e = 0.5;
  parameter size = 1;
  parameter bent = 0;
  coordinate x = size*(1 - e);
  coordinate y = 0;
  initial der(y) = size*sqrt((1 + e)/(1 - e));
  kinetic 1/2*(der(x)^2 + der(y)^2);
  potential -size^3/sqrt(x^2 + y^2);
  experiment(stop = 2*pi, tolerance = 1e-10);
end Sizes;
"""


def test_orders_of_single_precision_spoil_no_member_whose_numbers_do_not_fit() -> None:
    """The square of a radius of 1e25 is not a single, that of 1e-25 is zero: such members go on without a tail, and their neighbours
    do not feel it."""
    model = mechc.loads(SIZES)
    asked: dict[str, Any] = {
        "keep": "final(x/size), final(y/size)",
        "method": "taylor",
        "lanes": "on",
        "errors": "none",
    }
    few = 16
    rows = np.column_stack([np.linspace(0.1, 0.6, 3 * few), np.tile([1.0, 1e25, 1e-25], few)])
    all_sizes = model.ensemble({("e", "size"): rows}, **asked)
    np.testing.assert_allclose(all_sizes["final(x/size)"], 1 - rows[:, 0], rtol=0, atol=1e-8)
    np.testing.assert_allclose(all_sizes["final(y/size)"], 0, rtol=0, atol=1e-8)
    plain = model.ensemble({("e", "size"): rows[::3]}, **asked)
    np.testing.assert_array_equal(plain.numbers, all_sizes.numbers[::3])
    np.testing.assert_array_equal(plain.steps, all_sizes.steps[::3])
    assert (all_sizes.steps.reshape(few, 3) <= 1.5 * plain.steps[:, None] + 10).all()


def test_series_with_conditions() -> None:
    """A parameter chooses between two series; half of the members have each of them, beside each other."""
    text = SIZES.replace(
        "-size^3/sqrt(x^2 + y^2)", "if bent > 1 then 1/2*(x^2 + 4*y^2) else -size^3/sqrt(x^2 + y^2)"
    )
    model = mechc.loads(text.replace("stop = 2*pi", "stop = 6.28"))
    assert "single_pick" in emit_lanes(model.program(frozenset({"series"})), [("y", 0)], "taylor")
    bent = np.tile([0.0, 2.0], 12)
    rows = np.column_stack([np.linspace(0.1, 0.6, 24), bent])
    runs = model.ensemble({("e", "bent"): rows}, "final(x)", method="taylor", lanes="on", errors="none")
    exact = model.ensemble(
        {("e", "bent"): rows}, "final(x)", method="dop853", lanes="off", tolerance=1e-13, errors="none"
    )
    np.testing.assert_allclose(runs["final(x)"], exact["final(x)"], rtol=0, atol=1e-8)
    np.testing.assert_allclose(
        runs["final(x)"][bent > 1], ((1 - rows[:, 0]) * np.cos(6.28))[bent > 1], rtol=0, atol=1e-8
    )


MEANS = """\
model Means
  parameter m = 0.5 kg;
  coordinate a = 1 rad;
  coordinate b = 40 deg;
  state s = 0;
  state q = 0;
  kinetic 1/2*2 kg*(1 m*der(a))^2 + 1/2*m*(1 m*der(b))^2 + m*(1 m)^2*der(a)*der(b)*cos(a - b);
  potential -9.81 m/s^2*1 m*(2 kg*cos(a) + m*cos(b));
  equation der(s) = a*b/(1 s);
  equation der(q) = der(a)^2*(1 s);
  experiment(stop = 2 s, tolerance = 1e-12);
end Means;
"""


@pytest.mark.parametrize("lanes", ["on", "off"])
@pytest.mark.parametrize("method", slow_among(["taylor"], ["dop853", "taylor"]))
def test_means_are_as_good_as_the_motion(method: str, lanes: str) -> None:
    """Against states that are their integrals; the steps of Taylor's method are long."""
    runs = mechc.loads(MEANS).ensemble(
        "a ~ normal(1 rad, 0.2 rad)",
        "mean(a*b), final(s), mean(der(a)^2), final(q)",
        samples=40,
        method=method,
        lanes=lanes,
        errors="none",
    )
    np.testing.assert_allclose(runs["mean(a*b)"], runs["final(s)"] / 2, rtol=0, atol=2e-12)
    np.testing.assert_allclose(runs["mean(der(a)^2)"], runs["final(q)"] / 2, rtol=0, atol=2e-12)


def test_rotations_keep_their_length() -> None:
    top = mechc.load(ROOT / "examples" / "heavy_top_rotation.mech")
    asked: dict[str, Any] = {
        "vary": "m = 0.9 kg .. 1.1 kg, 3; Js = 0.19 kg.m^2 .. 0.21 kg.m^2, 3",
        "keep": "max(cos_nutation), min(tip[1]), R[1], R[2], R[3], R[4]",
        "every": "0.2 s",
        "errors": "all",
        "stop": "1 s",
    }
    on, off = top.ensemble(**asked, lanes="on"), top.ensemble(**asked, lanes="off")
    assert "lanes" in on.build and on.counts() == {"completed": 9}
    # at 1e-10 a step, some 50 steps
    np.testing.assert_allclose(on.numbers, off.numbers, atol=1e-8)
    np.testing.assert_allclose(on.rows, off.rows, atol=1e-8)
    lengths = np.sqrt(sum(on[f"R[{i}]"] ** 2 for i in range(1, 5)))
    np.testing.assert_allclose(lengths, 1.0, rtol=1e-15)
    assert np.nanmax(on.errors) < 1e-7


def test_members_in_trouble_are_told_as_single_runs_are(driven: mechc.Model) -> None:
    """Where an assertion fails, a start is refused, or a derivative is undefined."""
    asked: dict[str, Any] = {"vary": {"x": [0.1, 0.29, 0.5], "l": [1.0, -1.0, 0.0]}, "keep": "final(theta)"}
    on, off = driven.ensemble(**asked, lanes="on"), driven.ensemble(**asked, lanes="off")
    assert "lanes" in on.build
    np.testing.assert_array_equal(on.outcome_words, off.outcome_words)
    assert {"completed", "failed"} <= set(on.outcome_words.ravel())
    assert on.why() == off.why() and len(on.why()) >= 2
    np.testing.assert_allclose(on["final(theta)"], off["final(theta)"], rtol=1e-6)


def test_stiff_members_leave_their_lanes(monkeypatch: pytest.MonkeyPatch) -> None:
    model = mechc.loads(STIFF)
    monkeypatch.setattr("mechc.session.FEW_STEPS", 300)
    asked: dict[str, Any] = {"vary": {"mu": [1.0, 300.0, 2.0, 600.0]}, "keep": "final(x)", "errors": "all"}
    on, off = model.ensemble(**asked, lanes="on"), model.ensemble(**asked, lanes="off")
    assert "lanes" in on.build and on.counts() == {"completed": 4}
    assert on.steps.max() < 3000
    np.testing.assert_allclose(on["final(x)"], off["final(x)"], atol=1e-6)
    turning = model.ensemble(**asked, lanes="on", method="auto")
    assert turning.counts() == {"completed": 4} and turning.steps.max() < 3000
    np.testing.assert_allclose(turning["final(x)"], off["final(x)"], atol=1e-6)


def test_an_interrupted_ensemble_leaves_no_half_members(driven: mechc.Model) -> None:
    import signal

    def pressed(fraction: float) -> None:
        if not presses and fraction < 1:
            presses.append(fraction)
            signal.raise_signal(signal.SIGINT)

    presses: list[float] = []
    part = driven.ensemble(
        "l ~ uniform(0.8, 1.2 m)",
        "final(x)",
        samples=60_000,
        lanes="on",
        errors="all",
        threads=1,
        progress=pressed,
    )
    made = part.counts()
    assert presses and made.get("not made", 0) > 0
    waiting = part.outcome_words == "not made"
    assert np.isnan(part["final(x)"][waiting]).all() and np.isfinite(part["final(x)"][~waiting]).all()


@pytest.mark.slow
def test_lanes_are_compiled_where_they_pay(monkeypatch: pytest.MonkeyPatch) -> None:
    made: list[str] = []
    whole = compiled_lanes.build_lanes
    driven = mechc.loads(DRIVEN)  # that has no lanes yet

    def noted(program: Program, wanted: chosen.Wanted, method: str) -> Path:
        made.append(method)
        return whole(program, wanted, method)

    monkeypatch.setattr(compiled_lanes, "build_lanes", noted)
    few = driven.ensemble("k = 0 .. 0.4, 20", "final(x)", stop="0.1 s")
    assert not made and few.build == "compiled C" and not few.remarks
    many = driven.ensemble(f"k = 0 .. 0.4, {chosen.ENOUGH}", "final(x)", stop="0.1 s")
    assert made and "lanes" in many.build
    same = driven.ensemble(f"k = 0 .. 0.4, {chosen.ENOUGH}", "final(x)", stop="0.1 s", reproducible=True)
    assert same.build == "compiled C, reproducible" and "bits of the scalar kernel" in same.remarks[0]


@pytest.mark.parametrize(
    ("text", "settings", "said"),
    [
        (BALL, {"vary": "y = 1 m .. 2 m, 3"}, "events, contacts and switches"),
        (DRIVEN, {"vary": "l = 1 m .. 2 m, 3", "method": "radau5"}, "'radau5' takes no steps side by side"),
        (DRIVEN, {"vary": "l = 1 m .. 2 m, 3", "reproducible": True}, "the scalar kernel"),
        (DRIVEN, {"vary": "l = 1 m .. 2 m, 3", "lanes": "many"}, "'lanes' is auto or on or off"),
        (
            DRIVEN,
            {"vary": "l = 1 m .. 2 m, 3", "inputs": {"steady": "push.csv"}},
            "follow tables over time",
        ),
    ],
)
def test_what_lanes_cannot_do_is_said(
    text: str, settings: dict[str, Any], said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("push.csv").write_text("time,steady\n0,0\n1,1\n", encoding="utf-8")
    with pytest.raises(mechc.SimulationError, match=said):
        mechc.loads(text).ensemble(**{"lanes": "on", **settings})
    if settings.get("lanes") is None:
        assert mechc.loads(text).ensemble(**settings).build.startswith("compiled C")


PUSHED = """\
model Pushed
  dimensionless;
  parameter w = 3;
  coordinate x = 0.3;
  coordinate y = 0.1;
  initial der(x) = 0.4;
  kinetic 1/2*(der(x)^2 + der(y)^2);
  potential 1/24*(exp(2*x + 2*sqrt(3)*y) + exp(2*x - 2*sqrt(3)*y) + exp(-4*x)) + 0.05*x*cos(w*time);
  experiment(stop = 8, tolerance = 1e-10);
end Pushed;
"""
MOON = """\
model Moon
  parameter m = 6e24 kg;
  parameter G = 6.67e-11 N.m^2/kg^2;
  coordinate x = 3.8e8 m;
  coordinate y = 0 m;
  initial der(y) = 1 km/s;
  kinetic 1/2*7e22 kg*(der(x)^2 + der(y)^2);
  potential -G*m*7e22 kg/sqrt(x^2 + y^2);
  experiment(stop = 30 d, tolerance = 1e-10);
end Moon;
"""


@pytest.mark.slow
@pytest.mark.parametrize(
    ("text", "vary"), [(PUSHED, "w ~ uniform(1, 5)"), (MOON, "m ~ uniform(5.5e24 kg, 6.5e24 kg)")]
)
def test_series_of_the_time_and_of_numbers_that_are_no_singles(text: str, vary: str) -> None:
    """Time is counted in units of the step, as all else; the fourth power of a distance of 4e8 m is not a single."""
    model, kept = mechc.loads(text), "final(x), final(y)"
    on = model.ensemble(vary, kept, samples=40, method="taylor", lanes="on", errors="0.5")
    exact = model.ensemble(
        vary, kept, samples=40, method="dop853", lanes="off", tolerance=1e-13, errors="none"
    )
    size = np.abs(exact.numbers).max(axis=0)
    np.testing.assert_allclose(on.numbers / size, exact.numbers / size, rtol=0, atol=3e-10)
