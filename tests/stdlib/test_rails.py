"""Rolling contact against Hertz by SciPy's elliptic integrals, an own FASTSIM and Kalker's limits; hunting against linear theory and SciPy."""

from __future__ import annotations

import math
from functools import cache
from typing import Any

import numpy as np
import pytest
from gallery import run as run_example
from scipy.integrate import solve_ivp
from scipy.interpolate import PchipInterpolator
from scipy.optimize import brentq
from scipy.special import ellipe, ellipk

import mechc

E, MU, R0, B, RAIL, LOAD = 2.1e11, 0.35, 0.46, 0.75, 0.3, 6e4


def run(text: str, stop: float = 0.0, **options: Any) -> mechc.Solution:
    s = mechc.loads(
        f"import mech.rails.*;\nmodel M\n{text}\n  experiment(stop = {stop} s, tolerance = 1e-10);\nend M;\n"
    ).simulate(estimate_error=False, **options)
    assert s.outcome.value == "completed", s.message
    return s


def hertz(A: float, C: float) -> tuple[float, float]:
    """Return the half axes over the cube root of 3 N/(4 E* (A + C)), K. L. Johnson (1985), eq. 4.28 and 4.32."""
    r = max(A, C) / min(A, C)

    def ratio(k: float) -> float:
        m = 1 - k * k
        return float((ellipe(m) / k**2 - ellipk(m)) / (ellipk(m) - ellipe(m)))

    k = brentq(lambda k: ratio(k) - r, 1e-4, 1 - 1e-9, xtol=1e-15)
    m = 1 - k * k
    F = 4 / (math.pi * m) * k**1.5 * math.sqrt((ellipe(m) / k**2 - ellipk(m)) * (ellipk(m) - ellipe(m)))
    c = ((A + C) / (2 * math.sqrt(A * C)) * F) ** (1 / 3)
    axes = (c / math.sqrt(k), c * math.sqrt(k))
    return axes if A < C else axes[::-1]


def fastsim(ex: float, ey: float, spin: float, slim: float, nx: int, ny: int) -> tuple[float, float]:
    """Return the sums of tractions over friction times load: all strips at once, from the leading edge to the trailing one."""
    y = (np.arange(ny) + 0.5) * 2 / ny - 1
    edge = np.sqrt((1 - y) * (1 + y))
    step = 2 * edge / nx
    p = np.zeros((2, ny))
    total = np.zeros(2)
    last = edge
    for i in range(nx):
        x = edge * (1 - (2 * i + 1) / nx)
        way = last - x
        middle = (last + x) / 2
        p = p - way * np.array([ex - spin * slim * y, ey + spin * middle])
        size = np.hypot(*p)
        bound = edge**2 - x**2
        p = np.where(size > bound, p * bound / np.maximum(size, 1e-300), p)
        total += (p * step).sum(axis=1) * 2 / ny
        last = x
    fx, fy = 2 / math.pi * total
    return float(fx), float(fy)


def test_ellipses_of_hertz() -> None:
    pairs = [(1.087, 1.667), (5.0, 1.087), (1.0, 1.0001), (1.0, 40.0)]
    calls = "".join(
        f"let (a{i}, b{i}) = hertz({a!r}, {b!r}); output o{i}[2] = {{a{i}, b{i}}};"
        for i, (a, b) in enumerate(pairs)
    )
    s = run(calls)
    for i, pair in enumerate(pairs):
        assert [s[f"o{i}[1]"][0], s[f"o{i}[2]"][0]] == pytest.approx(hertz(*pair), rel=1e-7), pair


CREEPAGES = [
    (0.2, 0, 0, 0.75),
    (0, -0.7, 0, 1.6),
    (0.5, 0.4, 0.6, 0.75),
    (-1.5, 0.3, -2, 0.4),
    (0, 0, 1, 1),
    (3, 4, 0, 1),
]


@pytest.mark.parametrize("cells", [3, pytest.param(10, marks=pytest.mark.slow)])
def test_creep_forces_by_another_fastsim(cells: int) -> None:
    calls = "".join(
        f"let (x{i}, y{i}) = fastsim({{{a}, {b}, {c}}}, {d}, {cells}); output o{i}[2] = {{x{i}, y{i}}};"
        for i, (a, b, c, d) in enumerate(CREEPAGES)
    )
    s = run(calls)
    for i, (a, b, c, d) in enumerate(CREEPAGES):
        found = [s[f"o{i}[1]"][0], s[f"o{i}[2]"][0]]
        assert found == pytest.approx(fastsim(a, b, c, d, cells, cells), abs=1e-13)
        if cells == 10:  # 100 cells are within 4 % of the friction of 160 000
            assert found == pytest.approx(fastsim(a, b, c, d, 400, 400), abs=0.04)


