"""Solutions as mappings, between output points, as data frames and in files."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest
from msgspec.structs import replace
from written_problems import (
    called,
    compiled_kepler,
    compiled_pendulum,
    kepler,
    kepler_position,
    pendulum,
    rigid_body,
)

import mechc
from mechc.runtime.case import Case, SimulationOptions
from mechc.runtime.integrate import kernel_run
from mechc.runtime.integrate.kernel_run import run_kernel
from mechc.runtime.integrate.solver import SolverOptions
from mechc.runtime.integrate.trajectory import Trajectory
from mechc.runtime.outcome import Outcome
from mechc.runtime.problem import Array
from mechc.runtime.results.files import ResultsFileError, read_results
from mechc.runtime.results.quantities import Results
from mechc.runtime.results.solution import Solution
from mechc.runtime.studies.kinds.motion import simulate


@pytest.fixture(scope="module")
def solution() -> Solution:
    return simulate(compiled_pendulum(), SimulationOptions(stop=2, points=21))


def test_mapping(solution: Solution) -> None:
    assert list(solution) == ["theta", "der(theta)", "kinetic", "potential", "energy"]
    assert solution.time.tolist() == np.linspace(0, 2, 21).tolist()
    assert all(values.shape == (21,) for values in solution.values())
    assert "time" in solution and "theta" in solution and "thta" not in solution
    with pytest.raises(KeyError, match="there is no 'thta'; did you mean 'theta'"):
        solution["thta"]
    assert solution.unit("der(theta)") == "rad/s"
    assert solution.unit("time") == "s"
    assert solution["time"] is solution.time
    assert solution.final()["theta"] == solution["theta"][-1]
    with pytest.raises(KeyError):
        solution["phi"]


def test_output_times() -> None:
    every = simulate(compiled_pendulum(), SimulationOptions(stop=1, every=0.3))
    assert every.time.tolist() == [0, 0.3, 0.6, 0.3 * 3, 1]
    exact = simulate(compiled_pendulum(), SimulationOptions(stop=1, every=0.1))
    assert exact.time.tolist() == [k * 0.1 for k in range(10)] + [1.0]
    late = simulate(compiled_pendulum(), SimulationOptions(start=1, stop=2, points=3))
    assert late.time.tolist() == [1, 1.5, 2]
    full = simulate(compiled_pendulum(), SimulationOptions(stop=2, points=5))
    assert np.abs(late["theta"] - full["theta"][2:]).max() < 1e-9
    early = simulate(compiled_pendulum(), SimulationOptions(start=-1, stop=1, points=3))
    assert early["theta"][0] == 1
    assert np.abs(early["theta"] - full["theta"][[0, 2, 4]]).max() < 1e-7


@pytest.mark.parametrize("make", [compiled_kepler, kepler], ids=["compiled", "called"])
def test_between_output_points_dense_output_is_as_good_as_the_steps(make: object) -> None:
    assert callable(make)
    times = np.linspace(0, 6, 333)
    exact = kepler_position(times, 1.0, 1.0, 0.6)
    coarse = simulate(make(), SimulationOptions(stop=6, tolerance=1e-9, points=4))
    assert coarse.interpolation == "dense output"
    at = coarse(times)
    assert np.abs(np.column_stack([at["x"], at["y"]]) - exact).max() < 1e-6
    assert np.abs(at["momentum"] - coarse["momentum"][0]).max() < 1e-6
    assert at["x"].shape == times.shape
    assert coarse(3.0)["x"].shape == ()
    hermite = simulate(make(), SimulationOptions(stop=6, tolerance=1e-9, points=200, dense=False))
    assert hermite.interpolation == "cubic Hermite between output points"
    error = np.abs(hermite(times)["x"] - exact[:, 0]).max()
    assert 1e-7 < error < 1e-3  # h^4/384 x'''' near the pericentre: measured 3e-5
    with pytest.raises(ValueError, match="results reach from time 0 to 6"):
        coarse(6.1)


def test_dense_output_of_a_long_run() -> None:
    """Several buffers of polynomials join without a gap."""
    options = SimulationOptions(stop=600, tolerance=1e-11, points=2)
    solution = simulate(compiled_kepler(), options)
    assert solution.statistics.steps > 3000
    times = np.linspace(0, 600, 5000)
    exact = kepler_position(times, 1.0, 1.0, 0.6)
    at = solution(times)
    assert np.abs(np.column_stack([at["x"], at["y"]]) - exact).max() < 1e-5


def test_polynomials_are_dropped_beyond_their_bound_of_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("mechc.runtime.integrate.kernel_run.DENSE_LIMIT", 300_000)
    short = simulate(compiled_kepler(), SimulationOptions(stop=60, points=10))
    assert short.interpolation == "dense output"
    long = simulate(compiled_kepler(), SimulationOptions(stop=600, tolerance=1e-11, points=6000))
    assert long.interpolation == "cubic Hermite between output points"
    exact = kepler_position(np.array([300.05]), 1.0, 1.0, 0.6)[0]
    assert long(300.05)["x"] == pytest.approx(exact[0], abs=1e-4)
    whole = simulate(
        compiled_kepler(), SimulationOptions(stop=600, tolerance=1e-11, points=6000, dense=False)
    )
    assert np.abs(long["x"] - whole["x"]).max() < 1e-6


def test_polynomials_that_were_not_kept_are_those_of_the_run(monkeypatch: pytest.MonkeyPatch) -> None:
    """A run of many steps is made again when somebody asks for times between its points: with the same bits, once."""
    options = SimulationOptions(stop=600, tolerance=1e-11, points=50)
    kept = simulate(compiled_kepler(), options)
    monkeypatch.setattr("mechc.runtime.studies.runs.companion.DENSE_KEPT", 100_000)
    dropped = simulate(compiled_kepler(), options)
    assert dropped.interpolation == "dense output"
    made: list[Trajectory] = []

    def counted(case: Case, options: SolverOptions) -> Trajectory:
        made.append(run_kernel(case, options))
        return made[-1]

    monkeypatch.setattr(kernel_run, "run_kernel", counted)
    times = np.linspace(0, 600, 999)
    for _ in range(2):
        assert all(np.array_equal(dropped(times)[name], kept(times)[name]) for name in kept)
    assert len(made) == 1


def test_a_run_that_is_pictured_is_not_made_again(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("mechc.runtime.studies.runs.companion.DENSE_KEPT", 1_000)
    made: list[Trajectory] = []

    def counted(case: Case, options: SolverOptions) -> Trajectory:
        made.append(run_kernel(case, options))
        return made[-1]

    monkeypatch.setattr(kernel_run, "run_kernel", counted)
    text = "model A coordinate Length x = 1 m; kinetic (1 kg)*der(x)^2/2; potential (1 N/m)*x^2/2; draw sphere() at {x, 0 m}; end A;"
    times = np.linspace(0, 2000, 999)
    for keep, again in (frozenset({"scene"}), 0), (frozenset[str](), 1):
        solution = mechc.loads(text, keep=keep).simulate(stop=2000)
        assert isinstance(solution, mechc.Solution)
        assert np.abs(solution(times)["x"] - np.cos(times)).max() < 1e-4
        assert len(made) == again


def test_a_run_goes_the_same_way_whether_its_polynomials_are_kept_or_not(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Errors between the ends of steps, which limit these, bound them after the place where nothing is kept any more."""
    options = SimulationOptions(stop=600, tolerance=1e-8, points=50, estimate_error=False)
    kept = simulate(compiled_kepler(), options)
    monkeypatch.setattr("mechc.runtime.studies.runs.companion.DENSE_KEPT", 100_000)
    dropped = simulate(compiled_kepler(), options)
    assert dropped.statistics.steps == kept.statistics.steps
    assert all(np.array_equal(dropped[name], kept[name]) for name in kept)
    bare = simulate(compiled_kepler(), replace(options, dense=False))
    assert bare.statistics.steps != kept.statistics.steps, "they do limit them"


