"""Impacts with derivatives: Newton's restitution and Coulomb's cone, as the kernel resolves them (events/impulses.c)."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product

import numpy as np
from msgspec import Struct

from ..numerics.rank import inverse
from ..problem import Array
from .instant import BILATERAL, COEFFICIENT, CONTACT, EXTRA, FRICTION, GAP, RATE, Instant

Impulses = dict[int, tuple[float, Array]]
"""By row: an impulse and its derivatives [k]."""

STICKS, SLIDES, SPARED = range(3)
ROUNDS = 64
MOST_COMBINED = 5
TOUCHES = 1e-9
"""Gap, over the size of the coordinates, of a contact that touches."""


class Hit(Struct):
    """A contact that hits, with the rows of its friction."""

    contact: int
    slips: tuple[int, ...]
    restitution: float
    d_restitution: Array
    state: int = STICKS


def engage(instant: Instant) -> bool:
    """Take the rates of engaged constraints away; tell whether there are any."""
    held = _engaged(instant)
    settle(instant, held)
    return bool(held)


def settle(instant: Instant, held: Sequence[int]) -> None:
    """Take the rates of rows away that hold."""
    if held:
        m, dm = instant.measured()
        (b, db), nv = instant.responses(), instant.case.problem.nv
        columns = [nv + i for i in held]
        impulses = instant.solve(
            b[np.ix_(held, columns)].T,
            db[np.ix_(held, columns)].transpose(1, 0, 2),
            -m[held, RATE],
            -dm[held, RATE],
        )
        instant.push(held, *impulses)


def hit(instant: Instant, contacts: Sequence[int], rests: Sequence[bool]) -> None:
    """Let contacts hit at once; ``rests``: those that do not rebound."""
    hits = _hits(instant, contacts, rests)
    impulses: Impulses = {}
    for _ in range(ROUNDS):
        impulses = _solve(instant, hits, impulses)
        if not any(_mended(instant, one, impulses, len(hits) == 1) for one in hits):
            break
    _push(instant, impulses)


def hit_with_friction(instant: Instant, rests: dict[int, bool]) -> None:
    """Let all that touches hit at once: the first combination of sticking, sliding and leaving that fits."""
    touching = _touching(instant)
    if len(touching) > MOST_COMBINED:
        return
    hits = _hits(instant, touching, [rests.get(i, False) for i in touching])
    for states in product((STICKS, SLIDES, SPARED), repeat=len(hits)):
        for one, state in zip(hits, states, strict=True):
            one.state = state if one.slips or state == SPARED else STICKS
        impulses = _solve(instant, hits, {})
        if _fits(instant, hits, impulses):
            _push(instant, impulses)
            return


def hit_together(instant: Instant, rests: dict[int, bool]) -> None:
    """Let all that touches hit at once: a linear complementarity problem, whose active rows are found by pivoting."""
    m, dm = instant.measured()
    (b, db), nv = instant.responses(), instant.case.problem.nv
    held, touching = _engaged(instant), _touching(instant)
    rows = [*held, *touching]
    aims, d_aims = -m[rows, RATE], -dm[rows, RATE]
    for k, i in enumerate(rows):
        if i in touching and m[i, RATE] < 0 and not rests.get(i, False):
            aims[k] = -(1 + m[i, COEFFICIENT]) * m[i, RATE]
            d_aims[k] = -(1 + m[i, COEFFICIENT]) * dm[i, RATE] - dm[i, COEFFICIENT] * m[i, RATE]
    active = [k < len(held) for k in range(len(rows))]
    matrix = b[np.ix_(rows, [nv + i for i in rows])].T
    for _ in range(ROUNDS * len(rows)):
        inside = [k for k, on in enumerate(active) if on]
        p = np.zeros(len(rows))
        p[inside] = inverse(matrix[np.ix_(inside, inside)]) @ aims[inside] if inside else 0.0
        short = matrix @ p - aims
        wrong = [
            k
            for k in range(len(held), len(rows))
            if (p[k] < 0 if active[k] else short[k] < -1e-12 * (abs(aims[k]) + np.abs(matrix[k]) @ np.abs(p)))
        ]
        if not wrong:
            break
        active[wrong[0]] = not active[wrong[0]]
    inside = [k for k, on in enumerate(active) if on]
    chosen = [rows[k] for k in inside]
    columns = [nv + i for i in chosen]
    d_matrix = db[np.ix_(chosen, columns)].transpose(1, 0, 2)
    instant.push(
        chosen, *instant.solve(matrix[np.ix_(inside, inside)], d_matrix, aims[inside], d_aims[inside])
    )


def _engaged(instant: Instant) -> list[int]:
    return [i for i, r in enumerate(instant.rows) if r.kind == BILATERAL and instant.z[r.flag] > 0.5]


def _touching(instant: Instant) -> list[int]:
    m, _ = instant.measured()
    size = np.abs(instant.y[: instant.case.problem.nq]).max(initial=1e-300)
    return [i for i, r in enumerate(instant.rows) if r.kind == CONTACT and abs(m[i, GAP]) <= TOUCHES * size]


def _hits(instant: Instant, contacts: Sequence[int], rests: Sequence[bool]) -> list[Hit]:
    m, dm = instant.measured()
    none = np.zeros(instant.augmented.count)
    hits = []
    for i, rest in zip(contacts, rests, strict=True):
        slips = tuple(
            j
            for j, row in enumerate(instant.rows)
            if row.kind == FRICTION and row.normal == i and m[j, COEFFICIENT] > 0
        )
        rebounds = not rest and m[i, RATE] < 0
        e, d_e = (float(m[i, COEFFICIENT]), dm[i, COEFFICIENT]) if rebounds else (0.0, none)
        hits.append(Hit(i, slips, e, d_e))
    return hits


def _push(instant: Instant, impulses: Impulses) -> None:
    values = list(impulses.values())
    instant.push(list(impulses), np.array([p for p, _ in values]), np.array([d for _, d in values]))


def _solve(instant: Instant, hits: Sequence[Hit], before: Impulses) -> Impulses:
    """Give the impulses of hits in their states, and of constraints that are engaged, by Newton's method.

    Of what slides friction acts against the slip that is left; it begins against the slip before, with the pressure ``before``.
    """
    (b, db), (m, dm) = instant.responses(), instant.measured()
    struck = [one for one in hits if one.state != SPARED]
    rows = [*_engaged(instant), *(i for one in struck for i in (one.contact, *one.slips))]
    columns = [instant.case.problem.nv + i for i in rows]
    response = b[np.ix_(rows, columns)].T
    place = {i: k for k, i in enumerate(rows)}
    x = np.zeros(len(rows))
    for one in struck:
        if one.state != SLIDES:
            continue
        n, t = one.contact, list(one.slips)
        x[place[n]] = before[n][0] if n in before else -m[n, RATE] / response[place[n], place[n]]
        slip = m[t, RATE]
        if t[0] in before and np.abs(slip).max() <= 1e-12 * max(np.abs(m[:, RATE]).max(), 1e-300):
            slip = -np.array([before[i][0] for i in t])
        x[[place[i] for i in t]] = -m[t[0], EXTRA] * x[place[n]] * slip / max(np.linalg.norm(slip), 1e-300)

    def parts(x: Array) -> tuple[Array, Array, Array, Array]:
        """The residual, its derivatives by the rates that are left and by the impulses, and by what changes beside these."""
        u = m[rows, RATE] + response @ x
        value, by_rate, by_impulse = u.copy(), np.eye(len(rows)), np.zeros((len(rows), len(rows)))
        beside = np.zeros((len(rows), instant.augmented.count))
        for one in struck:
            n, t = place[one.contact], [place[j] for j in one.slips]
            value[n] += one.restitution * m[one.contact, RATE]
            beside[n] = one.restitution * dm[one.contact, RATE] + one.d_restitution * m[one.contact, RATE]
            if one.state != SLIDES:
                continue
            mu, d_mu = m[one.slips[0], EXTRA], dm[one.slips[0], EXTRA]
            size = max(float(np.linalg.norm(u[t])), 1e-300)
            unit = u[t] / size
            value[t] = x[t] + mu * x[n] * unit
            by_rate[np.ix_(t, t)] = mu * x[n] * (np.eye(len(t)) - np.outer(unit, unit)) / size
            by_impulse[t, t] = 1.0
            by_impulse[t, n] = mu * unit
            beside[t] = np.outer(x[n] * unit, d_mu)
        return value, by_rate, by_impulse, beside

    for _ in range(ROUNDS):
        value, by_rate, by_impulse, _ = parts(x)
        step = inverse(by_rate @ response + by_impulse) @ value
        x = x - step
        if np.abs(step).max(initial=0.0) <= 1e-15 * np.abs(x).max(initial=0.0):
            break
    _, by_rate, by_impulse, beside = parts(x)
    changes = dm[rows, RATE] + np.einsum("jik,j->ik", db[np.ix_(rows, columns)], x)
    dx = -inverse(by_rate @ response + by_impulse) @ (by_rate @ changes + beside)
    return dict(zip(rows, zip(x, dx, strict=True), strict=True))


def _fits(instant: Instant, hits: Sequence[Hit], impulses: Impulses) -> bool:
    """Tell whether what hits presses, within its cone where it sticks, and what does not rises."""
    (b, _), (m, _) = instant.responses(), instant.measured()
    nv, size = instant.case.problem.nv, 1e-9 * max((abs(p) for p, _ in impulses.values()), default=0.0)
    for one in hits:
        if one.state == SPARED:
            left = (1 + one.restitution) * m[one.contact, RATE]
            left += sum(p * b[j, nv + one.contact] for j, (p, _) in impulses.items())
            if left < -1e-9 * np.abs(m[:, RATE]).max():
                return False
            continue
        pressure = impulses[one.contact][0]
        if pressure < -size:
            return False
        if not one.slips:
            continue
        limit = m[one.slips[0], COEFFICIENT if one.state == STICKS else EXTRA] * pressure
        if np.linalg.norm([impulses[j][0] for j in one.slips]) > limit + size:
            return False
    return True


def _mended(instant: Instant, one: Hit, impulses: Impulses, alone: bool) -> bool:
    """Mend the state of a hit that does not fit; tell whether it was."""
    if one.state == SPARED:
        return False
    pressure = impulses[one.contact][0]
    if pressure < 0 and not alone:
        one.state = SPARED
        return True
    if one.state == SLIDES or not one.slips:
        return False
    m, _ = instant.measured()
    if np.linalg.norm([impulses[j][0] for j in one.slips]) <= m[one.slips[0], COEFFICIENT] * pressure:
        return False
    one.state = SLIDES
    return True
