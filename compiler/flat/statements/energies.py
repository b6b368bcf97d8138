"""Statements about energies and inertia: kinetic, potential, lagrangian, dissipation, gravity, mass, inertia."""

from __future__ import annotations

from mechc.lang import ast
from mechc.lang.diagnostics import Label, Reporter
from mechc.lang.source import Span
from mechc.lang.units import Dimension

from .. import model, types
from ..expressions.missing_factor import missing_factor
from ..expressions.operators import parameters_of_another_kind, parameters_without_unit
from ..instances.declared_types import fits
from ..instances.frames import frame_or_point
from ..model import Apply, Expression, Kind, Type
from ..names.instance import Expanded, Instance
from ..names.scope import Poisoned, Scope
from .record import StatementRecord

_WANTED = {
    "kinetic": "an energy",
    "potential": "an energy",
    "lagrangian": "an energy",
    "dissipation": "a power",
}


def energy(scope: Scope, statement: ast.Energy, record: StatementRecord) -> None:
    """Check that an energy is one (``dissipation``: a power) and record it."""
    value = scope.elaborate(statement.value)
    flattening = scope.flattening
    if value.type.kind not in types.NUMERIC or value.type.shape:
        raise scope.fail(
            "E0305",
            f"{statement.kind} must be one number",
            statement.value.span,
            caption=f"this is {types.describe(value.type)}",
            help="write 'dot(v, v)' for the square of a vector" if value.type.shape else "",
        )
    free = flattening.dimensionless or flattening.time_type.dimension != types.TIME
    wanted = types.POWER if statement.kind == "dissipation" else types.ENERGY
    if not free and value.type.dimension != wanted and not types.is_zero(value):
        raise _no_energy(scope, statement, value, wanted)
    record.energies.append(model.Energy(statement.kind, value, scope.origin(statement.span), statement.doc))


def _no_energy(scope: Scope, statement: ast.Energy, value: Expression, wanted: Dimension) -> Poisoned:
    given = value.type.dimension
    noun = _WANTED[statement.kind]
    this = "a number" if given.is_none else given.pretty()
    return scope.fail(
        "E0301",
        f"{statement.kind} must be {noun}",
        statement.value.span,
        caption=f"this is {this}, {noun} is {wanted.pretty()}",
        labels=parameters_without_unit(scope, value) or parameters_of_another_kind(scope, value, wanted),
        help=missing_factor(scope, given, wanted),
    )


# ---------------------------------------------------------------- gravity, mass, inertia


def gravities(instance: Instance, statements: list[Expanded]) -> None:
    """Find the field of an instance before its masses ask for it; the most derived one counts."""
    first: tuple[int, Span] | None = None
    for item in statements:
        if not isinstance(item.statement, ast.Gravity):
            continue
        scope, statement = item.scope, item.statement
        if first is not None and first[0] == scope.level:
            scope.report(
                "E0418",
                "gravity is stated twice",
                statement.span,
                caption="again here",
                labels=(Label(first[1], "first here"),),
            )
            continue
        if first is not None and first[0] < scope.level:
            continue
        first = (scope.level, statement.span)
        try:
            instance.gravity_field = _function(scope, statement.value)
            instance.gravity = None if instance.gravity_field else _field(scope, statement)
            instance.gravity_span = statement.span
        except Poisoned:
            continue


def _function(scope: Scope, node: ast.Expression) -> tuple[Scope, ast.Reference] | None:
    """Return a function of the place that a statement names; None where it is a vector."""
    if not isinstance(node, ast.Reference) or any(part.indices for part in node.parts):
        return None
    if scope.instance is not None and node.parts[0].name in scope.instance.members:
        return None
    found = scope.namespace.look_up(node.name, node.span)
    return (scope, node) if found is not None and isinstance(found.definition, ast.Function) else None


_PLACE = "place#gravity"


def _weigh(
    scope: Scope,
    statement: ast.Mass,
    value: Expression,
    at: Expression,
    record: StatementRecord,
    source: Instance,
) -> None:
    """Record what a field does to a mass: an energy by its potential, or a force by its acceleration."""
    assert source.gravity_field is not None
    outside, name = source.gravity_field
    call = ast.Call(
        function=ast.Reference(parts=(ast.Part(name="pos", span=statement.at.span),), span=statement.at.span),
        arguments=(statement.at,),
        span=statement.at.span,
    )
    place = scope.elaborate(call)
    there = outside.with_local({_PLACE: place})
    argument = ast.Reference(parts=(ast.Part(name=_PLACE, span=name.span),), span=name.span)
    field = there.elaborate(ast.Call(function=name, arguments=(argument,), span=name.span))
    type, origin = types.numeric(field.type), scope.origin(statement.span)
    specific = types.VELOCITY * types.VELOCITY
    weight = Apply(
        type=types.real(type.dimension * types.numeric(value.type).dimension, type.shape),
        span=statement.span,
        function="multiply",
        arguments=(value, field),
    )
    pure = scope.flattening.dimensionless
    if not type.shape and (type.dimension == specific or pure):
        record.energies.append(model.Energy("potential", weight, origin))
    elif type.shape == types.numeric(place.type).shape and (type.dimension == types.ACCELERATION or pure):
        record.loads.append(
            model.Load("force", record.numbered("weight"), weight, at, None, None, None, origin)
        )
    else:
        raise outside.fail(
            "E0323",
            f"the field '{name.name}' is neither an acceleration nor a potential",
            name.span,
            caption=f"it gives {types.describe(field.type)}",
            help="give a vector in m/s^2, or a number in m^2/s^2, the potential energy of a mass over the mass",
        )


