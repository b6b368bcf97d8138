"""``mechc explain``: the page of an error, or what the compiler chose for a model."""

from __future__ import annotations

import re
import sys
from importlib.resources import files

import click

from .options import model_option, set_option

CODE = re.compile(r"[EWN]\d{4}")


@click.command(name="explain", short_help="Explain an error code, or what the compiler chose for a model.")
@click.argument("what", metavar="CODE|MODEL.mech")
@model_option
@set_option
def command(what: str, model: str | None, settings: dict[str, str]) -> None:
    """Explain CODE, such as E0301, with an example; or, for MODEL.mech, which form of the equations was
    chosen, what is needed and what was left out, why, and what that saved."""
    if CODE.fullmatch(what.upper()):
        click.echo(page(what.upper()))
        return
    from ..api import load
    from ..explanation import explanation
    from ..style import style_for

    click.echo(explanation(load(what, model=model, set=settings), style_for(sys.stdout)))


def page(code: str) -> str:
    """Return the text of an error page, with its examples indented instead of fenced."""
    folder = files("mechc") / "errors"
    path = folder / f"{code}.md"
    if not path.is_file():
        known = sorted(p.name.removesuffix(".md") for p in folder.iterdir() if p.name.endswith(".md"))
        near = [other for other in known if other[:3] == code[:3]]
        hint = f"; codes of this family: {', '.join(near)}" if near else ""
        raise click.UsageError(f"there is no message {code}{hint}")
    rows: list[str] = []
    fenced = False
    for row in path.read_text(encoding="utf-8").splitlines():
        if row.startswith("```"):
            fenced = not fenced
            continue
        rows.append(f"    {row}".rstrip() if fenced else row.removeprefix("# "))
    return "\n".join(rows).rstrip()
