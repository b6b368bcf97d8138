"""Functions of a problem at many times and states."""

from __future__ import annotations

import ctypes
from functools import cached_property
from typing import TYPE_CHECKING, Literal, overload

from msgspec.structs import replace

from ..arrays.choice import np
from ..case import Case, inputs_at
from ..integrate.solver import table_structs
from ..native import kernel as native
from ..problem import Array

if TYPE_CHECKING:
    from numpy.typing import NDArray


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
    if z is not None:
        begins = np.flatnonzero(np.r_[True, (z[1:] != z[:-1]).any(axis=1)])
        for i, j in zip(begins, (*begins[1:], t.size), strict=True):
            part = replace(case, z=np.ascontiguousarray(z[i]))
            rows[i:j] = evaluate_rows(part, name, t[i:j], y[i:j])
        return rows
    if functions.struct is not None:
        t, y = np.ascontiguousarray(t), np.ascontiguousarray(y)
        tables, _alive = table_structs(case.tables)
        u = np.empty(len(problem.inputs))
        native.kernel_for(functions.struct, bool(case.asked and case.asked.reproducible)).mech_evaluate(
            ctypes.addressof(functions.struct),
            getattr(functions.struct, name),
            size,
            ctypes.addressof(tables),
            len(tables),
            t.size,
            *(array.ctypes.data for array in (t, y, case.z, case.p, u, rows)),
        )
        return rows
    for k in range(t.size):
        u = inputs_at(case, float(t[k]))
        rows[k] = function(float(t[k]), y[k], u, case.z, case.p)
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


class Blocks:
    """Columns [n, m] that stand side by side in several arrays, so that none is copied: ``blocks[:, i]``, ``blocks[rows]``."""

    def __init__(self, *blocks: Array) -> None:
        self.blocks = blocks

    @cached_property
    def _places(self) -> list[tuple[Array, int]]:
        return [(block, i) for block in self.blocks for i in range(block.shape[1])]

    @overload
    def __getitem__(self, key: tuple[slice, int]) -> Array: ...
    @overload
    def __getitem__(self, key: NDArray[np.bool_]) -> Array: ...
    def __getitem__(self, key: tuple[slice, int] | NDArray[np.bool_]) -> Array:
        if not isinstance(key, tuple):
            return np.hstack([block[key] for block in self.blocks])
        rows, column = key
        block, i = self._places[column]
        return block[rows, i]


def solution_blocks(case: Case, t: Array, y: Array, z: Array | None = None) -> Blocks:
    """States, outputs, inputs and discrete variables at t [n] and y [n, ny]."""
    outputs = evaluate_rows(case, "outputs", t, y, z)
    inputs = input_rows(case, t)
    own = sum(quantity.kind != "mode" for quantity in case.problem.discretes)
    discretes = np.broadcast_to(case.z[:own], (t.size, own)).copy() if z is None else z[:, :own]
    return Blocks(y, outputs, inputs, discretes)


def solution_columns(case: Case, t: Array, y: Array, z: Array | None = None) -> Array:
    """States, outputs, inputs and discrete variables at t [n] and y [n, ny], one column each."""
    return np.hstack(solution_blocks(case, t, y, z).blocks)
