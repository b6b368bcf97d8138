"""Smooth pulses of some milliseconds that end a rest, lower a limit, or fire a branch, in runs of ten seconds.

References: closed forms, and integration by SciPy between events that are bracketed by hand.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp
from scipy.optimize import brentq

import mechc
from mechc.runtime.native.build import find_compiler

pytestmark = pytest.mark.skipif(find_compiler() is None, reason="needs the kernel")

AT = 3.3
Shape = Callable[[float], float]
SHAPES: dict[str, tuple[str, Shape]] = {
    "gaussian": ("exp(-s^2)", lambda s: math.exp(-(s**2))),
    "quotient": ("1/(1 + s^2)", lambda s: 1 / (1 + s**2)),
    "power": ("(1 + s^2)^(-1.5)", lambda s: (1 + s**2) ** -1.5),
    "base": ("2^(-s^2)", lambda s: 2 ** -(s**2)),
    "cosh": ("1/cosh(s)", lambda s: 1 / math.cosh(s)),
    "tanh": ("tanh(s + 1) - tanh(s - 1)", lambda s: math.tanh(s + 1) - math.tanh(s - 1)),
    "atan": ("atan(s + 1) - atan(s - 1)", lambda s: math.atan(s + 1) - math.atan(s - 1)),
    "erf": ("erf(s + 1) - erf(s - 1)", lambda s: math.erf(s + 1) - math.erf(s - 1)),
    "log": ("log(1 + 1.7/(1 + s^2))", lambda s: math.log(1 + 1.7 / (1 + s**2))),
    "wave": ("cos(s/500)^400000", lambda s: math.cos(s / 500) ** 400000),
    "product": ("exp(-s^2)*cos(s/10)", lambda s: math.exp(-(s**2)) * math.cos(s / 10)),
}


def model(text: str, width: float, shape: str = "gaussian") -> mechc.Model:
    """``g`` is the pulse in ``text``."""
    return mechc.loads(
        f"let s = (time - {AT} s)/({width} s);let g = {SHAPES[shape][0]};{text}experiment(stop = 10 s);"
    )


def pulse(width: float, shape: str = "gaussian") -> Shape:
    return lambda t: SHAPES[shape][1]((t - AT) / width)


def rises(function: Shape, level: float, width: float) -> float:
    """The time before the middle of a pulse at which it passes a level."""
    early = AT - width
    while function(early) > level:
        early -= width
    return float(brentq(lambda t: function(t) - level, early, AT, xtol=1e-15))


def slid(force: Shape, limit: float, mass: float, width: float) -> tuple[float, float]:
    """When a block slips under a force, and how far it slides, until it stops well behind the pulse."""
    begin = rises(force, limit, width)
    push = solve_ivp(lambda t, y: [y[1], (force(t) - limit) / mass], (begin, AT + 0.2), [0, 0], rtol=1e-12, atol=1e-14, method="DOP853", max_step=width / 10)  # fmt: skip
    x, v = push.y[:, -1]
    rest = solve_ivp(lambda t, y: [y[1], (force(t) - limit) / mass], (AT + 0.2, 10), [x, v], rtol=1e-12, atol=1e-14, method="DOP853", max_step=0.01, events=stops)  # fmt: skip
    return begin, float(rest.y_events[0][0][0])


def stops(_: float, y: np.ndarray) -> float:
    return float(y[1])


stops.terminal = True  # type: ignore[attr-defined]
BLOCK = "coordinate Length x = 0 m;kinetic 1/2*4 kg*der(x)^2;"
SWING = "coordinate Length z = 1 m;kinetic 1/2*1 kg*der(z)^2;potential 1/2*4 N/m*z^2;"


@pytest.mark.parametrize("width", [2e-3, 5e-3])
def test_a_weight_is_thrown_up_from_a_floor(width: float) -> None:
    text = "coordinate Length y = 0 m;kinetic 1/2*4 kg*der(y)^2;potential 40 N*y;force 400 N*g on y;contact f: y;output v = der(y);"
    run = model(text, width).simulate(every=0.001)
    g = pulse(width)
    begin = rises(lambda t: 400 * g(t), 40, width)
    flight = solve_ivp(lambda t, y: [y[1], 100 * g(t) - 10], (begin, AT + 10 * width), [0, 0], rtol=1e-12, atol=1e-14, max_step=width / 10)  # fmt: skip
    y, v = flight.y[:, -1]
    assert run.events[0].time == pytest.approx(begin, abs=1e-9)
    assert run.events[0].kind == "lift-off"
    assert run.events[1].time == pytest.approx(
        AT + 10 * width + (v + math.sqrt(v**2 + 20 * y)) / 10, abs=1e-7
    )
    assert np.max(run["y"]) == pytest.approx(y + v**2 / 20, abs=2e-6)  # rows are a millisecond apart


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("method", ["dop853", "radau5"])
def test_a_block_that_friction_holds_is_kicked(shape: str, method: str) -> None:
    width = 4e-3
    if shape == "wave":
        run = model(BLOCK + "force 200 N*g on x;friction 3 N on x;", width, shape).simulate(
            method=method, stop=6
        )
    else:
        run = model(BLOCK + "force 200 N*g on x;friction 3 N on x;", width, shape).simulate(method=method)
    g = pulse(width, shape)
    begin, end = slid(lambda t: 200 * g(t), 3, 4, width)
    assert run.events[0].time == pytest.approx(begin, abs=1e-8)
    assert run["x"][-1] == pytest.approx(end, rel=1e-6)
    assert any("narrow" in remark for remark in run.remarks)


@pytest.mark.parametrize("shape", SHAPES)
def test_a_branch_beside_a_swing_fires_once(shape: str) -> None:
    text = SWING + "discrete Integer n = 0;when g > 0.5 then n := n + 1; end when;"
    run = model(text, 5e-3, shape).simulate(stop=6)
    assert [event.time for event in run.events] == [
        pytest.approx(rises(pulse(5e-3, shape), 0.5, 5e-3), abs=1e-9)
    ]
    assert run["n"][-1] == 1
    assert (
        "looked for narrow events every 0.0003 s or closer: what is met for less may be missed" in run.remarks
    )


def test_a_limit_of_friction_dips() -> None:
    width = 5e-3
    run = model(BLOCK + "force 1 N on x;friction 3 N*(1 - g) on x;", width).simulate()
    g = pulse(width)

    def slides(t: float, y: np.ndarray) -> list[float]:
        return [float(y[1]), (1 - 3 * (1 - g(t))) / 4]

    early = solve_ivp(slides, (rises(g, 2 / 3, width), AT), [0, 0], rtol=1e-12, atol=1e-16, max_step=width / 20)  # fmt: skip
    late = solve_ivp(slides, (AT, AT + 0.1), early.y[:, -1], rtol=1e-12, atol=1e-16, max_step=width / 20, events=stops)  # fmt: skip
    assert run["x"][-1] == pytest.approx(late.y_events[0][0][0], rel=1e-5)


def test_a_wall_that_jumps_up_hits_what_rests() -> None:
    """Restitution 1: the body leaves with twice the speed of the wall."""
    width = 5e-3
    text = "coordinate Length y = 0.2 m;kinetic 1/2*1 kg*der(y)^2;contact f: y - 0.4 m*g restitution 1;"
    run = model(text, width).simulate()
    s = math.sqrt(math.log(2))
    assert run.events[0].time == pytest.approx(AT - s * width, abs=1e-10)
    assert run["der(y)"][-1] == pytest.approx(2 * 0.4 * 0.5 * 2 * s / width, rel=1e-8)


def test_a_bump_that_is_crossed_in_flight() -> None:
    """A body meets the side of a bump of some millimetres on its way; without friction the impact is the mirror of the slope."""
    text = "coordinate Length x = -3.3 m;coordinate Length y = 0.1 m;initial der(x) = 1 m/s;kinetic 1/2*1 kg*(der(x)^2 + der(y)^2);contact f: y - 0.2 m*exp(-(x/(5 mm))^2) restitution 1;experiment(stop = 6 s);"  # fmt: skip
    run = mechc.loads(text).simulate()
    s = math.sqrt(math.log(2))
    slope = 0.1 * 2 * s / 5e-3
    assert run.events[0].time == pytest.approx(3.3 - s * 5e-3, abs=1e-9)
    assert run["der(x)"][-1] == pytest.approx(1 - 2 * slope**2 / (1 + slope**2), abs=1e-8)


def test_a_pad_without_mass_is_dragged() -> None:
    """A Jenkins element: dragged by 90 mm, back by 80 mm, at 1 N; then its spring holds 5 mJ."""
    text = "coordinate Length x = 0 m;kinetic 1/2*1 kg*der(x)^2;coordinate Length n = 0 m;potential 1/2*100 N/m*(n - 0.1 m*g)^2;friction 1 N on n;"
    run = model(text, 10e-3).simulate()
    assert run["n"][-1] == pytest.approx(0.01, abs=1e-9)
    assert run["energy.dissipated"][-1] == pytest.approx(0.17, abs=1e-6)
    assert run["energy.supplied"][-1] == pytest.approx(0.175, abs=1e-6)


def test_what_else_the_pulse_moves_is_as_exact() -> None:
    """The step to the event of the block saw nothing of the pulse at first."""
    width = 4e-3
    text = BLOCK + "coordinate Length z = 0 m;kinetic 1/2*1 kg*der(z)^2;force 200 N*g on x;force 100 N*g on z;friction 3 N on x;"  # fmt: skip
    run = model(text, width).simulate()
    assert run["der(z)"][-1] == pytest.approx(100 * width * math.sqrt(math.pi), rel=1e-7)


def test_an_input_is_a_pulse() -> None:
    text = f"input Real a = exp(-((time - {AT} s)/(4 ms))^2);" + BLOCK + "force 200 N*a on x;friction 3 N on x;experiment(stop = 10 s);"  # fmt: skip
    g = pulse(4e-3)
    _, end = slid(lambda t: 200 * g(t), 3, 4, 4e-3)
    assert mechc.loads(text).simulate()["x"][-1] == pytest.approx(end, rel=1e-6)


def test_members_of_an_ensemble_see_it_too() -> None:
    text = BLOCK + "parameter F = 200 N;force F*g on x;friction 3 N on x;"
    found = model(text, 4e-3).ensemble("F = {100, 200} N", "final(x)")
    g = pulse(4e-3)
    slides = [slid(lambda t, push=push: push * g(t), 3, 4, 4e-3)[1] for push in (100, 200)]  # type: ignore[misc]
    np.testing.assert_allclose(found.numbers.ravel(), slides, rtol=1e-6)


def test_a_caller_that_steps_sees_it() -> None:
    env = model(BLOCK + "force 200 N*g on x;friction 3 N on x;", 4e-3).env(10.0)
    env.step()
    g = pulse(4e-3)
    assert env.q[0] == pytest.approx(slid(lambda t: 200 * g(t), 3, 4, 4e-3)[1], rel=1e-6)


def test_a_quotient_of_time_pushes_a_swing() -> None:
    run = mechc.loads(
        "coordinate x = 1 m;kinetic 1/2*1 kg*der(x)^2;potential 1/2*4 N/m*x^2;"
        "force 100 N/(1 + ((time - 5.5 s)/(1 ms))^4) on x;experiment(stop = 10 s);"
    ).simulate()
    reference = solve_ivp(lambda t, y: [y[1], -4 * y[0] + 100 / (1 + ((t - 5.5) / 1e-3) ** 4)], (5.4, 5.6), [math.cos(10.8), -2 * math.sin(10.8)], rtol=1e-12, atol=1e-14, max_step=1e-4, method="DOP853")  # fmt: skip
    late = solve_ivp(lambda t, y: [y[1], -4 * y[0] + 100 / (1 + ((t - 5.5) / 1e-3) ** 4)], (5.6, 10), reference.y[:, -1], rtol=1e-12, atol=1e-14, method="DOP853")  # fmt: skip
    assert run["x"][-1] == pytest.approx(late.y[0, -1], abs=1e-6)


def swung(force: Shape, edges: list[float]) -> float:
    """Where a swing of 2 rad/s that starts at 1 is after 10 s; ``edges`` are where the force has kinks."""
    y = [math.cos(2 * edges[0]), -2 * math.sin(2 * edges[0])]
    for one, other in zip(edges, [*edges[1:], 10.0], strict=True):
        y = solve_ivp(lambda t, y: [y[1], -4 * y[0] + force(t)], (one, other), y, rtol=1e-12, atol=1e-14, method="DOP853").y[:, -1]  # fmt: skip
    return float(y[0])


def hat(s: float) -> float:
    return max(0.0, 1 - abs(s))


KINKED: dict[str, Shape] = {
    "max(0, 1 - abs(s))": hat,
    "max(0, s + 1) - 2*max(0, s) + max(0, s - 1)": hat,
    "clamp(s + 1, 0, 1) - clamp(s, 0, 1)": hat,
    "min(1, max(0, 2 - 2*abs(s)))": lambda s: min(1.0, 2 * hat(s)),
    "max(0, 1 - abs(mod(time/(1 s), 20) - 3.3)*1000/4)": hat,
    "max(0, 1 - s^2)": lambda s: max(0.0, 1 - s * s),
}
"""Of pulses of 8 ms with kinks."""


@pytest.mark.parametrize("formula", KINKED)
def test_a_swing_is_pushed_by_a_pulse_with_kinks(formula: str) -> None:
    width = 4e-3
    run = model(
        f"coordinate Length x = 1 m;kinetic 1/2*1 kg*der(x)^2;potential 1/2*4 N/m*x^2;force 100 N*({formula}) on x;",
        width,
    ).simulate()
    force = KINKED[formula]
    edges = [AT - width, AT - width / 2, AT, AT + width / 2, AT + width]
    assert run["x"][-1] == pytest.approx(swung(lambda t: 100 * force((t - AT) / width), edges), abs=1e-6)


@pytest.mark.parametrize("formula", KINKED)
def test_a_block_is_kicked_by_a_pulse_with_kinks(formula: str) -> None:
    width = 4e-3
    run = model(BLOCK + f"force 200 N*({formula}) on x;friction 3 N on x;", width).simulate()
    begin, end = slid(lambda t: 200 * KINKED[formula]((t - AT) / width), 3, 4, width)
    assert run.events[0].time == pytest.approx(begin, abs=1e-8)
    assert run["x"][-1] == pytest.approx(end, rel=1e-5)


def test_a_limit_is_cut_for_some_milliseconds() -> None:
    """Limit 300 |t - AT|/s within 10 ms, below a force of 1 N for 1/300 s: half of the way is that of the lack, half that of the stop."""
    run = model(BLOCK + f"force 1 N on x;friction min(3 N, 300 N/s*abs(time - {AT} s)) on x;", 1).simulate()

    def lack(t: float) -> float:
        return (1 - min(3, 300 * abs(t - AT))) / 4

    y, ends = [0.0, 0.0], [AT - 1 / 300, AT, AT + 1 / 300, AT + 0.01]
    for one, other in pairwise(ends):
        part = solve_ivp(lambda t, y: [y[1], lack(t)], (one, other), y, rtol=1e-12, atol=1e-15, method="DOP853", events=stops if one > AT else None)  # fmt: skip
        y = part.y[:, -1]
    assert run["x"][-1] == pytest.approx(part.y_events[0][0][0], rel=1e-5)


@pytest.mark.parametrize(
    ("law", "energy"),
    [
        ("force -100 N*max(0, 1 - abs(x - 5.0123 m)/(1 mm)) on x;", 0.1),
        ("force -100 N*max(0, 1 - ((x - 5.0123 m)/(1 mm))^2) on x;", 400e-3 / 3),
        ("friction 100 N*max(0, 1 - abs(x - 5.0123 m)/(1 mm)) on x;", 0.1),
    ],
)
def test_a_bump_of_a_law_with_kinks_is_crossed(law: str, energy: float) -> None:
    """While a swing beside it moves."""
    text = f"coordinate Length x = 0 m;initial der(x) = 1 m/s;kinetic 1/2*1 kg*der(x)^2;{law}{SWING}experiment(stop = 10 s);"
    run = mechc.loads(text).simulate()
    assert run["der(x)"][-1] == pytest.approx(math.sqrt(1 - 2 * energy), abs=1e-6)


def test_taylor_series_see_it_too() -> None:
    text = SWING + "force 100 N*g on z;"
    run = model(text, 4e-3).simulate(method="taylor")
    edges = [AT - 0.04, AT - 0.004, AT, AT + 0.004, AT + 0.04]
    assert run["z"][-1] == pytest.approx(swung(lambda t: 100 * pulse(4e-3)(t), edges), abs=1e-6)


def test_a_pulse_about_a_discrete_time() -> None:
    width = 4e-3
    text = f"discrete Time d = 100 s;when time >= 1 s then d := {AT} s; end when;" + BLOCK + "force 200 N/(1 + ((time - d)/(4 ms))^2) on x;friction 3 N on x;"  # fmt: skip
    run = model(text, width).simulate()
    begin, end = slid(lambda t: 200 * pulse(width, "quotient")(t), 3, 4, width)
    assert run.events[1].time == pytest.approx(begin, abs=1e-8)
    assert run["x"][-1] == pytest.approx(end, rel=1e-6)


PUSHES: dict[str, Shape] = {
    "exp(-s^2)": lambda s: math.exp(-s * s),
    "max(0, 1 - abs(s))": hat,
    "1/(1 + s^4)": lambda s: 1 / (1 + s**4),
}


@pytest.mark.parametrize("formula", PUSHES)
@pytest.mark.parametrize("lanes", ["on", "off"])
def test_swings_of_an_ensemble_are_pushed(formula: str, lanes: str) -> None:
    """Each member at a time of its own: by the integral of the force with the answer of the swing."""
    text = f"parameter T = 1 s;let s = (time - T)/(15 ms);coordinate Length x = 1 cm;kinetic 1/2*1 kg*der(x)^2;potential 1/2*0.01 N/m*x^2;force 8 N*({formula}) on x;experiment(stop = 100 s);"  # fmt: skip
    found = mechc.loads(text).ensemble("T = 3 s .. 90 s, 12", "final(x)", lanes=lanes)
    push, width = PUSHES[formula], 15e-3
    for at, end in zip(np.linspace(3, 90, 12), found.numbers.ravel(), strict=True):
        answer = lambda s, at=at: push(s) * math.sin(0.1 * (100 - at - s * width)) / 0.1  # noqa: E731
        moved = sum(
            quad(answer, *ends, epsabs=1e-13, limit=200)[0] for ends in pairwise([-180, -9, -1, 0, 1, 9, 180])
        )
        assert end == pytest.approx(0.01 * math.cos(10) + 8 * width * moved, abs=3e-6)
    assert any("narrow" in remark for remark in found.remarks)


def test_members_that_nothing_pushes_take_long_steps() -> None:
    text = (
        SWING
        + "force 1 N*max(0, time/(1 s) - 1) on z;parameter k = 1 N;force k*tanh(z/(1 m)) on z;experiment(stop = 10 s);"
    )
    found = mechc.loads(text).ensemble("k = {1, 2} N", "final(z)")
    assert not found.remarks
    assert found.steps.max() < 200
