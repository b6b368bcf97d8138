"""``mechc show``: a model as one stage of the compiler sees it."""

from __future__ import annotations

import click

from .options import Command, model_argument, model_option, set_option, verify_option

STAGES = ("ast", "flat", "system", "equations", "program")


@click.command(cls=Command, name="show", short_help="Print a model as one stage of the compiler sees it.")
@click.argument("stage", type=click.Choice(STAGES))
@model_argument
@model_option
@set_option
@verify_option
def command(stage: str, file: str, model: str | None, settings: dict[str, str]) -> None:
    """Print MODEL.mech after a STAGE of the compiler.

    \b
    ast        the syntax, as a tree
    flat       without components, loops and inheritance; names, types and units resolved
    system     the mechanical system: coordinates, bodies, energies, forces, joints
    equations  the functions that will be computed, and the chosen forms
    program    their straight-line statements, in order
    """
    from ..presentation.stages import show

    click.echo(show(stage, file, model, settings))
