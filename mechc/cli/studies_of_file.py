"""``mechc study FILE``: the studies that a file states."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import click

from .options import Compiling, ending, model_argument, model_option, set_option

if TYPE_CHECKING:
    from ..compiler.outline import StatedStudy


@click.command(cls=Compiling, name="FILE", short_help="Answer the studies that a file states.")
@model_argument
@click.argument("names", metavar="[NAME]...", nargs=-1)
@model_option
@set_option
@click.option("--list", "only_list", is_flag=True, help="List the studies of the file, and answer none.")
@click.option("--plots", metavar="FOLDER", help="Draw each answer to FOLDER/NAME.png.")
@click.option(
    "-o",
    "--output",
    metavar="FILE.json",
    callback=ending((".json",), "answers"),
    help="Write the answers as one JSON object.",
)
@click.option(
    "--json", "as_json", is_flag=True, help="Print the answers as one JSON object, and nothing else."
)
def command(
    file: str,
    names: tuple[str, ...],
    model: str | None,
    settings: dict[str, str],
    only_list: bool,
    plots: str | None,
    output: str | None,
    as_json: bool,
) -> int:
    """Answer the studies that FILE states, all of them or those named: study NAME = KIND(settings);"""
    from ..api import load
    from ..presentation.answers import save, text
    from ..presentation.style import style_for
    from ..requests.parse_values import UsageMistake, unknown_name
    from .failures import code_of, show_warnings

    loaded = load(file, model=model, set=settings)
    stated = loaded.studies
    if not stated:
        raise click.UsageError(
            f"'{loaded.name}' states no study: write 'study NAME = KIND(settings);' in it, or name a kind, as in "
            f"mechc study period {file}"
        )
    if unknown := [name for name in names if name not in stated]:
        raise click.UsageError(str(unknown_name("study", unknown[0], stated)))
    chosen = [stated[name] for name in names or stated]
    if not as_json:
        show_warnings(loaded)
        for one in chosen:
            given = ", ".join(f"{name} = {value}" for name, value in _as_written(one).items())
            click.echo(f"study {one.name} = {one.kind}({given})" + (f"  {one.doc}" if one.doc else ""))
    if only_list:
        if as_json:
            told = {
                one.name: {"study": one.kind, "settings": _as_written(one), "doc": one.doc} for one in chosen
            }
            click.echo(
                json.dumps({"model": loaded.name, "studies": told}, indent=1, ensure_ascii=False, default=str)
            )
        return 0
    answers, outcomes = {}, []
    for one in chosen:
        try:
            found = loaded.study(one.name)
        except UsageMistake as mistake:
            raise click.UsageError(f"study '{one.name}': {mistake}") from None
        answers[one.name] = {"study": one.kind, **found.summary()}
        outcomes.append(found.outcome.value)
        if plots is not None:
            Path(plots).mkdir(parents=True, exist_ok=True)
            save(found, Path(plots) / f"{one.name}.png")
        if not as_json:
            click.echo(f"\n{one.name}: {text(found, style_for(sys.stdout))}", color=True)
    written = json.dumps({"model": loaded.name, "studies": answers}, indent=1, ensure_ascii=False)
    if output:
        Path(output).write_text(written + "\n", encoding="utf-8")
    if as_json:
        click.echo(written)
    return code_of(outcomes)


def _as_written(study: StatedStudy) -> dict[str, object]:
    """Return the settings of a study by the words of the language."""
    from ..runtime.settings import settings_of
    from ..runtime.studies.table import STUDIES

    words = {setting.name: setting.option for setting in settings_of(STUDIES[study.kind].question())}
    return {words.get(name, name): value for name, value in study.settings.items()}
