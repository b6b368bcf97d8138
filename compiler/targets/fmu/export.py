"""From equations to an FMU file: one file for one version, with binaries for platforms or as sources alone."""

from __future__ import annotations

import hashlib
import io
import re
import zipfile
from collections.abc import Collection, Mapping, Sequence
from importlib.util import find_spec
from pathlib import Path
from types import MappingProxyType

from msgspec import Struct
from msgspec.structs import replace

from mechc.runtime.case import SimulationOptions, find_experiment, input_values, prepare
from mechc.runtime.functions import load_functions
from mechc.runtime.integrate.nominal_run import nominal_of
from mechc.runtime.methods import parts_for
from mechc.runtime.problem import Problem

from ...equations.model import Equations
from ...equations.sensitivities import with_sensitivities
from ...program.lower import lower
from ...program.model import Program
from ...program.series import with_series
from ...verification import verified
from ..alone import standing_alone
from ..c import emit_c
from . import arrays, model_description2, model_description3, terminals
from .identity import Identity, checked_identifier
from .platforms import HOST, binaries
from .sources import driving, sources, with_token
from .table import settable_parameters, variable_table
from .variables import Start, VariableTable

DEFAULT_STOP = 10.0
ICON = "terminalsAndIcons/icon.png"


class Package(Struct, frozen=True):
    """A finished FMU: its bytes, and what was written into it by path."""

    data: bytes
    files: Mapping[str, bytes]
    token: str


class Made(Struct, frozen=True):
    """A finished FMU with what it was made for; ``kinds``: me, cs."""

    package: Package
    start: Start
    method: str
    kinds: tuple[str, ...]


def start_of(
    problem: Problem,
    experiment: str | None = None,
    values: Mapping[str, float] | None = None,
    sizes: Mapping[str, float] = MappingProxyType({}),
) -> Start:
    """Return what a run of the experiment begins with; ``sizes``: nominal values that a run has found, by name.

    Raises SimulationError.
    """
    functions = load_functions(problem)
    plan = find_experiment(problem, experiment)
    said = plan is not None and "stop" in plan.options
    options = SimulationOptions(
        experiment=experiment, values=values or {}, stop=None if said else DEFAULT_STOP
    )
    case = prepare(problem, functions, options)
    u = input_values(functions, case.tables, case.begin, case.p, len(problem.inputs))
    nominal = nominal_of(case)
    for i, state in enumerate(problem.states):
        nominal[i] = sizes.get(state.name, nominal[i])
    given: dict[str, set[int]] = {"p": set(), "y": set(), "u": set()}
    for setting in plan.settings if plan else ():
        given[setting.array].add(setting.index)
    for array, quantities in (("p", problem.parameters), ("y", problem.states), ("u", problem.inputs)):
        given[array] |= {i for i, q in enumerate(quantities) if q.name in (values or {})}
    return Start(
        problem, case, u, nominal, frozenset(given["p"]), frozenset(given["y"]), frozenset(given["u"])
    )


class Written(Struct, frozen=True):
    """What the FMUs of both versions share: the program with its C text, and the table of variables."""

    program: Program
    code: str
    table: VariableTable


def write_program(equations: Equations, start: Start, method: str = "auto") -> Written:
    """Extend the equations by derivatives and write them as C, with what the method takes from the program."""
    extended = verified(with_sensitivities(equations, settable_parameters(equations, start.given_parameters)))
    program = standing_alone(lower(extended))
    program = verified(with_series(program) if "series" in parts_for(method) else program)
    return Written(program, emit_c(program), variable_table(extended, start))


