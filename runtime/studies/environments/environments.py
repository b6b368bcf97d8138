"""Many environments of one model: arrays that a program reads and writes between control steps."""

from __future__ import annotations

import ctypes
import math
from collections.abc import Collection
from typing import Any

import numpy as np
from msgspec import Struct
from msgspec.structs import replace
from numpy.typing import NDArray

from ...case import Case, SimulationOptions, inputs_at
from ...driving_inputs import derived
from ...ensembles.lanes import Lanes, Maker, NoLanes, find_lanes, refuse_lanes
from ...integrate.kernel_failure import kernel_failure
from ...integrate.solver import kink_times, method_of, table_structs
from ...methods import KERNEL_METHODS
from ...native import calls
from ...native import kernel as native
from ...native.status import Status
from ...outcome import AT_SINGULAR_POSITIONS, SimulationError, time_text
from ...problem import Array, Problem
from ...results.diagnosis import with_cause
from ..runs.simulate import plan_run
from .native import EnvironmentsStruct, functions_of, load_environments

LONGEST = 1000
"""The longest step over that of the experiment's run: how far the caller will go is not known."""
MAX_STEPS = 10_000
"""Steps of the integrator that one control step takes, if the caller sets no bound."""
LONGEST_CALL = 0.1
"""Seconds after which the kernel returns between two steps, so that Ctrl-C is heard and bounds of time are kept."""
PARALLEL = "rk4"
"""The method of which there are lanes with steps of one size."""


class Wishes(Struct, frozen=True, kw_only=True):
    """What a caller wants of environments: how many, the ``period`` of a control step [s] with so many ``substeps`` of a method with
    steps of one size, the bound of steps in each, ``threads``, and ``lanes`` by what makes them."""

    n: int = 1
    period: float = math.nan
    substeps: int = 1
    max_steps: int = MAX_STEPS
    threads: int = 1
    lanes: Maker | None = None
    moving: Collection[str] = ()
    """Inputs that the model gives as functions of time, so that they cannot be set."""
    at_singular_positions: str = ""
    """What helps where constraints become dependent on the way."""


def control_steps(
    options: SimulationOptions, wishes: Wishes, period: float, substeps: int
) -> tuple[SimulationOptions, Wishes]:
    """Return what environments are made of whose control steps last a period [s]; a method with steps of one size takes so many
    in each."""
    row = KERNEL_METHODS.get(options.method or "")
    step = period / substeps if row is not None and row.fixed_step else None
    return replace(options, every=None, step=step), replace(wishes, period=period, substeps=substeps)


class Names(Struct, frozen=True):
    """The names of the columns of ``q``, ``v``, ``x``, ``u``, ``y`` and ``z``."""

    q: tuple[str, ...]
    v: tuple[str, ...]
    x: tuple[str, ...]
    u: tuple[str, ...]
    y: tuple[str, ...]
    z: tuple[str, ...]


class Saved(Struct, frozen=True, eq=False):
    """What ``save`` gives: everything that changes, of the environments ``rows``."""

    rows: NDArray[np.intp]
    memory: tuple[bytes, ...]
    arrays: tuple[NDArray[Any], ...]


