"""Rows that can be switched, as the search for events sees them: eight values each, and what must stay positive."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from msgspec.structs import replace

from ...graph import Graph, Node
from ...graph.differentiate import jvp
from ...graph.rewrite import substitute
from ...mechanics.modes import Mode
from ...mechanics.system import MechanicalSystem
from ..rows.constraints import Row
from ..rows.modes import limits
from ..solve.solved import Solved

TURN = 0.5
"""A slide on a surface is looked at where its slip has turned by an angle with this cosine, or ends."""

UNFELT = 1e-4
"""Slip that counts as none where others hold a friction, as a share of what drives bring into it: beside what is driven along, polynomials
of steps err by less."""

RowValues = Mapping[Node, tuple[Node, ...]]
"""The eight values of each row, by its multiplier."""


def row_values(
    system: MechanicalSystem, solved: Solved, row: Row, normals: Mapping[str, Node], *, stepped: bool = False
) -> tuple[Node, ...]:
    """Return the eight values of a row in the order of the kernel (``mech_row_value``). ``stepped``: with those that steps which
    solve for contacts ask for."""
    graph, mode = system.graph, row.constraint.mode
    assert mode is not None
    zero = graph.zero
    velocities = {system.v[i].node: system.v[i].node for i in solved.free}
    (along,) = jvp(graph, [row.rate], velocities)
    drift = graph.sub(row.rate, along)
    gap = row.position if row.position is not None else zero
    limit = coefficient = extra = zero
    force = row.multiplier
    if (
        mode.kind == "freewheel"
    ):  # for the kernel a contact that always touches, whose force is what is left before it gives way
        _, held = limits(system, mode, normals, {})
        force = graph.add(force, held)
        assert mode.restitution is not None and mode.rest is not None
        coefficient, extra = mode.restitution, mode.rest
    elif (
        mode.kind == "friction" and mode.static_backward is not None
    ):  # the force about the middle of the limits
        _, forward = limits(system, mode, normals, {})
        (backward,) = substitute(graph, [mode.static_backward], {})
        limit = graph.mul(graph.half, graph.add(forward, backward))
        force = graph.add(force, graph.mul(graph.half, graph.sub(forward, backward)))
    elif mode.kind == "friction":
        _, limit = limits(system, mode, normals, {})
        if mode.contact:
            assert mode.kinetic is not None and mode.static is not None
            coefficient, extra = mode.static, mode.kinetic
    elif mode.kind == "contact":
        assert mode.restitution is not None and mode.rest is not None
        coefficient, extra = mode.restitution, mode.rest
    if stepped and mode.kind == "friction" and not mode.contact:
        coefficient, extra = _limits_of_steps(system, mode, normals)
    return solved.resolve([gap, row.rate, drift, row.second, force, limit, coefficient, extra])


def _limits_of_steps(system: MechanicalSystem, mode: Mode, normals: Mapping[str, Node]) -> tuple[Node, Node]:
    """Return the largest forces of a friction against a motion forwards and against one backwards, as it sticks or slides now."""
    graph = system.graph
    other = replace(mode, kinetic=mode.backward, static=mode.static_backward)
    sides = [limits(system, m, normals, {}) for m in (mode, other if mode.backward is not None else mode)]
    forward, backward = (graph.select(mode.flag, static, kinetic) for kinetic, static in sides)
    return forward, backward


def indicator(
    system: MechanicalSystem, row: Row, surface: Sequence[Row], values: RowValues
) -> tuple[Node, Node]:
    """Return what stays positive in the present mode of a row, and its rate where it is known.

    ``surface``: the rows of the friction that the row belongs to; ``values`` by the multiplier of each row.
    """
    graph, mode = system.graph, row.constraint.mode
    assert mode is not None
    gap, rate, drift, second, force, limit, _, _ = values[row.multiplier]
    zero = graph.zero
    match mode.kind:
        case "contact":
            found = graph.select(mode.flag, force, gap), graph.select(mode.flag, zero, rate)
        case "freewheel":
            found = graph.select(mode.flag, force, rate), graph.select(mode.flag, zero, second)
        case "friction" if len(surface) == 2:
            return _on_surface(system, row, surface, values)
        case "friction":
            assert mode.sign is not None
            margin = graph.sub(limit, graph.abs(force))
            slips = graph.mul(mode.sign, rate)
            if not graph.is_zero(drift):
                slides = graph.less(zero, graph.abs(mode.sign))
                slips = graph.select(slides, slips, _unheld(graph, [rate], [drift]))
            found = (
                graph.select(mode.flag, margin, slips),
                graph.select(mode.flag, zero, graph.mul(mode.sign, second)),
            )
        case _:
            return graph.one, zero
    if mode.enabled is not None:
        return graph.select(mode.enabled, found[0], graph.one), graph.select(mode.enabled, found[1], zero)
    return found


def _unheld(graph: Graph, rates: Sequence[Node], drifts: Sequence[Node]) -> Node:
    """Return what falls below zero where what neither sticks by itself nor slides, as others hold it, is moved by what is driven."""
    size, driven = (_size(graph, parts) for parts in (rates, drifts))
    return graph.minimum(graph.zero, graph.sub(graph.mul(graph.constant(UNFELT), driven), size))


def _size(graph: Graph, parts: Sequence[Node]) -> Node:
    if len(parts) == 1:
        return graph.abs(parts[0])
    square = graph.zero
    for part in parts:
        square = graph.add(square, graph.mul(part, part))
    return graph.sqrt(square)


def _on_surface(
    system: MechanicalSystem, row: Row, surface: Sequence[Row], values: RowValues
) -> tuple[Node, Node]:
    """Return the indicator of friction on a surface with its first row.

    It is about s.z/|z| - |s|/2, which falls below zero where the slip s has turned away from z, and s.z/|z| where s
    is less than z, so that a slip that keeps its direction ends at s = 0.
    """
    graph, zero = system.graph, system.graph.zero
    if row is not surface[0]:
        return graph.one, zero
    begun = along = change = force = square = growth = sticks = limit = zero
    rates, drifts = [], []
    for r in surface:
        mode = r.constraint.mode
        assert mode is not None and mode.sign is not None
        _, rate, drift, second, part, limit, _, _ = values[r.multiplier]
        rates.append(rate)
        drifts.append(drift)
        begun = graph.add(begun, graph.mul(mode.sign, mode.sign))
        along = graph.add(along, graph.mul(mode.sign, rate))
        change = graph.add(change, graph.mul(mode.sign, second))
        square = graph.add(square, graph.mul(rate, rate))
        growth = graph.add(growth, graph.mul(rate, second))
        force = graph.add(force, graph.mul(part, part))
        sticks = graph.add(sticks, mode.flag)
    slides, stuck = graph.less(zero, begun), graph.less(zero, sticks)
    size, speed = graph.sqrt(begun), graph.sqrt(graph.add(square, begun))
    turn = graph.constant(TURN)
    left = graph.sub(graph.div(along, size), graph.mul(turn, graph.sub(speed, size)))
    rate = graph.sub(graph.div(change, size), graph.mul(turn, graph.div(growth, speed)))
    margin = graph.sub(limit, graph.sqrt(force))
    unheld = zero if all(graph.is_zero(n) for n in drifts) else _unheld(graph, rates, drifts)
    return (
        graph.select(stuck, margin, graph.select(slides, left, unheld)),
        graph.select(stuck, zero, graph.select(slides, rate, zero)),
    )
