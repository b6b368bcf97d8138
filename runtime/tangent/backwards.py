"""The steps of a run, kept, and the sweep back over them in C (``adjoint.c``)."""

from __future__ import annotations

import ctypes
from ctypes import c_double, c_int, c_ssize_t, c_void_p
from functools import cache
from pathlib import Path

import numpy as np
from msgspec.structs import replace

from ..case import Case
from ..functions import Functions
from ..integrate.kernel_failure import kernel_failure
from ..integrate.solver import Solver
from ..native import contract
from ..native import kernel as native
from ..native.build import build_shared, find_quick_compiler, kernel_flags
from ..native.contract import fields
from ..native.status import Status
from ..outcome import Failure, SimulationError
from ..problem import Array

METHOD = "dop853"
SOURCE = Path(__file__).with_name("adjoint.c")
FIRST, MOST_NUMBERS = 256, 4_000_000
"""Steps of a run before it is looked at; later it is looked at after more, of so many numbers."""

MOST_BYTES = 2e9
"""Of the states at the beginning of all steps."""


class SweepRecord(ctypes.Structure):
    """sweep_record"""

    _fields_ = fields(
        "pointer rhs, inputs, goal, pull_back, pull_back_position, pull_back_velocity; "
        "ssize ny, nu, nz, n_free, n_steps, n_tabled, n_rotations; "
        "pointer rotations, tabled, p, t, h, y, from_tables; double rate; "
        "pointer lambda, gradient, integral",
    )


class BackwardSweep:
    """What a sweep needs of a case whose goal ``functions`` pull back; ``back`` makes it."""

    def __init__(
        self, case: Case, functions: Functions, p: Array, seeds: int, free: int, rate: float
    ) -> None:
        problem, struct = case.problem, functions.struct
        self.library = _library(struct.quick)
        self.tables = [table for _, table in sorted(case.tables.items())]
        self.kept = [np.array(k, dtype=np.intc) for k in (problem.rotations, sorted(case.tables))]
        self.integral = np.zeros(1)
        projects = {
            n: address(functions, n)
            for n in ("pull_back_position", "pull_back_velocity")
            if problem.constraints
        }
        self.record = SweepRecord(
            rhs=getattr(struct, "rhs"),  # noqa: B009, a field of the struct
            inputs=getattr(struct, "inputs"),  # noqa: B009
            goal=address(functions, "goal"),
            pull_back=address(functions, "pull_back"),
            **projects,
            ny=problem.ny,
            nu=len(problem.inputs),
            nz=seeds,
            n_free=free,
            n_tabled=len(self.tables),
            n_rotations=len(problem.rotations),
            rotations=self.kept[0].ctypes.data,
            tabled=self.kept[1].ctypes.data,
            p=p.ctypes.data,
            rate=rate,
            integral=self.integral.ctypes.data,
        )

    def back(self, t: Array, h: Array, y: Array, by_end: Array, gradient: Array) -> int:
        """Go back over steps that begin at t [n], with lengths h [n] and states y [n + 1, ny].

        ``by_end`` [ny]: the derivative of the goal by the last state, which becomes that by the first; to ``gradient`` [free]
        what belongs to parameters and inputs is added, to ``integral`` the goal along the motion. Gives the bytes it kept.
        """
        given = np.empty(0)
        if self.tables:
            nodes = _nodes(self.library.mech_adjoint_stages())
            times = np.minimum(t[:, None] + nodes * h[:, None], np.nextafter(t + h, t)[:, None])
            given = np.stack([table(times.ravel()) for table in self.tables], axis=-1)
        record, self.integral[0] = self.record, 0.0
        record.n_steps = t.size
        arrays = {"t": t, "h": h, "y": y, "from_tables": given, "lambda": by_end, "gradient": gradient}
        for name, array in arrays.items():
            setattr(record, name, array.ctypes.data)
        if not self.library.mech_adjoint_sweep(ctypes.byref(record)):
            raise MemoryError
        return int(t.nbytes + h.nbytes + y.nbytes + given.nbytes)


def steps(case: Case, nominal: Array, tolerance: float) -> tuple[Array, Array, Array]:
    """Run a case; give its steps (beginning, length) [n] and the states [n + 1, ny] at their ends."""
    case = replace(case, grid=np.array([case.stop]), tolerance=tolerance)
    struct = case.functions.struct
    kernel, made, ny = native.kernel_for(struct, method=METHOD), _library(struct.quick), case.y0.size
    times, states = [np.array([case.begin])], [case.y0[None, :]]
    room, size, count, report = FIRST, 0, ctypes.c_ssize_t(), native.ReportStruct()
    calls = [ctypes.cast(f, c_void_p) for f in (kernel.mech_advance, kernel.mech_read)]
    with Solver(kernel, case, METHOD, tolerance, tolerance * nominal) as solver:
        status = Status.RUNNING
        while status is Status.RUNNING:
            t, y = np.empty(room), np.empty((room, ny))
            ends = (
                ctypes.byref(report),
                c_void_p(t.ctypes.data),
                c_void_p(y.ctypes.data),
                ctypes.byref(count),
            )
            status = Status(
                made.mech_adjoint_steps(
                    c_void_p(solver.handle),
                    *calls,
                    c_double(case.stop),
                    c_ssize_t(ny),
                    c_ssize_t(room),
                    *ends,
                )
            )
            solver.count_work()
            times.append(t[: count.value])
            states.append(y[: count.value])
            size += 8 * count.value * (1 + ny)
            room = min(2 * room, max(FIRST, MOST_NUMBERS // ny))
            if size > MOST_BYTES:
                raise SimulationError(
                    f"the states of all steps up to t = {report.t:g} fill {size / 1e9:.2g} GB: the gradient goes back over all "
                    "of them",
                    help="a shorter run, or a looser tolerance",
                )
            if report.stiff_time == report.stiff_time:  # a number
                raise SimulationError(
                    f"the motion is stiff from t = {report.stiff_time:.4g} on, and the gradient goes back over explicit steps",
                    help="derivatives along a stiff motion: sensitivity=[...] of a run with method = radau5",
                )
        if status != Status.REACHED:
            failure: Failure | None = kernel_failure(case.problem, status, report, y[count.value - 1])
            raise SimulationError(
                f"the run ends before its last time: {failure.message if failure else status.name.lower()}"
            )
    t = np.concatenate(times)
    return t[:-1].copy(), np.diff(t), np.concatenate(states)


@cache
def _library(quick: bool) -> ctypes.CDLL:
    sources = {**native.kernel_sources(), SOURCE.name: SOURCE.read_text(encoding="utf-8")}
    headers = {name: text for name, text in sources.items() if name.endswith(".h") or name == SOURCE.name}
    by = find_quick_compiler() if quick else None
    loaded = ctypes.CDLL(str(build_shared(headers, kernel_flags(quick), name="adjoint", compiler=by)))
    loaded.mech_adjoint_sweep.restype = c_int
    return loaded


def _nodes(stages: int) -> Array:
    """Give the places of the stages in a step."""
    from scipy.integrate._ivp import dop853_coefficients

    return np.asarray(dop853_coefficients.C[:stages])


def address(functions: Functions, name: str) -> int:
    found = ctypes.cast(getattr(functions.library, name), c_void_p).value
    assert found is not None
    return found


def call(function: int, t: float, y: Array, u: Array, z: Array, p: Array, size: int) -> Array:
    out = np.empty(size)
    arrays = [np.ascontiguousarray(a) for a in (y, u, z, p, out)]
    contract.MODEL_FUNCTION(function)(t, *(a.ctypes.data for a in arrays))
    return out
