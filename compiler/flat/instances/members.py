"""What a declared name is: its type and value, found when first asked for."""

from __future__ import annotations

from fractions import Fraction

from msgspec.structs import replace

from mechc.lang import ast
from mechc.lang.source import Span

from .. import types
from ..model import Expression, Kind, Literal, Name, Role, Type, Unknown
from ..names.instance import (
    ROLE_WORDS,
    DefinitionMember,
    ElaborationProgress,
    InstanceMember,
    Modifier,
    VariableMember,
)
from ..names.scope import Poisoned, Scope
from ..names.space import nodes
from ..subscripts import subscripts
from ..values.evaluate import constant, not_structural, to_expression
from ..values.indexing import stack
from .declared_types import broadcast, declared_type, fit, refuse_one_number
from .instantiate import element_scope, extents
from .modifications import check_plain, modified_value, strongest
from .overrides import overridden


def begin(member: InstanceMember, what: str) -> bool:
    """Start resolving a member; False if it is resolved. Reports one that needs itself."""
    if member.progress is ElaborationProgress.DONE:
        return False
    if member.progress is ElaborationProgress.WRONG:
        raise Poisoned
    opened: list[InstanceMember] = member.scope.flattening.opened
    while opened and opened[-1].progress is not ElaborationProgress.OPEN:
        opened.pop()
    if member.progress is ElaborationProgress.OPEN:
        circle = [one.name for one in opened[opened.index(member) :]] if member in opened else []
        member.progress = ElaborationProgress.WRONG
        raise member.scope.fail(
            "E0207",
            f"'{member.declaration.name}' is defined by itself",
            member.declaration.name_span,
            caption=" -> ".join([*circle, member.name])
            if len(circle) > 1
            else f"{what} depends on this name again",
        )
    member.progress = ElaborationProgress.OPEN
    opened.append(member)
    return True


# ---------------------------------------------------------------- variables


def type_of(member: VariableMember) -> Type:
    """Return the type of a variable, from its declaration or from its default."""
    if member.progress is ElaborationProgress.WRONG:
        raise Poisoned
    if member.type is not None:
        return member.type
    if begin(member, "its type"):
        try:
            _resolve_variable(member)
        except Poisoned:
            member.progress = ElaborationProgress.WRONG
            raise
        member.progress = ElaborationProgress.DONE
    assert member.type is not None
    return member.type


def _resolve_variable(member: VariableMember) -> None:
    declaration, scope = member.declaration, member.scope
    if is_typed(declaration):
        member.type = stated_type(declaration, scope, _given(member))
        _check_kind(member, member.type, declaration.name_span)
    elif (given := _type_given(member)) is not None:
        member.type = given
    elif member.role in (Role.COORDINATE, Role.STATE) or _default(declaration) is not None:
        member.type = _inferred(member)
    else:
        winner = strongest(member.modifiers)
        if winner is None and scope.flattening.dimensionless:
            member.type = types.with_shape(types.NUMBER, extents(scope, declaration.dimensions))
            return
        if winner is None:
            raise scope.fail(
                "E0327",
                f"'{declaration.name}' needs a type or a value",
                declaration.name_span,
                help=_how_to_give(member)
                or f"write for example 'Length {declaration.name}' or '{declaration.name} = 1 m'",
            )
        member.type = types.numeric(_type_for_one(winner, None))
    if member.structural:
        member.constant = _structural_value(member)
        _check_range(member, member.constant)


def _how_to_give(member: VariableMember) -> str:
    """Say how a component is given what it leaves to those who use it."""
    instance = member.scope.instance
    if instance is None or instance.declaration is None:
        return ""
    part = instance.declaration.name
    return (
        f"give it where '{part}' is declared: '{instance.model.name} {part}({member.declaration.name} = ..);'"
    )


def _given(member: VariableMember | DefinitionMember) -> Type | None:
    """Return the type of the value where the declaration leaves its sizes to it."""
    if not leaves_sizes_open(member.declaration):
        return None
    winner = strongest(member.modifiers)
    if winner is not None:
        return _type_for_one(winner, len(member.declaration.dimensions))
    default = _default(member.declaration)
    return None if default is None else member.scope.elaborate(default).type


