"""Dry friction: blocks on inclines, belts and springs, pendulums and hoops (U18-U23, U30 a, closed forms)."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from gallery import Array, check_estimate, load, run, values
from happenings import follow, integrate, times, travel_time, turning_point
from mpmath import cos
from scipy.optimize import brentq

import mechc

g = 9.81


def pull(slope: float, mu: float) -> float:
    """Acceleration up a slope of a block that slides down."""
    return -g * (math.sin(slope) - mu * math.cos(slope))


# ---------------------------------------------------------------- inclines


def test_thrown_up_an_incline() -> None:
    """U23: 10 m/s, 45 degrees, mu = 0.1: the printed numbers, and the closed forms."""
    solution = follow("block_on_incline")
    up, down = g * math.sin(math.pi / 4) * 1.1, g * math.sin(math.pi / 4) * 0.9
    top = 100 / (2 * up)
    assert top == pytest.approx(6.552746, abs=5e-7)
    turned, back = times(solution, "when")
    assert turned == pytest.approx(10 / up, rel=1e-10)
    assert back - turned == pytest.approx(math.sqrt(2 * top / down), rel=1e-10)
    assert solution["top"][-1] == pytest.approx(top, rel=1e-10)
    assert -solution["der(s)"][-1] == pytest.approx(10 * math.sqrt(0.9 / 1.1), rel=1e-10)
    assert solution["top"][-1] == pytest.approx(6.552746, abs=5e-7)
    assert -solution["der(s)"][-1] == pytest.approx(9.0453403, abs=5e-8)
    assert [turned, back - turned] == pytest.approx([1.310549, 1.448867], abs=5e-7)
    assert solution["energy.dissipated"][-1] == pytest.approx(2 * 0.1 * g * math.cos(math.pi / 4) * top)
    assert solution.message.startswith("back at the start")


def test_block_between_the_two_angles_of_friction() -> None:
    """U18: between atan(mu_k) and atan(mu_s) a block that rests stays, one that slides goes on."""
    assert math.atan(0.3) < math.radians(20) < math.atan(0.4) < math.radians(25)
    stays = follow("block_on_incline", "stays")
    assert not stays.events
    assert np.all(stays["s"] == 0)
    slides = follow("block_on_incline", "slides")
    assert slides["s"][-1] == pytest.approx(3 - 1 + pull(math.radians(20), 0.3) / 2, rel=1e-10)
    slips = follow("block_on_incline", "slips")
    assert slips["s"][-1] == pytest.approx(1 + pull(math.radians(25), 0.3) / 2, rel=1e-10)


def test_angles_at_which_a_block_starts_and_slows_down() -> None:
    """U18: it starts at atan(mu_s), and loses speed below atan(mu_k), gains it above; a slope is off by 1e-6."""
    start = math.atan(0.4)
    stays, starts = (
        follow("block_on_incline", "stays", set={"slope": start + off, "s": 1.0}, stop=1.0)
        for off in (-1e-6, 1e-6)
    )
    assert np.all(stays["s"] == 1)
    assert starts["s"][-1] == pytest.approx(1 + pull(start + 1e-6, 0.3) / 2, rel=1e-10)
    for off in (-1e-6, 1e-6):
        slope = math.atan(0.3) + off
        solution = follow("block_on_incline", "slides", set={"slope": slope})
        assert not solution.events
        gained = -solution["der(s)"][-1] - 1
        assert gained == pytest.approx(-pull(slope, 0.3), rel=1e-6)
        assert gained * off > 0
    flat = math.radians(10)
    stopped = follow("block_on_incline", "slides", set={"slope": flat})
    assert times(stopped, "stick") == pytest.approx([1 / pull(flat, 0.3)], rel=1e-10)
    assert stopped["s"][-1] == pytest.approx(3 - 1 / (2 * pull(flat, 0.3)), rel=1e-10)


def test_coefficient_from_the_stopping_distance() -> None:
    """U22: down 30 degrees, 1 m/s, stops after 1 m: mu_k = 0.636204, and then it stays."""
    slope = math.pi / 6
    mu = math.tan(slope) + 1 / (2 * g * math.cos(slope))
    assert mu == pytest.approx(0.636204, abs=5e-7)
    assert math.degrees(math.atan(mu)) == pytest.approx(32.4647, abs=5e-5)
    solution = follow("block_on_incline", "stops", set={"mu_k": mu, "mu_s": mu})
    assert times(solution, "stick") == pytest.approx([2], rel=1e-10)
    assert solution["s"][-1] == pytest.approx(1, rel=1e-10)


def test_plane_tilted_until_the_block_slides() -> None:
    """U21: a = g (mu_s - mu_k)/sqrt(1 + mu_s^2); the plane is held 1e-9 rad beyond, which changes a by 2e-8."""
    solution = follow("tilted_plane")
    (slip,) = times(solution, "slip")
    assert slip == pytest.approx(math.atan(0.5) / 0.1, rel=1e-10)
    a = g * (0.5 - 0.4) / math.sqrt(1 + 0.5**2)
    assert solution["s"][-1] == pytest.approx(a * (10 - slip) ** 2 / 2, rel=3e-8)


def test_sliding_block_stops() -> None:
    """U30 a: v^2/(2 mu g), by the friction of a contact."""
    solution = follow("sliding_block")
    assert times(solution, "stick") == pytest.approx([3 / (0.3 * g)], rel=1e-10)
    assert solution["x"][-1] == pytest.approx(9 / (2 * 0.3 * g), rel=1e-10)
    assert solution["energy.dissipated"][-1] == pytest.approx(9, rel=1e-10)
    assert np.all(np.abs(solution["support"] - 2 * g) < 1e-10)


# ---------------------------------------------------------------- belts


@pytest.mark.parametrize(
    ("experiment", "fk", "fs", "u", "period"),
    [
        (None, 1.962, 2.943, 1.962, 6.3558901),
        ("slow", 1.962, 3.924, 0.981, 8.0688879),
        ("textbook", 0.5, 1.0, 0.2, 8.90260540781450),
    ],
)
def test_stick_slip_on_a_belt(experiment: str | None, fk: float, fs: float, u: float, period: float) -> None:
    """U19: slips at y0 = fs/fk, sticks at 2 - y0; period 2 (y0 - 1)/s0 + 2 pi - 2 atan((y0 - 1)/s0)."""
    solution = follow("stick_slip_belt", experiment)
    slips, sticks = times(solution, "slip"), times(solution, "stick")
    assert len(sticks) > 2 and len(slips) > 2
    assert slips[0] == pytest.approx(fs / u, rel=1e-10)
    y0, s0 = fs / fk, u / fk
    found = 2 * (y0 - 1) / s0 + 2 * math.pi - 2 * math.atan((y0 - 1) / s0)
    assert found == pytest.approx(period, abs=5e-8)
    assert np.diff(slips) == pytest.approx(found, rel=1e-10)
    assert np.diff(sticks) == pytest.approx(found, rel=1e-10)
    end = solution.final()
    assert [end[name] for name in ("slips_at", "sticks_at", "cycle")] == pytest.approx(
        [y0, 2 - y0, found], abs=1e-8
    )
    for t in sticks:
        assert solution(t)["y"] == pytest.approx(2 - y0, abs=1e-9)
    for slip, stick in zip(slips, sticks, strict=False):
        assert [solution(slip)[name] for name in ("s", "y")] == pytest.approx([s0, y0], abs=1e-9)
        on = solution(np.linspace(slip, stick, 20)[1:-1])
        circle = np.hypot(on["s"], on["y"] - 1)
        assert circle == pytest.approx(np.full(18, math.hypot(s0, y0 - 1)), rel=1e-9)


def test_stick_slip_of_another_mass_and_spring() -> None:
    """U19: m v^2/2 + k (x - fk/k)^2/2 stays while it slips from x = fs/k on; the period counts in sqrt(m/k)."""
    m, k, fk, fs, u = 2.0, 3.0, 1.962, 2.943, 1.962
    solution = follow("stick_slip_belt", set={"m": m, "k": k})
    slips, sticks = times(solution, "slip"), times(solution, "stick")
    assert solution(slips[0])["x"] == pytest.approx(fs / k, rel=1e-10)
    level = m * u**2 / 2 + k * (fs / k - fk / k) ** 2 / 2
    on = solution(np.linspace(slips[0], sticks[0], 20)[1:-1])
    assert m * on["der(x)"] ** 2 / 2 + k * (on["x"] - fk / k) ** 2 / 2 == pytest.approx(level, rel=1e-9)
    s0, y0 = u / fk * math.sqrt(m * k), fs / fk
    assert [solution(slips[1])[name] for name in ("s", "y")] == pytest.approx([s0, y0], rel=1e-9)
    period = 2 * (y0 - 1) / s0 + 2 * math.pi - 2 * math.atan((y0 - 1) / s0)
    assert np.diff(slips) == pytest.approx(math.sqrt(m / k) * period, rel=1e-10)


@pytest.mark.parametrize(
    ("experiment", "fk", "fs", "u"),
    [(None, 1.962, 2.943, 1.962), ("slow", 1.962, 3.924, 0.981), ("textbook", 0.5, 1.0, 0.2)],
)
def test_estimated_error_behind_many_events(experiment: str | None, fk: float, fs: float, u: float) -> None:
    """The place at the end is known: so many cycles after the first slip, carried by the belt or on a circle."""
    slipping = 2 * math.pi - 2 * math.atan((fs - fk) / u)
    phase = (40 - fs / u) % (slipping + 2 * (fs - fk) / u)
    x = fk + (fs - fk) * math.cos(phase) + u * math.sin(phase)
    v = -(fs - fk) * math.sin(phase) + u * math.cos(phase)
    if phase > slipping:
        x, v = 2 * fk - fs + u * (phase - slipping), u
    solution = run("stick_slip_belt", experiment, tolerance=1e-8)
    assert solution["x"][-1] == pytest.approx(x, abs=100 * 1e-8)
    check_estimate(solution, {"x": x, "der(x)": v})


def test_belt_of_the_reference() -> None:
    known = values("classical_closed_form_set", "escape/slip")
    solution = follow("stick_slip_belt", "textbook")
    slips, sticks = times(solution, "slip"), times(solution, "stick")
    assert sticks[0] - slips[0] == pytest.approx(known["slip_duration"], rel=1e-10)
    assert slips[1] - sticks[0] == pytest.approx(known["stick_duration"], rel=1e-10)
    assert solution(sticks[0])["x"] == pytest.approx(known["x_at_restick"], abs=1e-10)


def spiral(x0: float, v0: float, damping: float) -> Any:
    """Displacement and rate about f0/k of x'' + damping x' + x = 0."""
    w = math.sqrt(1 - damping**2 / 4)

    def at(t: float) -> tuple[float, float]:
        b = (v0 + damping / 2 * x0) / w
        c, s, decay = math.cos(w * t), math.sin(w * t), math.exp(-damping / 2 * t)
        x = decay * (x0 * c + b * s)
        return x, -damping / 2 * x + decay * w * (b * c - x0 * s)

    return at


