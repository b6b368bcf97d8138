"""An FMU driven call by call through fmpy: what ``simulate_fmu`` hides."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import fmpy
import numpy as np
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import FMU2Model, FMU2Slave, fmi2Discard, fmi2Terminated
from fmpy.fmi3 import FMU3Model, FMU3Slave
from fmpy.simulation import simulate_fmu

from mechc.runtime.problem import Array

from .arrays import element_names, flattened, length

REFINED = (1, 10, 100, 1000)
"""Parts of an output interval: CVode gives up after 500 steps from one output to the next."""


@contextmanager
def instance(path: Path, kind: str) -> Iterator[Any]:
    """Load an FMU, instantiate it and clear all away at the end. ``kind``: me or cs."""
    description = fmpy.read_model_description(str(path))
    folder = fmpy.extract(str(path))
    two = description.fmiVersion.startswith("2")
    classes = {
        (True, "me"): FMU2Model,
        (True, "cs"): FMU2Slave,
        (False, "me"): FMU3Model,
        (False, "cs"): FMU3Slave,
    }
    part = description.modelExchange if kind == "me" else description.coSimulation
    fmu = classes[two, kind](
        guid=description.guid,
        unzipDirectory=folder,
        modelIdentifier=part.modelIdentifier,
        instanceName="checked",
    )
    try:
        fmu.instantiate()
        try:
            yield fmu
        finally:
            fmu.freeInstance()
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def initialise(fmu: Any, start: float, stop: float | None = None, tolerance: float | None = None) -> None:
    """Take an instance through initialisation."""
    if isinstance(fmu, FMU2Model | FMU2Slave):
        fmu.setupExperiment(startTime=start, stopTime=stop, tolerance=tolerance)
        fmu.enterInitializationMode()
    else:
        fmu.enterInitializationMode(startTime=start, stopTime=stop, tolerance=tolerance)
    fmu.exitInitializationMode()


def numbers(fmu: Any, references: list[int], count: int | None = None) -> list[float]:
    """Get the values of variables; ``count`` of them where arrays are among them."""
    if isinstance(fmu, FMU2Model | FMU2Slave):
        return [float(v) for v in fmu.getReal(references)]
    return [float(v) for v in fmu.getFloat64(references, nValues=count)]


def do_step(fmu: Any, begin: float, step: float) -> bool:
    """Make a step; return whether the model has ended the simulation."""
    if isinstance(fmu, FMU3Slave):
        _, ended, _, _ = fmu.doStep(currentCommunicationPoint=begin, communicationStepSize=step)
        return bool(ended)
    try:
        fmu.doStep(currentCommunicationPoint=begin, communicationStepSize=step)
    except FMICallException as failure:
        if failure.status == fmi2Discard and fmu.getBooleanStatus(fmi2Terminated):
            return True
        raise
    return False


def co_simulation(path: Path, times: Array, step: float) -> Array:
    """Return the states at the given times, with a step of size ``step`` from each to the next."""
    description = fmpy.read_model_description(str(path))
    states = [unknown.variable.derivative.valueReference for unknown in description.derivatives]
    count = sum(length(unknown.variable) for unknown in description.derivatives)
    with instance(path, "cs") as fmu:
        initialise(fmu, float(times[0]))
        rows = [numbers(fmu, states, count)]
        for begin in times[:-1]:
            ended = do_step(fmu, float(begin), step)
            rows.append(numbers(fmu, states, count))
            if ended:
                break
        fmu.terminate()
    return np.array(rows)


def by_cvode(path: Path, times: Array, step: float, tolerance: float) -> Array:
    """Return the states at even times as CVode integrates a Model Exchange unit, events included.

    Fewer rows where the model ends its run.
    """
    description = fmpy.read_model_description(str(path))
    states = [unknown.variable.derivative for unknown in description.derivatives]
    names = [name for v in states for name in element_names(v.name, tuple(v.shape or ()))]
    for parts in REFINED:
        try:
            result = simulate_fmu(
                str(path),
                validate=False,
                fmi_type="ModelExchange",
                start_time=float(times[0]),
                stop_time=float(times[-1]),
                output_interval=step / parts,
                relative_tolerance=tolerance,
                output=[v.name for v in states],
                record_events=False,
            )
            break
        except RuntimeError as error:
            if "mxstep" not in str(error) or parts == REFINED[-1]:
                raise
    columns = flattened(result)
    reached = times[times <= columns["time"][-1] + 1e-9 * step]
    return np.array([np.interp(reached, columns["time"], columns[name]) for name in names]).T