def _type_for_one(winner: Modifier, rank: int | None) -> Type:
    """Return the type that a modification gives to one element of an array of components, where the declaration leaves the shape
    to it, or sizes of ``rank`` dimensions: one with the dimensions of the array before its own is distributed."""
    type = winner.source.value().type
    for chosen in (winner.picks, *((pick,) for pick in reversed(winner.picks))):
        sizes = tuple(n for pick in chosen for n in pick.extents)
        shape = type.shape[len(sizes) :]
        if sizes and type.shape == sizes + shape and rank in (None, len(shape)):
            return types.with_shape(type, shape)
    return type


def is_typed(declaration: ast.Declaration) -> bool:
    """Tell whether a declaration says its type, by name or by ``typeof(e)``."""
    return bool(declaration.type) or declaration.like is not None


def _type_given(member: VariableMember) -> Type | None:
    """Return the type of what an input without a type is given, where its own default is zero, which fits everything; of a state that
    begins at zero that which its equation leads to. None where there is nothing of the kind."""
    declaration, scope = member.declaration, member.scope
    default = _default(declaration)
    if default is None or scope.flattening.dimensionless or declaration.dimensions:
        return None
    if member.role is Role.INPUT:
        winner = strongest(member.modifiers)
        return (
            types.numeric(_type_for_one(winner, None)) if winner is not None and _is_zero(default) else None
        )
    if member.role is Role.STATE and _is_zero(default):
        return _type_by_equation(member)
    return None


def _is_zero(node: ast.Expression) -> bool:
    return isinstance(node, ast.Number) and node.value == 0


def _type_by_equation(member: VariableMember) -> Type | None:
    """Return the type of a state whose equation ``der(x) = f`` says it: that of f at x = 0, which fits everything, by time."""
    scope, name = member.scope, member.declaration.name
    right = _equation_of(member)
    if right is None or not _leads(member, right, frozenset()):
        return None
    try:
        found = types.numeric(scope.elaborate(replaced(right, name)).type)
    except Poisoned:
        return None
    time = scope.flattening.time_type.dimension
    return types.real(found.dimension * time, found.shape) if found.kind is Kind.REAL else None


def _equation_of(member: VariableMember) -> ast.Expression | None:
    """Return what the one equation of a state says."""
    instance, name = member.scope.instance, member.declaration.name
    assert instance is not None
    found = [s.statement for s in instance.cls.statements if isinstance(s.statement, ast.Equation)]
    stated = [e.right for e in found if _is_rate(e.left, name)]
    return stated[0] if len(stated) == 1 else None


def _is_rate(node: ast.Expression, name: str) -> bool:
    rate = isinstance(node, ast.Derivative) and node.order == 1 and isinstance(node.operand, ast.Reference)
    return rate and node.operand.name == name  # type: ignore[union-attr]


def _leads(member: VariableMember, node: ast.Expression, seen: frozenset[str]) -> bool:
    """Tell whether a formula has a type without that of a state: it reads inputs, parameters, coordinates, and states of which
    that is true as well."""
    instance = member.scope.instance
    assert instance is not None
    seen |= {member.declaration.name}
    for inner in nodes(node):
        if not isinstance(inner, ast.Reference) or inner.name == member.declaration.name:
            continue
        other = instance.members.get(inner.parts[0].name)
        if other is None:
            continue
        if len(inner.parts) > 1 or not isinstance(other, VariableMember):
            return False
        if other.role is not Role.STATE or is_typed(other.declaration) or other.type is not None:
            continue
        default = _default(other.declaration)
        if default is None or not _is_zero(default):
            continue
        right = _equation_of(other)
        if inner.name in seen or right is None or not _leads(other, right, seen):
            return False
    return True


def replaced(node: ast.Expression, name: str) -> ast.Expression:
    """Return a formula with the number 0 instead of a name."""
    if isinstance(node, ast.Reference):
        return ast.Number(value=Fraction(0), text="0", span=node.span) if node.name == name else node

    def inside(value: object) -> object:
        if isinstance(value, tuple):
            return tuple(inside(item) for item in value)
        return replaced(value, name) if isinstance(value, ast.Node) else value  # type: ignore[arg-type]

    changed = {field: inside(getattr(node, field)) for field in node.__struct_fields__}
    return replace(node, **changed)


