"""Functions of compiled models as built-in functions of Python (``calls.c``): a call costs a tenth of one through ctypes.

What they cannot do at once they hand to the function ``slow`` that each is given, which takes their place where nothing can be compiled.
"""

from __future__ import annotations

import ctypes
import functools
import importlib
from collections.abc import Callable, Sequence
from ctypes import c_char_p, c_int, c_ssize_t, c_void_p
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .build import BuildError, CompilerMissing, build_shared, find_quick_compiler, kernel_flags
from .contract import fields

SOURCE = Path(__file__).with_name("calls.c")
HEADER = Path(__file__).parents[1] / "kernel" / "model.h"

FASTCALL = 0x0080
"""METH_FASTCALL: arguments come as an array."""

PYTHON = (
    "PyObject_GetBuffer",
    "PyBuffer_Release",
    "PyErr_Clear",
    "PyFloat_AsDouble",
    "PyErr_Occurred",
    "PyFloat_FromDouble",
    "PyObject_Vectorcall",
    "PyTuple_GetItem",
    "PyBytes_AsString",
    "PyEval_SaveThread",
    "PyEval_RestoreThread",
)
"""The first pointers of ``interface`` in calls.c."""

ARRAY_TYPE, NEW_ARRAY = 2, 93
"""Places of PyArray_Type and PyArray_New in NumPy's table, which extensions of every version rely on."""

MOST_DIMENSIONS, MOST_PARTS = 3, 2


class CallRecord(ctypes.Structure):
    """call_record"""

    _fields_ = fields(
        ("name", c_char_p),
        "pointer method; int flags",
        ("doc", c_char_p),
        ("parts", c_void_p * MOST_PARTS),
        ("begins", c_ssize_t * MOST_PARTS),
        "ssize n_out, ny, na, nu, nz, dimensions",
        ("shape", c_ssize_t * MOST_DIMENSIONS),
        "pointer z, p; double begin; pointer inputs, indicators, switches; ssize n_switches, n_indicators",
    )


class TaskRecord(ctypes.Structure):
    """task_record"""

    _fields_ = fields(
        ("name", c_char_p),
        "pointer method; int flags",
        ("doc", c_char_p),
        "pointer task, of",
    )


@functools.cache
def library() -> ctypes.CDLL:
    """Load what makes calls. Raises BuildError, CompilerMissing, OSError."""
    table = _numpy_table()
    sources = {f.name: f.read_text(encoding="utf-8") for f in (SOURCE, HEADER)}
    file = build_shared(sources, kernel_flags(), name="calls", compiler=find_quick_compiler())
    loaded = ctypes.CDLL(str(file))
    given = [ctypes.cast(getattr(ctypes.pythonapi, name), c_void_p).value for name in PYTHON]
    given += [table[NEW_ARRAY], table[ARRAY_TYPE]]
    loaded.mech_calls_begin((c_void_p * len(given))(*given))
    loaded.mech_call_rows.argtypes = (
        c_void_p,
        c_ssize_t,
        *(c_void_p, c_ssize_t) * 4,
        c_void_p,
    )
    loaded.mech_call_rows.restype = c_int
    return loaded


def _numpy_table() -> Any:
    """Return the pointers that NumPy gives extensions."""
    try:
        core = importlib.import_module("numpy._core._multiarray_umath")
    except ImportError:  # NumPy 1
        core = importlib.import_module("numpy.core._multiarray_umath")
    pointer = ctypes.pythonapi.PyCapsule_GetPointer
    pointer.restype, pointer.argtypes = c_void_p, (ctypes.py_object, c_char_p)
    return ctypes.cast(pointer(core._ARRAY_API, None), ctypes.POINTER(c_void_p))


def built_in(
    record: CallRecord | TaskRecord, entry: str, name: str, doc: str, slow: Callable[..., Any], *kept: object
) -> Callable[..., Any]:
    """Return a built-in function for a record whose numbers are filled in; ``slow`` where that cannot be.

    ``entry``: mech_call_any, mech_call_bound or mech_call_task. ``kept``: what the pointers of the record point to.
    """
    try:
        made = library()
    except (BuildError, CompilerMissing, OSError):
        return slow
    texts = (name.encode(), doc.encode())
    record.name, record.doc = texts
    record.method = ctypes.cast(getattr(made, entry), c_void_p).value
    record.flags = FASTCALL
    raw = bytes(record)
    address = ctypes.pythonapi.PyBytes_AsString
    address.restype, address.argtypes = c_void_p, (ctypes.py_object,)
    new = ctypes.pythonapi.PyCFunction_NewEx
    new.restype, new.argtypes = ctypes.py_object, (c_void_p, ctypes.py_object, c_void_p)
    function: Callable[..., Any] = new(address(raw), (raw, slow, texts, made, *kept), None)
    return function


def call_of(address: int, size: int, slow: Callable[..., Any]) -> Callable[..., Any]:
    """Return the function (t, y, u, z, p) -> out [size] at an address."""
    record = CallRecord()
    record.parts[0], record.n_out = address, size
    return built_in(record, "mech_call_any", "model_function", "(t, y, u, z, p) -> out", slow)


def task_of(function: Any, of: ctypes.c_void_p) -> Callable[[], float]:
    """Return a call of a function ``long f(void *)`` of a library with its argument."""

    def slow() -> float:
        found: int = function(of)
        return found

    record = TaskRecord(task=ctypes.cast(function, c_void_p).value, of=of.value)
    return built_in(record, "mech_call_task", "task", "() -> number", slow, function)


def rows_of(
    record: CallRecord,
    n: int,
    blocks: Sequence[tuple[NDArray[np.float64] | None, int]],
    out: NDArray[np.float64],
) -> None:
    """Evaluate a record for n states: y, a, t and u with the way from one state to the next, None where not given. Raises what
    ``library`` raises."""
    arguments: list[int | None] = []
    for block, way in blocks:
        arguments += [None if block is None else block.ctypes.data, way]
    if not library().mech_call_rows(ctypes.addressof(record), n, *arguments, out.ctypes.data):
        raise MemoryError
