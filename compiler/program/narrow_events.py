"""Which functions may change within a small part of a step by formulas of the time, so that a run looks at them more closely.

What a step sees are its stages, and what events are looked for in is sampled a few times in each. Sums, products and waves show
themselves there; a peak or a dip of a few milliseconds does not, while nothing else makes steps short: as in a rest, which a push ends.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from msgspec import Struct

from ..equations.model import Function, Slot
from ..graph import Graph, Node
from ..graph.operations import ADD, COS, DIV, MUL, NEG, OPERATIONS, POW, SELECT, SIN, SUB, SYMBOL

SUMS = frozenset({ADD, SUB, NEG, SELECT}) | {
    row.code for row in OPERATIONS if row.jumps or row.kinks or row.condition
}
"""What is as wide as its arguments are; jumps and kinks are events of their own."""

HIGHEST = 8
"""Power of a wave that is wide still: its 40th is a row of peaks."""


class Moving(Struct, frozen=True):
    """How something depends on time: it holds the ``power`` of something, about, and is a polynomial of so high a ``degree``; that of
    waves is 0."""

    power: int
    degree: int


STILL = Moving(0, 0)


def peaks_in_time(graph: Graph, layout: Mapping[Node, Slot], functions: Sequence[Function]) -> bool:
    """Whether ``functions`` may have a narrow peak at some time, by formulas of the time alone and of inputs that are such.

    What has both the time and states in a denominator, as the inertia of a driven mechanism, is none of these.
    """
    places = {slot: n for n, slot in layout.items()}
    time = places.get(Slot("t", 0))
    if time is None:
        return False
    others = frozenset(n for n, slot in layout.items() if slot.array not in ("t", "u", "p"))
    walk = _Walk(graph, others, {time: Moving(1, 1)})
    inputs = next((f.outputs for f in functions if f.name == "inputs"), ())
    if not walk.follow(inputs):
        return True
    for k, n in enumerate(inputs):
        if n in walk.moving and Slot("u", k) in places:
            walk.moving[places[Slot("u", k)]] = walk.moving[n]
    return not all(walk.follow(f.outputs) for f in functions if f.name != "inputs")


class _Walk:
    """From the time upwards; ``others`` are the symbols of what moves otherwise."""

    def __init__(self, graph: Graph, others: frozenset[Node], moving: dict[Node, Moving]) -> None:
        self.graph = graph
        self.others = others
        self.moving = moving

    def follow(self, outputs: Sequence[Node]) -> bool:
        """Add how all that depends on what is moving does so; False where something may be narrow."""
        graph, moving = self.graph, self.moving
        if not graph.depend(outputs, moving.keys()):
            return True
        for n in graph.reach_of(outputs, moving):
            arguments = () if n in moving or graph.op(n) == SYMBOL else graph.args(n)
            here = [moving.get(a, STILL) for a in arguments]
            if not any(m.power for m in here):
                continue
            found = self._result(graph.op(n), arguments, here)
            if found is None or found.power > HIGHEST:
                return False
            moving[n] = found
        return True

    def _result(self, code: int, arguments: Sequence[Node], here: Sequence[Moving]) -> Moving | None:
        """Tell how the result of an operation moves; None where it may be narrow."""
        power, degree = max(m.power for m in here), max(m.degree for m in here)
        if code in SUMS:
            return Moving(power, degree)
        if code in (SIN, COS):
            return Moving(power, 0)
        if code == MUL:
            return Moving(power * (1 + (arguments[0] == arguments[1])), here[0].degree + here[1].degree)
        bent = (
            here[1].degree > 1 if code == DIV else degree > 0
        )  # what has the first degree below it is a pole, no peak
        if code == POW:
            if not self.graph.is_constant(arguments[1]):
                return self._unless_alone(arguments, Moving(power, degree))
            exponent = self.graph.value(arguments[1])
            bent = degree > 0 and exponent < 0
            power, degree = max(1, round(power * abs(exponent))), round(degree * abs(exponent))
        # what a wave is the argument of is no narrower
        return self._unless_alone(arguments, Moving(power, degree)) if bent else Moving(power, degree)

    def _unless_alone(self, arguments: Sequence[Node], found: Moving) -> Moving | None:
        """Give what was found where something else than the time takes part."""
        moved = [a for a in arguments if a in self.moving]
        return found if all(self.graph.depend((a,), self.others) for a in moved) else None
