"""``mechc study``: put one of the known questions to a model."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from .options import (
    PICTURES,
    Compiling,
    data_files,
    ending,
    files_here,
    input_option,
    model_argument,
    model_option,
    set_option,
)

if TYPE_CHECKING:
    from ..api import Model
    from ..runtime.settings import QuestionSetting
    from ..runtime.studies.study import Answer
    from ..runtime.studies.table import Kind

ANSWERS = (".json", ".npz", ".csv", ".mat")
METAVARS = {"time": "TIME", "number": "NUMBER", "count": "N", "text": "NAME", "names": "A,B"}
METAVARS |= {
    "place": 'start|equilibrium|"NAME=VALUE,..."',
    "directions": "A,B",
    "ranges": 'NAME="LOW .. HIGH"',
    "formula": "FORMULA",
    "formulas": '"A, B" or "P=A, Q=B"',
    "condition": "CONDITION",
    "surface": '"FORMULA = VALUE"',
    "interval": "TIME",
    "energy": "ENERGY",
    "free": 'A,B="LOW .. HIGH"',
    "amounts": 'NAME="AMOUNT"',
    "point": '"X, Y[, Z]"',
    "varying": '"NAME = LOW .. HIGH, COUNT"|"NAME ~ KIND(...)"|FILE.csv',
    "kept": '"max(A), final(B)"',
    "share": "all|none|SHARE",
    "matrix": '"{{A, B}, {B, C}}"',
    "seconds": "TIME",
    "cluster": "ADDRESS",
    "frequencies": '"LOW .. HIGH, COUNT"|"{A, B}"',
}


class Studies(click.Group):
    """A group with a command for each row of the table of studies."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        from ..runtime.studies.table import STUDIES

        return list(STUDIES)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        from ..runtime.studies.table import STUDIES

        return command_of(STUDIES[cmd_name]) if cmd_name in STUDIES else None

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        from ..runtime.studies.table import STUDIES
        from ..suggest import closest

        name = args[0]
        if name not in STUDIES and (name == "-" or name.endswith(".mech") or Path(name).is_file()):
            from .studies_of_file import command as of_file

            return name, of_file, args
        if name not in STUDIES and not name.startswith("-"):
            near = closest(name, list(STUDIES))
            hint = f" Did you mean '{near}'?" if near else f" There are {', '.join(STUDIES)}."
            ctx.fail(f"There is no study '{name}'.{hint}")
        return super().resolve_command(ctx, args)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        from ..runtime.studies.table import STUDIES

        with formatter.section("Studies"):
            formatter.write_dl([(kind.name, kind.asks) for kind in STUDIES.values()])


class Question(Compiling):
    """The command of a kind; it says why an option of a run is none of its own."""

    kind: Kind

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        try:
            return super().parse_args(ctx, args)
        except click.NoSuchOption as unknown:
            name = unknown.option_name.lstrip("-").removeprefix("no-").replace("-", "_")
            if name == "display":
                raise click.UsageError(
                    f"{unknown.option_name}: a study is told in SI, angles in rad; leave it out. A motion is shown in other "
                    "units by 'mechc run'.",
                    ctx,
                ) from None
            if said := self.kind.unused(name):
                raise click.UsageError(f"{unknown.option_name}: {said}; leave it out.", ctx) from None
            raise


@click.command(cls=Studies, name="study", no_args_is_help=True, short_help="Ask a question about a model.")
def command() -> None:
    """Ask a question about a model.

    \b
    mechc study virial kepler.mech --stop 200 --plot averages.png
    mechc study swing.mech                # the studies defined in the file, all or those named
    """


def command_of(kind: Kind) -> click.Command:
    """Make the command of one kind: its options are the settings of its question."""
    from ..runtime.settings import settings_of

    def run(file: str, **given: Any) -> int:
        from ..requests.parse_values import UsageMistake

        try:
            return _run(kind, file, given)
        except UsageMistake as mistake:
            raise click.UsageError(str(mistake)) from None

    made: Callable[..., Any] = run
    made = click.option(
        "--json", "as_json", is_flag=True, help="Print the answer as one JSON object, and nothing else."
    )(made)
    made = click.option(
        "-o",
        "--output",
        metavar="FILE",
        callback=ending(ANSWERS, "answers"),
        help="Write the answer as JSON (.json), or its arrays (.npz, .mat; .csv where they are columns).",
    )(made)
    made = click.option(
        "--plot",
        metavar="FILE",
        callback=ending(PICTURES, "pictures"),
        help="Draw the answer (png, pdf, svg).",
    )(made)
    for setting in reversed(settings_of(kind.question())):
        made = _option(setting)(made)
    made = input_option(set_option(made))
    made = click.option("--experiment", metavar="NAME", help="Which experiment of the model.")(made)
    made = click.command(cls=Question, name=kind.name, help=kind.asks)(model_argument(model_option(made)))
    made.kind = kind
    return made


