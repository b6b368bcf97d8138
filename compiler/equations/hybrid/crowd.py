"""Crowds of contacts: code for each kind of them, tables for each contact, and what their forces do to velocities."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence, Set
from collections.abc import Set as AbstractSet
from functools import partial

from msgspec import Struct, field
from msgspec.structs import replace

from mechc.lang.diagnostics import Reporter
from mechc.runtime.interface import Quantity

from ...flat.model import ContactFamily, Unlike
from ...graph import Graph, Node
from ...graph.differentiate import jacobian, jvp
from ...graph.operations import ABS, ADD, ATAN2, CONST, COS, LOOKUP, MUL, NEG, POW, SIN, SQRT, SUB, SYMBOL
from ...graph.rewrite import substitute
from ...mechanics.families import FamilyRows, Read
from ...mechanics.meaning.questions import PREFIX
from ...mechanics.system import ConstraintRows, MechanicalSystem
from ..crowd_plan import CrowdColumns, CrowdKind, CrowdLine, CrowdPlan
from ..model import Function, Slot, quantity
from ..reported.entries import Layout
from ..rows.crowd import CrowdMember
from ..rows.residual import constraint_rates
from ..solve.energies import carried
from ..solve.solved import Solved, answer_impulses, velocity_jumps

PUSH = "crowd_push"
"""The function of what generalised impulses do to the velocities."""
SUPPLY = "crowd_supply"
"""The function of what accelerations do to the energy."""

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

    @property
    def roots(self) -> list[Node]:
        return [self.gap, *self.numbers, *self.slips]


class _Sides(Struct, frozen=True):
    """The leaves of a contact in the ``order`` in which the first ``one`` are those of its row; those of all rows and columns."""

    order: tuple[int, ...]
    one: int
    rows: list[list[Node]]
    columns: list[list[Node]]


class _Labelled(Struct):
    labels: list[str] = field(default_factory=list)
    leaves: list[tuple[int, ...]] = field(default_factory=list)


class _Lines(Struct):
    """The lines of a crowd as they are found. ``numbers``: of each contact that was formed, in their order."""

    lines: list[CrowdLine] = field(default_factory=list)
    columns: list[_Labelled] = field(default_factory=list)
    numbers: list[int] = field(default_factory=list)
    count: int = 0

    def add(self, kind: int, rows: ConstraintRows, leaves: tuple[int, ...]) -> None:
        """Add a contact; with those before it that are of its kind it is a line."""
        last = self.lines[-1] if self.lines else None
        if last is None or last.one or last.head or (last.kind, last.span) != (kind, rows.origin.shown):
            self.columns.append(_Labelled())
            self.lines.append(
                CrowdLine(self.count, kind, (), len(self.columns) - 1, 0, 0, "", "", rows.origin.shown)
            )
        at = self.columns[-1]
        at.labels.append(rows.name)
        at.leaves.append(leaves)
        self.lines[-1] = replace(self.lines[-1], stop=len(at.labels))
        self.numbers.append(self.count)
        self.count += 1

    def add_family(
        self,
        kind: int,
        family: ContactFamily,
        rows: ConstraintRows,
        ones: Sequence[tuple[int, ...]],
        columns: Sequence[tuple[int, ...]],
    ) -> None:
        """Add all contacts of a family."""
        self.columns.append(_Labelled([*family.labels], [*columns]))
        many, place = len(columns), len(self.columns) - 1
        for k, (one, head, start) in enumerate(zip(ones, family.heads, family.starts, strict=True)):
            if start < many:
                line = CrowdLine(
                    self.count, kind, one, place, start, many, head, family.end, rows.origin.shown
                )
                self.lines.append(line)
                self.count += many - start
            if k == family.row:
                self.numbers.append(self.count - 1)


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
        self.xdot = system.xdot
        self.coordinates = {q: self.place[v] for q, v in self.qdot.items() if v in self.place}
        self.constant = frozenset(s.node for s in system.symbols.parameters)
        self.given: list[Node] = []

    def crowd(self, outputs: Sequence[Node]) -> Crowd:
        families = {one.family.contact: one for one in self.system.families}
        kinds: dict[Key, tuple[CrowdKind, Function]] = {}
        numbers: dict[Key, int] = {}
        lines = _Lines()
        for member, terms in zip(self.members, self.terms(), strict=True):
            key, leaves = self.signature(terms.roots)
            family = families.get(member.gap.name)
            sides = None if family is None else self.sides(family, leaves)
            if sides is not None:
                key, leaves = (key, sides.order), [leaves[k] for k in sides.order]
            if key not in kinds:
                one = 0 if sides is None else sides.one
                kinds[key] = self.kind(f"crowd_{len(kinds) + 1}", member, terms, leaves, one)
                numbers[key] = len(numbers)
            code = partial(self.code, rows=member.gap)
            if family is None or sides is None:
                lines.add(numbers[key], member.gap, tuple(map(code, leaves)))
                continue
            rows = [tuple(map(code, leaves)) for leaves in sides.rows]
            columns = tuple(tuple(map(code, leaves)) for leaves in sides.columns)
            lines.add_family(numbers[key], family.family, member.gap, rows, columns)
        formed = tuple(kind for kind, _ in kinds.values())
        push = self.push()
        supply = self.supply()
        efforts, asked, read = self.read_by(outputs, lines.numbers)
        capacity = 0 if self.stepped else min(lines.count, 2 * len(self.velocities))
        told = 1 + len(self.velocities) * (2 if efforts else 1) + len(asked) if self.told else 0
        places = [self.graph.symbol(f"#closed {k + 1}") for k in range(capacity)]
        places += [self.graph.symbol(f"#told {k + 1}") for k in range(told)]
        given = tuple(quantity(f"given[{k + 1}]", "given", "") for k in range(len(self.given)))
        slots = {n: Slot("g", k) for k, n in enumerate(self.given)}
        plan = CrowdPlan(
            formed,
            tuple(lines.lines),
            tuple(CrowdColumns(tuple(c.labels), tuple(c.leaves)) for c in lines.columns),
            0,
            capacity,
            self.groups(push),
            asked,
            told,
            self.stepped,
            efforts,
            bool(supply),
        )
        functions = tuple(function for _, function in kinds.values())
        return Crowd(plan, (*functions, push, *supply), given, slots, tuple(places), read)

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

    def signature(self, formulas: Sequence[Node]) -> tuple[Key, list[Node]]:
        """Return what formulas have in common that differ in their symbols alone, and these, in one order. With a coordinate
        or a state its rate is one of them."""
        graph = self.graph
        number: dict[Node, int] = {}
        key: list[object] = []
        leaves: list[Node] = []
        roots = [*formulas]
        key.append(len(roots))
        for root in roots:  # grows by rates
            stack = [root]
            while stack:
                n = stack[-1]
                if n in number:
                    stack.pop()
                    continue
                code = graph.op(n)
                if code == SYMBOL and n != self.system.symbols.time:
                    key.append((SYMBOL, n in self.qdot, n in self.place, n in self.xdot))
                    leaves.append(n)
                    if n in self.qdot:
                        roots.append(self.qdot[n])
                    if n in self.xdot:
                        roots.append(self.xdot[n])
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

    def sides(self, family: FamilyRows, leaves: Sequence[Node]) -> _Sides:
        """Return how the symbols of the contact that stands for a family are those of its row and its last column, and what stands
        in their places in the others. Raises Unlike where they differ in more than that."""
        known: dict[int, tuple[Key, list[Node]]] = {}

        def read(nodes: Read) -> tuple[Key, list[Node]]:
            if id(nodes) not in known:
                driven = self.solved.driven
                known[id(nodes)] = self.signature(substitute(self.graph, nodes, driven) if driven else nodes)
            return known[id(nodes)]

        rows, columns = [read(nodes) for nodes in family.rows], [read(nodes) for nodes in family.columns]
        own, other = rows[family.family.row], columns[-1]
        if any(key != own[0] for key, _ in rows) or any(key != other[0] for key, _ in columns):
            raise Unlike
        varying = [_varying([found for _, found in side]) for side in (rows, columns)]
        places = [{n: k for k, n in enumerate(found)} for _, found in (own, other)]
        moved = [
            {n for n, k in place.items() if k in changes}
            for place, changes in zip(places, varying, strict=True)
        ]
        common = self.graph.support(*family.common)
        if (
            moved[0] & places[1].keys()
            or moved[1] & places[0].keys()
            or not (moved[0] | moved[1]).isdisjoint(common)
        ):
            raise Unlike  # the formula may be another where what is one here is not
        order = [k for k, n in enumerate(leaves) if n not in moved[1]]
        one = len(order)
        order += [k for k, n in enumerate(leaves) if n in moved[1]]

        def put(
            found: list[Node], place: Mapping[Node, int], changes: AbstractSet[Node], part: list[int]
        ) -> list[Node]:
            return [found[place[n]] if n in changes else n for n in (leaves[k] for k in part)]

        return _Sides(
            tuple(order),
            one,
            [put(found, places[0], moved[0], order[:one]) for _, found in rows],
            [put(found, places[1], moved[1], order[one:]) for _, found in columns],
        )

    def code(self, n: Node, rows: ConstraintRows) -> int:
        """Return where a number lies, as one index over y, p and z."""
        slot = self.layout.slots.get(n)
        sizes = (len(self.layout.states), len(self.layout.parameters))
        before = {"y": 0, "p": sizes[0], "z": sum(sizes)}
        if slot is None or slot.array not in before:
            raise refused(self.reporter, rows, f"reads '{self.graph.name(n).removeprefix(PREFIX)}'")
        return before[slot.array] + slot.index

    # ------------------------------------------------------------ the code of a kind

    def kind(
        self, name: str, member: CrowdMember, terms: _Terms, leaves: Sequence[Node], one: int
    ) -> tuple[CrowdKind, Function]:
        """Return a kind and its function. The contacts of a line have the first ``one`` leaves in common."""
        graph, system = self.graph, self.system
        accelerations = dict.fromkeys(system.a, graph.zero)
        flows = {system.rate(state): value for state, value in system.xdot.items()}
        still = dict.fromkeys(self.velocities, graph.zero)
        place = {n: k for k, n in enumerate(leaves)}

        def motion(*directions: ConstraintRows) -> tuple[list[int], list[list[Node]]]:
            """Return the velocities that one of the rows needs, and for each row the two parts free of what follows, then K."""
            rates, parts = [], []
            for rows in directions:
                (rate,) = constraint_rates(system, rows)
                second = system.rate(rate)
                rate, second = substitute(graph, [rate, second], {**self.solved.driven, **flows})
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
        pieces = any(graph.op(n) >= ABS and graph.op(n) not in SMOOTH for n in graph.reach(terms.roots))
        self.stepped |= pieces or len(member.friction) > 1
        given = dict(zip(leaves, self.give(len(leaves)), strict=True))
        function = Function(
            name,
            f"gap, motion and friction of contacts like '{member.gap.name}'",
            tuple(substitute(graph, outputs, given)),
        )
        return CrowdKind(name, len(leaves), one, tuple(normal), tuple(slip), len(member.friction)), function

    # ------------------------------------------------------------ what forces do

    def push(self) -> Function:
        jumps = velocity_jumps(self.system, self.solved, self.give(len(self.velocities)))
        return Function(PUSH, "jumps of the velocities by impulses along them", self.solved.resolve(jumps))

    def supply(self) -> list[Function]:
        """Return the power that goes into the energy along accelerations, where what moves by itself has a part in it."""
        total, held = self.solved.energies.total, [row.rate for row in self.solved.rows]
        if not carried(self.system, total, held):
            return []
        along = dict(zip(self.velocities, self.give(len(self.velocities)), strict=True))
        return [
            Function(
                SUPPLY,
                "power of accelerations",
                self.solved.resolve(jvp(self.graph, [total], along)),
            )
        ]

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

    def read_by(
        self, outputs: Sequence[Node], numbers: Sequence[int]
    ) -> tuple[bool, tuple[tuple[int, int], ...], tuple[Node, ...]]:
        """Return whether outputs read forces along velocities, what they read of contacts, and the outputs as formulas of what they
        are given: accelerations, then these forces, then that.

        Formulas elsewhere know the accelerations without the crowd."""
        graph, solved = self.graph, self.solved
        read = dict(zip((self.system.a[i] for i in solved.free), self.give(len(solved.free)), strict=True))
        nodes = substitute(graph, outputs, {**solved.replace, **read})
        found = set(graph.support(*nodes))
        efforts = not found.isdisjoint(solved.found_apart)
        behind = len(read)
        if efforts:
            nodes = substitute(graph, nodes, self.held(behind))
            behind += len(self.velocities)
        asked: list[tuple[int, int]] = []
        put: dict[Node, Node] = {}
        for number, member in zip(numbers, self.members, strict=True):
            for what, symbol in (*enumerate(member.forces), (CLOSED, member.flag)):
                if symbol in found:
                    put[symbol] = self.give(behind + len(asked) + 1)[-1]
                    asked.append((number, what))
        return efforts, tuple(asked), tuple(substitute(graph, nodes, put))

    def held(self, after: int) -> dict[Node, Node]:
        """Return the forces of constraints, by the symbols for them: with what contacts add to those without them. What contacts do
        along the velocities is given ``after`` so many numbers."""
        graph, solved = self.graph, self.solved
        efforts = self.give(after + len(self.velocities))[after:]
        _, added = answer_impulses(self.system, solved, efforts)
        more = dict(zip((row.multiplier for row in solved.rows), solved.resolve(added), strict=True))
        return {
            symbol: graph.add(solved.resolve([lam])[0], more.get(lam, graph.zero))
            for symbol, lam in solved.found_apart.items()
        }


def _varying(side: Sequence[Sequence[Node]]) -> frozenset[int]:
    """Return the places at which not all lists have the same."""
    return frozenset(k for k, found in enumerate(zip(*side, strict=True)) if len({*found}) > 1)


def refused(reporter: Reporter, rows: ConstraintRows, what: str) -> Exception:
    """Report a contact of a crowd that cannot be one."""
    return reporter.fail(
        "E0722",
        f"contact '{rows.name}' {what}, and is one of too many for formulas",
        rows.origin.shown,
        caption="of more than 64 rows the forces are found by numbers",
        help="there gaps are functions of coordinates, rates, parameters, discrete variables and time",
    )


Bounds = dict[int, Node]


def reach(graph: Graph, gap: Node, places: Mapping[Node, int], constant: Set[Node]) -> Bounds | None:
    """Return bounds of |d gap/dq| by the places of coordinates; None where none is known that holds everywhere.

    ``places``: of coordinates whose rate is a velocity; ``constant``: symbols that do not change. A distance
    norm({a, b}) changes no faster than a and b do.
    """
    known: dict[Node, Bounds | None] = {}
    for n in graph.reach([gap]):
        known[n] = _bounds(graph, n, places, constant, known)
    return known[gap]


def _bounds(
    graph: Graph,
    n: Node,
    places: Mapping[Node, int],
    constant: Set[Node],
    known: Mapping[Node, Bounds | None],
) -> Bounds | None:
    code, args = graph.op(n), graph.args(n)
    if code == CONST or n in constant:
        return {}
    if code == SYMBOL:
        return {places[n]: graph.one} if n in places else None
    parts = [known[a] for a in args]
    if all(part == {} for part in parts):
        return {}
    if code in (ADD, SUB, NEG, SIN, COS):
        return _sum(graph, parts)
    if code == MUL:
        factor, of = (args[0], parts[1]) if parts[0] == {} else (args[1], parts[0])
        if of is not None and {} in parts:
            return {k: graph.mul(graph.abs(factor), bound) for k, bound in of.items()}
    return _norm(graph, args[0], known) if code == SQRT else None


def _sum(graph: Graph, parts: list[Bounds | None]) -> Bounds | None:
    total: Bounds = {}
    for part in parts:
        if part is None:
            return None
        for k, bound in part.items():
            total[k] = graph.add(total.get(k, graph.zero), bound)
    return total


def _norm(graph: Graph, of: Node, known: Mapping[Node, Bounds | None]) -> Bounds | None:
    """Return the bounds of a root of a sum of squares: those of the vector."""
    squares: Bounds = {}
    waiting = [of]
    while waiting:
        n = waiting.pop()
        args = graph.args(n)
        if graph.op(n) == ADD:
            waiting += args
            continue
        part = known[args[0]] if graph.op(n) == MUL and args[0] == args[1] else None
        if part is None:
            return None
        for k, bound in part.items():
            squares[k] = graph.add(squares.get(k, graph.zero), graph.mul(bound, bound))
    return {k: graph.sqrt(square) for k, square in squares.items()}
