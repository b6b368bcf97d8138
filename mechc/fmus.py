"""FMUs from the command line: write them, check them, run them."""

from __future__ import annotations

import os
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from .settings import UsageMistake

if TYPE_CHECKING:
    from .api import Model
    from .compiler.equations.model import Equations
    from .compiler.targets.fmu.export import Package
    from .compiler.targets.fmu.variables import Start

KINDS = {"me": ("me",), "cs": ("cs",), "both": ("me", "cs")}
VERSIONS = {"2": (2,), "3": (3,), "both": (2, 3)}


@dataclass(frozen=True, slots=True)
class FmuOptions:
    """``fmi``: 2, 3 or both; ``kind``: me, cs or both; ``check``: simulate and compare before writing."""

    fmi: str = "3"
    kind: str = "both"
    experiment: str | None = None
    sources_only: bool = False
    check: bool = True


def export_fmu(model: Model, output: Path | None, options: FmuOptions) -> tuple[Path, ...]:
    """Write an FMU, or ``fmi2/M.fmu`` and ``fmi3/M.fmu`` in the folder of ``output`` for both versions.

    Nothing is written unless everything succeeded. Raises UsageMistake, SimulationError, BuildError,
    CompilerMissing, OSError.
    """
    from .compiler.targets.fmu.checks import check_package
    from .compiler.targets.fmu.export import ExportError, make_package, start_of
    from .exporting import file_stem

    chosen = model.for_experiment(options.experiment)
    target = output or Path(f"{file_stem(model.name)}.fmu")
    if target.suffix != ".fmu":
        raise UsageMistake("the file of an FMU ends in .fmu", f"as in -o {target.with_suffix('.fmu').name}")
    versions = VERSIONS[options.fmi]
    places = [target.parent / f"fmi{v}" / target.name if len(versions) > 1 else target for v in versions]
    finished: list[tuple[Path, Package]] = []
    try:
        problem = chosen.problem("python" if options.sources_only else "c", reproducible=True)
        start = start_of(problem, options.experiment, chosen.settings)
        method = _method(chosen, options, start)
        equations = _equations(chosen, method)
        for version, place in zip(versions, places, strict=True):
            package = make_package(
                equations,
                start,
                fmi=version,
                kinds=KINDS[options.kind],
                method=method,
                with_binary=not options.sources_only,
            )
            if options.check:
                check_package(package, start, method, KINDS[options.kind], run=not options.sources_only)
            finished.append((place, package))
    except ExportError as error:
        raise UsageMistake(str(error)) from error
    for place, package in finished:
        write_whole(place, package.data)
    return tuple(places)


def _method(model: Model, options: FmuOptions, start: Start) -> str:
    """Return the method of the experiment; a model that turns out to be stiff gets the implicit one at hand."""
    said = model.method(options.experiment)
    if said and said != "auto":
        return said
    if options.sources_only:
        return "dop853"
    run = model.simulate(
        experiment=options.experiment,
        stop=start.case.stop,
        reproducible=True,
        estimate_error=False,
        target="c",
    )
    return "auto" if run.statistics.stiff_time is not None else "dop853"


def _equations(model: Model, method: str) -> Equations:
    from .api import WITH_JACOBIAN, WITH_MOMENTA
    from .compiler.equations.assemble import assemble
    from .lang.diagnostics import Reporter

    parts = {"jacobian"} if method in WITH_JACOBIAN else set()
    parts |= {"momenta"} if method in WITH_MOMENTA else set()
    # a switch that never changes would be a discrete variable, of which there are none in an FMU without events
    return assemble(model.compilation.system, Reporter(), model.compilation.parts - {"events"} | parts)


def write_whole(path: Path, data: bytes) -> None:
    """Write a file under its name only when it is complete. Raises OSError."""
    path.parent.mkdir(parents=True, exist_ok=True)
    handle, name = tempfile.mkstemp(prefix=path.name, dir=path.parent)
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(data)
        os.chmod(name, 0o644)
        os.replace(name, path)
    except OSError:
        Path(name).unlink(missing_ok=True)
        raise
