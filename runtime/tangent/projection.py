"""Derivatives put onto the linearised constraints, by the derivative of the projection."""

from __future__ import annotations

from ..problem import Array
from .augmented import Augmented
from .coordinates import basis


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
