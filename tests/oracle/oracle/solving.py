"""Accelerations and forces of an instant: one dense system, all cases of contact and dry friction tried."""

from __future__ import annotations

import itertools
from collections.abc import Collection, Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from oracle.expressions import der
from oracle.point import Point, Unknowns, at_order, now
from oracle.questions import answer, key_of, known_now
from oracle.series import STEP, real
from oracle.values import Ambiguous, Bent, Several, Undetermined

if TYPE_CHECKING:
    from oracle.meaning import Meaning

Array = Any
NEAR = 1e-9
CLEARLY = 1e-6
"""By how much the conditions of a mode hold, as shares of what acts, where nothing is tied."""
AWAY = (3, -3, 1, -1, 0.3, -0.3, 0.1, -0.1)
"""Where other answers to questions in laws are looked for, as shares of their size."""


@dataclass(frozen=True)
class Solution:
    """``point`` knows the accelerations; ``superfluous`` are the forces that no law tells apart."""

    point: Point
    unknowns: Unknowns
    modes: dict[str, str]
    superfluous: frozenset[str]


# ---------------------------------------------------------------- one combination of modes


def force_names(meaning: Meaning, point: Point, modes: Mapping[str, str]) -> list[str]:
    names = [name for name, _, _ in point.rows()]
    for c in meaning.flat.contacts:
        mode = modes.get(c.name, "open")
        if mode != "open":
            names.append(c.name)
        if mode == "stick":
            names += [f"{c.name}/{k}" for k in range(len(point.slip(c)))]
        if mode == "slip*":
            names.append(f"{c.name}/angle")
    return names + [f.name for f in meaning.flat.frictions if modes.get(f.name) == "stick"]


def residual(meaning: Meaning, point: Point, modes: Mapping[str, str]) -> list[Array]:
    """What has to vanish: balance of forces, accelerations of constraints, laws of states, assumed answers."""
    rows = list((point.inertial() - point.applied())[: meaning.size])
    rows += [at_order(value, 2 if kind == "position" else 1) for _, kind, value in point.rows()]
    for c in meaning.flat.contacts:
        mode = modes.get(c.name, "open")
        if mode != "open":
            rows.append(at_order(point.at(c.gap), 2))
        if mode == "stick":
            rows += [at_order(s, 1) for s in point.slip(c)]
        if mode == "slip*":
            (s, t), phi = (at_order(s, 1) for s in point.slip(c)), point.unknowns.forces[f"{c.name}/angle"]
            rows.append(s * np.sin(phi) - t * np.cos(phi))
    for f in meaning.flat.frictions:
        if modes.get(f.name) == "stick":
            rows.append(at_order(der(point.at(f.on)), 1))
    for name, value in state_laws(meaning, point).items():
        rows.append(point.unknowns.rates[name] - now(value))
    for q in meaning.law_questions:
        assumed = point.unknowns.answers[key_of(q)]
        defined = answer(meaning, point, q, defining=True)
        pairs = zip(np.ravel(np.asarray(assumed, object)), np.ravel(np.asarray(defined, object)), strict=True)
        rows += [now(x) - now(y) for x, y in pairs]
    return rows


def state_laws(meaning: Meaning, point: Point) -> dict[str, Any]:
    """`equation der(x) = e`, element by element (section 4)."""
    laws: dict[str, Any] = {}
    for name, shape, elements in meaning.state_layout:
        for e in meaning.flat.equations:
            if e.state == name:
                value = np.ravel(np.asarray(point.at(e.value), object))
                index = (
                    np.arange(len(elements)).reshape(shape)[e.indices]
                    if e.indices
                    else np.arange(len(elements))
                )
                laws.update({elements[i]: v for i, v in zip(np.ravel(index), value, strict=True)})
    return {x: laws[x] for _, _, elements in meaning.state_layout for x in elements}


