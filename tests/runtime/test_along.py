"""Linear systems along a run: against derivatives by hand, and their flow against exact derivatives of the motion."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.interpolate import make_interp_spline

import mechc
from mechc.runtime.outcome import SimulationError
from mechc.runtime.studies.kinds.along import Along

SWING = """
parameter l = 1.3 m;
input Torque u = 0.2 N.m;
coordinate Angle theta = 2 rad;
coordinate Angle unused = 0 rad;
kinetic 1/2*(2 kg)*l^2*der(theta)^2 + 1/2*(1 kg.m^2)*der(unused)^2;
potential -(2 kg)*(9.81 m/s^2)*l*cos(theta);
damping 0.3 N.m.s on theta;
force u on theta;
output height = -l*cos(theta);
experiment(stop = 2 s, every = 0.1 s, tolerance = 1e-10);
"""

BOB = """
parameter l = 1.3 m;
coordinate x = l*sin(2 rad); coordinate y ~ -l*cos(2 rad);
kinetic 1/2*(2 kg)*(der(x)^2 + der(y)^2);
potential (2 kg)*(9.81 m/s^2)*y;
constraint x^2 + y^2 = l^2;
experiment(stop = 0.4 s, every = 0.005 s, tolerance = 1e-11);
"""


def along(text: str, **settings: Any) -> Along:
    found = mechc.loads(text).study("along", **settings)
    assert isinstance(found, Along)
    return found


def test_a_pendulum_by_hand() -> None:
    found = along(SWING, outputs=["height", "theta"])
    assert [q.name for q in found.states] == ["theta", "unused", "der(theta)", "der(unused)"]
    assert found.A.shape == (21, 4, 4)
    theta, m, l = found.at[:, 0], 2.0, 1.3
    assert np.ptp(theta) > 2
    stiffness = np.zeros((21, 4, 4))
    stiffness[:, 0, 2] = stiffness[:, 1, 3] = 1
    stiffness[:, 2, 0] = -9.81 / l * np.cos(theta)
    stiffness[:, 2, 2] = -0.3 / (m * l**2)
    np.testing.assert_allclose(found.A, stiffness, atol=1e-13)
    np.testing.assert_allclose(found.B[:, :, 0], np.tile([0, 0, 1 / (m * l**2), 0], (21, 1)), atol=1e-14)
    np.testing.assert_allclose(found.C[:, 0, 0], l * np.sin(theta), atol=1e-13)
    np.testing.assert_allclose(found.C[:, 1], np.tile([1, 0, 0, 0], (21, 1)), atol=0)
    assert not found.D.any()
    np.testing.assert_allclose(found.time, np.arange(21) / 10, atol=1e-12)


def test_the_flow_of_a_constrained_motion_is_that_of_the_angle() -> None:
    """y = -l cos theta: dy of the loop against l sin theta times the exact derivative of the angle by its start.

    Splines of A with rows every 5 ms are good to 1e-8.
    """
    found = along(BOB)
    assert [q.name for q in found.states] == ["y", "der(y)"]
    system = make_interp_spline(found.time, found.A, k=5)
    l = 1.3
    flow = solve_ivp(
        lambda t, x: system(t) @ x, (0, 0.4), [l * np.sin(2.0), 0.0], rtol=1e-11, atol=1e-12, method="DOP853"
    )
    angle = mechc.loads(
        "parameter l = 1.3 m; coordinate Angle theta = 2 rad; kinetic 1/2*(2 kg)*l^2*der(theta)^2;"
        "potential -(2 kg)*(9.81 m/s^2)*l*cos(theta); experiment(stop = 0.4 s, tolerance = 1e-11);"
    ).simulate(sensitivity=["theta"])
    theta = angle["theta"][-1]
    expected = l * np.sin(theta) * angle.sensitivity("theta", "theta").values[-1]
    assert flow.y[0, -1] == pytest.approx(expected, rel=1e-7)
    assert flow.y[0, -1] != pytest.approx(l * np.sin(2.0), rel=1e-2)


def test_coordinates_are_those_that_describe_the_start() -> None:
    """At the side, x of a bob says nothing of where it is along the circle."""
    sideways = BOB.replace("coordinate x = l*sin(2 rad)", "coordinate x = 1.3 m").replace(
        "coordinate y ~ -l*cos(2 rad)", "coordinate y = 0 m"
    )
    assert [q.name for q in along(sideways.replace("0.4 s", "0.1 s")).states] == ["y", "der(y)"]


def test_what_switches_is_refused() -> None:
    text = "coordinate y = 1 m; kinetic 1/2*1 kg*der(y)^2; potential 9.81 N*y; contact floor: y; experiment(stop = 1 s);"
    with pytest.raises(SimulationError, match="switches, and a linear system does not"):
        mechc.loads(text).study("along")
