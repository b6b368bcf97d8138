"""``mechc compile``: write a model as code or as an FMU."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click
from click.core import ParameterSource

from ..targets import MODULES
from .failures import show_warnings
from .options import (
    Compiling,
    input_option,
    keep_all_option,
    kept,
    model_argument,
    model_option,
    no_model,
    set_option,
    verify_option,
)

ENDINGS = {".html": "web", ".htm": "web", ".fmu": "fmu", ".c": "c", ".h": "c"}
"""Endings of files -> the target that is meant."""
MEANT = {
    "html": "web",
    "htm": "web",
    "page": "web",
    "py": "python",
    "numpy": "python",
    "c11": "c",
    "c99": "c",
}
"""Words for targets that are none."""

OF_TARGETS = {
    "fmi": ("fmu",),
    "kind": ("fmu",),
    "experiment": ("fmu", "web"),
    "platforms": ("fmu",),
    "arrays": ("fmu",),
    "sources_only": ("fmu",),
    "check": ("fmu",),
    "recorded": ("web",),
}
"""Options that some targets alone know -> those targets."""


class Targets(click.Choice[str]):
    """The targets; what people call them otherwise is told by its name."""

    def get_invalid_choice_message(self, value: object, ctx: click.Context | None) -> str:
        meant = MEANT.get(str(value).casefold())
        said = super().get_invalid_choice_message(value, ctx)
        return f"{said} Did you mean '{meant}'?" if meant else said


def _check_ending(target: str, output: str | None) -> None:
    """Refuse to write a module into a file that is of another kind."""
    ending = Path(output).suffix.lower() if output else ""
    if target in MODULES and output and ending != ".py":
        meant = ENDINGS.get(ending)
        help = f"add --target {meant}" if meant else f"as in -o {Path(output).with_suffix('.py').name}"
        raise click.UsageError(f"the target {target} writes a module, whose file ends in .py; {help}")


def _check_options(target: str) -> None:
    """Refuse options that the target does not know."""
    context = click.get_current_context()
    for option in context.command.params:
        of = option.name or ""
        known = OF_TARGETS.get(of, (target,))
        if target in known or context.get_parameter_source(of) is not ParameterSource.COMMANDLINE:
            continue
        help = "; code of this target begins with the default experiment" if of == "experiment" else ""
        name = "/".join((*option.opts, *option.secondary_opts))
        raise click.UsageError(f"{name} is of --target {' and '.join(known)}, not of {target}{help}")


@click.command(
    cls=Compiling, name="compile", short_help="Write a model as code, an FMU, a page, or for CasADi or JAX."
)
@model_argument
@model_option
@set_option
@input_option
@click.option(
    "--target",
    type=Targets(["c", "fmu", "web", *MODULES]),
    default="python",
    show_default=True,
    help="A short Python module, C11 with the kernel beside it, a Functional Mock-up Unit, a page "
    "that shows the model move, or a module of functions for CasADi or JAX, which differentiate them.",
)
@click.option(
    "-o",
    "--output",
    metavar="PATH",
    callback=no_model,
    help="The module (python, casadi, jax), the folder (c) or the file (fmu, web).",
)
@click.option(
    "--fmi", type=click.Choice(["2", "3", "both"]), default="3", show_default=True, help="fmu: version."
)
@click.option(
    "--kind",
    type=click.Choice(["me", "cs", "both"]),
    default="both",
    show_default=True,
    help="fmu: Model Exchange, Co-Simulation or both.",
)
@click.option(
    "--experiment", metavar="NAME", help="fmu, web: whose settings are the defaults (default: the first)."
)
@click.option(
    "--platform",
    "platforms",
    metavar="NAME",
    multiple=True,
    help="fmu: host (default), x86_64-linux, aarch64-linux, x86_64-windows, aarch64-windows, x86_64-darwin, "
    "aarch64-darwin or all; may be repeated. Others than host are built by zig (pip install ziglang).",
)
@click.option(
    "--fmi3-arrays",
    "arrays",
    type=click.Choice(["on", "off"]),
    default="off",
    show_default=True,
    help="fmu: arrays as variables with dimensions in FMI 3; some importers know scalars only.",
)
@click.option(
    "--sources-only", is_flag=True, help="fmu: without a binary; needs neither gcc nor clang nor zig."
)
@click.option("--check/--no-check", default=True, help="fmu: validate, simulate and compare before writing.")
@click.option("--recorded", is_flag=True, help="web: with one motion in it instead of the model: no sliders.")
@keep_all_option
@verify_option
def command(
    file: str,
    model: str | None,
    settings: dict[str, str],
    inputs: dict[str, Any],
    target: str,
    output: str | None,
    fmi: str,
    kind: str,
    experiment: str | None,
    platforms: tuple[str, ...],
    arrays: str,
    sources_only: bool,
    check: bool,
    recorded: bool,
    keep_all: bool,
) -> None:
    """Write MODEL.mech as code that stands alone.

    \b
    mechc compile pendulum.mech --target python -o pendulum.py    # then: from pendulum import simulate
    mechc compile pendulum.mech --target c -o pendulum_c          # its files say how to build them
    mechc compile pendulum.mech --target fmu -o pendulum.fmu      # --fmi 2 for older importers
    mechc compile pendulum.mech --target web -o pendulum.html     # one file, live in any browser
    mechc compile pendulum.mech --target casadi                   # functions for optimal control
    """
    from ..api import load

    _check_ending(target, output)
    _check_options(target)
    if inputs and target != "web":
        raise click.UsageError(
            f"--input gives a page (--target web) its tables; code of the target {target} is told its inputs when it runs"
        )
    drawn = {"scene"} if target == "web" else set()
    loaded = load(file, model=model, set=settings, keep=kept(keep_all) | drawn)
    show_warnings(loaded)
    if target == "fmu":
        from ..fmu.export import FmuOptions, export_fmu
        from ..requests.parse_values import UsageMistake

        options = FmuOptions(
            fmi, kind, experiment, sources_only, check, platforms or ("host",), arrays == "on"
        )
        try:
            paths = export_fmu(loaded, Path(output) if output else None, options)
        except UsageMistake as mistake:
            raise click.UsageError(str(mistake)) from None
        for path in paths:
            click.echo(f"wrote {path}", err=True)
        return
    if target == "web":
        from ..requests.parse_values import UsageMistake
        from ..web.write import write_page

        try:
            path = write_page(loaded, output, recorded=recorded, experiment=experiment, inputs=inputs)
        except UsageMistake as mistake:
            raise click.UsageError(str(mistake)) from None
        click.echo(f"wrote {path}", err=True)
        return
    paths = loaded.compile(target, output)
    if target == "c":
        click.echo(f"wrote {len(paths)} files to {paths[0].parent}", err=True)
    else:
        click.echo(f"wrote {paths[0]}", err=True)
