"""What a named friction answers: its force while it sticks and slides, and whether it sticks.

Judges: statics, closed forms, and a stick-slip motion that SciPy integrates from event to event.
"""

from __future__ import annotations

import math

import numpy as np
import pytest
from refusals import refused
from scipy.integrate import solve_ivp

import mechc

RAMP = """
coordinate Length x = 0 m;
kinetic 1/2*2 kg*der(x)^2;
force 4 N/s*time on x;
friction rub: 1 N static 3 N on x;
output carried = multiplier(rub);
output stuck = closed(rub);
output heat = power(rub);
experiment(stop = 2 s, tolerance = 1e-10);
"""


def test_it_carries_what_pushes_until_it_slips() -> None:
    """It slips at 3/4 s; then 2 x'' = 4 t - 1."""
    solution = mechc.loads(RAMP).simulate(estimate_error=False)
    for t in (0.1, 0.5, 0.74):
        assert solution(t)["carried"] == pytest.approx(-4 * t, abs=1e-12)
        assert solution(t)["stuck"] == 1
    for t in (0.76, 1.3, 2.0):
        speed = (t**2 - 0.75**2) - (t - 0.75) / 2
        assert solution(t)["carried"] == pytest.approx(-1, abs=1e-12)
        assert solution(t)["stuck"] == 0
        assert solution(t)["heat"] == pytest.approx(-speed, rel=1e-8)


def test_the_torque_of_a_clutch_acts_on_what_it_is_stated_for() -> None:
    """Stuck, both discs turn as one: the disc of 3 kg.m^2 is dragged along by 3/4 of the torque on the one of 1 kg.m^2."""
    solution = mechc.loads(
        "model Clutch\n input Angle a; input Angle b; friction rub: 50 N.m on b - a; end Clutch;\n"
        "model M\n coordinate Angle a = 0 rad; coordinate Angle b = 0 rad;\n"
        " kinetic 1/2*1 kg.m^2*der(a)^2 + 1/2*3 kg.m^2*der(b)^2; force 8 N.m on a;\n"
        " Clutch c[2](a = a, b = b); output Torque drag = multiplier(c[1].rub) + multiplier(c[2].rub);\n"
        " output Boolean one = closed(c[1].rub) and closed(c[2].rub); experiment(stop = 1 s); end M;"
    ).simulate(estimate_error=False)
    assert solution["drag"] == pytest.approx(6.0, abs=1e-11)
    assert solution["b"][-1] == pytest.approx(1.0, abs=1e-9)


