"""What ``mechc fmu check`` finds out about any FMU: validity, agreement with its binary, and whether it runs."""

from __future__ import annotations

import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import fmpy
import numpy as np
from fmpy.fmi1 import FMICallException
from fmpy.simulation import simulate_fmu
from msgspec import Struct

from mechc.runtime.problem import Array

from . import driver
from .arrays import element_names, flattened
from .read_description import Finding
from .reference import Deviation, FmuReference, deviation, read_reference
from .rules import check_file

KINDS = {"me": "ModelExchange", "cs": "CoSimulation"}
MOST_PARTS = 10
MOST_STEPS = 100_000
"""Of Euler's method, which is tried."""
TOLERANCE = 1e-8
"""Of the integrator that runs a Model Exchange unit with a reference to be met."""
FINER = 100
"""By which it is divided where they differ."""
BOUND = 1e-3
"""Largest difference to the reference results, over the largest value of each variable."""


class CheckLine(Struct, frozen=True):
    """One row of the table; ``rule`` names the rule of a finding."""

    what: str
    passed: bool
    detail: str = ""
    rule: str = ""


class Report(Struct, frozen=True):
    lines: tuple[CheckLine, ...]

    @property
    def passed(self) -> bool:
        return all(line.passed for line in self.lines)

    @property
    def rules(self) -> frozenset[str]:
        """The rules that are broken."""
        return frozenset(line.rule for line in self.lines if line.rule)


class CheckStage(Struct, frozen=True):
    """A part of a check, which stands alone: the file itself (without a kind), the binary of a kind, a run of it."""

    name: str
    kind: str = ""

    @property
    def what(self) -> str:
        """Name it as its lines do."""
        return f"{KINDS[self.kind]} {self.name}" if self.kind else self.name


class CheckPart(Struct, frozen=True):
    """What a stage found. ``kinds``: what the file has that can be loaded on this machine."""

    lines: tuple[CheckLine, ...]
    kinds: tuple[str, ...] = ()


FILE = CheckStage("model description")

Perform = Callable[[CheckStage], CheckPart]


def inspect(path: Path, *, run: bool = True, perform: Perform | None = None) -> Report:
    """Return the findings for one FMU; a description that is not valid is not run.

    ``perform`` goes through one stage, in this process if it is not given: the library is loaded here.
    """
    perform = perform or (lambda stage: perform_stage(path, stage))
    found = perform(FILE)
    lines = found.lines
    for kind in found.kinds:
        binary = perform(CheckStage("binary", kind)).lines
        lines += binary
        if run and all(line.passed for line in binary):
            lines += perform(CheckStage("run", kind)).lines
    return Report(lines)


def perform_stage(path: Path, stage: CheckStage) -> CheckPart:
    """Go through one stage of the check of a file."""
    match stage.name:
        case "binary":
            description = fmpy.read_model_description(str(path), validate=False)
            return CheckPart(tuple(binary_lines(path, stage.kind, description)))
        case "run":
            return CheckPart(tuple(run_lines(path, stage.kind, read_reference(path, _numbers(path)))))
    problems = check_file(path)
    return CheckPart(tuple(_finding(p) for p in problems)) if problems else described(path)


def described(path: Path) -> CheckPart:
    """Tell what a file holds whose description is valid, and whether it can be loaded here."""
    description = fmpy.read_model_description(str(path), validate=False)
    lines = [CheckLine("model description", True, _described(description))]
    lines.append(CheckLine("platforms", True, ", ".join(_platforms(path)) or "sources only"))
    if fmpy.platform not in fmpy.supported_platforms(str(path)):
        return CheckPart((*lines, CheckLine("binary", True, f"none for {fmpy.platform}: not run")))
    try:
        read_reference(path, _numbers(path))
    except (ValueError, OSError) as error:
        return CheckPart((*lines, CheckLine("reference results", False, str(error), "reference results")))
    return CheckPart(tuple(lines), tuple(kinds_of(description)))


def behaviour(path: Path) -> Report:
    """Return the findings for an FMU whose description is known to be valid, in this process."""
    return inspect(
        path, perform=lambda stage: described(path) if stage == FILE else perform_stage(path, stage)
    )


