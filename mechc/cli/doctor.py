"""``mechc doctor``: what this installation can use, and what is missing."""

from __future__ import annotations

import os
import platform
import sys
import tempfile
from collections.abc import Iterator
from importlib import import_module
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import click
from msgspec import Struct

from .. import __version__
from .options import Command

REQUIRED = ("lark", "numpy", "scipy", "sympy", "fmpy", "click", "matplotlib", "platformdirs")
OPTIONAL = {
    "ziglang": "a C compiler from pip, also for other platforms: pip install ziglang",
    "pandas": "Solution.to_dataframe(): pip install pandas",
    "pin": "comparison with Pinocchio: pip install pin",
    "mujoco": "comparison with MuJoCo: pip install mujoco",
}
MODULES = {"pin": "pinocchio"}
"""What packages are imported as, where that is another name."""


class DoctorLine(Struct, frozen=True):
    """One line of the report. ``state``: good, optional (missing, but nothing needs it), bad."""

    topic: str
    text: str
    state: str = "good"
    help: str = ""


@click.command(
    cls=Command, name="doctor", short_help="Say what this installation can use, and what is missing."
)
def command() -> int:
    """Print versions, the C compiler and the cache folder; exit with 1 if something needed is missing or fails."""
    from ..presentation.style import style_for
    from .failures import COMPLETED, FAILED

    style = style_for(sys.stdout)
    signs = {"good": style.green("ok"), "optional": style.yellow("--"), "bad": style.red("!!")}
    findings = list(examine())
    width = max(len(finding.topic) for finding in findings)
    for finding in findings:
        click.echo(f"{signs[finding.state]}  {finding.topic:<{width}}  {finding.text}", color=True)
        if finding.help:
            click.echo(f"    {' ' * width}  {style.dim(finding.help)}", color=True)
    return FAILED if any(finding.state == "bad" for finding in findings) else COMPLETED


def examine() -> Iterator[DoctorLine]:
    """Look at everything that a run may need."""
    yield DoctorLine("mechc", __version__)
    yield DoctorLine("python", f"{platform.python_version()} ({sys.executable})")
    for name in REQUIRED:
        yield _package(name, "bad", "pip install mechc brings it; this installation is damaged")
    # before the compiler is tried: that takes another folder where this one cannot be written
    cache = _cache()
    yield _compiler()
    yield cache
    for name, use in OPTIONAL.items():
        yield _package(name, "optional", use)


def _package(name: str, missing: str, help: str) -> DoctorLine:
    """Import a package, as what is installed may still lack a library of the system."""
    try:
        found = version(name)
    except PackageNotFoundError:
        return DoctorLine(name, "not installed", missing, help)
    try:
        import_module(MODULES.get(name, name))
    except Exception as error:  # whatever a package raises while it is loaded
        said = str(error).strip().split("\n", 1)[0]
        return DoctorLine(
            name, f"{found}, but its import fails: {said or type(error).__name__}", missing, help
        )
    return DoctorLine(name, found)


def _compiler() -> DoctorLine:
    """Find the C compiler and try it."""
    from ..runtime.native.build import BuildError, CompilerMissing, build_shared, find_compiler, model_flags
    from .failures import COMPILER_HELP

    try:
        compiler = find_compiler()
        if compiler is None:
            return DoctorLine("C compiler", "none found: no model runs", "bad", COMPILER_HELP)
        build_shared({"probe.c": "int mechc_probe(void) { return 1; }\n"}, model_flags(), name="probe")
    except (BuildError, CompilerMissing) as error:
        return DoctorLine(
            "C compiler", str(error).split("\n", 1)[0], "bad", "the environment variable CC chooses another"
        )
    if compiler.in_process:
        return DoctorLine(
            "C compiler",
            "libtcc, which comes with mechc; gcc or clang make code that is two to seven times faster",
        )
    said = compiler.version.splitlines()[0] if compiler.version else ""
    return DoctorLine("C compiler", f"{' '.join(compiler.command)}: {said}")


def _cache() -> DoctorLine:
    from ..runtime.native.cache import SUBFOLDER, cache_content, made, users_cache
    from ..runtime.native.trust import folder_doubt
    from .cache import size_text

    chosen = os.environ.get("MECHC_CACHE")
    folder = Path(chosen) if chosen else users_cache()
    try:
        with tempfile.TemporaryFile(dir=made(folder / SUBFOLDER)):
            doubt = folder_doubt(made(folder / SUBFOLDER))
            content = cache_content()
    except OSError as error:
        where = f"MECHC_CACHE={chosen}" if chosen else str(folder)
        return DoctorLine("cache", f"{where}: {error.strerror}", "bad", "MECHC_CACHE chooses another folder")
    if doubt:
        return DoctorLine("cache", f"{folder}: {doubt}", "bad", "MECHC_CACHE chooses another folder")
    return DoctorLine("cache", f"{content.folder} ({content.entries} entries, {size_text(content.size)})")
