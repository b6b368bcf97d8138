"""Reference solutions in higher precision: the same generated C, the same kernel, numbers of 113 or 64 bits.

Two runs by a tolerance that differs by 1000 tell how many digits can be trusted.
"""

from __future__ import annotations

import ctypes
import functools
import math
import time
from collections.abc import Sequence
from ctypes import POINTER, Structure, byref, c_char_p, c_double, c_int, c_long, c_longlong, c_void_p
from pathlib import Path

import numpy as np
from msgspec import Struct

from ..case import Case
from ..integrate.solver import kink_times, table_structs
from ..native import kernel as native
from ..native.build import BuildError, build_shared
from ..native.contract import Signatures, declare, fields
from ..native.status import Status
from ..problem import Array

PRECISIONS = {
    "__float128": ("-DMECH_REAL=__float128", "-DMECH_QUAD"),
    "long double": ("-DMECH_REAL=long double", "-DMECH_LONG"),
}
"""Flags of each precision, the best first."""
FAST_PRECISION = "long double"
"""Computed by the processor."""

SERIES_PRECISION = "__float128"
"""Beside which Taylor series of 106 bits are formed."""

LADDERS = {
    "taylor": (1e-28, 1e-30),
    "dop853": (1e-16, 1e-19, 1e-22, 1e-25),
    "radau5": (1e-11, 1e-14, 1e-17),
}
"""Tolerances of the runs of each method, as far as time allows; at least two."""
SHORT_LADDERS = {"dop853": (1e-16, 1e-17), "radau5": (1e-11, 1e-13)}
"""The same for numbers of 64 bits, whose rounding ends a longer ladder."""

_ORDERS = {"taylor": 60, "dop853": 8, "radau5": 5}

LARGEST_EPSILON = 1e-18
OTHER_STEPS = 0.7
"""Part of the longest step, or time between two outputs, that the second run by Taylor series may step over: where the same
bounds ruled the steps of both, no difference would tell of rounding."""
SLICE = 100
"""Steps between two looks at the clock."""
JUDGED = 0.25
"""Part of the time for a reference after which its first run is expected to go on as it began."""
MARGIN = 2.0
"""Times the given seconds after which a run is given up."""
_FLAGS = ("-O2", "-std=c11", "-fno-math-errno", "-fPIC", "-fvisibility=hidden")


class ReferenceFailed(Exception):
    """No reference could be had, and why."""


class ReferenceTooLong(ReferenceFailed):
    """A reference took too long, or is going to; other numbers may be faster."""


class _Table(Structure):
    """mech_reference_table"""

    _fields_ = fields("int input, interpolation, n; pointer t, value, slope")


class _Case(Structure):
    """mech_reference_case"""

    _fields_ = fields(
        "int n_tables, n_stops, decimals; double t0, dt_max, rtol; pointer y0, nominal, z, p, stops, tables",
    )


class PrecisionReference(Struct, frozen=True, eq=False):
    """States ``high + low`` at the times ``t``: [n, ny] each. ``doubt`` [n] is the difference of the two best
    runs at each time, the largest over all states of |difference| / (nominal + |value|)."""

    t: Array
    high: Array
    low: Array
    doubt: Array
    nominal: Array
    precision: str
    method: str
    tolerance: float
    seconds: float
    evaluations: int
    cached: bool = False

    def error(self, y: Array) -> Array:
        """Largest error at each time of states y [n, ny], relative to nominal + |value|."""
        scaled = np.abs((y - self.high) - self.low) / (self.nominal + np.abs(self.high))
        worst: Array = np.nanmax(scaled, axis=1) if np.isnan(self.high).any() else scaled.max(axis=1)
        return worst

    def trusted(self, share: float) -> int:
        """Count the leading times up to which the doubt is below ``share``: the horizon of a chaotic motion."""
        beyond = np.flatnonzero(~(self.doubt <= share))
        return int(beyond[0]) if beyond.size else self.t.size


def ladder_of(precision: str, method: str) -> tuple[float, ...]:
    """Return the tolerances of the runs of a reference where time allows; none of what is not a run of the kernel."""
    if precision not in PRECISIONS:
        return ()
    return (LADDERS if precision == "__float128" else SHORT_LADDERS).get(method, ())


def reference_flags(precision: str) -> tuple[str, ...]:
    """Flags with which the kernel and the code of a model are compiled for a reference."""
    return (*_FLAGS, *PRECISIONS[precision])


@functools.cache
def reference_library(precision: str) -> Path:
    """Return the kernel in a precision; its name tells its content. Raises BuildError, CompilerMissing."""
    sources = native.kernel_sources((*native.KERNEL_ROOMS, "reference"))
    return build_shared(sources, reference_flags(precision), name="high-precision")


@functools.cache
def _kernel(precision: str) -> ctypes.CDLL:
    signatures: Signatures = {
        "mech_reference_new": (c_void_p, (c_void_p, c_char_p, POINTER(_Case))),
        "mech_reference_free": (None, (c_void_p,)),
        "mech_reference_advance": (c_int, (c_void_p, c_double, c_long)),
        "mech_reference_epsilon": (c_double, ()),
        "mech_reference_read": (c_longlong, (c_void_p, POINTER(c_double), c_void_p, c_void_p)),
    }
    return declare(ctypes.CDLL(str(reference_library(precision))), signatures)


def best_precision() -> str:
    """The most precise numbers that the C compiler of this machine has. Raises ``ReferenceFailed``."""
    for precision in PRECISIONS:
        if has_precision(precision):
            return precision
    raise ReferenceFailed("the C compiler has no numbers of more than 53 bits")


