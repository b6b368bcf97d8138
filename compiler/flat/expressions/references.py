"""Dotted names to expressions: ``link[i-1].b``, ``joint.angle``, ``r[1, 1:2]``."""

from __future__ import annotations

import re
from collections.abc import Sequence

from msgspec.structs import replace

from mechc.lang import ast
from mechc.lang.builtins import BUILTINS, CONSTANTS
from mechc.lang.diagnostics import Label
from mechc.lang.source import Span
from mechc.lang.units import UnitError, parse_unit
from mechc.suggest import closest

from .. import types
from ..instances.components import instances_of
from ..instances.frames import place_extents, place_reference
from ..instances.instantiate import expand, member_of
from ..instances.members import definition_reference, variable_reference
from ..model import Expression, Literal, Name, Query, Role, Unlike, friction_name
from ..names.instance import (
    AnyMember,
    ComponentMember,
    DefinitionMember,
    Instance,
    LabelMember,
    PlaceMember,
    VariableMember,
)
from ..names.scope import Poisoned, Scope
from ..subscripts import Index, subscript_text, subscripts
from ..values.evaluate import flat, whole_number
from ..values.indexing import dimension_words, indexed, positions, stack

MOST_NAMES = 8
"""Names in a component that a message lists."""

_QUANTITY_AND_SIGN = re.compile(
    r"(?<![\w.])([0-9][0-9.]*(?:[eE][+-]?[0-9]+)?[ \t]+[A-Za-z][\w.^/]*"
    r"(?:[ \t]*[/*][ \t]*[A-Za-z]\w*(?:\^[0-9]+)?)*)[ \t]*([/*])[ \t]*\Z"
)
_UNIT_BELOW = re.compile(
    r"(?<![\w.])([0-9][0-9.]*(?:[eE][+-]?[0-9]+)?)[ \t]+([A-Za-z][\w.^/]*)/\(([A-Za-z][\w.^/*]*)\)"
)
_POWER = re.compile(r"\^[0-9]+")

_ENERGIES = {"total": "energy", "kinetic": "kinetic_energy", "potential": "potential_energy"}

OF_ONE_PART = (
    "what a run dissipates, 'energy.dissipated', is known after it; what one law took is its power over time: "
    "'state Energy lost = 0 J; equation der(lost) = -power(law);'"
)


def reference(scope: Scope, node: ast.Reference) -> Expression:
    """Return the expression that a dotted name stands for."""
    first = node.parts[0]
    if len(node.parts) == 1 and not first.indices:
        return _whole(scope, first.name, node.span)
    value = scope.local.get(first.name)
    if value is not None:
        if len(node.parts) > 1:
            raise scope.fail("E0202", f"'{first.name}' has nothing inside", node.span)
        return indexed(scope, value, first.indices, first.span)
    instance = scope.instance
    member = None if instance is None else member_of(instance, first.name)
    if member is None:
        return _outside(scope, node)
    assert instance is not None
    return _member(scope, member, node.parts, node.span)


def _whole(scope: Scope, name: str, span: Span) -> Expression:
    value = scope.local.get(name)
    if value is not None:
        return value
    instance = scope.instance
    if instance is not None:
        member = instance.members.get(name)
        if member is None and name in instance.cls.conditional:
            member = member_of(instance, name)
        if member is not None:
            if isinstance(member, VariableMember):
                return variable_reference(member, span)
            return _plain_member(scope, member, span)
    return predefined(scope, name, span)


def predefined(scope: Scope, name: str, span: Span) -> Expression:
    """Return what every model has: ``world``, ``time``, ``pi``; reports an unknown name."""
    flattening = scope.flattening
    if name == "world":
        return Name(type=types.FRAME, span=span, name="world")
    if name == flattening.independent:
        return Name(type=flattening.time_type, span=span, name="time")
    if name in CONSTANTS:
        return Literal(type=types.NUMBER, span=span, value=CONSTANTS[name])
    raise unknown(scope, name, span)


def _plain_member(scope: Scope, member: AnyMember, span: Span) -> Expression:
    match member:
        case VariableMember():
            return variable_reference(member, span)
        case DefinitionMember():
            return definition_reference(member, span)
        case PlaceMember():
            sizes = place_extents(member)
            if not sizes:
                return place_reference(member, (), span)
            return stack([place_reference(member, i, span) for i in subscripts(sizes)], sizes, span)
        case ComponentMember():
            raise scope.fail(
                "E0213",
                f"'{member.declaration.name}' is a component and has no value",
                span,
                caption=f"it is a {member.declaration.type}",
                help=f"name something inside it, as in '{member.declaration.name}.{_inner(member)}'",
            )


