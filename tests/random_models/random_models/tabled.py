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
_READ = re.compile(r'\binput (?:\w+ )?(\w+)(?:\[[^\]]*\])?\(interpolation = "(\w+)"\)')


def tables(base: Compiled, folder: Path, random: Random) -> dict[str, Path]:
    """Write a table for some inputs of a model, by name."""
    chosen = [q for q in base.problem.inputs if random.random() < 0.7]
    found: dict[str, Path] = {}
    for q in chosen:
        times = [0.0, *sorted({round(random.uniform(0.05, 0.95), 3) for _ in range(ROWS - 2)}), 1.0]
        rows = [f"{t!r},{round(random.uniform(-1, 1), 3)!r}" for t in times]
        found[q.name] = folder / f"{len(found)}.csv"
        found[q.name].write_text("\n".join((f"time [s],{q.name} [{q.unit or '1'}]", *rows)) + "\n")
    return found


def meant(base: Compiled, paths: Mapping[str, Path]) -> dict[str, Callable[[float], float]]:
    """Return the same tables as functions of time, in SI, read as the text says."""
    kinds = dict(_READ.findall(base.text))
    return {
        name: _function(np.loadtxt(p, delimiter=",", skiprows=1), kinds.get(name.partition("[")[0], "linear"))
        for name, p in paths.items()
    }


def _function(rows: Any, kind: str) -> Callable[[float], float]:
    times, values = rows.T
    if kind == "step":
        return lambda t: float(values[max(int(np.searchsorted(times, t, side="right")) - 1, 0)])
    if kind == "linear":
        return lambda t: float(np.interp(t, times, values))
    spline = CubicSpline(times, values, bc_type="natural")
    return lambda t: float(spline(min(max(t, times[0]), times[-1])))
