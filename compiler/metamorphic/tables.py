"""Tables as what they stand for: a cubic polynomial in each piece, straight lines outside."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from itertools import pairwise
from random import Random

from ..flat import types
from ..flat.model import Apply, Expression, FlatModel, Type
from ..flat.values.evaluate import Value, constant
from .rewriting import choice, compared, number, product, rewritten, total, undrawn
from .twin import NotApplicable, Seen, Twin

MOST = 12
"""Points of a table that is written out."""
Numbers = tuple[Fraction, ...]


def tables_in_pieces(model: FlatModel, seen: Seen | None, random: Random) -> Twin:
    """Write `table` by `if` over its intervals."""
    found = 0

    def change(e: Expression) -> Expression:
        nonlocal found
        match e:
            case Apply(function="table", arguments=(x, xs, ys)):
                points, values = (_numbers(constant(a)) for a in (xs, ys))
                if points is None or values is None or len(points) > MOST:
                    return e
                found += 1
                return _written(x, points, values, e.type)
            case _:
                return e

    made = rewritten(undrawn(model), change)
    if not found:
        raise NotApplicable(f"it has no tables of at most {MOST} points")
    return Twin("tables in pieces", "tables as polynomials, piece by piece", made)


def _numbers(value: Value | None) -> Numbers | None:
    if not isinstance(value, tuple) or not all(isinstance(x, Fraction) for x in value):
        return None
    return tuple(x for x in value if isinstance(x, Fraction))


def _written(x: Expression, points: Numbers, values: Numbers, type: Type) -> Expression:
    slopes = _slopes(points, values)
    found = _polynomial(x, points[-1], (values[-1], slopes[-1]), type)
    pieces = list(zip(pairwise(points), pairwise(values), pairwise(slopes), strict=True))
    for (a, b), (f, g), (s, t) in reversed(pieces):
        h = b - a
        rise = (g - f) / h
        piece = _polynomial(x, a, (f, s, (3 * rise - 2 * s - t) / h, (s + t - 2 * rise) / h**2), type)
        found = choice(compared("less", x, number(b, x.type, x.span)), piece, found)
    first = _polynomial(x, points[0], (values[0], slopes[0]), type)
    return choice(compared("less", x, number(points[0], x.type, x.span)), first, found)


def _polynomial(x: Expression, at: Fraction, terms: Sequence[Fraction], type: Type) -> Expression:
    """Return terms[0] + terms[1] (x - at) + ..., by Horner's rule."""
    away = total(x, number(at, x.type, x.span), "subtract")
    dimension = type.dimension
    for _ in terms[1:]:
        dimension = dimension / x.type.dimension
    found: Expression = number(terms[-1], types.real(dimension), x.span)
    for term in reversed(terms[:-1]):
        dimension = dimension * x.type.dimension
        found = total(number(term, types.real(dimension), x.span), product(found, away))
    return found


def _slopes(x: Numbers, y: Numbers) -> Numbers:
    """Return the slopes at the points: weighted harmonic means of the secants (F. N. Fritsch, J. Butland 1984)."""
    widths = [b - a for a, b in pairwise(x)]
    secants = [(g - f) / h for (f, g), h in zip(pairwise(y), widths, strict=True)]
    if len(secants) == 1:
        return (secants[0], secants[0])
    inner = []
    for (h, k), (s, t) in zip(pairwise(widths), pairwise(secants), strict=True):
        if s * t <= 0:
            inner.append(Fraction(0))
            continue
        a, b = 2 * k + h, k + 2 * h
        inner.append((a + b) / (a / s + b / t))
    first = _end(widths[0], widths[1], secants[0], secants[1])
    last = _end(widths[-1], widths[-2], secants[-1], secants[-2])
    return (first, *inner, last)


def _end(h: Fraction, k: Fraction, s: Fraction, t: Fraction) -> Fraction:
    """Return the slope at an end: of the parabola through three points, as far as it does not overshoot."""
    slope = ((2 * h + k) * s - h * t) / (h + k)
    if slope * s <= 0:
        return Fraction(0)
    return 3 * s if s * t <= 0 and abs(slope) > 3 * abs(s) else slope
