"""Crowds: contacts so many that no formula finds their forces; the rows of a model that are set apart for numbers.

What holds of them is found at run time over those that touch (kernel/crowd.h). Contacts whose gaps differ in nothing but
in what they read are one kind: the code of a kind is formed once, for the first of its members.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import assert_never

from msgspec import Struct
from msgspec.structs import replace

from mechc.lang.diagnostics import Reporter

from ...flat.model import Unlike
from ...graph import Node
from ...mechanics.families import FamilyRows
from ...mechanics.modes import CheckAction, EndAction, ImpulseAction, SetAction
from ...mechanics.system import ConstraintRows, MechanicalSystem
from ..model import Equations, Function
from .modes import MOST_ROWS


class CrowdMember(Struct, frozen=True):
    """One contact of a crowd: the row of its gap and those of its friction, one for each direction; ``forces`` and ``flag`` are the
    symbols of the forces of these rows and of whether it is closed."""

    gap: ConstraintRows
    friction: tuple[ConstraintRows, ...]
    forces: tuple[Node, ...]
    flag: Node


def set_apart(
    system: MechanicalSystem, reporter: Reporter
) -> tuple[MechanicalSystem, tuple[CrowdMember, ...]]:
    """Return the system without the contacts that are found by numbers, and these; none where they are few."""
    switching = [rows for rows in system.constraints if rows.mode is not None and rows.mode.smooth is None]
    count = sum(len(rows.residuals) for rows in switching)
    if count <= MOST_ROWS and not system.families:
        return system, ()
    named = {rows.name for rows in switching}
    smooth = {rows.mode.contact for rows in system.constraints if rows.mode is not None and rows.mode.smooth}
    if any(one.family.contact not in named or one.family.contact in smooth for one in system.families):
        raise Unlike  # a contact of several parts, or of a smooth law
    others = [rows for rows in system.constraints if rows.mode is not None and not _belongs(rows)]
    if others:
        raise reporter.fail(
            "E0720",
            f"the model has {count + sum(map(derived, system.families))} rows of contacts, friction and constraints that switch, more than {MOST_ROWS}",
            others[0].origin.shown,
            caption="so many rows may only be contacts and their friction, not this one",
            help="remove contacts between shapes that never touch in your motion, leave this one out, or write it as a smooth force",
        )
    graph = system.graph
    members: list[CrowdMember] = []
    for rows in switching:
        assert rows.mode is not None
        force = graph.symbol(f"#crowd force {rows.name}")
        if rows.mode.kind == "contact":
            members.append(CrowdMember(rows, (), (force,), rows.mode.flag))
        else:
            last = members[-1]
            members[-1] = replace(last, friction=(*last.friction, rows), forces=(*last.forces, force))
    kept = tuple(rows for rows in system.constraints if rows.mode is None)
    return replace(system, constraints=kept), tuple(members)


def derived(rows: FamilyRows) -> int:
    """Return how many contacts of a family are told by what they read."""
    family = rows.family
    return sum(len(family.labels) - start for start in family.starts) - 1


def _belongs(rows: ConstraintRows) -> bool:
    """Tell whether a row is one that a crowd may have."""
    mode = rows.mode
    if mode is None or mode.smooth is not None or mode.enabled is not None:
        return False
    return mode.kind == "contact" or bool(mode.contact)


def forces_by_name(system: MechanicalSystem, members: Sequence[CrowdMember]) -> dict[str, tuple[Node, ...]]:
    """Return the symbols of the forces by the names that questions use: those of the parts of a gap together, and those of
    constraints, to which contacts add, where questions ask for them."""
    if not members:
        return {}
    found = _of_constraints(system)
    for member in members:
        for rows, force in zip((member.gap, *member.friction), member.forces, strict=True):
            assert rows.mode is not None
            found[rows.name] = (force,)
            whole = rows.mode.whole
            if whole and whole != rows.name:  # a part of its gap
                found[whole] = (system.graph.add(found.get(whole, (system.graph.zero,))[0], force),)
    return found


def _of_constraints(system: MechanicalSystem) -> dict[str, tuple[Node, ...]]:
    """Return a symbol for each multiplier of the constraints that questions name."""
    named = {query.target for query in system.queries.values() if query.function == "multiplier"}
    found: dict[str, tuple[Node, ...]] = {}
    for rows in system.constraints:
        if rows.name in named:
            before = found.get(rows.name, ())
            numbers = range(len(before), len(before) + len(rows.residuals))
            found[rows.name] = (
                *before,
                *(system.graph.symbol(f"#force of {rows.name}.{k}") for k in numbers),
            )
    return found


REFUSED = {
    "jacobian": "the Jacobian of implicit methods",
    "momenta": "a structure-preserving method",
    "series": "the method 'taylor'",
    "local_derivatives": "derivatives at a state",
    "second_order": "derivatives of the equations of motion",
    "phase": "the search for constants of the motion",
    "functions": "functions for others",
}
"""Parts that would need formulas of the forces."""


def check_crowd(
    system: MechanicalSystem, members: Sequence[CrowdMember], parts: Collection[str], reporter: Reporter
) -> None:
    """Report what asks for formulas of the forces of a crowd, or of accelerations, which these are in."""
    asked = [words for part, words in REFUSED.items() if part in parts]
    accelerations = set(system.a)
    found = set(system.graph.support(*system.xdot.values(), *(b.condition for b in system.branches)))
    found |= set(system.graph.support(*(a.condition for a in system.assertions), *_acted(system)))
    if found & accelerations:
        asked.append("an acceleration in an equation, a condition, an action or an assertion")
    if any(query.function in ("reaction", "moment") for query in system.queries.values()):
        asked.append("a reaction")
    laws = [n for e in system.efforts for _, n in e.pairs]
    laws += [*system.xdot.values(), *(b.condition for b in system.branches)]
    always = {rows.name for rows in system.constraints}
    forces = [system.queries[n] for n in system.lowering.questions.forces_in(laws)]
    if any(query.target in always for query in forces):
        asked.append("the force of a constraint in something that is not an output")
    if asked:
        raise _unformed(system, members, asked[0], reporter)


def _acted(system: MechanicalSystem) -> list[Node]:
    """Return the formulas of what branches do."""
    found: list[Node] = []
    for action in (action for branch in system.branches for action in branch.actions):
        match action:
            case SetAction(values=values):
                found += values
            case ImpulseAction(pairs=pairs):
                found += [impulse for _, impulse in pairs]
            case CheckAction(condition=condition):
                found.append(condition)
            case EndAction():
                pass
            case _:
                assert_never(action)
    return found


def check_askers(
    system: MechanicalSystem,
    members: Sequence[CrowdMember],
    functions: Sequence[Function],
    found_apart: Collection[Node],
    reporter: Reporter,
) -> None:
    """Report formulas other than outputs that read the forces of a crowd, those that it adds to, or which of its contacts are closed."""
    symbols = {n for m in members for n in (*m.forces, m.flag)} | {*found_apart}
    sticks = {rows.mode.flag for m in members for rows in m.friction if rows.mode is not None}
    for function in functions:
        if sticks & set(system.graph.support(*function.outputs)):
            raise _unformed(system, members, "whether the friction of a contact sticks", reporter)
        if function.name != "outputs" and symbols & set(system.graph.support(*function.outputs)):
            raise _unformed(
                system,
                members,
                "a force, or whether a contact is closed, in something that is not an output",
                reporter,
            )


def _unformed(
    system: MechanicalSystem, members: Sequence[CrowdMember], asked: str, reporter: Reporter
) -> Exception:
    count = len(members) + sum(derived(one) for one in system.families)
    return reporter.fail(
        "E0722",
        f"{asked} needs formulas, and the forces of {count} contacts are found by numbers",
        members[0].gap.origin.shown,
        caption="the first of these contacts",
        help="more than 64 rows of contacts and friction have no formula: outputs may ask for 'multiplier(c)' and 'closed(c)', "
        "or use fewer contacts",
    )


def check_forces_have_formulas(equations: Equations) -> None:
    """Report a crowd where the motion is to be differentiated. Raises CompileError."""
    crowd = equations.switching.crowd if equations.switching is not None else None
    if crowd is not None:
        raise Reporter().fail(
            "E0722",
            f"a derivative of the motion needs formulas, and the forces of {crowd.count} contacts are found by numbers",
            crowd.lines[0].span,
            caption="the first of these contacts",
            help="use up to 64 rows of contacts and friction, or compare runs",
        )
