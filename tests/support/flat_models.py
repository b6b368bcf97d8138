"""Short ways from a text to its flat model, or to what is said about it."""

from __future__ import annotations

import contextlib
from collections.abc import Mapping
from fractions import Fraction
from pathlib import Path

from mechc.compiler.flat.flatten import flatten
from mechc.compiler.flat.model import Definition, Expression, FlatModel, Literal, Variable
from mechc.compiler.flat.show import text
from mechc.lang.diagnostics import CompileError, Diagnostic, Reporter
from mechc.lang.parser import parse
from mechc.lang.source import SourceFile

Given = Fraction | int | float | bool | str


def flat(
    source: str,
    *,
    model: str | None = None,
    structural: Mapping[str, Given] | None = None,
    folder: Path | None = None,
) -> FlatModel:
    """Flatten a text that has no errors; it stands in the file ``model.mech`` of ``folder``."""
    reporter = Reporter()
    name = "model.mech" if folder is None else str(folder / "model.mech")
    return flatten(parse(SourceFile(name, source), reporter), reporter, model=model, structural=structural)


def said(
    source: str,
    *,
    model: str | None = None,
    structural: Mapping[str, Given] | None = None,
    folder: Path | None = None,
) -> tuple[Diagnostic, ...]:
    """Return everything that is said about a text."""
    reporter = Reporter()
    name = "model.mech" if folder is None else str(folder / "model.mech")
    with contextlib.suppress(CompileError):
        flatten(parse(SourceFile(name, source), reporter), reporter, model=model, structural=structural)
    return reporter.diagnostics


def codes(source: str, **options: str | Mapping[str, Given] | Path) -> list[str]:
    """Return the codes of everything that is said about a text, in order; short texts use little of what they declare."""
    return [d.code for d in said(source, **options) if d.code != "W0402"]  # type: ignore[arg-type]


def variable(model: FlatModel, name: str) -> Variable:
    return next(v for v in model.variables if v.name == name)


def definition(model: FlatModel, name: str) -> Definition:
    return next(d for d in model.definitions if d.name == name)


def value(expression: Expression | None) -> str:
    """Return an expression as text."""
    assert expression is not None
    return text(expression)


def number(expression: Expression | None) -> float:
    """Return the value of a literal number."""
    assert isinstance(expression, Literal) and isinstance(expression.value, Fraction)
    return float(expression.value)


def start(model: FlatModel, name: str) -> str:
    """Return the winning initial value of a variable with its sign: ``= 1`` or ``~ 0``."""
    found = variable(model, name).start
    assert found is not None
    return f"{'~' if found.guess else '='} {text(found.value)}"


def rate(model: FlatModel, name: str) -> str:
    """Return the winning initial rate of a coordinate with its sign."""
    found = variable(model, name).rate
    assert found is not None
    return f"{'~' if found.guess else '='} {text(found.value)}"
