"""Variables of the flat model: declarations with their winning values and attributes."""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction

from mechc.lang import ast
from mechc.lang.source import Span
from mechc.lang.units import NAMED_TYPES, UnitError, parse_unit, preferred_unit
from mechc.suggest import closest

from .. import types
from ..expressions.coordinates import definition_of
from ..filters import FILTER
from ..instances.declared_types import fits
from ..instances.members import is_found, type_of
from ..model import Attributes, Expression, Kind, Literal, Role, StartValue, Type, Variable
from ..names.instance import VariableMember
from ..names.scope import Flattening, Poisoned, Scope
from ..operands import free_names
from ..subscripts import Index, subscripts
from ..values.evaluate import constant, input_changes, parameter_changes, pick
from ..values.indexing import stack
from .initial_values import rate_type, stated_starts, winner
from .record import StatementRecord

_ELSEWHERE = {
    "start": "the initial value follows the name: 'x = 1 m' is known, 'x ~ 1 m' a guess",
    "fixed": "'x = 1 m' is a known initial value, 'x ~ 1 m' a guess",
    "unit": "a value carries its unit, as in 'x = 1 m', or a type says it: 'Length x'",
    "displayUnit": "write 'display = \"mm\"'",
    "quantity": "a type says it: 'Length x'",
}
"""What attributes of Modelica are here."""
_NUMERIC_ATTRIBUTES = ("nominal", "min", "max")
_TEXT_ATTRIBUTES = ("display", "chart", "interpolation")
_CHOICES = {"chart": ("zxz", "zyx", "xyz"), "interpolation": ("linear", "step", "spline")}


def variable(member: VariableMember, value: Expression | None, record: StatementRecord) -> Variable:
    """Return a finished variable; ``value`` is that of a parameter, discrete variable or input."""
    type = type_of(member)
    declaration, scope = member.declaration, member.scope
    start: StartValue | None = None
    rate: StartValue | None = None
    starts: dict[tuple[int, ...], StartValue] = {}
    rates: dict[tuple[int, ...], StartValue] = {}
    if member.role in (Role.COORDINATE, Role.STATE, Role.DISCRETE):
        stated = stated_starts(member, record)
        start, starts = winner(stated, rate=False, shape=type.shape)
        if member.role is Role.COORDINATE:
            rate, rates = winner(stated, rate=True, shape=rate_type(scope.flattening, type).shape)
    if member.role is Role.DISCRETE:
        value, start = value if start is None else start.value, None
        if starts:
            value, starts = _with_elements(value, starts, type, declaration.span), {}
    return Variable(
        name=member.name,
        role=member.role,
        type=type,
        origin=scope.origin(declaration.span),
        value=value,
        start=start,
        rate=rate,
        starts=starts,
        rates=rates,
        attributes=attributes(scope, declaration, type),
        doc=declaration.doc,
        found=is_found(member),
    )


def _with_elements(
    value: Expression | None, starts: Mapping[Index, StartValue], type: Type, span: Span
) -> Expression:
    """Return an array with other values of some elements; what has no value is zero, or false."""
    nothing = False if type.kind is Kind.BOOLEAN else Fraction(0)
    zero = Literal(type=types.with_shape(type, ()), span=span, value=nothing)
    rest = {i: zero if value is None else pick(value, i) for i in subscripts(type.shape)}
    return stack([starts[i].value if i in starts else one for i, one in rest.items()], type.shape, span)


def check_parameter(member: VariableMember, value: Expression) -> None:
    """Report a value of a parameter that changes during the run."""
    culprit = changing(member.scope.flattening, value)
    if culprit is not None:
        code, message, details = parameter_changes(member.declaration.name, culprit)
        raise member.scope.fail(code, message, value.span, **details)


def check_input(member: VariableMember, value: Expression) -> None:
    """Report a default of an input that uses what is known only during the run."""
    culprit = changing(member.scope.flattening, value, time=True)
    if culprit is not None:
        code, message, details = input_changes(member.declaration.name, culprit)
        raise member.scope.fail(code, message, value.span, **details)


def changing(flattening: Flattening, value: Expression, *, time: bool = False) -> str | None:
    """Return the first name in a value that is not a parameter, nor, if it is allowed, the time."""
    seen: set[str] = set()
    pending = [value]
    while pending:
        for name in free_names(pending.pop()):
            if name in seen:
                continue
            seen.add(name)
            member = flattening.variables.get(name)
            if (name == "time" and not time) or (member is not None and member.role is not Role.PARAMETER):
                return name
            if member is None and name in flattening.definitions:
                pending.extend(definition_of(flattening, name))
    return None


# ---------------------------------------------------------------- attributes


def attributes(scope: Scope, declaration: ast.Declaration, type: Type) -> Attributes:
    """Return nominal value, limits, display unit and further options of a declaration."""
    numbers: dict[str, float] = {}
    texts: dict[str, str] = {}
    for node in declaration.attributes:
        name = node.target.name if isinstance(node.target, ast.Reference) else node.target.span.text
        try:
            value = _attribute(scope, declaration, node, name, type)
        except Poisoned:
            continue
        if isinstance(value, str):
            texts[name] = value
        else:
            numbers[name] = value
    display = texts.pop("display", "") or _unit(scope, declaration, type)
    if not numbers and not texts and not display:
        return _NONE
    return Attributes(numbers.get("nominal"), numbers.get("min"), numbers.get("max"), display, texts)


