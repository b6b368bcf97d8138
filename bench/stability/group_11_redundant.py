"""Mechanisms whose constraints repeat one another."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from .case import Array, Case, Known, Measured, drift

NUMBER = 11
TITLE = "Redundant constraints"

DATA = Path(__file__).parents[2] / "tests" / "physics" / "data"


def published(name: str, at: float) -> dict[str, float]:
    """Return the published values at one time."""
    points = json.loads((DATA / f"{name}.json").read_text(encoding="utf-8"))["references"]
    (point,) = (p for p in points if float(p["t"]) == at)
    return {key: float(value) for key, value in point["values"].items() if key != "note"}


BRICARD = published("iftomm_a04_bricard", 10.0)

POSTS = """
import mech.planar.*;
structural parameter Integer n = 5;
Bar post[n](m = 1 kg, l = 1 m);
Bar table(m = 3 kg, l = 4 m);
Revolute foot(world -> post[1].a, angle = 60 deg, der(angle) = 1 rad/s);
Revolute knee(post[1].b -> table.a, angle ~ -60 deg);
Revolute stand[i in 1:n-1](world * trans({i, 0} m) -> post[i+1].a, angle ~ 60 deg);
cut Revolute pin[i in 1:n-1](table.a * trans({i, 0} m) -> post[i+1].b);
experiment(stop = 1 s, tolerance = 1e-10);
"""


def even(t: Array) -> Any:
    return np.radians(60) + t


CASES = (
    Case(
        "Bricard's mechanism",
        "six equations for five hinges, one of them superfluous on the manifold only",
        "examples/bricard.mech",
        Known("the published place after 10 s, to 1e-8",
              {f"P3[{k}]": BRICARD[f"{axis}3"] for k, axis in enumerate("xyz", start=1)}, 1e-8,
              sizes=dict.fromkeys(("P3[1]", "P3[2]", "P3[3]"), 1.0)),
        fault="pushed",
        options={"tolerance": 1e-10},
    ),
    Case(
        "Bricard's mechanism for 200 s",
        "a long run on the redundant constraints",
        "examples/bricard.mech",
        Measured("keeps its energy to 1e-7", drift, 1e-7),
        fault="loose",
        options={"tolerance": 1e-10, "stop": 200},
    ),
    Case(
        "table on five posts",
        "three of eight loop equations are superfluous",
        POSTS,
        Known("turns evenly, to 1e-8", {"foot.angle": even}, 1e-8),
        fault="pushed",
    ),
)  # fmt: skip