def test_limits_of_kalker() -> None:
    """Small creepages give his coefficients (strips add 1/(2 n^2)), large ones the friction, and pure spin no force along the rail."""
    s = run(
        "".join(
            f"let (x{i}, y{i}) = fastsim({{{a}, {b}, {c}}}, 0.8, 4); output o{i}[2] = {{x{i}, y{i}}};"
            for i, (a, b, c) in enumerate(
                [(1e-6, 0, 0), (0, 1e-6, 0), (0, 0, 1e-6), (300, 400, 0), (0, 0, 0.5)]
            )
        )
        + "let (c11, c22, c23) = kalker(0.55); let (d11, d22, d23) = kalker(1/0.55); output k[6] = {c11, c22, c23, d11, d22, d23};"
    )
    # mu N 3/8 G c11 xi/(mu p0) with p0 = 2 N/(pi a b): G a b c11 xi = mu N e 16/(3 pi)
    assert s["o0[1]"][0] == pytest.approx(-1e-6 * 16 / (3 * math.pi) * (1 + 1 / 32), rel=1e-9)
    assert s["o1[2]"][0] == pytest.approx(-1e-6 * 16 / (3 * math.pi) * (1 + 1 / 32), rel=1e-9)
    # spin: G c23 (a b)^1.5 phi = mu N e/2
    assert s["o2[2]"][0] == pytest.approx(-1e-6 / 2, rel=0.05)
    assert [s["o3[1]"][0], s["o3[2]"][0]] == pytest.approx([-0.6, -0.8], rel=0.05)
    assert s["o4[1]"][0] == pytest.approx(0, abs=1e-15)
    assert [s[f"k[{i}]"][0] for i in range(1, 7)] == pytest.approx([3.67, 3.075, 0.9795, 4.94, 4.70, 2.425])


class Wheelset:
    """Both wheels on straight track: lateral place, yaw, turn of the axle; V given."""

    def __init__(
        self, V: float, mu: float, profile: tuple[list[float], list[float]], springs: tuple[float, float]
    ) -> None:
        self.V, self.mu, self.springs = V, mu, springs
        at, up = (np.array(p) / 1000 for p in profile)
        self.tread = (
            (lambda s: np.interp(s, at, up), lambda s: (up[1] - up[0]) / (at[1] - at[0]))
            if len(at) == 2
            else (PchipInterpolator(at, up), PchipInterpolator(at, up).derivative())
        )
        A, C = 1 / (2 * R0), 1 / (2 * RAIL)
        self.axes = hertz(A, C)
        self.scale = 3 * (15 / 16) / (2 * E * (A + C))
        ratio = self.axes[0] / self.axes[1]
        g = np.arange(0.1, 1.01, 0.1)
        rows = (
            [4.12, 4.22, 4.36, 4.54, 4.78, 5.10, 5.57, 6.34, 7.78, 11.7],
            [3.67, 3.81, 3.99, 4.21, 4.50, 4.90, 5.48, 6.40, 8.14, 12.8],
            [1.47, 1.57, 1.75, 1.95, 2.23, 2.62, 3.24, 4.32, 6.63, 14.6],
        )
        assert ratio > 1
        self.c = [float(np.interp(1 / ratio, g, row[::-1])) for row in rows]

    def forces(self, y: float, yaw: float, v: float, w: float, spin: float) -> tuple[float, float, float]:
        """Return forces on y, yaw and turn of both wheels."""
        found = np.zeros(3)
        for side in (1, -1):
            slope = float(self.tread[1](side * y))
            r, d = R0 + float(self.tread[0](side * y)), math.atan(slope)
            N = LOAD / math.cos(d)
            a, b = (n * (N * self.scale) ** (1 / 3) for n in self.axes)
            p0 = 2 * N / (math.pi * a * b)
            G = E / 2.5
            xi = (self.V - side * B * w - r * spin) / self.V
            eta = (v - self.V * yaw) / math.cos(d) / self.V
            phi = (w * math.cos(d) - side * spin * math.sin(d)) / self.V
            scaled = 3 / 8 * G / (self.mu * p0)
            fx, fy = fastsim(
                scaled * self.c[0] * xi,
                scaled * self.c[1] * eta,
                4 / math.pi * G * self.c[2] * math.sqrt(a * b) * phi / (self.mu * p0),
                b / a,
                10,
                10,
            )
            Fx, Fy = self.mu * N * fx, self.mu * N * fy
            found += [Fy / math.cos(d) - side * LOAD * slope, -side * B * Fx, -r * Fx]
        return found[0], found[1], found[2]

    def rate(self, _: float, q: np.ndarray) -> list[float]:
        y, yaw, v, w, spin = q
        Fy, M, T = self.forces(y, yaw, v, w, spin)
        return [v, w, (Fy - self.springs[0] * y) / 1500, (M - self.springs[1] * yaw) / 800, T / 120]