def solve_in(
    meaning: Meaning,
    state: Mapping[str, float],
    modes: Mapping[str, str],
    frozen: dict[Any, Any] | None,
    quick: bool = False,
    angle: float = 0.1,
    seen: bool = True,
) -> Solution:
    """Newton's method on all unknowns at once; where the laws are affine it ends after one step.

    Not ``seen``: the unknowns alone are asked for, and at the point of the solution nothing has been evaluated.
    """
    key = (*modes.items(), *((k, v) for k, v in state.items() if k.startswith("held(")))
    if key not in meaning.force_names:
        bare = Point(meaning, state, Unknowns(meaning.unasked), frozen=frozen, modes=modes)
        meaning.force_names[key] = force_names(meaning, bare, modes)
    names = meaning.force_names[key]
    n, states, asked = meaning.size, meaning.states, meaning.law_questions
    widths = [
        1
        if q.function == "power" or (q.function == "moment" and meaning.flat.space == 2)
        else meaning.flat.space
        for q in asked
    ]
    N = n + len(names) + len(states) + sum(widths)

    def unpack(z: Array) -> Unknowns:
        forces = {name: z[n + i] for i, name in enumerate(names)}
        k = n + len(names)
        rates = {name: z[k + i] for i, name in enumerate(states)}
        k += len(states)
        answers: dict[Any, Any] = {}
        for q, width in zip(asked, widths, strict=True):
            items = np.empty(width, object)
            items[:] = [known_now(z[k + i]) for i in range(width)]
            answers[key_of(q)] = items[0] if width == 1 else items
            k += width
        return Unknowns(z[:n], forces, rates, answers)

    def look(z: Array, steps: Array) -> tuple[Point, Array]:
        point = Point(meaning, state, unpack(z[:, None] + 1j * STEP * steps), frozen=frozen, modes=modes)
        rows = residual(meaning, point, modes)
        return point, np.array([np.broadcast_to(r, steps.shape[1]) for r in rows]).reshape(N, steps.shape[1])

    def scan(z: Array) -> tuple[Array, Array]:
        try:
            rows = look(z, np.eye(N))[1]
        except ValueError:  # a law that is not a number there
            return np.full(N, np.nan), np.full((N, N), np.nan)
        return rows[:, 0].real, rows.imag / STEP

    last: tuple[Array, Point, Array] | None = None

    def stays(z: Array, J: Array) -> Array | None:
        """The residual after a step, where a further one with the same slopes would change nothing: the laws are affine."""
        nonlocal last
        try:
            last = z, *look(z, np.zeros((N, 1)))
        except ValueError:
            return None
        r = last[2][:, 0].real
        small = np.isfinite(r).all() and (np.abs(r) <= 1e-13 * (np.abs(J) @ np.abs(z))).all()
        return r if small and np.abs(least(J, r)[0]).max() <= 1e-13 * np.abs(z).max() else None

    def root(z: Array, steps: int = 80) -> tuple[Array, Array, Array, Array, bool]:
        """Newton's method from z: where it ends with residual, Jacobian and the directions left open, and whether it bends."""
        dz, loose, r, J = np.zeros(N), np.zeros((0, N)), np.zeros(N), np.zeros((N, N))
        first: Array | None = None
        for attempt in range(steps if N else 0):
            r, J = scan(z)
            for _ in range(40):
                if np.isfinite(r).all() and np.isfinite(J).all():
                    break
                dz = dz / 2
                z = z + dz
                r, J = scan(z)
            else:
                raise Undetermined("the laws are not numbers here")
            first = J if first is None else first
            dz, loose = least(J, r)
            size = np.abs(J) @ np.abs(z) + np.abs(J) @ np.abs(dz) + np.abs(r) + 1e-300
            if (attempt and np.abs(dz).max() <= 1e-13 * (np.abs(z).max() + 1e-300)) or not r.any():
                break
            z = z - dz
            if quick and (meaning.plain or meaning.affine) and not any(m == "slip*" for m in modes.values()):
                break
            if not attempt and not quick and (settled := stays(z, J)) is not None:
                r = settled
                break
            if attempt >= 1 and (np.abs(r) <= 1e-12 * size).all():
                break
        else:
            if N:
                raise Undetermined("no accelerations that satisfy the laws")
        bends = first is not None and np.abs(J - first).max(initial=0) > 1e-6 * np.abs(first).max(initial=0)
        if quick and attempt:
            meaning.affine = meaning.affine is None and not bends
        return z, r, J, loose, bool(bends)

    z, superfluous = np.zeros(N), frozenset[str]()
    z[n : n + len(names)] = [
        angle if name.endswith("/angle") else 0.0 if meaning.plain else 1.0 for name in names
    ]
    z, r, J, loose, bends = root(z)
    if bends and not quick and "slip*" not in modes.values():
        answers = np.r_[n + len(names) + len(states) : N]
        asking, told = np.r_[n : n + len(names), answers], np.r_[:n, answers]
        for away in AWAY:  # other forces and answers that agree with themselves
            elsewhere = z.copy()
            elsewhere[asking] += away * (1 + np.abs(z[asking]))
            try:
                other = root(elsewhere, 20)[0]
            except Undetermined:
                continue
            if np.abs(other - z)[told].max(initial=0) > 1e-6 * (1 + np.abs(z[told]).max(initial=0)):
                raise Several("several forces that agree with their laws")
    if N and not quick:
        size = np.abs(J) @ np.abs(z) + np.abs(J).max(axis=1) * (1e-5 * np.abs(z).max() + 1e-12)
        if (np.abs(r) > 1e-7 * size).any():
            raise Undetermined("constraints that contradict each other")
        others = np.delete(loose, np.s_[n : n + len(names)], axis=0)
        if loose.size and np.abs(others).max(initial=0) > 1e-6:
            if (
                np.abs(others[:n]).max(initial=0) <= 1e-6
            ):  # the motion is known, and what follows a load that is shared is not
                raise Several("a law that asks for a load which others share")
            raise Undetermined("accelerations that no law tells")
        shown = np.abs(loose[n : n + len(names)]).max(axis=1, initial=0) > 1e-6
        superfluous = frozenset(name for name, free in zip(names, shown, strict=True) if free)
    if seen:
        point, rows = last[1:] if last is not None and last[0] is z else look(z, np.zeros((N, 1)))
        size = np.abs(J) @ np.abs(z) + np.abs(r) + 1e-12
        if quick and meaning.affine and N and (np.abs(rows[:, 0]) > 1e-7 * size).any():
            meaning.affine = False
            raise Bent
    else:
        point = Point(meaning, state, unpack(z[:, None] + 0j), frozen=frozen, modes=modes)
    return Solution(point, point.unknowns, dict(modes), superfluous)


