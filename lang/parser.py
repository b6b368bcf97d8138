"""Tokens to syntax tree: the loop that drives the tables, and what it does after an error.

Nothing here is recursive, so no text, however nested, exhausts the stack.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from msgspec import Struct, field

from . import ast
from .build.builder import Builder
from .build.rules import ACTIONS
from .diagnostics import Diagnostic, Reporter
from .grammar.keywords import RESERVED
from .grammar.lexer import MOST_ERRORS, Token, tokenise
from .grammar.tables import END, LexerMode, ParserTables, load_tables
from .source import SourceFile, Span

if TYPE_CHECKING:
    from .mistakes.recovery import Situation

DEEPEST = 150
"""Most levels of nodes within nodes: later passes are recursive."""

VERSION = 1
"""The version of the language; the first line of a file may ask for it."""

_VERSION_LINE = re.compile(r"//[ \t]*mech[ \t]+(\d{1,9})[ \t]*")
_MOST_REPAIRS = 40
_PASSED: dict[tuple[int, int, str], int] = {}
"""What ``_passed`` found; there is one automaton."""


def parse(source: SourceFile, reporter: Reporter, piece: tuple[int, int] | None = None) -> ast.File:
    """Return the syntax tree of a file, or of the definitions in a piece of it, from one offset to another.

    Raises CompileError, with at most ``MOST_ERRORS`` errors in ``reporter``, where the text is not
    of the language.
    """
    tables = load_tables()
    problems = Reporter()
    tokens, comments = tokenise(source, tables, problems, piece)
    machine = _Machine(tables, tokens, Builder(source, problems), [tables.start])
    mended = {source.position(d.span.start)[0] for d in problems.diagnostics if d.span}
    whole = all(d.code != "E0108" for d in problems.diagnostics)  # else the rest of the file is missing
    while whole and not machine.advance():
        if not machine.repair(problems, mended) or len(problems.diagnostics) >= MOST_ERRORS:
            break
    _check_version(comments, problems)
    if not problems.has_errors:
        _check_depth(machine.items, problems)
    _hand_over(problems, reporter)
    return ast.File(
        source=source, items=machine.items, comments=comments, span=Span(source, 0, len(source.text))
    )


def _passed(tables: ParserTables, below: int, top: int, kind: str) -> int:
    """Return the state on top of ``below`` after all reductions before a token of this kind that make no value: of a number to a
    factor, to a term, and so on."""
    while (move := tables.moves[top].get(kind)) is not None and move < 0:
        production = tables.productions[~move]
        if production.mode is not LexerMode.PASS:
            break
        top = tables.gotos[below][production.origin]
    return top


def _fits(tables: ParserTables, states: list[int], kind: str) -> bool:
    """Tell whether a token of this kind follows what is here, once all that it ends is put together: a state that several rules
    share knows the words of all of them."""
    stack = states.copy()
    while (move := tables.moves[stack[-1]].get(kind)) is not None:
        if move >= 0:
            return True
        production = tables.productions[~move]
        if production.size:
            del stack[-production.size :]
        stack.append(tables.gotos[stack[-1]][production.origin])
    return False


class _Machine(Struct):
    """The stacks of the automaton: states, the value of each symbol, and where each begins."""

    tables: ParserTables
    tokens: list[Token]
    builder: Builder
    states: list[int]
    values: list[Any] = field(default_factory=list)
    starts: list[int] = field(default_factory=list)
    index: int = 0
    items: tuple[ast.Statement, ...] = ()
    repairs: int = 0
    trusted: int = 0  # tokens before this one were skipped or are suspect

    def advance(self, stop: int | None = None) -> bool:
        """Run to the end of the tokens (True), or stop with ``index`` at one that does not fit.

        With ``stop`` the tokens before that index are known to fit, and it goes no further.
        """
        tables, builder, source = self.tables, self.builder, self.builder.source
        states, values, starts, tokens = self.states, self.values, self.starts, self.tokens
        moves, gotos, productions = tables.moves, tables.gotos, tables.productions
        keywords, actions = tables.keywords, ACTIONS
        passes, calls, appends = LexerMode.PASS, LexerMode.CALL, LexerMode.APPEND
        end = tokens[self.index - 1].end if self.index else 0
        for index in range(self.index, len(tokens) if stop is None else stop):
            token = tokens[index]
            kind = token.kind
            if kind == "NAME" and token.text in keywords:
                word = keywords[token.text]
                there = moves[states[-1]]
                if token.text in RESERVED or (
                    word in there and (there[word] >= 0 or "NAME" not in there or _fits(tables, states, word))
                ):
                    kind = word
                    token = Token(kind, token.text, token.start, token.end)
            while True:
                move = moves[states[-1]].get(kind)
                if move is None:
                    self.index = index
                    return False
                if move >= 0:
                    states.append(move)
                    values.append(token)
                    starts.append(token.start)
                    end = token.end
                    break
                production = productions[~move]
                mode, size = production.mode, production.size
                if mode is passes:
                    key = (states[-2], states[-1], kind)
                    passed = _PASSED.get(key)
                    if passed is None:
                        passed = _PASSED[key] = _passed(tables, *key)
                    states[-1] = passed
                    continue
                children = values[-size:] if size else []
                start = starts[-size] if size else token.start
                if size:
                    del values[-size:], states[-size:], starts[-size:]
                if mode is calls:
                    if production.slots is not None:
                        children = [None if i is None else children[i] for i in production.slots]
                    span = Span(source, start, max(start, end))
                    value = actions[production.action](builder, children, span)
                elif mode is appends:
                    value = children[0]
                    value.append(children[-1])
                else:
                    value = children  # FIRST or EMPTY
                states.append(gotos[states[-1]][production.origin])
                values.append(value)
                starts.append(start)
                if kind == END and states[-1] == tables.end:
                    self.items = value
                    return True
        self.index = len(tokens) if stop is None else stop
        return False

    def situation(self) -> Situation:
        from .mistakes.recovery import Situation

        return Situation(
            self.tables,
            self.builder.source,
            self.tokens,
            self.index,
            self.states,
            self.values,
            self.starts,
        )

    def rewind(self) -> None:
        """Take back the reductions made for the token that does not fit, by reading its statement again.

        An LALR automaton may reduce before it finds out, and then knows less of what was expected.
        """
        situation, index = self.situation(), self.index
        depth, first = situation.depth, situation.first
        del self.states[depth + 1 :], self.values[depth:], self.starts[depth:]
        self.index = first
        self.advance(stop=index)

    def repair(self, problems: Reporter, mended: set[int]) -> bool:
        """Report the token that does not fit and make it fit, or skip; False where that is hopeless."""
        from .mistakes.recovery import Panic, TokenEdit, replaced_header, synchronise
        from .mistakes.syntax_errors import diagnose

        self.repairs += 1
        if self.repairs > _MOST_REPAIRS:
            return False
        self.rewind()
        situation = self.situation()
        problem, repair = diagnose(situation)
        line = self.builder.source.position(self.tokens[self.index].start)[0]
        unbalanced = any(d.code in ("E0115", "E0116", "E0120") for d in problems.diagnostics)
        consequence = unbalanced and isinstance(repair, Panic) and repair.stray_end
        if self.index >= self.trusted and line not in mended and not consequence:
            problems.add(problem)
        header = replaced_header(situation) if isinstance(repair, Panic) else None
        if header is not None:
            end, tokens = header
            del self.states[situation.depth + 1 :], self.values[situation.depth :]
            del self.starts[situation.depth :]
            self.index = situation.first
            TokenEdit(end - self.index, tokens).apply(self.tokens, self.index)
        elif isinstance(repair, Panic):
            place = synchronise(situation)
            if place is None:
                return False
            depth, self.index = place
            del self.states[depth + 1 :], self.values[depth:], self.starts[depth:]
        else:
            repair.apply(self.tokens, self.index)
        self.trusted = self.index + 3
        return True


def _line(d: Diagnostic) -> int:
    return d.span.file.position(d.span.start)[0] if d.span else 0


def _hand_over(problems: Reporter, reporter: Reporter) -> None:
    """Pass the errors on in the order of the text, and stop on any."""
    found = problems.diagnostics
    foreign = {
        _line(d) for d in found if d.code == "E0120"
    }  # 'def f(x):' is not a component with modifications
    found = tuple(d for d in found if d.code != "E0127" or _line(d) not in foreign)
    for d in sorted(found, key=lambda d: d.span.start if d.span else 0)[:MOST_ERRORS]:
        reporter.add(d)
    reporter.stop_on_errors()


def _check_version(comments: tuple[ast.Comment, ...], problems: Reporter) -> None:
    """Refuse a file whose first line asks for another version of the language: ``// mech 2``."""
    first = comments[0] if comments else None
    match = _VERSION_LINE.fullmatch(first.text) if first and first.span.start == 0 else None
    if first and match and int(match[1]) != VERSION:
        message = f"this file is written for version {match[1]} of the language"
        help = f"this compiler reads version {VERSION}: '// mech {VERSION}'"
        problems.error("E0130", message, first.span, help=help)


def _children(node: ast.Node) -> Iterator[ast.Node]:
    for name in node.__struct_fields__:
        value = getattr(node, name)
        if isinstance(value, ast.Node):
            yield value
        elif isinstance(value, tuple):
            yield from (v for v in value if isinstance(v, ast.Node))


def _check_depth(items: tuple[ast.Statement, ...], problems: Reporter) -> None:
    """Refuse nodes so deep that a recursive pass would fail; a node is no deeper than its text is long."""
    waiting: list[tuple[ast.Node, int]] = [(item, 1) for item in items]
    while waiting:
        node, depth = waiting.pop()
        if depth > DEEPEST:
            what = "statement" if isinstance(node, ast.Statement) else "expression"
            problems.error(
                "E0124",
                f"{what} nested too deeply",
                Span(node.span.file, node.span.start, node.span.start + 1),
                caption=f"more than {DEEPEST} levels",
                help="split it with 'let'; a long sum may be written 'sum({a, b, ..})'",
            )
            return
        if depth + 2 * (node.span.end - node.span.start) <= DEEPEST:
            continue
        waiting.extend((child, depth + 1) for child in _children(node))
