"""What an assembly knows of a model besides its functions: ``mech_start`` of ``kernel/model.h``, made from the problem."""

from __future__ import annotations

from collections.abc import Sequence

from msgspec import Struct

from ..interface import PURE, AssemblyRow, ModelInterface


class StartFacts(Struct, frozen=True):
    """``rows``: stage, whether it must hold, 1 for a pure number, 2 for a length, 0 for anything else; ``size`` [nv] of the coordinate of each
    velocity, 0: the characteristic size of lengths, which is made from the parameters ``lengths`` that something uses. ``partner`` [nv]:
    the index of that coordinate, of the first entry of a rotation; ``rotations``: all of these."""

    nq: int
    nv: int
    rotations: Sequence[int]
    rows: Sequence[tuple[int, bool, int]]
    known: Sequence[bool]
    partner: Sequence[int]
    size: Sequence[float]
    lengths: Sequence[int]
    dependent: Sequence[int]


def start_facts(problem: ModelInterface) -> StartFacts | None:
    """Return the facts of a model; None where its initial state is as it is stated."""
    if not (problem.assembly or problem.dependent or problem.found):
        return None
    partner = problem.partner
    return StartFacts(
        problem.nq,
        problem.nv,
        problem.rotations,
        tuple((row.stage, row.known, _measure(row)) for row in problem.assembly),
        problem.known,
        partner,
        tuple(_size(problem, i) for i in partner),
        tuple(k for k, q in enumerate(problem.parameters) if q.measure == "m" and q.kind != "idle"),
        problem.dependent,
    )


def _measure(row: AssemblyRow) -> int:
    """Return what a row measures; of one that must hold its rate counts as itself."""
    unit = row.unit.removesuffix("/s") if row.known and row.stage == 2 else row.unit
    return 1 if unit in PURE else 2 if row.known and unit == "m" else 0


def _size(problem: ModelInterface, i: int) -> float:
    quantity = problem.states[i]
    if i in problem.rotations:
        return 1.0
    if quantity.nominal is not None:
        return abs(quantity.nominal)
    return 1.0 if quantity.unit in PURE else 0.0