WHEELSET = """
  parameter V = {V!r} m/s;
  coordinate Length x; drive x = V*time;
  coordinate Length y = {y} mm; coordinate Angle yaw = 0 rad; coordinate Angle turn = 0 rad;
  initial der(turn) = V/0.46 m; initial der(y) = 0 m/s; initial der(yaw) = 0 rad/s;
  kinetic 1/2*1500 kg*der(y)^2 + 1/2*800 kg.m^2*der(yaw)^2 + 1/2*120 kg.m^2*der(turn)^2;
  potential 1/2*{ky} N/m*y^2 + 1/2*{kp} N.m/rad*yaw^2;
  RailWheel wheel[i in 1:2](x = x, y = y, yaw = yaw, turn = turn, side = 3 - 2*i, load = 6e4 N{more});
"""
CONE = ([-20.0, 20.0], [-3.0, 3.0])


def matrix(V: float) -> np.ndarray:
    """Return the matrix of y, yaw and their rates of the linear theory: Kalker's coefficients, and no saturation."""
    wheels = Wheelset(V, 1e3, CONE, (2e5, 2e6))
    slope = 0.15
    d = math.atan(slope)
    N = LOAD / math.cos(d)
    a, b = (n * (N * wheels.scale) ** (1 / 3) for n in wheels.axes)
    G, area = E / 2.5, a * b
    strips = 1 + 1 / 200
    f11, f22 = (G * area * c * strips for c in wheels.c[:2])
    # the sum of cells for (1 - x^2 - y^2)/2 of the spin, where the integral is pi/4
    f23 = G * area**1.5 * wheels.c[2] * 2 * -fastsim(0, 0, 1e-6, b / a, 10, 10)[1] / 1e-6
    c = math.cos(d)
    return np.array(
        [
            [0, 0, 1, 0],
            [0, 0, 0, 1],
            [-2e5 / 1500, 2 * f22 / c**2 / 1500, -2 * f22 / c**2 / V / 1500, -2 * f23 / V / 1500],
            [-2 * f11 * B * slope / R0 / 800, -2e6 / 800, 0, -2 * f11 * B * B / V / 800],
        ]
    )


@cache
def hunter() -> mechc.Model:
    text = WHEELSET.format(
        V=30.0, y=0, ky="2e5", kp="2e6", more=", mu = 1e3, at = {-20, 20} mm, up = {-3, 3} mm"
    )
    return mechc.loads(
        f"import mech.rails.*;\nmodel M\n{text}\n  experiment(stop = 1 s, tolerance = 1e-10);\nend M;\n"
    )


def poles(V: float) -> np.ndarray:
    return np.array([complex(*p) for p in hunter().linearize(set={"V": V}).details["poles"]])


@pytest.mark.slow
def test_critical_speed_of_a_wheelset() -> None:
    """Where the linear theory has it; below and above, all its eigenvalues are found."""
    critical = brentq(lambda V: np.linalg.eigvals(matrix(V)).real.max(), 5, 200)
    assert 20 < critical < 80
    for share, unstable in ((0.999, False), (1.001, True)):
        V = share * critical
        found, expected = poles(V), np.linalg.eigvals(matrix(V))
        for pole in expected:
            assert np.abs(found - pole).min() < 1e-6 * np.abs(expected).max()
        assert bool(max(p.real for p in found if abs(p.imag) > 1) > 0) is unstable


@pytest.mark.slow
def test_hunting_against_scipy() -> None:
    """Above its critical speed a wheelset runs from flange to flange; the same motion by the own FASTSIM and the profile by SciPy."""
    profile = ([-20.0, 0, 4, 6, 7, 8, 9, 10], [-0.5, 0, 0.1, 0.25, 0.6, 1.6, 3.6, 6.2])
    s = run_example("wheelset_hunting", stop=0.3, tolerance=1e-7)
    wheels = Wheelset(70.0, MU, profile, (1e5, 1e5))
    start = [6e-3, 0, 0, 0, 70 / R0]
    found = solve_ivp(wheels.rate, (0, 0.3), start, "LSODA", rtol=1e-8, atol=1e-11, t_eval=s.time)
    assert s["y"] == pytest.approx(found.y[0], abs=2e-6)
    assert s["wheel[1].radius"][0] > 0.46024 and np.ptp(s["y"]) > 8e-3
