"""``mechc fmu``: check and run Functional Mock-up Units, also of other tools."""

from __future__ import annotations

import click


@click.group(name="fmu", short_help="Check or run a Functional Mock-up Unit.")
def command() -> None:
    """Check or run a Functional Mock-up Unit, of this compiler or of another tool."""


@command.command(name="check")
@click.argument("file", type=click.Path(exists=True, dir_okay=False))
@click.option("--run/--no-run", default=True, help="Simulate each kind after the validation.")
def check(file: str, run: bool) -> int:
    """Validate FILE.fmu by the rules of the standard, compare it with its binary, and simulate it."""
    from pathlib import Path

    from ..compiler.targets.fmu.inspect import inspect

    report = inspect(Path(file), run=run)
    for line in report.lines:
        mark = "ok   " if line.passed else "FAIL "
        click.echo(f"{mark} {line.what}" + (f": {line.detail}" if line.detail else ""))
    return 0 if report.passed else 1


@command.command(name="run")
@click.argument("file", type=click.Path(exists=True, dir_okay=False))
@click.option("--kind", type=click.Choice(["me", "cs"]), default="cs", show_default=True)
@click.option("--stop", type=float, help="End of the run in s (default: that of the file).")
@click.option("-o", "--output", metavar="FILE.csv", help="Write all rows.")
def run(file: str, kind: str, stop: float | None, output: str | None) -> None:
    """Simulate FILE.fmu through fmpy and print a table of its outputs."""
    from ..compiler.targets.fmu.inspect import simulate

    result = simulate(file, kind, stop)
    names = list(result.dtype.names or ())
    if output:
        with open(output, "w", encoding="utf-8", newline="\n") as target:
            target.write(",".join(names) + "\n")
            target.writelines(",".join(repr(float(v)) for v in row) + "\n" for row in result)
    shown = names[:7]
    click.echo("  ".join(f"{name:>15}" for name in shown))
    for i in sorted({round(k * (len(result) - 1) / 10) for k in range(11)}):
        click.echo("  ".join(f"{float(result[name][i]):15.9g}" for name in shown))
    if len(names) > len(shown):
        click.echo(f"{len(names) - len(shown)} more columns: -o FILE.csv writes all")
