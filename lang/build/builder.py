"""What the actions of the grammar share: the builder, texts, numbers, dotted names, and actions that only name children.

An action gets the children of its rule in the order of ``mech.lark``, with None for a part in brackets that is left out; tokens
are children too.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from fractions import Fraction
from functools import lru_cache
from typing import Any

from msgspec import Struct

from .. import ast
from ..diagnostics import Reporter
from ..grammar.lexer import Token
from ..source import SourceFile, Span

Children = list[Any]


class Builder(Struct, frozen=True):
    """What the actions share: the file, and where to report what the grammar cannot forbid."""

    source: SourceFile
    reporter: Reporter

    def span(self, token: Token) -> Span:
        return Span(self.source, token.start, token.end)


Action = Callable[[Builder, Children, Span], Any]

_ESCAPE = re.compile(r"\\(.)")
_ESCAPES = {'"': '"', "\\": "\\", "n": "\n", "t": "\t"}
_LARGEST_EXPONENT = 400
_LONGEST_NUMBER = 400


def text_of(b: Builder, token: Token | None) -> str:
    """Return what a string stands for; an absent one is empty."""
    if token is None:
        return ""
    body = token.text[1:-1]
    if "\\" not in body:
        return body

    def replace(match: re.Match[str]) -> str:
        if match[1] not in _ESCAPES:
            start = token.start + 1 + match.start()
            b.reporter.error(
                "E0129",
                f"'\\{match[1]}' means nothing in a text",
                Span(b.source, start, start + 2),
                help="a backslash itself is written '\\\\'; known are '\\n', '\\t', '\\\"' and '\\\\'",
            )
        return _ESCAPES.get(match[1], match[1])

    return _ESCAPE.sub(replace, body)


def value_of(b: Builder, text: str, span: Span) -> Fraction:
    """Return the exact value of a number that a float can hold."""
    value = _number(text) if len(text) <= _LONGEST_NUMBER else None
    if value is not None:
        return value
    shown = text if len(text) <= 24 else text[:20] + "..."
    b.reporter.error(
        "E0109",
        f"the number '{shown}' is out of range",
        span,
        help="numbers lie between 1e-400 and 8e307 and have at most 400 digits",
    )
    return Fraction(1)


@lru_cache(maxsize=1024)
def _number(text: str) -> Fraction | None:
    exponent = re.search(r"[eE]([+-]?\d+)$", text)
    if exponent and abs(int(exponent[1])) > _LARGEST_EXPONENT:
        return None
    value = Fraction(text)
    return value if value < 2**1023 else None


def dotted(names: list[Token]) -> str:
    return ".".join(token.text for token in names)


def items_of(value: list[Any] | None) -> tuple[Any, ...]:
    return tuple(value) if value else ()


def plain_type(b: Builder, type: str | ast.Expression, what: str) -> str:
    """Return the type of what has no members to be typed by."""
    if isinstance(type, str):
        return type
    b.reporter.error(
        "E0110",
        f"'typeof' is not a type of {what}",
        type.span,
        help="it stands before parameters, coordinates, states, inputs, outputs, discrete variables and 'let'",
    )
    return ""


# ---------------------------------------------------------------- actions that only name children

Made = Callable[[Builder, Children], Any]
"""What a field is made of children."""


def word(place: int) -> Made:
    """Take a token as it is written."""
    return lambda b, c: c[place].text


def path(place: int) -> Made:
    """Take a dotted name."""
    return lambda b, c: dotted(c[place])


def items(place: int) -> Made:
    """Take a list, which is empty where it is left out."""
    return lambda b, c: items_of(c[place])


def text(place: int) -> Made:
    """Take what a string stands for."""
    return lambda b, c: text_of(b, c[place])


def always(value: object) -> Made:
    return lambda b, c: value


def node(kind: Callable[..., ast.Node], /, **fields: int | Made) -> Action:
    """Return the action that makes a node; a field is a child, by its number, or made of children."""
    children = [(name, field) for name, field in fields.items() if isinstance(field, int)]
    made = [(name, field) for name, field in fields.items() if not isinstance(field, int)]

    def action(b: Builder, c: Children, span: Span) -> ast.Node:
        values = {name: c[place] for name, place in children}
        for name, make in made:
            values[name] = make(b, c)
        return kind(span=span, **values)

    return action


def statement(kind: Callable[..., ast.Statement], /, **fields: int | Made) -> Action:
    """Return the action that makes a statement: its rule ends with ``[STRING] SEMICOLON``."""
    return node(kind, doc=text(-2), **fields)


def picked(*places: int) -> Action:
    """Return the action that takes these children, or the only one."""
    if len(places) == 1:
        return lambda b, c, span: c[places[0]]
    return lambda b, c, span: tuple([c[place] for place in places])