def least(J: Array, r: Array) -> tuple[Array, Array]:
    """The shortest solution of J dz = r, with rows and columns made alike first, and the directions left open."""
    row, column = np.ones(len(J)), np.ones(len(J))
    for _ in range(4):
        scaled = np.abs(row[:, None] * J * column)
        row /= np.sqrt(np.where(scaled.max(axis=1) > 0, scaled.max(axis=1), 1))
        column /= np.sqrt(np.where(scaled.max(axis=0) > 0, scaled.max(axis=0), 1))
    U, s, Vt = np.linalg.svd(row[:, None] * J * column)
    keep = s > 1e-10 * s[0]
    dz = column * (Vt[keep].T @ ((U.T @ (row * r))[keep] / s[keep]))
    return dz, Vt[~keep].T


# ---------------------------------------------------------------- all combinations


def touches(meaning: Meaning, state: Mapping[str, float], point: Point, contact: Any) -> bool:
    if not meaning.holds(state, contact.name):
        return False
    if f"closed({contact.name})" in state:
        return bool(state[f"closed({contact.name})"])
    gap = point.at(contact.gap)
    length = 1 + max((abs(state[x]) for x in meaning.all_coordinates), default=0)
    speed = 1 + max((abs(state[x]) for x in meaning.all_rates), default=0)
    return bool(abs(real(gap)) <= NEAR * length and float(np.real(at_order(gap, 1)[0])) <= NEAR * speed)


def choices(meaning: Meaning, state: Mapping[str, float], point: Point) -> dict[str, list[str]]:
    """What each contact and each friction may do now; to stick comes first."""
    out: dict[str, list[str]] = {}
    speed = 1 + max((abs(state[x]) for x in meaning.all_rates), default=0)

    def dry(name: str, rates: list[float]) -> list[str]:
        sign = state.get(f"slips({name})", 0.0 if max(abs(r) for r in rates) <= NEAR * speed else rates[0])
        if sign == 0:
            return ["stick", "slip+", "slip-"] if len(rates) == 1 else ["stick", "slip*"]
        return ["slip"] if len(rates) > 1 else ["slip+" if sign > 0 else "slip-"]

    for c in meaning.flat.contacts:
        if not touches(meaning, state, point, c):
            out[c.name] = ["open"]
        elif c.friction is None:
            out[c.name] = ["closed", "open"]
        elif meaning.smooth(c.options):
            out[c.name] = ["slip", "open"]
        else:
            out[c.name] = [*dry(c.name, [real(s) for s in point.slip(c)]), "open"]
    for f in meaning.flat.frictions:
        out[f.name] = ["slip"] if meaning.smooth(f.options) else dry(f.name, [real(der(point.at(f.on)))])
    return out


