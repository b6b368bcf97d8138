"""Period and action of motion in one coordinate, by integration between its turning points.

With q = middle - half cos(theta) the roots at both ends vanish and the integrand is a smooth periodic function, for which the
rule of midpoints converges faster than any power (Gauss and Chebyshev); the rest of an energy that is nearly that of a
saddle is met by more points.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import Annotated, Any, ClassVar

import numpy as np
from msgspec import Struct

from ...numerics.roots import minimum, root
from ...outcome import Outcome, SimulationError
from ...problem import Array, Problem
from ...settings import settable
from ..findings import Curve, Findings, Panel, Value, known_digits
from ..flow.pieces import periodic, with_horizon
from ..formulas.effective import Effective
from ..runs.simulate import plan_run
from ..study import OF_A_MOTION, Study

FEWEST, MOST = 16, 2**18
"""Points of an integral."""
EPSILON = float(np.finfo(float).eps)
TURN = 2 * np.pi
HORIZON = 10.0
FAR = 1e9
"""Nominal values of the coordinate up to which a turning point is looked for."""
GROWTH, FIRST = 1.05, 1e-3
"""Steps on the way to it: the first one in nominal values, and how they grow."""
LOOKS, CHUNK = 720, 64
"""Looks at a turn of an angle, and looks at a time."""
CURVE = 31
AT_REST = 1e-6
"""Share of its size within which the start is an unstable rest, if the integral does not settle."""
STEP, STEPS, SAME = 2e-3, 12, 1e-9
"""Steps of dJ/dE: the first one of the height over the bottom, how many, each a quarter of the last, and what settles them."""
SETTLED = 1e-2
"""Of a period: an error above it is not a bound, as the integral grows on with every doubling of the points."""


class Period(Study, frozen=True, kw_only=True):
    """Period, action and turning points of a conservative motion in one coordinate, which may be what is left when all
    others are cyclic."""

    unused = OF_A_MOTION
    of_own_states = True
    # energies have one formula on both sides of a kink
    needs: ClassVar[frozenset[str]] = frozenset({"bends"})

    energy: Annotated[float | None, settable("The energy (default: that of the start).", "energy")] = None

    def solve(self, problem: Problem) -> Findings:
        """Find the turning points and integrate. Raises SimulationError where the motion has none."""
        plan = plan_run(problem, with_horizon(problem, self, HORIZON))
        reduced = Effective(plan.case, plan.nominal)
        well = Well(reduced, float(plan.nominal[reduced.index]), turn=periodic(plan.case, reduced.index))
        energy = reduced.energy() if self.energy is None else self.energy
        return _findings(problem, well, energy)


def _distances(size: float, turn: bool) -> Array:
    """Give distances at which the potential is looked at, up to a turn of an angle or as far as there may be an end."""
    if turn:
        return np.linspace(0.0, TURN * (1 + 2 / LOOKS), LOOKS + 3)
    count = int(np.log(FAR * (GROWTH - 1) / FIRST) / np.log(GROWTH)) + 2
    distances: Array = np.r_[0.0, size * FIRST * np.cumsum(GROWTH ** np.arange(count))]
    return distances


class EnergyLoop(Struct, frozen=True):
    """One period: between ``low`` and ``high``, or a turn where there is no turning point (``sincos_batch``). ``advance`` [k]
    of the cyclic coordinates; ``errors`` of period, action, and advance; ``slowest``: where it stays longest."""

    low: float
    high: float
    turns: bool
    period: float
    action: float
    advance: Array
    errors: tuple[float, float, float]
    slowest: float


class Well:
    """The motions in an effective potential around one place."""

    def __init__(self, reduced: Effective, size: float, *, turn: bool) -> None:
        self.reduced, self.size, self.turn = reduced, size, turn
        self.name = reduced.case.problem.name
        self.place = float(reduced.start[reduced.index])

    def at(self, q: float) -> float:
        value = float(self.reduced.potential(np.array([q]))[0])
        return value if np.isfinite(value) else np.inf

    @cached_property
    def bottom(self) -> float:
        """Give the coordinate of the minimum that is reached downhill from the start."""
        here, step = self.place, FIRST * self.size
        direction = -1.0 if self.at(here - step) < self.at(here + step) else 1.0
        if min(self.at(here - step), self.at(here + step)) >= self.at(here):
            return self._least(here - step, here + step)
        back = here
        while abs(here - self.place) < FAR * self.size:
            ahead = here + direction * step
            if self.at(ahead) > self.at(here):
                return self._least(back, ahead)
            back, here, step = here, ahead, step * GROWTH
        raise SimulationError(
            f"the potential of '{self.name}' has no minimum: nothing brings the motion back"
        )

    def _least(self, one: float, other: float, sign: float = 1.0) -> float:
        """Give the place of the minimum in between; of the maximum, for the other sign."""
        low, high = min(one, other), max(one, other)
        return minimum(lambda q: sign * self.at(q), low, high, 1e-12 * self.size)[0]

    def _highest(self, one: float, other: float) -> float:
        return self._least(one, other, -1.0)

    def top(self, near: float) -> float:
        """Give the place of the maximum near a place."""
        reach = FIRST * self.size
        return self._highest(near - reach, near + reach)

    def loop(self, energy: float) -> EnergyLoop:
        """Give the period at an energy. Raises SimulationError."""
        inside = self._inside(energy)
        ends = [self._end(inside, energy, direction) for direction in (-1.0, 1.0)]
        low, high = ends
        if low is None or high is None:
            if low is None and high is None and self.turn:
                return self._turn(inside, energy)
            raise SimulationError(
                f"at the energy {energy:.6g} '{self.name}' does not come back: no turning point was found"
            )
        return self._swing(low, high)

    def _inside(self, energy: float) -> float:
        """Give a place with less potential energy than that."""
        if self.at(self.place) < energy - 64 * EPSILON * abs(energy):
            return self.place
        bottom = self.bottom
        least = self.at(bottom)
        if not least < energy:
            unit = self.reduced.case.problem.states[self.reduced.index].name
            raise SimulationError(
                f"'{self.name}' has no motion with the energy {energy:.10g}: it is {least:.10g} at rest, at {unit} = "
                f"{0.0 if abs(bottom) < 1e-6 * self.size else bottom:.6g}",
                help=f'begin away from rest: --set {unit}="..."',
            )
        return bottom

    def _end(self, inside: float, energy: float, direction: float) -> float | None:
        """Give the turning point in a direction, or None where there is none in reach."""
        far = _distances(self.size, self.turn)
        for begin in range(0, len(far) - 2, CHUNK):
            q = inside + direction * far[begin : begin + CHUNK + 2]
            u = self.reduced.potential(q)
            u = np.where(np.isfinite(u), u, np.inf)
            for k in np.flatnonzero((u[1:-1] >= energy) | ((u[1:-1] > u[:-2]) & (u[1:-1] >= u[2:]))) + 1:
                outer = q[k] if u[k] >= energy else self._highest(float(q[k - 1]), float(q[k + 1]))
                if self.at(outer) >= energy:
                    return self._root(float(q[k - 1]), float(outer), energy)
            if u[-1] >= energy:
                return self._root(float(q[-2]), float(q[-1]), energy)
        return None

    def _root(self, inner: float, outer: float, energy: float) -> float:
        while not np.isfinite(self.at(outer)):  # a wall
            middle = (inner + outer) / 2
            if middle in (inner, outer):
                return inner
            inner, outer = (middle, outer) if self.at(middle) < energy else (inner, middle)
        return root(lambda q: self.at(q) - energy, inner, outer)

    def _swing(self, low: float, high: float) -> EnergyLoop:
        ends = (self.at(low), self.at(high))
        half = (high - low) / 2

        def parts(n: int) -> tuple[Array, Array, float]:
            theta = (np.arange(n) + 0.5) * np.pi / n
            # distances from the nearer end, so that nothing is lost where the difference of energies vanishes
            fall = np.where(theta < np.pi / 2, 2 * np.sin(theta / 2) ** 2, 2 * np.cos(theta / 2) ** 2) * half
            q = np.where(theta < np.pi / 2, low + fall, high - fall)
            mass, potential, steady, _ = self.reduced.reduced(q)
            lost = EPSILON * (np.abs(potential) + np.abs(ends).max())
            free = np.maximum(np.where(theta < np.pi / 2, ends[0], ends[1]) - potential, lost)
            slow = half * np.sin(theta) * np.sqrt(mass / (2 * free))
            rows = np.column_stack(
                [slow, half * np.sin(theta) * np.sqrt(2 * mass * free), slow[:, None] * steady]
            )
            lost = 2 * (lost / free) @ np.abs(rows) * np.pi / n
            return 2 * rows.sum(axis=0) * np.pi / n, lost, float(q[np.argmax(slow)])

        return self._integrated(parts, low, high, turns=False)

    def _turn(self, inside: float, energy: float) -> EnergyLoop:
        def parts(n: int) -> tuple[Array, Array, float]:
            q = inside + np.arange(n) * TURN / n
            mass, potential, steady, _ = self.reduced.reduced(q)
            free = energy - potential
            slow = np.sqrt(mass / (2 * free))
            rows = np.column_stack([slow, np.sqrt(2 * mass * free), slow[:, None] * steady])
            lost = EPSILON * (np.abs(potential) + abs(energy)) / free
            return rows.sum(axis=0) * TURN / n, lost @ np.abs(rows) * TURN / n, float(q[np.argmax(slow)])

        return self._integrated(parts, inside, inside + TURN, turns=True)

    def _integrated(
        self, parts: Callable[[int], tuple[Array, Array, float]], low: float, high: float, *, turns: bool
    ) -> EnergyLoop:
        """Double the points until the integrals settle: the last change is the error, and at least what is lost to
        rounding in the difference of two energies."""
        n, (before, *_) = FEWEST, parts(FEWEST)
        while True:
            n *= 2
            now, lost, slowest = parts(n)
            change, lost = np.abs(now - before), np.maximum(lost, ROUNDING * np.abs(now))
            if (change <= lost).all() or n >= MOST:
                break
            before = now
        errors = np.maximum(change, lost)
        advance = now[2:]
        return EnergyLoop(
            low, high, turns, float(now[0]), float(now[1]), advance,
            (float(errors[0]), float(errors[1]), float(errors[2:].max(initial=0.0))), slowest,
        )  # fmt: skip


ROUNDING = 64 * EPSILON
"""What the sums lose, relative: turning points are known to four roundings, and E - U near them to some more."""


def _refuse_endless(problem: Problem, well: Well, energy: float, loop: EnergyLoop) -> None:
    """Refuse motions that end at an unstable rest, or so near to one that rounding decides how long they stay."""
    if loop.errors[0] <= SETTLED * loop.period:
        return
    index = well.reduced.index
    top = well.top(loop.slowest)
    coordinate, away = problem.states[index], well.place - top
    away -= TURN * round(away / TURN) if well.turn else 0.0
    begins = abs(away) <= AT_REST * well.size and well.reduced.velocity[index] == 0
    place = well.place if begins else top
    place = 0.0 if abs(place) <= AT_REST * well.size else place
    raise SimulationError(
        f"'{problem.name}' {'begins at' if begins else 'moves towards'} an unstable rest, "
        f"{f'{coordinate.name} = {place:.7g} {coordinate.unit}'.rstrip()}: it has no finite period",
        help=f'motions of other energies have one: --set {coordinate.name}="...", or --energy',
    )


def _findings(problem: Problem, well: Well, energy: float) -> Findings:
    loop = well.loop(energy)
    _refuse_endless(problem, well, energy, loop)
    names = [problem.states[k].name for k in well.reduced.cyclic]
    units = [problem.states[k].unit for k in well.reduced.cyclic]
    coordinate = problem.states[well.reduced.index]
    joule = next((q.unit for q in problem.outputs if q.kind == "energy"), "")
    action_unit = f"{joule} {problem.time.unit}".strip()
    values = [
        Value("energy", joule, energy, EPSILON * abs(energy)),
        Value("period", problem.time.unit, loop.period, loop.errors[0]),
        Value("action", action_unit, loop.action, loop.errors[1]),
        Value("action/2pi", action_unit, loop.action / TURN, loop.errors[1] / TURN),
    ]
    details: dict[str, Any] = {"period": loop.period, "action": loop.action, "energy": energy}
    details["turning_points"] = [] if loop.turns else [loop.low, loop.high]
    details["turns"] = loop.turns
    if not loop.turns:
        reach = 8 * EPSILON * max(abs(loop.low), abs(loop.high), well.size)
        values += [
            Value(f"lowest {coordinate.name}", coordinate.unit, loop.low, reach),
            Value(f"highest {coordinate.name}", coordinate.unit, loop.high, reach),
        ]
    advance = dict(zip(names, loop.advance.tolist(), strict=True))
    details["advance"] = advance
    values += [
        Value(f"advance of {name}", unit, advance[name], loop.errors[2])
        for name, unit in zip(names, units, strict=True)
    ]
    panels, remarks = _over_energy(problem, well, energy, loop, joule, action_unit)
    if loop.turns:
        remarks = (f"{coordinate.name} goes round: the period is that of one turn", *remarks)
    return Findings(
        study="period",
        model=problem.name,
        outcome=Outcome.COMPLETED,
        message=f"period {known_digits(loop.period, loop.errors[0], problem.time.unit)}",
        values=tuple(values),
        errors_from="integrals with half of the points, and rounding",
        remarks=remarks,
        panels=panels,
        details=details,
    )


def _slope(well: Well, energy: float, turns: bool, step: float) -> float | None:
    """Give dJ/dE by differences of fourth order, with the step at which a shorter one changes least and rounding of J matters little: beside
    a separatrix the first step leads beyond it. None if there is no motion of this kind around."""
    best: tuple[float, float | None] = (np.inf, None)
    last: tuple[float, float] | None = None
    for _ in range(STEPS):
        try:
            around = [well.loop(energy + k * step) for k in (-2, -1, 1, 2)]
        except SimulationError:
            around = []
        if around and all(one.turns == turns for one in around):
            j = [one.action for one in around]
            slope = (j[0] - 8 * j[1] + 8 * j[2] - j[3]) / (12 * step)
            if last is None:
                best = (np.inf, slope)
            elif (off := max(abs(last[0] - slope), last[1])) < best[0]:
                best = (off, last[0])
            if best[0] <= SAME * abs(slope):
                break
            last = slope, 1.5 * max(one.errors[1] for one in around) / step
        step /= 4
    return best[1]


def _over_energy(
    problem: Problem, well: Well, energy: float, loop: EnergyLoop, joule: str, action_unit: str
) -> tuple[tuple[Panel, ...], tuple[str, ...]]:
    """Draw period and action over the energy, and hold T against dJ/dE."""
    least = well.at(well.bottom)
    slope = _slope(well, energy, loop.turns, STEP * (energy - least))
    remarks: tuple[str, ...] = ()
    if slope is not None:
        remarks = (
            f"dJ/dE, of the action J, is {slope:.10g}: it is the period but for {abs(slope - loop.period):.1e}",
        )
    energies: list[float] = []
    periods: list[float] = []
    actions: list[float] = []
    turned: bool | None = None
    for e in least + (energy - least) * np.linspace(0.02, 2.0, CURVE):
        try:
            one = well.loop(float(e))
        except SimulationError:
            continue
        if turned not in (None, one.turns):  # a separatrix in between
            energies.append(float(e))
            periods.append(np.nan)
            actions.append(np.nan)
        turned = one.turns
        energies.append(float(e))
        periods.append(one.period if one.errors[0] < 1e-3 * one.period else np.nan)
        actions.append(one.action)
    x = np.array(energies)
    here = np.array([energy])
    unit = problem.time.unit
    return (
        Panel("period", "energy", joule, "period", unit, (
            Curve("period", x, np.array(periods)),
            Curve("this motion", here, np.array([loop.period]), "points"))),
        Panel("action", "energy", joule, "action", action_unit, (
            Curve("action", x, np.array(actions)),
            Curve("this motion", here, np.array([loop.action]), "points"))),
    ), remarks  # fmt: skip
