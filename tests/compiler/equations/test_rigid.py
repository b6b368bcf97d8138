"""Masses and inertias that no body has are told; parts of a body may have them."""

from __future__ import annotations

import numpy as np
import pytest

import mechc

BODY = "coordinate Length r[3] = 0 m; coordinate Rotation R; frame F = world * trans(r) * R; "
PLATE = "coordinate Length r[2] = 0 m; coordinate Angle a = 0 rad; frame F = world * trans(r) * rot(a); "


def codes(text: str) -> list[str]:
    try:
        return [found.code for found in mechc.loads(text).diagnostics]
    except mechc.CompileError as error:
        return [found.code for found in error.diagnostics]


@pytest.mark.parametrize(
    ("statements", "code"),
    [
        ("mass 1 kg at F; inertia diag({1, 2, 3} kg.m^2) on F;", ""),
        ("mass 1 kg at F; inertia diag({1, 2, 3.01} kg.m^2) on F;", "N0533"),
        # a wheel whose spin alone counts
        (
            "mass 1 kg at F; inertia diag({1, 1, 1} kg.m^2) on F; coordinate Angle a; inertia diag({2, 0, 0} kg.m^2) on F * rotx(a);",
            "",
        ),
        (
            "mass 1 kg at F; inertia diag({1, 1, 1} kg.m^2) on F; coordinate Angle a; inertia diag({2, 1e-3, 0} kg.m^2) on F * rotx(a);",
            "N0533",
        ),
        ("mass 1 kg at F; inertia {{2, 0.1, 0}, {0.2, 3, 0}, {0, 0, 4}} kg.m^2 on F;", "E0531"),
        ("mass 1 kg at F; inertia {{2, 0.1, 0}, {0.1, 3, 0}, {0, 0, 4}} kg.m^2 on F;", ""),
        ("mass 1 kg at F; inertia diag({1, 1, -0.1} kg.m^2) on F;", "E0530"),
        ("mass -1 kg at F; inertia diag({1, 1, 1} kg.m^2) on F;", "E0530"),
        ("mass 1 kg at F; mass -0.6 kg at F * {1, 0, 0} m; inertia diag({1, 1, 1} kg.m^2) on F;", "E0530"),
        ("mass 1 kg at F; mass -0.1 kg at F * {1, 0, 0} m; inertia diag({1, 1, 1} kg.m^2) on F;", ""),
        # moments that are impossible alone, but not with the masses beside them or with a turned part
        ("mass 1 kg at F; mass 1 kg at F * {0, 2, 0} m; inertia diag({0.1, 1.2, 0} kg.m^2) on F;", ""),
        ("mass 1 kg at F; mass 1 kg at F * {2, 0, 0} m; inertia diag({0.1, 1.2, 0} kg.m^2) on F;", "N0533"),
        (
            "mass 1 kg at F; mass 1 kg at F * rotz(90 deg) * {2, 0, 0} m; inertia diag({0.1, 1.2, 0} kg.m^2) on F;",
            "",
        ),
        (
            "inertia diag({0, 0, 1} kg.m^2) on F * rotx(90 deg); inertia diag({0.3, 0, 0.3} kg.m^2) on F; mass 1 kg at F;",
            "N0533",
        ),
        (
            "inertia diag({0, 0, 1} kg.m^2) on F * rotx(90 deg); inertia diag({0.3, 0, 0.8} kg.m^2) on F; mass 1 kg at F;",
            "",
        ),
    ],
)
def test_bodies_in_space(statements: str, code: str) -> None:
    assert codes(BODY + statements) == ([code] if code else [])


