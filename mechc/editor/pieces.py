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


_ASIDE = re.compile(r'//[^\n]*|/\*.*?(?:\*/|\Z)|"(?:[^"\\\n]|\\[^\n])*"?', re.DOTALL)


class NamedPath(Struct, frozen=True):
    """A name with those before it, ``path``; ``given``: it says what a component or a declaration is given."""

    piece: Piece
    path: tuple[str, ...]
    given: bool


def code_before(text: str, offset: int) -> int | None:
    """Return where the code begins that ends at a place, after the last comment or string; None inside of these."""
    begin = 0
    for match in _ASIDE.finditer(text):
        if match.start() >= offset:
            break
        closed = match[0].endswith("*/") if match[0].startswith("/*") else match[0][0] == '"' == match[0][-1]
        if offset < match.end() or (offset == match.end() and not (closed and len(match[0]) > 1)):
            return None
        begin = match.end()
    return begin


def names(text: str) -> Iterator[NamedPath]:
    """Yield the names of a text with the dotted path that each ends."""
    path: tuple[str, ...] = ()  # of the name before, while it may go on
    outer: list[tuple[str, ...]] = []  # of the names before the brackets that are open
    gives: list[bool] = []  # whether a round bracket that is open holds what something is given
    parts = [piece for piece in pieces(text) if piece.kind not in ("blank", "comment")]
    for k, piece in enumerate(parts):
        before = parts[k - 1].text if k else ""
        if piece.kind == "name":
            path = (*path, piece.text) if before == "." else (piece.text,)
            follows = parts[k + 1].text if k + 1 < len(parts) else ""
            given = bool(gives) and gives[-1] and before in ("(", ",") and follows in ("=", "~")
            yield NamedPath(piece, path, given)
            continue
        match piece.text:
            case "[":
                outer.append(path)
            case "]" if outer:
                path = outer.pop()
            case "(":
                two = [p for p in parts[max(0, k - 2) : k] if p.kind == "name"]
                gives.append(len(two) == 2 and two[0].text != "experiment")
            case ")" if gives:
                gives.pop()
        if piece.text not in ("]", "."):
            path = ()
