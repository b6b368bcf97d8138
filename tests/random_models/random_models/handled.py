"""An FMU in the hands of an importer: what it says of units, states that are saved and come back, a new beginning, derivatives, inputs that change."""

from __future__ import annotations

from collections.abc import Mapping
from ctypes import POINTER, c_double
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any
from xml.etree import ElementTree
from zipfile import ZipFile

import fmpy
import numpy as np
from fmpy.fmi2 import FMU2Model, FMU2Slave
from scipy.integrate import solve_ivp

from random_models.measures import measured

BENT = 1e-3
"""By how much slopes ahead and behind may differ where there is no kink: by a thousandth of the second derivative."""
STEP = 1e-6
"""Of a value of the size of one; central differences are off by 1e-12 of a third derivative, and by 1e-10 of the values for rounding."""
RELATIVE = 1e-5
LATER, END, COMMUNICATION = 0.2, 0.4, 0.1


def mishandled(unit: Path) -> str:
    """Say what goes wrong with a unit of FMI 2, or nothing."""
    about = fmpy.read_model_description(str(unit))
    with TemporaryDirectory() as folder:
        fmpy.extract(str(unit), folder)
        common = {"guid": about.guid, "unzipDirectory": folder, "instanceName": "i"}
        said = ""
        if about.coSimulation is not None:
            name = about.coSimulation.modelIdentifier
            said = _with(FMU2Slave(modelIdentifier=name, **common), about, _again)
        if not said and about.modelExchange is not None:
            name = about.modelExchange.modelIdentifier
            said = _with(FMU2Model(modelIdentifier=name, **common), about, _derivatives)
        return said


def misdescribed(unit: Path) -> str:
    """Say which unit of measurement is described wrongly, by its definition, or nothing."""
    with ZipFile(unit) as file:
        root = ElementTree.fromstring(file.read("modelDescription.xml"))
    for one in root.iter("Unit"):
        name, base = one.get("name", ""), one.find("BaseUnit")
        try:
            size, exponents = measured(name)
            told = {q: float(base.get(q, 0)) for q in ("kg", "m", "s", "A")} if base is not None else {}
            wrong = base is not None and [*told.values()] != [float(x) for x in exponents]
            if wrong or (base is not None and abs(float(base.get("factor", 1)) / size - 1) > 1e-12):
                return f"the unit {name} is {size} of {told} here: {ElementTree.tostring(one)!r}"
            for shown in one.iter("DisplayUnit"):
                factor, there = float(shown.get("factor", 1)), measured(shown.get("name", ""))
                if there[1] != exponents or abs(factor * there[0] / size - 1) > 1e-12:
                    return f"{shown.get('name')} for {name} has the factor {factor}, {size / there[0]} by definition"
        except (KeyError, StopIteration):  # no unit that is known here
            continue
    return ""


def pushed(
    unit: Path,
    ramps: Mapping[str, tuple[float, float]],
    values: Mapping[str, float],
    watched: Mapping[str, str],
) -> dict[str, Any]:
    """Integrate the Model Exchange unit of a motion without events whose inputs change evenly over a second.

    fmpy holds inputs between the steps of its solver. ``watched``: the variables, by the names that a run has.
    """
    about = fmpy.read_model_description(str(unit))
    numbers = {v.name: v.valueReference for v in about.modelVariables}
    inputs = [numbers[n] for n in ramps]
    grid = np.linspace(0, 1, 11)
    rows = {name: np.empty(len(grid)) for name in watched}

    def look(fmu: Any, _: Any) -> str:
        fmu.setupExperiment(startTime=0.0, tolerance=1e-8)
        fmu.enterInitializationMode()
        fmu.setReal([numbers[n] for n in values], list(values.values()))
        fmu.setReal(inputs, [first for first, _ in ramps.values()])
        fmu.exitInitializationMode()
        for _ in range(10):
            if not fmu.newDiscreteStates()[0]:
                break
        fmu.enterContinuousTimeMode()
        x, dx = np.zeros(len(about.derivatives)), np.zeros(len(about.derivatives))
        fmu.getContinuousStates(_pointer(x), len(x))

        def put(t: float, y: Any) -> None:
            fmu.setTime(t)
            fmu.setReal(inputs, [first + (last - first) * t for first, last in ramps.values()])
            fmu.setContinuousStates(_pointer(np.ascontiguousarray(y)), len(x))

        def rates(t: float, y: Any) -> Any:
            put(t, y)
            fmu.getDerivatives(_pointer(dx), len(x))
            return dx.copy()

        sizes = np.array([float(d.variable.derivative.nominal or 1) for d in about.derivatives])
        found = solve_ivp(
            rates,
            (0.0, 1.0),
            x,
            method="DOP853",
            t_eval=grid,
            rtol=1e-9,
            atol=1e-9 * np.minimum(sizes, 1.0),
            max_step=0.05,
        )
        for k, t in enumerate(found.t):
            put(float(t), found.y[:, k])
            for name, here in watched.items():
                rows[name][k] = fmu.getReal([numbers[here]])[0]
        return ""

    with TemporaryDirectory() as folder:
        fmpy.extract(str(unit), folder)
        name = about.modelExchange.modelIdentifier
        _with(
            FMU2Model(modelIdentifier=name, guid=about.guid, unzipDirectory=folder, instanceName="i"),
            about,
            look,
        )
    return {"time": grid, **rows}


