"""The same motion from what mechc exports: a Python module, a C program, and FMUs of both versions and kinds."""

from __future__ import annotations

import csv
import hashlib
import re
import shutil
import subprocess
import warnings
from collections.abc import Callable, Collection
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import fmpy
import numpy as np

import mechc
from mechc.fmu.export import FmuOptions, export_fmu
from mechc.runtime.outcome import Outcome
from random_models.compiled import Refused, prepared
from random_models.definition import SKIPPED
from random_models.handled import misdescribed, mishandled, pushed
from random_models.motions import Edged, asked, columns, errors, nowhere, run

RELATIVE = 1e-4
"""Programs have one method each, at a tolerance of 1e-8 and 1e-6: a hundred times the looser of both."""
OBJECTS = Path(__file__).resolve().parents[3] / "build" / "random_models" / "objects"
"""Compiled files of exported C programs, as far as they are the kernel's."""
_INCLUDE = re.compile(r'^[ \t]*#[ \t]*include[ \t]*"([^"]+)"', re.M)
_FOLLOWED = re.compile(r"coordinate Length q\d+ = [\d.]+\*(q\d+);")
"""A start that follows another."""
_NUMBER = re.compile(
    r"parameter (?:[A-Z]\w* )?(p\d+)(?:\([^)]*\))? = -?[\d.]+(?:e-?\d+)?(?: [^\s;*]+)?(?: \"[^\"]*\")?;"
)
"""A parameter that is a number."""
_BEGINNING = re.compile(r"(?:coordinate|state|initial) [^;=]*= -?(?:2\*)?(p\d+)[;^ ]")
"""A start that is a parameter, or nearly."""
_STEPPED = re.compile(r'\binput (?:\w+ )?(\w+)\(interpolation = "step"\)')
"""An input that steps from row to row."""
_MANY = "mxstep steps taken"
KERNEL = {f.name for f in (Path(mechc.__file__).parents[1] / "runtime" / "kernel").rglob("*.c")}


def exported(
    text: str,
    *,
    units: bool,
    edges: Callable[[Any], Edged] = lambda _: nowhere,
    sizes: Collection[str] = (),
) -> list[tuple[str, str]]:
    """List (what, how it differs from the run) of the programs that a model is exported to, or of its FMUs (``units``).

    ``edges`` tells of a run where outputs may jump; ``sizes`` are states that are compared over their own size.
    """
    model = mechc.loads(text).for_experiment(None)
    given = _given(model, text) if units else {}
    # another start is not a size of theirs
    own = _told(model, text, units=True) if units and not sizes else {}
    if own and len(text) % 2:
        text = _set_otherwise(model, text, own)
    if own.keys() & set(_BEGINNING.findall(text)):  # the start is found anew for it alone
        given = {}
    try:
        native = run(text, values=given | own)
    except Refused:  # of a start that something else decides
        own = {}
        native = run(text, values=given)
    if str(native.outcome) != "Outcome.COMPLETED":
        return []
    found: list[tuple[str, str]] = []
    with TemporaryDirectory() as folder, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        here = Path(folder)
        if units:
            return _units(text, native, here, given, own, sizes)
        if _drives_by_inputs(model):
            return []
        if native.events == () or not native.events:
            found += _said("python", native, _python(model, here, {}, native), edges(native), sizes)
            found += [] if sizes else _with_parameters(model, text, here)
        found += _said("c", native, _program(model, here), edges(native), sizes)
    return found


def _drives_by_inputs(model: Any) -> bool:
    """Whether inputs drive, the rates of which no program is told, as it says."""
    names = {q.name for q in model.problem(quick=True).inputs}
    return any(f"der({name})" in names for name in names)


def _with_parameters(model: Any, text: str, here: Path) -> list[tuple[str, str]]:
    """Compare a Python module that is given a parameter or a start with the run that is given it, of two models of three.

    Of every other of them the experiment sets another value, over which the one from outside counts.
    """
    given = _told(model, text)
    if len(text) % 2:
        text = _set_otherwise(model, text, given)
        model = mechc.loads(text).for_experiment(None)
    try:
        native = run(text, values=given)
    except Refused:
        return []
    if not given or native.events or str(native.outcome) != "Outcome.COMPLETED":
        return []
    return _said("python", native, _python(model, here, given, native))


def _set_otherwise(model: Any, text: str, given: dict[str, float]) -> str:
    """Let the experiment of a text set what is given, too, to other values."""
    problem = model.problem(quick=True)
    units = {q.name: q.unit for q in (*problem.parameters, *problem.states)}
    told = "".join(f", {name} = {_quantity(0.9 * value, units[name])}" for name, value in given.items())
    return re.sub(r"^( *experiment\(.*)\);", rf"\1{told});", text, count=1, flags=re.M)


def _quantity(value: float, unit: str) -> str:
    return f"{value!r}/(1 {unit[2:].strip('()')})" if unit.startswith("1/") else f"{value!r} {unit}".rstrip()


