"""Euler angles through their singularity, and the same motion without angles."""

from __future__ import annotations

from typing import Any

import numpy as np

from .case import Array, Case, Formula, Known, Refusal, within

NUMBER = 6
TITLE = "Gimbal lock"

ANGLES = """
coordinate Angle a = 0.3 rad;
coordinate Angle b = 0.5 rad;
coordinate Angle c = 0.2 rad;
initial der(a) = {a} rad/s;
initial der(b) = -1 rad/s;
frame body = world * rotz(a) * rotx(b) * rotz(c);
inertia diag({{2, 2, 2}} kg.m^2) on body;
output axis = direction(body, {{0, 0, 1}});
experiment(stop = 1 s, tolerance = 1e-10);
"""

ROTATION = """
coordinate Rotation R = rotz(0.3 rad)*rotx(0.5 rad)*rotz(0.2 rad);
initial der(R) = {{{x:.17g}, {y:.17g}, {z:.17g}}} rad/s;
frame body = world * R;
inertia diag({{2, 2, 2}} kg.m^2) on body;
output axis = direction(body, {{0, 0, 1}});
experiment(stop = 1 s, tolerance = 1e-10);
"""

Vector = tuple[float, float, float]


def world_rate(rate: float) -> Any:
    """Angular velocity at the start: a sphere keeps it."""
    return rate * np.array([0, 0, 1]) - np.array([np.cos(0.3), np.sin(0.3), 0])


def axis(rate: float, k: int) -> Formula:
    """The axis of the body turns about the constant angular velocity."""
    w = world_rate(rate)
    speed = float(np.linalg.norm(w))
    n = w / speed
    start = np.array([np.sin(0.3) * np.sin(0.5), -np.cos(0.3) * np.sin(0.5), np.cos(0.5)])

    def value(t: Array) -> Any:
        c, s = np.cos(speed * t), np.sin(speed * t)
        return c * start[k] + s * np.cross(n, start)[k] + (1 - c) * (n @ start) * n[k]

    return value


def known(rate: float) -> dict[str, Formula]:
    return {f"axis[{k + 1}]": axis(rate, k) for k in range(3)}


def body_rate(rate: float) -> dict[str, float]:
    def turn(a: float, first: int, second: int) -> Array:
        m = np.eye(3)
        m[first, first] = m[second, second] = np.cos(a)
        m[first, second], m[second, first] = -np.sin(a), np.sin(a)
        return m

    matrix = turn(0.3, 0, 1) @ turn(0.5, 1, 2) @ turn(0.2, 0, 1)
    return dict(zip("xyz", matrix.T @ world_rate(rate), strict=True))


CASES = (
    Case(
        "angles, straight through",
        "sin(b) = 0 at t = 0.5: the mass matrix is singular there, the motion is not",
        ANGLES.format(a=0),
        Known("the axis to 1e-8", known(0), 1e-8),
        fault="pushed",
    ),
    Case(
        "angles, past it by 1e-3",
        "the angles turn by pi within 1e-3 s",
        ANGLES.format(a=1e-3),
        Known("the axis to 1e-7", known(1e-3), 1e-7),
        fault="loose",
    ),
    Case(
        "angles, past it by 1e-7",
        "the angles turn by pi within 1e-7 s, at rates of 1e7",
        ANGLES.format(a=1e-7),
        Known("the axis to 1e-6", known(1e-7), 1e-6),
        fault="loose",
    ),
    Case(
        "angles, started in it",
        "b = 0: two angles turn about one axis",
        ANGLES.format(a=0).replace("b = 0.5 rad", "b = 0 rad"),
        Refusal("is refused at t = 0 with the cause", ("t = 0", "inertia"), (0, 0)),
        fault="no refusal",
    ),
    Case(
        "Rotation, straight through",
        "the same motion without angles",
        ROTATION.format(**body_rate(0)),
        Known("the axis to 1e-9, in few steps", known(0), 1e-9, (within(60),)),
        fault="pushed",
    ),
    Case(
        "Rotation, past it by 1e-7",
        "nothing happens there",
        ROTATION.format(**body_rate(1e-7)),
        Known("the axis to 1e-9, in few steps", known(1e-7), 1e-9, (within(60),)),
        fault="pushed",
    ),
)
