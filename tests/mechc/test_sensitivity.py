"""Derivatives of a run as people ask for them: in Python, on the command line, in files and pictures."""

from __future__ import annotations

import itertools
import json
import math
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner

import mechc
from mechc.cli.main import mechc as program
from mechc.requests.parse_values import UsageMistake
from mechc.runtime.outcome import SimulationError
from mechc.runtime.results.files import read_results

PENDULUM = """
model Pendulum
  parameter m = 1 kg;
  parameter l = 1 m;
  parameter g = 9.81 m/s^2;
  coordinate theta = 60 deg;
  kinetic 1/2*m*l^2*der(theta)^2;
  potential -m*g*l*cos(theta);
  output Length tip[2] = {l*sin(theta), -l*cos(theta)};
  experiment(stop = 10 s, tolerance = 1e-11);
end Pendulum;
"""


def test_a_pendulum_slows_down_as_its_length_grows() -> None:
    """theta(t) depends on t sqrt(g/l) alone: d(theta)/d(l) = -t/(2 l) der(theta), d(theta)/d(g) = t/(2 g) der(theta)."""
    solution = mechc.loads(PENDULUM).simulate(sensitivity="l, g")
    expected = -solution.time / 2 * solution["der(theta)"]
    found = solution.sensitivity("theta", "l")
    assert (found.unit, found.name) == ("rad/m", "d(theta)/d(l)")
    np.testing.assert_allclose(found.values, expected, atol=2e-8)
    assert found.errors is not None and np.abs(found.values - expected).max() < 10 * found.errors.max() + 1e-9
    np.testing.assert_allclose(solution.sensitivity("theta", "g"), -expected / 9.81, atol=2e-9)
    tip, theta = solution.sensitivity("tip", "l"), solution["theta"]
    wanted = np.column_stack(
        [np.sin(theta) + np.cos(theta) * expected, -np.cos(theta) + np.sin(theta) * expected]
    )
    np.testing.assert_allclose(tip, wanted, atol=2e-8)
    assert tip.unit == "" and tip.errors is not None and tip.errors.shape == (500, 2)
    energy = solution.sensitivity("energy.total", "l").values
    np.testing.assert_allclose(energy, -9.81 / 2, atol=2e-8)  # m g l cos(60 deg) at the start


@pytest.mark.slow
def test_the_command_line_gives_it_everywhere(tmp_path: Path) -> None:
    (tmp_path / "pendulum.mech").write_text(PENDULUM)
    arguments = ["run", str(tmp_path / "pendulum.mech"), "--sensitivity", "l,theta,der(theta)"]
    files = [tmp_path / "motion.csv", tmp_path / "motion.npz", tmp_path / "motion.json"]
    for file in files:
        said = CliRunner().invoke(
            program, [*arguments, "--json", "-o", str(file), "--plot", str(tmp_path / "a.svg")]
        )
        assert said.exit_code == 0, said.output
    report = json.loads(said.stdout)
    t, rate = report["time"], report["final"]["der(theta)"]
    assert report["sensitivities"]["theta"]["l"] == pytest.approx(-t / 2 * rate, rel=1e-8)
    assert set(report["sensitivities"]) == set(report["final"])
    assert 0 < report["sensitivity_errors"]["tip[2]"]["der(theta)"] < 1e-7
    for file in files:
        back = read_results(file)
        assert back["d(tip[1])/d(theta)"][-1] == report["sensitivities"]["tip[1]"]["theta"]
        assert back.unit("d(der(theta))/d(l)") == "rad/m/s"
    picture = (tmp_path / "a.svg").read_text()
    assert picture.count('<g id="axes_') == 4 + 3  # motion, angle, portrait, energies; the derivatives
    said = CliRunner().invoke(program, [*arguments, "--outputs", "tip", "-o", str(files[0])])
    assert "d(tip[1])/d(der(theta))" in said.output and "d(theta)/d(" not in said.output
    said = CliRunner().invoke(program, [*arguments, "--outputs", "tip", "--json"])
    assert [*json.loads(said.stdout)["sensitivities"]] == ["tip[1]", "tip[2]"]
    said = CliRunner().invoke(program, arguments)
    assert "d(der(theta))/d(l)" in said.output and "rad/(m.s)" in said.output
    assert [n for n in read_results(files[0]) if "d(" in n] == [
        f"d(tip[{i}])/d({to})" for i in (1, 2) for to in ("l", "theta", "der(theta)")
    ]


