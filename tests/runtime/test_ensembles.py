"""Ensembles against closed forms and against single runs, and the same bits however they are cut."""

from __future__ import annotations

import csv
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from shared_models import STIFF

import mechc
from mechc.requests.parse_values import UsageMistake
from mechc.runtime.ensembles import run as ensemble_run
from mechc.runtime.ensembles.batches import estimated
from mechc.runtime.ensembles.files import read_ensemble
from mechc.runtime.results.files import ResultsFileError

ROOT = Path(__file__).parents[2]

SPRING = """\
model Spring
  parameter k = 1 N/m;
  parameter a = 1 m;
  coordinate x = a;
  kinetic 1/2*1 kg*der(x)^2;
  potential 1/2*k*x^2;
  experiment(stop = 10 s, tolerance = 1e-10);
  experiment wide(a = 3*k*1 m^2/N, stop = 10 s);
  experiment long(stop = 10 s*k/(1 N/m));
  experiment scan(k in {1, 4} N/m, stop = 1 s);
  experiment cloud(k ~ uniform(1 N/m, 4 N/m), a ~ lognormal(20 cm, 0.1), stop = 1 s, samples = 40, seed = 5,
    sampling = "latin", keep = {max(x), first(x < 0 m)}, errors = "all");
  experiment kept(k in {1, 4} N/m, stop = 1 s, keep = {min(x)});
end Spring;
"""

BALL = """\
model Ball
  parameter e = 0.8;
  input Force push = 0 N;
  discrete Integer hits = 0;
  coordinate Length y = 1 m;
  kinetic 1/2*1 kg*der(y)^2;
  potential 1 kg*9.81 m/s^2*y;
  force push on y;
  contact floor: y restitution e;
  when y > 1.5 m then
    terminate("too high");
  end when;
  assert y > -1 m, "below";
  experiment(stop = 2 s);
end Ball;
"""


@pytest.fixture(scope="module")
def spring() -> mechc.Model:
    return mechc.loads(SPRING)


@pytest.fixture(scope="module")
def ball() -> mechc.Model:
    return mechc.loads(BALL)


def test_what_is_kept_is_that_of_the_closed_form(spring: mechc.Model) -> None:
    keep = (
        "final(x), max(x), min(der(x)), mean(x^2), zero = first(x < 0 m), first(x > 5 m), max(x - 1 m, x), x"
    )
    runs = spring.ensemble({"k": "1 N/m .. 9 N/m, 5", "a": [0.5, 2.0]}, keep, errors="all", every="0.5 s")
    k, a = runs["k"], runs["a"]
    assert runs.shape == (5, 2) and runs.dimensions == ("k", "a")
    w, t = np.sqrt(k), 10.0
    expected = {
        "final(x)": a * np.cos(w * t),
        "max(x)": a,
        "min(der(x))": -a * w,
        "mean(x^2)": a**2 * (0.5 + np.sin(2 * w * t) / (4 * w * t)),
        "zero": np.pi / 2 / w,
    }
    for name, values in expected.items():
        # tolerance 1e-10 a step, some 100 steps, values up to 4; errors grow linearly
        np.testing.assert_allclose(runs[name], values, atol=3e-8, err_msg=name)
        assert (np.abs(runs[name] - values) <= 10 * runs.error(name) + 1e-9).all(), name
    loose = spring.ensemble({"k": "1 N/m .. 9 N/m, 5", "a": [0.5, 2.0]}, keep, errors="all", tolerance=1e-5)
    for name in ("final(x)", "mean(x^2)", "zero"):
        off, told = np.abs(loose[name] - expected[name]), loose.error(name)
        assert (off <= 10 * told).all() and (told <= 10 * off).all() and off.max() > 1e-8, name
    assert np.isnan(runs["first(x > 5 m)"]).all()
    np.testing.assert_allclose(runs["x"], a[..., None] * np.cos(w[..., None] * runs.times), atol=3e-8)
    assert runs["max(x - 1 m, x)"].shape == (5, 2, 21)
    assert runs.unit("zero") == "s" and runs.unit("mean(x^2)") == "m^2"


