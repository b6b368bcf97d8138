"""Components: which class, which modifications, and one instance for each element of an array."""

from __future__ import annotations

from msgspec.structs import replace

from mechc.lang import ast
from mechc.lang.diagnostics import Label
from mechc.lang.source import Span
from mechc.lang.units import NAMED_TYPES
from mechc.suggest import closest

from ..names.classes import Class
from ..names.files import packages_with
from ..names.instance import (
    STATED,
    ComponentMember,
    ElaborationProgress,
    Instance,
    Modifier,
    Pick,
    Source,
    rank_of,
)
from ..names.scope import Poisoned, Scope
from ..subscripts import Index, element_name, subscript_text, subscripts
from ..values.evaluate import truth, whole_number
from .declared_types import PLAIN_TYPES
from .instantiate import element_scope, extents, make_instance, modifier_of

DEEPEST = 60
"""Most levels of components within components."""


def instances_of(member: ComponentMember) -> dict[Index, Instance]:
    """Return the instances of a component, making them at the first call."""
    if member.progress is ElaborationProgress.WRONG:
        raise Poisoned
    if member.progress is ElaborationProgress.DONE:
        return member.instances
    declaration, scope = member.declaration, member.scope
    assert isinstance(declaration, ast.Component)
    if member.progress is ElaborationProgress.OPEN:
        raise scope.fail("E0207", f"'{declaration.name}' depends on itself", declaration.name_span)
    member.progress = ElaborationProgress.OPEN
    try:
        if member.statement is None:
            _instantiate(member, declaration, scope)
        else:
            scope.flattening.make(member)
    except Poisoned:
        member.progress = ElaborationProgress.WRONG
        raise
    member.progress = ElaborationProgress.DONE
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
    shared = None if named else modifiers_of(declaration, cls, scope)
    for index in subscripts(member.extents):
        own = shared
        if own is None:
            own = modifiers_of(declaration, cls, element_scope(scope, declaration.dimensions, index))
        given = [*own, *handed_on(member, index)]
        if member.extents:
            given = [as_element(m, member.extents, index) for m in given]
        path = element_name(member.name, index)
        member.instances[index] = make_instance(scope.flattening, cls, path, parent, declaration, given)


def as_element(modifier: Modifier, sizes: tuple[int, ...], index: Index) -> Modifier:
    """Return a modification of an array of components on its way into one of them."""
    return replace(modifier, picks=(*modifier.picks, Pick(sizes, index)))


def handed_on(member: ComponentMember, index: Index) -> list[Modifier]:
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
                    f"'{first.name}' has no element {subscript_text(wanted)}",
                    first.span,
                    caption=f"it has {_extent_words(member.extents)}",
                )
                continue
            if wanted != index:
                continue
        result.append(replace(modifier, path=rest))
    return result


def _extent_words(sizes: tuple[int, ...]) -> str:
    return " x ".join(map(str, sizes)) + " elements" if sizes else "no elements: it is not an array"


OF_VARIABLES = {"start", "fixed", "min", "max", "nominal", "unit", "displayUnit", "quantity"}
"""What other languages say of a variable behind its name."""

MOST_MODELS = 8
"""Models that a message lists."""


def _by_inputs(cls: Class) -> str:
    """Return how a component is connected that has inputs, but no two sides."""
    names = [s.name for s in cls.model.body if isinstance(s, ast.Input) and s.value is None]
    listed = ", ".join(f"{name} = .." for name in names)
    return f"{cls.name} takes its sides as inputs: '{listed}'" if names else ""


def _where_models_are(scope: Scope, name: str) -> str:
    """Say how a model comes within reach, or which ones are, where the library is imported already."""
    if packages := packages_with(name):
        return " or ".join(f"'import {package}.*;'" for package in packages) + f" brings {name}"
    imported = [model.name for model in scope.namespace.imported_models() if not model.partial]
    if alike := [one for one in imported if one in name or name in one]:
        return f"did you mean '{max(alike, key=len)}'?"
    if not imported:
        return "import it, for example 'import mech.planar.*;'"
    more = ", .." if len(imported) > MOST_MODELS else ""
    return f"there are {', '.join(imported[:MOST_MODELS])}{more}"