def test_friction_that_falls_with_the_speed() -> None:
    """U20: mu' < 0 makes the rest on the belt a growing spiral, which ends in sticking and slipping."""
    solution = follow("belt_with_rosin")
    first = spiral(0.1, 0, -0.2)
    t = brentq(lambda t: first(t)[1] - 1, 22, 23.6, xtol=1e-14)
    sticks, slips = times(solution, "stick"), times(solution, "slip")
    assert sticks[0] == pytest.approx(t, rel=1e-10)
    # it is carried to k x = f0 + 0.2 N, and goes round from there
    slip = t + (2.2 - 2 - first(t)[0])
    assert slips[0] == pytest.approx(slip, rel=1e-10)
    cycle = spiral(0.2, 1, -0.2)
    slipping = brentq(lambda t: cycle(t)[1] - 1, 3, 6.2, xtol=1e-14)
    period = slipping + 0.2 - cycle(slipping)[0]
    assert len(slips) > 4
    assert np.diff(slips) == pytest.approx(period, rel=1e-10)


@pytest.mark.parametrize(("changed", "damping"), [({"c": 0.3}, 0.1), ({"slope": 0.0}, 0.0)])
def test_rest_on_the_belt_is_stable(changed: dict[str, float], damping: float) -> None:
    """With a little damping more than friction loses; a centre where friction does not depend on the speed."""
    solution = follow("belt_with_rosin", set=changed)
    assert not solution.events
    at = spiral(0.1, 0, damping)
    assert solution["x"] - 2 == pytest.approx(np.array([at(t)[0] for t in solution.time]), abs=1e-10)


