"""What is told beside a curve of one coordinate between given ends: conjugate points, and a curve that jumps and is lower."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..problem import Array
from .mesh import gauss
from .posed import Posed
from .search import FoundCurve
from .starts import evaluate, spans
from .unknowns import Unknowns

STEEP = 1e8
"""Slopes at which an integrand is asked how it grows, in sizes of the curve over the range."""
LEVELS = 400
PLACES = 4001


def plain(posed: Posed) -> bool:
    """Tell whether one integral of one coordinate decides, between two given ends, and nothing else."""
    curve = posed.curve
    kinds = sorted(row.kind for row in curve.wholes)
    return (
        (curve.coordinates, curve.order, curve.unknown, len(curve.points)) == (1, 1, 0, 0)
        and kinds == ["final", "initial"]
        and [row.kind for row in curve.numbers if row.kind not in ("lower", "upper")] == ["integral"]
    )


def conjugate_points(posed: Posed, answer: FoundCurve) -> list[float]:
    """Return places that are conjugate to the lower end: zeros of the solution of Jacobi's equation that is zero there."""
    discrete, layout = answer.discrete, answer.discrete.layout
    count, width = discrete.mesh.count, layout.width
    local = discrete.blocks(answer.solved).local
    inside = local[:, 2 * width :, 2 * width :]
    outer = local[:, 2 * width :, : 2 * width]
    bubbles = np.linalg.solve(inside, outer)
    small = local[:, : 2 * width, : 2 * width] - np.swapaxes(outer, 1, 2) @ bubbles
    whole = np.zeros((count + 1, count + 1))
    for e in range(count):
        whole[e : e + 2, e : e + 2] += small[e]
    field = np.zeros(count + 1)
    field[-1] = 1.0
    field[1:-1] = np.linalg.solve(whole[1:-1, 1:-1], -whole[1:-1, -1])
    border = field[:, None]
    ends = np.concatenate([border[:-1], border[1:]], axis=1)
    jacobi = Unknowns(border, -np.einsum("eij,ej->ei", bubbles, ends), answer.solved.whole)

    def at(s: Array) -> Array:
        values: Array = evaluate(discrete, jacobi, s, 0)[0]
        return values

    s = np.linspace(0, 1, PLACES)[1:]
    values = at(s)
    a, b = posed.range(posed.ends)
    return [
        a + (b - a) * _zero(at, float(s[k]), float(s[k + 1]))
        for k in np.flatnonzero(values[:-1] * values[1:] < 0)
    ]


def _zero(at: Callable[[Array], Array], low: float, high: float) -> float:
    sign = at(np.array([low]))[0]
    for _ in range(60):
        middle = (low + high) / 2
        if at(np.array([middle]))[0] * sign > 0:
            low = middle
        else:
            high = middle
    return (low + high) / 2


def jumping(posed: Posed, ends: tuple[float, float], limit: float) -> str:
    """Say which curve that jumps at the ends to a level and rests there is lower than ``limit``; empty if none is.

    It is the limit of smooth curves (Goldschmidt): of slopes only what the integrand grows by counts.
    """
    y = posed.guess(np.linspace(0, 1, 101))
    span = float(max(spans(posed, y)[0], abs(ends[0]), abs(ends[1])))
    low, high = min(ends) - span, max(ends) + span
    curve, z = posed.curve, posed.z(posed.ends)
    height = 2 + curve.depth - 1

    def integrand(s: Array, y: Array, slope: float) -> Array:
        rows = np.zeros((height, len(s)))
        rows[0], rows[1] = y, slope
        with np.errstate(all="ignore"):
            found: Array = posed.functions["integrands"](s, rows, np.zeros(0), z, posed.p)[0]
        return found

    def growth(end: int, y: Array, sign: float) -> Array:
        return integrand(np.full(len(y), float(end)), y, sign * STEEP * span) / (STEEP * span)

    probe = np.linspace(min(ends), max(ends), 7)
    far = integrand(np.zeros(7), probe, 10 * STEEP * span) / (10 * STEEP * span)
    if not np.allclose(far, growth(0, probe, 1.0), rtol=1e-6, atol=0) or not np.isfinite(far).all():
        return ""
    xi, weights = gauss(40)

    def value(level: float) -> float:
        total = float(np.sum(weights * integrand((1 + xi) / 2, np.full(len(xi), level), 0.0)) / 2)
        for end, place in enumerate(ends):
            path = place + (level - place) * (1 + xi) / 2
            rates = growth(end, path, 1.0 if (level > place) != bool(end) else -1.0)
            if not np.isfinite(rates).all() or np.any(rates < 0):
                return np.inf  # beyond where the integrand keeps its sign
            total += abs(level - place) * float(np.sum(weights * rates)) / 2
        return total if np.isfinite(total) else np.inf

    levels = np.unique(
        [*np.linspace(low, high, LEVELS), 0.0] if low < 0 < high else np.linspace(low, high, LEVELS)
    )
    values = np.array([value(float(c)) for c in levels])
    k = int(np.argmin(values))
    left, right = float(levels[max(k - 1, 0)]), float(levels[min(k + 1, len(levels) - 1)])
    level, best = float(levels[k]), float(values[k])
    for _ in range(80):
        a, b = left + 0.382 * (right - left), right - 0.382 * (right - left)
        left, right = (left, b) if value(a) < value(b) else (a, right)
    if value((left + right) / 2) < best:
        level, best = (left + right) / 2, value((left + right) / 2)
    numbers = posed.z(posed.ends)
    numbers[0] = best
    told = float(
        posed.functions["wholes"](np.zeros(1), np.zeros((height, 1)), np.zeros(0), numbers, posed.p)[0, 0]
    )
    if not np.isfinite(told) or (np.isfinite(limit) and told >= limit - 1e-9 * abs(limit)):
        return ""
    name, over = posed.problem.states[0].name, posed.problem.time
    a, b = posed.range(posed.ends)
    unit = f" {curve.unit}" if curve.unit else ""
    lower = "lower value" if np.isfinite(limit) else "value"
    return (
        f"curves that come near to one that jumps have the {lower} {told:.9g}{unit}: {name} from {ends[0]:.6g} to {level:.6g} "
        f"at {over.name} = {a:.6g}, resting there, and to {ends[1]:.6g} at {over.name} = {b:.6g}"
    )
