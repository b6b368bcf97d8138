"""``mechc check``: say what is wrong with models, without running them."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import click

from .options import Command, files_here, model_option, set_option, verify_option

if TYPE_CHECKING:
    from ..api import Model
    from ..compiler.parts import Parts
    from ..lang.diagnostics import Diagnostic
    from ..lang.source import Span
    from ..runtime.outcome import SimulationError


@click.command(cls=Command, name="check", short_help="Check models without running them.")
@click.argument("files", nargs=-1, required=True, metavar="FILE...", shell_complete=files_here)
@model_option
@set_option
@verify_option
@click.option("--json", "as_json", is_flag=True, help="Print the diagnostics as JSON, for editors.")
@click.option(
    "--structure",
    "with_structure",
    is_flag=True,
    help="Also print bodies, joints, loops and degrees of freedom.",
)
@click.option("--quiet", "-q", is_flag=True, help="Print nothing about models that are right.")
def command(
    files: tuple[str, ...],
    model: str | None,
    settings: dict[str, str],
    as_json: bool,
    with_structure: bool,
    quiet: bool,
) -> int:
    """Check each FILE: syntax, names, units, mechanics, and whether its experiments can begin: settings, assembly, what
    holds at the first instant. Exit with 1 if a model is wrong."""
    from ..api import load
    from ..lang.diagnostics import CompileError
    from ..presentation.render import render
    from ..presentation.run_failure import render_error
    from ..presentation.style import style_for
    from ..start_check import impossible_starts
    from .failures import COMPLETED, FAILED, show_compile_error

    if as_json and with_structure:
        raise click.UsageError("--json holds the diagnostics and no structure: leave out one of them")
    found: list[Diagnostic] = []
    starts: list[SimulationError] = []
    wrong = 0
    for name in files:
        try:
            checked = load(name, model=model, set=settings)
        except CompileError as error:
            parts = None if model or settings else parts_in(name)
            if parts is not None:
                of_parts = [d for part in parts.parts for d in part.diagnostics]
                found.extend(of_parts)
                wrong += any(part.wrong for part in parts.parts)
                if of_parts and not as_json:
                    click.echo(render(of_parts, style_for(sys.stderr)), err=True, color=True)
                if not (quiet or as_json):
                    click.echo(f"{name}: {summary_of_parts(parts)}")
                continue
            wrong += 1
            found.extend(error.diagnostics)
            if not as_json:
                show_compile_error(error)
            continue
        found.extend(checked.diagnostics)
        impossible = impossible_starts(checked)
        wrong += bool(impossible)
        starts.extend(impossible)
        if as_json:
            continue
        if checked.diagnostics:
            click.echo(render(checked.diagnostics, style_for(sys.stderr)), err=True, color=True)
        for start in impossible:
            click.echo(render_error(start, style_for(sys.stderr)), err=True, color=True)
        if not quiet and not impossible:
            click.echo(f"{name}: {summary(checked)}")
        if with_structure:
            from ..presentation.structure import structure

            click.echo(structure(checked, style_for(sys.stdout)))
    if as_json:
        data = [*map(as_data, found), *map(start_as_data, starts)]
        click.echo(json.dumps(data, indent=1, ensure_ascii=False))
    return FAILED if wrong else COMPLETED


def summary(model: Model) -> str:
    """Describe a model in one line: ``Pendulum is right: 1 coordinate, 4 parameters``."""
    counts = [
        (len(model.coordinates), "coordinate"),
        (len(model.states), "first-order state"),
        (len(model.inputs), "input"),
        (len(model.parameters), "parameter"),
        (len(model.experiments), "experiment"),
    ]
    parts = [f"{n} {word}{'' if n == 1 else 's'}" for n, word in counts if n]
    return f"{model.name} is right: {', '.join(parts)}"


def parts_in(name: str) -> Parts | None:
    """Look at a file that holds no whole model."""
    from ..compiler.parts import parts_of
    from ..lang.read import read_model

    return parts_of(read_model(name), (Path(name).parent,))


def summary_of_parts(parts: Parts) -> str:
    """Describe a file of parts in one line: ``2 parts are right as far as they go alone: Rope, Jib``."""
    right = [part.name for part in parts.parts if not part.wrong]
    wrong = [part.name for part in parts.parts if part.wrong]
    told = []
    if wrong:
        told.append(f"{len(wrong)} of {len(parts.parts)} parts are wrong: {', '.join(wrong)}")
    elif right:
        told.append(
            f"{len(right)} {'part is' if len(right) == 1 else 'parts are'} right in names, units and shapes: {', '.join(right)}"
        )
    if parts.completed:
        told.append(f"checked where they are used: {', '.join(parts.completed)}")
    return "; ".join(told)


def as_data(diagnostic: Diagnostic) -> dict[str, object]:
    """Return a diagnostic as plain data; lines and columns count from 1, ends are exclusive."""
    return {
        "severity": diagnostic.severity.value,
        "code": diagnostic.code,
        "message": diagnostic.message,
        "caption": diagnostic.caption,
        "help": diagnostic.help,
        "place": place(diagnostic.span),
        "labels": [{"place": place(label.span), "text": label.text} for label in diagnostic.labels],
    }


def start_as_data(error: SimulationError) -> dict[str, object]:
    """Return what keeps a model from being assembled as plain data, in the form of a diagnostic."""
    at = error.origin
    end = None if at is None else at.column + len(at.text.strip())
    return {
        "severity": "error",
        "code": error.code,
        "message": error.message,
        "caption": "",
        "help": error.help,
        "place": None
        if at is None
        else {"file": at.file, "line": at.line, "column": at.column, "end_line": at.line, "end_column": end},
        "labels": [{"place": None, "text": note} for note in error.notes],
    }


def place(span: Span | None) -> dict[str, object] | None:
    if span is None:
        return None
    line, column = span.file.position(span.start)
    end_line, end_column = span.file.position(span.end)
    return {
        "file": span.file.name,
        "line": line,
        "column": column,
        "end_line": end_line,
        "end_column": end_column,
    }
