"""What targets answer: a model written as code, run where it was written, and its motion read back."""

from __future__ import annotations

import csv
import json
import shutil
import subprocess
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..fmu.export import FmuOptions, export_fmu
from ..fmu.run import Order, simulated
from ..requests.parse_values import UsageMistake
from ..runtime.ensembles.batches import COMPLETED, TERMINATED
from ..runtime.native.build import find_compiler
from ..runtime.outcome import SimulationError

if TYPE_CHECKING:
    from ..api import Model
    from ..runtime.problem import Array

ROWS = 101
"""Rows that are asked of a Python module."""
TARGETS = ("c", "python", "fmu", "web", "ensemble")

PAGE_IN_NODE = """
const text = require('fs').readFileSync(process.argv[1], 'utf8');
const unpack = new Function(/<script>\\n([^]*?)<[/]script>/.exec(text)[1] + '; return unpack;')();
const told = async packed => JSON.parse(new TextDecoder().decode(await unpack(packed)));
const parts = JSON.parse(/\\nbegin[(](.*)[)];\\n/.exec(text)[1]);
(async () => {
  const {engine} = await told(parts.scripts), info = await told(parts.info);
  const makeEngine = new Function(engine + '; return makeEngine;')();
  const made = await makeEngine(await unpack(parts.wasm), info);
  const {failed, n, ny, nOut, t, y, out} = made.run({}), rows = [];
  for (let i = 0; i < n; i++) rows.push([t[i], ...y.slice(i * ny, (i + 1) * ny), ...out.slice(i * nOut, (i + 1) * nOut)]);
  console.log(JSON.stringify({failed, names: ['time', ...[...info.states, ...info.outputs].map(s => s.name)], rows}));
})();
"""
"""Runs the model of a page as the page does, without what is drawn, and prints its rows."""

Answer = Mapping[str, "Array"]
"""The values of each quantity by name, in SI, at the times of ``time``."""


class NotTried(Exception):
    """What cannot be run here, and why."""


def answer_of(target: str, model: Model, names: list[str], seconds: float) -> Answer:
    """Return the motion that a target gives for the default experiment; an ensemble gives what is named. Raises SimulationError and UsageMistake where it refuses,
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
    return _columns(
        [name.rpartition(" [")[0] or name for name in head], [list(map(float, row)) for row in rows]
    )


def _by_python(model: Model, _names: list[str], folder: Path, _seconds: float) -> Answer:
    (file,) = model.compile("python", folder / "module.py")
    module: dict[str, Any] = {"__name__": "module"}
    exec(file.read_text(encoding="utf-8"), module)
    try:
        with np.errstate(all="ignore"):  # branches that are not taken
            return dict(module["simulate"](points=ROWS))
    except (RuntimeError, ArithmeticError, ValueError) as error:
        raise SimulationError(str(error)) from None


def _by_fmu(model: Model, _names: list[str], folder: Path, _seconds: float) -> Answer:
    (file,) = export_fmu(model, folder / "model.fmu", FmuOptions(check=False, kind="cs"))
    result = simulated(Order(file.absolute())).result  # in this process, which is watched itself
    return {name.strip("'"): result[name] for name in result.dtype.names}


def _by_web(model: Model, _names: list[str], folder: Path, seconds: float) -> Answer:
    from ..web.page import page

    node = shutil.which("node")
    if node is None:
        raise NotTried("node runs what is in a page, and was not found")
    file = folder / "page.html"
    file.write_text(page(model), encoding="utf-8")
    try:
        done = subprocess.run(
            [node, "-e", PAGE_IN_NODE, str(file)],
            capture_output=True,
            text=True,
            check=False,
            timeout=seconds,
        )
    except subprocess.TimeoutExpired:
        raise NotTried(f"the page takes longer than {seconds:g} s") from None
    if done.returncode:
        raise SimulationError(done.stderr.strip() or f"the page ends with {done.returncode}")
    told = json.loads(done.stdout)
    if told.get("failed"):
        raise SimulationError(told["failed"])
    return _columns(told["names"], told["rows"])


def _by_ensemble(model: Model, names: list[str], _folder: Path, _seconds: float) -> Answer:
    problem = model.problem()
    start = model.simulate(stop=0, estimate_error=False)
    given = [(q.name, float(start.parameters[q.name])) for q in problem.parameters if q.kind != "idle"]
    given += [
        (q.name, float(start[q.name][0]))
        for q, known in zip(problem.states, problem.known, strict=True)
        if known and q.kind != "account"
    ]
    given = [(name, value) for name, value in given if name not in model.settings]
    if not given:
        raise NotTried("every value of it is set, and an ensemble needs one that varies")
    name, value = given[0]
    kept = [*names, "time"]
    try:
        found = model.ensemble({name: [value]}, keep=kept, lanes="on")
    except SimulationError:  # the model can have none: then members run as the run does
        found = model.ensemble({name: [value]}, keep=kept, lanes="off")
    if found.outcomes[0] not in (COMPLETED, TERMINATED):
        raise SimulationError(found.texts[0] if found.texts else "the member does not complete")
    return {name: found[name][0] for name in kept}


def _columns(names: list[str], rows: list[list[float]]) -> Answer:
    return dict(zip(names, np.array(rows, dtype=float).reshape(-1, len(names)).T, strict=True))


_ASKED: Mapping[str, Callable[[Model, list[str], Path, float], Answer]] = {
    "c": _by_c,
    "python": _by_python,
    "fmu": _by_fmu,
    "web": _by_web,
    "ensemble": _by_ensemble,
}

REFUSALS = (SimulationError, UsageMistake)
