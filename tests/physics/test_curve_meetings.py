"""Curves with everything else of the language: components, arrays, tables, experiments, sweeps, settings, structural choices."""

from __future__ import annotations

import math
from typing import Any

import mpmath as mp
import numpy as np
import pytest

import mechc
from mechc.runtime.curves.found import CurveSolution

STRANDS = """
model Strand
  dimensionless;
  parameter c = 1;
  parameter low = 0;
  parameter high = 0;
  coordinate y ~ low + (high - low)*t;
  initial y = low;
  final y = high;
  lagrangian 1/2*der(y)^2 - 1/2*c*y^2;
end Strand;
model Strands
  dimensionless;
  structural parameter Boolean coupled = true;
  independent t from 0 to 1;
  Strand s[2](c = 2, low = {1, 0}, high = {0, 1});
  if coupled then
    potential 1/2*(s[1].y - s[2].y)^2;
  end if;
  experiment together();
  experiment alone(coupled = false);
end Strands;
"""


@pytest.mark.parametrize(("experiment", "stiffness"), [("together", (2, 4)), ("alone", (2, 2))])
def test_components_in_arrays_and_a_structural_choice(experiment: str, stiffness: tuple[int, int]) -> None:
    """Sum and difference are oscillators: for ends u0, u1 the action is w ((u0^2 + u1^2) cos w - 2 u0 u1)/(2 sin w)."""
    found: CurveSolution = mechc.loads(STRANDS).solve(experiment=experiment)
    exact = 0.0
    for square, (u0, u1) in zip(stiffness, ((1, 1), (1, -1)), strict=True):
        w = math.sqrt(square)
        exact += 0.5 * w * ((u0**2 + u1**2) * math.cos(w) - 2 * u0 * u1) / (2 * math.sin(w))
    assert abs(found.stationary - exact) <= 30 * found.error <= 1e-9 * abs(exact)
    assert found.coordinates == ("s[1].y", "s[2].y")


LINE = """
model Line
  parameter a = 0 m;
  parameter b = 1 m;
  parameter k[2] = {1, 2};
  independent x from a to b;
  coordinate Real y[2] ~ {0.1*x/1 m, 1 - x/b};
  initial y = {0, 1};
  final y = {1, 0};
  stationary integral(1 m*(der(y[1])^2 + der(y[2])^2) + (k[1]^2*y[1]^2 + k[2]^2*y[2]^2)/(1 m));
  output mid[2] = {at(y[1], (a + b)/2), at(y[2], (a + b)/2)};
  experiment near();
  experiment far(b = 2 m);
  experiment several(b in {1 m, 2 m, 3 m});
end Line;
"""


def line(a: float, b: float) -> tuple[float, list[float]]:
    """y'' = k^2 y from 0 to 1, and from 1 to 0: k coth(k l) each; 1/(2 cosh(k l/2)) in the middle."""
    ks = (1, 2)
    return sum(k / math.tanh(k * (b - a)) for k in ks), [0.5 / math.cosh(k * (b - a) / 2) for k in ks]


@pytest.mark.parametrize(
    ("given", "ends"),
    [
        ({}, (0, 1)),
        ({"experiment": "far"}, (0, 2)),
        ({"set": {"b": "170 cm"}}, (0, 1.7)),
        ({"set": {"a": -0.5, "b": "1 m"}}, (-0.5, 1)),
        ({"experiment": "far", "set": {"a": 0.5}}, (0.5, 2)),
    ],
)
def test_ends_of_the_range_that_are_set(given: dict[str, Any], ends: tuple[float, float]) -> None:
    found: CurveSolution = mechc.loads(LINE).solve(**given)
    value, middle = line(*ends)
    assert found.interval == pytest.approx(ends, abs=1e-15)
    assert abs(found.stationary - value) <= 30 * found.error <= 1e-9
    assert [found.outputs["mid[1]"], found.outputs["mid[2]"]] == pytest.approx(middle, rel=1e-12)


@pytest.mark.slow
def test_a_sweep_gives_a_curve_for_each_value() -> None:
    found = mechc.loads(LINE).solve(experiment="several", all=True)
    assert [p["b"] for p in found.points] == [1, 2, 3]
    for point, (solution,) in zip(found.points, found.solutions, strict=True):
        assert solution.stationary == pytest.approx(line(0, point["b"])[0], rel=1e-12)


