"""FMUs from the command line: write them, check them, run them."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from msgspec import Struct

from ..lang.diagnostics import CompileError, Reporter
from ..requests.parse_values import UsageMistake

if TYPE_CHECKING:
    from ..compiler.equations.model import Equations
    from ..compiler.targets.fmu.export import Made
    from ..compiler.targets.fmu.variables import Start
    from ..model import CompiledModel
    from ..solution import Solution

KINDS = {"me": ("me",), "cs": ("cs",), "both": ("me", "cs")}
VERSIONS = {"2": (2,), "3": (3,), "both": (2, 3)}


class FmuOptions(Struct, frozen=True):
    """``fmi``: 2, 3 or both; ``kind``: me, cs or both; ``check``: simulate and compare before writing.

    ``arrays``: arrays of FMI 3 in place of scalars with indices. ``platforms``: host, names of FMI 3 such
    as aarch64-linux, or all.
    """

    fmi: str = "3"
    kind: str = "both"
    experiment: str | None = None
    sources_only: bool = False
    check: bool = True
    platforms: tuple[str, ...] = ("host",)
    arrays: bool = False


def export_fmu(model: CompiledModel, output: Path | None, options: FmuOptions) -> tuple[Path, ...]:
    """Write an FMU, or ``fmi2/M.fmu`` and ``fmi3/M.fmu`` in the folder of ``output`` for both versions.

    Nothing is written unless everything succeeded. Raises CompileError (E09), UsageMistake, SimulationError,
    BuildError.
    """
    if model.compilation.equations.curve is not None:
        raise UsageMistake(
            f"'{model.name}' is a curve, which nothing steps through in time", "'mechc run' finds it"
        )
    from ..exporting import with_weights

    if "delays" in model.compilation.equations.needs and options.kind != "cs":
        raise UsageMistake(
            f"'{model.name}' has delays, which look back at the motion, and in Model Exchange the importer keeps it",
            "--kind cs writes it for Co-Simulation, where the FMU keeps what it looks back at",
        )
    from ..runtime.methods import SOLVING_CONTACTS

    if model.method(options.experiment) in SOLVING_CONTACTS and options.kind != "cs":
        raise UsageMistake(
            f"the steps of '{model.method(options.experiment)}' solve for the contacts of '{model.name}', and in Model Exchange the importer steps",
            "--kind cs writes it for Co-Simulation, where the FMU steps; without the method, contacts are events in both",
        )
    switching = model.compilation.equations.switching
    if switching is not None and switching.crowd is not None and options.kind != "cs":
        raise UsageMistake(
            f"the forces of the {switching.crowd.count} contacts of '{model.name}' are found over those that touch, and in Model Exchange "
            "the importer would have to know which",
            "--kind cs writes it for Co-Simulation, where the FMU steps",
        )
    chosen = with_weights(model.for_experiment(options.experiment))
    places = _places(chosen, output, options)
    packages = fmu_packages(chosen, options)
    if options.check:
        from ..compiler.targets.fmu.checks import check_package  # with fmpy, which refuses some machines

        for package in packages:
            check_package(package)
    _write_all([(place, p.package.data) for place, p in zip(places, packages, strict=True)])
    return tuple(places)


def _places(model: CompiledModel, output: Path | None, options: FmuOptions) -> list[Path]:
    """Return the files to be written. Raises CompileError (E0901) for those that cannot be, UsageMistake."""
    from ..exporting import stem_of

    target = output or Path(f"{stem_of(model)}.fmu")
    if target.suffix != ".fmu":
        raise UsageMistake("the file of an FMU ends in .fmu", f"as in -o {target.with_suffix('.fmu').name}")
    versions = VERSIONS[options.fmi]
    places = [target.parent / f"fmi{v}" / target.name if len(versions) > 1 else target for v in versions]
    for place in places:
        folder = next(p for p in (place.parent, *place.parent.parents) if p.exists())
        if place.is_dir():
            raise _unwritable(place, "it is a folder")
        if not folder.is_dir():
            raise _unwritable(place, f"{folder} is not a folder")
        if not os.access(folder, os.W_OK | os.X_OK):
            raise _unwritable(place, f"the folder {folder} may not be written")
    return places


def _unwritable(place: Path, reason: str) -> CompileError:
    return Reporter().fail(
        "E0901", f"{place} cannot be written: {reason}", None, help="choose another place with -o FILE.fmu"
    )


def fmu_packages(model: CompiledModel, options: FmuOptions) -> list[Made]:
    """Return the FMU of each version that is asked for. Raises CompileError, SimulationError, BuildError."""
    from ..compiler.targets.fmu.export import Made, make_package, start_of, write_program
    from ..compiler.targets.fmu.identity import checked_identifier
    from ..compiler.targets.fmu.platforms import chosen_platforms
    from ..runtime.native.build import find_compiler
    from .documents import documents, native_run, placed

    checked_identifier(model.name)
    platforms = () if options.sources_only else chosen_platforms(options.platforms)
    compiler = find_compiler()
    if platforms and (compiler is None or compiler.in_process):  # which hides no functions from other FMUs
        raise Reporter().fail(
            "E0902",
            "the binary of an FMU needs gcc, clang or zig, and none was found",
            None,
            help="install gcc or clang, or: pip install ziglang; --sources-only writes an FMU without binaries",
        )

    def start_with(method: str, sizes: Mapping[str, float]) -> Start:
        problem = model.problem(method=method, reproducible=True)
        return start_of(problem, options.experiment, model.settings, sizes)

    first = start_with(model.method(options.experiment), {})
    model, run = native_run(model, options.experiment, first.case.stop)
    method = _method(model, options, run)
    # what the run has shown the model to need, its solver has as well
    start = start_with(method, run.motion.own_sizes)
    equations = equations_for(model, method)
    program = write_program(equations, start, method)
    files = documents(model, options.experiment, run, first.case.begin)
    return [
        Made(
            make_package(
                equations,
                start,
                fmi=version,
                kinds=KINDS[options.kind],
                method=method,
                platforms=platforms,
                documents=placed(files, version),
                parts=model.compilation.parts,
                with_arrays=options.arrays and version == 3,
                written=program,
            ),
            start,
            method,
            KINDS[options.kind],
        )
        for version in VERSIONS[options.fmi]
    ]


def _method(model: CompiledModel, options: FmuOptions, run: Solution) -> str:
    """Return the method of the experiment; a model that turned out to be stiff gets the implicit one at hand."""
    said = model.method(options.experiment)
    if said and said != "auto":
        return said
    return "auto" if run.statistics.stiff_time is not None else "dop853"


def equations_for(model: CompiledModel, method: str) -> Equations:
    """Return the equations with what the method needs of them, and all that the model was asked to keep."""
    from ..compiler.equations.assemble import assemble
    from ..compiler.verification import verified
    from ..runtime.methods import parts_for

    parts = model.compilation.parts | parts_for(method)
    return verified(assemble(model.compilation.system, Reporter(), parts))


def _write_all(files: Sequence[tuple[Path, bytes]]) -> None:
    """Write all files, each under its name only when all are complete. Raises CompileError (E0901)."""
    finished: list[tuple[str, Path]] = []
    place = files[0][0]
    try:
        for place, data in files:
            place.parent.mkdir(parents=True, exist_ok=True)
            handle, name = tempfile.mkstemp(prefix=place.name, dir=place.parent)
            finished.append((name, place))
            with os.fdopen(handle, "wb") as file:
                file.write(data)
            os.chmod(name, 0o644)
        while finished:
            name, place = finished[0]
            os.replace(name, place)
            finished.pop(0)
    except OSError as error:
        raise _unwritable(place, error.strerror or str(error)) from error
    finally:
        for name, _ in finished:
            Path(name).unlink(missing_ok=True)
