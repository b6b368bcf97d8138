"""What holds at a state: contacts that are closed, friction that sticks, constraints that are engaged.

Where a force presses the contact and the friction is below its limit, small motions keep all of it closed, and are those of
the system with what holds as constraints.
"""

from __future__ import annotations

import numpy as np
from msgspec.structs import replace

from ..driving_inputs import derived
from ..native import contract
from ..numerics.rank import POSITIONS
from ..problem import Array
from .independent_coordinates import independent
from .operating_point import Derivatives, Site, plan_of

GAP, RATE, VALUES = 0, 1, 8
"""Of mech_row_value in the kernel: the first two, and how many there are."""
KEPT = 1e-9
"""A displacement that the motion changes by less than this share of its rates is kept by it."""


def holding(site: Site) -> tuple[int, ...]:
    """Return the rows that hold with the present discrete variables."""
    plan, hybrid = plan_of(site), site.problem.hybrid
    if plan is None or hybrid is None:
        return ()
    flags = [plan.rows[k].flag for k in range(len(hybrid.rows))]
    return tuple(k for k, flag in enumerate(flags) if flag >= 0 and site.z[flag] > 0.5)


def row_values(site: Site, y: Array) -> Array:
    """Return what the kernel reads of each row [n_rows][8] at a state."""
    plan = plan_of(site)
    if plan is None or not plan.n_rows or plan.row_values is None:
        return np.zeros((0, VALUES))
    found = np.zeros((plan.n_rows, VALUES))
    arrays = [np.ascontiguousarray(a) for a in (y, site.u, site.z, site.p)]
    contract.MODEL_FUNCTION(plan.row_values)(site.t, *(a.ctypes.data for a in arrays), found.ctypes.data)
    return found


def sliding(site: Site) -> bool:
    """Whether friction slides with the present discrete variables."""
    plan, hybrid = plan_of(site), site.problem.hybrid
    if plan is None or hybrid is None:
        return False
    rows = [plan.rows[k] for k, row in enumerate(hybrid.rows) if row.kind == "friction"]
    return any(site.z[row.flag] < 0.5 and site.z[row.sign] != 0.0 for row in rows)


def with_held(site: Site, found: Derivatives) -> Derivatives:
    """Return the derivatives at a state with what holds there among the constraints."""
    return held_constraints(site, found)[0]


def held_constraints(site: Site, found: Derivatives) -> tuple[Derivatives, list[int]]:
    """Return the derivatives with what holds among the constraints, and the rows whose positions they have after the others.

    Of rows that say the same the first counts. Where a row has no position of its own, as friction, its displacement is
    held as well, as far as the motion keeps it.
    """
    rows = _independent_rows(site, found, holding(site))
    if not rows:
        return found, []
    nd, nv, n_position = site.chart.nd, site.problem.nv, len(found.position)
    by_inputs = found.constraints_by_inputs
    rates = replace(
        found,
        rate=np.vstack([found.rate, found.slips[rows]]),
        constraints_by_inputs=np.vstack([by_inputs, found.slips_by_inputs[rows]]),
    )
    positions, moved = found.gaps[rows], found.gaps_by_inputs[rows]
    for j, k in enumerate(rows):
        if positions[j].any():
            continue
        displaced = _displaced(site, found.slips[k, nd : nd + nv])
        by_input = _integrated(site, found.slips_by_inputs[k])
        if by_input is not None and _is_kept(site, rates, displaced):
            positions[j], moved[j] = displaced, by_input
    has = [bool(row.any()) for row in positions]
    by_inputs = rates.constraints_by_inputs
    whole = replace(
        rates,
        position=np.vstack([found.position, positions[has]]),
        constraints_by_inputs=np.vstack([by_inputs[:n_position], moved[has], by_inputs[n_position:]]),
    )
    return whole, [k for k, one in zip(rows, has, strict=True) if one]


def _independent_rows(site: Site, found: Derivatives, rows: tuple[int, ...]) -> list[int]:
    """Return the rows whose rates do not follow from the constraints and the rows before them."""
    velocities = slice(site.chart.nd, site.chart.nd + site.problem.nv)
    basis: list[Array] = []

    def adds(row: Array) -> bool:
        size = float(np.linalg.norm(row))
        if not size:
            return False
        left = row / size
        for _ in range(2):  # again, for what rounding leaves
            for one in basis:
                left = left - (one @ left) * one
        rest = float(np.linalg.norm(left))
        if rest <= np.sqrt(POSITIONS):
            return False
        basis.append(left / rest)
        return True

    for row in found.rate:
        adds(row[velocities])
    return [k for k in rows if adds(found.slips[k, velocities])]


def _displaced(site: Site, row: Array) -> Array:
    """Return a row of velocities as one of displacements."""
    chart = site.chart
    place, found = 0, np.zeros(chart.size)
    before = -1
    for velocity, i in enumerate(site.problem.partner):
        place = place + 1 if i == before and i in site.problem.rotations else chart.places.index(i)
        found[place], before = row[velocity], i
    return found


def _integrated(site: Site, by_inputs: Array) -> Array | None:
    """Return the derivatives of a displacement by inputs, from those of its rate; None where it is not a function of them."""
    found, rest = np.zeros_like(by_inputs), by_inputs.copy()
    for k, (first, _) in derived(site.problem).items():
        found[k], rest[first] = by_inputs[first], 0.0
    return None if rest.any() else found


def _is_kept(site: Site, found: Derivatives, row: Array) -> bool:
    """Whether no motion that the constraints allow changes a displacement."""
    tangent = independent(site.chart, found).tangent
    change = row @ found.rates @ tangent
    sizes = np.abs(row) @ np.abs(found.rates) @ np.abs(tangent)
    return bool((np.abs(change) <= KEPT * float(sizes.max(initial=0.0))).all())
