"""Stiff contacts, several hits at once, and friction without a solution."""

from __future__ import annotations

import math

import mpmath

from .case import Case, Known, Measured, energy_drift

NUMBER = 18
TITLE = "Stiff contact, many impacts, Painleve"

PENALTY = """
parameter k = {k} {unit};
coordinate Length x = 0 m;
coordinate Length y = 1 m;
initial der(x) = 1 m/s;
kinetic 1/2*1 kg*der(x)^2 + 1/2*3 kg*der(y)^2;
let depth = x - y + 0.1 m;
potential if depth > 0 m then {law} else 0 J;
experiment(stop = 2 s, tolerance = 1e-10);
"""
AFTER = {"der(x)": -0.5, "der(y)": 0.5}

DAMPED = """
parameter k = 1e12 N/m;
parameter c = 1e4 N.s/m;
coordinate Length h = 1 m;
kinetic 1/2*1 kg*der(h)^2;
potential 1 kg*9.81 m/s^2*h;
force (if h < 0 m then -k*h - c*der(h) else 0 N) on h;
experiment(stop = 1 s, tolerance = 1e-10);
"""


def rebound() -> float:
    """Height at 1 s after one bounce: a damped oscillator as long as h < 0, with 40 digits."""
    with mpmath.workdps(40):
        k, c, g = mpmath.mpf(10) ** 12, mpmath.mpf(10) ** 4, mpmath.mpf("9.81")
        fall, speed = mpmath.sqrt(2 / g), mpmath.sqrt(2 * g)
        w = mpmath.sqrt(k - c * c / 4)

        def inside(t: mpmath.mpf) -> mpmath.mpf:  # in nm
            swing = g / k * mpmath.cos(w * t) + (g * c / (2 * k) - speed) / w * mpmath.sin(w * t)
            return 10**9 * (swing * mpmath.exp(-c / 2 * t) - g / k)

        leaves = mpmath.findroot(inside, (mpmath.pi / w, 1.00001 * mpmath.pi / w))
        flight = 1 - fall - leaves
        return float(
            mpmath.diff(inside, leaves, h=mpmath.mpf(10) ** -20) / 10**9 * flight - g / 2 * flight**2
        )


BALLS = """
structural parameter Integer n = 3;
coordinate Length x[n] = {{if i == 1 then -1 m else (i - 2)*(1 m) for i in 1:n}};
initial der(x[1]) = 1 m/s;
for i in 1:n loop
  kinetic 1/2*(1 kg)*der(x[i])^2;
end for;
for i in 1:n-1 loop
  contact hit[i]: x[i+1] - x[i] - (if i == 1 then 0 m else 1 m) restitution 1, impacts = "{law}";
end for;
experiment(stop = 1.5 s);
"""


def speeds(*values: float) -> dict[str, float]:
    return {f"der(x[{i}])": v for i, v in enumerate(values, start=1)}


ONES = dict.fromkeys(("der(x[1])", "der(x[2])", "der(x[3])"), 1.0)

ROD = """
parameter mu = {mu};
gravity {{0, -9.81 m/s^2}};
coordinate Angle th = {angle} deg;
coordinate Length x = 0 m;
coordinate Length y = {height!r} m;
initial der(x) = {speed} m/s;
frame rod = world * trans({{x, y}}) * rot(th);
mass 1 kg at rod;
inertia 1 kg*(2 m)^2/12 on rod;
point foot = rod * {{-1 m, 0 m}};
contact ground: foot[2] restitution 0 friction mu along der(foot[1]);
experiment(stop = 1 s);
"""


def rod(angle: float, mu: float, speed: float) -> str:
    return ROD.format(angle=angle, mu=mu, speed=speed, height=math.sin(math.radians(angle)))


# Rod of half length 1 and mass 1, J = 1/3, foot at (-cos, -sin) from its centre, sliding to the left with friction +mu N:
# the foot is pushed down by its own friction where 1 + 3 cos^2 - 3 mu sin cos < 0.
PAINLEVE = 63.0


CASES = (
    Case(
        "two bodies, spring contact 1e12",
        "touch for 3e-6 s within a run of 2 s",
        PENALTY.format(k=1e12, unit="N/m", law="1/2*k*depth^2"),
        Known("leave with the speeds of an elastic impact, to 1e-7", AFTER, 1e-7),
        fault="missed events",
    ),
    Case(
        "two bodies, Hertz's contact",
        "stiffness 1e12 N/m^1.5, force depth^1.5, undefined when open",
        PENALTY.format(k=1e12, unit="N/m^1.5", law="2/5*k*depth^2.5"),
        Known("leave with the speeds of an elastic impact, to 1e-7", AFTER, 1e-7),
        fault="missed events",
    ),
    Case(
        "ball on a stiff damped ground",
        "1e12 N/m and 1e4 N.s/m: a bounce takes 3e-6 s",
        DAMPED,
        Known("the height after one bounce, to 1e-8", {"h": rebound()}, 1e-8),
        fault="missed events",
    ),
    Case(
        "three balls, one after the other",
        "two hits in one instant",
        BALLS.format(law="sequential"),
        Known("the last one takes all", speeds(0, 0, 1), 1e-12, sizes=ONES),
        fault="missed events",
    ),
    Case(
        "three balls at once",
        "two hits in one instant, solved together",
        BALLS.format(law="simultaneous"),
        Known("-1/3, 2/3, 2/3", speeds(-1 / 3, 2 / 3, 2 / 3), 1e-12, sizes=ONES),
        fault="missed events",
    ),
    Case(
        "Painleve's rod, inconsistent",
        "steep, rough, sliding so that friction drives the foot into the ground",
        rod(PAINLEVE, 3, -1),
        Measured("an impact ends the slip, and the energy keeps its balance, to 1e-9", energy_drift, 1e-9),
        fault="sign",
        options={"stop": 0.1},
    ),
    Case(
        "Painleve's rod, less friction",
        "the same rod with a friction just below the critical one",
        rod(PAINLEVE, 1.2, -1),
        Measured("slides and keeps the balance of its energy, to 1e-9", energy_drift, 1e-9),
        fault="sign",
        options={"stop": 0.1},
    ),
)