def test_a_member_is_the_run_of_its_values(spring: mechc.Model) -> None:
    """Every bit, where both have code of the same bits: of a single run libtcc makes the code, of an ensemble gcc."""
    runs = spring.ensemble("k = 1 N/m .. 9 N/m, 7", "x, final(x)", errors="none", reproducible=True)
    assert np.isnan(runs.errors).all()
    for k, x in zip(runs["k"], runs["x"], strict=True):
        np.testing.assert_array_equal(spring.simulate(set={"k": k}, reproducible=True)["x"], x)


def test_threads_and_batches_change_no_bit(spring: mechc.Model, monkeypatch: pytest.MonkeyPatch) -> None:
    asked: dict[str, Any] = {
        "vary": "k ~ uniform(1, 9 N/m), a ~ normal(1 m, 0.1 m)",
        "keep": "max(x), mean(x), x",
    }
    asked |= {"samples": 300, "every": "2 s", "errors": "0.3"}
    one = spring.ensemble(**asked, threads=1)
    monkeypatch.setattr(ensemble_run, "LARGEST", 17)
    three = spring.ensemble(**asked, threads=3)
    for name in ("numbers", "number_errors", "rows", "errors", "steps", "outcomes", "ends"):
        np.testing.assert_array_equal(getattr(one, name), getattr(three, name), err_msg=name)
    # nor does it matter which members are estimated, nor what else is kept over time
    none = spring.ensemble(**asked | {"errors": "none"})
    np.testing.assert_array_equal(none.numbers, one.numbers)
    part = spring.ensemble({"k": one["k"][5:6]}, asked["keep"], set={"a": one["a"][5]}, every="2 s")
    np.testing.assert_array_equal(part.numbers[0], one.numbers[5])


def test_experiments_hold_for_members(spring: mechc.Model) -> None:
    wide = spring.ensemble("k = 1 N/m .. 4 N/m, 4", "max(x)", experiment="wide")
    np.testing.assert_allclose(wide["max(x)"], 3 * wide["k"], rtol=1e-8)
    scan = spring.ensemble("a = 1 m .. 2 m, 3", "max(x)", experiment="scan")
    assert scan.dimensions == ("k", "a") and scan.shape == (2, 3)
    np.testing.assert_array_equal(scan["k"][:, 0], [1.0, 4.0])
    over = spring.ensemble("k = 1 N/m .. 2 N/m, 3", "max(x)", experiment="scan")
    assert over.shape == (3,)
    with pytest.raises(mechc.SimulationError, match="differ from member to member"):
        spring.ensemble("k = 1 N/m .. 4 N/m, 4", experiment="long")
    assert spring.ensemble("k = 1 N/m .. 4 N/m, 4", experiment="long", stop="1 s").complete


def test_events_inputs_and_ends(ball: mechc.Model) -> None:
    keep = "n = events(impact, floor), events(when), max(y), min(y), final(y), first(y < 0.5 m)"
    runs = ball.ensemble({"e": [0.5, 0.9], "push": [0.0, 20.0]}, keep, errors="all")
    for i, j in np.ndindex(2, 2):
        single = ball.simulate(set={"e": runs["e"][i, j], "push": runs["push"][i, j]})
        impacts = sum(event.kind == "impact" for event in single.events)
        assert runs["n"][i, j] == impacts
        assert runs.outcome_words[i, j] == single.outcome.value
        np.testing.assert_allclose(runs["final(y)"][i, j], single["y"][-1], rtol=1e-7, atol=1e-9)
    assert (runs["n"][:, 0] >= 2).all()
    np.testing.assert_array_equal(runs.outcome_words[:, 1], "terminated")
    np.testing.assert_array_equal(runs["events(when)"][:, 1], 1)
    np.testing.assert_allclose(runs["max(y)"][:, 1], 1.5, rtol=1e-9)
    np.testing.assert_allclose(runs["max(y)"][:, 0], 1.0, rtol=1e-9)
    np.testing.assert_allclose(runs["min(y)"][:, 0], 0.0, atol=1e-8)
    np.testing.assert_allclose(runs["first(y < 0.5 m)"][:, 0], np.sqrt(1 / 9.81), rtol=1e-8)


