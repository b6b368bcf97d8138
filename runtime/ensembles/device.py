"""Members on a device: OpenCL takes each of many on in a work item of its own (``kernel/ensemble/lane_item.h``)."""

from __future__ import annotations

import ctypes
import functools
import importlib
import warnings
from collections.abc import Callable, Iterator, Sequence
from ctypes import POINTER, c_long, c_size_t, c_void_p
from typing import Any

import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

from ..native.contract import Signatures, declare, fields
from ..outcome import SimulationError
from .lanes import NoLanes, Wanted
from .native import EnsembleStruct, load_ensemble

OPENCL = "opencl"
ATTEMPTS = 200
"""Steps that a member is taken on by in one call of the device: between two calls Ctrl-C is heard."""
ABREAST, MOST_BYTES = 16_384, 5e8
"""Members that a device holds at once, and bytes of them here and there."""
SINGLES, MARKS = 10, 5
"""MECH_ITEM_SINGLES and MECH_ITEM_MARKS of ``kernel/ensemble/item_layout.h``."""
RUNS = 1
"""Members whose status is at most this one have not ended."""
OPTIONS = ("-cl-std=CL1.2", "-w")
PROBE = """
#pragma OPENCL EXTENSION cl_khr_fp64 : enable
__kernel void probe(__global double *x) { x[0] = fma(x[0], x[0], 1.0); }
"""

MakeItems = Callable[[Wanted, str], str]
"""Gives the text of a model for devices: ``make(wanted, method)``. Raises NoLanes."""


class ArraysStruct(ctypes.Structure):
    """mech_item_arrays"""

    _fields_ = fields("pointer numbers, marks, fixed, rows, which")


class Device(Struct, frozen=True, eq=False):
    """A device that compiles and has double precision. ``cl``: the module pyopencl."""

    cl: Any
    context: Any
    queue: Any
    name: str


@functools.cache
def find_device(asked: str) -> Device:
    """Give the device that ``opencl`` or ``opencl:PART OF ITS NAME`` means, graphics processors first. Raises SimulationError."""
    kind, _, part = asked.partition(":")
    if kind.strip() != OPENCL:
        raise SimulationError(
            f"'device' is {OPENCL}, or {OPENCL}:NAME for one of several, not '{asked}'",
            help="without it members run on the processor",
        )
    try:
        cl = importlib.import_module("pyopencl")
    except ImportError:
        raise SimulationError(
            "devices are reached through pyopencl, which is not installed",
            help="pip install 'mechc[gpu]' brings it",
        ) from None
    found = list(_devices(cl))
    if not found:
        raise SimulationError(
            "there is no OpenCL device on this machine",
            help="a driver brings one; pocl lets processors be devices: apt install pocl-opencl-icd, or pip install 'mechc[gpu]'",
        )
    named = [one for one in found if part.strip().lower() in _name(one).lower()]
    if not named:
        raise SimulationError(
            f"no OpenCL device is called '{part.strip()}'",
            help=f"there are: {'; '.join(map(_name, found))}",
        )
    troubles = []
    for one in sorted(named, key=lambda d: not d.type & cl.device_type.GPU):
        made = _opened(cl, one)
        if isinstance(made, Device):
            return made
        troubles.append(f"{_name(one)}: {made}")
    raise SimulationError(
        f"no OpenCL device can run members: {'; '.join(troubles)}",
        help="members need double precision, and a driver that knows the processor that it compiles for",
    )


def _devices(cl: Any) -> Iterator[Any]:
    try:
        platforms = cl.get_platforms()
    except cl.Error:  # no driver is installed
        return
    for platform in platforms:
        try:
            yield from platform.get_devices()
        except cl.Error:  # a driver without a device
            continue


def _name(device: Any) -> str:
    return f"{device.name.strip()} ({device.platform.name.strip()})"


def _opened(cl: Any, device: Any) -> Device | str:
    """Give the device, or say why it cannot be used."""
    if not device.double_fp_config:
        return "it has no double precision"
    try:
        context = cl.Context([device])
        _compiled(cl, context, PROBE)
        return Device(cl, context, cl.CommandQueue(context), _name(device))
    except cl.Error as error:
        return next(
            (line for line in str(error).splitlines() if "error:" in line), "its driver does not compile"
        )


def _compiled(cl: Any, context: Any, text: str) -> Any:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # what drivers have to say of code that compiles
        return cl.Program(context, text).build(list(OPTIONS))