_NONE = Attributes()


def _attribute(
    scope: Scope, declaration: ast.Declaration, node: ast.Modification, name: str, type: Type
) -> float | str:
    known = (
        *_NUMERIC_ATTRIBUTES,
        *_TEXT_ATTRIBUTES,
        *([FILTER] if isinstance(declaration, ast.Input) else []),
    )
    if name not in known or node.kind != "=":
        near = closest(name, known)
        raise scope.fail(
            "E0415",
            f"there is no attribute '{name}'",
            node.span,
            help=_ELSEWHERE.get(name)
            or (f"did you mean '{near}'?" if near else f"the attributes are {', '.join(known)}"),
        )
    value = scope.elaborate(node.value)
    known_value = constant(value)
    if name == FILTER:
        return _filter(scope, node, value, type)
    if name in _NUMERIC_ATTRIBUTES:
        wanted = types.with_shape(type, ())
        if not fits(value, wanted) or value.type.shape or not isinstance(known_value, Fraction):
            raise scope.fail(
                "E0333",
                f"'{name}' is {types.describe(wanted)} that is known when compiling",
                node.value.span,
                caption=f"this is {types.describe(value.type)}",
            )
        return float(known_value)
    if not isinstance(known_value, str):
        raise scope.fail(
            "E0333", f"'{name}' is a text", node.value.span, help=f'write for example {name} = "mm"'
        )
    if name == "display":
        _check_display(scope, node, known_value, type)
    elif known_value not in _CHOICES[name]:
        near = closest(known_value, _CHOICES[name])
        raise scope.fail(
            "E0333",
            f"there is no {name} '{known_value}'",
            node.value.span,
            help=f"did you mean '{near}'?" if near else f"it may be {' or '.join(_CHOICES[name])}",
        )
    return known_value


def _filter(scope: Scope, node: ast.Modification, value: Expression, type: Type) -> str:
    """Return the time constant of a filter, as a fraction of SI."""
    tau, wanted = constant(value), scope.flattening.time_type
    if type.kind is not Kind.REAL:
        raise scope.fail(
            "E0333",
            f"a filter follows numbers that change steadily, and this is {types.describe(type)}",
            node.span,
        )
    if value.type.shape or not fits(value, wanted) or not isinstance(tau, Fraction) or isinstance(tau, bool):
        raise scope.fail(
            "E0333",
            f"'filter' is {types.describe(wanted)} that is known when compiling",
            node.value.span,
            caption=f"this is {types.describe(value.type)}",
            help="as in input Length road(filter = 0.5 ms)",
        )
    if tau <= 0:
        raise scope.fail("E0333", "the time of a filter is positive", node.value.span)
    return str(tau)


def _check_display(scope: Scope, node: ast.Modification, text: str, type: Type) -> None:
    try:
        unit = parse_unit(text)
    except UnitError as error:
        help = f"did you mean '{error.suggestion}'?" if error.suggestion else ""
        raise scope.fail("E0328", str(error), node.value.span, help=help) from None
    if unit.dimension != type.dimension:
        raise scope.fail(
            "E0328",
            f"'{text}' is not a unit of {types.unit_words(type.dimension, type.angle)}",
            node.value.span,
        )


def _unit(scope: Scope, declaration: ast.Declaration, type: Type) -> str:
    """Return the unit that a declaration is shown in, where that is not the usual one of its dimension."""
    own = _written_unit(declaration, type) or _unit_of_type(declaration, type)
    node = getattr(declaration, "value", None)
    if own or scope.instance is None or not isinstance(node, ast.Reference) or len(node.parts) != 1:
        return own
    other = scope.instance.members.get(node.parts[0].name)
    if not isinstance(other, VariableMember):
        return ""
    return _written_unit(other.declaration, type) or _unit_of_type(other.declaration, type)


def _written_unit(declaration: ast.Declaration, type: Type) -> str:
    """Return the unit of the literal that a declaration begins with: ``1 cm`` is shown in cm."""
    start = getattr(declaration, "start", None)
    node = start.value if isinstance(start, ast.Start) else getattr(declaration, "value", None)
    while isinstance(node, ast.Unary | ast.Vector | ast.Parenthesis):
        if isinstance(node, ast.Unary):
            node = node.operand
        elif node.unit:
            return _if_fits(node.unit, type)
        else:
            node = node.elements[0] if isinstance(node, ast.Vector) else node.inner
    return _if_fits(node.unit, type) if isinstance(node, ast.Quantity) else ""


def _unit_of_type(declaration: ast.Declaration, type: Type) -> str:
    """Return the unit of a declared type where the dimension alone would be shown in another: N.m for a torque."""
    named = NAMED_TYPES.get(declaration.type)
    if named is None or named.dimension != type.dimension or named.dimension.is_none:
        return ""
    return "" if named.unit == preferred_unit(type.dimension, type.angle) else named.unit


def _if_fits(unit: str, type: Type) -> str:
    return unit if type.kind is Kind.REAL and parse_unit(unit).dimension == type.dimension else ""
