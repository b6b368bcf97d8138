"""Where the energy of a run came from and where it went."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from msgspec import Struct

from ..arrays.choice import np

if TYPE_CHECKING:
    from ..problem import Array, Problem


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


def energy_accounts(problem: Problem, time: Array, values: Mapping[str, Array]) -> EnergyAccounts | None:
    """Read the accounts from the results of a run, in which both sides of each event are rows.

    None where the model has no balance, or where nothing is supplied or dissipated.
    """
    if not problem.energy_balance or not len(time):
        return None
    total, *accounts = problem.energy_balance
    dissipated, supplied = (values[problem.outputs[i].name] if i >= 0 else None for i in accounts)
    if dissipated is None and supplied is None:
        return None
    energy = values[problem.outputs[total].name]
    return EnergyAccounts(
        unit=problem.outputs[total].unit,
        start=float(energy[0]),
        end=float(energy[-1]),
        supplied=_change(supplied),
        dissipated=_change(dissipated),
        supplied_at_events=_at_events(time, supplied),
        dissipated_at_events=_at_events(time, dissipated),
    )


def _change(account: Array | None) -> float | None:
    return None if account is None else float(account[-1] - account[0])


def _at_events(time: Array, account: Array | None) -> float:
    """Sum of the jumps between rows of one time."""
    return 0.0 if account is None else float(np.diff(account)[np.diff(time) == 0].sum())
