"""What is driven by its rate goes on as it is driven where contacts beside it close and rest."""

from __future__ import annotations

import numpy as np
import pytest

import mechc
from mechc.runtime.methods import KERNEL_METHODS
from mechc.runtime.outcome import Outcome

BESIDE = """
coordinate Length s = 0.3 m;
drive der(s) = 1 m/s + 0.5 m/s*cos(2 Hz*time);
kinetic 1/2*1 kg*der(s)^2;
coordinate Length x = 0 m;
coordinate Length y = 0.3 m;
initial der(x) = 1 m/s;
kinetic 1/2*1 kg*(der(x)^2 + der(y)^2);
potential 1 kg*9.81 m/s^2*y;
contact floor: y + 0.2 m*sin(x/1 m) {bounce};
experiment(stop = 1 s);
"""


@pytest.mark.parametrize("bounce", ["", "restitution 0.5", "friction 0.3 along der(x)"])
@pytest.mark.parametrize("method", ["dop853", "radau5"])
def test_a_driven_rate_beside_a_contact(bounce: str, method: str) -> None:
    """The place is the integral of the rate, s = 0.3 m + t + sin(2 t)/4, whatever lands beside it."""
    solution = mechc.loads(BESIDE.format(bounce=bounce)).simulate(every=0.1, method=method, tolerance=1e-9)
    assert {"impact", "rest"} <= {e.kind for e in solution.events}
    t = np.asarray(solution.time)
    # of a tolerance of 1e-9 a step, a hundred of them and an event each
    assert np.asarray(solution["s"]) == pytest.approx(0.3 + t + np.sin(2 * t) / 4, abs=1e-7)
    error = solution.accuracy.error
    assert error is not None and error.largest < 1e-7


def test_an_impact_of_what_hangs_on_a_drive_is_booked_on_both_sides() -> None:
    """What drives x pushes back by the momentum that it gets along x: at q = 0 that is 0.8 kg.m of the jump of der(q)."""
    text = (
        "coordinate Length x;kinetic 1/2*2 kg*der(x)^2;coordinate Angle q = 0.1 rad;initial der(q) = -1 rad/s;"
        "kinetic 1/2*1.5 kg.m^2*der(q)^2;kinetic 0.8 kg.m*(der(q)*der(x))*cos(2*q);"
        "drive x = 0.35 m + 0.3 m*cos(2 s^-1*time);contact C: q restitution 0.5;experiment(stop = 0.3 s);"
    )
    run = mechc.loads(text).simulate()
    (k,) = np.flatnonzero(np.diff(run.time) == 0)
    jump = {name: run[name][k + 1] - run[name][k] for name in run if name != "time"}
    before = run["der(q)"][k]
    assert jump["der(q)"] == pytest.approx(-1.5 * before, rel=1e-12)
    assert jump["energy.supplied"] == pytest.approx(0.8 * jump["der(q)"] * run["der(x)"][k], rel=1e-9)
    assert jump["energy.dissipated"] == pytest.approx(1.5 * before**2 * (1 - 0.5**2) / 2, rel=1e-9)
    assert run.outcome is Outcome.COMPLETED, run.message


@pytest.mark.parametrize("impacts", ["", ', impacts = "simultaneous"'])
def test_a_pendulum_under_a_trolley_that_is_driven_hits_a_wall(impacts: str) -> None:
    text = (
        "import mech.planar.*;gravity {0, -9.81} m/s^2;Prismatic rail(world -> trolley.a);Body trolley(m = 3 kg);Rod bar(m = 2 kg, l = 1 m);"
        "Revolute pin(trolley.a -> bar.a, angle = -50 deg);drive rail.position = 0.2 m*sin(3 s^-1*time);"
        f"contact wall: 0.25 m - pos(bar.b)[1] restitution 0.6{impacts};experiment(stop = 4 s);"
    )
    run = mechc.loads(text).simulate()
    assert sum(event.kind == "impact" for event in run.events) >= 2
    assert run.outcome is Outcome.COMPLETED, run.message
    kept = run["energy.total"] + run["energy.dissipated"] - run["energy.supplied"]
    assert np.ptp(kept) < 1e-6  # of some hundred steps of 1e-8


