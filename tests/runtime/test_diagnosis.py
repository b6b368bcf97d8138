"""The cause of a failure: what has no inertia, and where energies end."""

from __future__ import annotations

import pytest

import mechc
from mechc.runtime.outcome import Outcome
from mechc.solution import Solution


def run(text: str) -> Solution:
    return mechc.loads(text).simulate(estimate_error=False)


def test_a_coordinate_without_mass_is_named() -> None:
    text = """
    parameter m = 0 kg;
    gravity {0, -9.81 m/s^2};
    coordinate Angle a = 1 rad;
    coordinate Angle b = 0.5 rad;
    mass 1 kg at world * rot(a) * {0 m, -1 m};
    mass m at world * rot(a) * trans({0 m, -1 m}) * rot(b) * {0 m, -1 m};
    experiment(stop = 1 s);
    """
    with pytest.raises(
        mechc.CompileError, match="nothing with mass moves with 'b', and no force decides where it is"
    ):
        run(text)


def test_coordinates_that_turn_about_one_axis_are_named_together() -> None:
    text = """
    coordinate Angle a = 0.3 rad;
    coordinate Angle b = 0 rad;
    coordinate Angle c = 0.2 rad;
    initial der(b) = -1 rad/s;
    frame body = world * rotz(a) * rotx(b) * rotz(c);
    inertia diag({2, 2, 2} kg.m^2) on body;
    experiment(stop = 1 s);
    """
    assert "nothing has inertia along 'a', 'c' there" in run(text).message


def test_a_mass_that_runs_out_is_the_cause() -> None:
    text = """
    coordinate Length x = 0 m;
    kinetic 1/2*(1 kg - 1 kg/s*time)*der(x)^2;
    force 1 N on x;
    experiment(stop = 3 s);
    """
    solution = run(text)
    assert solution.failure is not None and solution.failure.time == pytest.approx(1, abs=1e-6)
    assert "nothing has inertia along 'x' there" in solution.message


def test_a_singular_force_is_not_taken_for_a_missing_mass() -> None:
    text = """
    coordinate Length x = 1 m;
    kinetic 1/2*1 kg*der(x)^2;
    potential -1 N.m^2/x;
    experiment(stop = 3 s);
    """
    solution = run(text)
    assert solution.outcome is Outcome.FAILED and "inertia" not in solution.message


WALL = """
coordinate Length x = 0 m;
initial der(x) = {speed} m/s;
kinetic 1/2*1 kg*der(x)^2;
potential -1 J*log(1 - x/1 m);
experiment(stop = 3 s);
"""


def test_a_run_does_not_go_on_where_its_energy_is_undefined() -> None:
    """At 1e150 m/s one step crosses the wall; the accelerations after it are finite, the energy is not a number."""
    solution = run(WALL.format(speed="1e150"))
    assert solution.outcome is Outcome.FAILED
    assert "not a number" in solution.message and "energy." in solution.message
    assert solution.failure is not None and 0 < solution.failure.time < 0.1
    assert run(WALL.format(speed="1")).outcome is Outcome.COMPLETED
