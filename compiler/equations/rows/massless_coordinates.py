"""Which coordinates move no mass and are held by no constraint, in groups whose balances of forces hold each other."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence

from msgspec import Struct

from ...flat.model import Literal
from ...graph import Node
from ...graph.differentiate import gradient, jacobian
from ...graph.evaluate import evaluate
from ...mechanics.defaults import default_values
from ...mechanics.kinematics.frames import Frame
from ...mechanics.kinematics.pose import numbers_of
from ...mechanics.system import MechanicalSystem

PLACES = 4
"""Disturbed states at which ranks are decided."""


class Massless(Struct, frozen=True):
    """One coordinate: its indices in v and q."""

    v: int
    q: int


def massless_coordinates(system: MechanicalSystem, rubbing: Collection[str]) -> list[Massless]:
    """Return the coordinates that move no mass and that no constraint holds, but for the frictions ``rubbing``."""
    graph = system.graph
    driven = {i for row in system.drives for i in row.v}
    pairs = [m for m in all_but_rotations(system) if m.v not in driven]
    if not pairs:
        return []
    efforts = [n for effort in system.efforts for pair in effort.pairs for n in pair]
    moving = set(graph.support(system.kinetic, system.lagrangian))
    masses, inertias = system.masses, system.inertias
    sizes = [m.mass for m in masses] + [x for body in inertias for row in body.inertia for x in row]
    zeros = zero_parameters(system).intersection((*moving, *graph.support(*sizes)))
    if zeros:
        values = dict(zip(sizes, evaluate(graph, sizes, default_values(system)), strict=True))
        masses = tuple(m for m in masses if values[m.mass])
        inertias = tuple(body for body in inertias if any(values[x] for row in body.inertia for x in row))
        moving -= _without_inertia(system, [m.v for m in pairs if system.v[m.v].node in moving])
    moving |= set(graph.support(*efforts)).intersection(system.a)
    carried = {n for mass in masses for n in mass.point.offset}
    carried |= set(placing([*(m.point.frame for m in masses), *(b.frame for b in inertias)]))
    placed = set(graph.support(*carried))
    others = [rows for rows in system.constraints if rows.name not in rubbing]
    held = set(graph.support(*(n for rows in others for n in rows.residuals)))

    def weightless(m: Massless) -> bool:
        q, v, a = system.q[m.q].node, system.v[m.v].node, system.a[m.v]
        return moving.isdisjoint((v, a)) and placed.isdisjoint((q, v)) and held.isdisjoint((q, v, a))

    return [m for m in pairs if weightless(m)]


def all_but_rotations(system: MechanicalSystem) -> list[Massless]:
    """Return all coordinates but rotations."""
    pairs: list[Massless] = []
    first_q = first_v = 0
    for coordinate in system.symbols.coordinates:
        if not coordinate.is_rotation:
            pairs += [Massless(first_v + k, first_q + k) for k in range(len(coordinate.v))]
        first_q, first_v = first_q + len(coordinate.q), first_v + len(coordinate.v)
    return pairs


def zero_parameters(system: MechanicalSystem) -> set[Node]:
    """Return the parameters that are zero unless a run says otherwise."""
    return {
        s.node
        for s in system.symbols.parameters
        if isinstance(s.variable.value, Literal) and s.variable.value.value == 0
    }


def _without_inertia(system: MechanicalSystem, rates: Sequence[int]) -> set[Node]:
    """Return those of the rates whose inertia in the energies vanishes with the values of the parameters."""
    graph = system.graph.fork()  # what is formed here must not change the order of nodes
    velocities = [s.node for s in system.v]
    energy = graph.add(system.kinetic, system.lagrangian)
    momenta = gradient(graph, energy, [velocities[i] for i in rates])
    entries = jacobian(graph, momenta, velocities)
    places = disturbed_states(system, graph.support(*momenta))
    found = set()
    for i, row in zip(rates, entries, strict=True):
        if not any(x for place in places for x in evaluate(graph, list(row.values()), place)):
            found.add(velocities[i])
    return found


def placing(frames: Iterable[Frame]) -> Iterable[Node]:
    """Yield what places frames: lengths and angles of all steps from the root."""
    seen: set[int] = set()
    for frame in frames:
        at: Frame | None = frame
        while at is not None and id(at) not in seen:
            seen.add(id(at))
            if at.step is not None:
                yield from numbers_of(at.step)
            at = at.parent


def coupled_groups(
    system: MechanicalSystem,
    found: Sequence[Massless],
    rows: Mapping[Massless, Node],
    forces: Collection[Node],
) -> list[list[Massless]]:
    """Return the coordinates in groups whose balances hold each other's places or rates, or ``forces`` together."""
    graph = system.graph
    own = {system.q[m.q].node: m for m in found} | {system.v[m.v].node: m for m in found}
    leader = {m: m for m in found}

    def first(m: Massless) -> Massless:
        while leader[m] is not m:
            leader[m] = leader[leader[m]]
            m = leader[m]
        return m

    for m in found:
        for n in graph.support(rows[m]):
            if n in forces:
                own.setdefault(n, m)
            if n in own:
                leader[first(own[n])] = first(m)
    groups: dict[Massless, list[Massless]] = {}
    for m in found:
        groups.setdefault(first(m), []).append(m)
    return list(groups.values())


def disturbed_states(system: MechanicalSystem, symbols: Iterable[Node]) -> list[dict[Node, float]]:
    """Return values of everything at the start and at disturbed states, where ranks are decided."""
    import numpy as np

    start = default_values(system)
    start |= {n: 1.0 for n in symbols if n not in start}
    random = np.random.default_rng(22)
    moving = [*system.q, *system.v, *system.symbols.states]
    places = []
    for _ in range(PLACES):
        shifts = random.standard_normal(len(moving))
        places.append(
            start
            | {
                s.node: start[s.node] + 0.1 * d * (abs(start[s.node]) or 1.0)
                for s, d in zip(moving, shifts, strict=True)
            }
        )
    return places
