"""Which results depend on how rigid contacts share a load that the laws of mechanics do not share for them?

A table on four legs: three of its forces hold it, and in its modes those do so that stand first in the model. What rests beside
them, and depends on them, is redundant. Each redundant row is put in the first place; results that change are a choice, whether
the share of the least sum of squares is told (``kernel/shares.h``), or what the modes say.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from msgspec import Struct, field
from numpy.typing import NDArray

from ..case import Case, inputs_at
from ..native import contract
from ..numerics.rank import POSITIONS, inverse, solve
from ..outcome import time_text
from ..problem import Array
from ..rows import slices
from ..start.facts import start_facts
from ..start.free_state import characteristic_length
from .evaluate import Table

CONTACT, FRICTION, BILATERAL = 0, 1, 2
GAP, RATE, FORCE, VALUES = 0, 1, 4, 8
"""Places in what ``row_values`` says of each row (``mech_row_value``)."""
TOUCHES = 1e-8
"""Gap that is none, of the characteristic length of the model."""
DEPENDENT = 1e-9
"""Of what a force moves its own row by: what is left where forces along others keep these at rest."""
UNLOADED = 1e-9
"""Force that is none, of the largest one; difference that is none, of the largest value."""
EXCHANGED = 1e-3
"""Part of its force by which a row may stand for another, beside the largest."""
BRIEF = 1e-5
"""Part of the run in which modes pass that are not looked at, such as a slip that begins."""
MOST_MODES, MOST_NAMES = 20, 8
FIRST = "those that stand first in the text carry what they can"
LEAST = "the least sum of squares is told, the share of equal springs"


class _Row(Struct, frozen=True):
    """A row; ``rests``: where z says that it rests on others, -1 where it tells no share."""

    kind: int
    normal: int
    flag: int
    sign: int
    impulse: int
    enabled: int
    rests: int


class _At(Struct, frozen=True):
    """An instant of a run, and the functions of the model there."""

    case: Case
    struct: contract.HybridStruct
    rows: Sequence[_Row]
    t: float
    y: Array
    u: Array
    z: Array

    def values(self) -> Array:
        found = self._call(self.struct.row_values, VALUES * len(self.rows), self.z)
        return found.reshape(-1, VALUES)

    def responses(self) -> Array:
        """Changes of the rate of each row (first index) by unit impulses along each (second index)."""
        nv, n = self.case.problem.nv, len(self.rows)
        found = np.empty((n, n))
        for k, row in enumerate(self.rows):
            z = self.z.copy()
            z[row.impulse] = 1.0
            found[:, k] = self._call(self.struct.respond, nv + n, z)[nv:]
        return found

    def told(self, z: Array) -> tuple[Array, Array]:
        """Rates of the states, and outputs, with other modes."""
        functions, args = self.case.functions, (self.t, self.y, self.u, z, self.case.p)
        outputs = np.empty(0) if functions.outputs is None else functions.outputs(*args)
        return functions.rhs(*args), outputs

    def _call(self, address: int, size: int, z: Array) -> Array:
        out = np.empty(size)
        given = (a.ctypes.data for a in (self.y, self.u, z, self.case.p, out))
        contract.MODEL_FUNCTION(address)(self.t, *given)
        return out


def shared_loads(case: Case, table: Table) -> tuple[str, ...]:
    """Say which contacts share a load by choice, and which results depend on that."""
    problem, model = case.problem, case.functions.struct
    if problem.hybrid is None or model is None or not model.hybrid or table.z is None or not len(table):
        return ()
    struct = contract.HybridStruct.from_address(model.hybrid)
    if struct.crowd or not any(row.kind in ("contact", "friction") for row in problem.hybrid.rows):
        return ()  # more contacts than have formulas share by themselves (near_rows.c)
    rows = [_row(struct, k) for k in range(struct.n_rows)]
    facts = start_facts(problem)
    near = TOUCHES * (1.0 if facts is None else characteristic_length(facts, case.p))
    found = {False: _Sharing(), True: _Sharing()}
    for first, last in _stretches(table, rows):
        ends = [
            _At(case, struct, rows, t, table.y[k].copy(), inputs_at(case, t), table.z[k].copy())
            for k in (first, last)
            for t in (float(table.t[k]),)
        ]
        group, others = _redundant(ends, near)
        if not others:
            continue
        at = ends[0]
        rates, told = at.told(at.z)
        free, _ = at.told(_free(at))
        changed = [at.told(z) for z in others]
        turns = any(_differs(rates, other, free).any() for other, _ in changed)
        shared = _differs(told, at.told(_unshared(at, at.z))[1])
        least = _differs(
            told, at.told(_closed_alone(at))[1]
        ).any()  # where none is found, loads are those of the modes
        depend = shared & np.any([_differs(told, at.told(_unshared(at, z))[1]) for z in others], axis=0)
        depend |= np.any([_differs(told, other) for _, other in changed], axis=0)
        names = [q.name for q, d in zip(problem.outputs, depend, strict=True) if d and q.kind == "output"]
        if turns or names:
            found[bool(least)].add(at.t, [problem.hybrid.rows[k].name for k in group], names, moves=turns)
    return tuple(
        f"rigid bodies do not determine how {_listed(what.rows)} share their load, as at {time_text(problem, what.since)}: "
        f"{LEAST if least else FIRST}{what.carried}{'; the motion depends on this choice' if what.moves else ''}"
        for least, what in found.items()
        if what.rows
    )


def _row(struct: contract.HybridStruct, k: int) -> _Row:
    row = struct.rows[k]
    rests = struct.shares[k].rest if struct.shares else -1
    return _Row(row.kind, row.normal, row.flag, row.sign, row.impulse, row.enabled, rests)


class _Sharing(Struct):
    """What is said of loads that are shared alike."""

    since: float = 0.0
    rows: dict[str, None] = field(default_factory=dict)
    results: dict[str, None] = field(default_factory=dict)
    moves: bool = False

    def add(self, t: float, rows: Sequence[str], results: Sequence[str], *, moves: bool) -> None:
        self.since = self.since if self.rows else t
        self.rows |= dict.fromkeys(rows)
        self.results |= dict.fromkeys(results)
        self.moves |= moves

    @property
    def carried(self) -> str:
        are = "is" if len(self.results) == 1 else "are"
        return f", so that {_listed(self.results)} {are} one choice of many" if self.results else ""


def _stretches(table: Table, rows: Sequence[_Row]) -> list[tuple[int, int]]:
    """First and last row of the table between two changes of modes: of each combination where it lasts longest, and of many the
    longest."""
    assert table.z is not None
    places = sorted({i for row in rows for i in (row.flag, row.sign, row.enabled) if i >= 0})
    begins = [0]
    for part in slices(len(table), table.z):
        modes = table.z[max(part.start - 1, 0) : part.stop, places]
        begins += (np.flatnonzero((modes[1:] != modes[:-1]).any(axis=1)) + max(part.start, 1)).tolist()
    short = BRIEF * float(table.t[-1] - table.t[0])
    found: dict[bytes, tuple[float, int, int]] = {}
    for first, behind in zip(begins, (*begins[1:], len(table)), strict=True):
        lasts = float(table.t[behind - 1] - table.t[first])
        key = np.sign(table.z[first, places]).tobytes()
        if lasts > short and lasts > found.get(key, (0.0,))[0]:
            found[key] = lasts, first, behind - 1
    longest = sorted(found.values(), reverse=True)[:MOST_MODES]
    return sorted((first, last) for _, first, last in longest)


def _redundant(ends: Sequence[_At], near: float) -> tuple[list[int], list[Array]]:
    """Give the rows that share a load, and modes in which others of them carry it; none where the load has one share only."""
    at = ends[0]
    values = [end.values() for end in ends]
    held = [k for k, row in enumerate(at.rows) if row.kind <= BILATERAL and at.z[row.flag] > 0.5]
    touch = [
        k
        for k, row in enumerate(at.rows)
        if row.kind == CONTACT
        and k not in held
        and (row.enabled < 0 or at.z[row.enabled] > 0.5)
        and all(abs(v[k, GAP]) <= near for v in values)
    ]
    closed = {-1, *held, *touch}
    still = [
        k
        for k, row in enumerate(at.rows)
        if row.kind == FRICTION and k not in held and at.z[row.sign] == 0 and row.normal in closed
    ]
    if not (touch or still):
        return [], []
    response = at.responses()
    size = np.sqrt(np.abs(np.diag(response)))
    moved = size > UNLOADED * size.max(initial=0.0)
    response = response / np.outer(np.where(moved, size, 1.0), np.where(moved, size, 1.0))
    free = [k for k in (*touch, *still) if moved[k]]
    while True:
        # what each of them takes from those that hold, and what of it these cannot do
        along = response[np.ix_(held, free)]
        parts = solve(response[np.ix_(held, held)], along, POSITIONS)
        left = 1.0 - np.einsum("ik,ik->k", along, parts)
        bound = {k for k, own in zip(free, left, strict=True) if own < DEPENDENT}
        rests = {-1, *held, *bound}  # a contact that rises yet may have a slip that depends on others
        chosen = [i for i, k in enumerate(free) if k in bound and at.rows[k].normal in rests]
        rest = [free[i] for i in chosen]
        if not rest:
            return [], []
        rows = [*held, *rest]
        shares = np.vstack([-parts[:, chosen], np.eye(len(rest))])
        empty = _never_loaded(at, rows, shares, values[0][:, FORCE])
        if not empty:
            break
        held = [k for k in held if k not in empty]
        free = [k for k in free if k not in empty and at.rows[k].normal not in empty]
    group = sorted(k for k, share in zip(rows, np.abs(shares).max(axis=1), strict=True) if share > UNLOADED)
    largest = np.abs(values[0][:, FORCE] * size).max()
    loads = np.array([at.rows[k].kind != BILATERAL for k in held]) * np.abs(
        values[0][held, FORCE] * size[held]
    )
    others = []
    for k, share in zip(rest, np.abs(shares[: len(held)]).T, strict=True):
        given = np.where(share > EXCHANGED * share.max(initial=0.0), loads, 0.0)
        if not given.max(initial=0.0) > UNLOADED * largest:
            continue  # what it would take over carries nothing, or is a constraint
        z = at.z.copy()
        gives = at.rows[held[int(np.argmax(given))]]
        z[gives.flag], z[at.rows[k].flag] = 0.0, 1.0
        for row, value in ((gives, 1.0), (at.rows[k], 0.0)):
            if row.rests >= 0:
                z[row.rests] = value
        _set_frictions(
            at, z, {i for i in rest if at.rows[i].kind == CONTACT}, set(rows), values[0][:, RATE], near
        )
        others.append(z)
    return group, others


def _set_frictions(at: _At, z: Array, contacts: set[int], rest: set[int], rate: Array, slow: float) -> None:
    """Let the frictions of these contacts, which carried nothing, stick, or slide against their slip, but for those that rest
    since others hold them."""
    of: dict[int, list[int]] = {}
    for k, row in enumerate(at.rows):
        if row.kind == FRICTION and row.normal >= 0:
            of.setdefault(row.normal, []).append(k)
    pairs = [[at.z[at.rows[k].sign] for k in found] for found in of.values() if len(found) == 2]
    none = max((float(np.hypot(*pair)) for pair in pairs), default=0.0)
    for contact in contacts & of.keys():
        found, speed = of[contact], float(np.linalg.norm(rate[of[contact]]))
        if speed > max(none, slow):
            length = 1.0 if len(found) == 1 else none or DEPENDENT * speed
            z[[at.rows[k].sign for k in found]] = length * rate[found] / speed
        elif z[at.rows[contact].flag] > 0.5:
            z[[at.rows[k].flag for k in found if k not in rest]] = 1.0


def _never_loaded(at: _At, rows: Sequence[int], shares: Array, force: Array) -> set[int]:
    """Contacts that carry nothing in any share of the load: a table whose mass stands above one leg has one share."""
    largest = max((abs(float(force[k])) for k in rows), default=0.0)
    zero = [i for i, k in enumerate(rows) if at.rows[k].kind == CONTACT and not force[k] > UNLOADED * largest]
    if not zero:
        return set()
    count, free = len(zero), shares.shape[1]
    if (shares[zero] @ inverse(shares[zero]).sum(axis=1) > UNLOADED).all():
        return set()  # one share loads all of them, which is what is usual
    from scipy.optimize import linprog

    # as many of them as can be loaded at once, up to 1 each; the others stay loaded for a share that is small enough
    bound = np.hstack([-shares[zero], np.eye(count)])
    limits: list[tuple[float | None, float | None]] = [(None, None)] * free + [(0.0, 1.0)] * count
    found = linprog(np.r_[np.zeros(free), -np.ones(count)], A_ub=bound, b_ub=np.zeros(count), bounds=limits)
    if found.status != 0:
        return set()
    return {rows[i] for i, loaded in zip(zero, found.x[free:], strict=True) if loaded < 0.5}


def _unshared(at: _At, z: Array) -> Array:
    """The same modes, of which forces are told as they are."""
    z = z.copy()
    z[[row.rests for row in at.rows if row.rests >= 0]] = 0.0
    return z


def _closed_alone(at: _At) -> Array:
    """The modes in which what rests on others counts as closed (to formulas, what is not zero) and shares nothing (in the kernel, what is
    above one half)."""
    z = at.z.copy()
    places = [row.rests for row in at.rows if row.rests >= 0]
    z[places] = np.where(z[places] > 0.5, 0.25, z[places])
    return z


def _free(at: _At) -> Array:
    """The modes without contacts and frictions, of which accelerations tell the size."""
    z = _unshared(at, at.z)
    z[[row.flag for row in at.rows if row.kind in (CONTACT, FRICTION)]] = 0.0
    return z


def _differs(*values: Array) -> NDArray[np.bool_]:
    """Which of the first values are not the second ones, beside the largest of all."""
    one, other = values[:2]
    scale = max((float(np.abs(v[np.isfinite(v)]).max(initial=0.0)) for v in values), default=0.0)
    found: NDArray[np.bool_] = np.abs(one - other) > UNLOADED * scale
    return found


def _listed(names: Sequence[str] | dict[str, None]) -> str:
    """Names in quotes; of many the first ones."""
    listed = [f"'{name}'" for name in list(names)[:MOST_NAMES]]
    more = len(names) - len(listed)
    if more:
        return f"{', '.join(listed)} and {more} more"
    return " and ".join((", ".join(listed[:-1]), listed[-1])) if len(listed) > 1 else "".join(listed)
