"""Rates that events set in constrained mechanisms: the set one stays, the others follow."""

from __future__ import annotations

import numpy as np
import pytest

import mechc

PLANE = """
coordinate Length x ~ 0 m;
coordinate Length y ~ 0 m;
coordinate Length z ~ 0 m;
kinetic 1/2*1 kg*der(x)^2 + 1/2*1 kg*der(y)^2 + 1/2*3 kg*der(z)^2 + 0.5 kg*der(y)*der(z);
constraint plane: x + 2*y + 3*z = 1 m/s*time;
when time > 0.1 s then
  reinit(der(x), 1 m/s);
end when;
"""


def test_the_others_change_as_little_as_kinetic_energy_allows() -> None:
    """The least change d of (y', z') with 1 + K (v + d) = 1 solves [M K^T; K 0] (d, l) = (0, -K v)."""
    (event,) = mechc.loads(PLANE).simulate(stop=0.2).events
    v = np.array([event.before["der(y)"], event.before["der(z)"]])
    inertia, k = np.array([[1, 0.5], [0.5, 3]]), np.array([[2.0, 3.0]])
    matrix = np.block([[inertia, k.T], [k, np.zeros((1, 1))]])
    d = np.linalg.solve(matrix, [0, 0, *(-k @ v)])[:2]
    assert event.after["der(x)"] == 1
    assert [event.after["der(y)"], event.after["der(z)"]] == pytest.approx(v + d, abs=1e-14)


LOOPS = {
    "joint": "cut Revolute c(coupler.b -> rocker.b);",
    "constraint": "constraint c: pos(coupler.b) = pos(rocker.b);",
    "can be released": "cut Revolute c(coupler.b -> rocker.b); when time > 5 s then release c; end when;",
}


@pytest.mark.parametrize("loop", LOOPS.values(), ids=list(LOOPS))
def test_the_crank_of_a_four_bar_gets_its_speed(loop: str) -> None:
    """Whatever closes the loop, the rates are those of a loop that turns so from the start."""
    text = f"""
    import mech.planar.*;
    model Loop
      parameter w = 0 rad/s;
      Bar crank(m = 1 kg, l = 0.2 m);
      Bar coupler(m = 2 kg, l = 0.5 m);
      Bar rocker(m = 1.5 kg, l = 0.4 m);
      frame pivot = world * trans({{0.5 m, 0}});
      Revolute a(world -> crank.a, angle = 60 deg, der(angle) = w);
      Revolute b(crank.b -> coupler.a, angle ~ -30 deg);
      Revolute d(pivot -> rocker.a, angle ~ 90 deg);
      {loop}
      when time > 0.1 s then
        reinit(der(a.angle), 7 rad/s);
      end when;
    end Loop;
    """
    model = mechc.loads(text)
    after = model.simulate(stop=0.2).events[0].after
    begun = model.simulate(stop=0.01, set={"w": 7})
    for name in ("der(a.angle)", "der(b.angle)", "der(d.angle)"):
        assert after[name] == pytest.approx(begun[name][0], abs=1e-9)


def test_rates_that_are_all_set_stay() -> None:
    """A point on a circle that is turned back retraces its way."""
    solution = mechc.loads("""
    coordinate Length x = 0.6 m;
    coordinate Length y ~ -0.8 m;
    initial der(x) = 0.8 m/s;
    kinetic 1/2*1 kg*(der(x)^2 + der(y)^2);
    constraint rim: x^2 + y^2 = 1 m^2;
    when time > 0.1 s then
      reinit(der(x), -der(x));
      reinit(der(y), -der(y));
    end when;
    """).simulate(stop=0.2)
    assert [solution[n][-1] for n in ("x", "y", "der(x)")] == pytest.approx([0.6, -0.8, -0.8], abs=1e-9)


def test_where_the_others_cannot_follow_the_run_ends() -> None:
    """At its side a point on a circle has no rate across it."""
    solution = mechc.loads("""
    coordinate Length x = 1 m;
    coordinate Length y ~ 0 m;
    kinetic 1/2*1 kg*(der(x)^2 + der(y)^2);
    constraint rim: x^2 + y^2 = 1 m^2;
    when time > 0.1 s then
      reinit(der(x), 1 m/s);
    end when;
    """).simulate(stop=0.2)
    assert solution.outcome.value == "failed"
    assert "constraints" in solution.message


def test_what_is_released_does_not_hold() -> None:
    """A pair that a constraint couples until 0.05 s: afterwards one is set and the other goes on."""
    solution = mechc.loads("""
    coordinate Length x = 0 m;
    coordinate Length y ~ 0 m;
    initial der(x) = 1 m/s;
    kinetic 1/2*1 kg*der(x)^2 + 1/2*2 kg*der(y)^2;
    constraint tie: x = y;
    discrete Integer n = 0;
    when sample(0.1 s, 0.1 s) then
      reinit(der(x), 2*der(x));
    end when;
    when time > 0.15 s then
      release tie;
    end when;
    """).simulate(stop=0.25)
    assert [solution["der(x)"][-1], solution["der(y)"][-1]] == pytest.approx([4, 2], abs=1e-12)
