"""Colour mech text by Pygments, for documentation, notebooks and LaTeX: words, units, functions, parts, comments.

The words come from the tables of the language, so that a new statement is coloured without a line here.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from typing import Any, ClassVar

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
from ..lang.grammar.keywords import ACTIONS, CLAUSES, DEFINITIONS, EXPRESSIONS, STATEMENTS
from ..lang.units import unit_end

Word = Callable[[str], _TokenType]

_KINDS: Mapping[str, _TokenType] = {
    **dict.fromkeys((*CLAUSES, *ACTIONS, *STATEMENTS), Keyword),
    **dict.fromkeys(DEFINITIONS, Keyword.Declaration),
    **dict.fromkeys(EXPRESSIONS, Keyword.Pseudo),
    **dict.fromkeys(("true", "false"), Keyword.Constant),
    **dict.fromkeys(CONSTANTS, Name.Constant),
}

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


class MechLexer(Lexer):
    """Split mech text for Pygments; half-written text is coloured as far as it goes."""

    name = "mech"
    aliases: ClassVar[list[str]] = ["mech", "mechc"]
    filenames: ClassVar[list[str]] = ["*.mech"]
    mimetypes: ClassVar[list[str]] = ["text/x-mech"]

    def get_tokens_unprocessed(self, text: str) -> Iterator[tuple[int, _TokenType, str]]:
        position, length = 0, len(text)
        while position < length:
            match = _TOKEN.match(text, position)
            assert match is not None
            kind, value = match.lastgroup, match[0]
            yield position, _token(kind or "", value, text, match), value
            position = match.end()
            if kind == "number" or value in ")}":
                yield from _unit(text, position)
                position = _after_unit(text, position)


def _token(kind: str, value: str, text: str, match: re.Match[str]) -> _TokenType:
    match kind:
        case "blank":
            return Whitespace
        case "comment":
            return Comment.Single if value.startswith("//") else Comment.Multiline
        case "text":
            return String
        case "number":
            return Number
        case "operator":
            return Operator
        case "name":
            return _name(value, text[match.start() - 1 : match.start()], text[match.end() : match.end() + 1])
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


def _after_unit(text: str, position: int) -> int:
    """Return where the unit behind a number or a closing brace ends; ``position`` if there is none."""
    blanks = _BLANKS.match(text, position)
    if blanks is None:
        return position
    end = unit_end(text, blanks.end())
    return position if end == blanks.end() or text.startswith("^", end) else end


def _unit(text: str, position: int) -> Iterator[tuple[int, Any, str]]:
    end = _after_unit(text, position)
    if end == position:
        return
    blanks = _BLANKS.match(text, position)
    if blanks:
        yield position, Whitespace, blanks[0]
        position = blanks.end()
    yield position, Keyword.Type, text[position:end]
