"""A drive train with losses by other equations: Coulomb's law of five places that slip or stick, solved for each combination; SciPy's DOP853 between events.

Torques on six rotors of 2 kg.m^2: ``bearing`` on the third, ``gear`` from the fourth into the gear, ``clutch`` from the gear to the
fifth, ``pawl`` from there to the sixth (a freewheel and a clutch beside it), ``brake`` on the sixth. Each place slips forwards (1),
backwards (-1) or not at all (0).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from itertools import product
from typing import Any, NamedTuple

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import minimize_scalar

Vector = np.ndarray[Any, Any]
Modes = tuple[int, ...]
GEAR, CLUTCH, PAWL = 1, 2, 3
SLIPS = np.array(
    [[0, 0, 1, 0, 0, 0], [0, 0, 0, 1, 0, 0], [0, 0, 0, -0.5, 1, 0], [0, 0, 0, 0, -1, 1], [0, 0, 0, 0, 0, 1]]
)
"""Slip of each place by the speeds of the rotors; the gear turns 2 to 1."""
ACTS = np.array([[0, 0, 0, 0, 0]] * 2 + [[-1, 0, 0, 0, 0], [0, -1, 0, 0, 0], [0, 0, 1, -1, 0], [0, 0, 0, 1, -1]])  # fmt: skip
"""Torque on each rotor by the torques at the places."""
REST = 1e-10
"""Slower than that is at rest, rad/s."""


class State(NamedTuple):
    """What holds at a moment: accelerations, torques at the places, how far each is from slipping forwards and backwards, heat."""

    accelerations: Vector
    torques: Vector
    margins: list[tuple[float, float]]
    heat: float


class Law(NamedTuple):
    """What the frictions allow: share ``eta`` that the gear lets pass, its ``drag``, how far the clutches are pressed."""

    eta: float
    drag: float
    pressed: float

    def into(self, x: float) -> float:
        """Torque into the gear for the torque x out of it and its drag."""
        return x / self.eta if x > 0 else x * self.eta

    def margins(self, x: Vector) -> list[tuple[float, float]]:
        """How far torques are from those at which each place slips."""
        out, u = x[CLUTCH] / 2, self.pressed
        return [
            (1 - x[0], 1 + x[0]),
            (self.into(self.drag + out) - x[GEAR], x[GEAR] + self.into(self.drag - out)),
            (x[CLUTCH] + 5 * u, 5 * u - x[CLUTCH]),
            (x[PAWL] + 0.5 * u, np.inf),
            (u - x[4], u + x[4]),
        ]

    def row(self, place: int, side: int, steep: bool) -> tuple[list[float], float]:
        """Linear equation of the torques where a place slips towards a side."""
        u, ratio = self.pressed, 1 / self.eta if steep else self.eta
        rows: list[tuple[list[float], float]] = [
            ([1, 0, 0, 0, 0], side),
            ([0, side, -ratio * side / 2, 0, 0], ratio * self.drag),
            ([0, 0, 1, 0, 0], -side * 5 * u),
            ([0, 0, 0, 1, 0], -0.5 * u),
            ([0, 0, 0, 0, 1], side * u),
        ]
        return rows[place]


def state(t: float, y: Vector, modes: Modes) -> State | None:
    """Solve Newton's law with what each place does, or return None if nothing solves it."""
    q, w = y[:6], y[6:12]
    first, play = w[1] - w[0], q[2] - q[1]
    spring = 1e5 * (play - np.clip(play, -5e-4, 5e-4))
    damper = float(np.clip(100 * (w[2] - w[1]), -abs(spring), abs(spring)))
    torque1, torque3 = 1e4 * (q[1] - q[0]) + 20 * first, 1e4 * (q[3] - q[2])
    outer = 20 * np.sin(10 * np.pi * t) - 10 * w[0]
    mesh = spring + damper
    base = np.array([outer + torque1, mesh - torque1, torque3 - mesh, -torque3, 0, 0])
    law = Law(0.8 - 0.1 * abs(w[3]), 1 + abs(w[3]), float(np.sin(0.4 * np.pi * t)))
    for steep in (True, False) if modes[GEAR] else (True,):
        rows, right = np.empty((5, 5)), np.empty(5)
        for i, mode in enumerate(modes):
            if mode:
                rows[i], right[i] = law.row(i, mode, steep)
            else:
                rows[i], right[i] = SLIPS[i] @ ACTS / 2, -SLIPS[i] @ base / 2
        x = np.linalg.lstsq(rows, right, rcond=1e-12)[0]
        if np.abs(rows @ x - right).max() > 1e-9 * (1 + np.abs(right).max()):
            continue
        x = allowed(law, rows, x, modes)
        if modes[GEAR] and (law.drag + modes[GEAR] * x[CLUTCH] / 2 > 0) != steep:
            continue
        heat = 10 * w[0] ** 2 + 20 * first**2 + damper * (w[2] - w[1])
        slips = SLIPS @ w
        heat += x[0] * w[2] + (x[GEAR] - x[CLUTCH] / 2) * w[3] - x[CLUTCH] * slips[CLUTCH]
        heat += x[4] * w[5] - x[PAWL] * slips[PAWL]
        return State((base + ACTS @ x) / 2, x, law.margins(x), heat)
    return None


