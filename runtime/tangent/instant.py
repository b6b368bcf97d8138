"""What happens at one instant, done again with derivatives: impulses, branches, and what holds afterwards.

The kernel has decided what happens; here it is done once more, each operation on a state and its derivatives.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..case import inputs_at
from ..functions import named_function
from ..native import contract
from ..numerics.rank import inverse
from ..problem import Array
from .augmented import Augmented
from .coordinates import basis, projected

GAP, RATE, DRIFT, SECOND, FORCE, LIMIT, COEFFICIENT, EXTRA = range(8)
"""What is measured of each row (``mech_row_value`` of the kernel)."""

CONTACT, FRICTION, BILATERAL, STEP = range(4)
REMAINS = 1e-3
"""Of the slip from which on friction in two directions keeps its direction: what of it remains where it is taken to stick."""

ROUNDING = 1e-11
"""Share of the largest response below which rows depend on each other, as in the kernel."""


class Instant:
    """A state at one time that changes: ``y`` [ny], ``w`` [ny, k], ``z`` [nz], ``dz`` [real ones, k], and how the time itself
    changes in each direction, ``dt`` [k]. ``w`` are changes at the changed time."""

    def __init__(
        self, augmented: Augmented, t: float, y: Array, w: Array, z: Array, dz: Array, dt: Array
    ) -> None:
        self.augmented, self.t = augmented, t
        self.y, self.w, self.z, self.dz, self.dt = y.copy(), w.copy(), z.copy(), dz.copy(), dt
        self.case = augmented.case
        struct = self.case.functions.struct
        assert struct.hybrid
        self.hybrid = contract.HybridStruct.from_address(struct.hybrid)
        self.rows = tuple(self.hybrid.rows[i] for i in range(self.hybrid.n_rows))
        self.reals = augmented.reals

    def copy(self) -> Instant:
        return Instant(self.augmented, self.t, self.y, self.w, self.z, self.dz, self.dt)

    # ------------------------------------------------------------ functions

    def own(self, name: str, size: int) -> Array:
        """Evaluate a function of the model here."""
        function = named_function(self.case.problem, self.case.functions, name, size)
        return function(self.t, self.y, self.inputs(), self.z, self.case.p)

    def change(self, name: str, size: int) -> Array:
        """Evaluate its derivatives [size, k] here."""
        augmented = self.augmented
        z = augmented.discretes_at_event(self.z, self.dz, self.t, self.dt)
        function = augmented.function(f"tangent_{name}", size)
        row = function(self.t, augmented.joined(self.y, self.w), augmented.inputs(self.t), z, augmented.p)
        return row.reshape(augmented.count, size).T

    def inputs(self) -> Array:
        return inputs_at(self.case, self.t)

    def rates(self) -> Array:
        return self.case.functions.rhs(self.t, self.y, self.inputs(), self.z, self.case.p)

    def energy(self) -> tuple[float, Array]:
        """The total energy and its derivatives."""
        if self.hybrid.total < 0:
            return 0.0, np.zeros(self.augmented.count)
        augmented = self.augmented
        assert augmented.functions.outputs is not None
        row = augmented.functions.outputs(
            self.t,
            augmented.joined(self.y, self.w),
            augmented.inputs(self.t),
            augmented.discretes(self.z, self.dz),
            augmented.p,
        )
        values, changes = augmented.split(row, len(self.case.problem.outputs))
        return float(values[self.hybrid.total]), changes[self.hybrid.total]

    def measured(self) -> tuple[Array, Array]:
        """Give [rows, 8] and [rows, 8, k]: what is measured of the rows."""
        count = len(self.rows)
        values = self.own("row_values", 8 * count).reshape(count, 8)
        return values, self.change("row_values", 8 * count).reshape(count, 8, -1)

    def responses(self) -> tuple[Array, Array]:
        """Give [rows, nv + rows] and [.., k]: changes of velocities and rates by a unit impulse along each row."""
        width = self.case.problem.nv + len(self.rows)
        values, changes = [], []
        for row in self.rows:
            self.z[row.impulse] = 1.0
            values.append(self.own("respond", width))
            changes.append(self.change("respond", width))
            self.z[row.impulse] = 0.0
        return np.array(values), np.array(changes)

    # ------------------------------------------------------------ operations

    def push(self, rows: Sequence[int], impulses: Array, impulse_changes: Array) -> None:
        """Let impulses [n] along rows act on velocities and accounts of energy."""
        problem, (b, db), (m, dm) = self.case.problem, self.responses(), self.measured()
        nv, nq, chosen = problem.nv, problem.nq, list(rows)
        moved = np.einsum("j,jw->w", impulses, b[chosen])
        change = np.einsum("jk,jw->wk", impulse_changes, b[chosen]) + np.einsum(
            "j,jwk->wk", impulses, db[chosen]
        )
        h = self.hybrid
        steps = any(p != 0 and self.rows[i].kind == STEP for p, i in zip(impulses, chosen, strict=True))
        before = self.energy() if h.carried and h.supplied >= 0 and h.total >= 0 and not steps else None
        lost = supplied = 0.0
        d_lost, d_supplied = np.zeros(self.augmented.count), np.zeros(self.augmented.count)
        for p, dp, i in zip(impulses, impulse_changes, chosen, strict=True):
            if self.rows[i].kind == STEP:
                continue
            half, d_half = m[i, RATE] + moved[nv + i] / 2, dm[i, RATE] + change[nv + i] / 2
            lost -= p * half
            d_lost -= dp * half + p * d_half
            supplied -= p * m[i, DRIFT]
            d_supplied -= dp * m[i, DRIFT] + p * dm[i, DRIFT]
        self.y[nq : nq + nv] += moved[:nv]
        self.w[nq : nq + nv] += change[:nv]
        if before is not None:  # what constraints and drives that move bring in
            after = self.energy()
            supplied, d_supplied = after[0] - before[0] + lost, after[1] - before[1] + d_lost
        for place, amount, changes in (
            (h.dissipated, lost, d_lost),
            (h.supplied, supplied, d_supplied),
        ):
            if place >= 0:
                self.y[place] += amount
                self.w[place] += changes

    def slide_on(self, sticks: Sequence[int]) -> None:
        """Let friction in two directions that is about to stick slip in the direction in which it came: where slip vanishes, its
        own direction is that of errors."""
        nq, nv = self.case.problem.nq, self.case.problem.nv
        for i in sticks:
            rows = [
                k for k, r in enumerate(self.rows) if r.kind == FRICTION and r.normal == self.rows[i].normal
            ]
            signs = np.array([self.z[self.rows[k].sign] for k in rows])
            if self.rows[i].normal < 0 or len(rows) < 2 or not signs.any():
                continue
            (b, _), (m, _) = self.responses(), self.measured()
            matrix = b[np.ix_(rows, [nv + k for k in rows])].T
            impulses = inverse(matrix, ROUNDING) @ (REMAINS * signs - m[rows, RATE])
            self.y[nq : nq + nv] += impulses @ b[rows][:, :nv]

    def solve(
        self, matrix: Array, matrix_changes: Array, target: Array, target_changes: Array
    ) -> tuple[Array, Array]:
        """Solve A x = b with derivatives; rows that depend on others get none."""
        solver = inverse(matrix, ROUNDING)
        x = solver @ target
        return x, solver @ (target_changes - np.einsum("ijk,j->ik", matrix_changes, x))

    def stop(self, held: Sequence[int]) -> None:
        """Let rows that hold have no gap and no rate, and the derivatives none either."""
        if not held:
            return
        problem, nv = self.case.problem, self.case.problem.nv
        chosen = list(held)
        for which, first in ((GAP, 0), (RATE, problem.nq)):
            (b, _), (_, dm) = self.responses(), self.measured()
            if which == GAP and not np.any([self.rows[i].kind != FRICTION for i in chosen]):
                continue
            matrix = b[np.ix_(chosen, [nv + i for i in chosen])].T
            solver = inverse(matrix, ROUNDING)
            change = np.einsum("jk,jw->wk", solver @ -dm[chosen, which], b[chosen])[:nv]
            if which == GAP:
                self.w[: problem.ny] += basis(problem, self.y)[:, :nv] @ change
            else:
                self.w[first : first + nv] += change

    def act(self, branch: int) -> None:
        """Let a branch act, and book what its energy changes by."""
        problem = self.case.problem
        name = self.branch_name(branch)
        before = self.energy()
        size = problem.ny + len(problem.discretes)
        checks = self.hybrid.branches[branch]
        values, changes = self._acted(checks, size), self.change(name, size)
        self.y, self.w = values[: problem.ny].copy(), changes[: problem.ny].copy()
        self.z, self.dz = values[problem.ny : size].copy(), changes[problem.ny :][self.reals].copy()
        if problem.constraints:
            self.onto()
        self.book(before)

    def _acted(self, branch: contract.BranchStruct, size: int) -> Array:
        out = np.concatenate([self.y, self.z, np.zeros(branch.n_checks)])
        assert branch.act is not None
        arrays = (self.y, self.inputs(), self.z, self.case.p, out)  # alive until the call returns
        contract.MODEL_FUNCTION(branch.act)(self.t, *(a.ctypes.data for a in arrays))
        return out[:size]

    def branch_name(self, branch: int) -> str:
        return f"act_{branch + 1}"

    def book(self, before: tuple[float, Array]) -> None:
        """Put a change of the energy into its account, as the kernel does."""
        after = self.energy()
        gain, change = after[0] - before[0], after[1] - before[1]
        if self.hybrid.supplied >= 0 and (gain > 0 or self.hybrid.dissipated < 0):
            self.y[self.hybrid.supplied] += gain
            self.w[self.hybrid.supplied] += change
        elif self.hybrid.dissipated >= 0:
            self.y[self.hybrid.dissipated] -= gain
            self.w[self.hybrid.dissipated] -= change

    def onto(self) -> None:
        """Move the derivatives onto the linearised constraints, as changes at this time: constraints may move with it."""
        along = np.outer(self.rates(), self.dt)
        self.w = along + projected(self.augmented, self.t, self.y, self.w - along, self.z, self.dz)

    def pass_step(self, row: int, reflected: bool) -> None:
        """Cross a jump of the potential energy, or be thrown back by it."""
        (b, db), (m, dm) = self.responses(), self.measured()
        place = self.case.problem.nv + row
        w, dw, r, dr = b[row, place], db[row, place], m[row, RATE], dm[row, RATE]
        jump, d_jump = m[row, FORCE], dm[row, FORCE]
        if reflected:
            after, d_after = -r, -dr
        else:
            after = np.sign(r) * np.sqrt(r * r - 2 * w * jump)
            d_after = (r * dr - dw * jump - w * d_jump) / after
        p = (after - r) / w
        self.push([row], np.array([p]), ((d_after - dr - p * dw) / w)[None, :])
