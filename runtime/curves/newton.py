"""Newton's method for a discrete curve: bubbles are condensed in each element, what is left is solved as a whole."""

from __future__ import annotations

from typing import Any

import numpy as np
from msgspec import Struct

from ..numerics import newton as numerics
from ..problem import Array
from .discrete import Blocks, DiscreteCurve
from .unknowns import Unknowns

DENSE = 400
"""Unknowns of borders and the whole up to which a dense matrix is faster than a sparse one."""
MOST_STEPS = 60
LEAST = 0.1
"""Share of the start's size below which a curve counts as zero."""


class Factors:
    """The matrix of Newton's method, factorised: solves for steps, and tells how many of its eigenvalues are negative."""

    def __init__(self, discrete: DiscreteCurve, blocks: Blocks) -> None:
        layout = discrete.layout
        self.width, self.inner, self.wholes = layout.width, layout.inner, layout.whole
        self.count = discrete.mesh.count
        two = 2 * self.width
        self.inside = blocks.local[:, two:, two:]
        self.inverse = np.linalg.inv(self.inside) if self.inner else np.zeros((self.count, 0, 0))
        outer = np.concatenate([blocks.local[:, two:, :two], blocks.across[:, two:]], axis=2)
        self.outer = outer
        reduced = self.inverse @ outer
        left = np.swapaxes(outer, 1, 2) @ reduced
        size = self.width * (self.count + 1) + self.wholes
        self.size = size
        borders = blocks.local[:, :two, :two] - left[:, :two, :two]
        across = blocks.across[:, :two] - left[:, :two, two:]
        whole = blocks.whole - left[:, two:, two:].sum(axis=0)
        start = self.width * (self.count + 1)
        self.matrix: Any
        rows = self.width * np.arange(self.count)[:, None] + np.arange(two)[None, :]
        if size <= DENSE:
            matrix = np.zeros((size, size))
            for e in range(self.count):
                matrix[rows[e, 0] : rows[e, 0] + two, rows[e, 0] : rows[e, 0] + two] += borders[e]
                matrix[rows[e, 0] : rows[e, 0] + two, start:] += across[e]
            matrix[start:, :start] = matrix[:start, start:].T
            matrix[start:, start:] = whole
            self.matrix = matrix
            self.scale = _scales(np.abs(matrix))
            self.solver = np.linalg.inv(matrix * self.scale[:, None] * self.scale[None, :])
        else:
            import scipy.sparse as sparse
            from scipy.sparse.linalg import splu

            i = np.repeat(rows, two, axis=1).ravel()
            j = np.tile(rows, (1, two)).ravel()
            k = np.repeat(rows, self.wholes, axis=1).ravel()
            last = start + np.tile(np.arange(self.wholes), (self.count, two)).ravel()
            corner = start + np.indices((self.wholes, self.wholes)).reshape(2, -1)
            data = np.concatenate([borders.ravel(), across.ravel(), across.ravel(), whole.ravel()])
            places = (np.concatenate([i, k, last, corner[0]]), np.concatenate([j, last, k, corner[1]]))
            matrix = sparse.coo_matrix((data, places), shape=(size, size)).tocsr()
            self.matrix = matrix
            self.scale = 1 / np.sqrt(np.maximum(abs(matrix).max(axis=1).toarray().ravel(), 1e-300))
            scaled = sparse.diags(self.scale) @ matrix @ sparse.diags(self.scale)
            self.solver = splu(scaled.tocsc())

    def step(self, blocks: Blocks) -> Unknowns:
        """Return the step that a residual asks for."""
        two, w = 2 * self.width, self.width
        inner = np.einsum("eij,ej->ei", self.inverse, blocks.local_residual[:, two:])
        taken = np.einsum("eji,ej->ei", self.outer, inner)
        rest = np.zeros(self.size)
        start = w * (self.count + 1)
        sides = blocks.local_residual[:, :two] - taken[:, :two]
        borders = rest[:start].reshape(self.count + 1, w)
        borders[:-1] += sides[:, :w]
        borders[1:] += sides[:, w:]
        rest[start:] = blocks.whole_residual - taken[:, two:].sum(axis=0)
        scaled = rest * self.scale
        solved = self.solver @ scaled if isinstance(self.solver, np.ndarray) else self.solver.solve(scaled)
        found = -self.scale * solved
        border = found[:start].reshape(self.count + 1, w)
        whole = found[start:]
        known = np.concatenate([border[:-1], border[1:], np.tile(whole, (self.count, 1))], axis=1)
        right = -blocks.local_residual[:, two:] - np.einsum("eij,ej->ei", self.outer, known)
        return Unknowns(border.copy(), np.einsum("eij,ej->ei", self.inverse, right), whole.copy())

    def negative(self) -> tuple[int, float]:
        """Return how many eigenvalues are negative, and the smallest one in size, of the matrix scaled to one."""
        count = 0
        if self.inner:
            scale = 1 / np.sqrt(np.maximum(np.abs(self.inside).max(axis=2), 1e-300))
            inner = np.linalg.eigvalsh(self.inside * scale[:, :, None] * scale[:, None, :])
            count += int(np.sum(inner < 0))
        dense = self.matrix if isinstance(self.matrix, np.ndarray) else self.matrix.toarray()
        outer = np.linalg.eigvalsh(dense * self.scale[:, None] * self.scale[None, :])
        return count + int(np.sum(outer < 0)), float(np.min(np.abs(outer)))


