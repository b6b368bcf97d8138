"""The state that an assembly moves: which velocities belong to which coordinates, and how far it is from its guess.

Coordinates are weighed by one over their characteristic length, angles by one over a radian; rotations move along their
body axes and deviate by the angle of the rotation from the guess.
"""

from __future__ import annotations

import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

from ..functions import Functions
from ..nominal import PURE
from ..problem import Array, Problem
from .gauss_newton import Local

ATTEMPTS = 8

Flags = NDArray[np.bool_]


class Task(Struct, frozen=True):
    """One assembly: the functions at fixed t, u, z, p, and which velocities belong to which coordinates."""

    problem: Problem
    functions: Functions
    t: float
    u: Array
    z: Array
    p: Array
    known: Flags
    partner: tuple[int, ...]
    """Index in y of the coordinate of each velocity; of its first entry for a rotation."""

    def rows(self, stage: int, known: bool) -> list[int]:
        return [i for i, r in enumerate(self.problem.assembly) if r.stage == stage and r.known == known]

    def local(self, y: Array, stage: int, deviation: Array, lengths: float) -> Local:
        """Residuals and Jacobians at y. Wishes are weighed like coordinates."""
        assert self.functions.assembly is not None and self.functions.assembly_jacobian is not None
        values = self.functions.assembly(self.t, y, self.u, self.z, self.p)
        matrix = self.functions.assembly_jacobian(self.t, y, self.u, self.z, self.p)
        matrix = matrix.reshape(len(self.problem.assembly), self.problem.nv)
        hard, soft = self.rows(stage, True), self.rows(stage, False)
        share = np.array([1.0 if self.problem.assembly[i].unit in PURE else 1 / lengths for i in soft])
        return Local(
            values[hard], matrix[hard], share * values[soft], share[:, None] * matrix[soft], deviation
        )


def partners(problem: Problem) -> tuple[int, ...]:
    places = {q.name: i for i, q in enumerate(problem.states[: problem.nq])}
    result = []
    for quantity in problem.states[problem.nq : problem.nq + problem.nv]:
        name = quantity.name.removeprefix("der(")
        base, _, _ = name.rpartition(")")
        result.append(places[base] if base in places else places[f"{base}[1]"])
    return tuple(result)


def without_velocity(task: Task) -> list[int]:
    """Coordinates in y whose rates are prescribed: nothing moves them."""
    problem = task.problem
    moved = {i + k for i in task.partner for k in range(4 if i in problem.rotations else 1)}
    return [i for i in range(problem.nq) if i not in moved]


def displaced(problem: Problem, partner: tuple[int, ...], y: Array, d: Array) -> Array:
    """Return y with its coordinates moved along d [nv], rotations about their body axes."""
    moved = y.copy()
    for j, i in enumerate(partner):
        if i not in problem.rotations:
            moved[i] += d[j]
        elif j == 0 or partner[j - 1] != i:
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


def deviation_from(task: Task, y: Array, guess: Array) -> Array:
    """How far each coordinate is from its guess, [nv]; for a rotation the rotation vector from the guess."""
    result = np.zeros(task.problem.nv)
    for j, i in enumerate(task.partner):
        if i not in task.problem.rotations:
            result[j] = y[i] - guess[i]
        elif j == 0 or task.partner[j - 1] != i:
            result[j : j + 3] = rotation_vector(guess[i : i + 4], y[i : i + 4])
    return result


def rotation_vector(a: Array, b: Array) -> Array:
    relative = _product(a * np.array([1.0, -1.0, -1.0, -1.0]), b)
    relative = relative if relative[0] >= 0 else -relative
    size = float(np.linalg.norm(relative[1:]))
    return relative[1:] * (2 * np.arctan2(size, relative[0]) / size if size > 1e-300 else 2.0)


def characteristic_length(problem: Problem, p: Array) -> float:
    """The characteristic size of lengths: the geometric mean of the parameters that are lengths, else 1."""
    sizes = [abs(float(x)) for q, x in zip(problem.parameters, p, strict=False) if q.unit == "m" and x != 0]
    return float(np.exp(np.mean(np.log(sizes)))) if sizes else 1.0


def weight_of(problem: Problem, task: Task, j: int, length: float) -> float:
    quantity = problem.states[task.partner[j]]
    if task.partner[j] in problem.rotations:
        return 1.0
    if quantity.nominal is not None:
        return 1 / abs(quantity.nominal)
    return 1.0 if quantity.unit in PURE else 1 / length


def disturbed(task: Task, guess: Array, free: NDArray[np.intp], weights: Array) -> list[Array]:
    """States around the guess, always the same ones: the guess itself may be a position where nothing can begin."""
    numbers = np.random.default_rng(3)
    states = []
    for k in range(ATTEMPTS):
        d = np.zeros(task.problem.nv)
        d[free] = min(0.05 * 2.0**k, 1.5) * numbers.standard_normal(free.size) / weights[free]
        states.append(displaced(task.problem, task.partner, guess, d))
    return states
