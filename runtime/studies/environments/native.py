"""The environments of the kernel from Python: their struct (``kernel/ensemble/environments.h``) and their library."""

from __future__ import annotations

import ctypes
import functools
import sys
from ctypes import POINTER, Structure, c_int, c_long, c_size_t, c_void_p

from ...native import kernel as native
from ...native.build import LINK, build_shared, kernel_flags
from ...native.contract import Signatures, declare, fields
from ...native.selection import needed

FROM_KERNEL = (
    *("create", "free", "advance", "write", "restart"),
    *("set_events", "save_size", "save", "load", "assemble"),
)


class KernelStruct(Structure):
    """mech_kernel"""

    _fields_ = tuple((name, c_void_p) for name in FROM_KERNEL)


class EnvironmentsStruct(Structure):
    """mech_environments"""

    _fields_ = fields(
        "pointer kernel, model, options, lanes, held; long n; int n_held, threads, substeps; "
        "double period, until; long max_steps; pointer y, u, z, t, status, outputs, memory",
    )


_OF_ALL = POINTER(EnvironmentsStruct)
_SIGNATURES: Signatures = {
    "mech_environments_layout": (c_size_t, ()),
    "mech_environments_open": (c_int, (_OF_ALL,)),
    "mech_environments_close": (None, (_OF_ALL,)),
    "mech_environments_step": (c_long, (c_void_p,)),
    "mech_environments_reset": (c_int, (_OF_ALL, c_long, c_int)),
    "mech_environments_read": (c_long, (c_void_p,)),
    "mech_environments_save_size": (c_size_t, (_OF_ALL, c_long)),
    "mech_environments_save": (None, (_OF_ALL, c_long, c_void_p)),
    "mech_environments_load": (None, (_OF_ALL, c_long, c_void_p)),
    "mech_environments_report": (c_int, (_OF_ALL, c_long, POINTER(native.ReportStruct))),
}


@functools.cache
def load_environments(reproducible: bool) -> ctypes.CDLL:
    """Load the library of environments, which steps by the kernel that it is given. Raises ``BuildError`` and ``CompilerMissing``."""
    sources = needed(native.kernel_sources((*native.KERNEL_ROOMS, "ensemble")), _SIGNATURES)
    link = LINK if sys.platform == "win32" else (*LINK, "-pthread")
    file = build_shared(sources, kernel_flags(reproducible), name="environments", link=link)
    library = declare(ctypes.CDLL(str(file)), _SIGNATURES)
    if library.mech_environments_layout() != ctypes.sizeof(EnvironmentsStruct):
        raise RuntimeError("the struct of environments has another size in the kernel")
    return library


def functions_of(kernel: ctypes.CDLL) -> KernelStruct:
    """Give the functions of a kernel as environments call them; one that it lacks no model calls that it was made for."""
    found = (getattr(kernel, f"mech_{name}", None) for name in FROM_KERNEL)
    return KernelStruct(*(ctypes.cast(f, c_void_p) if f is not None else None for f in found))
