"""The structure of a text: what its models declare, and which lines fold."""

from __future__ import annotations

from msgspec import Struct

from ..lang import ast
from ..lang.source import Span
from .document import Document


class Symbol(Struct, frozen=True):
    """One entry of the outline; ``kind``: model, function, type, component, parameter, variable, event, study."""

    name: str
    kind: str
    span: Span
    name_span: Span
    children: tuple[Symbol, ...] = ()


def symbols(document: Document) -> tuple[Symbol, ...]:
    """Return the outline of the last text that could be read."""
    return () if document.tree is None else _symbols(document.tree.items)


def _symbols(items: tuple[ast.Statement, ...]) -> tuple[Symbol, ...]:
    return tuple(s for item in items for one in ast.single(item) if (s := _symbol(one)))


def _symbol(item: ast.Statement) -> Symbol | None:
    match item:
        case ast.Model():
            return Symbol(item.name, "model", item.span, item.name_span, _symbols(item.body))
        case ast.Function():
            return Symbol(item.name, "function", item.span, item.name_span)
        case ast.Type():
            return Symbol(item.name, "type", item.span, item.name_span)
        case ast.Component():
            return Symbol(item.name, "component", item.span, item.name_span)
        case ast.Parameter():
            return Symbol(item.name, "parameter", item.span, item.name_span)
        case ast.Declaration():
            return Symbol(item.name, "variable", item.span, item.name_span)
        case ast.Experiment():
            return Symbol(f"experiment {item.name}".strip(), "event", item.span, item.span)
    return None


def folds(document: Document) -> list[tuple[int, int]]:
    """Return the first and last lines, from 1, of what can be folded: models and blocks of several lines."""
    if document.tree is None:
        return []
    found: list[tuple[int, int]] = []

    def visit(statements: tuple[ast.Statement, ...]) -> None:
        for statement in statements:
            first, last = (
                statement.span.file.position(p)[0] for p in (statement.span.start, statement.span.end)
            )
            if last > first:
                found.append((first, last))
            match statement:
                case ast.Model() | ast.Function() | ast.For():
                    visit(statement.body)
                case ast.If():
                    for branch in statement.branches:
                        visit(branch.body)
                    visit(statement.otherwise)

    visit(document.tree.items)
    return found
