"""Models of curves: the interval, the ends, what is stationary, and what has no place in them."""

from __future__ import annotations

from mechc.lang import ast
from mechc.lang.diagnostics import Label

from .. import model, types
from ..expressions.coordinates import target_of, varies
from ..instances.declared_types import declared_type, fit
from ..model import Expression, Kind, Role, Type
from ..names.instance import Instance
from ..names.scope import Interval, Scope
from ..operands import free_names
from .record import StatementRecord, label_name
from .relations import sides

_RANGE = "a curve has a range: 'independent x from a to b;'"

_LOSES = "leave it out, or find the motion from its start: a model without a range"

_REFUSED: dict[type[ast.Statement], tuple[str, str]] = {
    ast.When: (
        "'when' is an event, and nothing happens along a curve",
        "a choice by place is written 'if x < a then .. else ..'",
    ),
    ast.Contact: (
        "a contact happens in time, and a curve is found as a whole",
        "an obstacle is an inequality: 'constraint c: z >= h;'",
    ),
    ast.State: (
        "a first-order state begins at one end, and a curve is found as a whole",
        "declare a coordinate, and constrain its slope: 'constraint c: der(s) = e;'",
    ),
    ast.Discrete: ("a discrete variable changes by events, of which a curve has none", "declare a parameter"),
    ast.Input: (
        "an input is told from outside in time, and a curve is found as a whole",
        "write it as a formula, or as 'table(x, {..}, {..})'",
    ),
    ast.Equation: (
        "a first-order equation begins at one end, and a curve is found as a whole",
        "constrain the slope: 'constraint c: der(z) = e;'",
    ),
    ast.Drive: (
        "a drive prescribes a motion in time",
        "write what is given as a constraint: 'constraint c: z = f(x);'",
    ),
    ast.Load: (
        "a force has no part in what is stationary",
        "write its potential: 'potential -F*x;', or put it into the integrand",
    ),
    ast.Damping: ("damping does not follow from anything stationary", _LOSES),
    ast.Friction: ("friction does not follow from anything stationary", _LOSES),
    ast.StationaryStart: (
        "a curve has two ends, and no start",
        "state a slope of zero: 'initial der(z) = 0;'",
    ),
    ast.Exact: ("a closed solution is compared with a motion", "write it as an output"),
}


def name_independent(scope: Scope, statement: ast.Independent) -> None:
    """Name the independent variable; with a range, open the interval of a curve."""
    flattening = scope.flattening
    flattening.independent = statement.name
    if statement.type:
        flattening.time_type = declared_type(scope, statement.type, statement.span)
    if statement.lower is None or statement.upper is None:
        return
    lower, upper = scope.elaborate(statement.lower), scope.elaborate(statement.upper)
    for node, value in ((statement.lower, lower), (statement.upper, upper)):
        if value.type.kind not in types.NUMERIC or value.type.shape:
            raise scope.fail(
                "E0305",
                "an end of the range is one number",
                node.span,
                caption=f"this is {types.describe(value.type)}",
            )
    if not statement.type:
        known = lower if types.is_zero(upper) or not types.is_zero(lower) else upper
        flattening.time_type = types.real(known.type.dimension, angle=known.type.angle)
    wanted = flattening.time_type
    lower = _end_of_range(scope, lower, wanted, statement.lower, statement)
    upper = _end_of_range(scope, upper, wanted, statement.upper, statement)
    unknown = [n for e in (lower, upper) for n in _unknown(scope, e, statement)]

    def functional() -> Type:
        return _type_of_functional(scope)

    flattening.interval = Interval(lower, upper, tuple(dict.fromkeys(unknown)), statement.span, functional)


def _end_of_range(
    scope: Scope, value: Expression, wanted: Type, node: ast.Expression, statement: ast.Independent
) -> Expression:
    if value.type.dimension != wanted.dimension and not types.is_zero(value):
        raise scope.fail(
            "E0551",
            f"the range of '{statement.name}' must end at {types.unit_words(wanted.dimension, wanted.angle)}",
            node.span,
            caption=f"this is {types.describe(types.numeric(value.type))}",
        )
    return fit(scope, value, wanted, node.span, name=statement.name)


