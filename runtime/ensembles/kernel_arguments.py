"""An ensemble of one problem made ready for the kernel: what all members share, and where their results go."""

from __future__ import annotations

import ctypes
import math
from collections.abc import Sequence
from contextlib import suppress
from functools import cached_property
from typing import Any

import numpy as np
from msgspec import Struct
from msgspec.structs import replace
from numpy.typing import NDArray

from ..allowed_values import check_type
from ..case import (
    NUMBERS,
    Case,
    SimulationOptions,
    find_experiment,
    find_setting,
    initial_state,
    input_values,
    prepare,
)
from ..functions import load_functions
from ..integrate.choose_method import choose_method
from ..integrate.solver import kink_times, table_structs
from ..interface import GROWTH, Quantity
from ..limits_of_time import PLACES_IN_A_STEP
from ..native import contract
from ..native import kernel as native
from ..nominal import kernel_sizes
from ..numerics.growth_rates import BATCHES, estimated, megno, times_of
from ..outcome import SimulationError
from ..problem import Array, Problem
from ..results.accuracy import APART, HALVES, companion_step, companion_tolerance, looser_companion
from .device import Items, MakeItems, find_device, refuse_device
from .kept import EXPONENT, FLOWING, GROWN, REDUCTIONS, SERIES, Kept
from .lanes import Lanes, Maker, NoLanes, Wanted, check_asked, find_lanes, refuse_lanes, stepped_by, turns
from .members import Members
from .native import (
    ARRAYS,
    MEMBER,
    CompanionStruct,
    EnsembleStruct,
    KeptStruct,
    PlaceStruct,
    load_ensemble,
)

FEW_STEPS = 100_000
"""Steps that a companion may take before it is asked whether it fights with rounding, as in studies/runs/simulate.py."""
FEWEST_TIMES = 2 * (BATCHES + 1)
"""Times of series beside which exponents are told."""
TRIED = 100
"""Members of which one must be able to begin, so that the times of all are known."""


class Batch(Struct, frozen=True, eq=False):
    """What members gave: ``members`` [n] (``MEMBER``), ``kept`` and ``errors`` [n, kept], ``series`` [n, series, times],
    ``ends`` [n, ny]."""

    members: Any
    kept: Array
    errors: Array
    series: Array
    ends: Array

    @staticmethod
    def empty(n: int, kept: int, series: int, times: int, ny: int) -> Batch:
        return Batch(
            np.zeros(n, dtype=MEMBER),
            np.full((n, kept), np.nan),
            np.full((n, kept), np.nan),
            np.full((n, series, times), np.nan),
            np.full((n, ny), np.nan),
        )