def _said(
    what: str,
    native: Any,
    other: dict[str, Any] | str,
    edged: Edged = nowhere,
    sizes: Collection[str] = (),
) -> list[tuple[str, str]]:
    if isinstance(other, str):
        return [(what, other)] if other else []
    times = other["time"]
    events = [float(e.time) for e in native.events]
    events += [float(t) for t, u in zip(native.time[:-1], native.time[1:], strict=True) if u - t < 1e-9]
    mine = columns(native)
    estimate = max((v for v in errors(native).values() if np.isfinite(v)), default=0.0)
    if estimate > 1e-6:
        return []
    for name, x in mine.items():
        if name not in other or x.ndim != 1:
            continue
        y = other[name]
        scale = (0 if name in sizes else 1) + float(np.max(np.abs(x[np.isfinite(x)]), initial=0.0))
        for t, here in zip(native.time, x, strict=True):
            k = int(np.argmin(np.abs(times - t)))
            if abs(times[k] - t) > 1e-9 or any(abs(t - e) < 1e-3 for e in events) or not np.isfinite(here):
                continue
            if not abs(y[k] - here) <= RELATIVE * scale * (10 if name.startswith("o") else 1):
                if asked(name) and edged(float(t)):
                    continue
                return [(what, f"{name} at {t:.3g}: {here:.9g} run, {y[k]:.9g} {what}")]
    return []


def _table(text: str) -> dict[str, Any]:
    rows = list(csv.reader(text.splitlines()))
    names = [h.split(" [")[0].strip() for h in rows[0]]
    numbers = np.array([[float(v) for v in row] for row in rows[1:] if row])
    return {n: numbers[:, k] for k, n in enumerate(names)}


def _python(model: Any, here: Path, given: dict[str, float], native: Any) -> dict[str, Any] | str:
    """Return the motion of the Python module, from where the run begins."""
    path = here / "m.py"
    try:
        model.compile("python", path)
    except mechc.CompileError as error:
        return f"refused: {mechc.render(error.diagnostics)[:300]}"
    except mechc.UsageMistake:  # a module is told no derivatives of inputs
        return ""
    module: dict[str, Any] = {"__name__": "m"}
    exec(path.read_text(encoding="utf-8"), module)
    parameters = dict(module["PARAMETERS"])
    values = {name: value for name, value in given.items() if name in parameters}
    start = [float(native[name][0]) for name, _ in module["STATES"]]
    try:
        found: dict[str, Any] = module["simulate"](1.0, values, start, points=11, tolerance=1e-9)
    except RuntimeError as error:
        return "" if "the model switches" in str(error) else f"fails: {error}"
    return found


def _program(model: Any, here: Path) -> dict[str, Any] | str:
    model.compile("c", here / "c")
    try:
        objects = [str(_object(f)) for f in sorted((here / "c").rglob("*.c"))]
        _cc(*objects, "-lm", "-o", str(here / "m"))
    except subprocess.CalledProcessError as error:
        return f"does not build: {error.stderr[:300]}"
    ran = subprocess.run(
        [str(here / "m"), "1", "1e-9"], capture_output=True, text=True, timeout=60, check=False
    )
    if ran.returncode:
        return f"fails: {ran.stderr[-300:]}"
    return _table(ran.stdout)


def _object(source: Path) -> Path:
    """Compile one file; those of the kernel are the same for many models, and kept."""
    if source.name not in KERNEL:
        _cc("-O0", "-I", str(source.parent), "-c", str(source), "-o", f"{source}.o")
        return Path(f"{source}.o")
    digest = hashlib.sha256(b"".join(f.read_bytes() for f in _included(source))).hexdigest()
    kept = OBJECTS / f"{digest[:32]}.o"
    if not kept.exists():
        OBJECTS.mkdir(parents=True, exist_ok=True)
        made = source.with_suffix(".o")
        _cc("-O0", "-I", str(source.parent), "-c", str(source), "-o", str(made))
        shutil.move(made, kept)
    return kept


def _included(source: Path) -> list[Path]:
    """Return a file and all that it includes of its folder, directly or not."""
    found = [source]
    for file in found:  # which grows
        inner = (source.parent / name for name in _INCLUDE.findall(file.read_text(encoding="utf-8")))
        found += [f for f in dict.fromkeys(inner) if f not in found and f.exists()]
    return found


def _cc(*words: str) -> None:
    subprocess.run(["cc", *words], capture_output=True, text=True, check=True)


def _given(model: Any, text: str) -> dict[str, float]:
    """Set every other input that has a name of its own, from the first or the second on; the others keep their defaults."""
    return {q.name: 0.35 for q in model.problem(quick=True).inputs[len(text) % 2 :: 2] if "[" not in q.name}


def _parameter(model: Any, text: str, *, units: bool) -> dict[str, float]:
    """Choose a parameter of the model itself, one with which something begins or the last that is declared, and another value for it;
    for ``units`` one that is not a formula."""
    values = prepared(lambda: model, None, text).parameters()
    own = [name for name, value in values.items() if re.fullmatch(r"p\d+", name) and value > 0]
    if units:
        numbers = set(_NUMBER.findall(text))
        own = [name for name in own if name in numbers]
    begins = set(_BEGINNING.findall(text))
    own.sort(key=lambda name: name in begins)
    return {own[-1]: 1.1 * values[own[-1]]} if own else {}