def _scales(size: Array) -> Array:
    """Return factors that bring the rows of a symmetric matrix to entries of about one (Ruiz 2001)."""
    scale = np.ones(len(size))
    for _ in range(4):
        rows = (size * scale[:, None] * scale[None, :]).max(axis=1)
        scale /= np.sqrt(np.where(rows > 0, rows, 1.0))
    return scale


def projected(discrete: DiscreteCurve, start: Unknowns, *, every: bool = False) -> Unknowns:
    """Return a curve near a start that meets its ends, or ``every`` condition: the least change of its derivatives."""
    layout, curve = discrete.layout, discrete.curve
    at = start
    lam0 = layout.unknown + layout.numbers
    mu0 = lam0 + layout.numbers
    ends = np.array([every or row.kind != "whole" for row in curve.wholes], dtype=bool)
    stiff = discrete.stiffness(discrete.sizes(start))
    for _ in range(8):
        plain = Unknowns(at.border.copy(), at.inside.copy(), at.whole.copy())
        plain.whole[lam0:] = 0.0
        plain.border[:, layout.shared :] = 0.0
        plain.inside[:, layout.own :] = 0.0
        blocks = discrete.blocks(plain)
        if not is_finite(blocks):
            return at
        coordinates = np.unique(layout.place)
        others = np.setdiff1d(np.arange(blocks.local.shape[1]), coordinates)
        blocks.local[:, coordinates[:, None], coordinates[None, :]] = stiff[
            :, coordinates[:, None], coordinates[None, :]
        ]
        blocks.local_residual[:, coordinates] = 0.0
        if not every and len(others):
            blocks.local[:, others] = 0.0
            blocks.local[:, :, others] = 0.0
            blocks.local[:, others, others] = 1.0
            blocks.local_residual[:, others] = 0.0
        blocks.whole[:lam0, :lam0] = 0.0
        for k in range(layout.unknown):
            blocks.whole[k, k] = 1.0 / max(abs(at.whole[k]), 1e-9) ** 2
        blocks.whole_residual[:lam0] = 0.0
        for k, on in enumerate(ends):
            if not on:
                blocks.whole[mu0 + k] = 0.0
                blocks.whole[:, mu0 + k] = 0.0
                blocks.whole[mu0 + k, mu0 + k] = 1.0
                blocks.whole_residual[mu0 + k] = 0.0
        try:
            step = Factors(discrete, blocks).step(blocks)
        except (np.linalg.LinAlgError, RuntimeError):
            return at
        size = norm_of(discrete, at)(step)
        if not np.isfinite(size):
            return at
        at = Unknowns(at.border.copy(), at.inside.copy(), at.whole.copy())
        n, b = layout.shared, layout.own
        at.border[:, :n] += step.border[:, :n]
        at.inside[:, :b] += step.inside[:, :b]
        at.whole[:lam0] += step.whole[:lam0]
        if size < 1e-9:
            break
    return at


