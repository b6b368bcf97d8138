"""The structs that generated code gives the kernel (``kernel/model.h``, the sizes of ``kernel/start/start.h``): the one table of
their fields in Python.

``ctypes`` lays them out for this machine; ``compiler/targets/model_data.py`` fills them in for C and WebAssembly, which take names
and layout from here. A test compares every field with the headers.
"""

from __future__ import annotations

import ctypes
from collections.abc import Mapping
from ctypes import POINTER, c_double, c_int, c_long, c_longlong, c_ssize_t, c_void_p
from typing import ClassVar

MODEL_VERSION = 12

MODEL_FUNCTION = ctypes.CFUNCTYPE(None, c_double, c_void_p, c_void_p, c_void_p, c_void_p, c_void_p)
"""mech_function"""


_TYPES = {
    "int": c_int,
    "long": c_long,
    "longlong": c_longlong,
    "ssize": c_ssize_t,
    "double": c_double,
    "pointer": c_void_p,
}


def fields(*parts: str | tuple[str, type]) -> tuple[tuple[str, type], ...]:
    """Return the fields of a struct from texts such as ``int n, m; pointer y``, and single ones of other types."""
    made: list[tuple[str, type]] = []
    for part in parts:
        if isinstance(part, str):
            for line in part.split(";"):
                kind, names = line.split(maxsplit=1)
                made += [(name.strip(), _TYPES[kind]) for name in names.split(",")]
        else:
            made.append(part)
    return tuple(made)


Signatures = Mapping[str, tuple[object, tuple[object, ...]]]
"""Functions by name: what they give, and what they take."""


def declare(library: ctypes.CDLL, signatures: Signatures) -> ctypes.CDLL:
    """Tell ctypes what functions of a library give and take."""
    for name, (result, arguments) in signatures.items():
        function = getattr(library, name)
        function.restype, function.argtypes = result, arguments
    return library


class Contract(ctypes.Structure):
    """A struct of the contract; ``c_name`` is its name in the headers."""

    c_name: ClassVar[str]


class BranchStruct(Contract):
    c_name = "mech_branch"
    _fields_ = fields("int event, n_checks, terminates; pointer act")
    act: int | None


class RowStruct(Contract):
    c_name = "mech_row"
    _fields_ = fields("int kind, normal, flag, sign, impulse, enabled")
    kind: int
    normal: int
    flag: int
    sign: int
    impulse: int
    enabled: int


class ShareRowStruct(Contract):
    c_name = "mech_share_row"
    _fields_ = fields("int rest, share, sort")
    rest: int
    share: int
    sort: int


class CrowdKindStruct(Contract):
    c_name = "mech_crowd_kind"
    _fields_ = fields("int n_leaves, n_one, n_normal, n_slip, velocities, friction; pointer values")


class CrowdLineStruct(Contract):
    c_name = "mech_crowd_line"
    _fields_ = fields("int first, kind, one, others")


class CrowdStruct(Contract):
    c_name = "mech_crowd"
    _fields_ = fields(
        "int n, n_lines, first, capacity, n_asked, n_told, n_efforts, nq, stepped, n_values, n_given; "
        "pointer kinds, lines, table, group, asked, rhs, outputs, push, supply",
    )


class DelaysStruct(Contract):
    c_name = "mech_delays"
    _fields_ = fields("int n_sources, n_delays, n_delayed; pointer sources, delayed, times")
    n_sources: int
    n_delays: int
    n_delayed: int
    sources: int
    delayed: int
    times: int


class HybridStruct(Contract):
    c_name = "mech_hybrid"
    _fields_ = fields(
        "int n_switches, n_times, n_clocks, n_branches, n_rows, initial, simultaneous, dissipated, "
        "supplied, total, carried",
        ("switches", POINTER(c_int)),
        ("times", POINTER(c_int)),
        ("clocks", POINTER(c_int)),
        ("branches", POINTER(BranchStruct)),
        ("rows", POINTER(RowStruct)),
        "pointer indicators, indicator_rates, crossing_times, conditions, row_values, respond, crowd, "
        "slides, delays",
        ("shares", POINTER(ShareRowStruct)),
        "int n_leading_switches, n_leading_branches, narrow, n_told, first_told; pointer told",
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
    _fields_ = fields("int stage, hard, measure")


class StartStruct(Contract):
    c_name = "mech_start"
    _fields_ = fields(
        "int n_rows, n_lengths, n_dependent; "
        "pointer rows, known, partner, size, lengths, dependent, assembly, assembly_jacobian, others; "
        "int n_found; pointer found, find",
    )


class SeriesStruct(Contract):
    c_name = "mech_series"
    _fields_ = fields("int n_slots, n_kept; pointer start, next, expand")


class ModelStruct(Contract):
    c_name = "mech_model"
    quick = False
    """Whether libtcc made it because that is ready first (``Problem.quick``)."""
    kept: HybridStruct | None = None
    """What ``hybrid`` points to where it is no longer that of the library."""
    _fields_ = fields(
        "int version, nq, nv, nx, nu, nz, np, nh, n_outputs, n_assertions, n_rotations",
        ("rotations", POINTER(c_int)),
        "int n_jacobian",
        ("jac_row", POINTER(c_int)),
        ("jac_col", POINTER(c_int)),
        "pointer parameters, rhs, initial, inputs, discretes, outputs, assertions, jacobian; "
        "int n_position, n_velocity, separable, n_accounts; "
        "pointer project_position, project_velocity, displace, closeness, momentum, force, mass, "
        "constraints, constraint_jacobian, hybrid, start, series",
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
    _fields_ = fields("int unit, kind, pure; double nominal, range; int group")


class SizesStruct(Contract):
    c_name = "mech_sizes"
    _fields_ = fields("pointer states, partner, units; int n_energies; pointer energies")
