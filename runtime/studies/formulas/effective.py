"""Motion in one coordinate, where all the others are cyclic: effective mass and potential (Routh 1877).

With a kinetic energy that is quadratic in the velocities, T = v.M(q)v/2 + b(q).v + c(q), which is measured at a few
velocities, h = v.Mv/2 - c + V is constant; momenta p of the cyclic coordinates give their velocities, and what is left is
m(q) q'^2/2 + U(q) = h.
"""

from __future__ import annotations

import numpy as np

from ...case import Case, inputs_at
from ...outcome import SimulationError
from ...problem import Array
from ...results.evaluate import evaluate_rows

KINETIC, POTENTIAL = "energy.kinetic", "energy.potential"
SAME = 1e-9
"""Relative difference that is rounding."""
NEAR, STEADY = 1e-4, 1e-9
"""Share of the motion's size over which rates are taken, and the rate over it that is none."""


class Effective:
    """``mass`` and ``potential`` as functions of the one coordinate q [n]; ``rates`` of the cyclic ones [n, m]."""

    def __init__(self, case: Case, nominal: Array) -> None:
        """Find the coordinate of a case, whose states have the sizes ``nominal`` [ny].

        Raises SimulationError where there is none, saying why.
        """
        problem = case.problem
        name = problem.name
        if problem.hybrid is not None:
            raise SimulationError(
                f"'{name}' switches: no integral between turning points gives its period",
                help="'orbit' finds the period of a motion with events",
            )
        if problem.constraints or problem.rotations or problem.nq != problem.nv:
            raise SimulationError(
                f"'{name}' has constraints or rotations: a period by integration needs coordinates that are free",
                help="'orbit' finds its period from the motion",
            )
        states = [problem.states[k].name for k in problem.own if k >= 2 * problem.nq]
        if states:
            raise SimulationError(
                f"'{name}' moves in states of first order beside its coordinates: {', '.join(states)}: no period follows "
                "from its energies",
                help="'orbit' finds the periodic motions that it has",
            )
        outputs = [quantity.name for quantity in problem.outputs]
        if KINETIC not in outputs or problem.nq == 0:
            raise SimulationError(f"'{name}' has no kinetic energy, so no period follows from its energies")
        self.case, self.nq = case, problem.nq
        self._columns = [outputs.index(KINETIC), outputs.index(POTENTIAL) if POTENTIAL in outputs else -1]
        self.cyclic = [k for k in range(self.nq) if self._is_cyclic(k)]
        free = [k for k in range(self.nq) if k not in self.cyclic]
        if not free:  # nothing acts: a free motion
            raise SimulationError(f"the energies of '{name}' depend on no coordinate: nothing brings it back")
        if len(free) > 1:
            names = ", ".join(problem.states[k].name for k in free)
            raise SimulationError(
                f"'{name}' moves in {names}, which are not cyclic: a period follows from the energies where one coordinate "
                "is left",
                help="'orbit' finds periodic motions of several coordinates, if nothing damps them to rest",
            )
        self.index = free[0]
        self.start = case.y0[: self.nq].copy()
        self.velocity = case.y0[self.nq : 2 * self.nq].copy()
        self._check_law(nominal[: 2 * self.nq])
        mass, linear, _ = self._quadratic(self.start[None, self.index])
        self.momenta: Array = (mass[0] @ self.velocity + linear[0])[self.cyclic]

    def _energies(self, q: Array, v: Array) -> tuple[Array, Array]:
        """Give T and V [n] at coordinates and velocities [n, nq]."""
        y = np.tile(self.case.y0, (len(q), 1))
        y[:, : self.nq], y[:, self.nq : 2 * self.nq] = q, v
        rows = evaluate_rows(self.case, "outputs", np.full(len(q), self.case.begin), y)
        zero = np.zeros(len(q))
        kinetic, potential = (rows[:, k] if k >= 0 else zero for k in self._columns)
        return kinetic, potential

    def _is_cyclic(self, k: int) -> bool:
        random = np.random.default_rng(k)
        y = self.case.y0
        q = y[: self.nq] * (1 + 0.1 * random.random((4, self.nq)))
        v = y[self.nq : 2 * self.nq] + random.standard_normal((4, self.nq))
        moved = q.copy()
        moved[:, k] += np.array([0.1, 0.7, -1.3, 2.9])
        here, there = self._energies(q, v), self._energies(moved, v)
        return all(
            np.allclose(a, b, rtol=SAME, atol=SAME * float(np.abs(a).max()), equal_nan=False)
            for a, b in zip(here, there, strict=True)
        )

    def _full(self, q: Array) -> Array:
        rows = np.tile(self.start, (len(q), 1))
        rows[:, self.index] = q
        return rows

    def _quadratic(self, q: Array) -> tuple[Array, Array, Array]:
        """Give M [n, nq, nq], b [n, nq] and V - c [n] at the one coordinate q [n]."""
        n, m = len(q), self.nq
        eye = np.eye(m)
        pairs = [(i, j) for i in range(m) for j in range(i)]
        sums = np.array([eye[i] + eye[j] for i, j in pairs]).reshape(-1, m)
        speeds = np.vstack([np.zeros((1, m)), eye, -eye, sums, -sums])
        full = self._full(q)
        found, potentials = self._energies(np.tile(full, (len(speeds), 1)), np.repeat(speeds, n, axis=0))
        kinetic, potential = found.reshape(-1, n), potentials[:n]
        rest = kinetic[0]
        plus, minus = kinetic[1 : m + 1] - rest, kinetic[m + 1 : 2 * m + 1] - rest
        both = kinetic[2 * m + 1 :].reshape(2, -1, n).mean(axis=0) - rest
        mass, linear = np.empty((n, m, m)), (plus - minus).T / 2
        for i in range(m):
            mass[:, i, i] = plus[i] + minus[i]
        for k, (i, j) in enumerate(pairs):
            mass[:, i, j] = mass[:, j, i] = both[k] - (mass[:, i, i] + mass[:, j, j]) / 2
        return mass, linear, potential - rest

    def reduced(self, q: Array) -> tuple[Array, Array, Array, Array]:
        """Give m(q) and U(q) [n], and of the cyclic rates what stays and what goes with q' [n, k] each."""
        mass, linear, potential = self._quadratic(np.atleast_1d(q))
        i, c = self.index, self.cyclic
        if not c:
            none = np.empty((len(potential), 0))
            return mass[:, i, i], potential, none, none
        block, across = mass[:, c][:, :, c], mass[:, c, i]
        # where a cyclic coordinate moves nothing, as an angle at a pole
        block[np.linalg.det(block) == 0] = np.nan
        left = self.momenta - linear[:, c]
        steady = np.asarray(np.linalg.solve(block, left[..., None])[..., 0], dtype=np.float64)
        along = np.asarray(np.linalg.solve(block, across[..., None])[..., 0], dtype=np.float64)
        effective: Array = mass[:, i, i] - np.einsum("nk,nk->n", across, along)
        routh: Array = potential + np.einsum("nk,nk->n", left, steady) / 2
        return effective, routh, steady, -along

    def mass(self, q: Array) -> Array:
        return self.reduced(q)[0]

    def potential(self, q: Array) -> Array:
        return self.reduced(q)[1]

    def rates(self, q: Array) -> Array:
        """Give the velocities of the cyclic coordinates [n, k] where q' = 0."""
        return self.reduced(q)[2]

    def energy(self) -> float:
        """Give h at the start."""
        q = self.start[None, self.index]
        mass, potential, _, _ = self.reduced(q)
        return float(mass[0] * self.velocity[self.index] ** 2 / 2 + potential[0])

    def _check_law(self, size: Array) -> None:
        """Refuse models in which h or the cyclic momenta change: drives, friction, other forces, explicit time."""
        case, problem, nq = self.case, self.case.problem, self.nq
        random = np.random.default_rng(0)
        for _ in range(3):
            y = case.y0.copy()
            y[: 2 * nq] += np.r_[0.05 * size[:nq], 0.5 * size[nq:]] * random.standard_normal(2 * nq)
            self._check_quadratic(y)
            for t in (case.begin, case.begin + 0.37 * (case.stop - case.begin)):
                u = inputs_at(case, t)
                slope = case.functions.rhs(t, y, u, case.z, case.p)[: 2 * nq]
                if not np.isfinite(slope).all():
                    continue
                step = NEAR * float(np.linalg.norm(size)) / max(float(np.linalg.norm(slope)), 1e-300)
                kept, sizes = self._kept(np.array([y[: 2 * nq] + s * step * slope for s in (-2, -1, 1, 2)]))
                change = np.abs((kept[0] - 8 * kept[1] + 8 * kept[2] - kept[3]) / 12)
                changed = change > NEAR * STEADY * sizes
                if changed.any():
                    k = int(np.argmax(changed))
                    whose = problem.states[self.cyclic[k - 1]].name if k else ""
                    what = f"the momentum of '{whose}'" if whose else "its energy"
                    raise SimulationError(
                        f"'{problem.name}' does not keep {what}: no period follows from its energies",
                        help="drives, damping and other forces change it; 'orbit' finds periodic motions that a "
                        "drive keeps up, and damping alone leaves none",
                    )

    def _check_quadratic(self, y: Array) -> None:
        """Refuse kinetic energies that are not quadratic functions of the velocities."""
        nq = self.nq
        q, v = np.tile(y[:nq], (4, 1)), np.outer((0.0, 0.5, 1.0, 1.5), y[nq : 2 * nq] + 0.1)
        kinetic, potential = self._energies(q, v)
        third = kinetic @ (-1.0, 3.0, -3.0, 1.0)
        size = float(np.abs(kinetic).max())
        if abs(third) > 1e-9 * size or np.ptp(potential) > 1e-9 * float(np.abs(potential).max() + size):
            raise SimulationError(
                f"the energies of '{self.case.problem.name}' are not quadratic functions of its velocities: this "
                "integral does not hold for them"
            )

    def _kept(self, rows: Array) -> tuple[Array, Array]:
        """Give h and the cyclic momenta [n, 1 + k] at rows of (q, v), and the sizes of what they are sums of [1 + k]."""
        q, v = rows[:, : self.nq], rows[:, self.nq :]
        found, sizes = [], []
        start = self.start
        for place, speed in zip(q, v, strict=True):
            self.start = place
            mass, linear, potential = (part[0] for part in self._quadratic(place[None, self.index]))
            momentum = (mass @ speed + linear)[self.cyclic]
            size = (np.abs(mass) @ np.abs(speed) + np.abs(linear))[self.cyclic]
            kinetic = speed @ mass @ speed / 2
            found.append([kinetic + potential, *momentum])
            sizes.append([abs(kinetic) + abs(potential), *size])
        self.start = start
        return np.array(found), np.maximum(np.max(sizes, axis=0), 1e-300)
