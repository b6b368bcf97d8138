"""Statements about forces: force, torque, damping, friction, contact, impulse."""

from __future__ import annotations

from mechc.lang import ast
from mechc.lang.diagnostics import Label
from mechc.lang.units import Dimension
from mechc.suggest import closest

from .. import model, types
from ..expressions.coordinates import has_rates
from ..expressions.missing_factor import missing_factor
from ..expressions.queries import is_infinite, is_turned
from ..instances.declared_types import fits
from ..instances.frames import frame_or_point
from ..model import Expression, Kind, Name, Type
from ..names.instance import Instance
from ..names.scope import Poisoned, Scope
from .record import StatementRecord, label_name


def load(scope: Scope, statement: ast.Load, record: StatementRecord) -> None:
    """Record a force or torque."""
    name = label_name(scope, statement.label, statement.kind, record)
    record.loads.append(make_load(scope, statement, statement.kind, name))


def make_load(scope: Scope, statement: ast.Load | ast.Impulse, kind: str, name: str) -> model.Load:
    """Return a checked force, torque or impulse."""
    on = scope.elaborate(statement.on)
    value = scope.elaborate(statement.value)
    origin = scope.origin(statement.span)
    if on.type.kind in (Kind.FRAME, Kind.POINT):
        return _on_body(scope, statement, kind, name, value, on)
    if on.type.kind not in types.NUMERIC or on.type.shape:
        raise scope.fail(
            "E0322",
            f"{types.with_article(kind)} is on a coordinate, a frame or a point",
            statement.on.span,
            caption=f"this is {types.describe(on.type)}",
            help="give an index" if on.type.shape and on.type.kind in types.NUMERIC else "",
        )
    for node, word in ((statement.at, "at"), (statement.frame, "in")):
        if node is not None:
            raise scope.fail(
                "E0322",
                f"'{word}' belongs to a vector {kind}; this one is on a single quantity",
                node.span,
                labels=(Label(statement.on.span, f"this is {types.describe(on.type)}"),),
            )
    _require_effort(scope, value, statement.value, on, statement.on, kind)
    source = None if statement.source is None else _other_scalar(scope, statement.source, on, statement.on)
    return model.Load(kind, name, value, on, None, source, None, origin)


def _other_scalar(scope: Scope, node: ast.Expression, on: Expression, on_node: ast.Expression) -> Expression:
    source = scope.elaborate(node)
    if not fits(source, on.type) or source.type.shape:
        raise scope.fail(
            "E0322",
            "both sides of a force must be of one kind",
            node.span,
            caption=f"this is {types.describe(source.type)}",
            labels=(Label(on_node.span, f"this is {types.describe(on.type)}"),),
        )
    return source


def _on_body(
    scope: Scope, statement: ast.Load | ast.Impulse, kind: str, name: str, value: Expression, on: Expression
) -> model.Load:
    """Return a force on a frame or point, or a torque on a frame."""
    on = frame_or_point(scope, statement.on, f"{types.with_article(kind)} is")
    space, components = scope.flattening.space, value.type.shape
    if space.size == 0 and components in ((2,), (3,)):  # the vector itself tells
        words = f"{types.with_article(kind)} of {components[0]} components"
        space.require(components[0], scope, statement.value.span, words)
    size = space.known(scope, statement.span)
    if kind == "torque":
        if on.type.kind is not Kind.FRAME:
            raise scope.fail("E0332", "a torque is on a frame, not on a point", statement.on.span)
        shape: tuple[int, ...] = () if size == 2 else (3,)
        dimension = types.ENERGY
    else:
        shape = (size,)
        dimension = types.MOMENTUM if kind == "impulse" else types.FORCE
    if scope.flattening.dimensionless:
        dimension = types.NUMBER.dimension
    _require_vector(scope, value, statement.value, types.real(dimension, shape), kind)
    at = None if statement.at is None else _point(scope, statement.at, f"{types.with_article(kind)} acts")
    source = None if statement.source is None else frame_or_point(scope, statement.source, "a reaction is")
    if at is not None:
        for end, node in ((on, statement.on), (source, statement.source)):
            if end is not None and node is not None and end.type.kind is Kind.POINT:
                raise scope.fail(
                    "E0332",
                    f"with 'at', {types.with_article(kind)} acts between frames, as what is rigid moves with them",
                    node.span,
                    caption="this is a point",
                    labels=(Label(at.span, "what is here moves as the frame says"),),
                    help="name the frame that carries it, or leave 'at' out",
                )
    frame = None
    if statement.frame is not None:
        frame = scope.elaborate(statement.frame)
        if frame.type.kind is not Kind.FRAME or frame.type.shape:
            raise scope.fail(
                "E0332",
                "'in' names the frame whose axes the components are in",
                statement.frame.span,
                caption=f"this is {types.describe(frame.type)}",
            )
    return model.Load(kind, name, value, on, at, source, frame, scope.origin(statement.span))


