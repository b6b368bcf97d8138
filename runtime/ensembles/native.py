"""The ensemble room of the kernel from Python: its structs (``kernel/ensemble/ensemble.h``), built as a library of its own."""

from __future__ import annotations

import ctypes
import functools
import sys
from ctypes import POINTER, Structure, c_int, c_long, c_size_t
from enum import IntEnum

import numpy as np

from ..native import kernel as native
from ..native.build import LINK, build_shared, kernel_flags
from ..native.contract import QuantityStruct, SizesStruct, declare, fields

ARRAYS = {"p": 0, "y": 1, "u": 2, "outputs": 3}


class Stage(IntEnum):
    """How far a member came: enum mech_member_stage."""

    WAITS = 0
    RAN = 1
    PARAMETER = 2
    UNSETTLED = 3
    TIMES = 4
    START = 5
    STATE = 6
    MEMORY = 7


class PlaceStruct(Structure):
    """mech_place"""

    _fields_ = (("array", c_int), ("index", c_int), ("guess", c_int))


class KeptStruct(Structure):
    """mech_kept"""

    _fields_ = fields("int kind, array, index, event, row")


MEMBER = np.dtype(
    [
        *((name, np.float64) for name in ("t", "failed_value", "error")),
        ("steps", np.int64),
        *((name, np.int32) for name in ("stage", "status", "index", "part", "stiff", "companion")),
    ],
    align=True,
)
"""mech_member"""


class CompanionStruct(Structure):
    """mech_companion"""

    _fields_ = fields("double rtol, dt, dt_max, factor, loose_rtol, loose_factor; long most")


class EnsembleStruct(Structure):
    """mech_ensemble"""

    _fields_ = fields(
        "pointer model, sizes, options; double begin, stop; long max_steps; "
        "pointer p, y, p_set, y_given, experiment; int n_numbers, n_settings; "
        "pointer numbers, settings, p_low, p_high, y_low, y_high; int n_varied; pointer varied; "
        "long n; pointer values, estimated",
        ("companion", CompanionStruct),
        "int n_kept, n_series; "
        "pointer kept, series, kept_values, kept_errors, series_values, ends, members, lanes; "
        "int turns, threads",
        ("done", POINTER(c_long)),
        ("stopped", POINTER(c_int)),
    )


@functools.cache
def load_ensemble(reproducible: bool = False) -> ctypes.CDLL:
    """Load the kernel with its ensemble room. Raises ``BuildError`` and ``CompilerMissing``."""
    sources = native.kernel_sources((*native.KERNEL_ROOMS, "ensemble"))
    link = LINK if sys.platform == "win32" else (*LINK, "-pthread")
    library = ctypes.CDLL(str(build_shared(sources, kernel_flags(reproducible), name="ensemble", link=link)))
    declare(
        library,
        {
            "mech_ensemble_layout": (None, (POINTER(c_size_t),)),
            "mech_ensemble_run": (c_int, (POINTER(EnsembleStruct),)),
        },
    )
    structs = (PlaceStruct, KeptStruct, None, CompanionStruct, EnsembleStruct, SizesStruct, QuantityStruct)
    ours = [MEMBER.itemsize if struct is None else ctypes.sizeof(struct) for struct in structs]
    found = (c_size_t * len(ours))()
    library.mech_ensemble_layout(found)
    if list(found) != ours:
        raise RuntimeError(f"the structs of the ensemble have the sizes {list(found)}, not {ours}")
    return library
