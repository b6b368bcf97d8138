"""A proof that a list of equilibria is complete: Krawczyk's operator over all of the bounds, in balls.

R. Krawczyk, Computing 4 (1969), 187; R. E. Moore, SIAM J. Numer. Anal. 14 (1977), 611: where the operator maps a box into
its interior there is exactly one zero in it, and where the image does not meet the box there is none.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from msgspec import Struct

from ..outcome import SimulationError
from ..problem import Array, NotEnclosed
from .equilibrium import Equilibrium, at_rest, polished
from .operating_point import Site
from .search import Box
from .vibration import BIAS, SECOND_ORDER

MOST, BOXES, SMALLEST = 4, 400_000, 1e-7
"""Most coordinates, most boxes, and the smallest share of the bounds that is divided further."""
BITS = 80
INFLATED = 0.02
SHIFT = 0.0371
"""By which a turn is shifted, so that no zero at 180 degrees lies on both of its ends."""


class Proof(Struct, frozen=True, eq=False):
    """``complete``: whether the list is proven to hold all equilibria within the bounds, each once."""

    equilibria: tuple[Equilibrium, ...]
    complete: bool
    message: str


def proven(site: Site, box: Box) -> Proof:
    """Find all equilibria within the bounds, and prove it. Raises SimulationError for models that have no enclosure."""
    try:
        from flint import arb, ctx
    except ImportError:
        raise SimulationError(
            "a proof needs python-flint, which is not installed", help="pip install mechc[proof]"
        ) from None
    _check(site, box)
    before, ctx.prec = ctx.prec, BITS
    begun = time.process_time()
    try:
        return _searched(site, box, _Enclosure(site, box, arb), arb, begun)
    except NotEnclosed as operation:
        raise SimulationError(
            f"there is no proof for this model: '{operation}' has no form over balls",
            help="leave 'prove' out",
        ) from None
    finally:
        ctx.prec = before


def _check(site: Site, box: Box) -> None:
    problem = site.problem
    reason = ""
    if problem.enclosure is None:
        reason = "the model is not at hand as a formula"
    elif problem.constraints or problem.rotations:
        reason = "constraints and rotations have none yet"
    elif site.chart.size > site.chart.nd + problem.nv:
        reason = "states beside the coordinates have none yet"
    elif problem.hybrid is not None:
        reason = "what switches has none"
    elif not 1 <= len(box.moved) <= MOST:
        reason = f"it is for 1 to {MOST} coordinates, these are {len(box.moved)}"
    if reason:
        raise SimulationError(f"there is no proof for this model: {reason}", help="leave 'prove' out")


class _Enclosure:
    """The forces at rest and their derivatives over a box."""

    def __init__(self, site: Site, box: Box, arb: Any) -> None:
        assert site.problem.enclosure is not None
        self.function: Callable[[str, Mapping[str, Sequence[Any]]], list[Any]] = site.problem.enclosure
        self.moved = [int(j) for j in box.moved]
        self.pattern = site.problem.patterns[SECOND_ORDER]
        self.arb = arb
        self.nv = site.problem.nv
        self.still = [arb(float(v)) for v in at_rest(site, site.y)]
        self.rest = {
            "t": [arb(site.t)],
            "u": [arb(float(v)) for v in site.u],
            "z": [arb(float(v)) for v in site.z],
            "p": [arb(float(v)) for v in site.p[: len(site.problem.parameters)]],
        }

    def _arrays(self, q: Sequence[Any]) -> dict[str, Sequence[Any]]:
        y = list(self.still)
        for j, value in zip(self.moved, q, strict=True):
            y[j] = value
        return {**self.rest, "y": y}

    def forces(self, q: Sequence[Any]) -> list[Any]:
        found = self.function(BIAS, self._arrays(q))
        return [found[j] for j in self.moved]

    def slopes(self, q: Sequence[Any]) -> list[list[Any]]:
        size = len(self.moved)
        entries = self.function(SECOND_ORDER, self._arrays(q))
        rows = [[self.arb(0)] * size for _ in range(size)]
        place = {j: k for k, j in enumerate(self.moved)}
        for (i, j), value in zip(self.pattern, entries, strict=True):
            column = j - 2 * self.nv
            if column in place and i in place:
                rows[place[i]][place[column]] = value
        return rows


def _searched(site: Site, box: Box, enclosure: _Enclosure, arb: Any, begun: float) -> Proof:
    shift = np.where(box.periodic, SHIFT, 0.0)
    low, high = box.low - shift, box.high - shift
    span = high - low
    pending = [(low, high)]
    zeros: list[tuple[list[Any], list[Any]]] = []
    undecided = count = 0
    while pending:
        a, b = pending.pop()
        count += 1
        if count > BOXES:
            undecided += 1 + len(pending)
            break
        verdict, inner, outer = _judged(enclosure, arb, a, b)
        if verdict == "none":
            continue
        if verdict == "one":
            if not any(_one_zero(inner, outer, other) for other in zeros):
                zeros.append((inner, outer))
            continue
        widest = int(np.argmax((b - a) / span))
        if (b - a)[widest] < SMALLEST * span[widest]:
            undecided += 1
            continue
        middle = a[widest] + 0.4937 * (b - a)[widest]  # no zero of round numbers on it
        lower, upper = b.copy(), a.copy()
        lower[widest] = upper[widest] = middle
        pending += [(a, lower), (upper, b)]
    ends = [(float(a), float(b)) for a, b in zip(low, high, strict=True)]
    zeros = [z for z in zeros if all(x.overlaps(_ball(arb, *e)) for x, e in zip(z[0], ends, strict=True))]
    zeros.sort(key=lambda z: [float(x.mid()) for x in z[0]])
    found = [_equilibrium(site, box, inner) for inner, _ in zeros]
    kept = [one for one in found if one is not None]
    complete = not undecided and len(kept) == len(zeros)
    seconds = time.process_time() - begun
    message = (
        f"proven in {seconds:.2g} s: {len(kept)} within the bounds, each in a box of its own with no other; {count} boxes"
        if complete
        else f"not proven: {len(zeros) - len(kept)} boxes hold an equilibrium each that the iteration does not find"
        if not undecided
        else f"not proven: {undecided} of {count} boxes are undecided, where equilibria are not isolated or close to being so"
    )
    return Proof(tuple(kept), complete, message)


def _judged(enclosure: _Enclosure, arb: Any, a: Array, b: Array) -> tuple[str, list[Any], list[Any]]:
    """Tell whether a box holds no zero, exactly one (within the box that is returned, a little wider), or neither."""
    whole = [_ball(arb, x, y) for x, y in zip(a, b, strict=True)]
    forces = enclosure.forces(whole)
    if any(f.is_finite() and not f.contains(0) for f in forces):
        return "none", [], []
    margin = INFLATED * (b - a)
    outer = [_ball(arb, x, y) for x, y in zip(a - margin, b + margin, strict=True)]
    slopes = enclosure.slopes(outer)
    middles = np.array([[float(s.mid()) for s in row] for row in slopes])
    if not all(s.is_finite() for row in slopes for s in row):
        return "open", [], []
    try:
        inverse = np.linalg.inv(middles)
    except np.linalg.LinAlgError:
        return "open", [], []
    if not np.isfinite(inverse).all():
        return "open", [], []
    image = _krawczyk(enclosure, arb, outer, slopes, inverse)
    if any(not x.overlaps(k) for x, k in zip(outer, image, strict=True)):
        return "none", [], []
    if not all(x.contains_interior(k) for x, k in zip(outer, image, strict=True)):
        return "open", [], []
    for _ in range(60):
        tighter = _krawczyk(enclosure, arb, image, enclosure.slopes(image), inverse)
        tighter = [x.intersection(k) for x, k in zip(image, tighter, strict=True)]
        if not any(float(t.rad()) < 0.9 * float(x.rad()) for t, x in zip(tighter, image, strict=True)):
            break
        image = tighter
    return "one", image, outer


def _krawczyk(
    enclosure: _Enclosure, arb: Any, x: list[Any], slopes: list[list[Any]], inverse: Array
) -> list[Any]:
    size = len(x)
    middle = [arb(v.mid()) for v in x]
    forces = enclosure.forces(middle)
    y = [[arb(float(inverse[i, j])) for j in range(size)] for i in range(size)]
    away = [v - m for v, m in zip(x, middle, strict=True)]
    image = []
    for i in range(size):
        total = middle[i] - sum((y[i][k] * forces[k] for k in range(size)), arb(0))
        for j in range(size):
            entry = arb(1 if i == j else 0) - sum((y[i][k] * slopes[k][j] for k in range(size)), arb(0))
            total += entry * away[j]
        image.append(total)
    return image


def _ball(arb: Any, low: float, high: float) -> Any:
    return arb(float(low)).union(arb(float(high)))


def _one_zero(inner: list[Any], outer: list[Any], other: tuple[list[Any], list[Any]]) -> bool:
    """Whether the zero of another box is this one: its enclosure lies in the box in which this one is the only zero."""
    if not all(a.overlaps(b) for a, b in zip(inner, other[0], strict=True)):
        return False
    within = all(a.contains(b) for a, b in zip(outer, other[0], strict=True))
    return within or all(a.contains(b) for a, b in zip(other[1], inner, strict=True))


def _equilibrium(site: Site, box: Box, inner: list[Any]) -> Equilibrium | None:
    y = at_rest(site, site.y)
    for j, ball, periodic in zip(box.moved, inner, box.periodic, strict=True):
        value = float(ball.mid())
        if periodic and value <= -np.pi * (1 - 1e-12):
            value += 2 * np.pi
        y[site.chart.places[int(j)]] = value
    found = polished(site, y, box.moved)
    if found is None:
        return None
    off = np.abs(site.chart.between(y, found.y))[box.moved]
    return found if (off <= 1e-6).all() else None
