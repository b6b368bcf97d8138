"""Colour mech text by Pygments, for documentation, notebooks and LaTeX: words, units, functions, parts, comments.

The words come from the tables of the language, so that a new statement is coloured without a line here.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import ClassVar

from pygments.lexer import Lexer
from pygments.token import (
    Comment,
    Keyword,
    Name,
    Number,
    Operator,
    Punctuation,
    String,
    Whitespace,
    _TokenType,
)

from ..lang.builtins import BUILTINS, CONSTANTS
from ..lang.grammar.keywords import ACTIONS, CLAUSES, DEFINITIONS, EXPRESSIONS, STATEMENTS, STEPS
from .pieces import Piece, pieces

_KINDS: Mapping[str, _TokenType] = {
    **dict.fromkeys((*CLAUSES, *ACTIONS, *STEPS, *STATEMENTS), Keyword),
    **dict.fromkeys(DEFINITIONS, Keyword.Declaration),
    **dict.fromkeys(EXPRESSIONS, Keyword.Pseudo),
    **dict.fromkeys(("true", "false"), Keyword.Constant),
    **dict.fromkeys(CONSTANTS, Name.Constant),
}


class MechLexer(Lexer):
    """Split mech text for Pygments; half-written text is coloured as far as it goes."""

    name = "mech"
    aliases: ClassVar[list[str]] = ["mech", "mechc"]
    filenames: ClassVar[list[str]] = ["*.mech"]
    mimetypes: ClassVar[list[str]] = ["text/x-mech"]

    def get_tokens_unprocessed(self, text: str) -> Iterator[tuple[int, _TokenType, str]]:
        for piece in pieces(text):
            yield piece.start, _token(piece, text), piece.text


def _token(piece: Piece, text: str) -> _TokenType:
    match piece.kind:
        case "blank":
            return Whitespace
        case "comment":
            return Comment.Single if piece.text.startswith("//") else Comment.Multiline
        case "text":
            return String
        case "number":
            return Number
        case "unit":
            return Keyword.Type
        case "operator":
            return Operator
        case "name":
            return _name(
                piece.text, text[max(0, piece.start - 1) : piece.start], text[piece.end : piece.end + 1]
            )
        case _:
            return Punctuation


def _name(value: str, before: str, after: str) -> _TokenType:
    if before == ".":
        kind = None
    elif value in BUILTINS and after == "(":
        kind = Name.Builtin
    else:
        kind = _KINDS.get(value)
    if kind is not None:
        return kind
    return Name.Class if value[0].isupper() and len(value) > 1 else Name