class Posed:
    """An ensemble of ``problem`` that can be run. Owns all that the kernel reads."""

    def __init__(
        self,
        problem: Problem,
        options: SimulationOptions,
        members: Members,
        kept: Sequence[Kept],
        maker: Maker | None = None,
        device: tuple[str, MakeItems] | None = None,
    ) -> None:
        self.problem, self.options, self.members = problem, options, members
        _check_types(problem, members)
        self.functions = load_functions(problem)
        self.case = self._case()
        self.method = choose_method(self.case, options.reproducible)
        self.scalars = [one for one in kept if one.kind != SERIES]
        self.series = [one for one in kept if one.kind == SERIES]
        self.grown = [(k, one.kind) for k, one in enumerate(self.scalars) if one.kind in GROWN]
        self.grid = self._grid()
        self._alive: list[Any] = []
        self.lanes: Lanes | None = None
        self.items: Items | None = None
        self.without_lanes = ""
        if device is not None:
            self.items = self._items(*device)
        elif maker is not None and maker.wanted_for(members.count):
            try:
                self.lanes = self._lanes(maker)
            except NoLanes as why:
                if maker.asked == "on":
                    raise refuse_lanes(why) from None
                self.without_lanes = str(why)
        self._struct = self._filled()

    def _lanes(self, maker: Maker) -> Lanes:
        """Raises NoLanes."""
        return find_lanes(
            maker,
            self.problem,
            self._model(),
            self.method.name,
            self._wanted(),
            [len(table.times) for table in self.case.tables.values()],
            self.options.reproducible,
        )

    def _wanted(self) -> Wanted:
        """Give what is wanted along each step."""
        flowing = any(one.kind in FLOWING for one in self.scalars)
        names = {number: name for name, number in ARRAYS.items()}
        places = [self._of(one) if one.kind in FLOWING else (-1, 0) for one in self.scalars if flowing]
        return tuple((names.get(array, ""), index) for array, index in places)

    def _items(self, asked: str, make: MakeItems) -> Items:
        """Give the model on a device. Raises SimulationError."""
        try:
            check_asked([len(table.times) for table in self.case.tables.values()], self.options.reproducible)
            text = make(self._wanted(), stepped_by(self.method.name))
            return Items(find_device(asked), text, turns(self.method.name, self._model()))
        except NoLanes as why:
            raise refuse_device(why) from None

    @property
    def build(self) -> str:
        """What makes the members, in words."""
        if self.items is not None:
            return self.items.build
        if self.lanes is not None:
            return f"compiled C, {self.lanes.build}"
        return "compiled C" + (", reproducible" if self.options.reproducible else "")

    # ---- what all members share

    def _grid(self) -> Array:
        """Give the times at which rows are formed: those of series, those by which exponents are told, or where errors are looked at,
        as rows cost nothing in runs that look between steps."""
        grid = self.case.grid
        if self.grown:
            if not self.case.stop > grid[0]:
                raise SimulationError("an exponent is a mean over time, and the motions last no time")
            if not self.series:
                return times_of(float(grid[0]), self.case.stop)
            if grid.size < FEWEST_TIMES:
                raise SimulationError(
                    f"an exponent is told by means over parts of the motion, and {grid.size} times are too few for them",
                    help=f"keep no series beside it, or one of {FEWEST_TIMES} times at least ('every')",
                )
        if self.series:
            return grid
        flowing = any(one.kind in FLOWING for one in self.scalars)
        return grid[:: max(1, grid.size // 20)] if flowing else np.empty(0)

    @property
    def rows(self) -> list[Kept]:
        """What is read at all times of the grid: series, and the growth that exponents are told by."""
        return [*self.series, *([Kept("", SERIES, GROWTH)] if self.grown else [])]

    def _case(self) -> Case:
        """Make the first member ready that can be: the times are those of all."""
        trouble: SimulationError | None = None
        for k in range(min(TRIED, self.members.count)):
            row = self.members.values(k, k + 1)[0]
            values = {**self.options.values, **dict(zip(self.members.names, row.tolist(), strict=True))}
            try:
                return prepare(self.problem, self.functions, replace(self.options, values=values))
            except SimulationError as error:
                trouble = trouble or error
        assert trouble is not None
        raise trouble

    def _places(self, names: Sequence[str]) -> list[PlaceStruct]:
        settings = [find_setting(self.problem, name) for name in names]
        return [PlaceStruct(ARRAYS[s.array], s.index, 0) for s in settings]

    def _array(self, values: Any, kind: Any = np.float64) -> int:
        array = np.ascontiguousarray(values, dtype=kind)
        self._alive.append(array)
        return int(array.ctypes.data)

    def _structs(self, structs: Sequence[ctypes.Structure], kind: type[ctypes.Structure]) -> int:
        array = (kind * max(1, len(structs)))(*structs)
        self._alive.append(array)
        return ctypes.addressof(array)

    def _filled(self) -> EnsembleStruct:
        problem, case = self.problem, self.case
        varied = self._places(self.members.names)
        given = {n: v for n, v in self.options.values.items() if n not in self.members.names}
        fixed = dict(zip(given, self._places(list(given)), strict=True))
        p, p_set = np.full(case.p.size, np.nan), np.zeros(len(problem.parameters), dtype=np.uint8)
        y, y_given = np.zeros(problem.ny), np.zeros(problem.ny, dtype=np.uint8)
        for name, place in fixed.items():
            if place.array == ARRAYS["p"]:
                p[place.index], p_set[place.index] = given[name], 1
            elif place.array == ARRAYS["y"]:
                y[place.index], y_given[place.index] = given[name], 1
        numbers, settings, function = self._experiment([*varied, *fixed.values()])
        sizes, beside = kernel_sizes(problem)
        options = self._options()
        self._alive += [sizes, beside, options]
        bounds = [_bounds(quantities) for quantities in (problem.parameters, problem.states)]
        return EnsembleStruct(
            model=ctypes.addressof(self._model()),
            sizes=ctypes.addressof(sizes),
            options=ctypes.addressof(options),
            begin=float(case.grid[0]),
            stop=case.stop,
            max_steps=self.options.max_steps or 0,
            p=self._array(p),
            y=self._array(y),
            p_set=self._array(p_set, np.uint8),
            y_given=self._array(y_given, np.uint8),
            experiment=function,
            n_numbers=len(numbers),
            n_settings=len(settings),
            numbers=self._array(numbers),
            settings=self._structs(settings, PlaceStruct),
            p_low=self._array(bounds[0][0]),
            p_high=self._array(bounds[0][1]),
            y_low=self._array(bounds[1][0]),
            y_high=self._array(bounds[1][1]),
            n_varied=len(varied),
            varied=self._structs(varied, PlaceStruct),
            companion=self._companion(),
            n_kept=len(self.scalars),
            n_series=len(self.rows),
            kept=self._structs([self._kept(one) for one in self.scalars], KeptStruct),
            series=self._structs([PlaceStruct(*self._of(one), 0) for one in self.rows], PlaceStruct),
            lanes=None if self.lanes is None else ctypes.addressof(self.lanes.struct),
            turns=self.lanes is not None and self.lanes.turns,
        )

    def _model(self) -> contract.ModelStruct:
        return self.functions.struct

    def _experiment(self, fixed: Sequence[PlaceStruct]) -> tuple[list[float], list[PlaceStruct], int | None]:
        """Give the numbers of the experiment that all members must share, its settings, and its function."""
        experiment = find_experiment(self.problem, self.options.experiment)
        if experiment is None:
            return [], [], None
        case = self.case
        taken = {(place.array, place.index) for place in fixed}
        settings = [PlaceStruct(ARRAYS[s.array], s.index, s.guess) for s in experiment.settings]
        for place in settings:
            if (place.array, place.index) in taken:
                place.array = -1
        z, y = initial_state(self.problem, self.functions, 0.0, case.p, case.tables)
        u = input_values(self.functions, case.tables, 0.0, case.p, len(self.problem.inputs))
        values = self.functions.experiments[experiment.function](0.0, y, u, z, case.p)
        numbers = [
            math.nan if name in NUMBERS and getattr(self.options, name) is not None else float(value)
            for name, value in zip(experiment.options, values, strict=False)
        ]
        function = getattr(self.functions.library, experiment.function)
        return numbers, settings, ctypes.cast(function, ctypes.c_void_p).value

    def _options(self) -> native.OptionsStruct:
        case = self.case
        tables, data = table_structs(case.tables)
        kinks = self._stops()
        self._alive += [tables, data]
        index = native.load_kernel(self.options.reproducible).mech_method_index(self.method.name.encode())
        return native.OptionsStruct(
            method=index,
            n_tables=len(case.tables),
            n_stops=kinks.size,
            n_grid=self.grid.size,
            t0=case.begin,
            dt_max=self._longest_step(),
            dt=case.step or 0.0,
            apart=case.apart,
            rtol=case.tolerance,
            tables=ctypes.addressof(tables),
            stops=self._array(kinks),
            grid=self._array(self.grid),
        )

    @cached_property
    def bound(self) -> float | None:
        """The longest step that shows members what is narrow in time, None where nothing is: nobody looks for it between their steps."""
        if (
            self.method.fixed_step
            or not self.case.apart > 0
            or not (self.problem.pulsed or self._moves_kinks())
        ):
            return None
        return PLACES_IN_A_STEP * self.case.apart

    def _moves_kinks(self) -> bool:
        """Whether steps would end at other times for the last member than for the first one."""
        if not self.problem.timed_points or not self.members.names:
            return False
        row = self.members.values(self.members.count - 1, self.members.count)[0]
        values = {**self.options.values, **dict(zip(self.members.names, row.tolist(), strict=True))}
        with suppress(SimulationError):
            return kink_times(self.case) != kink_times(
                prepare(self.problem, self.functions, replace(self.options, values=values))
            )
        return True

    def _longest_step(self) -> float:
        longest = self.case.max_step if self.case.max_step > 0 else 1.0
        return longest if self.bound is None else min(longest, self.bound)

    def _stops(self) -> Array:
        """Give the times that steps end at: where tables have kinks, and where what is kept begins."""
        begin, kept = self.case.begin, float(self.case.grid[0])
        return np.array(sorted({*kink_times(self.case), *([kept] if kept > begin else ())}), dtype=float)

    def _companion(self) -> CompanionStruct:
        case = self.case
        dt_max = self._longest_step() / (2 if case.max_step > 0 else 1)
        if self.method.fixed_step:
            assert case.step is not None
            parts = APART if self.problem.bent else HALVES
            step, factor = companion_step(case.step, self.method.order, parts)
            return CompanionStruct(case.tolerance, step, dt_max, factor, case.tolerance, factor, 0)
        tolerance, factor = companion_tolerance(case.tolerance)
        loose, loose_factor = looser_companion(case.tolerance)
        return CompanionStruct(tolerance, 0.0, dt_max, factor, loose, loose_factor, FEW_STEPS)

    def _of(self, one: Kept) -> tuple[int, int]:
        for array, quantities in (("outputs", self.problem.outputs), ("y", self.problem.states)):
            for index, quantity in enumerate(quantities):
                if quantity.name == one.quantity:
                    return ARRAYS[array], index
        raise AssertionError(f"check_kept let '{one.quantity}' pass")

    def _kept(self, one: Kept) -> KeptStruct:
        if one.kind in GROWN:
            return KeptStruct(REDUCTIONS.index("final"), *self._of(Kept("", SERIES, GROWTH)), -1, -1)
        kind = REDUCTIONS.index(one.kind)
        if one.kind != "events":
            return KeptStruct(kind, *self._of(one), -1, -1)
        hybrid = self.problem.hybrid
        rows = [hybrid.row(k).name for k in range(hybrid.n_rows)] if hybrid and one.row else []
        event = native.EVENT_KINDS.index(one.event) if one.event else -1
        return KeptStruct(kind, ARRAYS["y"], 0, event, rows.index(one.row) if one.row else -1)

    # ---- members

    def empty(self, n: int) -> Batch:
        rows = len(self.rows)
        return Batch.empty(n, len(self.scalars), rows, self.grid.size if rows else 0, self.problem.ny)

    def finished(self, batch: Batch) -> Batch:
        """Give what members gave with exponents, and their errors, in place of the growth that they are told by."""
        if not self.grown:
            return batch
        growth = batch.series[:, -1]
        # of those that did not reach their end
        growth[~np.isfinite(batch.kept[:, self.grown[0][0]])] = np.nan
        for k, kind in self.grown:
            if kind == EXPONENT:
                batch.kept[:, k], batch.errors[:, k] = estimated(self.grid, growth.T)
            else:
                batch.kept[:, k], batch.errors[:, k] = megno(self.grid, growth.T), np.nan
        return replace(batch, series=batch.series[:, :-1, : self.grid.size if self.series else 0])

    def run(
        self, values: Array, estimated: NDArray[np.uint8], into: Batch, threads: int, done: Any, stopped: Any
    ) -> None:
        """Run the members of a batch that wait. ``values`` [n, varied]; ``done`` counts them, ``stopped`` ends it soon."""
        values, estimated = np.ascontiguousarray(values), np.ascontiguousarray(estimated, dtype=np.uint8)
        if self.items is not None and self.case.stop > self.case.begin:
            self._run_on_device(self.items, values, estimated, into, threads, done, stopped)
            return
        struct = self._of_batch(values, estimated, into, threads, done, stopped)
        if load_ensemble(self.options.reproducible).mech_ensemble_run(ctypes.byref(struct)):
            raise MemoryError("the kernel could not allocate room for the members of an ensemble")

    def _run_on_device(
        self,
        items: Items,
        values: Array,
        estimated: NDArray[np.uint8],
        into: Batch,
        threads: int,
        done: Any,
        stopped: Any,
    ) -> None:
        """Run members in as many pieces as the device has room for."""
        problem, grid = self.problem, self.grid.tolist()
        given = np.zeros(len(problem.inputs), dtype=np.uint8)
        given[list(self.case.tables)] = 1
        flowing = any(one.kind in FLOWING for one in self.scalars)
        kinds = [REDUCTIONS.index(one.kind) for one in self.scalars] if flowing else []
        size = items.abreast(self._struct, len(grid) * problem.ny)
        for first in range(0, len(values), size):
            part = slice(first, first + size)
            piece = Batch(*(getattr(into, name)[part] for name in Batch.__struct_fields__))
            struct = self._of_batch(values[part], estimated[part], piece, threads, done, stopped)
            items.run(struct, grid, self._stops().tolist(), kinds, given, problem.ny, done, stopped)

    def _of_batch(
        self, values: Array, estimated: NDArray[np.uint8], into: Batch, threads: int, done: Any, stopped: Any
    ) -> EnsembleStruct:
        struct = EnsembleStruct.from_buffer_copy(self._struct)
        struct.n, struct.values, struct.estimated = len(values), values.ctypes.data, estimated.ctypes.data
        struct.kept_values, struct.kept_errors = into.kept.ctypes.data, into.errors.ctypes.data
        struct.series_values, struct.ends = into.series.ctypes.data, into.ends.ctypes.data
        struct.members, struct.threads = into.members.ctypes.data, threads
        struct.done, struct.stopped = ctypes.pointer(done), ctypes.pointer(stopped)
        return struct


def _check_types(problem: Problem, members: Members) -> None:
    """Raises SimulationError for members with a fraction where a whole number belongs."""
    columns = {axis.name: axis.values for axis in members.axes}
    if members.cloud is not None:
        columns |= dict(zip(members.cloud.names, members.cloud.rows.T, strict=True))
    for quantity in problem.parameters:
        if quantity.type != "real" and quantity.name in columns:
            check_type(quantity, *columns[quantity.name].tolist())


def _bounds(quantities: Sequence[Quantity]) -> tuple[list[float], list[float]]:
    low = [-math.inf if q.minimum is None else q.minimum for q in quantities]
    return low, [math.inf if q.maximum is None else q.maximum for q in quantities]
