"""Tangent vectors in the space of velocities: 2 nv + nx numbers, where a rotation has three and its quaternion four."""

from __future__ import annotations

import numpy as np

from ..problem import Array, Problem
from .augmented import Augmented


def basis(problem: Problem, y: Array) -> Array:
    """Give B [ny, 2 nv + nx]: the changes of the state that belong to changes (in velocity space, of v, of x).

    A rotation is turned about its body axes. Prescribed coordinates do not change.
    """
    nq, nv, nx = problem.nq, problem.nv, problem.nx
    matrix = np.zeros((problem.ny, 2 * nv + nx))
    first = -1
    for j, i in enumerate(problem.partner):
        if i not in problem.rotations:
            matrix[i, j] = 1.0
        elif i != first:
            first = i
            matrix[i : i + 4, j : j + 3] = turning(y[i : i + 4])
    matrix[nq:, nv:] = np.eye(nv + nx)
    return matrix


def turning(q: Array) -> Array:
    """Give [4, 3]: the rates of a unit quaternion (scalar first) by the angular velocity in body axes."""
    s, x, y, z = q
    return np.array([[-x, -y, -z], [s, -z, y], [z, s, -x], [-y, x, s]]) / 2


def minimal(problem: Problem, y: Array, w: Array) -> Array:
    """Give changes of the state, w [ny, k], in the space of velocities [2 nv + nx, k]."""
    reduced: Array = basis(problem, y).T @ w / _squares(problem)[:, None]
    return reduced


def _squares(problem: Problem) -> Array:
    """Give the squares of the columns of B, which are orthogonal; 1 for all but rotations."""
    quarter = [0.25 if i in problem.rotations else 1.0 for i in problem.partner]
    return np.array([*quarter, *np.ones(problem.nv + problem.nx)])


def projected(
    augmented: Augmented,
    t: float,
    y: Array,
    w: Array,
    z: Array,
    dz: Array | None = None,
) -> Array:
    """Give W [ny, k], changes at the time t, moved onto the constraints at the state y [ny], in the metric of the masses."""
    problem = augmented.case.problem
    nq, nv = problem.nq, problem.nv
    u, more = augmented.inputs(t), augmented.discretes(z, dz)
    w = w.copy()
    for name in ("project_position", "project_velocity"):
        change = augmented.function(f"tangent_{name}", nv)(t, augmented.joined(y, w), u, more, augmented.p)
        d = change.reshape(-1, nv).T
        if name == "project_position":
            w += basis(problem, y)[:, :nv] @ d
        else:
            w[nq : nq + nv] += d
    return w
