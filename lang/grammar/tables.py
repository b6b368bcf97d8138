"""The parser's tables: made by Lark from ``mech.lark``, kept beside it in an installation, else in the user's cache folder.

Lark reads the grammar and constructs the LALR(1) automaton, which takes a second; ``parser.py``
drives it. Loading kept tables needs neither Lark nor the grammar text. They are kept as plain data after their
checksum: reading them executes nothing, and what is damaged is made again.
"""

from __future__ import annotations

import hashlib
import os
from collections import deque
from collections.abc import Iterator, Mapping
from enum import IntEnum
from functools import cache
from pathlib import Path
from typing import Any

from msgspec import Struct, msgpack

from ..units import UNIT_PATTERN

END = "$END"
"""The terminal after the last token."""


class LexerMode(IntEnum):
    """What reducing a production does with the values of its symbols."""

    CALL = 0  # the action of that name makes the value
    PASS = 1  # the value of the only symbol
    EMPTY = 2  # a new, empty list
    FIRST = 3  # a new list of the first value
    APPEND = 4  # the first value, a list, and the last value in it


class Production(Struct, frozen=True):
    """``slots`` names, for each child of the action, the symbol that gives it, or None where left out."""

    origin: str
    size: int
    mode: LexerMode
    action: str
    slots: tuple[int | None, ...] | None


class ParserTables(Struct, frozen=True):
    """``moves[state][terminal]`` is a state to shift to, or ``~p`` to reduce production ``p``;
    ``gotos[state][nonterminal]`` is the state after it. ``keywords`` and ``punctuation`` map words and
    signs to terminals, ``patterns`` the other terminals, those with a unit left out, to expressions."""

    moves: tuple[dict[str, int], ...]
    gotos: tuple[dict[str, int], ...]
    productions: tuple[Production, ...]
    start: int
    end: int
    keywords: Mapping[str, str]
    punctuation: Mapping[str, str]
    patterns: Mapping[str, str]


_LISTS = {"empty": LexerMode.EMPTY, "first": LexerMode.FIRST, "append": LexerMode.APPEND}
_WITH_UNITS = ("QUANTITY", "UNITTAG")
"""Terminals that the lexer finds without their patterns, by ``unit_end``."""

_FOLDER = Path(__file__).parent
_INSTALLED = _FOLDER
_MOST_KEPT = 4
_CHECKSUM = 32


def grammar_text() -> str:
    """Return the grammar with the units in place."""
    text = _FOLDER.joinpath("mech.lark").read_text(encoding="utf-8")
    return text.replace("@UNIT@", UNIT_PATTERN.replace("/", r"\/"))


def build_tables(grammar: str) -> ParserTables:
    """Construct the tables. Raises ``lark.exceptions.GrammarError`` on any conflict."""
    from lark import Lark
    from lark.lexer import Lexer, LexerState, Token
    from lark.parsers.lalr_analysis import Shift

    class NoLexer(Lexer):
        """Stand in for Lark's lexer, which is not used."""

        def __init__(self, configuration: object) -> None:
            pass

        def lex(self, lexer_state: LexerState, parser_state: object) -> Iterator[Token]:
            return iter(())

    parser = Lark(
        grammar, parser="lalr", lexer=NoLexer, strict=True, maybe_placeholders=True, keep_all_tokens=True
    )
    table = parser.parser.parser.parser.parse_table
    index = {table.start_states["start"]: 0}
    rows = []
    for state in _in_order(index, table.states, Shift):
        rows.append(sorted(table.states[state].items(), key=lambda item: str(item[0])))
    productions: list[Production] = []
    number: dict[int, int] = {}
    moves: list[dict[str, int]] = []
    gotos: list[dict[str, int]] = []
    terminals = {t.name for t in parser.terminals} | {END}
    for row in rows:
        moves.append({})
        gotos.append({})
        for symbol, (kind, argument) in row:
            if kind is Shift:
                (moves if symbol in terminals else gotos)[-1][str(symbol)] = index[argument]
                continue
            if id(argument) not in number:
                number[id(argument)] = len(productions)
                productions.append(_production(argument))
            moves[-1][str(symbol)] = ~number[id(argument)]
    keywords, punctuation, patterns = _terminals(parser)
    return ParserTables(
        tuple(moves),
        tuple(gotos),
        tuple(productions),
        index[table.start_states["start"]],
        index[table.end_states["start"]],
        keywords,
        punctuation,
        patterns,
    )


