"""Integrals that have no finite value along a curve: their integrand grows like 1/distance, or faster, towards a place."""

from __future__ import annotations

import numpy as np

from ..problem import Array
from .discrete import DiscreteCurve
from .posed import Posed
from .starts import evaluate
from .unknowns import Unknowns

DISTANCES = np.array([1e-3, 1e-7])
"""Shares of the range beside a place at which integrands are compared."""
LEAST = 0.7
"""Of integrand times distance that is left between them where an integral has no value: for d^-0.9 it is 0.4, for 1/d it is 1."""
GROWS = "the integrand of '{}' grows like 1/distance, or faster, towards {}"
SCAN, ZOOMS = 201, 6


def diverging(posed: Posed, discrete: DiscreteCurve, unknowns: Unknowns, z: Array) -> dict[str, str]:
    """Return integrals without a finite value by name, each with the place that it fails at, as it is shown."""
    curve = posed.curve
    found: dict[str, str] = {}
    for function, rows in (("integrands", curve.numbers), ("further_integrands", curve.further)):
        names = [row.name for row in rows if row.kind == "integral"]

        def values(s: Array, function: str = function) -> Array:
            y = evaluate(discrete, unknowns, s, curve.depth)
            return np.abs(discrete.call(function, s, y, z))

        for k, name in enumerate(names):
            for s in (0.0, 1.0, _largest(values, k)):
                if _diverges(values, k, s):
                    found.setdefault(name, _shown(posed, discrete, unknowns, s))
    return found


def _diverges(values, k: int, s: float) -> bool:  # type: ignore[no-untyped-def]
    """Tell whether integrand times distance does not become small beside a place."""
    for side in (-1, 1):
        at = s + side * DISTANCES
        if np.any(at <= 0) or np.any(at >= 1):
            continue
        far, near = values(at)[k] * DISTANCES
        if not np.isfinite(near) or (np.isfinite(far) and near > LEAST * far > 0):
            return True
    return False


def _largest(values, k: int) -> float:  # type: ignore[no-untyped-def]
    """Return where an integrand is largest."""
    low, high = 0.0, 1.0
    at = 0.5
    for _ in range(ZOOMS):
        s = np.linspace(low, high, SCAN)
        size = values(s)[k]
        at = float(s[np.argmax(np.where(np.isfinite(size), size, np.inf))])
        width = (high - low) * 4 / SCAN
        low, high = max(0.0, at - width), min(1.0, at + width)
    return at


def _shown(posed: Posed, discrete: DiscreteCurve, unknowns: Unknowns, s: float) -> str:
    curve, over = posed.curve, posed.problem.time
    if curve.exchanged:
        place = float(evaluate(discrete, unknowns, np.array([s]), 0)[curve.coordinates - 1, 0])
    else:
        a, b = posed.range(unknowns.whole[: curve.unknown])
        place = a + (b - a) * s
        place = 0.0 if abs(place) < 1e-9 * (b - a) else place
    return f"{over.name} = {place:.6g}{' ' + over.unit if over.unit else ''}"
