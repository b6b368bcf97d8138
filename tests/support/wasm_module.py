"""Modules of WebAssembly in wasmtime: their functions, and numbers in their memory."""

from __future__ import annotations

import ctypes
import importlib.util
from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from mechc.compiler.program import Program
from mechc.compiler.targets.wasm.binary import PAGE
from mechc.compiler.targets.wasm.link import linked
from mechc.web.kernels import WebKernel, loaded

Floats = NDArray[np.float64]

needs_wasmtime = pytest.mark.skipif(
    importlib.util.find_spec("wasmtime") is None, reason="needs pip install wasmtime"
)


class Instance:
    """A module without imports that runs."""

    def __init__(self, module: bytes) -> None:
        import wasmtime

        engine = wasmtime.Engine()
        self.store = wasmtime.Store(engine)
        exports = wasmtime.Instance(self.store, wasmtime.Module(engine, module), []).exports(self.store)
        memory, table = exports["memory"], exports["__indirect_function_table"]
        assert isinstance(memory, wasmtime.Memory) and isinstance(table, wasmtime.Table)
        self._exports, self._memory, self._table = exports, memory, table
        self.call("_initialize")

    def call(self, name: str, *arguments: float) -> Any:
        return self._called(self._exports[name], *arguments)

    def room(self, n_bytes: int) -> int:
        """Return the address of new memory, which nobody else uses and which begins as zero."""
        pages = -(-n_bytes // PAGE)
        return int(self._memory.grow(self.store, pages)) * PAGE

    def view(self, address: int, count: int, kind: Any = np.float64) -> Any:
        """Return numbers in the memory; a view lasts until it grows."""
        begin = ctypes.addressof(self._memory.data_ptr(self.store).contents)
        n_bytes = count * np.dtype(kind).itemsize
        return np.frombuffer((ctypes.c_char * n_bytes).from_address(begin + address), kind)

    def at(self, entry: int) -> Any:
        """Return the function at an entry of the table."""
        function = self._table.get(self.store, entry)
        return lambda *arguments: self._called(function, *arguments)

    def _called(self, function: Any, *arguments: float) -> Any:
        return function(self.store, *arguments)


class WasmModel:
    """The functions of a program, by name."""

    def __init__(self, program: Program, kernel: WebKernel, experiment: str | None = None) -> None:
        self.program = program
        self.linked = linked(program, loaded(kernel), experiment, every=True)
        self.instance = Instance(self.linked.module)
        sizes = [*(program.size(array) for array in ("y", "u", "z", "p")), 0]
        sizes[1] += len(program.arrays.get("g", ()))
        sizes[4] = max((f.n_out for f in program.functions), default=0)
        begin = self.instance.room(8 * sum(sizes) + len(program.arrays["p"]) + 64)
        ends = np.cumsum(sizes)
        self.places = [int(begin + 8 * (end - size)) for end, size in zip(ends, sizes, strict=True)]
        self.behind = int(begin + 8 * ends[-1])

    def call(self, name: str, t: float, *arrays: Floats | Sequence[float]) -> Floats:
        """Return what a function gives for t, y, u, z and p."""
        function = self.program.function(name)
        assert function is not None
        for at, array in zip(self.places, arrays, strict=False):
            self.instance.view(at, len(array))[:] = array
        self.instance.view(self.places[4], function.n_out)[:] = 777.0
        self.instance.at(self.linked.entries[name])(t, *self.places)
        found: Floats = self.instance.view(self.places[4], function.n_out).copy()
        return found

    def default_parameters(self) -> Floats:
        n, total = len(self.program.arrays["p"]), self.program.size("p")
        self.instance.view(self.places[3], total)[:] = np.nan
        self.instance.view(self.behind, n, np.uint8)[:] = 0
        self.instance.at(self.linked.entries["parameters"])(self.places[3], self.behind)
        found: Floats = self.instance.view(self.places[3], total).copy()
        return found


class WasmRun:
    """A model as a page runs it: the exports of ``mechc/web/kernel/web.c``."""

    def __init__(self, module: bytes, rows: int = 101) -> None:
        self.instance = Instance(module)
        self.rows = rows
        self.instance.call("web_open", rows)

    def sizes(self) -> list[int]:
        """Return the numbers of states, parameters with constants, parameters, inputs, discretes, outputs."""
        return [int(n) for n in self.instance.view(self.instance.call("web_sizes"), 6, np.int32)]

    def array(self, which: int, count: int) -> Floats:
        found: Floats = self.instance.view(self.instance.call("web_array", which), count).copy()
        return found

    def run(
        self, stop: float, method: int = 0, tolerance: float = 1e-9, step: float = 0.0
    ) -> tuple[int, Floats]:
        """Return the status, and the states at equal times from 0 to the end."""
        call = self.instance.call
        assert call("web_settle") == 0
        call("web_times", 0.0, 0.0, stop)
        assert call("web_begin") >= 0
        status = int(call("web_run", tolerance, method, step, stop / 10))
        ny = self.sizes()[0]
        return status, self.array(8, call("web_n_grid") * ny).reshape(-1, ny)

    def event_times(self) -> Floats:
        """Return the times of the events of the last run."""
        at, count = self.instance.call("web_array", 11), self.instance.call("web_n_events")
        found: Floats = self.instance.view(at, 4 * count).reshape(-1, 4)[:, 0].copy()
        return found