def test_a_member_that_fails_is_a_row_with_its_reason(ball: mechc.Model) -> None:
    runs = ball.ensemble({"e": [0.5, 1.5, -1.0], "y": [1.0, -0.5]}, "final(y)")
    assert runs.outcome.value == "completed" and runs.counts() == {"completed": 1, "failed": 5}
    assert np.isfinite(runs["final(y)"]).sum() == 1
    assert "restitution" in runs.reason(1, 0) and runs.reason(0, 0) == ""
    assert sum(runs.why().values()) == 5


def test_stiff_members_get_an_implicit_method(monkeypatch: pytest.MonkeyPatch) -> None:
    model = mechc.loads(STIFF)
    monkeypatch.setattr("mechc.session.FEW_STEPS", 300)
    runs = model.ensemble({"mu": [1.0, 300.0]}, "final(x)", errors="all")
    assert runs.counts() == {"completed": 2}
    assert runs.steps[1] < 3000  # without the Jacobian it is some 8000
    single = model.simulate(set={"mu": 300.0}, tolerance=1e-10, method="radau5")["x"][-1]
    np.testing.assert_allclose(runs["final(x)"][1], single, atol=1e-6)


def test_clouds_have_the_distributions_that_were_asked_for(spring: mechc.Model) -> None:
    vary = "k ~ lognormal(2 N/m, 0.5); a ~ triangular(1 m, 2 m, 4 m); x ~ normal(1 m); der(x) ~ normal(2 m/s)"
    covariance = [[0.04, 0.03], [0.03, 0.09]]
    n = 4096
    for sampling in ("plain", "latin", "sobol"):
        runs = spring.ensemble(
            vary, "final(x)", samples=n, sampling=sampling, covariance=covariance, stop="0 s", errors="none"
        )
        log = np.log(runs["k"])
        five = 5 / np.sqrt(n)  # five standard errors of a mean of unit deviation
        assert abs(log.mean() - np.log(2)) < 0.5 * five and abs(log.std() - 0.5) < 0.5 * five
        assert abs(runs["a"].mean() - 7 / 3) < 0.63 * five and runs["a"].min() > 1 and runs["a"].max() < 4
        found = np.cov(runs["x"], runs["der(x)"])
        np.testing.assert_allclose(found, covariance, atol=0.09 * np.sqrt(2) * five)
        assert not runs.remarks
    again = spring.ensemble(vary, samples=n, sampling="sobol", covariance=covariance, stop="0 s", seed=2)
    assert (again["k"] != runs["k"]).all()
    assert "power of two" in spring.ensemble("a ~ uniform(1, 2 m)", samples=10, sampling="sobol").remarks[0]


def test_a_twentieth_is_estimated_by_its_number_alone() -> None:
    flags = estimated(0, 100_000, 0.05)
    assert abs(flags.mean() - 0.05) < 5 * np.sqrt(0.05 * 0.95 / 1e5)
    np.testing.assert_array_equal(estimated(40_000, 50_000, 0.05), flags[40_000:50_000])
    assert estimated(0, 10, 1.0).all() and not estimated(0, 10, 0.0).any()


def test_sobol_indices_are_those_of_the_variance(spring: mechc.Model) -> None:
    # x(0) = a + nothing of k: all variance is that of a; of a k it is split: 4/7 and 3/7 hold for [0, 1] x [0, 1]
    runs = spring.ensemble(
        "k ~ uniform(0, 1 N/m), a ~ uniform(0, 1 m)", "final(x), final(k*a)", samples=4000, stop="0 s"
    )
    assert runs.sobol("final(x)") == pytest.approx({"k": 0.0, "a": 1.0}, abs=0.03)
    assert runs.sobol("final(k*a)") == pytest.approx({"k": 3 / 7, "a": 3 / 7}, abs=0.06)


