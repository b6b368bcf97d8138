"""Functions of a problem at many times and states."""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Iterator
from functools import cached_property
from itertools import pairwise
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ..case import Case, inputs_at
from ..integrate.solver import table_structs
from ..native import kernel as native
from ..problem import Array, Problem
from ..rows import AT_ONCE, IN_MEMORY, Storage, slices


def evaluate_rows(
    case: Case,
    name: Literal["rhs", "outputs"],
    t: Array,
    y: Array,
    z: Array | None = None,
) -> Array:
    """Give [n, size]: the function ``name`` at the times t [n] and states y [n, ny], with z [n, nz] if it changes."""
    problem, functions = case.problem, case.functions
    size = problem.ny if name == "rhs" else len(problem.outputs)
    function = functions.rhs if name == "rhs" else functions.outputs
    rows = np.empty((t.size, size))
    if function is None or t.size == 0:
        return rows
    t, y, held = (np.ascontiguousarray(values) for values in (t, y, case.z[None] if z is None else z))
    begins = [0] if z is None else np.flatnonzero(np.r_[True, (z[1:] != z[:-1]).any(axis=1)]).tolist()
    tables, _alive = table_structs(case.tables)
    u = np.empty(len(problem.inputs))
    kernel = native.kernel_for(functions.struct, bool(case.asked and case.asked.reproducible))
    model = ctypes.addressof(functions.struct), getattr(functions.struct, name), size
    given = ctypes.addressof(tables), len(tables)
    places = [(values.ctypes.data, values.strides[0]) for values in (t, y, held, rows)]
    p_and_u = case.p.ctypes.data, u.ctypes.data
    for i, j in pairwise([*begins, t.size]):
        at_t, at_y, at_z, at_rows = (place + i * step for place, step in places)
        kernel.mech_evaluate(*model, *given, j - i, at_t, at_y, at_z, *p_and_u, at_rows)
    return rows


def scene_rows(case: Case, t: Array, y: Array, z: Array | None = None) -> Array:
    """Numbers of what is drawn [n, n_still + n_moving] at the times t [n], states y [n, ny] and z [n, nz]."""
    functions, scene = case.functions, case.problem.scene
    assert scene is not None, "the problem has a scene"
    rows = np.empty((t.size, scene.n_still + scene.n_moving))
    for k in range(t.size):
        at, u, held = float(t[k]), inputs_at(case, float(t[k])), case.z if z is None else z[k]
        if functions.scene_still is not None and k == 0:
            rows[:, : scene.n_still] = functions.scene_still(at, y[k], u, held, case.p)
        if functions.scene is not None:
            rows[k, scene.n_still :] = functions.scene(at, y[k], u, held, case.p)
    return rows


def input_rows(case: Case, t: Array) -> Array:
    """Give the inputs [n, nu] at the times t [n]."""
    nu = len(case.problem.inputs)
    rows = np.empty((t.size, nu))
    for k in range(t.size if nu else 0):
        rows[k] = inputs_at(case, float(t[k]))
    return rows


class Table:
    """States, outputs, inputs and discrete variables at the times t [n], from y [n, ny] and z [n, nz], one column each.

    Nothing is copied, and what is computed of many rows only where somebody asks for its column: reports read ``parts``.
    """

    def __init__(
        self, case: Case, t: Array, y: Array, z: Array | None = None, storage: Storage = IN_MEMORY
    ) -> None:
        self.case, self._storage = case, storage
        self.t, self.y, self.z = t, y, z
        self._problem = problem = case.problem
        own = sum(quantity.kind != "mode" for quantity in problem.discretes)
        self._widths = (problem.ny, len(problem.outputs), len(problem.inputs), own)

    def __len__(self) -> int:
        return len(self.t)

    @cached_property
    def outputs(self) -> Array:
        if len(self) <= AT_ONCE:
            return evaluate_rows(self.case, "outputs", self.t, self.y, self.z)
        return self._filled(self._widths[1], self._computed)

    @cached_property
    def inputs(self) -> Array:
        if len(self) <= AT_ONCE:
            return input_rows(self.case, self.t)
        return self._filled(self._widths[2], lambda rows: input_rows(self.case, self.t[rows]))

    @cached_property
    def discretes(self) -> Array:
        own = self._widths[3]
        return np.broadcast_to(self.case.z[:own], (len(self), own)) if self.z is None else self.z[:, :own]

    def parts(self) -> Iterator[tuple[slice, Array]]:
        """Give slices of the rows, with the outputs in each."""
        for rows in slices(len(self), self.t, self.y, self.z, vars(self).get("outputs")):
            yield rows, self.outputs_at(rows)

    def part(self, rows: slice) -> Table:
        """Give the same of some rows."""
        return Table(self.case, self.t[rows], self.y[rows], None if self.z is None else self.z[rows])

    def rows(self, rows: slice | NDArray[np.intp] | NDArray[np.bool_]) -> Array:
        """Give all columns of some rows."""
        outputs = self.outputs_at(rows)
        inputs = input_rows(self.case, self.t[rows])
        return np.hstack([self.y[rows], outputs, inputs, self.discretes[rows]])

    def index(self, name: str) -> int:
        """Give the number of an output."""
        return next(i for i, q in enumerate(self._problem.outputs) if q.name == name)

    def column(self, index: int) -> Array:
        """Give one column of all rows."""
        for name, width in zip(("y", "outputs", "inputs", "discretes"), self._widths, strict=True):
            if index < width:
                block: Array = getattr(self, name)
                return block[:, index]
            index -= width
        raise IndexError(index)

    def outputs_at(self, rows: slice | NDArray[np.intp] | NDArray[np.bool_]) -> Array:
        """Give the outputs of some rows."""
        if len(self) <= AT_ONCE or "outputs" in vars(self):
            return np.asarray(self.outputs[rows])
        return self._computed(rows)

    def _computed(self, rows: slice | NDArray[np.intp] | NDArray[np.bool_]) -> Array:
        z = None if self.z is None else self.z[rows]
        return evaluate_rows(self.case, "outputs", self.t[rows], self.y[rows], z)

    def _filled(self, width: int, values: Callable[[slice], Array]) -> Array:
        filled = self._storage.empty(len(self), width)
        for rows in slices(len(self), self.t, self.y, self.z, filled):
            filled[rows] = values(rows)
        return filled


class Columns(Table):
    """The same where all outputs and inputs are there already: columns [n, k] of a ``problem``."""

    def __init__(self, problem: Problem, t: Array, values: Array) -> None:
        self._problem, self.t, self.z = problem, t, None
        self._widths = (problem.ny, len(problem.outputs), len(problem.inputs), 0)
        ends = np.cumsum(self._widths)
        self.y, self.outputs = values[:, : ends[0]], values[:, ends[0] : ends[1]]
        self.inputs, self.discretes = values[:, ends[1] : ends[2]], values[:, ends[2] :]
        self._values = values

    def rows(self, rows: slice | NDArray[np.intp] | NDArray[np.bool_]) -> Array:
        found: Array = self._values[rows]
        return found


def solution_columns(case: Case, t: Array, y: Array, z: Array | None = None) -> Array:
    """States, outputs, inputs and discrete variables at t [n] and y [n, ny], one column each."""
    return Table(case, t, y, z).rows(slice(None))
