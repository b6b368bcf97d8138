"""Friction that gives way at other limits forwards than backwards: gears with losses, freewheels, one-way clutches.

Judges: SciPy between events, with a mode machine of its own for sticking and slipping; statics; closed forms.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from refusals import refused
from scipy.integrate import solve_ivp

import mechc

STUCK, FORWARD, BACKWARD = 0, 1, -1


def machine(
    rates: Callable[[int, float, np.ndarray], np.ndarray],
    slip: Callable[[np.ndarray], float],
    held: Callable[[float, np.ndarray], tuple[float, float, float]],
    y0: list[float],
    stop: float,
    mode: int,
) -> tuple[Callable[[float], np.ndarray], list[tuple[float, int]]]:
    """Integrate from mode to mode. ``held``: the force that holds, and the limits between which it may be, from below."""
    pieces, changes = [], [(0.0, mode)]
    t, y = 0.0, np.array(y0, float)
    while t < stop:
        if mode == STUCK:
            events = [lambda s, x: held(s, x)[0] - held(s, x)[1], lambda s, x: held(s, x)[2] - held(s, x)[0]]
        else:
            events = [lambda s, x, m=mode: m * slip(x)]  # type: ignore[misc]
        for event in events:
            event.terminal, event.direction = True, -1  # type: ignore[attr-defined]
        run = solve_ivp(
            lambda s, x, m=mode: rates(m, s, x), (t, stop), y, rtol=1e-12, atol=1e-13, events=events, dense_output=True,
            method="DOP853", first_step=1e-6,
        )  # fmt: skip
        pieces.append((t, run.t[-1], run.sol))
        t, y = float(run.t[-1]), run.y[:, -1]
        if run.status != 1:
            break
        if mode == STUCK:
            mode = FORWARD if run.t_events[0].size else BACKWARD
        else:
            force, low, high = held(t, y)
            mode = STUCK if low <= force <= high else FORWARD if force < low else BACKWARD
        changes.append((t, mode))

    def state(time: float) -> np.ndarray:
        sol = next(s for a, b, s in pieces if a <= time <= b)
        return np.asarray(sol(time))

    return state, changes


# ---------------------------------------------------------------- a mass

MASS = """
parameter x0 = -0.3 m;
coordinate Length x = x0;
initial der(x) = 0 m/s;
kinetic 1/2*1 kg*der(x)^2;
potential 1/2*4 N/m*x^2;
force 2.2 N*sin(0.9 rad/s*time) on x;
friction rub: forward 0.5 N backward 0.2 N static forward 0.8 N backward 0.3 N on x;
output F = multiplier(rub);
output stuck = closed(rub);
experiment(stop = 30 s, tolerance = 1e-11);
"""


def test_a_mass_that_sticks_otherwise_to_the_right_than_to_the_left() -> None:
    def push(t: float, y: np.ndarray) -> float:
        return 2.2 * math.sin(0.9 * t) - 4 * float(y[0])

    state, changes = machine(
        lambda m, t, y: np.array([y[1], 0.0 if m == STUCK else push(t, y) + (-0.5 if m > 0 else 0.2)]),
        lambda y: float(y[1]),
        lambda t, y: (-push(t, y), -0.8, 0.3),
        [-0.3, 0.0],
        30.0,
        FORWARD,
    )
    solution = mechc.loads(MASS).simulate(estimate_error=False)
    events = [e for e in solution.events if e.kind in ("slip", "stick")]
    assert len(changes) > 12
    assert [e.time for e in events] == pytest.approx([t for t, _ in changes[1:]], abs=1e-8)
    for time in np.linspace(0.05, 29.9, 60):
        mine = solution(time)
        assert mine["x"] == pytest.approx(state(time)[0], abs=1e-8)
        mode = [m for t, m in changes if t <= time][-1]
        force = -push(time, state(time)) if mode == STUCK else -0.5 if mode > 0 else 0.2
        assert mine["F"] == pytest.approx(force, abs=1e-7)
        assert mine["stuck"] == (mode == STUCK)


def test_its_account_of_energy_is_exact() -> None:
    """Dissipated is 0.5 N by the way forwards and 0.2 N by the way backwards; nothing else takes or brings energy."""
    text = MASS.replace("force 2.2 N*sin(0.9 rad/s*time) on x;", "").replace("x0 = -0.3", "x0 = -0.9")
    solution = mechc.loads(text).simulate(estimate_error=False)
    x = solution["x"]
    ways = np.diff(x)
    lost = 0.5 * ways[ways > 0].sum() - 0.2 * ways[ways < 0].sum()
    assert solution["energy.dissipated"][-1] == pytest.approx(lost, rel=1e-9)
    assert solution["energy.total"][-1] + lost == pytest.approx(2 * 0.81, rel=1e-9)
    assert solution.energy is not None and "energy.supplied" not in solution.quantities


def test_equal_sides_are_plain_friction() -> None:
    both = MASS.replace(
        "forward 0.5 N backward 0.2 N static forward 0.8 N backward 0.3 N",
        "forward 0.5 N backward 0.5 N static forward 0.8 N backward 0.8 N",
    )
    plain = MASS.replace(
        "forward 0.5 N backward 0.2 N static forward 0.8 N backward 0.3 N", "0.5 N static 0.8 N"
    )
    a, b = (mechc.loads(text).simulate(estimate_error=False) for text in (both, plain))
    assert a["x"][-1] == pytest.approx(b["x"][-1], abs=1e-9)


def test_a_regularized_law_has_two_sides() -> None:
    text = (
        "coordinate Length x = 0 m; initial der(x) = 1 m/s; kinetic 1/2*1 kg*der(x)^2; potential 1/2*9 N/m*x^2;\n"
        'friction rub: forward 0.4 N backward 0.1 N on x, law = "regularized", v_stick = 0.1 m/s; output F = multiplier(rub);\n'
        "experiment(stop = 3 s);"
    )
    solution = mechc.loads(text).simulate(estimate_error=False)
    v = solution["der(x)"]
    expected = np.where(v > 0, -0.4, -0.1) * np.tanh(v / 0.1)
    assert solution["F"] == pytest.approx(expected, abs=1e-12)


# ---------------------------------------------------------------- gears with losses

GEAR = """
parameter eta = 0.5;
coordinate Angle a = 0 rad;
coordinate Angle b ~ 0 rad;
kinetic 1/2*1 kg.m^2*der(a)^2 + 1/2*1.5 kg.m^2*der(b)^2;
constraint mesh: 2*b = a;
force drive: 10 N.m*sin(2*pi*time/1 s) on a;
force load: -10 N.m + 2.5 N.m/s*min(time, 2 s) on b;
let Torque tau = multiplier(mesh) "positive where a drives";
friction teeth: forward max((1/eta - 1)*tau, (eta - 1)*tau) backward max((1 - 1/eta)*tau, (1 - eta)*tau) on a;
output through = tau;
output loss = multiplier(teeth);
output stuck = closed(teeth);
experiment(stop = 2 s, tolerance = 1e-11);
"""


def test_a_gear_that_loses_and_locks() -> None:
    """The first demonstration of Modelica's LossyGear: efficiency 0.5 both ways, ratio 2, driven to and fro against a load."""
    eta, j1, j2 = 0.5, 1.0, 1.5

    def outside(t: float) -> tuple[float, float]:
        return 10 * math.sin(2 * math.pi * t), -10 + 2.5 * min(t, 2.0)

    def limits(tau: float) -> tuple[float, float]:
        fore = (1 / eta - 1) * tau if tau > 0 else (1 - eta) * -tau
        back = (1 - eta) * tau if tau > 0 else (1 / eta - 1) * -tau
        return -fore, back

    def sliding(m: int, t: float) -> tuple[float, float]:
        """a'' and tau: of both signs of tau the one that it has."""
        drive, load = outside(t)
        for sign in (1, -1):
            low, high = limits(sign)
            share = (low if m > 0 else high) * sign  # the loss is share tau
            # j1 a'' = drive - tau + share tau,  j2 a''/2 = load + 2 tau
            tau = (drive / j1 - 2 * load / j2) / (4 / j2 + (1 - share) / j1)
            if tau * sign >= 0:
                return (2 * load + 4 * tau) / j2, tau
        raise AssertionError

    def held(t: float, _: np.ndarray) -> tuple[float, float, float]:
        drive, load = outside(t)
        tau = -load / 2
        return (tau - drive, *limits(tau))

    state, changes = machine(
        lambda m, t, y: np.array([y[1], 0.0 if m == STUCK else sliding(m, t)[0]]),
        lambda y: float(y[1]),
        held,
        [0.0, 0.0],
        2.0,
        STUCK
        if held(0.0, np.zeros(2))[1] <= held(0.0, np.zeros(2))[0] <= held(0.0, np.zeros(2))[2]
        else BACKWARD,
    )
    solution = mechc.loads(GEAR).simulate(estimate_error=False)
    events = [e.time for e in solution.events if e.name == "teeth"]
    assert len(changes) > 3
    assert events == pytest.approx([t for t, _ in changes[1:]], abs=1e-8)
    for time in np.linspace(0.01, 1.99, 70):
        mine = solution(time)
        mode = [m for t, m in changes if t <= time][-1]
        assert mine["a"] == pytest.approx(state(time)[0], abs=1e-8)
        assert mine["stuck"] == (mode == STUCK)
        tau = -outside(time)[1] / 2 if mode == STUCK else sliding(mode, time)[1]
        assert mine["through"] == pytest.approx(tau, abs=1e-7)
    total = solution["energy.total"] + solution["energy.dissipated"] - solution["energy.supplied"]
    assert np.ptp(total) < 1e-8


