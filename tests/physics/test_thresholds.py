"""Steps of the potential, laws that hold in a region, times to a threshold (U27, U29, U69, U73, U111)."""

from __future__ import annotations

import math
from typing import Any

import mpmath
import numpy as np
import pytest
from gallery import run, values
from happenings import follow, times
from mpmath import mp

import mechc

g = 9.81


def test_refraction_at_a_step() -> None:
    """U69: v2^2 = v1^2 + 2 (U1 - U2)/m, sin(a2) = v1/v2 sin(a1)."""
    solution = follow("potential_step")
    assert times(solution, "crossing") == pytest.approx([math.sqrt(2)], rel=1e-10)
    v2 = math.sqrt(1 + 2)
    assert math.sin(solution["direction"][-1]) == pytest.approx(math.sqrt(0.5) / v2, rel=1e-12)
    assert math.hypot(solution["der(x)"][-1], solution["der(y)"][-1]) == pytest.approx(v2, rel=1e-12)


def test_refraction_of_another_mass_between_other_levels() -> None:
    """U69: m = 2, U1 - U2 = 0.7, v1 = 1.3, 30 degrees."""
    solution = follow(
        "potential_step", set={"m": 2.0, "U1": 0.3, "U2": -0.4, "v1": 1.3, "angle": math.radians(30)}
    )
    v2 = math.sqrt(1.3**2 + 2 * 0.7 / 2)
    assert math.hypot(solution["der(x)"][-1], solution["der(y)"][-1]) == pytest.approx(v2, rel=1e-12)
    assert math.sin(solution["direction"][-1]) == pytest.approx(1.3 / v2 / 2, rel=1e-12)


def test_reflection_at_a_step() -> None:
    """The motion across the step has m/2 v^2 cos(a)^2 = 1/4 J, less than the step: it is thrown back."""
    solution = follow("potential_step", "reflected")
    assert times(solution, "reflection") == pytest.approx([math.sqrt(2)], rel=1e-10)
    assert solution["der(y)"][-1] == pytest.approx(math.sqrt(0.5), rel=1e-12)
    assert np.min(solution["y"]) > -1e-12


@pytest.mark.parametrize(("U2", "kind"), [(0.2499, "crossing"), (0.2501, "reflection")])
def test_limit_of_reflection(U2: float, kind: str) -> None:
    assert times(follow("potential_step", set={"U2": U2}), kind) == pytest.approx([math.sqrt(2)], rel=1e-10)


def test_drag_below_a_step() -> None:
    """U73: refracted to tan(a) = 1/sqrt(5), 24.0948 degrees; the momentum carries it m v/gamma = (0.70710678, -1.5811388) far."""
    solution = follow("drag_in_region")
    (crossing,) = times(solution, "crossing")
    assert crossing == pytest.approx(math.sqrt(2), rel=1e-10)
    after = next(e for e in solution.events).after
    angle = math.atan2(math.sqrt(0.5), -after["der(y)"])
    assert solution(crossing)["der(x)"] == pytest.approx(math.sqrt(0.5), rel=1e-12)
    assert angle == pytest.approx(math.atan(1 / math.sqrt(5)), rel=1e-12)
    assert math.degrees(angle) == pytest.approx(24.0948, abs=5e-5)
    assert after["der(y)"] == pytest.approx(-math.sqrt(2.5), rel=1e-12)
    left = math.exp(-(30 - crossing))
    place = 1 / math.sqrt(2) - 1 + crossing / math.sqrt(2)
    assert solution["x"][-1] == pytest.approx(place - left / math.sqrt(2), abs=1e-10)
    assert solution["y"][-1] == pytest.approx(-math.sqrt(2.5) * (1 - left), abs=1e-10)
    assert (solution["x"][-1], solution["y"][-1]) == pytest.approx((0.70710678, -1.5811388), abs=6e-8)


def test_a_step_upwards_keeps_it_out_of_the_drag() -> None:
    """U73: with U = +1 it is thrown back."""
    solution = follow("drag_in_region", set={"U": 1.0}, stop=5)
    assert times(solution, "reflection") == pytest.approx([math.sqrt(2)], rel=1e-10)
    assert solution["der(y)"][-1] == pytest.approx(math.sqrt(0.5), rel=1e-12)


def test_two_masses_fall_together() -> None:
    """U111: r = r0 (1 + cos(n))/2 at t = sqrt(r0^3/(8 G M)) (n + sin(n)); the whole fall takes n = pi."""
    solution = follow("collapse")
    M, r0 = 6.674e-11 * (2e30 + 6e24), 1.5e11
    with mpmath.workdps(30):
        n = mpmath.acos(2 * mp.mpf(10) ** -6 - 1)
        t = float(mpmath.sqrt(mp.mpf(r0) ** 3 / (8 * mp.mpf(M))) * (n + mpmath.sin(n)))
    assert solution.time[-1] == pytest.approx(t, rel=1e-10)
    whole = math.pi / (2 * math.sqrt(2)) * math.sqrt(r0**3 / M)
    assert math.pi / (2 * math.sqrt(2)) == pytest.approx(1.1107207, abs=5e-8)
    assert whole - solution.time[-1] == pytest.approx(2 / 3 * 1e-9 * math.sqrt(r0**3 / (2 * M)), rel=1e-3)


