"""Displacements of a state: one number for each coordinate, three for a rotation, then velocities and states."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np
from msgspec import Struct

from ..problem import Array, Problem
from ..start.free_state import rotation_vector, turned


class Chart(Struct, frozen=True):
    """``places``: the index in y of each displacement of the positions, of the first of four numbers for those of a
    rotation; ``behind``: that of each displacement after those, of velocities and states; ``names`` and ``units`` of all."""

    problem: Problem
    places: tuple[int, ...]
    behind: tuple[int, ...]
    names: tuple[str, ...]
    units: tuple[str, ...]

    @property
    def nd(self) -> int:
        return len(self.places)

    @property
    def size(self) -> int:
        return len(self.names)

    def place(self, j: int) -> int:
        """Return the index in y of a displacement, of the first of four numbers for one of a rotation."""
        return self.places[j] if j < self.nd else self.behind[j - self.nd]

    def moved(self, y: Array, d: Array) -> Array:
        """Return a state displaced by d [size]; rotations are turned about their body axes."""
        problem, result = self.problem, y.copy()
        for j, i in enumerate(self.places):
            if i not in problem.rotations:
                result[i] += d[j]
            elif j == 0 or self.places[j - 1] != i:
                result[i : i + 4] = turned(y[i : i + 4], d[j : j + 3])
        result[list(self.behind)] += d[self.nd :]
        return result

    def between(self, start: Array, y: Array) -> Array:
        """Return the displacement [size] that leads from one state to another."""
        problem, d = self.problem, np.zeros(self.size)
        for j, i in enumerate(self.places):
            if i not in problem.rotations:
                d[j] = y[i] - start[i]
            elif j == 0 or self.places[j - 1] != i:
                d[j : j + 3] = rotation_vector(start[i : i + 4], y[i : i + 4])
        behind = list(self.behind)
        d[self.nd :] = y[behind] - start[behind]
        return d

    def of_entries(self, y: Array) -> Array:
        """Return the derivative [ny][size] of all numbers of y by displacements."""
        matrix = np.zeros((self.problem.ny, self.size))
        for j, i in enumerate(self.places):
            if i not in self.problem.rotations:
                matrix[i, j] = 1.0
                continue
            axis = np.zeros(3)
            axis[j - self.places.index(i)] = 0.5
            s, x = y[i], y[i + 1 : i + 4]
            matrix[i, j] = -(x @ axis)
            matrix[i + 1 : i + 4, j] = s * axis + np.cross(x, axis)
        for k, i in enumerate(self.behind):
            matrix[i, self.nd + k] = 1.0
        return matrix


def chart_of(problem: Problem, following: Collection[int] = ()) -> Chart:
    """Return the displacements of the states on which the motion depends, and of some ``following`` ones."""
    places: list[int] = []
    names: list[str] = []
    units: list[str] = []
    i = 0
    while i < problem.nq:
        quantity = problem.states[i]
        if i in problem.rotations:
            base = quantity.name.removesuffix("[1]")
            places += [i] * 3
            names += [f"{base}.turn[{k}]" for k in (1, 2, 3)]
            units += ["rad"] * 3
            i += 4
        else:
            places.append(i)
            names.append(quantity.name)
            units.append(quantity.unit)
            i += 1
    behind = tuple(k for k in sorted({*problem.own, *following}) if k >= problem.nq)
    names += [problem.states[k].name for k in behind]
    units += [problem.states[k].unit for k in behind]
    return Chart(problem, tuple(places), behind, tuple(names), tuple(units))
