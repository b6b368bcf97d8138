"""Making instances: members from declarations, modifications handed on, loops and conditions unrolled."""

from __future__ import annotations

from fractions import Fraction
from math import prod

from mechc.lang import ast
from mechc.lang.diagnostics import Label
from mechc.suggest import closest

from .. import types
from ..model import Expression, Literal, Role
from ..names.classes import Class, Stated, component_of
from ..names.instance import (
    EXTENDED,
    AnyMember,
    ComponentMember,
    DefinitionMember,
    Expanded,
    Instance,
    Labelled,
    LabelMember,
    Modifier,
    PlaceMember,
    Source,
    VariableMember,
    rank_of,
)
from ..names.scope import Flattening, Poisoned, Scope
from ..subscripts import Index
from ..values.evaluate import check_size, iterate, truth, whole_number

MOST = 30_000
"""Most components of a model."""

_ROLES: dict[type[ast.Declaration], Role] = {
    ast.Parameter: Role.PARAMETER,
    ast.Coordinate: Role.COORDINATE,
    ast.State: Role.STATE,
    ast.Discrete: Role.DISCRETE,
    ast.Input: Role.INPUT,
}


def make_instance(
    flattening: Flattening,
    cls: Class,
    path: str,
    parent: Instance | None,
    declaration: ast.Component | None,
    modifiers: list[Modifier],
) -> Instance:
    """Return a new instance with its unconditional members; its statements are unrolled when needed."""
    depth = 0 if parent is None else parent.depth + 1
    flattening.instances += 1
    if flattening.instances > MOST:
        raise flattening.reporter.fail(
            "E0406",
            f"the model has more than {MOST} components",
            None if declaration is None else declaration.span,
            caption="the last was made here",
        )
    instance = Instance(flattening, cls, path, parent, declaration, depth)
    for inherited in cls.inherited:
        scope = Scope(flattening, instance, inherited.namespace, level=inherited.level)
        if (modifier := modifier_of(inherited.modification, scope, EXTENDED)) is not None:
            modifiers.append(modifier)
    for modifier in modifiers:
        instance.modifiers.setdefault(modifier.path[0].name, []).append(modifier)
    scopes = _Scopes(instance)
    for name, stated in cls.declarations.items():
        assert isinstance(stated.statement, ast.Declaration)
        instance.members[name] = _member(instance, stated.statement, scopes.of(stated))
    _check_names(instance)
    return instance


class _Scopes:
    """The scopes of the statements of an instance: one for each level of inheritance and its names."""

    def __init__(self, instance: Instance) -> None:
        self._instance = instance
        self._known: dict[tuple[int, int], Scope] = {}

    def of(self, stated: Stated) -> Scope:
        key = (id(stated.namespace), stated.level)
        scope = self._known.get(key)
        if scope is None:
            instance = self._instance
            scope = Scope(instance.flattening, instance, stated.namespace, level=stated.level)
            self._known[key] = scope
        return scope


def _member(instance: Instance, declaration: ast.Declaration, scope: Scope) -> AnyMember:
    name = declaration.name
    full = instance.full_name(name)
    modifiers = instance.modifiers.get(name, [])
    match declaration:
        case ast.Component():
            return ComponentMember(declaration, scope, full, modifiers)
        case ast.Frame() | ast.Point():
            return PlaceMember(declaration, scope, full, modifiers)
        case ast.Let() | ast.Output():
            definition = DefinitionMember(declaration, scope, full, modifiers)
            instance.flattening.definitions[full] = definition
            return definition
        case _:
            structural = isinstance(declaration, ast.Parameter) and declaration.structural
            role = _ROLES[type(declaration)]
            variable = VariableMember(declaration, scope, full, modifiers, role=role, structural=structural)
            instance.flattening.variables[full] = variable
            return variable


def _check_names(instance: Instance) -> None:
    """Report modifications of names that the class does not have."""
    cls = instance.cls
    for name, modifiers in instance.modifiers.items():
        if name in instance.members or name in cls.conditional or cls.broken:
            continue
        near = closest(name, [*instance.members, *cls.conditional])
        for modifier in modifiers:
            modifier.source.scope.report(
                "E0401",
                f"{cls.name} has no '{name}'",
                modifier.span,
                caption="nothing of this name can be modified",
                labels=(Label(cls.model.name_span, f"{cls.name} is defined here"),),
                help=f"did you mean '{near}'?" if near else _what_there_is(instance),
            )


def _what_there_is(instance: Instance) -> str:
    members = {n: m for n, m in instance.members.items() if isinstance(m, VariableMember) or _is_free(m)}
    if not members:
        return ""
    coordinates = (
        n for n, m in members.items() if isinstance(m, VariableMember) and m.role is Role.COORDINATE
    )
    moving = next(coordinates, None)
    rate = f"; its rate at the start is 'der({moving}) = ..'" if moving else ""
    return f"it has {', '.join([*members][:8])}{rate}"


