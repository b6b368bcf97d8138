"""States of first order on which the motion does not depend: integrals that nothing reads, filters of what is measured.

They follow the motion, and a displacement of them changes nothing else: an integral grows where the model rests, and has the
multiplier 1 of every orbit. Studies of the motion leave them out.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from ..graph import Node
from ..graph.operations import SYMBOL
from .model import Equations, Slot

MOVING = ("project_position", "project_velocity", "constraints", "row_values", "respond")
"""Functions beside the rates of coordinates and velocities that decide how these move."""

Reads = dict[Slot, set[Slot]]
"""What each number of the state, and each one that changes at events, becomes by."""


def followers(equations: Equations) -> tuple[int, ...]:
    """Return the indices in y of states that no coordinate and no velocity depends on, directly or through others.

    States that act on themselves or on each other and depend on no coordinate move by themselves: they follow nothing. Where there
    are not coordinates, the motion is theirs alone; where no state acts on itself, nothing follows.
    """
    states = [Slot("y", i) for i, entry in enumerate(equations.states) if entry.kind == "state"]
    if (
        not states
        or equations.curve is not None
        or any(entry.kind == "tangent" for entry in equations.states)
    ):
        return ()
    moving = equations.nq + equations.nv
    reads, decided = _reads(equations), _decided(equations)
    decided |= {Slot("y", i) for i in range(moving)}
    needed = _needed(reads, decided) | _independent_states(reads, moving) if moving else _returning(reads)
    if not needed.intersection(states) and not moving:
        return ()
    return tuple(slot.index for slot in states if slot not in needed)


def _named(equations: Equations) -> Mapping[str, tuple[Node, ...]]:
    return {f.name: f.outputs for f in equations.functions}


def _places(equations: Equations, nodes: Iterable[Node]) -> set[Slot]:
    """Return the states and discrete variables that formulas contain."""
    found = (equations.layout[n] for n in equations.graph.support(*nodes))
    return {slot for slot in found if slot.array in "yz"}


def _decided(equations: Equations) -> set[Slot]:
    """Return what constraints, contacts and friction read."""
    functions, hybrid = _named(equations), equations.switching
    nodes = [n for name in MOVING for n in functions.get(name, ())]
    if hybrid is not None:
        nodes += functions.get("indicators", ())[len(hybrid.switches) :]
        if hybrid.crowd is not None:
            nodes += [n for name in hybrid.crowd.results(equations.nv) for n in functions.get(name, ())]
    return _places(equations, nodes)


def _reads(equations: Equations) -> Reads:
    functions, hybrid = _named(equations), equations.switching
    reads: Reads = {}

    def read(target: Slot, nodes: Iterable[Node]) -> None:
        reads.setdefault(target, set()).update(_places(equations, nodes))

    rates, moving = functions.get("rhs", ()), equations.nq + equations.nv
    # what one of them reads, the motion needs: they are asked together
    motion = _places(equations, rates[:moving])
    for i, rate in enumerate(rates):
        if i < moving:
            reads[Slot("y", i)] = set(motion)
        else:
            read(Slot("y", i), [rate])
    if hybrid is None:
        return reads
    indicators, conditions = functions.get("indicators", ()), functions.get("conditions", ())
    for switch, indicator in zip(hybrid.switches, indicators, strict=False):
        read(Slot("z", switch.index), [indicator])
    crossings = functions.get("crossing_times", ())
    for switch, crossing in zip(hybrid.times, crossings, strict=False):
        read(Slot("z", switch.index), [crossing])
    for clock, crossing in zip(hybrid.clocks, crossings[len(hybrid.times) :], strict=True):
        for place in clock:
            read(Slot("z", place), [crossing])
    arrays = [("y", len(equations.states)), ("z", len(equations.discretes))]
    targets = [Slot(array, i) for array, size in arrays for i in range(size)]
    for k, branch in enumerate(hybrid.branches):
        asked = [conditions[j] for j in range(k + 1) if hybrid.branches[j].event == branch.event]
        for target, node in zip(targets, functions[branch.function], strict=False):
            if not _is(equations, node, target):
                read(target, [node, *asked])
    return reads


def _is(equations: Equations, node: Node, place: Slot) -> bool:
    """Tell whether a formula is the number of a place itself."""
    return equations.graph.op(node) == SYMBOL and equations.layout[node] == place


def _needed(reads: Reads, places: set[Slot]) -> set[Slot]:
    """Return some places and everything that these depend on."""
    found, waiting = set(places), list(places)
    while waiting:
        new = reads.get(waiting.pop(), set()) - found
        found |= new
        waiting += new
    return found


def _independent_states(reads: Reads, moving: int) -> set[Slot]:
    """Return the states that move by themselves, with everything that they depend on: none of it is a coordinate or velocity."""
    motion = {Slot("y", i) for i in range(moving)}
    found: set[Slot] = set()
    for state in _returning(reads) - motion:
        depends = _needed(reads, {state})
        if motion.isdisjoint(depends):
            found |= depends
    return found


def _returning(reads: Reads) -> set[Slot]:
    """Return the states that act on themselves, directly or through others, and everything that these depend on."""
    between = {place: read for place, read in reads.items() if place.array == "z"}
    states = {
        place: {other for other in _needed(between, read) if other.array == "y" and other in reads}
        for place, read in reads.items()
        if place.array == "y"
    }
    readers = dict.fromkeys(states, 0)
    for read in states.values():
        for place in read:
            readers[place] += 1
    waiting = [place for place, count in readers.items() if not count]
    left = set(states)
    while waiting:  # what nothing reads, then what nothing else read
        place = waiting.pop()
        left.discard(place)
        for other in states[place]:
            readers[other] -= 1
            if not readers[other]:
                waiting.append(other)
    return left
