"""The assembly by the kernel (``kernel/start/assemble.c``), for models that are compiled."""

from __future__ import annotations

import ctypes

import numpy as np

from ..functions import Functions
from ..native import kernel as native
from ..problem import Array
from .free_state import Flags


def assembled_by_kernel(
    functions: Functions, t: float, y0: Array, known: Flags, u: Array, z: Array, p: Array, reproducible: bool
) -> tuple[Array, tuple[int, int]] | None:
    """Return the consistent state and the steps of both stages; None where the kernel finds none: why, is said in
    Python."""
    assert functions.struct is not None
    y, report, flags = y0.copy(), native.StartReportStruct(), np.asarray(known, dtype=np.uint8)
    status = native.kernel_for(functions.struct, reproducible).mech_assemble(
        ctypes.addressof(functions.struct),
        t,
        *(array.ctypes.data for array in (flags, u, z, p, y)),
        ctypes.byref(report),
    )
    return (y, (report.steps[0], report.steps[1])) if status == 0 else None