def _inner(member: ComponentMember) -> str:
    """Name what a component is mostly asked for: a coordinate, or a frame that it places."""
    inside = next(iter(member.instances.values())).members if member.instances else {}
    moving = (n for n, m in inside.items() if isinstance(m, VariableMember) and m.role is Role.COORDINATE)
    return (
        next(moving, None)
        or next((n for n in inside if n in ("a", "frame", "p")), None)
        or next(iter(inside), "a")
    )


def _member(scope: Scope, member: AnyMember, parts: tuple[ast.Part, ...], span: Span) -> Expression:
    part, rest = parts[0], parts[1:]
    if isinstance(member, ComponentMember):
        return _inside(scope, member, part, rest, span)
    if rest:
        noun = type(member.declaration).__name__.lower()
        raise scope.fail(
            "E0202",
            f"'{part.name}' is {types.with_article(noun)} and has no '{rest[0].name}'",
            rest[0].span,
            labels=(Label(member.declaration.name_span, "declared here"),),
        )
    if isinstance(member, PlaceMember) and place_extents(member):
        return _place_element(scope, member, part, span)
    return indexed(scope, _plain_member(scope, member, span), part.indices, part.span)


def _place_element(scope: Scope, member: PlaceMember, part: ast.Part, span: Span) -> Expression:
    sizes = member.extents
    if not part.indices:
        return _plain_member(scope, member, span)
    own, further = part.indices[: len(sizes)], part.indices[len(sizes) :]
    chosen = [positions(scope, node, n, part.span) for node, n in zip(own, sizes, strict=False)]
    if len(own) == len(sizes) and all(isinstance(c, int) for c in chosen):
        element = place_reference(member, tuple(c for c in chosen if isinstance(c, int)), span)
        return indexed(scope, element, further, part.span)
    return indexed(scope, _plain_member(scope, member, span), part.indices, part.span)


def _inside(
    scope: Scope, member: ComponentMember, part: ast.Part, rest: tuple[ast.Part, ...], span: Span
) -> Expression:
    """Return what is inside a component; an array of components without index gives an array."""
    if not rest:
        return _plain_member(scope, member, span)
    instances = existing(scope, member, part.span)
    if not part.indices and member.extents:
        values = [_within(scope, instance, rest, span) for instance in instances.values()]
        return _side_by_side(scope, member, values, tuple(instances), span)
    index = component_index(scope, member, part)
    return _within(scope, instances[index], rest, span)


def _side_by_side(
    scope: Scope, member: ComponentMember, values: list[Expression], indices: tuple[Index, ...], span: Span
) -> Expression:
    """Return what has one name in each component of an array: an array of it, or one list of all numbers where sizes differ."""
    if len({value.type for value in values}) <= 1:
        return stack(values, member.extents, span)
    first = next((k for k, value in enumerate(values) if not types.is_zero(value)), 0)
    type = values[first].type
    sizes_differ = any(value.type.shape != type.shape for value in values)
    for index, value in zip(indices, values, strict=True):
        other = value.type
        numbers = {other.kind, type.kind} <= set(types.NUMERIC)
        if (other.dimension != type.dimension and not types.is_zero(value)) or (
            not numbers and (sizes_differ or other.kind is not type.kind)
        ):
            name = member.declaration.name
            one, another = (f"{name}{subscript_text(k)}" for k in (indices[first], index))
            raise scope.fail(
                "E0317",
                f"'{span.text}' differs from element to element, and is not an array",
                span,
                caption=f"{types.describe(type)} in '{one}', {types.describe(other)} in '{another}'",
                help=f"name one of them, as in '{one}{span.text.removeprefix(name)}'",
            )
    if sizes_differ:
        values = [number for value in values for number in flat(value)]
        return stack(values, (len(values),), span)
    return stack(values, member.extents, span)


def _within(scope: Scope, instance: Instance, parts: tuple[ast.Part, ...], span: Span) -> Expression:
    part = parts[0]
    member = member_of(instance, part.name)
    if member is None:
        raise no_such_member(scope, instance, part)
    if len(parts) == 1 and not part.indices and isinstance(member, VariableMember):
        return variable_reference(member, span)
    return _member(scope, member, parts, span)