def _is_free(member: object) -> bool:
    """Whether it is a frame that the text around the component may place."""
    return (
        isinstance(member, PlaceMember)
        and isinstance(member.declaration, ast.Frame)
        and member.declaration.value is None
    )


def modifier_of(node: ast.Modification, scope: Scope, stage: int) -> Modifier | None:
    """Return what a modification says; links are handled apart."""
    rate = isinstance(node.target, ast.Derivative)
    reference = node.target.operand if isinstance(node.target, ast.Derivative) else node.target
    if isinstance(node.target, ast.Derivative) and node.target.order != 1:
        scope.report("E0403", "only the first derivative has an initial value here", node.target.span)
        return None
    if node.kind == "in":
        scope.report("E0809", "'in' makes a sweep, which belongs to an experiment", node.span)
        return None
    if node.kind == "->":
        scope.report("E0408", "'->' connects a component; there is none here", node.span)
        return None
    if not isinstance(reference, ast.Reference):
        scope.report("E0401", "a modification begins with a name", node.target.span)
        return None
    source = Source(node.value, scope)
    return Modifier(reference.parts, node.kind, rate, source, rank_of(scope, stage), node.target.span)


# ---------------------------------------------------------------- looking up


def member_of(instance: Instance, name: str) -> AnyMember | None:
    """Return a member by name, deciding the structural conditions if it may stand under one."""
    found = instance.members.get(name)
    if found is None and name in instance.cls.conditional and not instance.expanding:
        expand(instance)
        found = instance.members.get(name)
    return found


# ---------------------------------------------------------------- statements


def expand(instance: Instance) -> list[Expanded]:
    """Return the statements of an instance with loops and structural conditions unrolled."""
    if instance.expanded is not None:
        return instance.expanded
    instance.expanding = True
    result: list[Expanded] = []
    scopes = _Scopes(instance)
    named: dict[int, list[Expanded]] = {}  # conditions and loops before them may ask for them
    for stated in instance.cls.statements:
        statement = stated.statement
        if isinstance(statement, ast.Shape | ast.ContactOfShapes) and statement.label is not None:
            found = named[id(statement)] = []
            _expand(instance, statement, scopes.of(stated), found)
    for stated in instance.cls.statements:
        statement = stated.statement
        if id(statement) in named:
            result += named[id(statement)]
            continue
        if isinstance(statement, ast.Declaration):
            if instance.cls.declarations[statement.name].statement is statement:
                result.append(Expanded(statement, instance.members[statement.name].scope))
            continue
        _expand(instance, statement, scopes.of(stated), result)
    instance.expanding = False
    instance.expanded = result
    _check_conditional(instance)
    return result


def _check_conditional(instance: Instance) -> None:
    """Report modifications of names that a condition has left out."""
    for name, modifiers in instance.modifiers.items():
        declaration = instance.cls.conditional.get(name)
        if declaration is None or name in instance.members:
            continue
        for modifier in modifiers:
            modifier.source.scope.report(
                "E0216",
                f"{instance.cls.name} has '{name}' only under a condition that is false here",
                modifier.span,
                labels=(Label(declaration.name_span, "declared here"),),
            )


def _expand(instance: Instance, statement: ast.Statement, scope: Scope, result: list[Expanded]) -> None:
    try:
        match statement:
            case ast.For(name=name, range=range, body=body):
                from .pair_loops import pair_loop

                declared = (ast.Declaration, ast.Unpacked)
                statements = [item for item in body if not isinstance(item, declared)]
                turns = iterate(scope, name, range)
                loops = [item for item in statements if isinstance(item, ast.For)]
                pairs = {id(item): pair_loop(instance, name, turns, item) for item in loops}
                for k, inner in enumerate(turns):
                    for item in statements:
                        found = pairs.get(id(item))
                        if found is None:
                            _expand(instance, item, inner, result)
                        elif k == found.row and isinstance(item, ast.For):
                            last = inner.with_local(found.columns[-1].local)
                            for contact in item.body:
                                _expand(instance, contact, last, result)
                                result[-1].pairs = found
                                if isinstance(contact, ast.Contact) and contact.label is not None:
                                    instance.in_families.add(contact.label.name)
            case ast.If(branches=branches, otherwise=otherwise):
                chosen = otherwise
                for branch in branches:
                    if truth(scope, branch.condition, "the condition of a structural 'if'"):
                        chosen = branch.body
                        break
                for item in chosen:
                    _expand(instance, item, scope, result)
            case ast.Unpacked(lets=lets):
                for item in lets:
                    _expand(instance, item, scope, result)
            case ast.Declaration():
                _declare(instance, statement, scope)
                result.append(Expanded(statement, scope))
            case _:
                label = None
                if isinstance(statement, Labelled) and statement.label is not None:
                    label = _register(instance, statement, statement.label, scope)
                made = None
                if isinstance(statement, ast.Shape | ast.ContactOfShapes):
                    made = _make(instance, statement, label, scope)
                result.append(Expanded(statement, scope, made))
    except Poisoned:
        return


