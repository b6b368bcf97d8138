"""Where the energy of a run went: at events, between them, and what was brought in."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import mechc
from mechc.presentation.report import report

BALL = """\
coordinate h = 1 m;
kinetic 1/2*(0.1 kg)*der(h)^2;
potential (0.1 kg)*(9.81 m/s^2)*h;
"""


def run(text: str, stop: float, **settings: Any) -> mechc.Solution:
    solution = mechc.loads(text).simulate(stop=stop, **({"tolerance": 1e-11} | settings))
    assert isinstance(solution, mechc.Solution)
    return solution


def test_what_impacts_take() -> None:
    """One bounce with e = 0.8 takes 36 % of m g h; nothing is lost in the air."""
    found = run(BALL + "contact floor: h restitution 0.8;", stop=1).energy
    assert found is not None and found.supplied is None
    assert found.start == pytest.approx(0.981) and found.unit == "J"
    assert found.dissipated == pytest.approx(0.36 * 0.981, rel=1e-10)
    assert found.dissipated_at_events == pytest.approx(found.dissipated, rel=1e-12)
    assert found.end == pytest.approx(0.64 * 0.981, rel=1e-10)


def test_what_friction_and_the_belt_do() -> None:
    """Slides with f = 2 N for one second while the belt goes 3 m: 2 N times 3 m is brought in."""
    solution = run(
        "coordinate x = 0 m; kinetic 1/2*(1 kg)*der(x)^2; friction 2 N on x - (3 m/s)*time;", stop=1
    )
    found = solution.energy
    assert found is not None and found.supplied is not None and found.dissipated is not None
    assert found.supplied == pytest.approx(6, rel=1e-10)
    assert found.dissipated == pytest.approx(6 - 2**2 / 2, rel=1e-10)
    assert found.dissipated_at_events == 0 == found.supplied_at_events


def test_an_impulse_supplies_and_drag_takes() -> None:
    text = """
    coordinate x = 0 m;
    kinetic 1/2*(2 kg)*der(x)^2;
    damping 1 N.s/m on x;
    when time >= 1 s then reinit(der(x), 3 m/s); end when;
    """
    found = run(text, stop=2).energy
    assert found is not None and found.supplied is not None
    assert found.supplied == pytest.approx(9, rel=1e-10) == found.supplied_at_events
    assert found.dissipated == pytest.approx(9 * (1 - math.exp(-1)), rel=1e-9)


def test_a_thrust_supplies_and_what_depends_on_the_speed_dissipates() -> None:
    """Three newtons push 1 kg, a drag of 1 N.s/m holds: v = 3 (1 - exp(-t)), x = 3 (t - 1 + exp(-t))."""
    found = run(
        "coordinate x = 0 m; kinetic 1/2*(1 kg)*der(x)^2; force 3 N on x; force -1 N.s/m*der(x) on x;", stop=1
    ).energy
    way, speed = 3 * math.exp(-1), 3 * (1 - math.exp(-1))
    assert found is not None
    assert found.supplied == pytest.approx(3 * way, rel=1e-9)
    assert found.dissipated == pytest.approx(3 * way - speed**2 / 2, rel=1e-9)


def test_negative_kinetic_energy_is_remarked() -> None:
    text = "parameter m = 1 kg; coordinate x = 0 m; kinetic 1/2*m*der(x)^2; force 1 N on x;"
    assert not run(text, stop=1).remarks
    (remark,) = run(text.replace("m = 1 kg", "m = -1 kg"), stop=1).remarks
    assert remark.startswith("the kinetic energy falls to -0.5 J")


def test_damping_that_feeds_is_remarked_whatever_set_it() -> None:
    text = "parameter c = 1 N.s/m; coordinate x = 1 m; kinetic 1/2*1 kg*der(x)^2; damping c on x; potential 1/2*4 N/m*x^2;"
    assert not run(text, stop=5).remarks
    (remark,) = run(text.replace("c = 1 N", "c = -1 N"), stop=5).remarks
    assert remark.startswith("nothing dissipates: damping") and "feed in" in remark
    both = text.replace("damping c on x", "damping c*(x^2/1 m^2 - 1) on x")
    assert not run(both, stop=20).remarks, "what it feeds at one place it takes at another"
    weak = text.replace("c = 1 N.s/m", "c = -1e-6 N.s/m")
    assert not run(weak, stop=5).remarks, "less than a hundredth"


def test_a_model_that_stays_where_it_is_says_so() -> None:
    text = "coordinate x = {} m; kinetic 1/2*(1 kg)*der(x)^2; potential 1/2*2 N/m*x^2;"
    assert run(text.format("0"), stop=1).remarks == ("nothing moves: it starts at rest in equilibrium",)
    assert not run(text.format("1e-9"), stop=1).remarks
    filling = "state V = 0 V; equation der(V) = (1 V - V)/1 s;"
    assert not run(text.format("0") + filling, stop=1).remarks, "a state moves"


def test_the_report_and_the_json_tell_it() -> None:
    solution = run(BALL + "contact floor: h restitution 0.8;", stop=1)
    rows = report(solution).splitlines()
    first = rows.index("  energy")
    assert [row.split() for row in rows[first + 1 : first + 5]] == [
        ["at", "the", "start", "0.981", "J"],
        ["dissipated", "0.35316", "J"],
        ["at", "events", "0.35316", "J"],
        ["at", "the", "end", "0.62784", "J"],
    ]
    told = solution.summary()["energy"]
    assert told["dissipated"] == pytest.approx(0.35316) and told["supplied"] is None
    quiet = run(BALL, stop=0.1)
    assert quiet.summary()["energy"] is None and "at the start" not in report(quiet)


@pytest.mark.parametrize("guide", ["abs(x)", "max(x, -x)", "(if x > 0 m then x else -x)"])
@pytest.mark.parametrize("form", ["constraint y = {};", "contact below: y - {} restitution 0;"])
def test_what_a_bend_takes(form: str, guide: str) -> None:
    """Of a speed v along the one side of a bend of 2 atan(1/2), v cos(2 atan(1/2)) = 0.6 v is left."""
    text = """
    coordinate Length x = -1 m;
    coordinate Length y = 0.5 m;
    initial der(x) = 2 m/s;
    kinetic 1/2*(1 kg)*(der(x)^2 + der(y)^2);
    """ + form.format(f"0.5*{guide}")
    solution = run(text, stop=2)
    found = solution.energy
    assert solution.outcome.value == "completed", solution.message
    assert found is not None and found.supplied is None and found.dissipated is not None
    if form.startswith("constraint"):
        assert found.end == pytest.approx(0.36 * 2.5, rel=1e-9)
        assert solution["x"][-1] == pytest.approx(1.5 * 0.6 * 2, rel=1e-9)
    assert found.start - found.dissipated == pytest.approx(found.end, rel=1e-9)


def test_a_guide_that_begins_to_move_supplies() -> None:
    found = run(
        "coordinate x = 0 m; kinetic 1/2*(3 kg)*der(x)^2; constraint x = (2 m/s)*max(0 s, time - 1 s);",
        stop=2,
    ).energy
    assert found is not None and found.supplied == pytest.approx(1 / 2 * 3 * 2**2, rel=1e-9)


@pytest.mark.parametrize(
    ("load", "taken"),
    [
        ("", 0.0),
        ("force 2 N on x;", 0.0),
        ("damping 0.5 N.s/m on x;", 0.5),
        ("dissipation 0.25 N.s/m*der(x)^2;", 0.5),
        ("force -0.7 N.s/m*der(x) on x;", 0.7),
    ],
)
def test_where_all_is_driven_the_energy_is_what_the_bodies_have(load: str, taken: float) -> None:
    """x = a sin(w t): T + V in closed form, and c a^2 w^2 (t/2 + sin(2 w t)/(4 w)) that damping takes."""
    a, w, t = 0.3, 2.0, 3.0
    found = run(
        f"coordinate x = 0 m; drive x = {a} m*sin({w} rad/s*time); kinetic 1/2*1 kg*der(x)^2; "
        f"potential 1/2*3 N/m*x^2; {load}",
        stop=3,
    ).energy
    heat = taken * (a * w) ** 2 * (t / 2 + math.sin(2 * w * t) / (4 * w))
    energies = [(w * a * math.cos(w * s)) ** 2 / 2 + 3 / 2 * (a * math.sin(w * s)) ** 2 for s in (0, t)]
    assert found is not None and found.supplied is not None
    assert [found.start, found.end] == pytest.approx(energies, rel=1e-9)
    assert (found.dissipated or 0.0) == pytest.approx(heat, rel=1e-9)
    assert found.supplied == pytest.approx(energies[1] - energies[0] + heat, rel=1e-8)


def test_potential_that_contains_a_velocity_is_reported_as_it_is_written() -> None:
    """V = c x v + k x^2/2: the first part is the rate of c x^2/2, so x = cos wt + sin wt; it is not a part of h."""
    text = """coordinate Length x = 1 m; initial der(x) = 1 m/s;
    kinetic 1/2*1 kg*der(x)^2;
    potential 0.5 N.s/m*x*der(x) + 1/2*1 N/m*x^2;
    potential 2 N*x;
    potential -2 N*x;
    output asked = potential_energy();
    """
    solution = mechc.loads(text).simulate(stop=1.0, tolerance=1e-11, estimate_error=False)
    assert isinstance(solution, mechc.Solution)
    t = solution.time
    x, v = np.cos(t) + np.sin(t), np.cos(t) - np.sin(t)
    # ten times the tolerance for each of some ten steps
    for name in ("energy.potential", "asked"):
        assert solution[name] == pytest.approx(0.5 * x * v + 0.5 * x**2, abs=1e-9)
    assert solution["energy.total"] == pytest.approx(np.ones(len(t)), abs=1e-9)


def test_what_a_drive_brings_to_a_mass_that_it_drags_through_a_damper() -> None:
    """x = v t, and y'' = c (v - y') gives y' = v (1 - exp(-c t)): the drive brings c v^2 exp(-c t), half of it heats."""
    speed, c = 3.0, 0.8
    solution = run(
        f"coordinate Length x; coordinate Length y = 0 m; kinetic 1/2*2 kg*der(x)^2 + 1/2*1 kg*der(y)^2; drive x = {speed} m/s*time; "
        f"damping {c} N.s/m on x - y; output asked = energy();",
        stop=1,
    )
    found, rest = solution.energy, math.exp(-c)
    assert found is not None and found.start == pytest.approx(9, rel=1e-12)
    assert found.end == pytest.approx(9 + (speed * (1 - rest)) ** 2 / 2, rel=1e-9)
    assert found.supplied == pytest.approx(speed**2 * (1 - rest), rel=1e-9)
    assert found.dissipated == pytest.approx(speed**2 / 2 * (1 - rest**2), rel=1e-9)
    assert solution["asked"] == pytest.approx(solution["energy.total"], rel=1e-12)


def test_the_energy_of_a_driven_linkage_is_that_of_its_bodies() -> None:
    """The motor of the four-bar linkage brings what its loop takes up, with nothing left over."""
    solution = mechc.load("examples/four_bar.mech").simulate(stop=0.3, tolerance=1e-11)
    assert isinstance(solution, mechc.Solution)
    total = solution["energy.total"]
    assert total[0] == pytest.approx(13.188, abs=5e-4)
    assert total == pytest.approx(solution["energy.kinetic"] + solution["energy.potential"], rel=1e-12)
    assert total - solution["energy.supplied"] == pytest.approx(np.full(len(total), total[0]), rel=1e-8)


@pytest.mark.parametrize(
    "drag",
    [
        "-0.3 N.s^2/m^2*der(x)*abs(der(x))",
        "-c*der(x)^3/(1 m^2/s^2)",
        "-2 N*tanh(der(x)/(1 m/s))",
        "-c*exp(-x/(1 m))*der(x)",
    ],
)
def test_drag_is_dissipated(drag: str) -> None:
    text = f"parameter c = 0.4 N.s/m; coordinate x = 1 m; kinetic 1/2*2 kg*der(x)^2; potential 1/2*3 N/m*x^2; force {drag} on x;"
    found = run(text, stop=2).energy
    assert found is not None and found.supplied is None and found.dissipated is not None
    assert found.dissipated == pytest.approx(found.start - found.end, rel=1e-9)


def test_drag_of_a_point_is_dissipated() -> None:
    text = """coordinate x[2] = {0, 0} m; initial der(x) = {3, 2} m/s; point P = world*x; mass 2 kg at P;
    let v = {der(x[1]), der(x[2])}; force -0.2 N.s^2/m^2*norm(v)*v on P;"""
    found = run(text, stop=1).energy
    assert found is not None and found.supplied is None and found.dissipated is not None
    speed = 1 / (1 / math.hypot(3, 2) + 0.1)  # 2 v' = -0.2 v^2
    assert found.dissipated == pytest.approx(13 - speed**2, rel=1e-9)


def test_what_a_motor_brings_is_supplied() -> None:
    """2 v' = 5 (1 - v/3): the force depends on velocities, and drives."""
    found = run(
        "coordinate x = 0 m; kinetic 1/2*2 kg*der(x)^2; force 5 N*(1 - der(x)/(3 m/s)) on x;", stop=1
    ).energy
    assert found is not None and found.dissipated is None
    assert found.supplied == pytest.approx((3 * (1 - math.exp(-5 / 6))) ** 2, rel=1e-9)


def test_what_a_pump_brings_is_supplied() -> None:
    text = """coordinate x = 0.1 m; kinetic 1/2*1 kg*der(x)^2; potential 1/2*4 N/m*x^2;
    force 0.5 s/m^2*(2 J - energy())*der(x) on x; damping 0.1 N.s/m on x;"""
    found = run(text, stop=20).energy
    assert found is not None and found.supplied is not None and found.dissipated is not None
    assert found.supplied > found.dissipated > 0
    assert found.start + found.supplied - found.dissipated == pytest.approx(found.end, rel=1e-8)


def test_what_is_dissipated_where_an_input_sets_the_energy() -> None:
    """What the input brings in is not known, and no balance is stated; damping, drag and friction take what they take."""
    solution = run(
        "coordinate x = 0 m; initial der(x) = 3 m/s; kinetic 1/2*2 kg*der(x)^2; input Force u = 1 N; potential -u*x; "
        "damping 1 N.s/m on x; friction 1 N on x; force -0.5 N.s^2/m^2*der(x)*abs(der(x)) on x;",
        stop=1,
    )
    assert solution.energy is None and "energy.supplied" not in solution
    # with the constant input the potential gives what a force would: T + D = u x + 9 J
    lost = solution["energy.dissipated"][-1]
    assert lost == pytest.approx(9 + solution["x"][-1] - solution["der(x)"][-1] ** 2, rel=1e-9)


STIFF = """\
coordinate x = 10 mm; coordinate y = 11 mm;
kinetic 1/2*(1000 kg)*der(x)^2 + 1/2*(1 g)*der(y)^2;
potential 1/2*(40 kN/m)*x^2 + 1/2*(1e9 N/m)*(y - x)^2;
dissipation 1/2*(2e3 N.s/m)*(der(y) - der(x))^2;
"""


@pytest.mark.parametrize("tolerance", [1e-7, 1e-8, 1e-9])
def test_an_account_claims_no_more_than_the_balance_allows(tolerance: float) -> None:
    """Its own companion differed by a hundredth of what both were off by: 3.7e-7 J of 500 J, 8.4e-10 J claimed. The exponential of the
    linear system tells what is left after ten seconds."""
    from scipy.linalg import expm

    rates = np.zeros((4, 4))
    rates[:2, 2:] = np.eye(2)
    rates[2:] = [[-1.00004e6, 1e6, -2, 2], [1e12, -1e12, 2e6, -2e6]]
    x, y, dx, dy = expm(rates * 10.0) @ [0.010, 0.011, 0, 0]
    left = (1000 * dx**2 + 0.001 * dy**2 + 40e3 * x**2 + 1e9 * (y - x) ** 2) / 2
    found = mechc.loads(STIFF).simulate(stop=10, tolerance=tolerance)
    error = found.accuracy.error
    assert error is not None
    off = abs(found["energy.dissipated"][-1] - (502 - left))
    size = error.nominal["energy.dissipated"] + found["energy.dissipated"][-1]
    assert off < 3 * error.by_state_at_end["energy.dissipated"] * size
    assert error.by_state["energy.dissipated"] >= error.by_state_at_end["energy.dissipated"]
    assert found.accuracy.energy is not None
    assert error.by_state["energy.dissipated"] < 1.1 * found.accuracy.energy.absolute / 502 + 1e-7


ROPE = """
coordinate Length c; coordinate Length x = 0.5 m; coordinate Length y = 0.5 m;
initial der(y) = -0.5 m/s; initial der(x) ~ -0.5 m/s;
kinetic 1/2*1 kg*der(x)^2 + 1/2*2 kg*der(y)^2;
drive c = 1 m/s*time;
contact floor: y restitution {e};
"""
ROPES = [
    "constraint rope: x + y = 1 m - 1 m/s*time;",
    "constraint rope: der(x) + der(y) = -1 m/s;",
    "constraint rope: x + y = 1 m - c;",
]
ENGAGED = (
    "constraint rope: x + y = 1 m - 1 m/s*time; when initial() then release rope; end when;"
    "when y < 0.25 m then engage rope; end when;"
)
STEPS = {"method": "moreau", "step": 1e-3}


@pytest.mark.parametrize("e", [0, 0.5])
@pytest.mark.parametrize(
    ("rope", "settings"), [*((rope, s) for rope in ROPES for s in ({}, STEPS)), (ENGAGED, {})]
)
def test_what_a_moving_constraint_brings_at_an_impact(rope: str, e: float, settings: dict[str, Any]) -> None:
    """The floor turns der(y) from -0.5 m/s to e 0.5 m/s. The rope, which gets shorter at 1 m/s, gives x the momentum S = -(1 + e)/2 N.s
    that keeps it tight, which works 1 m/s*S. The floor, by P = (1 + e)*1.5 N.s, takes (1 - e^2)*3/8 J."""
    found = run(ROPE.format(e=e) + rope, stop=1.5, **settings).energy
    assert found is not None
    assert found.supplied == pytest.approx((1 + e) / 2, rel=1e-9)
    assert found.dissipated == pytest.approx((1 - e**2) * 3 / 8, rel=1e-9)
    assert found.end - found.start == pytest.approx((1 + e) / 2 - (1 - e**2) * 3 / 8, rel=1e-9)


def test_what_a_moving_constraint_brings_where_a_freewheel_takes_hold() -> None:
    """der(x) = 0 meets der(w) = 2 m/s: with 3 kg behind x, both go on at 0.5 m/s. The constraint takes 2 kg*0.5 m/s from y, at 1 m/s."""
    found = run(
        "coordinate Length x = 0 m; coordinate Length w = 0 m; coordinate Length y = 0 m; initial der(x) = 0 m/s;"
        "initial der(w) = 2 m/s; initial der(y) ~ 1 m/s; kinetic 1/2*1 kg*(der(x)^2 + der(w)^2 + 2*der(y)^2);"
        "constraint der(x) + der(y) = 1 m/s; friction forward 0 N backward infinite on der(x) - der(w);",
        stop=1,
    ).energy
    assert found is not None
    assert found.supplied == pytest.approx(-1, rel=1e-9) == found.supplied_at_events
    assert found.dissipated == pytest.approx(1.5, rel=1e-9)


@pytest.mark.parametrize("settings", [{}, STEPS])
def test_what_a_drive_brings_while_its_load_rebounds(settings: dict[str, Any]) -> None:
    """2 kg on what is driven at 0.7 m/s get P = 3 N.s from a stop on it: 0.7 m/s*P come from the drive."""
    found = run(
        "coordinate Length c; drive c = 0.7 m/s*time; coordinate Length x = 0.5 m; initial der(x) = -1 m/s;"
        "kinetic 1/2*2 kg*(der(x) + der(c))^2; contact x restitution 0.5;",
        stop=0.8,
        **settings,
    ).energy
    assert found is not None
    assert found.supplied == pytest.approx(2.1, rel=1e-9)
    assert found.dissipated == pytest.approx(0.75, rel=1e-9)


def test_what_a_drive_brings_where_a_potential_jumps() -> None:
    """der(x) = -1 m/s falls to -sqrt(1/2) m/s, by P = 2 kg*(1 - sqrt(1/2)) m/s; nothing is lost."""
    found = run(
        "coordinate Length c; drive c = 0.7 m/s*time; coordinate Length x = 0.5 m; initial der(x) = -1 m/s;"
        "kinetic 1/2*2 kg*(der(x) + der(c))^2; potential if x > 0.2 m then 0 J else 0.5 J;"
        "contact x + 5 m;",
        stop=0.8,
    ).energy
    assert found is not None
    assert found.supplied == pytest.approx(0.7 * 2 * (1 - math.sqrt(0.5)), rel=1e-9)
    assert not found.dissipated
