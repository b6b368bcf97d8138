"""Frames, momenta, regressors and inverse kinematics: against differences, Newton's and Euler's laws, closed forms and Pinocchio."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import mechc
from mechc.functions import Functions

ARM = """
import mech.spatial.*;
model Arm
  input Torque u[3] = {1, 2, 3} N.m;
  gravity {0.3, 0, -9.81} m/s^2;
  Body link[i in 1:3](m = 1.5 kg, com = {0.1, -0.4, 0.05} m, J = diag({0.11, 0.02, 0.13} kg.m^2));
  frame seat[i in 1:3] = (if i == 1 then world else link[i-1].a) * trans({0, if i == 1 then 0 else -1, 0} m);
  Revolute joint[i in 1:3](seat[i] -> link[i].a, angle = 0.3 rad,
                           axis = if i == 1 then {1, 0, 0} else if i == 2 then {0, 1, 0} else {0, 0, 1});
  point hand = link[3].a * {0, -1, 0} m;
end Arm;
"""

FREE = """
import mech.spatial.*;
model Lump
  Body body(m = 2 kg, com = {0.1, 0.2, -0.1} m, J = {{0.3, 0.01, 0}, {0.01, 0.2, 0.02}, {0, 0.02, 0.4}} kg.m^2);
  Free joint(world -> body.a, position = {1, 0, 0} m);
end Lump;
"""

TWO = """
import mech.planar.*;
model Two
  gravity {0, -9.81} m/s^2;
  Bar upper(m = 1 kg, l = 1 m);
  Bar lower(m = 0.5 kg, l = 80 cm);
  Revolute shoulder(world -> upper.a, angle = 30 deg);
  Revolute elbow(upper.b -> lower.a, angle = 20 deg);
end Two;
"""

FOUR = """
import mech.planar.*;
model FourBar
  Bar a(m = 1 kg, l = 0.5 m);
  Bar b(m = 1 kg, l = 1.2 m);
  Bar c(m = 1 kg, l = 0.9 m);
  Revolute p(world -> a.a, angle = 60 deg);
  Revolute q(a.b -> b.a, angle ~ -40 deg);
  Revolute r(world * trans({1 m, 0 m}) -> c.a, angle ~ 60 deg);
  Revolute t(b.b -> c.b);