def test_where_a_block_rests_on_the_belt() -> None:
    """U20: v = 0 at x = f0/k, as the friction at the speed of the belt holds the spring."""
    solution = follow("belt_with_rosin", set={"k": 4.0, "x": 0.5})
    assert not solution.events
    assert np.ptp(solution["x"]) < 1e-12
    (rest,) = load("belt_with_rosin").equilibria(set={"k": 4.0}).summary()["equilibria"]
    assert rest["values"]["x"] == pytest.approx(0.5, rel=1e-12) and rest["stable"] is False


# ---------------------------------------------------------------- springs and pendulums


def test_coulomb_block() -> None:
    """Half periods of pi; the amplitude falls by 2 f/k in each, until it sticks at 5 pi."""
    known = values("classical_closed_form_set", "stick-slip / Coulomb block")
    solution = follow("coulomb_block")
    turns = times(solution, "slip")
    assert turns == pytest.approx([k * math.pi for k in range(1, 5)], rel=1e-10)
    names = ["x_after_1_half_cycle", "x_after_2", "x_after_3", "x_after_4"]
    assert [solution(t)["x"] for t in turns] == pytest.approx([known[n] for n in names], rel=1e-10)
    assert times(solution, "stick") == pytest.approx([known["t_rest"]], rel=1e-10)
    assert solution["x"][-1] == pytest.approx(known["x_rest"], abs=1e-10)
    assert solution["energy.dissipated"][-1] == pytest.approx(0.5, rel=1e-10)


