"""Statements that relate quantities: constraint, drive, place, closure, equation, exact, assert."""

from __future__ import annotations

from contextlib import suppress

from mechc.lang import ast
from mechc.lang.diagnostics import Label

from .. import model, types
from ..expressions.coordinates import Target, has_unknowns, target_of, whole_rotation
from ..expressions.operators import meet
from ..instances.declared_types import broadcast, fit
from ..instances.frames import is_free
from ..model import Derivative, Expression, Kind, Role, Type
from ..names.instance import PlaceMember
from ..names.scope import Poisoned, Scope
from ..names.space import nodes
from ..unknowns import unknowns_in
from .record import JointParts, StatementRecord, label_name
from .servo import find_force, keep


def sides(
    scope: Scope, statement: ast.Constraint | ast.Closure | ast.Equation, what: str
) -> tuple[Expression, Expression]:
    """Return the two sides of an equation, of one dimension and shape."""
    left, right = scope.elaborate(statement.left), scope.elaborate(statement.right)
    for node, value in ((statement.left, left), (statement.right, right)):
        if value.type.kind not in types.NUMERIC:
            help = "write 'pos(F)' for its position" if value.type.kind is Kind.FRAME else ""
            raise scope.fail(
                "E0308",
                f"the sides of {what} are numbers",
                node.span,
                caption=f"this is {types.describe(value.type)}",
                help=help,
            )
    type = meet(scope, statement, left, right, f"the sides of {what}")
    left = _zero(left, type)
    right = _zero(right, type)
    if left.type.shape != right.type.shape:
        if not right.type.shape or not left.type.shape:
            return _matched(scope, left, right, statement)
        raise scope.fail(
            "E0305",
            f"the sides of {what} have different shapes",
            statement.right.span,
            caption=f"this is {types.describe(right.type)}",
            labels=(Label(statement.left.span, f"this is {types.describe(left.type)}"),),
        )
    return left, right


def _zero(value: Expression, type: Type) -> Expression:
    if types.is_zero(value) and not type.dimension.is_none:
        return types.retyped_zero(value, type.dimension, type.angle)
    return value


def _matched(
    scope: Scope, left: Expression, right: Expression, statement: ast.Constraint | ast.Closure | ast.Equation
) -> tuple[Expression, Expression]:
    """Spread a scalar zero over the shape of the other side; any other scalar is a mistake."""
    scalar, other = (right, left) if not right.type.shape else (left, right)
    node = statement.right if scalar is right else statement.left
    if not (isinstance(scalar, model.Literal) and scalar.value == 0):
        raise scope.fail(
            "E0305",
            "a single value equals no vector",
            node.span,
            caption=f"this is {types.describe(scalar.type)}, the other side {types.describe(other.type)}",
        )
    wide = broadcast(scope, scalar, types.numeric(other.type), node.span, "", None)
    return (left, wide) if scalar is right else (wide, right)


def constraint(scope: Scope, statement: ast.Constraint, record: StatementRecord) -> None:
    """Record a constraint."""
    left, right = sides(scope, statement, "the constraint")
    name = label_name(scope, statement.label, "constraint", record)
    origin = scope.origin(statement.span)
    record.constraints.append(model.Constraint(name, statement.kind, left, right, origin))
    if statement.by is not None:
        keep(scope, statement, statement.by, (name, left, right), record)


def drive(scope: Scope, statement: ast.Drive, record: StatementRecord) -> None:
    """Record a prescribed motion of a coordinate or its rate."""
    left = scope.elaborate(statement.target)
    target = target_of(scope, left)
    if target is None or target.role is not Role.COORDINATE or target.rate > 1:
        raise scope.fail(
            "E0420",
            "a drive prescribes a coordinate or its rate",
            statement.target.span,
            caption=f"'{statement.target.span.text}' is neither",
            help=whole_rotation(left) or "write 'drive q = f(time);' or 'drive der(q) = f(time);'",
        )
    value = scope.elaborate(statement.value)
    value = fit(
        scope,
        value,
        left.type,
        statement.value.span,
        name=statement.target.span.text,
        declared=target.member.declaration.name_span,
    )
    record.drives.append(model.Drive(left, value, scope.origin(statement.span)))


def hold_released_drives(record: StatementRecord) -> None:
    """Make constraints of the drives that an event releases or engages: their coordinates move freely meanwhile."""
    switched = frozenset[str]().union(*(event.switched for event in record.events))
    kept = []
    for item in record.drives:
        target = item.target.operand if isinstance(item.target, model.Derivative) else item.target
        if isinstance(target, model.Name) and target.name in switched and target.type.kind is Kind.REAL:
            record.constraints.append(model.Constraint(target.name, "", item.target, item.value, item.origin))
        else:
            kept.append(item)
    record.drives = kept