def test_every_run_of_a_sweep_is_differentiated() -> None:
    text = PENDULUM.replace("experiment(", "experiment(l in {1 m, 2 m}, ")
    runs = mechc.loads(text).sweep(sensitivity=["l"])
    for length, solution in zip((1.0, 2.0), runs.solutions, strict=True):
        expected = -solution.time / (2 * length) * solution["der(theta)"]
        np.testing.assert_allclose(solution.sensitivity("theta", "l"), expected, atol=2e-8)


def test_what_cannot_be_differentiated_is_refused_with_the_reason() -> None:
    model = mechc.loads(PENDULUM)
    with pytest.raises(UsageMistake, match="no parameter, initial value or input 'lenght'"):
        model.simulate(sensitivity="lenght")
    with pytest.raises(UsageMistake, match="takes names alone"):
        model.simulate(sensitivity="l = 1 .. 2")
    with pytest.raises(SimulationError, match="was not differentiated"):
        model.simulate().sensitivity("theta", "l")
    solution = model.simulate(sensitivity="l", stop="1 s")
    with pytest.raises(KeyError, match="only in l"):
        solution.sensitivity("theta", "m")
    with pytest.raises(KeyError, match="neither a state nor an output"):
        solution.sensitivity("thetta", "l")


BALL = """
model Ball
  parameter speed = 30 m/s;
  coordinate Length x = 0 m;
  coordinate Length y = 1 m;
  initial der(x) = speed*cos(45 deg);
  initial der(y) = speed*sin(45 deg);
  let v = sqrt(der(x)^2 + der(y)^2);
  kinetic 1/2*0.15 kg*v^2;
  potential 0.15 kg*9.81 m/s^2*y;
  force -1e-3 kg/m*v*der(x) on x;
  force -1e-3 kg/m*v*der(y) on y;
  when y < 0 m then
    terminate("landed");
  end when;
  experiment(stop = 20 s);
end Ball;
"""


def test_a_run_that_a_branch_ends_is_differentiated_to_its_end() -> None:
    """The run with derivatives lands at a time that is rounded otherwise: both sides of the landing are there all the same.

    Errors are 1e-9 of the motion, divided by 0.02 m/s that is 1e-5 of the difference.
    """
    model = mechc.loads(BALL)
    solution = model.simulate(sensitivity="speed")
    dx, dy = (solution.sensitivity(name, "speed") for name in ("x", "y"))
    assert dx.errors is not None and np.isfinite(dx.errors).all() and np.isfinite(dx.values).all()
    reach = dx.values[-1] - solution["der(x)"][-1] / solution["der(y)"][-1] * dy.values[-1]
    far, near = (model.simulate(set={"speed": 30 + d})["x"][-1] for d in (0.01, -0.01))
    assert reach == pytest.approx((far - near) / 0.02, abs=1e-5)


BOUNCE = """
model Bounce
  parameter e = 0.7;
  coordinate y = 1 m;
  kinetic 1/2*1 kg*der(y)^2;
  potential 1 kg*9.81 m/s^2*y;
  contact floor: y restitution e;
  experiment(stop = 1 s);
end Bounce;
"""
CALLED = """
model Called
  parameter a = 2 N;
  coordinate x = 0 m;
  discrete Integer n = 0;
  kinetic 1/2*1 kg*der(x)^2;
  force a + 1 N*n on x;
  when time >= 0.5 s then n := 1; end when;
  experiment(stop = 1 s);
end Called;
"""


