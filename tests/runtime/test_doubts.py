"""Runs whose own checks contradict their estimated error are doubtful; runs that are right are not."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from msgspec.structs import replace

import mechc
from mechc.cli.main import run
from mechc.runtime.case import SimulationOptions
from mechc.runtime.outcome import Outcome, worst
from mechc.runtime.problem import Problem
from mechc.runtime.results import accuracy, constraint_drift
from mechc.runtime.results.accuracy import ConstraintDrift
from mechc.runtime.results.consistency import compared
from mechc.runtime.results.doubts import Contradiction
from mechc.runtime.studies.kinds.motion import simulate
from mechc.runtime.studies.runs import companion

DAMPED = """\
model Damped
  parameter c = 0.5 N.s/m;
  coordinate Length x = 1 m;
  kinetic 1/2*1 kg*der(x)^2;
  potential 1/2*4 N/m*x^2;
  damping c on x;
  experiment(stop = 3 s);
end Damped;
"""
STATED = """\
model Stated
  parameter A = 1 m;
  coordinate Length x = 1 m;
  kinetic 1/2*1 kg*der(x)^2;
  potential 1/2*4 N/m*x^2;
  exact x = A*cos(2 rad/s*time);
  experiment(A = 1 m, stop = 3 s);
end Stated;
"""
THROWN = """\
model Thrown
  coordinate Length x = 0 m;
  coordinate Length y = 1 m;
  initial der(x) = 1 m/s;
  kinetic 1/2*1 kg*(der(x)^2 + der(y)^2);
  potential 1 kg*9.81 m/s^2*y;
  experiment(stop = 3 s);
end Thrown;
"""
ROD = """\
model Rod
  coordinate Length x = 1 m;
  coordinate Length y = 0 m;
  kinetic 1/2*1 kg*(der(x)^2 + der(y)^2);
  potential 1 kg*9.81 m/s^2*y;
  constraint x^2 + y^2 = 1 m^2;
  experiment(stop = 1 s);
