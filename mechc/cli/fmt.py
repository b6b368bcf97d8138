"""``mechc fmt``: write models in the canonical layout."""

from __future__ import annotations

import difflib
import os
import shutil
import sys
import tempfile
from pathlib import Path

import click

from .options import Command, files_here


@click.command(cls=Command, name="fmt", short_help="Write models in the canonical layout.")
@click.argument("files", nargs=-1, required=True, metavar="FILE...", shell_complete=files_here)
@click.option("--check", is_flag=True, help="Change nothing; exit with 1 if a file is laid out differently.")
@click.option("--diff", is_flag=True, help="Change nothing; print what would change.")
def command(files: tuple[str, ...], check: bool, diff: bool) -> int:
    """Write each FILE in the canonical layout; '-' reads standard input and writes standard output.

    Comments, numbers and parentheses stay as they are written.
    """
    from ..lang.diagnostics import CompileError
    from .failures import COMPLETED, FAILED, show_compile_error

    different = wrong = 0
    for name in files:
        try:
            old, new = formatted(name)
        except CompileError as error:
            show_compile_error(error)
            wrong += 1
            continue
        changed = old != new
        different += changed
        if diff:
            click.echo("".join(difference(name, old, new)), nl=False)
        if name == "-" and not check and not diff:
            click.echo(new, nl=False)
        elif changed and check:
            click.echo(f"{name}: would be changed", err=True)
        elif changed and not diff:
            _write_whole(Path(name).resolve(), new.encode("utf-8"))
            click.echo(f"{name}: changed", err=True)
    return FAILED if wrong or (check and different) else COMPLETED


def _write_whole(path: Path, content: bytes) -> None:
    """Put new content in place of a file at once: a full disk or an interruption must not cost a model."""
    handle, partial = tempfile.mkstemp(prefix=f".{path.name}.", dir=path.parent)
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(content)
        shutil.copymode(path, partial)
        os.replace(partial, path)
    finally:
        Path(partial).unlink(missing_ok=True)


def formatted(name: str) -> tuple[str, str]:
    """Return the text of a file (``-``: standard input) as it is and in the canonical layout, with the line ends it has."""
    from ..lang.diagnostics import Reporter
    from ..lang.parser import parse
    from ..lang.printing.printer import format_file
    from ..lang.read import read_source
    from ..lang.source import SourceFile

    reporter = Reporter()
    if name == "-":
        old = sys.stdin.read()
        source = SourceFile("<standard input>", old.replace("\r\n", "\n").replace("\r", "\n"))
    else:
        source = read_source(Path(name), reporter)
        old = Path(name).read_bytes().decode("utf-8-sig")
    new = format_file(parse(source, reporter))
    return old, new.replace("\n", "\r\n") if "\r\n" in old else new


def difference(name: str, old: str, new: str) -> list[str]:
    """Return a unified diff, each line with its end."""
    rows = difflib.unified_diff(old.splitlines(), new.splitlines(), name, f"{name} (formatted)", lineterm="")
    return [row + "\n" for row in rows]
