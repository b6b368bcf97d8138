"""Every statement of the grammar is in the tour (tests/models/language), and says something that is not dropped."""

from __future__ import annotations

import traceback
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest
from differentiable_modules import plain_text
from syntax import SAMPLES

from mechc.compiler.compilation import Compilation
from mechc.compiler.pipeline import compile_source
from mechc.compiler.targets.c import emit_c
from mechc.lang import ast
from mechc.lang.diagnostics import CompileError, Reporter
from mechc.lang.grammar import keywords
from mechc.lang.grammar.lexer import Token, tokenise
from mechc.lang.grammar.tables import load_tables
from mechc.lang.parser import parse
from mechc.lang.read import read_source
from mechc.lang.source import SourceFile

TOUR = sorted(SAMPLES.glob("*_tour*.mech"))
WHERE = "the tour: tests/models/language/*_tour*.mech"


def leaves(kind: type[ast.Statement]) -> Iterator[type[ast.Statement]]:
    for inner in kind.__subclasses__():
        yield from leaves(inner)
    if not kind.__subclasses__():
        yield kind


STATEMENTS = sorted(set(leaves(ast.Statement)), key=lambda kind: kind.__name__)
EVERY = pytest.mark.parametrize("kind", STATEMENTS, ids=[kind.__name__ for kind in STATEMENTS])


def statements(node: object) -> Iterator[ast.Statement]:
    """Yield all statements below a node, the outer ones first."""
    if isinstance(node, ast.Statement):
        yield node
    if isinstance(node, ast.Node):
        for name in node.__struct_fields__:
            yield from statements(getattr(node, name))
    elif isinstance(node, tuple):
        for item in node:
            yield from statements(item)


@cache
def found(path: Path) -> tuple[ast.Statement, ...]:
    return tuple(statements(parse(read_source(path), Reporter())))


@cache
def tokens(path: Path) -> list[Token]:
    return tokenise(read_source(path), load_tables(), Reporter())[0]


@pytest.mark.parametrize("word", sorted({*keywords.STATEMENTS, *keywords.DEFINITIONS, *keywords.ACTIONS}))
def test_every_word_is_in_the_tour(word: str) -> None:
    used = {token.text for path in TOUR for token in tokens(path)}
    assert word in used, f"no statement that begins with '{word}' is in {WHERE}"


def result(compilation: Compilation) -> str:
    """Return all that a model means: its code, the words of its events, what is drawn."""
    plan = compilation.equations.hybrid
    words: list[object] = (
        [(b.text, b.message, [c.message for c in b.checks]) for b in plan.branches] if plan else []
    )
    words.append(repr(compilation.equations.scene))
    words += [(s.name, s.kind, s.settings) for s in compilation.flat.studies]
    words += [compilation.program.experiments, [a.message for a in compilation.program.assertions]]
    return emit_c(compilation.program) + plain_text(compilation.program) + repr(words)


def compiled(source: SourceFile) -> str:
    """Return what a text means. Raises CompileError. (The values in other tracebacks are too long to be shown.)"""
    try:
        return result(compile_source(source, parts={"scene"}))
    except CompileError:
        raise
    except Exception as error:
        place = traceback.extract_tb(error.__traceback__)[-1]
        told = f"{source.name}: {type(error).__name__}: {error} at {place.filename}:{place.lineno}"
    pytest.fail(f"the stages do not know all of the tour: {told}", pytrace=False)


@cache
def whole(path: Path) -> str:
    return compiled(read_source(path))


@EVERY
def test_it_is_in_the_tour_and_counts(kind: type[ast.Statement]) -> None:
    """Without it the model is wrong, or another one."""
    places = [(path, s) for path in TOUR for s in found(path) if type(s) is kind]
    assert places, f"the statement ast.{kind.__name__} is not in {WHERE}"
    silent = []
    for path, statement in places:
        span, source = statement.span, read_source(path)
        text = source.text[: span.start] + source.text[span.end :].removeprefix(";")
        try:
            changed = compiled(SourceFile(source.name, text))
        except CompileError:
            return
        if changed != whole(path):
            return
        silent.append(f"{path.name}: {span.text[:60]!r}")
    pytest.fail(
        f"ast.{kind.__name__} says nothing: without {silent} all is as with it. "
        "Its case in compiler/flat/statements/elaborate.py, its meaning in compiler/mechanics"
    )