def _option(setting: QuestionSetting) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    if setting.kind == "data":  # files follow the model
        return click.argument(
            setting.name, metavar="DATA.csv...", nargs=-1, callback=data_files, shell_complete=files_here
        )
    name = setting.option.replace("_", "-")
    if setting.kind == "flag":
        return click.option(f"--{name}/--no-{name}", setting.name, default=None, help=setting.description)
    return click.option(f"--{name}", setting.name, metavar=METAVARS[setting.kind], help=setting.description)


def _run(kind: Kind, file: str, given: dict[str, Any]) -> int:
    from ..api import load
    from ..presentation.answers import save, text
    from ..presentation.style import style_for
    from ..requests.request import asked
    from ..session import answer
    from .failures import code_of, show_warnings

    as_json, output, plot = given.pop("as_json"), given.pop("output"), given.pop("plot")
    model = load(file, model=given.pop("model"), set=given.pop("settings"))
    question = asked(kind.question(), given)
    if not as_json:
        show_warnings(model)
        _note_bare_angles(kind, model, given)
    found = answer(model.for_experiment(question.experiment), question)
    written = json.dumps({"study": kind.name, **found.summary()}, indent=1, ensure_ascii=False)
    if output:
        _write(found, written, Path(output))
        click.echo(f"wrote {output}", err=True)
    click.echo(written if as_json else text(found, style_for(sys.stdout)), color=True)
    if plot:
        save(found, Path(plot))
        click.echo(f"wrote {plot}", err=True)
    return code_of([found.outcome.value])


def _note_bare_angles(kind: Kind, model: Model, given: dict[str, Any]) -> None:
    """Say of bare numbers given for angles in a place that they are radians."""
    from ..requests.question import assignments
    from ..runtime.settings import settings_of
    from .failures import note_bare_angles

    for setting in settings_of(kind.question()):
        text = given.get(setting.name)
        if setting.kind == "place" and isinstance(text, str) and "=" in text:
            note_bare_angles(model, assignments(setting, text))


def _write(found: Answer, written: str, path: Path) -> None:
    """Write an answer: as JSON, or the arrays that it holds."""
    from ..requests.parse_values import UsageMistake
    from ..runtime.ensembles.result import Ensemble

    if path.suffix == ".json":
        path.write_text(written + "\n", encoding="utf-8")
        return
    if path.suffix in (".npz", ".csv") and isinstance(found, Ensemble):
        found.save(path)
        return
    arrays = getattr(found, "arrays", None)
    if not arrays:
        raise UsageMistake(
            f"this answer holds no arrays to write to '{path}'", "write it as JSON: -o FILE.json"
        )
    if path.suffix == ".npz":
        import numpy as np

        np.savez(path, **arrays)
    elif path.suffix == ".csv":
        _write_columns(arrays, path)
    else:
        from scipy.io import savemat

        savemat(path, dict(arrays))


def _write_columns(arrays: Mapping[str, Any], path: Path) -> None:
    """Write arrays of one length as columns; the name of a matrix stands for its columns."""
    import csv

    from ..requests.parse_values import UsageMistake

    lengths = {name: len(array) for name, array in arrays.items() if array.ndim in (1, 2)}
    if len(lengths) < len(arrays) or len(set(lengths.values())) != 1:
        raise UsageMistake(
            f"the arrays of this answer are not columns of one table: '{path}'",
            "write them to a file .npz or .mat",
        )
    columns = [
        (name if array.ndim == 1 else f"{name}[{k + 1}]", column)
        for name, array in arrays.items()
        for k, column in enumerate(array.reshape(len(array), -1).T)
    ]
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow([name for name, _ in columns])
        writer.writerows(zip(*(column.tolist() for _, column in columns), strict=True))
