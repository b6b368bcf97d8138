"""Masses and inertias that change with time, as matter joins with the velocity of the body."""

from __future__ import annotations

import math

from random_models.operators import add, call, divide, multiply
from random_models.scope import Scope
from random_models.tree import INERTIA, MASS, NUMBER, TIME, Dim, E, Slot, reference

SHARE = 0.1
"""Of the models with bodies."""


def growing(s: Scope, seed: int) -> None:
    """Let something grow or shrink on a body. Its random numbers are its own: models keep all else."""
    if not s.space or not s.bodies:
        return
    with s.apart(f"growing of {seed}"):
        if s.chance(SHARE):
            for _ in range(s.pick((1, 1, 2))):
                _grow(s)


def _grow(s: Scope) -> None:
    body = s.pick(s.bodies)
    if s.space == 2 and body.type == "frame" and s.chance(0.4):
        s.add(
            "inertia",
            "inertia ",
            Slot("inertia.value", _in_time(s, INERTIA)),
            " on ",
            Slot("inertia.on", body),
            ";",
        )
        return
    places = [f for f in s.frames if f.ref != "world"] or [body]
    at = s.pick(places) if s.chance(0.6) else body
    s.add("mass", "mass ", Slot("mass.value", _in_time(s, MASS)), " at ", Slot("mass.at", at), ";")


def _in_time(s: Scope, d: Dim) -> E:
    """Return a positive size that changes with time, and is smooth."""
    t = divide(reference("time", "time", TIME, level="t"), s.value(TIME, s.number(0.4, 1.5)))
    share = s.literal(NUMBER, s.number(0.2, 0.8))
    if s.chance(0.5):
        grown: E = multiply(share, call("sin", t, value=math.sin))
    else:
        grown = multiply(share, call("tanh", t, value=math.tanh))
    return multiply(s.value(d, s.number(0.2, 1)), add(s.literal(NUMBER, s.number(1, 2)), grown))
