"""Vibrations about an equilibrium: M, C and K on what constraints allow, and their eigenvalues with errors.

Conservative ones are a symmetric problem K x = w^2 M x. Its eigenvalues are corrected by Rayleigh's quotient in extended
precision, whose error is the square of that of the vectors (B. N. Parlett, The Symmetric Eigenvalue Problem, ch. 4); what
is left is the rounding of the entries.
"""

from __future__ import annotations

import numpy as np
import scipy.linalg
import scipy.sparse
from msgspec import Struct
from numpy.typing import NDArray

from ..outcome import SimulationError
from ..problem import Array
from .active_constraints import holding, with_held
from .equilibrium import moving
from .independent_coordinates import independent, null_space
from .operating_point import Site
from .zeros import EPSILON, Complex, poles

SECOND_ORDER, BIAS = "second_order", "bias"
SYMMETRIC = 1e-11
"""Largest part of K that is not symmetric, as a share of its largest entry, that counts as rounding."""
NO_DAMPING = 1e-13
"""Largest C, as a share of the highest frequency, that counts as rounding."""


class Vibration(Struct, frozen=True, eq=False):
    """M w' + C w + K d = 0 for velocities w = ``allowed`` h and displacements d = ``allowed`` x: ``mass``, ``damping``,
    ``stiffness`` are the matrices between h [m][m]; ``entries`` those of M and K as they are, sparse."""

    mass: Array
    damping: Array
    stiffness: Array
    allowed: Array
    entries: tuple[scipy.sparse.csr_array, scipy.sparse.csr_array]

    @property
    def conservative(self) -> bool:
        """Whether nothing but a potential acts: K is symmetric, and velocities make no forces."""
        k = self.stiffness
        size = float(np.abs(k).max(initial=0.0))
        if np.abs(k - k.T).max(initial=0.0) > SYMMETRIC * size:
            return False
        heaviness = float(np.abs(self.mass).max(initial=0.0))
        return bool(np.abs(self.damping).max(initial=0.0) <= NO_DAMPING * np.sqrt(size * heaviness))


class Modes(Struct, frozen=True, eq=False):
    """``eigenvalues`` [k], one of each conjugate pair, with ``errors`` (None: cannot be told) and ``shapes`` [n][k] of
    velocities; ``rigid``: those that nothing holds; ``groups`` of equal ones."""

    eigenvalues: Complex
    errors: tuple[float | None, ...]
    shapes: Complex
    rigid: NDArray[np.bool_]
    groups: tuple[tuple[int, ...], ...]


def second_order(site: Site, y: Array) -> tuple[NDArray[np.intp], Array]:
    """Return (row, column) and values of the derivatives of the equations of motion; none of a model without coordinates."""
    pattern = np.array(site.problem.patterns[SECOND_ORDER], dtype=np.intp).reshape(-1, 2)
    if not len(pattern):
        return pattern, np.zeros(0)
    return pattern, site.case.functions.matrices[SECOND_ORDER](site.t, y, site.u, site.z, site.p)


def mass_matrix(site: Site, y: Array) -> Array:
    """Return the mass matrix [nv, nv]."""
    nv = site.problem.nv
    pattern, values = second_order(site, y)
    masses, found = pattern[:, 1] < nv, np.zeros((nv, nv))
    found[pattern[masses, 0], pattern[masses, 1]] = values[masses]
    return found


def vibration(site: Site, y: Array) -> Vibration:
    """Return the equations of small motions about an equilibrium, with what holds there as constraints. Raises
    SimulationError at singular positions."""
    problem, nv = site.problem, site.problem.nv
    shape = (nv, 2 * nv + site.chart.nd)
    pattern, values = second_order(site, y)
    if not np.isfinite(values).all():
        raise SimulationError("the equations of motion have no derivatives at this state")
    whole = scipy.sparse.csc_array((values, (pattern[:, 0], pattern[:, 1])), shape=shape)
    columns = moving(site.chart)[:nv]
    mass, damping, stiffness = whole[:, :nv], whole[:, nv : 2 * nv], whole[:, 2 * nv + columns]
    held = np.zeros((0, nv))
    if problem.constraints or holding(site):
        held = with_held(site, site.derivatives(y)).rate[:, site.chart.nd : site.chart.nd + nv]
    entries = scipy.sparse.csr_array(mass), scipy.sparse.csr_array(stiffness)
    allowed = null_space(held, len(held)) if len(held) else np.eye(nv)

    def between(matrix: scipy.sparse.csc_array) -> Array:
        full: Array = np.asarray(allowed.T @ (matrix @ allowed) if len(held) else matrix.todense())
        return full

    return Vibration(between(mass), between(damping), between(stiffness), allowed, entries)


