"""Rows that can be switched: which equation determines the multiplier in each mode.

A contact or constraint obeys f (K a + gamma) + (1 - f) lam = 0 with the flag f in {0, 1}; a friction
f (K a + gamma) + (1 - f) (lam + sigma F) = 0 with the direction of slip sigma and the limit F, which may contain
multipliers and reactions, and which may be another one for each direction; a freewheel slides forwards alone. After elimination the pivot is f S + 1 - f with S > 0, so that one straight-line program
serves every mode.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from msgspec.structs import replace

from mechc.lang.diagnostics import Reporter

from ...graph import Node
from ...graph.differentiate import jacobian
from ...graph.rewrite import substitute
from ...mechanics.modes import Mode
from ...mechanics.system import MechanicalSystem
from .constraints import Row

if TYPE_CHECKING:
    from .signs import Side


def with_modes(
    system: MechanicalSystem,
    rows: Sequence[Row],
    multipliers: Sequence[Node],
    answers: dict[Node, Node],
    sides: dict[Node, Side],
) -> tuple[Row, ...]:
    """Return the rows with the equation of their modes.

    ``multipliers`` are those of all rows of the model; ``answers`` replaces questions about forces; ``sides`` of zero
    that the laws ask forces to be on are added.
    """
    graph = system.graph
    normals = {row.constraint.name: row.multiplier for row in rows}
    surfaces = frictions(rows)
    result = []
    for row in rows:
        mode = row.constraint.mode
        assert mode is not None
        off = graph.sub(graph.one, mode.flag)
        law = row.multiplier
        if mode.smooth is not None and mode.smooth.force is not None:
            result.append(replace(row, equation=graph.sub(law, mode.smooth.force)))
            continue
        if mode.kind in ("friction", "freewheel"):
            unknowns = (*system.a, *multipliers)
            kinetic = _limit_of_sliding(system, mode, normals, unknowns, answers, sides)
            side = graph.one if mode.kind == "freewheel" else _side(system, row, surfaces[row.multiplier])
            if mode.backward is None:
                law = graph.add(law, graph.mul(side, kinetic))
            else:
                other = replace(mode, kinetic=mode.backward, static=mode.static_backward)
                backward = _limit_of_sliding(system, other, normals, unknowns, answers, sides)
                ahead, behind = graph.maximum(side, graph.zero), graph.minimum(side, graph.zero)
                law = graph.add(law, graph.add(graph.mul(ahead, kinetic), graph.mul(behind, backward)))
        equation = (
            law
            if mode.smooth is not None
            else graph.add(graph.mul(mode.flag, row.second), graph.mul(off, law))
        )
        result.append(replace(row, equation=equation))
    return tuple(result)


MOST_ROWS = 64
"""Rows that the kernel decides over at an instant: ``MECH_MOST_ROWS``, compared by a test."""


def check_count(rows: Sequence[Row], reporter: Reporter) -> None:
    """Report more rows that switch than a run could decide over, before their equations are solved."""
    switching = [
        row for row in rows if row.constraint.mode is not None and row.constraint.mode.smooth is None
    ]
    if len(switching) <= MOST_ROWS:
        return
    raise reporter.fail(
        "E0720",
        f"the model has {len(switching)} rows of contacts, friction and constraints that switch, more than {MOST_ROWS}",
        switching[MOST_ROWS].constraint.origin.shown,
        caption=f"number {MOST_ROWS + 1} comes from here",
        help="a run decides over all of them at once: replace some by potentials, or by friction with "
        'law = "regularized"; friction on a surface has two rows',
    )


def frictions(rows: Sequence[Row]) -> dict[Node, list[Row]]:
    """Return, by the multiplier of each row, the rows of the friction it belongs to: two where it acts on a surface."""
    by_contact: dict[str, list[Row]] = {}
    for row in rows:
        if row.constraint.mode is not None and row.constraint.mode.contact:
            by_contact.setdefault(row.constraint.mode.contact, []).append(row)
    return {
        row.multiplier: by_contact.get(row.constraint.mode.contact, [row]) if row.constraint.mode else [row]
        for row in rows
    }


def _side(system: MechanicalSystem, row: Row, surface: Sequence[Row]) -> Node:
    """Return the part of the limit that acts against a slip in the direction of a row.

    On a surface it is (s + z)/|s + z| as long as the slip s goes on at all along z, which comes from the kernel: a
    direction that the slip had a little before, with the size of no speed at all, so that a slip that begins has a
    direction. Behind s = 0 it stays z/|z|, so that a step that passes the end of a slip sees a law as smooth as that
    of one component. It is 0 where nothing slides.
    """
    graph, mode = system.graph, row.constraint.mode
    assert mode is not None and mode.sign is not None
    if mode.smooth is not None:
        return mode.smooth.side
    if len(surface) == 1:
        return mode.sign
    along = graph.zero
    directions = []
    for r in surface:
        assert r.constraint.mode is not None and r.constraint.mode.sign is not None
        along = graph.add(along, graph.mul(r.constraint.mode.sign, r.rate))
        directions.append((r.rate, r.constraint.mode.sign))
    ahead = graph.less(graph.zero, along)
    square = begun = graph.zero
    for rate, sign in directions:
        slip = graph.add(graph.select(ahead, rate, graph.zero), sign)
        square = graph.add(square, graph.mul(slip, slip))
        begun = graph.add(begun, graph.mul(sign, sign))
    part = graph.add(graph.select(ahead, row.rate, graph.zero), mode.sign)
    return graph.select(graph.less(graph.zero, begun), graph.div(part, graph.sqrt(square)), graph.zero)


def limits(
    system: MechanicalSystem, mode: Mode, normals: Mapping[str, Node], answers: Mapping[Node, Node]
) -> tuple[Node, Node]:
    """Return the largest forces while sliding and while sticking."""
    graph = system.graph
    assert mode.kinetic is not None and mode.static is not None
    kinetic, static = substitute(graph, [mode.kinetic, mode.static], answers)
    if mode.contact:
        normal = normals[mode.contact]
        kinetic, static = graph.mul(kinetic, normal), graph.mul(static, normal)
    return kinetic, static


def _limit_of_sliding(
    system: MechanicalSystem,
    mode: Mode,
    normals: Mapping[str, Node],
    unknowns: Sequence[Node],
    answers: dict[Node, Node],
    sides: dict[Node, Side],
) -> Node:
    """Return the limit in accelerations and multipliers where it is affine in them.

    Otherwise it keeps the symbols of answers about forces, and gets one for the normal force, which is added to
    ``answers``: a law of its own (solve/force_laws.py).
    """
    from .signs import take_sides

    graph = system.graph
    asked = dict(sides)
    plain, _ = limits(system, mode, normals, answers)
    plain = take_sides(graph, plain, unknowns, asked)
    (derivatives,) = jacobian(graph, [plain], unknowns)
    if set(unknowns).isdisjoint(graph.support(*derivatives.values())):
        sides |= asked
        return plain
    named = {name: graph.symbol(f"?normal {name}") for name in normals if name == mode.contact}
    answers |= {symbol: normals[name] for name, symbol in named.items()}
    return limits(system, mode, {**normals, **named}, {})[0]


def friction_loss(system: MechanicalSystem, rows: Sequence[Row]) -> Node:
    """Return the power that friction turns into heat: -lam s."""
    graph = system.graph
    total = graph.zero
    for row in rows:
        mode = row.constraint.mode
        if mode is not None and mode.kind in ("friction", "freewheel"):
            total = graph.sub(total, graph.mul(row.multiplier, row.rate))
    return total
