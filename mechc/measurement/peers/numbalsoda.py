"""LSODA of numbalsoda, on compiled functions."""

from __future__ import annotations

import ctypes
import time
from ctypes import c_void_p
from typing import TYPE_CHECKING

import numpy as np

from .shared import SLICE, Library, found, peer_model, rates, refuse, times_of

if TYPE_CHECKING:
    from collections.abc import Mapping

    from ...model import CompiledModel
    from ...runtime.case import Case
    from ...runtime.integrate.solver import SolverOptions
    from ...runtime.integrate.trajectory import Trajectory
    from ...runtime.reference.work_precision import Peer


def _runs(_model: CompiledModel, _parts: frozenset[str]) -> Mapping[str, Peer]:
    return {"numbalsoda:LSODA": _lsoda}


NUMBALSODA = Library(
    "numbalsoda",
    "numbalsoda",
    "LSODA on compiled functions, states over their nominal values, as it knows one absolute tolerance",
    _runs,
)


def _lsoda(case: Case, options: SolverOptions) -> Trajectory:
    """Run LSODA of numbalsoda; it cannot be interrupted, and counts no steps."""
    from numbalsoda import lsoda

    refuse(case, events=True, constraints=True)
    model, _alive = peer_model(case, options.nominal)
    sizes, times = _alive[0], times_of(case)
    data = np.frombuffer(memoryview(model).cast("B"), dtype=np.float64)
    address = ctypes.cast(rates().peer_lsoda_rates, c_void_p).value
    asked = np.r_[case.begin, times]
    begun = time.thread_time()
    rows, success = lsoda(
        address,
        case.y0 / sizes,
        asked,
        data=data,
        rtol=options.tolerance,
        atol=options.tolerance,
        mxstep=SLICE,
    )
    taken = time.thread_time() - begun
    return found(
        case, options, rows[1:] * sizes, 0, model.evaluations, taken, "" if success else "no success"
    )
