"""Fast tops, and tops at the limit of their stability."""

from __future__ import annotations

from typing import Any

import numpy as np

from mechc.solution import Solution

from .case import Array, Case, Known, Measured, drift

NUMBER = 5
TITLE = "Fast and sleeping tops"

M, L, G, I1, I3 = 1.0, 0.05, 9.81, 4e-3, 1e-3
TILT = np.radians(30)

ROTATION = """
parameter m = 1 kg;
parameter l = 5 cm;
parameter g = 9.81 m/s^2;
parameter I1 = 4e-3 kg.m^2;
parameter I3 = 1e-3 kg.m^2;
coordinate Rotation R = {start};
initial der(R) = {rate};
gravity {{0, 0, -g}};
frame body = world * R;
mass m at body * {{0 m, 0 m, l}};
inertia diag({{I1 - m*l^2, I1 - m*l^2, I3}}) on body;
output up = direction(body, {{0, 0, 1}})[3];
output Real across = direction(body, {{0, 0, 1}})[2];
experiment(stop = {stop} s, tolerance = {tolerance});
"""


def precession(spin: float) -> float:
    """Return the slow steady precession: I1 cos(t) w^2 - I3 spin w + m g l = 0."""
    a, b, c = I1 * np.cos(TILT), I3 * spin, M * G * L
    return float(2 * c / (b + np.sqrt(b * b - 4 * a * c)))


def steady(spin: float, stop: float) -> Case:
    w = precession(spin)
    return Case(
        f"steady precession at {spin:g} rad/s, Euler angles",
        f"spin and precession differ by {spin / w:.0g}",
        "examples/lagrange_top.mech",
        Known("the tilt to 1e-8, the precession to 1e-6",
              {"theta": lambda t: np.full_like(t, TILT), "phi": lambda t: w * t}, 1e-6),
        fault="pushed",
        options={"set": {"spin": spin, "precession": w}, "stop": stop, "tolerance": 1e-12},
    )  # fmt: skip


def turning(spin: float, stop: float) -> Case:
    w = precession(spin)
    rate = f"{{0 rad/s, {w * np.sin(TILT):.17g} rad/s, {spin:.17g} rad/s}}"
    start = f"rotx({TILT:.17g} rad)"

    def across(t: Array) -> Any:
        return -np.sin(TILT) * np.cos(w * t)

    return Case(
        f"steady precession at {spin:g} rad/s, Rotation",
        f"{spin * stop / 2 / np.pi:.0f} turns about the axis",
        ROTATION.format(start=start, rate=rate, stop=stop, tolerance=1e-12),
        Known(
            "tilt and precession to 5e-12",
            {"up": lambda t: np.full_like(t, np.cos(TILT)), "across": across},
            5e-12,
        ),
        fault="loose",
    )


LIMIT = np.sqrt(4 * I1 * M * G * L) / I3
"""Spin below which an upright top falls."""


def lowest(s: Solution) -> float:
    return float(s["up"].min())


def fallen(spin: float) -> float:
    """How low the axis of a sleeping top comes: cos(t) = I3^2 spin^2/(2 I1 m g l) - 1."""
    return (I3 * spin) ** 2 / (2 * I1 * M * G * L) - 1


def sleeping(share: float) -> str:
    rate = f"{{0, 0, {share * LIMIT:.17g}}} rad/s"
    return ROTATION.format(start="rotx(1e-6 rad)", rate=rate, stop=20, tolerance=1e-12)


CASES = (
    steady(1e4, 1.0),
    steady(1e5, 0.2),
    turning(1e4, 0.2),
    turning(1e5, 0.05),
    Case(
        "sleeping top above its limit",
        "1 % above the spin at which the upright top loses its stability, 1e-6 rad off",
        sleeping(1.01),
        Measured("stays upright: 1 - cos(tilt) below 1e-9", lambda s: 1 - lowest(s), 1e-9),
        fault="sign",
    ),
    Case(
        "sleeping top below its limit",
        "1 % below",
        sleeping(0.99),
        Measured("falls as low as the constants of the motion say, to 1e-4",
                 lambda s: abs(lowest(s) - fallen(0.99 * LIMIT)), 1e-4),
        fault="sign",
    ),
    Case(
        "fast top, 10 s",
        "160 000 turns",
        ROTATION.format(start="rotx(0.5 rad)", rate="{0, 0, 1e5} rad/s", stop=10, tolerance=1e-10),
        Measured("keeps energy and momenta to 1e-7", drift, 1e-7),
        fault="loose",
        full=True,
        seconds=200,
    ),
)  # fmt: skip
