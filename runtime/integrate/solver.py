"""One solver of the C kernel, as an object that owns the arrays which the kernel reads and writes.

``little_work`` counts the evaluations by code of libtcc, after which a question begins again with that of gcc: evaluations,
never time, so that the same question is answered by the same code each time.
"""

from __future__ import annotations

import ctypes
import functools
import math
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from types import TracebackType

import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

from ..case import Case, Progress
from ..inputs import Table
from ..methods import SOLVING_CONTACTS
from ..native import kernel as native
from ..native.status import Status
from ..problem import Array
from ..rows import AT_ONCE, IN_MEMORY, Follower, Storage
from .events import MOST_AT_ONCE, NOTED

FIRST_EVENTS = 256
STATUSES = {int(status): status for status in Status}
"""By their numbers, sooner than ``Status`` finds them."""
LONGEST_CALL = 0.1
"""Seconds after which the kernel returns between two steps, so that Ctrl-C is heard and bounds of time are kept."""
STATES_SWEPT = 256
"""A sweep over the contacts that so many states have in a heap takes libtcc's code 40 us, several times as long as gcc's."""
SEEN = 0.44
"""Ten times the share of the bend of a table at a point that is left beside the best polynomial of degree 7 over eight cells (0.044, by
linear programming). Where that is less than the tolerance, steps that are longer than the cells pass over the point."""
NO_TABLES = (native.TableStruct * 0)()


