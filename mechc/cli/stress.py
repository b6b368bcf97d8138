"""``mechc stress``: extremes made out of a model, and whether any answer is silently wrong."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from .options import Command, model_argument, model_option, no_model, set_option

if TYPE_CHECKING:
    from ..measurement.stress import Row


@click.command(
    cls=Command,
    name="stress",
    short_help="Run a model under extremes; tell whether any answer is silently wrong.",
)
@model_argument
@model_option
@set_option
@click.option("--experiment", metavar="NAME", help="Which experiment of the model.")
@click.option("--quick/--full", "quick", default=True, help="Few extremes (the default), or all of them.")
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
    well; an answer outside its claimed error is not: the exit code is then 1.
    """
    from ..measurement.stress import Subject, line_of, report, stress

    subject = Subject(
        str(Path(file)), given["model"], given["settings"], given["experiment"], given["seconds"]
    )
    aloud = given["json_file"] != "-"
    head = iter([line_of(None)])  # above the first row: there may be none

    def tell(row: Row) -> None:
        for line in (*head, line_of(row)):
            click.echo(line)

    made = stress(subject, full=not given["quick"], progress=tell if aloud else None)
    text = json.dumps(made.summary(), indent=1)
    if not aloud:
        click.echo(text)
        return int(made.silent)
    click.echo("\n" + report(made).rpartition("\n\n")[2])
    if given["json_file"]:
        Path(given["json_file"]).write_text(text + "\n", encoding="utf-8")
    return int(made.silent)
