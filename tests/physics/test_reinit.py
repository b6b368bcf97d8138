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
      reinit(der(y), -pre(der(y)));
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


ROD = """
coordinate Length x = 0 m;
coordinate Length y ~ 0 m;
coordinate Length z = 0 m;
coordinate Length w ~ 0 m;
initial der(x) = 1 m/s;
initial der(z) = -1 m/s;
kinetic 1/2*1 kg*der(x)^2 + 1/2*2 kg*der(y)^2 + 1/2*3 kg*der(z)^2 + 1/2*4 kg*der(w)^2;
constraint fixed: y = 2*x;
constraint tie: w = z;
discrete Velocity a = 0 m/s;
discrete Velocity b = 0 m/s;
"""
"""y follows x for good, w follows z while `tie` holds: masses of 9 kg in x, 3 kg and 4 kg in z and w."""


@pytest.mark.parametrize(
    "actions, values",
    [
        pytest.param(
            "reinit(der(x), 3 m/s); a := der(y); reinit(der(z), der(y)); b := der(w);",
            {"a": 6, "b": 6, "der(x)": 3, "der(y)": 6, "der(z)": 6, "der(w)": 6},
            id="what follows is seen",
        ),
        pytest.param(
            "reinit(der(z), 3 m/s); release tie; a := der(w);",
            {"a": 3, "der(z)": 3, "der(w)": 3},
            id="set, then released",
        ),
        pytest.param(
            "release tie; reinit(der(z), 3 m/s); a := der(w);",
            {"a": -1, "der(z)": 3, "der(w)": -1},
            id="released, then set",
        ),
        pytest.param(
            "impulse 14 N.s on z; a := der(w); release tie; impulse 3 N.s on z;",
            {"a": 1, "der(z)": 2, "der(w)": 1},
            id="pushed, then released",
        ),
        pytest.param(
            "reinit(der(z), 3 m/s); impulse 14 N.s on w; a := der(z); impulse 1 kg*der(w) on z;",
            {"a": 5, "der(z)": 5 + 5 / 7, "der(w)": 5 + 5 / 7},
            id="set, then pushed",
        ),
    ],
)
def test_actions_see_what_follows_from_those_above(actions: str, values: dict[str, float]) -> None:
    """By hand: constraints that hold at an action carry what it does on; those released above it do not."""
    text = f"{ROD} when time >= 0.1 s then {actions} end when; experiment(stop = 0.2 s);"
    solution = mechc.loads(text).simulate()
    assert {n: solution[n][-1] for n in values} == pytest.approx(values, abs=1e-12)


@pytest.mark.parametrize(
    "actions, values",
    [
        ("engage tie; a := der(w);", {"a": 3 / 7, "der(z)": 3 / 7, "der(w)": 3 / 7}),
        ("a := der(z); engage tie; b := der(z);", {"a": 1, "b": 3 / 7}),
        ("reinit(der(z), 8 m/s); engage tie;", {"der(z)": 24 / 7, "der(w)": 24 / 7}),
        ("engage tie; reinit(der(z), 8 m/s);", {"der(z)": 8, "der(w)": 8}),
        (
            "reinit(der(z), 8 m/s); engage tie; reinit(der(w), 2*der(z));",
            {"der(z)": 48 / 7, "der(w)": 48 / 7},
        ),
    ],
)
def test_what_is_engaged_acts_on_what_stands_above_it(actions: str, values: dict[str, float]) -> None:
    """An impact without rebound of 3 kg at 1 m/s or 8 m/s with 4 kg at rest; a rate set below it is that of both."""
    solution = mechc.loads(f"""
    coordinate Length z = 0 m;
    coordinate Length w = 0 m;
    initial der(z) = 1 m/s;
    kinetic 1/2*3 kg*der(z)^2 + 1/2*4 kg*der(w)^2;
    constraint tie: der(w) = der(z);
    discrete Velocity a = 0 m/s;
    discrete Velocity b = 0 m/s;
    when initial() then release tie; end when;
    when time >= 0.1 s then {actions} end when;
    experiment(stop = 0.2 s);
    """).simulate()
    assert {n: solution[n][-1] for n in values} == pytest.approx(values, abs=1e-12)


RIM = """
coordinate Length x = 0.6 m;
coordinate Length y ~ -0.8 m;
initial der(x) = 0.8 m/s;
kinetic 1/2*1 kg*(der(x)^2 + der(y)^2);
"""


@pytest.mark.parametrize(
    "tie", ["", "when time > 5 s then release rim; end when;"], ids=["for good", "can be released"]
)
@pytest.mark.parametrize(
    "actions, words",
    [
        (
            "reinit(der(x), 3 m/s); reinit(der(y), 3 m/s);",
            "'rim' cannot hold at the rates that this event sets",
        ),
        ("reinit(der(x), -der(x)); reinit(der(y), -der(y));", "is pre(der(..))"),
        ("reinit(x, 1 m); reinit(y, 1 m);", "'rim' cannot hold where this event sets its coordinates"),
    ],
)
def test_values_that_do_not_fit_end_the_run(tie: str, actions: str, words: str) -> None:
    """They are not replaced by others; of a rate and its opposite, the second has followed the first."""
    text = f"{RIM} constraint rim: x^2 + y^2 = 1 m^2; when time > 0.1 s then {actions} end when; {tie}"
    solution = mechc.loads(text).simulate(stop=0.2)
    assert solution.outcome.value == "failed"
    assert words in solution.message


def test_places_that_fit_stand_and_rates_follow_there() -> None:
    """Of the velocity before, what points along the circle at the new place goes on."""
    solution = mechc.loads(
        f"{RIM} constraint rim: x^2 + y^2 = 1 m^2;"
        "when time >= 0.1 s then reinit(x, 1 m); reinit(y, 0 m); end when;"
    ).simulate(stop=0.2)
    (event,) = solution.events
    before = event.before["y"] if "y" in event.before else solution["y"][0]
    turned = np.arctan2(-0.8, 0.6) + 0.1
    assert [event.before["x"], before] == pytest.approx([np.cos(turned), np.sin(turned)], abs=1e-9)
    assert [event.after["x"], event.after["y"]] == [1, 0]
    assert [event.after.get("der(x)"), solution["der(y)"][-1]] == pytest.approx(
        [0, np.cos(turned) * np.cos(0.1 * np.cos(turned))], abs=1e-9
    )
