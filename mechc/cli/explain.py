"""``mechc explain``: the page of an error, or what the compiler chose for a model."""

from __future__ import annotations

import json
import re
import sys
from importlib.resources import files
from typing import TYPE_CHECKING

import click

from .options import Command, files_here, model_option, set_option

if TYPE_CHECKING:
    from ..measurement.savings import Code

CODE = re.compile(r"([EWN])(\d{3,4})", re.IGNORECASE)
"""A code; a zero with which it begins may be left out."""
DIRECTIVE = re.compile(r"(run|compile): -|without: (compiler|ziglang)$")
"""Lines of a page that say how its example is run; they are for the tests."""


@click.command(
    cls=Command, name="explain", short_help="Explain an error code, or what the compiler chose for a model."
)
@click.argument("what", metavar="CODE|MODEL.mech", shell_complete=files_here)
@model_option
@set_option
@click.option(
    "--target",
    type=click.Choice(["c", "python", "fmu", "web"]),
    help="Measure what is saved in this target; C where there is a compiler.",
)
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object, and nothing else.")
def command(
    what: str, model: str | None, settings: dict[str, str], target: Code | None, as_json: bool
) -> None:
    """Explain CODE, such as E0301, with an example; or, for MODEL.mech, which form of the equations was chosen, what is needed, what was left out and why, and how much that saved compared with --keep-all."""
    if code := CODE.fullmatch(what):
        click.echo(page(f"{code[1].upper()}{code[2]:0>4}"))
        return
    if re.fullmatch(r"\d{3,4}", what):
        raise click.UsageError(f"a code begins with a letter: E{what:0>4} is an error, W{what:0>4} a warning")
    from ..api import load
    from ..measurement.explanation import as_run, explanation, summary
    from ..measurement.savings import savings
    from ..presentation.style import style_for
    from ..runtime.native.build import find_compiler

    loaded = load(what, model=model, set=settings).for_experiment(None)
    if loaded.compilation.equations.curve is not None:
        from ..presentation.curve_report import curve_explained

        rows = curve_explained(loaded.name, loaded.compilation.equations)
        text = json.dumps(rows, indent=1, ensure_ascii=False)
        click.echo(text if as_json else "\n".join(f"{k}: {v}" for k, v in rows.items()))
        return
    measured = target is not None or find_compiler() is not None
    ran = as_run(loaded)
    taken = ran.model
    saved = savings(taken, target or "c", measured=measured)
    style = style_for(sys.stdout)
    if as_json:
        found = summary(taken, saved, ran)
        if target == "fmu":
            from ..fmu.account import fmu_summary

            found |= {"fmu": fmu_summary(taken)}
        click.echo(json.dumps(found, indent=1, ensure_ascii=False))
        return
    click.echo(explanation(taken, style, saved, ran))
    if target == "fmu":
        from ..fmu.account import fmu_rows

        click.echo("\n" + "\n".join(fmu_rows(taken, style)))


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
        if fenced or not DIRECTIVE.match(row):
            rows.append(f"    {row}".rstrip() if fenced else row.removeprefix("# "))
    return "\n".join(rows).rstrip()
