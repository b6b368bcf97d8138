"""Checks of a finished FMU: validation by fmpy, simulation by fmpy, and comparison with the run of this compiler."""

from __future__ import annotations

import tempfile
from dataclasses import dataclass, replace
from pathlib import Path

import fmpy
import numpy as np

from mechc.lang.diagnostics import CompileError, Reporter
from mechc.runtime import native
from mechc.runtime.functions import load_functions
from mechc.runtime.problem import Array
from mechc.runtime.solver import FIRST_EVENTS, Solver

from .arrays import element_names
from .driver import co_simulation
from .export import Package
from .inspect import run_lines
from .reference import Reference, read_reference
from .rules import check_file
from .variables import Start

POINTS = 47
"""A prime: events at round times, where states jump, lie between two points."""


@dataclass(frozen=True, slots=True)
class Made:
    """A finished FMU with what it was made for; ``kinds``: me, cs."""

    package: Package
    start: Start
    method: str
    kinds: tuple[str, ...]


def check_package(made: Made) -> None:
    """Raise CompileError if an FMU is not valid or does not move as the native run does.

    Co-Simulation must give the bits of the native solver that stops at the same times. An FMU without a binary
    for this machine is validated only.
    """
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "model.fmu"
        path.write_bytes(made.package.data)
        problems = check_file(path)
        if problems:
            raise _failed("it is not valid: " + "; ".join(p.text for p in problems))
        if fmpy.platform in fmpy.supported_platforms(str(path)):
            _check_motion(path, made)


def _failed(reason: str) -> CompileError:
    return Reporter().fail(
        "",
        f"the FMU fails its check and was not written: {reason}",
        None,
        help="--no-check writes it all the same, for a look at it",
    )


def _check_motion(path: Path, made: Made) -> None:
    start = made.start
    if start.case.stop <= start.case.begin:
        return
    times, step, reference = native_points(start, made.method, POINTS)
    if "cs" in made.kinds:
        found = co_simulation(path, times, step)
        if not np.array_equal(found, reference):
            raise _failed("Co-Simulation does not give the same motion as the native run")
    if "me" in made.kinds:
        wanted = read_reference(path) or _early(path, times, reference)
        for line in run_lines(path, "me", wanted):
            if not line.passed:
                raise _failed(f"{line.what}: {line.detail}")


def _early(path: Path, times: Array, states: Array) -> Reference:
    """Return the first tenth of the native run as a reference: another integrator follows that far."""
    description = fmpy.read_model_description(str(path))
    variables = [unknown.variable.derivative for unknown in description.derivatives]
    names = [name for v in variables for name in element_names(v.name, tuple(v.shape or ()))]
    rows = max(2, POINTS // 10)
    return Reference("the native run", times[:rows], dict(zip(names, states[:rows].T, strict=True)))


def native_points(start: Start, method: str, count: int) -> tuple[Array, float, Array]:
    """Return times, their spacing, and the states of the native run, made to stop at each of the times.

    Where the model ends the run, that is the last time.
    """
    # output within steps would make the solver take shorter ones
    case = replace(start.case, grid=start.case.grid[:1])
    step = (case.stop - case.begin) / count
    times = [case.begin]
    for _ in range(count):
        times.append(times[-1] + step)
    kernel, functions = native.load_kernel(True), load_functions(start.problem)
    # without events nothing happens at the start
    rows = [] if start.problem.hybrid else [case.y0.copy()]
    with Solver(
        kernel, functions, case, method, case.tolerance, case.tolerance * start.nominal, case.step or 0.0
    ) as solver:
        for t in times[len(rows) :]:
            status = native.RUNNING
            while status in (native.RUNNING, native.EVENTS_FULL):
                if status == native.EVENTS_FULL:
                    solver.start_events(FIRST_EVENTS)
                status = solver.advance(t, 10000)
            if status not in (native.REACHED, native.TERMINATED):
                raise _failed(f"the native run it is compared with fails at time {solver.report()[0].t:g}")
            rows.append(solver.report()[1].copy())
            if status == native.TERMINATED:
                times[len(rows) - 1 :] = [solver.report()[0].t]
                break
    return np.array(times), step, np.array(rows)