def allowed(law: Law, rows: Vector, x: Vector, modes: Modes) -> Vector:
    """Where places at rest share a torque in more than one way, the way that is farthest from slipping."""
    _, singular, turned = np.linalg.svd(rows)
    free = turned[singular < 1e-12]
    if len(free) == 0:
        return x
    assert len(free) == 1

    def nearest(share: float) -> float:
        found = law.margins(x + share * free[0])
        return -min(min(pair) for pair, mode in zip(found, modes, strict=True) if mode == 0)

    best = minimize_scalar(nearest, bounds=(-20, 20), method="bounded", options={"xatol": 1e-12})
    return np.array(x + best.x * free[0])


def after(t: float, y: Vector, before: Modes, forced: Mapping[int, int]) -> Modes:
    """Return what the places do after an event: sticks bear their torques, and slips at rest begin towards their side."""
    slips = SLIPS @ y[6:12]
    choices: list[tuple[int, ...]] = []
    for i in range(5):
        if i in forced:
            choices.append((forced[i],))
        elif abs(slips[i]) > REST:
            choices.append((int(np.sign(slips[i])),))
        else:
            choices.append((0, 1) if i == PAWL else (0, 1, -1))
    found = []
    for modes in product(*choices):
        now = state(t, y, modes)
        if now is None:
            continue
        growth = SLIPS @ now.accelerations
        fits = [
            abs(slips[i]) > REST
            or (
                min(now.margins[i]) > -1e-9
                if mode == 0
                else mode * growth[i] > (-1e-7 if i in forced else 1e-9)
            )
            for i, mode in enumerate(modes)
        ]
        if all(fits):
            found.append(modes)
    return min(found, key=lambda modes: sum(a != b for a, b in zip(modes, before, strict=True)))


def watched(start: float, place: int, side: int, modes: Modes) -> Callable[[float, Vector], float]:
    """Return the event at which a slip ends, or a stick gives way towards a side."""

    def event(t: float, y: Vector) -> float:
        if t <= start:  # it begins with what was the event before
            return 1e-300 * (modes[place] or 1)
        if modes[place]:
            return float(SLIPS[place] @ y[6:12])
        now = state(t, y, modes)
        assert now
        return now.margins[place][0 if side > 0 else 1]

    event.terminal = True  # type: ignore[attr-defined]
    event.direction = -(modes[place] or 1)  # type: ignore[attr-defined]
    return event


def losses(times: Sequence[float], tolerance: float = 1e-11) -> dict[str, Any]:
    """Return the motion from rest, and the heat of all places, at ``times`` above 0."""
    t, y = 0.0, np.zeros(13)
    modes: Modes = after(t, y, (0,) * 5, {})
    found: list[Vector] = []

    def right(t: float, y: Vector) -> Vector:
        now = state(t, y, modes)
        assert now
        return np.concatenate([y[6:12], now.accelerations, [now.heat]])

    while True:
        ends = [(i, side) for i, mode in enumerate(modes) for side in ((mode,) if mode else (1, -1)[: 1 if i == PAWL else 2])]  # fmt: skip
        events = [watched(t, i, side, modes) for i, side in ends]
        way = solve_ivp(right, (t, times[-1]), y, "DOP853", [x for x in times if x > t], events=events, rtol=tolerance, atol=tolerance / 100, max_step=2e-3)  # fmt: skip
        found += list(np.array(way.y).T)
        if way.status == 0:
            break
        which = next(k for k, at in enumerate(way.t_events) if len(at))
        place, side = ends[which]
        t, y = float(way.t_events[which][0]), way.y_events[which][0].copy()
        # What is at rest is exactly so; what gives way together with another one is at its limit, too.
        held = SLIPS[[i for i, mode in enumerate(modes) if mode == 0 or i == place]]
        y[6:12] -= held.T @ np.linalg.lstsq(held @ held.T, held @ y[6:12], rcond=1e-12)[0]
        forced = {}
        if modes[place] == 0:
            now = state(t, y, modes)
            assert now
            forced = {i: s for i, mode in enumerate(modes) if mode == 0 for s, left in zip((1, -1), now.margins[i], strict=True) if left < 1e-6}  # fmt: skip
            forced[place] = side
        modes = after(t, y, modes, forced)
    q = np.array(found).T
    w = q[6:12]
    return {
        "damper.phi_rel": q[0],
        "springDamper.phi_rel": q[1] - q[0],
        "springDamper.w_rel": w[1] - w[0],
        "elastoBacklash.phi_rel": q[2] - q[1],
        "clutch.phi_rel": q[4] - q[3] / 2,
        "clutch.w_rel": w[4] - w[3] / 2,
        "inertia5.phi": q[4],
        "inertia5.w": w[4],
        "oneWayClutch.phi_rel": q[5] - q[4],
        "oneWayClutch.w_rel": w[5] - w[4],
        "heat": q[12],
    }