def leaves_sizes_open(declaration: ast.Declaration) -> bool:
    """Tell whether a declaration leaves a size to its value, as in ``K[:, :]``."""
    return any(isinstance(d.size, ast.Whole) for d in declaration.dimensions)


def stated_type(declaration: ast.Declaration, scope: Scope, value: Type | None) -> Type:
    """Return the type that a declaration says; ``value``: that of its value, which tells what is left open."""
    given = None if value is None else value.shape
    if declaration.like is not None:
        like = types.numeric(scope.elaborate(declaration.like).type)
        shape = extents(scope, declaration.dimensions, given) if declaration.dimensions else like.shape
        return types.with_shape(like, shape)
    base = declared_type(scope, declaration.type, declaration.name_span)
    shape = extents(scope, declaration.dimensions, given)
    if base is types.NUMBER and value is not None and leaves_sizes_open(declaration):
        base = types.real(value.dimension, angle=value.angle)  # size and unit are those of the value
    if base.kind is Kind.ROTATION and shape:
        raise scope.fail(
            "E0305", "an array of rotations is not possible", declaration.span, help="declare them one by one"
        )
    return types.with_shape(base, shape)


def _default(declaration: ast.Declaration) -> ast.Expression | None:
    """Return the expression of ``= e`` or ``~ e`` in a declaration."""
    match declaration:
        case ast.Coordinate(start=start) | ast.State(start=start):
            return None if start is None else start.value
        case ast.Parameter(value=value) | ast.Discrete(value=value) | ast.Input(value=value):
            return value
        case ast.Let(value=value) | ast.Output(value=value):
            return value
        case _:
            return None


_GREEK = ("phi", "theta", "th", "psi", "alpha", "beta", "gamma", "angle")


def _with_a_type(member: VariableMember) -> str:
    name = member.declaration.name
    usual = "Angle" if name.rstrip("0123456789_").casefold() in _GREEK else "Length"
    return f"write for example '{member.role.value} {usual} {name};'"


def _start_of_modelica(declaration: ast.Declaration) -> str:
    """Say how an attribute ``start`` is written, if there is one."""
    for node in declaration.attributes:
        if node.target.span.text == "start":
            value = node.value.span.text
            return f"write '{declaration.name} = {value}' for a known value, '{declaration.name} ~ {value}' for a guess"
    return ""


def _inferred(member: VariableMember) -> Type:
    declaration, scope = member.declaration, member.scope
    default = _default(declaration)
    if default is None and scope.flattening.dimensionless:
        return types.with_shape(types.NUMBER, extents(scope, declaration.dimensions))
    if default is None:
        raise scope.fail(
            "E0327",
            f"'{declaration.name}' needs a type or an initial value",
            declaration.name_span,
            help=_start_of_modelica(declaration) or _with_a_type(member),
        )
    value = elementwise(declaration, scope, default)
    type = value.type
    if type.kind is Kind.POSE and member.role is Role.COORDINATE:
        type = types.ROTATION
    if not member.structural:
        type = types.numeric(type)  # a whole number may become any number
    if declaration.dimensions:
        given = _given(member)
        shape = extents(scope, declaration.dimensions, None if given is None else given.shape)
        if type.shape and type.shape != shape:
            broadcast(
                scope,
                value,
                types.with_shape(type, shape),
                default.span,
                declaration.name,
                declaration.name_span,
            )
        type = types.with_shape(type, shape)
    _check_kind(member, type, default.span)
    return type


_KINDS = {Role.COORDINATE: (Kind.REAL, Kind.ROTATION), Role.STATE: (Kind.REAL,)}
_VALUES = (Kind.REAL, Kind.INTEGER, Kind.BOOLEAN, Kind.STRING)


def _check_kind(member: VariableMember, type: Type, span: Span) -> None:
    """Refuse coordinates that are whole numbers, parameters that are frames, and the like."""
    text = type.kind is Kind.STRING and not member.structural
    if type.kind in _KINDS.get(member.role, _VALUES) and not text:
        return
    given = types.describe(type)
    raise member.scope.fail(
        "E0303",
        f"{ROLE_WORDS[member.role]} cannot be {given}",
        span,
        caption=f"this is {given}",
        help=f"a text chooses while compiling: write 'structural parameter {member.declaration.name} = ..;'"
        if text
        else "a frame is declared by 'frame'"
        if type.kind in (Kind.FRAME, Kind.POSE)
        else "",
    )


