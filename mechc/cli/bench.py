"""``mechc bench``: error against run time."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
from click.core import ParameterSource

from .options import PICTURES, Compiling, ending, model_argument, model_option, no_model, set_option

if TYPE_CHECKING:
    from ..model import CompiledModel


def _list(ctx: click.Context, parameter: click.Parameter, text: str | None) -> tuple[str, ...]:
    return tuple(part.strip() for part in text.split(",") if part.strip()) if text else ()


@click.command(
    cls=Compiling, name="bench", short_help="Measure error against run time, for methods and tolerances."
)
@model_argument
@model_option
@set_option
@click.option("--experiment", metavar="NAME", help="Which experiment of the model.")
@click.option("--stop", metavar="TIME", help="When to stop, instead of the experiment's time.")
@click.option(
    "--methods",
    metavar="A,B",
    callback=_list,
    help="Methods of the kernel (default: all that the model allows).",
)
@click.option(
    "--tolerances", metavar="A,B", callback=_list, help="Tolerances to measure (default: 1e-3 to 1e-14)."
)
@click.option(
    "--against",
    metavar="A,B",
    callback=_list,
    help="Other libraries on the same equations: scipy (or one method: scipy:DOP853), sundials, numbalsoda, heyoka, diffsol, diffrax; those that are not installed are named.",
)
@click.option(
    "--seconds", type=float, default=60.0, show_default=True, help="CPU seconds that the reference may take."
)
@click.option(
    "--json",
    "json_file",
    metavar="FILE",
    callback=no_model,
    help="Write the table as JSON; - for standard output alone.",
)
@click.option(
    "-o",
    "--output",
    metavar="FILE",
    callback=ending((".html", ".htm"), "pages"),
    help="Write a page on which the points of the diagram tell what they are (html).",
)
@click.option(
    "--plot", metavar="FILE", callback=ending(PICTURES, "pictures"), help="Draw the diagram (png, pdf, svg)."
)
def command(file: str, **given: Any) -> None:
    """Measure the error of MODEL.mech over the run time that it takes, against a reference in higher precision;
    of a curve, over the unknowns of its elements."""
    from ..api import load
    from ..measurement.benchmark import benchmark
    from ..requests.parse_values import UsageMistake, read_value
    from ..runtime.reference.high_precision import ReferenceFailed
    from ..runtime.reference.work_precision import TOLERANCES

    try:
        tolerances = tuple(float(text) for text in given["tolerances"]) or TOLERANCES
    except ValueError:
        raise click.BadParameter("tolerances are numbers such as 1e-6,1e-9") from None
    try:
        model = load(file, model=given["model"], set=given["settings"]).for_experiment(given["experiment"])
        if model.compilation.equations.curve is not None:
            _bench_curve(model, given)
            return
        stop = None
        if given["stop"]:
            stop = read_value(given["stop"]).in_unit(model.compilation.equations.time.unit, "stop")[0]
        made = benchmark(
            model,
            methods=given["methods"],
            against=given["against"],
            tolerances=tolerances,
            experiment=given["experiment"],
            stop=stop,
            seconds=given["seconds"],
        )
    except UsageMistake as mistake:
        raise click.UsageError(str(mistake)) from None
    except ReferenceFailed as failure:
        raise click.ClickException(f"no reference could be had: {failure}") from None
    text = json.dumps(made.summary(), indent=1)
    if given["json_file"] == "-":
        click.echo(text)
    else:
        from ..measurement.benchmark_report import report

        click.echo(report(made))
        if given["json_file"]:
            Path(given["json_file"]).write_text(text + "\n", encoding="utf-8")
    if given["plot"]:
        from ..measurement.benchmark_report import draw

        draw(made, Path(given["plot"]))
    if given["output"]:
        from ..measurement.benchmark_report import write_page

        write_page(made, Path(given["output"]))


def _bench_curve(model: CompiledModel, given: dict[str, Any]) -> None:
    from ..measurement.curve_convergence import convergence, draw, report
    from ..requests.parse_values import UsageMistake

    context = click.get_current_context()
    for name in ("stop", "methods", "tolerances", "against", "seconds", "output"):
        if context.get_parameter_source(name) is ParameterSource.COMMANDLINE:
            raise UsageMistake(f"--{name} belongs to a motion, and '{model.name}' is a curve")
    made = convergence(model, given["experiment"])
    text = json.dumps(made.summary(), indent=1)
    click.echo(text if given["json_file"] == "-" else report(made))
    if given["json_file"] not in (None, "-"):
        Path(given["json_file"]).write_text(text + "\n", encoding="utf-8")
    if given["plot"]:
        draw(made, Path(given["plot"]))
