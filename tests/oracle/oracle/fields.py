"""Derivatives of fields by their place, by central differences of order eight."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from oracle.series import real

Value = Any
Combined = Callable[[int | None, list[float], list[float], bool], Value]
WEIGHTS = [4 / 5, -1 / 5, 4 / 105, -1 / 280]
"""Of f(place + k step) - f(place - k step) in the derivative, times the step."""
_BOTH = np.array([*(-w for w in reversed(WEIGHTS)), 0, *WEIGHTS])
TWICE = [float(x) for x in np.convolve(_BOTH, _BOTH)[9:]]
"""Of f(place + k step) + f(place - k step) - 2 f(place) in the derivative of that, times the square of the step."""


def moved(place: Value, index: int | None, distance: Any) -> Value:
    """Return a place moved along one component, or the number that it is."""
    if index is None:
        return place + distance
    out = np.array(place, object)
    out[index] = out[index] + distance
    return out


def differences(operator: str, combined: Combined, place: Value) -> Value:
    """Return what an operator makes of a field at a place.

    ``combined(index, distances, weights, even)``: the sum of the weights times f(place + d) - f(place - d), or, even,
    f(place + d) + f(place - d) - 2 f(place).
    """
    single = not isinstance(place, np.ndarray)
    size = abs(real(place)) if single else max(abs(real(x)) for x in place)
    step = 0.02 * (size or 1.0)
    indices = [None] if single else list(range(len(place)))

    def derived(index: int | None, weights: list[float], order: int) -> Value:
        distances = [step * k for k in range(1, len(weights) + 1)]
        return combined(index, distances, [w / step**order for w in weights], order == 2)

    if operator == "laplacian":
        twice = [derived(k, TWICE, 2) for k in indices]
        return sum(twice[1:], twice[0])
    slopes = [derived(k, WEIGHTS, 1) for k in indices]
    if single:
        return slopes[0]
    if operator == "curl":
        turns = [
            slopes[j][k] - slopes[k][j] for j, k in ((0, 1), (1, 2), (2, 0))[: 1 if len(place) == 2 else 3]
        ]
        return turns[0] if len(place) == 2 else np.array([turns[1], turns[2], turns[0]], object)
    jacobian = np.empty((*np.shape(slopes[0]), len(place)), object)
    for k, slope in enumerate(slopes):
        jacobian[..., k] = slope
    return jacobian if operator == "grad" else np.trace(jacobian, axis1=-2, axis2=-1)
