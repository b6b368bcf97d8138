"""What a method gives back: states on the output grid, the dense output, statistics, and why it stopped."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import TYPE_CHECKING, Protocol

import numpy as np
from msgspec import Struct

from ..outcome import Failure, time_text
from ..problem import Array, Problem
from ..rows import slices
from .events import EventRecord

if TYPE_CHECKING:
    from .solver import Solver


class ContactSteps(Struct, frozen=True):
    """Of steps that solve for contacts: the largest residual of a step, as a rate of a contact; the deepest overlap, in the unit of its
    gap; steps that were not solved to 1e-10 of the largest rate; contacts and frictions that share loads which rigid bodies do not
    determine, at the end."""

    residual: float
    overlap: float
    unsolved: int
    indeterminate: int


class Statistics(Struct, frozen=True):
    """``run_time``: seconds inside the method. ``method``: the last one in use, where ``auto`` changed it, at
    ``switch_time``. ``stiff_time``: where stiffness was first noticed. ``drift_position`` and
    ``drift_velocity``: the largest correction by projection, over the nominal values. ``laid``: how often a contact of many was laid
    down, with ``laid_energy``. ``several``: how often forces had a second solution. ``poisson``: how many impacts followed Poisson's law. None where a method does not tell or where there is nothing to tell."""

    method: str
    steps: int
    rejected: int | None
    evaluations: int
    run_time: float
    shortest_step: float | None = None
    longest_step: float | None = None
    stiff_time: float | None = None
    jacobians: int = 0
    factorisations: int = 0
    iterations: int = 0
    switches: int = 0
    switch_time: float | None = None
    drift_position: float | None = None
    drift_velocity: float | None = None
    laid: int = 0
    laid_energy: float | None = None
    several: int = 0
    poisson: int = 0
    contact: ContactSteps | None = None


class DenseOutput(Struct, frozen=True, eq=False, dict=True):
    """The polynomials of all steps, as the kernel records them: ``rows`` [m, 2 + n_dense ny] of ``begin`` and ``length`` [m],
    ``coefficients`` [m, n_dense, ny].

    The basis is that of ``kernel/solver.h``, point 6.
    """

    rows: Array
    ny: int

    @cached_property
    def begin(self) -> Array:
        return self.rows[:, 0].copy()

    @cached_property
    def length(self) -> Array:
        return self.rows[:, 1].copy()

    @cached_property
    def coefficients(self) -> Array:
        count, width = self.rows.shape
        return self.rows[:, 2:].reshape(count, (width - 2) // self.ny, self.ny)

    def __call__(self, t: Array) -> Array:
        """Give y [n, ny] at the times t [n]; the first and last polynomial hold beyond the ends."""
        step = np.clip(np.searchsorted(self.begin, t, side="right") - 1, 0, self.begin.size - 1)
        s = ((t - self.begin[step]) / self.length[step])[:, None]
        c = self.coefficients
        y: Array = c[step, -1]
        for k in range(c.shape[1] - 2, -1, -1):
            y = c[step, k] + (1 - s if k % 2 else s) * y
        return y


class Reader(Protocol):
    """Whoever reads the rows of a run while they are written."""

    def read(self, first: int, t: Array, y: Array, z: Array | None) -> None:
        """Take further rows, of which the first has the number ``first``: times, states and discrete variables."""


class Trajectory(Struct, frozen=True, eq=False, dict=True):
    """``t`` [n], ``y`` [n, ny]: the rows of the grid that were reached, then the point where a run stopped
    early. ``dense`` is None if it was not asked for, or would have exceeded its bound of memory."""

    t: Array
    y: Array
    dense: Callable[[Array], Array] | None
    statistics: Statistics
    failure: Failure | None = None
    interrupted: bool = False
    happened: EventRecord | None = None
    terminated: str | None = None
    """The text of the branch that ended the run."""
    solver: Solver | None = None
    """What made it, to be asked for the same with other errors."""

    def ending(self, problem: Problem) -> str:
        """Say why it ended early, by a failure or by ``terminate``; nothing where it did not."""
        if self.failure is not None:
            return self.failure.message
        return (
            "" if self.terminated is None else f"{self.terminated} at {time_text(problem, float(self.t[-1]))}"
        )

    @cached_property
    def reached(self) -> Array:
        """The largest size [ny] of each state among the rows; what is not a number counts as none."""
        found = np.zeros(self.y.shape[1])
        for part in slices(len(self.y), self.y):
            rows = np.abs(self.y[part])
            sizes = rows.max(axis=0)
            if not np.isfinite(sizes).all():
                sizes = np.where(np.isfinite(rows), rows, 0.0).max(axis=0)
            found = np.maximum(found, sizes)
        return found


def with_unit_rotations(rotations: tuple[int, ...], y: Array) -> Array:
    """Give ``y`` [ny] or [n, ny] with quaternions of unit length."""
    if not rotations:
        return y
    y = y.copy()
    for index in rotations:
        y[..., index : index + 4] /= np.linalg.norm(y[..., index : index + 4], axis=-1, keepdims=True)
    return y
