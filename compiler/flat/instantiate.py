"""Making instances: members from declarations, modifications handed on, loops and conditions unrolled."""

from __future__ import annotations

from fractions import Fraction
from itertools import product

from mechc.lang import ast
from mechc.lang.diagnostics import Label
from mechc.lang.source import Span
from mechc.lang.suggest import closest

from . import types
from .classes import Class, Placed
from .evaluate import check_size, iterate, truth, whole_number
from .instance import (
    EXTENDED,
    MODIFIED,
    AnyMember,
    ComponentMember,
    DefinitionMember,
    Expanded,
    Index,
    Instance,
    LabelMember,
    Modifier,
    Pick,
    PlaceMember,
    Progress,
    Source,
    VariableMember,
)
from .model import Expression, Literal, Role
from .scope import Flattening, Poisoned, Scope

DEEPEST = 60
"""Most levels of components within components."""

MOST = 20_000
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
    made_at: Span | None,
    modifiers: list[Modifier],
) -> Instance:
    """Return a new instance with its unconditional members; its statements are unrolled when needed."""
    depth = 0 if parent is None else parent.depth + 1
    flattening.instances += 1
    if flattening.instances > MOST:
        raise flattening.reporter.fail(
            "E0406", f"the model has more than {MOST} components", made_at, caption="the last was made here"
        )
    instance = Instance(flattening, cls, path, parent, made_at, depth)
    for inherited in cls.inherited:
        scope = Scope(flattening, instance, inherited.namespace, level=inherited.level)
        rank = (EXTENDED, -depth, -inherited.level)
        if (modifier := _modifier(inherited.modification, scope, rank, instance)) is not None:
            modifiers.append(modifier)
    for modifier in modifiers:
        instance.modifiers.setdefault(modifier.path[0].name, []).append(modifier)
    scopes: dict[tuple[int, int], Scope] = {}
    for name, placed in cls.declarations.items():
        key = (id(placed.namespace), placed.level)
        scope = scopes.get(key) or Scope(flattening, instance, placed.namespace, level=placed.level)
        scopes[key] = scope
        assert isinstance(placed.statement, ast.Declaration)
        instance.members[name] = _member(instance, placed.statement, scope)
    _check_names(instance)
    return instance


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
    names = [n for n, m in instance.members.items() if isinstance(m, VariableMember)]
    return f"it has {', '.join(names[:8])}" if names else ""


def _modifier(
    node: ast.Modification, scope: Scope, rank: tuple[int, int, int], target: Instance | None
) -> Modifier | None:
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
    return Modifier(reference.parts, node.kind, rate, source, rank, node.target.span)


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
    scopes: dict[tuple[int, int], Scope] = {}
    for placed in instance.cls.statements:
        statement = placed.statement
        if isinstance(statement, ast.Declaration):
            if instance.cls.declarations[statement.name].statement is statement:
                result.append(Expanded(statement, instance.members[statement.name].scope))
            continue
        key = (id(placed.namespace), placed.level)
        scope = scopes.get(key) or Scope(instance.flattening, instance, placed.namespace, level=placed.level)
        scopes[key] = scope
        _expand(instance, placed, statement, scope, result)
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


def _expand(
    instance: Instance, placed: Placed, statement: ast.Statement, scope: Scope, result: list[Expanded]
) -> None:
    try:
        match statement:
            case ast.For(name=name, range=range, body=body):
                statements = [item for item in body if not isinstance(item, ast.Declaration)]
                for inner in iterate(scope, name, range):
                    for item in statements:
                        _expand(instance, placed, item, inner, result)
            case ast.If(branches=branches, otherwise=otherwise):
                chosen = otherwise
                for branch in branches:
                    if truth(scope, branch.condition, "the condition of a structural 'if'"):
                        chosen = branch.body
                        break
                for item in chosen:
                    _expand(instance, placed, item, scope, result)
            case ast.Declaration():
                _declare(instance, statement, scope)
                result.append(Expanded(statement, scope))
            case _:
                if label := getattr(statement, "label", None):
                    _register(instance, statement, label, scope)  # type: ignore[arg-type]
                result.append(Expanded(statement, scope))
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