def test_members_from_a_file(spring: mechc.Model, tmp_path: Path) -> None:
    file = tmp_path / "members.csv"
    file.write_text("k [N/m],a [cm]\n1,50\n4,200\n", encoding="utf-8")
    runs = spring.ensemble(file, "max(x)")
    assert runs.shape == (2,) and runs.dimensions == ("sample",)
    np.testing.assert_allclose(runs["max(x)"], [0.5, 2.0], rtol=1e-8)
    rows = np.array([[1.0, 0.5], [4.0, 2.0]])
    listed = spring.ensemble({("k", "a"): rows}, "max(x)")
    np.testing.assert_array_equal(listed["max(x)"], runs["max(x)"])
    with pytest.raises(UsageMistake, match="rows of 2 finite numbers"):
        spring.ensemble({("k", "a"): rows[0]}, "max(x)")


@pytest.mark.parametrize(
    ("settings", "said"),
    [
        ({"vary": "k = 2 N/m"}, "a range, a list or a distribution"),
        ({"vary": "k = 1 N/m .. 2 N/m"}, "the number of values of 'k' is missing"),
        ({"vary": "k = 1 N/m .. 2 N/m, 0"}, "a whole number from 1 on"),
        ({"vary": "k = {} N/m"}, "'k' has no values"),
        ({"vary": "a = 1 m .. 2 m, 3; k = { }"}, "'k' has no values"),
        ({"vary": "k = 1 N/m .. 1 N/m, 3"}, "begins where it ends"),
        ({"vary": "k = 1 m .. 2 N/m, 3"}, "has the unit"),
        ({"vary": "q = 1 .. 2, 3"}, "no parameter, initial value or input 'q'"),
        ({"vary": "k ~ nomal(1, 2 N/m)"}, "did you mean 'normal'"),
        ({"vary": "k ~ uniform(2, 1 N/m)"}, "from a lower to a higher value"),
        ({"vary": "k ~ normal(1, -2 N/m)"}, "positive"),
        ({"vary": "k ~ triangular(1, 2 N/m)"}, "low, mode and high"),
        ({"vary": "200"}, "takes names"),
        ({"vary": "k = 1 .. 2 N/m, 3", "keep": "first(x)"}, "one comparison"),
        ({"vary": "k = 1 .. 2 N/m, 3", "keep": "final(x, k)"}, "of one formula"),
        ({"vary": "k = 1 .. 2 N/m, 3", "errors": "some"}, "all, none or a share"),
    ],
)
def test_what_is_written_wrongly_is_told(spring: mechc.Model, settings: dict[str, Any], said: str) -> None:
    with pytest.raises(UsageMistake, match=said):
        spring.ensemble(**settings)


