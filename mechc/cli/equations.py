"""``mechc equations``: the equations of motion for people."""

from __future__ import annotations

from pathlib import Path

import click

from .options import Command, model_argument, model_option, no_model, set_option


@click.command(
    cls=Command, name="equations", short_help="Print the equations of motion, the Lagrangian and the momenta."
)
@model_argument
@model_option
@set_option
@click.option(
    "--format",
    "layout",
    type=click.Choice(["text", "latex", "html"]),
    default="text",
    show_default=True,
    help="Plain text, LaTeX, or a page for a browser.",
)
@click.option(
    "-o", "--output", metavar="FILE", callback=no_model, help="Write to a file instead of standard output."
)
def command(file: str, model: str | None, settings: dict[str, str], layout: str, output: str | None) -> None:
    """Print the equations of motion of MODEL.mech, its Lagrangian, the momenta, and which coordinates are
    cyclic."""
    from ..api import load

    compilation = load(file, model=model, set=settings).for_experiment(None).compilation
    from ..compiler.symbolic.layouts import write_equations

    text = write_equations(compilation.system, layout)
    if output is None:
        click.echo(text)
    else:
        Path(output).write_text(text + "\n", encoding="utf-8")
        click.echo(f"wrote {output}", err=True)
