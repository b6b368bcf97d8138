"""``when`` statements: conditions and what happens on their rising edge."""

from __future__ import annotations

from typing import assert_never

from mechc.lang import ast
from mechc.lang.diagnostics import Label

from .. import model
from ..expressions.coordinates import target_of, whole_rotation
from ..expressions.references import contacts_of, find_instance, find_label
from ..instances.declared_types import fit
from ..model import Role
from ..names.instance import ROLE_WORDS
from ..names.scope import Poisoned, Scope
from .loads import make_load
from .record import StatementRecord
from .relations import assertion, truth_value


def when(scope: Scope, statement: ast.When, record: StatementRecord) -> None:
    """Record an event; a branch keeps its actions that are right."""
    inner = scope.for_events()
    branches = []
    for branch in statement.branches:
        condition = truth_value(inner, branch.condition, "the condition of 'when'")
        actions = []
        for action in branch.actions:
            try:
                actions += _actions(inner, action)
            except Poisoned:
                continue
        branches.append(model.EventBranch(condition, tuple(actions), scope.origin(branch.span)))
    record.events.append(model.Event(tuple(branches), scope.origin(statement.span)))


def _actions(scope: Scope, action: ast.Action) -> list[model.Action]:
    """Return an action; of a contact of shapes, one for each contact that it consists of."""
    if isinstance(action, ast.Release | ast.Engage):
        word = "release" if isinstance(action, ast.Release) else "engage"
        names = _switched(scope, action.target, word)
        return [model.Switch(name, word == "engage", scope.origin(action.span)) for name in names]
    return [_action(scope, action)]


def _action(
    scope: Scope, action: ast.Reinit | ast.Assign | ast.Terminate | ast.Impulse | ast.Assert
) -> model.Action:
    origin = scope.origin(action.span)
    match action:
        case ast.Reinit():
            return _reinit(scope, action)
        case ast.Assign():
            return _assign(scope, action)
        case ast.Terminate(message=message):
            return model.Terminate(message, origin)
        case ast.Impulse():
            return model.Impulse(make_load(scope, action, "impulse", ""), origin)
        case ast.Assert():
            return assertion(scope, action)
        case _:
            assert_never(action)


def _reinit(scope: Scope, action: ast.Reinit) -> model.Reinit:
    left = scope.elaborate(action.target)
    target = target_of(scope, left)
    allowed = target is not None and (
        (target.role is Role.COORDINATE and target.rate <= 1)
        or (target.role is Role.STATE and target.rate == 0)
    )
    if target is None or not allowed:
        discrete = target is not None and target.role is Role.DISCRETE
        raise scope.fail(
            "E0417",
            "'reinit' sets a coordinate, its rate or a state",
            action.target.span,
            caption=f"'{action.target.span.text}' is {ROLE_WORDS[target.role] if target else 'none of them'}",
            help=f"write '{action.target.span.text} := ...'" if discrete else whole_rotation(left),
        )
    value = scope.elaborate(action.value)
    name = action.target.span.text
    value = fit(
        scope, value, left.type, action.value.span, name=name, declared=target.member.declaration.name_span
    )
    return model.Reinit(left, value, scope.origin(action.span))


def _assign(scope: Scope, action: ast.Assign) -> model.Assign:
    left = scope.elaborate(action.target)
    target = target_of(scope, left)
    if target is None or target.role is not Role.DISCRETE:
        name = action.target.span.text
        moving = target is not None and target.role in (Role.COORDINATE, Role.STATE)
        labels = (Label(target.member.declaration.name_span, "declared here"),) if target else ()
        raise scope.fail(
            "E0416",
            f"':=' sets a discrete variable, '{name}' is {ROLE_WORDS[target.role] if target else 'none'}",
            action.target.span,
            labels=labels,
            help=f"write 'reinit({name}, ...)'" if moving else f"declare it as 'discrete {name} = ...;'",
        )
    value = scope.elaborate(action.value)
    name = action.target.span.text
    value = fit(
        scope, value, left.type, action.value.span, name=name, declared=target.member.declaration.name_span
    )
    return model.Assign(left, value, scope.origin(action.span))


NAMED = "name the constraint, as in 'constraint hold: a = b;'"


def _switched(scope: Scope, node: ast.Reference, word: str) -> list[str]:
    """Return the names of what is released or engaged: a constraint, contact, driven coordinate or cut joint."""
    label = find_label(scope, node)
    if label is not None and label.kind in ("constraint", "contact"):
        if isinstance(label.statement, ast.ContactOfShapes):
            return [contact.name for contact in contacts_of(label)]
        return [label.name]
    instance = find_instance(scope, node) if label is None else None
    if instance is not None:
        if instance.cls.places:
            return [instance.path]
        raise _not_switched(scope, node, word, f"'{instance.path}' is not a joint")
    if label is None:
        name = node.parts[0].name
        known = scope.instance.members if scope.instance is not None else {}
        if len(node.parts) == 1 and name not in known:
            raise scope.fail("E0201", f"unknown name '{name}'", node.span, help=NAMED)
        target = target_of(scope, scope.elaborate(node))
        if target is not None and target.role is Role.COORDINATE and not target.indices:
            return [target.name]
    raise _not_switched(scope, node, word, "")


def _not_switched(scope: Scope, node: ast.Reference, word: str, caption: str) -> Poisoned:
    return scope.fail(
        "E0212",
        f"'{word}' takes a named constraint, a contact, a driven coordinate or a cut joint",
        node.span,
        caption=caption,
        help=NAMED,
    )
