"""Particles on surfaces and slopes (T16, U38, U45, U57, U79, U80, V4)."""

from __future__ import annotations

import numpy as np
import pytest
from closed_forms import integrate, time_between
from gallery import (
    Array,
    Case,
    at,
    check,
    check_estimate,
    downward_crossings,
    references,
    run,
    upward_crossings,
)
from numpy import cos, sin, sqrt, tan
from scipy.optimize import brentq

import mechc

g = 9.81

wedge_s = g * 0.5 * 3 / (2 + 0.25)
wedge_X = -g * 0.5 * sqrt(0.75) / (2 + 0.25)

CASES = [
    Case("helix", {"z": lambda t: -g * t**2 / 10}, bound=100),
    Case(
        "wedge",
        {
            "s": lambda t: wedge_s * t**2 / 2,
            "X": lambda t: wedge_X * t**2 / 2,
            "a_s": lambda t: 6.54,
            "a_X": lambda t: wedge_X,
        },
        bound=10,
    ),
    Case(
        "wedge",
        {"a_s": lambda t: g * 0.6 * 5 / (2 + 3 * 0.36), "a_X": lambda t: -3 * g * 0.6 * 0.8 / (2 + 3 * 0.36)},
        bound=10,
        set={"m": 3, "theta": np.arcsin(0.6)},
    ),
]


@pytest.mark.parametrize("case", CASES, ids=str)
def test_closed_form(case: Case) -> None:
    check(case)


def test_printed_acceleration_of_the_wedge() -> None:
    assert run("wedge")["a_X"][0] == pytest.approx(-1.887935, abs=6e-7)


def test_wedge_prints_its_forces() -> None:
    """The sources' formulas."""
    for theta, M in ((30, 2.0), (50, 0.5)):
        s = run("wedge", set={"theta": f"{theta} deg", "M": M})
        sin, cos = np.sin(np.radians(theta)), np.cos(np.radians(theta))
        down = g * sin * (M + 1) / (M + sin**2)
        assert s["n"] == pytest.approx(M * g * cos / (M + sin**2), rel=1e-12)
        assert s["N"] == pytest.approx((M + 1) * g - down * sin, rel=1e-12)


def test_forces_on_the_wedge() -> None:
    """U38: between block and wedge m M g cos/(M + m sin^2), on the floor (M + m) g - m s'' sin; in free coordinates with
    constraints, whose multipliers they are."""
    text = """\
model Wedge
  dimensionless;
  coordinate X = 0;
  coordinate Y = 0;
  coordinate x = 0;
  coordinate y = 0;
  kinetic 2/2*(der(X)^2 + der(Y)^2) + 1/2*(der(x)^2 + der(y)^2);
  potential 9.81*(2*Y + y);
  constraint between: (y - Y)*cos(pi/6) + (x - X)*sin(pi/6) = 0;
  constraint floor: Y = 0;
  output n = multiplier(between);
  output N = multiplier(floor);
  output a = der(X, 2);
  experiment(stop = 1);
end Wedge;
"""
    solution = mechc.loads(text).simulate()
    n = 2 * g * sqrt(0.75) / (2 + 0.25)
    assert np.abs(np.abs(solution["n"]) - n).max() < 1e-11
    assert np.abs(np.abs(solution["N"]) - (3 * g - wedge_s * 0.5)).max() < 1e-11
    assert np.abs(np.abs(solution["a"]) + wedge_X).max() < 1e-11


SPHERICAL = {
    "theta": "theta", "phi": "phi", "thetadot": "der(theta)", "phidot": "der(phi)",
    "x": "bob[1]", "y": "bob[2]", "z": "bob[3]",
}  # fmt: skip
ELASTIC = {"x": "x", "y": "y"}
PARTS = {
    "x": "guide.position[1]", "y": "guide.position[2]",
    "vx": "der(guide.position[1])", "vy": "der(guide.position[2])",
}  # fmt: skip


# Bounds at the last time in units of the tolerance; the elastic pendulum trades its energy to and fro for 40 s.
@pytest.mark.parametrize(
    ("example", "data", "names", "bound"),
    [
        ("spherical_pendulum", "spherical_pendulum", SPHERICAL, 300),
        ("elastic_pendulum", "elastic_pendulum_1_2", ELASTIC, 300),
        ("elastic_pendulum_parts", "elastic_pendulum_1_2", PARTS, 300),
    ],
)
def test_reference(example: str, data: str, names: dict[str, str], bound: float) -> None:
    points = references(data)
    solution = run(example, stop=points[-1]["t"])
    for point in points:
        expected = [point["values"][k] for k in names]
        assert at(solution, point["t"], list(names.values())) == pytest.approx(expected, abs=bound * 1e-10)
        if point["t"] == solution.time[-1] and names is not ELASTIC:  # x and y are not states there
            check_estimate(solution, dict(zip(names.values(), expected, strict=True)))


def test_equations_of_the_elastic_pendulum() -> None:
    """U45: r'' = r th'^2 + g cos(th) - (K/m)(r - l0), r th'' + 2 r' th' + g sin(th) = 0; of 0.6 kg."""

    def rates(_: float, y: Array) -> list[float]:
        r, th, u, w = y
        return [u, w, r * w * w + g * cos(th) - 29.43 / 0.6 * (r - 1), -(2 * u * w + g * sin(th)) / r]

    solution = run("elastic_pendulum", set={"m": 0.6, "x0": 0.5}, stop=10.0)
    expected = integrate(rates, [np.hypot(0.5, 43 / 30), np.arctan2(0.5, 43 / 30), 0, 0], solution.time)
    for name, values in zip(("r", "theta", "der(r)", "der(theta)"), expected, strict=True):
        assert solution[name] == pytest.approx(values, abs=1e-7), name