@pytest.mark.parametrize(
    ("statements", "code"),
    [
        (
            "mass 3 kg at F; mass -1 kg at F * {1, 0} m; inertia 2 kg.m^2 on F;",
            "",
        ),  # 2 - 1 - 1/2 = 1/2 remain
        ("mass 3 kg at F; mass -1 kg at F * {1, 0} m; inertia 1.4 kg.m^2 on F;", "E0530"),
        ("mass 1 kg at F; inertia -1 kg.m^2 on F;", "E0530"),
        # two bodies: the second one is a body of its own, though its point hangs on the world
        (
            "coordinate Length x = 1 m; mass 3 kg at F; inertia 1 kg.m^2 on F; mass -1 kg at world * {x, 0};",
            "E0530",
        ),
    ],
)
def test_bodies_in_the_plane(statements: str, code: str) -> None:
    assert codes(PLATE + statements) == ([code] if code else [])


@pytest.mark.parametrize("asked", ["reaction", "moment"])
@pytest.mark.parametrize("turn", ["pin.angle = time*(1 rad/s)", "pin.angle = 1 rad"])
def test_body_behind_a_joint_that_is_asked(asked: str, turn: str) -> None:
    """A joint whose reaction is asked for displaces its body virtually, which has no place of its own then."""
    text = f"""
import mech.spatial.*;
model Asked
  Revolute pin(world -> bar.a, axis = {{0, 0, 1}});
  drive {turn};
  Body bar(m = 1 kg, J = diag({{1, 2, 3.01}} kg.m^2));
  output A[3] = {asked}(pin);
  experiment(stop = 1 s);
end Asked;
"""
    assert codes(text) == ["N0533"]


SWING = """
import mech.spatial.*;
model Swing
  gravity {{0, 0, -9.81}} m/s^2;
  Body b(m = 1 kg, com = {{0, 0, 0.1}} m, J = {tensor} kg.m^2);
  Body tip(m = 1 kg, com = {{0.1, 0, 0}} m, J = diag({{0.1, 0.1, 0.1}} kg.m^2));
  Revolute j(world -> b.a, axis = {{0, 1, 0}});
  Revolute k(b.a -> tip.a, axis = {{0, 0, 1}});
  experiment(stop = 1 s, tolerance = 1e-10);
end Swing;
"""


@pytest.mark.parametrize(
    "tensor",
    [
        "{{-5e-20, 0, 0}, {0, -5e-20, 0}, {0, 0, 0}}",
        "{{0, 3e-20, 0}, {0, 0, 0}, {0, 0, 0}}",
        "{{1e-15, 0, 0}, {0, 1e-15, 0}, {0, 0, -5e-20}}",
    ],
)
def test_moments_that_are_rounding_are_none(tensor: str) -> None:
    """What is left of turning and shifting is lost in the moments about the joints: a compound pendulum, by its energy."""
    model = mechc.loads(SWING.format(tensor=tensor))
    assert not model.diagnostics
    solution = model.simulate(estimate_error=False)
    assert isinstance(solution, mechc.Solution)
    angle, rate = solution["j.angle"], solution["der(j.angle)"]
    moment = 0.1**2 + 0.1 + 0.1**2
    assert rate**2 == pytest.approx(2 * 0.981 * (1 - np.cos(angle) + np.sin(angle)) / moment, abs=1e-7)
    assert rate[-1] > 3


@pytest.mark.parametrize(
    ("statements", "code"),
    [
        # about the frame 0.01 kg.m^2, a tenth of a billionth of which is no rounding
        ("mass 1 kg at F * {0, 0, 0.1} m; inertia diag({-1e-12, 1, 1} kg.m^2) on F;", ""),
        ("mass 1 kg at F * {0, 0, 0.1} m; inertia diag({-1e-12, -1e-12, 0} kg.m^2) on F;", "E0530"),
        ("mass 1 kg at F; inertia diag({-5e-20, -5e-20, 0} kg.m^2) on F;", "E0530"),
        ("mass 1 kg at world * {0, 0, 1} m; mass -2.8e-17 kg at F; inertia identity(3)*1 kg.m^2 on F;", ""),
        ("mass -2.8e-17 kg at F; inertia identity(3)*1 kg.m^2 on F;", "E0530"),
    ],
)
def test_what_is_rounding_is_measured_by_the_model(statements: str, code: str) -> None:
    assert codes(BODY + statements) == ([code] if code else [])
