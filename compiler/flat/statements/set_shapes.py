"""Shapes that are set on frames, as by ``shape Sphere(r = 1 cm) on ball;``, and what carries each of them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

from msgspec import Struct, field

from mechc.lang import ast
from mechc.lang.diagnostics import Label
from mechc.suggest import closest

from .. import types
from ..expressions.references import check_count, existing
from ..instances.components import as_element, class_in_use, handed_on, instances_of, modifiers_of
from ..instances.frames import place_extents, place_reference, place_value
from ..instances.instantiate import expand, make_instance, member_of
from ..model import Apply, Expression, Kind, Name
from ..names.classes import Class
from ..names.instance import (
    STATED,
    AnyMember,
    ComponentMember,
    Instance,
    Modifier,
    PlaceMember,
    SetShape,
    Shapes,
    Source,
    rank_of,
)
from ..names.scope import Flattening, Poisoned, Scope
from ..operands import free_names
from ..subscripts import element_name, subscripts
from ..values.evaluate import elements
from ..values.indexing import positions
from .variables import changing

_CARRIER = "frame#carrier"
_UNNAMED = "shape"


def make_shapes(member: ComponentMember) -> None:
    """Make the instances of a statement ``shape``: one, or one for each frame of a list."""
    statement, scope, declaration = member.statement, member.scope, member.declaration
    assert isinstance(statement, ast.Shape) and isinstance(declaration, ast.Component)
    owner = scope.instance
    assert owner is not None
    if statement.on is None and not _is_looked_at(owner):
        raise scope.fail(
            "E0730",
            "a shape is set on a frame",
            statement.span,
            caption="nothing carries it",
            help=f"write 'shape {statement.type}(...) on body;'; only a model of a contact of two shapes leaves it out",
        )
    cls = _class_of(scope, declaration)
    if len(cls.interface) != 1:
        raise scope.fail(
            "E0730",
            f"the shape model '{cls.name}' has {len(cls.interface) or 'no'} free frames",
            statement.span,
            labels=(defined(cls),),
            help="it has one, which 'on' gives: 'frame a;'",
        )
    carriers: Sequence[Expression | None] = [None]  # of a part that is looked at by itself
    several = False
    if statement.on is not None:
        carriers, several = _carriers(scope, statement.on)
    member.extents = (len(carriers),) if several else ()
    own = modifiers_of(declaration, cls, scope)
    for index, carrier in zip(subscripts(member.extents), carriers, strict=True):
        given = [*own, *handed_on(member, index)]
        if index:
            given = [as_element(m, member.extents, index) for m in given]
        path = element_name(member.name, index)
        if statement.label is None:
            owner.unnamed += 1
            path = owner.full_name(f"shape[{owner.unnamed}]")
        if carrier is not None:
            given.append(_frame_modifier(scope, statement, cls.interface[0], carrier))
        member.instances[index] = make_instance(scope.flattening, cls, path, owner, declaration, given)


def _is_looked_at(owner: Instance) -> bool:
    """Tell whether a part for two shapes is looked at by itself, as the model of a file."""
    shapes = [s.statement for s in owner.cls.statements if isinstance(s.statement, ast.Shape)]
    return owner.parent is None and sum(shape.on is None for shape in shapes) == 2


def _class_of(scope: Scope, declaration: ast.Component) -> Class:
    found = scope.namespace.look_up_shape(declaration.type, declaration.span)
    if found is None or not isinstance(found.definition, ast.Model):
        if scope.namespace.broken:
            raise Poisoned
        near = closest(declaration.type, known := list(dict.fromkeys(scope.namespace.shapes())))
        raise scope.fail(
            "E0203",
            f"there is no shape '{declaration.type}'",
            declaration.span,
            help=f"did you mean '{near}'?"
            if near
            else f"there is {', '.join(known)}"
            if known
            else "import some: 'import mech.shapes.*;'",
        )
    return class_in_use(scope, scope.flattening.classes.of(found.definition, found.namespace), declaration)


def defined(cls: Class) -> Label:
    """Return the label that shows where a model is defined."""
    return Label(cls.model.name_span, f"{cls.name} is defined here")


# ---------------------------------------------------------------- frames that carry shapes


def components(scope: Scope, node: ast.Reference) -> list[Instance] | None:
    """Return the components that a name means, all of an array without an index; None if it is not a name of components."""
    if scope.instance is None or node.parts[0].name in scope.local:
        return None
    at = [scope.instance]
    for part in node.parts:
        found: list[Instance] = []
        for instance in at:
            member = member_of(instance, part.name)
            if not isinstance(member, ComponentMember):
                return None
            found += _chosen(scope, member, part)
        at = found
    return at


def _chosen(scope: Scope, member: ComponentMember, part: ast.Part) -> list[Instance]:
    instances, sizes = existing(scope, member, part.span), member.extents
    if not part.indices:
        return list(instances.values())
    check_count(scope, member, part)
    chosen = [positions(scope, node, n, part.span) for node, n in zip(part.indices, sizes, strict=True)]
    single = tuple(p for p in chosen if isinstance(p, int))
    if len(single) == len(chosen):
        one = instances.get(single)
        return [] if one is None else [one]
    return [
        instance
        for index, instance in instances.items()
        if all(k == p if isinstance(p, int) else k in p for k, p in zip(index, chosen, strict=True))
    ]


def _carriers(scope: Scope, node: ast.Expression) -> tuple[Sequence[Expression], bool]:
    """Return the frames that an expression means, and whether it means a list of them; a body stands for its frame."""
    found = components(scope, node) if isinstance(node, ast.Reference) else None
    if found is not None:
        assert isinstance(node, ast.Reference)
        several = len(found) != 1 or _is_list(scope, node)
        return [_frame_of(scope, instance, node) for instance in found], several
    value = scope.elaborate(node)
    if value.type.kind is Kind.FRAME and len(value.type.shape) <= 1:
        return (elements(value), True) if value.type.shape else ([value], False)
    raise scope.fail(
        "E0730",
        "a shape is set on a frame, or on a body",
        node.span,
        caption=f"this is {types.describe(value.type)}",
        help="the place is what follows 'at', in the axes of the frame: 'on body at {1, 2} m'"
        if value.type.kind is Kind.POINT
        else "",
    )


def _is_list(scope: Scope, node: ast.Reference) -> bool:
    """Tell whether a name of components means an array, or a range of one, however many it has."""
    instance = scope.instance
    for part in node.parts:
        member = None if instance is None else member_of(instance, part.name)
        assert isinstance(member, ComponentMember)
        if len(part.indices) != len(member.extents) or any(
            isinstance(i, ast.Whole | ast.Range) for i in part.indices
        ):
            return True
        (instance,) = _chosen(scope, member, part)
    return False


def _frame_of(scope: Scope, instance: Instance, node: ast.Reference) -> Expression:
    """Return the frame of a body: the only one of its frames that something else places."""
    frames = [instance.members[name] for name in instance.cls.interface]
    if len(frames) == 1 and isinstance(frames[0], PlaceMember):
        return place_reference(frames[0], (), node.span)
    every = [name for name, member in instance.members.items() if _is_frame(member)]
    raise scope.fail(
        "E0730",
        f"'{instance.path}', a {instance.cls.name}, does not say on which of its frames",
        node.span,
        labels=(defined(instance.cls),),
        help=f"name one: {', '.join(f'{node.span.text}.{name}' for name in every[:4])}"
        if every
        else "it has no frame",
    )


def _is_frame(member: AnyMember) -> bool:
    return isinstance(member, PlaceMember) and isinstance(member.declaration, ast.Frame)


def _frame_modifier(scope: Scope, statement: ast.Shape, name: str, carrier: Expression) -> Modifier:
    """Return what connects the free frame of a shape to the frame that carries it."""
    assert statement.on is not None
    inner, span = scope.with_local({_CARRIER: carrier}), statement.on.span
    node: ast.Expression = ast.Reference(parts=(ast.Part(name=_CARRIER, span=span),), span=span)
    if statement.at is not None:
        _check_place(scope, statement.at)
        function = ast.Reference(parts=(ast.Part(name="trans", span=span),), span=span)
        shift = ast.Call(function=function, arguments=(statement.at,), span=statement.at.span)
        node = ast.Binary(operator="*", left=node, right=shift, span=span.to(statement.at.span))
    part = ast.Part(name=name, span=span)
    return Modifier((part,), "=", False, Source(node, inner), rank_of(scope, STATED), span, link=True)


def _check_place(scope: Scope, node: ast.Expression) -> None:
    value = scope.elaborate(node)
    length = types.NUMBER.dimension if scope.flattening.dimensionless else types.LENGTH
    kind, shape = value.type.kind, value.type.shape
    if (
        kind not in types.NUMERIC
        or shape not in ((2,), (3,))
        or (value.type.dimension != length and not types.is_zero(value))
    ):
        raise scope.fail(
            "E0730",
            "'at' is a place in the axes of the frame: a vector of 2 or 3 lengths",
            node.span,
            caption=f"this is {types.describe(value.type)}",
            help="write 'on' for a frame" if kind is Kind.FRAME else "",
        )


# ---------------------------------------------------------------- all of them, and their bodies


def canonical(shapes: Shapes, name: str) -> str:
    """Return the frame that a name stands for, through connections."""
    while name in shapes.frames and isinstance(value := place_value(*shapes.frames[name]), Name):
        name = value.name
    return name


def shapes_of(instance: Instance) -> Shapes:
    """Return the shapes of the whole model of which an instance is part."""
    flattening = instance.flattening
    if flattening.shapes is None:
        while instance.parent is not None:
            instance = instance.parent
        flattening.shapes = _Finder(flattening, Shapes()).collected(instance)
    return flattening.shapes


class _Finder(Struct):
    """What looks for all shapes: first for all frames, then for what holds them rigidly, then for the shapes that sit on them."""

    flattening: Flattening
    shapes: Shapes
    made: list[Instance] = field(default_factory=list)
    joints: list[tuple[Scope, ast.Place]] = field(default_factory=list)

    def collected(self, root: Instance) -> Shapes:
        shapes = self.shapes
        pending = [root]
        while pending:
            pending += reversed(self.look_into(pending.pop()))
        for name, (member, index) in shapes.frames.items():
            place_value(member, index)
            if index in member.welds:
                shapes.rigid[name] = member.welds[index][0]
        for scope, statement in self.joints:
            self.hold(scope, statement)
        for instance in self.made:
            frame = instance.members[instance.cls.interface[0]]
            assert isinstance(frame, PlaceMember)
            names = self.sits_on(place_value(frame, ()))
            body = self.body_of(names, instance.path)
            shapes.all.append(SetShape(instance, names, body, _short(instance, names)))
        counts = Counter(shape.name for shape in shapes.all)
        for shape in shapes.all:
            if counts[shape.name] > 1:
                shape.name = shape.instance.path
        return shapes

    def look_into(self, at: Instance) -> list[Instance]:
        """Note the frames, joints and shapes of an instance, and return what is in it."""
        for item in expand(at):
            if isinstance(item.statement, ast.Place):
                self.joints.append((item.scope, item.statement))
            elif isinstance(item.statement, ast.Shape) and item.made is not None:
                self.made += self.tried(item.made)
        inner: list[Instance] = []
        for member in at.members.values():
            if isinstance(member, PlaceMember) and _is_frame(member):
                for index in subscripts(place_extents(member)):
                    self.shapes.frames[element_name(member.name, index)] = member, index
            elif isinstance(member, ComponentMember) and member.statement is None:
                inner += self.tried(member)
        return inner

    def tried(self, member: ComponentMember) -> list[Instance]:
        try:
            return list(instances_of(member).values())
        except Poisoned:
            self.shapes.wrong = True
            return []

    def hold(self, scope: Scope, statement: ast.Place) -> None:
        """Note a joint without freedom as a rigid connection."""
        assert scope.instance is not None
        member = scope.instance.members.get(statement.target.parts[0].name)
        value = scope.elaborate(statement.value)
        if isinstance(member, PlaceMember) and self.sits_on(value):
            self.shapes.rigid[canonical(self.shapes, member.name)] = value

    def sits_on(self, value: Expression | None) -> tuple[str, ...]:
        """Return the names of the frames to which a frame is fixed, the nearest first."""
        names: list[str] = []
        frames = self.shapes.frames
        while value is not None:
            while isinstance(value, Apply) and value.function == "multiply":
                value, pose = value.arguments
                if self.moves(pose):
                    return tuple(names)
            if not isinstance(value, Name):
                break
            names.append(value.name)
            value = place_value(*frames[value.name]) if value.name in frames else None
        return tuple(names)

    def moves(self, pose: Expression) -> bool:
        of_frames = any(name in self.shapes.frames for name in free_names(pose))
        return of_frames or changing(self.flattening, pose) is not None

    def body_of(self, names: tuple[str, ...], otherwise: str) -> str:
        """Return the name of the rigid body of what sits on frames."""
        body, seen = names[-1] if names else otherwise, set[str]()
        while body in self.shapes.rigid and body not in seen:
            seen.add(body)
            body = self.sits_on(self.shapes.rigid[body])[-1]
        return body


def _short(instance: Instance, frames: tuple[str, ...]) -> str:
    """Return what a shape is called: by its own name, or by that of the part on whose frame it sits."""
    declaration = instance.declaration
    if declaration is None or declaration.name != _UNNAMED or not frames:
        return instance.path
    return frames[0].rpartition(".")[0] or frames[0]