@pytest.mark.parametrize(
    ("example", "momentum"),
    [("spherical_pendulum", "p_phi"), ("cone", "p_phi"), ("particle_on_sphere", "p_phi")],
)
def test_cyclic_angle(example: str, momentum: str) -> None:
    """Its momentum is conserved and its rate keeps its sign."""
    solution = run(example)
    assert np.ptp(solution[momentum]) < 300e-10
    assert solution["der(phi)"].min() > 0


def test_cone() -> None:
    """V4: rho'^2 = 2 sin^2(alpha)/m (E - p^2/(2 m rho^2) - m g rho cot(alpha)); turning points and their times."""
    p, slope, sine2 = 1.5, 1 / tan(np.pi / 6), 0.25
    E = p**2 / (2 * 0.25) + g * 0.5 * slope

    def excess(rho: float) -> float:
        return float(E - p**2 / (2 * rho**2) - g * rho * slope)

    other = brentq(excess, 0.51, 5, xtol=1e-15)
    half = time_between(lambda rho: 2 * sine2 * excess(rho), 0.5, other)
    solution = run("cone")
    for n in range(1, int(10 / half) + 1):
        assert solution(n * half)["rho"] == pytest.approx(other if n % 2 else 0.5, rel=1000e-10)
    assert abs(solution(half)["der(rho)"]) < 1e-7


@pytest.mark.parametrize(("experiment", "F0"), [(None, 2.0), ("free", 0.0)])
def test_paraboloid(experiment: str | None, F0: float) -> None:
    """T16: L = m/2 (x'^2 + y'^2 + 4 a^2 (x x' + y y')^2) - m g a (x^2 + y^2), with the force along x; a = 1/2."""

    def rates(t: float, s: Array) -> list[float]:
        x, y, u, v = s
        M = [[1 + x * x, x * y], [x * y, 1 + y * y]]
        pull = -(u * u + v * v + g)
        return [u, v, *np.linalg.solve(M, [pull * x + F0 * sin(3 * t), pull * y])]

    solution = run("paraboloid", experiment)
    expected = integrate(rates, [0.2, 0, 0, 0.5], solution.time)
    assert solution["x"] == pytest.approx(expected[0], abs=300e-10)
    assert solution["y"] == pytest.approx(expected[1], abs=300e-10)
    if experiment == "free":
        assert np.ptp(solution["l"]) < 100e-10


def test_parabola() -> None:
    """T16: without a rate across it stays on the parabola z = a x^2: (1 + 4 a^2 x^2) x'^2/2 + g a x^2 is constant, with its period."""
    solution = run("paraboloid", "free", set={"der(y)": 0.0})
    assert np.max(np.abs(solution["y"])) == 0
    half = time_between(lambda x: g * (0.04 - x * x) / (1 + x * x), -0.2, 0.2)
    for n in range(1, int(10 / half) + 1):
        assert solution(n * half)["x"] == pytest.approx((-1) ** n * 0.2, abs=300e-10)


def test_particle_on_sphere() -> None:
    """U79: turning points at 51.13163 deg and at its mirror image."""
    solution = run("particle_on_sphere")
    lowest = [solution(t)["theta"] for t in upward_crossings(solution, "der(theta)")]
    sine2 = (1 - 0.6 + sqrt(0.16 + 2 * 0.25)) / 2
    assert np.array(lowest) == pytest.approx(np.arcsin(sqrt(sine2)), abs=300e-10)
    assert np.rad2deg(lowest[0]) == pytest.approx(51.13163, abs=6e-6)
    E = (
        solution["der(theta)"] ** 2 / 2
        + 0.5**2 / (2 * sin(solution["theta"]) ** 2)
        + cos(solution["theta"]) ** 2
    )
    assert pytest.approx(0.6, abs=300e-10) == E
    highest = [solution(t)["theta"] for t in downward_crossings(solution, "der(theta)")]
    assert len(highest) > 5 and np.array(highest) == pytest.approx(np.pi - np.array(lowest[0]), abs=300e-10)


def test_spherical_pendulum() -> None:
    """U80: p_phi = m r^2 sin^2(theta) phi'; it turns where E = p^2/(2 m r^2 sin^2(theta)) - m g r cos(theta), a cubic in
    u = cos(theta)."""
    solution = run("spherical_pendulum")
    p, E = 2 * sin(1) ** 2, 2 * sin(1) ** 2 - g * cos(1)
    assert solution["p_phi"] == pytest.approx(sin(solution["theta"]) ** 2 * solution["der(phi)"], rel=1e-12)
    assert solution["p_phi"] == pytest.approx(p, rel=300e-10)
    assert solution["energy.total"] == pytest.approx(E, abs=300e-10)
    turns = np.roots([-2 * g, -2 * E, 2 * g, 2 * E - p * p])  # 2 (E + g u) (1 - u^2) = p^2
    low, high = sorted(u for u in turns.real if abs(u) < 1)
    nearest = [cos(solution(t)["theta"]) for t in upward_crossings(solution, "der(theta)")]
    farthest = [cos(solution(t)["theta"]) for t in downward_crossings(solution, "der(theta)")]
    assert len(nearest) > 3 and len(farthest) > 3
    assert np.array(nearest) == pytest.approx(high, abs=300e-10)
    assert np.array(farthest) == pytest.approx(low, abs=300e-10)
