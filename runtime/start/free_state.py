"""The state that an assembly moves: which velocities belong to which coordinates, and how far it is from its guess.

Coordinates are weighed by one over their characteristic length, angles by one over a radian; rotations move along their
body axes and deviate by the angle of the rotation from the guess. What follows the marker stands in modules of the Python
target, too.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..problem import Array, ModelFunction
from .facts import StartFacts
from .gauss_newton import Local

Flags = NDArray[np.bool_]


# ---- copied from here

ATTEMPTS = 8
LEAST = 1e-3
"""Of the sizes in a model: rows with smaller gradients are measured as if they had these, so that rounding is none of them."""


class Task(NamedTuple):
    """One assembly: the functions at fixed t, u, z, p, the characteristic ``length``, and ``weights`` [nv]."""

    facts: StartFacts
    residuals: ModelFunction
    jacobian: ModelFunction
    t: float
    u: Array
    z: Array
    p: Array
    known: Flags
    length: float
    weights: Array

    def rows(self, stage: int, hard: bool) -> list[int]:
        return [i for i, row in enumerate(self.facts.rows) if row[:2] == (stage, hard)]

    def free(self, stage: int) -> NDArray[np.intp]:
        """Which of the velocities may move."""
        facts = self.facts
        places = facts.partner if stage == 1 else range(facts.nq, facts.nq + facts.nv)
        return np.flatnonzero([not self.known[i] for i in places])

    def local(self, y: Array, stage: int, deviation: Array) -> Local:
        """Residuals and Jacobians at y. Wishes are weighed like coordinates."""
        values = self.residuals(self.t, y, self.u, self.z, self.p)
        matrix = self.jacobian(self.t, y, self.u, self.z, self.p)
        matrix = matrix.reshape(len(self.facts.rows), self.facts.nv)
        hard, soft = self.rows(stage, True), self.rows(stage, False)
        share = np.array([1.0 if self.facts.rows[i][2] == 1 else 1 / self.length for i in soft])
        sizes = (0.0, *self.sizes(y, stage))
        least = np.array([LEAST * sizes[self.facts.rows[i][2]] for i in hard])
        return Local(
            values[hard], matrix[hard], share * values[soft], share[:, None] * matrix[soft], deviation, least
        )

    def sizes(self, y: Array, stage: int) -> tuple[float, float]:
        """The size of what pure numbers and lengths of the model are made of, or of their rates."""
        facts = self.facts
        lengths = [abs(float(y[i])) for i, size in zip(facts.partner, facts.size, strict=True) if size == 0]
        speed = float(np.abs(self.weights * y[facts.nq : facts.nq + facts.nv]).max(initial=1.0))
        rate = speed if stage == 2 else 1.0
        return rate, rate * max([self.length, *lengths])


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


def disturbed(
    task: Task, move: Callable[[Array, Array], Array], first: Array, free: NDArray[np.intp]
) -> list[Array]:
    """States around the first one, always the same ones: it may be one where nothing can begin."""
    numbers = even_numbers(3, ATTEMPTS * free.size).reshape(ATTEMPTS, free.size)
    states = []
    for k in range(ATTEMPTS):
        d = np.zeros(task.facts.nv)
        d[free] = min(0.05 * 2.0**k, 1.5) * numbers[k] / task.weights[free]
        states.append(move(first, d))
    return states


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