class Solver:
    """One ``mech_solver``: owns the arrays that the kernel reads and writes. Use as a context.

    ``dense`` bounds the errors of all steps between their ends, also of those that nobody records; the polynomials of the
    first ``records`` are.
    """

    def __init__(
        self,
        kernel: ctypes.CDLL,
        case: Case,
        method: str,
        tolerance: float,
        atol: Array,
        step: float = 0.0,
        storage: Storage = IN_MEMORY,
        *,
        dense: bool = False,
        records: int = 0,
        halves: bool = False,
    ) -> None:
        struct = case.functions.struct
        self.kernel = kernel
        self._case = case  # the library of its functions stays loaded
        self._solves_contacts = method in SOLVING_CONTACTS
        index, n_dense = method_of(kernel, method)
        y0, z, tables = case.y0, case.z, case.tables
        ny, nz = self.ny, self.nz = y0.size, z.size
        self.n_dense = n_dense
        self._tables, self._table_data = table_structs(tables)
        stops = kink_times(case)
        given = [atol, y0, z, case.p]
        self._numbers = numbers = np.concatenate([*given, np.array(stops, dtype=float)] if stops else given)
        at = numbers.ctypes.data
        self._grid = grid = np.ascontiguousarray(case.grid)
        n_grid = grid.size
        self._grid_y = grid_y = storage.empty(n_grid + 1, ny)  # and the point where a run stops
        self._grid_z = grid_z = storage.empty(n_grid + 1, nz) if struct.hybrid else None
        self._listener: object = None
        width = 2 + n_dense * ny
        if records:
            _freed_once(records * width)
        self._record = record = np.empty((records, width))
        self._report = native.ReportStruct()
        self._report_at = ctypes.byref(self._report)
        longest = case.max_step
        self._options = native.OptionsStruct(
            method=index,
            n_tables=len(tables),
            n_stops=len(stops),
            n_grid=n_grid,
            t0=case.begin,
            dt_max=longest if longest > 0 else 1.0,
            dt=step,
            rtol=tolerance,
            atol=at,
            y0=at + 8 * ny,
            z=at + 16 * ny,
            p=at + 8 * (2 * ny + nz),
            tables=ctypes.addressof(self._tables),
            stops=at + 8 * (numbers.size - len(stops)) if stops else None,
            grid=grid.ctypes.data,
            grid_y=grid_y.ctypes.data,
            grid_z=None if grid_z is None else grid_z.ctypes.data,
            record=record.ctypes.data if records else None,
            record_capacity=records,
            dense=dense,
            halves=halves,
            apart=case.apart,
            longest_call=LONGEST_CALL,
        )
        self._create()

    def again(
        self, tolerance: float, atol: Array, step: float, longest: float, halves: bool, storage: Storage
    ) -> Solver:
        """Give a solver of the same case by the same method for whom errors, steps and places of rows are others; it records
        nothing. This one was left."""
        assert self._handle is None
        other = Solver.__new__(Solver)
        other.__dict__.update(self.__dict__)
        other._report = native.ReportStruct()
        other._report_at = ctypes.byref(other._report)
        other._numbers[: self.ny] = atol
        other._grid_y = storage.empty(len(self._grid) + 1, self.ny)
        options = other._options
        options.rtol, options.dt, options.dt_max = tolerance, step, longest if longest > 0 else 1.0
        options.record, options.record_capacity, options.dense, options.halves = None, 0, False, halves
        options.grid_y = other._grid_y.ctypes.data
        if self._grid_z is not None:
            other._grid_z = storage.empty(len(self._grid) + 1, self.nz)
            options.grid_z = other._grid_z.ctypes.data
        other._create()
        return other

    def _create(self) -> None:
        struct = self._case.functions.struct
        self._work = 0
        self._handle = self.kernel.mech_create(ctypes.addressof(struct), ctypes.byref(self._options))
        if not self._handle:
            raise MemoryError("the kernel could not allocate its solver")
        if struct.hybrid:
            self.start_events(FIRST_EVENTS)

    def __enter__(self) -> Solver:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.kernel.mech_free(self._handle)
        self._handle = None

    @property
    def handle(self) -> int:
        """The address of the solver in the kernel, as long as this object is entered."""
        assert self._handle is not None
        return int(self._handle)

    def advance(self, stop: float, max_steps: int) -> Status:
        """Take up to ``max_steps`` steps towards ``stop``. Raises BetterCodePays."""
        status = STATUSES[self.kernel.mech_advance(self._handle, stop, max_steps)]
        self.count_work()
        return status

    def count_work(self) -> None:
        """Count what was done since the last count, if libtcc's code did it: a factorisation as evaluations for each state, a sweep
        over contacts as one, over many as one for each ``STATES_SWEPT`` states."""
        if self._case.functions.struct.quick:
            report = self.progress()
            work = report.evaluations + self.ny * report.factorisations
            if self._solves_contacts:
                work += report.iterations * max(1, self.ny // STATES_SWEPT)
            done, self._work = work - self._work, work
            count_work(done)

    def report(self) -> tuple[native.ReportStruct, Array]:
        """Where the run stands, and its state."""
        report, y = native.ReportStruct(), np.empty(self.ny)
        self.kernel.mech_read(self._handle, ctypes.byref(report), y.ctypes.data)
        return report, y

    def progress(self) -> native.ReportStruct:
        """Where the run stands: the same object each time."""
        self.kernel.mech_read(self._handle, self._report_at, None)
        return self._report

    def write(self, y: Array) -> None:
        """Go on from another state."""
        state = np.ascontiguousarray(y, dtype=np.float64)
        self.kernel.mech_write(self._handle, state.ctypes.data)

    def set_constant(self, index: int, value: float) -> None:
        """Give the table of one row for input ``index`` another value, from the present time on."""
        (number,) = [k for k, table in enumerate(self._tables) if table.input == index and table.n == 1]
        self._table_data[3 * number + 1][0] = value
        self.kernel.mech_restart(self._handle)

    def save(self) -> bytes:
        """Give all that changes during a run."""
        memory = ctypes.create_string_buffer(self.kernel.mech_save_size(self._handle))
        self.kernel.mech_save(self._handle, memory)
        return memory.raw

    def load(self, memory: bytes) -> None:
        """Go back to what ``save`` gave, bit for bit."""
        hybrid = self._case.problem.hybrid
        grows = hybrid is not None and hybrid.delays  # by what these look back at
        assert grows or len(memory) == self.kernel.mech_save_size(self._handle)
        self.kernel.mech_load(self._handle, memory)

    def grid_rows(self, count: int) -> tuple[Array, Array]:
        return self._grid[:count], self._grid_y[:count]

    def add_last(self, count: int) -> int:
        """Put the state where a run stopped after ``count`` rows of the grid; give the number of rows then."""
        self._grid_y[count] = self.report()[1]
        if self._grid_z is not None:
            self._grid_z[count] = self.discretes()
        return count + 1

    @property
    def rows(self) -> tuple[Array, Array, Array | None]:
        """Times, states and, where something switches, discrete variables of the grid, as far as they are written."""
        return self._grid, self._grid_y, self._grid_z

    @property
    def instants(self) -> Array:
        """What was noted at instants so far: time, both sides of states and discrete variables."""
        return self._instants[: self._n_instants + self.progress().n_instants]

    def listen(self, listener: Callable[[int], None]) -> None:
        """Have ``listener`` called with the number of rows that are written, whenever there are about ``AT_ONCE`` more."""
        self._listener = native.LISTENER(listener)
        self.kernel.mech_listen(self._handle, ctypes.cast(self._listener, ctypes.c_void_p), AT_ONCE)

    def start_record(self, capacity: int) -> None:
        """Give the kernel a buffer for the polynomials of ``capacity`` steps; 0 stops recording."""
        self._record = np.empty((capacity, 2 + self.n_dense * self.ny))
        self.kernel.mech_set_record(self._handle, self._record.ctypes.data if capacity else None, capacity)

    @property
    def _width(self) -> int:
        """Numbers of an instant: its time and both sides."""
        return 1 + 2 * (self.ny + self.nz)

    def start_events(self, capacity: int) -> None:
        """Give the kernel room for ``capacity`` instants with four events each."""
        self._events = np.empty(_events_of(capacity, self.nz), dtype=NOTED)
        self._instants = np.empty((capacity, self._width))
        self._n_events = self._n_instants = 0
        self._give_events()

    def grow_events(self) -> None:
        """Give the kernel room for as many instants again, ``MOST_AT_ONCE`` at most, after those that it has noted.

        The arrays grow where they are (``resize``), so that nothing is there twice.
        """
        self._count_events()
        more = min(self._n_instants, MOST_AT_ONCE)
        self._events.resize(self._n_events + _events_of(more, self.nz), refcheck=False)
        self._instants.resize((self._n_instants + more, self._width), refcheck=False)
        self._give_events()

    def _count_events(self) -> None:
        """Count what the kernel has noted since it was given room, and number its instants through."""
        report = self.progress()
        if self._n_instants:
            self._events["instant"][self._n_events : self._n_events + report.n_events] += self._n_instants
        self._n_events += report.n_events
        self._n_instants += report.n_instants

    def _give_events(self) -> None:
        self.kernel.mech_set_events(
            self._handle,
            self._events.ctypes.data + NOTED.itemsize * self._n_events,
            len(self._events) - self._n_events,
            self._instants.ctypes.data + self._n_instants * 8 * self._width,
            len(self._instants) - self._n_instants,
        )

    def happened(self) -> tuple[NDArray[np.void], Array]:
        """Give the events and instants since ``start_events``; the solver notes no more."""
        self._count_events()
        events, instants = self._events, self._instants
        self.kernel.mech_set_events(self._handle, None, 0, None, 0)
        events.resize(self._n_events, refcheck=False)
        instants.resize((self._n_instants, self._width), refcheck=False)
        return events, instants

    def discretes(self) -> Array:
        z = np.empty(self.nz)
        self.kernel.mech_read_discretes(self._handle, z.ctypes.data)
        return z

    def recorded(self, count: int) -> Array:
        return self._record[:count]

    def last_record(self, count: int) -> Array:
        """Give the ``count`` steps that were recorded last, in memory of just their size; the run records no more."""
        self._record.resize((count, self._record.shape[1]), refcheck=False)
        return self._record


@functools.cache
def _freed_once(numbers: int) -> None:
    """Free room for so many numbers that nobody has touched: the C library keeps as much from then on. What it takes from the
    system for each run again costs a page fault, some 2 us, for each 4 kB that the kernel writes."""
    np.empty(numbers)


@functools.cache
def method_of(kernel: ctypes.CDLL, name: str) -> tuple[int, int]:
    """Give the number of a method of a kernel, and how many coefficients its polynomials have."""
    index = int(kernel.mech_method_index(name.encode()))
    assert index >= 0
    return index, int(kernel.mech_method_n_dense(index))


@functools.cache
def method_name(kernel: ctypes.CDLL, index: int) -> str:
    """Give the name of a method of a kernel."""
    name: str = kernel.mech_method_name(index).decode()
    return name


def kink_times(case: Case, tolerance: float | None = None) -> list[float]:
    """List the times of a run at which tables have kinks that count at a tolerance, those of inputs and those of the model. (np.unique
    imports numpy.ma, which takes longer than a short run.)"""
    kinks = [table.kinks().tolist() for table in case.tables.values()]
    if case.problem.timed_points:
        kinks += _points_in_time(case, case.tolerance if tolerance is None else tolerance)
    return sorted({t for times in kinks for t in times if t > case.begin})


def _points_in_time(case: Case, tolerance: float) -> list[list[float]]:
    """List the times of a run at which the arguments of tables of time pass the points of these."""
    evaluate = case.functions.timed_arguments
    assert evaluate is not None
    lines = evaluate(case.begin, case.y0, np.zeros(len(case.problem.inputs)), case.z, case.p).reshape(-1, 2)
    found = []
    for timed, (begin, rate) in zip(case.problem.timed_points, lines, strict=True):
        if not rate or not np.isfinite(begin) or not np.isfinite(rate):
            continue
        points = np.array(timed.points)
        period = points[-1] - points[0]
        points = points[np.array(timed.bends) * SEEN > tolerance]
        if timed.periodic:
            ends = (begin + rate * np.array([case.begin, case.stop]) - timed.points[0]) / period
            turns = np.arange(np.floor(ends.min()), np.ceil(ends.max()))
            points = (points[:-1] + period * turns[:, None]).ravel()
        times = (points - begin) / rate
        found.append(times[(times > case.begin) & (times < case.stop)].tolist())
    return found


def _events_of(instants: int, nz: int) -> int:
    """Room for the events of so many instants: four each, and at one of them many for everything that may switch."""
    return 4 * instants + 256 + 64 * nz


def table_structs(tables: Mapping[int, Table]) -> tuple[ctypes.Array[native.TableStruct], list[Array]]:
    """Give tables as the kernel reads them, and the arrays that must stay alive with them."""
    if not tables:
        return NO_TABLES, []
    data: list[Array] = []
    structs = []
    for index, table in tables.items():
        arrays = [np.ascontiguousarray(a) for a in (table.times, table.values, table.slopes)]
        data += arrays
        structs.append(
            native.TableStruct(
                index,
                native.INTERPOLATIONS[table.interpolation],
                table.times.size,
                *(array.ctypes.data for array in arrays),
            )
        )
    return (native.TableStruct * len(structs))(*structs), data


LITTLE = 40_000
"""Evaluations of the derivatives of a model. By libtcc they take two to seven times as long as by gcc, so that they cost a run of ten
million three percent at most; to compile the model takes gcc the time of a hundred thousand of its own and more."""

_left: ContextVar[list[int] | None] = ContextVar("left", default=None)


class BetterCodePays(Exception):
    """The answer takes more than a little work."""


@contextmanager
def little_work() -> Iterator[None]:
    """Raise BetterCodePays once all runs by libtcc within have taken ``LITTLE`` evaluations."""
    token = _left.set([LITTLE])
    try:
        yield
    finally:
        _left.reset(token)


def count_work(evaluations: int) -> None:
    """Tell of evaluations by libtcc. Raises BetterCodePays where they were too many."""
    left = _left.get()
    if left is not None:
        left[0] -= evaluations
        if left[0] < 0:
            raise BetterCodePays


class SolverOptions(Struct, frozen=True, eq=False):
    """``nominal`` [ny]: sizes of the states; the absolute tolerance is ``tolerance`` times these. ``step`` is that of a
    method of fixed step, and the first one of others. ``dense`` keeps the polynomials of all steps, those
    of more than ``dense_kept`` bytes by running again where somebody asks for them. A run of more than
    ``max_steps`` accepted steps or ``seconds`` is given up, and one that is stiff after ``stiff_after`` steps. ``reproducible``:
    by the kernel that gives the same bits on every machine. Between slices it is looked whether a run was interrupted, first after ``first_slice`` steps;
    by ``interrupted``, where somebody listens already. ``like``: a solver of the same case by the same method, which has
    come to its end. ``halves``: the way to a known time is taken in two steps where one would do."""

    method: str
    tolerance: float
    nominal: Array
    step: float | None = None
    dense: bool = False
    max_steps: int | None = None
    stiff_after: int | None = None
    seconds: float = math.inf
    reproducible: bool = False
    progress: Progress | None = None
    dense_kept: float = math.inf
    follower: Follower | None = None
    first_slice: int | None = None
    interrupted: Callable[[], bool] | None = None
    like: Solver | None = None
    halves: bool = False

    @property
    def atol(self) -> Array:
        return self.tolerance * self.nominal