def test_hermite_interpolation_keeps_rotations_of_unit_length() -> None:
    body = simulate(rigid_body(), SimulationOptions(stop=5, points=10, dense=False))
    at = body(np.linspace(0, 5, 100))
    assert np.abs(sum(at[f"R[{k}]"] ** 2 for k in range(1, 5)) - 1).max() < 1e-15


def test_hermite_interpolation_follows_events() -> None:
    """A ball that bounces is on parabolas between its bounces: a cubic has them exactly, with the right modes."""
    text = (
        "coordinate Length h = 1 m; kinetic 1/2*(1 kg)*der(h)^2; potential (9.81 N)*h;"
        "contact floor: h restitution 0.8;"
    )
    problem = mechc.loads(text).problem()
    dense, hermite = (
        simulate(problem, SimulationOptions(stop=2, points=30, dense=keep)) for keep in (True, False)
    )
    times = np.linspace(0, 2, 777)
    assert hermite.interpolation == "cubic Hermite between output points"
    assert np.abs(dense(times)["h"] - hermite(times)["h"]).max() < 1e-14


@pytest.mark.parametrize("ending", ["csv", "npz", "json", "CSV", "Npz"])
def test_files_give_back_the_same_bits(solution: Solution, tmp_path: Path, ending: str) -> None:
    path = tmp_path / f"run.{ending}"
    solution.save(path)
    back = read_results(path)
    assert list(back) == list(solution)
    assert back.time.tobytes() == solution.time.tobytes()
    assert all(back[name].tobytes() == solution[name].tobytes() for name in solution)
    assert all(back.unit(name) == solution.unit(name) for name in solution)
    assert back.report == (None if ending.lower() == "csv" else json.loads(json.dumps(solution.summary())))
    again = tmp_path / f"again.{ending}"
    back.save(again)
    assert read_results(again)["theta"].tobytes() == solution["theta"].tobytes()
    assert sorted(file.name for file in tmp_path.iterdir()) == [again.name, path.name]


