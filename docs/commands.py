"""Make docs/commands.md, the reference of the command line, and the tables of settings in docs/studies.md from the commands
themselves: ``python docs/commands.py``."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from pathlib import Path

import click

from mechc.cli import failures
from mechc.cli.main import COMMANDS, mechc

HERE = Path(__file__).resolve().parent

HEAD = """# Commands

Every command with its options, the exit codes, and the environment variables. `mechc COMMAND --help` says the same. Made from
the commands by `python docs/commands.py`.

An option that takes a value is written `--stop 10` or `--stop=10`; values with a blank are quoted, `--stop "10 s"`. An option
that is given twice is refused, but where it may be repeated.
"""

SETTINGS = "| setting | |\n|---|---|"
"""The head of the tables that are made in docs/studies.md."""

CODES = (
    (failures.COMPLETED, "done; a run completed, or was ended by its `terminate`"),
    (failures.FAILED, "the model is wrong, the run failed, or a check found something"),
    (failures.USAGE, "wrong usage: an option, a name or a value that does not fit"),
    (failures.DOUBTFUL, "a run is [doubtful](accuracy.md#doubtful-runs): its checks contradict its errors"),
    (failures.INTERRUPTED, "interrupted by Ctrl-C or SIGTERM"),
)

VARIABLES = {
    "MECHC_CACHE": "folder below which compiled code is kept, instead of the user's cache folder",
    "MECHPATH": "folders in which `import` looks for models, after that of the model itself",
    "CC": "the C compiler, with its options; `libtcc`: the one that comes with mechc",
    "PATH": "where `cc`, `gcc`, `clang` are looked for without `CC`",
    "NO_COLOR": "no colours",
    "FORCE_COLOR": "colours without a terminal, too",
    "TERM": "`dumb`: no colours",
    "DISPLAY": "without it and `WAYLAND_DISPLAY` (Linux), `--plot` writes a file instead of opening a window",
    "WAYLAND_DISPLAY": "as `DISPLAY`",
    "MECHC_DEBUG": "show the traceback of a bug of mechc instead of writing it to a file",
    "OPENBLAS_NUM_THREADS": "threads of NumPy's algebra; 1 without it, as its matrices are small here",
}


def page() -> str:
    """Return the text of commands.md: a section for each command, then exit codes and variables."""
    root = click.Context(mechc, info_name="mechc")
    lines = [HEAD, "\n| command | |\n|---|---|\n"]
    lines += [f"| [`{name}`](#mechc-{name}) | {says} |\n" for name, says in COMMANDS.items()]
    for name in COMMANDS:
        command = mechc.get_command(root, name)
        assert command is not None
        lines += _sections(command, click.Context(command, root, info_name=name))
    lines.append("\n## Exit codes\n\n| code | |\n|---|---|\n")
    lines += [f"| {code} | {says} |\n" for code, says in CODES]
    lines.append("\n## Environment variables\n\n| variable | |\n|---|---|\n")
    lines += [f"| `{name}` | {says} |\n" for name, says in VARIABLES.items()]
    return "".join(lines)


def _sections(command: click.Command, context: click.Context, told: Sequence[str] = ()) -> Iterator[str]:
    """Write the section of a command and those of the commands in it, without the rows that are told above."""
    level = "###" if context.parent and context.parent.parent else "##"
    usage = " ".join([context.command_path, *command.collect_usage_pieces(context)])
    yield f"\n{level} {context.command_path}\n\n```\n{usage}\n```\n\n{_help(command.help or '')}\n"
    inner = {}
    if isinstance(command, click.Group):
        found = {name: command.get_command(context, name) for name in command.list_commands(context)}
        inner = {name: one for name, one in found.items() if one is not None}
    every = [_rows(one, context) for one in inner.values()]
    shared = [row for row in every[0] if all(row in rows for rows in every)] if every else []
    if shared:
        yield "\nOptions of all of them:\n"
    if rows := [row for row in (*_rows(command, context), *shared) if row not in told]:
        yield "\n| option | |\n|---|---|\n"
        yield from rows
    if command.name == "study":
        yield "\nThose of each study are in its section of [studies](studies.md).\n"
        return
    for name, one in inner.items():
        yield from _sections(one, click.Context(one, context, info_name=name), shared)


def studies(text: str) -> str:
    """Return the text of studies.md with the settings of each study at the end of its section."""
    root = click.Context(mechc, info_name="mechc")
    group = mechc.get_command(root, "study")
    assert isinstance(group, click.Group)
    context = click.Context(group, root, info_name="study")
    rows = {}
    for name in group.list_commands(context):
        command = group.get_command(context, name)
        assert command is not None
        rows[name] = _rows(command, context)
    shared = [row for row in rows["simulate"] if all(row in others for others in rows.values())]
    of_a_run = [row for row in rows["virial"] if row in rows["simulate"] and row not in shared]
    head, *parts = re.split(r"^(?=## )", text, flags=re.MULTILINE)
    for k, part in enumerate(parts):
        name = part.partition("\n")[0].removeprefix("## ")
        if name not in rows:
            continue
        all_of_a_run = set(of_a_run) <= set(rows[name]) and name != "simulate"
        own = [row for row in rows[name] if row not in (shared + of_a_run if all_of_a_run else shared)]
        run = ["| those of a [run](#simulate) | |\n"] if all_of_a_run else []
        table = "".join([f"{SETTINGS}\n", *run, *own]) if run or own else ""
        parts[k] = f"{part.partition(SETTINGS)[0].rstrip()}\n\n{table}" + ("\n" if table else "")
    return "".join([head, *parts])


def _rows(command: click.Command, context: click.Context) -> list[str]:
    return [
        _row(p) for p in command.get_params(context) if isinstance(p, click.Option) and "--help" not in p.opts
    ]


def _help(text: str) -> str:
    """Paragraphs as they are; those that click must not wrap, as blocks."""
    parts = []
    for part in re.split(r"\n\s*\n", text.strip()):
        lines = [line.strip() for line in part.splitlines()]
        if lines[0] == "\b":
            block = "\n".join(line.strip() for line in part.splitlines()[1:])
            parts.append(f"```\n{block}\n```")
        else:
            parts.append(" ".join(lines).replace("``", "`"))
    return "\n\n".join(parts)


def _row(option: click.Option) -> str:
    names = ", ".join(f"`{name}`" for name in (*option.opts, *option.secondary_opts))
    kind = option.type
    choices = f"[{'|'.join(map(str, kind.choices))}]" if isinstance(kind, click.Choice) else kind.name.upper()
    value = "" if option.is_flag or option.count else f" `{option.metavar or choices}`"
    says = option.help or ""
    if option.show_default and not option.is_flag:
        says += f" Without it: {option.default}."
    cells = (cell.replace("|", "\\|") for cell in (names + value, says))
    return f"| {' | '.join(cells)} |\n"


if __name__ == "__main__":
    from own_installation import require_own_installation

    require_own_installation()
    (HERE / "commands.md").write_text(page(), encoding="utf-8")
    of_studies = HERE / "studies.md"
    of_studies.write_text(studies(of_studies.read_text(encoding="utf-8")), encoding="utf-8")