def _register(
    instance: Instance,
    statement: ast.Load | ast.Damping | ast.Friction | ast.Constraint | ast.Contact,
    label: ast.LabelName,
    scope: Scope,
) -> None:
    index = tuple(whole_number(scope, i, "the index of a name") for i in label.indices)
    text = f"{label.name}[{','.join(map(str, index))}]" if index else label.name
    key = (label.name, index)
    first = instance.labels.get(key)
    declared = instance.members.get(label.name)
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
    instance.labels[key] = LabelMember(kind, instance.full_name(text), statement, scope)


# ---------------------------------------------------------------- components


def extents(scope: Scope, dimensions: tuple[ast.Dimension, ...]) -> tuple[int, ...]:
    """Return the sizes of array dimensions ``[n]``, ``[i in 1:n]``."""
    sizes = []
    for dimension in dimensions:
        if isinstance(dimension.size, ast.Range):
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
    total = 1
    for size in sizes:
        total *= size
    if dimensions:
        check_size(scope, total, dimensions[0].span)
    return tuple(sizes)


def indices(sizes: tuple[int, ...]) -> list[Index]:
    """Return every index of an array, counted from 0, the last changing fastest."""
    return list(product(*(range(n) for n in sizes)))


def subscript(index: Index) -> str:
    """Return ``[1,2]``, counted from 1; empty for a scalar."""
    return f"[{','.join(str(i + 1) for i in index)}]" if index else ""


def element_scope(scope: Scope, dimensions: tuple[ast.Dimension, ...], index: Index) -> Scope:
    """Return the scope of one element, in which the names of ``[i in 1:n]`` have their values."""
    local: dict[str, Expression] = {
        d.name: Literal(type=types.INTEGER, span=d.span, value=Fraction(i + 1))
        for d, i in zip(dimensions, index, strict=True)
        if d.name
    }
    return scope.with_local(local) if local else scope


def instances_of(member: ComponentMember) -> dict[Index, Instance]:
    """Return the instances of a component, making them at the first call."""
    if member.progress is Progress.WRONG:
        raise Poisoned
    if member.progress is Progress.DONE:
        return member.instances
    declaration, scope = member.declaration, member.scope
    assert isinstance(declaration, ast.Component)
    if member.progress is Progress.OPEN:
        raise scope.fail("E0207", f"'{declaration.name}' depends on itself", declaration.name_span)
    member.progress = Progress.OPEN
    try:
        _instantiate(member, declaration, scope)
    except Poisoned:
        member.progress = Progress.WRONG
        raise
    member.progress = Progress.DONE
    return member.instances


def _instantiate(member: ComponentMember, declaration: ast.Component, scope: Scope) -> None:
    if declaration.condition is not None and not truth(
        scope, declaration.condition, "the condition of a component"
    ):
        return
    cls = _class_of(declaration, scope)
    member.extents = extents(scope, declaration.dimensions)
    parent = scope.instance
    assert parent is not None
    named = any(d.name for d in declaration.dimensions)
    shared = None if named else _modifiers(declaration, cls, scope)
    for index in indices(member.extents):
        own = shared
        if own is None:
            own = _modifiers(declaration, cls, element_scope(scope, declaration.dimensions, index))
        given = [*own, *_handed_on(member, index)]
        if member.extents:
            given = [_picked(m, member.extents, index) for m in given]
        path = member.name + subscript(index)
        member.instances[index] = make_instance(scope.flattening, cls, path, parent, declaration.span, given)


def _picked(modifier: Modifier, sizes: tuple[int, ...], index: Index) -> Modifier:
    return Modifier(
        modifier.path,
        modifier.kind,
        modifier.rate,
        modifier.source,
        modifier.rank,
        modifier.span,
        (*modifier.picks, Pick(sizes, index)),
        modifier.link,
    )


def _handed_on(member: ComponentMember, index: Index) -> list[Modifier]:
    """Return the outer modifications that go into one element of a component."""
    result = []
    for modifier in member.modifiers:
        first, rest = modifier.path[0], modifier.path[1:]
        if not rest:
            modifier.source.scope.report(
                "E0402",
                f"'{first.name}' is a component; only what is inside it can be modified",
                modifier.span,
                help=f"write '{first.name}.name = value'",
            )
            continue
        if first.indices:
            wanted = tuple(whole_number(modifier.source.scope, i, "an index") - 1 for i in first.indices)
            if len(wanted) != len(member.extents) or any(
                not 0 <= i < n for i, n in zip(wanted, member.extents, strict=False)
            ):
                modifier.source.scope.report(
                    "E0314",
                    f"'{first.name}' has no element {subscript(wanted)}",
                    first.span,
                    caption=f"it has {_extent_words(member.extents)}",
                )
                continue
            if wanted != index:
                continue
        result.append(
            Modifier(
                rest,
                modifier.kind,
                modifier.rate,
                modifier.source,
                modifier.rank,
                modifier.span,
                modifier.picks,
                modifier.link,
            )
        )
    return result