def _unknown(scope: Scope, value: Expression, statement: ast.Independent) -> list[str]:
    """Return the coordinates that an end of the range is made of."""
    found = []
    for name in free_names(value):
        member = scope.flattening.variables.get(name)
        if name == "time":
            raise scope.fail("E0551", "the range of a variable ends at a known place", value.span)
        if member is None or member.role is Role.PARAMETER:
            continue
        declaration = member.declaration
        if member.role is not Role.COORDINATE or declaration.dimensions:
            raise scope.fail(
                "E0551",
                f"the range cannot end at '{name}'",
                value.span,
                labels=(Label(declaration.name_span, "declared here"),),
                help="it ends at parameters, or at a coordinate with a guess: 'coordinate b ~ 1 m;'",
            )
        found.append(name)
    return found


def _type_of_functional(scope: Scope) -> Type:
    """Return the type of what is stationary: of the statement, or of an action."""
    flattening, instance = scope.flattening, scope.instance
    assert instance is not None
    for stated in instance.cls.statements:
        if isinstance(stated.statement, ast.Stationary):
            inner = Scope(flattening, instance, stated.namespace)
            return inner.elaborate(stated.statement.value).type
    energy = types.NUMBER.dimension if flattening.dimensionless else types.ENERGY
    return types.real(energy * flattening.time_type.dimension)


# ---------------------------------------------------------------- statements


def refuse(scope: Scope, statement: ast.Statement) -> None:
    """Report a statement that only a motion can have."""
    if isinstance(statement, ast.Energy) and statement.kind == "dissipation":
        found: tuple[str, str] | None = ("dissipation does not follow from anything stationary", _LOSES)
    else:
        found = _REFUSED.get(type(statement))
    if found is None:
        return
    interval = scope.flattening.interval
    assert interval is not None
    raise scope.fail(
        "E0552",
        found[0],
        statement.span,
        labels=(Label(interval.span, "this makes it a model of a curve"),),
        help=found[1],
    )


def end(scope: Scope, statement: ast.Initial | ast.Final, record: StatementRecord) -> None:
    """Record a condition at one end of a curve."""
    upper = isinstance(statement, ast.Final)
    word = "final" if upper else "initial"
    if scope.flattening.interval is None:
        raise scope.fail(
            "E0550",
            "'final' is a condition at the upper end of a curve, and this model is not a curve",
            statement.span,
            help=_RANGE,
        )
    if statement.start.guess:
        raise scope.fail(
            "E0553",
            f"an end is known or free, and not guessed: '{word}' takes '='",
            statement.span,
            help="leave the statement out for a free end; the curve as a whole is guessed: 'coordinate z ~ f(x);'",
        )
    left = scope.elaborate(statement.target)
    node = statement.start.value
    target = target_of(scope, left)
    if target is not None and target.role is not Role.COORDINATE:
        raise scope.fail(
            "E0553", f"'{statement.target.span.text}' is the same along the curve", statement.span
        )
    if left.type.kind not in (*types.NUMERIC, Kind.POINT):
        raise scope.fail(
            "E0420",
            f"'{word}' needs a quantity",
            statement.target.span,
            caption=f"this is {types.describe(left.type)}",
        )
    declared = target.member.declaration.name_span if target else statement.target.span
    value = fit(
        scope,
        scope.elaborate(node),
        types.numeric(left.type),
        node.span,
        name=statement.target.span.text,
        declared=declared,
    )
    record.ends.append(model.End(left, value, upper, scope.origin(statement.span)))


