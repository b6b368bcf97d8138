"""A model that samples (`when sample(T)`) near a state of rest: linear between its samples, and at each of them.

x' = A x + B(s) u + E z between samples, which change real discrete variables: z[k] = Gx x(kT) + Gz z[k-1] + Gu(s) u(kT), all from exact
derivatives. With u = U exp(i w t) the states at the samples are X exp(i w k T), Z exp(i w k T); outputs are those just after each sample.
K. J. Åström, B. Wittenmark, Computer-Controlled Systems, Prentice Hall 1997.
"""

from __future__ import annotations

import numpy as np
import scipy.linalg
from msgspec import Struct
from msgspec.structs import replace
from numpy.typing import NDArray

from ...case import Case
from ...interface import Quantity
from ...local.active_constraints import with_held
from ...local.frequency_response import Amplitudes, held, polynomial
from ...local.independent_coordinates import independent
from ...local.linear_system import LinearSystem, columns_of
from ...local.operating_point import PART, Site
from ...local.zeros import Complex
from ...native import contract
from ...outcome import SimulationError
from ...problem import Array, Problem
from ...tangent.augmented import Augmented, augment
from ...tangent.directions import as_asked, named
from ...tangent.instant import Instant
from .linearised import SETTLING, declared_discretes, first_of_fewest, remembered, unchanged

CHANGED = 1e-9
"""Of a value and one: what a sample changes by less rests."""
SAME = 1e-12
"""Relative difference of the periods and the first ticks of clocks that are one."""


class SampledLoop(Struct, frozen=True, eq=False):
    """``e`` [n][z], ``g_x`` [z][n], ``g_z`` [z][z], ``g_u`` for the inputs, their rates and accelerations [z][m] each, ``c_z`` [k][z] beside
    the ``system`` of what moves between samples; ``discretes``: the names of z."""

    system: LinearSystem
    period: float
    e: Array
    g_x: Array
    g_z: Array
    g_u: tuple[Array, Array, Array]
    c_z: Array
    discretes: tuple[str, ...]
    remarks: tuple[str, ...]

    @property
    def condition(self) -> float:
        return max(1.0, self.system.condition)

    @property
    def states(self) -> int:
        return 2 * len(self.system.a) + len(self.g_z)

    @property
    def matrix(self) -> Array:
        """What takes x and z[k-1] from one sample to the next."""
        move, push = held(self.system.a, self.e, self.period)
        return np.block([[move + push @ self.g_x, push @ self.g_z], [self.g_x, self.g_z]])

    def amplitudes(self, w: Array) -> Amplitudes:
        a, n = self.system.a, len(self.system.a)
        s: Complex = np.asarray(1j * w, dtype=complex)
        z = np.exp(s * self.period)[:, None, None]
        move, push = held(a, self.e, self.period)
        whole = np.zeros((len(w), 2 * n, 2 * n), dtype=complex)
        whole[:, :n, :n], whole[:, :n, n:] = a, np.eye(n)
        whole[:, n:, n:] = s[:, None, None] * np.eye(n)
        driven = scipy.linalg.expm(whole * self.period)[:, :n, n:] if n else whole
        count = len(self.g_z)
        m = np.zeros((len(w), n + count, n + count), dtype=complex)
        m[:, :n, :n], m[:, :n, n:] = z * np.eye(n) - move, -push
        m[:, n:, :n], m[:, n:, n:] = -self.g_x, np.eye(count) - self.g_z / z
        sizes = np.abs(np.block([[move, push], [self.g_x, self.g_z]])) + np.eye(n + count)
        p = np.concatenate([driven @ polynomial(self.system.b, s), polynomial(self.g_u, s)], axis=1)
        c = np.hstack([self.system.c, self.c_z])
        return Amplitudes(m, np.broadcast_to(sizes, m.shape), p, c, polynomial(self.system.d, s))


def samples_itself(problem: Problem) -> str:
    """Name what a model does at the ticks of its clocks; nothing where it has none."""
    branches = problem.hybrid.branches if problem.hybrid is not None else ()
    return ", ".join(dict.fromkeys(branch.text for branch in branches if branch.sampled))


def held_samples(problem: Problem) -> list[str]:
    """Say that what a model samples is taken as constant; nothing where it samples nothing."""
    if not (sampling := samples_itself(problem)):
        return []
    return [
        f"what the model samples ({sampling}) is held at its values here; the study 'response' follows its samples"
    ]