@pytest.mark.parametrize(
    ("text", "name", "expected"),
    [(BOUNCE, "e", math.sqrt(2 * 9.81) * (1 - math.sqrt(2 / 9.81))), (CALLED, "a", 0.5)],
    ids=["contact", "when"],
)
def test_a_process_of_its_own_differentiates_across_events(
    text: str, name: str, expected: float, tmp_path: Path
) -> None:
    """Where the command line is all that runs. The ball hits at t = sqrt(2/g) with sqrt(2 g); what is pushed has moved by a t^2/2."""
    (tmp_path / "model.mech").write_text(text)
    done = subprocess.run(
        [sys.executable, "-m", "mechc", "run", str(tmp_path / "model.mech"), "--sensitivity", name, "--json"],
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)["sensitivities"]["y" if name == "e" else "x"][name]
    assert found == pytest.approx(expected, rel=1e-8)


QUESTIONS = ("sensitivity", "condition", "constants")


@pytest.mark.parametrize(
    "asked", [several for n in (2, 3) for several in itertools.combinations(QUESTIONS, n)], ids=str
)
def test_several_questions_at_once(asked: tuple[str, ...]) -> None:
    """x = cos(2 t): x'^2 + 4 x^2 is constant, d(x)/d(x(0)) = cos(2 t), and small changes grow no more than twofold."""
    model = mechc.loads(
        "coordinate x = 1 m; kinetic 1/2*1 kg*der(x)^2; potential 1/2*4 N/m*x^2; experiment(stop = 1 s);"
    )
    given: dict[str, Any] = {"sensitivity": "x", "condition": True, "constants": True}
    solution = model.simulate(**{name: given[name] for name in asked})
    assert solution["x"][-1] == pytest.approx(math.cos(2), abs=1e-9)
    if "sensitivity" in asked:
        assert solution.sensitivity("x", "x").values[-1] == pytest.approx(math.cos(2), abs=1e-9)
    if "condition" in asked:
        assert solution.condition is not None and 1 <= solution.condition.growth.max() < 2.01
    if "constants" in asked:
        assert [drift.name for drift in solution.accuracy.conserved] == ["der(x)^2 + 4*x^2"]


def test_a_stop_takes_over_what_friction_alone_held() -> None:
    """A block at a stop is pressed, then held by friction alone, pressed again, and drawn away where F p = -mu: after that
    dx/dF = 1/m times the integral of (t - s) p(s)."""
    found = mechc.loads("""
    model Pressed
      parameter F = 3 N;
      let p = -(time/1 s - 1)*(time/1 s - 2)*(time/1 s - 4)/8;
      coordinate Length x = 5 cm;
      kinetic 1/2*2 kg*der(x)^2;
      force F*p on x;
      friction 0.5 N on x;
      contact stop: 5 cm - x;
      experiment(stop = 4.8 s, tolerance = 1e-11);
    end Pressed;
    """).simulate(sensitivity="F")
    assert [event.kind for event in found.events if event.name == "stop"] == ["lift-off", "rest", "lift-off"]
    p = np.polynomial.Polynomial.fromroots([1, 2, 4]) * (-1 / 8)
    (leaves,) = (
        t.real for t in np.asarray((3 * p + 0.5).roots(), np.complex128) if abs(t.imag) < 1e-12 and t.real > 4
    )
    rate = p.integ() - p.integ()(leaves)
    place = rate.integ() - rate.integ()(leaves)
    assert found.sensitivity("x", "F").values[-1] == pytest.approx(place(4.8) / 2, rel=1e-8)
    assert found.sensitivity("der(x)", "F").values[-1] == pytest.approx(rate(4.8) / 2, rel=1e-8)


RAMP = """parameter k = 2 N/m; parameter t0 = 0.5 s; coordinate x = 0.1 m;
kinetic 1/2*1 kg*der(x)^2; potential 1/2*k*x^2; force 3 N/s*max(0 s, time - t0) on x; experiment(stop = 2 s);"""


def test_where_a_kink_of_the_time_lies() -> None:
    """x = .. + 3/2 (t - t0 - sin(w (t - t0))/w), of which the derivative in t0 is -3/2 (1 - cos(w (t - t0)))."""
    found = mechc.loads(RAMP).simulate(sensitivity=["t0"], tolerance=1e-11).sensitivity("x", "t0")
    assert found.values[-1] == pytest.approx(-1.5 * (1 - math.cos(math.sqrt(2) * 1.5)), rel=1e-9)
