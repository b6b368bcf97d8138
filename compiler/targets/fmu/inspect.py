"""What ``mechc fmu check`` finds out about any FMU: validity, agreement with its binary, and whether it runs."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import fmpy
import numpy as np
from fmpy.simulation import simulate_fmu

from . import driver
from .rules import check_file

KINDS = {"me": "ModelExchange", "cs": "CoSimulation"}


@dataclass(frozen=True, slots=True)
class Line:
    what: str
    passed: bool
    detail: str = ""


@dataclass(frozen=True, slots=True)
class Report:
    lines: tuple[Line, ...]

    @property
    def passed(self) -> bool:
        return all(line.passed for line in self.lines)


def inspect(path: Path, *, run: bool = True) -> Report:
    """Return the findings for one FMU; a description that is not valid is not run."""
    problems = check_file(path)
    if problems:
        return Report(tuple(Line("model description", False, p) for p in problems))
    lines = [Line("model description", True)]
    description = fmpy.read_model_description(str(path), validate=False)
    parts = {"me": description.modelExchange, "cs": description.coSimulation}
    if fmpy.platform not in fmpy.supported_platforms(str(path)):
        lines.append(Line("binary", True, f"none for {fmpy.platform}: not run"))
        return Report(tuple(lines))
    for kind, part in parts.items():
        if part is None:
            continue
        lines += binary_lines(path, kind, description)
        if run and lines[-1].passed:
            lines.append(run_line(path, kind))
    return Report(tuple(lines))


def binary_lines(path: Path, kind: str, description: Any) -> list[Line]:
    """Compare what the description says with what the binary does: token, event indicators, states."""
    what = f"{KINDS[kind]} binary"
    try:
        with driver.instance(path, kind) as fmu:
            driver.initialise(fmu, 0.0)
            if kind == "cs":
                return [Line(what, True)]
            return [Line(what, not problem, problem) for problem in [_sizes(fmu, description)]]
    except Exception as error:  # fmpy raises plain exceptions where a binary refuses
        return [Line(what, False, f"it cannot be instantiated and initialised: {error}")]


def _sizes(fmu: Any, description: Any) -> str:
    """Return what is wrong with the numbers of event indicators and states, or an empty text."""
    n = int(description.numberOfEventIndicators or 0)
    if hasattr(fmu, "getNumberOfEventIndicators"):
        served = int(fmu.getNumberOfEventIndicators())
        if served != n:
            return f"{n} event indicators are declared, the binary has {served}"
        states = int(fmu.getNumberOfContinuousStates())
        if states != description.numberOfContinuousStates:
            return f"{description.numberOfContinuousStates} states are declared, the binary has {states}"
        return ""
    import ctypes

    values = (ctypes.c_double * (n + 1))()
    try:
        fmu.fmi2GetEventIndicators(fmu.component, values, n)
    except Exception:
        return f"the binary does not have {n} event indicators"
    return ""


def run_line(path: Path, kind: str) -> Line:
    """Simulate the default experiment: all results are finite."""
    try:
        result = simulate(str(path), kind)
    except Exception as error:
        return Line(f"{KINDS[kind]} run", False, str(error))
    values = np.array([[float(v) for v in row] for row in result])
    finite = bool(np.all(np.isfinite(values)))
    end = float(result["time"][-1])
    return Line(f"{KINDS[kind]} run", finite, f"to time {end:g}" if finite else "a result is not finite")


def simulate(path: str, kind: str, stop: float | None = None) -> Any:
    """Simulate the default experiment through fmpy; return a structured array by variable name."""
    return simulate_fmu(path, fmi_type=KINDS[kind], stop_time=stop)
