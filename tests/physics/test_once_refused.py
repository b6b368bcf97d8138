"""Models that are right, and that were once refused, without an end, or slow.

| what | where it is tested besides |
|---|---|
| a count of turns | here |
| a clamp that takes hold later | test_docking |
| a table on four legs, rough, without rebound | test_ties |
| masses twelve powers of ten apart, without a tie | test_masses_far_apart |
| the same with a tie | here |
| a weld beside a universal joint, off by rounding | stdlib/test_couplings |
| a coordinate without mass that constraints hold | here |
| a spatial loop that begins far from closed | here |
| both sides of a groove reached together | test_grooves |
| rolling on a circle beside an arm | stdlib/test_couplings |
"""

from __future__ import annotations

import numpy as np
import pytest

import mechc
from mechc.runtime.outcome import Outcome
from mechc.solution import Solution


def run(text: str, stop: float, tolerance: float | None = None) -> Solution:
    solution = mechc.loads(text).simulate(stop=stop, tolerance=tolerance, estimate_error=False)
    assert solution.outcome is Outcome.COMPLETED, solution.message
    return solution


def energy_drift(solution: Solution) -> float:
    drift = solution.accuracy.energy
    assert drift is not None and drift.relative is not None
    return drift.relative


def test_turns_are_counted_while_they_become_shorter() -> None:
    """After 60 s at 1 rad/s^2 it is on 1800 rad; intervals that shrink to no end are not bounces."""
    solution = run(
        """
        discrete Integer turns = 0;
        coordinate Angle a = 0 rad;
        kinetic 1/2*1 kg.m^2*der(a)^2;
        force 1 N.m on a;
        when a > 2*pi*(turns + 1) then turns := turns + 1; end when;
        """,
        60,
    )
    assert solution["turns"][-1] == 1800 // (2 * np.pi)


@pytest.mark.parametrize("tolerance", [1e-8, 1e-12])
def test_a_light_pendulum_tied_to_a_heavy_one(tolerance: float) -> None:
    """What 1e-6 kg and 1e6 kg on one bar lose is what the tolerance allows of the energy of the heavy one."""
    solution = run(
        """
        coordinate Angle a = 1 rad;
        coordinate Angle b ~ 1 rad;
        gravity {0, -9.81} m/s^2;
        point p = world * {sin(a), -cos(a)} m;
        point q = world * {2 + sin(b), -cos(b)} m;
        mass 1e-6 kg at p;
        mass 1e6 kg at q;
        constraint tie: norm(q - p) = 2 m;
        """,
        10,
        tolerance=tolerance,
    )
    assert energy_drift(solution) < 20 * tolerance
    assert np.abs(solution["a"] - solution["b"]).max() < 20 * tolerance


def test_a_coordinate_without_mass_that_constraints_hold() -> None:
    """A bead on (s, s^2), where s is the place on the wire: v^2 = 2 g (y0 - y)."""
    solution = run(
        """
        coordinate Length x = 1 m;
        coordinate Length y ~ 1 m;
        coordinate s ~ 1;
        kinetic 1/2*1 kg*(der(x)^2 + der(y)^2);
        potential 1 kg*9.81 m/s^2*y;
        constraint {x, y} = {s, s^2}*(1 m);
        """,
        3,
    )
    square = solution["der(x)"] ** 2 + solution["der(y)"] ** 2
    np.testing.assert_allclose(square, 2 * 9.81 * (1 - solution["y"]), atol=1e-5)
    np.testing.assert_allclose(solution["s"] ** 2, solution["y"], atol=1e-7)
    assert solution["x"].min() < -0.99


def test_the_nearest_place_of_a_curve_is_a_coordinate_without_mass() -> None:
    """A ball of 0.1 m bounces on a parabola; the distance of its centre by a search over the curve."""
    solution = run(
        """
        coordinate Length x = 0.5 m;
        coordinate Length y = 0.6 m;
        coordinate s ~ 0.6;
        kinetic 1/2*1 kg*(der(x)^2 + der(y)^2);
        potential 1 kg*9.81 m/s^2*y;
        let off = {x - s*(1 m), y - s^2*(1 m)};
        constraint foot: off[1] + 2*s*off[2] = 0 m;
        contact c: (off[2] - 2*s*off[1])/sqrt(1 + 4*s^2) - 0.1 m restitution 0.5;
        """,
        0.6,
    )
    places = np.linspace(-1.5, 1.5, 3001)
    far = np.hypot(solution["x"][:, None] - places, solution["y"][:, None] - places**2).min(axis=1)
    assert far.min() == pytest.approx(0.1, abs=1e-5)
    assert next(e.kind for e in solution.events) == "impact"
    assert energy_drift(solution) < 1e-7


@pytest.mark.slow
def test_a_spatial_loop_that_begins_far_from_closed() -> None:
    """Revolute, two spherical joints, revolute; all angles are guessed."""
    solution = run(
        """
        import mech.spatial.*;
        gravity {0, 0, -9.81} m/s^2;
        Body a(m = 1 kg, J = diag({0.01, 0.02, 0.03})*(1 kg.m^2), com = {0.25 m, 0, 0});
        Body b(m = 1 kg, J = diag({0.01, 0.02, 0.03})*(1 kg.m^2), com = {0.3 m, 0, 0});
        Body c(m = 1 kg, J = diag({0.01, 0.02, 0.03})*(1 kg.m^2), com = {0.2 m, 0, 0});
        Revolute first(world -> a.a, axis = {0, 0, 1}, angle ~ 0.3 rad);
        Spherical second(a.a * trans({0.5 m, 0, 0}) -> b.a);
        Spherical third(b.a * trans({0.8 m, 0, 0}) -> c.a);
        Revolute last(world * trans({0.7, 0.3, 0.1} m) -> c.a * trans({0.5 m, 0, 0}), axis = {0, 1, 0});
        """,
        0.4,
    )
    assert solution.statistics.steps < 100 and energy_drift(solution) < 1e-6
