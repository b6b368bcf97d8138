"""Statements of models of curves: the range, its ends, what is stationary, inequalities."""

from __future__ import annotations

from typing import Any

from .. import ast
from ..source import Span
from .builder import Builder, Children, plain_type, text_of


def inequality(b: Builder, c: Children, span: Span) -> ast.Inequality | ast.Constraint:
    condition = c[2]
    match condition:
        case ast.Binary(operator="==", left=left, right=right):
            sign = b.source.text.index("==", left.span.end)
            b.reporter.error(
                "E0119", "an equation is written with '='", Span(b.source, sign, sign + 2), help="write '='"
            )
            return ast.Constraint(
                kind="", label=c[1], left=left, right=right, doc=text_of(b, c[3]), span=span
            )
        case ast.Binary(operator="<" | "<=" | ">" | ">="):
            pass
        case _:
            b.reporter.error(
                "E0132",
                "a constraint is an equation, or, of a curve, an inequality",
                condition.span,
                caption="this has one side only",
                help=f"write 'constraint {condition.span.text} = 0;' or 'constraint {condition.span.text} >= 0;'",
            )
    return ast.Inequality(label=c[1], condition=condition, doc=text_of(b, c[3]), span=span)


def final(b: Builder, c: Children, span: Span) -> ast.Final:
    return ast.Final(target=c[1], start=c[2], doc=text_of(b, c[3]), span=span)


def independent(b: Builder, c: Children, span: Span) -> ast.Independent:
    type, name, dimensions = c[1]
    type = plain_type(b, type, "the independent variable")
    if dimensions:
        b.reporter.error("E0110", "the independent variable is a single number", dimensions[0].span)
    lower, upper = c[2] or (None, None)
    return ast.Independent(
        name=name.text, type=type, lower=lower, upper=upper, doc=text_of(b, c[3]), span=span
    )


def interval(b: Builder, c: Children, span: Span) -> tuple[Any, Any]:
    return c[1], c[3]


def stationary(b: Builder, c: Children, span: Span) -> ast.Stationary:
    return ast.Stationary(value=c[1], doc=text_of(b, c[2]), span=span)
