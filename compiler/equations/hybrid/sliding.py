"""Sliding along the place where a law of first-order states jumps, by the convex combination of both sides (Filippov).

Where both sides lead onto a surface g = 0, the motion goes on along it: with the shares 1 - a and a of the laws where g > 0 and
g < 0, so that g stays. With the rates r+ and r- of g on its sides, a = r+/(r+ - r-). The mode is one more switch. Its indicator is |g|
with the rate r+ - r- < 0 where both sides lead to it, so that the kernel turns it where the switch of g has turned at
zero, and then a (a - 1), so that it ends where a leaves 0 to 1.
A. F. Filippov, Differential Equations with Discontinuous Righthand Sides (1988), section 4.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence

from msgspec import Struct
from msgspec.structs import replace

from ...graph import Node
from ...graph.rewrite import substitute
from ...mechanics.system import MechanicalSystem
from .switches import Switches, SwitchPlan


class SlidingSurface(Struct, frozen=True):
    """``switch`` tells the sides apart, ``mode`` is that of sliding between them; ``share`` of the law where g < 0."""

    switch: SwitchPlan
    mode: SwitchPlan
    share: Node


def with_sliding(
    system: MechanicalSystem, switches: Switches, states: Collection[Node]
) -> tuple[Switches, tuple[SlidingSurface, ...]]:
    """Return the switches with the modes of surfaces along which first-order ``states`` may slide, as their rates jump there.

    Comparisons that tell the same two sides apart are one switch, as all of them turn at once. One surface at a time carries
    a motion; where it meets another one it goes to and fro.
    """
    graph = system.graph
    groups = [group for group in _groups(system, switches, states) if _jumps(system, switches, group)]
    if not groups:
        return switches, ()
    merged = {
        switch.symbol: group[0][0].symbol if same else graph.logical_not(group[0][0].symbol)
        for group in groups
        for switch, same in group[1:]
    }
    laws = substitute(graph, list(switches.replace.values()), merged)
    switches = replace(switches, replace=dict(zip(switches.replace, laws, strict=True)))
    modes = [graph.symbol(f"slides({group[0][0].text})") for group in groups]
    surfaces = [
        _surface(system, switches, group[0][0], mode, [m for m in modes if m != mode])
        for group, mode in zip(groups, modes, strict=True)
    ]
    held = {s.switch.symbol: s for s in surfaces}
    located = [
        _sliding_switch(system, s, held[s.symbol]) if s.symbol in held else s
        for s in switches.located
        if s.symbol not in merged
    ]
    return replace(switches, located=(*(s.mode for s in surfaces), *located)), tuple(surfaces)


def sliding(
    system: MechanicalSystem, surfaces: Sequence[SlidingSurface], nodes: Sequence[Node]
) -> tuple[Node, ...]:
    """Return formulas with the combination of both sides where the motion slides along a surface."""
    graph, found = system.graph, list(nodes)
    for s in surfaces:
        above, below = (substitute(graph, found, {s.switch.symbol: n}) for n in (graph.zero, graph.one))
        found = [
            f if a == b else graph.select(s.mode.symbol, graph.add(a, graph.mul(s.share, graph.sub(b, a))), f)
            for f, a, b in zip(found, above, below, strict=True)
        ]
    return tuple(found)


def places_of_modes(surfaces: Sequence[SlidingSurface], located: Sequence[SwitchPlan]) -> tuple[int, ...]:
    """Return for each switch the index of the mode of its surface, -1 where it has none; nothing where no motion slides."""
    places = {s.symbol: k for k, s in enumerate(located)}
    modes = {s.switch.symbol: places[s.mode.symbol] for s in surfaces}
    return tuple(modes.get(switch.symbol, -1) for switch in located) if surfaces else ()


def _groups(
    system: MechanicalSystem, switches: Switches, states: Collection[Node]
) -> list[list[tuple[SwitchPlan, bool]]]:
    """Return the switches that states alone decide, those with one surface together; whether each has its sign."""
    graph = system.graph
    groups: list[list[tuple[SwitchPlan, bool]]] = []
    for switch in switches.located:
        g = switch.indicator
        support = set(graph.support(g))
        if support.isdisjoint(states) or not support.isdisjoint(system.symbols.velocities):
            continue
        for group in groups:
            first = group[0][0].indicator
            if graph.is_zero(graph.sub(first, g)) or graph.is_zero(graph.add(first, g)):
                group.append((switch, graph.is_zero(graph.sub(first, g))))
                break
        else:
            groups.append([(switch, True)])
    return groups


def _jumps(system: MechanicalSystem, switches: Switches, group: Sequence[tuple[SwitchPlan, bool]]) -> bool:
    """Whether the rate of g differs between the sides."""
    (rate,) = switches.apply(system, [group[0][0].rate])
    return not {switch.symbol for switch, _ in group}.isdisjoint(system.graph.support(rate))


def _surface(
    system: MechanicalSystem, switches: Switches, switch: SwitchPlan, mode: Node, others: Sequence[Node]
) -> SlidingSurface:
    graph = system.graph
    (rate,) = switches.apply(system, [switch.rate])
    up, down = (substitute(graph, [rate], {switch.symbol: n})[0] for n in (graph.zero, graph.one))
    apart = graph.sub(up, down)
    share = graph.div(up, graph.select(mode, apart, graph.minus_one))
    leads = graph.mul(graph.less(up, graph.zero), graph.less(graph.zero, down))
    for other in others:
        leads = graph.mul(leads, graph.logical_not(other))
    outside = graph.mul(share, graph.sub(share, graph.one))
    indicator = graph.select(mode, outside, graph.abs(switch.indicator))
    beginning = graph.select(mode, graph.zero, graph.mul(leads, apart))
    return SlidingSurface(
        switch, SwitchPlan(mode, indicator, beginning, indicator, f"{switch.text} slides"), share
    )


def _sliding_switch(system: MechanicalSystem, switch: SwitchPlan, surface: SlidingSurface) -> SwitchPlan:
    """Return a switch that stays as it is while the motion slides along its surface."""
    graph, mode = system.graph, surface.mode.symbol
    as_it_is = graph.select(switch.symbol, graph.minus_one, graph.one)
    return replace(
        switch,
        indicator=graph.select(mode, as_it_is, switch.indicator),
        rate=graph.select(mode, graph.zero, switch.rate),
    )
