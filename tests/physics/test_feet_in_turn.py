"""Feet that land, slip, stick and lift off while others do: what one does leaves the slips of the others as they are."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import mechc
from mechc.runtime.outcome import Outcome

BLOCKS = """
model Blocks
  gravity {0, 0, -9.81} m/s^2;
  coordinate Length x = 0 m;
  coordinate Length y = 0 m;
  coordinate Length z = 0 m;
  initial der(x) = -10 m/s;
  initial der(y) = 3 m/s;
  frame one = world * trans({x, y, z});
  mass 1 kg at one;
  force {0, 20, 0} N on one;
  contact floor: z friction 0.3 along {der(x), der(y)};
  coordinate Length s = 0 m;
  coordinate Length h = 0 m;
  frame other = world * trans({s, 50 m, h});
  mass 1 kg at other;
  force {(100 N/s)*time, 0, 0} on other;
  contact ground: h friction 0.4 along der(s);
  experiment(stop = 1 s);
end Blocks;
"""

QUADRUPED = """
import mech.spatial.{Body, Revolute, Free};
import mech.shapes.{Plane, Sphere};
model Trotting "drives like springs and dampers; the diagonal pairs of legs are half a period apart"
  gravity {0, 0, -9.81} m/s^2;
  parameter lift = 0.25 rad;
  parameter stride = 0.12 rad;
  parameter period = 0.4 s;
  parameter Length corner[4, 3] = {{0.2, 0.1, 0}, {-0.2, -0.1, 0}, {0.2, -0.1, 0}, {-0.2, 0.1, 0}} m;
  parameter Angle bend[4] = {1, -1, 1, -1} rad;
  Body trunk(m = 1.4 kg, J = diag({0.007, 0.025, 0.03} kg.m^2));
  Free root(world -> trunk.a, position = {0, 0, 0.245} m);
  Body hip[4](m = 0.15 kg, J = diag({4e-5, 4e-4, 4e-4} kg.m^2));
  Body thigh[4](m = 0.15 kg, com = {0, 0, -0.08} m, J = diag({4e-4, 4e-4, 3e-5} kg.m^2));
  Body shank[4](m = 0.04 kg, com = {0, 0, -0.09} m, J = diag({1.2e-4, 1.2e-4, 3e-6} kg.m^2));
  Revolute sway[i in 1:4](trunk.a * trans(corner[i]) -> hip[i].a, axis = {1, 0, 0}, angle = 0 rad);
  Revolute swing[i in 1:4](hip[i].a -> thigh[i].a, axis = {0, 1, 0}, angle = 0.8*bend[i]);
  Revolute knee[i in 1:4](thigh[i].a * trans({0, 0, -0.16} m) -> shank[i].a, axis = {0, 1, 0},
                          angle = -1.6*bend[i]);
  function drive(Angle q, Angle goal, AngularVelocity w) -> Torque
      = clamp((6 N.m/rad)*(goal - q) - (0.2 N.m.s/rad)*w, -2.7 N.m, 2.7 N.m);
  let Angle phase[i in 1:4] = 2*pi*time/period + (if i <= 2 then 0 else pi);
  for i in 1:4 loop
    force drive(sway[i].angle, 0 rad, der(sway[i].angle)) on sway[i].angle;
    force drive(swing[i].angle, bend[i]*(0.8 + lift*max(0, sin(phase[i]))) + stride*cos(phase[i]), der(swing[i].angle))
        on swing[i].angle;
    force drive(knee[i].angle, -2*bend[i]*(0.8 + lift*max(0, sin(phase[i]))), der(knee[i].angle)) on knee[i].angle;
  end for;
  shape floor: Plane on world;
  for i in 1:4 loop
    shape toe[i]: Sphere(r = 16 mm) on shank[i].a * trans({0, 0, -0.16} m);
    contact floor with toe[i] friction 0.8;
  end for;
  experiment(stop = 10 s);
end Trotting;
"""


def test_a_slide_keeps_its_direction_while_another_begins() -> None:
    """The one block turns under a force across its slip when the other gives way, at 0.4 m g = 100 N/s t."""
    solution = mechc.loads(BLOCKS).simulate(estimate_error=False)
    assert solution.outcome is Outcome.COMPLETED, solution.message
    assert [e.kind for e in solution.events] == ["slip"]
    assert solution.events[0].time == pytest.approx(0.03924, rel=1e-9)

    def rates(_: float, u: np.ndarray) -> np.ndarray:
        v = u[2:]
        return np.concatenate([v, np.array([0, 20]) - 0.3 * 9.81 * v / np.hypot(*v)])

    reference = solve_ivp(rates, (0, 1), [0, 0, -10, 3], method="DOP853", rtol=1e-12, atol=1e-12).y[:2, -1]
    assert np.abs(np.array([solution["x"][-1], solution["y"][-1]]) - reference).max() < 1e-7


@pytest.mark.slow
def test_a_quadruped_trots() -> None:
    """Some two hundred events a second, and slips that begin so slowly that they are stiff. The steps of `moreau` know no events; their
    impacts are dated to 1 ms, in which a toe at 0.5 m/s moves by half a millimetre. Found: 0.28 mm."""
    model = mechc.loads(QUADRUPED)
    solution = model.simulate(method="auto", stop="4 s", estimate_error=False)
    assert solution.outcome is Outcome.COMPLETED, solution.message
    counts = {kind: sum(e.kind == kind for e in solution.events) for kind in ("impact", "slip", "lift-off")}
    assert min(counts.values()) > 50
    energy = solution["energy.total"] + solution["energy.dissipated"] - solution["energy.supplied"]
    assert np.abs(energy - energy[0]).max() < 1e-7 * energy.max()
    stepped = model.simulate(method="moreau", step="1 ms", stop="1 s", estimate_error=False)
    for k in range(1, 11):
        assert np.abs(stepped(k / 10)["root.position"] - solution(k / 10)["root.position"]).max() < 5e-4
    assert np.ptp(solution["root.position"][:, 2]) < 0.05
