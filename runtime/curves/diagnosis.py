"""Why there is no curve: conditions that contradict one another or that nothing meets, values that fall without bound."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..numerics.rank import POSITIONS, independent_rows, rank
from .discrete import DiscreteCurve
from .first_solution import value_of
from .mesh import mesh_of
from .newton import projected, stiffly
from .posed import Posed
from .starts import Source, beginning, ends_given, evaluate, gauge, spans, undefined, with_numbers, with_waves
from .unknowns import Unknowns

ELEMENTS, DEGREE = 6, 6
MISSED = 1e-6
"""Of the size of its terms by which a condition that is met may be off."""
STEPS, DOUBLINGS = 40, 30
BOTTOMLESS = 1e8
"""Times the size of the value's terms with the guess: a value that falls below the negative of that has no bound."""
SAME = 1e-10
ZERO = 1e-15
"""Of the larger end: a smaller one is rounding."""


def contradiction(posed: Posed) -> str:
    """Say which condition at every place the given ends contradict; empty if none does."""
    if not posed.curve.points:
        return ""
    discrete, first = begun(posed, posed.guess, 2)
    size = float(np.max(discrete.sizes(first)))
    for upper in (False, True):
        ends, rows, values = ends_given(discrete, first, upper)
        for k, row in enumerate(posed.curve.points):
            if row.kind != "position":  # slopes at the ends are free to meet it
                continue
            scale = float(np.abs(rows[k]).max())
            if scale == 0 or np.isnan(values[k]):
                continue
            more = np.vstack([ends, rows[k : k + 1] / scale])
            if rank(more, POSITIONS) > rank(ends, POSITIONS):
                continue
            off = float(values[k]) / (scale * size)
            if off < -MISSED or (abs(off) > MISSED and not row.bound):
                a, b = posed.range(posed.ends)
                over = posed.problem.time
                unit = f" {over.unit}" if over.unit else ""
                return (
                    f"'{row.name}' does not hold where the ends are given: at {over.name} = {b if upper else a:.6g}{unit} "
                    f"its sides differ by {values[k]:.4g}{' ' + row.unit if row.unit else ''}"
                )
    return ""


def obstructions(posed: Posed, jumps: str) -> Iterator[str]:
    """Yield why there may be no curve, the surest reasons first; ``jumps``: what is said of one that jumps."""
    discrete, first = begun(posed, posed.guess, ELEMENTS)
    if undefined(discrete, first):
        return
    if said := _dependent(discrete, first):
        yield said
        return
    if any(row.kind == "whole" for row in posed.curve.wholes):
        if said := _unmet(posed):
            yield said
        return
    if posed.curve.points or posed.curve.gauge:
        return
    if _same_for_all(discrete, first):
        yield "what is stationary is the same for every curve between these ends: it decides none"
    elif said := jumps or _bottomless(posed, discrete, first):
        yield said


def ends_of(posed: Posed) -> tuple[float, float]:
    """Return the values of the first coordinate at both ends that a guess bent to them has."""
    discrete, first = begun(posed, posed.guess, 2)
    low, high = evaluate(discrete, first, np.array([0.0, 1.0]), 0)[0]
    least = ZERO * max(abs(low), abs(high))
    return (float(low) if abs(low) > least else 0.0), (float(high) if abs(high) > least else 0.0)


def begun(posed: Posed, source: Source, count: int) -> tuple[DiscreteCurve, Unknowns]:
    degree = max(DEGREE, 2 * posed.curve.order + 2)
    mesh = mesh_of(posed.borders(), count, degree, (False, False))
    discrete = DiscreteCurve(posed.problem, mesh, posed.p, gauge(posed, source))
    return discrete, beginning(discrete, posed, source)[0]


def _dependent(discrete: DiscreteCurve, first: Unknowns) -> str:
    """Say which conditions at ends are not further conditions."""
    rows = discrete.curve.wholes
    z, y = discrete._z(first), np.zeros((discrete._height(), 1))
    by_numbers = np.zeros((len(rows) + 1, discrete.layout.unknown + discrete.layout.numbers))
    for (row, c), g in zip(
        discrete.curve.whole_gradient, discrete.call("whole_gradients", np.zeros(1), y, z)[:, 0], strict=True
    ):
        by_numbers[row, c] = g
    which = [k for k, row in enumerate(rows) if row.kind in ("initial", "final")]
    table = by_numbers[1:][which]
    table = table / (np.abs(table).max(axis=1, keepdims=True) + 1e-300)
    kept = independent_rows(table, POSITIONS)
    extra = [rows[which[k]].name for k in range(len(which)) if k not in kept]
    if not extra:
        return ""
    return f"'{extra[0]}' repeats or contradicts what else is given at the ends: leave one of them out"


def _unmet(posed: Posed) -> str:
    """Say which conditions on the whole no curve was found to meet."""
    size = spans(posed, posed.guess(np.linspace(0, 1, 201)))
    starts = [posed.guess, *(s for _, s in with_waves(posed.guess, size, (0.5, -0.5)))][:5]
    best, said = np.inf, ""
    for source in starts:
        discrete, first = begun(posed, source, ELEMENTS)
        if undefined(discrete, first):
            continue
        found = with_numbers(discrete, projected(discrete, first, every=True))
        y = np.zeros((discrete._height(), 1))
        residuals = discrete.call("wholes", np.zeros(1), y, discrete._z(found))[1:, 0]
        numbers = found.whole[discrete.layout.unknown : discrete.layout.unknown + discrete.layout.numbers]
        off = np.abs(residuals) / (np.max(np.abs(numbers)) + 1e-300)
        if not np.isfinite(off).all():
            continue
        if off.max() < best:
            k = int(np.argmax(off))
            row = posed.curve.wholes[k]
            best = float(off[k])
            said = f"no curve was found that meets '{row.name}': the nearest one is off by {residuals[k]:.4g}"
            said += f" {row.unit}" if row.unit else ""
    return said if best > MISSED else ""


def _same_for_all(discrete: DiscreteCurve, first: Unknowns) -> bool:
    """Tell whether nothing inside of the range changes the value."""
    blocks = discrete.blocks(first)
    inside = np.unique(discrete.layout.place)
    inside = inside[inside >= 2 * discrete.layout.width]
    scale = float(np.abs(blocks.local).max()) + float(np.abs(first.whole).max()) + 1e-300
    curved = float(np.abs(blocks.local[:, inside[:, None], inside[None, :]]).max())
    return bool(max(curved, float(np.abs(blocks.local_residual[:, inside]).max())) < SAME * scale)


def _bottomless(posed: Posed, discrete: DiscreteCurve, first: Unknowns) -> str:
    """Say how far the value falls if a curve is moved down it again and again; empty where that comes to an end."""
    at = first
    value, size = value_of(discrete, at)
    limit = -np.inf
    for _ in range(STEPS):
        step = stiffly(discrete, at)
        if step is None:
            return ""
        share, moved = 1.0, False
        for _ in range(DOUBLINGS):
            after = with_numbers(discrete, at.moved(step, share))
            lower = value_of(discrete, after)[0]
            if not np.isfinite(lower):
                break
            if lower >= value:
                if moved:
                    break
                share /= 4
                continue
            best, value, moved = after, lower, True
            if not np.isfinite(limit):
                limit = -BOTTOMLESS * max(size, abs(lower))
            share *= 2
            if value < limit:
                unit = f" {posed.curve.unit}" if posed.curve.unit else ""
                return f"what is stationary has no lower bound: beside the guess it falls below {value:.3g}{unit}"
        if not moved:
            return ""
        at = best
    return ""
