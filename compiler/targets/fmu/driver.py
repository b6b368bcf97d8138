"""An FMU driven call by call through fmpy: what ``simulate_fmu`` hides."""

from __future__ import annotations

import ctypes
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
from fmpy.sundials import CVodeSolver

from mechc.runtime.problem import Array

from .arrays import length

MOST_STEPS = 1_000_000
"""Steps of CVode from one output to the next, after which it gives up."""


@contextmanager
def instance(path: Path, kind: str) -> Iterator[Any]:
    """Load an FMU, instantiate it and clear all away at the end. ``kind``: me or cs."""
    description = fmpy.read_model_description(str(path), validate=False)
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
    description = fmpy.read_model_description(str(path), validate=False)
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


class _Inputs:
    """Inputs that stay as they are, for fmpy's integrator."""

    def apply(self, t: float) -> None:
        """Change nothing."""


def by_cvode(
    path: Path,
    times: Array,
    tolerance: float,
    *,
    may_fail: bool = False,
    events: list[tuple[float, Array]] | None = None,
) -> Array:
    """Return the states at times as CVode integrates a Model Exchange unit, events included.

    ``events`` gets the time of each event, and the states [2, ny] at both sides. Fewer rows where the model ends its run, and up to a failure that is allowed; else it raises FMICallException or
    RuntimeError. ``simulate_fmu`` does the same, but gives up after 500 steps from one output to the next.
    """
    description = fmpy.read_model_description(str(path), validate=False)
    begin, end = float(times[0]), float(times[-1])
    close = 1e-12 * (abs(begin) + abs(end))
    needs_completed = description.modelExchange.needsCompletedIntegratorStep
    nx = description.numberOfContinuousStates
    with instance(path, "me") as fmu:
        two = isinstance(fmu, FMU2Model)
        update = fmu.newDiscreteStates if two else fmu.updateDiscreteStates

        def happen() -> tuple[bool, float]:
            """Go through event mode; return whether the model ends, and the time of its next event."""
            again, ends = True, False
            while again and not ends:
                again, ends, _, _, known, following = update()
            fmu.enterContinuousTimeMode()
            return bool(ends), float(following) if known else np.inf

        def states() -> list[float]:
            values = (ctypes.c_double * nx)()
            fmu.getContinuousStates(values, nx)
            return list(values)

        initialise(fmu, begin, end)
        ended, following = happen()
        solver = CVodeSolver(
            nx=nx,
            nz=int(description.numberOfEventIndicators or 0),
            get_x=fmu.getContinuousStates,
            set_x=fmu.setContinuousStates,
            get_dx=fmu.getDerivatives if two else fmu.getContinuousStateDerivatives,
            get_z=fmu.getEventIndicators,
            get_nominals=fmu.getNominalsOfContinuousStates,
            set_time=fmu.setTime,
            input=_Inputs(),
            startTime=begin,
            maxStep=(end - begin) / 50,
            relativeTolerance=tolerance,
            maxNumSteps=MOST_STEPS,
        )
        rows = [states()]

        def run() -> None:
            """Add the rows from the second one on."""
            nonlocal ended, following
            time = begin
            for wanted in times[1:]:
                while wanted - time > close and not ended:
                    found, _, time = solver.step(time, min(float(wanted), following))
                    fmu.setTime(time)
                    asked, ended = fmu.completedIntegratorStep() if needs_completed else (False, False)
                    if ended:
                        break
                    if found or asked or following - time <= close:
                        before = states() if events is not None else []
                        fmu.enterEventMode()
                        ended, following = happen()
                        if events is not None:
                            events.append((time, np.array((before, states()))))
                        solver.reset(time)
                if ended:
                    break
                rows.append(states())
            fmu.terminate()

        try:
            run()
        except (FMICallException, RuntimeError):
            if not may_fail:
                raise
    return np.array(rows)
