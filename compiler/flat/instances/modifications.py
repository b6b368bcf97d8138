"""Modifications of a member: which one wins, what it gives, and which are refused."""

from __future__ import annotations

from mechc.lang.diagnostics import Label

from ..model import Expression, Role, Type
from ..names.instance import ROLE_WORDS, InstanceMember, Modifier, VariableMember
from ..names.scope import Poisoned
from .declared_types import distributed, fit, refuse_one_number


def strongest(modifiers: list[Modifier], *, rate: bool = False) -> Modifier | None:
    """Return the winning modification; two of equal rank are reported."""
    best: Modifier | None = None
    for modifier in modifiers:
        if modifier.rate is not rate:
            continue
        if best is not None and modifier.rank == best.rank:
            raise twice(modifier, best)
        if best is None or modifier.rank > best.rank:
            best = modifier
    return best


def twice(modifier: Modifier, first: Modifier) -> Poisoned:
    """Report two modifications of equal rank."""
    name = modifier.path[0].name
    return modifier.source.scope.fail(
        "E0409",
        f"'{name}' is given two values at the same level",
        modifier.span,
        caption="second",
        labels=(Label(first.span, "first"),),
        help="leave one of them out",
    )


def modified_value(member: VariableMember, modifier: Modifier, target: Type) -> Expression:
    """Return the value that a modification gives to a member, fitted to its type."""
    source = modifier.source
    value = distributed(source.scope, source.value(), target.shape, modifier.picks, source.node.span)
    declaration = member.declaration
    if member.role is Role.PARAMETER:
        refuse_one_number(source.scope, value, target, source.node.span, declaration.name_span)
    return fit(
        source.scope, value, target, source.node.span, name=declaration.name, declared=declaration.name_span
    )


def check_plain(member: VariableMember, modifier: Modifier) -> None:
    """Report ``~``, a rate, an index or a deeper name in the modification of a plain value."""
    name, scope = member.declaration.name, modifier.source.scope
    noun = ROLE_WORDS[member.role]
    if len(modifier.path) > 1:
        raise scope.fail("E0401", f"'{name}' is {noun} and has nothing inside", modifier.span)
    if modifier.rate:
        raise scope.fail("E0403", f"'{name}' is {noun}; its rate cannot be set", modifier.span)
    if modifier.kind == "~" and (member.role is not Role.PARAMETER or member.structural):
        raise scope.fail(
            "E0403",
            f"'{name}' is {noun}, which is known and not guessed",
            modifier.span,
            help=f"write '{name} = ...'",
        )
    if modifier.path[0].indices:
        raise scope.fail(
            "E0403",
            f"one element of '{name}' cannot be modified alone",
            modifier.span,
            help="give all elements, as in '{1, 2, 3} m'",
        )


def cannot_modify(member: InstanceMember, modifier: Modifier, reason: str) -> Poisoned:
    """Report a modification of what has none; ``reason`` follows "it"."""
    name = member.declaration.name
    return modifier.source.scope.fail(
        "E0402",
        f"'{name}' cannot be modified: it {reason}",
        modifier.span,
        labels=(Label(member.declaration.name_span, "declared here"),),
        help="parameters, initial values, inputs and free frames can be modified",
    )
