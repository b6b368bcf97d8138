"""Generated C, compiled and called through ctypes, and beside it the Python functions of the same program."""

from __future__ import annotations

import ctypes
import random
import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from random_models.python_functions import load_python

import mechc.runtime
from mechc.compiler.equations.model import Equations
from mechc.compiler.program import Program, lower
from mechc.compiler.program.verify import verify
from mechc.compiler.targets.c import emit_c
from mechc.compiler.targets.model_data import MODEL_FUNCTIONS
from mechc.runtime.native.build import model_flags
from mechc.runtime.native.contract import ModelStruct

KERNEL = Path(mechc.runtime.__file__).parent / "kernel"
STRICT = ("-std=c11", "-Wall", "-Wextra", "-Wpedantic", "-Werror")
REPRODUCIBLE = model_flags(reproducible=True)

Floats = NDArray[np.float64]


def compiler() -> str:
    command = shutil.which("gcc") or shutil.which("cc")
    if command is None:
        pytest.skip("no C compiler")
    return command


def compile_c(
    text: str,
    folder: Path,
    flags: Sequence[str] = REPRODUCIBLE,
    name: str = "model",
    libraries: Sequence[str] = ("-lm",),
) -> Path:
    """Compile a model file to a shared library without a warning."""
    source, library = folder / f"{name}.c", folder / f"{name}.so"
    source.write_text(text)
    command = [
        compiler(),
        *STRICT,
        *flags,
        "-fPIC",
        "-shared",
        "-I",
        str(KERNEL),
        "-o",
        str(library),
        str(source),
    ]
    done = subprocess.run([*command, *libraries], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return library


class NativeModel:
    """The functions of a compiled program, by name."""

    def __init__(
        self,
        program: Program,
        folder: Path,
        chunk_size: int | None = None,
        name: str = "model",
        flags: Sequence[str] = REPRODUCIBLE,
        *,
        turns: bool = False,
    ) -> None:
        self.program = program
        text = emit_c(program, chunk_size, turns=turns)
        self.library = ctypes.CDLL(str(compile_c(text, folder, flags, name)))
        get = self.library.mech_model_get
        get.restype = ctypes.POINTER(ModelStruct)
        self.model = get().contents

    def _address(self, name: str) -> int:
        if name in MODEL_FUNCTIONS:
            address = getattr(self.model, name)
        else:
            address = ctypes.cast(getattr(self.library, name), ctypes.c_void_p).value
        assert isinstance(address, int), f"the model has no function {name}"
        return address

    def call(self, name: str, t: float, y: Floats, u: Floats, z: Floats, p: Floats) -> Floats:
        function = self.program.function(name)
        assert function is not None
        out = np.full(function.n_out, 777.0)
        if name in self.program.actions:
            out[: y.size + z.size] = np.concatenate([y, z])
        pointer = ctypes.c_void_p
        prototype = ctypes.CFUNCTYPE(None, ctypes.c_double, *[pointer] * 5)
        prototype(self._address(name))(t, *(a.ctypes.data for a in (y, u, z, p, out)))
        return out

    def parameters(self, p: Floats, given: NDArray[np.uint8]) -> None:
        prototype = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_void_p)
        prototype(self.model.parameters)(p.ctypes.data, given.ctypes.data)

    def default_parameters(self) -> Floats:
        p = np.full(self.program.size("p"), np.nan)
        self.parameters(p, np.zeros(len(self.program.arrays["p"]), np.uint8))
        return p


def bits(values: Floats) -> list[int]:
    """Return the numbers as integers; every NaN is the same one."""
    return [int(np.float64(v).view(np.uint64)) if v == v else -1 for v in values]


def random_states(count: int, size: int, seed: int = 1) -> list[list[float]]:
    """Return states of magnitudes from small to large, within the domain of many functions or not."""
    rng = random.Random(seed)
    return [
        [rng.choice((rng.uniform(-1, 1), rng.uniform(0, 4), rng.gauss(0, 30))) for _ in range(size)]
        for _ in range(count)
    ]


class Both:
    """A program as C and as Python."""

    def __init__(self, equations: Equations, folder: Path) -> None:
        self.program: Program = lower(equations)
        verify(self.program)
        self.native = NativeModel(self.program, folder)
        self.python, self.complete = load_python(self.program)
        self.p = self.native.default_parameters()
        behind = len(self.program.arrays.get("g", ()))  # numbers that are given after the inputs
        self.u = np.full(self.program.size("u") + behind, 0.3)
        self.z = np.full(self.program.size("z"), 1.0)
        switching = self.program.switching
        for share in switching.shares if switching is not None else ():  # C finds these, Python is told them
            self.z[[k for k in (share.rests, share.beside) if k >= 0]] = 0.0

    def compare(self, name: str, state: list[float], t: float = 0.7) -> None:
        y = np.array(state)
        expected = self.native.call(name, t, y, self.u, self.z, self.p)
        found = self.python[name](t, y, self.u, self.z, self.p)
        differing = [i for i, (a, b) in enumerate(zip(bits(expected), bits(found), strict=True)) if a != b]
        assert not differing, (name, state, [(i, expected[i], found[i]) for i in differing])
