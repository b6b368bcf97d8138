"""C programs that models are written as, compiled; files of the kernel are the same in many: each is compiled once."""

from __future__ import annotations

import csv
import hashlib
import re
import subprocess
from pathlib import Path

import numpy as np
import pytest
from msgspec.structs import replace

import mechc
from mechc.exporting import defaults_of, exported_run, method_of
from mechc.runtime.case import SimulationOptions
from mechc.runtime.native.build import find_compiler
from mechc.runtime.problem import Array
from mechc.runtime.rows import output_times
from mechc.runtime.studies.kinds.motion import simulate

BITS = ("-O0", "-ffp-contract=off", "-frounding-math")
"""One rounding for each operation, as a reproducible run has."""


def build(folder: Path, objects: Path) -> Path:
    """Compile the program that was written into a folder; ``objects`` holds what was compiled before."""
    compiler = find_compiler()
    assert compiler is not None
    linked = []
    for source in sorted(folder.glob("*.c")):
        digest = hashlib.sha256("\0".join(read(source, {}).values()).encode()).hexdigest()
        linked.append(objects / f"{digest}.o")
        if not linked[-1].exists():
            flags = [
                "-std=c11",
                "-Wall",
                "-Wextra",
                "-Werror",
                *BITS,
                "-c",
                source.name,
                "-o",
                str(linked[-1]),
            ]
            subprocess.run([*compiler.command, *flags], cwd=folder, check=True)
    program = folder / "program"
    subprocess.run([*compiler.command, "-o", program, *linked, "-lm"], check=True)
    return program


def read(file: Path, known: dict[str, str]) -> dict[str, str]:
    """Return what the compiler reads of a file: its text, and that of all it includes, by name."""
    known[file.name] = text = file.read_text(encoding="utf-8")
    for name in re.findall(r'^#include "([^"]+)"', text, re.M):
        if name not in known:
            read(file.with_name(name), known)
    return known


def rows_of_program(
    model: mechc.Model, folder: Path, objects: Path, *arguments: str
) -> tuple[list[str], Array]:
    """Return names and rows of the C program that a model is written as."""
    model.compile("c", folder)
    done = subprocess.run([build(folder, objects), *arguments], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    head, *rows = csv.reader(done.stdout.splitlines())
    return [name.split(" [")[0] for name in head], np.array(rows, dtype=float)


def rows_of_run(model: mechc.Model, names: list[str]) -> tuple[Array, Array]:
    """Return the same columns of a run with the same method, which shows both sides of events, and its output times."""
    defaults = defaults_of(model.problem(reproducible=True), model.settings)
    ran, first = exported_run(model, None, defaults.stop)
    method = method_of(ran, first)
    compiled = ran.problem(reproducible=True, method=method)
    # programs end no steps at kinks and points of tables of time
    compiled = replace(compiled, timed_points=())
    options = SimulationOptions(
        values=model.settings,
        stop=defaults.stop,
        estimate_error=False,
        every=defaults.every,
        points=501,
        method=method,
        reproducible=True,
    )
    solution = simulate(compiled, options)
    times = output_times(defaults.start, defaults.stop, defaults.every, 501)
    rows = np.column_stack([solution.time, *(solution[name] for name in names[1:])])
    return rows, times[times <= solution.time[-1]]


def check_rows(model: mechc.Model, folder: Path, objects: Path) -> Array:
    """Compare every bit: one start, one set of nominal values, the same steps. Return the rows of the program."""
    names, own = rows_of_program(model, folder, objects)
    rows, times = rows_of_run(model, names)
    np.testing.assert_array_equal(own[:, 0], times)
    for row in own:
        sides = rows[rows[:, 0] == row[0]]
        if not any(np.array_equal(row, side, equal_nan=True) for side in sides):
            pairs = zip(names, row, sides[-1], strict=True)
            pytest.fail(f"{model.name} at {row[0]}: {[(n, a, b) for n, a, b in pairs if a != b]}")
    return own