def _terminals(parser: Any) -> tuple[dict[str, str], dict[str, str], dict[str, str]]:
    """Return the terminals by keyword, by sign, and the patterns of the others but those with units."""
    keywords, punctuation, patterns = {}, {}, {}
    for terminal in parser.terminals:
        name, pattern = str(terminal.name), terminal.pattern
        if pattern.type == "re" and pattern.value.endswith(r"\b"):
            keywords[pattern.value.removesuffix(r"\b")] = name
        elif pattern.type == "str":
            punctuation[pattern.value] = name
        elif name not in _WITH_UNITS:
            patterns[name] = pattern.value
    return keywords, punctuation, patterns


def _in_order(index: dict[Any, int], states: Mapping[Any, Mapping[Any, Any]], shift: object) -> Iterator[Any]:
    """Number the states in the order in which they are reached, so that equal grammars give equal tables."""
    waiting = deque(index)
    while waiting:
        state = waiting.popleft()
        yield state
        for _, (kind, target) in sorted(states[state].items(), key=lambda item: str(item[0])):
            if kind is shift and target not in index:
                index[target] = len(index)
                waiting.append(target)


def _production(rule: Any) -> Production:
    """Translate a rule of Lark."""
    origin, size, alias = str(rule.origin.name), len(rule.expansion), rule.alias
    if rule.options.expand1 and alias is None and size == 1:
        return Production(origin, size, LexerMode.PASS, "", None)
    action = str(alias or origin)
    slots: tuple[int | None, ...] | None = None
    if rule.options.empty_indices:
        present = iter(range(size))
        slots = tuple(None if absent else next(present) for absent in rule.options.empty_indices)
    return Production(origin, size, _LISTS.get(action, LexerMode.CALL), action, slots)


@cache
def load_tables() -> ParserTables:
    """Return the tables, from beside the grammar or from the cache folder where they are there and fit this version."""
    name = _file_name()
    tables = _read(_INSTALLED / name) or _read(_cache_folder() / name)
    if tables is None:
        tables = build_tables(grammar_text())
        _keep(tables, _cache_folder() / name)
    return tables


def lay_beside_the_grammar() -> None:
    """Make the tables, and keep them where an installation finds them: a part of building it (setup.py)."""
    _keep(build_tables(grammar_text()), _INSTALLED / _file_name())


def _read(path: Path) -> ParserTables | None:
    try:
        content = path.read_bytes()
        checksum, data = content[:_CHECKSUM], content[_CHECKSUM:]
        if hashlib.sha256(data).digest() == checksum:
            return msgpack.decode(data, type=ParserTables)
    except Exception:  # absent, unreadable or damaged: whatever it is, the tables can be made again
        pass
    return None


def _file_name() -> str:
    """Name the file after all that its content depends on."""
    digest = hashlib.sha256()
    for part in ("mech.lark", "tables.py", "../units.py"):
        digest.update(_FOLDER.joinpath(part).read_bytes())
    return f"grammar-{digest.hexdigest()[:20]}.msgpack"


def _cache_folder() -> Path:
    from platformdirs import user_cache_path

    return user_cache_path("mechc")


def kept_tables() -> dict[str, bytes]:
    """Return the tables as they are kept beside the grammar: the name of the file and what it holds."""
    return {_file_name(): _content(load_tables())}


def _content(tables: ParserTables) -> bytes:
    data = msgpack.encode(tables)
    return hashlib.sha256(data).digest() + data


def _keep(tables: ParserTables, path: Path) -> None:
    """Write under a temporary name and rename, so that a second run never reads half a file.

    The tables of a few other versions stay beside it.
    """
    import tempfile

    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        handle, name = tempfile.mkstemp(dir=path.parent, prefix="grammar-", suffix=".new")
    except OSError:
        return  # no place for a cache: the next run makes the tables again
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(_content(tables))
        os.replace(name, path)
        kept = sorted(path.parent.glob("grammar-*.msgpack"), key=lambda p: p.stat().st_mtime)
        for old in kept[:-_MOST_KEPT]:
            old.unlink(missing_ok=True)
    except OSError:
        Path(name).unlink(missing_ok=True)
