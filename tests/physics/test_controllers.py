"""Controllers with modes, limits and samples, against exact pieces and equations written by hand."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from gallery import Array
from happenings import follow, integrate, times

import mechc

g = 9.81


def test_jets_with_two_thresholds() -> None:
    """Between events a = a0 + v0 t + u t^2/2, so the thresholds of a + T v are met at roots of parabolas."""
    u, T, on, off = 0.1, 2.0, 0.05, 0.03
    t, a, v, jet, exact = 0.0, 0.5, 0.0, -1, []

    def wait(level: float, rising: int) -> float:
        """Until a + T a' passes the level in this sense."""
        half, slope, rest = jet * u / 2, v + T * jet * u, a + T * v - level
        roots = np.roots([half, slope, rest] if half else [slope, rest])
        ways = [
            float(r.real)
            for r in np.atleast_1d(roots)
            if abs(r.imag) < 1e-14 and r.real > 1e-12 and (slope + 2 * half * r.real) * rising > 0
        ]
        return min(ways, default=math.inf)

    while True:
        if jet:
            way, after = wait(-jet * off, jet), 0
        else:
            way, after = min((wait(on, 1), -1), (wait(-on, -1), 1))
        t, a, v = t + way, a + v * way + jet * u * way**2 / 2, v + jet * u * way
        jet = after
        if t > 120:
            break
        exact.append(t)
    solution = follow("relay_attitude")
    assert len(exact) > 25
    assert times(solution, "when") == pytest.approx(exact, rel=1e-10)
    # what the jets give and take is all the energy there is
    assert solution["energy.kinetic"] == pytest.approx(solution["energy.supplied"], abs=1e-12)


def test_cart_with_an_inverted_pendulum() -> None:
    """Bar on a cart, a lag of first order after a limited sum: each mode of the limit by itself."""
    M, m, l, lag, limit = 1.0, 0.2, 0.6, 0.02, 15.0

    def inertia(y: Array) -> Array:
        return np.array([[M + m, -m * l / 2 * math.sin(y[1])], [-m * l / 2 * math.sin(y[1]), m * l**2 / 3]])

    def wanted(y: Array) -> float:
        return float(-120 * (y[1] - math.pi / 2) - 25 * y[3] + 4 * y[0] + 8 * y[2])

    def rhs(mode: int) -> Callable[[float, Array], Array]:
        def f(t: float, y: Array) -> Array:
            force = [y[4] + m * l / 2 * math.cos(y[1]) * y[3] ** 2, -m * g * l / 2 * math.cos(y[1])]
            order = mode * limit if mode else wanted(y)
            return np.concatenate([y[2:4], np.linalg.solve(inertia(y), force), [(order - y[4]) / lag]])

        return f

    def room(mode: int) -> Callable[[float, Array], float]:
        return lambda t, y: (abs(wanted(y)) - limit) * (1 if mode else -1)

    y = np.array([0, math.pi / 2, 0, 0, 0])
    y[2:4] += np.linalg.solve(inertia(y), [0.08, -l * 0.08])
    t, mode, changes = 1.0, 1 if wanted(y) > limit else 0, []
    assert mode == 1
    while True:
        t, y, met = integrate(rhs(mode), y, t, 6, room(mode))
        if not met:
            break
        changes.append(t)
        mode = 0 if mode else (1 if wanted(y) > 0 else -1)
    solution = follow("cart_pendulum", tolerance=1e-11)
    found = times(solution, "when")
    assert found[:2] == [1, 1]
    assert found[2:] == pytest.approx(changes, rel=1e-10)
    assert [solution["rail.position"][-1], solution["pin.angle"][-1], solution["u"][-1]] == pytest.approx(
        [y[0], y[1], y[4]], abs=1e-9
    )
    assert np.min(solution["u"]) >= -limit and np.max(solution["u"]) <= limit


def test_controller_that_samples() -> None:
    """Between samples x' = v, v' = u - c v with constant u has an exact step; 500 of them."""
    Ts, c, kp, kd, ki, target = 0.01, 0.2, 40.0, 8.0, 20.0, 1.0
    x = v = u = total = last = 0.0
    decay, shown = math.exp(-c * Ts), []
    for _ in range(500):
        total += target - x
        u = kp * (target - x) + ki * Ts * total - kd * (x - last) / Ts
        last = x
        shown.append((x, u))
        settled = u / c
        x, v = x + settled * Ts + (v - settled) * (1 - decay) / c, settled + (v - settled) * decay
    solution = follow("sampled_controller")
    ticks = times(solution, "when")
    assert ticks == [pytest.approx(k * Ts, abs=1e-15) for k in range(501)]
    assert solution["x"][-1] == pytest.approx(x, rel=1e-10)
    for k, (place, force) in enumerate(shown):
        event = solution.events[k]
        assert event.after["u"] == pytest.approx(force, rel=1e-9, abs=1e-9)
        assert solution(k * Ts)["x"] == pytest.approx(place, abs=1e-10)
    assert solution["x"][-1] == pytest.approx(target, abs=0.05)


@pytest.mark.parametrize("period", ["0 s", "-0.1 s"])
def test_a_sample_without_a_period_is_refused(period: str) -> None:
    text = """\
parameter T = 0.1 s;
coordinate x = 0 m;
initial der(x) = 1 m/s;
kinetic 1/2*(1 kg)*der(x)^2;
discrete Integer n = 0;
when sample(T) then n := n + 1; end when;
"""
    run = mechc.loads(text).simulate(stop=1, set={"T": period})
    assert run.outcome.value == "failed" and len(run.time) == 1
    assert run.message == f"a 'sample' has the period {period.removesuffix(' s')} (SI): a period is positive"


def test_a_sample_may_begin_later() -> None:
    """``sample(T, t0)``: at t0, t0 + T, ..."""
    solution = mechc.loads("""
    coordinate x = 0 m;
    initial der(x) = 1 m/s;
    kinetic 1/2*(1 kg)*der(x)^2;
    discrete Integer n = 0;
    when sample(0.3 s, 0.2 s) then n := n + 1; end when;
    """).simulate(stop=1)
    assert times(solution, "when") == pytest.approx([0.2, 0.5, 0.8], abs=1e-15)