@pytest.mark.parametrize("drive", [2.0, 0.0, -0.15, -0.5])
def test_a_self_locking_worm(drive: float) -> None:
    """From b it loses more than it transmits (efficiency -0.4): its load alone turns nothing, nor with a small torque on a."""
    text = (
        "coordinate Angle a = 0 rad; coordinate Angle b ~ 0 rad; kinetic 1/2*0.1 kg.m^2*der(a)^2 + 1/2*2 kg.m^2*der(b)^2;\n"
        "constraint mesh: 20*b = a; let Torque tau = multiplier(mesh);\n"
        "friction teeth: forward max((1/0.4 - 1)*tau, (-0.4 - 1)*tau) backward max((1 - 1/0.4)*tau, (1 + 0.4)*tau) on a;\n"
        f"force -10 N.m on b; force {drive} N.m on a; output stuck = closed(teeth); experiment(stop = 1 s);"
    )
    found = mechc.loads(text).simulate(estimate_error=False)
    # with 0.1 a'' = drive - share tau and 2 a''/20 = -10 + 20 tau: at rest tau is 0.5 N.m, and a may carry up to 0.7 N.m
    share = 1 / 0.4 if drive > 0 else -0.4
    if -0.2 < drive <= 1.25:
        assert found["a"] == pytest.approx(0, abs=1e-12)
        assert found["stuck"].all()
        return
    tau = (drive / 0.1 + 100) / (200 + share / 0.1)
    assert found["a"][-1] == pytest.approx((drive - share * tau) / 0.1 / 2, rel=1e-8)


