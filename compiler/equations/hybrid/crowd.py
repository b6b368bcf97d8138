"""Crowds of contacts: code for each kind of them, tables for each contact, and what their forces do to velocities."""

from __future__ import annotations

from collections.abc import Collection, Sequence

from msgspec import Struct

from mechc.lang.diagnostics import Reporter
from mechc.runtime.interface import Quantity

from ...graph import Node
from ...graph.differentiate import jacobian
from ...graph.operations import ABS, ATAN2, CONST, LOOKUP, POW, SYMBOL
from ...graph.rewrite import substitute
from ...mechanics.system import ConstraintRows, MechanicalSystem
from ..crowd_plan import CrowdKind, CrowdPlan, CrowdRow
from ..model import Function, Slot
from ..quantities import quantity
from ..reported.entries import Layout
from ..rows.crowd import CrowdMember
from ..rows.residual import constraint_rates
from ..solve.impulses import velocity_jumps
from ..solve.solved import Solved
from .reach import reach

PUSH = "crowd_push"
"""The function of what generalised impulses do to the velocities."""

CLOSED = 3
"""What an output asks of a contact beside its forces, along its gap and its slips: whether it is closed."""

SMOOTH = (ATAN2, POW, LOOKUP)
"""Operations after ``ABS`` in their table that have no pieces."""

Key = tuple[object, ...]


class Crowd(Struct, frozen=True):
    """What a crowd adds to equations; ``places``: the symbols in z of contacts that are closed; ``outputs``: those of the
    model, of what they are given."""

    plan: CrowdPlan
    functions: tuple[Function, ...]
    given: tuple[Quantity, ...]
    slots: dict[Node, Slot]
    places: tuple[Node, ...]
    outputs: tuple[Node, ...]


class _Terms(Struct, frozen=True):
    """What is formed of every contact: gap, restitution, approach at rest; slips and coefficients where it has friction."""

    gap: Node
    numbers: tuple[Node, ...]
    slips: tuple[Node, ...]


def crowd_of(
    system: MechanicalSystem,
    solved: Solved,
    layout: Layout,
    members: Sequence[CrowdMember],
    outputs: Sequence[Node],
    parts: Collection[str],
    reporter: Reporter,
) -> Crowd | None:
    """Return the functions and tables of a crowd; None where there is none. ``outputs``: formulas that read its forces."""
    if not members:
        return None
    return _Former(system, solved, layout, members, "contact_steps" in parts, reporter).crowd(outputs)


