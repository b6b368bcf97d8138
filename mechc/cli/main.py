"""Find the command, run it, and turn whatever happens into words and an exit code.

Exit codes: 0 done, 1 the model is wrong or the run failed, 2 wrong usage, 3 a run reached its end but is doubtful (its own
checks contradict its estimated error), 130 interrupted.
"""

from __future__ import annotations

import sys
import warnings
from collections.abc import Sequence
from importlib import import_module

import click

from .. import __version__
from .failures import explain_failure, say, write_to_nobody

COMMANDS = {
    "run": "Run a model and report how accurate the result is.",
    "study": "Ask a question about a model.",
    "fit": "Find parameters and starts from measured motions.",
    "report": "Write a document on a model: HTML or PDF.",
    "bench": "Measure error against run time, for methods and tolerances.",
    "stress": "Run a model under extremes; tell whether any answer is silently wrong.",
    "check": "Check models without running them.",
    "fmt": "Write models in the canonical layout.",
    "new": "Write a first model to start from.",
    "import": "Write a robot in URDF or MJCF as a model.",
    "init": "Print the consistent initial state of a model.",
    "equations": "Print the equations of motion, the Lagrangian and the momenta.",
    "explain": "Explain an error code, or what the compiler chose for a model.",
    "show": "Print a model as one stage of the compiler sees it.",
    "view": "Show a model move, on a page in the browser.",
    "compile": "Write a model as code, an FMU, a page, or for CasADi or JAX.",
    "fmu": "Check or run a Functional Mock-up Unit.",
    "lsp": "Answer an editor (language server).",
    "doctor": "Say what this installation can use, and what is missing.",
    "cache": "Show or clear the compiled code that is kept.",
}
"""The commands, each in the module of its name, with the line that ``--help`` shows (kept here so that
help imports no command)."""
MODULES = {"import": "importing"}
"""Modules of commands whose names a module cannot have."""


class Commands(click.Group):
    """A group whose commands are imported when they are used."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        if cmd_name not in COMMANDS:
            return None
        command: object = import_module(f".{MODULES.get(cmd_name, cmd_name)}", __package__).command
        assert isinstance(command, click.Command)
        return command

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        name = args[0]
        if not name.startswith("-") and name not in COMMANDS:
            from ..suggest import closest

            near = closest(name, list(COMMANDS))
            if name.endswith(".mech"):
                near = f"run {name}"
            hint = f" Did you mean 'mechc {near}'?" if near else ""
            ctx.fail(f"No such command '{name}'.{hint}")
        return super().resolve_command(ctx, args)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        with formatter.section("Commands"):
            formatter.write_dl(list(COMMANDS.items()))


@click.group(
    cls=Commands,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100},
    epilog="'mechc COMMAND --help' explains a command. A first run: mechc new pendulum, "
    "then mechc run pendulum.mech --plot",
)
@click.version_option(__version__, "--version", "-V", message="mechc %(version)s")
def mechc() -> None:
    """Compile and run models of mechanics: bodies, joints, constraints and energies."""


def run(arguments: Sequence[str] | None = None) -> int:
    """Run the command line and return the exit code."""
    with warnings.catch_warnings():
        warnings.showwarning = _say_warning
        return _run(arguments)


def _give_up_output() -> None:
    """Write what is still held back, or let it go: a full disk is told once."""
    try:
        sys.stdout.flush()
    except OSError:
        write_to_nobody()


def _say_warning(message: Warning | str, *_: object, **__: object) -> None:
    say("warning", str(message))


def _run(arguments: Sequence[str] | None) -> int:
    try:
        code = mechc.main(args=arguments, prog_name="mechc", standalone_mode=False)
        sys.stdout.flush()
    except BrokenPipeError:
        write_to_nobody()
        return 1
    except BaseException as error:
        code = explain_failure(error)
        _give_up_output()
        return code
    return code if isinstance(code, int) else 0
