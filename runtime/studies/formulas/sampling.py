"""Random states of a model, on its constraints, with rates and all quantities of the part ``phase``."""

from __future__ import annotations

import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from ...case import Case, inputs_at
from ...outcome import SimulationError
from ...problem import Array

TRIES = 12
"""So many times as many states are tried as are wanted: where square roots of negative numbers come up."""

CALM = 4 / 3
"""So many times as many states are formed as are wanted; those with the largest rates, near singular places, are left out."""

FARTHER = 4.0
"""Times the usual spread, of states that are wide."""

CORRECTIONS = 40
ON_CONSTRAINTS = 1e-12
"""Newton's corrections of a random state that has to fulfil constraints, relative to the size of coordinates."""

REPEATABLE = 20260


class PhaseSample(Struct, frozen=True, eq=False):
    """``t`` [n], ``y`` and ``rate`` [n, ny], ``phase`` and ``phase_rate`` [n, number of quantities]."""

    t: Array
    y: Array
    rate: Array
    phase: Array
    phase_rate: Array


class Sampler:
    """Where random states of a case are taken from: around its start, as wide as its coordinates are large."""

    def __init__(self, case: Case, seed: int = REPEATABLE) -> None:
        problem = case.problem
        self.case = case
        self.random = np.random.default_rng(seed)
        self.turning = {i + k for i in problem.rotations for k in range(4)}
        self.width = self._widths()
        nq, nv = problem.nq, problem.nv
        lengths = self.width[:nq][[k not in self.turning for k in range(nq)]]
        typical = float(np.median(lengths)) if lengths.size else 1.0
        speed = float(np.median(self.width[nq : nq + nv])) if nv else 1.0
        self.time = typical / speed if speed > 0 else 1.0
        span = case.stop - case.begin
        if 0 < span < self.time:
            self.time = span

    def _widths(self) -> Array:
        """Return how far each number of the state is spread: the largest start of its unit, else what accelerations
        make of the coordinates."""
        problem, case = self.case.problem, self.case
        nq, nv = problem.nq, problem.nv
        width = np.ones(problem.ny)
        sizes: dict[tuple[str, str], float] = {}
        for k, state in enumerate(problem.states):
            key = (state.kind, state.unit)
            size = max(abs(float(case.y0[k])), state.nominal or 0.0)
            sizes[key] = max(sizes.get(key, 0.0), size)
        for k, state in enumerate(problem.states):
            size = sizes[state.kind, state.unit]
            width[k] = 1.0 if state.unit == "rad" or size == 0.0 or k in self.turning else size
            if not state.unit:
                width[k] = max(width[k], 1.0)  # of a pure number, small starts say little of its range
        still = [k for k in range(nq, nq + nv) if sizes["rate", problem.states[k].unit] == 0.0]
        if still:
            found = []
            for _ in range(8):
                y = case.y0.copy()
                y[:nq] += 0.3 * width[:nq] * self.random.uniform(-1, 1, nq)
                self._normalise(y)
                rate = case.functions.rhs(case.begin, y, inputs_at(case, case.begin), case.z, case.p)
                found.append(np.abs(rate[nq : nq + nv]))
            with np.errstate(all="ignore"):
                accelerations = np.nanmedian(np.array(found), axis=0)
            for k in still:
                a = float(accelerations[k - nq])
                own = width[k - nq] if nq == nv else 1.0
                if np.isfinite(a) and a > 0:
                    width[k] = float(np.sqrt(a * own))
        return width

    def states(self, count: int, p: Array | None = None, *, wide: bool = False) -> PhaseSample:
        """Give ``count`` states at which everything is finite. Raises SimulationError if there are too few.

        ``p``: other values of parameters than those of the case. ``wide``: half of them from farther away, where what is
        nearly constant close by is not.
        """
        case = self.case if p is None else replace(self.case, p=p)
        wanted = int(np.ceil(CALM * count))
        rows: list[tuple[float, Array, Array, Array, Array]] = []
        for attempt in range(TRIES * count):
            # closer to the start if the wide world has hardly any state
            reach = 1.0 if attempt < 4 * count else 0.3
            if wide and attempt % 2:
                reach *= FARTHER
            row = self._one(case, reach)
            if row is not None:
                rows.append(row)
            if len(rows) == wanted:
                break
        else:
            raise SimulationError(
                f"'{case.problem.name}' has values at {len(rows)} of {TRIES * count} random states only",
                help="give coordinates a min and max, or start where everything has a value",
            )
        nq = case.problem.nq
        rows.sort(key=lambda row: float(np.abs(row[2][nq:] / self.width[nq:]).max(initial=0.0)))
        rows = rows[:count]
        t, y, rate, phase, phase_rate = (np.array(column) for column in zip(*rows, strict=True))
        return PhaseSample(t, y, rate, phase, phase_rate)

    def _one(self, case: Case, reach: float) -> tuple[float, Array, Array, Array, Array] | None:
        problem, functions, random = case.problem, case.functions, self.random
        nq, nv = problem.nq, problem.nv
        t = case.begin + self.time * float(random.uniform(0.0, 1.0))
        y = case.y0.copy()
        spread = random.uniform(-1, 1, problem.ny)
        y += reach * self.width * spread
        y[nq : nq + nv] = reach * (1.3 * self.width * spread)[nq : nq + nv]
        for k, state in enumerate(problem.states):
            if k in self.turning:
                y[k] = random.normal()
            elif state.kind == "account":
                y[k] = case.y0[k]
            elif state.minimum is not None or state.maximum is not None:
                low = case.y0[k] - self.width[k] if state.minimum is None else state.minimum
                high = case.y0[k] + self.width[k] if state.maximum is None else state.maximum
                if not low < y[k] < high:
                    y[k] = random.uniform(low, high)
        self._normalise(y)
        u = inputs_at(case, t)
        if u.size:
            u = u + random.uniform(-1, 1, u.size) * np.maximum(1.0, np.abs(u))
        if problem.constraints and not self._onto(case, t, y, u):
            return None
        with np.errstate(all="ignore"):
            rate = functions.rhs(t, y, u, case.z, case.p)
            assert functions.phase is not None and functions.phase_rate is not None, "the part phase"
            phase = functions.phase(t, y, u, case.z, case.p)
            phase_rate = functions.phase_rate(t, y, u, case.z, case.p)
        if not (np.isfinite(rate).all() and np.isfinite(phase).all() and np.isfinite(phase_rate).all()):
            return None
        return t, y, rate, phase, phase_rate

    def _normalise(self, y: Array) -> None:
        for i in self.case.problem.rotations:
            y[i : i + 4] /= np.linalg.norm(y[i : i + 4])

    def _onto(self, case: Case, t: float, y: Array, u: Array) -> bool:
        """Move a state onto the constraints; tell whether it got there."""
        problem, functions = case.problem, case.functions
        nq, nv = problem.nq, problem.nv
        if functions.project_position is None or functions.displace is None:
            return False
        assert functions.project_velocity is not None
        scale = self.width[:nq]
        for _ in range(CORRECTIONS):
            moved = y.copy()
            moved[nq : nq + nv] = functions.project_position(t, y, u, case.z, case.p)[:nv]
            step = functions.displace(t, moved, u, case.z, case.p)
            if not np.isfinite(step).all() or np.abs(step / scale).max(initial=0.0) > 1e3:
                return False
            y[:nq] += step
            self._normalise(y)
            if np.abs(step / scale).max(initial=0.0) < ON_CONSTRAINTS:
                break
        else:
            return False
        for _ in range(2):
            y[nq : nq + nv] += functions.project_velocity(t, y, u, case.z, case.p)[:nv]
        return bool(np.isfinite(y).all())
