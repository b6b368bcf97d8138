"""Relations between moving quantities as switches: constant between events, each with an event indicator.

A relation a < b of a formula that depends on the state, inputs or time becomes a number s in z, 1 where it holds, and
the indicator g = a - b; s changes only at events. Where g is an affine function of time alone, the time of the event is
known. A relation of parameters and discrete variables alone stays as it is: these change at events only, and so do piecewise
constant numbers. Integer parts of moving quantities are switches of the same kind.

The integer part of x is constant between events, which occur where x is an integer. As steps end at every integer,
one bit identifies the interval around x: whether its lower end is odd. That bit is the switch; the integer part
follows from it and from x, and stays the same for half a unit beyond either end, so that it does not matter on which side
of an integer rounding leaves x.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Mapping, Sequence
from fractions import Fraction
from typing import TYPE_CHECKING

from msgspec import Struct

from ...graph import DivisionByZero, Graph, Node
from ...graph import operations as ops
from ...graph.differentiate import jvp, vjp
from ...graph.rewrite import substitute
from ...mechanics.system import MechanicalSystem

if TYPE_CHECKING:
    from ..rows.signs import Side

UNSEEN = ops.JUMPING | {ops.SELECT}
"""Operations that a derivative does not see jump."""


class SwitchPlan(Struct, frozen=True):
    """``indicator``: g, and ``rate`` dg/dt or zero where it is not known; ``text`` says what is compared.

    ``written``: g in the coordinates and rates that the user wrote, of which total derivatives are known. ``leads``: it turns before
    others are asked.
    """

    symbol: Node
    indicator: Node
    rate: Node
    written: Node
    text: str
    leads: bool = False


class TimeSwitch(Struct, frozen=True):
    """Becomes ``after`` at the time ``crossing``."""

    symbol: Node
    crossing: Node
    after: int
    text: str


class Switches(Struct, frozen=True):
    """``replace`` takes the place of relations in formulas."""

    located: tuple[SwitchPlan, ...]
    timed: tuple[TimeSwitch, ...]
    replace: Mapping[Node, Node]

    def apply(self, system: MechanicalSystem, nodes: Sequence[Node]) -> tuple[Node, ...]:
        return tuple(substitute(system.graph, nodes, self.replace))


def find_switches(
    system: MechanicalSystem,
    resolve: Mapping[Node, Node],
    formulas: Iterable[Node],
    further: Iterable[Node],
    fixed: frozenset[Node],
    sides: Sequence[Side],
    left: Collection[Node] = (),
) -> Switches:
    """Return the switches of all relations that ``formulas`` contain, and of all ``sides`` of forces.

    ``resolve`` turns what the user wrote into formulas of array entries; ``further`` are relations that the user did
    not write; ``fixed`` are the symbols that change at events only; ``left`` are relations that stay as they stand.
    """
    graph = system.graph
    lowering = system.lowering
    written = sorted(
        (n for n in lowering.relations if n not in left), key=lambda n: n not in lowering.leading
    )
    settled = map(graph.unsigned, system.lowering.questions.settle(written))  # as in what is differentiated
    relations = [*written, *(n for n, m in zip(settled, written, strict=True) if n != m), *further]
    if not relations and not sides:
        return Switches((), (), {})
    images = substitute(graph, relations, resolve)
    reached = set(graph.reach(list(formulas)))
    time = system.symbols.time
    inputs = [s.node for s in system.symbols.inputs]
    steady = {n for n in inputs if resolve.get(system.rate(n)) == graph.zero}
    unknown = (
        {*system.queries, *system.a, *system.unknown_rates, *inputs} - steady - set(map(system.rate, steady))
    )
    located: list[SwitchPlan] = []
    timed: list[TimeSwitch] = []
    made: dict[tuple[Node, Node], Node] = {}
    replace: dict[Node, Node] = {}

    def locate(symbol: Node, g: Node, written: Node, text: str, leads: bool) -> None:
        known = unknown.isdisjoint(graph.support(written))
        rate = system.rate(written) if known else graph.zero
        (rate,) = substitute(graph, [rate], resolve)
        if set(graph.support(rate)) & set(system.unknown_rates):
            rate = graph.zero
        located.append(SwitchPlan(symbol, g, rate, written, text, leads))

    for relation, found in zip(relations, images, strict=True):
        image = graph.unsigned(found)  # the sign of what is the negative of its formula
        if image not in reached or image in replace:
            continue
        leads = relation in system.lowering.leading
        support = set(graph.support(image))
        if support <= fixed:
            continue
        x, pairs = stair(graph, image), compared(graph, image)
        if x is not None:
            if not _moves(graph, x, support - fixed):
                continue
            symbol = made.get((x, x))
            if symbol is None:
                symbol = made[x, x] = graph.symbol(f"switch({len(made) + 1})")
                written_x = stair(graph, relation) or x
                what = "point of table" if relation in system.lowering.tables.points else "whole part"
                locate(symbol, evenness(graph, x), evenness(graph, written_x), f"{what} {len(made)}", leads)
            replace[image] = frozen(graph, image, x, symbol)
            continue
        if pairs is None or not _moves(graph, graph.sub(*pairs[:2]), support - fixed):
            continue
        (a, b, negated), (below, above, _) = pairs, compared(graph, relation) or pairs
        below, above = (above, below) if image != found else (below, above)
        symbol = made.get((a, b))
        if symbol is None:
            symbol = made[a, b] = graph.symbol(f"switch({len(made) + 1})")
            g, text = graph.sub(a, b), system.lowering.leading.get(relation) or _text(graph, below, above)
            text = text or f"comparison {len(made)}"
            crossing = _crossing(system, g, support - fixed <= {time})
            if crossing is not None:
                timed.append(TimeSwitch(symbol, crossing[0], crossing[1], text))
            else:
                locate(symbol, g, graph.sub(below, above), text, leads)
        if graph.op(image) == ops.SIGN:
            replace[image] = graph.select(symbol, graph.minus_one, graph.one)
        else:
            replace[image] = graph.logical_not(symbol) if negated else symbol
    differences = substitute(graph, [side.difference for side in sides], resolve)
    for k, (side, difference) in enumerate(zip(sides, differences, strict=True)):
        text = f"side of force {k + 1}"
        located.append(SwitchPlan(side.symbol, difference, graph.zero, side.difference, text))
    return Switches(tuple(located), tuple(timed), replace)


def _text(graph: Graph, below: Node, above: Node) -> str | None:
    """Return a comparison as people would write it, None where it is long."""
    from ...graph.show import short_formula

    longest = 40
    left, right = (short_formula(graph, n, longest) for n in (below, above))
    return f"{left} < {right}" if left and right else None


def relations_of_time(
    system: MechanicalSystem, rates: Sequence[Node], resolve: Mapping[Node, Node]
) -> list[Node]:
    """Return what the rates of constraints ask of time alone, as where max(0, f(time)) bends: they jump there."""
    graph, known = system.graph, {system.symbols.time, *(s.node for s in system.symbols.parameters)}
    inside = _inside_unknowns(system, resolve)
    asked = [n for n in graph.reach(rates) if compared(graph, n) is not None and n not in inside]
    return [n for n in asked if known.issuperset(graph.support(n))]


def jumps_of_forces(
    system: MechanicalSystem,
    rates: Sequence[Node],
    resolve: Mapping[Node, Node],
    written: Collection[Node],
    *,
    of_energies: bool,
) -> list[Node]:
    """Return what derivatives ask where the ``rates`` of the motion jump: the signs in the force of a dissipation c*abs(v) and,
    ``of_energies``, of a potential k*abs(x).

    A motion may slide along such a jump, and no step across it would end. Where both sides agree, as those of abs(v)^3 do
    at rest, and where they are singular, nothing is asked, nor what is ``written`` by the user, nor by what solves laws of
    forces, which ``resolve`` puts instead of answers about them.
    """
    graph, symbols = system.graph, system.symbols
    energy = graph.sub(graph.add(system.kinetic, system.lagrangian), system.potential)
    velocities = sorted(symbols.velocities)
    laws = vjp(graph, [(system.dissipation, graph.one)], velocities)
    if of_energies:
        laws += vjp(graph, [(energy, graph.one)], [*(s.node for s in system.q), *velocities])
    inside = _inside_unknowns(system, {})
    compares = [n for n in graph.reach(laws) if compared(graph, n) is not None and n not in inside]
    resolved = map(graph.unsigned, substitute(graph, compares, resolve))
    images = dict(zip(compares, resolved, strict=True))
    felt = set(graph.reached_among(rates, list(images.values()))).difference(written)
    moving = symbols.positions | symbols.velocities
    return [
        n
        for n, there in images.items()
        if there in felt and not moving.isdisjoint(graph.support(there)) and _jumps(graph, there, rates)
    ]


def _inside_unknowns(system: MechanicalSystem, resolve: Mapping[Node, Node]) -> set[Node]:
    """Return what Newton's method compares to find what equations determine, and the signs in its derivatives."""
    graph = system.graph
    found = substitute(graph, list(system.lowering.unknowns.found), resolve)
    return {n for n in graph.reach(found) if compared(graph, n) is not None}


