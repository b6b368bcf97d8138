"""What holds for every mechanical system."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence

from ..flat.model import Origin
from ..graph import Node
from ..graph import verify as graphs
from ..graph.operations import SYMBOL
from ..malformed import Malformed, excerpt
from .kinematics.frames import Frame, Point
from .meaning.symbols import Scalar
from .meaning.values import Placement
from .modes import BranchRow, CheckAction, ImpulseAction, Mode, SetAction
from .system import MechanicalSystem


def verify(system: MechanicalSystem) -> None:
    """Raise Malformed where a system is not what system.py says.

    Sizes agree; frames form a tree rooted in ``world``, and joints place each root once or close a loop; formulas
    contain known symbols only, and those that their place allows; everything has an origin.
    """
    graphs.verify(system.graph)
    _Check(system).run()


class _Check:
    def __init__(self, system: MechanicalSystem) -> None:
        self.system = system
        symbols = system.symbols
        self.fixed = {s.node for s in symbols.parameters}
        self.positions = {s.node for s in system.q}
        self.velocities = {s.node for s in system.v}
        self.accelerations = set(system.a)
        self.others = {
            symbols.time,
            *(s.node for s in (*symbols.states, *symbols.inputs, *symbols.discretes)),
        }
        self.others |= (
            {system.rate(s.node) for s in symbols.states} | set(system.unknown_rates) | set(system.queries)
        )
        self.others |= {n for displacement in system.virtual.values() for n in displacement.values}
        for rows in system.constraints:
            self.others |= set(_switched(rows.mode)) if rows.mode is not None else set()
        lowering = system.lowering
        self.others |= {n for clock in lowering.clocks.values() for n in (clock.pulse, clock.count)}
        self.others |= set(lowering.delays.found)
        self.others |= set(lowering.previous.values()) | (
            {lowering.initial} if lowering.initial is not None else set()
        )

    def run(self) -> None:
        self.sizes()
        self.symbols()
        self.frames()
        self.topology()
        for where, nodes, forbidden in self.formulas():
            self.formula(where, nodes, forbidden)
        self.rows()
        self.origins()

    # ------------------------------------------------------------ sizes

    def sizes(self) -> None:
        s = self.system
        nq, nv, nx = len(s.q), len(s.v), len(s.symbols.states)
        for what, found, wanted in (
            ("a", len(s.a), nv),
            ("qdot", len(s.qdot), nq),
            ("start_q", len(s.start_q), nq),
            ("start_v", len(s.start_v), nv),
            ("start_x", len(s.start_x), nx),
            ("xdot", len(s.xdot), nx),
            ("q of the coordinates", sum(len(c.q) for c in s.symbols.coordinates), nq),
            ("v of the coordinates", sum(len(c.v) for c in s.symbols.coordinates), nv),
        ):
            if found != wanted:
                self.fail(what, f"has {found} numbers instead of {wanted}")
        if set(s.xdot) != {x.node for x in s.symbols.states}:
            self.fail("xdot", "is not of the states")
        for k, i in s.rotations:
            names = {x.variable.name for x in (*s.q[k : k + 4], *s.v[i : i + 3])}
            if len(names) != 1 or len(s.q[k : k + 4]) != 4 or len(s.v[i : i + 3]) != 3:
                self.fail(f"rotation ({k}, {i})", f"has the numbers of {sorted(names)}", self.listed(s.q, k))

    def symbols(self) -> None:
        """Each number of each variable has a symbol of its own, of its name."""
        s, graph = self.system, self.system.graph
        scalars = (
            *s.q,
            *s.v,
            *s.symbols.states,
            *s.symbols.inputs,
            *s.symbols.discretes,
            *s.symbols.parameters,
        )
        seen: dict[Node, str] = {}
        for k, scalar in enumerate(scalars):
            n = scalar.node
            if not 0 <= n < len(graph) or graph.op(n) != SYMBOL or graph.name(n) != scalar.name:
                self.fail(f"'{scalar.name}'", "is not the symbol of its name", self.listed(scalars, k))
            if n in seen:
                self.fail(f"'{scalar.name}'", f"is the symbol of '{seen[n]}'", self.listed(scalars, k))
            seen[n] = scalar.name
        if len(self.accelerations) != len(s.a) or any(graph.op(n) != SYMBOL for n in s.a):
            self.fail("a", "are not symbols of their own")

    # ------------------------------------------------------------ frames

    def placed(self) -> Iterator[tuple[str, Frame]]:
        s = self.system
        for k, mass in enumerate(s.masses):
            yield f"masses[{k}]", mass.point.frame
        for k, inertia in enumerate(s.inertias):
            yield f"inertias[{k}]", inertia.frame
        for name, displacement in s.virtual.items():
            yield f"virtual['{name}']", displacement.frame
        for name, value in s.lowering.known.items():
            for part in _leaves(value):
                if isinstance(part, Frame | Point):
                    yield f"'{name}'", part.frame if isinstance(part, Point) else part

    def frames(self) -> None:
        world = self.system.kinematics.world
        good = {id(world)}
        if world.parent is not None or world.depth:
            self.fail("world", "hangs on another frame")
        for where, frame in self.placed():
            chain: list[Frame] = []
            at: Frame | None = frame
            while at is not None and id(at) not in good:
                if any(at is other for other in chain):
                    self.fail(where, "hangs on itself", _chain(chain))
                chain.append(at)
                at = at.parent
            if at is None:
                self.fail(where, "does not hang on world", _chain(chain))
            for child in chain:
                parent = child.parent
                if parent is None or child.step is None or child.depth != parent.depth + 1:
                    self.fail(where, "is not a step deeper than what it hangs on", _chain(chain))
            good |= {id(child) for child in chain}

    def topology(self) -> None:
        s = self.system
        names = Counter(j.name for j in (*(e.joint for e in s.topology.tree), *s.topology.closures))
        if names != Counter(j.name for j in s.model.joints):
            self.fail("topology", "does not hold each joint once", sorted(names.elements()))
        roots = Counter(edge.root for edge in s.topology.tree)
        twice = [root for root, count in roots.items() if count > 1]
        if twice:
            self.fail("topology", f"places '{twice[0]}' twice", [e.joint.name for e in s.topology.tree])
        unknowns = {c.variable.name for c in s.symbols.coordinates}
        if both := unknowns & s.topology.dropped:
            self.fail("topology", f"drops '{min(both)}', which is an unknown", sorted(unknowns))

    # ------------------------------------------------------------ formulas

    def formulas(self) -> Iterator[tuple[str, Sequence[Node], set[Node]]]:
        """Yield every formula, and the symbols that it must not contain."""
        s, a = self.system, self.accelerations
        moving = self.velocities | a
        changing = self.positions | moving
        yield "qdot", s.qdot, a
        for k, mass in enumerate(s.masses):
            yield f"masses[{k}]", (mass.mass,), changing
            yield f"masses[{k}], field", mass.field or (), a
        for k, inertia in enumerate(s.inertias):
            yield f"inertias[{k}]", [n for row in inertia.inertia for n in row], changing
        yield "kinetic", (s.kinetic,), a
        yield "potential", (s.potential,), a
        yield "lagrangian", (s.lagrangian,), set()
        yield "dissipation", (s.dissipation,), a
        for k, effort in enumerate(s.efforts):
            yield f"efforts[{k}] '{effort.name}'", [n for pair in effort.pairs for n in pair], set()
        for k, rows in enumerate(s.constraints):
            level = moving if rows.level == "position" else a
            yield f"constraints[{k}] '{rows.name}'", rows.residuals, level
        for k, drive in enumerate(s.drives):
            yield f"drives[{k}]", (*drive.values, *drive.rates), a
        yield "xdot", tuple(s.xdot.values()), set()
        for name, starts in (("start_q", s.start_q), ("start_v", s.start_v), ("start_x", s.start_x)):
            for k, start in enumerate(starts):
                yield f"{name}[{k}]", (start.value,), changing
                yield f"{name}[{k}], by_others", () if start.by_others is None else (start.by_others,), a
        yield "outputs", [row.node for row in s.outputs], set()
        yield "initials", [row.residual for row in s.initials], set()
        yield "exacts", [row.node for row in s.exacts], set()
        yield "assertions", [row.condition for row in s.assertions], set()
        for k, branch in enumerate(s.branches):
            yield f"branches[{k}] '{branch.text}'", _of_branch(branch), set()

    def formula(self, where: str, nodes: Sequence[Node], forbidden: set[Node]) -> None:
        graph = self.system.graph
        for k, n in enumerate(nodes):
            if not 0 <= n < len(graph):
                self.fail(f"{where}, number {k}", f"is node {n} of {len(graph)}")
        known = self.fixed | self.positions | self.velocities | self.accelerations | self.others
        for symbol in graph.support(*nodes):
            if symbol in forbidden or symbol not in known:
                what = "must not depend on" if symbol in known else "depends on the unknown symbol"
                n = next(n for n in nodes if symbol in graph.support(n))
                self.fail(where, f"{what} '{graph.name(symbol)}'", graphs.way(graph, n, symbol))

    # ------------------------------------------------------------ rows

    def rows(self) -> None:
        s = self.system
        for k, rows in enumerate(s.constraints):
            if len(rows.residuals) != len(rows.units):
                self.fail(
                    f"constraints[{k}] '{rows.name}'",
                    f"has {len(rows.residuals)} rows, {len(rows.units)} units",
                )
        driven: set[int] = set()
        for k, drive in enumerate(s.drives):
            if len(drive.values) != len(drive.q) or not len(drive.rates) == len(drive.v) == len(drive.names):
                self.fail(f"drives[{k}]", "has other numbers of formulas than of what they prescribe")
            if not set(drive.q) <= set(range(len(s.q))) or not set(drive.v) <= set(range(len(s.v))):
                self.fail(f"drives[{k}]", f"prescribes {drive.q}, {drive.v} of {len(s.q)}, {len(s.v)}")
            if driven & set(drive.v):
                self.fail(f"drives[{k}]", "prescribes what another one does", self.listed(s.v, min(drive.v)))
            driven |= set(drive.v)
        names = Counter(row.name for row in s.outputs)
        if twice := [name for name, count in names.items() if count > 1]:
            self.fail("outputs", f"'{twice[0]}' is there twice", list(names))

    def origins(self) -> None:
        s = self.system
        placed = (
            s.masses,
            s.inertias,
            s.efforts,
            s.constraints,
            s.drives,
            s.initials,
            s.exacts,
            s.assertions,
        )
        for many in (*placed, s.branches):
            for k, element in enumerate(many):
                if not isinstance(getattr(element, "origin", None), Origin):
                    self.fail(f"{type(element).__name__} {k}", "has no origin")

    # ------------------------------------------------------------ what surrounds a mistake

    def listed(self, scalars: Sequence[Scalar], at: int) -> list[str]:
        return excerpt(len(scalars), at, lambda k: f"%{scalars[k].node} = symbol {scalars[k].name}")

    def fail(self, where: str, what: str, nearby: Sequence[str] = ()) -> None:
        raise Malformed(f"system, {where}", what, nearby)


def _switched(mode: Mode) -> Iterator[Node]:
    yield from mode.impulses
    yield from (n for n in (mode.flag, mode.sign, mode.enabled) if n is not None)


def _of_branch(branch: BranchRow) -> list[Node]:
    nodes = [branch.condition]
    for action in branch.actions:
        match action:
            case SetAction(targets=targets, values=values):
                nodes += [*targets, *values]
            case ImpulseAction(pairs=pairs):
                nodes += [n for pair in pairs for n in pair]
            case CheckAction(condition=condition):
                nodes.append(condition)
    return nodes


def _leaves(value: object) -> Iterator[object]:
    """Yield what a value consists of, through arrays; poses hang on nothing."""
    pending = [value]
    while pending:
        at = pending.pop()
        if isinstance(at, tuple):
            pending += at
        elif not isinstance(at, Placement):
            yield at


def _chain(frames: Sequence[Frame]) -> list[str]:
    return [f"{'->' if not k else '  '} depth {f.depth}: {f.step or 'no step'}" for k, f in enumerate(frames)]
