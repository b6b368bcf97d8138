"""Loads that rigid bodies do not determine: what rows that depend on each other carry beside their forces in the present modes.

In the modes some rows hold, and others, which rest beside them, carry nothing (``hybrid/``). Questions about forces are answered
by the share of the least sum of squares, which numbers find (``shares.h`` of the kernel): of each row that may share, z has a place
for what that adds to its force. The motion reads none of it; where it follows a force, that is one of the modes, and nothing
is shared.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from msgspec import Struct
from msgspec.structs import replace

from mechc.lang.diagnostics import Reporter
from mechc.lang.units import parse_unit

from ...flat.model import Query
from ...graph import Graph, Node
from ...graph.evaluate import evaluate
from ...graph.rewrite import substitute
from ...mechanics.defaults import default_values
from ...mechanics.system import MechanicalSystem
from ..model import Function, HybridPlan, Slot
from ..rows.constraints import Row

NONE = 1e-9
"""Part of a row in what depends on others that is rounding."""


class Share(Struct, frozen=True):
    """Numbers in z. ``rests``: 1 where a row touches, or sticks, and others carry its part; ``beside``: what it carries beside its force in
    the modes. Forces of rows of one ``sort`` have one unit."""

    rests: Node
    beside: Node
    sort: str


def shares_of(
    system: MechanicalSystem,
    rows: Sequence[Row],
    switched: Sequence[Row],
    free: Sequence[int],
    fixed: Mapping[Node, Node],
) -> dict[Node, Share]:
    """Return what rows that may depend on each other share, by their multipliers; ``rows`` always hold.

    Rows that are independent in general share nothing: where they depend on each other all the same, as in a position
    that is singular, those that stand first in the text carry the load.
    """
    if len(switched) < 2 or not any(_tells(system, query) for query in system.queries.values()):
        return {}
    graph = system.graph
    sorts = {row.constraint.name: _sort(row) for row in switched}
    shared: dict[Node, Share] = {}
    for row in _dependent(system, rows, switched, free, fixed):
        name, mode = row.constraint.name, row.constraint.mode
        assert mode is not None
        title = name if len(row.constraint.residuals) == 1 else f"{name} {row.component}"
        rests, beside = (graph.symbol(f"{what}({title})") for what in ("rests", "share"))
        shared[row.multiplier] = Share(rests, beside, sorts[mode.contact or name])
    return shared


def follows(
    system: MechanicalSystem,
    shared: Mapping[Node, Share],
    asked: Sequence[Node],
    answers: Mapping[Node, Node],
) -> bool:
    """Tell whether the motion follows one of these forces, by the answers that its equations ask for."""
    return not shared.keys().isdisjoint(system.graph.support(*(answers[n] for n in asked)))


def told(
    system: MechanicalSystem, shared: Mapping[Node, Share], switched: Sequence[Row], answers: Sequence[Node]
) -> list[Node]:
    """Return answers to questions about forces, and about what is closed, with what is shared."""
    graph = system.graph
    put: dict[Node, Node] = {n: graph.add(n, share.beside) for n, share in shared.items()}
    for row in switched:
        mode, share = row.constraint.mode, shared.get(row.multiplier)
        if mode is not None and share is not None:
            put[mode.flag] = graph.logical_or(put.get(mode.flag, mode.flag), share.rests)
    return substitute(graph, answers, put)


def undefined(graph: Graph, shares: Mapping[Node, Node], formula: Node) -> Node:
    """Return what is added to derivatives of a formula that reads shares: not a number where one of them is at work, else 0.

    ``shares``: what tells whether a row rests on others, by the symbols of what it carries.
    """
    read, added = set(graph.support(formula)) if shares else set(), graph.zero
    for beside, rests in shares.items():
        if beside in read:
            nothing = graph.sqrt(graph.sub(graph.minus_one, graph.mul(rests, rests)))
            added = graph.add(added, graph.select(rests, nothing, graph.zero))
    return added


def shares_in(switching: HybridPlan | None, layout: Mapping[Node, Slot]) -> dict[Node, Node]:
    """Return what tells whether a row rests on others, by the symbols of what it carries beside its force."""
    shares = [share for share in switching.shares if share.beside >= 0] if switching is not None else []
    places = {slot: n for n, slot in layout.items()} if shares else {}
    return {places[Slot("z", share.beside)]: places[Slot("z", share.rests)] for share in shares}


def check_derivatives(
    graph: Graph,
    switching: HybridPlan | None,
    layout: Mapping[Node, Slot],
    functions: Sequence[Function],
    what: str,
) -> None:
    """Report functions of which ``what`` takes derivatives, and that read shares: numbers find these. Raises CompileError."""
    if switching is None or not switching.shares:
        return
    places = {share.beside: k for k, share in enumerate(switching.shares)}
    for n in graph.support(*(n for function in functions for n in function.outputs)):
        slot = layout.get(n)
        if slot is not None and slot.array == "z" and slot.index in places:
            row = switching.rows[places[slot.index]]
            raise Reporter().fail(
                "E0729",
                f"{what} needs the derivative of how '{row.name}' and others share a load, which has no formula",
                row.span,
                caption="rigid bodies may not determine its force, and numbers find the share that is told",
                help="ask for it in an output, or let one of the bodies be elastic",
            )


def _tells(system: MechanicalSystem, query: Query) -> bool:
    return query.function == "closed" or system.lowering.questions.is_force(query)


def _sort(row: Row) -> str:
    """Return the dimension of energy over force."""
    dimension = parse_unit(row.constraint.units[row.component] or "1").dimension
    return str(dimension if row.constraint.level == "position" else dimension * parse_unit("s").dimension)


def _dependent(
    system: MechanicalSystem,
    rows: Sequence[Row],
    switched: Sequence[Row],
    free: Sequence[int],
    fixed: Mapping[Node, Node],
) -> list[Row]:
    """Return rows that may share, with the frictions of contacts among them."""
    import numpy as np

    from mechc.runtime.numerics.rank import null_space

    from ..rows.rank import rank

    modes = {row.multiplier: mode for row in switched if (mode := row.constraint.mode) is not None}
    smooth = {mode.contact for mode in modes.values() if mode.smooth is not None}
    able = {
        n
        for n, mode in modes.items()
        if mode.kind != "freewheel" and mode.smooth is None and mode.static_backward is None
    }
    able -= {row.multiplier for row in switched if row.constraint.name in smooth}
    every = [*rows, *(replace(row, position=None) for row in switched)]
    values = _numbers(system, every, fixed)
    dependent: set[int] | None = None
    for place in rank(system, every, free, values).places:
        size = np.linalg.norm(place.matrix, axis=1)
        if not np.isfinite(size).all():
            continue
        moved = place.matrix / np.where(size > 0.0, size, 1.0)[:, None]
        null = null_space(moved.T, NONE)  # combinations that move nothing
        found = {
            k for k in np.flatnonzero(np.abs(null).max(axis=1, initial=0.0) > NONE).tolist() if size[k] > 0.0
        }
        dependent = found if dependent is None else dependent & found
    found_rows = [every[k] for k in dependent or () if k >= len(rows) and every[k].multiplier in able]
    names = {row.constraint.name for row in found_rows}
    # both directions of a friction have one limit, which goes with the load of the contact
    touching = names | {
        contact for row in found_rows if (contact := modes[row.multiplier].contact) is not None
    }
    return [
        row
        for row in switched
        if row.multiplier in able
        and (row.constraint.name in touching or modes[row.multiplier].contact in touching)
    ]


def _numbers(system: MechanicalSystem, rows: Sequence[Row], fixed: Mapping[Node, Node]) -> dict[Node, float]:
    """Return numbers for everything that rates of rows may read: default values, and 0 for what is found later."""
    graph = system.graph
    values = default_values(system)
    known = {n: f for n, f in fixed.items() if values.keys() >= set(graph.support(f))}
    values |= zip(known, evaluate(graph, list(known.values()), values), strict=True)
    read = graph.support(*(n for row in rows for n in (row.rate, row.position or row.rate)), *system.qdot)
    return {**dict.fromkeys(read, 0.0), **values}
