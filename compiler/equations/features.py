"""What equations hold beside the motion itself: a row for each feature, in the order in which they are built.

A feature adds functions to a draft of the equations, and the fields of ``Equations`` that describe them. To add one, write its
functions in a file of their own and its row here; one that is built on request has its name in ``PARTS`` of needs.py.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

from msgspec import Struct, field

from mechc.lang.diagnostics import Reporter

from ..graph import Node
from ..graph.differentiate import jacobian
from ..mechanics.system import MechanicalSystem
from .hybrid.crowd import Crowd
from .hybrid.plans import names_of
from .hybrid.switching import add_events
from .model import Function, Slot
from .reported.assembly import assembly
from .reported.balance import balance_of
from .reported.entries import Layout
from .reported.experiments import experiment_plans
from .reported.initial_unknowns import InitialUnknowns
from .reported.output_systems import systems_of
from .reported.outputs import OutputList
from .rows.crowd import CrowdMember, check_askers
from .solve.shares import check_derivatives
from .solve.solved import Solved
from .timed_tables import timed_tables

if TYPE_CHECKING:
    from .hybrid.told_laws import ToldLaws


class Draft(Struct, eq=False):
    """Equations while features are added. ``functions`` come first in the code, those ``behind`` after them; ``described``: fields of
    ``Equations`` by name; ``slots``: places of symbols beyond those of the layout."""

    system: MechanicalSystem
    solved: Solved
    layout: Layout
    listed: OutputList
    found: InitialUnknowns
    members: tuple[CrowdMember, ...]
    crowd: Crowd | None
    laws: ToldLaws | None
    reporter: Reporter
    parts: frozenset[str]
    functions: list[Function]
    behind: list[Function] = field(default_factory=list)
    slots: dict[Node, Slot] = field(default_factory=dict)
    described: dict[str, Any] = field(default_factory=dict)

    def function(self, name: str) -> Function:
        return next(f for f in self.functions if f.name == name)


class Feature(Struct, frozen=True):
    """``always``: every model is asked whether it has it; else only where the part of that name is."""

    name: str
    build: Callable[[Draft], None]
    always: bool = False


def _assembly(draft: Draft) -> None:
    entries, functions = assembly(draft.system, draft.solved, draft.layout, draft.found, draft.reporter)
    draft.functions += functions
    if draft.found.parameters:
        doc = "the parameters that the start finds"
        values = draft.solved.resolve(list(draft.found.parameters.values()))
        draft.functions.append(Function("found", doc, values))
        draft.described["found"] = tuple(draft.found.parameters)
    draft.described["assembly"] = entries


def _balance(draft: Draft) -> None:
    if draft.members:
        return
    found = balance_of(draft.system, draft.solved)
    draft.functions += found.functions
    draft.described["balance"] = found.entries


def _momenta(draft: Draft) -> None:
    from .momenta import momentum_functions

    draft.functions += momentum_functions(draft.system, draft.solved)


def _events(draft: Draft) -> None:
    found = add_events(
        draft.system,
        draft.solved,
        draft.layout,
        tuple(draft.functions),
        draft.listed.entries,
        draft.reporter,
        draft.parts,
        draft.crowd,
        draft.laws,
    )
    if found is None:
        return
    draft.layout, draft.functions = found.layout, list(found.functions)
    draft.described["switching"] = found.plan
    draft.described["hybrid"] = names_of(found.plan)
    if found.jumps:
        draft.described["conserved"] = ()


def _timed_tables(draft: Draft) -> None:
    read = [n for f in draft.functions if f.name in ("rhs", "inputs") for n in f.outputs]
    points, arguments = timed_tables(draft.system, draft.solved, read)
    if points:
        doc = "arguments of tables and kinks of time, at time 0, and their rates"
        draft.behind.append(Function("timed_arguments", doc, arguments))
        draft.described["timed_points"] = points


def _experiments(draft: Draft) -> None:
    plans, functions = experiment_plans(draft.system, draft.layout, draft.reporter)
    draft.reporter.stop_on_errors()
    draft.behind += functions
    draft.described["experiments"] = plans


def _check_derivatives(draft: Draft, what: str, *names: str) -> None:
    functions = [f for f in draft.functions if f.name in names]
    check_derivatives(
        draft.system.graph, draft.described.get("switching"), draft.layout.slots, functions, what
    )


def _jacobian(draft: Draft) -> None:
    _check_derivatives(draft, "an implicit method", "rhs")
    derivatives, pattern = jacobian_of_rates(draft.system, draft.layout, draft.functions)
    draft.functions.append(derivatives)
    draft.described["jacobian_pattern"] = pattern


def _scene(draft: Draft) -> None:
    from .reported.scene import scene_of

    scene, functions = scene_of(draft.system, draft.solved, draft.layout, draft.reporter)
    draft.behind += functions
    draft.described["scene"] = scene


def _add_matrix(draft: Draft, function: Function, pattern: tuple[tuple[int, int], ...]) -> None:
    draft.functions.append(function)
    draft.described["patterns"] = {**draft.described.get("patterns", {}), function.name: pattern}


def _local_derivatives(draft: Draft) -> None:
    from .local_derivatives import local_derivatives

    _add_matrix(draft, *local_derivatives(draft.system, draft.solved, draft.layout, draft.functions))


def _second_order(draft: Draft) -> None:
    from .local_derivatives import bias, second_order

    _add_matrix(draft, *second_order(draft.system, draft.solved, draft.layout))
    draft.functions.append(bias(draft.system, draft.solved))


def _phase(draft: Draft) -> None:
    from .reported.phase import phase_functions

    _check_derivatives(draft, "the search for constants of the motion", "rhs")
    found = phase_functions(draft.system, draft.solved, draft.layout, draft.function("rhs").outputs)
    draft.functions += found.functions
    draft.described["phase"] = found.entries


def _matter(draft: Draft) -> None:
    from .reported.matter import matter_of

    found = matter_of(draft.system, draft.solved, draft.layout)
    draft.functions += found.functions
    draft.described["matter"] = found.entries
    draft.described["matter_size"] = sum(len(f.outputs) for f in found.functions)


def _sought(draft: Draft) -> None:
    if draft.crowd is not None:
        return
    found = systems_of(draft.system, draft.solved, draft.listed.entries)
    draft.behind += found.functions
    draft.slots |= found.slots
    draft.described |= {"given": found.given, "sought": found.plans}


def _crowd(draft: Draft) -> None:
    if draft.crowd is None:
        return
    draft.behind += draft.crowd.functions
    draft.slots |= draft.crowd.slots
    draft.described["given"] = draft.crowd.given
    functions = (*draft.functions, *draft.behind)
    check_askers(draft.system, draft.members, functions, draft.solved.found_apart, draft.reporter)


def _functions(draft: Draft) -> None:
    from .offered import offered
    from .sensitivities import passing_on

    layout = draft.layout
    given = offered(draft.system, draft.solved, layout, draft.functions, draft.listed.entries)
    count = len(layout.discretes)
    draft.slots |= {n: Slot("z", count + k) for k, n in enumerate(given.seeds)}
    switching = draft.described.get("switching")
    branches = () if switching is None else switching.branches
    every = (*draft.functions, *draft.behind, *given.functions)
    every = tuple(passing_on(every, branches, len(layout.states) + count, given.seeds))
    draft.functions, draft.behind = list(_with_zeros("discretes", every, draft.system, len(given.seeds))), []
    draft.described |= {"offers": given.offers, "discretes": (*layout.discretes, *given.entries)}


def _with_zeros(
    name: str, functions: Sequence[Function], system: MechanicalSystem, count: int
) -> tuple[Function, ...]:
    """Return functions with so many zeros after the results of one, which need not be there yet."""
    zeros = (system.graph.zero,) * count
    found = next((f for f in functions if f.name == name), Function(name, "initial discrete variables", ()))
    others = tuple(f for f in functions if f.name != name)
    return (*others, Function(name, found.doc, (*found.outputs, *zeros))) if zeros else tuple(functions)


FEATURES = (
    Feature("assembly", _assembly, always=True),
    Feature("balance", _balance, always=True),
    Feature("momenta", _momenta),
    Feature("events", _events, always=True),
    Feature("timed_tables", _timed_tables, always=True),
    Feature("experiments", _experiments, always=True),
    Feature("jacobian", _jacobian),
    Feature("scene", _scene),
    Feature("local_derivatives", _local_derivatives),
    Feature("second_order", _second_order),
    Feature("phase", _phase),
    Feature("matter", _matter),
    Feature("sought", _sought, always=True),
    Feature("crowd", _crowd, always=True),
    Feature("functions", _functions),
)


def jacobian_of_rates(
    system: MechanicalSystem, layout: Layout, functions: Sequence[Function]
) -> tuple[Function, tuple[tuple[int, int], ...]]:
    """Return the function of the entries of d(rhs)/dy that can differ from zero, and their places."""
    rhs = next(f for f in functions if f.name == "rhs")
    states = [n for n, slot in layout.slots.items() if slot.array == "y"]
    rows = jacobian(system.graph, rhs.outputs, states)
    still = layout.without_effect
    entries = [
        (i, j, n) for i, row in enumerate(rows) for j, n in sorted(row.items()) if states[j] not in still
    ]
    function = Function(
        "jacobian", "entries of d(rhs)/dy that can differ from zero", tuple(n for *_, n in entries)
    )
    return function, tuple((i, j) for i, j, _ in entries)