def sampled_loop(
    site: Site,
    y: Array,
    system: LinearSystem,
    inputs: list[int],
    outputs: list[tuple[Quantity, tuple[str, int]]],
) -> SampledLoop:
    """Return the loop of a model that samples at one rate, near a state. Raises SimulationError where samples do more than change real
    discrete variables, and where these move constraints."""
    problem = site.problem
    columns = columns_of(problem, inputs)
    used = list(dict.fromkeys(k for order in columns for k in order if k >= 0))
    case = site.case
    listed = named(case, [problem.inputs[k].name for k in used])
    augmented = augment(case, as_asked(case, listed, 1))
    free = independent(site.chart, with_held(site, site.derivatives(y)))
    directions = site.chart.of_entries(y) @ free.tangent
    it, change = _settled(augmented, site, y, directions)
    period, remarks, reals = it.period(), list[str](), augmented.reals
    g_x, g_z, by_inputs, after = change.g_x, change.g_z, change.by_inputs, change.after
    g_u = tuple(_picked(by_inputs, order, used) for order in columns)
    e, c_z = it.felt(outputs, system)
    kept = remembered((np.vstack([e, c_z]), np.hstack([g_x, *g_u]), g_z))
    for j, k in enumerate(reals):
        if j in kept and abs(after[k] - it.site.z[k]) > CHANGED * (1 + abs(it.site.z[k])):
            remarks.append(
                f"a sample changes '{problem.discretes[k].name}' here: this state is not at rest, and small motions are deviations from the motion"
            )
    for k in it.changed(change):
        remarks.append(f"a sample changes '{problem.discretes[k].name}', which is taken as constant")
    it.check_constraints([reals[j] for j in kept])
    assert len(g_u) == 3
    names = tuple(problem.discretes[reals[j]].name for j in kept)
    remarks.append(
        f"sampled by the model ({samples_itself(problem)}): outputs are those just after each sample; inputs act in between as they are"
    )
    return SampledLoop(
        system,
        period,
        e[:, kept],
        g_x[kept],
        g_z[np.ix_(kept, kept)],
        (g_u[0][kept], g_u[1][kept], g_u[2][kept]),
        c_z[:, kept],
        names,
        tuple(remarks),
    )


class _Change(Struct, frozen=True, eq=False):
    """How a sample changes real discrete variables, as in ``SampledLoop`` but by all inputs [z][1 + m], and all of them ``after`` it."""

    g_x: Array
    g_z: Array
    by_inputs: Array
    after: Array


def _settled(augmented: Augmented, site: Site, y: Array, directions: Array) -> tuple[_Sampling, _Change]:
    """Return the sample that finds set what the samples before it set once. Raises SimulationError where the rates have other
    derivatives then."""
    looked = list[tuple[_Sampling, _Change]]()
    left, z = list[list[int]](), site.z
    while not left or (left[-1] and len(left) <= SETTLING):
        it = _Sampling(augmented, replace(site, z=z), y)
        change = it.change(directions)
        looked.append((it, change))
        left.append(it.changed(change))
        z = site.z.copy()
        declared = list(declared_discretes(site.problem))
        z[declared] = change.after[declared]
    it, change = looked[first_of_fewest(left)]
    here, there = (
        site.case.functions.matrices[PART](site.t, y, site.u, z, site.p) for z in (site.z, it.site.z)
    )
    if not np.array_equal(here, there, equal_nan=True):
        names = ", ".join(f"'{site.problem.discretes[k].name}'" for k in left[0])
        raise SimulationError(
            f"the first samples set {names}, after which the rates have other derivatives",
            help="declare them with the values that later samples find",
        )
    return it, change


def _picked(matrix: Array, columns: list[int], used: list[int]) -> Array:
    """Return the columns of inputs, zeros for -1."""
    found = np.zeros((len(matrix), len(columns)))
    for j, k in enumerate(columns):
        if k >= 0:
            found[:, j] = matrix[:, used.index(k)]
    return found


