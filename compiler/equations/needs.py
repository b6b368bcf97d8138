"""What the equations of a model need, as facts; the one place where it is decided what is left out.

Targets own the tables from a fact to files and functions (``targets/``); ``mechc explain`` prints the choices.
"""

from __future__ import annotations

from collections.abc import Sequence

from ..graph import Node
from ..mechanics.system import MechanicalSystem
from .entries import Layout
from .model import Choice, Function
from .solve import Solved

FACTS = {
    "space": "three dimensions",
    "rotations": "quaternions and their normalisation",
    "constraints": "multipliers, projection and assembly",
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


def needs(system: MechanicalSystem, layout: Layout, functions: Sequence[Function]) -> frozenset[str]:
    """Return the facts that hold for a model."""
    graph = system.graph
    rhs = next(f for f in functions if f.name == "rhs")
    support = set(graph.support(*rhs.outputs))
    facts = {
        "space": system.kinematics.size == 3 and _is_spatial(system),
        "rotations": bool(system.rotations),
        "constraints": bool(system.constraints),
        "inputs": bool(layout.inputs),
        "tables": _has_tables(system, functions),
        "discrete": bool(layout.discretes),
        "time": system.symbols.time in support,
        "drives": bool(system.drives),
        "gravity": any(m.field is not None for m in system.masses),
        "dissipation": "energy.dissipated" in layout.accounts,
        "supply": "energy.supplied" in layout.accounts,
        "states": bool(system.symbols.states),
        "assertions": bool(system.assertions),
    }
    return frozenset(name for name, holds in facts.items() if holds)


def _is_spatial(system: MechanicalSystem) -> bool:
    return system.model.space == 3


def _has_tables(system: MechanicalSystem, functions: Sequence[Function]) -> bool:
    from ..graph.operations import LOOKUP

    graph = system.graph
    outputs: list[Node] = [n for f in functions for n in f.outputs]
    return any(graph.op(n) == LOOKUP for n in graph.reach(outputs))


def choices(system: MechanicalSystem, solved: Solved, facts: frozenset[str]) -> tuple[Choice, ...]:
    """Return the decisions taken for a model, each with its reason."""
    result = [_form(system, solved)]
    if any(row.give is not None for row in solved.rows):
        reason = "the mechanism meets positions in which constraints depend on each other"
        result.append(Choice("singular positions", "multipliers with a compliance of 1e-10", reason))
    for fact, words in FACTS.items():
        kept = fact in facts
        result.append(Choice(words, "needed" if kept else "left out", _reason(fact, kept)))
    return tuple(result)


def _form(system: MechanicalSystem, solved: Solved) -> Choice:
    graph = system.graph
    moving = {s.node for s in (*system.q, *system.v)} | {system.symbols.time}
    constant = not any(moving.intersection(graph.support(p)) for p in solved.pivots)
    form = "constant mass matrix, factorised once" if constant else solved.method
    count = len(system.v)
    reason = f"{solved.operations} operations for {count} accelerations"
    return Choice("accelerations", form, reason)


def _reason(fact: str, kept: bool) -> str:
    return "the equations contain it" if kept else "nothing in the equations asks for it"
