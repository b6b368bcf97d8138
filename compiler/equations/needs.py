"""What the equations of a model need, as facts; the one place where it is decided what is left out.

Targets own the tables from a fact to files and functions (``targets/``); ``mechc explain`` prints the choices.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Sequence

from msgspec import Struct

from mechc.runtime.interface import COMPLIANCE

from ..graph import Node
from ..graph.operations import LOOKUP, SELECT
from ..mechanics.system import MechanicalSystem
from .model import SINGULAR, SINGULAR_MASS, Choice, Function, HybridPlan
from .reported.entries import Layout
from .solve.solved import Solved

FACTS = {
    "space": "three dimensions",
    "rotations": "quaternions and their normalisation",
    "constraints": "multipliers, projection and assembly",
    "events": "the search for events",
    "delays": "the history that delays look back at",
    "modes": "contacts, friction and constraints that switch",
    "inputs": "inputs and their tables",
    "tables": "look-up tables",
    "discrete": "discrete variables",
    "time": "explicit time",
    "drives": "prescribed motions and their reactions",
    "gravity": "weight",
    "dissipation": "the account of dissipated energy",
    "supply": "the account of supplied energy",
    "states": "first-order states",
    "assertions": "assertions",
}
"""What may be needed, in words."""


class BuiltPart(Struct, frozen=True):
    """Something that can be built whether it is needed or not: ``words``, the facts that need it, and what is said
    where it is left out. ``studied``: no run needs it, only questions of another kind, or a method
    that some models refuse."""

    words: str
    needed_by: tuple[str, ...]
    absence: str
    studied: bool = False


PARTS = {
    "jacobian": BuiltPart(
        "the Jacobian of implicit methods",
        ("jacobian",),
        "no implicit method is asked for; one that is brings it",
    ),
    "momenta": BuiltPart(
        "momenta, forces and the mass matrix as functions",
        ("momenta",),
        "no structure-preserving method for constraints is asked for; one that is brings them",
    ),
    "series": BuiltPart(
        "Taylor series of the rates",
        (),
        "the method 'taylor' is not asked for; it brings them",
        studied=True,
    ),
    "local_derivatives": BuiltPart(
        "derivatives of rates, outputs and constraints at a state",
        (),
        "no study asks for them; one that does brings them",
        studied=True,
    ),
    "contact_steps": BuiltPart(
        "places for the forces of many contacts that steps solve for",
        (),
        "the method 'moreau' is not asked for; it brings them",
        studied=True,
    ),
    "second_order": BuiltPart(
        "derivatives of the equations of motion before they are solved",
        (),
        "no study asks for them; one that does brings them",
        studied=True,
    ),
    "phase": BuiltPart(
        "momenta, energy and outputs with their rates and gradients",
        (),
        "no study that looks for what is constant is asked for; one that is brings them",
        studied=True,
    ),
    "matter": BuiltPart(
        "masses and inertias where they are",
        (),
        "no study asks for them; one that does brings them",
        studied=True,
    ),
    "functions": BuiltPart(
        "mass matrix, bias, inverse dynamics, energies and Jacobians as functions for others",
        (),
        "nobody asks for them; `model.functions` brings them",
        studied=True,
    ),
    "growth": BuiltPart(
        "a change of the motion and the logarithm of its growth as states",
        (),
        "no exponents of many runs are asked for; they bring it",
        studied=True,
    ),
    "bends": BuiltPart(
        "kinks of tables and of energies as they stand, where runs would stop",
        (),
        "a run stops at kinks of tables and of energies",
        studied=True,
    ),
    "projection": BuiltPart(
        "projection onto constraints after each step", ("constraints",), "there are no constraints"
    ),
    "events": BuiltPart("the search for events in each step", ("events",), "nothing switches"),
    "accounts": BuiltPart(
        "accounts of supplied and dissipated energy",
        ("supply", "dissipation"),
        "nothing supplies energy, or nothing dissipates it",
    ),
    "reactions": BuiltPart("the multipliers as outputs", (), "what is not asked for is not reported"),
    "positions": BuiltPart(
        "the place of every mass as an output", (), "what is not asked for is not reported"
    ),
    "scene": BuiltPart("places and sizes of what is drawn", (), "nothing asks for a picture"),
    "constants": BuiltPart(
        "formulas of parameters in each evaluation", (), "they are computed once, before the run"
    ),
    "exchanged": BuiltPart(
        "a curve over a parameter, with its independent variable as a coordinate",
        (),
        "no slope is infinite; where one is, the search for the curve brings it",
        studied=True,
    ),
    "formulas": BuiltPart(
        "what steps find as formulas that have its derivatives",
        (),
        "its value is what steps find; libraries that differentiate programs read the formulas",
        studied=True,
    ),
    "loops": BuiltPart(
        "what steps find, by loops of a library", (), "the steps are written out", studied=True
    ),
    "structure": BuiltPart(
        "factorisation of the mass matrix as a whole",
        (),
        "the accelerations are eliminated along the structure",
    ),
}
"""What the equations decide to leave out; ``--keep-all`` builds it all the same. Targets own the tables from a part to
functions and files."""

EVERYTHING = frozenset(name for name, part in PARTS.items() if not part.studied)
"""Every part of a model that is run."""

NEVER = "never"
"""The text of the switch that stands for all where nothing switches (hybrid/)."""


def needs(
    system: MechanicalSystem, layout: Layout, functions: Sequence[Function], plan: HybridPlan | None = None
) -> frozenset[str]:
    """Return the facts that hold for a model."""
    graph = system.graph
    rhs = next(f for f in functions if f.name == "rhs")
    facts = {
        "space": system.kinematics.size == 3 and system.model.space == 3,
        "rotations": bool(system.rotations),
        "constraints": bool(system.constraints),
        "events": bool(system.branches)
        or (plan is not None and bool(plan.rows or plan.clocks))
        or (plan is not None and plan.delays is not None)
        or (plan is not None and any(s.text != NEVER for s in (*plan.switches, *plan.times))),
        "delays": plan is not None and plan.delays is not None,
        "modes": any(rows.mode is not None for rows in system.constraints),
        "inputs": bool(layout.inputs),
        "tables": _has_tables(system, functions),
        "discrete": bool(layout.discretes),
        "time": graph.depend(rhs.outputs, [system.symbols.time]),
        "drives": any(not row.balanced for row in system.drives),
        "gravity": any(m.field is not None for m in system.masses),
        "dissipation": "energy.dissipated" in layout.accounts,
        "supply": "energy.supplied" in layout.accounts,
        "states": bool(system.symbols.states or layout.first_order),
        "assertions": any(f.name == "assertions" for f in functions),
    }
    return frozenset(name for name, holds in facts.items() if holds)


def _has_tables(system: MechanicalSystem, functions: Sequence[Function]) -> bool:
    graph = system.graph
    if not graph.tables:
        return False
    outputs: list[Node] = [n for f in functions for n in f.outputs]
    return any(graph.op(n) == LOOKUP for n in graph.reach(outputs))


def choices(
    system: MechanicalSystem, solved: Solved, facts: frozenset[str], parts: Collection[str] = ()
) -> tuple[Choice, ...]:
    """Return the decisions taken for a model, each with its reason."""
    result = [_form(system, solved)]
    apart = independent(system, solved)
    if len(apart) > 1:
        sizes = ", ".join(str(n) for n in apart)
        reason = f"parts of {sizes} accelerations do not act on each other's"
        result.append(Choice("independent subsystems", "solved apart", reason, fact="coordinates"))
    if any(row.give is not None for row in solved.rows):
        reason = "the mechanism meets positions in which constraints depend on each other"
        if COMPLIANCE in parts:
            reason = "a run has met a position in which constraints depend on each other"
        result.append(Choice(SINGULAR, "multipliers with a compliance of 1e-9", reason, fact="constraints"))
    if any(row.weight is not None for row in solved.rows):
        reason = "nothing has inertia along motions that only the constraints decide"
        result.append(Choice(SINGULAR_MASS, "constraints with weights in it", reason, fact="massless"))
    for fact, words in FACTS.items():
        kept = fact in facts
        result.append(Choice(words, "needed" if kept else "left out", _reason(fact, kept), fact=fact))
    for name, part in PARTS.items():
        if not facts.intersection(part.needed_by) and (name in parts or not part.studied):
            kept = name in parts
            why = "it was asked for" if kept else part.absence
            result.append(Choice(part.words, "kept" if kept else "left out", why, part=name))
    return tuple(result)


def independent(system: MechanicalSystem, solved: Solved) -> tuple[int, ...]:
    """Return the sizes of the groups of accelerations that the equations of motion couple, the largest first."""
    graph = system.graph
    group = {system.a[i]: system.a[i] for i in solved.free}
    group |= {row.multiplier: row.multiplier for row in solved.rows}

    def root(n: Node) -> Node:
        while group[n] != n:
            group[n] = n = group[group[n]]
        return n

    own = [(system.a[i], solved.residual[i]) for i in solved.free]
    own += [(row.multiplier, row.equation) for row in solved.rows]
    within = {n: n for n in group}  # an unknown of each node that has any; the others are in its group
    left, right, code = graph._left, graph._right, graph._code
    for n in graph.reach_of([equation for _, equation in own], group):
        if not (left[n] in within or right[n] in within or code[n] == SELECT):
            continue
        found = [within[x] for x in graph.args(n) if x in within]
        if found:
            within[n] = found[0]
        for other in found[1:]:
            group[root(other)] = root(found[0])
    for unknown, equation in own:
        if equation in within:
            group[root(within[equation])] = root(unknown)
    sizes = Counter(root(system.a[i]) for i in solved.free)
    return tuple(sorted(sizes.values(), reverse=True))


def _form(system: MechanicalSystem, solved: Solved) -> Choice:
    moving = system.symbols.positions | system.symbols.velocities | {system.symbols.time}
    constant = not system.graph.depend(solved.pivots, moving)
    form = "constant mass matrix, factorised once" if constant else solved.method
    count = len(system.v)
    reason = f"{solved.operations} operations for {count} acceleration{'s' if count != 1 else ''}"
    return Choice("accelerations", form, reason, fact="inertia")


def _reason(fact: str, kept: bool) -> str:
    return "the equations contain it" if kept else "nothing in the equations asks for it"
