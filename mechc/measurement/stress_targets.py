"""What targets answer: a model written as code, run where it was written, and its last state read back."""

from __future__ import annotations

import csv
import subprocess
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..fmu.export import FmuOptions, export_fmu
from ..fmu.run import Order, simulated
from ..requests.parse_values import UsageMistake
from ..runtime.native.build import find_compiler
from ..runtime.outcome import SimulationError

if TYPE_CHECKING:
    from ..api import Model

TARGETS = ("c", "python", "fmu", "ensemble")

Answer = Mapping[str, float]
"""The last value of each quantity by name, in SI, and ``time``."""


class NotTried(Exception):
    """What cannot be run here, and why."""


def answer_of(target: str, model: Model, names: list[str], seconds: float) -> Answer:
    """Return the last state that a target gives for the default experiment. Raises SimulationError and UsageMistake where it refuses,
    NotTried."""
    with tempfile.TemporaryDirectory() as folder:
        return _ASKED[target](model, names, Path(folder), seconds)


def _by_c(model: Model, _names: list[str], folder: Path, seconds: float) -> Answer:
    compiler = find_compiler()
    if compiler is None or compiler.in_process:
        raise NotTried("a C program is built by gcc, clang or zig, and none was found")
    model.compile("c", folder)
    sources = sorted(str(path) for path in folder.glob("*.c"))
    program = folder / "program"
    subprocess.run(
        [*compiler.command, "-O1", "-o", program, *sources, "-lm"], check=True, capture_output=True
    )
    try:
        done = subprocess.run([program], capture_output=True, text=True, check=False, timeout=seconds)
    except subprocess.TimeoutExpired:
        raise NotTried(f"the C program takes longer than {seconds:g} s") from None
    if done.returncode:
        raise SimulationError(done.stderr.strip() or f"the C program ends with {done.returncode}")
    head, *rows = csv.reader(done.stdout.splitlines())
    return {name.rpartition(" [")[0] or name: float(x) for name, x in zip(head, rows[-1], strict=True)}


def _by_python(model: Model, _names: list[str], folder: Path, _seconds: float) -> Answer:
    (file,) = model.compile("python", folder / "module.py")
    module: dict[str, Any] = {"__name__": "module"}
    exec(file.read_text(encoding="utf-8"), module)
    try:
        found = module["simulate"](points=3)
    except (RuntimeError, ArithmeticError, ValueError) as error:
        raise SimulationError(str(error)) from None
    return {name: float(values[-1]) for name, values in found.items()}


def _by_fmu(model: Model, _names: list[str], folder: Path, _seconds: float) -> Answer:
    (file,) = export_fmu(model, folder / "model.fmu", FmuOptions(check=False))
    result = simulated(Order(file.absolute())).result  # in this process, which is watched itself
    return {name: float(result[name][-1]) for name in result.dtype.names}


def _by_ensemble(model: Model, names: list[str], _folder: Path, _seconds: float) -> Answer:
    problem = model.problem()
    start = model.simulate(stop=0, estimate_error=False)
    given = [(q.name, float(start.parameters[q.name])) for q in problem.parameters if q.kind != "idle"]
    given += [
        (q.name, float(start[q.name][0]))
        for q, known in zip(problem.states, problem.known, strict=True)
        if known
    ]
    given = [(name, value) for name, value in given if name not in model.settings]
    if not given:
        raise NotTried("every value of it is set, and an ensemble needs one that varies")
    name, value = given[0]
    kept = [f"final({name})" for name in names]
    found = model.ensemble({name: [value]}, keep=kept)
    if found.outcomes[0] != 1:
        raise SimulationError(found.texts[0] if found.texts else "the member does not complete")
    return {name: float(found[text][0]) for name, text in zip(names, kept, strict=True)}


_ASKED: Mapping[str, Callable[[Model, list[str], Path, float], Answer]] = {
    "c": _by_c,
    "python": _by_python,
    "fmu": _by_fmu,
    "ensemble": _by_ensemble,
}

REFUSALS = (SimulationError, UsageMistake)