def test_pendulum_with_dry_friction() -> None:
    """Turns where the potential has fallen by friction times way; sticks where f > m g l sin(theta)."""
    f, t = 0.7, 0.0
    at, turned = [2.0], []
    while g * abs(math.sin(at[-1])) > f:
        start = at[-1]
        side = math.copysign(1, start)

        def squared(x: Any, start: float = start, side: float = side) -> Any:
            return 2 * (g * (cos(x) - cos(start)) - f * side * (start - x))

        # fastest where gravity equals friction
        at.append(turning_point(squared, side * math.asin(f / g), -start))
        t += travel_time(squared, start, at[-1])
        turned.append(float(t))
    solution = follow("coulomb_pendulum")
    found = times(solution, "slip") + times(solution, "stick")
    assert len(found) > 5
    assert found == pytest.approx(turned, rel=1e-10)
    assert [solution(t)["theta"] for t in found] == pytest.approx([float(x) for x in at[1:]], rel=1e-9)
    assert solution["theta"][-1] == pytest.approx(float(at[-1]), rel=1e-9)


def test_bead_on_a_rough_hoop() -> None:
    """Against the equation written by hand: m R theta'' = gravity and turning - mu |N| sign(theta')."""
    w, mu = 4.5, 0.1

    def forces(y: Array) -> tuple[float, float]:
        s, c = math.sin(y[0]), math.cos(y[0])
        normal = math.hypot(y[1] ** 2 + w**2 * s**2 + g * c, 2 * w * c * y[1])
        return w**2 * s * c - g * s, mu * normal

    side = -1.0 if forces(np.array([2.5, 0.0]))[0] < 0 else 1.0
    t, y, found, stuck = 0.0, np.array([2.5, 0.0]), [], False
    while not stuck:

        def rhs(t: float, y: Array, side: float = side) -> list[float]:
            drive, friction = forces(y)
            return [y[1], drive - side * friction]

        def forwards(t: float, y: Array, side: float = side) -> float:
            return float(side * y[1])

        t, y, _ = integrate(rhs, y, t, 20, forwards)
        found.append(t)
        y[1] = 0.0
        drive, friction = forces(y)
        stuck = abs(drive) <= friction
        side = math.copysign(1, drive)
    solution = follow("bead_on_rough_hoop")
    assert times(solution, "slip") + times(solution, "stick") == pytest.approx(found, rel=1e-10)
    assert solution["theta"][-1] == pytest.approx(y[0], rel=1e-9)
    assert all(a < b for a, b in pairwise(found))


