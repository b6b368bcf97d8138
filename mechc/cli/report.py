"""``mechc report``: one document on a model, to be read, printed and sent."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import Any

import click

from .failures import code_of, show_warnings
from .options import Compiling, ending, input_option, model_argument, model_option, set_option

DOCUMENTS = (".html", ".pdf")


@click.command(cls=Compiling, name="report", short_help="Write a document on a model: HTML or PDF.")
@model_argument
@click.argument("studies", metavar="[STUDY]...", nargs=-1)
@model_option
@set_option
@input_option
@click.option("--experiment", metavar="NAME", help="Whose settings are used (default: the first).")
@click.option("--stop", metavar="TIME", help='When to stop: "10 s", "2 min"; a bare number is seconds.')
@click.option(
    "--tolerance", type=float, metavar="NUMBER", help="Relative tolerance of a step (default: 1e-8)."
)
@click.option("--method", metavar="NAME", help="Method of integration, as for 'mechc run'.")
@click.option(
    "-o",
    "--output",
    metavar="FILE.html|pdf",
    callback=ending(DOCUMENTS, "reports"),
    help="File for the report (default: MODEL.html).",
)
def command(
    file: str,
    studies: tuple[str, ...],
    model: str | None,
    settings: dict[str, str],
    inputs: dict[str, Any],
    output: str | None,
    **given: Any,
) -> int:
    """Write a report on MODEL.mech: outcome, largest forces with where and when, accuracy and checks, pictures, the page that
    moves (HTML), the studies that the file states or those named, equations, the text, and the command that repeats it.

    \b
    mechc report loader.mech -o loader.pdf
    mechc report pendulum.mech modes equilibria --set l="80 cm"
    """
    from ..api import load
    from ..document.contents import contents
    from ..exporting import stem_of

    loaded = load(file, model=model, set=settings)
    show_warnings(loaded)
    path = Path(output or f"{stem_of(loaded)}.html")
    words = ["mechc", "report", file, *studies]
    words += ["--model", model] if model else []
    for name, value in settings.items():
        words += ["--set", f"{name}={value}"]
    for name, value in inputs.items():
        words += ["--input", f"{name}={value}"]
    for name, value in given.items():
        words += [f"--{name}", str(value)] if value is not None else []
    document, outcome = contents(
        loaded, shlex.join([*words, "-o", str(path)]), studies, inputs=inputs, **given
    )
    if path.suffix == ".pdf":
        from ..document.pdf import write
    else:
        from ..document.html import write
    write(document, path)
    click.echo(f"wrote {path}", err=True)
    return code_of([outcome])
