"""Newton's method from far away: with a stiffness that fades, or with conditions that are brought in step by step."""

from __future__ import annotations

import numpy as np
from msgspec.structs import replace

from ..numerics.newton import SMALLEST
from .discrete import DiscreteCurve
from .newton import LEAST, MOST_STEPS, Factors, Solved, Step, is_finite, newton, norm_of
from .unknowns import Unknowns

FIRST_STRIDE, LEAST_STRIDE, QUICK = 0.25, 1e-3, 5
ABANDONED = 1e6
"""Times the first weight of the stiffness beyond which no step helps."""


def newton_from_afar(discrete: DiscreteCurve, start: Unknowns) -> Solved:
    """Solve where Newton's own matrix has no solution, or its steps lead out of the domain."""
    at, steps, last = start, 0, np.inf
    first = discrete.sizes(start)
    stiff = discrete.stiffness(first)
    weight = largest = 1.0
    while steps < 4 * MOST_STEPS:
        blocks = discrete.blocks(at)
        if not is_finite(blocks):
            return Solved(at, last, steps, "not finite")
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
            return Solved(at, last, steps, "singular")
        whole = factors.step(blocks)
        size = norm(whole)
        step = Step(whole, size, factors, norm)
        if not np.isfinite(size):
            return Solved(at, last, steps, "singular")
        share = 1.0
        steps += 1
        while share >= SMALLEST:
            after = at.moved(whole, share)
            trial = discrete.blocks(after, matrix=False)
            if is_finite(trial) and step.shortens(trial, share):
                break
            share /= 2
        if share < SMALLEST:
            weight *= 10
            if weight > ABANDONED * largest:
                return Solved(at, size, steps, "no shorter step")
            continue
        at, last = after, size
        if share == 1.0:
            weight /= 5
        if weight < 1e-6 * largest or size < 1e-6:
            solved = newton(discrete, at)
            return replace(solved, steps=steps + solved.steps)
    return Solved(at, last, steps, "too many steps")


def newton_by_steps(discrete: DiscreteCurve, start: Unknowns) -> Solved:
    """Solve with the conditions that the start itself meets, and take them step by step to those that are asked for."""
    layout = discrete.layout
    mu0 = layout.unknown + 2 * layout.numbers
    off = discrete.blocks(start, matrix=False).whole_residual[mu0:]
    if not np.any(off):
        return Solved(start, np.inf, 0, "nothing to bring in")
    try:
        discrete.held = off
        solved = newton(discrete, start)
        steps, share, stride = solved.steps, 0.0, FIRST_STRIDE
        before: Unknowns | None = None
        last = 0.0
        while solved.converged and share < 1:
            to = min(1.0, share + stride)
            discrete.held = (1 - to) * off
            at = solved.at
            ahead = at if before is None else at.moved(at.moved(before, -1.0), (to - share) / (share - last))
            tried = newton(discrete, ahead)
            steps += tried.steps
            if tried.converged:
                before, last, share, solved = at, share, to, tried
                stride *= 2 if tried.steps <= QUICK else 1
            else:
                stride /= 3
                if stride < LEAST_STRIDE:
                    return replace(tried, at=at, steps=steps, why=f"{share:.0%} of the conditions")
        return replace(solved, steps=steps)
    finally:
        discrete.held = None
