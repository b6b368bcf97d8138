"""Models of what falls: boxes, rods, tables and quadrupeds on point feet, with friction and restitution."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

WEIGHT = 2 * 9.81

IN_THE_PLANE = """
model Drop
  parameter Length c[%d, 2] = {%s} m;
  coordinate Length x = 0 m;
  coordinate Length y = %.4f m;
  coordinate Angle a = %.3f deg;
  initial der(x) = %.3f m/s;
  initial der(a) = %.3f rad/s;
  kinetic 1/2*2 kg*(der(x)^2 + der(y)^2) + 1/2*%.5f kg.m^2*der(a)^2;
  potential 2 kg*9.81 m/s^2*y;
%s  output total = %s;
  experiment(stop = 6 s);
end Drop;
"""

IN_SPACE = """
import mech.spatial.*;
model Drop
  parameter Length foot[%(n)d, 3] = {%(feet)s} m;
  gravity {0, 0, -9.81} m/s^2;
  coordinate Length x = 0 m;
  coordinate Length y = 0 m;
  coordinate Length z = %(z).4f m;
  coordinate Rotation R = rotx(%(a).3f deg)*roty(%(b).3f deg);
  initial der(R) = {0, 0, %(w).3f rad/s};
  initial der(x) = %(v).3f m/s;
  frame box = world * trans({x, y, z}) * R;
  mass 2 kg at box;
  inertia diag({%(i).4f, %(j).4f, %(k).4f} kg.m^2) on box;
  for i in 1:%(n)d loop
    contact hit[i]: pos(box * {foot[i, 1], foot[i, 2], foot[i, 3]})[3] %(laws)s;
  end for;
  output total = sum({multiplier(hit[i]) for i in 1:%(n)d});
  output load[%(n)d] = {multiplier(hit[i]) for i in 1:%(n)d};
  experiment(stop = 6 s);
end Drop;
"""

SLIP = "along {vel(box * {foot[i, 1], foot[i, 2], foot[i, 3]})[1], vel(box * {foot[i, 1], foot[i, 2], foot[i, 3]})[2]}"


def rows(points: Sequence[tuple[float, ...]]) -> str:
    return ", ".join("{" + ", ".join(f"{x:.4f}" for x in point) + "}" for point in points)


def drop(seed: int) -> str:
    """Friction from 0.05 to 1.2, of every second model restitution up to 0.9."""
    rng = np.random.default_rng(seed)
    friction, restitution = rng.uniform(0.05, 1.2), rng.choice([0.0, rng.uniform(0, 0.9)])
    laws = f"restitution {restitution:.3f} friction {friction:.3f}"
    kind = ("box", "rod", "table", "quadruped", "solid box", "stool")[seed % 6]
    if kind in ("box", "rod"):
        w, h = (
            (rng.uniform(0.2, 0.6), rng.uniform(0.05, 0.8)) if kind == "box" else (rng.uniform(0.5, 1), 0.0)
        )
        corners = (
            [(w / 2, h / 2), (w / 2, -h / 2), (-w / 2, -h / 2), (-w / 2, h / 2)]
            if h
            else [(w / 2, 0.0), (-w / 2, 0.0)]
        )
        contacts = "".join(
            f"  contact g{k}: y + c[{k}, 1]*sin(a) + c[{k}, 2]*cos(a) {laws} along der(x + c[{k}, 1]*cos(a) - c[{k}, 2]*sin(a));\n"
            for k in range(1, len(corners) + 1)
        )
        total = " + ".join(f"multiplier(g{k})" for k in range(1, len(corners) + 1))
        height, inertia = math.hypot(w, h) / 2 + rng.uniform(0.02, 0.2), 2 * (w * w + h * h) / 12
        numbers = (height, rng.uniform(-40, 40), rng.uniform(-1, 1), rng.uniform(-2, 2), inertia)
        return IN_THE_PLANE % (len(corners), rows(corners), *numbers, contacts, total)
    if kind == "table":
        feet = [(0.2 * x, 0.15 * y, -0.1) for x, y in ((1, 1), (-1, 1), (-1, -1), (1, -1))]
    elif kind == "quadruped":
        feet = [
            (x * rng.uniform(0.2, 0.3), y * rng.uniform(0.1, 0.2), -0.35)
            for x, y in ((1, 1), (-1, 1), (-1, -1), (1, -1))
        ]
    elif kind == "solid box":
        size = rng.uniform(0.1, 0.3, 3)
        feet = [(a * size[0], b * size[1], c * size[2]) for a in (1, -1) for b in (1, -1) for c in (1, -1)]
    else:
        feet = [(0.2 * math.cos(2.1 * k), 0.2 * math.sin(2.1 * k), -0.1) for k in range(3)]
    mass = rng.uniform(0.5, 2) * np.array([0.02, 0.03, 0.04])
    settings = {
        "n": len(feet),
        "feet": rows(feet),
        "z": rng.uniform(0.12, 0.3) - min(foot[2] for foot in feet),
        "a": rng.uniform(-15, 15),
        "b": rng.uniform(-15, 15),
        "w": rng.uniform(-2, 2),
        "v": rng.uniform(-0.6, 0.6),
        "i": mass[0],
        "j": mass[1],
        "k": mass[2],
        "laws": f"{laws} {SLIP}",
    }
    return IN_SPACE % settings


def on_four_feet(height: float, heavy: float, angles: tuple[float, float], v: float, w: float) -> str:
    feet = [(0.2 * x, 0.15 * y, -height) for x, y in ((1, 1), (-1, 1), (-1, -1), (1, -1))]
    settings = {
        "n": 4,
        "feet": rows(feet),
        "z": height + 0.15,
        "a": angles[0],
        "b": angles[1],
        "w": w,
        "v": v,
    }
    settings |= {"i": 0.02 * heavy, "j": 0.03 * heavy, "k": 0.04 * heavy, "laws": f"friction 0.6 {SLIP}"}
    return IN_SPACE % settings
