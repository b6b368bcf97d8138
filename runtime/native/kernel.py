"""The C kernel from Python: its structs (``kernel/solver.h``, ``kernel/model.h``) and its functions.

The kernel is compiled once per installation and compiler; a model is a library of its own.
"""

from __future__ import annotations

import ctypes
import functools
import os
from collections.abc import Iterable, Mapping, Sequence
from ctypes import (
    POINTER,
    Structure,
    c_char_p,
    c_double,
    c_int,
    c_long,
    c_size_t,
    c_void_p,
)
from pathlib import Path

from .build import build_shared, built_once, kernel_flags, known_compiler
from .compiler import Compiler
from .contract import BranchStruct, HybridStruct, ModelStruct, Signatures, declare, fields
from .libtcc import find_libtcc

KERNEL = Path(__file__).parents[1] / "kernel"
KERNEL_ROOMS = (".", "run", "algebra", "contact", "methods", "stepping", "events", "solver", "start")
"""Folders of the kernel, from the lowest to the highest: none calls what stands in a later one."""
AROUND = ("fmi", "reference", "ensemble")
"""Further folders, of which each stands on all of the kernel and none on another."""

KERNEL_VERSION = 1

EVENT_KINDS = (
    *("when", "impact", "rest", "lift-off", "slip"),
    *("stick", "crossing", "reflection", "release", "engage"),
)

INTERPOLATIONS = {"linear": 0, "step": 1, "spline": 2}

LISTENER = ctypes.CFUNCTYPE(None, c_long)
PARAMETERS_FUNCTION = ctypes.CFUNCTYPE(None, c_void_p, c_void_p)


class TableStruct(Structure):
    """mech_table"""

    _fields_ = fields("int input, interpolation, n; pointer t, value, slope")


class OptionsStruct(Structure):
    """mech_options"""

    _fields_ = fields(
        "int method, n_tables, n_stops; long n_grid, record_capacity; double t0, dt_max, dt, rtol; "
        "pointer atol, y0, z, p, tables, stops, grid, grid_y, record, grid_z, events, instants; "
        "long event_capacity, instant_capacity; int dense, halves; double apart, longest_call",
    )


class ReportStruct(Structure):
    """mech_report"""

    _fields_ = fields(
        "double t, dt, dt_min, dt_max, stiff_time, failed_value, switch_time, drift_position, "
        "drift_velocity, laid_energy, residual, overlap, seconds; "
        "longlong steps, rejected, evaluations, jacobians, factorisations, iterations, switches, "
        "laid, unsolved, indeterminate, several, poisson; long n_grid, n_record; "
        "int status, failed_index, method, failed_part; long n_events, n_instants",
    )
    t: float
    dt: float
    dt_min: float
    dt_max: float
    stiff_time: float
    failed_value: float
    switch_time: float
    drift_position: float
    drift_velocity: float
    laid_energy: float
    residual: float
    overlap: float
    seconds: float
    steps: int
    rejected: int
    evaluations: int
    jacobians: int
    factorisations: int
    iterations: int
    switches: int
    laid: int
    unsolved: int
    indeterminate: int
    several: int
    poisson: int
    n_grid: int
    n_record: int
    status: int
    failed_index: int
    method: int
    failed_part: int
    n_events: int
    n_instants: int


class EventStruct(Structure):
    """mech_event"""

    _fields_ = fields("double t, value; int kind, index; long instant")
    t: float
    value: float
    kind: int
    index: int
    instant: int


class StartReportStruct(Structure):
    """mech_start_report"""

    _fields_ = fields(
        "int status, row",
        ("steps", c_int * 2),
        "double off",
    )
    status: int
    row: int
    steps: Sequence[int]
    off: float


_USUAL = "dop853"
"""The method of a kernel that is compiled for some models alone."""

