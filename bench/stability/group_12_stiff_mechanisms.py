"""Mechanisms with stiff springs and dampers."""

from __future__ import annotations

from .case import Case, Followed, Known, by, within
from .group_11_redundant import published

NUMBER = 12
TITLE = "Stiff mechanisms"

GOVERNOR = """
import mech.spatial.*;
parameter l = 1 m;
parameter k = {k} N/m;
parameter c = {c} N.s/m;
gravity {{0, 0, -9.81 m/s^2}};
coordinate Angle phi = 0 rad;
coordinate Angle left = 30 deg;
coordinate Angle right = 30 deg;
coordinate Length s = 0.5 m;
initial der(phi) = 2*pi*1 rad/s;
frame axis = world * rotz(phi);
point slider = axis * {{0 m, 0 m, -s}};
inertia diag({{1, 1, 30}} kg.m^2) on axis;
mass 5 kg at axis * {{l*sin(left), 0 m, -l*cos(left)}};
mass 5 kg at axis * {{-l*sin(right), 0 m, -l*cos(right)}};
mass 3 kg at slider;
let stretch_left = norm(axis * {{l/2*sin(left), 0 m, -l/2*cos(left)}} - slider) - 0.5 m;
let stretch_right = norm(axis * {{-l/2*sin(right), 0 m, -l/2*cos(right)}} - slider) - 0.5 m;
potential 1/2*k*(stretch_left^2 + stretch_right^2);
dissipation 1/2*c*(der(stretch_left)^2 + der(stretch_right)^2);
experiment(stop = 10 s);
"""

ANDREWS = published("andrews_squeezer", 0.03)
ANGLES = ("beta", "theta", "gamma", "phi", "delta", "omega", "epsilon")

LOOP = """
import mech.planar.*;
gravity {0, -9.81 m/s^2};
Bar crank(m = 1 kg, l = 0.2 m);
Bar coupler(m = 2 kg, l = 0.5 m);
Bar rocker(m = 1.5 kg, l = 0.4 m);
coordinate Length give = 0 m;
mass 0.1 kg at world * {0.5 m + give, 0 m};
potential 1/2*1e9 N/m*give^2;
damping 1e6 N.s/m on give;
frame pivot = world * trans({0.5 m + give, 0 m});
Revolute a(world -> crank.a, angle = 60 deg, der(angle) = 10 rad/s);
Revolute b(crank.b -> coupler.a, angle ~ -30 deg);
Revolute d(pivot -> rocker.a, angle ~ 90 deg);
cut Revolute c(coupler.b -> rocker.b);
experiment(stop = 2 s, tolerance = 1e-8);
"""

CASES = (
    Case(
        "flyball governor",
        "springs of 8e5 N/m with dampers of 4e4 N.s/m",
        GOVERNOR.format(k=8e5, c=4e4),
        Followed("follows the reference to 1e-5", 1e-5, (within(20_000),), seconds=20),
        fault="loose",
    ),
    Case(
        "flyball governor, 1000 times stiffer",
        "springs of 8e8 N/m with dampers of 4e7 N.s/m",
        GOVERNOR.format(k=8e8, c=4e7),
        Followed(
            "follows the reference to 1e-5, in as many steps", 1e-5, (by("radau5"), within(5000)), seconds=20
        ),
        fault="not switched",
        options={"tolerance": 1e-9},
    ),
    Case(
        "Andrews' squeezing mechanism",
        "accelerations of 1e5 rad/s^2 within 0.03 s; three loops",
        "examples/squeezing_mechanism.mech",
        Known("the published angles, to 1e-8", {name: ANDREWS[name] for name in ANGLES}, 1e-8),
        fault="no projection",
        options={"tolerance": 1e-9},
    ),
    Case(
        "Andrews' squeezing mechanism, implicitly",
        "the same by radau5",
        "examples/squeezing_mechanism.mech",
        Known("the published angles, to 1e-9", {name: ANDREWS[name] for name in ANGLES}, 1e-9),
        fault="loose",
        options={"tolerance": 1e-10, "method": "radau5"},
    ),
    Case(
        "four-bar on a stiff pivot",
        "a spring of 1e9 N/m and a damper of 1e6 N.s/m within a closed loop",
        LOOP,
        Followed(
            "follows the reference to 1e-5, implicitly", 1e-5, (by("radau5"), within(20_000)), seconds=20
        ),
        fault="not switched",
    ),
)
