"""Values with first and second derivatives at many places at once."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Numbers = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Jet:
    """Hold ``value`` [places], ``slope`` [places, variables] and ``bend`` [places, variables, variables]."""

    value: Numbers
    slope: Numbers
    bend: Numbers

    def __add__(self, other: Jet) -> Jet:
        return Jet(self.value + other.value, self.slope + other.slope, self.bend + other.bend)

    def __sub__(self, other: Jet) -> Jet:
        return Jet(self.value - other.value, self.slope - other.slope, self.bend - other.bend)

    def __mul__(self, other: Jet) -> Jet:
        crossed = self.slope[:, :, None] * other.slope[:, None, :]
        bend = self.value[:, None, None] * other.bend + other.value[:, None, None] * self.bend
        slope = self.value[:, None] * other.slope + other.value[:, None] * self.slope
        return Jet(self.value * other.value, slope, bend + crossed + crossed.transpose(0, 2, 1))

    def __truediv__(self, other: Jet) -> Jet:
        return self * power(other, -1.0)

    def through(self, value: Numbers, first: Numbers, second: Numbers) -> Jet:
        """Return f(self) of a function with these values and derivatives."""
        square = self.slope[:, :, None] * self.slope[:, None, :]
        bend = first[:, None, None] * self.bend + second[:, None, None] * square
        return Jet(value, first[:, None] * self.slope, bend)


def constant(value: float | Numbers, places: int, variables: int) -> Jet:
    filled = np.broadcast_to(np.asarray(value, dtype=float), (places,)).copy()
    return Jet(filled, np.zeros((places, variables)), np.zeros((places, variables, variables)))


def power(base: Jet, n: float) -> Jet:
    x = base.value
    first = n * x ** (n - 1) if n else 0 * x
    second = n * (n - 1) * x ** (n - 2) if n not in (0, 1) else 0 * x
    return base.through(x**n, first, second)


def _tanh(x: Numbers) -> tuple[Numbers, Numbers, Numbers]:
    t = np.tanh(x)
    return t, 1 - t * t, -2 * t * (1 - t * t)


def _atan(x: Numbers) -> tuple[Numbers, Numbers, Numbers]:
    d = 1 / (1 + x * x)
    return np.arctan(x), d, -2 * x * d * d


def _sqrt(x: Numbers) -> tuple[Numbers, Numbers, Numbers]:
    r = np.sqrt(x)
    return r, 0.5 / r, -0.25 / r**3


FUNCTIONS: dict[str, Callable[[Numbers], tuple[Numbers, Numbers, Numbers]]] = {
    "sin": lambda x: (np.sin(x), np.cos(x), -np.sin(x)),
    "cos": lambda x: (np.cos(x), -np.sin(x), -np.cos(x)),
    "exp": lambda x: (np.exp(x), np.exp(x), np.exp(x)),
    "cosh": lambda x: (np.cosh(x), np.sinh(x), np.cosh(x)),
    "sinh": lambda x: (np.sinh(x), np.cosh(x), np.sinh(x)),
    "log": lambda x: (np.log(x), 1 / x, -1 / x**2),
    "sqrt": _sqrt,
    "tanh": _tanh,
    "atan": _atan,
}
