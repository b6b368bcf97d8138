"""Text to syntax trees for tests."""

from __future__ import annotations

from pathlib import Path

from mechc.lang import ast
from mechc.lang.diagnostics import CompileError, Diagnostic, Reporter
from mechc.lang.parser import parse
from mechc.lang.source import SourceFile

SAMPLES = Path(__file__).resolve().parents[1] / "models" / "language"


def sample_files() -> list[Path]:
    """The models that define the language by example, drafts of a gallery, and the library."""
    root = SAMPLES.parents[2]
    return sorted([*SAMPLES.rglob("*.mech"), *(root / "stdlib").glob("*.mech")])


def parse_text(text: str) -> ast.File:
    return parse(SourceFile("model.mech", text), Reporter())


def parse_expression(text: str) -> ast.Expression:
    (item,) = parse_text(f"let x_ = {text};").items
    assert isinstance(item, ast.Let)
    return item.value


def errors_of(text: str) -> list[Diagnostic]:
    """The errors of a text that must not parse."""
    try:
        parse_text(text)
    except CompileError as error:
        return list(error.diagnostics)
    raise AssertionError(f"this was accepted: {text!r}")