_SIGNATURES: Signatures = {
    "mech_kernel_version": (c_int, ()),
    "mech_layout": (None, (POINTER(c_size_t),)),
    "mech_method_count": (c_int, ()),
    "mech_method_index": (c_int, (c_char_p,)),
    "mech_method_name": (c_char_p, (c_int,)),
    "mech_method_doc": (c_char_p, (c_int,)),
    "mech_method_is_adaptive": (c_int, (c_int,)),
    "mech_method_order": (c_int, (c_int,)),
    "mech_method_n_dense": (c_int, (c_int,)),
    "mech_method_lacks": (c_int, (c_int, c_void_p)),
    "mech_create": (c_void_p, (c_void_p, POINTER(OptionsStruct))),
    "mech_free": (None, (c_void_p,)),
    "mech_advance": (c_int, (c_void_p, c_double, c_long)),
    "mech_read": (None, (c_void_p, POINTER(ReportStruct), c_void_p)),
    "mech_write": (None, (c_void_p, c_void_p)),
    "mech_restart": (None, (c_void_p,)),
    "mech_listen": (None, (c_void_p, c_void_p, c_long)),
    "mech_set_record": (None, (c_void_p, c_void_p, c_long)),
    "mech_drift": (None, (c_void_p, c_void_p)),
    "mech_set_events": (None, (c_void_p, c_void_p, c_long, c_void_p, c_long)),
    "mech_read_discretes": (None, (c_void_p, c_void_p)),
    "mech_save_size": (c_size_t, (c_void_p,)),
    "mech_save": (None, (c_void_p, c_void_p)),
    "mech_load": (None, (c_void_p, c_void_p)),
    "mech_evaluate": (
        None,
        (c_void_p, c_void_p, c_int, c_void_p, c_int, c_long, *(c_void_p,) * 6),
    ),
    "mech_evaluate_inputs": (None, (c_void_p, c_void_p, c_int, c_long, *(c_void_p,) * 3)),
    "mech_start_state": (c_int, (c_void_p, c_double, *(c_void_p,) * 6, POINTER(StartReportStruct))),
    "mech_start_found": (c_int, (c_void_p, c_double, *(c_void_p,) * 5)),
    "mech_assemble": (c_int, (c_void_p, c_double, *(c_void_p,) * 5, POINTER(StartReportStruct))),
    **dict.fromkeys(
        ("mech_nominal_at_start", "mech_nominal_values"),
        (c_int, (c_void_p, c_void_p, POINTER(OptionsStruct), c_double, c_void_p, c_void_p)),
    ),
    "mech_dense_at": (None, (c_void_p, c_int, c_int, c_double, c_void_p)),
}


_ASSEMBLY = ("mech_start_state", "mech_start_found", "mech_assemble")
"""What only models call whose initial states are assembled."""


def kernel_sources(rooms: Sequence[str] = KERNEL_ROOMS) -> dict[str, str]:
    """Give the text of every file of these rooms of the kernel by its name: names are unique, so that all can lie in
    one folder."""
    files = [file for room in rooms for file in (KERNEL / room).glob("*.[ch]")]
    return {file.name: file.read_text(encoding="utf-8") for file in sorted(files, key=lambda file: file.name)}


def load_kernel(reproducible: bool = False) -> ctypes.CDLL:
    """Load the kernel, compiled on first use. Raises ``BuildError`` and ``CompilerMissing``."""
    return _loaded(reproducible)  # one place for all ways to say False: what is cached knows them apart


def kernel_for(model: ModelStruct, reproducible: bool = False, method: str = _USUAL) -> ctypes.CDLL:
    """Load a kernel that can run the model by this method: where the whole one was not needed yet, of the usual method and
    what the model needs alone, of which the same bits come. A model that is quick has the kernel by libtcc, with the bits of a
    reproducible one. Raises ``BuildError`` and ``CompilerMissing``."""
    if model.quick:
        return _quick(method == _USUAL and not model.hybrid)
    if method != _USUAL or reproducible in _whole:
        return _loaded(reproducible)
    states = _own_code(model.nq + model.nv + model.nx)
    return _fitted(reproducible, states, bool(model.hybrid), bool(model.start))


