"""Tables: from the text to the first result, and one evaluation, called from C.

Processor times, medians of tasks in turn. An evaluation is that of the rates of a model with the table alone, less that of the same
model with the argument in its place.
"""

from __future__ import annotations

import ctypes
import os
import resource
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import mechc
from mechc.runtime.case import SimulationOptions, prepare
from mechc.runtime.functions import load_functions

from .generated import Contestant, _Task, caller, measured
from .machine import table, write

Floats = NDArray[np.float64]

STATES = 1024
POINTS = 100_000
GRID = (200, 100)
KINDS = ("linear", "smooth", "spline")
GOALS = {"road": (30.0, 3.0), "map": (60.0, 2.0)}
"""Nanoseconds of one evaluation, and seconds from the text to the first result of a fresh process."""
SPACINGS = ("even", "uneven")

ROAD = """model Road
  dimensionless;
  state x = 3; state h = 0;
  equation der(x) = 1;
  equation der(h) = {law};
  experiment(stop = 0.001);
end Road;
"""
MAP = """model Map
  dimensionless;
  structural parameter Real xs[:] = file("map.npz", "xs");
  structural parameter Real ys[:] = file("map.npz", "ys");
  structural parameter Real z[:, :] = file("map.npz", "z");
  state x = 3; state y = 1; state h = 0; state rest = 0;
  equation der(x) = 1; equation der(y) = 1; equation der(rest) = 0;
  equation der(h) = {law};
  experiment(stop = 0.001);
end Map;
"""


def points(count: int, length: float, spacing: str, rng: np.random.Generator) -> Floats:
    """Return points of the range from 0 to ``length``; uneven ones are off by two fifths of their distance at most."""
    at = np.arange(count) + (rng.uniform(-0.4, 0.4, count) if spacing == "uneven" else 0.0)
    at[[0, -1]] = 0, count - 1
    found: Floats = at * (length / (count - 1))
    return found


def road(folder: Path, spacing: str) -> tuple[Floats, Floats]:
    rng = np.random.default_rng(1)
    x = points(POINTS, 1000.0, spacing, rng)
    z = 1e-3 * np.cumsum(rng.standard_normal(POINTS))
    np.savetxt(folder / "road.csv", np.column_stack([x, z]), "%.17g", ",", header="x,z", comments="")
    return x, z


def surface(folder: Path, spacing: str) -> tuple[Floats, Floats, Floats]:
    rng = np.random.default_rng(2)
    x, y = points(GRID[0], 10.0, spacing, rng), points(GRID[1], 5.0, spacing, rng)
    z = np.sin(x[:, None]) * np.cos(y) + 0.1 * rng.standard_normal(GRID)
    np.savez(folder / "map.npz", xs=x, ys=y, z=z)
    return x, y, z


def contestant(model: mechc.Model, y: Floats) -> Contestant:
    """Return the rates of a model at states; what switches is as at the start."""
    problem = model.problem()
    functions = load_functions(problem)
    case = prepare(problem, functions, SimulationOptions())
    z = np.zeros(64)
    at = ctypes.addressof(functions.struct), y.ctypes.data, case.p.ctypes.data, z.ctypes.data
    task = _Task(at[0], None, None, y.shape[1] // 2, len(y), *at[1:])
    return Contestant(task, (functions, case, y, z))


def models(folder: Path, name: str, text: str, laws: dict[str, str]) -> dict[str, mechc.Model]:
    made = {}
    for label, law in laws.items():
        (folder / f"{name}.mech").write_text(text.format(law=law), encoding="utf-8")
        made[label] = mechc.load(folder / f"{name}.mech")
    return made


def first_result(model: Path) -> float:
    """Return processor seconds of ``mechc run``, with nothing kept from before."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    with tempfile.TemporaryDirectory() as cache:
        subprocess.run(
            [sys.executable, "-m", "mechc", "run", str(model)],
            check=True, capture_output=True, env={**os.environ, "MECHC_CACHE": cache},
        )  # fmt: skip
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def main(quick: bool = False) -> None:
    library = caller()
    rows: list[list[str]] = []
    for name, text, arguments in (("road", ROAD, "x"), ("map", MAP, "x, y")):
        for spacing in SPACINGS[: 1 if quick else 2]:
            with tempfile.TemporaryDirectory() as made:
                rows += measured_rows(library, Path(made), name, text, arguments, spacing)
    head = [
        "table",
        "points",
        "kind",
        "along, ns",
        "anywhere, ns",
        "dependent, ns",
        "goal, ns",
        "first result, s",
        "goal, s",
    ]
    text = (
        "One evaluation along the points, anywhere, and where each waits for the one before; and processor time from the text to the "
        f"first result of a fresh process: a road of {POINTS} points from a file, a map of {GRID[0]} × {GRID[1]}."
    )
    write("tables", "Tables", [text, table(head, rows)])


def measured_rows(
    library: Any, folder: Path, name: str, text: str, arguments: str, spacing: str
) -> list[list[str]]:
    source = '"road.csv", "z"' if name == "road" else "xs, ys, z"
    given: tuple[Floats, ...] = road(folder, spacing) if name == "road" else surface(folder, spacing)
    laws = {"": "x"} | {kind: f'table({arguments}, {source}, "{kind}")' for kind in KINDS}
    made = models(folder, name, text, laws)
    rng = np.random.default_rng(3)
    axes = given[:-1]
    rest = np.zeros((STATES, len(axes)))
    anywhere = np.column_stack([*(rng.uniform(0, p[-1], STATES) for p in axes), rest])
    share = 0.2 + np.arange(STATES) / (3 * axes[0].size) % 0.7
    along = np.column_stack([*(share * p[-1] for p in axes), rest])
    times = {}
    for column, y in (("along", along), ("anywhere", anywhere), ("dependent", anywhere)):
        tasks = [contestant(model, np.ascontiguousarray(y)) for model in made.values()]
        times[column] = measured(library, tasks, column == "dependent")
    rows = []
    goal, longest = GOALS[name]
    for k, kind in enumerate(laws):
        if not kind:
            continue
        cells = [f"{times[c][k] - times[c][0]:.1f}" for c in ("along", "anywhere", "dependent")]
        (folder / f"{name}.mech").write_text(text.format(law=laws[kind]), encoding="utf-8")
        seconds = first_result(folder / f"{name}.mech")
        rows.append([name, spacing, kind, *cells, f"{goal:.0f}", f"{seconds:.2f}", f"{longest:.0f}"])
    return rows
