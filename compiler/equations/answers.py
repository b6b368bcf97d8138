"""Answers to questions about named elements: momenta, energies, multipliers, reactions, powers."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from msgspec import Struct

from mechc.lang.diagnostics import Reporter

from ..flat.model import Query
from ..graph import Node
from ..mechanics.bodies import inertia_tensor, mass_centre
from ..mechanics.forces import damping_power
from ..mechanics.symbols import element_name, subscripts
from ..mechanics.system import MechanicalSystem
from .energies import Energies

Answer = Callable[[Query], Sequence[Node] | None]


class Replies(Struct, frozen=True):
    """What elimination knows about named elements.

    ``multipliers`` by constraint; ``dropped``: multipliers of rows that are left out; ``drive_reactions`` by
    coordinate; ``joint_reactions``: (force, moment) on the ``to`` side, world components, by joint.
    """

    multipliers: Mapping[str, tuple[Node, ...]]
    dropped: frozenset[Node]
    drive_reactions: Mapping[str, Node]
    joint_reactions: Mapping[str, tuple[tuple[Node, ...], tuple[Node, ...]]]


def force_answers(system: MechanicalSystem, replies: Replies) -> list[Node]:
    """Return, for each question, the answer in multipliers and accelerations, or its own symbol."""
    found: list[Node] = []
    groups: dict[int, list[Node]] = {}
    for symbol, query in system.queries.items():
        groups.setdefault(id(query), []).append(symbol)
    for symbol, query in system.queries.items():
        place = groups[id(query)].index(symbol)
        answer: Sequence[Node] | None = None
        match query.function:
            case "multiplier":
                answer = replies.multipliers.get(query.target)
            case "reaction" | "moment" if query.target in replies.joint_reactions:
                answer = replies.joint_reactions[query.target][query.function == "moment"]
            case "reaction":
                names = [element_name(query.target, i) for i in subscripts(query.type.shape)]
                if all(n in replies.drive_reactions for n in names):
                    answer = [replies.drive_reactions[n] for n in names]
                else:  # a drive that is released
                    answer = replies.multipliers.get(query.target)
        found.append(symbol if answer is None else answer[place])
    return found


def answers(
    system: MechanicalSystem, energies: Energies, replies: Replies, reporter: Reporter
) -> dict[Node, Node]:
    """Return the node for each symbol that stands for an answer; report questions without one."""
    graph = system.graph

    def momentum(query: Query) -> Sequence[Node] | None:
        rates = zip(system.v, energies.momenta, strict=True)
        found = [p for rate, p in rates if rate.variable.name == query.target]
        known = [p for p in found if p is not None]
        return known if found and len(known) == len(found) else None

    def power(query: Query) -> Sequence[Node] | None:
        for effort in system.efforts:
            if effort.name == query.target:
                return [graph.sum(graph.mul(r, e) for r, e in effort.pairs)]
        for item in system.model.dampings:
            if item.name == query.target:
                return [damping_power(system.lowering, item, system.symbols)]
        for rows in system.constraints:
            if rows.name == query.target and rows.mode is not None and rows.mode.kind == "friction":
                return [graph.mul(replies.multipliers[rows.name][0], rows.residuals[0])]
        return None

    def multiplier(query: Query) -> Sequence[Node] | None:
        found = replies.multipliers.get(query.target)
        if found is not None and replies.dropped.intersection(found):
            reporter.error(
                "E0525",
                f"'multiplier({query.target})' is not unique",
                query.span,
                caption="this constraint repeats others, so its force cannot be told from theirs",
                help="remove the constraint, or ask for the reaction of one that is kept",
            )
        return found

    def closed(query: Query) -> Sequence[Node] | None:
        for rows in system.constraints:
            if rows.name == query.target:
                return [graph.one if rows.mode is None else rows.mode.flag]
        return None

    def moment(query: Query) -> Sequence[Node] | None:
        found = replies.joint_reactions.get(query.target)
        return None if found is None else found[1]

    def reaction(query: Query) -> Sequence[Node] | None:
        if query.target in replies.joint_reactions:
            return replies.joint_reactions[query.target][0]
        drive_reactions = replies.drive_reactions
        names = [element_name(query.target, i) for i in subscripts(query.type.shape)]
        if all(n in drive_reactions for n in names):
            return [drive_reactions[n] for n in names]
        return replies.multipliers.get(query.target)

    def centre(query: Query) -> Sequence[Node] | None:
        frame = system.lowering.frame(query.arguments[0]) if query.arguments else None
        return mass_centre(system, frame)

    def tensor(query: Query) -> Sequence[Node] | None:
        rows = inertia_tensor(system, system.lowering.frame(query.arguments[0]))
        return None if rows is None else [entry for row in rows for entry in row]

    rules: dict[str, Answer] = {
        "mass_centre": centre,
        "inertia_tensor": tensor,
        "energy": lambda q: [energies.total],
        "kinetic_energy": lambda q: [energies.kinetic],
        "potential_energy": lambda q: [energies.potential],
        "momentum": momentum,
        "power": power,
        "multiplier": multiplier,
        "reaction": reaction,
        "moment": moment,
        "closed": closed,
    }
    result: dict[Node, Node] = {}
    groups: dict[int, tuple[Query, list[Node]]] = {}
    for symbol, query in system.queries.items():
        groups.setdefault(id(query), (query, []))[1].append(symbol)
    for query, symbols in groups.values():
        found = rules[query.function](query) if query.function in rules else None
        if found is None:
            what = f"{query.function}({query.target})"
            reporter.error(
                "E0522",
                f"'{what}' has no answer in this model",
                query.span,
                caption=_reason(query),
            )
            found = [graph.zero] * len(symbols)
        result.update(zip(symbols, found, strict=True))
    return result


def _reason(query: Query) -> str:
    match query.function:
        case "momentum":
            return "no free coordinate of this name"
        case "power":
            return "no force, torque, damping or friction of this name"
        case "multiplier":
            return "no constraint of this name"
        case "reaction":
            return "neither a driven coordinate nor a joint whose reaction is available"
        case "mass_centre" | "inertia_tensor":
            return "no mass moves with this frame"
        case _:
            return "not available for this element"
