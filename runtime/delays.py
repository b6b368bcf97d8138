"""What looks back in a compiled model (``mech_delays`` of ``kernel/model.h``), and what cannot be asked of it.

The state of a model with delays is all that was within the longest delay, which no list of numbers holds.
"""

from __future__ import annotations

import ctypes

import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

from .functions import Functions
from .native import contract
from .outcome import SimulationError
from .problem import Array, Problem

Y, U, Z, T = range(4)
"""enum mech_source"""


class DelayTable(Struct, frozen=True):
    """``sources`` [n, 2]: array and index; ``delayed`` [m, 3]: index in z, source, delay; ``times`` [k] of the delays."""

    sources: NDArray[np.int32]
    delayed: NDArray[np.int32]
    times: Array


def delays_of(functions: Functions, p: Array) -> DelayTable | None:
    """Return what looks back in a compiled model; None where nothing does."""
    if functions.struct is None or not functions.struct.hybrid:
        return None
    address = contract.HybridStruct.from_address(functions.struct.hybrid).delays
    if not address:
        return None
    of = contract.DelaysStruct.from_address(address)

    def table(at: int, rows: int, columns: int) -> NDArray[np.int32]:
        numbers = (ctypes.c_int * (rows * columns)).from_address(at)
        return np.array(numbers, dtype=np.int32).reshape(rows, columns)

    times, nothing = np.empty(of.n_delays), np.zeros(1)
    unread = nothing.ctypes.data
    contract.MODEL_FUNCTION(of.times)(0.0, unread, unread, unread, p.ctypes.data, times.ctypes.data)
    return DelayTable(table(of.sources, of.n_sources, 2), table(of.delayed, of.n_delayed, 3), times)


def as_at_the_start(functions: Functions, t: float, y: Array, u: Array, z: Array, p: Array) -> Array:
    """Return z [nz] at the start, where what was is what is."""
    delays = delays_of(functions, p)
    if delays is None:
        return z
    found = z.copy()
    for place, source, _ in delays.delayed:
        array, index = delays.sources[source]
        found[place] = t if array == T else (y, u, z)[array][index]
    return found


ANSWERED = "runs, sweeps, ensembles, 'response', 'linearize', 'spectrum', 'diagram', 'hysteresis', 'threshold', 'virial' and 'inertia' answer for such models"


def refuse_delays(problem: Problem, why: str) -> None:
    """Raise SimulationError for a model with delays. ``why``: what asks for a state of numbers."""
    delays = problem.hybrid.delays if problem.hybrid is not None else ()
    if not delays:
        return
    raise SimulationError(
        f"'{problem.name}' looks back, as in '{delays[0].text}', and {why}",
        delays[0].origin,
        help=ANSWERED,
    )
