"""Actions of the grammar that build what is drawn."""

from __future__ import annotations

from itertools import pairwise

from .. import ast
from ..source import Span
from .builder import Builder, Children, text_of


def draw(b: Builder, c: Children, span: Span) -> ast.Draw:
    _, shape, arguments, on, at, options, doc, _ = c
    given = arguments or ()
    for before, after in pairwise(given):
        if _order(after) < _order(before):
            message = "an argument without a name follows a named one"
            b.reporter.error("E0110", message, after.span, help="put the named ones last, then 's in a:b'")
    return ast.Draw(
        shape=shape.text,
        arguments=tuple(a for a in given if _order(a) == 0),
        keywords=tuple(a for a in given if isinstance(a, ast.Keyword)),
        samples=tuple(a for a in given if isinstance(a, ast.Generator)),
        on=on,
        at=at,
        options=tuple(options),
        doc=text_of(b, doc),
        span=span,
    )


def sampled(b: Builder, c: Children, span: Span) -> ast.Generator:
    return ast.Generator(name=c[0].text, range=c[2], span=span)


def _order(argument: ast.Node) -> int:
    return 1 if isinstance(argument, ast.Keyword) else 2 if isinstance(argument, ast.Generator) else 0
