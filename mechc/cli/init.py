"""``mechc init``: the state in which a run begins."""

from __future__ import annotations

import sys

import click

from .options import Compiling, model_argument, model_option, set_option


@click.command(cls=Compiling, name="init", short_help="Print the consistent initial state of a model.")
@model_argument
@model_option
@click.option("--experiment", metavar="NAME", help="Which experiment of the model.")
@set_option
@click.option("--explain", is_flag=True, help="Also print what was wanted, and by how much it was moved.")
def command(
    file: str, model: str | None, experiment: str | None, settings: dict[str, str], explain: bool
) -> None:
    """Assemble MODEL.mech: find the positions nearest to the guesses (~) that fulfil all constraints and keep what
    is given (=), then the velocities; print them in SI."""
    from ..api import load
    from ..curves import check_motion
    from ..presentation.initial import initial_text
    from ..presentation.style import style_for

    loaded = load(file, model=model, set=settings)
    check_motion(loaded, "initial state")
    click.echo(initial_text(loaded, experiment, explain=explain, style=style_for(sys.stdout)))