def _point(scope: Scope, node: ast.Expression, what: str) -> Expression:
    """Return a frame, a point, or world components as they are."""
    value = scope.elaborate(node)
    length = types.NUMBER.dimension if scope.flattening.dimensionless else types.LENGTH
    if value.type.kind is Kind.REAL and len(value.type.shape) == 1 and value.type.dimension == length:
        return value
    return frame_or_point(scope, node, what)


def _require_vector(scope: Scope, value: Expression, node: ast.Expression, wanted: Type, kind: str) -> None:
    if not fits(value, wanted):
        raise scope.fail(
            "E0322",
            f"{types.with_article(kind)} on a body is {_body_words(wanted)}",
            node.span,
            caption=f"this is {types.describe(value.type)}",
        )
    if value.type.shape != wanted.shape and not (types.is_zero(value) and not value.type.shape):
        space = "planar" if scope.flattening.space.size == 2 else "spatial"
        raise scope.fail(
            "E0305",
            f"in a {space} model {types.with_article(kind)} on a body is {_body_words(wanted)}",
            node.span,
            caption=f"this is {types.describe(value.type)}",
        )


# ---------------------------------------------------------------- generalised forces


def effort_dimension(scope: Scope, on: Expression, *, impulse: bool) -> Dimension:
    """Return the dimension of the generalised force on a quantity: power divided by its rate.

    A quantity that contains velocities is itself a rate.
    """
    if scope.flattening.dimensionless:
        return types.NUMBER.dimension
    rates = has_rates(scope.flattening, on)
    total = types.POWER if rates else types.ENERGY
    if impulse:
        total = total * types.TIME
    return total / on.type.dimension


def _body_words(wanted: Type) -> str:
    """Return what a load on a body is; a torque has the dimension of an energy."""
    if wanted.dimension != types.ENERGY:
        return types.describe(wanted)
    return f"a vector of {wanted.shape[0]} torques (N.m)" if wanted.shape else "one value in N.m"


def _effort_words(on: Expression, dimension: Dimension) -> str:
    torque = on.type.angle and dimension == types.ENERGY
    return "a torque (N.m)" if torque else types.unit_words(dimension)


def _require_effort(
    scope: Scope,
    value: Expression,
    node: ast.Expression,
    on: Expression,
    on_node: ast.Expression,
    kind: str,
) -> None:
    dimension = effort_dimension(scope, on, impulse=kind == "impulse")
    if not fits(value, types.real(dimension)):
        given = types.describe(value.type)
        raise scope.fail(
            "E0322",
            f"{types.with_article(kind)} on {types.unit_words(on.type.dimension, on.type.angle)} "
            f"is {_effort_words(on, dimension)}",
            node.span,
            caption=f"this is {given}",
            labels=(Label(on_node.span, f"it acts on {types.unit_words(on.type.dimension, on.type.angle)}"),),
            help=_effort_help(scope, value, on, dimension, kind),
        )
    if value.type.shape:
        raise scope.fail(
            "E0305",
            f"{types.with_article(kind)} on a single quantity is one value",
            node.span,
            caption=f"this is {types.describe(value.type)}",
        )


def _effort_help(scope: Scope, value: Expression, on: Expression, wanted: Dimension, kind: str) -> str:
    """Say what a force on something lacks, or that it is on nothing that moves."""
    if isinstance(on, Name) and on.name == scope.flattening.independent:
        return f"{types.with_article(kind)} acts on a coordinate, or on a length or an angle made of coordinates: name it after 'on'"
    return missing_factor(scope, value.type.dimension, wanted)


def quantity(scope: Scope, node: ast.Expression, what: str) -> Expression:
    """Return a single number that something acts on."""
    on = scope.elaborate(node)
    if on.type.kind not in types.NUMERIC or on.type.shape:
        raise scope.fail(
            "E0322",
            f"{what} acts on a single quantity",
            node.span,
            caption=f"this is {types.describe(on.type)}",
            help="give an index" if on.type.shape and on.type.kind in types.NUMERIC else "",
        )
    return on


