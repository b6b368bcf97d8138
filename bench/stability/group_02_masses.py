"""Double pendulum with extreme ratios of masses, and with none at all."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.special import ellipj, ellipk

from .case import Array, Case, Followed, Known, Measured, Refusal, drift

NUMBER = 2
TITLE = "Extreme ratios of masses"

LINKS = """
parameter m1 = {m1} kg;
parameter m2 = {m2} kg;
parameter l = 1 m;
gravity {{0, -9.81}} m/s^2;
coordinate Angle a = {a} rad;
coordinate Angle b = {b} rad;
point elbow = world * rot(a) * {{0 m, -l}};
point tip = world * rot(a) * trans({{0 m, -l}}) * rot(b - a) * {{0 m, -l}};
mass m1 at elbow;
mass m2 at tip;
experiment(stop = {stop} s, tolerance = 1e-10);
"""


def pendulum(t: Array) -> Any:
    """A pendulum of 1 m let go at 1 rad."""
    k, w = np.sin(0.5), np.sqrt(9.81)
    sn = ellipj(ellipk(k * k) - w * t, k * k)[0]
    return 2 * np.arcsin(k * sn)


CASES = (
    Case(
        "light lower bob",
        "mass ratio 1e-12: the lower bob does not move the upper one",
        LINKS.format(m1=1, m2=1e-12, a=1, b=0.5, stop=5),
        Known("the upper bob is a pendulum, to 1e-8", {"a": pendulum}, 1e-8),
        fault="loose",
    ),
    Case(
        "heavy lower bob, straight",
        "mass ratio 1e12: the upper bob holds only 1e-12 of the mass; both angles alike is not a motion",
        LINKS.format(m1=1e-12, m2=1, a=1, b=1, stop=1e-6),
        Followed("follows the reference to 1e-6", 1e-6),
        fault="sign",
    ),
    Case(
        "heavy lower bob, bent",
        "mass ratio 1e6: the elbow swings 1000 times faster than the bob",
        LINKS.format(m1=1e-6, m2=1, a=1, b=1.0001, stop=0.2),
        Followed("follows the reference to 1e-5", 1e-5),
        fault="loose",
    ),
    Case(
        "heavy lower bob, bent, all the ratio",
        "mass ratio 1e12: a million times faster",
        LINKS.format(m1=1e-12, m2=1, a=1, b=1.0001, stop=1e-5),
        Followed("follows the reference to 1e-5", 1e-5),
        fault="sign",
    ),
    Case(
        "energy of a heavy lower bob",
        "mass ratio 1e4",
        LINKS.format(m1=1e-4, m2=1, a=1, b=1.001, stop=2),
        Measured("keeps the energy to 1e-10", drift, 1e-10),
        fault="loose",
    ),
    Case(
        "massless lower bob",
        "no mass at the end of the second link",
        LINKS.format(m1=1, m2=0, a=1, b=0.5, stop=5),
        Refusal("is refused by the compiler: nothing with mass moves with b", ("E0520", "'b'")),
        fault="masses unchecked",
    ),
    Case(
        "massless link, damped",
        "the second link carries nothing, and a damper turns with it",
        LINKS.format(m1=1, m2=0, a=1, b=0.5, stop=5).replace("mass m2 at tip;", "damping 1 N.m.s on b;"),
        Known("the upper bob is a pendulum, the link stays, to 1e-8", {"a": pendulum, "b": 0.5}, 1e-8),
        fault="loose",
    ),
)
