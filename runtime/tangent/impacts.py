"""Impacts with derivatives: Newton's restitution and Coulomb's cone, as the kernel resolves them (events/impulses.c)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from msgspec import Struct

from ..numerics.rank import inverse
from ..problem import Array
from .instant import BILATERAL, COEFFICIENT, CONTACT, EXTRA, FRICTION, GAP, RATE, Instant

STICKS, SLIDES, SPARED = range(3)
ROUNDS = 64
TOUCHES = 1e-9
"""Gap, over the size of the coordinates, of a contact that touches."""


class Hit(Struct):
    """A contact that hits, with the rows of its friction; ``push`` [m] and its derivatives [m, k] where these slide."""

    contact: int
    slips: tuple[int, ...]
    restitution: float
    d_restitution: Array
    state: int = STICKS
    push: Array | None = None
    d_push: Array | None = None


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
    m, dm = instant.measured()
    none = np.zeros(instant.augmented.count)
    hits = []
    for i, rest in zip(contacts, rests, strict=True):
        slips = tuple(
            j
            for j, row in enumerate(instant.rows)
            if row.kind == FRICTION and row.normal == i and m[j, COEFFICIENT] > 0
        )
        e, d_e = (0.0, none) if rest else (float(m[i, COEFFICIENT]), dm[i, COEFFICIENT])
        hits.append(Hit(i, slips, e, d_e))
    for _ in range(ROUNDS):
        rows, impulses, changes = _solve(instant, hits)
        at = dict(zip(rows, zip(impulses, changes, strict=True), strict=True))
        if not any(_mended(instant, one, at, len(hits) == 1) for one in hits):
            break
    every = dict(at)
    for one in hits:
        if one.state == SLIDES and one.push is not None and one.d_push is not None:
            p, dp = at[one.contact]
            for c, j in enumerate(one.slips):
                share, d_share = _share(m, dm, one, c)
                every[j] = (share * p, share * dp + d_share * p)
    instant.push(
        list(every), np.array([p for p, _ in every.values()]), np.array([d for _, d in every.values()])
    )


def hit_together(instant: Instant, rests: dict[int, bool]) -> None:
    """Let all that touches hit at once: a linear complementarity problem, whose active rows are found by pivoting."""
    m, dm = instant.measured()
    (b, db), nv = instant.responses(), instant.case.problem.nv
    size = np.abs(instant.y[: instant.case.problem.nq]).max(initial=1e-300)
    held = _engaged(instant)
    touching = [
        i for i, r in enumerate(instant.rows) if r.kind == CONTACT and abs(m[i, GAP]) <= TOUCHES * size
    ]
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


def _share(m: Array, dm: Array, one: Hit, c: int) -> tuple[float, Array]:
    """The impulse of a row of friction that slides, over that of its contact."""
    assert one.push is not None and one.d_push is not None
    i = one.slips[0]
    return float(m[i, EXTRA] * one.push[c]), dm[i, EXTRA] * one.push[c] + m[i, EXTRA] * one.d_push[c]


def _solve(instant: Instant, hits: Sequence[Hit]) -> tuple[list[int], Array, Array]:
    """Give the rows that reach their aims, their impulses, and the derivatives of these."""
    (b, db), (m, dm) = instant.responses(), instant.measured()
    b, db = b.copy(), db.copy()
    rows = _engaged(instant)
    aims, d_aims = [-m[i, RATE] for i in rows], [-dm[i, RATE] for i in rows]
    for one in hits:
        if one.state == SPARED:
            continue
        i = one.contact
        rows.append(i)
        aims.append(-(1 + one.restitution) * m[i, RATE])
        d_aims.append(-(1 + one.restitution) * dm[i, RATE] - one.d_restitution * m[i, RATE])
        for c, j in enumerate(one.slips):
            if one.state == STICKS:
                rows.append(j)
                aims.append(-m[j, RATE])
                d_aims.append(-dm[j, RATE])
            else:  # the impulses of contact and friction lie on the cone and act as one
                share, d_share = _share(m, dm, one, c)
                db[i] += share * db[j] + np.outer(b[j], d_share)
                b[i] += share * b[j]
    columns = [instant.case.problem.nv + i for i in rows]
    x, dx = instant.solve(
        b[np.ix_(rows, columns)].T,
        db[np.ix_(rows, columns)].transpose(1, 0, 2),
        np.array(aims),
        np.array(d_aims),
    )
    return rows, x, dx


def _mended(instant: Instant, one: Hit, at: dict[int, tuple[float, Array]], alone: bool) -> bool:
    """Mend the state of a hit that does not fit; tell whether it was."""
    if one.state == SPARED or one.contact not in at:
        return False
    normal = at[one.contact][0]
    if normal < 0 and not alone:
        one.state = SPARED
        return True
    if one.state == SLIDES or not one.slips:
        return False
    m, dm = instant.measured()
    tangential = np.array([at[j][0] for j in one.slips])
    if np.linalg.norm(tangential) <= m[one.slips[0], COEFFICIENT] * normal:
        return False
    slip, d_slip = m[list(one.slips), RATE], dm[list(one.slips), RATE]
    against = slip if np.abs(slip).max() > 1e-12 * max(np.abs(m[:, RATE]).max(), 1e-300) else -tangential
    changes = d_slip if against is slip else -np.array([at[j][1] for j in one.slips])
    size = float(np.linalg.norm(against))
    unit = against / size
    one.push = -unit
    one.d_push = -(changes - np.outer(unit, unit @ changes)) / size
    one.state = SLIDES
    return True