def stationary(scope: Scope, statement: ast.Stationary, record: StatementRecord) -> None:
    """Record what is stationary."""
    if scope.flattening.interval is None:
        raise scope.fail(
            "E0550", "'stationary' belongs to a curve, and this model is not one", statement.span, help=_RANGE
        )
    if scope.path:
        raise scope.fail(
            "E0412", "only the model itself says what is stationary, no component", statement.span
        )
    if record.functional is not None:
        raise scope.fail(
            "E0554",
            "two things are stationary",
            statement.span,
            caption="second",
            labels=(Label(record.functional.span, "first"),),
            help="add them, or make one of them a constraint",
        )
    value = scope.elaborate(statement.value)
    node = statement.value
    if value.type.kind not in types.NUMERIC or value.type.shape:
        raise scope.fail(
            "E0305",
            "what is stationary is one number",
            node.span,
            caption=f"this is {types.describe(value.type)}",
        )
    if varies(scope.flattening, value):
        raise scope.fail(
            "E0555",
            "what is stationary is one number for the whole curve",
            node.span,
            caption="this has another value at each place",
            help=f"integrate it: 'stationary integral({' '.join(node.span.text.split())});'",
        )
    record.functional = value


def inequality(scope: Scope, statement: ast.Inequality, record: StatementRecord) -> None:
    """Record an inequality as ``greater - less`` of a constraint."""
    if scope.flattening.interval is None:
        raise scope.fail(
            "E0550",
            "an inequality belongs to a curve, and this model is not one",
            statement.span,
            help="what may be touched in a motion is 'contact gap restitution e;'",
        )
    condition = statement.condition
    assert isinstance(condition, ast.Binary)
    equation = ast.Constraint(
        kind="", label=statement.label, left=condition.left, right=condition.right, span=statement.span
    )
    left, right = sides(scope, equation, "the inequality")
    if condition.operator in ("<", "<="):
        left, right = right, left
    name = label_name(scope, statement.label, "constraint", record)
    record.constraints.append(model.Constraint(name, "inequality", left, right, scope.origin(statement.span)))


# ---------------------------------------------------------------- the whole


def variation(instance: Instance, record: StatementRecord) -> model.Variation | None:
    """Return what makes the model one of a curve; None where it is one of a motion."""
    flattening = instance.flattening
    interval = flattening.interval
    if interval is None:
        return None
    scope = Scope(flattening, instance, instance.cls.namespace)
    matter = [e.origin for e in record.energies] + [e.origin for e in record.masses]
    matter += [e.origin for e in record.inertias]
    if record.functional is None and not matter:
        if not flattening.reporter.has_errors:
            scope.report(
                "E0556",
                "nothing says what is stationary",
                interval.span,
                help="write 'stationary integral(..);', or energies, whose action is stationary then",
            )
        return None
    if record.functional is not None and matter:
        scope.report(
            "E0554",
            "energies have an action, and something else is stationary",
            record.functional.span,
            labels=(Label(matter[0].shown, "an energy"),),
            help="leave one of them out",
        )
    _check_guesses(scope, record, interval)
    origin = scope.origin(interval.span)
    return model.Variation(
        interval.lower, interval.upper, interval.unknown, tuple(record.ends), record.functional, origin
    )


def _check_guesses(scope: Scope, record: StatementRecord, interval: Interval) -> None:
    for member in record.variables:
        start = getattr(member.declaration, "start", None)
        if member.role is not Role.COORDINATE:
            continue
        name = member.declaration.name
        if member.type is not None and member.type.kind is Kind.ROTATION:
            scope.report(
                "E0552",
                "a rotation cannot be found as a curve",
                member.declaration.span,
                help="write the frame as rotz(a)*rotx(b)*rotz(c) with coordinates a, b, c",
            )
        elif isinstance(start, ast.Start) and not start.guess:
            known = "the end of the range is to be found" if member.name in interval.unknown else ""
            scope.report(
                "E0553",
                f"'{name}' is given a value, as if it were the same along the curve",
                start.span,
                caption=known or "of a curve this is a guess",
                help=f"write 'coordinate {name} ~ {start.value.span.text};' for a guess, "
                f"'initial {name} = ..;' and 'final {name} = ..;' for its ends",
            )
        elif member.name in interval.unknown and not isinstance(start, ast.Start):
            scope.report("E0553", f"'{name}' is unknown and needs a guess", member.declaration.span)
        rates = [m for m in member.modifiers if m.rate]
        for modifier in rates:
            scope.report(
                "E0553",
                f"a curve has no initial rate of '{name}'",
                modifier.span,
                help="its slope follows from what is stationary",
            )