def _jumps(graph: Graph, relation: Node, formulas: Sequence[Node]) -> bool:
    """Tell whether formulas feel a relation where both sides are equal."""
    pairs = compared(graph, relation)
    assert pairs is not None
    a, b = pairs[:2]
    moved, other = (b, a) if graph.is_constant(a) else (a, b)
    answer = graph.symbol("answer")
    try:
        there = substitute(graph, formulas, {moved: other, relation: answer})
    except DivisionByZero:
        return False
    return answer in graph.support(*there)


def _moves(graph: Graph, x: Node, symbols: Collection[Node]) -> bool:
    """Tell whether x changes between events."""
    return not all(map(graph.is_zero, vjp(graph, [(x, graph.one)], list(symbols))))


def compared(graph: Graph, relation: Node) -> tuple[Node, Node, bool] | None:
    """Return (a, b, negated) so that the relation is a < b, or its negation."""
    match graph.op(relation):
        case ops.LESS:
            a, b = graph.args(relation)
            return a, b, False
        case ops.LESS_EQUAL:
            a, b = graph.args(relation)
            return b, a, True
        case ops.SIGN:
            return graph.args(relation)[0], graph.zero, False
        case _:
            return None


def _crossing(system: MechanicalSystem, g: Node, of_time: bool) -> tuple[Node, int] | None:
    """Return the time at which g = slope (t - T) vanishes and the value of g < 0 from then on."""
    graph, time = system.graph, system.symbols.time
    if not of_time or any(graph.op(n) in UNSEEN and time in graph.support(n) for n in graph.reach([g])):
        return None
    (slope,) = jvp(graph, [g], {time: graph.one})
    if not graph.is_constant(slope) or graph.is_zero(slope):
        return None
    (start,) = substitute(graph, [g], {time: graph.zero})
    return graph.neg(graph.div(start, slope)), int(graph.value(slope) < 0)


