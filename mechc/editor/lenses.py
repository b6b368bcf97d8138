"""What can be done with a model that says how it is run: commands above it, which the editor runs as ``mechc`` in a terminal."""

from __future__ import annotations

from collections.abc import Mapping

from msgspec import Struct

from ..lang import ast
from ..lang.source import Span
from .document import Document

COMMANDS: Mapping[str, tuple[str, ...]] = {
    "run": ("run",),
    "plot": ("run", "--plot"),
    "view": ("view",),
    "explain": ("explain",),
    "equations": ("equations",),
    "modes": ("study", "modes"),
}
"""Title -> the words after ``mechc``, before the file. The editor's command is ``mechc.`` and the title."""
OF_CURVES = ("run", "plot", "equations")
"""Those that a curve has, too."""


class Lens(Struct, frozen=True):
    """A command above a model, at its name."""

    title: str
    model: str
    span: Span


def lenses(document: Document) -> list[Lens]:
    """Return the commands above the models of a text that have an experiment, or make something stationary."""
    found = []
    for item in document.tree.items if document.tree is not None else ():
        if not isinstance(item, ast.Model) or item.partial:
            continue
        curve = any(isinstance(s, ast.Stationary) for s in item.body)
        if curve or any(isinstance(s, ast.Experiment) for s in item.body):
            found += [Lens(title, item.name, item.name_span) for title in (OF_CURVES if curve else COMMANDS)]
    return found