def has_precision(precision: str) -> bool:
    """Tell whether the C compiler has such numbers: a long double may be no more than a double."""
    try:
        epsilon: float = _kernel(precision).mech_reference_epsilon()
    except BuildError:
        return False
    return epsilon < LARGEST_EPSILON


class _Task(Struct, frozen=True):
    """What the runs of a reference have in common. ``model`` is the address of its ``mech_model``."""

    kernel: ctypes.CDLL
    model: int
    case: Case
    nominal: Array
    times: Array
    method: str
    decimals: bool


class _Watch:
    """CPU time of the runs of a reference, which may take ``seconds`` together."""

    def __init__(self, seconds: float) -> None:
        self.seconds = seconds
        self._begun = self._run_begun = time.process_time()

    def taken(self) -> float:
        return time.process_time() - self._begun

    def begin_run(self) -> None:
        self._run_begun = time.process_time()

    def taken_by_run(self) -> float:
        return time.process_time() - self._run_begun

    def too_long(self, part: float) -> bool:
        """Tell whether the runs have taken, or this one will have, more than they may: ``part`` of it is done."""
        taken, by_run = self.taken(), self.taken_by_run()
        if taken > MARGIN * self.seconds:
            return True
        left = by_run * (1 - part) / part if part > 0 else math.inf
        return by_run > JUDGED * self.seconds and taken + left > 2 * MARGIN * self.seconds


def reference(
    library: Path,
    case: Case,
    nominal: Array,
    times: Array,
    *,
    precision: str,
    method: str,
    seconds: float,
    decimals: bool = False,
    ladder: Sequence[float] | None = None,
) -> PrecisionReference:
    """Solve a case at ``times``; ``library`` is its model, compiled with ``reference_flags``.

    Tightens the tolerance as long as the next run is expected to stay within ``seconds``. ``decimals``: parameters and
    initial values are taken as the model states them where those of the case are their rounding; else exactly as they
    are. ``ladder``: tolerances instead of those of ``LADDERS`` or ``SHORT_LADDERS``. Raises ``ReferenceFailed`` if not
    even two runs could be made: ``ReferenceTooLong`` if for want of time.
    """
    model = ctypes.CDLL(str(library))
    model.mech_model_get.restype = c_void_p
    task = _Task(_kernel(precision), model.mech_model_get(), case, nominal, times, method, decimals)
    watch = _Watch(seconds)
    runs: list[tuple[float, Array, Array, int]] = []
    for tolerance in ladder or ladder_of(precision, method):
        watch.begin_run()
        longest = case.max_step
        if runs and method == "taylor":
            longest = OTHER_STEPS * min(longest, float(np.diff(times, prepend=case.begin).max()))
        runs.append((tolerance, *_run(task, tolerance, longest, watch)))
        expected = watch.taken_by_run() * 1e3 ** (1 / _ORDERS[method])
        if len(runs) >= 2 and watch.taken() + expected > seconds:
            break
    (_, high, low, _), (tolerance, best, rest, evaluations) = runs[-2:]
    doubt = (np.abs((high - best) + (low - rest)) / (nominal + np.abs(best))).max(axis=1)
    return PrecisionReference(
        times, best, rest, doubt, nominal, precision, method, tolerance, watch.taken(), evaluations
    )


def _run(task: _Task, tolerance: float, longest: float, watch: _Watch) -> tuple[Array, Array, int]:
    """One run in steps of at most ``longest``: states at the times as sums of two doubles, and the evaluations."""
    kernel, case, times = task.kernel, task.case, task.times
    handle = _begin(task, tolerance, longest)
    high, low = np.empty((times.size, case.y0.size)), np.empty((times.size, case.y0.size))
    at, evaluations = c_double(case.begin), 0
    try:
        for k, t in enumerate(times):
            status = Status.RUNNING if t > case.begin else Status.REACHED
            while status == Status.RUNNING:
                status = Status(kernel.mech_reference_advance(handle, t, SLICE))
                kernel.mech_reference_read(handle, byref(at), high[k].ctypes.data, low[k].ctypes.data)
                if watch.too_long((at.value - case.begin) / (float(times[-1]) - case.begin)):
                    raise ReferenceTooLong(f"a run at {tolerance:g} takes too long")
            if status != Status.REACHED:
                raise ReferenceFailed(f"the run at {tolerance:g} failed with status {status.name}")
            evaluations = kernel.mech_reference_read(
                handle, byref(at), high[k].ctypes.data, low[k].ctypes.data
            )
    finally:
        kernel.mech_reference_free(handle)
    return high, low, evaluations


def _begin(task: _Task, tolerance: float, longest: float) -> int:
    """Make a solver, which copies all that it is given; free it by mech_reference_free."""
    case = task.case
    tables, _alive = table_structs(case.tables)
    same = [_Table(t.input, t.interpolation, t.n, t.t, t.value, t.slope) for t in tables]
    own = (_Table * len(same))(*same)
    arrays = {
        "y0": np.ascontiguousarray(case.y0),
        "nominal": np.ascontiguousarray(task.nominal),
        "z": np.ascontiguousarray(case.z),
        "p": np.ascontiguousarray(case.p),
        "stops": np.array(kink_times(case, 0.0), dtype=float),
    }
    c = _Case(
        n_tables=len(case.tables),
        n_stops=arrays["stops"].size,
        decimals=task.decimals,
        t0=case.begin,
        dt_max=longest,
        rtol=tolerance,
        tables=ctypes.addressof(own),
        **{name: array.ctypes.data for name, array in arrays.items()},
    )
    handle: int | None = task.kernel.mech_reference_new(task.model, task.method.encode(), byref(c))
    if not handle:
        raise MemoryError("the kernel could not allocate its solver")
    return handle
