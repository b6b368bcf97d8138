"""The TextMate grammar of mech, for editors that colour by patterns: ``python -m mechc.editor.textmate > FILE``.

The words come from the tables of the language, the groups are those of ``highlighting``. Patterns keep to what Oniguruma
and Python's ``re`` read alike, so that tests can follow them.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Mapping

from ..lang.builtins import BUILTINS, CONSTANTS, PREDEFINED
from ..lang.grammar.keywords import ACTIONS, CLAUSES, DEFINITIONS, EXPRESSIONS, RESERVED, STATEMENTS, STEPS
from ..lang.units import NAMED_TYPES, UNIT_PATTERN

Pattern = Mapping[str, object]

SCOPE = "source.mech"

_TRUTH = ("true", "false")
_JOINING = ("and", "or", "not")
_BLOCKS = frozenset((*(RESERVED - {*EXPRESSIONS, *DEFINITIONS}), "when", "elsewhen"))

WORDS: Mapping[str, Iterable[str]] = {
    "storage.type": DEFINITIONS,
    "keyword.control": _BLOCKS,
    "keyword.other": {*STATEMENTS, *STEPS, *ACTIONS, *CLAUSES} - _BLOCKS,
    "constant.language": {*_TRUTH, *CONSTANTS},
    "keyword.operator.word": _JOINING,
    "variable.language": {*EXPRESSIONS, *PREDEFINED} - {*_TRUTH, *_JOINING},
    "support.type": NAMED_TYPES,
}
"""Scopes of words, wherever they stand but after a dot."""


def grammar() -> Mapping[str, object]:
    """Return the grammar as the tables of the language make it."""
    return {
        "name": "mech",
        "scopeName": SCOPE,
        "fileTypes": ["mech"],
        "patterns": [*_texts(), *_quantities(), *_names(), *_signs()],
    }


def text() -> str:
    """Return the grammar as the file that editors read."""
    return json.dumps(grammar(), indent=2, ensure_ascii=False) + "\n"


def _texts() -> list[Pattern]:
    return [
        _match("comment.line.double-slash", r"//.*"),
        {"name": _scoped("comment.block"), "begin": r"/\*", "end": r"\*/"},
        {
            "name": _scoped("string.quoted.double"),
            "begin": '"',
            "end": '"|$',
            "patterns": [_match("constant.character.escape", r"\\.")],
        },
    ]


def _quantities() -> list[Pattern]:
    unit = rf"(?>{UNIT_PATTERN})(?!\^)"
    scope = {"name": _scoped("support.type.unit")}
    number = {"name": _scoped("constant.numeric")}
    digits = r"(?:[0-9]+(?:\.[0-9]+)?|\.[0-9]+)(?:[eE][+-]?[0-9]+)?"
    closing = {"name": _scoped("punctuation.bracket")}
    return [
        {"match": rf"({digits})[ \t]+({unit})", "captures": {"1": number, "2": scope}},
        _match("constant.numeric", digits),
        {"match": rf"([)}}])[ \t]+({unit})", "captures": {"1": closing, "2": scope}},
    ]


def _names() -> list[Pattern]:
    free = r"(?<![\w.])"
    called = _match("support.function", rf"{free}{_any(BUILTINS)}(?=\()")
    words = [_match(scope, rf"{free}{_any(which)}\b") for scope, which in WORDS.items()]
    return [
        called,
        *words,
        _match("entity.name.type", r"[A-Z]\w+"),
        _match("variable.other", r"[^\W\d]\w*"),
    ]


def _signs() -> list[Pattern]:
    return [
        _match("keyword.operator", r"->|<>|<=|>=|==|[-+*/^<>=~:]"),
        _match("punctuation.terminator", ";"),
        _match("punctuation.separator", "[,.]"),
        _match("punctuation.bracket", r"[(){}\[\]]"),
    ]


def _match(scope: str, pattern: str) -> Pattern:
    return {"name": _scoped(scope), "match": pattern}


def _scoped(scope: str) -> str:
    return f"{scope}.mech"


def _any(words: Iterable[str]) -> str:
    return "(?:" + "|".join(map(re.escape, sorted(words))) + ")"


if __name__ == "__main__":
    print(text(), end="")
