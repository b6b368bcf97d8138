"""A model where it is looked at: fixed time, inputs, discrete variables and parameters; rates and derivatives there."""

from __future__ import annotations

import ctypes

import numpy as np
from msgspec import Struct
from msgspec.structs import replace
from numpy.typing import NDArray

from ..case import Case, SimulationOptions, inputs_at, prepare
from ..delays import DelayTable, T, U, Y, as_at_the_start, delays_of
from ..driving_inputs import derived
from ..functions import load_functions
from ..integrate.solver import Solver
from ..native import contract
from ..native import kernel as native
from ..native.status import Status
from ..outcome import SimulationError
from ..problem import Array, Problem
from ..settings import Place
from .chart import Chart, chart_of

PART = "local_derivatives"

NAMED = 6
"""Of what holds or stands at an edge, at most so many are named."""
EDGE = 1e-9
"""An indicator below this stands at its edge: what it tells apart has different derivatives on its two sides."""

STEPS = (1e-6, 1e-9)
"""Of the size of a displacement: where it is looked at whether rates bend."""

BEND = 1e-2
"""Share of a derivative by which it differs on the two sides where rates bend."""

ROUNDED = 1e-14
"""Of the rates: what rounding makes of them, with the digits that models lose."""


class Derivatives(Struct, frozen=True, eq=False):
    """Derivatives by displacements x of the state [n], inputs u, and time: of rates [n], outputs, constraints. Behind the columns
    of the inputs are those of what is delayed, in the order of the table of delays, where the past stands apart.

    ``position`` are residuals of positions, ``rate`` is K v + b; ``gaps`` and ``slips`` are the same of each row that switches,
    whether it holds or not. ``outputs_by_others``: by the states that are not displaced.
    """

    rates: Array
    rates_by_inputs: Array
    outputs: Array
    outputs_by_inputs: Array
    outputs_by_others: Array
    position: Array
    rate: Array
    constraints_by_inputs: Array
    gaps: Array
    gaps_by_inputs: Array
    slips: Array
    slips_by_inputs: Array
    moves_by_itself: bool
    """Whether rates or constraints contain the time, here or elsewhere."""


