"""The jump of derivatives at an event, whose time changes with each direction (saltation).

The event happens where g(t, y) = 0: dt = -(dg W)/(dg/dt). The state there changes by W + f dt, whatever happens is
differentiated (instant.py), and after it W = .. - f dt with the rates of the new law. M. A. Aizerman, F. R. Gantmacher 1958;
R. I. Leine, H. Nijmeijer, Dynamics and Bifurcations of Non-Smooth Mechanical Systems, Springer 2004.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from msgspec import Struct

from ..integrate.events import EventRecord, Note
from ..outcome import SimulationError, time_text
from ..problem import Array
from .augmented import Augmented
from .impacts import engage, hit, hit_together, hit_with_friction, settle
from .instant import BILATERAL, COEFFICIENT, CONTACT, EXTRA, FRICTION, GAP, RATE, Instant
from .sizes import own_sizes

NEAR = 1e-7
"""Of the duration: what may lie between an event and the zero of its indicator."""

SAME_TIME = 1e-6
"""Relative difference of the changes of two times that belong to one event."""

SAME_INSTANT = 1e-12
"""Of the duration: by how much times of one event may differ when a parameter changes by its size."""

REPLAYED = 1e-6
"""Of the size of a state: what may differ where what happened is done again."""

ROUNDED = 1e-13
"""Of the size of a state: what differs by rounding alone. Whether a contact rebounds or rests makes more, however softly it hits."""

AGREE = 1e-9
"""Relative difference of rates by laws that agree, at an instant that is known to rounding: where a slip begins, it may stick again
at once by that."""

QUIET = frozenset({"rest", "lift-off", "stick", "slip"})
"""Kinds of events that may change nothing but what holds."""

ONE_SIDED = 1e-9
"""Relative change of what is zero at the start from which on a direction leaves it."""

LEAVES = 1e-4
"""Share of derivatives by which they may leave what holds after an event."""

STRONG = 1e3
"""Growth of derivatives at one event from which on it is told: it is almost grazed, or meets another."""


class TangentSizes(Struct, frozen=True, eq=False):
    """What counts as one: of states ``nominal`` [ny], of their derivatives ``tangents`` [ny, k]."""

    nominal: Array
    tangents: Array


class StartsOnSurface(SimulationError):
    """A motion that begins at the very point where something changes."""


class Crossing(Struct, frozen=True):
    """Derivatives after an instant: ``w`` [ny, k] and ``dz``, and of its time, ``dt`` [k]; ``remark`` where it is told."""

    w: Array
    dz: Array
    dt: Array
    remark: str = ""


def crossed(
    augmented: Augmented,
    sizes: TangentSizes,
    record: EventRecord,
    number: int,
    w: Array,
    dz: Array,
    probe: int,
) -> Crossing:
    """Take derivatives ``w`` [ny, k] and ``dz`` across instant ``number``. ``probe``: a direction of the state that is free.

    Raises SimulationError where the motion has no derivative there.
    """
    case, ny, nominal = augmented.case, augmented.case.problem.ny, sizes.nominal
    t = float(record.times[number])
    before, after = record.before[number], record.after[number]
    notes = record.events.notes(number)
    here = Instant(augmented, t, before[:ny], w, before[ny:], dz, np.zeros(augmented.count))
    what = _names(case.problem.hybrid, notes) if case.problem.hybrid else ""
    here.slide_on([n.index for n in notes if n.kind == "stick"])
    dt = _time_change(here, notes, after[ny:], probe, what)
    rates = here.rates()
    here.w += np.outer(rates, dt)
    here.dt = dt
    here = _happened(here, notes, after, nominal, what)
    here.y, here.z = after[:ny].copy(), after[ny:].copy()
    held = [i for i, r in enumerate(here.rows) if r.flag >= 0 and here.z[r.flag] > 0.5]
    _stay(here, held, sizes, what)
    here.w -= np.outer(here.rates(), dt)
    if not np.isfinite(here.w).all():
        raise SimulationError(f"at {time_text(case.problem, t)} ({what}) the motion has no finite derivative")
    least = np.maximum((sizes.tangents / nominal[:, None]).max(axis=0), 1 / own_sizes(augmented))
    far = [np.maximum(np.abs(x / nominal[:, None]).max(axis=0), least) for x in (w, here.w)]
    growth = float((far[1] / far[0]).max(initial=0.0))
    remark = ""
    if growth > STRONG:
        remark = (
            f"at {time_text(case.problem, t)} ({what}) derivatives grow {growth:.2g} times: the event is almost grazed, or "
            "another is about to come before it"
        )
    return Crossing(here.w, here.dz, dt, remark)


def _names(hybrid: object, notes: Sequence[Note]) -> str:
    from ..interface import Hybrid

    assert isinstance(hybrid, Hybrid)
    found = [
        hybrid.branches[n.index].text if n.kind == "when" else f"{hybrid.rows[n.index].name} {n.kind}"
        for n in notes
    ]
    return ", ".join(dict.fromkeys(found)) or "a law changes"


# ---------------------------------------------------------------- when it happens


def _time_change(here: Instant, notes: Sequence[Note], z_after: Array, probe: int, what: str) -> Array:
    """Give how the time of an event changes in each direction, [k]."""
    case, h = here.case, here.hybrid
    duration = max(case.stop - case.begin, 1e-300)
    found: list[tuple[str, Array]] = []
    grazes = soft = False
    n_timed = h.n_times + h.n_clocks
    if n_timed:
        times, changes = here.own("crossing_times", n_timed), here.change("crossing_times", n_timed)
        for i in range(n_timed):
            if abs(times[i] - here.t) <= 1e-12 * max(abs(here.t), duration):
                found.append(("a known time", changes[i]))
    n_indicators = h.n_switches + h.n_rows
    if n_indicators:
        g = here.own("indicators", n_indicators)
        changes = here.change("indicators", n_indicators)
        rates = _indicator_rates(here, n_indicators, probe)
        wanted = [k for k in range(h.n_switches) if here.z[h.switches[k]] != z_after[h.switches[k]]]
        wanted += sorted(
            {h.n_switches + n.index for n in notes if n.kind not in ("when", "crossing", "reflection")}
        )
        wanted += [
            k for n in notes if n.kind in ("crossing", "reflection") for k in (here.rows[n.index].normal,)
        ]
        for k in dict.fromkeys(wanted):
            grazes |= bool(rates[k] == 0 and g[k] == 0)
            if rates[k] != 0 and abs(g[k]) <= NEAR * duration * abs(rates[k]):
                found.append((what, -changes[k] / rates[k]))
            else:
                soft |= any(n.kind == "impact" and h.n_switches + n.index == k for n in notes)
        for k in range(h.n_switches) if not found else ():  # one that a branch has turned back at once
            if rates[k] != 0 and abs(g[k]) <= NEAR * duration * abs(rates[k]):
                found.append((what, -changes[k] / rates[k]))
    if not found:
        if here.t <= case.begin:
            return np.zeros(here.augmented.count)
        if all(n.kind in QUIET for n in notes) and _goes_on(here, z_after):
            return np.zeros(here.augmented.count)
        at = f"at {time_text(case.problem, here.t)} ({what})"
        if grazes:
            raise SimulationError(f"{at} the motion grazes: it has no derivative there")
        if soft:
            raise SimulationError(
                f"{at} it hits so softly that the time of the impact is not known: where bodies rattle to rest, derivatives end",
                help="derivatives until then: a stop before that time",
            )
        raise SimulationError(
            f"{at} it cannot be told what the event comes from, so it is not differentiated"
        )
    first = found[0][1]
    rounding = SAME_INSTANT * duration / own_sizes(here.augmented)
    for _, other in found[1:]:
        bound = SAME_TIME * max(np.abs(first).max(initial=0.0), np.abs(other).max(initial=0.0)) + rounding
        if (np.abs(other - first) > bound).any():
            raise SimulationError(
                f"at {time_text(case.problem, here.t)} several things happen at once ({what}), and which of them comes "
                "first changes with what the motion is differentiated in: it has no derivative there"
            )
    return first


def _goes_on(here: Instant, z_after: Array) -> bool:
    """Whether laws change where they agree, as where a force begins, or a stop takes over what friction alone held: when
    they do makes no difference."""
    other = here.copy()
    other.z = z_after
    before, after = here.rates(), other.rates()
    return bool((np.abs(after - before) <= AGREE * np.abs(before)).all())


def _indicator_rates(here: Instant, count: int, probe: int) -> Array:
    """Give the rates of the indicators along the motion."""
    other = here.copy()
    other.w, other.dz = np.zeros_like(here.w), np.zeros_like(here.dz)
    other.w[:, probe] = here.rates()
    other.dt = np.zeros(here.augmented.count)
    other.dt[probe] = 1.0
    return other.change("indicators", count)[:, probe]


# ---------------------------------------------------------------- what happens


def _happened(here: Instant, notes: Sequence[Note], after: Array, nominal: Array, what: str) -> Instant:
    """Do again what was noted. Which contacts did not rebound is not noted: by their thresholds, else those that rest."""
    ny = here.case.problem.ny
    best: tuple[float, int, Instant] | None = None
    holds = [i for i, r in enumerate(here.rows) if r.flag >= 0 and after[ny + r.flag] > 0.5]
    begins = any(n.kind in ("rest", "stick") for n in notes)
    for by_threshold, settles in (
        (True, False),
        (False, False),
        *([(True, True), (False, True)] if begins else []),
    ):
        tried = here.copy()
        _happen(tried, notes, after[ny:], by_threshold)
        if settles:  # what comes to rest, loses what is left of its rate
            settle(tried, holds)
        apart = np.nan_to_num(np.abs(tried.y - after[:ny]) / (nominal + np.abs(after[:ny])), nan=np.inf)
        worst = int(apart.argmax())
        if best is None or apart[worst] < best[0]:
            best = float(apart[worst]), worst, tried
        if best[0] <= ROUNDED:
            break
    assert best is not None
    off, worst, found = best
    if off <= REPLAYED:
        return found
    name = here.case.problem.states[worst].name
    raise SimulationError(
        f"what happens at {time_text(here.case.problem, here.t)} ({what}) is more than can be differentiated: "
        f"'{name}' is changed otherwise than by the impacts and branches of that instant"
    )


def _happen(here: Instant, notes: Sequence[Note], z_after: Array, by_threshold: bool) -> None:
    """Do again what was noted, in its order."""
    h = here.hybrid
    stepped = {h.switches[here.rows[n.index].normal] for n in notes if n.kind in ("crossing", "reflection")}
    switched = [h.switches[k] for k in range(h.n_switches)] + [h.times[2 * k] for k in range(h.n_times)]
    before = here.energy()
    turned = [i for i in switched if here.z[i] != z_after[i] and i not in stepped]
    here.z[turned] = z_after[turned]
    if turned and h.supplied >= 0:
        after = here.energy()
        if abs(after[0] - before[0]) > 1e-12 * (abs(after[0]) + abs(before[0])):
            here.y[h.supplied] += after[0] - before[0]
            here.w[h.supplied] += after[1] - before[1]
    if turned and here.case.problem.constraints:
        here.onto()
    if any(n.kind == "engage" for n in notes):
        for row in here.rows:
            if row.kind == BILATERAL:
                here.z[row.flag] = z_after[row.flag]
        engage(here)
    last = {n.index: k for k, n in enumerate(notes) if n.kind == "impact"}
    k = 0
    while k < len(notes):
        note = notes[k]
        k += 1
        if note.kind == "impact":
            group, measured = [note], here.measured()[0]
            while k < len(notes) and (h.simultaneous or _goes_with(notes[k], note, measured)):
                if notes[k].kind != "impact":
                    break
                group.append(notes[k])
                k += 1
            rests = {
                n.index: _is_slow(n, measured)
                if by_threshold
                else last[n.index] < k and bool(z_after[here.rows[n.index].flag] > 0.5)
                for n in group
            }
            if h.simultaneous and any(row.kind == FRICTION for row in here.rows):
                hit_with_friction(here, rests)
            elif h.simultaneous:
                hit_together(here, rests)
            else:
                hit(here, list(rests), list(rests.values()))
        elif note.kind == "when":
            here.act(note.index)
        elif note.kind in ("crossing", "reflection"):
            here.pass_step(note.index, note.kind == "reflection")
            place = h.switches[here.rows[note.index].normal]
            here.z[place] = z_after[place]


def _goes_with(other: Note, first: Note, measured: Array) -> bool:
    """Whether a contact hits together with another: it approaches as fast, and does so already."""
    if other.kind != "impact" or abs(other.value - first.value) > 1e-9 * first.value:
        return False
    return bool(abs(measured[other.index, RATE] + other.value) <= 1e-9 * other.value)


def _is_slow(note: Note, measured: Array) -> bool:
    """Whether a contact would rebound more slowly than it rests."""
    threshold, rebound = measured[note.index, EXTRA], measured[note.index, COEFFICIENT] * note.value
    return bool(0 <= rebound <= threshold)


def _stay(here: Instant, held: Sequence[int], sizes: TangentSizes, what: str) -> None:
    """Put the derivatives onto what holds now; refuse where they leave it: another mode is about to come."""
    if not held:
        return
    before = here.w.copy()
    here.stop(held)
    reach = sizes.nominal[:, None] * np.abs(before / sizes.nominal[:, None]).max(axis=0)
    moved = np.abs(here.w - before) / np.maximum(reach, sizes.tangents)
    if moved.max(initial=0.0) > LEAVES:
        hybrid = here.case.problem.hybrid
        names = [hybrid.rows[i].name for i in held] if hybrid else []
        raise SimulationError(
            f"at {time_text(here.case.problem, here.t)} ({what}) a small change would not let "
            f"{', '.join(dict.fromkeys(names))} hold any more: the motion has no derivative there"
        )


def check_start(here: Instant, nominal: Array) -> None:
    """Refuse a start on a surface that a direction leaves: it has a derivative on one side only."""
    hybrid = here.case.problem.hybrid
    assert hybrid is not None
    sizes = np.maximum(np.abs(here.w / nominal[:, None]).max(axis=0), 1e-300)
    for name, which, changes in _surfaces(here, nominal):
        if (np.abs(changes) > ONE_SIDED * sizes * _scale(here, which, nominal)).any():
            raise StartsOnSurface(
                f"the motion begins at the very point where '{name}' changes, and a change of the start leaves it: there is "
                "a derivative on one side only",
                help="begin a little before or after, or differentiate in what leaves it as it is",
            )


def _surfaces(here: Instant, nominal: Array) -> Iterator[tuple[str, int, Array]]:
    """Yield what the start lies on: its name, what is zero there, and how that changes [k]."""
    hybrid, h = here.case.problem.hybrid, here.hybrid
    assert hybrid is not None
    if here.rows:
        m, dm = here.measured()
        for i, row in enumerate(here.rows):
            holds = row.flag >= 0 and here.z[row.flag] > 0.5
            touches = row.kind == CONTACT and abs(m[i, GAP]) <= 1e-13 * _scale(here, GAP, nominal)
            if (holds and row.kind != FRICTION) or touches:
                yield hybrid.rows[i].name, GAP, dm[i, GAP]
            if holds:
                yield hybrid.rows[i].name, RATE, dm[i, RATE]
    if h.n_switches:
        count = h.n_switches + h.n_rows
        g, changes, rates = here.own("indicators", count), here.change("indicators", count), here.rates()
        for k in np.flatnonzero(g[: h.n_switches] == 0):
            place = h.switches[int(k)]
            other = here.copy()
            other.z[place] = 1.0 - here.z[place]
            jump = np.abs(other.rates() - rates) / np.maximum(np.abs(rates), nominal)
            if not jump.max(initial=0.0) <= ONE_SIDED:
                unscaled = changes[k] / max(np.abs(changes[k]).max(initial=0.0), 1e-300)
                yield hybrid.switches[int(k)], RATE, unscaled * sizes_of(here, nominal)


def sizes_of(here: Instant, nominal: Array) -> Array:
    """Give how far the directions reach, [k], in the largest size of a velocity."""
    far: Array = np.abs(here.w / nominal[:, None]).max(axis=0) * _scale(here, RATE, nominal)
    return far


def _scale(here: Instant, which: int, nominal: Array) -> float:
    problem = here.case.problem
    part = nominal[: problem.nq] if which == GAP else nominal[problem.nq : problem.nq + problem.nv]
    return float(part.max(initial=0.0)) or 1.0
