"""What the names of a text stand for, for colours that patterns cannot tell: parameters, variables, members, models."""

from __future__ import annotations

from msgspec import Struct

from ..lang import ast
from .document import Document, region_of
from .names import Meaning, Word, meaning
from .pieces import names

KINDS = ("class", "type", "function", "parameter", "variable", "property")
"""Names of the protocol; members after a dot, and what a component is given, are properties."""
MODIFIERS = ("declaration", "readonly")


class Token(Struct, frozen=True):
    """A name at [start, end) of the text; ``kind`` of ``KINDS``, ``modifiers`` of ``MODIFIERS``."""

    start: int
    end: int
    kind: str
    modifiers: tuple[str, ...] = ()


def tokens(document: Document) -> list[Token]:
    """Return what is known of the names of a text, in order; words of the language and built-in functions are left out."""
    found: list[Token] = []
    known: dict[tuple[str, tuple[str, ...]], Meaning | None] = {}
    regions = document.regions()
    for name in names(document.text):
        start, end = name.piece.start, name.piece.end
        if name.given:
            found.append(Token(start, end, "property"))
            continue
        model = region_of(regions, start)
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
        case ast.Declaration() | ast.Argument():
            return "variable"
    return ""
