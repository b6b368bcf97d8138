"""``mechc view``: a model that moves, on a page in the browser."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import click

from .failures import show_warnings
from .options import Compiling, input_option, model_argument, model_option, no_model, set_option


@click.command(cls=Compiling, name="view", short_help="Show a model move, on a page in the browser.")
@model_argument
@model_option
@set_option
@input_option
@click.option(
    "--experiment", metavar="NAME", help="Experiment whose settings are shown (default: the first)."
)
@click.option(
    "-o",
    "--output",
    metavar="FILE",
    callback=no_model,
    help="File for the page (default: a temporary file).",
)
@click.option("--recorded", is_flag=True, help="Record one motion instead of the model, without sliders.")
@click.option("--no-open", is_flag=True, help="Write the page without opening it.")
def command(
    file: str,
    model: str | None,
    settings: dict[str, str],
    inputs: dict[str, Any],
    experiment: str | None,
    output: str | None,
    recorded: bool,
    no_open: bool,
) -> None:
    """Show MODEL.mech in motion: picture, curves, phase portrait, energy, estimated error, and sliders that rerun the model.

    The page is one file that needs no network and no server; ``mechc compile --target web`` writes the same one.

    \b
    mechc view pendulum.mech
    mechc view pendulum.mech --set l="80 cm"
    mechc view cart.mech --input push=measured.csv
    """
    from ..api import load
    from ..exporting import stem_of
    from ..requests.parse_values import UsageMistake
    from ..web.write import open_page, write_page
    from .failures import say

    try:
        loaded = load(file, model=model, set=settings, keep={"scene"})
        show_warnings(loaded)
        folder = Path(tempfile.gettempdir()) / "mechc-pages"
        path = write_page(
            loaded,
            output or folder / f"{stem_of(loaded)}.html",
            recorded=recorded,
            experiment=experiment,
            inputs=inputs,
        )
    except UsageMistake as mistake:
        raise click.UsageError(str(mistake)) from None
    click.echo(f"wrote {path}", err=True)
    if not no_open and not open_page(path):
        say("note", "no browser was found here", f"open {path.resolve()} in one, on this machine or another")
