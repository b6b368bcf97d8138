"""Run an FMU through fmpy, also that of another tool, and show it like a run of a model."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import fmpy
import numpy as np
from fmpy.simulation import simulate_fmu
from msgspec import Struct

from ..compiler.targets.fmu.archive import archive_findings
from ..compiler.targets.fmu.arrays import element_names, flattened
from ..compiler.targets.fmu.inspect import KINDS, kinds_of
from ..compiler.targets.fmu.table import BETWEEN_ROWS
from ..lang.units import UnitError, parse_unit
from ..requests.input_tables import factor_of
from ..requests.parse_values import UsageMistake, read_value_of, unknown_name
from ..requests.tables import TableFile, absolute, sheet_of_file
from ..runtime.inputs import Table, derivatives, read_tables
from ..runtime.integrate.trajectory import Statistics
from ..runtime.interface import Quantity
from ..runtime.outcome import Outcome, SimulationError
from ..runtime.problem import Array, Problem
from ..runtime.results.accuracy import Accuracy, Judged, Verdict
from ..runtime.results.evaluate import Columns
from ..runtime.results.solution import Motion
from ..solution import Solution
from .guard import Limits, LostProcess, guarded

LONGEST_RUN = 600.0
"""Seconds."""


class Order(Struct, frozen=True):
    """What is to be run."""

    path: Path
    kind: str | None = None
    stop: float | None = None
    every: float | None = None
    values: Mapping[str, str] = {}
    inputs: Mapping[str, str | TableFile] = {}


class Simulated(Struct, frozen=True):
    """What fmpy gave: its structured array, with the variables described; ``stop``: where the run was to end, if that is known."""

    problem: Problem
    result: Any
    kind: str
    seconds: float
    stop: float | None


def run_fmu(
    path: Path,
    *,
    kind: str | None = None,
    stop: float | None = None,
    every: float | None = None,
    values: Mapping[str, str] | None = None,
    inputs: Mapping[str, str | TableFile] | None = None,
    limits: Limits | None = None,
) -> Solution:
    """Simulate an FMU in a process of its own; numbers are in the units of its model description.

    ``inputs``: CSV files by the names of inputs, whose first column is the time; values hold over a
    communication step, and after the last row. ``kind``: me or cs; Co-Simulation where the file has both. ``every``: spacing of the output and, for
    Co-Simulation, the communication step. Raises UsageMistake for a kind, name or file that does not fit, and
    SimulationError where the process of the file crashes or goes beyond its limits.
    """
    limits = limits or Limits(seconds=LONGEST_RUN)
    files = {name: absolute(file) for name, file in (inputs or {}).items()}
    order = Order(path.absolute(), kind, stop, every, values or {}, files)
    with guarded(simulator, limits) as ask:
        reply = ask(order)
    if isinstance(reply, LostProcess):
        raise SimulationError(f"{path} cannot be run: {reply.text}", help=reply.help)
    return _solution(reply)


def simulator() -> Callable[[Order], Simulated]:
    """Return what simulates a file in the process that calls it."""
    return simulated


def simulated(order: Order) -> Simulated:
    """Simulate a file in this process. Raises UsageMistake."""
    path = order.path
    unfit = archive_findings(path)
    if unfit:
        raise UsageMistake(f"{path} is not an FMU that can be unpacked: {unfit[0].text}")
    try:
        description = fmpy.read_model_description(str(path), validate=False)
        kinds = kinds_of(description)
        problem = _problem(description)
    except Exception as error:  # fmpy raises plain exceptions of many kinds for a file that is wrong
        raise UsageMistake(f"{path} is not an FMU: {error}", "'mechc fmu check' says more") from None
    chosen = order.kind or ("cs" if "cs" in kinds else kinds[0] if kinds else "")
    if chosen not in kinds:
        raise UsageMistake(
            f"{path} has no {KINDS.get(chosen, 'kind that can be run')}",
            f"it has {' and '.join(KINDS[k] for k in kinds)}" if kinds else "",
        )
    known = {
        v.name: v for v in description.modelVariables if v.causality in ("parameter", "input") or v.start
    }
    starts: dict[str, str | float] = {}
    for name, text in order.values.items():
        if name not in known:
            raise unknown_name("variable that can be set", name, known)
        starts[name] = _start(known[name], text)
    signals = input_signals(description, order.inputs)
    columns = {v.name for v in _shown(description)}
    begun = time.perf_counter()
    try:
        result = simulate_fmu(
            str(path),
            fmi_type=KINDS[chosen],
            stop_time=order.stop,
            output_interval=order.every,
            start_values=starts,
            input=signals,
            output=sorted(columns),
            early_return_allowed=True,
            validate=False,
        )
    except MemoryError:
        raise
    except Exception as error:  # the same, for a binary that refuses
        raise UsageMistake(f"{path} cannot be run: {error}", "'mechc fmu check' says more") from None
    stated = description.defaultExperiment.stopTime if description.defaultExperiment else None
    stop = order.stop if order.stop is not None else float(stated) if stated is not None else None
    return Simulated(problem, result, chosen, time.perf_counter() - begun, stop)


WITHIN_A_ROW = 16
"""Places of a spline that fmpy is given for each of its rows."""


def input_signals(description: Any, files: Mapping[str, str | TableFile]) -> Any:
    """Return the tables of inputs as fmpy takes them, in the units of the file; None without any. Raises UsageMistake, SimulationError."""
    if not files:
        return None
    known = {v.name: v for v in description.modelVariables if v.causality == "input"}
    tables: dict[str, Table] = {}
    for name, file in files.items():
        if name not in known:
            raise unknown_name("input", name, known)
        if known[name].type not in ("Real", "Float32", "Float64") or known[name].dimensions:
            raise UsageMistake(f"'{name}' is not a single real number, so no table drives it")

        def convert(column: str, unit: str, own: str = known[name].unit or "1") -> float:
            try:
                there = float(parse_unit(own).factor) if unit and column != "time" else 1.0
                return factor_of("", column, "s" if column == "time" else own, unit) / there
            except UnitError:
                raise SimulationError(
                    f"the file has '{column}' in {own}, which is not a unit that is known"
                ) from None
            except UsageMistake as mistake:
                raise SimulationError(mistake.message, help=mistake.help) from None

        rates = [f"der({name})", f"der({name},2)"]
        drives = known.keys() >= set(rates) and not files.keys() & set(rates)
        kind = "spline" if drives else _interpolation(known[name].description or "")
        tables |= read_tables(sheet_of_file(file).without_repeats(), {name: kind}, convert, column=name)
        if drives:  # as 'mechc run' has them
            tables |= zip(rates, derivatives(tables[name]), strict=True)
    times = np.unique(np.concatenate([table.times for table in tables.values()]))
    if any(
        table.interpolation == "spline" for table in tables.values()
    ):  # fmpy draws straight lines between rows
        between = np.linspace(0, 1, WITHIN_A_ROW, endpoint=False)
        times = np.append((times[:-1, None] + np.diff(times)[:, None] * between).ravel(), times[-1])
    before = {name: _before(table, times) for name, table in tables.items()}
    jumps = np.any([before[name] != table(times) for name, table in tables.items()], axis=0)
    first = np.arange(times.size) + np.cumsum(jumps) - jumps  # rows that come before the jump
    rows = np.zeros(
        times.size + int(jumps.sum()), dtype=[("time", np.float64), *((n, np.float64) for n in tables)]
    )
    for name, values in (("time", times), *((name, table(times)) for name, table in tables.items())):
        rows[name][first + jumps] = values
        rows[name][first] = before.get(name, times)
    return rows


def _interpolation(description: str) -> str:
    """Return how a model says, in the description of an input, that tables of it are read."""
    _, _, words = description.partition(f"({BETWEEN_ROWS}")
    kind = words.partition(")")[0]
    return kind if kind in ("step", "spline") else "linear"


def _before(table: Table, times: Array) -> Array:
    """Return the values of a table just before times, which are others than at them where it jumps."""
    values = table(times)
    if table.interpolation == "spline" or table.times.size == 1:
        return values
    row = np.minimum(np.searchsorted(table.times, times), table.times.size - 1)  # the first at these times
    at = (row > 0) & (table.times[row] == times)
    return np.where(at, table.values[np.maximum(row - (table.interpolation == "step"), 0)], values)


def _start(variable: Any, text: str) -> str | float:
    """Return a value as fmpy takes it: a number in the unit of the file. Raises UsageMistake."""
    if variable.type not in ("Real", "Float32", "Float64") or variable.dimensions:
        return text
    value = read_value_of(variable.name, text)
    try:
        unit = parse_unit(variable.unit or "1")
    except UnitError:
        unit = None
    if not value.single or (value.unit and (unit is None or unit.dimension != value.unit.dimension)):
        raise UsageMistake(f"'{variable.name}' takes one number in {variable.unit or '1'}, not '{text}'")
    factor = float(value.unit.factor / unit.factor) if value.unit and unit else 1.0
    return value.numbers[0] * factor


def _problem(description: Any) -> Problem:
    """Describe the variables of an FMU as those of a model."""
    states = {id(s) for s in _states(description)}
    names = {name for v in _states(description) for name in element_names(v.name, v.shape or ())}
    of_states: list[Quantity] = []
    outputs: list[Quantity] = []
    inputs: list[Quantity] = []
    for v in _shown(description):
        for name in element_names(v.name, v.shape or ()):
            if id(v) in states:
                of_states.append(_quantity(v, name, _kind(name, names)))
            else:
                (inputs if v.causality == "input" else outputs).append(_quantity(v, name, v.causality))
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


def _states(description: Any) -> list[Any]:
    return [u.variable.derivative for u in description.derivatives if u.variable.derivative is not None]


def _shown(description: Any) -> list[Any]:
    """Return the variables to show: states, then outputs and inputs."""
    states = _states(description)
    known = {id(v) for v in states}
    rest = [
        v for v in description.modelVariables if id(v) not in known and v.causality in ("input", "output")
    ]
    return [v for v in (*states, *rest) if v.type not in ("String", "Binary", "Clock")]


def _kind(name: str, states: set[str]) -> str:
    """Tell coordinates and their rates from other states by their names."""
    if f"der({name})" in states:
        return "coordinate"
    return "rate" if name.startswith("der(") and name[4:-1] in states else "state"


def _quantity(variable: Any, name: str, kind: str) -> Quantity:
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
    return Quantity(name, kind, unit, display if same else "", doc=variable.description or "")


def _solution(made: Simulated) -> Solution:
    problem, result = made.problem, made.result
    instants: Array = np.asarray(result["time"], dtype=np.float64)
    names = [q.name for q in (*problem.states, *problem.outputs, *problem.inputs)]
    found = flattened(result)
    columns = np.array([found[name] for name in names]).T.reshape(len(instants), -1)

    last = float(instants[-1])
    ended = made.stop is not None and last < made.stop * (1 - 1e-9)
    outcome = Outcome.TERMINATED if ended else Outcome.COMPLETED
    message = f"the FMU ended the run at {last:.10g}, before {made.stop:g}" if ended else ""

    def at(times: Array) -> Array:
        values = [np.interp(times, instants, column) for column in columns.T]
        return np.array(values).T.reshape(len(times), -1)

    motion = Motion(
        problem,
        instants,
        Columns(problem, instants, columns),
        at,
        interpolation="linear between output points",
        experiment="",
        parameters={},
        statistics=Statistics(f"{KINDS[made.kind]} by fmpy", len(instants) - 1, None, 0, made.seconds),
        judged=Judged(Verdict(outcome, message, None, Accuracy())),
    )
    return Solution(motion)