def with_multipliers(discrete: DiscreteCurve, start: Unknowns) -> Unknowns:
    """Return a start with the multipliers that leave the least of the gradient, measured by the stiffness."""
    layout = discrete.layout
    lam0 = layout.unknown + layout.numbers
    n, b = layout.shared, layout.own
    plain = Unknowns(start.border.copy(), start.inside.copy(), start.whole.copy())
    plain.whole[lam0:] = 0.0
    plain.border[:, n:] = 0.0
    plain.inside[:, b:] = 0.0
    step = stiffly(discrete, plain, start)
    if step is None:
        return start
    plain.whole[lam0:] = step.whole[lam0:]
    plain.border[:, n:] = step.border[:, n:]
    plain.inside[:, b:] = step.inside[:, b:]
    return plain


def stiffly(discrete: DiscreteCurve, at: Unknowns, start: Unknowns | None = None) -> Unknowns | None:
    """Return the step down from a curve, and multipliers, that a stiffness in place of the matrix gives; None if there is none."""
    layout = discrete.layout
    lam0 = layout.unknown + layout.numbers
    start = start or at
    blocks = discrete.blocks(at)
    if not is_finite(blocks):
        return None
    coordinates = np.unique(layout.place)
    stiff = discrete.stiffness(discrete.sizes(start))[:, coordinates[:, None], coordinates[None, :]]
    blocks.local[:, coordinates[:, None], coordinates[None, :]] = stiff
    for k in range(layout.unknown):
        blocks.whole[k, k] = 1.0 / max(abs(start.whole[k]), 1e-9) ** 2
    blocks.whole_residual[lam0:] = 0.0
    others = np.setdiff1d(np.arange(blocks.local.shape[1]), coordinates)
    blocks.local_residual[:, others] = 0.0
    try:
        step = Factors(discrete, blocks).step(blocks)
    except (np.linalg.LinAlgError, RuntimeError):
        return None
    return step if np.isfinite(step.whole).all() and np.isfinite(step.inside).all() else None


class Norm(Struct, frozen=True, eq=False):
    """Measures steps against the size of what they change."""

    border: Array
    inside: Array
    whole: Array

    def __call__(self, step: Unknowns) -> float:
        parts = [step.border / self.border, step.inside / self.inside, step.whole / self.whole]
        return float(np.sqrt(max(np.mean(x**2) if x.size else 0.0 for x in parts)))


class Step(Struct, frozen=True, eq=False):
    whole: Unknowns
    size: float
    factors: Factors
    norm: Norm

    def shortens(self, trial: Blocks, share: float) -> bool:
        """Whether the next step, by the same matrix, is shorter after a share of this one."""
        further = self.norm(self.factors.step(trial))
        return bool(further <= max((1 - share / 4) * self.size, 1e-12 if share == 1.0 else 0.0))


Solved = numerics.NewtonResult[Unknowns, Step]


def norm_of(discrete: DiscreteCurve, unknowns: Unknowns, least: Array | float = 0.0) -> Norm:
    """Return the measure of steps: coordinates by their largest values, numbers of the whole by theirs; no multipliers."""
    layout = discrete.layout
    size = np.maximum(discrete.sizes(unknowns), least)
    never = np.inf
    block = np.full(2 * layout.width + layout.inner, never)
    for j, row in enumerate(layout.place):
        block[row] = size * 10 if j < 2 * layout.r and j % layout.r else size
    border, inside = block[: layout.width], block[2 * layout.width :]
    whole = np.full(layout.whole, never)
    known = unknowns.whole[: layout.unknown]
    whole[: layout.unknown] = np.where(known != 0, np.abs(known), 1.0)
    return Norm(border, inside, whole)