class Site(Struct, frozen=True, eq=False):
    """A model at a time t with inputs u, discrete variables z and parameters p; ``y`` is its start. ``balanced``: places of the
    rates that count as zero wherever it is looked at, as they are rounding there."""

    case: Case
    chart: Chart
    t: float
    u: Array
    z: Array
    y: Array
    p: Array
    balanced: tuple[int, ...] = ()

    @property
    def problem(self) -> Problem:
        return self.case.problem

    def discretes(self, y: Array) -> Array:
        """Return the discrete variables at a state in which the motion has been all the time: what was is what is."""
        hybrid = self.problem.hybrid
        if hybrid is None or not hybrid.delays:
            return self.z
        return as_at_the_start(self.case.functions, self.t, y, self.u, self.z, self.p)

    @property
    def past(self) -> DelayTable | None:
        """What is delayed; None where nothing is."""
        hybrid = self.problem.hybrid
        return delays_of(self.case.functions, self.p) if hybrid is not None and hybrid.delays else None

    def rates(self, y: Array) -> Array:
        """Return the rates [n] of the displacements at a state: of positions, velocities, states."""
        problem, chart = self.problem, self.chart
        dy = self.case.functions.rhs(self.t, y, self.u, self.discretes(y), self.p)
        found = np.zeros(chart.size)
        for j, i in enumerate(chart.places):
            if i not in problem.rotations:
                found[j] = dy[i]
            elif j == 0 or chart.places[j - 1] != i:
                found[j : j + 3] = 4.0 * chart.of_entries(y)[i : i + 4, j : j + 3].T @ dy[i : i + 4]
        found[chart.nd :] = dy[list(chart.behind)]
        found[list(self.balanced)] = 0.0
        return found

    def phase(self, y: Array) -> Array:
        """Return momenta, energy and the other quantities of the part ``phase`` at a state."""
        assert self.case.functions.phase is not None, "the part phase"
        return self.case.functions.phase(self.t, y, self.u, self.z, self.p)

    def constraints(self, y: Array) -> tuple[Array, Array]:
        """Return the residuals of the position constraints, and K v + b."""
        problem, functions = self.problem, self.case.functions
        if functions.project_position is None or functions.project_velocity is None:
            return np.zeros(0), np.zeros(0)
        arguments = (self.t, y, self.u, self.discretes(y), self.p)
        return functions.project_position(*arguments)[problem.nv :], functions.project_velocity(*arguments)[
            problem.nv :
        ]

    def outputs(self, y: Array) -> Array:
        functions = self.case.functions
        z = self.discretes(y)
        return np.zeros(0) if functions.outputs is None else functions.outputs(self.t, y, self.u, z, self.p)

    def derivatives(self, y: Array, *, apart: bool = False) -> Derivatives:
        """Return everything that is linear near a state. Raises SimulationError where that is undefined.

        ``apart``: what was stands still beside what is, as in a motion; else both are displaced, as between states of rest.
        """
        problem, n, nd = self.problem, self.chart.size, self.chart.nd
        behind = problem.ny - problem.nq
        own = rows_of(self.chart)
        others = np.setdiff1d(np.arange(nd + behind), own)
        nu, n_out = len(problem.inputs), len(problem.outputs)
        pattern = pattern_of(problem)
        n_position = sum(row.level == "position" for row in problem.constraints)
        constrained = nd + behind + n_out + n_position + len(problem.constraints)
        switching = 0 if problem.hybrid is None else len(problem.hybrid.rows)
        by_time = nd + behind + nu
        sources = [] if (past := self.past) is None else past.sources[past.delayed[:, 1]].tolist()
        shape = (constrained + 2 * switching, by_time + 1 + len(sources))
        full = np.zeros(shape)
        if len(pattern):
            entries = self.case.functions.matrices[PART](self.t, y, self.u, self.discretes(y), self.p)
            full[pattern[:, 0], pattern[:, 1]] = entries
        for k, (array, index) in enumerate(sources):
            if array in (Y, U) and not apart:
                full[:, :by_time] += np.outer(full[:, by_time + 1 + k], self._displaced(y, array, index))
        needed = np.r_[own, nd + behind + n_out : constrained]
        if not np.isfinite(full[needed]).all():
            row, column = (int(k) for k in np.argwhere(~np.isfinite(full[needed]))[0])
            raise self.undefined(
                f"the rate of '{self.chart.names[row]}'" if row < n else "a constraint", column
            )
        full[own[list(self.balanced)]] = 0.0
        columns = [*range(nd + behind, by_time), *(range(by_time + 1, full.shape[1]) if apart else ())]
        by_inputs = np.array(columns, dtype=np.intp)
        clocks = [by_time, *(by_time + 1 + k for k, (array, _) in enumerate(sources) if array == T)]
        out = slice(nd + behind, nd + behind + n_out)
        position = slice(out.stop, out.stop + n_position)
        rate = slice(position.stop, constrained)
        held = slice(position.start, rate.stop)
        return Derivatives(
            rates=full[np.ix_(own, own)],
            rates_by_inputs=full[np.ix_(own, by_inputs)],
            outputs=full[out][:, own],
            outputs_by_inputs=full[out][:, by_inputs],
            outputs_by_others=full[out][:, others],
            position=full[position][:, own],
            rate=full[rate][:, own],
            constraints_by_inputs=full[held][:, by_inputs],
            gaps=full[constrained::2][:, own],
            gaps_by_inputs=full[constrained::2][:, by_inputs],
            slips=full[constrained + 1 :: 2][:, own],
            slips_by_inputs=full[constrained + 1 :: 2][:, by_inputs],
            moves_by_itself=bool((np.isin(pattern[:, 1], clocks) & np.isin(pattern[:, 0], needed)).any()),
        )

    def _displaced(self, y: Array, array: int, index: int) -> Array:
        """Return the derivative of a number of the state or of the inputs by displacements, all other states and inputs."""
        nd, nq = self.chart.nd, self.problem.nq
        row = np.zeros(nd + self.problem.ny - nq + len(self.problem.inputs))
        if array == Y and index < nq:
            row[:nd] = self.chart.of_entries(y)[index, :nd]
        else:
            row[nd + index - nq if array == Y else nd + self.problem.ny - nq + index] = 1.0
        return row

    def undefined(self, what: str, column: int) -> SimulationError:
        """Return the message that a derivative does not exist; ``column`` counts all displacements, then inputs."""
        return SimulationError(
            f"a derivative is undefined here: of {what} by {self._column(column)}",
            help="look for square roots, quotients or angles of vectors that vanish at this state",
        )

    def _column(self, column: int) -> str:
        names = [
            *self.chart.names[: self.chart.nd],
            *(q.name for q in self.problem.states[self.problem.nq :]),
        ]
        names += [q.name for q in self.problem.inputs]
        return f"'{names[column]}'" if column < len(names) else "time"

    def at(self, y: Array) -> Site:
        """Return the same model with another state."""
        return replace(self, y=y)