def _extent_words(sizes: tuple[int, ...]) -> str:
    return " x ".join(map(str, sizes)) + " elements" if sizes else "no elements: it is no array"


def _class_of(declaration: ast.Component, scope: Scope) -> Class:
    """Return the class of a component; refuse what cannot be instantiated here."""
    span = declaration.span
    found = scope.namespace.look_up(declaration.type, span)
    if found is None or not isinstance(found.definition, ast.Model):
        if scope.namespace.broken:
            raise Poisoned
        near = closest(declaration.type, scope.namespace.names())
        raise scope.fail(
            "E0203",
            f"there is no model '{declaration.type}'",
            span,
            caption="unknown model" if found is None else f"'{declaration.type}' is no model",
            help=f"did you mean '{near}'?" if near else "import it, for example 'import mech.planar.*;'",
        )
    model = found.definition
    cls = scope.flattening.classes.of(model, found.namespace)
    if model.partial:
        raise scope.fail(
            "E0407",
            f"'{model.name}' is partial and cannot be a component",
            span,
            labels=(Label(model.name_span, "declared 'partial' here"),),
            help="write a model that extends it",
        )
    if cls.broken:
        raise Poisoned
    if cls.dimensionless is not scope.flattening.dimensionless:
        raise _dimensions_differ(scope, cls, span)
    _check_depth(scope, cls, declaration)
    return cls


def _dimensions_differ(scope: Scope, cls: Class, span: Span) -> Poisoned:
    if cls.dimensionless:
        message = f"'{cls.name}' is dimensionless, the model around it is not"
        help = "write 'dimensionless;' in the model as well, or give the component units"
    else:
        message = f"'{cls.name}' has units, the model around it is dimensionless"
        help = "leave out 'dimensionless;', or write the component in pure numbers"
    return scope.fail(
        "E0320", message, span, labels=(Label(cls.model.name_span, f"{cls.name} is defined here"),), help=help
    )


def _check_depth(scope: Scope, cls: Class, declaration: ast.Component) -> None:
    """Stop components that contain themselves without end."""
    instance = scope.instance
    if instance is None or instance.depth < DEEPEST:
        return
    chain = [declaration.name]
    at: Instance | None = instance
    while at is not None and len(chain) < 5:
        chain.append(at.path.rpartition(".")[2] or at.model.name)
        at = at.parent
    raise scope.flattening.reporter.fail(  # nothing else would end, so all stops here
        "E0406",
        f"components are nested more than {DEEPEST} deep",
        declaration.span,
        caption=f"{cls.name} contains itself: ... " + " -> ".join(reversed(chain)),
        help="end the recursion by a condition, as in 'Type name(depth = depth - 1) if depth > 0;'",
    )


def _modifiers(declaration: ast.Component, cls: Class, scope: Scope) -> list[Modifier]:
    """Return what the parentheses of a component say; ``A -> B`` binds the first two interface frames."""
    depth = 0 if scope.instance is None else scope.instance.depth
    rank = (MODIFIED, -depth, -scope.level)
    result: list[Modifier] = []
    for node in declaration.modifications:
        if node.kind != "->":
            if (modifier := _modifier(node, scope, rank, None)) is not None:
                result.append(modifier)
            continue
        interface = cls.interface
        if len(interface) < 2:
            scope.report(
                "E0408",
                f"'->' connects two frames, and {cls.name} has {len(interface) or 'none'} to be placed",
                node.span,
                labels=(Label(cls.model.name_span, f"{cls.name} is defined here"),),
                help="'a -> b' gives the first two free frames of a joint or force element",
            )
            continue
        for name, value in zip(interface[:2], (node.target, node.value), strict=True):
            part = ast.Part(name=name, span=value.span)
            source = Source(value, scope)
            result.append(Modifier((part,), "=", False, source, rank, value.span, link=True))
    return result