# ---------------------------------------------------------------- freewheels

FREEWHEEL = """
coordinate Angle a = 0 rad;
coordinate Angle b = 0 rad;
kinetic 1/2*1 kg.m^2*der(a)^2 + 1/2*2 kg.m^2*der(b)^2;
force 3 N.m*sin(1 rad/s*time) on a;
damping 0.5 N.m.s on b;
friction lock: SIDES;
output torque = multiplier(lock);
output locked = closed(lock);
experiment(stop = 20 s, tolerance = 1e-11);
"""


def freewheel(drag: float, static: float) -> tuple[Callable[[float], np.ndarray], list[tuple[float, int]]]:
    """b may run ahead of a against the drag, and is never slower."""

    def rates(m: int, t: float, y: np.ndarray) -> np.ndarray:
        push = 3 * math.sin(t)
        if m == STUCK:
            both = (push - 0.5 * y[3]) / 3
            return np.array([y[2], y[3], both, both])
        return np.array([y[2], y[3], push + drag, (-drag - 0.5 * y[3]) / 2])

    def held(t: float, y: np.ndarray) -> tuple[float, float, float]:
        push = 3 * math.sin(t)
        return 2 * (push - 0.5 * y[3]) / 3 + 0.5 * y[3], -static, math.inf

    return machine(rates, lambda y: float(y[3] - y[2]), held, [0, 0, 0, 0], 20.0, STUCK)


