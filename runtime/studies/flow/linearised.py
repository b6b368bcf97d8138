"""The linear map of a motion over a time: how small changes of its start arrive, in the space of velocities.

Where real discrete variables carry memory from one time to the next, changes of these belong to it: a start is the state with
the discrete variables of the model after it. It begins before what happens at its time, and ends before what clocks do then.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from msgspec import Struct
from msgspec.structs import replace
from numpy.typing import NDArray

from ...numerics.rank import POSITIONS, decomposed, inverse, singular_values
from ...outcome import SimulationError, time_text
from ...problem import Array, Problem
from ...tangent.coordinates import basis, minimal, projected
from ...tangent.flow import Tangents
from ..runs.simulate import Plan

ROUNDING = 64 * float(np.finfo(float).eps)
"""Of a map over some hundred steps, relative to its size."""
SETTLING = 4
"""Periods after which what a motion sets once has been set."""
PARTS = (1 / 64, 1 / 16, 1 / 4, 1.0)
"""Of a run, in which it is looked how far the state moves discrete variables."""


class LinearMap(Struct, frozen=True, eq=False):
    """``matrix`` [r, r]: of changes along the columns of ``directions`` [2 nv + nx + m, r], which span what the constraints
    allow and the m real discrete variables, each in nominal sizes; ``error`` [r, r]; the state there, ``end`` [ny], with the
    discrete variables ``z`` [nz]. ``memory``: the real discrete variables of ``directions``, the last ones; ``constant``: those
    that are taken over as they are, but for a constant; ``stated``: those that are set to what no small change moves."""

    matrix: Array
    error: Array
    directions: Array
    end: Array
    z: Array
    memory: tuple[int, ...] = ()
    constant: tuple[int, ...] = ()
    stated: tuple[int, ...] = ()

    def of(self, memory: Sequence[int]) -> LinearMap:
        """Give the same of some of its real discrete variables."""
        first = len(self.matrix) - len(self.memory)
        kept = [*range(first), *(first + self.memory.index(j) for j in memory)]
        return replace(
            self,
            matrix=self.matrix[np.ix_(kept, kept)],
            error=self.error[np.ix_(kept, kept)],
            directions=self.directions[:, kept],
            memory=tuple(memory),
        )

    def blocks(self) -> tuple[Array, Array, Array]:
        """Give how states change with memory, memory with states, and memory with memory."""
        first = len(self.matrix) - len(self.memory)
        return self.matrix[:first, first:], self.matrix[first:, :first], self.matrix[first:, first:]

    def remembered(self) -> LinearMap:
        """Give the same of what is memory: what changes and is read again, at once or later."""
        if not self.memory:
            return self
        _, by_states, own = self.blocks()
        constant = tuple(self.memory[j] for j in unchanged(by_states, own))
        stated = tuple(self.memory[j] for j in range(len(own)) if not by_states[j].any() and not own[j].any())
        kept = self.of([self.memory[j] for j in remembered(self.blocks())])
        return replace(kept, constant=constant, stated=stated)


def of_pieces(maps: Sequence[LinearMap]) -> tuple[int, ...]:
    """Give the memory of a motion in pieces: what one of them sets and the same or a later one reads."""
    return tuple(remembered(*(one.blocks() for one in maps)))


class Linearised:
    """The linear maps of the motions of a plan. Raises SimulationError where they have no derivatives."""

    def __init__(self, plan: Plan) -> None:
        self.problem = plan.case.problem
        self.states = 2 * self.problem.nv + self.problem.nx
        self.reals = real_discretes(self.problem)
        self.declared = declared_discretes(self.problem)
        self.size = self.states + len(self.reals)
        self.tangents = Tangents(plan.case, plan.method, plan.nominal, (), self.size)
        self.own = own_directions(self.problem)
        self.memory: tuple[int, ...] = ()
        """Of ``reals``, those of which an orbit is made (``close``)."""
        scale = np.maximum(sizes(self.problem, plan.nominal), 1e-300)
        self.scale = np.concatenate([scale, np.ones(len(self.reals))])
        if self.reals:
            self.scale[self.states :] = self._sizes_of_memory()

    def _sizes_of_memory(self) -> Array:
        """Give the sizes [m] of real discrete variables: as stated, else by how much changes of the state by their sizes first
        change them, else as large as they begin, or 1."""
        case = self.tangents.case
        y, z = case.y0, case.z
        found = np.array([self.problem.discretes[k].nominal or 0.0 for k in self.reals])
        directions = np.eye(self.size)
        directions[:, self.states :] = 0.0
        w, dz = self.changes(y, directions)
        for part in PARTS if not (found > 0).all() else ():
            grid = np.array([case.begin + part * (case.stop - case.begin)])
            try:
                flow = self.tangents.flow(case.begin, y, w, grid, z=z, dz=dz, both_sides=True)
            except SimulationError:
                break
            assert flow.dz is not None
            moved = np.abs(flow.dz).max(axis=2)
            first = moved[(moved > 0).argmax(axis=0), np.arange(len(self.reals))]
            found = np.where((found > 0) | ~np.isfinite(first), found, first)
            if (found > 0).all() or flow.short:
                break
        begun = np.abs(z[list(self.reals)])
        sizes: Array = np.where(found > 0, found, np.where(begun > 0, begun, 1.0))
        return sizes

    @property
    def kept(self) -> NDArray[np.intp]:
        """The indices of the changes on which the motion depends."""
        return np.array([*self.own, *(self.states + j for j in self.memory)])

    def joined(self, y: Array, z: Array) -> Array:
        """Give a start: the state and the discrete variables of the model."""
        return np.concatenate([y, z[list(self.declared)]])

    def split(self, start: Array) -> tuple[Array, Array]:
        """Give y [ny] and z [nz] of a start; of a state alone, with the discrete variables that the model begins with."""
        y, z = start[: self.problem.ny], self.tangents.case.z
        if start.size > y.size:
            z = z.copy()
            z[list(self.declared)] = start[y.size :]
        return y, z

    def changes(self, y: Array, whole: Array) -> tuple[Array, Array]:
        """Give changes of the state [ny, k] and of real discrete variables [m, k] from such in nominal sizes."""
        whole = whole * self.scale[:, None]
        return basis(self.problem, y) @ whole[: self.states], whole[self.states :]

    def told(self, y: Array, w: Array, dz: Array) -> Array:
        """Give changes in nominal sizes [2 nv + nx + m, k] from those of the state and of real discrete variables."""
        found: Array = np.concatenate([minimal(self.problem, y, w), dz]) / self.scale[:, None]
        return found

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

    def allowed(self, start: Array, memory: Sequence[int] | None = None) -> Array:
        """Give an orthonormal basis [2 nv + nx + m, r], in nominal sizes, of the changes that the constraints allow and of
        ``memory``, last; without it of that of an orbit. Raises SimulationError where memory moves a constraint."""
        kept = np.eye(self.size)[:, [self.states + j for j in (self.memory if memory is None else memory)]]
        unit = np.eye(self.size)[:, self.own]
        if not self.problem.constraints:
            return np.hstack([unit, kept])
        y, z = self.split(start)
        w, dz = self.changes(y, np.hstack([np.eye(self.size)[:, : self.states], kept]))
        moved = self.told(y, self.onto(self.tangents, self.tangents.case.begin, y, w, z, dz), dz)
        for j, column in zip(
            self.memory if memory is None else memory, moved[:, self.states :].T, strict=True
        ):
            if np.abs(column[: self.states]).max(initial=0.0) > ROUNDING:
                raise SimulationError(
                    f"'{self.problem.discretes[self.reals[j]].name}' moves a constraint, so that the state jumps with it",
                    help="let a first-order state follow it, and constrain by that state",
                )
        found = decomposed(moved[:, self.own])
        free = found.left[
            :, : found.rank(POSITIONS, 1.0)
        ]  # of unit changes: all of what is left may be rounding
        if not free.size and not kept.size:
            raise SimulationError(
                f"'{self.problem.name}' has no freedom: its constraints and drives leave no other motion",
                help="replace the drive by a force or a torque, so that it can move",
            )
        return np.hstack([free, kept])

    @staticmethod
    def onto(
        tangents: Tangents, t: float, y: Array, w: Array, z: Array | None = None, dz: Array | None = None
    ) -> Array:
        """Give changes of the state [ny, k] put onto the constraints, at discrete variables ``z`` that change by ``dz``."""
        augmented, k = tangents.augmented, w.shape[1]
        inner = np.zeros((y.size, augmented.count))
        inner[:, :k] = w
        changes = None
        if dz is not None:
            changes = np.zeros((len(dz), augmented.count))
            changes[:, :k] = dz
        return projected(augmented, t, y, inner, tangents.case.z if z is None else z, changes)[:, :k]

    def map(
        self, begin: float, start: Array, duration: float, *, checked: bool = True, closed: bool = True
    ) -> LinearMap:
        """Give the linear map from a start over a time, with the difference from a tighter run as its error, of all real
        discrete variables.

        ``closed``: the motion ends where it began, and changes are told in the same directions at both ends.
        """
        every = tuple(range(len(self.reals)))
        directions = self.allowed(start, every)
        end, found, z = self.over(self.tangents, begin, start, duration)
        arriving = directions if closed else self.allowed(end, every)
        matrix = arriving.T @ found @ directions
        error = np.zeros_like(matrix)
        if checked:
            beside = self.tangents.tighter()
            there, other, modes = self.over(beside, begin, start, duration)
            error = np.abs(matrix - arriving.T @ other @ directions)
            if beside.tolerance <= self.tangents.tolerance:
                end, z, matrix = there, modes, arriving.T @ other @ directions
        return LinearMap(matrix, error, directions, self.split(end)[0], z, memory=every)

    def over(
        self, tangents: Tangents, begin: float, start: Array, duration: float
    ) -> tuple[Array, Array, Array]:
        """Give where a motion ends, the map [2 nv + nx + m, 2 nv + nx + m] of all changes, in nominal sizes, and all discrete
        variables [nz] at the end, among them what sticks, slips and touches."""
        problem = self.problem
        y, z = self.split(start)
        w, dz = self.changes(y, np.eye(self.size))
        flow = tangents.flow(begin, y, w, np.array([begin + duration]), z=z, dz=dz, scheduled=False)
        if flow.short:
            raise SimulationError(
                f"the motion ends before {time_text(problem, begin + duration)}: {flow.short}",
                help="ask for a shorter time, or take away what ends the motion",
            )
        assert flow.z is not None and flow.dz is not None
        end = flow.states[-1]
        return self.joined(end, flow.z[-1]), self.told(end, flow.tangents[-1], flow.dz[-1]), flow.z[-1]

    def named(self, found: LinearMap) -> str:
        """Name the discrete variables of a map."""
        return ", ".join(f"'{self.problem.discretes[self.reals[j]].name}'" for j in found.memory)

    def missed(self, start: Array, found: LinearMap) -> float:
        """Give by how much memory misses where it began, in nominal sizes."""
        _, z = self.split(start)
        gaps = [
            abs(found.z[self.reals[j]] - z[self.reals[j]]) / self.scale[self.states + j] for j in found.memory
        ]
        return float(max(gaps, default=0.0))

    def changed(self, start: Array, found: LinearMap) -> list[int]:
        """Give the places in z of what small changes do not move and does not come back: numbers that are counted, and what is on
        or off. ``found`` is of what is remembered."""
        _, z = self.split(start)
        moved = {k for j, k in enumerate(self.reals) if j not in found.constant and j not in found.stated}
        return [k for k in self.declared if k not in moved and z[k] != found.z[k]]

    def unreturned(self, start: Array, found: LinearMap) -> list[str]:
        """Say what of discrete variables does not come back."""
        _, z = self.split(start)
        return [
            f"'{self.problem.discretes[k].name}' does not come back after this time, it goes from {z[k]:.6g} to {found.z[k]:.6g}: "
            "it is taken as constant, and where the motion reads it this is not a period"
            for k in self.changed(start, found)
        ]

    def settled(self, begin: float, start: Array, duration: float, first: LinearMap) -> Array:
        """Give a start with the discrete variables of the period from which on the fewest of them change otherwise than by small
        changes: what is set once, as by the first sample, is set then. ``first``: the map from the start, of what is remembered."""
        y, _ = self.split(start)
        left, starts, found = [self.changed(start, first)], [start], first
        while left[-1] and len(left) <= SETTLING:
            following = self.joined(y, found.z)
            try:
                found = self.map(begin, following, duration, checked=False).remembered()
            except SimulationError:
                break
            left.append(self.changed(following, found))
            starts.append(following)
        return starts[first_of_fewest(left)]


def own_directions(problem: Problem) -> Array:
    """Give the indices of the changes of states on which the motion depends."""
    behind = [problem.nv + k - problem.nq for k in problem.own if k >= problem.nq]
    return np.array([*range(problem.nv), *behind])


def sizes(problem: Problem, nominal: Array) -> Array:
    """Give nominal values [2 nv + nx] of changes in the space of velocities."""
    square = basis(problem, np.where(np.arange(problem.ny) >= 0, 0.5, 0.0))
    found = np.abs(square).T @ nominal / np.maximum(np.abs(square).sum(axis=0), 1e-300)
    return np.where(found > 0, found, 1.0)


NEARLY_ONE, BESIDE = 1e-3, 0.02
"""Of an eigenvalue: |x* y| of its left and right vectors below which it may be part of a double one with a single vector, and the share
of the distance to the next one above which an error may have parted them."""


def multipliers(found: LinearMap) -> tuple[Array, Array]:
    """Give the eigenvalues [r] of a linear map, the largest first, and how far each may be off [r].

    Of a simple eigenvalue the change is |x* E y| / |x* y| with its left and right vectors; where that is larger than
    the root of the error, as for those that coincide, the root. So for those that share nearly one vector and lie no farther
    apart than errors of this size part a double one: of these, the change is half of the distance at most. No entry is taken
    for better known than all of them are relative to the sizes of its row and column.
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
    apart = np.abs(values[:, None] - values) + np.diag(np.full(len(values), np.inf))
    parted = (condition < NEARLY_ONE) & (simple > BESIDE * apart.min(axis=1, initial=np.inf))
    errors = np.where(parted, np.inf, simple)
    errors = np.minimum(errors, np.sqrt(noise * size))
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
    grown = singular_values(found.matrix)
    if grown[-1] > ROUNDING * grown[0]:
        return value, abs(value) * float(np.linalg.norm(inverse(found.matrix))) * noise
    others = [float(np.prod(np.delete(grown, k))) for k in range(len(grown))]
    return value, float(np.linalg.norm(others)) * noise


