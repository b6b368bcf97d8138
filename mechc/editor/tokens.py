"""What the names of a text stand for, for colours that patterns cannot tell: parameters, variables, members, models."""

from __future__ import annotations

from collections.abc import Iterator

from msgspec import Struct

from ..lang import ast
from .document import Document
from .names import Meaning, Word, meaning
from .pieces import Piece, pieces

KINDS = ("class", "type", "function", "parameter", "variable", "property")
"""Names of the protocol; members behind a dot, and what a component is given, are properties."""
MODIFIERS = ("declaration", "readonly")


class Token(Struct, frozen=True):
    """A name at [start, end) of the text; ``kind`` of ``KINDS``, ``modifiers`` of ``MODIFIERS``."""

    start: int
    end: int
    kind: str
    modifiers: tuple[str, ...] = ()


class _Name(Struct, frozen=True):
    """A name with those before it, ``path``; ``given``: it says what a component or a declaration is given."""

    piece: Piece
    path: tuple[str, ...]
    given: bool


def tokens(document: Document) -> list[Token]:
    """Return what is known of the names of a text, in order; words of the language and built-in functions are left out."""
    found: list[Token] = []
    known: dict[tuple[str, tuple[str, ...]], Meaning | None] = {}
    regions = document.regions()
    for name in _names(document.text):
        start, end = name.piece.start, name.piece.end
        if name.given:
            found.append(Token(start, end, "property"))
            continue
        model = next((model for first, last, model in regions if first < start < last), "")
        key = (model, name.path)
        if key not in known:
            known[key] = meaning(document, Word(name.path, start, end), model)
        what = known[key]
        if what is not None and (kind := _kind(what)):
            here = what.place is not None and what.place.file.name == document.source.name
            declares = here and what.place is not None and what.place.start == start
            modifiers = (
                *(MODIFIERS[:1] if declares else ()),
                *(MODIFIERS[1:] if kind == "parameter" else ()),
            )
            found.append(Token(start, end, kind, modifiers))
    return found


def _kind(found: Meaning) -> str:
    match found.what:
        case ast.Model():
            return "class"
        case ast.Type():
            return "type"
        case ast.Function():
            return "function"
        case ast.Declaration() if len(found.word.parts) > 1:
            return "property"
        case ast.Parameter():
            return "parameter"
        case ast.Declaration():
            return "variable"
    return ""


def _names(text: str) -> Iterator[_Name]:
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
            yield _Name(piece, path, given)
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