@pytest.mark.parametrize(
    ("sides", "sign", "drag", "static"),
    [
        ("forward 0 N.m backward infinite on b - a", 1, 0.0, 0.0),
        ("forward infinite backward 0 N.m on a - b", -1, 0.0, 0.0),
        ("forward 0.2 N.m backward infinite static forward 0.3 N.m backward infinite on b - a", 1, 0.2, 0.3),
        ("forward infinite backward 0.2 N.m static forward infinite backward 0.3 N.m on a - b", -1, 0.2, 0.3),
    ],
)
def test_a_hub_drives_a_wheel_that_may_run_ahead(sides: str, sign: int, drag: float, static: float) -> None:
    state, changes = freewheel(drag, static)
    solution = mechc.loads(FREEWHEEL.replace("SIDES", sides)).simulate(estimate_error=False)
    events = [e for e in solution.events if e.name == "lock"]
    assert len(changes) > 4
    assert [e.kind for e in events] == ["stick" if m == STUCK else "slip" for _, m in changes[1:]]
    assert [e.time for e in events] == pytest.approx([t for t, _ in changes[1:]], abs=1e-8)
    for time in np.linspace(0.1, 19.9, 50):
        mine, y = solution(time), state(time)
        mode = [m for t, m in changes if t <= time][-1]
        assert [mine[n] for n in ("a", "b", "der(a)", "der(b)")] == pytest.approx(y, abs=1e-8)
        assert mine["locked"] == (mode == STUCK)
        force = 2 * (3 * math.sin(time) - 0.5 * y[3]) / 3 + 0.5 * y[3] if mode == STUCK else -drag
        assert mine["torque"] == pytest.approx(sign * force, abs=1e-7)
    total = solution["energy.total"] + solution["energy.dissipated"] - solution["energy.supplied"]
    assert np.ptp(total) < 1e-8


def test_it_takes_part_in_an_impact() -> None:
    """A hub that is stopped by a buffer leaves its wheel running; one that is thrown forwards takes it along at once."""
    text = (
        "coordinate Angle a = 0 rad; coordinate Angle b = 0 rad; initial der(a) = W; initial der(b) = W;\n"
        "kinetic 1/2*1 kg.m^2*der(a)^2 + 1/2*2 kg.m^2*der(b)^2; friction lock: forward 0 N.m backward infinite on b - a;\n"
        "contact buffer: GAP restitution 0.5; experiment(stop = 2 s);"
    )
    stopped = mechc.loads(text.replace("W", "1 rad/s").replace("GAP", "1 rad - a")).simulate(
        estimate_error=False
    )
    assert (stopped(1.5)["der(a)"], stopped(1.5)["der(b)"]) == pytest.approx((-0.5, 1.0), abs=1e-9)
    thrown = mechc.loads(text.replace("W", "-1 rad/s").replace("GAP", "1 rad + a")).simulate(
        estimate_error=False
    )
    # the hub rebounds with 0.5 rad/s, and both go on with what momentum they have, in turn until nothing approaches
    after = thrown(1.5)
    assert after["der(b)"] >= after["der(a)"] - 1e-9
    assert after["der(b)"] == pytest.approx(after["der(a)"], abs=1e-9)


def test_a_start_that_breaks_it_is_an_impact() -> None:
    text = (
        FREEWHEEL.replace("SIDES", "forward 0 N.m backward infinite on b - a") + "initial der(a) = 3 rad/s;"
    )
    solution = mechc.loads(text).simulate(estimate_error=False)
    assert solution.time[0] == 0
    assert (solution(1e-9)["der(a)"], solution(1e-9)["der(b)"]) == pytest.approx((1, 1), abs=1e-6)
    assert solution["energy.dissipated"][1] == pytest.approx(4.5 - 1.5, rel=1e-3)


def test_small_motions_of_what_is_locked() -> None:
    model = mechc.loads(
        "coordinate Angle a = 0 rad; coordinate Angle b = 0 rad; kinetic 1/2*1 kg.m^2*der(a)^2 + 1/2*2 kg.m^2*der(b)^2;\n"
        "potential 1/2*12 N.m*b^2; force 5 N.m on a; potential 5 N.m*b; friction lock: forward 0 N.m backward infinite on b - a;"
    )
    assert "'lock' sticks" in str(model.modes())


# ---------------------------------------------------------------- wrong models


