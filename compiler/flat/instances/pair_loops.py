"""Contacts in two loops, as of each ball with each later one, that are one formula of one thing of each loop.

Such a contact is elaborated once. What it reads of each turn is told beside it (``ContactFamily``), and who forms the equations
sees whether the turns differ in nothing else.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from mechc.lang import ast

from ..names.instance import Instance, PairLoop
from ..names.scope import Scope
from ..names.space import branches_of
from ..values.evaluate import check_size, values_of, whole_number

FEW = 64
"""So many contacts have a formula for each; of more, those of a family are told by what they read."""


def pair_loop(instance: Instance, name: str, scopes: Sequence[Scope], inner: ast.For) -> PairLoop | None:
    """Return what is known of a loop within another one over ``name``; None where it is not a loop of contacts that one formula
    may be of."""
    if instance.flattening.each_pair or len(scopes) < 2 or not isinstance(inner.range, ast.Range):
        return None
    if inner.range.step is not None or _mentions(inner.range.stop, {name}):
        return None
    for statement in inner.body:
        if not isinstance(statement, ast.Contact) or not _is_told(statement, name, inner.name):
            return None
    first = [whole_number(scope, inner.range.start, "the start of a range") for scope in scopes]
    last = whole_number(scopes[0], inner.range.stop, "the end of a range")
    row = min(range(len(scopes)), key=lambda k: (first[k], k))
    count = last - first[row] + 1
    if sum(max(0, last - at + 1) for at in first) <= FEW:
        return None
    check_size(scopes[0], count + len(scopes), inner.range.span)
    whole = ast.Range(start=inner.range.start, stop=inner.range.stop, step=None, span=inner.range.span)
    turns = values_of(scopes[row], whole)
    outer = tuple(whole_number(scope, _variable(inner, name), "a turn") for scope in scopes)
    outside = scopes[row].without(name)
    return PairLoop(
        row,
        tuple(scopes),
        tuple(min(at, last + 1) - first[row] for at in first),
        tuple(outside.with_local({inner.name: turn}) for turn in turns),
        (outer, tuple(range(first[row], last + 1))),
        (name, inner.name),
    )


def _variable(at: ast.Node, name: str) -> ast.Reference:
    return ast.Reference(parts=(ast.Part(name=name, span=at.span),), span=at.span)


def _is_told(contact: ast.Contact, outer: str, inner: str) -> bool:
    """Tell whether what a contact reads of both loops can be told apart."""
    label = contact.label
    if label is None or any(option.name == "law" for option in contact.options):
        return False
    if [_plain(index) for index in label.indices] != [outer, inner]:
        return False
    bound = {one.name for one in _nodes(contact) if isinstance(one, ast.Generator)}
    for reference in outermost(contact):
        said = [name for name in (outer, inner) if _mentions(reference, {name})]
        plain = len(reference.parts) == 1 and not reference.parts[0].indices
        if len(said) > 1 or (_mentions(reference, bound) and not plain):
            return False
    return True


def read_of(contact: ast.Contact, name: str) -> list[ast.Reference]:
    """Return the references in a contact that say the variable of a loop."""
    return [one for one in outermost(contact) if _mentions(one, {name})]


def read_beside(contact: ast.Contact, names: Sequence[str]) -> list[ast.Reference]:
    """Return the references in a contact that say none of the variables, nor one of the statement itself."""
    bound = {one.name for one in _nodes(contact) if isinstance(one, ast.Generator)}
    return [one for one in outermost(contact) if not _mentions(one, {*names, *bound})]


def outermost(contact: ast.Contact) -> Iterator[ast.Reference]:
    """Yield the references in a contact, but none in the index of another one, nor in its name."""
    pending: list[ast.Node] = [
        node
        for node in (
            *(contact.gap, contact.restitution, contact.friction, contact.static, contact.along),
            *(option.value for option in contact.options),
        )
        if node is not None
    ]
    while pending:
        at = pending.pop()
        if isinstance(at, ast.Reference):
            yield at
        else:
            pending += _inside(at)


def _nodes(node: ast.Node) -> Iterator[ast.Node]:
    pending = [node]
    while pending:
        at = pending.pop()
        yield at
        pending += _inside(at)


def _inside(node: ast.Node) -> list[ast.Node]:
    if isinstance(node, ast.Reference):
        return [index for part in node.parts for index in part.indices]
    if isinstance(node, ast.Call):
        return [*node.arguments, *node.keywords]
    found: list[ast.Node] = []
    for name in branches_of(node.__class__):
        value = getattr(node, name)
        found += [v for v in (value if isinstance(value, tuple) else (value,)) if isinstance(v, ast.Node)]
    return found


def _mentions(node: ast.Node, names: set[str]) -> bool:
    return any(isinstance(one, ast.Reference) and one.parts[0].name in names for one in _nodes(node))


def _plain(index: ast.Expression) -> str:
    return index.name if isinstance(index, ast.Reference) and not index.parts[0].indices else ""