def pattern_of(problem: Problem) -> NDArray[np.intp]:
    """Return the (row, column) of the derivatives that can differ from zero: displacements and outputs of all states count."""
    return np.array(problem.patterns[PART], dtype=np.intp).reshape(-1, 2)


def rows_of(chart: Chart) -> NDArray[np.intp]:
    """Return the places of the displacements of a chart among those of all states."""
    behind = np.array(chart.behind, dtype=np.intp)
    return np.concatenate([np.arange(chart.nd), chart.nd + behind - chart.problem.nq])


def depended_on(site: Site) -> set[int]:
    """Return the displacements on which some rate of a velocity or state depends, or some constraint."""
    chart, problem, pattern = site.chart, site.problem, pattern_of(site.problem)
    rows = rows_of(chart)
    first = chart.nd + problem.ny - problem.nq + len(problem.outputs)
    last = first + sum(row.level == "position" for row in problem.constraints) + len(problem.constraints)
    felt = np.isin(pattern[:, 0], rows[chart.nd :]) | ((pattern[:, 0] >= first) & (pattern[:, 0] < last))
    return {k for k, row in enumerate(rows.tolist()) if row in pattern[felt, 1]}


def moving_inputs(site: Site) -> tuple[str, ...]:
    """Say which inputs are functions of time: near a state they count as constant, with their derivatives where they drive."""
    later = [inputs_at(site.case, site.t + delay) for delay in (0.37, 1.618, 100.0)]
    following = derived(site.problem)
    derivatives = {k for pair in following.values() for k in pair}
    return tuple(
        f"the input '{q.name}' is a function of time: {'it, its rate and its acceleration are' if k in following else 'it is'} "
        f"held at {'their values' if k in following else 'its value'} at t = {site.t:g}"
        for k, q in enumerate(site.problem.inputs)
        if k not in derivatives and any(u[k] != site.u[k] for u in later)
    )


def site_of(problem: Problem, options: SimulationOptions, place: Place) -> Site:
    """Return the model at the start of its run, or with the values of a place there. Raises SimulationError."""
    functions = load_functions(problem)
    values = {**options.values, **place.values}
    # the motion is not looked at: its times are
    options = replace(options, values=values, start=0.0, stop=0.0, every=None, step=None)
    case = prepare(problem, functions, options)
    u, z, y = inputs_at(case, case.begin), case.z, case.y0
    if problem.hybrid is not None:
        y, z = _begun(case)
    return Site(case, chart_of(problem), case.begin, u, z, y, case.p)


def _begun(case: Case) -> tuple[Array, Array]:
    """Return state and discrete variables once the events of the start have happened: what holds, sticks and switches."""
    kernel = native.kernel_for(case.functions.struct)
    with Solver(kernel, case, "dop853", case.tolerance, np.full(case.y0.size, case.tolerance)) as solver:
        status = solver.advance(case.begin, 1)
        _, y = solver.report()
        z = solver.discretes()
    if status != Status.REACHED:
        raise SimulationError(
            f"'{case.problem.name}' cannot begin here: {status.name.lower().replace('_', ' ')}",
            help="mechc run tells more",
        )
    return y, z


def switched(site: Site, y: Array) -> Site:
    """Return the same model with its switches as they stand at a state; what holds or sticks stays as it is."""
    plan = plan_of(site)
    if plan is None or not plan.n_switches:
        return site
    values, z = indicators_of(site, plan, y), site.z.copy()
    for k in range(plan.n_switches):
        z[plan.switches[k]] = float(values[k] < 0)
    return replace(site, z=z)


def begun_at(site: Site, y: Array) -> Site:
    """Return the same model with what holds, sticks and switches where a motion begins at a state."""
    if site.problem.hybrid is None:
        return site
    return replace(site, z=_begun(replace(site.case, y0=y))[1])


def plan_of(site: Site) -> contract.HybridStruct | None:
    """Return what the kernel knows of switches and rows; None where nothing switches."""
    struct = site.case.functions.struct
    if site.problem.hybrid is None or struct.hybrid is None:
        return None
    return ctypes.cast(struct.hybrid, ctypes.POINTER(contract.HybridStruct)).contents


def indicators_of(site: Site, plan: contract.HybridStruct, y: Array) -> Array:
    values = np.zeros(plan.n_switches + plan.n_rows)
    if plan.indicators is not None:
        arrays = [np.ascontiguousarray(a) for a in (y, site.u, site.z, site.p)]
        contract.MODEL_FUNCTION(plan.indicators)(site.t, *(a.ctypes.data for a in arrays), values.ctypes.data)
    return values


