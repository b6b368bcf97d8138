"""The assembly of a start: the kernel moves a state onto its rows (``kernel/start/assemble.c``); here these are looked at."""

from __future__ import annotations

import ctypes

import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

from ..functions import Functions
from ..native import kernel as native
from ..problem import Array, Problem
from .facts import StartFacts, start_facts
from .free_state import Flags, characteristic_length, weights_of

STARTED, APART, RATES, UNDIRECTED, NO_MEMORY = 0, -1, -2, -3, -5
"""enum mech_start_status"""

LEAST = 1e-3
"""Of the sizes in a model: rows with smaller gradients are measured as if they had these, so that rounding is none of them."""


class Assembly(Struct, frozen=True, eq=False):
    """One assembly: the rows of a problem at fixed t, u, z, p, the ``known`` entries [ny] that stay, the characteristic ``length``,
    and ``weights`` [nv]."""

    problem: Problem
    functions: Functions
    facts: StartFacts
    t: float
    u: Array
    z: Array
    p: Array
    known: Flags
    length: float
    weights: Array
    reproducible: bool

    @staticmethod
    def of(
        problem: Problem,
        functions: Functions,
        t: float,
        known: Flags,
        u: Array,
        z: Array,
        p: Array,
        reproducible: bool = False,
    ) -> Assembly:
        facts = start_facts(problem)
        assert facts is not None and functions.assembly is not None
        length = characteristic_length(facts, p)
        weights = weights_of(facts, length)
        return Assembly(problem, functions, facts, t, u, z, p, known, length, weights, reproducible)

    def rows(self, stage: int) -> list[int]:
        """Return the rows that must hold: of positions in stage 1, of velocities in stage 2."""
        return [i for i, row in enumerate(self.facts.rows) if row[:2] == (stage, True)]

    @property
    def free(self) -> NDArray[np.intp]:
        """Which of the velocities may move positions."""
        return np.flatnonzero([not self.known[i] for i in self.facts.partner])

    def from_guess(self, guess: Array, known: Flags | None = None) -> tuple[Array, native.StartReportStruct]:
        """Return the consistent state nearest to a guess; where there is none, the closest that was found. ``known``: other entries
        that stay."""
        y, report = guess.copy(), native.StartReportStruct()
        flags = np.asarray(self.known if known is None else known, dtype=np.uint8)
        struct = self.functions.struct
        native.kernel_for(struct, self.reproducible).mech_assemble(
            ctypes.addressof(struct),
            self.t,
            *(array.ctypes.data for array in (flags, self.u, self.z, self.p, y)),
            ctypes.byref(report),
        )
        if report.status == NO_MEMORY:
            raise MemoryError("the kernel could not allocate what an assembly takes")
        return y, report

    def residuals(self, y: Array) -> Array:
        """Return the values of all rows."""
        assert self.functions.assembly is not None
        return self.functions.assembly(self.t, y, self.u, self.z, self.p)

    def gradients(self, y: Array, stage: int) -> Array:
        """Return the gradients [n, nv] of the rows that must hold, by characteristic sizes."""
        rows = self.rows(stage)
        if self.functions.assembly_jacobian is None:
            return np.empty((len(rows), self.facts.nv))
        entries = self.functions.assembly_jacobian(self.t, y, self.u, self.z, self.p)
        gradients: Array = entries.reshape(-1, self.facts.nv)[rows] / self.weights
        return gradients

    def scales(self, stage: int, *states: Array) -> Array:
        """Return what residuals are measured by: the largest entry of each gradient at these states."""
        sizes = (0.0, 1.0, self.length)
        least = np.array([LEAST * sizes[self.facts.rows[i][2]] for i in self.rows(stage)])
        found = [np.abs(self.gradients(y, stage)).max(axis=1, initial=0.0) for y in states]
        scale = np.fmax.reduce([least, *found])
        return np.where(scale > 0, scale, 1.0)
