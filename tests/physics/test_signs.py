"""Signs of what counts the other way round: sign(-x), sign(b - a) beside sign(a - b), and signs of names of differences."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

import mechc
from mechc import SimulationError

Array = NDArray[np.float64]

PUSHED = "coordinate x = 1 m; kinetic 1/2*1 kg*der(x)^2; {} experiment(stop = 10 s);"
PUSHES = (
    "force -1 N*sign(x) on x;",
    "force 1 N*sign(-x) on x;",
    "let y = -x; force 1 N*sign(y) on x;",
    "parameter c = 1 N; let y = 2*(0 m - x); let push = -sign(y)*c; force -push on x;",
    "let y = 3 m - (x + 3 m); force (if sign(y) > 0 then 1 N else -1 N) on x;",
)


@pytest.mark.parametrize("push", PUSHES)
def test_a_push_that_turns_with_the_sign(push: str) -> None:
    """Parabolas: a quarter of a swing takes the square root of two."""
    solution = mechc.loads(PUSHED.format(push)).simulate()
    left = 10 - 7 * math.sqrt(2)  # after seven quarters it comes through the middle with that speed
    assert solution.statistics.steps < 40
    assert solution["x"][-1] == pytest.approx(math.sqrt(2) * left - left**2 / 2, abs=1e-12)


BRAKED = """
coordinate a = 0 m;
coordinate b = 0 m;
initial der(a) = 3 m/s;
initial der(b) = -1 m/s;
kinetic 1/2*1 kg*der(a)^2 + 1/2*2 kg*der(b)^2;
let u = der(a) - der(b);
let w = der(b) - der(a);
parameter v = 3 m/s;
force -1 N*sign(u)*exp(-u^2/v^2) on a;
force -1 N*sign(w)*exp(-u^2/v^2) on b;
potential 1/2*8 N/m*(a - b)^2;
experiment(stop = 2 s);
"""


def test_differences_of_both_orders() -> None:
    """Bodies that brake each other, against SciPy with its events where one overtakes the other."""

    def motion(_: float, y: Array, side: float) -> list[float]:
        d, w = y
        push = -side * math.exp(-(w**2) / 9) - 8 * d
        return [w, 1.5 * push]

    def turns(_: float, y: Array, side: float) -> float:
        return float(y[1])

    turns.terminal = True  # type: ignore[attr-defined]
    t, y, side = 0.0, np.array([0.0, 4.0]), 1.0
    while t < 2:
        turns.direction = -side  # type: ignore[attr-defined]
        found = solve_ivp(
            motion, (t, 2), y, "DOP853", args=(side,), events=turns, rtol=1e-12, atol=1e-13, max_step=0.01
        )
        t, y, side = float(found.t[-1]), found.y[:, -1], -side
    solution = mechc.loads(BRAKED).simulate()
    relative = [solution["a"][-1] - solution["b"][-1], solution["der(a)"][-1] - solution["der(b)"][-1]]
    assert relative == pytest.approx(y.tolist(), abs=2e-8)
    assert solution.statistics.steps < 100


PLAY = """
import mech.rotational.*;
{declared}
Rotor rotor(J = 0.1 kg.m^2);
Node mid(angle ~ 0 rad);
SpringDamper shaft(rotor.angle -> mid.angle, k = 100 N.m/rad, c = 1 N.m.s/rad);
Backlash teeth({between}, k = 50 N.m/rad, c = 0.5 N.m.s/rad, play = 0.02 rad);
initial der(rotor.angle) = 1 rad/s;
experiment(stop = 1 s);
"""
HELD = ("from = mid.angle", "from = mid.angle, to = 0", "0 -> mid.angle", "mid.angle -> housing")


def _swung(stop: float) -> Array:
    """Angle and rate of the rotor, and the angle of the node: the balance of torques gives its rate, in the play and beyond it."""

    def spring(mid: float) -> float:
        return 50 * (mid - math.copysign(0.01, mid)) if abs(mid) > 0.01 else 0.0

    def rate(y: Array, touching: bool) -> float:
        return float((y[1] + 100 * (y[0] - y[2]) - touching * spring(y[2])) / (1 + 0.5 * touching))

    def motion(_: float, y: Array, touching: bool) -> list[float]:
        v = rate(y, touching)
        return [y[1], -(100 * (y[0] - y[2]) + (y[1] - v)) / 0.1, v]

    def changes(_: float, y: Array, touching: bool) -> float:
        if touching:
            return math.copysign(1, y[2]) * (spring(y[2]) + 0.5 * rate(y, True))
        return 0.01 - abs(float(y[2]))

    changes.terminal = True  # type: ignore[attr-defined]
    changes.direction = -1  # type: ignore[attr-defined]
    t, y, touching = 0.0, np.array([0.0, 1.0, 0.0]), False
    while t < stop:
        found = solve_ivp(
            motion,
            (t, stop),
            y,
            "DOP853",
            args=(touching,),
            events=changes,
            rtol=1e-12,
            atol=1e-14,
            max_step=1e-3,
        )
        t, y, touching = float(found.t[-1]), found.y[:, -1], not touching
    return y


@pytest.mark.parametrize("between", HELD)
def test_a_node_without_mass_in_a_play(between: str) -> None:
    """Its angle and its rate come through zero, where nothing happens."""
    declared = "let housing = 0 rad;" if "housing" in between else ""
    solution = mechc.loads(PLAY.format(declared=declared, between=between)).simulate()
    found = [solution[name][-1] for name in ("rotor.angle", "der(rotor.angle)", "mid.angle")]
    assert found == pytest.approx(_swung(1.0).tolist(), abs=1e-8)


def test_what_a_part_holds_is_not_moved_from_outside() -> None:
    model = mechc.loads(PLAY.format(declared="", between="from = mid.angle"))
    moved = {"teeth.to": ([0.0, 1.0], [0.0, 0.1])}
    with pytest.raises(
        SimulationError, match=r"need the rate of the input 'teeth\.to', which they take to be zero"
    ):
        model.simulate(inputs=moved)


VALLEYS = (
    "potential 1 N*abs(x);",
    "potential 1 N*sqrt(x^2);",
    "let y = -x; potential 1 N*max(y, -y);",
    "parameter k = 2 N; potential sum(k/2*abs(e) for e in {x});",
)


@pytest.mark.parametrize("valley", VALLEYS)
def test_a_valley_with_a_sharp_floor(valley: str) -> None:
    """Its force jumps where its derivative does: the same parabolas."""
    solution = mechc.loads(PUSHED.format(valley)).simulate()
    left = 10 - 7 * math.sqrt(2)
    assert solution.statistics.steps < 40
    assert solution["x"][-1] == pytest.approx(math.sqrt(2) * left - left**2 / 2, abs=1e-12)


def test_what_bends_ends_no_step() -> None:
    """The force of a spring that only pushes is continuous."""
    found = mechc.loads("coordinate x = 1 m; kinetic 1/2*1 kg*der(x)^2; potential 1/2*1 N/m*max(x, 0 m)^2;")
    assert found.problem().hybrid is None