def conservative_modes(found: Vibration, off: Array) -> Modes:
    """Return the modes of a symmetric problem, the lowest first; shapes have the generalised mass 1.

    ``off``: how much K may be off because of the equilibrium itself.
    """
    k = (found.stiffness + found.stiffness.T) / 2
    m = (found.mass + found.mass.T) / 2
    if not k.size:
        nothing = np.zeros(0, dtype=complex)
        return Modes(
            nothing, (), np.zeros((len(found.allowed), 0), dtype=complex), np.zeros(0, dtype=bool), ()
        )
    try:
        _, vectors = scipy.linalg.eigh(k, m)
    except np.linalg.LinAlgError:
        raise SimulationError(
            "the mass matrix is not positive definite at this state: small motions about it are not vibrations",
            help="a coordinate may lose its meaning there, as the azimuth at a pole; take other coordinates",
        ) from None
    shapes = found.allowed @ vectors
    squares, masses = (_quotients(entries, shapes) for entries in reversed(found.entries))
    squares = squares / masses
    shapes = shapes / np.sqrt(np.asarray(masses, dtype=float))
    order = np.argsort(squares, kind="stable")
    squares, shapes = np.asarray(squares[order], dtype=float), shapes[:, order]
    sizes = np.abs(shapes)
    mass, stiffness = (abs(entries) for entries in found.entries)
    rounding = (
        2
        * EPSILON
        * ((sizes * (stiffness @ sizes)).sum(axis=0) + np.abs(squares) * (sizes * (mass @ sizes)).sum(axis=0))
    )
    if off is not None:
        rounding += (sizes * (np.abs(off) @ sizes)).sum(axis=0)
    rigid = np.abs(squares) <= 4 * rounding
    values = np.where(rigid, 0.0, np.emath.sqrt(-squares.astype(complex)))
    errors = np.where(
        rigid,
        np.sqrt(np.maximum(rounding, 0.0)),
        rounding / (2 * np.sqrt(np.maximum(np.abs(squares), 1e-300))),
    )
    return Modes(
        np.asarray(values, dtype=complex),
        tuple(float(e) for e in errors),
        _signed(shapes.astype(complex)),
        rigid,
        _equal(squares, 4 * rounding),
    )


def _quotients(entries: scipy.sparse.csr_array, shapes: Array) -> NDArray[np.longdouble]:
    """Return x^T K x of each column in extended precision."""
    exact = shapes.astype(np.longdouble)
    product = entries.astype(np.longdouble) @ exact
    total: NDArray[np.longdouble] = (exact * product).sum(axis=0)
    return total


def general_modes(found: Vibration) -> Modes:
    """Return the modes of M x'' + C x' + K x = 0 with damping and gyroscopic forces."""
    m = len(found.mass)
    factor = np.linalg.cholesky((found.mass + found.mass.T) / 2)
    white = scipy.linalg.solve_triangular(factor, found.allowed.T, lower=True)

    def whitened(matrix: Array) -> Array:
        left = scipy.linalg.solve_triangular(factor, matrix, lower=True)
        result: Array = scipy.linalg.solve_triangular(factor, left.T, lower=True).T
        return result

    c, k = whitened(found.damping), whitened(found.stiffness)
    scale = max(float(np.sqrt(np.linalg.norm(k, 2))), float(np.linalg.norm(c, 2)), 1e-300) if m else 1.0
    companion = np.block([[np.zeros((m, m)), np.eye(m)], [-k / scale**2, -c / scale]])
    values, errors = poles(companion, ["displacement"] * m + ["rate"] * m)
    return _complex_modes(
        scale * values, [None if e is None else scale * e for e in errors], companion, scale, white.T
    )


def first_order_modes(site: Site, y: Array) -> Modes:
    """Return the modes of a model with states besides its coordinates."""
    found = with_held(site, site.derivatives(y))
    free = independent(site.chart, found)
    a = (found.rates @ free.tangent)[free.chosen]
    values, errors = poles(a, [site.chart.units[int(j)] for j in free.chosen])
    bounds = [None if e is None else max(1.0, free.condition) * e for e in errors]
    return _complex_modes(values, bounds, a, 1.0, free.tangent[: site.chart.nd])


def _complex_modes(
    values: Complex, errors: list[float | None], matrix: Array, scale: float, shape: Array
) -> Modes:
    """Return one of each pair of eigenvalues of a matrix, the slowest first; ``shape`` takes the head of its vectors to
    displacements."""
    kept, vectors = [], []
    every, columns = scipy.linalg.eig(matrix) if matrix.size else (np.zeros(0), np.zeros((0, 0)))
    bound = [max((e or 0.0), 64 * EPSILON * float(np.abs(values).max(initial=0.0))) for e in errors]
    for k, value in enumerate(values):
        if value.imag < 0:
            continue
        kept.append(k)
        nearest = int(np.argmin(np.abs(scale * every - value)))
        vectors.append(shape @ columns[: shape.shape[1], nearest])
    order = sorted(range(len(kept)), key=lambda i: (abs(values[kept[i]]), values[kept[i]].real))
    chosen = [kept[i] for i in order]
    found = values[chosen]
    limits = np.array([bound[k] for k in chosen])
    rigid = np.abs(found) <= np.where(
        [errors[k] is None for k in chosen], 1e-7 * float(np.abs(values).max(initial=0.0)), 4 * limits
    )
    shapes = np.array([vectors[i] for i in order], dtype=complex).T.reshape(len(shape), len(chosen))
    sizes = np.linalg.norm(shapes, axis=0)
    groups = _equal(found, 4 * limits)
    return Modes(
        np.where(rigid, 0.0, found),
        tuple(errors[k] for k in chosen),
        _signed(np.asarray(shapes / np.where(sizes > 0, sizes, 1.0), dtype=complex)),
        rigid,
        groups,
    )


def _signed(shapes: Complex) -> Complex:
    """Turn each shape so that its largest part is real and positive; of equal ones the first."""
    if not shapes.size:
        return shapes
    sizes = np.abs(shapes)
    largest = np.argmax(sizes > (1 - 1e-6) * sizes.max(axis=0), axis=0)
    phases = shapes[largest, np.arange(shapes.shape[1])]
    safe = np.where(phases == 0, 1.0, phases)
    result: Complex = shapes * (np.abs(safe) / safe)
    return result


def _equal(values: NDArray[np.generic], bounds: Array) -> tuple[tuple[int, ...], ...]:
    """Return groups of neighbours that are equal within their bounds."""
    groups: list[list[int]] = []
    for k in range(len(values)):
        if k and abs(values[k] - values[k - 1]) <= bounds[k] + bounds[k - 1]:
            groups[-1].append(k)
        else:
            groups.append([k])
    return tuple(tuple(group) for group in groups if len(group) > 1)
