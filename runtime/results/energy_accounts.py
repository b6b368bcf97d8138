"""Where the energy of a run came from and where it went."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from msgspec import Struct

from ..rows import slices

if TYPE_CHECKING:
    from ..problem import Array, Problem
    from .evaluate import Table


class EnergyAccounts(Struct, frozen=True):
    """Energies [J, or as ``unit`` says]: ``start`` + ``supplied`` - ``dissipated`` = ``end``, up to the drift.

    ``supplied``: by inputs, drives, moving constraints, whatever depends on time, and forces that depend on no
    velocity. ``dissipated``: by friction, damping, impacts and forces that depend on velocities. None where the
    model has no such account. The parts ``at_events`` are those of impacts, `reinit` and impulses.
    """

    unit: str
    start: float
    end: float
    supplied: float | None
    dissipated: float | None
    supplied_at_events: float
    dissipated_at_events: float


def energy_accounts(problem: Problem, table: Table) -> EnergyAccounts | None:
    """Read the accounts from the results of a run, in which both sides of each event are rows.

    None where the model has no balance, or where nothing is supplied or dissipated.
    """
    if not problem.energy_balance or not len(table):
        return None
    total, dissipated, supplied = problem.energy_balance
    if dissipated < 0 and supplied < 0:
        return None
    first, last = (table.outputs_at(slice(row, row + 1))[0] for row in (0, len(table) - 1))
    jumps = _at_events(table)

    def change(account: int) -> float | None:
        return float(last[account] - first[account]) if account >= 0 else None

    def at_events(account: int) -> float:
        return float(jumps[:, account].sum()) if account >= 0 else 0.0

    return EnergyAccounts(
        unit=problem.outputs[total].unit,
        start=float(first[total]),
        end=float(last[total]),
        supplied=change(supplied),
        dissipated=change(dissipated),
        supplied_at_events=at_events(supplied),
        dissipated_at_events=at_events(dissipated),
    )


def _at_events(table: Table) -> Array:
    """Give the jumps [m, n_outputs] of all outputs between rows of one time."""
    found = [
        rows.start + np.flatnonzero(np.diff(table.t[rows.start : rows.stop + 1]) == 0)
        for rows in slices(len(table), table.t)
    ]
    before = np.concatenate(found)
    return table.outputs_at(before + 1) - table.outputs_at(before)
