"""``mechc run``: run a model and report how accurate the result is."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from .ensemble import FORMATS, ensemble_options, is_ensemble
from .files_of_runs import beside, check_streamed, plot, show_motion, streamed_to, write
from .options import (
    MOVING,
    RESULTS,
    Compiling,
    asked_plots,
    ending,
    input_option,
    keep_all_option,
    kept,
    method_names,
    model_argument,
    model_option,
    set_option,
    verify_option,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

    from ..api import Model
    from ..display import Display
    from ..runtime.results.streamed import Streamed
    from ..runtime.studies.kinds.sweep import Runs
    from ..solution import Solution


@click.command(cls=Compiling, name="run", short_help="Run a model and report how accurate the result is.")
@model_argument
@model_option
@click.option(
    "--experiment", metavar="NAME|all", help="Which experiment of the model; all runs one after another."
)
@set_option
@input_option
@click.option("--stop", metavar="TIME", help='When to stop: "10 s", "2 min"; a bare number is seconds.')
@click.option(
    "--start",
    metavar="TIME",
    help="First output time; the motion begins at 0, or there if a table of an input does.",
)
@click.option("--every", metavar="TIME", help="Spacing of the output, instead of 500 points.")
@click.option("--step", metavar="TIME", help="Step of a fixed-step method.")
@click.option(
    "--tolerance", type=float, metavar="NUMBER", help="Relative tolerance of a step (default: 1e-8)."
)
@click.option(
    "--method",
    metavar="NAME",
    shell_complete=method_names,
    help="auto, dop853, radau5, taylor; with a fixed step rk4, gauss2 to gauss8, verlet, rattle, lobatto4, lobatto6, moreau.",
)
@click.option(
    "-o",
    "--output",
    metavar="FILE",
    callback=ending((*RESULTS, *FORMATS), "results"),
    help="Write results as CSV, NPZ or JSON; of many runs also as .nc, .zarr, .parquet.",
)
@click.option(
    "--streamed",
    is_flag=True,
    help="Write results during the run, and keep no points in memory.",
)
@click.option(
    "--sensitivity",
    metavar="A,B",
    help="Differentiate the motion with respect to these parameters, initial values and inputs.",
)
@click.option(
    "--condition",
    is_flag=True,
    help="Report how small changes of the start grow, and until when the results can be trusted.",
)
@click.option(
    "--constants",
    is_flag=True,
    help="Find constants of the motion, and check them along the run like the energy.",
)
@click.option(
    "--outputs",
    metavar="A,B",
    help="Quantities to write and draw, and whose derivatives to list (default: all). The report always shows them.",
)
@click.option(
    "--plot",
    "plots",
    is_flag=False,
    flag_value="",
    multiple=True,
    metavar="[FILE|A,B|A:B]",
    callback=asked_plots,
    help="Draw the motion, to FILE (png, pdf, svg) or in a window; of these quantities only: x,y over time, "
    '"tip[1]:tip[2]" one over another. May be given twice, with a file and with names.',
)
@click.option(
    "--animate",
    metavar="FILE",
    callback=ending(MOVING, "moving pictures"),
    help="Write a moving picture (mp4, gif, webp).",
)
@click.option(
    "--snapshot",
    metavar="T1,T2",
    help="Write one picture of the motion at several times (seconds), earlier ones paler: MODEL_snapshot.png.",
)
@click.option(
    "--display",
    metavar="DEG,MM",
    help="Units in which results are shown and written (default in files: SI).",
)
@click.option("--no-error-estimate", is_flag=True, help="Skip the second run, which estimates the error.")
@click.option(
    "--all", "every_curve", is_flag=True, help="For a model of a curve: search for further stationary curves."
)
@click.option("--reproducible", is_flag=True, help="Make results bit-for-bit the same on every machine.")
@ensemble_options
@keep_all_option
@verify_option
@click.option("--quiet", "-q", is_flag=True, help="Print nothing but errors.")
@click.option(
    "--json", "as_json", is_flag=True, help="Print the report as one JSON object, and nothing else."
)
def command(file: str, **given: Any) -> int:
    """Compile MODEL.mech, simulate it, and report how the run ended, what it cost, and how accurate it is.

    \b
    mechc run pendulum.mech --plot
    mechc run pendulum.mech --set l="80 cm" --set theta="10 deg" --stop "20 s" -o motion.csv
    mechc run pendulum.mech --vary "l = 0.5 m .. 2 m, 200" --keep "max(theta)" -o scan.npz --plot scan.png
    """
    from ..api import load
    from ..display import choose
    from ..requests.parse_values import UsageMistake

    given["plot"], given["pictured"] = given.pop("plots")
    shows = given["animate"] or given["snapshot"] or (given["plot"] is not None and not given["pictured"])
    try:
        display = choose(given["display"]) if given["display"] else None
        model = load(
            file,
            model=given["model"],
            set=given["settings"],
            keep=kept(given["keep_all"]) | ({"scene"} if shows else set()),
            remembered=True,
        )
        if not (given["quiet"] or given["as_json"]):
            from .failures import note_bare_angles, show_warnings

            show_warnings(model)
            note_bare_angles(model, given["settings"])
        if given["streamed"]:
            check_streamed(given["output"], curve=model.is_curve, many=is_ensemble(given, model))
        if model.is_curve:
            from .curve import run_curve

            return run_curve(model, file, given, display)
        if given["every_curve"]:
            raise UsageMistake(f"--all looks for further curves, and '{model.name}' is a motion")
        if is_ensemble(given, model):
            from .ensemble import run_ensemble

            return run_ensemble(model, file, given)
        if given["output"] and Path(given["output"]).suffix in FORMATS:
            raise UsageMistake(
                f"'{given['output']}' is for many runs; one is written as {', '.join(RESULTS)}"
            )
        names = _chosen_outputs(model, given["outputs"])
        _spare_inputs(given["output"], given["inputs"])
        given["pictured"] = _chosen_outputs(model, given["pictured"] or None, pairs=True) or names
        return _run_all(model, file, given, display, names)
    except UsageMistake as mistake:
        raise click.UsageError(str(mistake)) from None


def _spare_inputs(output: str | None, inputs: dict[str, str]) -> None:
    """Refuse to write results over a table that the run reads. Raises UsageMistake."""
    from ..requests.parse_values import UsageMistake

    for name, path in inputs.items():
        if output and Path(output).exists() and Path(path).exists() and Path(output).samefile(path):
            raise UsageMistake(f"the results would be written over '{path}', which holds the input '{name}'")


def _run_all(
    model: Model, file: str, given: dict[str, Any], display: Display | None, names: list[str]
) -> int:
    """Run the experiments that were asked for; the exit code is that of the worst."""
    from ..requests.parse_values import UsageMistake
    from .failures import INTERRUPTED, code_of, say

    experiments: list[str | None] = [given["experiment"]]
    if given["experiment"] == "all":
        experiments = [*model.experiments] or [None]
        if random := [name for name in model.experiments if model.ensemble_settings(name)]:
            raise UsageMistake(
                f"{', '.join(map(repr, random))} {'are' if len(random) > 1 else 'is'} many runs each",
                f"ask for one at a time: --experiment {random[0]}",
            )
    objects: list[dict[str, object]] = []
    outcomes: list[str] = []
    code = 0
    for experiment in experiments:
        try:
            many = f"-{experiment or 'default'}" if len(experiments) > 1 else ""
            streamed = (
                streamed_to(beside(given["output"], many), names, display) if given["streamed"] else None
            )
            sweep = _run_one(model, given, experiment, streamed)
        except KeyboardInterrupt:
            if experiment is experiments[0]:
                raise
            code = INTERRUPTED  # what the experiments before it gave is kept
            say("warning", f"interrupted before the experiment '{experiment}'")
            break
        for solution in sweep.solutions:
            solution.display = display or solution.display
            solution.angles = model.angles
            outcomes.append(solution.outcome.value)
        alone = len(sweep.solutions) == 1
        if alone and sweep.solutions[0].failure is not None and not given["as_json"]:
            _print_failure(sweep.solutions[0])  # before its report, whose last values may be beyond sense
        if given["as_json"]:
            objects += _objects(sweep, names)
        elif not given["quiet"]:
            _print_report(sweep, names, first=experiment is experiments[0])
        for i, solution in enumerate(sweep.solutions, start=1):
            digits = len(str(len(sweep.solutions)))  # so that names sort as the runs do
            addition = many + (f"-{i:0{digits}}" if len(sweep.solutions) > 1 else "")
            if solution.failure is not None and not alone and not given["as_json"]:
                _print_failure(solution)
            if given["streamed"]:
                if not given["quiet"]:
                    click.echo(f"wrote {beside(given['output'], many)}", err=True)
            elif given["output"]:
                write(solution, beside(given["output"], addition), names, display, quiet=given["quiet"])
            if given["plot"] is not None:
                picture = given["plot"] or f"{Path(file).stem}.png"
                plot(
                    solution,
                    beside(picture, addition),
                    given["pictured"],
                    window=not given["plot"],
                    quiet=given["quiet"],
                )
            if given["animate"] or given["snapshot"]:
                show_motion(solution, file, addition, given)
        code = code_of(outcomes)
        if not sweep.complete:
            code = INTERRUPTED
            say("warning", f"interrupted after {len(sweep.solutions)} runs; the others were not made")
        if code == INTERRUPTED:
            break
    if given["as_json"]:
        import json

        click.echo(json.dumps(objects[0] if len(objects) == 1 else objects, indent=1, ensure_ascii=False))
    return code


def _run_one(
    model: Model, given: dict[str, Any], experiment: str | None, streamed: Streamed | None
) -> Runs[Solution]:
    from ..presentation.progress import Progress

    with Progress(model.name, quiet=given["quiet"]) as progress:
        return model.sweep(
            stop=given["stop"],
            start=given["start"],
            every=given["every"],
            step=given["step"],
            tolerance=given["tolerance"],
            method=given["method"],
            experiment=experiment,
            inputs=given["inputs"],
            estimate_error=not given["no_error_estimate"],
            sensitivity=given["sensitivity"],
            condition=given["condition"],
            constants=given["constants"],
            reproducible=given["reproducible"],
            progress=progress,
            to=streamed,
        )


def _objects(sweep: Runs[Solution], names: Sequence[str]) -> list[dict[str, object]]:
    """Return the report of each run as plain data, with the swept values where there are any; derivatives of ``names``."""
    return [
        solution.summary(names or None) | ({"sweep": dict(point)} if point else {})
        for point, solution in zip(sweep.points, sweep.solutions, strict=True)
    ]


def _chosen_outputs(model: Model, text: str | None, *, pairs: bool = False) -> list[str]:
    """Return the names asked for; a vector's name stands for its elements. ``pairs``: ``a:b`` may stand among them."""
    if text is None:
        return []
    from ..requests.question import chosen_names, chosen_pairs, names_in

    equations = model.compilation.equations
    discretes = (entry for entry in equations.discretes if entry.kind != "mode")
    entries = (*equations.states, *equations.outputs, *equations.inputs, *discretes)
    known = [*dict.fromkeys(entry.name for entry in entries)]  # an account is a state and an output
    return [*(chosen_pairs if pairs else chosen_names)(names_in(text), known)]


def _print_report(sweep: Runs[Solution], names: Sequence[str], *, first: bool) -> None:
    from ..presentation.report import report
    from ..presentation.style import style_for
    from ..presentation.sweep_report import sweep_report
    from .failures import write_to_nobody

    style = style_for(sys.stdout)
    solution = sweep.solutions[0]
    text = sweep_report(sweep, style, names) if sweep.points[0] else report(solution, style, names)
    try:
        click.echo(("" if first else "\n") + text, color=True)
    except BrokenPipeError:  # results and pictures are still to be written
        write_to_nobody()


def _print_failure(solution: Solution) -> None:
    from ..presentation.run_failure import render_failure
    from ..presentation.style import style_for

    click.echo(render_failure(solution, style_for(sys.stderr)), err=True, color=True)
