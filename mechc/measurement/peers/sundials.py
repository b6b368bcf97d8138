"""CVODE of SUNDIALS, as FMPy ships it, called through ctypes: the compiled functions of the model without Python between."""

from __future__ import annotations

import ctypes
import functools
import time
from ctypes import c_double, c_int, c_long, c_void_p
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from ...runtime.native.contract import Signatures, declare
from .exchange import RUNNING, CvodeStruct, Exchange, ExchangeUnit, Stopped, exchanged
from .shared import LATE, SLICE, Library, found, peer_model, rates, times_of

if TYPE_CHECKING:
    from collections.abc import Mapping

    from ...model import CompiledModel
    from ...runtime.case import Case
    from ...runtime.integrate.solver import SolverOptions
    from ...runtime.integrate.trajectory import Trajectory
    from ...runtime.problem import Array
    from ...runtime.reference.work_precision import Peer

ADAMS, BDF = 1, 2
NORMAL, TOO_MUCH_WORK = 1, -1
"""Constants of cvode.h."""
WORDS = {
    -3: "the error test fails again and again, or with the smallest step",
    -4: "the corrector does not converge, or not with the smallest step",
}
"""What it returns where it gives up (CV_ERR_FAILURE, CV_CONV_FAILURE)."""
METHODS = {"Adams": ADAMS, "BDF": BDF}


MOST_EVENTS = 100_000


def _runs(model: CompiledModel, _parts: frozenset[str]) -> Mapping[str, Peer]:
    exchange = Exchange(model)
    return {f"cvode:{name}": functools.partial(_cvode, kind, exchange) for name, kind in METHODS.items()}


SUNDIALS = Library(
    "sundials",
    "fmpy",
    "CVODE as FMPy ships it, on compiled functions: Adams with fixed-point iterations, BDF with the Jacobian of the model and dense LU",
    _runs,
    by_unit="its own root finding; it begins again after an event; BDF projects onto constraints at each step, Adams begins again where a "
    "step has left them",
)


@functools.cache
def _sundials() -> ctypes.CDLL:
    """CVODE as FMPy ships it: one library holds all that is called here."""
    from fmpy.sundials.libraries import sundials_cvode

    p = c_void_p
    signatures: Signatures = {
        "N_VMake_Serial": (p, (c_long, p, p)),
        "CVodeCreate": (p, (c_int, p)),
        "SUNDenseMatrix": (p, (c_long, c_long, p)),
        "SUNLinSol_Dense": (p, (p, p, p)),
        "SUNNonlinSol_FixedPoint": (p, (p, c_int, p)),
        "CVode": (c_int, (p, c_double, p, p, c_int)),
        "CVodeInit": (c_int, (p, p, c_double, p)),
        "CVodeSVtolerances": (c_int, (p, c_double, p)),
        "CVodeRootInit": (c_int, (p, c_int, p)),
        "CVodeSetRootDirection": (c_int, (p, p)),
        "CVodeSetNoInactiveRootWarn": (c_int, (p,)),
        "CVodeSetMaxHnilWarns": (c_int, (p, c_int)),
        "CVodeReInit": (c_int, (p, c_double, p)),
        "CVodeSetStopTime": (c_int, (p, c_double)),
        "CVodeSetMaxStep": (c_int, (p, c_double)),
        "CVodeSetMaxNumSteps": (c_int, (p, c_long)),
        "CVodeSetUserData": (c_int, (p, p)),
        "CVodeSetNonlinearSolver": (c_int, (p, p)),
        "CVodeSetJacFn": (c_int, (p, p)),
        "CVodeSetProjFn": (c_int, (p, p)),
        "CVodeGetNumSteps": (c_int, (p, p)),
        "CVodeSetLinearSolver": (c_int, (p, p, p)),
        "SUNContext_Create": (c_int, (c_int, p)),
        "SUNContext_ClearErrHandlers": (c_int, (p,)),
        **dict.fromkeys(
            (
                "CVodeFree",
                "N_VDestroy",
                "SUNMatDestroy",
                "SUNLinSolFree",
                "SUNNonlinSolFree",
                "SUNContext_Free",
            ),
            (c_int, (p,)),
        ),
    }
    return declare(sundials_cvode, signatures)