HELD = {"contact": "is closed", "friction": "sticks", "freewheel": "sticks"}
LOOSE = {
    "contact": "is closed, but nothing presses it",
    "friction": "sticks at its limit",
    "freewheel": "sticks at its limit",
}


class Edges(Struct, frozen=True):
    """``sharp``: what has other derivatives on its other side, contacts that nothing presses and friction at its limit among
    it; ``smooth``: events at their edges that change no derivative; ``leaving``: friction that is overcome from rest, so that
    one side alone is that of the motion; ``held``: what holds, also in small motions."""

    sharp: tuple[str, ...]
    smooth: tuple[str, ...]
    leaving: tuple[str, ...] = ()
    held: tuple[str, ...] = ()


def edges(site: Site, y: Array) -> Edges:
    """Find what holds at a state, or stands at an edge there."""
    problem, plan = site.problem, plan_of(site)
    sharp = [f"the rates bend at this value of '{name}'" for name in bends(site, y)]
    if problem.hybrid is None or plan is None:
        return Edges(tuple(sharp), ())
    leaving: list[str] = []
    held: list[str] = []
    values = indicators_of(site, plan, y)
    for k, row in enumerate(problem.hybrid.rows):
        flag = plan.rows[k].flag
        if flag >= 0 and site.z[flag] > 0.5:
            firm = values[plan.n_switches + k] > EDGE
            words = (HELD if firm else LOOSE).get(row.kind, "holds")
            noun = "friction" if row.kind == "freewheel" else row.kind
            (held if firm else sharp).append(f"the {noun} '{row.name}' {words}")
        elif row.kind == "friction" and plan.rows[k].normal < 0 and abs(values[plan.n_switches + k]) <= EDGE:
            leaving.append(f"the friction '{row.name}' begins to slide")
    smooth: list[str] = []
    for k, text in enumerate(problem.hybrid.switches[: plan.n_switches]):
        if abs(values[k]) > EDGE:
            continue
        other = site.z.copy()
        other[plan.switches[k]] = 1.0 - other[plan.switches[k]]
        here, there = (
            site.case.functions.matrices[PART](site.t, y, site.u, z, site.p) for z in (site.z, other)
        )
        (smooth if np.array_equal(here, there) else sharp).append(f"'{text}' stands at its edge")
    unique = (tuple(dict.fromkeys(one)) for one in (sharp, smooth, leaving, held))
    return Edges(*unique)


def bends(site: Site, y: Array) -> tuple[str, ...]:
    """Name the displacements on whose two sides the rates have different derivatives, such as |x| at x = 0: the second
    difference over a step, which is the step times a curvature where they are smooth, is the same for both ``STEPS``."""
    here, found = site.rates(y), []
    for j, name in enumerate(site.chart.names):
        i = site.chart.place(j)
        size = 1.0 if i in site.problem.rotations else abs(float(y[i])) or 1.0
        second, first = [], []
        for step in STEPS:
            d = np.zeros(site.chart.size)
            d[j] = step * size
            ahead, behind = site.rates(site.chart.moved(y, d)), site.rates(site.chart.moved(y, -d))
            second.append((ahead + behind - 2 * here) / d[j])
            first.append(np.abs(ahead - here) / d[j] + np.abs(behind - here) / d[j])
        rounding = ROUNDED * (np.abs(here) / (STEPS[-1] * size) + 1e-300)
        bent = np.abs(second[1]) > BEND * first[1] + rounding
        if (bent & (np.abs(second[0] - second[1]) < BEND * np.abs(second[1]) + rounding)).any():
            found.append(name)
    return tuple(found)


def _listed(texts: tuple[str, ...]) -> str:
    return ", ".join(texts[:NAMED]) + (f", and {len(texts) - NAMED} more" if len(texts) > NAMED else "")


def refuse_edges(site: Site, y: Array, what: str) -> tuple[str, ...]:
    """Return remarks on what holds at a state, and on events that are due there. Raises SimulationError where the state is not a
    smooth one."""
    found = edges(site, y)
    if found.sharp:
        raise SimulationError(
            f"there is no {what} here: {_listed(found.sharp)}",
            help='derivatives are different on the two sides; look at a state beside it with at = "name = value"',
        )
    return (
        *(f"{text}: the event that it is for is not looked at" for text in found.smooth),
        *(f"{text}: derivatives are those of sliding that way, not of the other" for text in found.leaving),
        *((f"held here: {_listed(found.held)}",) if found.held else ()),
    )
