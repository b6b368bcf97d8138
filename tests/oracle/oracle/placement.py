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

    Rigid connections come before all others.
    """
    placed, edges, backwards, loops = {"world"}, {}, set(), []
    waiting = sorted(joints, key=lambda joint: bool(joint.cut or joint.coordinates or joint.closures))
    while waiting:
        for joint in waiting:
            source, target = (
                base(joint.value, definitions),
                base(definitions[joint.target].value or _name(joint), definitions),
            )
            if joint.cut or (source in placed and target in placed):
                if not joint.coordinates and not joint.closures:
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