def test_names_with_indices_and_values_that_json_does_not_know(tmp_path: Path) -> None:
    values = {"R[1]": np.array([1.0, math.nan]), "der(R)[1]": np.array([-0.0, 1e-320])}
    results = Results(np.array([0.0, 0.1]), values, {"time": "s", "R[1]": "", "der(R)[1]": "rad/s"})
    for ending in ("csv", "npz", "json"):
        path = tmp_path / f"run.{ending}"
        results.save(path)
        back = read_results(path)
        assert list(back) == ["R[1]", "der(R)[1]"]
        assert (back.unit("R[1]"), back.unit("der(R)[1]")) == ("", "rad/s")
        assert np.array_equal(back["R[1]"], values["R[1]"], equal_nan=True)
        assert back["der(R)[1]"].tobytes() == values["der(R)[1]"].tobytes()


def test_headers_and_display_units(solution: Solution, tmp_path: Path) -> None:
    def display(name: str, unit: str) -> tuple[str, float]:
        return ("deg", 180 / math.pi) if unit == "rad" else (unit, 1.0)

    path = tmp_path / "run.csv"
    solution.save(path, names=["theta", "energy"], display=display)
    lines = path.read_text(encoding="utf-8").splitlines()
    assert lines[0] == "time [s],theta [deg],energy [J]"
    assert float(lines[1].split(",")[1]) == pytest.approx(math.degrees(1))
    frame = solution.to_dataframe(["theta"], display)
    assert list(frame.columns) == ["theta [deg]"]
    assert frame.index.name == "time [s]"
    assert np.load(_saved(solution, tmp_path / "run.npz"))["theta [rad]"].shape == (21,)


def _saved(solution: Solution, path: Path) -> Path:
    solution.save(path)
    return path


def test_results_that_were_read_interpolate_by_splines(solution: Solution, tmp_path: Path) -> None:
    back = read_results(_saved(solution, tmp_path / "run.csv"))
    assert back(0.55)["theta"] == pytest.approx(solution(0.55)["theta"], abs=1e-4)
    with pytest.raises(ValueError, match="results reach"):
        back(-1)


def test_results_with_events_that_were_read_interpolate_between_them(tmp_path: Path) -> None:
    """Parabolas between bounces: splines have them exactly; at a bounce the later side holds."""
    text = (
        "coordinate Length h = 1 m; kinetic 1/2*(1 kg)*der(h)^2; potential (9.81 N)*h;"
        "contact floor: h restitution 0.8;"
    )
    run = mechc.loads(text).simulate(stop=1.5, every=0.01)
    run.save(tmp_path / "run.csv")
    back, bounce = read_results(tmp_path / "run.csv"), run.events[0].time
    times = np.linspace(0, 1.5, 777)
    assert np.abs(back(times)["h"] - run(times)["h"]).max() < 1e-12
    assert back(bounce)["der(h)"] == pytest.approx(run.events[0].after["der(h)"], rel=1e-12)


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("a.csv", b""),
        ("a.csv", b"theta,x\n1,2\n"),
        ("a.csv", b"time [s],x\n1,two\n"),
        ("a.json", b"{}"),
        ("a.json", b"[1"),
        ("a.npz", b"PK"),
        ("a.csv", b"\xff\xfe\x00"),
    ],
)
def test_files_without_results(tmp_path: Path, name: str, content: bytes) -> None:
    path = tmp_path / name
    path.write_bytes(content)
    with pytest.raises(ResultsFileError):
        read_results(path)


def test_unknown_format_leaves_no_file(solution: Solution, tmp_path: Path) -> None:
    with pytest.raises(ResultsFileError, match=r"written as \.csv, \.npz, \.json, not 'run.xls'"):
        solution.save(tmp_path / "run.xls")
    assert list(tmp_path.iterdir()) == []


def test_summary_is_json(solution: Solution) -> None:
    summary = json.loads(json.dumps(solution.summary(), allow_nan=False))
    assert summary["model"] == "Pendulum"
    assert summary["outcome"] == "completed"
    assert summary["message"] == "completed at t = 2 s"
    assert summary["time"] == 2
    assert list(summary["final"]) == list(solution)
    assert {"steps", "rejected", "evaluations", "run_time"} <= set(summary["statistics"])
    assert 0 < summary["accuracy"]["estimated_error"] < 1e-6
    assert summary["accuracy"]["energy_drift"] < 1e-6
    assert summary["events"] == []