def _field(scope: Scope, statement: ast.Gravity) -> Expression:
    value = scope.elaborate(statement.value)
    type = types.numeric(value.type)
    span = statement.value.span
    if type.kind is not Kind.REAL or len(type.shape) != 1 or type.shape[0] not in (2, 3):
        raise scope.fail(
            "E0323",
            "gravity is a vector of 2 or 3 components",
            span,
            caption=f"this is {types.describe(value.type)}",
            help="write for example '{0, -9.81 m/s^2}'",
        )
    wanted = types.real(_dimension(scope, types.ACCELERATION), type.shape)
    if not fits(value, wanted):
        raise scope.fail(
            "E0323",
            "gravity is an acceleration (m/s^2)",
            span,
            caption=f"this is {types.describe(value.type)}",
            help=f"write '{span.text} m/s^2'" if type.dimension.is_none else "",
        )
    scope.flattening.space.require(type.shape[0], scope, span, f"a field of {type.shape[0]} components")
    return value


def _dimension(scope: Scope, dimension: Dimension) -> Dimension:
    return types.NUMBER.dimension if scope.flattening.dimensionless else dimension


def mass(scope: Scope, statement: ast.Mass, record: StatementRecord) -> None:
    """Check a mass and record it with the field that reaches it: of its instance or the nearest one around it."""
    value = scope.elaborate(statement.value)
    _require(scope, value, types.real(_dimension(scope, types.MASS)), statement.value.span, "a mass (kg)")
    at = frame_or_point(scope, statement.at, "a mass is")
    source = scope.instance
    while source is not None and source.gravity is None and source.gravity_field is None:
        source = source.parent
    field = None
    if source is not None:
        record.reached.add(id(source))
        field = source.gravity
        if source.gravity_field is not None:
            _weigh(scope, statement, value, at, record, source)
            record.fields.setdefault(id(source), source.gravity_field[1].span)
    record.masses.append(model.Mass(value, at, field, scope.origin(statement.span)))


def inertia(scope: Scope, statement: ast.Inertia, record: StatementRecord) -> None:
    """Check a moment of inertia, or in space a matrix of 3 x 3, and record it."""
    value = scope.elaborate(statement.value)
    on = scope.elaborate(statement.on)
    if on.type.kind is not Kind.FRAME or on.type.shape:
        raise scope.fail(
            "E0332",
            "an inertia is on a frame",
            statement.on.span,
            caption=f"this is {types.describe(on.type)}",
            help="a point has no axes; name the frame of the body",
        )
    space = scope.flattening.space.known(scope, statement.span)
    shape = () if space == 2 else (3, 3)
    span = statement.value.span
    dimension = _dimension(scope, types.INERTIA)
    _require(scope, value, types.real(dimension, shape), span, "a moment of inertia (kg.m^2)")
    record.inertias.append(model.Inertia(value, on, scope.origin(statement.span)))


def _require(scope: Scope, value: Expression, wanted: Type, span: Span, words: str) -> None:
    if not fits(value, wanted):
        raise scope.fail(
            "E0323", f"this must be {words}", span, caption=f"this is {types.describe(value.type)}"
        )
    if value.type.shape != wanted.shape:
        help = "in space write a matrix, for example 'diag({J1, J2, J3})'" if wanted.shape == (3, 3) else ""
        raise scope.fail(
            "E0305",
            f"this must be {'a matrix of 3 x 3' if wanted.shape else 'one'} value{'s' if wanted.shape else ''}",
            span,
            caption=f"this is {types.describe(value.type)}",
            help=help,
        )


def note_fields(record: StatementRecord, reporter: Reporter) -> None:
    """Say what a field leaves out over bodies that have an extent."""
    for span in record.fields.values() if record.inertias else ():
        reporter.note(
            "N0569",
            "the field acts on each mass at its place",
            span,
            help="how it varies across a body, which turns the body, is neglected",
        )