EARLY = Fraction(1, 10**14)
"""A whole number counts as reached by this much before, so that one that is met exactly is reached."""


def stair(graph: Graph, n: Node) -> Node | None:
    """Return x where ``n`` jumps with the whole part of x: floor(x), or the rest of a division."""
    match graph.op(n):
        case ops.FLOOR:
            return graph.args(n)[0]
        case ops.MODULO:
            return graph.div(*graph.args(n))
        case _:
            return None


def evenness(graph: Graph, x: Node) -> Node:
    """Return a smooth formula that is not negative where the whole part of x is even, and negative where it is odd."""
    two = graph.constant(2)
    turn = graph.sub(x, graph.mul(two, graph.floor(graph.div(x, two))))  # exact, however large x is
    return graph.sin(graph.mul(graph.constant(Fraction(math.pi)), graph.add(turn, graph.constant(EARLY))))


def frozen(graph: Graph, n: Node, x: Node, odd: Node) -> Node:
    """Return ``n`` with the whole part of x that has the parity ``odd``, 0 or 1."""
    two, shifted = graph.constant(2), graph.sub(x, odd)
    near = graph.floor(graph.div(graph.add(shifted, graph.half), two))
    whole = graph.add(odd, graph.mul(two, near))
    if graph.op(n) == ops.FLOOR:
        return whole
    a, b = graph.args(n)
    return graph.sub(a, graph.mul(b, whole))
