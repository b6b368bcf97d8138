"""Smooth tables of time, and kinks of lines of time such as ``max(0, time - t0)``: their points, at which a run ends its steps as it does
at the rows of the table of an input.

The second derivative of a table jumps there. No method of high order steps across many of these without an error of a tolerance at each,
and where a step ends, none is made.
"""

from __future__ import annotations

from collections.abc import Sequence, Set

from mechc.runtime.interface import TimedPoints

from ..graph import Graph, Node
from ..graph.differentiate import jvp
from ..graph.kinks import bends_of
from ..graph.operations import ABS, JUMPING, LOOKUP, MAXIMUM, MINIMUM, SELECT
from ..graph.rewrite import substitute
from ..mechanics.system import MechanicalSystem
from .solve.solved import Solved


def timed_tables(
    system: MechanicalSystem, solved: Solved, rates: Sequence[Node]
) -> tuple[tuple[TimedPoints, ...], tuple[Node, ...]]:
    """Return the points of the smooth tables of time and the kinks of lines of time that ``rates`` read, and of each its argument at
    time 0 and the rate of that."""
    graph, turning = system.graph, system.lowering.tables.turning
    read = {graph.table_of(n)[0] for n in graph.reach(rates) if graph.op(n) == LOOKUP} if turning else ()
    points, arguments = dict[tuple[Node, TimedPoints], None](), list[Node]()
    for one in turning:
        (x,) = solved.resolve([one.x])
        key = x, TimedPoints(one.points, one.bends, one.periodic)
        line = _line_of_time(system, x) if one.table in read and key not in points else None
        if line is not None:
            points[key] = None
            arguments += line
    for x in _kinks(graph, rates, _known(system), system.symbols.time):
        line = _line_of_time(system, x)
        if line is not None and (x, KINK) not in points:
            points[x, KINK] = None
            arguments += line
    return tuple(timed for _, timed in points), tuple(arguments)


KINK = TimedPoints((0.0,), (1.0,))


def _kinks(graph: Graph, rates: Sequence[Node], known: Set[Node], time: Node) -> list[Node]:
    """Return what is zero where sizes, least and largest values of time and of what is ``known`` may bend."""
    if not graph.reached_with(rates, {ABS, MINIMUM, MAXIMUM}):
        return []
    kept, timed = set(known), {time}
    kinks = list[Node]()
    for n in graph.reach(rates):
        args = graph.args(n)
        if args and all(a in kept or graph.is_constant(a) for a in args):
            kept.add(n)
            if not timed.isdisjoint(args):
                timed.add(n)
                if graph.op(n) in (ABS, MINIMUM, MAXIMUM):
                    kinks.append(n)
    return [x for n in kinks for x in bends_of(graph, graph.op(n), graph.args(n)) or ()]


def _line_of_time(system: MechanicalSystem, x: Node) -> tuple[Node, Node] | None:
    """Return x at time 0 and its rate where it is linear in time and depends on nothing else that changes."""
    graph, time = system.graph, system.symbols.time
    if not _known(system).issuperset(graph.support(x)):
        return None
    if any(graph.op(n) in JUMPING | {SELECT} and time in graph.support(n) for n in graph.reach([x])):
        return None
    (rate,) = jvp(graph, [x], {time: graph.one})
    if graph.is_zero(rate) or time in graph.support(rate):
        return None
    (begin,) = substitute(graph, [x], {time: graph.zero})
    return begin, rate


def _known(system: MechanicalSystem) -> set[Node]:
    return {system.symbols.time, *(s.node for s in system.symbols.parameters)}
