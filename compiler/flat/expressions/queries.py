"""Type rules of the questions about named elements: reactions, multipliers, momenta, energies."""

from __future__ import annotations

from collections.abc import Callable

from mechc.lang import ast
from mechc.lang.diagnostics import Label
from mechc.lang.units import Dimension
from mechc.suggest import closest

from .. import types
from ..instances.declared_types import fit
from ..model import Apply, Element, Expression, Kind, Literal, Query, Role, Type
from ..names.instance import Instance, LabelMember
from ..names.scope import Interval, Poisoned, Scope
from .coordinates import Target, constraint_dimension, has_rates, on_the_curve, target_of, whole_rotation
from .kinematics import in_frame, position_argument
from .references import CONSTRAINING, contacts_of, find_instance, find_label, friction_of, question_of
from .signature import ElaboratedCall


def _argument(call: ElaboratedCall) -> ast.Reference | None:
    node = call.nodes[0]
    return node if isinstance(node, ast.Reference) else None


def _query(call: ElaboratedCall, type: Type, target: str, *arguments: Expression) -> Query:
    return Query(type=type, span=call.node.span, function=call.name, target=target, arguments=arguments)


def _energy(call: ElaboratedCall) -> Expression:
    return _query(call, types.real(call.dimension(types.ENERGY)), "")


def _not_named(
    call: ElaboratedCall, wanted: str, candidates: list[str], other: LabelMember | None = None
) -> Poisoned:
    """``other``: the named statement of another kind that was asked about."""
    node = call.nodes[0]
    near = closest(node.span.text, candidates)
    some = f"there is {', '.join(candidates[:5])}" if candidates else ""
    return call.scope.fail(
        "E0212",
        f"'{call.name}' asks about {wanted}, '{node.span.text}' is none",
        node.span,
        help=question_of(other.kind, node.span.text)
        if other
        else f"did you mean '{near}'?"
        if near
        else some or f"give one a name, as in 'constraint hold: a = b;', and ask '{call.name}(hold)'",
    )


def _labels(scope: Scope, kinds: tuple[str, ...]) -> list[str]:
    if scope.instance is None:
        return []
    names = {key[0]: None for key, label in scope.instance.labels.items() if label.kind in kinds}
    return list(names)


def _label(call: ElaboratedCall, kinds: tuple[str, ...], wanted: str) -> LabelMember:
    node = _argument(call)
    label = find_label(call.scope, node) if node is not None else None
    if label is None or label.kind not in kinds:
        joint = find_instance(call.scope, node) if node is not None else None
        if joint is not None and joint.cls.places and call.name == "multiplier":
            raise call.scope.fail(
                "E0212",
                f"'multiplier' asks about {wanted}, '{call.nodes[0].span.text}' is a joint",
                call.nodes[0].span,
                help=f"ask for 'reaction({joint.path})', its force, or 'moment({joint.path})'",
            )
        raise _not_named(call, wanted, _labels(call.scope, kinds), label)
    return label


def _per(call: ElaboratedCall, dimension: Dimension, per: Dimension) -> Dimension:
    return types.NUMBER.dimension if call.scope.flattening.dimensionless else dimension / per


def _frictions(call: ElaboratedCall) -> list[LabelMember]:
    """Return the frictions of all points of a contact of shapes, if it is ``c.friction`` of one that is asked about."""
    node = _argument(call)
    if node is None or len(node.parts) == 1 or node.parts[-1].name != "friction" or node.parts[-1].indices:
        return []
    parts = node.parts[:-1]
    contact = ast.Reference(parts=parts, span=parts[0].span.to(parts[-1].span))
    label = find_label(call.scope, contact)
    if label is None or not isinstance(label.statement, ast.ContactOfShapes):
        return []
    if label.statement.friction is None:
        raise call.scope.fail(
            "E0212",
            f"the contact '{label.name}' has no friction",
            node.span,
            labels=(Label(label.statement.span, "stated here"),),
            help="write 'contact .. with .. friction mu'",
        )
    rows = contacts_of(label)
    if call.name == "multiplier":
        raise call.scope.fail(
            "E0212",
            f"the frictions of '{label.name}' have no sum along a slip: each of its points has its own directions",
            node.span,
            help=f"ask for '{contact.span.text}.force', their forces and pressures in the world, "
            f"or of one point for 'multiplier({rows[0].name}.friction)'",
        )
    return [friction_of(call.scope, row, node.span) for row in rows]


def _multiplier(call: ElaboratedCall) -> Expression:
    _frictions(call)
    label = _label(call, CONSTRAINING, "a named constraint, contact or friction")
    if isinstance(label.statement, ast.ContactOfShapes):
        return _of_rows(call, contacts_of(label), "add", lambda row: _multiplier_of(call, row))
    return _multiplier_of(call, label)


