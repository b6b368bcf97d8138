"""``mechc fmu``: check and run Functional Mock-up Units, also of other tools."""

from __future__ import annotations

import sys
from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, TypeVar

import click

from .options import PICTURES, RESULTS, Command, ending, input_option, set_option

if TYPE_CHECKING:
    from ..compiler.targets.fmu.inspect import Report
    from ..solution import Solution

F = TypeVar("F", bound=Callable[..., object])

SECONDS, MEMORY = 120.0, 8.0

memory_option = click.option(
    "--memory",
    type=click.FloatRange(min=0, min_open=True),
    default=MEMORY,
    metavar="GB",
    help=f"Memory that the library may use (default: {MEMORY:g} GB).",
)


def seconds_option(what: str, default: float) -> Callable[[F], F]:
    """Give the option of how long a library may take."""
    return click.option(
        "--seconds",
        type=click.FloatRange(min=0, min_open=True),
        default=default,
        metavar="NUMBER",
        help=f"Longest time of {what} (default: {default:g} s).",
    )


ROWS = 11
COLUMNS = 6


@click.group(name="fmu", short_help="Check or run a Functional Mock-up Unit.")
def command() -> None:
    """Check or run a Functional Mock-up Unit made by mechc or another tool."""


@command.command(cls=Command, name="check", short_help="Check FMUs: by rule, binary and results.")
@click.argument(
    "files", metavar="FILE.fmu...", nargs=-1, required=True, type=click.Path(exists=True, dir_okay=False)
)
@click.option("--run/--no-run", default=True, help="Simulate each kind after the validation.")
@seconds_option("each stage of a check", SECONDS)
@memory_option
def check(files: tuple[str, ...], run: bool, seconds: float, memory: float) -> int:
    """Check FMUs: by the rules of the standard, against their binaries, and against the results they hold.

    A file is simulated in each of its kinds. Reference results are looked for in documentation/reference.csv
    and extra/org.fmi-standard.fmi-ls-ref/. The exit code is 1 if anything is wrong.

    The library in an FMU is a program of its author. It is loaded, even with --no-run, in a separate process that is limited in time and memory but has your permissions.
    """
    from pathlib import Path

    from ..fmu.guard import Limits, check_fmu

    limits = Limits(seconds, round(memory * 1e9))
    passed = True
    for i, file in enumerate(files):
        report = check_fmu(Path(file), run=run, limits=limits)
        if len(files) > 1:
            click.echo(("\n" if i else "") + file)
        _table(report)
        passed &= report.passed
    return 0 if passed else 1


def _table(report: Report) -> None:
    """Print one row for each line of a report."""
    from ..presentation.style import style_for

    style = style_for(sys.stdout)
    width = max(len(line.what) for line in report.lines)
    for line in report.lines:
        mark = style.green("ok  ") if line.passed else style.red("FAIL")
        rule = f" [{line.rule}]" if line.rule else ""
        click.echo(f"{mark}  {line.what:<{width}}  {line.detail}{rule}".rstrip())


@command.command(cls=Command, name="run", short_help="Simulate an FMU and show its outputs.")
@click.argument("file", metavar="FILE.fmu", type=click.Path(exists=True, dir_okay=False))
@click.option(
    "--kind", type=click.Choice(["me", "cs"]), help="Which kind to run; Co-Simulation where there is one."
)
@partial(set_option, bare="is in the unit of the file")
@input_option
@click.option("--stop", type=float, metavar="NUMBER", help="End of the run (default: that of the file).")
@click.option(
    "--every", type=float, metavar="NUMBER", help="Spacing of the output, and the communication step."
)
@click.option(
    "-o",
    "--output",
    metavar="FILE",
    callback=ending(RESULTS, "results"),
    help="Write all rows as CSV, NPZ or JSON.",
)
@click.option(
    "--plot",
    is_flag=False,
    flag_value="",
    metavar="[FILE]",
    callback=ending(PICTURES, "pictures"),
    help="Draw the results, to FILE or in a window.",
)
@click.option("--display", metavar="DEG,MM", default="", help="Units to show quantities in.")
@seconds_option("the run", 600.0)
@memory_option
def run(
    file: str,
    kind: str | None,
    settings: dict[str, str],
    inputs: dict[str, str],
    stop: float | None,
    every: float | None,
    output: str | None,
    plot: str | None,
    display: str,
    seconds: float,
    memory: float,
) -> None:
    """Simulate FILE.fmu through fmpy, in a process of its own; print a table of its outputs, draw or write them."""
    from pathlib import Path

    from ..fmu.guard import Limits
    from ..fmu.run import run_fmu
    from ..presentation.plots import has_display, save, show

    limits = Limits(seconds, round(memory * 1e9))
    solution = run_fmu(
        Path(file), kind=kind, stop=stop, every=every, values=settings, inputs=inputs, limits=limits
    )
    solution = solution.shown_in(display)
    _print(solution)
    if solution.message:
        click.echo(solution.message, err=True)
    if output:
        solution.save(output)
        click.echo(f"wrote {output}", err=True)
    if plot == "" and has_display():
        show(solution)
    elif plot is not None:
        picture = Path(plot or f"{Path(file).stem}.png")
        save(solution, picture)
        click.echo(f"wrote {picture}", err=True)


def _print(solution: Solution) -> None:
    """Print a few rows and columns in the units to show."""
    names = [q.name for q in (*solution.problem.states, *solution.problem.outputs)]
    shown = names[:COLUMNS]
    heads = ["time", *(f"{n} [{u}]" if (u := solution.shown_unit(n)[0]) else n for n in shown)]
    widths = [max(len(head), 14) for head in heads]
    click.echo("  ".join(head.rjust(width) for head, width in zip(heads, widths, strict=True)))
    for i in sorted({round(k * (len(solution.time) - 1) / (ROWS - 1)) for k in range(ROWS)}):
        cells = [solution.time[i], *(solution.shown(name)[i] for name in shown)]
        click.echo("  ".join(f"{cell:{width}.9g}" for cell, width in zip(cells, widths, strict=True)))
    if len(names) > len(shown):
        click.echo(f"{len(names) - len(shown)} more columns: -o FILE.csv writes all")