# ---------------------------------------------------------------- rolling and clutches


@pytest.mark.parametrize(("experiment", "spin"), [(None, 0.0), ("back_spin", 200.0)])
def test_bowling_ball_begins_to_roll(experiment: str | None, spin: float) -> None:
    """Rolls after 2 u/(7 mu g), u the speed of sliding, with (5 v - 2 R w)/7: with back spin it comes back."""
    v, R, mu = 8.0, 0.11, 0.2
    solution = follow("bowling_ball", experiment)
    t, end = 2 * (v + R * spin) / (7 * mu * g), (5 * v - 2 * R * spin) / 7
    assert times(solution, "stick") == pytest.approx([t], rel=1e-10)
    assert solution["der(x)"][-1] == pytest.approx(end, rel=1e-10)
    assert solution["rim"][-1] == pytest.approx(end, rel=1e-10)
    stop = solution.time[-1]
    assert solution["x"][-1] == pytest.approx(v * t - mu * g * t**2 / 2 + end * (stop - t), rel=1e-10)
    # the heat is that of the relative motion: the reduced mass is 2/7 m
    assert solution["energy.dissipated"][-1] == pytest.approx(7 * (v + R * spin) ** 2 / 7, rel=1e-10)


def test_masse_shot() -> None:
    """G. G. Coriolis (1835): the direction of sliding stays, so the way is a parabola; rolls with v - 2/7 u."""
    r, mu = 0.0305, 0.2
    v, u = np.array([2.0, 0.0]), np.array([2.0 + r * 80, r * 60])  # vel + spin x (0, 0, -r)
    slips = math.hypot(*u)
    t, push = 2 * slips / (7 * mu * g), mu * g * u / slips
    solution = follow("masse_shot")
    assert times(solution, "stick") == pytest.approx([t], rel=1e-10)
    for at in (0.3 * t, 0.9 * t):
        found = solution(at)
        assert [found["x"], found["y"]] == pytest.approx(v * at - push * at**2 / 2, rel=1e-9)
        assert found["slip_y"] / found["slip_x"] == pytest.approx(u[1] / u[0], rel=1e-9)
    end = v - 2 / 7 * u
    assert [solution["der(x)"][-1], solution["der(y)"][-1]] == pytest.approx(end, rel=1e-9)
    place = v * t - push * t**2 / 2 + end * (1.5 - t)
    assert [solution["x"][-1], solution["y"][-1]] == pytest.approx(place, rel=1e-9)
    assert solution["energy.dissipated"][-1] == pytest.approx(0.2 * slips**2 / 7, rel=1e-9)


