"""Whether an equilibrium is stable: by its eigenvalues, and by the second variation where these cannot tell.

Lagrange and Dirichlet: where the potential has a strict minimum on the constraints, rest is stable; Thomson and Tait:
dissipation and gyroscopic forces change nothing in that.
"""

from __future__ import annotations

import numpy as np
from msgspec import Struct

from ..outcome import SimulationError
from ..problem import Array
from .active_constraints import with_held
from .independent_coordinates import independent
from .operating_point import Site
from .vibration import SYMMETRIC, vibration
from .zeros import EPSILON, Complex, poles


class Stability(Struct, frozen=True, eq=False):
    """``stable``: None where neither eigenvalues nor the second variation can tell; ``eigenvalues`` of the motion near by,
    without those of directions that change nothing."""

    stable: bool | None
    eigenvalues: Complex
    errors: tuple[float | None, ...]
    conservative: bool


UNTOLD = Stability(None, np.zeros(0, dtype=np.complex128), (), False)
"""Where the equations have no derivatives."""


def stability(site: Site, y: Array, idle: tuple[str, ...] = (), within: Array | None = None) -> Stability:
    """Tell whether an equilibrium is stable, but for displacements along ``idle`` coordinates, which nothing depends on.

    ``within``: errors of the equilibrium itself [n]; what changes within them is not told.
    """
    found = with_held(site, site.derivatives(y))
    free = independent(site.chart, found)
    names = [site.chart.names[int(j)] for j in free.chosen]
    kept = np.array([name not in idle for name in names], dtype=bool)
    a = (found.rates @ free.tangent)[free.chosen][np.ix_(kept, kept)]
    values, errors = poles(a, [site.chart.units[int(j)] for j, k in zip(free.chosen, kept, strict=True) if k])
    bounds = tuple(None if e is None else max(1.0, free.condition) * e for e in errors)
    scale = float(np.abs(values).max(initial=0.0))
    limits = np.array([1e-7 * scale if e is None else 4 * e + 64 * EPSILON * scale for e in bounds])
    beside = None if within is None else site.chart.moved(y, within)
    if beside is not None:
        other = (site.derivatives(beside).rates @ free.tangent)[free.chosen][np.ix_(kept, kept)]
        limits = limits + 4 * float(np.linalg.norm(other - a))
    minimum, conservative = _second_variation(site, y, idle, beside)
    stable: bool | None = None
    if (values.real > limits).any():
        stable = False
    elif not names or minimum or (len(values) and (values.real < -limits).all()):
        stable = True  # as where closed contacts and constraints let nothing move
    return Stability(stable, values, bounds, conservative)


def _second_variation(site: Site, y: Array, idle: tuple[str, ...], beside: Array | None) -> tuple[bool, bool]:
    """Return whether the potential has a strict minimum and nothing feeds energy in, and whether nothing damps at all."""
    chart = site.chart
    if chart.size > chart.nd + site.problem.nv:
        return False, False
    try:
        found = vibration(site, y)
    except SimulationError:
        return False, False
    moves = np.abs(found.allowed).max(axis=1, initial=0.0) > EPSILON
    names = chart.names[: len(found.allowed)]
    kept = np.array([name not in idle or not m for name, m in zip(names, moves, strict=False)], dtype=bool)
    if len(kept) != len(found.allowed) or (
        not kept.all() and found.allowed.shape[0] != found.allowed.shape[1]
    ):
        return False, found.conservative
    k, c = found.stiffness, found.damping
    if found.allowed.shape[0] == found.allowed.shape[1]:
        k, c = k[np.ix_(kept, kept)], c[np.ix_(kept, kept)]
    size = float(np.abs(k).max(initial=0.0))
    if np.abs(k - k.T).max(initial=0.0) > SYMMETRIC * size:
        return False, False
    if not k.size:
        return False, found.conservative
    values = np.linalg.eigvalsh((k + k.T) / 2)
    losses = np.linalg.eigvalsh((c + c.T) / 2)
    limit = 64 * EPSILON * len(k) * max(size, 1e-300)
    if beside is not None:
        limit += 4 * float(np.abs((vibration(site, beside).entries[1] - found.entries[1]).todense()).sum())
    fed = bool(losses.min() < -64 * EPSILON * max(float(np.abs(c).max()), 1e-300))
    return bool(values.min() > limit) and not fed, found.conservative


def eigenvalue_text(z: complex) -> str:
    """Return an eigenvalue as tables show it; one that is not real stands for its conjugate, too."""
    if abs(z.imag) <= 1e-12 * abs(z):
        return f"{z.real:.5g}"
    return f"{z.imag:.5g}i" if abs(z.real) <= 1e-12 * abs(z) else f"{z.real:.5g} +- {z.imag:.5g}i"
