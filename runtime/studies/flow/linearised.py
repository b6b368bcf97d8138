"""The linear map of a motion over a time: how small changes of its start arrive, in the space of velocities."""

from __future__ import annotations

import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from ...numerics.rank import POSITIONS, decomposed, inverse
from ...outcome import SimulationError, time_text
from ...problem import Array, Problem
from ...tangent.coordinates import basis, minimal
from ...tangent.flow import Tangents
from ...tangent.projection import projected
from ..runs.simulate import Plan

ROUNDING = 64 * float(np.finfo(float).eps)
"""Of a map over some hundred steps, relative to its size."""


class LinearMap(Struct, frozen=True, eq=False):
    """``matrix`` [r, r]: of changes along the columns of ``directions`` [2 nv + nx, r], which span what the constraints
    allow, each in nominal sizes; ``error`` [r, r]; the state there, ``end`` [ny]."""

    matrix: Array
    error: Array
    directions: Array
    end: Array


class Linearised:
    """The linear maps of the motions of a plan. Raises SimulationError where they have no derivatives."""

    def __init__(self, plan: Plan) -> None:
        self.problem = plan.case.problem
        self.size = 2 * self.problem.nv + self.problem.nx
        self.tangents = Tangents(plan.case, plan.method, plan.nominal, (), self.size)
        self.kept = own_directions(self.problem)
        self.scale = np.maximum(sizes(self.problem, plan.nominal), 1e-300)

    def renewed(self, plan: Plan) -> Linearised:
        """Give the same for other values of parameters, with the same code."""
        other = object.__new__(Linearised)
        other.__dict__.update(self.__dict__)
        tangents = object.__new__(Tangents)
        tangents.__dict__.update(self.tangents.__dict__)
        old = self.tangents.augmented
        count = len(self.problem.parameters)
        p = np.concatenate([plan.case.p[:count], np.full(old.problem.nh, np.nan)])
        old.functions.parameters(p, np.ones(count, dtype=np.uint8))
        tangents.case = plan.case
        tangents.augmented = replace(old, case=plan.case, p=p)
        tangents.nominal, tangents.tolerance = plan.nominal, plan.case.tolerance
        tangents.sizes = None
        other.tangents = tangents
        return other

    def allowed(self, y: Array) -> Array:
        """Give an orthonormal basis [2 nv + nx, r], in nominal sizes, of the changes that the constraints allow."""
        unit = np.eye(self.size)[:, self.kept]
        if not self.problem.constraints:
            return unit
        w = self.onto(self.tangents, self.tangents.case.begin, y, basis(self.problem, y) * self.scale)
        found = decomposed((minimal(self.problem, y, w) / self.scale[:, None])[:, self.kept])
        return found.left[:, : found.rank(POSITIONS)]

    @staticmethod
    def onto(tangents: Tangents, t: float, y: Array, w: Array) -> Array:
        """Give changes of the state [ny, k] put onto the constraints."""
        augmented = tangents.augmented
        inner = np.zeros((y.size, augmented.count))
        inner[:, : w.shape[1]] = w
        return projected(augmented, t, y, inner, tangents.case.z)[:, : w.shape[1]]

    def map(
        self, begin: float, y: Array, duration: float, *, checked: bool = True, closed: bool = True
    ) -> LinearMap:
        """Give the linear map from a state over a time, with the difference from a tighter run as its error.

        ``closed``: the motion ends where it began, and changes are told in the same directions at both ends.
        """
        directions = self.allowed(y)
        end, found = self._over(self.tangents, begin, y, duration)
        arriving = directions if closed else self.allowed(end)
        matrix = arriving.T @ found @ directions
        error = np.zeros_like(matrix)
        if checked:
            beside = self.tangents.tighter()
            there, other = self._over(beside, begin, y, duration)
            error = np.abs(matrix - arriving.T @ other @ directions)
            if beside.tolerance <= self.tangents.tolerance:
                end, matrix = there, arriving.T @ other @ directions
        return LinearMap(matrix, error, directions, end)

    def _over(self, tangents: Tangents, begin: float, y: Array, duration: float) -> tuple[Array, Array]:
        problem = self.problem
        w = basis(problem, y) * self.scale
        flow = tangents.flow(begin, y, w, np.array([begin + duration]))
        if flow.short:
            raise SimulationError(
                f"the motion ends before {time_text(problem, begin + duration)}: {flow.short}",
                help="ask for a shorter time, or take away what ends the motion",
            )
        end = flow.states[-1]
        return end, minimal(problem, end, flow.tangents[-1]) / self.scale[:, None]


def own_directions(problem: Problem) -> Array:
    """Give the indices of the changes of states on which the motion depends."""
    behind = [problem.nv + k - problem.nq for k in problem.own if k >= problem.nq]
    return np.array([*range(problem.nv), *behind])


def sizes(problem: Problem, nominal: Array) -> Array:
    """Give nominal values [2 nv + nx] of changes in the space of velocities."""
    square = basis(problem, np.where(np.arange(problem.ny) >= 0, 0.5, 0.0))
    found = np.abs(square).T @ nominal / np.maximum(np.abs(square).sum(axis=0), 1e-300)
    return np.where(found > 0, found, 1.0)


def multipliers(found: LinearMap) -> tuple[Array, Array]:
    """Give the eigenvalues [r] of a linear map, the largest first, and how far each may be off [r].

    Of a simple eigenvalue the change is |x* E y| / |x* y| with its left and right vectors; where that is larger than
    the root of the error, as for those that coincide, the root. No entry is taken for better known than all of them are
    relative to the sizes of its row and column.
    """
    from scipy.linalg import eig

    values, left, right = eig(found.matrix, left=True, right=True)
    size = float(np.linalg.norm(found.matrix)) or 1.0
    noise = float(np.linalg.norm(found.error)) + ROUNDING * size
    rows, columns = (np.linalg.norm(found.matrix, axis=k) / size for k in (1, 0))
    entries = np.maximum(found.error, noise * np.outer(rows, columns))
    condition = np.abs(np.einsum("ij,ij->j", left.conj(), right))
    with np.errstate(divide="ignore", invalid="ignore"):
        simple = np.einsum("ij,ik,kj->j", np.abs(left), entries, np.abs(right)) / condition
    simple = np.where(np.isfinite(simple), simple, np.inf)
    errors = np.minimum(simple, np.sqrt(noise * size))
    order = np.lexsort((-values.imag, -np.abs(values)))
    return values[order], errors[order]


def compared(found: LinearMap, looser: LinearMap, *, free: bool) -> tuple[Array, Array]:
    """Give multipliers and errors, which hold what the map of a looser orbit has otherwise.

    ``free``: nothing depends on time, so that the multiplier of a shift along the orbit is 1.
    """
    from scipy.optimize import linear_sum_assignment

    values, errors = multipliers(found)
    others, _ = multipliers(looser)
    if len(values) == len(others):
        apart = np.abs(values[:, None] - others)
        errors = np.maximum(errors, apart[linear_sum_assignment(apart)])
    if free and len(values):
        shift = int(np.argmin(np.abs(values - 1)))
        errors[shift] = max(errors[shift], abs(values[shift] - 1))
    return values, errors


def determinant(found: LinearMap) -> tuple[float, float]:
    """Give the determinant of a linear map and how far it may be off."""
    value = float(np.linalg.det(found.matrix))
    noise = float(np.linalg.norm(found.error)) + ROUNDING * float(np.linalg.norm(found.matrix))
    grown = float(np.linalg.norm(inverse(found.matrix)))
    return value, abs(value) * grown * noise