def _multiplier_of(call: ElaboratedCall, label: LabelMember) -> Expression:
    type, of_rates = constraint_dimension(label)
    interval = call.scope.flattening.interval
    if interval is not None:
        return _query(call, _curve_multiplier(call, interval, label, type), label.name)
    if isinstance(label.statement, ast.Constraint) and label.statement.by is not None:
        return _query(call, effort_type(label.scope, label.statement.by, type.shape), label.name)
    dimension = _per(call, types.POWER if of_rates else types.ENERGY, type.dimension)
    result = _query(call, types.real(dimension, type.shape), label.name)
    if isinstance(label.statement, ast.Friction) and is_turned(label.scope, label.statement):
        return Apply(type=result.type, span=call.node.span, function="negate", arguments=(result,))
    return result


def _curve_multiplier(call: ElaboratedCall, interval: Interval, label: LabelMember, type: Type) -> Type:
    """Return the type of dJ/dc; of a constraint at every place, that of its density."""
    dimension = interval.functional().dimension / type.dimension
    if on_the_curve(call.scope.flattening, label):
        dimension = dimension / call.scope.flattening.time_type.dimension
    return types.real(dimension, type.shape)


def _closed(call: ElaboratedCall) -> Expression:
    if frictions := _frictions(call):
        return _of_rows(call, frictions, "or", lambda row: _query(call, types.BOOLEAN, row.name))
    label = _label(call, CONSTRAINING, "a named constraint, contact or friction")
    statement = label.statement
    options: tuple[ast.Option, ...] = ()
    if label.kind == "friction" and isinstance(statement, ast.Friction | ast.Contact):
        options = statement.options
    if any(_is_regularized(option) for option in options):
        raise call.scope.fail(
            "E0212",
            f"'closed' asks whether '{label.name}' sticks, and a regularized friction never does",
            call.nodes[0].span,
            labels=(Label(statement.span, "its law is smooth"),),
            help=f"its output 'creep({label.name.removesuffix('.friction')})' is the speed where it ought to stick",
        )
    if isinstance(statement, ast.ContactOfShapes):
        return _of_rows(call, contacts_of(label), "or", lambda row: _query(call, types.BOOLEAN, row.name))
    return _query(call, types.BOOLEAN, label.name)


def _of_rows(
    call: ElaboratedCall, rows: list[LabelMember], operator: str, ask: Callable[[LabelMember], Expression]
) -> Expression:
    """Return what is asked of all points of a contact of shapes: a sum, or whether any is so."""
    values = [ask(row) for row in rows]
    while len(values) > 1:  # in pairs, so that no formula is deep
        values = [
            values[k]
            if k + 1 == len(values)
            else Apply(
                type=values[k].type,
                span=call.node.span,
                function=operator,
                arguments=(values[k], values[k + 1]),
            )
            for k in range(0, len(values), 2)
        ]
    return values[0]


def _given(call: ElaboratedCall) -> Expression:
    """Return whether a name of this component has a value from the text around it, which is known while compiling."""
    node, instance = call.nodes[0], call.scope.instance
    name = node.parts[0].name if isinstance(node, ast.Reference) and len(node.parts) == 1 else ""
    known = {} if instance is None else {**instance.cls.declarations, **instance.cls.conditional}
    if instance is None or name not in known or node.span.text != name:
        near = closest(name, known)
        raise call.scope.fail(
            "E0212",
            "'given' asks about a name that this model declares",
            node.span,
            help=f"did you mean '{near}'?" if near else "",
        )
    told = any(not m.rate and len(m.path) == 1 for m in instance.modifiers.get(name, ()))
    return Literal(type=types.BOOLEAN, span=call.node.span, value=told)


def effort_type(scope: Scope, by: ast.Effort, shape: tuple[int, ...]) -> Type:
    """Return the type of what keeps a constraint: a force, a torque, or the value of an input."""
    on = scope.elaborate(by.on)
    if by.kind == "input":
        return types.numeric(on.type)
    if scope.flattening.dimensionless:
        return types.real(types.NUMBER.dimension, shape)
    if on.type.kind in (Kind.FRAME, Kind.POINT):
        return types.real(types.FORCE if by.kind == "force" else types.ENERGY, shape)
    rates = has_rates(scope.flattening, on)
    return types.real((types.POWER if rates else types.ENERGY) / on.type.dimension, shape)


def is_infinite(scope: Scope, node: ast.Expression | None) -> bool:
    """Tell whether a limit of friction is the word for an infinite one."""
    named = scope.instance is not None and INFINITE in scope.instance.members
    return node is not None and node.span.text == INFINITE and not named