def _cvode(kind: int, exchange: Exchange, case: Case, options: SolverOptions) -> Trajectory:
    """Run CVODE: Adams with fixed-point iterations, BDF with the Jacobian of the model and dense LU. Models with events or
    constraints are a unit, whose indicators CVODE looks for roots of; BDF moves each step onto the constraints itself."""
    lib, own = _sundials(), rates()
    unit = exchange.unit(case, options, multi_step=True) if exchanged(case) else None
    address = ctypes.cast(lib.N_VGetArrayPointer, c_void_p).value
    columns = ctypes.cast(lib.SUNDenseMatrix_Data, c_void_p).value
    if unit is None:
        model, _alive = peer_model(case, options.nominal)
        model.entries, model.columns, user = address, columns, ctypes.addressof(model)
        functions, has_jacobian = own.peer_cvode_rates, bool(model.jacobian)
        jacobian, y = own.peer_cvode_jacobian, case.y0.copy()
    else:
        unit.library.peer_unit_serve(unit.address, address, columns)
        user, y = unit.address, unit.y.copy()
        functions, jacobian = unit.library.peer_unit_cvode_rates, unit.library.peer_unit_cvode_jacobian
        has_jacobian = bool(unit.library.peer_unit_has_jacobian(unit.address))
    atol, ny = np.ascontiguousarray(options.atol), y.size
    steps = c_long()
    context = c_void_p()
    lib.SUNContext_Create(0, ctypes.byref(context))
    lib.SUNContext_ClearErrHandlers(context)  # what it gives up is told by its return values
    row = np.empty(ny)
    state, tolerances, between = (lib.N_VMake_Serial(ny, a.ctypes.data, context) for a in (y, atol, row))
    memory = c_void_p(lib.CVodeCreate(kind, context))
    _done(lib.CVodeInit(memory, ctypes.cast(functions, c_void_p), case.begin, state))
    _done(lib.CVodeSVtolerances(memory, options.tolerance, tolerances))
    _done(lib.CVodeSetUserData(memory, user))
    _done(lib.CVodeSetMaxStep(memory, case.max_step))
    _done(lib.CVodeSetMaxNumSteps(memory, SLICE))
    _done(lib.CVodeSetMaxHnilWarns(memory, -1))  # of steps below rounding
    matrix = solver = None
    if kind == ADAMS:
        solver = lib.SUNNonlinSol_FixedPoint(state, 0, context)
        _done(lib.CVodeSetNonlinearSolver(memory, solver))
    else:
        matrix = lib.SUNDenseMatrix(ny, ny, context)
        solver = lib.SUNLinSol_Dense(state, matrix, context)
        _done(lib.CVodeSetLinearSolver(memory, solver, matrix))
        if has_jacobian:
            _done(lib.CVodeSetJacFn(memory, ctypes.cast(jacobian, c_void_p)))
        if unit is not None and case.problem.constraints:
            projection = unit.library.peer_unit_cvode_projection
            _done(lib.CVodeSetProjFn(memory, ctypes.cast(projection, c_void_p)))
    if unit is not None and unit.count:
        indicators = unit.library.peer_unit_cvode_indicators
        _done(lib.CVodeRootInit(memory, unit.count, ctypes.cast(indicators, c_void_p)))
        _done(lib.CVodeSetRootDirection(memory, (c_int * unit.count)(*[-1] * unit.count)))
        _done(lib.CVodeSetNoInactiveRootWarn(memory))
    begun = time.thread_time()
    if unit is None:
        rows, reached, end = _smooth(lib, memory, state, y, case, options, begun)
    else:
        calls = CvodeStruct(
            memory,
            state,
            between,
            *(ctypes.cast(f, c_void_p).value for f in (lib.CVode, lib.CVodeGetDky)),
        )
        rows, reached, end = _by_events(lib, calls, unit, y, case, options, begun)
    taken = time.thread_time() - begun
    lib.CVodeGetNumSteps(memory, ctypes.byref(steps))
    count, evaluations = (steps.value, model.evaluations) if unit is None else (unit.steps, unit.evaluations)
    lib.CVodeFree(ctypes.byref(memory))
    (lib.SUNNonlinSolFree if kind == ADAMS else lib.SUNLinSolFree)(solver)
    if matrix is not None:
        lib.SUNMatDestroy(matrix)
    for vector in (state, tolerances, between):
        lib.N_VDestroy(vector)
    lib.SUNContext_Free(ctypes.byref(context))
    return found(case, options, rows, count, evaluations, taken, end, reached)


Way: TypeAlias = "tuple[Array, float, str]"
"""Rows at ``times_of``, the time that was reached, and how it ended."""


def _smooth(
    lib: ctypes.CDLL, memory: c_void_p, state: int, y: Array, case: Case, options: SolverOptions, begun: float
) -> Way:
    """Run a model without events."""
    times, reached, end, count = times_of(case), c_double(case.begin), "", 0
    rows = np.empty((times.size, y.size))
    _done(lib.CVodeSetStopTime(memory, case.stop))
    for k, t in enumerate(times.tolist()):
        status = TOO_MUCH_WORK
        while status == TOO_MUCH_WORK and not end:
            status = lib.CVode(memory, t, state, ctypes.byref(reached), NORMAL)
            end = LATE if status == TOO_MUCH_WORK and time.thread_time() - begun > options.seconds else ""
        if end or status < 0:
            end = end or WORDS.get(status, f"CVode returned {status}")
            break
        rows[k] = y
        count = k + 1
    return rows[:count], reached.value, end


def _by_events(
    lib: ctypes.CDLL,
    calls: CvodeStruct,
    unit: ExchangeUnit,
    y: Array,
    case: Case,
    options: SolverOptions,
    begun: float,
) -> Way:
    """Run a unit: on to each of its events, where CVODE begins again."""
    times, reached, written = times_of(case), c_double(case.begin), c_long()
    rows = np.empty((times.size, y.size))
    memory, state, end, events = c_void_p(calls.memory), c_void_p(calls.state), "", 0
    while reached.value < case.stop and not unit.ended and not end:
        _done(lib.CVodeSetStopTime(memory, unit.next))
        status = unit.advance(calls, unit.next, reached, SLICE, times, written, rows)
        if status < 0:
            end = WORDS.get(status, f"CVode returned {status}")
        elif time.thread_time() - begun > options.seconds:
            end = LATE
        elif status != RUNNING and reached.value < case.stop:
            try:
                y[:] = unit.happen(reached.value, y)
            except Stopped as stopped:
                end = str(stopped)
            _done(lib.CVodeReInit(memory, reached, state))
            events += 1
            if events > MOST_EVENTS:
                end = f"more than {MOST_EVENTS} events and new beginnings"
    return rows[: written.value], reached.value, end


def _done(status: int) -> None:
    assert status == 0, f"CVODE returned {status}"
