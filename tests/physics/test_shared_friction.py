"""More frictions than freedoms: what rests by them shares its load, and no friction at its limit slides on what others keep at rest."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import lsq_linear
from slow_params import slow_among

import mechc
from mechc.runtime.outcome import Outcome

FAST = [(3, 7, 0), (5, 12, 4)]


def rubbed(slips: np.ndarray, limits: np.ndarray, push: np.ndarray, pace: np.ndarray) -> str:
    """Unit masses on lines, pushed by sines, and frictions on sums of their coordinates."""
    m, n = slips.shape
    sums = [" + ".join(f"({row[j]:g})*x[{j + 1}]" for j in range(n) if row[j]) for row in slips]
    frictions = "\n".join(f"  friction {limits[i]} N on {sums[i]};" for i in range(m))
    return f"""
model Rubbed
  parameter Force push[{n}] = {{{", ".join(map(str, push))}}} N;
  parameter AngularVelocity pace[{n}] = {{{", ".join(map(str, pace))}}} rad/s;
  coordinate Length x[{n}] = {{{", ".join(["0"] * n)}}} m;
  for i in 1:{n} loop
    kinetic 1/2*1 kg*der(x[i])^2;
    force push[i]*sin(pace[i]*time) on x[i];
  end for;
{frictions}
  experiment(stop = 3 s);
end Rubbed;
"""


@pytest.mark.parametrize("case", slow_among(FAST, [*FAST, (4, 10, 1), (2, 6, 2), (3, 6, 5), (4, 9, 6)]))
def test_accelerations_are_the_least_that_limits_allow(case: tuple[int, int, int]) -> None:
    """Coulomb's law with given limits is the optimality of a convex problem (J.-J. Moreau 1970): at each time the frictions of what
    rests are those within their limits that leave the least acceleration. SciPy solves it; accelerations are differences over 0.1 ms
    of the dense solution, whose error is below 1e-5; frictions up to 1 N move unit masses by up to 10 m/s^2."""
    n, m, seed = case
    rng = np.random.default_rng(seed)
    slips = rng.integers(-1, 2, (m, n)).astype(float)
    for k, row in enumerate(slips):
        if not row.any():
            row[k % n] = 1
    limits = rng.uniform(0.2, 1, m).round(3)
    push, pace = (rng.normal(size=n) * 4).round(3), rng.uniform(2, 6, n).round(3)
    solution = mechc.loads(rubbed(slips, limits, push, pace)).simulate(estimate_error=False)
    assert solution.outcome is Outcome.COMPLETED, solution.message

    def speeds(t: float) -> np.ndarray:
        values = solution(t)
        return np.array([values[f"der(x[{j}])"] for j in range(1, n + 1)])

    events = np.array([event.time for event in solution.events])
    moved = 0
    for t in np.linspace(0.0005, 2.9995, 300):
        if np.abs(events - t).min() < 2e-4:
            continue
        rates = slips @ speeds(t)
        slides = np.abs(rates) > 1e-9
        moved += bool(slides.any())
        free = push * np.sin(pace * t) - slips[slides].T @ (np.sign(rates[slides]) * limits[slides])
        resting, most = slips[~slides].T, limits[~slides]
        if most.size:
            free = free - resting @ lsq_linear(resting, free, (-most, most), method="bvls", tol=1e-15).x
        found = (speeds(t + 5e-5) - speeds(t - 5e-5)) / 1e-4
        assert np.abs(found - free).max() < 1e-4, t
    assert moved > 30


LEGS = """
import mech.spatial.*;
model Legs "stands on four legs, with springs and dry friction in their joints"
  gravity {0, 0, -9.81} m/s^2;
  parameter Length at[4, 2] = {{0.2, 0.12}, {-0.2, 0.12}, {-0.2, -0.12}, {0.2, -0.12}} m;
  coordinate Length x = 0 m;
  coordinate Length y = 0 m;
  coordinate Length z = 0.32 m;
  coordinate Rotation R = rotx(0 deg);
  coordinate Angle hip[4] = {0, 0, 0, 0} rad;
  coordinate Angle swing[4] = {0, 0, 0, 0} rad;
  frame box = world * trans({x, y, z}) * R;
  mass 2 kg at box;
  inertia diag({0.02, 0.03, 0.04} kg.m^2) on box;
  for i in 1:4 loop
    kinetic 1/2*2e-3 kg.m^2*(der(hip[i])^2 + der(swing[i])^2);
    potential 1/2*20 N.m*(hip[i]^2 + swing[i]^2);
    damping 0.2 N.m.s on hip[i];
    damping 0.2 N.m.s on swing[i];
    friction 0.3 N.m on hip[i];
    friction 0.3 N.m on swing[i];
    contact foot[i]: pos(%(foot)s)[3] friction 0.6 along {vel(%(foot)s)[1], vel(%(foot)s)[2]};
  end for;
  output load[4] = {multiplier(foot[i]) for i in 1:4};
  experiment(stop = 1 s);
end Legs;
"""


def test_legs_with_friction_in_their_joints_share_the_weight() -> None:
    """12 rows of feet and 8 of joints on 14 freedoms. By symmetry each foot carries a quarter; one diagonal could carry all."""
    foot = "box * trans({at[i, 1], at[i, 2], 0 m}) * rotx(hip[i]) * roty(swing[i]) * {0 m, 0 m, -0.3 m}"
    solution = mechc.loads(LEGS % {"foot": foot}).simulate(estimate_error=False)
    assert solution.outcome is Outcome.COMPLETED, solution.message
    loads = np.array([solution[f"load[{k}]"][-1] for k in range(1, 5)])
    assert np.abs(loads - 2 * 9.81 / 4).max() < 1e-9 * 2 * 9.81
