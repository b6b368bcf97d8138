"""Derivatives of fields by their place, by central differences of order eight."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from oracle.series import real

Value = Any
Field = Callable[[Value], Value]
WEIGHTS = (4 / 5, -1 / 5, 4 / 105, -1 / 280)


def partial(field: Field, place: Value, index: int | None, step: float) -> Value:
    """Return the derivative by one component of the place, or by the place where it is one number."""

    def beside(distance: float) -> Value:
        if index is None:
            return field(place + distance)
        moved = np.array(place, object)
        moved[index] = moved[index] + distance
        return field(moved)

    pairs = [(beside(k * step) - beside(-k * step)) * (w / step) for k, w in enumerate(WEIGHTS, 1)]
    return sum(pairs[1:], pairs[0])


def differences(operator: str, field: Field, place: Value) -> Value:
    """Return what an operator makes of a field at a place."""
    single = not isinstance(place, np.ndarray)
    size = abs(real(place)) if single else max(abs(real(x)) for x in place)
    step = 0.02 * (size or 1.0)
    indices = [None] if single else list(range(len(place)))
    if operator == "laplacian":
        twice = [
            partial(lambda at, k=k: partial(field, at, k, step), place, k, step)  # type: ignore[misc]
            for k in indices
        ]
        return sum(twice[1:], twice[0])
    slopes = [partial(field, place, k, step) for k in indices]
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
