"""Where pages choose between meanings that mechanics leaves open, runs do what they say."""

from __future__ import annotations

import math

import numpy as np
import pytest
from compiled import compiled, outcome
from scipy.interpolate import PchipInterpolator

import mechc
from mechc.runtime.outcome import Outcome


def test_curve_of_a_table() -> None:
    """PCHIP between its points, straight on outside of them."""
    places, values = (-1.0, 0.1, 2.0, 2.5, 4.0), (0.2, 0.3, 0.8, 0.8, -3.0)
    listed = [", ".join(map(str, numbers)) for numbers in (places, values)]
    model = compiled(
        f"parameter x = 0; coordinate q = 0 m; kinetic 1/2*1 kg*der(q)^2; "
        f"output y = table(x, {{{listed[0]}}}, {{{listed[1]}}});"
    )
    curve = PchipInterpolator(places, values)
    for x in np.linspace(-3, 6, 46):
        inside = float(np.clip(x, places[0], places[-1]))
        expected = float(curve(inside)) + (x - inside) * float(curve(inside, 1))
        assert outcome(model, "outputs", {"x": float(x)})["y"] == pytest.approx(expected, abs=1e-13)


def test_branches_of_a_when_act_one_after_the_other() -> None:
    """At 1 s the first acts alone; what it did lets the third act at the same instant, the second one's turn is over."""
    solution = mechc.loads("""dimensionless;
coordinate q = 0; kinetic 1/2*der(q)^2; discrete a = 0; discrete b = 0; discrete c = 0;
when time >= 1 then a := a + 1; elsewhen time >= 1 then b := b + 1; elsewhen a > 0 then c := c + 1; end when;
experiment(stop = 2);
""").simulate()
    assert [solution[n][-1] for n in "abc"] == [1, 0, 1]
    assert {e.time for e in solution.events} == {1.0}


def test_what_reinit_leaves_open_changes_least_in_kinetic_energy() -> None:
    """Of x + y + z = 0 the rate of x is set to 1: of m y'^2 + n z'^2 with y' + z' = -1 the least has y'/z' = n/m."""
    solution = mechc.loads("""dimensionless;
coordinate x = 0; coordinate y = 0; coordinate z = 0;
kinetic 1/2*der(x)^2 + 1/2*3*der(y)^2 + 1/2*1*der(z)^2;
constraint c: x + y + z = 0;
when time >= 1 then reinit(der(x), 1); end when;
experiment(stop = 1.5);
""").simulate()
    assert solution["der(x)"][-1] == pytest.approx(1, abs=1e-12)
    assert solution["der(y)"][-1] == pytest.approx(-0.25, abs=1e-12)
    assert solution["der(z)"][-1] == pytest.approx(-0.75, abs=1e-12)


MASS, INERTIA, MU = 1.0, 0.02, 0.05


def hits(angle: float, slip: float, fall: float) -> tuple[float, float, str]:
    """The velocities of the tip of a rod along and across the floor after a hit without rebound, and what it does.

    The mass centre is at (0, 0), the tip at (dx, dy) from it.
    """
    dx, dy = 0.5 * math.cos(angle), 0.5 * math.sin(angle)
    along, across = np.array([1.0, 0.0, -dy]), np.array([0.0, 1.0, dx])
    weights = np.array([1 / MASS, 1 / MASS, 1 / INERTIA])
    tt, tn, nn = ((a * weights) @ b for a, b in ((along, along), (along, across), (across, across)))
    stick = np.linalg.solve([[tt, tn], [tn, nn]], [-slip, fall])
    if abs(stick[0]) <= MU * stick[1]:
        return 0.0, 0.0, "sticks"
    found = []
    for push in (-MU, MU):
        impulse = fall / (nn + tn * push)
        after = slip + (tn + tt * push) * impulse
        found += [after] if after * push < 0 else []
    (after,) = found
    return after, 0.0, "turns" if after * slip < 0 else "slides"


@pytest.mark.parametrize(
    ("angle", "slip", "does"),
    [(-1.2, -0.1, "turns"), (-1.2, 0.8, "slides"), (-1.57, 0.01, "sticks"), (-1.57, 2.0, "slides")],
)
def test_friction_of_an_impact_acts_against_the_slip_that_is_left(
    angle: float, slip: float, does: str
) -> None:
    """Also where the slip turns round during the impact: one impulse, on the one side of the cone that opposes what comes out."""
    expected, _, kind = hits(angle, slip, 0.3)
    assert kind == does
    text = f"""dimensionless;
coordinate x = 0; coordinate y = {-0.5 * math.sin(angle) + 0.3e-3}; coordinate a = {angle};
initial der(x) = {slip}; initial der(y) = -0.3;
frame rod = world*trans({{x, y}})*rot(a);
mass {MASS} at rod; inertia {INERTIA} on rod;
point tip = rod*{{0.5, 0}};
contact floor: tip[2] friction {MU} along vel(tip)[1];
output s = vel(tip)[1];
experiment(stop = 1.1e-3, every = 1e-5);
"""
    solution = mechc.loads(text).simulate()
    assert solution.outcome is Outcome.COMPLETED, solution.message
    (hit,) = [e for e in solution.events if e.kind == "impact"]
    first = int(np.searchsorted(solution.time, hit.time, side="right")) - 1
    assert solution["s"][first] == pytest.approx(expected, abs=1e-9)


def test_guesses_move_least_as_shares_of_their_sizes() -> None:
    """x + y = 1 from (0, 0) with x^2 + (y/2)^2 least: y = 4 x."""
    solution = mechc.loads("""dimensionless;
coordinate x(nominal = 1) ~ 0; coordinate y(nominal = 2) ~ 0;
kinetic 1/2*7*der(x)^2 + 1/2*der(y)^2;
constraint c: x + y = 1;
experiment(stop = 0.1);
""").simulate()
    assert (solution["x"][0], solution["y"][0]) == pytest.approx((0.2, 0.8), abs=1e-12)