@pytest.mark.parametrize(
    ("settings", "said"),
    [
        ({}, "nothing varies"),
        ({"vary": "k ~ normal(1, 2 N/m)"}, "the number of samples is missing"),
        ({"vary": "k ~ normal(1 N/m)", "samples": 3}, "no standard deviation"),
        ({"vary": "k = 1 .. 2 N/m, 3", "samples": 3}, "nothing is drawn"),
        ({"vary": "k = 1 .. 2 N/m, 3; k ~ uniform(1, 2 N/m)", "samples": 3}, "varies twice"),
        ({"vary": "k = 1 .. 2 N/m, 3", "set": {"k": 1.0}}, "set to one value as well"),
        ({"vary": "k = 1 .. 2 N/m, 1e5; a = 1 .. 2 m, 1e4"}, r"1e\+09 members.*GB"),
        ({"vary": "k = 1 .. 2 N/m, 1e6", "keep": "x"}, "at 500 times"),
        ({"vary": "k = 1 .. 2 N/m, 3", "keep": "events(impact)"}, "has none"),
        ({"vary": "k = 1 .. 2 N/m, 3", "keep": "x, x"}, "kept twice"),
        ({"vary": {"k": []}}, "'k' has no values"),
        ({"vary": "k ~ uniform(1, 2 N/m)", "samples": 10**9}, r"1e\+09 members.*50 GB"),
        ({"vary": "k ~ normal(1 N/m)", "samples": 3, "covariance": "{{1, 2}, {2, 1}}"}, "1 normal"),
        (
            {"vary": "k ~ normal(1 N/m), a ~ normal(1 m)", "samples": 3, "covariance": "{{1, 2}, {2, 1}}"},
            "definite",
        ),
        ({"vary": "k ~ uniform(1, 2 N/m)", "samples": 3, "sampling": "grid"}, "no sampling"),
    ],
)
def test_what_does_not_fit_is_told(spring: mechc.Model, settings: dict[str, Any], said: str) -> None:
    with pytest.raises(mechc.SimulationError, match=f"(?s){said}"):
        spring.ensemble(**settings)


