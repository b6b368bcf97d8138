"""Where frames are: the tree that joints span, and the loops that they close (language, section 9)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from mechc.compiler.flat import model as flat
from oracle.values import NotCovered

Definitions = Mapping[str, flat.Definition]


@dataclass(frozen=True)
class Tree:
    """``edges``: by the name of the free frame that they place; ``backwards`` those that place their `from` side."""

    edges: dict[str, flat.Joint]
    backwards: frozenset[str]
    loops: tuple[flat.Joint, ...]


def base(e: flat.Expression, definitions: Definitions) -> str:
    """The free frame, or world, on which a frame is built."""
    match e:
        case flat.Name(name="world"):
            return "world"
        case flat.Name(name=name):
            value = definitions[name].value
            return name if value is None else base(value, definitions)
        case flat.Apply(function="multiply", arguments=(first, _)):
            return base(first, definitions)
    raise NotCovered(f"a frame by {type(e).__name__}")


def span(joints: tuple[flat.Joint, ...], definitions: Definitions) -> Tree:
    """In the order of declaration, joints place what is not placed; the others, and those cut, close loops.

    Rigid connections come before all others, but for those whose pose follows a joint.
    """
    moving = frozenset(x for joint in joints for x in joint.coordinates)

    def early(joint: flat.Joint) -> bool:
        return connects(joint) and not mentions(joint.value, moving, definitions)

    placed, edges, backwards, loops = {"world"}, {}, set(), []
    waiting = sorted(joints, key=lambda joint: not early(joint))
    while waiting:
        for joint in waiting:
            source, target = (
                base(joint.value, definitions),
                base(definitions[joint.target].value or _name(joint), definitions),
            )
            if joint.cut or (source in placed and target in placed):
                if early(joint):
                    raise NotCovered("connections that form a loop among themselves")
                loops.append(joint)
            elif source in placed:
                edges[target] = joint
                placed.add(target)
            elif target in placed:
                edges[source] = joint
                backwards.add(joint.name)
                placed.add(source)
            else:
                continue
            waiting.remove(joint)
            break
        else:
            raise NotCovered("joints that hang on nothing")
    return Tree(edges, frozenset(backwards), tuple(loops))


def connects(joint: flat.Joint) -> bool:
    """Whether a joint has neither freedoms nor equations of its own."""
    return not (joint.cut or joint.coordinates or joint.closures)


def mentions(e: object, names: frozenset[str], definitions: Definitions) -> bool:
    """Whether an expression asks for one of some names, be it through others."""
    if isinstance(e, flat.Name):
        value = definitions[e.name].value if e.name in definitions else None
        return e.name in names or (value is not None and mentions(value, names, definitions))
    if isinstance(e, tuple):
        return any(mentions(x, names, definitions) for x in e)
    return isinstance(e, flat.Typed) and any(
        mentions(getattr(e, field), names, definitions) for field in e.__struct_fields__
    )


def _name(joint: flat.Joint) -> flat.Name:
    return flat.Name(span=joint.origin.span, type=flat.Type(flat.Kind.FRAME), name=joint.target)


def sides(joint: flat.Joint, definitions: Definitions) -> tuple[str, ...]:
    """The names by which the joint itself knows its `to` side."""

    def follow(name: str) -> str:
        value = definitions[name].value if name in definitions else None
        return follow(value.name) if isinstance(value, flat.Name) else name

    end = follow(joint.target)
    own = [d for d in definitions if d.startswith(f"{joint.name}.") and "." not in d[len(joint.name) + 1 :]]
    return tuple(d for d in own if definitions[d].role is flat.DefinitionRole.FRAME and follow(d) == end)
