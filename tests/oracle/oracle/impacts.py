"""Jumps of velocities: impacts, impulses, reinit, and steps of a potential (language, section 15; events, 2, 4, 5)."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from mechc.compiler.flat import model as flat
from oracle.expressions import der
from oracle.point import Point
from oracle.series import STEP, Series, real
from oracle.start import shift
from oracle.values import NotCovered, Undetermined

if TYPE_CHECKING:
    from oracle.meaning import Meaning

Array = Any
State = dict[str, float]


def mass_matrix(meaning: Meaning, state: State, frozen: dict[Any, Any] | None = None) -> Array:
    """The derivative of the momenta by the velocities."""
    n = meaning.size
    batch = shift(meaning, state, 1j * STEP * np.eye(n), list(range(n)), True)
    return np.broadcast_to(meaning.point(batch, frozen=frozen).momenta(), (n, n)).imag / STEP


def gradient(point: Point, value: Any, kind: str) -> Array:
    return point.moved(value, kind == "rate")[:, 0].real


def holding(meaning: Meaning, point: Point) -> Array:
    """The rows of all constraints, and of what is driven: an impulse does not change their rates."""
    rows = [gradient(point, value, kind) for _, kind, value in point.rows()]
    return np.array(rows).reshape(len(rows), meaning.size)


ALIKE = 1e-7
"""Approaches that differ by less, as a share, are equally fast: a motion of tolerance 1e-9 has them from one flight only."""


class Blow:
    """Impulses on a mechanism at one instant: M dv = sum of impulses along rows, each row with a wanted change.

    ``frozen``: the branches of laws that hold from then on.
    """

    def __init__(self, meaning: Meaning, state: State, frozen: dict[Any, Any] | None = None) -> None:
        self.meaning, self.state = meaning, state
        self.point = meaning.point(state, frozen=frozen)
        self.M = mass_matrix(meaning, state, frozen)
        self.held = holding(meaning, self.point)

    def solve(self, load: Array, rows: Array, wanted: Array) -> tuple[Array, Array]:
        """``dv`` and the impulses along ``rows``, whose rates change by ``wanted``."""
        G = np.vstack([self.held, rows]) if len(rows) else self.held
        n, m = len(self.M), len(G)
        K = np.block([[self.M, -G.T], [G, np.zeros((m, m))]])
        right = np.concatenate([load, np.zeros(len(self.held)), wanted])
        z = np.linalg.lstsq(K, right, rcond=1e-12)[0]
        if np.abs(K @ z - right).max(initial=0) > 1e-8 * (1 + np.abs(right).max(initial=0)):
            raise Undetermined("impulses that contradict each other")
        return z[:n], z[n + len(self.held) :]

    def after(self, dv: Array) -> State:
        names = self.meaning.all_rates
        return {**self.state, **{x: self.state[x] + float(d) for x, d in zip(names, dv, strict=True)}}


def pushed(meaning: Meaning, state: State, load: Array) -> State:
    blow = Blow(meaning, state)
    none = np.zeros((0, meaning.size))
    return blow.after(blow.solve(load, none, np.zeros(0))[0])


def with_rates(meaning: Meaning, state: State, wanted: Mapping[str, float], extra: Array = None) -> State:
    """Given velocities; constraints hold again, which change the others as little as kinetic energy allows."""
    blow = Blow(meaning, state)
    index = [meaning.all_rates.index(x) for x in wanted]
    jump = np.zeros(meaning.size)
    jump[index] = [wanted[x] - state[x] for x in wanted]
    rows = np.vstack([np.eye(meaning.size)[index], blow.held])
    change = np.concatenate([np.zeros(len(index)), -blow.held @ jump])
    if extra is not None:
        rows, change = np.vstack([rows, extra[0]]), np.concatenate([change, extra[1] - extra[0] @ jump])
    blow.held = np.zeros((0, meaning.size))
    return blow.after(jump + blow.solve(np.zeros(meaning.size), rows, change)[0])


def obeying(meaning: Meaning, state: State, frozen: dict[Any, Any] | None = None) -> State:
    """Velocities on all constraints, an impact without rebound (`engage`, and where a constraint bends)."""
    blow = Blow(meaning, state, frozen)
    rates = [der(value) if kind == "position" else value for _, kind, value in blow.point.rows()]
    rows, blow.held = blow.held, np.zeros((0, meaning.size))
    return blow.after(blow.solve(np.zeros(meaning.size), rows, -np.array([real(r) for r in rates]))[0])


# ---------------------------------------------------------------- impacts


def approach(point: Point, contact: flat.Contact) -> float:
    return real(der(point.at(contact.gap)))


def restitution(point: Point, contact: flat.Contact) -> float:
    return 0.0 if contact.restitution is None else real(point.at(contact.restitution))


def strike(
    meaning: Meaning,
    state: State,
    hit: list[flat.Contact],
    pressed: list[flat.Contact],
    frozen: dict[Any, Any] | None = None,
) -> State:
    """Newton's law at the contacts that are hit; those that press stay closed where that needs no pull.

    Every combination of pressing and opening, sticking and sliding is tried; the friction of an impact keeps to
    Coulomb's law in impulses.
    """
    blow = Blow(meaning, state, frozen)
    point = blow.point
    cases: list[list[tuple[flat.Contact, str, float]]] = []
    for c in (*hit, *pressed):
        change = -(1 + restitution(point, c)) * approach(point, c) if c in hit else -approach(point, c)
        rough = c.friction is not None and not meaning.smooth(c.options)  # a smooth force gives no impulse
        ways = ["stick", "slip+", "slip-"] if rough else ["smooth"]
        if rough and len(point.slip(c)) > 1:
            ways = ["stick", "slide"]
        cases.append([(c, way, change) for way in (*ways, "open")])
    for combination in itertools.product(*cases):
        found = _combined(
            blow, [x for x in combination if x[1] != "open"], [x for x in combination if x[1] == "open"]
        )
        if found is not None:
            return blow.after(found)
    raise Undetermined("no impulses that fit the laws of impact")


def _direction(point: Point, contact: flat.Contact, way: str) -> Array | None:
    """The direction in which a contact slides: along its one slip, or as before the impact where it has two."""
    if way in ("slip+", "slip-"):
        return np.array([1.0 if way == "slip+" else -1.0])
    if way != "slide":
        return None
    slips = np.array([real(s) for s in point.slip(contact)])
    if not np.linalg.norm(slips) > 0:
        raise NotCovered("an impact that begins to slide in some direction")
    return slips / np.linalg.norm(slips)


def _combined(blow: Blow, closed: list[Any], opened: list[Any]) -> Array | None:
    point = blow.point
    rows: list[Array] = []
    wanted: list[float] = []
    for c, way, change in closed:
        rows.append(gradient(point, point.at(c.gap), "position"))
        wanted.append(change)
        if way == "stick":
            for s in point.slip(c):
                rows.append(gradient(point, s, "rate"))
                wanted.append(-real(s))
    against = [_direction(point, c, way) for c, way, _ in closed]
    sliding = [
        real(point.at(c.friction))
        * sum(e * gradient(point, s, "rate") for e, s in zip(turn, point.slip(c), strict=True))
        if turn is not None
        else None
        for (c, _, _), turn in zip(closed, against, strict=True)
    ]
    n, G = len(blow.M), np.vstack([blow.held, *rows])
    push = G.copy()  # along a sliding contact the impulse is that of its normal, turned
    k = len(blow.held)
    for (c, way, _), slide in zip(closed, sliding, strict=True):
        if slide is not None:
            push[k] = push[k] - slide
        k += 1 + (len(point.slip(c)) if way == "stick" else 0)
    K = np.block([[blow.M, -push.T], [G, np.zeros((len(G), len(G)))]])
    right = np.concatenate([np.zeros(n), np.zeros(len(blow.held)), wanted])
    z = np.linalg.lstsq(K, right, rcond=1e-12)[0]
    if np.abs(K @ z - right).max(initial=0) > 1e-8 * (1 + np.abs(right).max(initial=0)):
        return None
    dv, impulses, k, turned = z[:n], z[n + len(blow.held) :], 0, False
    size = 1e-9 * (1e-300 + np.abs(impulses).max(initial=0))
    for (c, way, _), turn in zip(closed, against, strict=True):
        J = impulses[k]
        if -size > J:
            return None
        if way == "stick":
            mu = real(point.at(c.static if c.static is not None else c.friction))
            count = len(point.slip(c))
            if np.linalg.norm(impulses[k + 1 : k + 1 + count]) > mu * J + size:
                return None
            k += count
        if turn is not None:
            slips = point.slip(c)
            end = np.array([real(s) + gradient(point, s, "rate") @ dv for s in slips])
            still = 1e-9 * (np.abs([real(s) for s in slips]).max() + np.abs(dv).max())
            if turn @ end < -still:
                return None
            turned = turned or np.abs(end - (turn @ end) * turn).max() > still
        k += 1
    for c, _, change in opened:
        if gradient(point, point.at(c.gap), "position") @ dv < change - 1e-9 * np.abs(dv).max(initial=0):
            return None
    if turned:
        raise NotCovered("an impact in which sliding in two directions turns")
    return dv


def impacts(
    meaning: Meaning,
    state: State,
    touching: list[flat.Contact],
    pressed: list[flat.Contact],
    rest: dict[str, float],
    frozen: dict[Any, Any] | None = None,
) -> tuple[State, list[str]]:
    """Hits, the fastest first or all together, until nothing approaches; the names of what was hit."""
    happened: list[str] = []
    for _ in range(2000):
        point = meaning.point(state, frozen=frozen)
        closing = [c for c in touching if approach(point, c) < -rest[c.name]]
        if not closing:
            return state, happened
        together = [
            c for c in closing if meaning.option(c.options, "impacts", "sequential") == "simultaneous"
        ]
        fastest = min(closing, key=lambda c: approach(point, c))
        alike = [c for c in closing if approach(point, c) < (1 - ALIKE) * approach(point, fastest)]
        hit = together if fastest in together else [c for c in alike if c not in together]
        others = [
            c for c in touching if c not in hit and meaning.option(c.options, "impacts", "") == "simultaneous"
        ]
        support = others if fastest in together else [c for c in pressed if c not in hit]
        state = strike(meaning, state, hit, support, frozen)
        happened += [c.name for c in hit]
    raise Undetermined("impacts at one instant that do not end")


def climb(meaning: Meaning, state: State, surface: Series, step: float, rows: Array) -> tuple[State, bool]:
    """Pass a step of the potential, or be thrown back by it; ``surface`` is negative beyond. Energy stays."""
    blow = Blow(meaning, state)
    blow.held = np.vstack([blow.held, rows])
    g = blow.point.moved(surface)[:, 0].real
    speed = real(der(surface))
    unit, _ = blow.solve(g, np.zeros((0, len(g))), np.zeros(0))
    W = g @ unit
    if not W > 0:  # the surface is one of time alone: no velocity changes
        return state, True
    square = speed**2 - 2 * W * step
    passes = square > 0
    after = -np.sqrt(square) if passes else -speed
    return blow.after(unit * (after - speed) / W), passes
