"""The kinematic graph: which joint places which frame, and which joints close loops.

Free frames are nodes, joints are edges. Rigid connections hold frames together before any joint does, as they have no
freedom: they are edges of the tree unless connections alone form a loop. The spanning tree grows from ``world`` in the
order of declaration; joints marked ``cut`` and joints between what the tree holds already are closures. Decided from
names alone, before any formula exists, because the coordinates of a closure are not unknowns.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping

from msgspec import Struct

from mechc.lang.diagnostics import Reporter

from ...flat.model import Apply, Array, Definition, Element, Expression, FlatModel, Joint, Name
from ...flat.operands import free_names

WORLD = "world"


class TreeEdge(Struct, frozen=True):
    """``joint`` places the free frame ``root``; ``backwards``: from its ``to`` side to its ``from`` side."""

    joint: Joint
    root: str
    backwards: bool


class Topology(Struct, frozen=True):
    """``tree`` in the order in which frames get placed; ``closures`` in the order of declaration."""

    tree: tuple[TreeEdge, ...]
    closures: tuple[Joint, ...]

    @property
    def dropped(self) -> frozenset[str]:
        """Names of the coordinates that closures would have had."""
        return frozenset(name for joint in self.closures for name in joint.coordinates)


def root_of(expression: Expression, definitions: Mapping[str, Definition]) -> str | None:
    """Return the free frame (or ``world``) that a frame expression hangs on."""
    seen: set[str] = set()
    while True:
        match expression:
            case Name(name=name):
                if name == WORLD or name in seen or name not in definitions:
                    return name if name == WORLD else None
                seen.add(name)
                value = definitions[name].value
                if value is None:
                    return name
                expression = value
            case Apply(function="multiply", arguments=arguments):
                expression = arguments[0]
            case Element(base=Name(name=name), indices=indices) if name in definitions:
                value = definitions[name].value
                for i in indices:
                    if not isinstance(value, Array):
                        return None
                    value = value.elements[i]
                if value is None:
                    return None
                expression = value
            case Element(base=Array(elements=items), indices=(i, *_)):
                expression = items[i]
            case _:
                return None


def classify(model: FlatModel, reporter: Reporter) -> Topology:
    """Return the spanning tree and the closures of a model; report bodies that nothing connects to ``world``."""
    definitions = {d.name: d for d in model.definitions}
    ends = {j.name: _ends(j, definitions) for j in model.joints}
    for joint in model.joints:
        _check_not_to_itself(joint, *ends[joint.name], reporter)
    held = _Held()
    closing = {joint.name for joint in model.joints if joint.cut}
    connections: set[str] = set()
    for joint in _connections(model, definitions):
        (connections if held.join(*ends[joint.name]) else closing).add(joint.name)
    waiting = [j for j in model.joints if j.name not in closing]
    placed, reached = {WORLD}, {held.by(WORLD)}
    tree: list[TreeEdge] = []
    while waiting:
        left: list[Joint] = []
        for joint in waiting:
            source, target = ends[joint.name]
            if joint.name not in connections and {held.by(source), held.by(target)} <= reached:
                closing.add(joint.name)
            elif source in placed and target is not None:
                placed.add(target)
                reached.add(held.by(target))
                tree.append(TreeEdge(joint, target, backwards=False))
            elif target in placed and source is not None:
                placed.add(source)
                reached.add(held.by(source))
                tree.append(TreeEdge(joint, source, backwards=True))
            else:
                left.append(joint)
        if len(left) == len(waiting):
            break
        waiting = left
    _report_floating(model, definitions, placed, reporter)
    return Topology(tuple(tree), tuple(j for j in model.joints if j.name in closing))


class _Held:
    """What rigid connections hold together: each free frame stands for itself, or for the frames joined with it."""

    def __init__(self) -> None:
        self._by: dict[str, str] = {}

    def by(self, frame: str | None) -> str | None:
        """Return the frame that stands for all that are held together with ``frame``."""
        while frame in self._by:
            frame = self._by[frame]
        return frame

    def join(self, source: str | None, target: str | None) -> bool:
        """Hold two frames together; return False if they are already."""
        first, second = self.by(source), self.by(target)
        if first is None or second is None:
            return True
        if first == second:
            return False
        self._by[second] = first
        return True


def _connections(model: FlatModel, definitions: Mapping[str, Definition]) -> Iterator[Joint]:
    """Yield the joints that have neither freedoms nor equations of their own, nor a pose that follows another joint."""
    moving = {name for joint in model.joints for name in joint.coordinates}
    for joint in model.joints:
        if not (
            joint.cut or joint.coordinates or joint.closures or _depends(joint.value, moving, definitions)
        ):
            yield joint


def _depends(expression: Expression, wanted: Collection[str], definitions: Mapping[str, Definition]) -> bool:
    """Tell whether an expression mentions one of the wanted names, be it through definitions."""
    pending, seen = [expression], set[str]()
    while pending:
        for name in free_names(pending.pop()):
            if name in wanted:
                return True
            definition = definitions.get(name)
            if name not in seen and definition is not None and definition.value is not None:
                seen.add(name)
                pending.append(definition.value)
    return False


def _ends(joint: Joint, definitions: Mapping[str, Definition]) -> tuple[str | None, str | None]:
    def end(name: str) -> str | None:
        if name == WORLD:
            return WORLD
        definition = definitions.get(name)
        if definition is None:
            return None
        return name if definition.value is None else root_of(definition.value, definitions)

    return (root_of(joint.value, definitions) if not joint.source else end(joint.source)), end(joint.target)


def _check_not_to_itself(joint: Joint, source: str | None, target: str | None, reporter: Reporter) -> None:
    if source == target and source not in (None, WORLD):
        reporter.error(
            "E0511",
            f"joint '{joint.name}' connects a body to itself",
            joint.origin.shown,
            caption=f"both sides belong to '{source}'",
            help="connect two different bodies, or a body and 'world'",
        )


def _report_floating(
    model: FlatModel, definitions: Mapping[str, Definition], placed: set[str], reporter: Reporter
) -> None:
    used: dict[str, str] = {}
    for mass in model.masses:
        used.setdefault(root_of(mass.at, definitions) or "", "mass")
    for inertia in model.inertias:
        used.setdefault(root_of(inertia.on, definitions) or "", "inertia")
    for name, what in used.items():
        definition = definitions.get(name)
        if definition is None or name in placed:
            continue
        owner = definition.origin.instance or name
        reporter.error(
            "E0512",
            f"nothing connects '{owner}' to world",
            definition.origin.shown,
            caption=f"its {what} is on the frame '{name}', which no joint places",
            help=f"add a joint that leads to it, as in 'Revolute pin(world -> {name});', or a Free joint",
        )
