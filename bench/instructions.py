"""How many instructions a step takes: counted by valgrind where it is installed, code without those of this processor."""

from __future__ import annotations

import re
import shutil
import subprocess
import tempfile
from pathlib import Path

import numpy as np

import mechc
from mechc.measurement.savings import default_case
from mechc.runtime.native import kernel as native
from mechc.runtime.native.build import build_shared, find_compiler, kernel_flags

DRIVER = Path(__file__).parent / "count_steps.c"
STEPS = 100
SHARE = 1e-4
"""Length of the steps over that of the experiment: no motion runs away in so few of them."""


def instructions(model: mechc.Model, driver: Path) -> int | None:
    """Return the instructions of ``STEPS`` steps; None where the motion cannot begin or is undefined."""
    problem = model.problem(reproducible=True)
    case = default_case(problem)
    if case is None:
        return None
    kernel = build_shared(native.kernel_sources(), kernel_flags(reproducible=True), name="kernel")
    with tempfile.NamedTemporaryFile() as numbers:
        numbers.write(np.concatenate([case.y0, case.z, case.p]).tobytes())
        numbers.flush()
        watch = [
            "valgrind",
            "--tool=callgrind",
            "--callgrind-out-file=/dev/null",
            "--toggle-collect=mech_advance",
        ]
        step = SHARE * (case.stop - case.begin)
        command = [*watch, driver, kernel, problem.library, numbers.name, STEPS, step]
        done = subprocess.run([str(word) for word in command], capture_output=True, text=True)
    found = re.search(r"Collected : (\d+)", done.stderr)
    return int(found[1]) if found and done.returncode == 0 else None


def make_driver(folder: Path) -> Path | None:
    """Compile the program that is watched; None without valgrind or a C compiler."""
    compiler = find_compiler()
    if compiler is None or shutil.which("valgrind") is None:
        return None
    built = folder / "count_steps"
    headers = Path(native.__file__).parent / "kernel"
    command = [
        *compiler.command,
        "-O1",
        "-std=c11",
        f"-I{headers}",
        str(DRIVER),
        "-o",
        str(built),
        "-ldl",
        "-lm",
    ]
    subprocess.run(command, check=True)
    return built