def real_discretes(problem: Problem) -> tuple[int, ...]:
    """Give the places in z of the discrete variables that have derivatives, in their order."""
    if problem.hybrid is None:
        return ()
    return tuple(k for k, q in enumerate(problem.discretes) if q.kind == "discrete" and q.type == "real")


def declared_discretes(problem: Problem) -> tuple[int, ...]:
    """Give the places in z of the discrete variables of the model itself, of all types."""
    return tuple(k for k, q in enumerate(problem.discretes) if q.kind == "discrete")


def first_of_fewest(left: Sequence[Sequence[int]]) -> int:
    """Give from which period on no more change than in the last one."""
    return max((k + 1 for k, one in enumerate(left) if len(one) > len(left[-1])), default=0)


def unchanged(by_others: Array, by_discretes: Array) -> list[int]:
    """Give the discrete variables that a map takes over as they are, but for a constant: by_others [z][n], by_discretes [z][z]."""
    unit = np.eye(len(by_discretes))
    return [
        j for j in range(len(unit)) if np.array_equal(by_discretes[j], unit[j]) and not by_others[j].any()
    ]


def remembered(*maps: tuple[Array, Array, Array]) -> list[int]:
    """Give the discrete variables that maps change and that what moves reads, at once or later.

    Each map tells how what moves changes with z [n][z], and z with what moves [z][m] and with z [z][z]. The others are
    constant, are set again before they are read, or are read by nothing.
    """
    count = len(maps[0][2])
    same = set(range(count)).intersection(*(unchanged(by_others, own) for _, by_others, own in maps))
    reads = np.any([np.abs(by_z).any(axis=0) for by_z, _, _ in maps], axis=0)
    uses = np.any([own != 0 for _, _, own in maps], axis=0)
    wanted, seen = np.flatnonzero(reads).tolist(), set[int]()
    while wanted:
        j = wanted.pop()
        if j not in seen and j not in same:
            seen.add(j)
            wanted += np.flatnonzero(uses[j]).tolist()
    return sorted(seen)