class _Former:
    def __init__(
        self,
        system: MechanicalSystem,
        solved: Solved,
        layout: Layout,
        members: Sequence[CrowdMember],
        told: bool,
        reporter: Reporter,
    ) -> None:
        self.system, self.solved, self.layout, self.members = system, solved, layout, members
        self.told, self.reporter = told, reporter
        self.stepped = False
        self.graph = system.graph
        self.velocities = [system.v[i].node for i in solved.free]
        self.place = {n: k for k, n in enumerate(self.velocities)}
        self.qdot = {
            s.node: d for s, d in zip(system.q, system.qdot, strict=True) if s.node not in solved.driven
        }
        self.coordinates = {q: self.place[v] for q, v in self.qdot.items() if v in self.place}
        self.constant = frozenset(s.node for s in system.symbols.parameters)
        self.given: list[Node] = []

    def crowd(self, outputs: Sequence[Node]) -> Crowd:
        keys: dict[Key, int] = {}
        firsts: list[tuple[CrowdMember, _Terms, list[Node]]] = []
        rows: list[tuple[int, list[Node]]] = []
        for member, terms in zip(self.members, self.terms(), strict=True):
            key, leaves = self.signature(member, terms)
            kind = keys.setdefault(key, len(keys))
            if kind == len(firsts):
                firsts.append((member, terms, leaves))
            rows.append((kind, leaves))
        kinds: list[CrowdKind] = []
        functions: list[Function] = []
        columns: list[tuple[list[int], list[int]]] = []
        for number, (member, terms, leaves) in enumerate(firsts):
            formed, function, used = self.kind(f"crowd_{number + 1}", member, terms, leaves)
            kinds.append(formed)
            functions.append(function)
            columns.append(used)
        plan_rows = tuple(
            CrowdRow(
                member.gap.name,
                kind,
                tuple(self.code(n, member.gap) for n in leaves),
                tuple(self.place[leaves[k]] for k in columns[kind][0]),
                tuple(self.place[leaves[k]] for k in columns[kind][1]),
                member.gap.origin.shown,
            )
            for member, (kind, leaves) in zip(self.members, rows, strict=True)
        )
        push = self.push()
        asked, read = self.read_by(outputs)
        capacity = min(len(rows), 2 * len(self.velocities))
        told = 1 + max(kind.friction for kind in kinds) if self.told else 0
        places = [self.graph.symbol(f"#closed {k + 1}") for k in range(capacity)]
        places += [self.graph.symbol(f"#force {k + 1}") for k in range(told * capacity)]
        given = tuple(quantity(f"given[{k + 1}]", "given", "") for k in range(len(self.given)))
        slots = {n: Slot("g", k) for k, n in enumerate(self.given)}
        plan = CrowdPlan(tuple(kinds), plan_rows, 0, capacity, self.groups(push), asked, told, self.stepped)
        return Crowd(plan, (*functions, push), given, slots, tuple(places), read)

    # ------------------------------------------------------------ what is formed of every contact

    def terms(self) -> list[_Terms]:
        """Return the formulas of all contacts with what is prescribed put in."""
        nodes: list[Node] = []
        for member in self.members:
            mode = member.gap.mode
            assert mode is not None and mode.restitution is not None and mode.rest is not None
            nodes += [member.gap.residuals[0], mode.restitution, mode.rest]
            nodes += [rows.residuals[0] for rows in member.friction]
            if member.friction:
                law = member.friction[0].mode
                assert law is not None and law.static is not None and law.kinetic is not None
                nodes += [law.static, law.kinetic]
        found = iter(substitute(self.graph, nodes, self.solved.driven) if self.solved.driven else nodes)
        result = []
        for member in self.members:
            gap, numbers = next(found), [next(found), next(found)]
            slips = tuple(next(found) for _ in member.friction)
            if slips:
                numbers += [next(found), next(found)]
            result.append(_Terms(gap, tuple(numbers), slips))
        return result

    def signature(self, member: CrowdMember, terms: _Terms) -> tuple[Key, list[Node]]:
        """Return what two contacts of one kind have in common, and the symbols in which they differ, in one order."""
        graph = self.graph
        number: dict[Node, int] = {}
        key: list[object] = []
        leaves: list[Node] = []
        roots = [terms.gap, *terms.numbers, *terms.slips]
        key.append(len(roots))
        for root in roots:  # grows: with a coordinate its rate belongs to the roots
            stack = [root]
            while stack:
                n = stack[-1]
                if n in number:
                    stack.pop()
                    continue
                code = graph.op(n)
                if code == SYMBOL and n != self.system.symbols.time:
                    key.append((SYMBOL, n in self.qdot, n in self.place))
                    leaves.append(n)
                    if n in self.qdot:
                        roots.append(self.qdot[n])
                elif code in (CONST, SYMBOL):
                    key.append((code, graph.value(n) if code == CONST else 0))
                else:
                    args = graph.args(n)
                    waiting = [a for a in args if a not in number]
                    if waiting:
                        stack += reversed(waiting)
                        continue
                    table = graph.table_of(n) if code == LOOKUP else None
                    key.append((code, table, *(number[a] for a in args)))
                number[n] = len(number)
                stack.pop()
            key.append(number[root])
        return tuple(key), leaves

    def code(self, n: Node, rows: ConstraintRows) -> int:
        """Return where a number lies, as one index over y, p and z."""
        slot = self.layout.slots.get(n)
        sizes = (len(self.layout.states), len(self.layout.parameters))
        before = {"y": 0, "p": sizes[0], "z": sum(sizes)}
        if slot is None or slot.array not in before:
            raise refused(self.reporter, rows, f"reads '{self.graph.name(n)}'")
        return before[slot.array] + slot.index

    # ------------------------------------------------------------ the code of a kind

    def kind(
        self, name: str, member: CrowdMember, terms: _Terms, leaves: Sequence[Node]
    ) -> tuple[CrowdKind, Function, tuple[list[int], list[int]]]:
        """Return a kind, its function, and which of what it is given are the velocities of gap and slip."""
        graph, system = self.graph, self.system
        accelerations = dict.fromkeys(system.a, graph.zero)
        still = dict.fromkeys(self.velocities, graph.zero)
        place = {n: k for k, n in enumerate(leaves)}

        def motion(*directions: ConstraintRows) -> tuple[list[int], list[list[Node]]]:
            """Return the velocities that one of the rows needs, and for each row the two parts free of what follows, then K."""
            rates, parts = [], []
            for rows in directions:
                (rate,) = constraint_rates(system, rows)
                second = system.rate(rate)
                rate, second = substitute(graph, [rate, second], self.solved.driven)
                rates.append(rate)
                parts.append([*substitute(graph, [rate], still), *substitute(graph, [second], accelerations)])
            entries = jacobian(graph, rates, self.velocities)
            columns = sorted({k for row in entries for k in row})
            for part, row in zip(parts, entries, strict=True):
                part += [row.get(k, graph.zero) for k in columns]
            return [place[self.velocities[k]] for k in columns], parts

        normal, ((drift, bias, *entries),) = motion(member.gap)
        bounds = reach(graph, terms.gap, self.coordinates, self.constant)
        own = [leaves[k] for k in normal]
        unknown = graph.minus_one
        outputs = [terms.gap, drift, bias, *terms.numbers[:2], *entries]
        outputs += [unknown if bounds is None else bounds.get(self.place[v], graph.zero) for v in own]
        slip, directions = motion(*member.friction)
        for drift, bias, *entries in directions[:1]:
            outputs += [drift, bias, *terms.numbers[2:], *entries]
        for further in directions[1:]:
            outputs += further
        formed = [terms.gap, *terms.numbers, *terms.slips]
        if any(graph.op(n) >= ABS and graph.op(n) not in SMOOTH for n in graph.reach(formed)):
            raise refused(self.reporter, member.gap, "is made of pieces")
        self.stepped |= len(member.friction) > 1
        given = dict(zip(leaves, self.give(len(leaves)), strict=True))
        function = Function(
            name,
            f"gap, motion and friction of contacts like '{member.gap.name}'",
            tuple(substitute(graph, outputs, given)),
        )
        kind = CrowdKind(name, len(leaves), len(normal), len(slip), len(member.friction))
        return kind, function, (normal, slip)

    # ------------------------------------------------------------ what forces do

    def push(self) -> Function:
        jumps = velocity_jumps(self.system, self.solved, self.give(len(self.velocities)))
        return Function(PUSH, "jumps of the velocities by impulses along them", self.solved.resolve(jumps))

    def groups(self, push: Function) -> tuple[int, ...]:
        """Number the groups of velocities within which impulses act."""
        count = len(self.velocities)
        group = list(range(count))

        def root(k: int) -> int:
            while group[k] != k:
                group[k] = k = group[group[k]]
            return k

        seeds = {n: k for k, n in enumerate(self.given[:count])}
        for k, n in enumerate(push.outputs):
            for symbol in self.graph.support(n):
                if symbol in seeds:
                    group[root(seeds[symbol])] = root(k)
        roots = {r: i for i, r in enumerate(dict.fromkeys(map(root, range(count))))}
        return tuple(roots[root(k)] for k in range(count))

    def give(self, count: int) -> list[Node]:
        """Return so many symbols of what functions are given."""
        while len(self.given) < count:
            self.given.append(self.graph.symbol(f"#given {len(self.given)}"))
        return self.given[:count]

    def read_by(self, outputs: Sequence[Node]) -> tuple[tuple[tuple[int, int], ...], tuple[Node, ...]]:
        """Return what outputs read of contacts, and the outputs as formulas of what they are given: accelerations, then that.

        Formulas elsewhere know the accelerations without the crowd."""
        graph, solved = self.graph, self.solved
        read = dict(zip((self.system.a[i] for i in solved.free), self.give(len(solved.free)), strict=True))
        nodes = substitute(graph, outputs, {**solved.replace, **read})
        found = set(graph.support(*nodes))
        asked: list[tuple[int, int]] = []
        put: dict[Node, Node] = {}
        for number, member in enumerate(self.members):
            for what, symbol in (*enumerate(member.forces), (CLOSED, member.flag)):
                if symbol in found:
                    put[symbol] = self.give(len(read) + len(asked) + 1)[-1]
                    asked.append((number, what))
        return tuple(asked), tuple(substitute(graph, nodes, put))


def refused(reporter: Reporter, rows: ConstraintRows, what: str) -> Exception:
    """Report a contact of a crowd that cannot be one."""
    return reporter.fail(
        "E0722",
        f"contact '{rows.name}' {what}, and is one of too many for formulas",
        rows.origin.shown,
        caption="of more than 64 rows the forces are found by numbers",
        help="there gaps are smooth functions of coordinates, rates, parameters, discrete variables and time",
    )