def _finding(finding: Finding) -> CheckLine:
    return CheckLine("model description", False, finding.text, finding.rule)


def _numbers(path: Path) -> frozenset[str]:
    """Return the names of variables that are numbers, of arrays those of their elements, too: the others are not compared."""
    description = fmpy.read_model_description(str(path), validate=False)
    plain = [v for v in description.modelVariables if v.type not in ("String", "Binary", "Clock")]
    return frozenset(name for v in plain for name in (v.name, *_elements(v)))


def kinds_of(description: Any) -> list[str]:
    """Return the kinds of an FMU among me and cs."""
    parts = {"me": description.modelExchange, "cs": description.coSimulation}
    return [kind for kind, part in parts.items() if part is not None]


def _described(description: Any) -> str:
    kinds = " and ".join(KINDS[kind] for kind in kinds_of(description))
    kinds = kinds or "Scheduled Execution, which is not run"
    tool = f", by {description.generationTool}" if description.generationTool else ""
    return f"{description.modelName}, FMI {description.fmiVersion}, {kinds}{tool}"


def _platforms(path: Path) -> list[str]:
    with zipfile.ZipFile(path) as archive:
        folders = {
            n.split("/")[1] for n in archive.namelist() if n.startswith("binaries/") and n.count("/") > 1
        }
    return sorted(folders)


def binary_lines(path: Path, kind: str, description: Any) -> list[CheckLine]:
    """Compare what the description says with what the binary does: token, event indicators, states."""
    what = f"{KINDS[kind]} binary"
    entered = False
    try:
        with driver.instance(path, kind) as fmu:
            entered = True
            driver.initialise(fmu, 0.0)
            problem = _sizes(fmu, description) if kind == "me" else ""
            rule = "event indicators" if "indicators" in problem else "states" if problem else ""
            return [CheckLine(what, not problem, problem or "it can be instantiated and initialised", rule)]
    except MemoryError:
        raise
    except Exception as error:  # fmpy raises plain exceptions where a binary refuses
        if entered:
            return [CheckLine(what, False, f"it cannot be initialised: {error}", "initialisation")]
        return [
            CheckLine(
                what, False, f"it cannot be instantiated, as with a token of another file: {error}", "token"
            )
        ]


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


def run_lines(path: Path, kind: str, reference: FmuReference | None) -> list[CheckLine]:
    """Simulate the default experiment: all results are finite and, where there is a reference, near to it."""
    what = f"{KINDS[kind]} run"
    try:
        result = simulate(str(path), kind) if reference is None else _as_reference(path, kind, reference)
    except MemoryError:
        raise
    except Exception as error:  # as above, and whatever the integrator raises
        return [CheckLine(what, False, str(error), "run")]
    columns = dict(flattened(result))
    time = columns.pop("time")
    bad = [name for name, values in columns.items() if not np.all(np.isfinite(values))]
    if bad:
        return [CheckLine(what, False, f"'{bad[0]}' is not finite", "run")]
    lines = [CheckLine(what, True, f"to time {time[-1]:g}")]
    found = deviation(reference, time, columns, _units(path)) if reference is not None else None
    if reference is not None and found is not None and kind == "me" and found.size > BOUND:
        found = _of_finer_run(path, reference, found)
    if reference is not None and found is not None:
        near = found.size <= BOUND
        detail = (
            f"largest difference {found.size:.1e} of '{found.name}' at time {found.time:g}, {reference.file}"
        )
        if all(np.ptp(values) == 0 for name, values in reference.columns.items() if name in columns):
            detail += "; nothing changes there, so agreement says little"
        if not near and kind == "me" and (step := _euler_step(path, reference)) is not None:
            near = True
            detail = f"{reference.file} has the motion of Euler's method in steps of {step:g}, which is followed; {detail}"
        lines.append(CheckLine(f"{KINDS[kind]} reference", near, detail, "" if near else "reference results"))
    elif reference is not None:
        lines.append(CheckLine(f"{KINDS[kind]} reference", True, f"nothing in common with {reference.file}"))
    return lines


