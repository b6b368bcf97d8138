"""Options that several commands share."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click

if TYPE_CHECKING:
    from click.shell_completion import CompletionItem

F = TypeVar("F", bound=Callable[..., Any])

RESULTS = (".csv", ".npz", ".json")
PICTURES = (".png", ".pdf", ".svg")
MOVING = (".mp4", ".gif", ".webp")
"""Endings of files that commands write, here as well so that they are refused before a run and not after it."""


class Command(click.Command):
    """A command that refuses to be told one thing twice: the first would be dropped without a word."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        if ctx.resilient_parsing:
            return super().parse_args(ctx, args)  # a shell completes what is not all there yet
        _, spare, order = self.make_parser(ctx).parse_args(list(args))
        if spare:
            raise click.UsageError(
                f"unexpected '{' '.join(spare)}'; a value with blanks stands in quotes, as in l=\"80 cm\"",
                ctx,
            )
        for parameter in order:
            if not isinstance(parameter, click.Option) or parameter.multiple or parameter.count:
                continue
            if parameter.is_flag and not parameter.secondary_opts:
                continue
            if order.count(parameter) > 1:
                names = "/".join((*parameter.opts, *parameter.secondary_opts))
                lists = "," in (parameter.metavar or "")
                what = f"write all in one text, {parameter.opts[-1]} A,B" if lists else "leave one out"
                raise click.UsageError(f"{names} is given twice; {what}.", ctx)
        return super().parse_args(ctx, args)


class Compiling(Command):
    """A command that compiles C, and tells people at a terminal so where they have to wait for it."""

    def invoke(self, ctx: click.Context) -> Any:
        from ..presentation.progress import building

        asked = ctx.params
        silent = asked.get("quiet") or asked.get("as_json") or asked.get("json_file") == "-"
        with building(quiet=bool(silent)):
            return super().invoke(ctx)


def method_names(_: click.Context, __: click.Parameter, begun: str) -> list[str]:
    """Name the methods that begin so, for shells."""
    from ..runtime.methods import KERNEL_METHODS

    return [name for name in ("auto", *KERNEL_METHODS) if name.startswith(begun)]


READING = "mechc.reading"
"""Where a context keeps what is said of how tables are read."""


def _said_of_reading(ctx: click.Context, parameter: click.Parameter, value: Any) -> None:
    if value not in (None, "", 0):
        ctx.meta.setdefault(READING, {})[parameter.name] = value


def read_as_said(ctx: click.Context, files: list[str]) -> list[Any]:
    """Return files with what is said of how they are read."""
    said = ctx.meta.get(READING)
    if not said:
        return list(files)
    from ..requests.parse_values import UsageMistake
    from ..requests.tables import table_file

    try:
        return [table_file(file, **said) for file in files]
    except UsageMistake as mistake:
        raise click.UsageError(str(mistake), ctx) from None


def data_files(ctx: click.Context, parameter: click.Parameter, files: tuple[str, ...]) -> tuple[Any, ...]:
    """Take the files after a model, read as is said."""
    return tuple(read_as_said(ctx, list(files)))


def _input_files(ctx: click.Context, parameter: click.Parameter, texts: tuple[str, ...]) -> dict[str, Any]:
    given = _assignments(ctx, parameter, texts)
    if not given and ctx.meta.get(READING) and not any(p.name == "data" for p in ctx.command.params):
        named = ", ".join(f"--{name}" for name in ctx.meta[READING])
        raise click.UsageError(f"{named}: there is no table to read; --input NAME=FILE.csv names one.", ctx)
    return dict(zip(given, read_as_said(ctx, list(given.values())), strict=True))


def _assignments(ctx: click.Context, parameter: click.Parameter, texts: tuple[str, ...]) -> dict[str, str]:
    """Turn ``name=value`` texts into a mapping; a name that is given twice is refused."""
    from ..requests.parse_values import UsageMistake, split_assignment

    example = "push=push.csv" if parameter.name == "inputs" else 'l="80 cm"'
    given: dict[str, str] = {}
    try:
        for name, value in map(split_assignment, texts):
            if name in given:
                raise UsageMistake(f"'{name}' is given twice: {given[name]} and {value}")
            given[name] = value
    except UsageMistake as mistake:
        raise click.BadParameter(
            f"{mistake.message}; as in {parameter.opts[0]} {example}", ctx, parameter
        ) from None
    return given


def no_model(ctx: click.Context, parameter: click.Parameter, value: str | None) -> str | None:
    """Refuse to write over a model."""
    if value and Path(value).suffix.lower() == ".mech":
        raise click.BadParameter(f"{value} is a model: write it before {parameter.opts[0]}", ctx, parameter)
    return value