def _stick_slip(stop: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """x'' = -x + F on a belt of 0.2 m/s, 0.5 N sliding and 1 N sticking: times, places, forces of the friction."""
    belt, sliding, sticking = 0.2, 0.5, 1.0
    times, places, forces = [0.0], [0.0], [0.0]
    t, x, v, stuck = 0.0, 0.0, belt, True
    while t < stop - 1e-12:
        if stuck:
            end = min(stop, t + (sticking - x) / belt)
            grid = np.linspace(t, end, 40)
            xs = x + belt * (grid - t)
            fs, v = xs, belt
        else:
            event = lambda _, y: y[1] - belt  # noqa: E731
            event.terminal, event.direction = True, 1  # type: ignore[attr-defined]
            run = solve_ivp(
                lambda _, y: [y[1], -y[0] + sliding], (t, stop), [x, v], rtol=1e-12, atol=1e-13, events=event,
                dense_output=True, first_step=1e-4,
            )  # fmt: skip
            grid = np.linspace(t, run.t[-1], 40)
            xs = run.sol(grid)[0]
            fs, v, end = np.full(40, sliding), run.y[1, -1], run.t[-1]
        times += list(grid[1:-1])
        places += list(xs[1:-1])
        forces += list(fs[1:-1])
        t, x, stuck = float(end), float(xs[-1]), not stuck
    return np.array(times[1:]), np.array(places[1:]), np.array(forces[1:])


def test_stick_and_slip_against_scipy() -> None:
    solution = mechc.loads(
        "coordinate Length x = 0 m; initial der(x) = 0.2 m/s; kinetic 1/2*1 kg*der(x)^2; potential 1/2*1 N/m*x^2;\n"
        "friction belt: 0.5 N static 1 N on x - 0.2 m/s*time; output F = multiplier(belt);\n"
        "output stuck = closed(belt); experiment(stop = 20 s, tolerance = 1e-11);"
    ).simulate(estimate_error=False)
    times, places, forces = _stick_slip(20.0)
    mine = [solution(t) for t in times]
    assert [m["x"] for m in mine] == pytest.approx(places, abs=1e-8)
    assert [m["F"] for m in mine] == pytest.approx(forces, abs=1e-8)
    assert [m["stuck"] for m in mine] == [float(f != 0.5) for f in forces]


def test_a_law_and_an_event_may_ask() -> None:
    """Pushed by 4 N/s t and 1 N more while it sticks, it slips at 1/2 s, and the run ends there."""
    solution = mechc.loads(
        "coordinate Length x = 0 m; kinetic 1/2*1 kg*der(x)^2; friction rub: 1 N static 3 N on x;\n"
        "force 4 N/s*time + (if closed(rub) then 1 N else 0 N) on x;\n"
        'when not closed(rub) then terminate("slips"); end when; experiment(stop = 2 s);'
    ).simulate(estimate_error=False)
    assert solution.time[-1] == pytest.approx(0.5, abs=1e-9)


def test_of_a_slip_that_is_prescribed() -> None:
    solution = mechc.loads(
        "coordinate Length x; drive x = 1 m/s^2*max(0 s, time - 0.5 s)^2; kinetic 1/2*1 kg*der(x)^2;\n"
        "friction rub: 2 N on x; output F = multiplier(rub); output stuck = closed(rub); experiment(stop = 1 s);"
    ).simulate(estimate_error=False)
    assert [float(solution(0.4)[name]) for name in ("F", "stuck")] == [0, 1]
    assert [float(solution(0.6)[name]) for name in ("F", "stuck")] == [-2, 0]


def test_of_a_regularized_friction() -> None:
    text = (
        "coordinate Length x = 0 m; initial der(x) = 1 m/s; kinetic 1/2*1 kg*der(x)^2;\n"
        'friction rub: 2 N on x, law = "regularized", v_stick = 0.5 m/s;\noutput F = multiplier(rub);\n'
        "experiment(stop = 1 s);"
    )
    solution = mechc.loads(text).simulate(estimate_error=False)
    assert solution["F"] == pytest.approx(-2 * np.tanh(solution["der(x)"] / 0.5), abs=1e-12)
    caught = refused(text.replace("multiplier", "closed"))
    assert caught[0].code == "E0212"
    assert "creep(rub)" in caught[0].help


@pytest.mark.parametrize(
    ("statement", "code"),
    [
        ("output F = multiplier(rob);", "E0212"),
        ("output F = reaction(rub);", "E0212"),
        ("constraint multiplier(rub)*1 m/N = x;", "E0535"),
        ("potential if closed(rub) then x*1 N else 0 J;", "E0535"),
        ("when initial() then release rub; end when;", "E0212"),
    ],
)
def test_what_cannot_be_asked(statement: str, code: str) -> None:
    text = f"coordinate Length x = 0 m; kinetic 1/2*1 kg*der(x)^2; friction rub: 2 N on x;\n{statement}"
    assert code in [d.code for d in refused(text)]


def test_closed_form_of_a_pendulum_that_is_held() -> None:
    """At 30 degrees the hinge carries m g l sin(30 deg), below its limit."""
    solution = mechc.loads(
        "import mech.planar.*; gravity {0, -9.81} m/s^2; Bar bar(m = 2 kg, l = 1 m);\n"
        "Revolute hinge(world -> bar.a, angle = -60 deg); friction rub: 12 N.m on hinge.angle;\n"
        "output carried = multiplier(rub); experiment(stop = 1 s);"
    ).simulate(estimate_error=False)
    assert solution["carried"] == pytest.approx(2 * 9.81 * 0.5 * math.cos(math.radians(60)), rel=1e-12)