class Environments:
    """``n`` environments of a model, each with its own motion; none feels the others.

    ``q`` [n, nq], ``v`` [n, nv], ``x`` [n, nx], ``z`` [n, nz], ``time`` and ``status`` [n] are views of what the kernel writes, in SI;
    ``u`` [n, nu] is what it reads at the beginning of a control step; ``y`` [n, ny] are the outputs, evaluated when they are asked
    for. ``names`` has their columns. ``status`` is 1 where the control step was reached, 0 where it took more than its bound of steps
    and goes on with the next one, 3 where the model ended the run, and negative where it failed: what has ended stays as it is
    until it is reset. Close it, or use it as a context.
    """

    def __init__(self, problem: Problem, options: SimulationOptions, wishes: Wishes) -> None:
        """Begin the motions. Raises ``SimulationError``."""
        if wishes.n < 1 or wishes.threads < 1 or wishes.substeps < 1:
            raise SimulationError("'n', 'threads' and 'substeps' are at least 1")
        stop = math.inf if options.stop is None else options.stop
        options = replace(options, stop=stop if math.isfinite(stop) else 1.0, points=2, every=None)
        plan = plan_run(problem, options)
        case, method = plan.case, plan.method
        if wishes.substeps > 1 and not method.fixed_step:
            raise SimulationError(f"'{method.name}' chooses its steps itself, and takes no substeps")
        self._problem, self._wishes, self._options = problem, wishes, options
        held = self._held = settable(problem, case, wishes.moving)
        now = inputs_at(case, case.begin)
        n, nq, nv, ny, nz = wishes.n, problem.nq, problem.nv, problem.ny, len(problem.discretes)
        self._y, self._z = np.empty((n, ny)), np.empty((n, nz))
        self._u = np.tile(now[held], (n, 1))
        self._t, self._status = np.empty(n), np.ones(n, dtype=np.int32)
        self._outputs = np.empty((n, len(problem.outputs)))
        self._stale = True
        states = tuple(s.name for s in problem.states)
        self.names = Names(
            states[:nq],
            states[nq : nq + nv],
            states[nq + nv :],
            tuple(problem.inputs[k].name for k in held),
            tuple(q.name for q in problem.outputs),
            tuple(q.name for q in problem.discretes),
        )
        parts = (self._y[:, :nq], self._y[:, nq : nq + nv], self._y[:, nq + nv :])
        arrays: tuple[NDArray[Any], ...] = (*parts, self._z, self._t, self._status, self._y)
        self._views = tuple(map(_read_only, arrays))
        tables = {k: t for k, t in case.tables.items() if k not in set(held)}
        self._case = replace(case, tables=tables, grid=np.empty(0), max_step=LONGEST * case.max_step)
        self._nominal = plan.nominal
        self.stop = case.stop - case.begin
        self._open(method.name)

    def _open(self, method: str) -> None:
        case, wishes = self._case, self._wishes
        struct, reproducible = case.functions.struct, self._options.reproducible
        kernel = native.kernel_for(struct, reproducible, method)
        self._lanes = self._lanes_of(method)
        self._given, self._table_data = table_structs(case.tables)
        self._stops = np.array(kink_times(case), dtype=float)
        self._atol = np.ascontiguousarray(case.tolerance * self._nominal)
        self._start = np.ascontiguousarray(case.y0)
        self._held_places = np.array(self._held, dtype=np.int32)
        longest = case.max_step
        self._kernel_options = native.OptionsStruct(
            method=method_of(kernel, method)[0],
            n_tables=len(case.tables),
            n_stops=self._stops.size,
            t0=case.begin,
            dt_max=longest if longest > 0 else 1.0,
            dt=case.step or 0.0,
            apart=10 * case.apart,  # half a millisecond where no stop is given
            rtol=case.tolerance,
            atol=self._atol.ctypes.data,
            y0=self._start.ctypes.data,
            z=case.z.ctypes.data,
            p=case.p.ctypes.data,
            tables=ctypes.addressof(self._given),
            stops=self._stops.ctypes.data,
            longest_call=LONGEST_CALL,
        )
        self._kernel = kernel, functions_of(kernel)
        self._library = load_environments(reproducible)
        self._struct = EnvironmentsStruct(
            kernel=ctypes.addressof(self._kernel[1]),
            model=ctypes.addressof(struct),
            options=ctypes.addressof(self._kernel_options),
            lanes=None if self._lanes is None else ctypes.addressof(self._lanes.struct),
            held=self._held_places.ctypes.data,
            n=wishes.n,
            n_held=len(self._held),
            threads=wishes.threads,
            substeps=wishes.substeps,
            period=wishes.period,
            until=math.nan,
            max_steps=wishes.max_steps,
            y=self._y.ctypes.data,
            u=self._u.ctypes.data,
            z=self._z.ctypes.data,
            t=self._t.ctypes.data,
            status=self._status.ctypes.data,
            outputs=self._outputs.ctypes.data,
        )
        if self._library.mech_environments_open(self._struct):
            raise MemoryError("the kernel could not allocate its environments")
        self._at = ctypes.c_void_p(ctypes.addressof(self._struct))
        self._step = calls.task_of(self._library.mech_environments_step, self._at)
        self._read = calls.task_of(self._library.mech_environments_read, self._at)

    def _lanes_of(self, method: str) -> Lanes | None:
        """Return the lanes by which the environments move; None: each by a solver."""
        wishes = self._wishes
        if wishes.lanes is None or not wishes.lanes.wanted_for(wishes.n):
            return None
        try:
            if method != PARALLEL:
                raise NoLanes(f"'{PARALLEL}' takes steps of one size in lanes, '{method}' does not")
            rows = [table.times.size for table in self._case.tables.values()]
            case = self._case
            return find_lanes(
                wishes.lanes,
                case.problem,
                case.functions.struct,
                method,
                (),
                rows,
                self._options.reproducible,
            )
        except NoLanes as why:
            if wishes.lanes.asked == "on":
                raise refuse_lanes(why) from None
            return None

    def __enter__(self) -> Any:
        return self

    def __exit__(self, *details: object) -> None:
        self.close()

    def close(self) -> None:
        """Give the memory of the motions back; views stay as they are."""
        if self._struct.memory:
            self._library.mech_environments_close(self._struct)
            self._step = self._read = _closed

    def __del__(self) -> None:
        if hasattr(self, "_at"):
            self.close()

    @property
    def states(self) -> Array:
        """All of the state [n, .]: ``q``, ``v`` and ``x`` side by side."""
        return self._views[6]

    @property
    def start(self) -> Array:
        """The state in which the model begins."""
        return self._start

    @property
    def held(self) -> list[int]:
        """The inputs of the model that the columns of ``u`` are."""
        return self._held

    @property
    def n(self) -> int:
        return self._wishes.n

    @property
    def dt(self) -> float:
        """The period of a control step [s]."""
        return self._wishes.period

    @property
    def by(self) -> str:
        """How they are stepped, in words."""
        return "one after the other" if self._lanes is None else self._lanes.build

    @property
    def q(self) -> Array:
        return self._views[0]

    @property
    def v(self) -> Array:
        return self._views[1]

    @property
    def x(self) -> Array:
        return self._views[2]

    @property
    def z(self) -> Array:
        return self._views[3]

    @property
    def time(self) -> Any:
        return self._views[4]

    @property
    def status(self) -> Any:
        return self._views[5]

    @property
    def u(self) -> Array:
        """The inputs [n, nu] that can be set, held from one control step to the next."""
        return self._u

    @property
    def y(self) -> Array:
        """The outputs [n, ny]."""
        if self._stale:
            self._read()
            self._stale = False
        return self._outputs

    def step(self) -> None:
        """Take all of them one control step on, with the inputs of ``u``. Status tells those that fail."""
        self._stale = True
        while self._step():
            pass  # a signal is heard in between

    def reset(
        self,
        q: Any = None,
        v: Any = None,
        x: Any = None,
        where: Any = None,
    ) -> None:
        """Begin again at the start: all, or those of a mask [n] or of indices.

        ``q``, ``v``, ``x``: other coordinates, velocities and states, a row for each of those or one for all; on the constraints,
        or close by: then the nearest state that fulfils them is taken, and ``status`` tells where there is none.
        """
        self._check_open()
        rows = _rows(where, self._wishes.n)
        problem, (nq, nv) = self._problem, (self._problem.nq, self._problem.nv)
        given = [
            (part, values)
            for part, values in (
                (slice(0, nq), q),
                (slice(nq, nq + nv), v),
                (slice(nq + nv, problem.ny), x),
            )
            if values is not None
        ]
        if given and problem.found:
            raise SimulationError(
                "parameters follow from the start of this model, so that no other start is taken"
            )
        self._y[rows] = self._start
        for part, values in given:
            width = part.stop - part.start
            values = np.asarray(values, dtype=np.float64)
            if values.shape not in ((width,), (1, width), (rows.size, width)):
                raise SimulationError(
                    f"{width} numbers are given for each of {rows.size} environments, not an array of the shape {values.shape}"
                )
            if not np.isfinite(values).all():
                raise SimulationError("a start is finite, not infinite or not a number")
            self._y[rows, part] = values
        if given:
            self._put_others(rows, {i for part, _ in given for i in range(part.start, part.stop)})
        for k in rows.tolist():
            self._library.mech_environments_reset(self._struct, k, bool(given))
        self._stale = True

    def _put_others(self, rows: NDArray[np.intp], given: set[int]) -> None:
        """Give the states whose start is stated with that of others."""
        functions, case = self._case.functions, self._case
        if functions.initial_of_others is None:
            return
        free = [k for k, i in enumerate(self._problem.dependent) if i not in given]
        places = [self._problem.dependent[k] for k in free]
        for k in rows.tolist():
            u = self._inputs(k)
            for _ in places:  # one of them may be stated with another
                self._y[k, places] = functions.initial_of_others(case.begin, self._y[k], u, case.z, case.p)[
                    free
                ]

    def _inputs(self, k: int) -> Array:
        """Give all inputs of an environment at its time."""
        u = inputs_at(self._case, float(self._t[k]))
        u[self._held] = self._u[k]
        return u

    def _check_open(self) -> None:
        if not self._struct.memory:
            _closed()

    def save(self, where: Any = None) -> Saved:
        """Give all that changes of all environments, or of those of a mask or of indices."""
        self._check_open()
        rows = _rows(where, self._wishes.n)
        memory = []
        for k in rows.tolist():
            block = ctypes.create_string_buffer(self._library.mech_environments_save_size(self._struct, k))
            self._library.mech_environments_save(self._struct, k, block)
            memory.append(block.raw)
        return Saved(rows, tuple(memory), tuple(a[rows] for a in self._arrays()))

    def load(self, saved: Saved, where: Any = None) -> None:
        """Go back to what ``save`` gave, bit for bit: in the same environments, or in as many others."""
        self._check_open()
        rows = saved.rows if where is None else _rows(where, self._wishes.n)
        if rows.size != len(saved.memory):
            raise SimulationError(f"{len(saved.memory)} environments were saved, not {rows.size}")
        for k, block in zip(rows.tolist(), saved.memory, strict=True):
            self._library.mech_environments_load(self._struct, k, block)
        for array, values in zip(self._arrays(), saved.arrays, strict=True):
            array[rows] = values
        self._stale = True

    def _arrays(self) -> tuple[NDArray[Any], ...]:
        return self._y, self._z, self._u, self._t, self._status

    def why(self, k: int = 0) -> SimulationError | None:
        """Give what ended an environment, with its time and cause; None where it goes on."""
        status = Status(int(self._status[k]))
        if status in (Status.REACHED, Status.RUNNING):
            return None
        report = native.ReportStruct()
        problem, t = self._problem, float(self._t[k])
        if not self._library.mech_environments_report(self._struct, k, report):
            words = {
                Status.ASSERTION: "an assertion of the model does not hold",
                Status.OFF_CONSTRAINTS: "no state close by fulfils the constraints",
            }
            return SimulationError(
                f"{words.get(status, 'a state is no longer finite')} at {time_text(problem, t)}"
            )
        if status == Status.OFF_CONSTRAINTS and report.status != status:
            return SimulationError("no state close by fulfils the constraints: the start cannot be taken")
        if status == Status.TERMINATED and problem.hybrid is not None:
            message = problem.hybrid.branches[report.failed_index].message
            return SimulationError(f"{message} at {time_text(problem, report.t)}")
        found = kernel_failure(problem, status, report, self._y[k])
        if found is None:
            return SimulationError(f"the run stopped at {time_text(problem, report.t)}")
        found = with_cause(self._case, found)
        singular = problem.constraints and found.kind in AT_SINGULAR_POSITIONS
        advice = self._wishes.at_singular_positions if singular else ""
        return SimulationError(found.message, found.origin, help=advice)


