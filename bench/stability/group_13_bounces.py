"""Bounces that pile up, that go on for ever, and events that chatter."""

from __future__ import annotations

import math

import numpy as np

from mechc.solution import Solution

from .case import Case, Measured, Refusal, happens

NUMBER = 13
TITLE = "Impacts and chattering"

BALL = """
parameter g = 9.81 m/s^2;
parameter e = {e};
coordinate Length h = 1 m;
kinetic 1/2*1 kg*der(h)^2;
potential 1 kg*g*h;
{floor}
experiment(stop = {stop} s, tolerance = 1e-10);
"""
FALL = math.sqrt(2 / 9.81)
CONTACT = "contact floor: h restitution e;"
RAW = "when h < 0 m then reinit(der(h), -e*der(h)); end when;"


def rests(s: Solution) -> float:
    """Relative error of the time at which it comes to rest."""
    (rest,) = (event.time for event in s.events if event.kind == "rest")
    return abs(rest / (FALL * (1 + s.parameters["e"]) / (1 - s.parameters["e"])) - 1)


def period(s: Solution) -> float:
    """Largest relative deviation of the intervals between impacts from twice the fall."""
    times = np.array([event.time for event in s.events if event.kind == "impact"])
    return float(np.abs(np.diff(times) / (2 * FALL) - 1).max())


# A ball that is thrown by a plate once a period: the phase at which the plate has the speed that it loses.
PERIOD, E, AMPLITUDE = 0.2, 0.5, 0.012
UP = 9.81 * PERIOD / 2
OMEGA = 2 * math.pi / PERIOD
PHASE = math.acos(UP * (1 - E) / (1 + E) / (AMPLITUDE * OMEGA))
PLATE = f"""
parameter w = {OMEGA!r} rad/s;
let plate = {AMPLITUDE} m*sin(w*time + {PHASE!r} rad);
coordinate Length y = {AMPLITUDE * math.sin(PHASE)!r} m;
initial der(y) = {UP!r} m/s;
kinetic 1/2*1 kg*der(y)^2;
potential 1 kg*9.81 m/s^2*y;
contact table: y - plate restitution {E};
experiment(stop = {PERIOD * 500.5!r} s, tolerance = 1e-10);
"""


def thrown(s: Solution) -> float:
    """Largest deviation of an impact from a multiple of the period, in periods, and missing ones."""
    times = np.array([event.time for event in s.events if event.kind == "impact"]) / PERIOD
    wanted = np.arange(1, 501)
    return float(np.abs(times - wanted).max()) if times.shape == wanted.shape else math.inf


# A slender block that rocks without bouncing: each impact leaves 1 - 3/2 sin^2(slenderness) of the rate.
ROCKING = """
parameter b = 0.1 m;
parameter h = 0.5 m;
parameter m = 1 kg;
gravity {0, -9.81 m/s^2};
coordinate Angle a = 0.05 rad;
coordinate Length x = -b + b*cos(0.05) - h*sin(0.05);
coordinate Length y = b*sin(0.05) + h*cos(0.05);
frame block = world * trans({x, y}) * rot(a);
mass m at block;
inertia m*(b^2 + h^2)/3 on block;
point left = block * {-b, -h};
point right = block * {b, -h};
contact l: left[2] restitution 0 friction 5 along der(left[1]);
contact r: right[2] restitution 0 friction 5 along der(right[1]);
experiment(stop = 1.5 s, tolerance = 1e-11);
"""


def rocking(s: Solution) -> float:
    """Deviation of the ratio of rates at each of the first impacts."""
    ratio = 1 - 1.5 * 0.1**2 / (0.1**2 + 0.5**2)
    found = [
        event.after["der(a)"] / event.before["der(a)"]
        for event in s.events
        if event.kind == "impact" and abs(event.before.get("der(a)", 0.0)) > 0.05
    ]
    return max((abs(x - ratio) for x in found), default=math.inf)


CHATTER = """
coordinate Length x = 1 m;
initial der(x) = 0.2 m/s;
kinetic 1/2*1 kg*der(x)^2;
force -(1 N)*sign(x + (1 s)*der(x)) on x;
experiment(stop = 20 s);
"""


def bounced(count: int) -> str:
    return BALL.format(e=1, floor=CONTACT, stop=count * 2 * FALL)


CASES = (
    Case(
        "ball to rest, e = 0.5",
        "infinitely many bounces in a finite time",
        BALL.format(e=0.5, floor=CONTACT, stop=5),
        Measured("comes to rest at (1 + e)/(1 - e) falls, to 1e-10", rests, 1e-10),
        fault="missed events",
    ),
    Case(
        "ball to rest, e = 0.999",
        "20 000 bounces before it rests",
        BALL.format(e=0.999, floor=CONTACT, stop=1000),
        Measured("comes to rest at (1 + e)/(1 - e) falls, to 1e-7", rests, 1e-7),
        fault="missed events",
    ),
    Case(
        "ball without a contact",
        "bounces written as raw events pile up",
        BALL.format(e=0.8, floor=RAW, stop=5),
        Refusal("stops at the limit of the bounces and advises a contact", ("h < 0 m", "contact"),
                (8.99 * FALL, 9.01 * FALL)),
        fault="no refusal",
    ),
    Case(
        "10 000 elastic bounces",
        "an error instead of one impact stays for ever",
        bounced(10_000),
        Measured("all intervals to 1e-9, none missed", period, 1e-9, (happens("impact", 10_000),)),
        fault="missed events",
    ),
    Case(
        "ball on a vibrating plate",
        "thrown once a period, 500 times, by a plate that accelerates with 1.2 g",
        PLATE,
        Measured("every impact at a multiple of the period, to 1e-8 of it", thrown, 1e-8),
        fault="missed events",
    ),
    Case(
        "rocking block",
        "one corner leaves the ground in the instant in which the other one hits it",
        ROCKING,
        Measured("Housner's ratio of rates at each impact, to 1e-9", rocking, 1e-9),
        fault="missed events",
    ),
    Case(
        "sliding along a switch",
        "a relay: its surface attracts from both sides, the switch would turn for ever",
        CHATTER,
        Refusal("stops where it begins to slide, and advises friction", ("to and fro", "friction"), (0, 5)),
        fault="no refusal",
    ),
)  # fmt: skip
