"""The structs that generated code gives the kernel (``kernel/model.h``, the sizes of ``kernel/start/start.h``): the one table of
their fields in Python.

``ctypes`` lays them out for this machine; ``compiler/targets/model_data.py`` fills them in for C and WebAssembly, which take names
and layout from here. A test compares every field with the headers.
"""

from __future__ import annotations

import ctypes
from ctypes import POINTER, c_double, c_int, c_void_p
from typing import ClassVar

MODEL_VERSION = 12

MODEL_FUNCTION = ctypes.CFUNCTYPE(None, c_double, c_void_p, c_void_p, c_void_p, c_void_p, c_void_p)
"""mech_function"""


class Contract(ctypes.Structure):
    """A struct of the contract; ``c_name`` is its name in the headers."""

    c_name: ClassVar[str]


class BranchStruct(Contract):
    c_name = "mech_branch"
    _fields_ = (*((name, c_int) for name in ("event", "n_checks", "terminates")), ("act", c_void_p))
    act: int | None


class RowStruct(Contract):
    c_name = "mech_row"
    _fields_ = tuple((name, c_int) for name in ("kind", "normal", "flag", "sign", "impulse", "enabled"))
    kind: int
    normal: int
    flag: int
    sign: int
    impulse: int
    enabled: int


class ShareRowStruct(Contract):
    c_name = "mech_share_row"
    _fields_ = tuple((name, c_int) for name in ("rest", "share", "sort"))
    rest: int
    share: int
    sort: int


class CrowdKindStruct(Contract):
    c_name = "mech_crowd_kind"
    _fields_ = (
        *((name, c_int) for name in ("n_leaves", "n_one", "n_normal", "n_slip", "velocities", "friction")),
        ("values", c_void_p),
    )


class CrowdLineStruct(Contract):
    c_name = "mech_crowd_line"
    _fields_ = tuple((name, c_int) for name in ("first", "kind", "one", "others"))


class CrowdStruct(Contract):
    c_name = "mech_crowd"
    _fields_ = (
        *(
            (name, c_int)
            for name in ("n", "n_lines", "first", "capacity", "n_asked", "n_told", "n_efforts", "nq")
        ),
        *((name, c_int) for name in ("stepped", "n_values", "n_given")),
        *((name, c_void_p) for name in ("kinds", "lines", "table", "group", "asked")),
        *((name, c_void_p) for name in ("rhs", "outputs", "push", "supply")),
    )


class DelaysStruct(Contract):
    c_name = "mech_delays"
    _fields_ = (
        *((name, c_int) for name in ("n_sources", "n_delays", "n_delayed")),
        *((name, c_void_p) for name in ("sources", "delayed", "times")),
    )
    n_sources: int
    n_delays: int
    n_delayed: int
    sources: int
    delayed: int
    times: int


class HybridStruct(Contract):
    c_name = "mech_hybrid"
    _fields_ = (
        *((name, c_int) for name in ("n_switches", "n_times", "n_clocks", "n_branches", "n_rows")),
        *(
            (name, c_int)
            for name in ("initial", "simultaneous", "dissipated", "supplied", "total", "carried")
        ),
        *((name, POINTER(c_int)) for name in ("switches", "times", "clocks")),
        ("branches", POINTER(BranchStruct)),
        ("rows", POINTER(RowStruct)),
        *((name, c_void_p) for name in ("indicators", "indicator_rates", "crossing_times")),
        *((name, c_void_p) for name in ("conditions", "row_values", "respond", "crowd", "slides", "delays")),
        ("shares", POINTER(ShareRowStruct)),
        *((name, c_int) for name in ("n_leading_switches", "n_leading_branches", "narrow")),
        *((name, c_int) for name in ("n_told", "first_told")),
        ("told", c_void_p),
    )
    n_switches: int
    n_times: int
    n_clocks: int
    n_branches: int
    n_rows: int
    indicators: int | None
    conditions: int | None
    delays: int | None


class StartRowStruct(Contract):
    c_name = "mech_start_row"
    _fields_ = tuple((name, c_int) for name in ("stage", "hard", "measure"))


class StartStruct(Contract):
    c_name = "mech_start"
    _fields_ = (
        *((name, c_int) for name in ("n_rows", "n_lengths", "n_dependent")),
        *((name, c_void_p) for name in ("rows", "known", "partner", "size", "lengths", "dependent")),
        *((name, c_void_p) for name in ("assembly", "assembly_jacobian", "others")),
        ("n_found", c_int),
        *((name, c_void_p) for name in ("found", "find")),
    )


class SeriesStruct(Contract):
    c_name = "mech_series"
    _fields_ = (
        *((name, c_int) for name in ("n_slots", "n_kept")),
        *((name, c_void_p) for name in ("start", "next", "expand")),
    )


class ModelStruct(Contract):
    c_name = "mech_model"
    quick = False
    """Whether libtcc made it because that is ready first (``Problem.quick``)."""
    kept: HybridStruct | None = None
    """What ``hybrid`` points to where it is no longer that of the library."""
    _fields_ = (
        *((name, c_int) for name in ("version", "nq", "nv", "nx", "nu", "nz", "np", "nh")),
        *((name, c_int) for name in ("n_outputs", "n_assertions", "n_rotations")),
        ("rotations", POINTER(c_int)),
        ("n_jacobian", c_int),
        ("jac_row", POINTER(c_int)),
        ("jac_col", POINTER(c_int)),
        ("parameters", c_void_p),
        *(
            (name, c_void_p)
            for name in ("rhs", "initial", "inputs", "discretes", "outputs", "assertions", "jacobian")
        ),
        *((name, c_int) for name in ("n_position", "n_velocity", "separable", "n_accounts")),
        *((name, c_void_p) for name in ("project_position", "project_velocity", "displace", "closeness")),
        *((name, c_void_p) for name in ("momentum", "force", "mass", "constraints", "constraint_jacobian")),
        ("hybrid", c_void_p),
        ("start", c_void_p),
        ("series", c_void_p),
    )
    version: int
    nq: int
    nv: int
    nx: int
    nu: int
    nz: int
    np: int
    nh: int
    n_outputs: int
    n_assertions: int
    n_rotations: int
    n_jacobian: int
    n_position: int
    n_velocity: int
    separable: int
    n_accounts: int
    hybrid: int | None
    start: int | None


class QuantityStruct(Contract):
    c_name = "mech_quantity"
    _fields_ = (
        *((name, c_int) for name in ("unit", "kind", "pure")),
        *((name, c_double) for name in ("nominal", "range")),
        ("group", c_int),
    )


class SizesStruct(Contract):
    c_name = "mech_sizes"
    _fields_ = (
        *((name, c_void_p) for name in ("states", "partner", "units")),
        ("n_energies", c_int),
        ("energies", c_void_p),
    )
