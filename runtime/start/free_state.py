"""Ways of a state: which velocities belong to which coordinates, and how far it is from another.

Coordinates are weighed by one over their characteristic length, angles by one over a radian; rotations move along their
body axes and deviate by the angle of the rotation between both.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..problem import Array
from .facts import StartFacts

Flags = NDArray[np.bool_]


def displaced(facts: StartFacts, y: Array, d: Array) -> Array:
    """Return y with its coordinates moved along d [nv], rotations about their body axes."""
    moved = y.copy()
    for j, i in enumerate(facts.partner):
        if i not in facts.rotations:
            moved[i] += d[j]
        elif j == 0 or facts.partner[j - 1] != i:
            moved[i : i + 4] = turned(y[i : i + 4], d[j : j + 3])
    return moved


def turned(q: Array, turn: Array) -> Array:
    angle = float(np.linalg.norm(turn))
    half = np.array([np.cos(angle / 2), *(np.sinc(angle / (2 * np.pi)) / 2 * turn)])
    product = _product(q, half)
    return product / np.linalg.norm(product)


def _product(a: Array, b: Array) -> Array:
    vector = a[0] * b[1:] + b[0] * a[1:] + np.cross(a[1:], b[1:])
    return np.array([a[0] * b[0] - a[1:] @ b[1:], *vector])


def deviation_from(facts: StartFacts, y: Array, guess: Array) -> Array:
    """How far each coordinate is from its guess, [nv]; for a rotation the rotation vector from the guess."""
    result = np.zeros(facts.nv)
    for j, i in enumerate(facts.partner):
        if i not in facts.rotations:
            result[j] = y[i] - guess[i]
        elif j == 0 or facts.partner[j - 1] != i:
            result[j : j + 3] = rotation_vector(guess[i : i + 4], y[i : i + 4])
    return result


def rotation_vector(a: Array, b: Array) -> Array:
    relative = _product(a * np.array([1.0, -1.0, -1.0, -1.0]), b)
    relative = relative if relative[0] >= 0 else -relative
    size = float(np.linalg.norm(relative[1:]))
    return relative[1:] * (2 * np.arctan2(size, relative[0]) / size if size > 1e-300 else 2.0)


def characteristic_length(facts: StartFacts, p: Array) -> float:
    """The characteristic size of lengths: the geometric mean of the parameters that are lengths, else 1."""
    sizes = [abs(float(p[k])) for k in facts.lengths if p[k] != 0]
    return float(np.exp(np.mean(np.log(sizes)))) if sizes else 1.0


def weights_of(facts: StartFacts, length: float) -> Array:
    """One over the size of the coordinate of each velocity."""
    return np.array([1 / (size or length) for size in facts.size])


def even_numbers(seed: int, count: int) -> Array:
    """Return numbers that are evenly spread with variance 1, the same as the kernel's.

    G. Steele, D. Lea, C. Flood, Fast splittable pseudorandom number generators, OOPSLA 2014.
    """
    numbers = []
    for k in range(1, count + 1):
        x = (seed + k * 0x9E3779B97F4A7C15) & (2**64 - 1)
        x = ((x ^ x >> 30) * 0xBF58476D1CE4E5B9) & (2**64 - 1)
        x = ((x ^ x >> 27) * 0x94D049BB133111EB) & (2**64 - 1)
        numbers.append((x ^ x >> 31) >> 11)
    return 1.7320508075688772 * (np.array(numbers, float) / 2.0**52 - 1)