def _own_code(states: int) -> int:
    """Return the number of states for which explicit methods have code of its own (methods/explicit_step.h); 0: none."""
    return states if 2 <= states <= 9 else 0


_whole: set[bool] = set()
"""Whether reproducible: of which kinds the whole kernel is loaded."""


@functools.cache
def _loaded(reproducible: bool) -> ctypes.CDLL:
    if _only_libtcc():
        return _quick(False)
    library = _built(kernel_flags(reproducible))
    _whole.add(reproducible)
    return library


@functools.cache
def _fitted(reproducible: bool, states: int, switches: bool, assembles: bool) -> ctypes.CDLL:
    if _only_libtcc():
        return _quick(not switches)
    return _built_part(kernel_flags(reproducible), states, switches, assembles)


@functools.cache
def _quick(smooth: bool) -> ctypes.CDLL:
    """Load the kernel by libtcc: of smooth models a third of it, in a third of the time, else the whole one."""
    if smooth:
        return _built_part(kernel_flags(True), 0, False, True, find_libtcc())
    return _built(kernel_flags(True), find_libtcc())


def _only_libtcc() -> bool:
    """Whether there is no other compiler here: its code is that of quick models."""
    compiler = known_compiler()
    return compiler is not None and compiler.in_process


def _built(flags: tuple[str, ...], compiler: Compiler | None = None) -> ctypes.CDLL:
    """Load the whole kernel."""

    def build() -> Path:
        return build_shared(kernel_sources(), flags, name="kernel", compiler=compiler)

    return _opened(built_once({"kernel": _kernel_state()}, flags, build, compiler))


def _built_part(
    flags: tuple[str, ...], states: int, switches: bool, assembles: bool, compiler: Compiler | None = None
) -> ctypes.CDLL:
    """Load what the usual method needs of the kernel for models of a kind."""
    used = [name for name in _SIGNATURES if assembles or name not in _ASSEMBLY]
    key = f"{_USUAL}, {states} states, {'' if switches else 'no '}events; {', '.join(used)}"

    def build() -> Path:
        sources = kernel_sources()

        def chosen() -> Mapping[str, str]:
            from .selection import fitted, needed

            return needed(fitted(sources, methods=(_USUAL,), states=states, switches=switches), used)

        return build_shared(sources, flags, key, name="kernel", compiler=compiler, chosen=chosen)

    return _opened(built_once({"kernel": _kernel_state(), "of": key}, flags, build, compiler), used)


def _kernel_state() -> str:
    """Return names, sizes and times of the kernel's files and of what chooses among them: while they stay, none is read."""
    folders = [KERNEL / room for room in KERNEL_ROOMS]
    files = [e for folder in folders for e in os.scandir(folder) if e.name.endswith((".c", ".h"))]
    files += [e for e in os.scandir(Path(__file__).parent) if e.name.endswith(".py")]
    return repr(sorted((f.path, f.stat().st_size, f.stat().st_mtime_ns) for f in files))


def _opened(file: Path, names: Iterable[str] = _SIGNATURES) -> ctypes.CDLL:
    library = declare(ctypes.CDLL(str(file)), {name: _SIGNATURES[name] for name in names})
    _check_layout(library)
    return library


def _check_layout(library: ctypes.CDLL) -> None:
    """Make sure that kernel and structs agree: a difference would corrupt memory."""
    structs = (
        ModelStruct,
        HybridStruct,
        BranchStruct,
        TableStruct,
        OptionsStruct,
        ReportStruct,
        EventStruct,
    )
    ours = [ctypes.sizeof(struct) for struct in structs]
    sizes = (c_size_t * len(structs))()
    library.mech_layout(sizes)
    if library.mech_kernel_version() != KERNEL_VERSION or list(sizes) != ours:
        raise RuntimeError(f"the kernel's structs have the sizes {list(sizes)}, not {ours}")


def kernel_methods(library: ctypes.CDLL) -> dict[str, str]:
    """Name and description of each method of the kernel."""
    return {
        library.mech_method_name(index).decode(): library.mech_method_doc(index).decode()
        for index in range(library.mech_method_count())
    }