@pytest.mark.parametrize(
    ("experiment", "gravity", "printed", "printed_speed"),
    [(None, 9.81, 28.16744, 39.39498), ("ten", 10.0, 27.89857, 39.77465)],
)
def test_drop_from_a_kilometre(
    experiment: str | None, gravity: float, printed: float, printed_speed: float
) -> None:
    """U27: t = vT/g acosh(exp(g h/vT^2)), v = vT sqrt(1 - exp(-2 g h/vT^2))."""
    solution = follow("drop_with_drag", experiment)
    square = gravity / (1.29 * 0.07**2)
    t = math.sqrt(square) / gravity * math.acosh(math.exp(1000 * gravity / square))
    assert t == pytest.approx(printed, abs=5e-6)
    assert solution.time[-1] == pytest.approx(t, rel=1e-10)
    v = math.sqrt(square * (1 - math.exp(-2000 * gravity / square)))
    assert -solution["der(h)"][-1] == pytest.approx(v, rel=1e-10)
    assert solution["terminal"][-1] == pytest.approx(math.sqrt(square), rel=1e-12)
    assert -solution["der(h)"][-1] == pytest.approx(printed_speed, abs=5e-6)
    if experiment is None:
        assert solution["terminal"][-1] == pytest.approx(39.39505, abs=5e-6)
    assert solution.message.startswith("on the ground")


@pytest.mark.parametrize(
    ("experiment", "m", "d", "printed_time", "printed_way"),
    [
        ("bubble", 1e-7, 1e-2, 0.010627624, 5.0621991e-4),
        ("drop", 0.5e-9, 1e-4, 0.021196811, 1.7867791e-3),
        (None, 0.6, 0.25, 1.1603213, 6.2960899),
    ],
)
def test_half_of_the_terminal_speed(
    experiment: str | None, m: float, d: float, printed_time: float, printed_way: float
) -> None:
    """U29: m v' = m g - A v - B v^2 by partial fractions, and the way by m v dv/(m g - A v - B v^2)."""
    A, B = 7.75 * 2e-5 * d, 0.17 * 1.29 * d * d
    root = math.sqrt(A * A + 4 * B * m * g)
    low, high = (-A - root) / (2 * B), (-A + root) / (2 * B)
    t = m / root * math.log((high / 2 - low) / -low * 2)

    def way(v: Any) -> Any:
        return m * v / (m * g - A * v - B * v * v)

    s = float(mpmath.quad(way, [0, high / 2]))
    assert t == pytest.approx(printed_time, rel=5e-8)
    assert s == pytest.approx(printed_way, rel=5e-8)
    solution = follow("half_speed", experiment)
    assert solution.time[-1] == pytest.approx(t, rel=1e-10)
    assert solution["y"][-1] == pytest.approx(s, rel=1e-9)


def test_chain_slides_off_a_table() -> None:
    known = values("classical_closed_form_set", "uniform chain L=1")
    solution = follow("chain_off_table")
    assert solution.time[-1] == pytest.approx(known["t_slide_off"], rel=1e-10)
    assert solution["der(x)"][-1] == pytest.approx(known["v_end"], rel=1e-10)
    assert run("chain_off_table").message.startswith("off the table")


def test_step_beside_a_law_that_changes_with_time() -> None:
    """The step takes 3/2 of the energy, whatever comes before it: 2 - 3/2 = 1/2 is left, less the work of the force."""
    model = mechc.loads("""model Step
  dimensionless;
  coordinate x = 1;
  kinetic 1/2*der(x)^2;
  potential (if time < 3 then 1 else 2)*x/1000;
  potential if x < 0 then 0 else -3/2;
  initial der(x) = -2;
  experiment(stop = 2);
end Step;
""")
    solution = model.simulate(tolerance=1e-11)
    left = 2 - 3 / 2 - (solution["x"][-1] - 1) / 1000
    assert solution["der(x)"][-1] ** 2 / 2 == pytest.approx(left, rel=1e-9)


NARROW = """
parameter c = 0.3 m;
parameter w = 1 mm;
coordinate Length x = 1 m;
kinetic 1/2*1 kg*der(x)^2;
potential 1/2*1 N/m*x^2;
discrete Integer n = 0;
when %s then
  n := n + 1;
end when;
"""


@pytest.mark.parametrize(
    "condition", ["abs(x - c) < w", "max(x - c, c - x) < w", "min(x - c + w, c + w - x) > 0 m"]
)
def test_a_narrow_region_with_a_kink_in_it_is_never_passed_over(condition: str) -> None:
    """Whichever way the steps fall, x = cos(t) enters the region twice in each period."""
    model = mechc.loads(NARROW % condition)
    rng = np.random.default_rng(1)
    for _ in range(25):
        c, w = float(rng.uniform(-0.9, 0.9)), 10 ** float(rng.uniform(-5, -2))
        stop, tolerance = float(rng.uniform(20, 40)), 10 ** float(rng.uniform(-10, -4))
        solution = model.simulate(set={"c": c, "w": w}, stop=stop, tolerance=tolerance, estimate_error=False)
        periods = 2 * math.pi * np.arange(8)
        entries = np.concatenate([periods + math.acos(c + w), 2 * math.pi + periods - math.acos(c - w)])
        assert solution["n"][-1] == np.count_nonzero(entries < stop), (c, w, stop, tolerance)


def test_a_narrow_region_of_what_has_no_known_rate() -> None:
    """The rate of an input is not known, so the distance to it is sampled only."""
    model = mechc.loads("input Length u = c;" + NARROW % "abs(x - u) < w")
    rng = np.random.default_rng(3)
    for _ in range(25):
        c, w, stop = (
            float(rng.uniform(-0.9, 0.9)),
            10 ** float(rng.uniform(-3, -1)),
            float(rng.uniform(20, 40)),
        )
        solution = model.simulate(set={"c": c, "w": w}, stop=stop, estimate_error=False)
        periods = 2 * math.pi * np.arange(8)
        entries = np.concatenate([periods + math.acos(c + w), 2 * math.pi + periods - math.acos(c - w)])
        assert solution["n"][-1] == np.count_nonzero(entries < stop), (c, w, stop)
