"""What could have stood where a token does not fit, in words; no name of a terminal is ever shown."""

from __future__ import annotations

from typing import Unpack

from ..diagnostics import Details, Diagnostic, Severity
from ..grammar.examples import WORDS
from ..grammar.lexer import Token
from ..grammar.tables import END
from ..source import Span
from .recovery import Panic, Repair, Situation, words_of

Finding = tuple[Diagnostic, Repair]

OPERATORS = frozenset(("PLUS", "MINUS", "STAR", "SLASH", "CARET", "RELATION", "AND", "OR"))

_SIGNS = {
    "ARROW": "'->'", "ASSIGN": "':='", "EQUAL": "'='", "TILDE": "'~'", "DOT": "'.'", "COMMA": "','",
    "COLON": "':'", "SEMICOLON": "';'", "LPAR": "'('", "RPAR": "')'", "LSQB": "'['", "RSQB": "']'",
    "LBRACE": "'{'", "RBRACE": "'}'", "NAME": "a name", "STRING": "a text in quotes",
    "NUMBER": "a number", "QUANTITY": "a quantity", "UNITTAG": "a unit", "PLUS": "'+'", "MINUS": "'-'",
    "STAR": "'*'", "SLASH": "'/'", "CARET": "'^'", "RELATION": "a comparison", END: "the end of the file",
}  # fmt: skip


def error(code: str, message: str, span: Span, **details: Unpack[Details]) -> Diagnostic:
    """Return an error, to be reported by the parser."""
    return Diagnostic(Severity.ERROR, code, message, span, **details)


def behind(s: Situation) -> Span:
    """Return the place just after the previous token."""
    end = s.previous.end if s.previous else 0
    return Span(s.source, max(end - 1, 0), end) if end else Span(s.source, 0, 0)


def unexpected(s: Situation) -> Finding:
    """Say what could stand here."""
    expected = _in_words(s)
    found = _found(s.token)
    message = f"expected {expected}, found {found}" if expected else f"{found} cannot stand here"
    span = behind(s) if s.token.kind == END else s.span(s.token)
    return error("E0110", message, span, help=_example(s)), Panic()


def _example(s: Situation) -> str:
    """Return how a statement is written whose head is wrong; empty where it is not known which one is meant, or behind its first words."""
    if "BACKWARD" in s.expected:
        return "a friction of two sides has both limits: 'friction forward 2 N backward 1 N on x;'"
    known = s.is_keyword(s.first) and s.first < s.index <= s.first + 3
    return (
        f"write it like this: '{WORDS[word][0]}'"
        if known and (word := s.tokens[s.first].text) in WORDS
        else ""
    )


def _found(token: Token) -> str:
    match token.kind:
        case "$END":
            return "the end of the file"
        case "STRING":
            return "a text in quotes"
        case _:
            return f"'{token.text}'"


def _in_words(s: Situation) -> str:
    kinds = s.expected
    if s.at_beginning:
        return "an action such as 'reinit(..)' or 'n := ..'" if "REINIT" in kinds else "a statement"
    words: list[str] = []
    if s.bracket is None or s.bracket.kind != "LSQB":
        kinds = kinds - {"COLON"} or kinds
    if kinds & {"NAME", "SEMICOLON"}:
        kinds = kinds - {"DOT", "STRING"}
    if {"NUMBER", "LPAR", "MINUS"} <= kinds:
        words.append("an expression")
        kinds = kinds & {"RPAR", "SEMICOLON", "RBRACE", "RSQB"}
    elif kinds & OPERATORS:
        kinds = kinds - OPERATORS - {"DOT", "LPAR", "LSQB", "UNITTAG", "FOR"}
    words += sorted(_SIGNS[k] for k in kinds if k in _SIGNS)
    words += [f"'{w}'" for w in words_of(kinds)]
    if len(words) > 6:
        words = [w for w in words if w[0] != "'" or not w[1].isalpha()]
    return words[0] if len(words) == 1 else ", ".join(words[:-1]) + " or " + words[-1] if words else ""