@pytest.mark.parametrize("method", sorted(set(KERNEL_METHODS) - {"auto"}))
def test_every_method_takes_a_driven_rate_as_it_is_or_refuses_it(method: str) -> None:
    """The place is 0.3 + 0.11 t + 0.25 sin(0.84 t), whatever moves beside it; `verlet` moved it by the velocity of that."""
    text = (
        "coordinate Angle a = 0.3 rad;kinetic 1/2*0.3 kg.m^2*der(a)^2;coordinate Length q = 0.69 m;"
        "kinetic 1/2*0.6 kg*(der(q)^2 + (q^2 + 0.2 m^2)*der(a)^2);potential 1/2*3 N/m*q^2;"
        "drive der(a) = 0.11 rad/s + 0.21 rad/s*cos(0.84 rad/s*time);experiment(stop = 1 s);"
    )
    step = None if method in ("dop853", "radau5", "taylor") else 0.01
    try:
        run = mechc.loads(text).simulate(method=method, step=step)
    except mechc.SimulationError as refused:
        # nothing switches
        assert "of which the rate alone is prescribed" in str(refused) or method == "moreau"
        return
    assert run["a"][-1] == pytest.approx(0.3 + 0.11 + 0.25 * np.sin(0.84), abs=1e-5)


COUPLED = """
coordinate Length x;
kinetic 1/2*2 kg*der(x)^2;
coordinate Angle q = 0.1 rad;
initial der(q) = -1 rad/s;
kinetic 1/2*1.5 kg.m^2*der(q)^2 + 0.8 kg.m*(der(q)*der(x))*cos(2*q);
coordinate Length z = 0 m;
initial der(z) = 0.2 m/s;
kinetic 1/2*1 kg*der(z)^2 + 0.3 kg.m*der(q)*der(z);
experiment(stop = 0.5 s);
"""
PLACE = "drive x = 0.35 m + 0.3 m*cos(2 s^-1*time);"


@pytest.mark.parametrize(
    "what",
    [
        PLACE + "contact C: q restitution 0.5 friction 0.3 along der(z) - 0.5*der(x);",
        PLACE + "contact C: q*1 m + 0.1*(x - 0.65 m) - 0.02 m*sin(3 s^-1*time) restitution 0.5;",
        "initial x = 0.3 m;drive der(x) = 0.3 m/s*cos(2 s^-1*time);contact C: q restitution 0.5;",
        PLACE
        + "constraint k: der(q)*1 m = der(z) - 0.1*der(x);when initial() then release k;end when;when time > 0.2 s then engage k;end when;",
        PLACE + "when time > 0.2 s then reinit(der(q), 2 rad/s);end when;",
        PLACE + "when time > 0.2 s then impulse 0.7 N.m.s on q;end when;",
        PLACE + "potential (if q < 0 rad then 0.2 J else 0 J);",
        PLACE + "potential (if q < 0 rad then 5 J else 0 J);",
        PLACE + "friction 5 N.m on q;",
    ],
)
def test_whatever_throws_what_is_coupled_to_a_drive_is_booked(what: str) -> None:
    run = mechc.loads(COUPLED + what).simulate(tolerance=1e-9)
    assert run.events
    assert run.outcome is Outcome.COMPLETED, run.message
    lost = run.get("energy.dissipated", 0.0)
    assert np.ptp(run["energy.total"] + lost - run["energy.supplied"]) < 1e-10


def test_a_rod_on_a_slider_that_is_driven_hits_a_stop() -> None:
    """The jump of the speed gives the slider m l sin(angle) of it as an impulse, which what drives it takes up at its own speed."""
    text = (
        "import mech.planar.*;Prismatic rail(world -> cart.a);Body cart(m = 5 kg);drive rail.position = 0.3 m/s*time;"
        "Body rod(m = 2 kg, J = 0.1 kg.m^2, com = {0.4 m, 0 m});Revolute pin(cart.a -> rod.a, angle = 90 deg, der(angle) = -2 rad/s);"
        "contact stop: pin.angle - 60 deg restitution 0.5;experiment(stop = 0.5 s);"
    )
    run = mechc.loads(text).simulate(tolerance=1e-10)
    (k,) = np.flatnonzero(np.diff(run.time) == 0)
    jump = {name: run[name][k + 1] - run[name][k] for name in run if name != "time"}
    speed, inertia = -2.0, 0.1 + 2 * 0.4**2
    assert jump["der(pin.angle)"] == pytest.approx(-1.5 * speed, rel=1e-9)
    assert jump["energy.supplied"] == pytest.approx(0.3 * 2 * 0.4 * np.sin(np.pi / 3) * 1.5 * speed, rel=1e-9)
    assert jump["energy.dissipated"] == pytest.approx(inertia * speed**2 / 2 * (1 - 0.5**2), rel=1e-9)
