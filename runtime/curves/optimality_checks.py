"""What contradicts a curve: first integrals that drift, and the conditions of Legendre and Weierstrass.

I. M. Gelfand, S. V. Fomin, Calculus of Variations, 1963, sections 4, 25 and 34. Slopes are those by s, over which the range
has the length 1; for integrands with second derivatives, these stand instead of slopes.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from msgspec import Struct

from ..numerics.rank import GRADIENTS, null_space
from ..problem import Array
from .discrete import DiscreteCurve
from .posed import Posed
from .starts import densities, evaluate, spans
from .unknowns import Unknowns, orders_of

STEADY = 0.01
"""Part of its size by which a first integral may vary along a curve; measured: 1e-7 where curves are smooth, 5e-4 beside steep ends."""
FLAT, FAINT = 1e-7, 1e-12
"""Of the largest second derivative by slopes, at a place and of all: a smaller one has no sign."""
LOWER = 1e-6
"""Of the size of its terms: an excess below that is rounding."""
REACH = (0.1, 0.3, 1.0, 3.0, 10.0, 100.0)
"""How far other slopes lie from those of the curve, in sizes of these."""
DIRECTIONS = 8
"""Of slopes of several coordinates, beside those of one."""
PLACES = 200
HELD = 1e-9
"""Of its largest value: a bound that is nearer than that is reached."""


def drifting(
    first: Mapping[str, tuple[float, float]], size: float, ranges: Mapping[str, float], length: float
) -> str:
    """Say which first integral is not the same along a curve, as it is along every stationary one; empty if none is.

    ``first``: mean and deviation by name; ``size`` of the value, ``ranges`` of the coordinates, ``length`` of the range.
    """
    for name, (mean, off) in first.items():
        span = length if name == "energy" else ranges[name.removeprefix("momentum(")[:-1]]
        if off > STEADY * max(abs(mean), size / span if span else 0.0):
            return (
                f"this is not stationary: its {name}, {mean:.4g} on average, differs by {off:.2g} along it, and a stationary curve "
                "keeps it; either a step of the integrand is passed, which no method sees (take as independent variable the one "
                "that the step is in), or there is no smooth curve"
            )
    return ""


class CurveSamples(Struct, frozen=True, eq=False):
    """A curve at places ``s``: ``y`` as the functions of the model read it, ``z`` without what keeps the speed constant,
    the rows ``top`` of y that hold slopes, and the size of each slope."""

    discrete: DiscreteCurve
    s: Array
    y: Array
    z: Array
    top: Array
    sizes: Array

    @property
    def lam(self) -> Array:
        layout = self.discrete.layout
        start = layout.unknown + layout.numbers
        return self.z[start : start + sum(row.kind == "integral" for row in self.discrete.curve.numbers)]


def along(posed: Posed, discrete: DiscreteCurve, unknowns: Unknowns) -> CurveSamples:
    """Look at a curve at places inside of its elements."""
    curve, layout = discrete.curve, discrete.layout
    every = discrete.inner.s.ravel()
    s = every[:: max(1, len(every) // PLACES)]
    y = evaluate(discrete, unknowns, s, curve.depth)
    if curve.points:
        y[layout.n * (curve.depth + 1) :] = densities(discrete, unknowns, s)
    kept = discrete._z(unknowns)
    if curve.gauge:  # the last two integrals
        end = layout.unknown + layout.numbers + sum(row.kind == "integral" for row in curve.numbers)
        kept[end - 2 : end] = 0.0
    top = np.array([layout.n * order + i for i, order in enumerate(orders_of(curve))])
    slopes = y[top]
    sizes = np.maximum(np.median(np.abs(slopes), axis=1), spans(posed, y[: layout.n]))
    sizes = np.maximum(sizes, 1e-3 * discrete.sizes(unknowns))
    return CurveSamples(discrete, s, y, kept, top, sizes)


def contradiction(posed: Posed, at: CurveSamples, kind: str) -> str:
    """Say which condition on the second derivatives, or on all slopes, a curve of this ``kind`` does not fulfil; empty if it
    fulfils them as far as is seen."""
    return _legendre(posed, at, kind) or (_weierstrass(posed, at, kind) if kind in SIGNS else "")


SIGNS = {"minimum": 1.0, "maximum": -1.0}


def _legendre(posed: Posed, at: CurveSamples, kind: str) -> str:
    """Say where the second derivative by the slopes has other signs than elsewhere, or than the kind asks for."""
    bent = _by_slopes(at)
    basis = _let(at, bounds=True)
    largest = float(np.max(np.abs(bent), initial=0.0))
    counts = []
    for k in range(len(at.s)):
        values = np.linalg.eigvalsh(basis[k].T @ bent[k] @ basis[k])
        size = float(np.max(np.abs(bent[k]), initial=0.0))
        known = np.abs(values) > FLAT * size if size > FAINT * largest else np.zeros(len(values), dtype=bool)
        counts.append((int(np.sum(known & (values < 0))), int(np.sum(known & (values > 0)))))
    full = max((sum(c) for c in counts), default=0)
    signed = [(k, c) for k, c in enumerate(counts) if full and sum(c) == full]
    if not signed:
        return ""
    wrong = {"minimum": 0, "maximum": 1}.get(kind)
    for k, c in signed:
        if basis[k].shape[1] == basis[signed[0][0]].shape[1] and c != signed[0][1]:
            return (
                "this is not an extremum, and nothing determines the curve across a place near "
                f"{_place(posed, at, k)}: the second derivative of the integrand by the slope changes its sign there "
                "(Legendre's condition)"
            )
        if wrong is not None and c[wrong]:
            return (
                f"this is not a {kind}: the second derivative of the integrand by the slope has the wrong sign at "
                f"{_place(posed, at, k)} (Legendre's condition)"
            )
    return ""


def _weierstrass(posed: Posed, at: CurveSamples, kind: str) -> str:
    """Say with which other slope the value is lower than that of a minimum, or higher than that of a maximum."""
    curve, sign = at.discrete.curve, SIGNS[kind]
    here, momentum = _value(at, at.y), _momentum(at)
    for way in _ways(at):
        for reach in REACH:
            other = at.y.copy()
            moved = reach * at.sizes[:, None] * way
            other[at.top] += moved
            there, pushed = _value(at, other), np.sum(momentum * moved, axis=0)
            excess = sign * (there - here - pushed)
            size = np.abs(there) + np.abs(here) + np.abs(pushed)
            lower = (excess < -LOWER * size) & _allowed(at, other) & np.isfinite(excess)
            if lower.any():
                k = int(np.argmax(lower))
                word = "lower" if sign > 0 else "higher"
                what = "slopes" if curve.order == 1 else "second derivatives"
                return (
                    f"this is a {kind} among curves of nearly the same {what} only: curves that change to other {what} and back near "
                    f"{_place(posed, at, k)} have {word} values (Weierstrass' condition), however close to this one they are"
                )
    return ""


def _ways(at: CurveSamples) -> list[Array]:
    """Return directions in which slopes are changed at each place, [coordinates, places]."""
    n = len(at.top)
    random = np.random.default_rng(1)
    given = [*np.eye(n), *(random.normal(size=(DIRECTIONS, n)) if n > 1 else ())]
    basis = _let(at, bounds=False)
    ways = []
    for one in given:
        way = np.stack([b @ (b.T @ one) for b in basis], axis=1)
        ways += [way, -way]
    return ways


def _place(posed: Posed, at: CurveSamples, k: int) -> str:
    over = posed.problem.time
    if posed.curve.exchanged:
        place = float(at.y[posed.curve.coordinates - 1, k])
    else:
        low, high = posed.range(at.z[: posed.curve.unknown])
        place = low + (high - low) * float(at.s[k])
    return f"{over.name} = {place:.4g}{' ' + over.unit if over.unit else ''}"


# ---------------------------------------------------------------- the integrand of the whole


def _value(at: CurveSamples, y: Array) -> Array:
    values: Array = at.lam @ at.discrete.call("integrands", at.s, y, at.z)
    return values


def _momentum(at: CurveSamples) -> Array:
    """Return the derivatives by the slopes of the integrand with all conditions at every place: [coordinates, places]."""
    curve = at.discrete.curve
    found = np.zeros((len(at.top), len(at.s)))
    held = at.y[at.discrete.layout.n * (curve.depth + 1) :]
    for pattern, name, weights in (
        (curve.gradient, "integrand_gradients", at.lam[:, None]),
        (curve.point_gradient, "point_gradients", held),
    ):
        for (k, c), g in zip(pattern, at.discrete.call(name, at.s, at.y, at.z), strict=True):
            found[at.top == c] += weights[k] * g
    return found


def _by_slopes(at: CurveSamples) -> Array:
    """Return the second derivatives by slopes, measured by the sizes of these: [places, coordinates, coordinates]."""
    curve, n = at.discrete.curve, len(at.top)
    found = np.zeros((len(at.s), n, n))
    for pattern, name in ((curve.curvature, "curvature"), (curve.point_curvature, "point_curvature")):
        for (a, b), entry in zip(pattern, at.discrete.call(name, at.s, at.y, at.z), strict=True):
            for i, j in {(a, b), (b, a)}:
                if i in at.top and j in at.top:
                    p, q = int(np.argmax(at.top == i)), int(np.argmax(at.top == j))
                    found[:, p, q] += entry * at.sizes[p] * at.sizes[q]
    return found


def _let(at: CurveSamples, *, bounds: bool) -> list[Array]:
    """Return at each place an orthonormal basis of the changes of slopes, measured by their sizes, that conditions at every
    place allow; with ``bounds`` on slopes as if those that are reached stayed so."""
    curve, n = at.discrete.curve, len(at.top)
    every = [np.eye(n)] * len(at.s)
    if not curve.points:
        return every
    values = at.discrete.call("points", at.s, at.y, at.z)
    rows = np.zeros((len(at.s), len(curve.points), n))
    for (k, c), g in zip(
        curve.point_gradient, at.discrete.call("point_gradients", at.s, at.y, at.z), strict=True
    ):
        first = 0 if curve.points[k].kind == "position" else n
        if first <= c < first + n:
            rows[:, k, c - first] = g * at.sizes[c - first]
    for k, row in enumerate(curve.points):
        free = values[k] > HELD * np.max(np.abs(values[k])) if row.bound else np.zeros(len(at.s), dtype=bool)
        if row.bound and row.kind == "velocity" and not bounds:
            free[:] = True
        rows[free, k] = 0.0
    return [null_space(table, GRADIENTS) for table in rows]


def _allowed(at: CurveSamples, y: Array) -> Array:
    """Tell at which places the conditions on slopes hold with others."""
    curve = at.discrete.curve
    allowed = np.ones(len(at.s), dtype=bool)
    if not any(row.kind == "velocity" for row in curve.points):
        return allowed
    values = at.discrete.call("points", at.s, y, at.z)
    size = np.max(np.abs(at.discrete.call("points", at.s, at.y, at.z)), axis=1) + np.max(
        np.abs(values), axis=1
    )
    for k, row in enumerate(curve.points):
        if row.kind == "velocity":
            allowed &= values[k] >= 0 if row.bound else np.abs(values[k]) <= HELD * size[k]
    return allowed
