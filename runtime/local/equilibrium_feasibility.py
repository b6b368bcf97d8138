"""Whether an equilibrium of the equations is one of the model: short of every contact, on the assumed side of switches, not
held by friction."""

from __future__ import annotations

import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from ..outcome import SimulationError
from ..problem import Array
from .active_constraints import GAP, RATE, holding, row_values
from .equilibrium import Equilibrium, at_rest, reached, resting
from .operating_point import PART, Site, begun_at, plan_of, switched

TOUCHING = 1e-9
"""Gaps down to minus this share of the size of the coordinates are closed, not penetrated."""
SLIPS = 1e-12
"""Rates of slip below this share of the rates in the row's size are none."""
TURNS = 8
"""Most sides of switches that one equilibrium is looked for on."""


class Standing(Struct, frozen=True, eq=False):
    """``site``: the model with what holds and switches at a state. ``rests``: whether the state is an equilibrium of it;
    ``beyond``: the contacts that it penetrates."""

    site: Site
    rests: bool
    beyond: tuple[str, ...] = ()


def contacts(site: Site) -> tuple[int, ...]:
    """Return the rows of contacts that act with the present switches."""
    plan, hybrid = plan_of(site), site.problem.hybrid
    if plan is None or hybrid is None:
        return ()
    return tuple(
        k
        for k, row in enumerate(hybrid.rows)
        if row.kind == "contact" and (plan.rows[k].enabled < 0 or site.z[plan.rows[k].enabled] > 0.5)
    )


def penetrated(site: Site, y: Array) -> tuple[str, ...]:
    """Name the contacts that a state lies beyond."""
    hybrid, rows = site.problem.hybrid, contacts(site)
    if hybrid is None or not rows:
        return ()
    gaps = row_values(site, y)[:, GAP]
    limit = -TOUCHING * max(1.0, float(np.abs(y[: site.problem.nq]).max(initial=0.0)))
    return tuple(hybrid.rows[k].name for k in rows if gaps[k] < limit)


def stilled(site: Site, y: Array) -> Site:
    """Return the model with friction as it acts where nothing moves: against the rates of slip that are prescribed.

    Raises SimulationError where friction holds at rest: equilibria are intervals then.
    """
    plan, hybrid = plan_of(site), site.problem.hybrid
    if plan is None or hybrid is None:
        return site
    z, groups = site.z.copy(), dict[int, list[int]]()
    for k, row in enumerate(hybrid.rows):
        normal = plan.rows[k].normal
        if row.kind == "friction" and (normal < 0 or z[plan.rows[normal].flag] > 0.5):
            groups.setdefault(normal if normal >= 0 else -1 - k, []).append(k)
    rates = row_values(site, at_rest(site, y))[:, RATE]
    for rows in groups.values():
        slip = float(np.linalg.norm(rates[rows]))
        if slip <= SLIPS:
            raise _held(site, hybrid.rows[rows[0]].name)
        for k in rows:
            z[plan.rows[k].flag], z[plan.rows[k].sign] = 0.0, rates[k] / slip
    return replace(site, z=z)


def _held(site: Site, name: str) -> SimulationError:
    return SimulationError(
        f"the friction '{name}' holds '{site.problem.name}' at rest: its equilibria are not points but intervals, "
        "in which it sticks",
        help="look at the model without that friction, or at motions: mechc run shows where it stops",
    )


def standing(site: Site, one: Equilibrium) -> Standing:
    """Tell whether an equilibrium of the equations is one of the model as it stands there.

    Raises SimulationError where friction holds there.
    """
    if site.problem.hybrid is None:
        return Standing(site, True)
    beyond = penetrated(site, one.y)
    if beyond:
        return Standing(site, False, beyond)
    there, plan = begun_at(site, one.y), plan_of(site)
    assert plan is not None, "what begins has a plan"
    for k, row in enumerate(site.problem.hybrid.rows):
        flag = plan.rows[k].flag
        if row.kind in ("friction", "freewheel") and flag >= 0 and there.z[flag] > 0.5:
            raise _held(site, row.name)
    return Standing(there, np.array_equal(there.z, site.z) or resting(there, one.y) is not None)


def arrived(site: Site, y: Array) -> tuple[Site, Equilibrium]:
    """Return the equilibrium that strong damping leads to, and the model with what holds and switches there: the start, where
    it rests with what holds there.

    Raises SimulationError where none is found, beyond contacts, and where friction would hold at another state.
    """
    if site.problem.hybrid is None:
        return site, reached(site, y)
    if holding(site):
        there = resting(site, y)
        if there is not None:
            return site, there
    for _ in range(TURNS):
        site = stilled(site, y)
        one = reached(site, y)
        found = standing(site, one)
        if found.rests:
            return found.site, one
        if found.beyond:
            raise SimulationError(
                f"the equilibrium that strong damping leads to lies beyond the contact '{found.beyond[0]}'",
                help="what rests against a closed contact is not looked for; begin nearer to another equilibrium: "
                'at = "name = value, ..."',
            )
        site, y = found.site, one.y
    raise SimulationError(
        f"no equilibrium of '{site.problem.name}' was found on the side of its switches that it belongs to",
        help="it may rest only at the edge of a switch, where derivatives are different on the two sides",
    )


def alike(site: Site, y: Array) -> bool:
    """Whether the switches as they stand at a state change neither forces nor derivatives there."""
    other = switched(site, y)
    if np.array_equal(other.z, site.z):
        return True
    matrix = site.case.functions.matrices[PART]
    here, there = (matrix(s.t, y, s.u, s.z, s.p) for s in (site, other))
    return np.array_equal(here, there, equal_nan=True) and np.array_equal(site.rates(y), other.rates(y))


def check_side(site: Site, y: Array, over: str) -> None:
    """Raise SimulationError where a state on a branch over a parameter needs other switches than the start."""
    if not alike(site, y):
        raise SimulationError(
            f"an equilibrium of '{site.problem.name}' stands on another side of a switch than the start",
            help=f"branches are followed on one side: look at single values of {over}, without 'over'",
        )


def touched_by(site: Site, y: Array, names: tuple[str, ...]) -> bool:
    """Whether the gap of a contact changes with a displacement of some of these names."""
    gaps = row_values(site, y)[:, GAP]
    for name in names:
        d = np.zeros(site.chart.size)
        d[site.chart.names.index(name)] = 0.37
        if (row_values(site, site.chart.moved(y, d))[:, GAP] != gaps)[list(contacts(site))].any():
            return True
    return False