def no_such_member(scope: Scope, instance: Instance, part: ast.Part) -> Poisoned:
    """Report a name that a component does not have, or only under another condition."""
    if instance.cls.broken:
        return Poisoned()
    labels = (Label(instance.cls.model.name_span, f"{instance.cls.name} is defined here"),)
    if part.name in instance.cls.conditional:
        return scope.fail(
            "E0216",
            f"'{instance.path}' has '{part.name}' only under a condition that is false here",
            part.span,
            labels=(Label(instance.cls.conditional[part.name].name_span, "declared here"),),
        )
    near = closest(part.name, instance.members)
    return scope.fail(
        "E0202",
        f"'{instance.path}', a {instance.cls.name}, has no '{part.name}'",
        part.span,
        labels=labels,
        help=f"did you mean '{near}'?" if near else _inside_help(instance),
    )


def _inside_help(instance: Instance) -> str:
    """Name what is asked for most first: outputs, frames, what moves."""
    names = [
        name
        for kinds in (
            ast.Output,
            ast.Frame | ast.Point,
            ast.Coordinate | ast.State | ast.Discrete,
            ast.Statement,
        )
        for name, member in instance.members.items()
        if isinstance(member.declaration, kinds)
    ]
    return f"it has {', '.join([*dict.fromkeys(names)][:MOST_NAMES])}" if names else ""


def existing(scope: Scope, member: ComponentMember, span: Span) -> dict[Index, Instance]:
    """Return the instances of a component; reports one that its condition leaves out."""
    instances = instances_of(member)
    declaration = member.declaration
    assert isinstance(declaration, ast.Component)
    if not instances and declaration.condition is not None and not declaration.dimensions:
        raise scope.fail(
            "E0216",
            f"'{declaration.name}' does not exist here",
            span,
            labels=(Label(declaration.condition.span, "this condition is false"),),
            help="put what uses it under the same condition: 'if ... then ... end if;'",
        )
    return instances


def check_count(scope: Scope, member: ComponentMember, part: ast.Part) -> None:
    """Report a name of components with more or fewer indices than it has dimensions."""
    sizes = member.extents
    if len(part.indices) != len(sizes):
        raise scope.fail(
            "E0316",
            f"'{part.name}' has {dimension_words(len(sizes))}, not {len(part.indices)}",
            part.span,
            labels=(Label(member.declaration.name_span, "declared here"),),
        )


def component_index(scope: Scope, member: ComponentMember, part: ast.Part) -> Index:
    """Return the index of one component, counted from 0."""
    sizes = member.extents
    check_count(scope, member, part)
    chosen = []
    for node, size in zip(part.indices, sizes, strict=True):
        position = positions(scope, node, size, part.span)
        if not isinstance(position, int):
            raise scope.fail(
                "E0316", "a range of components has no value", node.span, help=_listed(member, part, sizes)
            )
        chosen.append(position)
    return tuple(chosen)


def _listed(member: ComponentMember, part: ast.Part, sizes: Sequence[int]) -> str:
    """Say how the values of a range of components are written."""
    name, inner = member.declaration.name, _inner(member)
    texts = [node.span.text.strip() for node in part.indices]
    if all(text in (":", "*") for text in texts):
        return f"a name without an index stands for all of them, as in '{name}.{inner}'"
    letters = iter("ijkl")
    indices, ranges = [], []
    for text, size in zip(texts, sizes, strict=True):
        if ":" in text or text == "*":
            letter = next(letters)
            ranges.append(f"{letter} in {text if text not in (':', '*') else f'1:{size}'}")
        indices.append(letter if ":" in text or text == "*" else text)
    return f"list what is meant, as in '{{{name}[{', '.join(indices)}].{inner} for {', '.join(ranges)}}}'"


# ---------------------------------------------------------------- names that are nothing here


def _outside(scope: Scope, node: ast.Reference) -> Expression:
    """Return what a name that is not a member stands for: ``energy.total``, ``engine.power``, ``world``."""
    first, rest = node.parts[0], node.parts[1:]
    if len(rest) == 1 and not rest[0].indices:
        if first.name == "energy" and rest[0].name in _ENERGIES and not first.indices:
            dimension = types.NUMBER.dimension if scope.flattening.dimensionless else types.ENERGY
            return Query(
                type=types.real(dimension), span=node.span, function=_ENERGIES[rest[0].name], target=""
            )
        label = find_label(scope, ast.Reference(parts=(first,), span=first.span))
        if label is not None and rest[0].name == "power":
            dimension = types.NUMBER.dimension if scope.flattening.dimensionless else types.POWER
            return Query(type=types.real(dimension), span=node.span, function="power", target=label.name)
    if rest:
        raise unknown(scope, first.name, first.span)
    return indexed(scope, predefined(scope, first.name, first.span), first.indices, node.span)


