"""Terminal text: colours where they are wanted, and the width of characters in cells."""

from __future__ import annotations

import os
import unicodedata
from typing import TextIO

from msgspec import Struct

TAB = 4
"""Cells that a tab stop is wide when source text is shown."""


class Style(Struct, frozen=True):
    """Wraps text in ANSI sequences, or returns it unchanged where ``colour`` is off."""

    colour: bool = False

    def _wrap(self, text: str, code: str) -> str:
        return f"\x1b[{code}m{text}\x1b[0m" if self.colour and text else text

    def bold(self, text: str) -> str:
        return self._wrap(text, "1")

    def dim(self, text: str) -> str:
        return self._wrap(text, "2")

    def red(self, text: str) -> str:
        return self._wrap(text, "1;31")

    def yellow(self, text: str) -> str:
        return self._wrap(text, "1;33")

    def green(self, text: str) -> str:
        return self._wrap(text, "1;32")

    def blue(self, text: str) -> str:
        return self._wrap(text, "1;34")

    def cyan(self, text: str) -> str:
        return self._wrap(text, "1;36")


PLAIN = Style(False)


def style_for(stream: TextIO) -> Style:
    """Return colours for a terminal, none for a file or where ``NO_COLOR`` is set.

    ``FORCE_COLOR`` asks for colours even without a terminal (https://no-color.org, https://force-color.org).
    """
    if os.environ.get("NO_COLOR"):
        return PLAIN
    if os.environ.get("FORCE_COLOR"):
        return Style(True)
    return Style(stream.isatty() and os.environ.get("TERM") != "dumb")


_REORDERING = frozenset(("LRE", "RLE", "LRO", "RLO", "PDF", "LRI", "RLI", "FSI", "PDI"))
"""Classes of characters that would turn around what follows them."""


def cell_width(character: str, column: int = 0) -> int:
    """Return how many terminal cells a character takes when it starts in ``column`` (from 0)."""
    if character == "\t":
        return TAB - column % TAB
    if unicodedata.bidirectional(character) in _REORDERING:
        return 1  # shown as a sign of its own
    if unicodedata.combining(character) or unicodedata.category(character) in ("Cf", "Me"):
        return 0
    return 2 if unicodedata.east_asian_width(character) in ("W", "F") else 1


def width(text: str) -> int:
    """Return the cells that a text takes, tabs counted from its start."""
    column = 0
    for character in text:
        column += cell_width(character, column)
    return column


def printable(text: str) -> str:
    """Return a source line as it is shown: tabs expanded, control characters replaced."""
    shown: list[str] = []
    column = 0
    for character in text:
        cells = cell_width(character, column)
        if character == "\t":
            shown.append(" " * cells)
        elif (
            unicodedata.category(character) in ("Cc", "Cs")
            or unicodedata.bidirectional(character) in _REORDERING
        ):
            shown.append("\N{REPLACEMENT CHARACTER}")
        else:
            shown.append(character)
        column += cells
    return "".join(shown)


def pad(text: str, cells: int) -> str:
    """Append blanks until the text fills the cells."""
    return text + " " * max(0, cells - width(text))