def damping(scope: Scope, statement: ast.Damping, record: StatementRecord) -> None:
    """Check the dimension of a damping, which is power divided by the square of a rate, and record it."""
    on = quantity(scope, statement.on, "damping")
    value = scope.elaborate(statement.value)
    flattening = scope.flattening
    wanted = types.NUMBER.dimension
    if not flattening.dimensionless:
        rate = on.type.dimension if has_rates(flattening, on) else on.type.dimension / types.TIME
        wanted = types.POWER / rate / rate
    if not fits(value, types.real(wanted)) or value.type.shape:
        raise scope.fail(
            "E0322",
            f"the damping of {types.unit_words(on.type.dimension, on.type.angle)} is in {wanted.pretty()}",
            statement.value.span,
            caption=f"this is {types.describe(value.type)}",
            labels=(
                Label(statement.on.span, f"it acts on {types.unit_words(on.type.dimension, on.type.angle)}"),
            ),
            help="'damping c on q' means the force -c*der(q)",
        )
    name = label_name(scope, statement.label, "damping", record)
    record.dampings.append(model.Damping(name, value, on, scope.origin(statement.span)))


# ---------------------------------------------------------------- friction and contact

_FRICTION_OPTIONS = ("law", "v_stick")
CONTACT_OPTIONS = ("rest", "impacts", "law", "v_stick")
_LAWS = ("stick", "regularized")


def friction(scope: Scope, statement: ast.Friction, record: StatementRecord) -> None:
    """Check the limits and options of a dry friction and record it."""
    on = quantity(scope, statement.on, "friction")
    kinetic, static = (
        _limit(scope, statement.kinetic, on, statement),
        _limit(scope, statement.static, on, statement),
    )
    backward = _limit(scope, statement.backward, on, statement)
    static_backward = _limit(scope, statement.static_backward, on, statement)
    speed = _slip_type(scope, on)
    options = _options(scope, statement.options, _FRICTION_OPTIONS, speed, "friction")
    name, origin = label_name(scope, statement.label, "friction", record), scope.origin(statement.span)
    if statement.backward is not None and (kinetic is None or backward is None):
        _check_one_way(scope, statement, kinetic, backward, static, static_backward)
        turned = is_turned(scope, statement)
        if turned:
            on = model.Apply(type=on.type, span=on.span, function="negate", arguments=(on,))
        free, static = (backward, static_backward) if turned else (kinetic, static)
        assert free is not None
        record.frictions.append(
            model.Friction(name, free, static, on, options, origin, one_way=True, reversed=turned)
        )
        return
    if kinetic is None or (static is None and statement.static is not None):
        raise scope.fail(
            "E0725",
            "an infinite limit holds one side of a friction",
            (statement.static or statement.kinetic).span,
            help="write 'forward 0 N backward infinite' for what locks backwards, 'constraint' for what never moves",
        )
    record.frictions.append(
        model.Friction(name, kinetic, static, on, options, origin, backward, static_backward)
    )


def _limit(
    scope: Scope, node: ast.Expression | None, on: Expression, statement: ast.Friction
) -> Expression | None:
    """Return a limit of friction; None where none is stated, or where it is infinite."""
    if node is None or is_infinite(scope, node):
        return None
    value = scope.elaborate(node)
    _require_effort(scope, value, node, on, statement.on, "friction force")
    return value


def _check_one_way(
    scope: Scope,
    statement: ast.Friction,
    kinetic: Expression | None,
    backward: Expression | None,
    static: Expression | None,
    static_backward: Expression | None,
) -> None:
    """Report what an infinite side cannot have beside it."""
    assert statement.backward is not None
    if kinetic is None and backward is None:
        raise scope.fail(
            "E0725",
            "a friction that never gives way is a constraint",
            statement.backward.span,
            caption="both sides are infinite",
            help=f"write 'constraint der({statement.on.span.text}) = 0;', which holds on both sides",
        )
    if statement.static is not None and (static is None, static_backward is None) != (
        kinetic is None,
        backward is None,
    ):
        raise scope.fail(
            "E0725",
            "a side of a friction is infinite while it sticks and while it slides",
            statement.static.span,
            labels=(Label(statement.kinetic.span, "while it slides"),),
            help="write 'infinite' on the same side of both",
        )
    for option in statement.options:
        if option.name == "law" and option.value.span.text == '"regularized"':
            raise scope.fail(
                "E0725",
                "a smooth law has no infinite side",
                option.value.span,
                labels=(Label(statement.kinetic.span.to(statement.backward.span), "infinite here"),),
                help="write a large limit in its place, or leave the law out",
            )