class Items:
    """A model on a device. ``sincos_batch``: members that turn out stiff need the other part of the method."""

    def __init__(self, device: Device, text: str, turns: bool) -> None:
        self.device, self._turns = device, turns
        cl = device.cl
        try:
            program = _compiled(cl, device.context, text)
        except cl.Error as error:
            raise NoLanes(
                f"{device.name} does not compile the model: {str(error).strip().splitlines()[0]}"
            ) from None
        self._kernel = cl.Kernel(program, "mech_items")
        sizes = self._empty(2, np.int32)
        cl.Kernel(program, "mech_item_sizes")(device.queue, (1,), None, sizes)
        self.n_numbers, self.n_fixed = (int(n) for n in self._read(sizes, np.empty(2, np.int32)))

    @property
    def build(self) -> str:
        return f"OpenCL, {self.device.name}"

    def abreast(self, struct: EnsembleStruct, n_rows: int) -> int:
        """Give how many members are taken on at once; ``n_rows`` numbers of each on the grid."""
        each = _library().mech_items_bytes(ctypes.byref(struct)) + 8 * (
            self.n_numbers + self.n_fixed + n_rows
        )
        return max(1, min(ABREAST, int(MOST_BYTES / each)))

    def run(
        self,
        struct: EnsembleStruct,
        grid: Sequence[float],
        stops: Sequence[float],
        kinds: Sequence[int],
        given: NDArray[np.uint8],
        ny: int,
        done: Any,
        stopped: Any,
    ) -> None:
        """Run the members of an ensemble that wait. ``kinds`` of kept numbers; ``given``: inputs that do not follow the model."""
        n = int(struct.n)
        library, mine = _library(), c_long(0)
        struct.done = ctypes.pointer(mine)
        numbers, fixed = np.zeros((self.n_numbers, n)), np.zeros((self.n_fixed, n))
        marks, which = np.zeros((MARKS, n), np.int32), np.zeros(n, np.uint32)
        rows = np.zeros((max(1, len(grid) * ny), n))
        arrays = ArraysStruct(*(array.ctypes.data for array in (numbers, marks, fixed, rows, which)))
        items = library.mech_items_open(ctypes.byref(struct))
        if not items:
            raise MemoryError("there is no room for the members that a device takes on")
        try:
            buffers = {
                name: self._empty(array.size, array.dtype)
                for name, array in (
                    ("which", which),
                    ("numbers", numbers),
                    ("marks", marks),
                    ("fixed", fixed),
                    ("rows", rows),
                )
            }
            rest = [
                self._filled(np.array([*grid, *stops, 0.0])),
                np.int32(len(grid)),
                np.int32(len(stops)),
                np.float64(struct.stop),
                np.float64(struct.begin),
                self._filled(np.array([*kinds, 0], np.int32)),
                self._filled(np.append(given, np.uint8(0)).astype(np.uint8)),
                np.int32(self._turns),
            ]
            begun = mine.value
            done.value += begun
            first = True
            while count := library.mech_items_next(items, ctypes.byref(arrays)):
                for name, array in (("numbers", numbers), ("marks", marks), ("fixed", fixed)):
                    self._write(buffers[name], array)
                alive = which[:count].copy()
                while alive.size and not stopped.value:
                    self._write(buffers["which"], alive)
                    self._kernel(
                        self.device.queue,
                        (alive.size,),
                        None,
                        np.uint32(n),
                        np.uint32(alive.size),
                        buffers["which"],
                        np.int32(ATTEMPTS),
                        buffers["numbers"],
                        buffers["marks"],
                        buffers["fixed"],
                        buffers["rows"],
                        *rest,
                    )
                    self._read(buffers["marks"], marks)
                    left = alive[marks[0, alive] <= RUNS]
                    done.value += (alive.size - left.size) * first
                    alive = left
                self._read(buffers["numbers"], numbers)
                self._read(buffers["rows"], rows)
                library.mech_items_take(items, ctypes.byref(arrays), count)
                first = False
                if stopped.value:
                    break
        finally:
            library.mech_items_close(items)

    # ---- memory of the device

    def _empty(self, count: int, kind: Any) -> Any:
        cl = self.device.cl
        return cl.Buffer(
            self.device.context, cl.mem_flags.READ_WRITE, max(1, count) * np.dtype(kind).itemsize
        )

    def _filled(self, array: Any) -> Any:
        buffer = self._empty(array.size, array.dtype)
        self._write(buffer, array)
        return buffer

    def _write(self, buffer: Any, array: Any) -> None:
        if array.size:
            self.device.cl.enqueue_copy(self.device.queue, buffer, np.ascontiguousarray(array))

    def _read(self, buffer: Any, array: Any) -> Any:
        self.device.cl.enqueue_copy(self.device.queue, array, buffer)
        return array


@functools.cache
def _library() -> ctypes.CDLL:
    signatures: Signatures = {
        "mech_items_bytes": (c_size_t, (POINTER(EnsembleStruct),)),
        "mech_items_open": (c_void_p, (POINTER(EnsembleStruct),)),
        "mech_items_next": (c_long, (c_void_p, POINTER(ArraysStruct))),
        "mech_items_take": (None, (c_void_p, POINTER(ArraysStruct), c_long)),
        "mech_items_close": (None, (c_void_p,)),
    }
    return declare(load_ensemble(), signatures)


def refuse_device(why: NoLanes) -> SimulationError:
    """Return the error for a device that was asked for."""
    return SimulationError(
        f"members cannot run on a device: {why}", help="without 'device' they run on the processor"
    )