def _of_finer_run(path: Path, reference: FmuReference, found: Deviation) -> Deviation:
    """Compare once more at a finer tolerance: errors of the integrator that add up, as over many events, become smaller."""
    try:
        columns = dict(flattened(_as_reference(path, "me", reference, TOLERANCE / FINER)))
    except (FMICallException, RuntimeError):  # the integrator gives up there
        return found
    finer = deviation(reference, columns.pop("time"), columns, _units(path))
    return finer if finer is not None and finer.size < found.size else found


def _euler_step(path: Path, reference: FmuReference) -> float | None:
    """Return the step with which Euler's method gives the reference; None where it does not. Reference FMUs are made so."""
    experiment = fmpy.read_model_description(str(path), validate=False).defaultExperiment
    steps = np.diff(reference.time)
    own = [float(experiment.stepSize)] if experiment and experiment.stepSize else []
    shown = float(np.min(steps[steps > 0], initial=np.inf))
    parts = (shown / n for n in (10, 100, 1000))  # of the rows of a reference, tools write only some
    duration = float(np.ptp(reference.time))
    for step in dict.fromkeys((*own, shown, *parts)):
        if not np.isfinite(step) or duration > MOST_STEPS * step:
            continue
        try:
            result = simulate_fmu(
                str(path),
                fmi_type=KINDS["me"],
                start_time=float(reference.time[0]),
                stop_time=float(reference.time[-1]),
                solver="Euler",
                step_size=step,
                output_interval=step,
                output=_known(path, reference),
            )
        except FMICallException:  # what is stiff is not for steps of Euler
            continue
        columns = dict(flattened(result))
        time = columns.pop("time")
        found = deviation(reference, time, columns, _units(path))
        if found is not None and found.size <= BOUND:
            return step
    return None


def _as_reference(path: Path, kind: str, reference: FmuReference, tolerance: float = TOLERANCE) -> Any:
    """Simulate from the start of the default experiment, with outputs at the times of the reference."""
    description = fmpy.read_model_description(str(path), validate=False)
    experiment = description.defaultExperiment
    start = float(experiment.startTime or 0.0) if experiment else 0.0
    times = np.unique([start, *reference.time[reference.time >= start]])
    if len(times) < 2:
        return simulate(str(path), kind)
    step = _common_step(np.diff(times))

    def run(interval: float) -> Any:
        return simulate_fmu(
            str(path),
            fmi_type=KINDS[kind],
            start_time=start,
            stop_time=float(reference.time[-1]),
            output_interval=interval,
            relative_tolerance=tolerance if kind == "me" else None,
            early_return_allowed=True,
            output=_known(path, reference),
        )

    try:
        return run(step)
    except RuntimeError as error:
        if "mxstep" not in str(error):
            raise
        return run(step / 100)  # CVode gives up after 500 steps without an output


def _common_step(steps: Array) -> float:
    """Return a step of which all are multiples, if a part of the shortest one is, else that one."""
    shortest = float(np.min(steps))
    for parts in range(1, MOST_PARTS + 1):
        counts = steps * (parts / shortest)
        if np.all(np.abs(counts - np.round(counts)) < 1e-3):
            return shortest / parts
    return shortest


def _units(path: Path) -> dict[str, str]:
    description = fmpy.read_model_description(str(path), validate=False)
    return {name: v.unit or "" for v in description.modelVariables for name in _elements(v)}


def _elements(variable: Any) -> list[str]:
    return element_names(variable.name, tuple(variable.shape or ()))


def _known(path: Path, reference: FmuReference) -> list[str]:
    """Return the variables of a reference that an FMU has."""
    description = fmpy.read_model_description(str(path), validate=False)
    names = set(reference.columns)
    return [v.name for v in description.modelVariables if names.intersection(_elements(v))]


def simulate(path: str, kind: str, stop: float | None = None) -> Any:
    """Simulate the default experiment through fmpy; return a structured array by variable name."""
    return simulate_fmu(path, fmi_type=KINDS[kind], stop_time=stop, early_return_allowed=True)