def test_cylinder_rolls_up_to_three_mu() -> None:
    """U126: (2/3) g sin(slope) while it rolls; beyond, g (sin - mu cos), and it turns at 2 mu g cos/R."""
    R, mu = 0.05, 0.2
    assert math.tan(math.radians(30)) < 3 * mu < math.tan(math.radians(32))
    rolls, slides = follow("slide_or_roll"), follow("slide_or_roll", "steep")
    assert rolls["der(s)"][-1] == pytest.approx(2 / 3 * g * math.sin(math.radians(30)), rel=1e-10)
    assert rolls["der(s)"] + R * rolls["der(a)"] == pytest.approx(0, abs=1e-12)
    assert rolls["energy.dissipated"][-1] == pytest.approx(0, abs=1e-12)
    slope = math.radians(32)
    assert slides["der(s)"][-1] == pytest.approx(-pull(slope, mu), rel=1e-10)
    assert -slides["der(a)"][-1] == pytest.approx(2 * mu * g * math.cos(slope) / R, rel=1e-10)


def test_clutch_sticks_and_slips_again() -> None:
    """Equal speeds after w/(f/J1 + f/J2); holds until the share J2/(J1 + J2) of the motor exceeds the hold."""
    solution = follow("clutch")
    assert times(solution, "stick") == pytest.approx([5 / (6 / 2 + 6 / 3)], rel=1e-10)
    slips = 2 + 9 / 4 * (2 + 3) / 3
    assert times(solution, "slip") == pytest.approx([slips], rel=1e-10)
    assert solution(1.5)["der(a)"] == pytest.approx(2, rel=1e-10) == solution(1.5)["der(b)"]
    assert solution(1.5)["energy.dissipated"] == pytest.approx(2 * 3 / (2 + 3) * 5**2 / 2, rel=1e-10)
    # slipping: 3 b'' = 6 N.m, 2 a'' = 4 (t - 2) - 6
    common = 2 + 4 * (slips - 2) ** 2 / 2 / 5
    late = 8 - slips
    assert solution["der(b)"][-1] == pytest.approx(common + 2 * late, rel=1e-10)
    gained = (4 * (6**2 - (slips - 2) ** 2) / 2 - 6 * late) / 2
    assert solution["der(a)"][-1] == pytest.approx(common + gained, rel=1e-10)


def test_a_piston_near_its_dead_centre_slides_on() -> None:
    """Where no force moves the slip, rounding decides the sign of what an impulse does: the friction slides as it did.

    The crank turns at 125 rad/s past its dead centre, at a bank of 45 deg; 5 N brake the piston.
    """
    model = mechc.loads("""
    import mech.planar.*;
    model Engine
      parameter start = 225 deg;
      gravity {0, -9.81} m/s^2;
      Body crank(m = 8 kg, J = 0.05 kg.m^2);
      Revolute main(world -> crank.a, angle = start, der(angle) = 125 rad/s);
      Bar rod(m = 0.6 kg, l = 14 cm);
      Particle piston(m = 0.5 kg);
      frame pin = crank.a * trans({40 mm, 0 m});
      frame block = world * rot(45 deg);
      Revolute big(pin -> rod.a, angle ~ 180 deg);
      Prismatic bore(block -> piston.a, axis = {1, 0}, position ~ 0.1 m);
      cut Revolute small(piston.a -> rod.b);
      friction skirt: 5 N on bore.position;
    end Engine;
    """)
    dead = np.deg2rad(225)
    for off in (*np.linspace(-1e-7, 1e-7, 40), *np.linspace(-1e-9, 1e-9, 41)):
        solution = model.simulate(stop=1e-4, set={"start": dead + off}, estimate_error=False)
        assert solution.outcome.value == "completed", (off, solution.message)