def _declare(instance: Instance, declaration: ast.Declaration, scope: Scope) -> None:
    first = instance.members.get(declaration.name)
    if first is not None:
        raise scope.fail(
            "E0204",
            f"'{declaration.name}' is declared twice",
            declaration.name_span,
            caption="again here",
            labels=(Label(first.declaration.name_span, "first here"),),
        )
    instance.members[declaration.name] = _member(instance, declaration, scope)


def _make(
    instance: Instance,
    statement: ast.Shape | ast.ContactOfShapes,
    label: LabelMember | None,
    scope: Scope,
) -> ComponentMember | None:
    """Return the component of a ``shape`` or of a contact of shapes; None for the shape of a pair, which is known already."""
    declaration = component_of(statement)
    if isinstance(statement, ast.Shape) and statement.on is None and declaration.name in instance.members:
        return None
    modifiers = instance.modifiers.get(declaration.name, []) if label is not None else []
    name = instance.full_name(declaration.name) if label is None else label.name
    made = ComponentMember(declaration, scope, name, modifiers, statement=statement)
    if label is not None:
        label.made = made
        if statement.label is not None and not statement.label.indices:
            instance.members[declaration.name] = made
    return made


def _register(instance: Instance, statement: Labelled, label: ast.LabelName, scope: Scope) -> LabelMember:
    index = tuple(whole_number(scope, i, "the index of a name") for i in label.indices)
    text = f"{label.name}[{','.join(map(str, index))}]" if index else label.name
    key = (label.name, index)
    first = instance.labels.get(key)
    declared = instance.members.get(label.name)
    if instance.pair and isinstance(statement, ast.Shape):
        declared = None  # the contact that the instance is of has named its shapes
    if first is not None or declared is not None:
        other = first.statement.label if first is not None else None
        span = other.span if other is not None else declared.declaration.name_span if declared else label.span
        raise scope.fail(
            "E0204",
            f"'{text}' is declared twice",
            label.span,
            caption="again here",
            labels=(Label(span, "first here"),),
            help="in a loop, give the name the index, as in 'name[i]:'"
            if first is not None and not index
            else "",
        )
    kind = statement.kind if isinstance(statement, ast.Load) else type(statement).__name__.lower()
    if isinstance(statement, ast.ContactOfShapes):
        kind = "contact"
    found = instance.labels[key] = LabelMember(kind, instance.full_name(text), statement, scope)
    return found


# ---------------------------------------------------------------- arrays


def extents(
    scope: Scope, dimensions: tuple[ast.Dimension, ...], given: tuple[int, ...] | None = None
) -> tuple[int, ...]:
    """Return the sizes of array dimensions ``[n]``, ``[i in 1:n]``; ``given`` is the shape of the value for ``[:]``."""
    sizes = []
    for k, dimension in enumerate(dimensions):
        if isinstance(dimension.size, ast.Whole):
            if given is None or len(given) != len(dimensions):
                what = "is none" if given is None else f"has the shape {types.shape_text(given)}"
                raise scope.fail(
                    "E0422",
                    f"the value tells the size that ':' leaves open, and it {what}",
                    dimension.span,
                    help="write the number of elements" if given is None else "write one ':' for each index",
                )
            size = given[k]
        elif isinstance(dimension.size, ast.Range):
            node = dimension.size
            first = whole_number(scope, node.start, "the start of a range")
            if first != 1 or node.step is not None:
                raise scope.fail(
                    "E0422", "the elements of an array are counted from 1", node.span, help="write '1:n'"
                )
            size = whole_number(scope, node.stop, "the size of an array")
        else:
            size = whole_number(scope, dimension.size, "the size of an array")
        if size < 0:
            raise scope.fail("E0422", f"an array cannot have {size} elements", dimension.span)
        sizes.append(size)
    if dimensions:
        check_size(scope, prod(sizes), dimensions[0].span)
    return tuple(sizes)


def element_scope(scope: Scope, dimensions: tuple[ast.Dimension, ...], index: Index) -> Scope:
    """Return the scope of one element, in which the names of ``[i in 1:n]`` have their values."""
    local: dict[str, Expression] = {
        d.name: Literal(type=types.INTEGER, span=d.span, value=Fraction(i + 1))
        for d, i in zip(dimensions, index, strict=True)
        if d.name
    }
    return scope.with_local(local) if local else scope
