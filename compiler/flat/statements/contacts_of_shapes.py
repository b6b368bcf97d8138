"""Contacts of shapes, as by ``contact crate with floor friction 0.5;``: the pairs, and the part of a library that each of them is.

A part for two shapes is a model that leaves two shapes open: ``model BallOnPlane shape one: Plane; shape other: Sphere; ...``. It is
looked for in what the statement may use, and where the shapes are defined. What follows ``friction`` and ``restitution`` modifies it;
the options of a contact are those of the contacts in it, and others modify it, too.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence

from msgspec import Struct

from mechc.lang import ast
from mechc.lang.diagnostics import Label
from mechc.lang.source import Span

from .. import types
from ..expressions.references import find_label
from ..instances.components import handed_on, instances_of
from ..instances.instantiate import make_instance
from ..instances.pair_loops import FEW
from ..model import Expression, Kind, Name
from ..names.classes import Class, component_of
from ..names.instance import (
    STATED,
    ComponentMember,
    ElaborationProgress,
    Instance,
    Modifier,
    SetShape,
    Shapes,
    Source,
    rank_of,
)
from ..names.namespace import Namespace
from ..names.scope import Poisoned, Scope
from ..values.evaluate import elements
from .contact_families import PairsOfShapes, kind_of_shape, numbers_in
from .loads import CONTACT_OPTIONS
from .set_shapes import canonical, components, defined, make_shapes, shapes_of

APART = 8
"""So few shapes of an array may each be one side of a family: walls on an array of frames differ in numbers."""


def make(member: ComponentMember) -> None:
    """Make the instances of a ``shape``, or of a contact of shapes that has a name."""
    if isinstance(member.statement, ast.Shape):
        make_shapes(member)
        return
    pairs = [pair for pair, _ in _pairs(member)]
    member.extents = (len(pairs),) if len(pairs) > 1 else ()
    for k, pair in enumerate(pairs):
        index = (k,) if member.extents else ()
        member.instances[index] = pair.connect(member, _path(member.name, index), handed_on(member, index))


def made_by(member: ComponentMember) -> list[tuple[Instance, PairsOfShapes | None]]:
    """Return what a statement makes; contacts without a name are called by their shapes, ``ball[2]-floor``. Of more than a few
    of one kind there is one, with the pairs that it stands for."""
    if isinstance(member.statement, ast.ContactOfShapes) and member.statement.label is None:
        return [(pair.connect(member, pair.name, []), family) for pair, family in _pairs(member)]
    return [(instance, None) for instance in instances_of(member).values()]


def _path(name: str, index: tuple[int, ...]) -> str:
    """Return the name of one of several pairs: ``c[2]``, or ``c[1,2]`` where the name has an index."""
    if not index:
        return name
    return f"{name[:-1]},{index[0] + 1}]" if name.endswith("]") else f"{name}[{index[0] + 1}]"


# ---------------------------------------------------------------- pairs


class _Part(Struct, frozen=True, eq=False):
    """A model of a contact, and the names that it has for its two shapes."""

    cls: Class
    free: tuple[ast.Shape, ast.Shape]


class _Pair(Struct, frozen=True, eq=False):
    """Two shapes, in the order in which a part wants them."""

    part: _Part
    shapes: tuple[SetShape, SetShape]
    name: str

    def connect(self, member: ComponentMember, path: str, given: list[Modifier]) -> Instance:
        """Return the part as a component that knows both shapes."""
        statement, scope, declaration = member.statement, member.scope, member.declaration
        assert isinstance(statement, ast.ContactOfShapes) and isinstance(declaration, ast.Component)
        told = {"friction": statement.friction, "restitution": statement.restitution}
        values = [(name, node) for name, node in told.items() if node is not None]
        options = [o for o in statement.options if o.name not in CONTACT_OPTIONS]
        values += [(option.name, option.value) for option in options]
        modifiers = [
            Modifier(
                (ast.Part(name=name, span=node.span),),
                "=",
                False,
                Source(node, scope),
                rank_of(scope, STATED),
                node.span,
            )
            for name, node in values
        ]
        cls = self.part.cls
        instance = make_instance(
            scope.flattening, cls, path, scope.instance, declaration, [*modifiers, *given]
        )
        instance.pair = True
        instance.options = tuple((o, scope) for o in statement.options if o.name in CONTACT_OPTIONS)
        for free, shape in zip(self.part.free, self.shapes, strict=True):
            known = component_of(free)
            instance.members[known.name] = ComponentMember(
                known,
                Scope(scope.flattening, instance, cls.namespace),
                shape.instance.path,
                progress=ElaborationProgress.DONE,
                statement=free,
                instances={(): shape.instance},
            )
        return instance


def _pairs(member: ComponentMember) -> list[tuple[_Pair, PairsOfShapes | None]]:
    """Return the pairs of a statement: of each shape of one side with each of the others, but for those of one rigid body. Of a
    family there is one."""
    statement, scope = member.statement, member.scope
    assert isinstance(statement, ast.ContactOfShapes) and scope.instance is not None
    shapes = shapes_of(scope.instance)
    first = _shapes_of(scope, shapes, statement.of)
    others = list(dict.fromkeys(s for node in statement.others for s in _shapes_of(scope, shapes, node)))
    known: dict[tuple[int, int], tuple[_Part, bool]] = {}
    number = {id(s): k for k, s in enumerate(shapes.all)}
    sought = [(number[id(b)], b, b.body, id(b.instance.cls)) for b in others]
    touching, span = scope.flattening.touching, statement.span
    rows: list[tuple[SetShape, list[SetShape]]] = []
    for a in first:
        touched: list[SetShape] = []
        one, body, cls = number[id(a)], a.body, id(a.instance.cls)
        for other, b, its_body, its_cls in sought:
            if body == its_body:
                continue
            key = one * len(number) + other if one < other else other * len(number) + one
            before = len(touching)
            if touching.setdefault(key, span) is not span:
                raise _touch_already(scope, span, touching[key], a, b)
            if len(touching) == before:  # this statement has it
                continue
            if (cls, its_cls) not in known:
                known[cls, its_cls] = _part_for(scope, statement, a.instance.cls, b.instance.cls)
            touched.append(b)
        rows.append((a, touched))
    place = _places((*first, *others))
    families = _families(scope, statement, rows, place)
    pairs: list[tuple[_Pair, PairsOfShapes | None]] = []
    for a, touched in rows:
        of = {p: families.get((place[id(a)], p)) for p in {place[id(b)] for b in touched}}
        for b in touched:
            family = of[place[id(b)]]
            if family is not None and (family.pair[0] is not a or family.pair[1] is not b):
                continue
            part, turned = known[id(a.instance.cls), id(b.instance.cls)]
            pairs.append((_Pair(part, (b, a) if turned else (a, b), f"{a.name}-{b.name}"), family))
    if not pairs:
        raise scope.fail(
            "E0733",
            "no two of these shapes can touch: all are fixed to one another",
            statement.span,
            labels=tuple(
                Label(s.instance.made_at, f"on the body of '{s.body}'")
                for s in (first[0], others[-1])
                if s.instance.made_at is not None
            ),
        )
    return pairs


def _places(shapes: Iterable[SetShape]) -> dict[int, int]:
    """Return a number of where each shape is stated, by their identities: the same for all of an array, if it is more than a few."""
    stated = {id(s): s.instance.made_at for s in shapes}
    many = {place for place, n in Counter(stated.values()).items() if n > APART}
    numbers: dict[object, int] = {}
    return {s: numbers.setdefault(place if place in many else s, len(numbers)) for s, place in stated.items()}


def _families(
    scope: Scope,
    statement: ast.ContactOfShapes,
    rows: list[tuple[SetShape, list[SetShape]]],
    place: Mapping[int, int],
) -> dict[tuple[int, int], PairsOfShapes]:
    """Return the pairs that one formula may tell, by ``place``, where their shapes are stated: so many that it pays."""
    found: dict[tuple[int, int], PairsOfShapes] = {}
    if scope.flattening.each_pair or statement.label is not None:
        return found
    of: dict[tuple[int, int], list[tuple[SetShape, list[SetShape]]]] = {}
    for a, touched in rows:
        by_statement: dict[int, list[SetShape]] = {}
        for b in touched:
            by_statement.setdefault(place[id(b)], []).append(b)
        for number, many in by_statement.items():
            of.setdefault((place[id(a)], number), []).append((a, many))
    told = (statement.friction, statement.restitution, *(option.value for option in statement.options))
    for places, own in of.items():
        row = max(range(len(own)), key=lambda k: (len(own[k][1]), -k))
        ones, columns = [a for a, _ in own], own[row][1]
        starts = [len(columns) - len(many) for _, many in own]
        if sum(len(many) for _, many in own) <= FEW:
            continue
        if any(columns[start:] != many for start, (_, many) in zip(starts, own, strict=True)):
            continue
        kinds = [{kind_of_shape(s.instance) for s in side} for side in (ones, columns)]
        if any(len(kind) > 1 or None in kind for kind in kinds):
            continue
        common = numbers_in([scope.elaborate(node) for node in told if node is not None])
        if len(columns) > 1:
            heads, labels = [f"{a.name}-" for a in ones], [b.name for b in columns]
            pair = ones[row], columns[-1]
        else:  # one thing with each of many
            heads, labels = [""], [f"{a.name}-{columns[0].name}" for a in ones]
            pair = ones[-1], columns[0]
            ones, columns, row, starts = columns, ones, 0, [0]
        found[places] = PairsOfShapes(
            *(pair, row, tuple(ones), tuple(heads), tuple(starts), tuple(columns), tuple(labels), common)
        )
    return found


def _touch_already(scope: Scope, span: Span, before: Span, a: SetShape, b: SetShape) -> Poisoned:
    """Return what tells of a pair that another statement has, too: one of them would count twice."""
    return scope.fail(
        "E0733",
        f"{_called(a)} and {_called(b)} have a contact already",
        span,
        labels=(Label(before, "stated here"),),
        help="name only shapes, bodies or elements of an array that have none yet",
    )


def _called(shape: SetShape) -> str:
    """Return what a message calls a shape: ``the Sphere 'ball.shape[1]' on 'ball.a'``."""
    instance = shape.instance
    on = f" on '{shape.frames[0]}'" if shape.frames else ""
    return f"the {instance.cls.name} '{instance.path}'{on}"


# ---------------------------------------------------------------- whose shapes


def _shapes_of(scope: Scope, shapes: Shapes, node: ast.Reference) -> list[SetShape]:
    """Return the shapes that a name means: a shape, those of a part with all in it, or those on a frame."""
    found = list(_named(scope, shapes, node))
    if not found:
        if shapes.wrong:
            raise Poisoned
        raise scope.fail(
            "E0731",
            f"'{node.span.text}' has no shape",
            node.span,
            help=f"set one on it, as in 'shape Sphere(r = 1 cm) on {node.span.text};'",
        )
    return found


def _named(scope: Scope, shapes: Shapes, node: ast.Reference) -> Iterator[SetShape]:
    parts = components(scope, node)
    if parts is not None:
        chosen = {id(instance) for instance in parts}
        within = tuple(f"{instance.path}." for instance in parts)
        return (
            s
            for s in shapes.all
            if id(s.instance) in chosen
            or s.instance.path.startswith(within)
            or any(name.startswith(within) for name in s.frames)
        )
    label = find_label(scope, node)
    if label is not None and label.kind == "shape" and label.made is not None:
        chosen = {id(instance) for instance in instances_of(label.made).values()}
        return (s for s in shapes.all if id(s.instance) in chosen)
    frames = {canonical(shapes, name) for name in _frames(scope, node)}
    return (s for s in shapes.all if not frames.isdisjoint(s.frames))


def _frames(scope: Scope, node: ast.Reference) -> list[str]:
    value: Expression = scope.elaborate(node)
    if value.type.kind is Kind.FRAME and len(value.type.shape) <= 1:
        every = elements(value) if value.type.shape else [value]
        return [frame.name for frame in every if isinstance(frame, Name)]
    raise scope.fail(
        "E0731",
        "a contact is between shapes, or between parts or frames that have some",
        node.span,
        caption=f"this is {types.describe(value.type)}",
    )


# ---------------------------------------------------------------- the part for a pair


def _part_for(scope: Scope, statement: ast.ContactOfShapes, a: Class, b: Class) -> tuple[_Part, bool]:
    """Return the part for two shapes and whether it wants them in the other order: that for the most special ones, the nearest."""
    ranked: list[tuple[int, int, _Part, bool]] = []
    for tier, offer in _offers(scope, (a, b), ({"shape"}, a.kinds, b.kinds)):
        one, other = offer.wanted
        for turned, (first, second) in enumerate(((a, b), (b, a))):
            steps = first.lineage.get(id(one)), second.lineage.get(id(other))
            if steps[0] is not None and steps[1] is not None:
                cls = scope.flattening.classes.of(offer.model, offer.namespace)
                if not cls.broken:
                    ranked.append((steps[0] + steps[1], tier, _Part(cls, offer.free), bool(turned)))
                break
    if not ranked:
        offers = (offer.wanted for _, offer in _offers(scope, (a, b), ({"shape"},)))
        every = [" with ".join(sorted((one.name, other.name))) for one, other in offers]
        raise scope.fail(
            "E0732",
            f"there is no contact of a {a.name} with a {b.name}",
            statement.span,
            labels=(defined(a), defined(b)) if a is not b else (defined(a),),
            help=f"there is {', '.join(dict.fromkeys(every))}; a part for others is a model with "
            f"'shape one: {a.name}; shape other: {b.name};'"
            if every
            else f"write a model with 'shape one: {a.name}; shape other: {b.name};' and their contact",
        )
    best = min(ranked, key=lambda one: one[:2])
    equal = {id(one[2].cls): one[2].cls for one in ranked if one[:2] == best[:2]}
    if len(equal) > 1:
        raise scope.fail(
            "E0732",
            f"there are several contacts of a {a.name} with a {b.name}",
            statement.span,
            labels=tuple(defined(cls) for cls in equal.values()),
            help="import the one that is meant by its name",
        )
    return best[2], best[3]


class _Offer(Struct, frozen=True, eq=False):
    """A model that leaves two shapes open, and the shape models that it wants there."""

    model: ast.Model
    namespace: Namespace
    free: tuple[ast.Shape, ast.Shape]
    wanted: tuple[ast.Model, ast.Model]


def _offers(
    scope: Scope, shapes: tuple[Class, Class], words: Sequence[Collection[str]]
) -> Iterator[tuple[int, _Offer]]:
    """Yield the models in reach that leave two shapes open, of the library those whose text has a word of each of ``words``; the number
    says how far they are."""
    seen: set[int] = set()
    places: list[tuple[int, Namespace]] = [(0, scope.namespace)]
    places += [(3, cls.namespace) for cls in shapes]
    for further, place in places:
        for tier, model, namespace in place.models_in_reach(words):
            if id(model) in seen:
                continue
            seen.add(id(model))
            free = tuple(s for s in model.body if isinstance(s, ast.Shape) and s.on is None and s.label)
            if len(free) != 2 or model.partial:
                continue
            inside = namespace.inside(model.body)
            wanted = [inside.look_up_shape(s.type, s.span) for s in free]
            models = [w.definition for w in wanted if w is not None and isinstance(w.definition, ast.Model)]
            if len(models) == 2:
                yield tier + further, _Offer(model, namespace, (free[0], free[1]), (models[0], models[1]))
