"""Initial values: every statement about them, and which one wins."""

from __future__ import annotations

from fractions import Fraction

from mechc.lang import ast
from mechc.lang.diagnostics import Label
from mechc.lang.source import Span

from .. import model, types
from ..expressions.coordinates import Target, slice_elements, target_of
from ..instances.declared_types import distributed, fit
from ..instances.members import elementwise, type_of
from ..instances.modifications import cannot_modify
from ..model import Expression, Kind, Role, StartValue, Type
from ..names.instance import DECLARED, ROLE_WORDS, STATED, Modifier, VariableMember, rank_of
from ..names.scope import Flattening, Poisoned, Scope
from ..subscripts import Index, subscripts
from ..values.evaluate import elements, pick, whole_number
from .record import StatedStart, StatementRecord

_HIGHEST = {Role.COORDINATE: 2, Role.STATE: 1, Role.DISCRETE: 0}
"""The highest derivatives that may be given at the start."""


def initial(scope: Scope, statement: ast.Initial, record: StatementRecord) -> None:
    """Record an ``initial`` statement: of a variable, its rate, or any other expression."""
    left = scope.elaborate(statement.target)
    value = scope.elaborate(statement.start.value)
    _initial(scope, statement, left, value, record)


def _initial(
    scope: Scope, statement: ast.Initial, left: Expression, value: Expression, record: StatementRecord
) -> None:
    node, guess = statement.start.value, statement.start.guess
    target = target_of(scope, left)
    parts = slice_elements(left) if target is None else None
    if parts is not None:
        value = fit(scope, value, types.numeric(left.type), node.span, name=statement.target.span.text)
        for part, part_value in zip(parts, elements(value), strict=True):
            _initial(scope, statement, part, part_value, record)
        return
    if target is not None and target.rate > _HIGHEST.get(target.role, -1):
        raise _no_initial(scope, statement, target)
    wanted = left.type if left.type.kind is not Kind.POINT else types.numeric(left.type)
    if wanted.kind not in (*types.NUMERIC, Kind.ROTATION, Kind.BOOLEAN):
        raise scope.fail(
            "E0420",
            "'initial' needs a quantity",
            statement.target.span,
            caption=f"this is {types.describe(wanted)}",
        )
    name = statement.target.span.text
    declared = target.member.declaration.name_span if target else statement.target.span
    value = fit(scope, value, wanted, node.span, name=name, declared=declared)
    start = StartValue(value, guess, scope.origin(statement.span))
    if target is None or target.rate == _HIGHEST[target.role] > 0:  # what forces and equations give
        record.initials.append(model.InitialCondition(left, start, scope.origin(statement.span)))
        return
    rank = rank_of(scope, STATED)
    stated = StatedStart(target.member, target.indices, target.rate == 1, start, rank, statement.span)
    record.starts.setdefault(target.name, []).append(stated)


def _no_initial(scope: Scope, statement: ast.Initial, target: Target) -> Poisoned:
    span = statement.target.span
    if target.role is Role.COORDINATE:
        return scope.fail(
            "E0590",
            "initial values of third and higher derivatives are not supported yet",
            span,
            help="a start may state a value, a rate and an acceleration",
        )
    noun = ROLE_WORDS[target.role]
    what = f"the rate of {noun}" if target.rate else noun
    return scope.fail(
        "E0420",
        f"'{span.text}' is {what} and has no initial value",
        span,
        labels=(Label(target.member.declaration.name_span, "declared here"),),
    )


def stationary_start(scope: Scope, statement: ast.StationaryStart, record: StatementRecord) -> None:
    """Record that coordinates are at rest at the start and not accelerated, and that states do not change.

    Without names those of the instance and its components are meant, which are known only later.
    """
    if not statement.targets:
        record.stationary.append((scope, statement))
        return
    for node in statement.targets:
        expression = scope.elaborate(node)
        target = target_of(scope, expression)
        parts = (expression,) if target is not None else slice_elements(expression) or ()
        found = [target_of(scope, part) for part in parts]
        if not found or any(t is None or t.role not in _RESTING or t.rate for t in found):
            raise scope.fail(
                "E0420",
                f"'{node.span.text}' is neither a coordinate nor a state",
                node.span,
                caption="'initial stationary' takes what moves",
                help="state more by 'initial der(..) = 0;'",
            )
        for part, one in zip(parts, found, strict=True):
            assert one is not None
            _rest(scope, statement.span, part, one, record)


def all_stationary(record: StatementRecord) -> None:
    """Let everything rest that ``initial stationary;`` speaks of, but for what is driven."""
    driven = {_place(d.target) for d in record.drives}
    for scope, statement in record.stationary:
        prefix = f"{scope.path}." if scope.path else ""
        for member in record.variables:
            if member.role not in _RESTING or not member.name.startswith(prefix):
                continue
            whole = type_of(member)
            name = model.Name(type=whole, span=statement.span, name=member.name)
            target = Target(member.name, (), member.role, 0, whole, whole, member)
            if not any(place == member.name for place, _ in driven):
                _rest(scope, statement.span, name, target, record)
                continue
            given = [index for place, index in driven if place == member.name]
            for index in subscripts(whole.shape) if whole.shape else ():
                if not any(index[: len(one)] == one for one in given):
                    type = types.element_of(whole, len(index))
                    element = model.Element(type=type, span=statement.span, base=name, indices=index)
                    part = Target(member.name, index, member.role, 0, type, whole, member)
                    _rest(scope, statement.span, element, part, record)


