"""Newton's method from far away: with a stiffness that fades, or with conditions that are brought in step by step."""

from __future__ import annotations

import numpy as np

from .discrete import Discrete
from .newton import LEAST, MOST_STEPS, SMALLEST, Factors, Solved, is_finite, newton, norm_of
from .unknowns import Unknowns

FIRST_STRIDE, LEAST_STRIDE, QUICK = 0.25, 1e-3, 5
ABANDONED = 1e6
"""Times the first weight of the stiffness beyond which no step helps."""


def newton_from_afar(discrete: Discrete, start: Unknowns) -> Solved:
    """Solve where Newton's own matrix has no solution, or its steps lead out of the domain."""
    at, steps, last = start, 0, np.inf
    first = discrete.sizes(start)
    stiff = discrete.stiffness(first)
    weight = largest = 1.0
    while steps < 4 * MOST_STEPS:
        blocks = discrete.blocks(at)
        if not is_finite(blocks):
            return Solved(at, False, steps, last, "not finite")
        if steps == 0:
            diagonal = float(np.abs(np.einsum("ejj->ej", blocks.local)).max())
            terms = np.abs(
                at.whole[discrete.layout.unknown : discrete.layout.unknown + discrete.layout.numbers]
            )
            size_of_terms = float(terms.max()) if len(terms) else 1.0
            weight = max(diagonal, size_of_terms, 1e-12) / float(np.einsum("ejj->ej", stiff).max())
            largest = weight
        blocks.local = blocks.local + weight * stiff
        norm = norm_of(discrete, at, LEAST * first)
        try:
            factors = Factors(discrete, blocks)
        except (np.linalg.LinAlgError, RuntimeError):
            return Solved(at, False, steps, last, "singular")
        step = factors.step(blocks)
        size = norm(step)
        if not np.isfinite(size):
            return Solved(at, False, steps, last, "singular")
        share = 1.0
        steps += 1
        while share >= SMALLEST:
            after = at.moved(step, share)
            trial = discrete.blocks(after, matrix=False)
            if is_finite(trial) and norm(factors.step(trial)) <= (1 - share / 4) * size:
                break
            share /= 2
        if share < SMALLEST:
            weight *= 10
            if weight > ABANDONED * largest:
                return Solved(at, False, steps, size, "no shorter step")
            continue
        at, last = at.moved(step, share), size
        if share == 1.0:
            weight /= 5
        if weight < 1e-6 * largest or size < 1e-6:
            solved = newton(discrete, at)
            return Solved(solved.unknowns, solved.converged, steps + solved.steps, solved.last, solved.why)
    return Solved(at, False, steps, last, "too many steps")


def newton_by_steps(discrete: Discrete, start: Unknowns) -> Solved:
    """Solve with the conditions that the start itself meets, and take them step by step to those that are asked for."""
    layout = discrete.layout
    mu0 = layout.unknown + 2 * layout.numbers
    off = discrete.blocks(start, matrix=False).whole_residual[mu0:]
    if not np.any(off):
        return Solved(start, False, 0, np.inf, "nothing to bring in")
    try:
        discrete.held = off
        solved = newton(discrete, start)
        steps, share, stride = solved.steps, 0.0, FIRST_STRIDE
        before: Unknowns | None = None
        last = 0.0
        while solved.converged and share < 1:
            to = min(1.0, share + stride)
            discrete.held = (1 - to) * off
            at = solved.unknowns
            ahead = at if before is None else _ahead(before, at, (to - share) / (share - last))
            tried = newton(discrete, ahead)
            steps += tried.steps
            if tried.converged:
                before, last, share, solved = at, share, to, tried
                stride *= 2 if tried.steps <= QUICK else 1
            else:
                stride /= 3
                if stride < LEAST_STRIDE:
                    return Solved(at, False, steps, tried.last, f"{share:.0%} of the conditions")
        return Solved(solved.unknowns, solved.converged, steps, solved.last, solved.why)
    finally:
        discrete.held = None


def _ahead(before: Unknowns, at: Unknowns, share: float) -> Unknowns:
    step = Unknowns(at.border - before.border, at.inside - before.inside, at.whole - before.whole)
    return at.moved(step, share)
