"""Closed chains that are started far from assembly, near a dead centre, or cannot be assembled."""

from __future__ import annotations

import numpy as np

from mechc.solution import Solution

from .case import Case, Measured, Refusal

NUMBER = 16
TITLE = "Assembly"

FOUR_BAR = """
import mech.planar.*;
gravity {{0, -9.81 m/s^2}};
Bar crank(m = 1 kg, l = 0.2 m);
Bar coupler(m = 2 kg, l = {coupler} m);
Bar rocker(m = 1.5 kg, l = 0.4 m);
frame pivot = world * trans({{0.5 m, 0 m}});
Revolute a(world -> crank.a, angle = {a});
Revolute b(crank.b -> coupler.a, angle ~ {b});
Revolute d(pivot -> rocker.a, angle ~ {d});
cut Revolute c(coupler.b -> rocker.b);
output gap = norm(pos(coupler.b) - pos(rocker.b));
output side = cross(pos(coupler.b) - pos(coupler.a), pos(rocker.a) - pos(coupler.a));
experiment(stop = 0.5 s, tolerance = 1e-10);
"""


def gap(s: Solution) -> float:
    return float(s["gap"].max())


def start(coupler: float, a: str, b: str, d: str) -> str:
    return FOUR_BAR.format(coupler=coupler, a=a, b=b, d=d)


OTHER = ("the guess's side is kept", lambda s: bool(s["side"][0] > 0))
ONE = ("the guess's side is kept", lambda s: bool(s["side"][0] < 0))

# crank and coupler stretched: with the rocker's angle d, the pivot at 0.5 and lengths 0.2 + 0.5 = 0.7 and 0.4
STRETCHED = float(np.degrees(np.arccos((0.7**2 + 0.5**2 - 0.4**2) / (2 * 0.7 * 0.5))))

TWO_PLACES = """
coordinate Length x ~ 0 m;
kinetic 1/2*1 kg*der(x)^2;
constraint here: x = 1 m;
constraint there: x = {there};
experiment(stop = 1 s);
"""

TWO_CIRCLES = """
parameter far = {far} m;
coordinate Length x ~ 0.5 m;
coordinate Length y ~ 0.5 m;
coordinate Length z = 0 m;
kinetic 1/2*1 kg*(der(x)^2 + der(y)^2 + der(z)^2);
constraint one: x^2 + y^2 = 1 m^2;
constraint two: (x - far)^2 + y^2 = 1 m^2;
experiment(stop = 1 s);
"""

RATES = """
coordinate Length x = 0 m;
coordinate Length y = -1 m;
initial der(x) = 1 m/s;
initial der(y) = 1 m/s;
kinetic 1/2*1 kg*(der(x)^2 + der(y)^2);
constraint rod: x^2 + y^2 = 1 m^2;
experiment(stop = 1 s);
"""

CASES = (
    Case(
        "guesses half a turn off",
        "the loop is open by twice its length",
        start(0.5, "60 deg", "150 deg", "-90 deg"),
        Measured("is closed, and stays so to 1e-8 m", gap, 1e-8),
        fault="not assembled",
    ),
    Case(
        "guesses many turns off",
        "angles of 1000 deg",
        start(0.5, "60 deg", "1000 deg", "-2000 deg"),
        Measured("is closed, and stays so to 1e-8 m", gap, 1e-8),
        fault="not assembled",
    ),
    Case(
        "near the dead centre, guessed above",
        "1e-3 deg from where both assemblies meet",
        start(0.5, f"{STRETCHED + 1e-3!r} deg", "-2 deg", "120 deg"),
        Measured("is closed to 1e-8 m", gap, 1e-8),
        fault="not assembled",
    ),
    Case(
        "one assembly",
        "two ways to close the loop",
        start(0.5, "60 deg", "-30 deg", "90 deg"),
        Measured("takes the guessed one", gap, 1e-8, (ONE,)),
        fault="not assembled",
    ),
    Case(
        "the other assembly",
        "two ways to close the loop",
        start(0.5, "60 deg", "-120 deg", "-60 deg"),
        Measured("takes the guessed one", gap, 1e-8, (OTHER,)),
        fault="not assembled",
    ),
    Case(
        "coupler too short",
        "no position closes the loop",
        start(0.03, "60 deg", "-30 deg", "90 deg"),
        Refusal("does not begin, and says which loop stays open by how much", ("'c[1]'", "m")),
        fault="not assembled",
    ),
    Case(
        "two places at once",
        "x = 1 and x = 2",
        TWO_PLACES.format(there="2 m"),
        Refusal("is refused, both constraints named", ("here", "there")),
        fault="not assembled",
    ),
    Case(
        "circles that do not meet",
        "two constraints without a common point",
        TWO_CIRCLES.format(far=3),
        Refusal("does not begin, the constraints named", ("one", "two")),
        fault="not assembled",
    ),
    Case(
        "rates that contradict a constraint",
        "a given velocity across the rod",
        RATES,
        Refusal("does not begin, the constraint named", ("rod",)),
        fault="not assembled",
    ),
)
