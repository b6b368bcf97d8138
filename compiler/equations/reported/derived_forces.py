"""Forces on bodies that are derivatives by their places: of potentials, losses, constraints, and loads on what is not a body.

They are found with the bodies apart (``mechanics/apart.py``), where every formula of places depends on those of the bodies
themselves.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from ...flat.model import Damping, Expression, Kind, Load
from ...graph import Node
from ...graph.differentiate import vjp
from ...graph.vector import Vector, subtract
from ...mechanics.apart import Apart
from ...mechanics.contacts import gap_parts
from ...mechanics.system import MechanicalSystem
from ..solve.solved import Solved

Pairs = list[tuple[Node, Node]]


class DerivedForces:
    """``unclear``: bodies on which something acts whose force is not formed here: energies with velocities, gaps of several
    parts, what asks for energies or momenta."""

    def __init__(self, system: MechanicalSystem, solved: Solved, apart: Apart) -> None:
        self._system, self._graph, self._lowering, self._apart = system, system.graph, system.lowering, apart
        self._powers: Pairs = []
        """Rates, and the forces along them."""
        self._potentials: list[Node] = []
        self._losses: list[Node] = []
        self.unclear: set[str] = set()
        with apart.lowered():
            self._collect(solved)

    def wrenches(self) -> Iterator[tuple[str, Vector, Vector]]:
        """Yield forces at the origin of bodies, with their moments."""
        graph, apart, size = self._graph, self._apart, self._system.kinematics.size
        bodies = list(apart.bodies.values())
        places, motions = [n for b in bodies for n in b.place], [n for b in bodies for n in b.motion]
        found = [vjp(graph, [pair], motions) for pair in self._powers if graph.depend([pair[0]], motions)]
        for values, along in ((self._potentials, places), (self._losses, motions)):
            found += [vjp(graph, [(v, graph.minus_one)], along) for v in values if graph.depend([v], along)]
        width = len(bodies[0].place) if bodies else 1
        for efforts in found:
            for k, body in enumerate(bodies):
                own = efforts[width * k : width * (k + 1)]
                if not all(graph.is_zero(x) for x in own):
                    own = [*apart.joined(apart.still(own))]
                    yield body.name, tuple(own[:size]), tuple(own[size:])

    def _collect(self, solved: Solved) -> None:
        """Collect statements about places and rates, whatever these are of."""
        model = self._system.model
        for energy in model.energies:
            value = self._plain(energy.value)
            if energy.kind == "dissipation":
                self._losses += value
            elif energy.kind == "potential" and not self._moves(value):
                self._potentials += value
            else:
                self._leave(value)
        for damping in model.dampings:
            self._losses += self._lost(damping)
        for load in model.loads:
            if load.on.type.kind not in (Kind.FRAME, Kind.POINT):
                self._powers += self._along(load)
        rows: dict[str, tuple[Node, ...]] = {}
        for constraint in model.constraints:
            left, right = self._plain(constraint.left), self._plain(constraint.right)
            count = max(len(left), len(right))
            left, right = left * (count // len(left)), right * (count // len(right))
            rows[constraint.name] = subtract(self._graph, left, right)
        for friction in model.frictions:
            rows[friction.name] = self._rate(self._plain(friction.on))
        for contact in model.contacts:
            gap = self._plain(contact.gap)
            if len(gap_parts(self._lowering, contact, self._places())) > 1:
                self._leave(gap)
                continue
            rows[contact.name] = gap
            slips = () if contact.along is None else self._plain(contact.along)
            for k, slip in enumerate(slips):
                number = "" if len(slips) == 1 else f"[{k + 1}]"
                rows[f"{contact.name}.friction{number}"] = (slip,)
        for row in {row.multiplier: row for row in (*solved.all_rows, *solved.switched)}.values():
            if not row.constraint.joint and row.constraint.name in rows:
                residual = rows[row.constraint.name][row.component]
                rate = residual if row.constraint.level == "velocity" else self._system.rate(residual)
                self._powers.append((rate, row.multiplier))

    def _leave(self, nodes: Sequence[Node]) -> None:
        met = set(self._graph.support(*nodes))
        for body in self._apart.bodies.values():
            if not met.isdisjoint((*body.place, *body.motion, *body.axes)):
                self.unclear.add(body.name)

    def _moves(self, nodes: Sequence[Node]) -> bool:
        return self._graph.depend(nodes, self._apart.motions)

    def _places(self) -> frozenset[Node]:
        places = (n for body in self._apart.bodies.values() for n in body.place)
        return frozenset((*self._system.symbols.positions, *places))

    def _plain(self, expression: Expression) -> tuple[Node, ...]:
        """Return the numbers of an expression; note it where it asks for what is only known of joined bodies."""
        nodes = self._lowering.reported(expression)
        settled = self._lowering.questions.settle(nodes)
        if settled != nodes:
            self.unclear |= set(self._apart.bodies)
        return settled

    def _rate(self, nodes: Sequence[Node]) -> tuple[Node, ...]:
        """Return rates as they are, and of all else the rates."""
        moving = self._apart.motions | self._system.symbols.velocities
        if moving.isdisjoint(self._graph.support(*nodes)):
            return tuple(self._system.rate(n) for n in nodes)
        return tuple(nodes)

    def _lost(self, damping: Damping) -> list[Node]:
        graph = self._graph
        self._plain(damping.value)
        pairs = zip(self._coefficients(damping), self._rate(self._plain(damping.on)), strict=True)
        return [graph.mul(graph.half, graph.mul(c, graph.mul(rate, rate))) for c, rate in pairs]

    def _coefficients(self, damping: Damping) -> tuple[Node, ...]:
        found = self._lowering.numbers(damping.value)
        count = len(self._lowering.numbers(damping.on))
        return found * count if len(found) == 1 else found

    def _along(self, load: Load) -> Pairs:
        rates = self._rate(self._plain(load.on))
        values = self._lowering.numbers(load.value)
        values = values * len(rates) if len(values) == 1 else values
        pairs = list(zip(rates, values, strict=True))
        if load.source is not None:
            sources = self._rate(self._plain(load.source))
            pairs += [(r, self._graph.neg(v)) for r, v in zip(sources, values, strict=True)]
        return pairs