def _slip_type(scope: Scope, on: Expression) -> Type:
    if has_rates(scope.flattening, on):
        return types.real(on.type.dimension)
    return types.real(on.type.dimension / scope.flattening.time_type.dimension)


def contact(scope: Scope, statement: ast.Contact, record: StatementRecord) -> None:
    """Check gap, coefficients, slip and options of a contact and record it."""
    gap = quantity(scope, statement.gap, "a contact")
    restitution = _number(scope, statement.restitution, "a restitution")
    coefficient = _number(scope, statement.friction, "a coefficient of friction")
    static = _number(scope, statement.static, "a coefficient of friction")
    along = None if statement.along is None else _slip(scope, statement.along)
    speed = types.real(gap.type.dimension / scope.flattening.time_type.dimension)
    options = _options(scope, statement.options, CONTACT_OPTIONS, speed, "contact")
    pair = _pair(scope)
    for option, outer in () if pair is None else pair.options:
        if option.name not in options:
            options |= _options(outer, (option,), CONTACT_OPTIONS, speed, "contact")
    name = label_name(scope, statement.label, "contact", record)
    origin = scope.origin(statement.span)
    found = model.Contact(
        name, gap, restitution, coefficient, static, along, options, origin, pair is not None
    )
    record.contacts.append(found)


def _pair(scope: Scope) -> Instance | None:
    """Return the contact of two shapes of which a contact is part."""
    instance = scope.instance
    while instance is not None and not instance.pair:
        instance = instance.parent
    return instance


def _number(scope: Scope, node: ast.Expression | None, what: str) -> Expression | None:
    if node is None:
        return None
    value = scope.elaborate(node)
    if not fits(value, types.NUMBER) or value.type.shape:
        raise scope.fail(
            "E0333", f"{what} is a number", node.span, caption=f"this is {types.describe(value.type)}"
        )
    return value


def _slip(scope: Scope, node: ast.Expression) -> Expression:
    value = scope.elaborate(node)
    type = types.numeric(value.type)
    if type.kind is not Kind.REAL or type.shape not in ((), (1,), (2,)):
        raise scope.fail(
            "E0333",
            "a slip velocity is one number, or a vector of 1 or 2",
            node.span,
            caption=f"this is {types.describe(value.type)}",
        )
    if type.dimension != types.VELOCITY and not scope.flattening.dimensionless:
        raise scope.fail(
            "E0333",
            "a slip velocity is a velocity (m/s)",
            node.span,
            caption=f"this is {types.describe(value.type)}",
            help=f"write 'der({node.span.text})'" if type.dimension == types.LENGTH else "",
        )
    if not has_rates(scope.flattening, value):
        raise scope.fail(
            "E0333",
            "a slip velocity depends on the velocities of the model",
            node.span,
            caption="friction along this would act on nothing",
            help=f"write 'der({node.span.text})'" if scope.flattening.dimensionless else "",
        )
    return value


def _options(
    scope: Scope, nodes: tuple[ast.Option, ...], known: tuple[str, ...], speed: Type, what: str
) -> dict[str, Expression]:
    result: dict[str, Expression] = {}
    for node in nodes:
        if node.name not in known:
            near = closest(node.name, known)
            raise scope.fail(
                "E0415",
                f"{what} has no option '{node.name}'",
                node.span,
                help=f"did you mean '{near}'?" if near else f"the options are {', '.join(known)}",
            )
        value = scope.elaborate(node.value)
        _check_option(scope, node, value, speed)
        result[node.name] = value
    return result


def _check_option(scope: Scope, node: ast.Option, value: Expression, speed: Type) -> None:
    given = types.describe(value.type)
    if node.name == "law":
        if isinstance(value, model.Literal) and value.value in _LAWS:
            return
        raise _bad_option(scope, node, '"stick" or "regularized"', given)
    if node.name in ("v_stick", "rest") and (not fits(value, speed) or value.type.shape):
        raise _bad_option(scope, node, types.describe(speed), given)


def _bad_option(scope: Scope, node: ast.Option, wanted: str, given: str) -> Poisoned:
    return scope.fail(
        "E0333", f"the option '{node.name}' is {wanted}", node.value.span, caption=f"this is {given}"
    )