def elementwise(declaration: ast.Declaration, scope: Scope, node: ast.Expression) -> Expression:
    """Return the value of a declaration; with ``[i in 1:n]`` it is elaborated for each element."""
    if not any(d.name for d in declaration.dimensions):
        return scope.elaborate(node)
    sizes = extents(scope, declaration.dimensions)
    values = [
        element_scope(scope, declaration.dimensions, index).elaborate(node) for index in subscripts(sizes)
    ]
    return nested(values, sizes, node.span, scope)


def nested(values: list[Expression], sizes: tuple[int, ...], span: Span, scope: Scope) -> Expression:
    """Return an array of shape ``sizes`` (and that of the values) from its elements in row-major order."""
    if not values:
        raise scope.fail("E0422", "an array without elements has no type", span, help="give it a type")
    if not sizes:
        return values[0]
    first = next((v for v in values if not types.is_zero(v)), values[0])
    unified: list[Expression] = [
        fit(
            scope,
            v,
            types.numeric(first.type) if first.type.kind is Kind.INTEGER else first.type,
            v.span,
            code="E0317",
        )
        for v in values
    ]
    return stack(unified, sizes, span)


# ---------------------------------------------------------------- values of variables


def parameter_value(member: VariableMember) -> Expression | None:
    """Return the value of a parameter, discrete variable or input: the strongest modification, or its default."""
    type = type_of(member)
    for modifier in member.modifiers:
        check_plain(member, modifier)
    winner = strongest(member.modifiers)
    if winner is not None:
        return modified_value(member, winner, type)
    default = _default(member.declaration)
    if default is None:
        return None
    value = elementwise(member.declaration, member.scope, default)
    if member.role is Role.PARAMETER:
        refuse_one_number(member.scope, value, type, default.span, member.declaration.name_span)
    return fit(
        member.scope,
        value,
        type,
        default.span,
        name=member.declaration.name,
        declared=member.declaration.name_span,
    )


def is_found(member: VariableMember) -> bool:
    """Tell whether a parameter is guessed, so that the start finds it: by the strongest modification, or its default."""
    if member.role is not Role.PARAMETER:
        return False
    winner = strongest(member.modifiers)
    if winner is not None:
        return winner.kind == "~"
    return isinstance(member.declaration, ast.Parameter) and member.declaration.found


def _structural_value(member: VariableMember) -> Expression:
    """Return the value of a structural parameter as literals."""
    assert member.type is not None
    given = overridden(member)
    if given is not None:
        return given
    member.progress = ElaborationProgress.OPEN
    value = _stated_value(member)
    known = constant(value)
    if known is None:
        winner = strongest(member.modifiers)
        scope = winner.source.scope if winner else member.scope
        node = winner.source.node if winner else _default(member.declaration)
        assert node is not None
        raise not_structural(scope, node, value, f"the structural parameter '{member.declaration.name}'")
    return to_expression(known, member.type, value.span)


def _check_range(member: VariableMember, value: Expression) -> None:
    """Refuse a structural value beyond the ``min`` or ``max`` of its declaration; other values are checked before each run."""
    scope, number = member.scope, constant(value)
    for node in member.declaration.attributes:
        which = node.target.span.text
        if which not in ("min", "max") or not isinstance(number, Fraction):
            continue
        bound = constant(scope.elaborate(node.value))
        if isinstance(bound, Fraction) and (number < bound if which == "min" else number > bound):
            raise scope.fail(
                "E0423",
                f"'{member.declaration.name}' is {float(number):g}, {_BEYOND[which]} {float(bound):g}",
                value.span,
            )


_BEYOND = {"min": "below its minimum", "max": "above its maximum"}


def _stated_value(member: VariableMember) -> Expression:
    value = parameter_value(member)
    if value is None:
        declaration = member.declaration
        raise member.scope.fail(
            "E0411",
            f"the structural parameter '{declaration.name}' has no value",
            declaration.name_span,
            help=f"write '{declaration.name} = ...'",
        )
    return value


# ---------------------------------------------------------------- let and output


