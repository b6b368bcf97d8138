"""The page of a model or of a motion inside a notebook."""

from __future__ import annotations

import html
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .page import page
from .write import open_page

if TYPE_CHECKING:
    from ..model import CompiledModel
    from ..requests.parse_values import Given

HEIGHT = 640
"""Pixels of the frame."""


class View:
    """A page that shows itself where it is the value of a cell; ``text`` is the page."""

    def __init__(self, text: str, name: str, height: int = HEIGHT) -> None:
        self.text = text
        self.name = name
        self.height = height

    def __repr__(self) -> str:
        return f"<page of {self.name}: {len(self.text) / 1000:.0f} kB; save('{self.name}.html') writes it, open() shows it>"

    def _repr_html_(self) -> str:
        """Return a frame with the page in it: the name is IPython's."""
        style = f"width: 100%; height: {self.height}px; border: 0"
        return f'<iframe srcdoc="{html.escape(self.text)}" style="{style}" title="{html.escape(self.name)}"></iframe>'

    def save(self, path: str | Path) -> Path:
        """Write the page to a file and return its path."""
        file = Path(path)
        file.write_text(self.text, encoding="utf-8", newline="\n")
        return file

    def open(self) -> bool:
        """Show the page in the browser; tell whether there is one."""
        folder = Path(tempfile.mkdtemp(prefix="mechc-page-"))
        return open_page(self.save(folder / f"{self.name}.html"))


def view(
    model: CompiledModel,
    *,
    recorded: bool = False,
    set: Mapping[str, Given] | None = None,
    experiment: str | None = None,
    height: int = HEIGHT,
    options: Mapping[str, Any] | None = None,
) -> View:
    """Return the page of a model; ``recorded``: of its motion alone. ``options``: of the run."""
    text = page(model, recorded=recorded, set=set, experiment=experiment, options=options)
    return View(text, model.name, height)
