"""``mechc run`` of a model of a curve: find it, and report what it is and how accurate."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ..requests.parse_values import UsageMistake
from .files_of_runs import beside, wrote

if TYPE_CHECKING:
    from ..api import Model
    from ..display import Display
    from ..runtime.studies.kinds.stationary import Curves

OF_MOTIONS = {
    "stop": "--stop",
    "start": "--start",
    "every": "--every",
    "step": "--step",
    "method": "--method",
    "inputs": "--input",
    "no_error_estimate": "--no-error-estimate",
    "sensitivity": "--sensitivity",
    "condition": "--condition",
    "constants": "--constants",
    "animate": "--animate",
    "snapshot": "--snapshot",
}
"""Options that mean something for a run in time only."""


def run_curve(model: Model, file: str, given: dict[str, Any], display: Display | None) -> int:
    """Find the curves of the experiments that were asked for; the exit code is that of the worst."""
    from ..curves import curves_of
    from .failures import code_of

    for name, option in OF_MOTIONS.items():
        if given[name] or given[name] == "":
            raise UsageMistake(f"{option} belongs to a motion, and '{model.name}' is a curve")
    if given["reproducible"]:
        raise UsageMistake(
            f"--reproducible fixes every operation of a motion, and '{model.name}' is a curve",
            "its equations are solved by the linear algebra of this machine: digits beyond the claimed error may differ",
        )
    experiments: list[str | None] = [given["experiment"]]
    if given["experiment"] == "all":
        experiments = [*model.experiments] or [None]
    objects: list[dict[str, Any]] = []
    outcomes: list[str] = []
    for experiment in experiments:
        found = curves_of(
            model.for_experiment(experiment), experiment, given["tolerance"], given["every_curve"]
        )
        outcomes.append(found.outcome.value)
        if given["as_json"]:
            objects += _objects(found, every=given["every_curve"])
        elif not given["quiet"]:
            _print(found, display, first=experiment is experiments[0])
        many = f"-{experiment or 'default'}" if len(experiments) > 1 else ""
        _write(found, given, file, many, display)
    if given["as_json"]:
        click.echo(json.dumps(objects[0] if len(objects) == 1 else objects, indent=1, ensure_ascii=False))
    return code_of(outcomes)


def _objects(found: Curves, *, every: bool) -> list[dict[str, Any]]:
    rows = []
    for point, solutions in zip(found.points, found.solutions, strict=True):
        row = solutions[0].summary() | ({"sweep": dict(point)} if point else {})
        if every:
            row["solutions"] = [s.summary() for s in solutions]
        rows.append(row)
    return rows


def _print(found: Curves, display: Display | None, *, first: bool) -> None:
    from ..presentation.curve_report import curve_report
    from ..presentation.style import style_for
    from .failures import write_to_nobody

    text = curve_report(found, display, style_for(sys.stdout))
    try:
        click.echo(("" if first else "\n") + text, color=True)
    except BrokenPipeError:
        write_to_nobody()


def _write(found: Curves, given: dict[str, Any], file: str, addition: str, display: Display | None) -> None:
    from ..requests.question import chosen_names, chosen_pairs, names_in

    every = [s for solutions in found.solutions for s in solutions]
    for i, solution in enumerate(every, start=1):
        digits = len(str(len(every)))
        number = addition + (f"-{i:0{digits}}" if len(every) > 1 else "")
        names = [*chosen_names(names_in(given["outputs"]), [*solution])] if given["outputs"] else []
        if given["output"]:
            path = beside(given["output"], number)
            solution.save(path, names or None, display.in_units if display else None)
            wrote(path, quiet=given["quiet"])
        if given["plot"] is not None:
            from ..presentation.curve_plots import save_curve

            path = beside(given["plot"] or f"{Path(file).stem}.png", number)
            pictured = given["pictured"]
            pairs = [*chosen_pairs(names_in(pictured), [*solution])] if pictured else names
            save_curve(solution, path, pairs, display)
            wrote(path, quiet=given["quiet"])
