"""What the parser knows where a token does not fit, and the ways to go on."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Sequence
from functools import cached_property
from typing import Any

from msgspec import Struct

from ..grammar.keywords import ACTIONS, DEFINITIONS, KEYWORDS, STATEMENTS, STEPS
from ..grammar.lexer import Token
from ..grammar.tables import END, ParserTables
from ..source import SourceFile, Span

OPENERS = {"LPAR": ")", "LBRACE": "}", "LSQB": "]"}
CLOSERS = {"RPAR": "(", "RBRACE": "{", "RSQB": "["}
KIND_OF = {")": "RPAR", "}": "RBRACE", "]": "RSQB"}

_BLOCKS = ("MODEL", "FUNCTION", "FOR", "IF", "WHEN")
_NAMED_BLOCKS = ("MODEL", "FUNCTION")
_BEGINNINGS = frozenset((*STATEMENTS, *DEFINITIONS, *STEPS, *ACTIONS, "end", "elsewhen", "elseif", "else"))


class TokenEdit(Struct, frozen=True):
    """Put tokens in place of the next ``delete`` ones and try again."""

    delete: int = 0
    insert: tuple[tuple[str, str], ...] = ()

    def apply(self, tokens: list[Token], index: int) -> None:
        position = tokens[index].start
        tokens[index : index + self.delete] = [Token(k, t, position, position) for k, t in self.insert]


class Panic(Struct, frozen=True):
    """Give up this statement and go on with the next.

    ``stray_end``: it is an 'end' too many, which is often the consequence of an earlier mistake.
    """

    stray_end: bool = False


Repair = TokenEdit | Panic


def words_of(kinds: frozenset[str]) -> list[str]:
    """Return the keywords among terminals, as they are written."""
    return sorted(kind.casefold() for kind in kinds if kind.casefold() in KEYWORDS)


class Situation(Struct, frozen=True, dict=True):
    """The automaton at a token that does not fit; nothing in here is changed."""

    tables: ParserTables
    source: SourceFile
    tokens: Sequence[Token]
    index: int
    states: Sequence[int]
    values: Sequence[Any]
    starts: Sequence[int]

    @property
    def token(self) -> Token:
        return self.tokens[self.index]

    @property
    def previous(self) -> Token | None:
        return self.tokens[self.index - 1] if self.index else None

    @property
    def following(self) -> Token:
        """The token after this one; the end repeats."""
        return self.tokens[min(self.index + 1, len(self.tokens) - 1)]

    def span(self, token: Token) -> Span:
        return Span(self.source, token.start, max(token.end, token.start))

    def line(self, token: Token) -> int:
        return self.source.position(token.start)[0]

    @cached_property
    def begins_line(self) -> bool:
        """True where nothing stands before the token on its line."""
        before = self.previous
        return before is None or self.source.position(before.end)[0] < self.line(self.token)

    # ------------------------------------------------ the automaton

    def accepts(self, kind: str, depth: int | None = None) -> bool:
        """True if a token of this kind could be shifted, with the stack cut to ``depth`` values."""
        moves, gotos, productions = self.tables.moves, self.tables.gotos, self.tables.productions
        states = list(self.states if depth is None else self.states[: depth + 1])
        while (move := moves[states[-1]].get(kind)) is not None:
            if move >= 0:
                return True
            production = productions[~move]
            if production.size:
                del states[-production.size :]
            states.append(gotos[states[-1]][production.origin])
            if states[-1] == self.tables.end:
                return kind == END
        return False

    @cached_property
    def expected(self) -> frozenset[str]:
        """The terminals that fit here."""
        return frozenset(k for k in self.tables.moves[self.states[-1]] if self.accepts(k))

    @property
    def expected_words(self) -> list[str]:
        return words_of(self.expected)

    def is_keyword(self, index: int) -> bool:
        """True where a token of this statement was taken as a keyword."""
        start = self.tokens[index].start
        values = self.values[self.depth :]
        return any(isinstance(v, Token) and v.start == start and v.kind != "NAME" for v in values)

    def is_list(self, state: int) -> bool:
        """True for a state in which a statement may begin or a block end."""
        row = self.tables.moves[state]
        return ("END" in row or END in row) and "EQUAL" not in row  # as after the head of a function

    @cached_property
    def depth(self) -> int:
        """The number of values below the statement that is being read."""
        return next((i for i in range(len(self.states) - 1, 0, -1) if self.is_list(self.states[i])), 0)

    @cached_property
    def first(self) -> int:
        """The index of the first token of the statement that is being read."""
        if self.depth >= len(self.starts):
            return self.index
        return bisect_left([t.start for t in self.tokens[: self.index]], self.starts[self.depth])

    @property
    def at_beginning(self) -> bool:
        """True where a statement should begin."""
        return self.first == self.index

    @cached_property
    def block(self) -> tuple[Token, int] | None:
        """The word that opened the innermost block, and its place on the stack."""
        for i in range(min(self.depth, len(self.values)) - 1, -1, -1):
            value = self.values[i]
            opens = isinstance(value, Token) and value.kind in _BLOCKS
            if opens and (value.kind in _NAMED_BLOCKS or self.is_list(self.states[i])):
                return value, i
        return None

    @cached_property
    def block_end(self) -> tuple[str, tuple[tuple[str, str], ...]]:
        """How the innermost block ends, as text and as tokens; nothing at the level of the file."""
        if self.block is None:
            return "", ()
        word, place = self.block
        if word.kind not in _NAMED_BLOCKS:
            return f"end {word.text};", (("END", "end"), (word.kind, word.text), ("SEMICOLON", ";"))
        name = self.values[place + 1].text
        return f"end {name};", (("END", "end"), ("NAME", name), ("SEMICOLON", ";"))

    @cached_property
    def function(self) -> Token | None:
        """The name of the function whose steps are being read."""
        for i in range(min(self.depth, len(self.values) - 1) - 1, -1, -1):
            value, name = self.values[i : i + 2]
            if isinstance(value, Token) and value.kind in _NAMED_BLOCKS:
                return name if value.kind == "FUNCTION" else None
        return None

    @cached_property
    def bracket(self) -> Token | None:
        """The innermost bracket of this statement that is still open."""
        closed = 0
        for value in reversed(self.values[self.depth :]):
            if isinstance(value, Token) and value.kind in CLOSERS:
                closed += 1
            elif isinstance(value, Token) and value.kind in OPENERS:
                if not closed:
                    return value
                closed -= 1
        return None


def synchronise(situation: Situation) -> tuple[int, int] | None:
    """Return the stack depth and token index where parsing can go on, or None at the end.

    It goes on after the next semicolon outside brackets of a later line, or before a line that
    begins with the word of a statement.
    """
    s = situation
    tokens, index = s.tokens, s.index
    while tokens[index].kind != END:
        if tokens[index].kind == "SEMICOLON":
            index += 1
            break
        if index > s.index and tokens[index].text in _BEGINNINGS and _begins_line(s, index):
            break
        index += 1
    if tokens[index].kind == END and s.index == index:
        return None
    kinds = [tokens[index].kind]
    word = s.tables.keywords.get(tokens[index].text) if kinds[0] == "NAME" else None
    if word is not None:
        kinds.insert(0, word)
    lists = [i for i in range(len(s.states) - 1, -1, -1) if s.is_list(s.states[i])]
    for kind in kinds:
        for depth in lists:
            if s.accepts(kind, depth):
                return depth, index
    return lists[0] if lists else 0, index


_HEADERS = {"if": "then", "elseif": "then", "when": "then", "elsewhen": "then", "for": "loop"}


def replaced_header(s: Situation) -> tuple[int, tuple[tuple[str, str], ...]] | None:
    """Return an empty header for the broken one of a block, and where that one ends.

    With it the block still opens, and its end closes something.
    """
    word = s.tokens[s.first].text
    if word not in _HEADERS or s.at_beginning:
        return None
    index = s.index
    while s.tokens[index].kind not in ("SEMICOLON", END):
        if s.tokens[index].text == _HEADERS[word]:
            middle = (("NAME", "i"), ("IN", "in"), ("NUMBER", "1")) if word == "for" else (("TRUE", "true"),)
            return index + 1, ((word.upper(), word), *middle, (_HEADERS[word].upper(), _HEADERS[word]))
        index += 1
    return None


def _begins_line(s: Situation, index: int) -> bool:
    return s.source.position(s.tokens[index - 1].end)[0] < s.line(s.tokens[index])
