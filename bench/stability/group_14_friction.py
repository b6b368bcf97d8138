"""Stick and slip, and turning points under dry friction."""

from __future__ import annotations

import math

import numpy as np

from mechc.solution import Solution

from .case import Array, Case, Known, Measured

NUMBER = 14
TITLE = "Dry friction"

BELT = """
parameter belt = {u!r} m/s;
coordinate Length x = {x!r} m;
initial der(x) = {v!r} m/s;
kinetic 1/2*1 kg*der(x)^2;
potential 1/2*1 N/m*x^2;
friction {k!r} N static {s!r} N on x - belt*time;
experiment(stop = {stop!r} s, tolerance = 1e-11);
"""
U, SLIDING, STICKING = 2.0, 2.0, 3.0
CYCLE = 2 * math.pi - 2 * math.atan((STICKING - SLIDING) / U) + 2 * (STICKING - SLIDING) / U


def cycles(s: Solution) -> float:
    """Largest relative deviation of the time of a slip from its place in 1000 equal cycles."""
    slips = np.array([event.time for event in s.events if event.kind == "slip"])
    wanted = STICKING / U + CYCLE * np.arange(1000)
    return float(np.abs(slips / wanted - 1).max()) if slips.shape == wanted.shape else math.inf


def grazing(t: Array) -> Array:
    """It sticks until the spring is as strong, then swings and just reaches the speed of the belt each time."""
    return np.where(t < SLIDING / U, U * t, SLIDING + U * np.sin(t - SLIDING / U))


TURNS = """
coordinate Length x = 10.3 m;
kinetic 1/2*1 kg*der(x)^2;
potential 1/2*1 N/m*x^2;
friction 0.25 N on x;
experiment(stop = 80 s, tolerance = 1e-11);
"""


def turning(t: Array) -> Array:
    """Half swings about +-0.25, each 0.5 smaller, 21 of them; then it rests at 0.2."""
    swing = np.minimum(np.floor(t / math.pi), 20)
    centre = 0.25 * (-1.0) ** swing
    size = 10.3 - 0.5 * swing - 0.25
    moving = centre + (-1.0) ** swing * size * np.cos(t - math.pi * swing)
    return np.where(t < 21 * math.pi, moving, 0.2)


SLOPE = """
parameter mu = 0.5;
parameter slope = {slope!r} rad;
coordinate Length s = 0 m;
initial der(s) = {v} m/s;
kinetic 1/2*1 kg*der(s)^2;
potential 1 kg*9.81 m/s^2*s*sin(slope);
friction mu*1 kg*9.81 m/s^2*cos(slope) on s;
experiment(stop = 10 s);
"""

CASES = (
    Case(
        "stick-slip for 1000 cycles",
        "2000 changes between sticking and sliding",
        BELT.format(u=U, x=0.0, v=U, k=SLIDING, s=STICKING, stop=STICKING / U + 999.5 * CYCLE),
        Measured("every slip at its time, to 1e-9", cycles, 1e-9),
        fault="missed events",
    ),
    Case(
        "equal limits of sticking and sliding",
        "after the first slip the mass just reaches the speed of the belt again and again",
        BELT.format(u=U, x=0.0, v=U, k=SLIDING, s=SLIDING, stop=20 * math.pi),
        Known("swings for ever, to 1e-6", {"x": grazing}, 1e-6),
        fault="missed events",
    ),
    Case(
        "turning points",
        "the friction changes its sign at each of 20 turns and holds at the last",
        TURNS,
        Known("rests at 0.2 m after 21 half swings; the path to 1e-8", {"x": turning}, 1e-8),
        fault="missed events",
    ),
    Case(
        "slope just too flat",
        "tan(slope) is smaller than mu by 1e-9",
        SLOPE.format(slope=math.atan(0.5 - 1e-9), v=0),
        Known("stays", {"s": lambda t: 0 * t}, 1e-12),
        fault="pushed",
    ),
    Case(
        "slope just steep enough",
        "tan(slope) is larger than mu by 1e-3",
        SLOPE.format(slope=math.atan(0.5 + 1e-3), v=0),
        Known("slides down, to 1e-6",
              {"s": lambda t: -0.5 * 9.81 * math.cos(math.atan(0.5 + 1e-3)) * 1e-3 * t * t}, 1e-6),
        fault="sign",
    ),
)  # fmt: skip