def is_turned(scope: Scope, statement: ast.Friction) -> bool:
    """Tell whether a friction is recorded along the opposite of what it is written on: the infinite side stands backwards."""
    return statement.backward is not None and is_infinite(scope, statement.kinetic)


INFINITE = "infinite"


def _is_regularized(option: ast.Option) -> bool:
    return (
        option.name == "law" and isinstance(option.value, ast.String) and option.value.value == "regularized"
    )


def _power(call: ElaboratedCall) -> Expression:
    type = types.real(call.dimension(types.POWER))
    if len(call.nodes) == 1:
        if frictions := _frictions(call):
            return _of_rows(call, frictions, "add", lambda row: _power_of_contact(call, row))
        label = _label(call, ("force", "torque", "damping", "friction"), "a named force or torque")
        if isinstance(label.statement, ast.Contact):
            return _power_of_contact(call, label)
        return _query(call, type, label.name)
    target = _coordinate(call, 1)
    if target.type.shape or target.type.kind is Kind.ROTATION:
        raise call.scope.fail(
            "E0212",
            f"'power(f, q)' asks about one coordinate, '{call.nodes[1].span.text}' has several numbers",
            call.nodes[1].span,
            help="give an index, or give the force a name: 'power(name)'",
        )
    force = call.scope.elaborate(call.nodes[0])
    wanted = _per(call, types.ENERGY, target.type.dimension)
    number = force.type.kind in types.NUMERIC and not force.type.shape
    if not number or (force.type.dimension != wanted and not types.is_zero(force)):
        given = types.describe(force.type)
        raise call.scope.fail(
            "E0322",
            f"a force on '{call.nodes[1].span.text}' is {types.unit_words(wanted)}, this is {given}",
            call.nodes[0].span,
            caption=f"this is {given}",
        )
    rate = call.scope.elaborate(ast.Derivative(operand=call.nodes[1], order=1, span=call.nodes[1].span))
    return Apply(type=type, span=call.node.span, function="multiply", arguments=(force, rate))


def _power_of_contact(call: ElaboratedCall, label: LabelMember) -> Expression:
    """Return the power of the friction of a contact: its force along the slip times that."""
    slipping, _ = constraint_dimension(label)
    type = types.real(_per(call, types.POWER, slipping.dimension), slipping.shape)
    force = Query(type=type, span=call.node.span, function="multiplier", target=label.name)
    assert isinstance(label.statement, ast.Contact) and label.statement.along is not None
    slip = label.scope.elaborate(label.statement.along)
    return Apply(
        type=types.real(call.dimension(types.POWER)),
        span=call.node.span,
        function="dot" if slipping.shape else "multiply",
        arguments=(force, slip),
    )


def _coordinate(call: ElaboratedCall, index: int = 0) -> Target:
    """Return the coordinate that an argument names."""
    node = call.nodes[index]
    expression = call.scope.elaborate(node)
    target = target_of(call.scope, expression)
    if target is None or target.role is not Role.COORDINATE or target.rate:
        names = [] if call.scope.instance is None else _coordinates(call.scope.instance)
        near = closest(node.span.text, names)
        raise call.scope.fail(
            "E0212",
            f"'{call.name}' asks about a coordinate, '{node.span.text}' is none",
            node.span,
            help=whole_rotation(expression)
            or (f"did you mean '{near}'?" if near else "")
            or (f"the coordinates are {', '.join(names[:6])}" if names else ""),
        )
    return target


def _coordinates(instance: Instance) -> list[str]:
    return [n for n, m in instance.members.items() if isinstance(m.declaration, ast.Coordinate)]


def _momentum(call: ElaboratedCall) -> Expression:
    target = _coordinate(call)
    interval = call.scope.flattening.interval
    if interval is not None:
        return _of_elements(
            call,
            target,
            types.real(interval.functional().dimension / target.type.dimension, target.whole.shape),
        )
    action = (
        call.dimension(types.ACTION) if not call.scope.flattening.dimensionless else types.NUMBER.dimension
    )
    if target.type.kind is Kind.ROTATION:
        return _query(call, types.real(action, (3,)), target.name)
    return _of_elements(call, target, types.real(action / target.type.dimension, target.whole.shape))


def _of_elements(call: ElaboratedCall, target: Target, type: Type) -> Expression:
    """Return a question about a coordinate, or the element of it that was asked for."""
    query = _query(call, type, target.name)
    if not target.indices:
        return query
    element = types.element_of(type, len(target.indices))
    return Element(type=element, span=call.node.span, base=query, indices=target.indices)