def margins(meaning: Meaning, s: Solution, options: Mapping[str, list[str]]) -> dict[str, float]:
    """By how much the conditions of each mode are fulfilled, of the order of one (section 15)."""
    point, out = s.point, {}
    forces = {name: float(np.real(np.ravel(f)[0])) for name, f in s.unknowns.forces.items()}
    # what is zero but for rounding presses on nothing
    load = 1e-6 + max((abs(f) for f in forces.values()), default=0)
    pace = (
        1e-12
        + float(np.abs(s.unknowns.a).max(initial=0))
        + max((abs(point.state[x]) for x in meaning.all_rates), default=0)
    )

    def friction(name: str, mode: str, parts: list[Any], tangential: list[float], limit: float) -> None:
        if mode == "stick":
            out[f"{name} sticks"] = (limit - float(np.linalg.norm(tangential))) / load
        elif mode in ("slip+", "slip-") and {"slip+", "slip-"} <= set(options[name]):
            out[f"{name} starts"] = (
                float(np.real(np.ravel(parts[0])[0])) * (1 if mode == "slip+" else -1) / pace
            )
        elif mode == "slip*":
            phi = forces[f"{name}/angle"]
            x, y = (float(np.real(np.ravel(p)[0])) for p in parts)
            out[f"{name} starts"] = (x * np.cos(phi) + y * np.sin(phi)) / pace

    for c in meaning.flat.contacts:
        mode = s.modes[c.name]
        if mode == "open":
            if "open" in options[c.name] and len(options[c.name]) > 1:
                out[f"{c.name} opens"] = float(np.real(np.ravel(at_order(point.at(c.gap), 2))[0])) / pace
            continue
        out[f"{c.name} presses"] = forces[c.name] / load
        if c.friction is not None and not meaning.smooth(c.options):
            parts = [at_order(x, 1) for x in point.slip(c)]
            mu = real(point.at(c.static if c.static is not None else c.friction))
            held = [forces.get(f"{c.name}/{k}", 0.0) for k in range(len(parts))]
            friction(c.name, mode, parts, held, mu * forces[c.name])
    for f in meaning.flat.frictions:
        if not meaning.smooth(f.options):
            limit = real(point.at(f.static if f.static is not None else f.kinetic))
            load = max(load, abs(limit))
            friction(
                f.name, s.modes[f.name], [at_order(der(point.at(f.on)), 1)], [forces.get(f.name, 0.0)], limit
            )
    return out


def solve(
    meaning: Meaning,
    state: Mapping[str, float],
    modes: Mapping[str, str] | None = None,
    frozen: dict[Any, Any] | None = None,
    without: Collection[str] = (),
) -> Solution:
    """The motion that goes on from a state: in given modes, or in the one combination that fits, ``without`` some."""
    if modes is not None:
        return solve_in(meaning, state, modes, frozen)
    options = choices(meaning, state, meaning.point(state, frozen=frozen))
    for name, ways in options.items():  # what has just come to its end
        if f"{name} presses" in without:
            options[name] = ["open"]
        elif f"{name} sticks" in without:
            options[name] = [w for w in ways if w != "stick"]
    if all(len(o) == 1 for o in options.values()):
        return solve_in(meaning, state, {k: o[0] for k, o in options.items()}, frozen)
    fitting: dict[tuple[bool, ...], Solution] = {}
    for combination in itertools.product(*options.values()):
        taken = dict(zip(options, combination, strict=True))
        pattern = tuple(taken[c.name] != "open" for c in meaning.flat.contacts)
        if pattern in fitting:
            continue
        for angle in np.arange(8) * np.pi / 4 + 0.1 if "slip*" in combination else [0.1]:
            try:
                s = solve_in(meaning, state, taken, dict(frozen) if frozen is not None else None, angle=angle)
            except Several:
                raise
            except Undetermined:
                continue
            if min(margins(meaning, s, options).values(), default=0) >= -NEAR:
                fitting[pattern] = s
                break
    if not fitting:
        raise Undetermined("no combination of touching, sticking and sliding fits")
    first, *others = fitting.values()
    for other in others:
        a, b = first.unknowns.a[:, 0].real, other.unknowns.a[:, 0].real
        if np.abs(a - b).max(initial=0) > 1e-6 * (1 + np.abs(a).max(initial=0)):
            barely = min(abs(x) for s in (first, other) for x in margins(meaning, s, options).values())
            kind = Ambiguous if barely > CLEARLY else Undetermined
            raise kind("several combinations of touching, sticking and sliding fit")
    if frozen is not None:
        solve_in(meaning, state, first.modes, frozen)
    stuck = {name: "stick" if "stick" in ways else first.modes[name] for name, ways in options.items()}
    if (
        "stick" in stuck.values()
    ):  # what else holds may share a load with friction that nothing moves: none is told
        with suppress(Undetermined):
            other = solve_in(meaning, state, stuck, dict(frozen) if frozen is not None else None)
            return replace(first, superfluous=first.superfluous | other.superfluous)
    return first