def place(scope: Scope, statement: ast.Place, parts: JointParts, record: StatementRecord) -> None:
    """Record the pose that a joint gives to its free frame."""
    target = statement.target
    instance = scope.instance
    assert instance is not None
    member = instance.members.get(target.parts[0].name)
    if (
        len(target.parts) != 1
        or not isinstance(member, PlaceMember)
        or not is_free(member)
        or member.declaration.dimensions
    ):
        help = f"declare it without a value: 'frame {target.parts[0].name};'"
        if len(target.parts) > 1:
            part, frame = target.parts[0].name, target.parts[-1].name
            help = f"bind it where the part is declared, as in 'Part {part}({frame} = world);', or give the part a joint"
        raise scope.fail(
            "E0412", f"'{target.span.text}' is not a free frame of this model", target.span, help=help
        )
    first = record.placed.get(member.name)
    if first is not None:
        raise scope.fail(
            "E0412",
            f"'{member.declaration.name}' is placed twice",
            statement.span,
            caption="again here",
            labels=(Label(first, "first here"),),
        )
    record.placed[member.name] = statement.span
    value = scope.elaborate(statement.value)
    if value.type.kind is not Kind.FRAME or value.type.shape:
        raise scope.fail(
            "E0332",
            "a frame is placed by a frame",
            statement.value.span,
            caption=f"this is {types.describe(value.type)}",
            help="begin with a frame, as in 'from * rot(angle)'",
        )
    parts.places.append((member.name, value, statement.span))


def closure(scope: Scope, statement: ast.Closure, parts: JointParts) -> None:
    """Collect an equation that holds where the joint of this model closes a loop."""
    instance = scope.instance
    assert instance is not None
    if not instance.cls.places:
        raise scope.fail(
            "E0412",
            "'closure' belongs to a joint, and this model places no frame",
            statement.span,
            help="write 'constraint' for an equation that always holds",
        )
    left, right = sides(scope, statement, "the closure")
    parts.closures.append(model.ClosureEquation(left, right, scope.origin(statement.span)))


def equation(scope: Scope, statement: ast.Equation, record: StatementRecord) -> None:
    """Record ``equation der(x) = e`` of a state, or an equation between unknown outputs."""
    left = scope.elaborate(statement.left)
    target = target_of(scope, left)
    if not (isinstance(left, Derivative) and target is not None and target.role is Role.STATE) and (
        has_unknowns(scope.flattening, left)
        or has_unknowns(scope.flattening, scope.elaborate(statement.right))
    ):
        implicit = model.ImplicitEquation(
            *sides(scope, statement, "the equation"), scope.origin(statement.span)
        )
        record.implicit.append(implicit)
        return
    if (
        not isinstance(left, Derivative)
        or target is None
        or target.role is not Role.STATE
        or target.rate != 1
    ):
        if not isinstance(left, Derivative) and any(
            _is_unknown(m) for m in scope.flattening.definitions.values()
        ):
            record.held.append((scope, statement))
            return
        raise _no_state(scope, statement, target)
    value = scope.elaborate(statement.right)
    value = fit(
        scope,
        value,
        left.type,
        statement.right.span,
        name=statement.left.span.text,
        declared=target.member.declaration.name_span,
    )
    record.equations.append(
        model.StateEquation(target.name, target.indices, value, scope.origin(statement.span))
    )


def _is_unknown(member: object) -> bool:
    declaration = getattr(member, "declaration", None)
    return isinstance(declaration, ast.Output) and declaration.guess is not None


def keep_by_unknowns(record: StatementRecord) -> None:
    """Let outputs of no equation of their own keep the equations between coordinates, as forces that servo constraints find."""
    values = {d.name: d.value for d in record.definitions}
    entering = {n for e in record.implicit for side in (e.left, e.right) for n in unknowns_in(side, values)}
    free = [u for u in record.unknowns if u.name not in entering]
    shapes = {d.name: d.type.shape for d in record.definitions}
    paired = len(free) == len(record.held) and not any(shapes[u.name] for u in free)
    for k, (scope, statement) in enumerate(record.held):
        with suppress(Poisoned):
            left, right = sides(scope, statement, "the equation")
            if not paired or left.type.shape:
                raise _no_state(scope, statement, target_of(scope, left))
            unknown = free[k]
            name = label_name(scope, None, "constraint", record)
            origin = scope.origin(statement.span)
            record.constraints.append(model.Constraint(name, "", left, right, origin))
            find_force(scope, (name, left, right), unknown.name, unknown.origin.span, record)


