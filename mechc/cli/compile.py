"""``mechc compile``: write a model as code."""

from __future__ import annotations

import click

from .options import model_argument, model_option, set_option


@click.command(name="compile", short_help="Write a model as Python or C code.")
@model_argument
@model_option
@set_option
@click.option(
    "--target",
    type=click.Choice(["python", "c"]),
    default="python",
    show_default=True,
    help="A Python module that needs only NumPy, or C11 with the kernel beside it.",
)
@click.option("-o", "--output", metavar="PATH", help="The module (python) or the folder (c).")
def command(file: str, model: str | None, settings: dict[str, str], target: str, output: str | None) -> None:
    """Write MODEL.mech as code that stands alone.

    \b
    mechc compile pendulum.mech --target python -o pendulum.py    # then: python pendulum.py
    mechc compile pendulum.mech --target c -o pendulum_c          # its files say how to build them
    """
    from ..api import load

    for path in load(file, model=model, set=settings).compile(target, output):
        click.echo(f"wrote {path}", err=True)
