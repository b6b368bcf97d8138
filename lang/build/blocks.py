"""Actions of the grammar that build blocks and the actions of events; see ``statements.py`` for what they get."""

from __future__ import annotations

from typing import Any

from .. import ast
from ..source import Span
from .builder import Builder, Children, items_of, text_of

# ---------------------------------------------------------------- blocks


def for_block(b: Builder, c: Children, span: Span) -> ast.For:
    return ast.For(name=c[1].text, range=c[3], body=tuple(c[5]), doc=text_of(b, c[8]), span=span)


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


# ---------------------------------------------------------------- actions of events


def reinit(b: Builder, c: Children, span: Span) -> ast.Reinit:
    return ast.Reinit(target=c[2], value=c[4], doc=text_of(b, c[6]), span=span)


def assign(b: Builder, c: Children, span: Span) -> ast.Assign:
    return ast.Assign(target=c[0], value=c[2], doc=text_of(b, c[3]), span=span)


def terminate(b: Builder, c: Children, span: Span) -> ast.Terminate:
    return ast.Terminate(message=text_of(b, c[2]), doc=text_of(b, c[4]), span=span)


def impulse(b: Builder, c: Children, span: Span) -> ast.Impulse:
    _, value, _, on, at, source, frame, doc, _ = c
    return ast.Impulse(value=value, on=on, at=at, source=source, frame=frame, doc=text_of(b, doc), span=span)


def release(b: Builder, c: Children, span: Span) -> ast.Release:
    return ast.Release(target=c[1], doc=text_of(b, c[2]), span=span)


def engage(b: Builder, c: Children, span: Span) -> ast.Engage:
    return ast.Engage(target=c[1], doc=text_of(b, c[2]), span=span)