def test_files_give_the_same_ensemble_back(ball: mechc.Model, tmp_path: Path) -> None:
    runs = ball.ensemble(
        {"e": [0.5, 1.5], "y": "~ uniform(1, 2 m)"}, "max(y), y", samples=3, every="0.5 s", errors="all"
    )
    runs.save(tmp_path / "runs.npz")
    again = read_ensemble(tmp_path / "runs.npz")
    assert again.names == runs.names and again.texts == runs.texts and again.shape == runs.shape
    for name in (*runs.names, "e", "y"):
        np.testing.assert_array_equal(again[name], runs[name])
    assert again.unit("max(y)") == "m" and again.counts() == {"completed": 3, "failed": 3}
    runs.save(tmp_path / "runs.csv")
    with (tmp_path / "runs.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 6 * runs.times.size
    column = np.array([float(row["y [m]"] or "nan") for row in rows]).reshape(runs["y"].shape)
    np.testing.assert_array_equal(column, runs["y"])
    frame = runs.to_dataframe()
    assert len(frame) == 6 and list(frame["outcome"]) == list(runs.outcome_words.ravel())
    with pytest.raises(ResultsFileError, match="not as"):
        runs.save(tmp_path / "runs.xls")
    assert {file.name for file in tmp_path.iterdir()} == {"runs.npz", "runs.csv"}


@pytest.mark.parametrize("ending", ["nc", "zarr"])
def test_named_dimensions_go_through_files(spring: mechc.Model, tmp_path: Path, ending: str) -> None:
    xarray = pytest.importorskip("xarray")
    pytest.importorskip("netCDF4" if ending == "nc" else "zarr")
    runs = spring.ensemble("k = 1 .. 2 N/m, 3; a = 1 .. 2 m, 2", "max(x), x", every="5 s")
    runs.save(tmp_path / f"runs.{ending}")
    options = {"engine": "zarr", "consolidated": False} if ending == "zarr" else {}
    found = xarray.open_dataset(tmp_path / f"runs.{ending}", **options)
    assert found["x"].dims == ("k", "a", "time") and found["x"].attrs["units"] == "m"
    np.testing.assert_array_equal(found["max(x)"].sel(a=2.0).values, runs["max(x)"][:, 1])
    np.testing.assert_array_equal(found["k"].values, [1.0, 1.5, 2.0])
    assert found["outcome"].attrs["flag_meanings"].split()[1] == "completed"


@pytest.mark.parametrize(
    "asked",
    [
        {"vary": "k = 1 .. 2 N/m, 3; a = 1 .. 2 m, 2", "keep": "max(x), x, x/(1 m)"},
        {"vary": "k = 1 .. 2 N/m, 2; a ~ uniform(1 m, 2 m)", "keep": "max(x/(2 m))", "samples": 3},
    ],
)
def test_files_are_those_of_xarray(spring: mechc.Model, asked: dict[str, Any], tmp_path: Path) -> None:
    """Written without xarray, whose import takes most of the time of a small ensemble."""
    xarray = pytest.importorskip("xarray")
    pytest.importorskip("netCDF4")
    runs = spring.ensemble(**asked, every="5 s")
    runs.save(tmp_path / "own.nc")
    whole = runs.to_xarray()
    named = whole.rename({name: str(name).replace("/", " per ") for name in whole.data_vars})
    named.to_netcdf(tmp_path / "theirs.nc")
    with (
        xarray.open_dataset(tmp_path / "own.nc") as own,
        xarray.open_dataset(tmp_path / "theirs.nc") as theirs,
    ):
        assert own.identical(theirs)
        for name in (*own.data_vars, *own.coords):
            assert own[name].encoding["dtype"] == theirs[name].encoding["dtype"], name


def test_an_interrupted_ensemble_goes_on(spring: mechc.Model, tmp_path: Path) -> None:
    file = tmp_path / "runs.npz"
    asked: dict[str, Any] = {"vary": "k = 1 .. 9 N/m, 1000", "keep": "max(x)", "store": str(file)}
    whole = spring.ensemble("k = 1 .. 9 N/m, 1000", "max(x)")

    presses: list[float] = []

    def pressed(fraction: float) -> None:
        if fraction > 0.3 and not presses:
            presses.append(fraction)
            signal.raise_signal(signal.SIGINT)

    part = spring.ensemble(**asked, progress=pressed, threads=1)
    made = part.counts()
    assert part.outcome.value == "interrupted" and made["not made"] + made["completed"] == 1000
    pieces = list((tmp_path / "runs.npz.parts").glob("*.npz"))
    assert pieces and made["completed"] >= 64 * len(pieces)
    with pytest.raises(ResultsFileError, match="another ensemble"):
        spring.ensemble(**asked | {"keep": "min(x)"}, resume=True)
    seen: list[float] = []
    again = spring.ensemble(**asked, resume=True, progress=seen.append)
    assert again.complete and seen[0] > 0.06  # goes on after the pieces
    np.testing.assert_array_equal(again.numbers, whole.numbers)
    assert not (tmp_path / "runs.npz.parts").exists()
    with pytest.raises(mechc.SimulationError, match="no file is named"):
        spring.ensemble("k = 1 .. 9 N/m, 3", resume=True)


def test_experiments_say_what_is_drawn_and_kept(spring: mechc.Model) -> None:
    said = spring.ensemble(experiment="cloud")
    assert said.names == ("max(x)", "first(x < 0 m)") and len(said) == 40
    asked = spring.ensemble(
        "k ~ uniform(1, 4 N/m), a ~ lognormal(20 cm, 0.1)",
        "max(x), first(x < 0 m)",
        samples=40,
        seed=5,
        sampling="latin",
        errors="all",
        stop="1 s",
        tolerance=1e-8,
    )
    np.testing.assert_array_equal(said.numbers, asked.numbers)
    np.testing.assert_array_equal(said.number_errors, asked.number_errors)
    np.testing.assert_allclose(said["max(x)"], said["a"], rtol=1e-9)
    other = spring.ensemble("a = 1 m .. 2 m, 3", experiment="cloud")
    assert other.shape == (3,) and other.names == said.names
    kept = spring.ensemble(experiment="kept")
    np.testing.assert_allclose(kept["min(x)"], [np.cos(1.0), np.cos(2.0)], atol=1e-8)
    for question in (spring.simulate, spring.sweep, spring.virial):
        with pytest.raises(mechc.SimulationError, match="draws at random: k ~ uniform"):
            question(experiment="cloud")


def test_both_tables_of_distributions_agree() -> None:
    from mechc.compiler.flat.statements.ensembles import DISTRIBUTIONS
    from mechc.runtime.ensembles.members import NUMBERS

    assert {name: len(words) for name, words in DISTRIBUTIONS.items()} == {
        n: most for n, (_, most) in NUMBERS.items()
    }


@pytest.mark.parametrize(
    ("drawn", "code"),
    [
        ("k ~ normal(1 N/m)", "E0809"),
        ("k ~ uniform(1 N/m, 2 m)", "E0303"),
        ("k ~ uniform(1 N/m, k)", "E0"),
        ("samples in {1, 2}", "E0804"),
        ("q ~ uniform(1, 2)", "E0801"),
    ],
)
def test_wrong_distributions_are_told_where_they_stand(drawn: str, code: str) -> None:
    text = SPRING.replace("k in {1, 4} N/m, stop = 1 s);", f"{drawn}, stop = 1 s);", 1)
    with pytest.raises(mechc.CompileError, match=code):
        mechc.loads(text)


@pytest.mark.slow
@pytest.mark.parametrize(
    "name", ["double_pendulum", "henon_heiles", "kepler", "coulomb_pendulum", "vertically_driven_pendulum"]
)
def test_errors_hold_for_99_of_100_members(name: str) -> None:
    """Of 2000 members spread by a tenth; the reference is the same kernel at 1e-12, whose own estimate is far below."""
    model = mechc.load(ROOT / "examples" / f"{name}.mech")
    start, names = model.simulate(estimate_error=False), [q.name for q in model.coordinates]
    spread = {q: 0.1 * abs(float(start[q][0])) + 0.01 for q in names[:2]}
    vary = {q: f"~ uniform({start[q][0] - d}, {start[q][0] + d})" for q, d in spread.items()}
    keep = ", ".join([*(f"final({q})" for q in names), f"max({names[0]})", f"mean({names[0]}^2)"])
    runs = model.ensemble(vary, keep, samples=2000, errors="all")
    exact = model.ensemble(vary, keep, samples=2000, errors="none", tolerance=1e-12)
    assert runs.counts() == {"completed": 2000}
    for one in runs.names:
        off = np.abs(runs[one] - exact[one])
        assert np.mean(off <= 10 * runs.error(one) + 1e-13 * np.abs(exact[one])) >= 0.99, one


@pytest.mark.slow
def test_a_million_members_take_less_than_300_megabytes() -> None:
    if not Path("/proc/self/status").exists():
        pytest.skip("needs Linux, which tells the peak of a process without that of who began it")
    script = f"""
import mechc
model = mechc.loads({SPRING!r})
runs = model.ensemble("k ~ uniform(1, 4 N/m), a ~ normal(1 m, 1 cm)", "max(x), final(x), mean(x)", samples=10**6, stop="1 s")
assert runs.counts() == {{"completed": 10**6}}
print(next(line.split()[1] for line in open("/proc/self/status") if line.startswith("VmHWM")))
"""
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert int(done.stdout) * 1024 < 300e6


HANGING = """\
model Hanging
  parameter w = 1 rad/s;
  coordinate x = 1 m;
  kinetic 1/2*1 kg*der(x)^2;
  potential 1/2*1 kg*(w/(1 rad))^2*x^2;
  experiment(stop = 1 s);
end Hanging;
"""
"""A member with w = 1e9 takes some 1e9 steps."""


@pytest.mark.parametrize("lanes", ["off", "on"])
def test_a_member_that_hangs_is_a_row_with_its_reason(lanes: str) -> None:
    model = mechc.loads(HANGING)
    values = np.linspace(1.0, 9.0, 100)
    values[7] = 1e9
    runs = model.ensemble({"w": values}, "final(x), x", lanes=lanes, time_limit="0.1 s", every="0.5 s")
    assert runs.counts() == {"completed": 99, "failed": 1} and runs.outcome_words[7] == "failed"
    assert "longer than the time limit of a member, 0.1 s" in runs.reason(7)
    assert np.isnan(runs["x"][7]).all() and np.isnan(runs.ends[7]) and runs.steps[7] == 0
    good = np.arange(100) != 7
    alone = model.ensemble({"w": values[good]}, "final(x), x", lanes=lanes, every="0.5 s")
    np.testing.assert_array_equal(runs["x"][good], alone["x"])


def test_wrong_time_limits_are_told(spring: mechc.Model) -> None:
    for wrong in ("0 s", "-1 s", "1 m", "soon", -2):
        with pytest.raises(UsageMistake, match="time_limit"):
            spring.ensemble("k = 1 .. 9 N/m, 3", time_limit=wrong)


def test_members_whose_second_run_ends_otherwise_are_doubtful() -> None:
    """A swing of height 1 m that ends the run above h: near h = 1 m an error of the run decides how it ends."""
    model = mechc.loads(
        "model Edge\n  parameter h = 1 m;\n  coordinate x = 0 m;\n  initial der(x) = 1 m/s;\n"
        "  kinetic 1/2*1 kg*der(x)^2;\n  potential 1/2*1 N/m*x^2;\n"
        '  when x > h then\n    terminate("high");\n  end when;\n  experiment(stop = 20 s);\nend Edge;\n'
    )
    heights = np.concatenate(([0.9, 1.1], 1 + np.linspace(-1e-5, 1e-5, 81)))
    runs = model.ensemble({"h": heights}, "final(x)", errors="all", tolerance=1e-3)
    said = runs.outcome_words
    assert list(said[:2]) == ["terminated", "completed"]
    doubtful = np.flatnonzero(said == "doubtful")
    assert doubtful.size and (np.abs(heights[doubtful] - 1) < 1e-5).all()
    assert "ended otherwise" in runs.reason(int(doubtful[0])) and runs.counts()["doubtful"] == doubtful.size
    assert set(said[2:]) == {"terminated", "doubtful", "completed"}


@pytest.mark.parametrize("vary", ["k = 1 .. 2, 3; n = {2, 3}", {"n": [2, 3]}, {("k", "n"): [[1, 2], [2, 3]]}])
def test_structural_parameters_do_not_vary_between_members(vary: Any) -> None:
    model = mechc.loads(
        "model Row\n  dimensionless;\n  structural parameter Integer n = 2;\n  parameter k = 1;\n  state x[i in 1:n] = 1;\n"
        "  for i in 1:n loop\n    equation der(x[i]) = -k*x[i];\n  end for;\n  experiment(stop = 1);\nend Row;\n"
    )
    with pytest.raises(UsageMistake, match="'n' is structural: each of its values is a model of its own"):
        model.ensemble(vary)
    for n in (2, 3):
        runs = model.ensemble("k = 1 .. 2, 3", f"final(x[{n}])", set={"n": n})
        np.testing.assert_allclose(runs[f"final(x[{n}])"], np.exp(-runs["k"]), rtol=1e-8)


def test_what_happens_at_the_start_counts_where_it_ends_the_motion() -> None:
    """A mass that is too high at the start ends the run there: its one instant has events, extremes and times, as that of a run."""
    model = mechc.loads(
        """
model Clamp
  coordinate Length x = 1 m;
  kinetic 1/2*1 kg*der(x)^2;
  discrete Real n = 0;
  when initial() then n := 1; end when;
  when initial() and x > 1.2 m then terminate("too high"); end when;
  experiment(stop = 1 s);
end Clamp;
"""
    )
    kept = "events(), max(x), min(x), mean(x), first(x > 0 m), final(n)"
    runs = model.ensemble({"x": [1.0, 1.5]}, keep=kept, errors="none")
    assert list(runs.outcome_words) == ["completed", "terminated"], runs.why()
    single = [model.simulate(set={"x": x}, estimate_error=False) for x in (1.0, 1.5)]
    assert list(runs["events()"]) == [len(s.events) for s in single] == [1, 2]
    assert list(runs["max(x)"]) == list(runs["min(x)"]) == list(runs["mean(x)"]) == [1.0, 1.5]
    assert list(runs["first(x > 0 m)"]) == [0.0, 0.0] and list(runs["final(n)"]) == [1.0, 1.0]
