"""The pieces of a mech text: blanks, comments, texts, numbers, names, units, signs; half-written text is split as far as it goes."""

from __future__ import annotations

import re
from collections.abc import Iterator

from msgspec import Struct

from ..lang.units import unit_end

_TOKEN = re.compile(
    r"(?P<blank>\s+)"
    r"|(?P<comment>//[^\n]*|/\*.*?(?:\*/|\Z))"
    r'|(?P<text>"(?:[^"\\\n]|\\[^\n])*"?)'
    r"|(?P<number>(?:[0-9]+(?:\.[0-9]+)?|\.[0-9]+)(?:[eE][+-]?[0-9]+)?)"
    r"|(?P<name>[^\W\d]\w*)"
    r"|(?P<operator>->|<>|<=|>=|==|[-+*/^<>=~:])"
    r"|(?P<sign>.)",
    re.DOTALL,
)
_BLANKS = re.compile(r"[ \t]+")


class Piece(Struct, frozen=True):
    """``kind``: blank, comment, text, number, name, operator, sign, unit; ``start``: where ``text`` begins."""

    kind: str
    start: int
    text: str

    @property
    def end(self) -> int:
        return self.start + len(self.text)


def pieces(text: str) -> Iterator[Piece]:
    """Yield what a text consists of; one after the other they are the whole text."""
    position, length = 0, len(text)
    while position < length:
        match = _TOKEN.match(text, position)
        assert match is not None
        piece = Piece(match.lastgroup or "", position, match[0])
        yield piece
        position = piece.end
        if piece.kind == "number" or piece.text in ")}":
            blanks, end = _unit(text, position)
            if end > blanks:
                yield Piece("blank", position, text[position:blanks])
                yield Piece("unit", blanks, text[blanks:end])
                position = end


def _unit(text: str, position: int) -> tuple[int, int]:
    """Return where the unit after a number or a closing bracket begins and ends; the same place if there is none."""
    blanks = _BLANKS.match(text, position)
    if blanks is None:
        return position, position
    end = unit_end(text, blanks.end())
    return blanks.end(), blanks.end() if text.startswith("^", end) else end
