"""``mechc lsp``: answer an editor over standard input and output."""

from __future__ import annotations

import os

import click

from .options import Command


@click.command(cls=Command, name="lsp", short_help="Answer an editor (language server).")
@click.option("--stdio", is_flag=True, help="What is done anyway; many editors say it.")
def command(stdio: bool) -> int:
    """Speak the Language Server Protocol over standard input and output: messages while typing, meanings, completions, renaming,
    layout. Editors start it; see docs/editors.md."""
    from ..requests.parse_values import UsageMistake

    try:
        from ..editor.server import make_server
    except ImportError as error:
        if error.name and error.name.split(".")[0] in ("pygls", "lsprotocol"):
            raise click.UsageError(
                str(UsageMistake("the language server needs pygls", "pip install 'mechc[editor]'"))
            ) from None
        raise
    with (
        os.fdopen(os.dup(0), "rb") as asked,
        os.fdopen(os.dup(1), "wb") as told,
    ):  # the server closes what it gets
        make_server().start_io(asked, told)
    return 0
