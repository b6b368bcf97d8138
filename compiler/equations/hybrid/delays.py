"""What looks back, as plain data for the kernel: which numbers are kept, and where they come again."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from msgspec.structs import replace

from mechc.lang.diagnostics import Reporter
from mechc.runtime.interface import Delay

from ...graph import Node
from ...graph.rewrite import substitute
from ...mechanics.meaning.delays import Delayed
from ...mechanics.system import MechanicalSystem
from ..model import DelayPlan, Function, Slot, origin
from ..solve.solved import Solved

ORDER = "yuzt"
"""Of the arrays of sources (``enum mech_source``)."""


def with_past(system: MechanicalSystem, solved: Solved, reporter: Reporter) -> Solved:
    """Return formulas in which what is prescribed or balanced, and so no state, is delayed by the formula that gives it."""
    graph, delays = system.graph, system.lowering.delays
    driven = [n for n, delayed in delays.found.items() if delayed.source in solved.driven]
    delays.driven |= {n: delays.found.pop(n) for n in driven}
    formulas: dict[Node, Node] = {}
    for n, delayed in delays.driven.items():
        (now,) = solved.resolve([delayed.source])
        if any(graph.name(n).startswith("guess(") for n in graph.support(now)):
            raise reporter.fail(
                "E0581",
                f"'{delayed.name}' cannot be delayed",
                delayed.span,
                caption="a nonlinear balance of forces gives it, solved from where it was, and its past is not kept",
                help="give it a mass, or let a 'state' follow it and delay that",
            )
        images = delays.images([now], delayed.delay, delayed.span, reporter)
        for symbol in images.values():
            if delays.found[symbol].source in solved.driven:
                raise reporter.fail(
                    "E0581",
                    f"'{delayed.name}' cannot be delayed",
                    delayed.span,
                    caption="the balance of forces gives it, and depends on the past itself",
                    help="give it a mass, or let a 'state' follow it and delay that",
                )
        within = set(graph.reach([now]))
        settled = map(graph.unsigned, solved.resolve(list(system.lowering.relations)))
        asked = [relation for relation in settled if relation in within]
        system.lowering.relations.update(dict.fromkeys(map(graph.unsigned, substitute(graph, asked, images))))
        (formulas[n],) = substitute(graph, [now], images)
    if not formulas:
        return solved
    known = dict(zip(solved.replace, substitute(graph, list(solved.replace.values()), formulas), strict=True))
    return replace(solved, replace={**known, **formulas})


def as_at_the_start(system: MechanicalSystem, nodes: Sequence[Node]) -> tuple[Node, ...]:
    """Return formulas at the start, where what was is what is."""
    found = system.lowering.delays.found
    return (
        tuple(substitute(system.graph, nodes, {n: d.source for n, d in found.items()}))
        if found
        else tuple(nodes)
    )


def in_order(found: Mapping[Node, Delayed]) -> list[Node]:
    """Return the symbols of what is delayed in the order in which the kernel numbers them: by their delays."""
    delays = list(dict.fromkeys(d.delay for d in found.values()))
    return sorted(found, key=lambda n: delays.index(found[n].delay))


def delay_plan(
    system: MechanicalSystem, slots: Mapping[Node, Slot]
) -> tuple[DelayPlan | None, tuple[Function, ...]]:
    """Return what the kernel is told, and the function of the delays. ``slots``: places of all numbers."""
    found = system.lowering.delays.found
    if not found:
        return None, ()
    delays = list(dict.fromkeys(d.delay for d in found.values()))
    by_delay = in_order(found)
    places = {d.source: slots[d.source] for d in found.values()}
    sources = sorted(places, key=lambda n: (ORDER.index(places[n].array), places[n].index))
    plan = DelayPlan(
        tuple((places[n].array, places[n].index) for n in sources),
        tuple(
            (slots[n].index, sources.index(found[n].source), delays.index(found[n].delay)) for n in by_delay
        ),
        tuple(
            next(Delay(d.span.text, origin(d.span)) for d in found.values() if d.delay == t) for t in delays
        ),
    )
    return plan, (Function("delay_times", "how long ago, of what looks back", tuple(delays)),)