end FourBar;
"""


@pytest.fixture(scope="module")
def arm() -> Functions:
    return mechc.loads(ARM).functions


def state(f: Functions, seed: int = 3) -> Any:
    return f.start + np.random.default_rng(seed).normal(size=f.start.size)


@pytest.mark.parametrize("name", ["link[3].a", "seat[2]", "hand"])
def test_rates_of_frames_by_differences(arm: Functions, name: str) -> None:
    """Central differences over 1e-5 s along a motion without acceleration: 1e-10 times third derivatives, some 1e2."""
    y, step = state(arm), 1e-5
    frame, nv = arm.frame(name), 3
    v = y[3:6]
    along = np.concatenate([v, np.zeros(y.size - 3)])
    after, before = y + step * along, y - step * along

    def slope(function: Any) -> Any:
        return (function(after) - function(before)) / (2 * step)

    assert frame.velocity(y) == pytest.approx(slope(frame.position), abs=1e-7)
    assert frame.jacobian_rate(y) == pytest.approx(slope(frame.jacobian), abs=1e-7)
    assert frame.drift(y) == pytest.approx(frame.jacobian_rate(y) @ v, abs=1e-12)
    assert frame.jacobian(y)[:nv] @ v == pytest.approx(frame.velocity(y), abs=1e-12)
    if frame.rotation is not None and frame.angular_velocity is not None:
        turn = slope(frame.rotation) @ frame.rotation(y).T
        assert frame.angular_velocity(y) == pytest.approx([turn[2, 1], turn[0, 2], turn[1, 0]], abs=1e-7)
        assert frame.rotation(y) @ frame.rotation(y).T == pytest.approx(np.eye(3), abs=1e-14)
    states = np.stack([y, after])
    assert frame.jacobian_rate(states).shape == (2, 6 if frame.rotation else 3, 3)


def test_a_frame_is_ready_at_once(arm: Functions) -> None:
    assert arm.frame("link[2].a") is arm.frame("link[2].a")
    with pytest.raises(mechc.UsageMistake, match="neither a frame nor a point"):
        arm.frame("joint[1].angle")
    with pytest.raises(mechc.UsageMistake, match="neither a frame nor a point"):
        arm.frame("elsewhere")


def test_momenta_of_a_free_body() -> None:
    """By hand: the mass centre stands off the origin of the frame, and J is about it."""
    f = mechc.loads(FREE).functions
    y = state(f)
    y[3:7] /= np.linalg.norm(y[3:7])
    frame = f.frame("body.a")
    assert frame.rotation is not None and frame.angular_velocity is not None
    turn, spin = frame.rotation(y), frame.angular_velocity(y)
    arm = turn @ [0.1, 0.2, -0.1]
    inertia = turn @ [[0.3, 0.01, 0], [0.01, 0.2, 0.02], [0, 0.02, 0.4]] @ turn.T
    momentum = np.concatenate([2 * (frame.velocity(y) + np.cross(spin, arm)), inertia @ spin])
    assert f.centroid.mass(y) == 2
    assert f.centroid.position(y) == pytest.approx(frame.position(y) + arm, abs=1e-14)
    assert f.centroid.momentum(y) == pytest.approx(momentum, abs=1e-13)
    assert f.centroid.matrix(y) @ y[7:13] == pytest.approx(momentum, abs=1e-13)
    a = f.accelerations(y)  # no force acts
    assert f.centroid.matrix(y) @ a + f.centroid.drift(y) == pytest.approx(np.zeros(6), abs=1e-11)


@pytest.mark.parametrize("question", ["reaction", "moment"])
def test_questions_about_reactions_leave_frames_and_momenta(question: str) -> None:
    """A reaction gives joints displacements that are zero in every motion: what is asked of frames is as without it."""
    plain = mechc.loads(FREE).functions
    asked = mechc.loads(FREE.replace("end ", f"  output R[3] = {question}(joint);\nend ")).functions
    y = state(plain)
    a, b = plain.frame("body.a"), asked.frame("body.a")
    for name in a.__struct_fields__:
        assert getattr(b, name)(y) == pytest.approx(getattr(a, name)(y), abs=1e-13)
    assert asked.centroid.momentum(y) == pytest.approx(plain.centroid.momentum(y), abs=1e-13)
    assert asked.centroid.matrix(y) == pytest.approx(plain.centroid.matrix(y), abs=1e-13)
    rates = np.random.default_rng(3).normal(size=6)
    assert asked.regressor(["body.a"])(y, rates) == pytest.approx(
        plain.regressor(["body.a"])(y, rates), abs=1e-12
    )


def test_gravity_of_all_bodies_is_zero_without_any_and_none_where_it_depends_on_the_place() -> None:
    """A regressor serves a model without gravity; the field of a planet is not one acceleration."""
    plain = mechc.loads(FREE).functions
    y, a = state(plain), np.array([0.3, -2.0, 1.1, 0.4, 0.1, -0.7])
    y[3:7] /= np.linalg.norm(y[3:7])
    c = np.array([0.1, 0.2, -0.1])
    about = np.array([[0.3, 0.01, 0], [0.01, 0.2, 0.02], [0, 0.02, 0.4]]) + 2 * (
        c @ c * np.eye(3) - np.outer(c, c)
    )
    one = [2, *(2 * c), *np.diag(about), about[0, 1], about[0, 2], about[1, 2]]
    assert plain.centroid.gravity is not None and plain.centroid.gravity(y) == pytest.approx(np.zeros(3))
    assert plain.regressor(["body.a"])(y, a) @ one == pytest.approx(plain.inverse_dynamics(y, a), abs=1e-12)
    planet = "function planet(Length r[3]) = -1 m^3/s^2/norm(r);\n"
    for field, text in (
        ("planet", planet),
        ("pull", planet.replace("planet", "pull").replace("-1 m^3/s^2/", "-1 m^3/s^2*r/norm(r)^2/")),
    ):
        f = mechc.loads(text + FREE.replace("  Body", f"  gravity {field};\n  Body", 1)).functions
        assert f.centroid.gravity is None
        with pytest.raises(mechc.UsageMistake, match="gravity is not the same"):
            f.regressor(["body.a"])


def test_the_regressor_gives_inverse_dynamics(arm: Functions) -> None:
    """Linear in mass, first moments and moments of inertia about the origins; the inputs act beside it."""
    y, a = state(arm), np.array([0.3, -2.0, 1.1])
    c = np.array([0.1, -0.4, 0.05])
    about = np.diag([0.11, 0.02, 0.13]) + 1.5 * (c @ c * np.eye(3) - np.outer(c, c))
    one = [1.5, *(1.5 * c), *np.diag(about), about[0, 1], about[0, 2], about[1, 2]]
    regressor = arm.regressor([f"link[{k}].a" for k in (1, 2, 3)])(y, a)
    assert regressor.shape == (3, 30)
    assert regressor @ np.tile(one, 3) == pytest.approx(arm.inverse_dynamics(y, a), abs=1e-12)


def test_pinocchio_says_the_same(arm: Functions) -> None:
    pin = pytest.importorskip("pinocchio")
    model = pin.Model()
    model.gravity.linear = np.array([0.3, 0, -9.81])
    parent = 0
    for i, axis in enumerate("XYZ"):
        place = pin.SE3(np.eye(3), np.array([0, -1.0 if i else 0.0, 0]))
        parent = model.addJoint(parent, getattr(pin, f"JointModelR{axis}")(), place, f"j{i}")
        body = pin.Inertia(1.5, np.array([0.1, -0.4, 0.05]), np.diag([0.11, 0.02, 0.13]))
        model.appendBodyToJoint(parent, body, pin.SE3.Identity())
    data = model.createData()
    y = state(arm)
    q, v, a = y[:3], y[3:6], np.array([0.3, -2.0, 1.1])
    pin.computeJointJacobiansTimeVariation(model, data, q, v)
    axes = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
    frame = arm.frame("link[3].a")
    assert frame.jacobian_rate(y) == pytest.approx(
        pin.getJointJacobianTimeVariation(model, data, 3, axes), abs=1e-11
    )
    assert frame.rotation is not None
    assert frame.rotation(y) == pytest.approx(data.oMi[3].rotation, abs=1e-12)
    pin.ccrba(model, data, q, v)
    assert arm.centroid.position(y) == pytest.approx(data.com[0], abs=1e-12)
    assert arm.centroid.momentum(y) == pytest.approx(data.hg.vector, abs=1e-11)
    assert arm.centroid.matrix(y) == pytest.approx(data.Ag, abs=1e-11)
    theirs = pin.computeJointTorqueRegressor(model, data, q, v, a)
    order = [0, 1, 2, 3, 4, 6, 9, 5, 7, 8]  # theirs: m, mc, xx xy yy xz yz zz
    ours = arm.regressor([f"link[{k}].a" for k in (1, 2, 3)])(y, a)
    for body in range(3):
        assert ours[:, 10 * body : 10 * body + 10] == pytest.approx(
            theirs[:, 10 * body : 10 * body + 10][:, order], abs=1e-11
        )


def test_inverse_kinematics_of_two_bars() -> None:
    """The law of cosines gives both elbows."""
    model = mechc.loads(TWO)
    place = np.array([0.9, 0.8])
    distance = math.hypot(*place)
    elbow = math.pi - math.acos((1 + 0.64 - distance**2) / (2 * 0.8))
    found = model.ik("lower.b", place)
    assert found.reached
    assert abs(abs(found.values["elbow.angle"]) - elbow) < 1e-9
    other = model.ik("lower.b", place, limits={"elbow.angle": (-math.pi, 0.0)})
    assert other.values["elbow.angle"] == pytest.approx(-elbow, abs=1e-9)
    assert model.functions.frame("lower.b").position(other.y) == pytest.approx(place, abs=1e-9)
    far = model.ik("lower.b", [2.0, 1.0], starts=3)
    assert not far.reached
    assert far.error == pytest.approx(math.hypot(2, 1) - 1.8, rel=1e-6)


def test_poses_in_space_within_limits(arm: Functions) -> None:
    y = state(arm, 5)
    frame = arm.frame("link[3].a")
    assert frame.rotation is not None
    model = mechc.loads(ARM)
    found = model.ik("link[3].a", frame.position(y), frame.rotation(y))
    assert found.reached
    assert frame.rotation(found.y) == pytest.approx(frame.rotation(y), abs=1e-8)
    held = model.ik("hand", arm.frame("hand").position(y), held="joint[3].angle", starts=2)
    assert held.q.size == 2
    with pytest.raises(mechc.UsageMistake, match="which has no rotation"):
        model.ik("hand", rotation=np.eye(3))
    with pytest.raises(mechc.UsageMistake, match="orthogonal"):
        model.ik("link[3].a", rotation=2 * np.eye(3))
    with pytest.raises(mechc.UsageMistake, match="did you mean"):
        model.ik("hand", [0, 0, 0], limits={"joint[1].angl": (0, 1)})


def test_loops_stay_closed() -> None:
    model = mechc.loads(FOUR)
    place = model.functions.frame("b.b").position(model.functions.start) + np.array([0.05, 0.0])
    on_the_circle = np.array([1, 0]) + 0.9 * (place - [1, 0]) / np.linalg.norm(place - [1, 0])
    found = model.ik("b.b", on_the_circle)
    assert found.reached
    assert np.abs(model.functions.constraints(found.y)[:2]).max() < 1e-8


def test_faster_functions_give_the_same(arm: Functions) -> None:
    """But for the last digits: gcc fuses products and sums."""
    fast, y = arm.faster(), state(arm)
    assert fast.faster() is fast
    assert fast.mass_matrix(y) == pytest.approx(arm.mass_matrix(y), rel=1e-13)
    assert fast.frame("hand").jacobian(y) == pytest.approx(
        arm.frame("hand").jacobian(y), rel=1e-13, abs=1e-14
    )
    assert fast.centroid.momentum(y) == pytest.approx(arm.centroid.momentum(y), rel=1e-12)