end Rod;
"""
OPTIONS = SimulationOptions(stop=3)


def problem(text: str) -> Problem:
    return mechc.loads(text).problem()


def output(made: Problem, name: str) -> int:
    return [quantity.name for quantity in made.outputs].index(name)


@pytest.mark.parametrize("text", [DAMPED, STATED, THROWN, ROD])
@pytest.mark.parametrize("tolerance", [1e-3, 1e-8, 1e-13])
@pytest.mark.parametrize("method", ["dop853", "radau5"])
def test_what_is_right_is_not_doubtful(text: str, tolerance: float, method: str) -> None:
    solution = mechc.loads(text).simulate(tolerance=tolerance, method=method)
    assert solution.outcome is Outcome.COMPLETED, solution.message
    assert solution.summary()["accuracy"]["contradictions"] == []


def test_an_account_that_is_left_out_is_told_and_persists() -> None:
    made = mechc.loads(DAMPED).problem()
    total, _, supplied = made.energy_balance
    solution = simulate(replace(made, energy_balance=(total, -1, supplied)), OPTIONS)
    assert solution.outcome is Outcome.DOUBTFUL
    (doubt,) = solution.accuracy.contradictions
    lost = np.abs(solution["energy.total"] - solution["energy.total"][0]).max()
    assert (doubt.kind, doubt.persists) == ("energy", True)
    assert doubt.found == pytest.approx(lost, rel=1e-3)  # at output points and at both sides of events
    assert doubt.found > doubt.allowed
    assert "the energy balance is off by" in solution.message and solution.message.startswith("completed at")


def test_a_momentum_that_does_not_stay_is_told() -> None:
    made = problem(THROWN)
    wrong = replace(made, conserved=(output(made, "energy.potential"),))
    (doubt,) = simulate(wrong, OPTIONS).accuracy.contradictions
    assert (doubt.kind, doubt.name, doubt.persists) == ("momentum", "energy.potential", True)
    assert "'energy.potential', which ought to stay, is off by" in doubt.text()


def test_a_closed_solution_that_does_not_hold_is_told(capsys: pytest.CaptureFixture[str]) -> None:
    solution = mechc.loads(STATED.replace("A = 1 m", "A = 1.001 m")).simulate()
    (doubt,) = solution.accuracy.contradictions
    assert (doubt.kind, doubt.name) == ("closed solution", "x")
    assert doubt.found == pytest.approx(1e-3, rel=1e-4)
    changed = mechc.loads(STATED).simulate(set={"A": 2.0})  # not as it was stated: nothing is said
    assert changed.outcome is Outcome.COMPLETED


def test_an_estimate_that_is_too_small_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    """The energy shows more than 1e-12 of an error at this tolerance; a tighter run is off less."""

    def small(*given: Any) -> Any:
        made = accuracy.compare(*given)
        return replace(made, largest=1e-12, by_state=dict.fromkeys(made.by_state, 1e-12))

    monkeypatch.setattr(companion, "compare", small)
    solution = simulate(problem(DAMPED), replace(OPTIONS, tolerance=1e-5))
    (doubt,) = solution.accuracy.contradictions
    assert (doubt.kind, doubt.persists) == ("energy", False)
    assert "errors are larger than estimated" in " ".join(doubt.causes.split())


BENT = (
    "parameter w = 0.5 m;coordinate x = 1 m;kinetic 1/2*1 kg*der(x)^2;potential 1/2*1 N/m*x^2 + 12 N/m*max(x - w, 0 m)^2;"
    "experiment(stop = 2.5 s);"
)


@pytest.fixture(scope="module")
def bent() -> mechc.Model:
    return mechc.loads(BENT)


def off(run: mechc.Solution, w: float) -> tuple[float, float]:
    """The largest error of x, and the estimated one, relative to 1 m + |x|: the force is 24 N/m w - 25 N/m x, after w -x."""
    t, turn = run.time, np.arccos(0.04 * w / (1 - 0.96 * w)) / 5
    speed = -5 * (1 - 0.96 * w) * np.sin(5 * turn)
    behind = w * np.cos(t - turn) + speed * np.sin(t - turn)
    true = np.where(t < turn, 0.96 * w + (1 - 0.96 * w) * np.cos(5 * t), behind)
    assert run.accuracy.error is not None
    return float(np.max(np.abs(run["x"] - true) / (1 + np.abs(true)))), run.accuracy.error.by_state["x"]


@pytest.mark.parametrize("method", ["rk4", "verlet", "gauss2", "gauss4", "gauss6", "gauss8", "lobatto6"])
def test_a_kink_within_fixed_steps_is_in_the_estimate(bent: mechc.Model, method: str) -> None:
    """Of 560 such runs none is off by more than 5 times its estimate."""
    for w in (0.5, 0.65, 0.705, 0.755):
        run = bent.simulate(set={"w": w}, method=method, step=0.05)
        assert run.outcome is Outcome.COMPLETED, run.message
        true, estimated = off(run, w)
        assert 1e-7 < true < 10 * estimated < 10


def test_beside_half_the_step_alone_a_kink_is_missed(
    bent: mechc.Model, monkeypatch: pytest.MonkeyPatch
) -> None:
    """At this place half the step leaves the same error as the step."""
    monkeypatch.setattr(companion, "APART", 2.0)
    monkeypatch.setattr(companion, "FARTHER", 2.0)
    true, estimated = off(bent.simulate(set={"w": 0.68}, method="gauss8", step=0.05), 0.68)
    assert true > 1e4 * estimated


CLOCKED = """\
parameter w = 3 rad/s;
coordinate x = 1 m;
kinetic 1/2*1 kg*der(x)^2;
potential 1/2*1 kg*w^2*x^2;
discrete Integer n = 0;
experiment(stop = 3 s);
"""


@pytest.mark.parametrize("known", ["clock", "table"])
def test_errors_of_steps_that_known_times_end_are_estimated(known: str, tmp_path: Path) -> None:
    """Steps of 50 ms in both runs had one error, 600 times what was stated: a companion of half their length tells it."""
    text, inputs = CLOCKED + "when sample(0.05 s) then n := n + 1; end when;", {}
    if known == "table":
        (tmp_path / "u.csv").write_text("time,u\n" + "".join(f"{k / 20},0\n" for k in range(61)))
        text, inputs = CLOCKED + "input Force u = 0 N; force u on x;", {"u": str(tmp_path / "u.csv")}
    run = mechc.loads(text).simulate(inputs=inputs, set={"w": 5})
    error = run.accuracy.error
    assert run.outcome is Outcome.COMPLETED and error is not None
    true = np.max(np.abs(run["x"] - np.cos(5 * run.time)) / (1 + np.abs(np.cos(5 * run.time))))
    assert 1e-11 < true < 1.5 * error.by_state["x"]


def test_steps_that_known_times_end_are_no_less_in_doubt_after_longer_ones(tmp_path: Path) -> None:
    """It claimed 1.6e-15 for 3.9e-11: the steps of 50 ms behind the rest were shorter than half the longest one, which alone bounded those
    of the companion."""
    rows = ["0,0", "1,0", "1,1", *(f"{k / 20},1" for k in range(21, 61))]
    (tmp_path / "u.csv").write_text("time,u\n" + "\n".join(rows) + "\n")
    text = CLOCKED.replace("x = 1 m", "x = 0 m") + "input Force u = 0 N; force u on x;"
    run = mechc.loads(text).simulate(inputs={"u": str(tmp_path / "u.csv")}, set={"w": 6})
    error = run.accuracy.error
    longest = run.statistics.longest_step
    assert longest is not None and longest > 0.1 and error is not None
    exact = (1 - np.cos(6 * np.maximum(run.time - 1, 0))) / 36
    true = np.max(np.abs(run["x"] - exact) / (error.nominal["x"] + np.abs(exact)))
    assert 1e-11 < true < 1.5 * error.by_state["x"]


@pytest.mark.parametrize("level", ["positions", "velocities"])
def test_states_off_their_constraints_are_told(monkeypatch: pytest.MonkeyPatch, level: str) -> None:
    made = problem(ROD)
    monkeypatch.setattr(
        constraint_drift, "constraint_drifts", lambda *_: (ConstraintDrift(level, 0.0, 1e-5),)
    )
    (doubt,) = simulate(made, OPTIONS).accuracy.contradictions
    assert (doubt.kind, doubt.name) == ("constraints", level)
    assert f"the constraints of {level} are off by 1e-05" in doubt.text()


def test_without_an_estimate_nothing_is_contradicted() -> None:
    made = problem(DAMPED)
    wrong = replace(made, energy_balance=(made.energy_balance[0], -1, -1))
    assert simulate(wrong, replace(OPTIONS, estimate_error=False)).outcome is Outcome.COMPLETED


def test_a_sweep_ends_as_its_worst_run() -> None:
    swept = mechc.loads(STATED.replace("A = 1 m, stop", "A in {1.001, 1} m, stop")).sweep()
    assert [s.outcome for s in swept.solutions] == [Outcome.DOUBTFUL, Outcome.COMPLETED]
    assert swept.outcome is Outcome.DOUBTFUL
    assert worst([Outcome.FAILED, Outcome.DOUBTFUL, Outcome.COMPLETED]) is Outcome.FAILED
    assert worst([]) is Outcome.COMPLETED


@pytest.mark.parametrize("command", [["run"], ["study", "virial"]])
def test_the_command_line_says_it_first_and_has_an_exit_code(
    command: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "wrong.mech"
    file.write_text(STATED.replace("A = 1 m", "A = 1.001 m"), encoding="utf-8")
    assert run([*command, str(file)]) == 3
    first = capsys.readouterr().out.split("\n\n")[0]
    assert "doubtful" in first or "but 'x', against its closed solution, is off by" in first
    assert run([*command, str(file), "--json"]) == 3
    assert json.loads(capsys.readouterr().out)["outcome"] == "doubtful"


def test_checks_of_many_states_are_looked_at_in_parts(monkeypatch: pytest.MonkeyPatch) -> None:
    """The derivatives of the checks are the same numbers however many states are moved at once."""
    found = []
    for at_once in (10**6, 1, 500):
        monkeypatch.setattr("mechc.runtime.results.consistency.MOST_NUMBERS", at_once)
        made: list[tuple[Contradiction, float]] = []

        def noted(*asked: Any, made: list[Any] = made, **more: Any) -> tuple[Contradiction, ...]:
            made += compared(*asked, **more)
            return ()

        monkeypatch.setattr(companion, "contradictions", noted)
        assert mechc.loads(DAMPED).simulate().accuracy.error
        found.append([ratio for _, ratio in made])
    assert found[0] and found[0] == found[1] == found[2]


TICKING = """
coordinate Length x = 1 m;
kinetic 0.5*1 kg*der(x)^2;
discrete Real n = 1;
potential 0.5*2 N/m*n*x^2;
when sample(0.2 s) then n := n + 0.1; end when;
"""


@pytest.mark.parametrize(("stop", "every"), [(1.0, 0.002), (1.0, 0.1), (0.95, 0.05)])
def test_rows_at_instants_that_change_the_energy_are_those_before_them(stop: float, every: float) -> None:
    """The accounts hold on both sides of an instant; a state from before it with variables from after it has neither."""
    run = mechc.loads(TICKING).simulate(stop=stop, every=every)
    assert run.outcome.value == "completed", run.message
    energy = run.energy
    assert energy is not None and energy.supplied is not None
    assert abs(energy.end - energy.start - energy.supplied) < 1e-10
