"""Run an FMU through fmpy, also that of another tool, and show it like a run of a model."""

from __future__ import annotations

import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import fmpy
import numpy as np
from fmpy.simulation import simulate_fmu

from .compiler.targets.fmu.inspect import KINDS, kinds_of
from .display import Display
from .lang.units import UnitError, parse_unit
from .runtime.accuracy import Accuracy
from .runtime.outcome import Outcome
from .runtime.problem import Array, Problem, Quantity
from .runtime.solution import Solution as Run
from .runtime.trajectory import Statistics
from .settings import UsageMistake, unknown_name
from .solution import Solution

NUMERIC = {"Real", "Float32", "Float64"}


def run_fmu(
    path: Path,
    *,
    kind: str | None = None,
    stop: float | None = None,
    every: float | None = None,
    values: Mapping[str, str] | None = None,
) -> Solution:
    """Simulate an FMU; numbers are in the units of its model description.

    ``kind``: me or cs; Co-Simulation where the file has both. ``every``: spacing of the output and, for
    Co-Simulation, the communication step. Raises UsageMistake for a kind, name or file that does not fit.
    """
    try:
        description = fmpy.read_model_description(str(path), validate=False)
    except Exception as error:  # fmpy raises plain exceptions of many kinds for a file that is wrong
        raise UsageMistake(f"{path} is no FMU: {error}", "'mechc fmu check' says more") from error
    kinds = kinds_of(description)
    chosen = kind or ("cs" if "cs" in kinds else kinds[0] if kinds else "")
    if chosen not in kinds:
        raise UsageMistake(
            f"{path} has no {KINDS.get(chosen, 'kind that can be run')}",
            f"it has {' and '.join(KINDS[k] for k in kinds)}" if kinds else "",
        )
    known = [v.name for v in description.modelVariables if v.causality in ("parameter", "input") or v.start]
    for name in values or {}:
        if name not in known:
            raise unknown_name("variable that can be set", name, known)
    problem = _problem(description)
    quantities = (*problem.states, *problem.outputs, *problem.inputs)
    begun = time.perf_counter()
    try:
        result = simulate_fmu(
            str(path),
            fmi_type=KINDS[chosen],
            stop_time=stop,
            output_interval=every,
            start_values=dict(values or {}),
            output=[q.name for q in quantities],
            validate=False,
        )
    except Exception as error:  # the same, for a binary that refuses
        raise UsageMistake(f"{path} cannot be run: {error}", "'mechc fmu check' says more") from error
    return _solution(problem, result, chosen, time.perf_counter() - begun)


def _problem(description: Any) -> Problem:
    """Describe the variables of an FMU as those of a model."""
    states = [u.variable.derivative for u in description.derivatives if u.variable.derivative is not None]
    names = {v.name for v in states}
    of_states = [_quantity(v, _kind(v.name, names)) for v in states if v.type in NUMERIC]
    rest = [v for v in description.modelVariables if v.name not in names and not v.dimensions]
    outputs = [_quantity(v, "output") for v in rest if v.causality == "output" and v.type != "String"]
    inputs = [_quantity(v, "input") for v in rest if v.causality == "input" and v.type in NUMERIC]
    coordinates = sum(q.kind == "coordinate" for q in of_states)
    rates = sum(q.kind == "rate" for q in of_states)
    return Problem(
        name=description.modelName,
        doc=description.description or "",
        nq=coordinates,
        nv=rates,
        nx=len(of_states) - coordinates - rates,
        nh=0,
        time=Quantity("time", "time", "s"),
        states=tuple(of_states),
        parameters=(),
        inputs=tuple(inputs),
        discretes=(),
        outputs=tuple(outputs),
        known=(True,) * len(of_states),
        rotations=(),
        assertions=(),
        experiments=(),
    )


def _kind(name: str, states: set[str]) -> str:
    """Tell coordinates and their rates from other states by their names."""
    if f"der({name})" in states:
        return "coordinate"
    return "rate" if name.startswith("der(") and name[4:-1] in states else "state"


def _quantity(variable: Any, kind: str) -> Quantity:
    unit = variable.unit or ""
    try:
        parse_unit(unit or "1")
    except UnitError:
        unit = ""  # a unit of another tool, which cannot be converted
    display = variable.displayUnit or ""
    try:
        same = bool(unit) and parse_unit(display or "1").dimension == parse_unit(unit).dimension
    except UnitError:
        same = False
    return Quantity(variable.name, kind, unit, display if same else "", doc=variable.description or "")


def _solution(problem: Problem, result: Any, kind: str, seconds: float) -> Solution:
    instants: Array = np.asarray(result["time"], dtype=np.float64)
    names = [q.name for q in (*problem.states, *problem.outputs, *problem.inputs)]
    columns = np.array([[float(v) for v in result[name]] for name in names]).T.reshape(len(instants), -1)

    def at(times: Array) -> Array:
        found = [np.interp(times, instants, column) for column in columns.T]
        return np.array(found).T.reshape(len(times), -1)

    run = Run(
        problem,
        instants,
        columns,
        at,
        interpolation="linear between output points",
        experiment="",
        parameters={},
        outcome=Outcome.COMPLETED,
        message="",
        failure=None,
        statistics=Statistics(f"{KINDS[kind]} by fmpy", len(instants) - 1, None, 0, seconds),
        accuracy=Accuracy(),
    )
    return Solution.of(run, problem, display=Display(), as_stated=False)