def _class_of(declaration: ast.Component, scope: Scope) -> Class:
    """Return the class of a component; refuse what cannot be instantiated here."""
    span = declaration.span
    found = scope.namespace.look_up(declaration.type, span)
    if found is None or not isinstance(found.definition, ast.Model):
        if scope.namespace.broken:
            raise Poisoned
        is_type = found is None and declaration.type.rpartition(".")[2] in (*PLAIN_TYPES, *NAMED_TYPES)
        if is_type and {m.target.span.text for m in declaration.modifications} <= OF_VARIABLES:
            raise _no_keyword(scope, declaration)
        near = None if is_type else closest(declaration.type, scope.namespace.names())
        raise scope.fail(
            "E0203",
            f"there is no model '{declaration.type}'",
            span,
            caption="unknown model"
            if found is None and not is_type
            else f"'{declaration.type}' is {'a type of numbers' if is_type else 'no model'}",
            help=f"did you mean '{near}'?"
            if near and not packages_with(declaration.type)
            else _where_models_are(scope, declaration.type),
        )
    return class_in_use(scope, scope.flattening.classes.of(found.definition, found.namespace), declaration)


def class_in_use(scope: Scope, cls: Class, declaration: ast.Component) -> Class:
    """Return a class; refuse what cannot be instantiated here."""
    model, span = cls.model, declaration.span
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


def _no_keyword(scope: Scope, declaration: ast.Component) -> Poisoned:
    """Report ``Real x(start = 1);``: a variable that does not say what it is."""
    given = {m.target.span.text: m.value.span.text for m in declaration.modifications if m.kind == "="}
    name, start = declaration.name, given.get("start")
    known = given.get("fixed") == "true"
    value = f" {'=' if known else '~'} {start}" if start is not None else " = .."
    help = f"say what '{name}' is: 'coordinate {name}{value};'" + (
        f" ({'known' if known else 'a guess; = if it is known'})" if start is not None else ""
    )
    return scope.fail(
        "E0125",
        f"a declaration begins with a keyword, not with the type '{declaration.type}'",
        declaration.span,
        help=help + f", 'state {name}{value};', 'parameter {name} = ..;' or 'let {name} = ..;'",
    )


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


_ENDS = ast.Input | ast.Frame


def _declared(cls: Class, name: str) -> ast.Statement | None:
    found = cls.declarations.get(name)
    return None if found is None else found.statement


def modifiers_of(declaration: ast.Component, cls: Class, scope: Scope) -> list[Modifier]:
    """Return what the parentheses of a component say; ``A -> B`` binds the first two interface frames, or, where there are none, the
    inputs ``from`` and ``to``."""
    result: list[Modifier] = []
    for node in declaration.modifications:
        if node.kind != "->":
            if (modifier := modifier_of(node, scope, STATED)) is not None:
                result.append(modifier)
            continue
        interface, frames = cls.interface, True
        if len(interface) < 2 and all(isinstance(_declared(cls, end), _ENDS) for end in ("from", "to")):
            interface, frames = ("from", "to"), False
        if len(interface) < 2:
            scope.report(
                "E0408",
                f"'->' connects two sides, and {cls.name} has {len(interface) or 'no'} frame{'' if len(interface) == 1 else 's'} to be placed",
                node.span,
                labels=(Label(cls.model.name_span, f"{cls.name} is defined here"),),
                help=_by_inputs(cls)
                or "'a -> b' gives the first two free frames of a joint or force element, or its inputs 'from' and 'to'",
            )
            continue
        for name, value in zip(interface[:2], (node.target, node.value), strict=True):
            part = ast.Part(name=name, span=value.span)
            source = Source(value, scope)
            link = frames or isinstance(_declared(cls, name), ast.Frame)
            result.append(
                Modifier((part,), "=", False, source, rank_of(scope, STATED), value.span, link=link)
            )
    return result
