"""A page as a file, and in a browser."""

from __future__ import annotations

import webbrowser
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mechc.exporting import stem_of
from mechc.requests.parse_values import UsageMistake

from .page import MARK, page

if TYPE_CHECKING:
    from mechc.model import CompiledModel


def write_page(
    model: CompiledModel,
    output: str | Path | None,
    *,
    recorded: bool = False,
    experiment: str | None = None,
    inputs: Mapping[str, Any] | None = None,
) -> Path:
    """Write the page of a model and return its path; without ``output`` it is named after the file. ``inputs``: as for ``simulate``.

    A page is written over, any other file is not: raises UsageMistake. Raises what ``page`` raises.
    """
    path = Path(output) if output is not None else Path(f"{stem_of(model)}.html")
    if path.suffix not in (".html", ".htm"):
        raise UsageMistake(f"a page ends with '.html', not '{path.suffix}'", f"as in -o {path.stem}.html")
    if path.is_dir() or (path.exists() and MARK not in _beginning(path)):
        raise UsageMistake(
            f"there is a file '{path}' already, which is not a page of mechc",
            "give another name, or remove it",
        )
    text = page(model, recorded=recorded, experiment=experiment, options={"inputs": inputs} if inputs else {})
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8", newline="\n")
    return path


def open_page(path: Path) -> bool:
    """Show a file in the browser; tell whether there is one."""
    try:
        return webbrowser.open(path.resolve().as_uri())
    except webbrowser.Error:
        return False


def _beginning(path: Path) -> str:
    with path.open(encoding="utf-8", errors="replace") as file:
        return file.read(400)
