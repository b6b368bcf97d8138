"""The grammar file by itself: conflicts, words, and agreement with Lark's own parser."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from lark import Lark
from lark.exceptions import GrammarError
from syntax import sample_files

from mechc.lang.build.rules import ACTIONS
from mechc.lang.diagnostics import Reporter
from mechc.lang.grammar.keywords import KEYWORDS, RESERVED
from mechc.lang.grammar.lexer import tokenise
from mechc.lang.grammar.tables import END, LexerMode, build_tables, grammar_text, load_tables
from mechc.lang.source import SourceFile
from mechc.lang.units import UNIT_NAMES, unit_end


def test_the_grammar_has_no_conflict() -> None:
    build_tables(grammar_text())  # strict: any conflict raises


def test_a_conflict_would_be_noticed() -> None:
    doubtful = grammar_text().replace(
        "?conjunction:", "?conjunction: disjunction AND conjunction -> binary |"
    )
    with pytest.raises(GrammarError):
        build_tables(doubtful)


def test_every_action_is_used_and_every_rule_has_one() -> None:
    used = {p.action for p in load_tables().productions if p.mode is LexerMode.CALL}
    assert not used ^ set(ACTIONS), f"rules of mech.lark and of lang/build/rules.py: {used ^ set(ACTIONS)}"


def test_the_word_list_is_that_of_the_grammar() -> None:
    apart = set(load_tables().keywords) ^ KEYWORDS
    assert not apart, f"words of mech.lark and of lang/grammar/keywords.py: {apart}"
    assert RESERVED <= KEYWORDS


def test_no_unit_is_a_word_that_can_follow_a_number() -> None:
    tables = load_tables()
    behind_a_number = {
        terminal
        for row in tables.moves
        if (after := row.get("NUMBER", -1)) >= 0
        for terminal in tables.moves[after]
    }
    words = {w for w, terminal in tables.keywords.items() if terminal in behind_a_number}
    assert {"then", "on", "at", "for", "loop", "to"} <= words
    assert words.isdisjoint(UNIT_NAMES)
    assert all(unit_end(word) == 0 for word in KEYWORDS)


def without_keywords_as_names() -> list[Path]:
    """Return the samples, without those that name inputs `from` and `to`: Lark's own lexer takes these for nothing but keywords."""
    flange = re.compile(r"^\s*input \w+ (from|to)\b", re.MULTILINE)
    return [path for path in sample_files() if not flange.search(path.read_text(encoding="utf-8"))]


@pytest.mark.parametrize("path", without_keywords_as_names(), ids=lambda p: p.stem)
def test_samples_have_the_same_tokens_with_larks_own_lexer(path: Path, reference_parser: Lark) -> None:
    """The lexer and the loop that drives the tables are ours: Lark alone must read the same."""
    source = SourceFile(path.name, path.read_text(encoding="utf-8"))
    ours, _ = tokenise(source, load_tables(), Reporter())
    interactive = reference_parser.parse_interactive(source.text)
    theirs = list(interactive.exhaust_lexer())
    interactive.feed_eof(theirs[-1])  # type: ignore[no-untyped-call]
    words = {t.upper() for t in KEYWORDS}
    assert ours[-1].kind == END
    assert [(t.start, t.end) for t in ours[:-1]] == [(_begin(t), t.end_pos) for t in theirs]
    for mine, other in zip(ours, theirs, strict=False):
        assert mine.kind == other.type or (mine.kind == "NAME" and other.type in words)


def _begin(token: object) -> int:
    """Lark's unit after a bracket begins with the blanks before it."""
    text, start = str(token), getattr(token, "start_pos")  # noqa: B009
    return int(start) + len(text) - len(text.lstrip())


@pytest.fixture(scope="module")
def reference_parser() -> Lark:
    return Lark(grammar_text(), parser="lalr", lexer="contextual", keep_all_tokens=True)