def _beginning(model: Any, text: str) -> dict[str, float]:
    """Choose a coordinate of the model itself, one that others follow or the first that is declared, and another start for it."""
    made = prepared(lambda: model, None, text)
    start = made.start()
    own = [] if made.constrained else [name for name in start if re.fullmatch(r"q\d+", name)]
    followed = set(_FOLLOWED.findall(text))
    own.sort(key=lambda name: name not in followed)
    return {own[0]: start[own[0]] + 0.05} if own else {}


def _told(model: Any, text: str, *, units: bool = False) -> dict[str, float]:
    """Choose what a program is told: of every third model nothing; where starts follow others or parameters, always one of those."""
    kind = 2 if _FOLLOWED.search(text) else 1 if _BEGINNING.search(text) else len(text) % 3
    return ({}, _parameter(model, text, units=units), _beginning(model, text))[kind]


def _units(
    text: str,
    native: Any,
    here: Path,
    given: dict[str, float],
    parameter: dict[str, float],
    sizes: Collection[str],
) -> list[tuple[str, str]]:
    """Export both versions, which checks them, and simulate both kinds by fmpy, which sets some inputs as they go on."""
    found: list[tuple[str, str]] = []
    try:
        export_fmu(mechc.loads(text), here / "u.fmu", FmuOptions(fmi="both"))
    except mechc.CompileError as error:
        if mechc.loads(text).simulate(estimate_error=False).outcome is Outcome.FAILED:
            SKIPPED["an FMU of an experiment that fails"] += 1
            return []
        return [("fmu", f"export fails: {mechc.render(error.diagnostics)[-800:]}")]
    except (mechc.SimulationError, mechc.UsageMistake) as error:
        return [("fmu", f"export fails: {error}")]
    ramps = _ramps(given, text)
    driven = _driven(text, ramps, parameter, here) if ramps else None
    for unit in sorted(here.rglob("*.fmu")):
        watched = _watched(unit, columns(native).keys())
        for kind in ("ModelExchange", "CoSimulation"):
            try:
                result = fmpy.simulate_fmu(
                    str(unit),
                    fmi_type=kind,
                    stop_time=1.0,
                    output_interval=0.1,
                    relative_tolerance=1e-9,
                    solver="CVode",
                    input=_signals(given),
                    start_values=dict(parameter),
                    output=list(watched.values()),
                    step_size=0.1,
                )
            except RuntimeError as error:
                if _MANY in str(error):  # so many steps that the importer itself gives up
                    SKIPPED[f"an FMU in {kind}: the importer gives up"] += 1
                    continue
                raise
            other = {n: np.asarray(result[there]) for n, there in watched.items()}
            other["time"] = np.asarray(result["time"])
            what = f"{unit.parent.name} {kind}"
            found += _said(what, native, other, sizes=sizes)
        if said := misdescribed(unit):
            found.append((f"{unit.parent.name} described", said))
        if unit.parent.name == "fmi2" and (said := mishandled(unit)):
            found.append(("fmi2 handled", said))
        if unit.parent.name == "fmi2" and driven is not None:
            found += _said("fmi2 pushed", driven, pushed(unit, ramps, parameter, watched), sizes=sizes)
    return found


def _ramps(given: dict[str, float], text: str) -> dict[str, tuple[float, float]]:
    """Let inputs that are set change evenly, where all of them may."""
    stepped = set(_STEPPED.findall(text))
    return (
        {}
        if stepped & given.keys()
        else {n: (v, v + 0.1 + 0.05 * k) for k, (n, v) in enumerate(given.items())}
    )


def _driven(text: str, ramps: dict[str, tuple[float, float]], values: dict[str, float], here: Path) -> Any:
    """Return the motion under these inputs, or nothing where it does not come to its end, or has events."""
    units = {q.name: q.unit for q in mechc.loads(text).problem(quick=True).inputs}
    paths = {name: here / f"ramp{k}.csv" for k, name in enumerate(ramps)}
    for name, (first, last) in ramps.items():
        paths[name].write_text(f"time [s],{name} [{units[name] or '1'}]\n0,{first!r}\n1,{last!r}\n")
    try:
        solution = run(text, inputs=paths, values=values)
    except Refused:
        return None
    return None if solution.events or str(solution.outcome) != "Outcome.COMPLETED" else solution


def _watched(unit: Path, names: Collection[str]) -> dict[str, str]:
    """Return the variables of an FMU that a run has, too, by name: states, inputs as they are, outputs, accounts."""
    found: dict[str, str] = {}
    for variable in fmpy.read_model_description(str(unit)).modelVariables:
        name = variable.name.strip("'").replace("\\'", "'")
        if name in names and variable.causality in ("local", "input", "output"):
            found[name] = variable.name
    return found


def _signals(given: dict[str, float]) -> Any:
    """Return what fmpy sets inputs to, at both ends of a motion."""
    if not given:
        return None
    kinds = [("time", float), *((name, float) for name in given)]
    return np.array([(t, *given.values()) for t in (0.0, 1.0)], dtype=kinds)
