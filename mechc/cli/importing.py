"""``mechc import``: write a robot in another format as a model."""

from __future__ import annotations

import shutil
from pathlib import Path

import click

from .options import Command, files_here


def _of_a_model(ctx: click.Context, parameter: click.Parameter, value: str | None) -> str | None:
    if value and not value.endswith(".mech"):
        raise click.BadParameter(
            f"a model goes to a file that ends in .mech, not to '{value}'", ctx, parameter
        )
    if value and not Path(value).absolute().parent.is_dir():
        raise click.BadParameter(f"there is no folder '{Path(value).parent}'", ctx, parameter)
    return value


@click.command(cls=Command, name="import", short_help="Write a robot in URDF or MJCF as a model.")
@click.argument("file", metavar="FILE", shell_complete=files_here)
@click.option(
    "-o",
    "--output",
    metavar="FILE.mech",
    callback=_of_a_model,
    help="Where to write it (default: the current folder, under the name of FILE, without overwriting a file).",
)
@click.option(
    "--package",
    "packages",
    metavar="FOLDER",
    multiple=True,
    type=click.Path(exists=True, file_okay=False),
    help="A folder of ROS packages, or one of them, for the files of package://... May be repeated.",
)
@click.option("--floating/--fixed", default=False, help="Let the root move freely, or hold it in the world.")
@click.option(
    "--meshes",
    type=click.Choice(["link", "copy", "none"]),
    default="link",
    help="Draw the surfaces of files where they lie, of copies beside the model, or draw none.",
)
def command(file: str, output: str | None, packages: tuple[str, ...], floating: bool, meshes: str) -> None:
    """Write the robot of FILE as a model in the canonical layout.

    Links become bodies, joints those of the library, each with an input for its drive. Shapes touch where contacts = true. What
    the model does not hold is listed at its head, with the lines of FILE. 'mechc run FILE' does the same without writing it.
    """
    from ..lang.diagnostics import Reporter
    from ..lang.importing import Wishes, imported
    from ..lang.read import read_robot

    path, reporter = Path(file), Reporter()
    target = Path(output) if output else Path(f"{path.name.split('.')[0]}.mech")
    if not output and target.exists():
        raise click.UsageError(f"{target} exists and is left as it is; name another one: -o FILE.mech")
    text = read_robot(path, reporter)
    wishes = Wishes(path, target.absolute().parent, tuple(map(Path, packages)), floating, meshes)
    model = imported(text, wishes, reporter)
    for beside, source in model.copies.items():
        copy = target.absolute().parent / beside
        copy.parent.mkdir(exist_ok=True)
        shutil.copyfile(source, copy)
    target.write_text(model.text, encoding="utf-8")
    click.echo(f"wrote {target}", err=True)
    for remark in model.left_out:
        click.echo(f"  left out: {remark}", err=True)