@pytest.mark.parametrize(
    ("statement", "code"),
    [
        ("friction f: forward infinite backward infinite on x;", "E0725"),
        ("friction f: infinite on x;", "E0725"),
        (
            "friction f: forward 1 N backward infinite static forward infinite backward infinite on x;",
            "E0725",
        ),
        ("friction f: forward 1 N backward infinite static forward 2 N backward 3 N on x;", "E0725"),
        ('friction f: forward 1 N backward infinite on x, law = "regularized", v_stick = 1 mm/s;', "E0725"),
        ("friction f: forward 1 N backward -2 N on x;", "E0706"),
        ("friction f: forward 1 N backward 2 N static forward 2 N backward 1 N on x;", "E0706"),
        ("friction f: forward 1 N backward 2 N.m on x;", "E0322"),
        ("friction f: forward 1 N on x;", "E0110"),
        ("friction f: backward 1 N forward 2 N on x;", "E0110"),
        ("friction f: forward 1 N backward 2 N static 3 N on x;", "E0110"),
        ("friction f: forward 1 N backward infinite on x; when initial() then release f; end when;", "E0212"),
    ],
)
def test_wrong_models(statement: str, code: str) -> None:
    caught = refused("coordinate Length x = 0 m; kinetic 1/2*1 kg*der(x)^2;\n" + statement)
    assert caught[0].code == code, caught[0].message


def test_a_name_may_be_infinite() -> None:
    text = "parameter infinite = 2 N; coordinate Length x = 0 m; kinetic 1/2*1 kg*der(x)^2; force 3 N on x; friction f: infinite on x; experiment(stop = 1 s);"
    assert mechc.loads(text).simulate(estimate_error=False)["x"][-1] == pytest.approx(0.5, rel=1e-9)


def test_the_formatter_keeps_both_sides(tmp_path: object) -> None:
    from pathlib import Path

    from mechc.cli.main import run

    text = "friction f[1]: forward 1 N backward infinite static forward 2 N backward infinite on x;\nfriction forward a backward b on x;\n"
    file = Path(str(tmp_path)) / "m.mech"
    file.write_text(text)
    assert run(["fmt", str(file)]) == 0
    assert file.read_text() == text


# ---------------------------------------------------------------- limits that ask which way it slips

AS_WRITTEN = """
friction teeth: (if tau*der(a) < 0 W then 1 - eta else 1/eta - 1)*abs(tau)
  static (if (10 N.m*sin(2*pi*time/1 s) - tau)*tau < 0 N^2.m^2 then 1 - eta else 1/eta - 1)*abs(tau) on a;
"""


def test_a_limit_by_the_direction_of_its_own_slip_has_two_sides() -> None:
    """The gear of above as one would write it with one limit: at rest the sign of the slip is that of the slip that would begin."""
    begin = GEAR.index("friction teeth")
    text = GEAR[:begin] + AS_WRITTEN + GEAR[GEAR.index("output through") :]
    one, two = (mechc.loads(t).simulate(estimate_error=False) for t in (text, GEAR))
    assert [e.time for e in one.events] == pytest.approx([e.time for e in two.events], abs=1e-9)
    assert one["a"][-1] == pytest.approx(two["a"][-1], abs=1e-10)
    assert one["loss"][-1] == pytest.approx(two["loss"][-1], abs=1e-9)


@pytest.mark.parametrize(
    "limit", ["if der(x) - der(y) > 0 then 1 else 0.4", "0.7 + 0.3*sign(der(x) - der(y))", "if der(y) >= der(x) then 0.4 else 1"]
)  # fmt: skip
def test_signs_of_a_slip_between_two_masses(limit: str) -> None:
    head = "dimensionless; coordinate x = 0; coordinate y = 0; kinetic 1/2*(der(x)^2 + der(y)^2); force 1.9*sin(time) on x;"
    end = "output F = multiplier(f); experiment(stop = 10);"
    one = mechc.loads(f"{head} friction f: {limit} on x - y; {end}").simulate(estimate_error=False)
    two = mechc.loads(f"{head} friction f: forward 1 backward 0.4 on x - y; {end}").simulate(
        estimate_error=False
    )
    assert len(two.events) > 2
    times = np.linspace(0, 10, 41)
    assert np.abs(one(times)["x"] - two(times)["x"]).max() < 1e-9
    assert np.abs(one(times)["F"] - two(times)["F"]).max() < 1e-9
