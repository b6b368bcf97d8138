"""Newton's method, with steps that are bounded, or shortened until they are accepted."""

from __future__ import annotations

from collections.abc import Callable
from typing import Generic, TypeVar

import numpy as np
from msgspec import Struct

from .rank import Array

X = TypeVar("X")
D = TypeVar("D")

SMALLEST = 1e-4
"""Share of a step below which it is given up."""
SHORTER = 4
"""Steps that get shorter by less, near the solution, are rounding."""


class NewtonResult(Struct, Generic[X, D], frozen=True, eq=False):
    """Where Newton's method came to: ``size`` of the last step, ``steps`` that it took, ``why`` it did not converge; ``step``:
    the last one, which is taken, or what is left of one at ``at`` where steps do not get shorter; None where there was none."""

    at: X
    size: float
    steps: int
    why: str = ""
    step: D | None = None

    @property
    def converged(self) -> bool:
        return not self.why


def newton(
    at: X,
    step: Callable[[X], tuple[D, float] | str | None],
    moved: Callable[[X, D, float], X | None],
    *,
    most: int,
    close: float = 0.0,
    resting: float = 0.0,
    longest: float = np.inf,
    accepted: Callable[[X, D, X, float], bool] | None = None,
) -> NewtonResult[X, D]:
    """Take steps until one is ``close`` to nothing, or ``resting``: shorter than that, and no shorter than a quarter of the last.

    ``step`` gives the whole step and its size, measured by that of the unknowns, None or why where there is none; ``moved`` the place
    after a share of it, None where nothing is defined. A step longer than ``longest`` is cut to that. What is not ``accepted``
    (from where, the step, to where, its share) is halved; the next step begins with twice the share.
    """
    size, trusted, best = np.inf, 1.0, None
    for count in range(1, most + 1):
        found = step(at)
        if found is None or isinstance(found, str):
            return NewtonResult(at, size, count - 1, found or "undefined")
        if not np.isfinite(found[1]):
            return NewtonResult(at, size, count - 1, "singular")
        last, (whole, size) = size, found
        if best is None or size < best.size:
            best = NewtonResult(at, size, count, "", whole)
        if size <= close:
            after = moved(at, whole, 1.0)
            return NewtonResult(at if after is None else after, size, count, "", whole)
        if size <= resting and size > last / SHORTER:
            return best
        allowed, trusted = min(1.0, longest / size), min(1.0, 2 * trusted)
        while (after := moved(at, whole, trusted * allowed)) is None or not (
            accepted is None or accepted(at, whole, after, trusted * allowed)
        ):
            trusted /= 2
            if trusted < SMALLEST:
                return best if size <= resting else NewtonResult(at, size, count, "no shorter step", whole)
        at = after
    return NewtonResult(at, size, most, "too many steps")


def added(x: Array, step: Array, share: float) -> Array:
    return x + share * step