def unknown(scope: Scope, name: str, span: Span) -> Poisoned:
    """Report a name that means nothing as a value."""
    instance = scope.instance
    if instance is not None and instance.cls.broken:
        return Poisoned()
    if instance is not None and name in instance.cls.conditional:
        return scope.fail(
            "E0216",
            f"'{name}' exists only under a condition that is false here",
            span,
            labels=(Label(instance.cls.conditional[name].name_span, "declared here"),),
        )
    if name in BUILTINS:
        return scope.fail(
            "E0213",
            f"'{name}' is a function and needs its arguments",
            span,
            help=BUILTINS[name].doc if name != "energy" else f"'energy()'; {OF_ONE_PART}",
        )
    if instance is not None:
        expand(instance)
        kinds = [label.kind for key, label in instance.labels.items() if key[0] == name]
        if kinds:
            return scope.fail(
                "E0213",
                f"'{name}' names a statement and has no value",
                span,
                help=question_of(kinds[0], name),
            )
    found = scope.namespace.look_up(name, span)
    if found is not None:
        noun = type(found.definition).__name__.lower()
        return scope.fail("E0213", f"'{name}' is {types.with_article(noun)} and has no value", span)
    help = _rest_of_unit(name, span) or _unit_in_parentheses(span) or _suggestion(scope, name)
    return scope.fail("E0201", f"unknown name '{name}'", span, help=help)


def _rest_of_unit(name: str, span: Span) -> str:
    """Return how to write a quantity whose unit has blanks inside, as in ``9.81 m / s^2``; empty for others."""
    text = span.file.text
    before = _QUANTITY_AND_SIGN.search(text[text.rfind("\n", 0, span.start) + 1 : span.start])
    if before is None:
        return ""
    power = _POWER.match(text, span.end)
    number, written = before[1].split(maxsplit=1)
    pieces = f"{written}{before[0][before.end(1) - before.start() :]}{name}{power[0] if power else ''}"
    unit = "".join(pieces.split()).replace("*", ".")
    try:
        parse_unit(unit)
    except UnitError:
        return ""
    rule = (
        "has no blanks inside"
        if len(pieces.split()) > 1
        else "is written in one piece, with '.' for products"
    )
    return f"a unit {rule}: '{number} {unit}'"


def _unit_in_parentheses(span: Span) -> str:
    """Return how to write a unit below a line that stands in parentheses, as in ``5 V/(rad/s)``; empty for others."""
    text = span.file.text
    begin = text.rfind("\n", 0, span.start) + 1
    for match in _UNIT_BELOW.finditer(text, begin):
        if match.start() <= span.start < match.end():
            number, above, below = match.groups()
            first, *others = re.split(r"/", below)
            over, line, under = above.partition("/")
            unit = f"{'.'.join((over, *others))}{line}{under}/{first.replace('.', '/').replace('*', '/')}"
            try:
                parse_unit(unit)
            except UnitError:
                return ""
            return f"a unit has no parentheses: '{number} {unit}'"
    return ""


def _suggestion(scope: Scope, name: str) -> str:
    candidates = [*scope.local, *CONSTANTS, "world", scope.flattening.independent]
    if scope.instance is not None:
        candidates = [*scope.local, *scope.instance.members, *candidates]
    if moving := _rate_of(scope, name):
        return f"the rate of '{moving}' is written 'der({moving})'"
    near = closest(name, candidates)
    if near:
        return f"did you mean '{near}'?"
    if name == "t":
        return f"the time is called '{scope.flattening.independent}'"
    if scope.instance is None:
        return (
            "a function sees its arguments, and what its body declares before in the same block or around it; "
            f"give it '{name}' as an argument"
        )
    inside = [
        f"{member.declaration.name}.{name}"
        for member in scope.instance.members.values()
        if isinstance(member, ComponentMember)
        and not member.extents
        and any(name in instance.members for instance in member.instances.values())
    ]
    if inside:
        return f"did you mean '{inside[0]}'?"
    return f"declare it: 'parameter {name} = ..;' for a given value, 'let {name} = ..;' for a formula"


def _rate_of(scope: Scope, name: str) -> str:
    """Return the coordinate or state whose rate a name stands for on paper: thetadot, theta_dot, thetad, dtheta."""
    found = re.fullmatch(r"(?P<a>\w+?)_?(dot|d|p)|d_?(?P<b>\w+?)(_?dt)?", name)
    for base in found.group("a", "b") if found and scope.instance else ():
        member = scope.instance.members.get(base) if scope.instance and base else None
        if isinstance(member, VariableMember) and member.role in (Role.COORDINATE, Role.STATE):
            return str(base)
    return ""