def _closed(*details: object) -> int:
    raise SimulationError("the environments were closed")


def settable(problem: Problem, case: Case, moving: Collection[str]) -> list[int]:
    """List the inputs that a caller sets: none that the model or a table moves, that drives a coordinate, or whose rate the
    equations take to be zero."""
    driving = {i for own, more in derived(problem).items() for i in (own, *more)}
    given = {k for k, table in case.tables.items() if table.times.size > 1}
    return [
        k
        for k, q in enumerate(problem.inputs)
        if k not in driving | given
        and k not in problem.held_inputs
        and (k in case.tables or q.name not in moving)
    ]


def _read_only(array: NDArray[Any]) -> NDArray[Any]:
    view = array[:]
    view.flags.writeable = False
    return view


def _rows(where: Any, n: int) -> NDArray[np.intp]:
    """Return the environments that a mask or indices mean. Raises SimulationError."""
    if where is None:
        return np.arange(n)
    chosen = np.atleast_1d(np.asarray(where))
    if chosen.dtype == bool:
        if chosen.shape != (n,):
            raise SimulationError(f"a mask has an entry for each of {n} environments, not {chosen.size}")
        return np.flatnonzero(chosen)
    if chosen.size and (chosen.min() < 0 or chosen.max() >= n):
        raise SimulationError(f"environments are numbered from 0 to {n - 1}")
    return chosen.astype(np.intp)
