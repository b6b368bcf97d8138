"""A flat model from the text of a file, with formulas that are asked for beside it."""

from __future__ import annotations

from collections.abc import Collection
from fractions import Fraction
from pathlib import Path

from msgspec.structs import replace

from mechc.lang import ast
from mechc.lang.diagnostics import Reporter
from mechc.lang.grammar.keywords import KEYWORDS
from mechc.lang.parser import parse
from mechc.lang.source import SourceFile

from .flatten import flatten
from .model import FlatModel


def flat_model_of(
    source: SourceFile,
    reporter: Reporter,
    *,
    model: str | None,
    structural: Collection[tuple[str, Fraction | bool | str]],
    search: tuple[Path, ...],
    formulas: Collection[tuple[str, str]],
    each_pair: bool = False,
) -> tuple[ast.File, FlatModel]:
    """Return the syntax tree and the flat model of one model of a text, with ``each_pair`` no contacts as families. Raises
    CompileError."""
    tree = parse(source, reporter)
    flat = flatten(
        tree,
        reporter,
        model=model,
        structural=dict(structural),
        search=search,
        further=tuple(_output(name, text, reporter) for name, text in formulas),
        each_pair=each_pair,
    )
    return tree, flat


def _output(name: str, text: str, reporter: Reporter) -> ast.Statement:
    """Read a formula from outside, which holds no semicolon, as an output of the model. Raises CompileError."""
    shown = name.removeprefix("asked_")  # messages show it as it was asked for
    if shown in KEYWORDS:
        shown = name
    (statement,) = parse(SourceFile(shown, f"output {shown} = {text};"), reporter).items
    assert isinstance(statement, ast.Output)
    return replace(statement, name=name)
