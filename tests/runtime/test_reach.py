"""A drive that asks a loop for more than it can reach is named, with the loop; the time is that of stretched bars."""

from __future__ import annotations

import math

import pytest

import mechc

LOOP = """
import mech.planar.*;
model Loop
  parameter speed = 10 rad/s;
  Bar crank(m = 1 kg, l = 0.2 m);
  Bar coupler(m = 2 kg, l = 0.5 m);
  Bar rocker(m = 1.5 kg, l = 0.4 m);
  frame pivot = world * trans({0.5, 0} m);
  Revolute a(world -> crank.a, angle = 60 deg);
  Revolute b(crank.b -> coupler.a, angle ~ -30 deg);
  Revolute d(pivot -> rocker.a, angle ~ 90 deg);
  Revolute c(coupler.b -> rocker.b);
  DRIVE
  experiment(stop = 0.5 s);
end Loop;
"""


@pytest.fixture(scope="module")
def driven() -> mechc.Model:
    return mechc.loads(LOOP.replace("DRIVE", "drive a.angle = 60 deg + speed*time;"))


@pytest.mark.parametrize(("crank", "rocker"), [(0.45, 0.4), (0.2, 0.15), (0.7, 0.4)])
def test_the_loop_and_the_time_are_named(driven: mechc.Model, crank: float, rocker: float) -> None:
    solution = driven.simulate(set={"crank.l": crank, "rocker.l": rocker})
    # the diagonal is as long as both bars together: law of cosines
    angle = math.acos((crank**2 + 0.25 - (0.5 + rocker) ** 2) / crank)
    assert solution.failure is not None
    assert solution.failure.time == pytest.approx((angle - math.radians(60)) / 10, abs=1e-6)
    assert "out of reach" in solution.failure.message and "closed by 'c'" in solution.failure.message
    assert solution.failure.origin is not None and "Revolute c(" in solution.failure.origin.text


def test_a_loop_that_closes_says_nothing(driven: mechc.Model) -> None:
    assert driven.simulate().failure is None


def test_what_fails_otherwise_is_no_matter_of_reach() -> None:
    model = mechc.loads(LOOP.replace("DRIVE", "torque 1 N.m/(0.1 - time/1 s)^2 on a.angle;"))
    failure = model.simulate().failure
    assert failure is not None and "out of reach" not in failure.message


def test_steps_say_it_too(driven: mechc.Model) -> None:
    run = driven.start(set={"crank.l": 0.45})
    with pytest.raises(mechc.SimulationError, match="out of reach"):
        run.step(0.5)
