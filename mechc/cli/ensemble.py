"""``mechc run --vary``: many runs of a model as one question, with one report, one file and one picture."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from .files_of_runs import wrote

if TYPE_CHECKING:
    from ..api import Model
    from ..runtime.ensembles.result import Ensemble

MAKING = ("time_limit", "workers", "cluster")
SETTINGS = (
    "vary",
    "keep",
    "samples",
    "seed",
    "sampling",
    "covariance",
    "errors",
    "threads",
    "lanes",
    "device",
    *MAKING,
)
FORMATS = (".nc", ".zarr", ".parquet")
"""Endings of files that ensembles have beside those of single runs."""
OF_ONE_RUN = {
    "animate": "a moving picture is of one run",
    "snapshot": "a picture of the motion is of one run",
    "sensitivity": "derivatives are of one run",
    "outputs": "'--keep' says what is kept of many runs",
    "every_curve": "'--all' is about curves",
    "display": "an ensemble is told in SI",
}


def ensemble_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Give a command the options of an ensemble; what they mean is read by the study of that name."""
    options = [
        click.option(
            "--vary",
            metavar="WHAT",
            help='Many runs: "l = 0.5 m .. 2 m, 200", "theta ~ normal(1 rad, 0.01 rad)", members.csv.',
        ),
        click.option(
            "--keep",
            metavar='"max(A), B"',
            help="What to keep of each of many runs: final, max, min, mean, rms, first(A < B), events(), lyapunov(time); a formula alone over time.",
        ),
        click.option("--samples", metavar="N", help="Number of random members."),
        click.option("--seed", metavar="N", help="Seed of the random numbers (default: 1)."),
        click.option("--sampling", metavar="NAME", help="plain, latin or sobol."),
        click.option(
            "--covariance", metavar='"{{A, B}, {B, C}}"', help="Covariance of normal distributions, in SI."
        ),
        click.option(
            "--errors",
            metavar="all|none|SHARE",
            help="Members whose error is estimated: all, none or a share (default: 0.05).",
        ),
        click.option("--threads", metavar="N", help="Threads of many runs (default: all processors)."),
        click.option(
            "--lanes",
            metavar="auto|on|off",
            help="Run members side by side in vectors; auto does so from 1000 members on.",
        ),
        click.option(
            "--device",
            metavar="opencl[:NAME]",
            help="Run members on a device, one per work item; needs 'pip install mechc[gpu]'.",
        ),
        click.option(
            "--time-limit", metavar="TIME", help="Longest wall-clock time of a member; a longer one fails."
        ),
        click.option(
            "--workers",
            metavar="N",
            help="Number of Dask worker processes to start on this machine.",
        ),
        click.option(
            "--cluster",
            metavar="ADDRESS",
            help="Dask scheduler whose workers run the members: tcp://HOST:8786.",
        ),
        click.option("--resume", is_flag=True, help="Continue an interrupted ensemble into the same file."),
    ]
    for option in reversed(options):
        command = option(command)
    return command


def is_ensemble(given: dict[str, Any], model: Model) -> bool:
    """Whether many runs are asked for: by an option, or by the experiment."""
    if given["resume"] or any(given[name] is not None for name in SETTINGS):
        return True
    return given["experiment"] != "all" and bool(model.ensemble_settings(given["experiment"]))


def run_ensemble(model: Model, file: str, given: dict[str, Any]) -> int:
    """Run all members, print their report, and write what was asked for; the exit code tells whether all were made."""
    from ..presentation.progress import Progress
    from ..requests.parse_values import UsageMistake
    from .failures import INTERRUPTED, say

    for name, why in OF_ONE_RUN.items():
        if given[name]:
            raise UsageMistake(f"{why}: leave --{name.replace('every_curve', 'all')} out")
    if given["pictured"]:
        raise UsageMistake("an ensemble is drawn by what --keep keeps", "leave the names after --plot out")
    if given["experiment"] == "all":
        raise UsageMistake("an ensemble is of one experiment", "name it, --experiment NAME")
    settings = {name: given[name] for name in SETTINGS if given[name] is not None}
    if given["no_error_estimate"]:
        settings["errors"] = "none"
    if given["output"]:
        settings |= {"store": given["output"], "resume": given["resume"]}
    elif given["resume"]:
        raise UsageMistake("--resume goes on with a file of results", "name it, -o FILE.npz")
    names = ("stop", "start", "every", "step", "tolerance", "method", "experiment", "inputs")
    with Progress(model.name, quiet=given["quiet"]) as progress:
        runs = model.ensemble(
            **settings,
            **{name: given[name] for name in names},
            reproducible=given["reproducible"] or None,
            progress=progress,
        )
    _report(runs, given)
    if given["output"]:
        runs.save(given["output"])
        wrote(given["output"], quiet=given["quiet"])
    if given["plot"] is not None:
        picture = given["plot"] or f"{Path(file).stem}.png"
        _draw(runs, picture)
        wrote(picture, quiet=given["quiet"])
    if not runs.complete:
        kept = f"; --resume goes on from {runs.counts().get('not made', 0)} left" if given["output"] else ""
        say(
            "warning",
            f"interrupted: {runs.counts().get('not made', 0)} of {len(runs)} members were not made{kept}",
        )
        return INTERRUPTED
    return 0


def _report(runs: Ensemble, given: dict[str, Any]) -> None:
    from ..presentation.ensemble import report
    from ..presentation.style import style_for

    if given["as_json"]:
        import json

        click.echo(json.dumps(runs.summary(), indent=1, ensure_ascii=False))
    elif not given["quiet"]:
        click.echo(report(runs, style_for(sys.stdout)), color=True)


def _draw(runs: Ensemble, picture: str) -> None:
    runs.plot(picture)
