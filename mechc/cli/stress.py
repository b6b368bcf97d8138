"""``mechc stress``: extremes made out of a model, and whether any answer is silently wrong."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from .failures import COMPLETED, DOUBTFUL, FAILED
from .options import Compiling, model_argument, model_option, no_model, set_option

if TYPE_CHECKING:
    from ..measurement.stress_table import Stress, StressRow

GROUPS = (
    "as stated",
    "twin",
    "parameter",
    "start",
    "sizes",
    "length",
    "tolerance",
    "method",
    "output",
    "target",
)


def _targets(ctx: click.Context, parameter: click.Parameter, text: str | None) -> tuple[str, ...]:
    from ..measurement.stress_targets import TARGETS

    named = tuple(part.strip() for part in text.split(",") if part.strip()) if text else ()
    for name in named:
        if name not in TARGETS:
            raise click.BadParameter(f"'{name}' is none of {', '.join(TARGETS)}", ctx, parameter)
    return named


@click.command(
    cls=Compiling,
    name="stress",
    short_help="Run a model under extremes; tell whether any answer is silently wrong.",
)
@model_argument
@model_option
@set_option
@click.option("--experiment", metavar="NAME", help="Which experiment of the model.")
@click.option("--quick/--full", "quick", default=True, help="Few extremes (the default), or all of them.")
@click.option(
    "--only",
    type=click.Choice(GROUPS),
    multiple=True,
    help="Only this group of runs; may be given several times.",
)
@click.option(
    "--target",
    "targets",
    metavar="A,B",
    callback=_targets,
    help="Compare what targets answer with the run, too: c, python, fmu, web, ensemble.",
)
@click.option("--seconds", type=float, default=5.0, show_default=True, help="How long one run may take.")
@click.option(
    "--json",
    "json_file",
    metavar="FILE",
    callback=no_model,
    help="Write the table as JSON; - for standard output alone.",
)
def command(file: str, **given: Any) -> int:
    """Run MODEL.mech with parameters, start, length, tolerance and method driven to extremes.

    Each run is compared with a reference in higher precision, or with another method. A refusal with its reason is
    well; an answer outside its claimed error is not: the exit code is then 1. Twins say the same mechanics otherwise,
    and must give the same motion: else, where starts beside the stated one lead elsewhere however near they are, or where the
    run as stated is doubtful itself, the exit code is 3.
    """
    from ..measurement.stress import Subject, stress
    from ..measurement.stress_table import line_of, report

    subject = Subject(
        str(Path(file)),
        given["model"],
        given["settings"],
        given["experiment"],
        given["seconds"],
        given["targets"],
    )
    aloud = given["json_file"] != "-"
    head = iter([line_of(None)])  # above the first row: there may be none

    def tell(row: StressRow) -> None:
        for line in (*head, line_of(row)):
            click.echo(line)

    made = stress(subject, full=not given["quick"], only=given["only"], progress=tell if aloud else None)
    text = json.dumps(made.summary(), indent=1)
    if not aloud:
        click.echo(text)
        return _code(made)
    click.echo("\n" + report(made).rpartition("\n\n")[2])
    if given["json_file"]:
        Path(given["json_file"]).write_text(text + "\n", encoding="utf-8")
    return _code(made)


def _code(made: Stress) -> int:
    if made.silent:
        return FAILED
    return DOUBTFUL if made.doubtful else COMPLETED
