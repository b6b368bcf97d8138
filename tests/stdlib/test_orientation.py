"""Rotation vectors and angles of all conventions, against scipy.spatial.transform."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import mechc

CONVENTIONS = [a for a in product((1, 2, 3), repeat=3) if a[0] != a[1] != a[2]]
STOP = 50.0


@pytest.fixture(scope="module")
def tumbling() -> mechc.Solution:
    """A body that turns about no axis of its own against a frame that turns too, seen by the twelve conventions."""
    parts = "".join(
        f"Orientation o{''.join(map(str, a))}(turned -> body.a, axes = {{{a[0]}, {a[1]}, {a[2]}}});\n" for a in CONVENTIONS
    )  # fmt: skip
    return mechc.loads(f"""
import mech.spatial.*;
model Tumbling
  Body body(J = diag({{1, 2, 3}}) kg.m^2);
  Free joint(world -> body.a, orientation = axis_angle({{1, -2, 0.5}}, 100 deg), der(orientation) = {{0.3, 2, -0.2}} rad/s);
  frame turned = world * axis_angle({{0.3, 1, 2}}, (0.9 rad/s)*time);
  {parts}
  output Real seen[3, 3] = {{components(turned, direction(body.a, {{1, 0, 0}})), components(turned, direction(body.a, {{0, 1, 0}})),
                             components(turned, direction(body.a, {{0, 0, 1}}))}};
  experiment(stop = {STOP} s, tolerance = 1e-10);
end Tumbling;
""").simulate(estimate_error=False)


def rotations(s: mechc.Solution) -> Rotation:
    rows = np.array([[s[f"seen[{i},{k}]"] for k in (1, 2, 3)] for i in (1, 2, 3)])
    return Rotation.from_matrix(rows.transpose(2, 1, 0))


def test_vectors_of_rotation(tumbling: mechc.Solution) -> None:
    """Up to half a turn, where axis and opposite axis are alike: compared as rotations."""
    found = np.array([tumbling[f"o123.vector[{i}]"] for i in (1, 2, 3)]).T
    assert np.linalg.norm(found, axis=1).max() > 3.0  # close to half a turn
    assert np.linalg.norm(found, axis=1).max() < np.pi + 1e-12
    apart = (Rotation.from_rotvec(found).inv() * rotations(tumbling)).magnitude()
    assert apart.max() < 1e-7  # of acos near 1


@pytest.mark.parametrize("axes", CONVENTIONS, ids=str)
def test_angles_of_a_convention(tumbling: mechc.Solution, axes: tuple[int, int, int]) -> None:
    wanted = rotations(tumbling).as_euler("".join(" XYZ"[k] for k in axes))
    name = "o" + "".join(map(str, axes))
    found = np.array([tumbling[f"{name}.angles[{i}]"] for i in (1, 2, 3)]).T
    middle = np.cos(wanted[:, 1]) if axes[0] != axes[2] else np.sin(wanted[:, 1])
    determined = np.abs(middle) > 1e-3
    assert determined.sum() > 100
    assert np.exp(1j * found[determined]) == pytest.approx(np.exp(1j * wanted[determined]), abs=1e-10)
    assert found[:, 1].min() >= (-np.pi / 2 if axes[0] != axes[2] else 0)


@pytest.mark.parametrize(
    ("axis", "angle"),
    [("{1, 2, 2}/3", "1e-9 rad"), ("{1, 2, 2}/3", "pi"), ("{0, 0, 1}", "pi"), ("{-1, 0, 0}", "3 rad"), ("{0, 1, 0}", "0 rad")],
)  # fmt: skip
def test_vectors_without_a_turn_and_of_half_a_turn(axis: str, angle: str) -> None:
    s = mechc.loads(f"""
import mech.spatial.*;
model Still
  frame F = world * axis_angle({axis}, {angle});
  Orientation o(world -> F);
  output wanted[3] = {axis}*{angle};
  coordinate x = 1 m;
  kinetic 1/2*1 kg*der(x)^2;
  experiment(stop = 1 s);
end Still;
""").simulate()
    found, wanted = (np.array([s[f"{n}[{i}]"][0] for i in (1, 2, 3)]) for n in ("o.vector", "wanted"))
    assert found == pytest.approx(wanted, rel=1e-12, abs=1e-15)


def test_angles_about_one_axis_twice_over_are_refused() -> None:
    s = mechc.loads("import mech.spatial.*;\nmodel M frame F = world; Orientation o(world -> F, axes = {1, 1, 2}); coordinate x = 1 m; kinetic 1/2*1 kg*der(x)^2; end M;").simulate(stop=1)  # fmt: skip
    assert s.outcome.value == "failed" and "no two neighbours alike" in s.message