# ---------------------------------------------------------------- named statements and components

CONSTRAINING = ("constraint", "contact", "friction")
"""Kinds of named statements that hold something and have a multiplier; the others have a power."""


def question_of(kind: str, name: str) -> str:
    """Say what may be asked of a named statement."""
    if kind in CONSTRAINING:
        return f"ask for 'multiplier({name})'"
    return f"ask for 'power({name})', the power of this {kind}"


def find_label(scope: Scope, node: ast.Reference) -> LabelMember | None:
    """Return the named statement that a reference means, if it means one; ``c.friction`` is the friction of a contact ``c``."""
    instance = scope.instance
    for k, part in enumerate(node.parts[:-1]):
        member = None if instance is None else member_of(instance, part.name)
        if not isinstance(member, ComponentMember):
            if k == len(node.parts) - 2 and node.parts[-1].name == "friction":
                return _friction_of(scope, node)
            return None
        instance = existing(scope, member, part.span).get(component_index(scope, member, part))
    if instance is None:
        return None
    part = node.parts[-1]
    expand(instance)
    if not any(key[0] == part.name for key in instance.labels):
        return None
    if part.name in instance.in_families:
        raise Unlike  # one of them is asked for by its name
    index = tuple(whole_number(scope, i, "an index") for i in part.indices)
    label = instance.labels.get((part.name, index))
    whole = instance.labels.get((part.name, ()))
    if (
        label is None
        and whole is not None
        and whole.made is not None
        and instances_of(whole.made).keys() != {()}
    ):
        return replace(whole, element=component_index(scope, whole.made, part))
    if label is None:
        raise scope.fail(
            "E0314",
            f"there is no '{part.name}{subscript_text(tuple(i - 1 for i in index))}'",
            part.span,
            help=f"'{part.name}' needs an index" if not index else "",
        )
    return label


def _friction_of(scope: Scope, node: ast.Reference) -> LabelMember | None:
    """Return the friction of the contact that all but the last part of a reference names."""
    parts, last = node.parts[:-1], node.parts[-1]
    contact = find_label(scope, ast.Reference(parts=parts, span=parts[0].span.to(parts[-1].span)))
    if contact is None or not isinstance(contact.statement, ast.Contact):
        return None
    return friction_of(scope, contact, node.span, whole=not last.indices)


def friction_of(scope: Scope, contact: LabelMember, span: Span, *, whole: bool = True) -> LabelMember:
    """Return the friction of a contact that ``span`` asks about; report where it has none, or an element of it is asked for."""
    assert isinstance(contact.statement, ast.Contact)
    if contact.statement.friction is None or not whole:
        raise scope.fail(
            "E0212",
            f"the contact '{contact.name}' has no friction"
            if contact.statement.friction is None
            else f"the friction of '{contact.name}' is asked about as a whole",
            span,
            labels=(Label(contact.statement.span, "stated here"),),
            help="write 'contact .. friction mu along s'"
            if contact.statement.friction is None
            else f"ask for 'multiplier({contact.name}.friction)', and take an element of that",
        )
    if contact.friction is None:
        name = friction_name(contact.name)
        contact.friction = LabelMember("friction", name, contact.statement, contact.scope)
    return contact.friction


def contacts_of(label: LabelMember) -> list[LabelMember]:
    """Return the named contacts that a contact of shapes consists of: those of all points, of all pairs or of the one that is meant."""
    assert label.made is not None
    found: list[LabelMember] = []
    pending = [
        instance for index, instance in instances_of(label.made).items() if label.element in (None, index)
    ]
    while pending:
        at = pending.pop(0)
        for item in expand(at):
            if isinstance(item.statement, ast.Contact) and item.statement.label is None:
                raise item.scope.fail(
                    "E0212",
                    f"'{label.name}' is asked about, and this contact of it has no name",
                    item.statement.span,
                    help="write 'contact touch: ..'",
                )
        found += [one for one in at.labels.values() if isinstance(one.statement, ast.Contact)]
        for member in at.members.values():
            if isinstance(member, ComponentMember) and member.statement is None:
                pending += instances_of(member).values()
    return found


def find_instance(scope: Scope, node: ast.Reference) -> Instance | None:
    """Return the component that a reference means, if it means one."""
    instance = scope.instance
    for part in node.parts:
        member = None if instance is None else member_of(instance, part.name)
        if not isinstance(member, ComponentMember):
            return None
        instance = existing(scope, member, part.span).get(component_index(scope, member, part))
    return instance
