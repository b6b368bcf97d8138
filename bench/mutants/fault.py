"""What a mutant is, and a tree of sources in which it stands."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from msgspec import Struct

ROOT = Path(__file__).resolve().parents[2]
ROOMS = ("lang", "compiler", "runtime", "stdlib", "mechc")
"""Folders that are the package."""


class DoesNotFit(Exception):
    """The text that a fault replaces does not stand in its file exactly once."""


class Edit(Struct, frozen=True):
    """``there``, which stands in a file exactly once, is replaced."""

    file: str
    there: str
    instead: str


class Fault(Struct, frozen=True):
    """``text`` says what is wrong; ``model`` and ``options`` of ``mechc run`` reach it. ``point``: under which heading it was
    found, if mechc once had it."""

    text: str
    edits: tuple[Edit, ...]
    model: str
    options: tuple[str, ...] = ()
    point: str = ""


def edit(file: str, there: str, instead: str) -> tuple[Edit, ...]:
    """Return one edit, as edits."""
    return (Edit(file, there, instead),)


def changed(edits: tuple[Edit, ...]) -> dict[str, str]:
    """Return the texts of the files that edits change. Raises DoesNotFit."""
    texts: dict[str, str] = {}
    for one in edits:
        text = texts.get(one.file) or (ROOT / one.file).read_text(encoding="utf-8")
        if text.count(one.there) != 1:
            raise DoesNotFit(f"{text.count(one.there)} times in {one.file}: {one.there!r}")
        texts[one.file] = text.replace(one.there, one.instead)
    return texts


class Tree:
    """A copy of the package in a folder, in which one fault at a time may stand."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        for room in ROOMS:
            shutil.copytree(
                ROOT / room, folder / room, symlinks=True, ignore=shutil.ignore_patterns("__pycache__")
            )

    @contextmanager
    def mutated(self, edits: tuple[Edit, ...]) -> Iterator[None]:
        """Put edits in for as long as the body runs. Raises DoesNotFit."""
        texts = changed(edits)
        try:
            for file, text in texts.items():
                (self.folder / file).write_text(text, encoding="utf-8")
            yield
        finally:
            for file in texts:
                shutil.copy2(ROOT / file, self.folder / file)
