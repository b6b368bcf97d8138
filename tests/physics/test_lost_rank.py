"""Constraints of velocities that depend on each other at one place: no jump of velocities without a word."""

from __future__ import annotations

import pytest

import mechc
from mechc.runtime.outcome import Outcome

CART = """
parameter turn = 0 deg;
parameter ahead = 1 m/s;
coordinate Length x = 0 m;
coordinate Length y = 0 m;
coordinate Angle a = 0 deg;
coordinate Angle b = turn;
kinetic 1/2*0.01 kg.m^2*der(b)^2;
initial der(b) = -1 rad/s;
frame body = world * trans({x, y}) * rot(a);
mass 1 kg at body;
inertia 0.1 kg.m^2 on body;
point p = body * {0, 1} m;
point q = body * {0, -1} m;
constraint first: dot(vel(p), {-sin(a), cos(a)}) = 0 m/s;
constraint second: dot(vel(q), {-sin(a + b), cos(a + b)}) = 0 m/s;
initial der(x) ~ ahead;
initial der(y) ~ 0 m/s;
initial der(a) ~ 1 rad/s;
"""


@pytest.fixture(scope="module")
def cart() -> mechc.Model:
    return mechc.loads(CART)


@pytest.mark.parametrize("tolerance", [1e-6, 1e-10])
def test_velocities_that_fit_only_where_the_rank_is_lost(cart: mechc.Model, tolerance: float) -> None:
    """Two parallel wheels let the body roll as well as turn, a steered one has it turn about q alone."""
    solution = cart.simulate(stop=0.5, tolerance=tolerance, estimate_error=False)
    assert solution.outcome is Outcome.FAILED
    assert "change the velocities at once" in solution.message
    assert solution.time[-1] < 0.01


@pytest.mark.parametrize("turn", ["0 deg", "20 deg"])
def test_velocities_that_fit_on_both_sides(cart: mechc.Model, turn: str) -> None:
    """The body turns about q evenly, through the place where the wheels are parallel."""
    solution = cart.simulate(stop=1, set={"turn": turn, "ahead": "-1 m/s"}, estimate_error=False)
    assert solution.outcome is Outcome.COMPLETED
    assert solution["der(a)"][-1] == pytest.approx(1, abs=1e-8)
    assert solution["a"][-1] == pytest.approx(1, abs=1e-8)


def test_a_body_at_rest_stays_at_rest(cart: mechc.Model) -> None:
    still = (
        CART.replace("~ ahead", "= 0 m/s").replace("~ 1 rad/s", "= 0 rad/s").replace("der(y) ~", "der(y) =")
    )
    solution = mechc.loads(still).simulate(stop=1, set={"turn": "20 deg"}, estimate_error=False)
    assert solution.outcome is Outcome.COMPLETED
    assert solution["a"][-1] == pytest.approx(0, abs=1e-12)


AXLE = """
import mech.spatial.*;
import mech.couplings.*;
parameter camber = 10 deg;
gravity {0, 0, -9.81} m/s^2;
Body axle(m = 1 kg, J = diag({0.1, 0.2, 0.3} kg.m^2), com = {0, 0, 0} m);
Free free(world -> axle.a, position ~ {0, 0, 0.4} m, der(position) ~ {1, 0, 0} m/s);
"""
DISK = """
Body wheel{n}(m = 0.2 kg, J = diag({{0.01, 0.02, 0.01}} kg.m^2), com = {{0, 0, 0}} m);
Revolute hinge{n}(axle.a * trans({{0, {side}0.5, 0}} m) * rotx({side}camber) -> wheel{n}.a, axis = {{0, 1, 0}});
RollingDisk roll{n}(world -> wheel{n}.a, r = 0.4 m, axis = {{0, 1, 0}});
"""


@pytest.mark.slow
def test_two_cambered_disks_on_one_axle() -> None:
    """Upright they roll on; cambered each would turn about another point of the ground."""
    text = AXLE + "".join(DISK.format(n=n, side=side) for n, side in ((1, ""), (2, "-")))
    upright = mechc.loads(text.replace("10 deg", "0 deg")).simulate(stop=1, estimate_error=False)
    assert upright.outcome is Outcome.COMPLETED
    assert upright["free.position[1]"][-1] - upright["free.position[1]"][0] == pytest.approx(
        upright["der(free.position[1])"][0], abs=1e-9
    )
    cambered = mechc.loads(text).simulate(stop=1, estimate_error=False)
    assert cambered.outcome is Outcome.FAILED and cambered.time[-1] < 1e-3
    assert "change the velocities at once" in cambered.message
