"""Loops that close by themselves: joints between bodies that are welded to each other are off by rounding only, in any direction."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

import mechc

Matrix = NDArray[np.float64]
G = 9.81


def _turn(axis: str, angle: float) -> Matrix:
    c, s = np.cos(angle), np.sin(angle)
    return (
        np.array([[1, 0, 0], [0, c, -s], [0, s, c]])
        if axis == "x"
        else np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])
    )


def _vector(v: Matrix, scale: float = 1.0) -> str:
    return "{" + ", ".join(f"({scale * x!r})" for x in v.tolist()) + "}"


@pytest.mark.parametrize("joint", ["Universal", "Spherical", "Weld"])
@pytest.mark.parametrize("size", [1e-4, 1.0, 1e4])
@pytest.mark.filterwarnings("ignore")
def test_a_compound_pendulum_whose_parts_are_joined_twice(joint: str, size: float) -> None:
    """alpha = -g (m1 x1 + m2 x2) / (I1 + m1 x1^2 + I2 + m2 r2^2), with spheres for both."""
    at = np.array([-0.1323, -0.2007, -0.5615])
    turned = _turn("x", -0.067) @ _turn("y", -2.837)
    place = np.array([-0.4428, -0.4678, -0.1793])
    seen = turned.T @ (place - at)
    if joint == "Universal":  # angles of zero leave the axes of both sides as they are
        turning, further = (
            f"*axis_angle({{1, 0, 0}}, 0 rad)*roty({2.837!r} rad)*rotx({0.067!r} rad)",
            ", first={1, 0, 0}, second={0, 1, 0}",
        )
    else:
        turning, further = f"*roty({2.837!r} rad)*rotx({0.067!r} rad)", ""
    found = mechc.loads(f"""
import mech.spatial.*;
model Joined
  gravity {{0, {-G}, 0}} m/s^2;
  Body one(m = 2 kg, J = identity(3)*{0.3 * size**2!r} kg.m^2, com = {{{0.3 * size!r}, 0, 0}} m);
  Revolute axle(world -> one.a, axis = {{0, 0, 1}}, angle = 0 rad);
  Body two(m = 1 kg, J = identity(3)*{0.2 * size**2!r} kg.m^2);
  Weld held(one.a*trans({_vector(at, size)} m)*rotx(-0.067 rad)*roty(-2.837 rad) -> two.a);
  {joint} again(two.a*trans({_vector(seen, size)} m){turning} -> one.a*trans({_vector(place, size)} m){further});
  output alpha = der(axle.angle, 2);
  experiment(stop = {0.01 * size**0.5!r} s);
end Joined;
""").simulate(estimate_error=False)
    assert isinstance(found, mechc.Solution) and found.outcome.value == "completed"
    expected = -G * (2 * 0.3 + at[0]) / (0.3 + 2 * 0.09 + 0.2 + at[0] ** 2 + at[1] ** 2) / size
    assert float(found["alpha"][0]) == pytest.approx(expected, rel=1e-9)