def ascends(discrete: DiscreteCurve, at: Unknowns) -> bool:
    """Tell whether the range goes upwards, of which an end may be unknown."""
    if not discrete.curve.unknown:
        return True
    found = discrete.functions["range"](
        np.zeros(()), np.zeros(discrete._height()), np.zeros(0), discrete._z(at), discrete.p
    )
    return bool(found[0] < found[1])


def newton(
    discrete: DiscreteCurve,
    start: Unknowns,
    *,
    tolerance: float = 1e-10,
    deflated: list[Unknowns] | None = None,
    tested: bool = True,
) -> Solved:
    """Solve from a start; steps are shortened until the next one would be shorter (Deuflhard, Newton methods, 2004, ch. 3).

    Without ``tested`` steps are only bounded. ``deflated``: solutions from which the search is driven away (Farrell, Birkisson, Funke 2015).
    """
    least = LEAST * discrete.sizes(start)
    known = deflated or []
    free = bool(known) or not tested  # far from a solution the deflated step may be long: bounded, not tested

    def step(at: Unknowns) -> tuple[Step, float] | str:
        blocks = discrete.blocks(at)
        if not is_finite(blocks):
            return "not finite"
        try:
            factors = Factors(discrete, blocks)
        except (np.linalg.LinAlgError, RuntimeError):
            return "singular"
        norm = norm_of(discrete, at, least)
        whole = factors.step(blocks)
        size = norm(whole)
        if known and np.isfinite(size):
            whole, size = _driven(at, whole, known, norm, size)
            if not np.isfinite(size):
                return "on a known curve"
        return Step(whole, size, factors, norm), size

    def accepted(_: Unknowns, taken: Step, after: Unknowns, share: float) -> bool:
        trial = discrete.blocks(after, matrix=False)
        return is_finite(trial) and (free or (ascends(discrete, after) and taken.shortens(trial, share)))

    return numerics.newton(
        start,
        step,
        lambda at, taken, share: at.moved(taken.whole, share),
        most=MOST_STEPS,
        close=tolerance,
        resting=0.0 if free else 1e-8,
        longest=0.5 if free else np.inf,
        accepted=accepted,
    )


def _driven(
    at: Unknowns, step: Unknowns, known: list[Unknowns], norm: Norm, size: float
) -> tuple[Unknowns, float]:
    """Return the step of the problem that is multiplied by prod (1/d^2 + 1), d the distances from known solutions."""
    total, slope = 1.0, 0.0
    for other in known:
        apart = at.moved(other, -1.0)
        distance = norm(apart) ** 2
        if distance == 0:
            return step, np.nan
        along = _inner(apart, step, norm)
        factor = 1 / distance + 1
        total *= factor
        slope += -2 * along / (distance**2 * factor)
    scale = 1 / (1 - slope) if abs(1 - slope) > 1e-12 else 1.0
    scaled = Unknowns(scale * step.border, scale * step.inside, scale * step.whole)
    return scaled, abs(scale) * size


def _inner(a: Unknowns, b: Unknowns, norm: Norm) -> float:
    parts = [
        float(np.mean((a.border / norm.border) * (b.border / norm.border))) if a.border.size else 0.0,
        float(np.mean((a.inside / norm.inside) * (b.inside / norm.inside))) if a.inside.size else 0.0,
    ]
    return max(parts, key=abs)


def is_finite(blocks: Blocks) -> bool:
    return bool(np.isfinite(blocks.local_residual).all() and np.isfinite(blocks.whole_residual).all())
