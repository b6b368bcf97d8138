"""A runner that lands on two legs: impacts that a stop and a foot which sticks pass on to each other."""

from __future__ import annotations

import pytest

import mechc
from mechc.runtime.outcome import Outcome

RUNNER = """
import mech.spatial.{Body, Revolute, Prismatic};

model Runner "a planar runner that lands on two legs, one of which runs into its stop"
  gravity {0, 0, -9.81} m/s^2;
  frame across;
  frame up;
  Prismatic x(world -> across, axis = {1, 0, 0});
  Prismatic z(across -> up, axis = {0, 0, 1}, position = 0.7 m);
  Body torso(m = 6.25 kg, com = {0.152, 0, 0.025} m, J = identity(3)*(0.9 kg.m^2));
  Revolute pitch(up -> torso.a, axis = {0, 1, 0});
  Body bthigh(m = 1.54 kg, com = {0.1, 0, -0.13} m, J = identity(3)*(0.0168 kg.m^2));
  Body bshin(m = 1.59 kg, com = {-0.14, 0, -0.07} m, J = identity(3)*(0.0183 kg.m^2));
  Body bfoot(m = 1.1 kg, com = {0.03, 0, -0.097} m, J = identity(3)*(0.0064 kg.m^2));
  Body fthigh(m = 1.44 kg, com = {-0.07, 0, -0.12} m, J = identity(3)*(0.0137 kg.m^2));
  Body fshin(m = 1.2 kg, com = {0.065, 0, -0.09} m, J = identity(3)*(0.0082 kg.m^2));
  Body ffoot(m = 0.88 kg, com = {0.045, 0, -0.07} m, J = identity(3)*(0.0035 kg.m^2));
  Revolute bhip(torso.a * trans({-0.5, 0, 0} m) -> bthigh.a, axis = {0, 1, 0}, damping = 6 N.m.s,
                stiffness = 240 N.m/rad, armature = 0.1 kg.m^2);
  Revolute bknee(bthigh.a * trans({0.16, 0, -0.25} m) -> bshin.a, axis = {0, 1, 0},
                 damping = 4.5 N.m.s, stiffness = 180 N.m/rad, armature = 0.1 kg.m^2);
  Revolute bankle(bshin.a * trans({-0.28, 0, -0.14} m) -> bfoot.a, axis = {0, 1, 0},
                  damping = 3 N.m.s, stiffness = 120 N.m/rad, armature = 0.1 kg.m^2);
  Revolute fhip(torso.a * trans({0.5, 0, 0} m) -> fthigh.a, axis = {0, 1, 0}, damping = 4.5 N.m.s,
                stiffness = 180 N.m/rad, armature = 0.1 kg.m^2);
  Revolute fknee(fthigh.a * trans({-0.14, 0, -0.24} m) -> fshin.a, axis = {0, 1, 0},
                 damping = 3 N.m.s, stiffness = 120 N.m/rad, armature = 0.1 kg.m^2);
  Revolute fankle(fshin.a * trans({0.13, 0, -0.18} m) -> ffoot.a, axis = {0, 1, 0},
                  damping = 1.5 N.m.s, stiffness = 60 N.m/rad, armature = 0.1 kg.m^2);
  frame btoe = bfoot.a * trans({0.054, 0, -0.188} m);
  frame ftoe = ffoot.a * trans({0.084, 0, -0.128} m);
  contact back: pos(btoe)[3] friction 1 along der(pos(btoe)[1]);
  contact front: pos(ftoe)[3] friction 1 along der(pos(ftoe)[1]);
  contact stop: 0.007 rad - fhip.angle;
  experiment(stop = 0.5 s);
end Runner;
"""


@pytest.mark.parametrize("height", [0.70, 0.742, 0.787])
def test_a_landing_leaves_no_slip(height: float) -> None:
    """A hip runs into its stop while the foot below sticks. Each passes the impact on to the other, ever more weakly, until all three
    rates are zero: a slip that is left over of them, of 4e-11 m/s, would have to slide under a force that jams it, and nothing fits
    that (P. Painleve 1895)."""
    model = mechc.loads(RUNNER)
    solution = model.simulate(set={"z.position": height}, stop=0.3)
    assert solution.outcome == Outcome.COMPLETED
    energy = solution.accuracy.energy
    assert energy is not None
    assert energy.relative is not None
    assert energy.relative < 1e-7


def test_a_landing_by_time_steps() -> None:
    """The same by steps of 20 us that take impacts together (Moreau 1988)."""
    model = mechc.loads(RUNNER)
    exact = model.simulate(stop=0.3)
    steps = model.simulate(stop=0.3, method="moreau", step=2e-5)
    for name in ("x.position", "z.position", "pitch.angle", "fhip.angle"):
        assert steps[name][-1] == pytest.approx(exact[name][-1], abs=2e-4), name
