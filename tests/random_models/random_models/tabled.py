"""Inputs read from tables with rows at unequal times, and what they mean by the page: straight lines, steps, natural splines."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from pathlib import Path
from random import Random
from typing import Any

import numpy as np
from scipy.interpolate import CubicSpline

from random_models.compiled import Compiled

ROWS = 6
BEYOND = -0.5, 2.0
"""What the tables of inputs that drive reach from and to, more than any run."""
SECOND = {"s": 1.0, "ms": 1000.0, "min": 1 / 60}
SECONDS = tuple(SECOND)
PART = {"": 1.0, ".cm/m": 100.0, ".g/mg": 0.001}
PARTS = tuple(PART)
"""Units of the columns: how many of them are one of SI."""
_READ = re.compile(r'\binput (?:\w+ )?(\w+)(?:\[[^\]]*\])?\(interpolation = "(\w+)"\)')


def tables(base: Compiled, folder: Path, random: Random) -> dict[str, Path]:
    """Write a table for some inputs of a model, by name."""
    names = {q.name for q in base.problem.inputs}
    chosen = [q for q in base.problem.inputs if not q.name.startswith("der(") and random.random() < 0.7]
    found: dict[str, Path] = {}
    for q in chosen:
        times = [0.0, *sorted({round(random.uniform(0.05, 0.95), 3) for _ in range(ROWS - 2)}), 1.0]
        if f"der({q.name})" in names:  # what it drives would stand still at the ends
            times[0], times[-1] = BEYOND
        second, one = random.choice(SECONDS), random.choice(PARTS)
        rows = [
            f"{t * SECOND[second]:.12g},{round(random.uniform(-1, 1), 3) * PART[one]:.12g}" for t in times
        ]
        found[q.name] = folder / f"{len(found)}.csv"
        unit = f"{q.unit or '1'}{one}".removeprefix("1.")
        found[q.name].write_text("\n".join((f"time [{second}],{q.name} [{unit}]", *rows)) + "\n")
    return found


def meant(base: Compiled, paths: Mapping[str, Path]) -> dict[str, Callable[[float], float]]:
    """Return the same tables as functions of time, in SI, read as the text says."""
    kinds = dict(_READ.findall(base.text))
    driving = {q.name for q in base.problem.inputs if q.name.startswith("der(")}

    def one(name: str, path: Path) -> Callable[[float], float]:
        if f"der({name})" in driving:
            times, values = _rows(path).T
            return CubicSpline(times, values, bc_type="natural")  # type: ignore[no-any-return]
        return _function(_rows(path), kinds.get(name.partition("[")[0], "linear"))

    return {name: one(name, path) for name, path in paths.items()}


def _rows(path: Path) -> Any:
    """Return the rows of a table in SI."""
    head = path.read_text().partition("\n")[0]
    second = next(s for s in SECONDS if f"time [{s}]" in head)
    one = next((p for p in PARTS if p and head.endswith(f"{p[1:]}]")), "")
    return np.loadtxt(path, delimiter=",", skiprows=1) / [SECOND[second], PART[one]]


def _function(rows: Any, kind: str) -> Callable[[float], float]:
    times, values = rows.T
    if kind == "step":
        return lambda t: float(values[max(int(np.searchsorted(times, t, side="right")) - 1, 0)])
    if kind == "linear":
        return lambda t: float(np.interp(t, times, values))
    spline = CubicSpline(times, values, bc_type="natural")
    return lambda t: float(spline(min(max(t, times[0]), times[-1])))