def definition_value(member: DefinitionMember) -> Expression:
    """Return the checked value of a ``let`` or ``output``."""
    if begin(member, "its value"):
        try:
            member.value = _definition(member)
            _check_output(member, member.value)
            if isinstance(member.declaration, ast.Output) and member.declaration.guess:
                member.guess, member.value = member.value, _unknown(member, member.value)
        except Poisoned:
            member.progress = ElaborationProgress.WRONG
            raise
        member.progress = ElaborationProgress.DONE
    assert member.value is not None
    return member.value


def _definition(member: DefinitionMember) -> Expression:
    declaration, scope = member.declaration, member.scope
    assert isinstance(declaration, ast.Let | ast.Output)
    if declaration.value is None:
        raise scope.fail(
            "E0411",
            f"output '{declaration.name}' has no value",
            declaration.name_span,
            help=f"write 'output {declaration.name} = ...;', or 'output {declaration.name} ~ ...;' with a guess, where equations find it",
        )
    if is_typed(declaration):
        member.type = stated_type(declaration, scope, _given(member))
    value = elementwise(declaration, scope, declaration.value)
    if member.type is not None:
        return fit(
            scope,
            value,
            member.type,
            declaration.value.span,
            name=declaration.name,
            declared=declaration.name_span,
        )
    if declaration.dimensions:
        shape = extents(scope, declaration.dimensions, value.type.shape)
        if value.type.kind is not Kind.POINT or value.type.shape != shape:
            target = types.with_shape(value.type, shape)
            value = broadcast(
                scope, value, target, declaration.value.span, declaration.name, declaration.name_span
            )
    return value


def _unknown(member: DefinitionMember, guess: Expression) -> Expression:
    """Return what stands for an output that equations determine."""
    type = types.numeric(guess.type)
    if type.kind is not Kind.REAL:
        raise member.scope.fail(
            "E0338",
            f"an unknown is a number or an array of numbers, '{member.declaration.name}' is {types.describe(type)}",
            guess.span,
        )
    return Unknown(type=type, span=member.declaration.name_span, name=member.name)


def _check_output(member: DefinitionMember, value: Expression) -> None:
    """Report an output that is not a number, which no result could hold."""
    kind, declaration = value.type.kind, member.declaration
    if not isinstance(declaration, ast.Output) or kind in (*types.NUMERIC, Kind.BOOLEAN):
        return
    node = declaration.value
    assert node is not None
    own = isinstance(node, ast.Reference) and not value.type.shape
    name, what = declaration.name, node.span.text if own else "F"
    ways = {
        Kind.FRAME: f"write 'output {name} = pos({what});' for the path of its origin, 'frame {name} = ...;' to give it a name",
        Kind.ROTATION: f"write one number of it, as in 'output {name} = {what}[1];', or the place of a point that it turns",
        Kind.POSE: "write the place of a point that it moves, as in 'world * pose * {1 m, 0 m}'",
    }
    raise member.scope.fail(
        "E0335",
        f"output '{name}' is {types.describe(value.type)}; an output is a number, a vector or a point",
        node.span,
        caption=f"this is {types.describe(value.type)}",
        help=ways.get(kind, ""),
    )


def definition_type(member: DefinitionMember) -> Type:
    """Return the type of a ``let`` or ``output``; a declared one needs no value.

    What is declared as a rotation may be any pose: only one that names a coordinate has elements and rates.
    """
    if (
        member.type is None
        and is_typed(member.declaration)
        and member.progress is not ElaborationProgress.DONE
    ):
        if member.progress is ElaborationProgress.WRONG:
            raise Poisoned
        member.type = stated_type(member.declaration, member.scope, _given(member))
    if member.type is None or member.type.kind is Kind.ROTATION:
        return definition_value(member).type
    return member.type


# ---------------------------------------------------------------- references to members


def variable_reference(member: VariableMember, span: Span) -> Expression:
    """Return a variable by name; a structural parameter by its value."""
    type = type_of(member)
    if member.constant is not None:
        return member.constant
    return Name(type=type, span=span, name=member.name)


def definition_reference(member: DefinitionMember, span: Span) -> Expression:
    """Return a ``let`` or ``output`` by name; a constant whole number or truth value by its value."""
    type = definition_type(member)
    if type.kind in (Kind.INTEGER, Kind.BOOLEAN) and not type.shape:
        value = definition_value(member)
        if isinstance(value, Literal):
            return value
    return Name(type=type, span=span, name=member.name)