def test_a_tabulated_index_of_refraction() -> None:
    """Through points on a line the table is that line: light in n = 1 + y goes along a catenary."""
    found: CurveSolution = mechc.loads("""
        model Tabulated
          dimensionless;
          independent x from -0.5 to 0.5;
          coordinate y ~ 1;
          initial y = 1;
          final y = 1;
          stationary integral(table(y, {0, 0.5, 1.5, 2}, {1, 1.5, 2.5, 3})*sqrt(1 + der(y)^2));
        end Tabulated;
    """).solve()
    c = mp.findroot(lambda c: c * mp.cosh(mp.mpf("0.5") / c) - 2, 1.9)
    exact = float(c / 2 + c**2 / 2 * mp.sinh(1 / c))
    assert abs(found.stationary - exact) <= 30 * found.error <= 1e-9


def test_several_variables_on_a_wall() -> None:
    """A geodesic of a cylinder is a helix; the density of the wall's multiplier is that of the force on it."""
    found: CurveSolution = mechc.loads("""
        model Cylinder
          dimensionless;
          parameter turn = 1;
          independent z from 0 to 1;
          coordinate x ~ cos(turn*z);
          coordinate y ~ sin(turn*z);
          initial x = 1;
          initial y = 0;
          final x = cos(turn);
          final y = sin(turn);
          stationary integral(sqrt(1 + der(x)^2 + der(y)^2));
          constraint wall: x^2 + y^2 = 1;
        end Cylinder;
    """).solve(set={"turn": 2})
    assert abs(found.stationary - math.sqrt(5)) <= 30 * found.error <= 1e-9
    assert found["multiplier(wall)"] == pytest.approx(-4 / (2 * math.sqrt(5)), rel=1e-6)
    assert np.abs(found["x"] - np.cos(2 * found.places)).max() < 1e-9


def test_bodies_of_the_library_between_two_places() -> None:
    """A pendulum from the library and the formula of its Lagrangian make the same action stationary."""
    bar = mechc.loads("""
        import mech.planar.*;
        model Between
          gravity {0, -9.81} m/s^2;
          Bar bar(m = 1 kg, l = 1 m);
          independent t from 0 s to 0.4 s;
          Revolute pivot(world -> bar.a, angle ~ 0 rad);
          initial pivot.angle = 0 rad;
          final pivot.angle = 0.5 rad;
        end Between;
    """).solve()
    formula = mechc.loads("""
        model Formula
          parameter m = 1 kg;
          parameter l = 1 m;
          parameter g = 9.81 m/s^2;
          independent t from 0 s to 0.4 s;
          coordinate Angle phi ~ 1.25 rad/s*t;
          initial phi = 0 rad;
          final phi = 0.5 rad;
          kinetic 1/6*m*l^2*der(phi)^2;
          potential m*g*l/2*sin(phi);
        end Formula;
    """).solve()
    assert bar.stationary == pytest.approx(formula.stationary, rel=1e-12)
    assert bar.negative_directions == formula.negative_directions == 0


STEERED = """
model Steered "the slope of y is z: a beam, of two coordinates"
  dimensionless;
  independent x from 0 to 1;
  coordinate y ~ 0;
  coordinate z ~ 0;
  initial y = 0;
  final y = 1;
  initial z = 0;
  final z = 0;
  stationary integral(1/2*der(z)^2);
  constraint c: der(y) = z;
end Steered;
"""


def test_ends_are_given_where_a_condition_on_slopes_holds() -> None:
    """y = 3 x^2 - 2 x^3, value 6; the slope of y at the ends is free to be z, and no contradiction of what is given."""
    found = mechc.loads(STEERED).solve()
    assert found.stationary == pytest.approx(6, rel=1e-12)
    assert found(0.25)["y"] == pytest.approx(3 / 16 - 2 / 64, rel=1e-10)
    other = mechc.loads(
        STEERED.replace("der(y) = z;", "2*der(y) = z - x;").replace("final z = 0", "final z = 3")
    )
    # 2 y' = z - x: z bends by as much as its mean, 1/2 + 2, is off the straight line's, 3/2: z = 3 x + 6 x (1 - x)
    assert other.solve().stationary == pytest.approx(4.5 + 6, rel=1e-12)