def test_summary_writes_null_for_what_is_not_a_number() -> None:
    p = pendulum()

    def undefined(t: float, y: Array, u: Array, z: Array, q: Array) -> Array:
        return np.array([np.nan, np.inf, 0.0])

    p = called(replace(p, functions={**p.functions, "outputs": undefined}, energy_balance=(), conserved=()))
    summary = simulate(p, SimulationOptions(stop=1)).summary()
    assert summary["final"]["kinetic"] is None
    assert summary["final"]["potential"] is None
    json.dumps(summary, allow_nan=False)


def test_states_and_outputs_stand_where_they_were_computed() -> None:
    solution = simulate(compiled_pendulum(), SimulationOptions(stop=2, points=21))
    assert solution.outcome is Outcome.COMPLETED  # while that is not known numbers are given as copies
    table = solution.motion.columns
    names = list(solution.quantities)
    assert all(np.array_equal(table.column(i), solution[name]) for i, name in enumerate(names))
    assert np.shares_memory(solution["theta"], table.y)
    late = solution.time > 1
    assert np.array_equal(table.rows(late), np.column_stack([solution[name][late] for name in names]))


def test_remarks_and_reports_follow_what_is_added() -> None:
    solution = simulate(compiled_pendulum(), SimulationOptions(stop=1, points=5))
    assert "seen" not in solution.report["remarks"]
    solution.add_remark("seen")
    assert solution.remarks[0] == "seen" and solution.report["remarks"][0] == "seen"


def test_elements_of_several_units_have_none_together() -> None:
    found = mechc.loads("""
    model Kept
      input u;
      output y = u;
    end Kept;
    model M
      coordinate Length x = 1 m;
      kinetic 1/2*1 kg*der(x)^2;
      Kept k[i in 1:2](u = if i == 1 then x else der(x));
      experiment(stop = 1 s);
    end M;
    """).simulate()
    assert found["k.y"].shape[1] == 2 and found.unit("k[2].y") == "m/s"
    with pytest.raises(KeyError, match=r"'k.y' has no single unit: k\[1\].y in m, k\[2\].y in m/s"):
        found.unit("k.y")


def test_vectors_of_one_element_of_an_array_of_parts() -> None:
    """``flight[2].r`` was unknown, though ``flight[2].r[1]`` and ``flight.r`` are known."""
    found = mechc.loads("""
    model Flight
      coordinate Length r[2] = {1, 2} m;
      coordinate Rotation R = rotz(0 rad);
      initial der(R) = {1, 2, 3} rad/s;
      kinetic 1/2*1 kg*dot(der(r), der(r));
      inertia identity(3)*1 kg.m^2 on world * R;
    end Flight;
    model M
      Flight flight[2](r = {{1, 2}, {3, 4}} m);
      experiment(stop = 1 s);
    end M;
    """).simulate()
    assert found["flight[2].r"][-1] == pytest.approx([3.0, 4.0])
    assert found["flight.r"][-1] == pytest.approx(np.array([[1.0, 2.0], [3.0, 4.0]]))
    assert found["der(flight[1].R)"][-1] == pytest.approx([1.0, 2.0, 3.0])
    assert found["flight[1].R"].shape[1] == 4 and found["der(flight.r)"].shape[1:] == (2, 2)
    assert found.unit("flight[2].r") == "m" and found.unit("der(flight.r)") == "m/s"
    with pytest.raises(KeyError, match=r"there is no 'flight\[3\].r'"):
        found["flight[3].r"]


def test_parts_of_several_sizes_are_named_one_by_one() -> None:
    found = mechc.loads("""
    model Part
      structural parameter Integer n = 1;
      coordinate Length x[n] = 1 m;
      kinetic sum(1/2*1 kg*der(x[i])^2 for i in 1:n);
      output y = sum(x);
      if n > 1 then output Length z[n] = x; else output Length z = x[1]; end if;
    end Part;
    model M
      Part p[i in 1:2](n = i);
      output all = p.x;
      experiment(stop = 1 s);
    end M;
    """).simulate()
    assert found["all"].shape[1] == 3 and found["p.y"].shape[1] == 2
    for name, parts in (("p.x", r"p\[1\].x\[1\], p\[2\].x\[1\], p"), ("p.z", r"p\[1\].z, p\[2\].z\[1\], p")):
        with pytest.raises(KeyError, match=f"'{name}' is not a whole array, its elements are {parts}"):
            found[name]
