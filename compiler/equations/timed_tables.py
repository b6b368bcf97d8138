"""Smooth tables of time: their points, at which a run ends its steps as it does at the rows of the table of an input.

The second derivative jumps there. No method of high order steps across many of these without an error of a tolerance at each,
and where a step ends, none is made.
"""

from __future__ import annotations

from collections.abc import Sequence

from mechc.runtime.interface import TimedPoints

from ..graph import Node
from ..graph.differentiate import jvp
from ..graph.operations import JUMPING, LOOKUP, SELECT
from ..graph.rewrite import substitute
from ..mechanics.system import MechanicalSystem
from .solve.solved import Solved


def timed_tables(
    system: MechanicalSystem, solved: Solved, rates: Sequence[Node]
) -> tuple[tuple[TimedPoints, ...], tuple[Node, ...]]:
    """Return the points of the smooth tables of time that ``rates`` read, and of each table its argument at time 0 and the rate of
    that."""
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
    return tuple(timed for _, timed in points), tuple(arguments)


def _line_of_time(system: MechanicalSystem, x: Node) -> tuple[Node, Node] | None:
    """Return x at time 0 and its rate where it is linear in time and depends on nothing else that changes."""
    graph, time = system.graph, system.symbols.time
    if not {time, *(s.node for s in system.symbols.parameters)}.issuperset(graph.support(x)):
        return None
    if any(graph.op(n) in JUMPING | {SELECT} and time in graph.support(n) for n in graph.reach([x])):
        return None
    (rate,) = jvp(graph, [x], {time: graph.one})
    if graph.is_zero(rate) or time in graph.support(rate):
        return None
    (begin,) = substitute(graph, [x], {time: graph.zero})
    return begin, rate