class _Sampling:
    """What happens at the next tick of the clocks at a state, and its derivatives."""

    def __init__(self, augmented: Augmented, site: Site, y: Array) -> None:
        self.augmented, self.site, self.y = augmented, site, y
        self.problem: Problem = site.problem
        self.case: Case = augmented.case
        self.here = self._instant(site.z, np.zeros(site.problem.ny), np.zeros(len(augmented.reals)))

    def _instant(self, z: Array, w: Array, dz: Array) -> Instant:
        count = self.augmented.count
        columns, changes = np.zeros((len(w), count)), np.zeros((len(dz), count))
        columns[:, 0], changes[:, 0] = w, dz
        return Instant(self.augmented, self.site.t, self.y, columns, z, changes, np.zeros(count))

    def change(self, directions: Array) -> _Change:
        """Return what a sample does, by displacements along ``directions`` [ny][n]."""
        count, branches = len(self.augmented.reals), self.due()
        nothing, rest = np.zeros(count), np.zeros(self.problem.ny)
        by_states = [self.act(branches, column, nothing)[0][:, 0] for column in directions.T]
        by_discretes = [self.act(branches, rest, unit)[0][:, 0] for unit in np.eye(count)]
        by_inputs, after = self.act(branches, rest, nothing)
        g_x = np.array(by_states).T.reshape(count, directions.shape[1])
        return _Change(g_x, np.array(by_discretes).T.reshape(count, count), by_inputs[:, 1:], after)

    def changed(self, change: _Change) -> list[int]:
        """Return the places in z of what a sample changes, and small changes do not move."""
        felt = np.abs(np.hstack([change.g_x, change.g_z, change.by_inputs])).max(axis=1, initial=0.0) > 0
        same = unchanged(np.hstack([change.g_x, change.by_inputs]), change.g_z)
        moved = [k for j, k in enumerate(self.augmented.reals) if felt[j] and j not in same]
        z = self.site.z
        return [k for k in declared_discretes(self.problem) if k not in moved and change.after[k] != z[k]]

    def _clocks(self) -> NDArray[np.intp]:
        h = self.here.hybrid
        return np.array([[h.clocks[2 * k], h.clocks[2 * k + 1]] for k in range(h.n_clocks)], dtype=np.intp)

    def period(self) -> float:
        """Return the period of all clocks. Raises SimulationError where they have several."""
        h, clocks = self.here.hybrid, self._clocks()
        ticks = []
        for count in (0.0, 1.0):
            z = self.site.z.copy()
            z[clocks[:, 1]] = count
            here = self._instant(z, np.zeros(len(self.y)), np.zeros(len(self.augmented.reals)))
            ticks.append(here.own("crossing_times", h.n_times + h.n_clocks)[h.n_times :])
        first, periods = ticks[0], ticks[1] - ticks[0]
        apart = np.abs((first - first[0] + periods[0] / 2) % periods[0] - periods[0] / 2)
        if (np.abs(periods - periods[0]) > SAME * periods[0]).any() or (apart > SAME * periods[0]).any():
            raise SimulationError(
                "the model samples at several rates or phases: " + ", ".join(f"every {x:g}" for x in periods),
                help="a response has one rate: let one clock sample all of it",
            )
        return float(periods[0])

    def due(self) -> list[int]:
        """Return the branches that act at a tick, in their order."""
        h, z = self.here.hybrid, self._ticking()
        assert h.conditions is not None
        out = np.empty(h.n_branches)
        arrays = [np.ascontiguousarray(x) for x in (self.y, self.site.u, z, self.site.p)]
        contract.MODEL_FUNCTION(h.conditions)(self.site.t, *(x.ctypes.data for x in arrays), out.ctypes.data)
        found: list[int] = []
        assert self.problem.hybrid is not None
        for k, branch in enumerate(self.problem.hybrid.branches):
            events = [h.branches[j].event for j in found]
            if branch.sampled and out[k] > 0.5 and h.branches[k].event not in events:
                found.append(k)
        return found

    def _ticking(self) -> Array:
        z = self.site.z.copy()
        z[self._clocks()[:, 0]] = 1.0
        return z

    def act(self, branches: list[int], w: Array, dz: Array) -> tuple[Array, Array]:
        """Let branches act on a change of the state and one of the discrete variables; return the changes of these after it
        [reals][1 + inputs], and the discrete variables."""
        here = self._instant(self._ticking(), w, dz)
        before = here.w.copy()
        for k in branches:
            here.act(k)
        states = [i for i, q in enumerate(self.problem.states) if q.kind != "account"]
        if not np.array_equal(here.y[states], self.y[states]) or not np.allclose(
            here.w[states],
            before[states],
            rtol=0,
            atol=CHANGED * max(1.0, float(np.abs(before).max(initial=0.0))),
        ):
            raise SimulationError(
                "a sample sets the state itself ('reinit'), and not only what acts on it",
                help="let it set a discrete variable that a force or an equation reads",
            )
        return here.dz, here.z

    def felt(
        self, outputs: list[tuple[Quantity, tuple[str, int]]], system: LinearSystem
    ) -> tuple[Array, Array]:
        """Return the derivatives of the rates of the chosen displacements, and of outputs, by the real discrete variables."""
        augmented, chart, site = self.augmented, self.site.chart, self.site
        count = len(augmented.reals)
        e, c = np.zeros((len(system.chosen), count)), np.zeros((len(outputs), count))
        for j in range(count):
            changes = np.zeros((count, augmented.count))
            changes[j, 0] = 1.0
            y = augmented.joined(self.y, np.zeros((len(self.y), augmented.count)))
            arguments = (
                site.t,
                y,
                augmented.inputs(site.t),
                augmented.discretes(site.z, changes),
                augmented.p,
            )
            rates = augmented.split(augmented.functions.rhs(*arguments), len(self.y))[1][:, 0]
            whole = np.zeros(chart.size)
            whole[chart.nd :] = rates[list(chart.behind)]
            e[:, j] = whole[system.chosen]
            if augmented.functions.outputs is not None:
                seen = augmented.split(augmented.functions.outputs(*arguments), len(self.problem.outputs))[1]
                for row, (_, (array, k)) in enumerate(outputs):
                    c[row, j] = seen[k, 0] if array == "out" else 0.0
        return e, c

    def check_constraints(self, reals: list[int]) -> None:
        """Raise SimulationError where a discrete variable moves a constraint."""
        before = self.site.constraints(self.y)
        for k in reals:
            z = self.site.z.copy()
            z[k] += 1.0
            after = Site(
                self.case, self.site.chart, self.site.t, self.site.u, z, self.y, self.site.p
            ).constraints(self.y)
            if any(not np.array_equal(a, b) for a, b in zip(before, after, strict=True)):
                raise SimulationError(
                    f"'{self.problem.discretes[k].name}' moves a constraint, so that the state jumps with each sample",
                    help="let a first-order state follow it, and constrain by that state",
                )