def _no_state(scope: Scope, statement: ast.Equation, target: Target | None) -> Poisoned:
    left = statement.left
    help = (
        "declare it as 'state', write 'constraint' for a relation between coordinates, or 'output x ~ guess;' for what "
        "equations determine"
    )
    moved = _accelerated(left)
    if moved:
        help = (
            f"accelerations follow from energies and forces: 'kinetic 1/2*m*der({moved})^2;' and, of what is no energy, "
            f"'force {statement.right.span.text} on {moved};'"
        )
    elif target is not None and target.role is Role.COORDINATE:
        help = "its motion follows from 'kinetic', 'potential' and 'force'; 'der(..)' is its rate wherever that is needed"
        if not isinstance(left, ast.Derivative):
            help = (
                f"a motion that is given is 'drive {left.span.text} = ..;', or, kept by a force elsewhere, "
                f"'constraint hold: {left.span.text} = .. by force on ..;'"
            )
    elif not isinstance(left, ast.Derivative):
        help = _solved(statement) or help
    name = left.operand.span.text if isinstance(left, ast.Derivative) else left.span.text
    return scope.fail(
        "E0421",
        "an equation gives the rate of a state",
        left.span,
        caption=f"'{name}' is not declared as 'state'"
        if isinstance(left, ast.Derivative)
        else "this asks for a motion, which forces make"
        if target is not None and target.role is Role.COORDINATE
        else "this is not 'der(x)' of a state",
        help=help,
    )


def _solved(statement: ast.Equation) -> str:
    """Say how an equation that contains a rate is solved for it; an empty text where it contains none."""
    for side, other in ((statement.left, statement.right), (statement.right, statement.left)):
        rates = [n for n in nodes(side) if isinstance(n, ast.Derivative)]
        if not rates:
            continue
        rate, rest = rates[0].span.text, other.span.text
        match side:
            case ast.Binary(operator="*", left=factor, right=ast.Derivative()):
                divisor = factor.span.text if isinstance(factor, ast.Reference) else f"({factor.span.text})"
                dividend = f"({rest})" if isinstance(other, ast.Binary) else rest
                return f"solve it for the rate: 'equation {rate} = {dividend}/{divisor};'"
            case ast.Derivative():
                return f"write the rate on the left: 'equation {rate} = {rest};'"
        return f"solve it for the rate: 'equation {rate} = ..;'"
    return ""


def _accelerated(left: ast.Expression) -> str:
    """Return what is differentiated twice, as in Newton's ``m*der(der(x))``; empty if nothing is."""
    for node in nodes(left):
        if isinstance(node, ast.Derivative):
            inner = node.operand
            if node.order == 2:
                return inner.span.text
            if isinstance(inner, ast.Derivative):
                return inner.operand.span.text
    return ""


def exact(scope: Scope, statement: ast.Exact, record: StatementRecord) -> None:
    """Record the closed solution of a coordinate, a state or an output."""
    left = scope.elaborate(statement.left)
    target = target_of(scope, _base(left))
    output = isinstance(_base(left), model.Name) and _is_output(scope, _base(left))
    if not output and (target is None or target.role not in (Role.COORDINATE, Role.STATE)):
        raise scope.fail(
            "E0420",
            "'exact' gives the solution of a coordinate, a state or an output",
            statement.left.span,
            help="declare an output for an expression: 'output y = ...;'",
        )
    value = scope.elaborate(statement.right)
    name = statement.left.span.text
    value = fit(
        scope, value, types.numeric(left.type), statement.right.span, name=name, declared=statement.left.span
    )
    record.exacts.append(model.ExactSolution(left, value, scope.origin(statement.span)))


def _base(expression: Expression) -> Expression:
    return expression.base if isinstance(expression, model.Element) else expression


def _is_output(scope: Scope, expression: Expression) -> bool:
    assert isinstance(expression, model.Name)
    member = scope.flattening.definitions.get(expression.name)
    return member is not None and isinstance(member.declaration, ast.Output)


def truth_value(scope: Scope, node: ast.Expression, what: str) -> Expression:
    """Return a condition."""
    value = scope.elaborate(node)
    if value.type.kind is not Kind.BOOLEAN or value.type.shape:
        raise scope.fail(
            "E0318",
            f"{what} must be true or false",
            node.span,
            caption=f"this is {types.describe(value.type)}",
            help="compare it, as in 'x > 0 m'" if value.type.kind in types.NUMERIC else "",
        )
    return value


def assertion(scope: Scope, statement: ast.Assert) -> model.Assertion:
    """Return a checked assertion."""
    condition = truth_value(scope, statement.condition, "the condition of 'assert'")
    return model.Assertion(condition, statement.message, scope.origin(statement.span))
