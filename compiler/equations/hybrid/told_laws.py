"""Laws that ask for forces, or for what is closed, where steps solve for contacts.

Such steps form the rates without contacts and frictions, whose impulses they find: a law that asks there finds nothing. It is told
instead what held at the beginning of the step, in the modes that the step before left: z has a place for each answer, and one that is 1
while a step forms its rates. What events run reads formulas.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from msgspec import Struct
from msgspec.structs import replace

from ...graph import Node
from ...graph.rewrite import substitute
from ...mechanics.system import EffortPairs, MechanicalSystem
from ..model import Function
from ..solve.solved import Solved

TOLD = "told"
"""The function of the answers."""


class ToldLaws(Struct, frozen=True):
    """``told``: the symbol that is 1 while a step forms its rates; ``places``: of the ``answers``."""

    told: Node
    places: tuple[Node, ...]
    answers: tuple[Node, ...]

    @property
    def symbols(self) -> tuple[Node, ...]:
        """All of them, in the order of their numbers in z."""
        return (self.told, *self.places)


def with_told_laws(system: MechanicalSystem) -> tuple[MechanicalSystem, ToldLaws | None]:
    """Return a system whose forces, dissipation and rates of states are told of what they ask; as it is where they ask for nothing."""
    flags = {
        rows.mode.flag for rows in system.constraints if rows.mode is not None and rows.mode.smooth is None
    }
    if not flags:
        return system, None
    graph, questions = system.graph, system.lowering.questions
    efforts = [n for e in system.efforts if not _holds(system, e) for _, n in e.pairs]
    rates = _settled(system, list(system.xdot.values()))
    laws = [*efforts, system.dissipation]
    forces = questions.forces_in([*laws, *rates])
    read = set(graph.support(*laws, *rates))
    closed = sorted(flags & read)
    moved = sorted(set(system.a) & set(graph.support(*rates)))  # what adds to a mass acts at once
    asked = [*forces, *closed, *moved]
    if not asked:
        return system, None
    told = graph.symbol("told")
    places = tuple(graph.symbol(f"told({graph.name(n)})") for n in asked)
    put = {n: graph.select(told, place, n) for n, place in zip(asked, places, strict=True)}
    of_laws = {n: put[n] for n in (*forces, *closed)}
    known = system.lowering.relations  # of what is told, too: switches that turn at events
    known |= dict.fromkeys(map(graph.unsigned, substitute(graph, questions.settle(list(known)), put)))
    system = replace(
        system,
        efforts=tuple(e if _holds(system, e) else _with(system, e, of_laws) for e in system.efforts),
        dissipation=substitute(graph, [system.dissipation], of_laws)[0],
        xdot=dict(zip(system.xdot, substitute(graph, rates, put), strict=True)),
    )
    return system, ToldLaws(told, places, tuple(asked))


def told_function(system: MechanicalSystem, solved: Solved, laws: ToldLaws) -> Function:
    """Return the function of what laws are told, of a state and its modes."""
    graph = system.graph
    rests = {
        row.constraint.mode.flag: graph.logical_or(row.constraint.mode.flag, share.rests)
        for row in solved.switched
        if row.constraint.mode is not None and (share := solved.shared.get(row.multiplier)) is not None
    }
    answers = [rests.get(n, n) for n in laws.answers]
    return Function(TOLD, "what laws are told of forces and contacts", solved.resolve(answers))


def _settled(system: MechanicalSystem, nodes: Sequence[Node]) -> list[Node]:
    """Return formulas with answers about what is closed put in."""
    questions = system.lowering.questions
    asked = [n for n in questions.symbols_in(nodes) if questions.asked[n].function == "closed"]
    return substitute(system.graph, nodes, dict(zip(asked, questions.settle(asked), strict=True)))


def _with(system: MechanicalSystem, effort: EffortPairs, put: Mapping[Node, Node]) -> EffortPairs:
    """Return a force with other answers."""
    rates, values = zip(*effort.pairs, strict=True)
    return replace(effort, pairs=tuple(zip(rates, substitute(system.graph, values, put), strict=True)))


def _holds(system: MechanicalSystem, effort: EffortPairs) -> bool:
    """Tell whether a force is the one that holds a constraint, which is found with it."""
    names = {f"{rows.name.partition('[')[0]}.own" for rows in system.constraints}
    return effort.name.partition("[")[0] in names
