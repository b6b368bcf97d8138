"""Colour text by a TextMate grammar, as editors do: line by line, the pattern that fits first, or the first of those."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

Rule = Mapping[str, Any]
Piece = tuple[str, str]
"""A text, and its innermost scope; empty where the grammar says nothing."""


def coloured(grammar: Rule, text: str) -> Iterator[Piece]:
    """Yield the pieces of a text."""
    inside: list[Rule] = []
    for line in text.splitlines(keepends=True):
        yield from _line(grammar, line, inside)


def _line(grammar: Rule, line: str, inside: list[Rule]) -> Iterator[Piece]:
    position = 0
    while True:
        around = inside[-1] if inside else None
        scope = str(around["name"]) if around else ""
        found = _first(grammar if around is None else around, around, line, position)
        if found is None:
            yield from _piece(line[position:], scope)
            return
        rule, match = found
        yield from _piece(line[position : match.start()], scope)
        if rule is around:
            inside.pop()
            yield from _piece(match[0], scope)
        elif "begin" in rule:
            inside.append(rule)
            yield from _piece(match[0], str(rule["name"]))
        else:
            yield from _captured(rule, match, line)
        assert match.end() > position or rule is around, "a pattern fits nothing, and would for ever"
        position = match.end()


def _first(holder: Rule, around: Rule | None, line: str, position: int) -> tuple[Rule, re.Match[str]] | None:
    rules: Sequence[Rule] = holder.get("patterns", ())
    offered = [(around, re.compile(around["end"]).search(line, position))] if around else []
    offered += [
        (rule, re.compile(rule.get("match") or rule["begin"]).search(line, position)) for rule in rules
    ]
    fitting = [(rule, match) for rule, match in offered if match is not None]
    return min(fitting, key=lambda pair: pair[1].start(), default=None)


def _captured(rule: Rule, match: re.Match[str], line: str) -> Iterator[Piece]:
    scope, position = str(rule.get("name", "")), match.start()
    for group, capture in rule.get("captures", {}).items():
        start, end = match.span(int(group))
        yield from _piece(line[position:start], scope)
        yield from _piece(line[start:end], str(capture["name"]))
        position = end
    yield from _piece(line[position : match.end()], scope)


def _piece(text: str, scope: str) -> Iterator[Piece]:
    if text:
        yield text, scope