def _place(expression: Expression) -> tuple[str, Index]:
    """Return the name of what is driven, and of which element."""
    indices: Index = ()
    while not isinstance(expression, model.Name):
        if isinstance(expression, model.Element):
            indices = (*expression.indices, *indices)
            expression = expression.base
        else:
            assert isinstance(expression, model.Derivative)
            expression = expression.operand
    return expression.name, indices


_RESTING = (Role.COORDINATE, Role.STATE)


def _rest(scope: Scope, span: Span, expression: Expression, target: Target, record: StatementRecord) -> None:
    """Record rates of zero, and conditions on what gives the highest derivative."""
    order = _HIGHEST[target.role]
    origin, time = scope.origin(span), scope.flattening.time_type.dimension
    rate = rate_type(scope.flattening, target.type)
    if order == 2:
        zero = model.Literal(type=types.with_shape(rate, ()), span=span, value=Fraction(0))
        start = StartValue(zero, False, origin)
        stated = StatedStart(target.member, target.indices, True, start, rank_of(scope, STATED), span)
        record.starts.setdefault(target.name, []).append(stated)
        rate = types.real(rate.dimension / time, rate.shape, rate.angle)
    highest = model.Derivative(type=rate, span=span, operand=expression, order=order)
    zero = model.Literal(type=types.with_shape(rate, ()), span=span, value=Fraction(0))
    record.initials.append(model.InitialCondition(highest, StartValue(zero, False, origin), origin))


# ---------------------------------------------------------------- which one wins


def rate_type(flattening: Flattening, type: Type) -> Type:
    """Return the type of the first derivative of a variable."""
    time = flattening.time_type.dimension
    if type.kind is Kind.ROTATION:
        return types.real(types.NUMBER.dimension / time, (3,), angle=True)
    return types.real(type.dimension / time, type.shape, type.angle)


def stated_starts(member: VariableMember, record: StatementRecord) -> list[StatedStart]:
    """Return every initial value stated for a coordinate or state: declaration, modifications, ``initial``."""
    type = type_of(member)
    found = []
    start = getattr(member.declaration, "start", None)
    if isinstance(start, ast.Start):
        value = elementwise(member.declaration, member.scope, start.value)
        name = member.declaration.name
        value = fit(
            member.scope, value, type, start.value.span, name=name, declared=member.declaration.name_span
        )
        origin = member.scope.origin(member.declaration.span)
        rank = rank_of(member.scope, DECLARED)
        found.append(StatedStart(member, (), False, StartValue(value, start.guess, origin), rank, start.span))
    for modifier in member.modifiers:
        try:
            found.append(_modification(member, modifier, type))
        except Poisoned:
            continue
    return found + record.starts.get(member.name, [])


def _modification(member: VariableMember, modifier: Modifier, type: Type) -> StatedStart:
    source, name = modifier.source, member.declaration.name
    scope = source.scope
    if len(modifier.path) > 1:
        raise cannot_modify(member, modifier, f"is {ROLE_WORDS[member.role]} and has nothing inside")
    if modifier.rate and member.role is not Role.COORDINATE:
        raise scope.fail("E0403", f"'{name}' is a state; only its value can be given", modifier.span)
    wanted = rate_type(scope.flattening, type) if modifier.rate else type
    position: Index = ()
    if modifier.path[0].indices:
        position = tuple(whole_number(scope, i, "an index") - 1 for i in modifier.path[0].indices)
        if len(position) > len(wanted.shape) or any(
            not 0 <= i < n for i, n in zip(position, wanted.shape, strict=False)
        ):
            raise scope.fail("E0314", f"'{name}' has no such element", modifier.span)
        wanted = types.element_of(wanted, len(position))
    value = distributed(scope, source.value(), wanted.shape, modifier.picks, source.node.span)
    declared = member.declaration.name_span
    label = f"der({name})" if modifier.rate else name
    value = fit(scope, value, wanted, source.node.span, name=label, declared=declared)
    start = StartValue(value, modifier.kind == "~", scope.origin(source.node.span))
    return StatedStart(member, position, modifier.rate, start, modifier.rank, modifier.span)


Elements = dict[Index, StartValue]


def winner(
    candidates: list[StatedStart], *, rate: bool, shape: tuple[int, ...]
) -> tuple[StartValue | None, Elements]:
    """Return the start value of the whole and those of single elements that win over it."""
    whole: StatedStart | None = None
    for candidate in candidates:
        if candidate.rate is rate and not candidate.indices:
            whole = _stronger(whole, candidate)
    single: dict[Index, StatedStart] = {}
    for candidate in candidates:
        if candidate.rate is not rate or not candidate.indices:
            continue
        if whole is not None and candidate.rank < whole.rank:
            continue
        for rest in subscripts(shape[len(candidate.indices) :]):
            index = candidate.indices + rest
            value = StartValue(
                pick(candidate.start.value, rest), candidate.start.guess, candidate.start.origin
            )
            part = StatedStart(candidate.member, index, rate, value, candidate.rank, candidate.span)
            single[index] = _stronger(single.get(index), part)
    return (whole.start if whole else None), {i: b.start for i, b in single.items()}


def _stronger(first: StatedStart | None, second: StatedStart) -> StatedStart:
    if first is None or second.rank > first.rank:
        return second
    if second.rank == first.rank:
        member = second.member
        name = f"der({member.name})" if second.rate else member.name
        raise member.scope.fail(
            "E0409",
            f"'{name}' is given two initial values at the same level",
            second.span,
            caption="second",
            labels=(Label(first.span, "first"),),
            help="leave one of them out",
        )
    return first