def _reaction(call: ElaboratedCall) -> Expression:
    node = _argument(call)
    joint = find_instance(call.scope, node) if node is not None else None
    if joint is not None:
        _check_joint(call, joint)
        return _in_axes(
            call, _query(call, types.real(call.dimension(types.FORCE), (call.space(),)), joint.path)
        )
    target = _driven(call)
    if target.type.kind is Kind.ROTATION:
        return _query(call, types.real(call.dimension(types.ENERGY), (3,)), target.name)
    dimension = _per(call, types.ENERGY, target.type.dimension)
    return _of_elements(call, target, types.real(dimension, target.whole.shape))


def _driven(call: ElaboratedCall) -> Target:
    node = call.nodes[0]
    reference = _argument(call)
    label = find_label(call.scope, reference) if reference is not None else None
    if label is not None:
        raise call.scope.fail(
            "E0212",
            f"'{node.span.text}' is not a joint or coordinate",
            node.span,
            help=question_of(label.kind, node.span.text),
        )
    return _coordinate(call)


def _check_joint(call: ElaboratedCall, instance: Instance) -> None:
    if not instance.cls.places:
        raise call.scope.fail(
            "E0212",
            f"'{instance.path}' is not a joint",
            call.nodes[0].span,
            caption=f"{instance.cls.name} places no frame",
            help="ask for the reaction of the joint that carries it",
        )


def _in_axes(call: ElaboratedCall, vector: Expression) -> Expression:
    """Apply ``in = F``."""
    for keyword in call.node.keywords:
        if keyword.name == "in":
            frame = call.scope.elaborate(keyword.value)
            if frame.type.kind is not Kind.FRAME or frame.type.shape:
                raise call.scope.fail("E0332", "'in' takes a frame", keyword.value.span)
            return in_frame(call, vector, frame) if vector.type.shape else vector
    return vector


def _moment(call: ElaboratedCall) -> Expression:
    node = _argument(call)
    joint = find_instance(call.scope, node) if node is not None else None
    if joint is None:
        raise _not_named(call, "a joint", [])
    _check_joint(call, joint)
    shape = () if call.space() == 2 else (3,)
    return _in_axes(call, _query(call, types.real(call.dimension(types.ENERGY), shape), joint.path))


def _elaborated(call: ElaboratedCall) -> None:
    call.arguments = [call.scope.elaborate(node) for node in call.nodes]


def _inertia_tensor(call: ElaboratedCall) -> Expression:
    _elaborated(call)
    frame = call.frame(0)
    shape = () if call.space() == 2 else (3, 3)
    return _query(call, types.real(call.dimension(types.INERTIA), shape), "", frame)


def _mass_centre(call: ElaboratedCall) -> Expression:
    _elaborated(call)
    arguments = [position_argument(call, k) for k in range(len(call.arguments))]
    return _query(call, types.real(call.dimension(types.LENGTH), (call.space(),)), "", *arguments)


def _integral(call: ElaboratedCall) -> Expression:
    """Return the integral over the interval of a curve."""
    body = call.scope.elaborate(call.nodes[0])
    if body.type.kind not in types.NUMERIC or body.type.shape:
        raise call.scope.fail(
            "E0305",
            "the integrand must be one number",
            call.nodes[0].span,
            caption=f"this is {types.describe(body.type)}",
            help="write 'dot(v, v)' or 'norm(v)' for the size of a vector" if body.type.shape else "",
        )
    type = types.real(body.type.dimension * call.scope.flattening.time_type.dimension)
    return _query(call, type, "", body)


def _at(call: ElaboratedCall) -> Expression:
    """Return a value at one place of a curve."""
    scope = call.scope
    if scope.flattening.interval is None:
        raise scope.fail(
            "E0550",
            "'at' asks for a value at a point of a curve, and this model is not a curve",
            call.node.span,
            help="a curve has a range: 'independent x from a to b;'",
        )
    value, place = (scope.elaborate(node) for node in call.nodes)
    if value.type.kind not in types.NUMERIC:
        raise scope.fail(
            "E0308", f"'at' asks for numbers, this is {types.describe(value.type)}", call.nodes[0].span
        )
    wanted = scope.flattening.time_type
    place = fit(scope, place, wanted, call.nodes[1].span, name=scope.flattening.independent)
    return _query(call, types.numeric(value.type), "", value, place)


QUERY_RULES: dict[str, Callable[[ElaboratedCall], Expression]] = {
    "energy": _energy,
    "kinetic_energy": _energy,
    "potential_energy": _energy,
    "multiplier": _multiplier,
    "closed": _closed,
    "given": _given,
    "power": _power,
    "momentum": _momentum,
    "reaction": _reaction,
    "moment": _moment,
    "inertia_tensor": _inertia_tensor,
    "mass_centre": _mass_centre,
    "at": _at,
    "integral": _integral,
}
"""Rules that get their arguments unelaborated, because they name things."""