def ending(endings: tuple[str, ...], what: str) -> Any:
    """Make a check that a file has one of the endings."""

    def check(ctx: click.Context, parameter: click.Parameter, value: str | None) -> str | None:
        no_model(ctx, parameter, value)
        if value and Path(value).suffix.lower() not in endings:
            meant = (
                "" if "." in value or parameter.name != "output" else "; names of quantities go to --outputs"
            )
            raise click.BadParameter(
                f"{what} go to a file that ends in {', '.join(endings)}{meant}", ctx, parameter
            )
        if value and not (folder := Path(value).parent).is_dir():
            raise click.BadParameter(f"there is no folder '{folder}'", ctx, parameter)
        return value

    return check


OTHER_FILES = (
    ".jpg",
    ".jpeg",
    ".gif",
    ".bmp",
    ".tif",
    ".tiff",
    ".webp",
    ".mp4",
    ".eps",
    ".txt",
    ".csv",
    ".json",
    ".npz",
    ".html",
    ".mech",
)
"""Endings that are not names of quantities."""


def asked_plots(
    ctx: click.Context, parameter: click.Parameter, values: tuple[str, ...]
) -> tuple[str | None, str]:
    """Return the file of a picture ("" for a window, None for no picture) and the quantities that are asked for.

    What has the ending of a picture, or looks like a path, is a file; all else are names.
    """
    if not values:
        return None, ""
    files = [
        v for v in values if Path(v).suffix.lower() in (*PICTURES, *OTHER_FILES) or "/" in v or "\\" in v
    ]
    if len(files) > 1:
        raise click.BadParameter(f"one file is enough, and there are {len(files)}", ctx, parameter)
    names = [v for v in values if v and v not in files]
    check = ending(PICTURES, "pictures")
    for value in names:
        no_model(ctx, parameter, value)
    return (check(ctx, parameter, files[0]) if files else ""), ",".join(names)


def files_here(ctx: click.Context, parameter: click.Parameter, incomplete: str) -> list[CompletionItem]:
    """Let the shell complete the name of a file."""
    from click.shell_completion import CompletionItem

    return [CompletionItem(incomplete, type="file")]


def model_argument(function: F) -> F:
    """The file of a model; whether it can be read is told by the compiler in its own words."""
    return click.argument("file", metavar="MODEL.mech", shell_complete=files_here)(function)


def model_option(function: F) -> F:
    return click.option(
        "--model", metavar="NAME", help="Which model of the file (default: the last that can be run)."
    )(function)


def set_option(function: F, *, bare: str = "is SI") -> F:
    """Add ``--set``; ``bare`` says what a number without unit means."""
    return click.option(
        "--set",
        "settings",
        metavar="NAME=VALUE",
        multiple=True,
        callback=_assignments,
        help=f'Change a parameter or an initial value: --set l="80 cm". A bare number {bare}. May be repeated.',
    )(function)


def input_option(function: F) -> F:
    """Add ``--input``, and what says how tables are read."""
    said = [
        click.option(
            "--columns",
            metavar='"HEAD = NAME, ..."',
            help='Names for columns of tables whose headers differ: "Kraft [kN] = force, Zeit = time".',
            **_READING_OPTION,
        ),
        click.option(
            "--skip",
            type=click.IntRange(min=0),
            metavar="N",
            help="Skip this many lines at the top of tables.",
            **_READING_OPTION,
        ),
        click.option(
            "--separator",
            metavar="SIGN",
            help="Separator of columns in tables (default: detected): , ; | tab blank.",
            **_READING_OPTION,
        ),
        click.option(
            "--decimal",
            metavar="SIGN",
            help="Decimal separator in tables: . or ,",
            **_READING_OPTION,
        ),
    ]
    for option in reversed(said):
        function = option(function)
    return click.option(
        "--input",
        "inputs",
        metavar="NAME=FILE.csv",
        multiple=True,
        callback=_input_files,
        help="Drive an input by a table with a time column. May be repeated.",
    )(function)


_READING_OPTION: dict[str, Any] = {"is_eager": True, "expose_value": False, "callback": _said_of_reading}


def keep_all_option(function: F) -> F:
    return click.option(
        "--keep-all", is_flag=True, help="Also build parts that the equations do not need, for comparison."
    )(function)


def _verify(ctx: click.Context, parameter: click.Parameter, wanted: bool) -> None:
    if wanted:
        from ..compiler.verification import verifying

        ctx.with_resource(verifying())


def verify_option(function: F) -> F:
    """Verify the stages of every compilation until the command ends."""
    return click.option(
        "--verify",
        is_flag=True,
        expose_value=False,
        callback=_verify,
        help="Verify the result of each compiler stage, to find bugs of mechc.",
    )(function)


def kept(keep_all: bool) -> frozenset[str]:
    """Return the parts that ``--keep-all`` asks for."""
    if not keep_all:
        return frozenset()
    from ..compiler.equations.needs import EVERYTHING

    return EVERYTHING
