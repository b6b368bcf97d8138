"""Actions of the grammar that build blocks, where these are more than named children (``rules.py``)."""

from __future__ import annotations

from typing import Any

from .. import ast
from ..source import Span
from .builder import Builder, Children, items_of, text_of


def if_block(b: Builder, c: Children, span: Span) -> ast.If:
    _, condition, _, body, others, otherwise, _, _, doc, _ = c
    first = ast.IfBranch(condition=condition, body=tuple(body), span=_branch_span(b, condition, body))
    return ast.If(branches=(first, *others), otherwise=items_of(otherwise), doc=text_of(b, doc), span=span)


def _branch_span(b: Builder, condition: ast.Expression, body: list[Any]) -> Span:
    return condition.span.to(body[-1].span) if body else condition.span


def elseif_block(b: Builder, c: Children, span: Span) -> ast.IfBranch:
    return ast.IfBranch(condition=c[1], body=tuple(c[3]), span=_branch_span(b, c[1], c[3]))


def when_block(b: Builder, c: Children, span: Span) -> ast.When:
    _, condition, _, actions, others, _, _, doc, _ = c
    first = ast.WhenBranch(
        condition=condition, actions=tuple(actions), span=_branch_span(b, condition, actions)
    )
    return ast.When(branches=(first, *others), doc=text_of(b, doc), span=span)


def elsewhen_block(b: Builder, c: Children, span: Span) -> ast.WhenBranch:
    return ast.WhenBranch(condition=c[1], actions=tuple(c[3]), span=_branch_span(b, c[1], c[3]))