def _pointer(x: Any) -> Any:
    return x.ctypes.data_as(POINTER(c_double))


def _with(fmu: Any, about: Any, look: Any) -> str:
    fmu.instantiate()
    try:
        said: str = look(fmu, about)
        fmu.terminate()
        return said
    finally:
        fmu.freeInstance()


def _begin(fmu: Any) -> None:
    fmu.setupExperiment(startTime=0.0, tolerance=1e-8)
    fmu.enterInitializationMode()
    fmu.exitInitializationMode()


def _watched(about: Any) -> list[int]:
    """Return the references of all real numbers that change."""
    return [
        v.valueReference
        for v in about.modelVariables
        if v.type == "Real" and v.causality in ("output", "local") and v.variability != "fixed"
    ]


def _ran(fmu: Any, first: float, watched: list[int]) -> Any:
    """Step to the end; return the values at all communication points."""
    rows = []
    for k in range(round(first / COMMUNICATION), round(END / COMMUNICATION)):
        fmu.doStep(currentCommunicationPoint=k * COMMUNICATION, communicationStepSize=COMMUNICATION)
        rows.append(fmu.getReal(watched))
    return np.array(rows)


def _again(fmu: Any, about: Any) -> str:
    """Say how values differ after a saved state has come back, and after a new beginning: not in one bit."""
    watched = _watched(about)
    _begin(fmu)
    first = _ran(fmu, 0.0, watched)
    fmu.reset()
    _begin(fmu)
    for k in range(round(LATER / COMMUNICATION)):
        fmu.doStep(currentCommunicationPoint=k * COMMUNICATION, communicationStepSize=COMMUNICATION)
    saved = fmu.getFMUState()
    second = _ran(fmu, LATER, watched)
    fmu.setFMUState(saved)
    third = _ran(fmu, LATER, watched)
    fmu.freeFMUState(saved)
    n = len(second)
    names = {v.valueReference: v.name for v in about.modelVariables}
    for what, one, other in (("a new beginning", first[-n:], second), ("a saved state", second, third)):
        off = ~((one == other) | (np.isnan(one) & np.isnan(other)))
        if off.any():
            k = int(np.flatnonzero(off.any(axis=0))[0])
            return f"{names[watched[k]]} after {what}: {other[:, k]}, before {one[:, k]}"
    return ""


def _derivatives(fmu: Any, about: Any) -> str:
    """Say how the derivatives that a unit offers differ from differences, at a state next to its start."""
    _begin(fmu)
    for _ in range(10):
        if not fmu.newDiscreteStates()[0]:
            break
    fmu.enterContinuousTimeMode()
    numbers = {v.name: v.valueReference for v in about.modelVariables}
    rates = [numbers[d.variable.name] for d in about.derivatives]
    states = [numbers[d.variable.derivative.name] for d in about.derivatives]
    outputs = [
        v.valueReference
        for v in about.modelVariables
        if v.type == "Real" and v.causality == "output" and v.variability == "continuous"
    ]
    inputs = [v.valueReference for v in about.modelVariables if v.type == "Real" and v.causality == "input"]
    asked, by = rates + outputs, states + inputs
    if not by:
        return ""
    rng = np.random.default_rng(len(about.modelVariables))
    seed = rng.standard_normal(len(by))
    fmu.setTime(0.0123)
    x = np.array(fmu.getReal(by))
    told = np.array(fmu.getDirectionalDerivative(asked, by, list(seed)))

    def at(values: Any) -> Any:
        there = np.ascontiguousarray(values[: len(states)])
        fmu.setContinuousStates(_pointer(there), len(states))
        fmu.setReal(inputs, list(values[len(states) :]))
        return np.array(fmu.getReal(asked))

    size = 1 + float(np.max(np.abs(x), initial=0.0))
    two = [(at(x + h * seed) - at(x - h * seed)) / (2 * h) for h in (STEP * size, STEP * size / 2)]
    h, here = STEP * size, at(x)
    ahead, behind = (at(x + h * seed) - here) / h, (here - at(x - h * seed)) / h
    known = np.abs(two[0] - two[1]) <= RELATIVE * (1 + np.abs(two[1]))  # not too steep
    known &= np.abs(ahead - behind) <= BENT * (1 + np.abs(two[1]))  # no kink
    off = np.abs(told - two[1]) > 10 * RELATIVE * (1 + np.abs(two[1])) + 10 * np.abs(two[0] - two[1])
    wrong = np.flatnonzero(known & off & np.isfinite(two[1]))
    if not len(wrong):
        return ""
    names = {v.valueReference: v.name for v in about.modelVariables}
    k = wrong[0]
    return f"the derivative of {names[asked[k]]} is {told[k]:.9g}, {two[1][k]:.9g} by differences"
