"""Places where two features meet: answers in forces, bends in gaps, sizes, ticks, narrow regions."""

from __future__ import annotations

import math

import numpy as np

from .case import Case, Known, happens

NUMBER = 24
TITLE = "Where features meet"

BRAKE = """
coordinate Length x = 0 m;
initial der(x) = 2 m/s;
kinetic 1/2*1 kg*der(x)^2;
force -0.5*kinetic_energy()/(1 m) on x;
experiment(stop = 5 s);
"""
HINGE = """
import mech.planar.*;
gravity {0, 0};
Body plate(m = 1 kg, J = 1 kg.m^2, com = {1 m, 0 m});
Revolute pin(world -> plate.a, angle = 0 rad, der(angle) = 2 rad/s);
potential 50 N*norm(pos(plate.a*{0 m, 0 m}) - {3 m, 4 m});
output R = reaction(pin);
experiment(stop = 1 s);
"""
EDGE = """
coordinate Length x = 0 m;
coordinate Length y = 0 m;
initial der(x) = 1 m/s;
kinetic 1/2*1 kg*(der(x)^2 + der(y)^2);
potential 1 kg*9.81 m/s^2*y;
contact table: max(y, x - 1 m);
experiment(stop = 2 s);
"""
GROOVE = """
coordinate Length x = 0.3 m;
coordinate Length y = 1 m;
kinetic 1/2*1 kg*(der(x)^2 + der(y)^2);
potential 1 kg*9.81 m/s^2*y;
contact g: min(y - x, y + x) restitution 0.5;
output push = multiplier(g);
experiment(stop = 5 s);
"""
TABLE = """
gravity {0, 0, -9.81} m/s^2;
coordinate Length x = 0 m;
coordinate Length y = 0 m;
coordinate Length z = 0.5 m;
coordinate Rotation R = rotz(0 rad);
initial der(x) = 1 m/s;
frame top = world * trans({x, y, z}) * R;
mass 1 kg at top;
inertia diag({0.1, 0.1, 0.2} kg.m^2) on top;
let legs = {{0.5, 0.5, -0.1}, {-0.5, 0.5, -0.1}, {-0.5, -0.5, -0.1}, {0.5, -0.5, -0.1}}*1 m;
for i in 1:4 loop
  contact leg[i]: pos(top*legs[i])[3] friction 0.6 along {vel(top*legs[i])[1], vel(top*legs[i])[2]};
end for;
experiment(stop = 1 s);
"""
TICKS = """
discrete Integer n = 0;
discrete Integer seen = 0;
coordinate Length x = 0 m;
kinetic 1/2*1 kg*der(x)^2;
force (if seen > 0 then 1 N else 1 N) on x;
when sample(0.1 s) then
  n := n + 1;
end when;
when sample(0.3 s) then
  seen := seen + n;
end when;
output late = seen + 0.0;
experiment(stop = 9.05 s);
"""
WAVES = """
coordinate x = 1;
kinetic 1/2*1 kg.m^2*der(x)^2;
output I = integral(cos(200*s) for s in 0:x);
experiment(stop = 1 s);
"""
WEAK = """
coordinate Length x = 0 m;
coordinate Length y = 1e7 m;
kinetic 1/2*1 kg*(der(x)^2 + der(y)^2);
potential 1/2*40 N/m*x^2 + 1/2*1 N/m*y^2;
force 1e-14 N/m*y on x;
experiment(stop = 10 s);
"""
BUMP = """
coordinate Length x = -30 m;
initial der(x) = 1 m/s;
kinetic 1/2*1 kg*der(x)^2;
potential 1 J*exp(-(x/5 mm)^2);
experiment(stop = 60 s);
"""


def weak(t: np.ndarray) -> np.ndarray:
    return 1e-7 / 39 * (np.cos(t) - np.cos(math.sqrt(40) * t))


# sample(0.3 s) is at 0, 0.3 ..., 9.0 s, where sample(0.1 s) has counted 1, 4, ... 91, itself included
SEEN = float(sum(3 * k + 1 for k in range(31)))

CASES = (
    Case(
        "brake by the energy",
        "a question about the motion is a force",
        BRAKE,
        Known("the speed 2/(1 + t/2) all along, to 1e-7", {"der(x)": lambda t: 2 / (1 + t / 2)}, 1e-7),
        fault="sign",
    ),
    Case(
        "hinge under a field",
        "what acts is an energy written as a formula",
        HINGE,
        Known(
            "the hinge holds 50 N from (3, 4) m and what turns, to 1e-7",
            {"R[1]": lambda t: -30 - 4 * np.cos(2 * t), "R[2]": lambda t: -40 - 4 * np.sin(2 * t)},
            1e-7,
        ),
        fault="moved start",
    ),
    Case(
        "off a table",
        "the gap of a closed contact bends",
        EDGE,
        Known("flies on from the edge, to 1e-9", {"x": 2.0, "y": -9.81 / 2}, 1e-9),
        fault="missed events",
    ),
    Case(
        "bounces in a groove",
        "two sides in one gap, both closed at the end",
        GROOVE,
        Known("comes to rest in the corner", {"x": 0.0, "y": 0.0, "push": 9.81}, 1e-9, (happens("rest", 2),)),
        fault="one gap",
    ),
    Case(
        "table falls on four legs",
        "more contacts and frictions than determine the impact",
        TABLE,
        Known(
            "stops where it falls, and does not turn, to 1e-9",
            {"x": math.sqrt(0.8 / 9.81), "y": 0.0, "R[4]": 0.0},
            1e-9,
        ),
        fault="first come",
    ),
    Case(
        "ticks that belong together",
        "every third tick of 0.1 s is one of 0.3 s",
        TICKS,
        Known("the order of the text at each of 31 instants", {"late": SEEN}, 0.0),
        fault="missed times",
    ),
    Case(
        "64 waves in an integral",
        "the bound is a coordinate",
        WAVES,
        Known("its value, to 1e-9 of what is integrated", {"I": math.sin(200) / 200}, 1e-9, sizes={"I": 1.0}),
        fault="moved start",
    ),
    Case(
        "weakly driven by 1e7 m",
        "a length of 5e-9 m beside one of 1e7 m, 1e-14 N/m between them",
        WEAK,
        Known("the small one, to 1e-6 of its range", {"x": weak}, 1e-6),
        fault="own size ignored",
    ),
    Case(
        "bump of 5 mm",
        "met at 1 m/s after a way of 30 m",
        BUMP,
        Known("is thrown back, to 1e-6", {"der(x)": -1.0}, 1e-6),
        fault="passed over",
    ),
)
