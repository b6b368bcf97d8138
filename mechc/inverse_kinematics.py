"""Coordinates that bring a frame to a pose: least squares with damping (K. Levenberg 1944, D. W. Marquardt 1963), within limits, from
several starts."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

from .functions import Functions
from .requests.parse_values import UsageMistake
from .suggest import suggest

Array = NDArray[np.float64]

MOST_STEPS = 200
LEAST_DAMPING, MOST_DAMPING = 1e-12, 1e8


class Reached(Struct, frozen=True, eq=False):
    """``y``: a state at rest whose coordinates are ``q``, by name in ``values``; ``error``: how far the frame is off, in m and rad;
    ``reached``: less than was asked for; ``starts`` and ``steps`` that it took."""

    y: Array
    q: Array
    values: Mapping[str, float]
    error: float
    reached: bool
    starts: int
    steps: int


class Target(Struct, frozen=True, eq=False):
    """A pose that is wanted; None: free."""

    position: Array | None
    rotation: Array | None


class _Search:
    def __init__(
        self,
        f: Functions,
        frame: str,
        target: Target,
        limits: Mapping[str, tuple[float, float]],
        held: set[str],
    ) -> None:
        self.f, self.frame, self.target = f, f.frame(frame), target
        problem = f._problem
        rotations = {k for first in problem.rotations for k in range(first, first + 4)}
        places = [k for k in range(problem.nq) if k not in rotations and problem.states[k].name not in held]
        columns = {q: v for v, q in enumerate(problem.partner)}
        self.places, self.columns = places, [columns[k] for k in places]
        names = [problem.states[k].name for k in places]
        for name in limits.keys() - set(names):
            raise UsageMistake(f"'{name}' is not a coordinate that may move{suggest(name, names)}")
        stated = [(problem.states[k].minimum, problem.states[k].maximum) for k in places]
        given = [limits.get(n, own) for n, own in zip(names, stated, strict=True)]
        self.low = np.array([-math.inf if a is None else a for a, _ in given])
        self.high = np.array([math.inf if b is None else b for _, b in given])
        self.loops = len(problem.constraints) > 0 and hasattr(f, "constraints")
        self.angles = np.array([problem.states[k].unit == "rad" for k in places])
        if target.rotation is not None and self.frame.rotation is None:
            raise UsageMistake(f"'{frame}' is a point, which has no rotation")

    def residual(self, y: Array) -> tuple[Array, Array]:
        """Give what is off, and its derivatives by the coordinates that move."""
        f, frame, target = self.f, self.frame, self.target
        jacobian = frame.jacobian(y)
        size = len(frame.position(y))
        off, rows = [], []
        if target.position is not None:
            off.append(frame.position(y) - target.position)
            rows.append(jacobian[:size])
        if target.rotation is not None:
            assert frame.rotation is not None
            off.append(_turn(frame.rotation(y) @ target.rotation.T))
            rows.append(jacobian[size:])
        if self.loops:
            count = len(f.constraints(y)) - len(f.constraint_jacobian(y))
            off.append(f.constraints(y)[:count])
            rows.append(f.constraint_jacobian(y)[:count])
        return np.concatenate(off), np.concatenate(rows)[:, self.columns]

    def search(self, q: Array, tolerance: float) -> tuple[Array, float, int]:
        """Go from coordinates downhill; give where that ends, what is off there, and the steps."""
        y = self.f.start.copy()
        y[self.f._problem.nq :] = 0.0
        y[self.places] = q = np.clip(q, self.low, self.high)
        off, rows = self.residual(y)
        damping, steps = 1e-3, 0
        while float(np.linalg.norm(off)) > tolerance and steps < MOST_STEPS and damping < MOST_DAMPING:
            steps += 1
            slope = rows.T @ off
            free = ~((q <= self.low) & (slope > 0) | (q >= self.high) & (slope < 0))
            if not free.any() or float(np.abs(slope[free]).max()) < 1e-14:
                break
            part = rows[:, free]
            change = np.zeros_like(q)
            change[free] = -np.linalg.solve(part.T @ part + damping * np.eye(part.shape[1]), slope[free])
            there = np.clip(q + change, self.low, self.high)
            y[self.places] = there
            new, new_rows = self.residual(y)
            if float(new @ new) < float(off @ off):
                q, off, rows, damping = there, new, new_rows, max(damping / 10, LEAST_DAMPING)
            else:
                damping *= 10
        return q, float(np.linalg.norm(off)), steps

    def start(self, random: np.random.Generator) -> Array:
        """Draw coordinates: within their limits, else all around or within a metre of the start."""
        here = self.f.start[self.places]
        wide = np.where(self.angles, math.pi, 1.0)
        low = np.where(np.isfinite(self.low), self.low, np.where(self.angles, -wide, here - wide))
        high = np.where(np.isfinite(self.high), self.high, np.where(self.angles, wide, here + wide))
        return np.asarray(low + (high - low) * random.random(len(here)))


def _turn(rotation: Array) -> Array:
    """Return the rotation vector of a matrix, in the plane the angle."""
    if len(rotation) == 2:
        return np.array([math.atan2(rotation[1, 0], rotation[0, 0])])
    from scipy.spatial.transform import Rotation

    return np.asarray(Rotation.from_matrix(rotation).as_rotvec())


def find_pose(
    f: Functions,
    frame: str,
    position: Any = None,
    rotation: Any = None,
    *,
    start: Any = None,
    limits: Mapping[str, tuple[float, float]] | None = None,
    held: Any = (),
    starts: int = 20,
    tolerance: float = 1e-9,
    seed: int = 1,
) -> Reached:
    """See ``Model.ik``."""
    target = _target(f, frame, position, rotation)
    search = _Search(f, frame, target, limits or {}, {held} if isinstance(held, str) else set(held))
    random = np.random.default_rng(seed)
    q = f.start[search.places] if start is None else np.asarray(start, dtype=float)
    if q.shape != (len(search.places),):
        names = ", ".join(f._problem.states[k].name for k in search.places)
        raise UsageMistake(f"'start' has a number for each of {names}, not the shape {q.shape}")
    best, off, total, begun = q, math.inf, 0, 0
    while begun < starts:
        found, error, steps = search.search(q, tolerance)
        total, begun = total + steps, begun + 1
        if error < off:
            best, off = found, error
        if off <= tolerance:
            break
        q = search.start(random)
    y = f.start.copy()
    y[f._problem.nq :] = 0.0
    y[search.places] = best
    moved = [f._problem.states[k].name for k in search.places]
    return Reached(y, best, dict(zip(moved, best.tolist(), strict=True)), off, off <= tolerance, begun, total)


def _target(f: Functions, frame: str, position: Any, rotation: Any) -> Target:
    if position is None and rotation is None:
        raise UsageMistake(
            "a pose is a position, a rotation, or both", 'as in model.ik("tool", [0.4, 0, 0.3])'
        )
    size = len(f.frame(frame).position(f.start))
    place = turn = None
    if position is not None:
        place = np.asarray(position, dtype=float)
        if place.shape != (size,):
            raise UsageMistake(f"the position of '{frame}' has {size} numbers, not the shape {place.shape}")
    if rotation is not None:
        turn = np.asarray(rotation, dtype=float)
        if turn.shape != (size, size) or not np.allclose(turn @ turn.T, np.eye(size), atol=1e-9):
            raise UsageMistake(f"the rotation is an orthogonal matrix of {size} rows and columns")
    return Target(place, turn)
