"""The files that ``mechc run`` writes of one run."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from ..display import Display
    from ..runtime.results.streamed import Streamed
    from ..solution import Solution


def check_streamed(output: str | None, *, curve: bool, many: bool) -> None:
    """Refuse to write while a run goes on what has no points that come one after the other. Raises UsageMistake."""
    from ..requests.parse_values import UsageMistake

    if curve or many:
        what = "a curve is found as a whole" if curve else "many runs are kept by what --keep names"
        raise UsageMistake(
            f"--streamed writes the points of one motion while it is made, and {what}", "leave it out"
        )
    if not output:
        raise UsageMistake(
            "--streamed writes results while a run goes on, and nothing says into which file",
            "name it: --output motion.csv --streamed",
        )


def streamed_to(path: Path, names: list[str], display: Display | None) -> Streamed:
    from ..runtime.results.streamed import Streamed

    return Streamed(path, names or None, display.in_units if display else None)


def beside(file: str, addition: str) -> Path:
    """Put the name of an experiment before the ending of a file."""
    path = Path(file)
    return path.with_name(f"{path.stem}{addition}{path.suffix}")


def wrote(path: Path | str, *, quiet: bool) -> None:
    """Say that a file was written."""
    if not quiet:
        click.echo(f"wrote {path}", err=True)


def write(solution: Solution, path: Path, names: list[str], display: Display | None, *, quiet: bool) -> None:
    """Write results in SI, or in the units of --display."""
    solution.save(path, names or None, display.in_units if display else None)
    if not quiet:
        click.echo(f"wrote {path}", err=True)


def show_motion(solution: Solution, file: str, addition: str, given: dict[str, Any]) -> None:
    """Write the moving picture and the stroboscopic one that were asked for."""
    from ..presentation.animation import animate, snapshot
    from ..requests.parse_values import UsageMistake

    written: list[Path] = []
    if given["animate"]:
        written.append(beside(given["animate"], addition))
        animate(solution, written[-1])
    if given["snapshot"]:
        try:
            times = [float(part) for part in given["snapshot"].split(",")]
        except ValueError:
            raise UsageMistake(
                f"'{given['snapshot']}' is not a list of times", "as in --snapshot 0,0.5,1, in seconds"
            ) from None
        written.append(beside(f"{Path(file).stem}_snapshot.png", addition))
        snapshot(solution, written[-1], times)
    if not given["quiet"]:
        for path in written:
            click.echo(f"wrote {path}", err=True)


def plot(solution: Solution, path: Path, names: list[str], *, window: bool, quiet: bool) -> None:
    """Open a window if that is wanted and possible, else write the picture."""
    from ..presentation.plots import has_display, save, show

    if window and has_display():
        show(solution, names)
        return
    save(solution, path, names)
    if not quiet:
        click.echo(f"wrote {path}", err=True)
