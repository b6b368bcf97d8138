"""What sets a rotation or its rate: starts, events, drives and experiments, against quaternions by hand and by SciPy."""

from __future__ import annotations

import numpy as np
import pytest
from refusals import refused
from scipy.spatial.transform import Rotation

import mechc

TOP = """
import mech.spatial.*;
model Top
  Body b(J = diag({0.05, 0.06, 0.03} kg.m^2));
  Spherical s(world -> b.a);
  %s
  output w = angvel(b.a, b.a);
  output axes[3, 3] = {direction(b.a, {1, 0, 0}), direction(b.a, {0, 1, 0}), direction(b.a, {0, 0, 1})};
  experiment(stop = 0.5 s, every = 0.1 s, tolerance = 1e-10%s);
end Top;
"""


def run(statement: str, setting: str = "") -> mechc.Solution:
    return mechc.loads(TOP % (statement, setting)).simulate()


def turned(solution: mechc.Solution, row: int) -> Rotation:
    return Rotation.from_matrix(solution["axes"][row].reshape(3, 3).T)


def about(angles: list[float]) -> Rotation:
    return Rotation.from_rotvec(np.deg2rad(angles))


@pytest.mark.parametrize(
    ("value", "reference"),
    [
        ("rotz(20 deg)*rotx(10 deg)", about([0, 0, 20]) * about([10, 0, 0])),
        ("axis_angle({1, 2, 2}, 200 deg)", about([200 / 3, 400 / 3, 400 / 3])),
        ("quat(1, 2, 3, 4)", Rotation.from_quat([2, 3, 4, 1])),
    ],
)
def test_an_event_turns_a_body_to_a_rotation(value: str, reference: Rotation) -> None:
    solution = run(f"when time > 0.25 s then reinit(s.orientation, {value}); end when;")
    assert (turned(solution, 0) * Rotation.identity()).magnitude() == 0
    assert (turned(solution, -1) * reference.inv()).magnitude() < 1e-12
    assert np.linalg.norm([solution[f"s.orientation[{k}]"][-1] for k in range(1, 5)]) == pytest.approx(1)


def test_an_event_turns_a_body_further_from_where_it_is() -> None:
    """About its own z axis, which goes on turning: 0.5 s at 2 rad/s and 30 degrees."""
    solution = run(
        "initial s.orientation = rotx(40 deg); initial der(s.orientation) = {0, 0, 2} rad/s;"
        "when time > 0.25 s then reinit(s.orientation, s.orientation*rotz(30 deg)); end when;"
    )
    reference = about([40, 0, 0]) * Rotation.from_rotvec([0, 0, 1 + np.deg2rad(30)])
    assert (turned(solution, -1) * reference.inv()).magnitude() < 1e-9


@pytest.mark.parametrize("element", [1, 2, 3])
def test_an_element_of_the_rate_is_that_of_the_angular_velocity(element: int) -> None:
    expected = np.zeros(3)
    expected[element - 1] = 5
    started = run(f"initial der(s.orientation)[{element}] = 5 rad/s;")
    assert started["w"][0] == pytest.approx(expected, abs=1e-14)
    struck = run(f"when time > 0.25 s then reinit(der(s.orientation)[{element}], 5 rad/s); end when;")
    assert struck["w"][-1] == pytest.approx(expected, abs=1e-9)


def test_the_rate_of_a_number_of_the_quaternion_is_half_the_angular_velocity() -> None:
    """At the identity q' = (0, w)/2, so that 1.5 1/s belong to 3 rad/s about y."""
    assert run("initial der(s.orientation[3]) = 1.5 s^-1;")["w"][0] == pytest.approx([0, 3, 0], abs=1e-12)


def test_a_number_of_the_quaternion_is_a_condition_on_the_start() -> None:
    """sin(angle/2) = 0.2 about y, the smallest turn that has it."""
    solution = run("initial s.orientation[3] = 0.2;")
    reference = Rotation.from_rotvec([0, 2 * np.arcsin(0.2), 0])
    assert (turned(solution, 0) * reference.inv()).magnitude() < 1e-9


def test_a_start_may_continue_that_of_another_joint() -> None:
    """Its quaternion has zeros, which the quaternion of a matrix would divide by."""
    model = mechc.loads(
        "import mech.spatial.*; Body b(J = identity(3)*1 kg.m^2); Body c(J = identity(3)*1 kg.m^2);"
        "Spherical s(world -> b.a, orientation = rotx(3 deg));"
        "Spherical t(world -> c.a, orientation = s.orientation*rotz(10 deg)); experiment(stop = 0.1 s);"
    )
    x, y, z, w = (about([3, 0, 0]) * about([0, 0, 10])).as_quat()
    solution = model.simulate()
    assert [solution[f"t.orientation[{k}]"][0] for k in range(1, 5)] == pytest.approx([w, x, y, z])


def test_the_quaternion_of_a_drive_does_not_jump() -> None:
    """About a diagonal beyond half a turn: cos and sin of half the angle, whatever number is the largest."""
    model = mechc.loads(
        "coordinate Rotation R; drive R = axis_angle({1, 1, 1}, 3 rad/s*time); frame b = world*R;"
        "inertia diag({1, 2, 3} kg.m^2) on b; experiment(stop = 4 s, every = 0.1 s);"
    )
    solution = model.simulate()
    half, unit = 1.5 * solution.time, np.full(3, 3**-0.5)
    expected = np.column_stack([np.cos(half), *(np.sin(half) * x for x in unit)])
    np.testing.assert_allclose(
        np.column_stack([solution[f"R[{k}]"] for k in range(1, 5)]), expected, atol=1e-14
    )


@pytest.mark.parametrize(
    ("statement", "setting", "code"),
    [
        ("when time > 0.2 s then reinit(der(s.orientation[3]), 5 rad/s); end when;", "", "E0417"),
        ("when time > 0.2 s then reinit(s.orientation[3], 0.2); end when;", "", "E0417"),
        ("", ", s.orientation[3] = 0.2", "E0802"),
        ("", ", der(s.orientation[3]) = 5 rad/s", "E0802"),
        ("drive s.orientation[3] = 0.1*time/1 s;", "", "E0420"),
        ("output p = momentum(s.orientation[3]);", "", "E0212"),
    ],
)
def test_a_number_of_a_rotation_is_not_set_alone(statement: str, setting: str, code: str) -> None:
    """It used to count as the element of the angular velocity, as all numbers at once, or as nothing."""
    (told,) = refused(TOP % (statement, setting))
    assert told.code == code
    assert "'s.orientation' is one value" in told.help and "'der(s.orientation)'" in told.help


@pytest.mark.parametrize(
    "statement",
    [
        "initial s.orientation = trans({1, 0, 0} m)*rotz(10 deg);",
        "when time > 0.2 s then reinit(s.orientation, trans({1, 0, 0} m)*rotz(10 deg)); end when;",
        "drive s.orientation = rotz(time*1 rad/s)*trans({1, 0, 0} m);",
    ],
)
def test_a_rotation_takes_no_displacement(statement: str) -> None:
    (told,) = refused(TOP % (statement, ""))
    assert told.code == "E0303" and "'trans'" in told.caption


@pytest.mark.parametrize("value", ["{0.6, 0.8, 0, 0}", "{10, 20, 30} deg", "30 deg"])
def test_what_is_no_rotation_is_told_how_to_write_one(value: str) -> None:
    assert (
        "rotz(30 deg)*rotx(10 deg)"
        in refused(TOP % (f"when time > 0.2 s then reinit(s.orientation, {value}); end when;", ""))[0].help
    )