def make_package(
    equations: Equations,
    start: Start,
    *,
    fmi: int,
    kinds: tuple[str, ...] = ("me", "cs"),
    method: str,
    platforms: Sequence[str] = (HOST,),
    documents: Mapping[str, bytes] | None = None,
    parts: Collection[str] = (),
    with_arrays: bool = False,
    written: Written | None = None,
) -> Package:
    """Return the FMU of a model. ``platforms`` without a name gives sources alone; ``documents`` are further files
    by path; ``parts`` are kept though the model does without; ``with_arrays`` (FMI 3) makes arrays of
    scalars that are alike; ``written``: by ``write_program``, if there is more than one version.

    Raises CompileError, BuildError, CompilerMissing.
    """
    identifier = checked_identifier(equations.name)
    written = written or write_program(equations, start, method)
    program, table = written.program, written.table
    groups = arrays.grouped(table) if with_arrays else arrays.scalars(table)
    sizes = arrays.sizes(groups, table) if with_arrays else []
    plain = sources(program, written.code, start, table, method, fmi, parts=parts, sizes=sizes)
    case = start.case
    identity = Identity(
        name=equations.name,
        model_identifier=identifier,
        doc=equations.doc,
        token="",
        kinds=kinds,
        start=case.begin,
        stop=case.stop,
        tolerance=case.tolerance,
        step=(case.stop - case.begin) / 500,
        sources=tuple(name for name in plain if name.endswith(".c")),
        needs_completed_step=bool(
            program.constraints
            or program.rotations
            or program.assertions
            or program.switching
            or driving(program)
        ),
    )

    def describe(identity: Identity) -> str:
        return (
            model_description2.write(identity, table)
            if fmi == 2
            else model_description3.write(identity, table, groups)
        )

    # the token is a hash of all that the file says without it
    everything = repr((plain, describe(identity)))
    token = "{" + _uuid(hashlib.sha256(everything.encode()).hexdigest()) + "}"
    texts = with_token(plain, token)
    description = describe(replace(identity, token=token))
    headers = standard_headers(fmi)
    files: dict[str, bytes] = {"modelDescription.xml": description.encode()}
    for name, text in texts.items():
        files[f"sources/{name}"] = text.encode()
    if fmi == 3:
        files["terminalsAndIcons/terminalsAndIcons.xml"] = terminals.write(
            groups, table, icon=ICON in (documents or {})
        ).encode()
        files["sources/buildDescription.xml"] = model_description3.build_description(identity).encode()
    else:
        files.update({f"sources/{name}": text.encode() for name, text in headers.items()})
    files |= binaries({**texts, **headers}, platforms, fmi, identifier)
    files |= {f"documentation/licenses/{name}": text.encode() for name, text in licences(fmi).items()}
    files |= documents or {}
    return Package(_zipped(files), files, token)


def standard_headers(fmi: int) -> dict[str, str]:
    """Return the headers of the standard by name: those that fmpy ships (2-clause BSD licence)."""
    folder = header_folder()
    names = {
        2: ("TypesPlatform", "FunctionTypes", "Functions"),
        3: ("PlatformTypes", "FunctionTypes", "Functions"),
    }
    return {f"fmi{fmi}{n}.h": (folder / f"fmi{fmi}{n}.h").read_text(encoding="utf-8") for n in names[fmi]}


def _uuid(digest: str) -> str:
    return "-".join((digest[:8], digest[8:12], digest[12:16], digest[16:20], digest[20:32]))


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


FIRST = """\
This FMU was made from a model. The rights to the model are those of its author.

Code of others in this file, as source text and in the binaries:

- the integration kernel and the interface, sources/*.c and *.h other than model.c and description.c:
  MIT licence, see mechc.txt
- the headers of the Functional Mock-up Interface, fmi{fmi}*.h: 2-Clause BSD licence, see fmi.txt
"""


def header_folder() -> Path:
    """Return where fmpy keeps the headers; it is not imported, which fails on machines that FMI has no name for."""
    spec = find_spec("fmpy")
    assert spec is not None and spec.submodule_search_locations, "mechc depends on fmpy"
    return Path(spec.submodule_search_locations[0]) / "c-code"


def licences(fmi: int) -> dict[str, str]:
    """Return the texts by file name; ``license.txt`` is the one to begin with."""
    import mechc.runtime

    own = Path(mechc.runtime.__file__).parent / "kernel" / "LICENSE"
    header = header_folder() / f"fmi{fmi}Functions.h"
    return {
        "license.txt": FIRST.format(fmi=fmi),
        "mechc.txt": own.read_text(encoding="utf-8"),
        "fmi.txt": bsd_notice(header.read_text(encoding="utf-8")),
    }


def bsd_notice(header: str) -> str:
    """Cut the copyright lines and the licence out of a header. Raises ValueError if there are none."""
    found = re.search(r"^[ \t]*Copyright.*?POSSIBILITY\s+OF\s+SUCH\s+DAMAGE\.", header, re.S | re.M)
    if not found:
        raise ValueError("the header of the standard holds no licence")
    rows = [re.sub(r"^\s*\*? ?", "", row).rstrip() for row in found[0].splitlines()]
    return "\n".join(rows) + "\n"
