"""Answers to questions about named elements: momenta, energies, multipliers, reactions, powers.

Forces and moments of joints are read from the residual along virtual displacements (mechanics/kinematics/reactions.py).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from msgspec import Struct

from mechc.lang.diagnostics import Reporter

from ...flat.model import Query, friction_name
from ...flat.subscripts import element_name, subscripts
from ...graph import Node
from ...graph.differentiate import vjp
from ...mechanics.system import MechanicalSystem
from ..rows.residual import energy_efforts, seeds_of
from .energies import Energies


class Replies(Struct, frozen=True):
    """What elimination knows about named elements.

    ``multipliers`` by constraint; ``dropped``: multipliers of rows that are left out; ``drive_reactions`` by
    coordinate; ``joint_reactions``: (force, moment) on the ``to`` side, world components, by joint.
    """

    multipliers: Mapping[str, tuple[Node, ...]]
    dropped: frozenset[Node]
    drive_reactions: Mapping[str, Node]
    joint_reactions: Mapping[str, tuple[tuple[Node, ...], tuple[Node, ...]]]


def force_answers(system: MechanicalSystem, replies: Replies) -> dict[Node, Node]:
    """Return the answers to questions about forces, in multipliers and accelerations, by the symbols for them."""
    result: dict[Node, Node] = {}
    for query, symbols in _symbols_by_question(system):
        found = _force(system, replies, query)
        if found is not None:
            result |= zip(symbols, found, strict=True)
    return result


def answers(
    system: MechanicalSystem, energies: Energies, replies: Replies, reporter: Reporter
) -> dict[Node, Node]:
    """Return the node for each symbol that stands for an answer; report questions without one."""
    result: dict[Node, Node] = {}
    for query, symbols in _symbols_by_question(system):
        found = _answer(system, energies, replies, query)
        if found is None:
            _unanswered(system, query, reporter)
            found = [system.graph.zero] * len(symbols)
        elif query.function == "multiplier" and not replies.dropped.isdisjoint(found):
            reporter.error(
                "E0525",
                f"'multiplier({query.target})' is not unique",
                query.span,
                caption="this constraint repeats others, so its force cannot be told from theirs",
                help="remove the constraint, or ask for the reaction of one that is kept",
            )
        result |= zip(symbols, found, strict=True)
    return result


def refuse_unanswered(system: MechanicalSystem, nodes: Sequence[Node], reporter: Reporter) -> None:
    """Report questions in what the motion follows that have no answer in the state, and stop if there are any."""
    questions = system.lowering.questions
    asked = {id(q): q for n in questions.symbols_in(nodes) if not questions.is_force(q := questions.asked[n])}
    for query in asked.values():
        _unanswered(system, query, reporter)
    if asked:
        reporter.stop_on_errors()


def _unanswered(system: MechanicalSystem, query: Query, reporter: Reporter) -> None:
    reporter.error(
        "E0522",
        f"'{query.function}({query.target})' has no answer in this model",
        query.span,
        caption=_reason(query),
        help=_instead(system, query),
    )


def _symbols_by_question(system: MechanicalSystem) -> list[tuple[Query, list[Node]]]:
    """Return each question with the symbols that stand for the numbers of its answer."""
    groups: dict[int, tuple[Query, list[Node]]] = {}
    for symbol, query in system.queries.items():
        groups.setdefault(id(query), (query, []))[1].append(symbol)
    return list(groups.values())


def _answer(
    system: MechanicalSystem, energies: Energies, replies: Replies, query: Query
) -> Sequence[Node] | None:
    """Return the numbers of an answer in row-major order; None where there is none."""
    match query.function:
        case "energy":
            return [energies.total]
        case "kinetic_energy":
            return [energies.kinetic]
        case "potential_energy":
            return [energies.potential]
        case "momentum":
            return _momentum(system, energies, query.target)
        case _ if not system.lowering.questions.is_force(query):
            return system.lowering.questions.answer(query)
        case _:
            return _force(system, replies, query)


def _force(system: MechanicalSystem, replies: Replies, query: Query) -> Sequence[Node] | None:
    """Answer a question about a force; None for any other."""
    match query.function:
        case "multiplier":
            names = [element_name(query.target, i) for i in subscripts(query.type.shape)]
            found = replies.multipliers.get(query.target)
            if found is None and all(
                n in replies.multipliers for n in names
            ):  # a friction in several directions
                found = tuple(replies.multipliers[n][0] for n in names)
            if found is None and any(query.target in (c, friction_name(c)) for c in system.lowering.apart):
                found = (system.graph.zero,) * len(names)
            return found
        case "moment" if query.target in replies.joint_reactions:
            return replies.joint_reactions[query.target][1]
        case "reaction" if query.target in replies.joint_reactions:
            return replies.joint_reactions[query.target][0]
        case "reaction":
            names = [element_name(query.target, i) for i in subscripts(query.type.shape)]
            if all(n in replies.drive_reactions for n in names):
                return [replies.drive_reactions[n] for n in names]
            return replies.multipliers.get(query.target)  # of a drive that is released
        case "power" if system.lowering.questions.is_force(query):
            return _friction_power(system, replies, query.target)
        case _:
            return None


def _momentum(system: MechanicalSystem, energies: Energies, target: str) -> Sequence[Node] | None:
    rates = zip(system.v, energies.momenta, strict=True)
    found = [p for rate, p in rates if rate.variable.name == target]
    known = [p for p in found if p is not None]
    return known if found and len(known) == len(found) else None


def _friction_power(system: MechanicalSystem, replies: Replies, target: str) -> Sequence[Node] | None:
    rows = next((rows for rows in system.constraints if rows.name == target), None)
    return None if rows is None else [system.graph.mul(replies.multipliers[target][0], rows.residuals[0])]


def _instead(system: MechanicalSystem, query: Query) -> str:
    """Say what can be asked instead of a reaction that is none: the joint of a coordinate, a drive."""
    if query.function not in ("reaction", "moment"):
        return ""
    joints = {name: joint.name for joint in system.model.joints for name in joint.coordinates}
    if query.target in joints:
        return (
            f"'{query.target}' moves freely: 'reaction({joints[query.target]})' is the force in the joint, and "
            f"'drive {query.target} = ..;' gives its coordinate a reaction"
        )
    driven = [name for row in system.drives for name in row.names]
    ours = [name for name in driven if name.startswith(f"{query.target}[")]
    if ours:
        return (
            f"of '{query.target}' only {', '.join(ours)} {'is' if len(ours) == 1 else 'are'} driven, and an answer is that of the whole array: "
            "give what is driven a coordinate of its own"
        )
    known = [*dict.fromkeys([*(joint.name for joint in system.model.joints), *driven])][:6]
    return f"there are {', '.join(f'{query.function}({name})' for name in known)}" if known else ""


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


def joint_reactions(
    system: MechanicalSystem, multipliers: Sequence[Sequence[Node]]
) -> dict[str, tuple[tuple[Node, ...], tuple[Node, ...]]]:
    """Return (force, moment) on the ``to`` side of each joint that was asked for, in world components.

    The residual along the virtual rates of a tree joint is the force that moves what it carries. For a closure, where
    the joint alone is displaced, it is minus the force of its own multipliers and of what acts on its coordinates.
    """
    graph, kinematics = system.graph, system.kinematics
    closing = {joint.name for joint in system.topology.closures}
    result = {}
    along = [rate for moved in system.virtual.values() for rate in (*moved.force_rates, *moved.moment_rates)]
    found = iter(vjp(graph, seeds_of(system, multipliers), along) if along else ())
    for name, moved in system.virtual.items():
        efforts = [graph.add(next(found), share) for share in energy_efforts(system, moved)]
        if name in closing:
            efforts = [graph.neg(e) for e in efforts]
        size = kinematics.size
        force = kinematics.to_world(moved.frame, tuple(efforts[:size]))
        moment = tuple(efforts[size:])
        if size == 3:
            moment = kinematics.to_world(moved.frame, moment)
        result[name] = (tuple(force), tuple(moment))
    return result
