"""From equations to an FMU file: one file for one version, for the platform of this machine or as sources."""

from __future__ import annotations

import hashlib
import io
import platform
import sys
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from mechc.runtime.build import LIBRARY_SUFFIX, build_shared, kernel_flags
from mechc.runtime.case import SimulationOptions, find_experiment, input_values, prepare
from mechc.runtime.functions import load_functions
from mechc.runtime.nominal import nominal_values
from mechc.runtime.problem import Problem

from ...equations.model import Equations
from ...equations.sensitivities import with_sensitivities
from ...program.lower import lower
from . import xml2, xml3
from .identity import Identity, tool
from .sources import sources
from .variables import Start, settable_parameters, variable_table

PLATFORMS = {2: "linux64", 3: "x86_64-linux"}
_SYSTEMS = {"linux": "linux", "darwin": "darwin", "win32": "windows"}
_MACHINES = {"x86_64": "x86_64", "amd64": "x86_64", "aarch64": "aarch64", "arm64": "aarch64"}
DEFAULT_STOP = 10.0


class ExportError(Exception):
    """The model cannot be exported; the message says why."""


@dataclass(frozen=True, slots=True)
class Package:
    """A finished FMU: its bytes, and what was written into it by path."""

    data: bytes
    files: Mapping[str, bytes]
    token: str


def host_platform(fmi: int) -> str:
    """Return the name of the folder of this machine's binaries."""
    machine = _MACHINES.get(platform.machine().lower())
    system = _SYSTEMS.get(sys.platform)
    if machine is None or system is None:
        raise ExportError(f"FMI has no name for this platform ({platform.machine()}, {sys.platform})")
    if fmi == 2 and machine == "x86_64":
        return {"linux": "linux64", "darwin": "darwin64", "windows": "win64"}[system]
    return f"{machine}-{system}"


def start_of(
    problem: Problem, experiment: str | None = None, values: Mapping[str, float] | None = None
) -> Start:
    """Return what a run of the experiment begins with. Raises SimulationError."""
    functions = load_functions(problem)
    plan = find_experiment(problem, experiment)
    said = plan is not None and "stop" in plan.options
    options = SimulationOptions(
        experiment=experiment, values=values or {}, stop=None if said else DEFAULT_STOP
    )
    case = prepare(problem, functions, options)
    u = input_values(functions, case.tables, case.begin, case.p, len(problem.inputs))
    rates = functions.rhs(case.begin, case.y0, u, case.z, case.p)
    out = functions.outputs(case.begin, case.y0, u, case.z, case.p) if functions.outputs else np.empty(0)
    energies = [float(v) for v, q in zip(out, problem.outputs, strict=True) if q.kind == "energy"]
    nominal = nominal_values(problem, case.y0, rates, case.p, energies, case.stop - case.begin)
    given: dict[str, set[int]] = {"p": set(), "y": set(), "u": set()}
    for setting in plan.settings if plan else ():
        given[setting.array].add(setting.index)
    for array, quantities in (("p", problem.parameters), ("y", problem.states), ("u", problem.inputs)):
        given[array] |= {i for i, q in enumerate(quantities) if q.name in (values or {})}
    if problem.constraints:
        given["y"] = set(range(problem.ny))
    return Start(
        problem, case, u, nominal, frozenset(given["p"]), frozenset(given["y"]), frozenset(given["u"])
    )


def make_package(
    equations: Equations,
    start: Start,
    *,
    fmi: int,
    kinds: tuple[str, ...] = ("me", "cs"),
    method: str,
    with_binary: bool = True,
) -> Package:
    """Return the FMU of a model. Raises ExportError, BuildError, CompilerMissing."""
    if any(e.kind != "seed" for e in equations.discretes):
        raise ExportError(
            "models with discrete variables cannot be exported as an FMU yet: "
            f"'{equations.discretes[0].name}' is one"
        )
    independent = settable_parameters(equations, start.given_parameters)
    extended = with_sensitivities(equations, independent)
    program = lower(extended)
    table = variable_table(extended, start)
    everything = repr(
        (program.name, sources(program, start, table, "", method, fmi), table.variables, kinds, tool())
    )
    token = "{" + _uuid(hashlib.sha256(everything.encode()).hexdigest()) + "}"
    texts = sources(program, start, table, token, method, fmi)
    case = start.case
    identity = Identity(
        name=equations.name,
        doc=equations.doc,
        token=token,
        kinds=kinds,
        start=case.begin,
        stop=case.stop,
        tolerance=case.tolerance,
        step=(case.stop - case.begin) / 500,
        sources=tuple(name for name in texts if name.endswith(".c")),
        needs_completed_step=bool(program.constraints or program.rotations or program.assertions),
    )
    headers = standard_headers(fmi)
    description = xml2.write(identity, table) if fmi == 2 else xml3.write(identity, table)
    files: dict[str, bytes] = {"modelDescription.xml": description.encode()}
    for name, text in texts.items():
        files[f"sources/{name}"] = text.encode()
    if fmi == 3:
        files["sources/buildDescription.xml"] = xml3.build_description(identity).encode()
    else:
        files.update({f"sources/{name}": text.encode() for name, text in headers.items()})
    if with_binary:
        library = build_shared({**texts, **headers}, kernel_flags(reproducible=True), name="fmu")
        place = f"binaries/{host_platform(fmi)}/{identity.model_identifier}{LIBRARY_SUFFIX}"
        files[place] = library.read_bytes()
    files["documentation/index.html"] = _documentation(identity, equations).encode()
    return Package(_zipped(files), files, token)


def standard_headers(fmi: int) -> dict[str, str]:
    """Return the headers of the standard by name: those that fmpy ships (2-clause BSD licence)."""
    import fmpy

    folder = Path(fmpy.__file__).parent / "c-code"
    names = {
        2: ("TypesPlatform", "FunctionTypes", "Functions"),
        3: ("PlatformTypes", "FunctionTypes", "Functions"),
    }
    return {f"fmi{fmi}{n}.h": (folder / f"fmi{fmi}{n}.h").read_text(encoding="utf-8") for n in names[fmi]}


def _uuid(digest: str) -> str:
    return "-".join((digest[:8], digest[8:12], digest[12:16], digest[16:20], digest[20:32]))


def _documentation(identity: Identity, equations: Equations) -> str:
    from html import escape

    rows = "".join(
        f"<tr><td>{escape(e.name)}</td><td>{escape(e.unit)}</td><td>{escape(e.doc)}</td></tr>\n"
        for e in (*equations.states, *equations.inputs, *equations.parameters, *equations.outputs)
    )
    return (
        f"<!DOCTYPE html>\n<html><head><meta charset='utf-8'><title>{escape(identity.name)}</title></head>\n"
        f"<body><h1>{escape(identity.name)}</h1>\n<p>{escape(identity.doc.strip())}</p>\n"
        f"<table>\n<tr><th>variable</th><th>unit</th><th></th></tr>\n{rows}</table>\n</body></html>\n"
    )


def _zipped(files: Mapping[str, bytes]) -> bytes:
    """Pack files with fixed dates and modes, the model description first."""
    memory = io.BytesIO()
    with zipfile.ZipFile(memory, "w", zipfile.ZIP_DEFLATED) as archive:
        for name in sorted(files, key=lambda n: (n != "modelDescription.xml", n)):
            info = zipfile.ZipInfo(name, (1980, 1, 1, 0, 0, 0))
            info.compress_type = zipfile.ZIP_DEFLATED
            info.create_system = 3
            info.external_attr = 0o100644 << 16
            archive.writestr(info, files[name])
    return memory.getvalue()
