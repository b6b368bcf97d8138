"""The linear system near a state, between inputs and quantities that are observed.

An input that drives a coordinate acts by its value, its rate and its acceleration: x' = A x + B0 u + B1 u' + B2 u'',
y = C x + D0 u + D1 u' + D2 u'', H(s) = C (s - A)^-1 (B0 + s B1 + s^2 B2) + D0 + s D1 + s^2 D2. The change of state
x -> x - S0 u - S1 u' with S1 = B2, S0 = B1 + A B2 leaves u alone in the equation of the state.
"""

from __future__ import annotations

import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

from ..driving_inputs import derived
from ..interface import Quantity
from ..outcome import SimulationError
from ..problem import Array, Problem
from .active_constraints import with_held
from .independent_coordinates import independent
from .operating_point import Derivatives, Site
from .zeros import EPSILON, Complex, zeros


class LinearSystem(Struct, frozen=True, eq=False):
    """x' = ``a`` x + sum of ``b``[k] u^(k), y = ``c`` x + sum of ``d``[k] u^(k), for displacements x of the ``chosen``
    coordinates, velocities and states; ``condition`` of that choice. ``drives`` [m]: the inputs that act by their derivatives
    too."""

    a: Array
    b: tuple[Array, ...]
    c: Array
    d: tuple[Array, ...]
    drives: NDArray[np.bool_]
    chosen: NDArray[np.intp]
    condition: float
    behind: tuple[Quantity, ...] = ()
    """States that are not displacements: those of approximations."""

    def beside(self, parts: tuple[Array, ...]) -> Array:
        """Return the parts of B or D side by side: all inputs, then rates, then accelerations of those that drive."""
        return np.hstack([parts[0], *(part[:, self.drives] for part in parts[1:])])

    def zeros(self) -> Complex | None:
        """Return the transmission zeros; None where inputs and outputs are different in number.

        They are those of the system that is driven by accelerations, with values and rates of the inputs as states.
        """
        k = int(self.drives.sum())
        if not k:
            return zeros(self.a, self.b[0], self.c, self.d[0])
        n, m = self.b[0].shape
        a = np.zeros((n + 2 * k, n + 2 * k))
        a[:n, :n] = self.a
        a[:n, n : n + k], a[:n, n + k :] = (self.b[j][:, self.drives] for j in (0, 1))
        a[n : n + k, n + k :] = np.eye(k)
        b, d = np.zeros((n + 2 * k, m)), np.where(self.drives, self.d[2], self.d[0])
        b[:n] = np.where(self.drives, self.b[2], self.b[0])
        b[n + k :, self.drives] = np.eye(k)
        c = np.hstack([self.c, self.d[0][:, self.drives], self.d[1][:, self.drives]])
        return zeros(a, b, c, d)


class OutputForm(Struct, frozen=True, eq=False):
    """x' = ``a`` x + ``b`` u, y = ``c`` x + ``d`` u + ``d1`` u' + ``d2`` u'' for the states x = displacements - ``s0`` u -
    ``s1`` u'."""

    a: Array
    b: Array
    c: Array
    d: Array
    d1: Array
    d2: Array
    s0: Array
    s1: Array

    @property
    def improper(self) -> bool:
        """Whether an output follows derivatives of an input at once."""
        return bool(self.d1.any() or self.d2.any())


def linear_system(
    site: Site,
    found: Derivatives,
    inputs: list[int],
    observed: tuple[Array, Array],
    before: NDArray[np.intp] | None = None,
) -> LinearSystem:
    """Return the system between inputs and what is observed, given by its derivatives by displacements and by all inputs; of
    the independent displacements, or of those that were chosen ``before``. What holds is among the constraints. Raises SimulationError where an input without
    derivatives moves a constraint."""
    problem, found = site.problem, with_held(site, found)
    free = independent(site.chart, found, before)
    columns = columns_of(problem, inputs)
    held = [_taken(found.constraints_by_inputs, order) for order in columns]
    drives = np.array([k >= 0 for k in columns[1]], dtype=bool)
    if held[0][:, ~drives].any():
        raise SimulationError(
            "an input moves a constraint, so that the state jumps with it",
            help="let a first-order state follow the input, and constrain by that state",
        )
    rows, direct = observed
    along = [_moved(found, free.chosen, e) for e in held]
    b = [found.rates @ p + _taken(found.rates_by_inputs, k) for p, k in zip(along, columns, strict=True)]
    d = [rows @ p + _taken(direct, k) for p, k in zip(along, columns, strict=True)]
    return LinearSystem(
        (found.rates @ free.tangent)[free.chosen],
        tuple(x[free.chosen] for x in b),
        rows @ free.tangent,
        tuple(d),
        drives,
        free.chosen,
        free.condition,
    )


def that_stay(site: Site, found: Derivatives, inputs: list[int]) -> list[int]:
    """Return those of the inputs that keep one value during a run: they move a constraint and have no derivatives."""
    moved = _taken(with_held(site, found).constraints_by_inputs, inputs)
    following = derived(site.problem)
    return [k for j, k in enumerate(inputs) if moved[:, j].any() and k not in following]


def proper_form(system: LinearSystem) -> OutputForm:
    """Change the state so that only the values of the inputs move it.

    What is left of derivatives in the outputs counts as zero where it is below the rounding of its terms, at the largest
    frequency of the system."""
    a, c = system.a, system.c
    b0, b1, b2 = system.b
    d0, d1, d2 = system.d
    s0 = b1 + a @ b2
    direct = d1 + c @ b2
    fastest = float(np.abs(np.linalg.eigvals(a)).max(initial=0.0)) if a.size else 0.0
    sizes = np.abs(d0) + fastest * (np.abs(d1) + fastest * np.abs(d2))
    sizes += np.abs(c) @ (np.abs(b1) + np.abs(a) @ np.abs(b2) + fastest * np.abs(b2))
    rounding = 1e3 * EPSILON * sizes
    return OutputForm(
        a,
        b0 + a @ s0,
        c,
        d0 + c @ s0,
        np.where(fastest * np.abs(direct) > rounding, direct, 0.0) if fastest else direct,
        np.where(fastest**2 * np.abs(d2) > rounding, d2, 0.0) if fastest else d2,
        s0,
        b2,
    )


def columns_of(problem: Problem, inputs: list[int]) -> tuple[list[int], list[int], list[int]]:
    """Return the columns of the inputs, of their rates, of their accelerations; -1 where they do not drive."""
    following = derived(problem)
    rates = [following.get(k, (-1, -1)) for k in inputs]
    return inputs, [first for first, _ in rates], [second for _, second in rates]


def _taken(matrix: Array, columns: list[int]) -> Array:
    """Return columns of a matrix, zeros for -1."""
    found = np.zeros((len(matrix), len(columns)))
    for j, k in enumerate(columns):
        if k >= 0:
            found[:, j] = matrix[:, k]
    return found


def _moved(found: Derivatives, chosen: NDArray[np.intp], held: Array) -> Array:
    """Return the displacements [n][m] that constraints ask for where inputs move them and the chosen ones rest."""
    n = found.rates.shape[0]
    if not held.any():
        return np.zeros((n, held.shape[1]))
    rows = np.vstack([found.position, found.rate, np.eye(n)[chosen]])
    moved: Array = np.linalg.solve(rows, np.vstack([-held, np.zeros((len(chosen), held.shape[1]))]))
    return moved
