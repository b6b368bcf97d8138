"""Which functions may change within a small part of a step by formulas of the time, so that a run looks at them more closely.

What a step sees are its stages, and what events are looked for in is sampled a few times in each. Sums, products and waves show
themselves there; a peak or a dip of a few milliseconds does not, while nothing else makes steps short: as in a rest, which a push ends.
Nor do two kinks that lie in one step: those of formulas as ``max(0, 1 - abs(x))`` are no events.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from msgspec import Struct
from msgspec.structs import replace

from ..equations.model import Function, Slot
from ..graph import Graph, Node
from ..graph.kinks import bends_of
from ..graph.operations import (
    ABS,
    ADD,
    COS,
    DIV,
    LOOKUP,
    MAXIMUM,
    MINIMUM,
    MUL,
    NEG,
    OPERATIONS,
    POW,
    SELECT,
    SIN,
    SUB,
    SYMBOL,
)

KINKS = frozenset({ABS, MINIMUM, MAXIMUM})
"""What no event locates, where it stands in a formula; what jumps is located, and so are conditions."""

CUTS = frozenset({MINIMUM, MAXIMUM})

LINEAR = frozenset({ADD, SUB, NEG})

SUMS = frozenset({ADD, SUB, NEG, SELECT}) | {
    row.code for row in OPERATIONS if row.jumps or row.kinks or row.condition
}
"""What is as wide as its arguments are, but for kinks of the time; jumps are events of their own."""

HIGHEST = 8
"""Power of a wave that is wide still: its 40th is a row of peaks."""


class Moving(Struct, frozen=True):
    """How something depends on time: it holds the ``power`` of something, about, and is a polynomial of so high a ``degree``; that of
    waves is 0. ``straight``: it is made of pieces of straight lines, and steps end at all of its kinks."""

    power: int
    degree: int
    straight: bool = False


STILL = Moving(0, 0)


def peaks_in_time(
    graph: Graph, layout: Mapping[Node, Slot], functions: Sequence[Function], *, ends_at_lines: bool
) -> bool:
    """Whether ``functions`` may have a narrow peak at some time, by formulas of the time alone and of inputs that are such.

    ``ends_at_lines``: steps end at kinks of lines of time, and at points of tables of these. Discrete variables are constants beside it:
    they change at events. What has both the time and states in a denominator, as the inertia of a driven mechanism, is none of these.
    """
    places = {slot: n for n, slot in layout.items()}
    time = places.get(Slot("t", 0))
    if time is None:
        return False
    others = frozenset(n for n, slot in layout.items() if slot.array not in ("t", "u", "p", "z"))
    elsewhere = (
        frozenset(n for n, slot in layout.items() if slot.array not in ("t", "p")) if ends_at_lines else None
    )
    walk = _Walk(graph, others, {time: Moving(1, 1, elsewhere is not None)}, elsewhere)
    inputs = next((f.outputs for f in functions if f.name == "inputs"), ())
    if not walk.follow(inputs):
        return True
    for k, n in enumerate(inputs):
        if n in walk.moving and Slot("u", k) in places:
            walk.moving[places[Slot("u", k)]] = replace(walk.moving[n], straight=False)
    return not all(walk.follow(_within(graph, f)) for f in functions if f.name != "inputs")


def peaks_by_cuts(graph: Graph, layout: Mapping[Node, Slot], functions: Sequence[Function]) -> bool:
    """Whether the least or the largest of something may cut out a narrow part of a size or a square of states: ``max(0, 1 - abs(x))``.

    A stop, a saturation, and ``x*abs(x)`` have one kink where a straight line has none, or show on both sides what they are.
    """
    moving = {n for n, slot in layout.items() if slot.array not in ("p", "z")}
    others = {n for n in moving if layout[n].array not in ("t", "u")}
    outputs = [n for f in functions for n in f.outputs]
    if not graph.reached_with(outputs, CUTS):
        return False
    straight, humps = set(moving), set[Node]()
    for n in graph.reach_of(outputs, moving):
        if n in straight or graph.op(n) == SYMBOL:
            continue
        code, arguments = graph.op(n), graph.args(n)
        below = [a for a in arguments if a in moving]
        if not below:
            continue
        moving.add(n)
        if code in CUTS and graph.depend(humps.intersection(below), others):
            return True
        known = all(a in straight or a in humps for a in below)
        if known and (
            code in LINEAR or (code == MUL and len(below) == 1) or (code == DIV and below == [arguments[0]])
        ):
            (straight if straight.issuperset(below) else humps).add(n)
        elif straight.issuperset(below) and (code == ABS or (code in (MUL, POW) and len(set(below)) == 1)):
            humps.add(n)
    return False


def _within(graph: Graph, function: Function) -> list[Node]:
    """Give what a function is made of; of what events are looked for in what a size is taken of, as that of a force: zero of a
    size less a limit is located as well as that of the force."""
    if function.name != "indicators":
        return list(function.outputs)
    found: list[Node] = []
    seen: set[Node] = set()
    left = list(function.outputs)
    while left:
        n = left.pop()
        if n in seen:
            continue
        seen.add(n)
        code, arguments = graph.op(n), graph.args(n)
        if code in (SELECT, SUB, NEG, ABS):
            left += arguments
        else:
            found.append(n)
    return found


class _Walk:
    """From the time upwards; ``others`` are the symbols of what moves otherwise, ``elsewhere`` those that no line of time holds, None
    where steps end at no kinks of these."""

    def __init__(
        self,
        graph: Graph,
        others: frozenset[Node],
        moving: dict[Node, Moving],
        elsewhere: frozenset[Node] | None,
    ) -> None:
        self.graph = graph
        self.elsewhere = elsewhere
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
        straight = all(m.straight or not m.power for m in here)
        if code in KINKS:
            bent = Moving(power, max(degree, 2), straight=straight)
            return (
                bent
                if straight and self._ends_steps(arguments, code)
                else self._unless_alone(arguments, bent)
            )
        if code == LOOKUP and straight and self._free(arguments):
            return Moving(power, max(degree, 2))
        if code in SUMS - LINEAR:
            return Moving(power, max(degree, 2))
        if code in LINEAR:
            return Moving(power, degree, straight)
        if code in (SIN, COS):
            return Moving(power, 0)
        if code == MUL:
            uneven = all(m.power for m in here) and (here[0].degree > 0) != (here[1].degree > 0)
            times = 1 + (arguments[0] == arguments[1])
            line = straight and not all(m.power for m in here)
            return Moving(power * times, here[0].degree + here[1].degree + uneven, line)
        if code == DIV and not here[1].power:
            return here[0]
        # what has the first degree below it is a pole, no peak
        narrow = here[1].degree > 1 if code == DIV else degree > 0
        if code == POW:
            if not self.graph.is_constant(arguments[1]):
                return self._unless_alone(arguments, Moving(power, degree))
            exponent = self.graph.value(arguments[1])
            narrow = degree > 0 and exponent < 0
            power, degree = max(1, round(power * abs(exponent))), round(degree * abs(exponent))
        # what a wave is the argument of is no narrower
        return self._unless_alone(arguments, Moving(power, degree)) if narrow else Moving(power, degree)

    def _ends_steps(self, arguments: Sequence[Node], code: int) -> bool:
        """Whether steps end at the kinks of an operation on straight lines."""
        return self._free(arguments) and bends_of(self.graph, code, arguments) is not None

    def _free(self, arguments: Sequence[Node]) -> bool:
        """Whether something is of the time and of parameters alone, and steps end at kinks of such lines."""
        return self.elsewhere is not None and not self.graph.depend(arguments, self.elsewhere)

    def _unless_alone(self, arguments: Sequence[Node], found: Moving) -> Moving | None:
        """Give what was found where something else than the time takes part."""
        moved = [a for a in arguments if a in self.moving]
        return found if all(self.graph.depend((a,), self.others) for a in moved) else None
