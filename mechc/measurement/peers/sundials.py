"""CVODE of SUNDIALS, as FMPy ships it, called through ctypes: the compiled functions of the model without Python between."""

from __future__ import annotations

import ctypes
import functools
import time
from ctypes import c_double, c_int, c_long, c_void_p
from typing import TYPE_CHECKING

import numpy as np

from .shared import SLICE, Library, found, peer_model, rates, times_of

if TYPE_CHECKING:
    from collections.abc import Mapping

    from ...model import CompiledModel
    from ...runtime.case import Case
    from ...runtime.integrate.solver_options import SolverOptions
    from ...runtime.integrate.trajectory import Trajectory
    from ...runtime.reference.work_precision import Peer

ADAMS, BDF = 1, 2
NORMAL, TOO_MUCH_WORK = 1, -1
"""Constants of cvode.h."""
METHODS = {"Adams": ADAMS, "BDF": BDF}


def _runs(_model: CompiledModel, _parts: frozenset[str]) -> Mapping[str, Peer]:
    return {f"cvode:{name}": functools.partial(_cvode, kind) for name, kind in METHODS.items()}


SUNDIALS = Library(
    "sundials",
    "fmpy",
    "CVODE as FMPy ships it, on compiled functions: Adams with fixed-point iterations, BDF with the Jacobian of the model and dense LU",
    _runs,
)


@functools.cache
def _sundials() -> ctypes.CDLL:
    """CVODE as FMPy ships it: one library holds all that is called here."""
    from fmpy.sundials.libraries import sundials_cvode

    library: ctypes.CDLL = sundials_cvode

    vector = library.N_VMake_Serial
    vector.restype, vector.argtypes = c_void_p, (c_long, c_void_p, c_void_p)
    for name, arguments in {
        "CVodeCreate": (c_int, c_void_p),
        "SUNDenseMatrix": (c_long, c_long, c_void_p),
        "SUNLinSol_Dense": (c_void_p, c_void_p, c_void_p),
        "SUNNonlinSol_FixedPoint": (c_void_p, c_int, c_void_p),
    }.items():
        function = getattr(library, name)
        function.restype, function.argtypes = c_void_p, arguments
    library.CVode.argtypes = (c_void_p, c_double, c_void_p, c_void_p, c_int)
    library.CVodeInit.argtypes = (c_void_p, c_void_p, c_double, c_void_p)
    library.CVodeSVtolerances.argtypes = (c_void_p, c_double, c_void_p)
    library.CVodeSetStopTime.argtypes = library.CVodeSetMaxStep.argtypes = (c_void_p, c_double)
    library.CVodeSetMaxNumSteps.argtypes = (c_void_p, c_long)
    for name in ("CVodeSetUserData", "CVodeSetNonlinearSolver", "CVodeSetJacFn", "CVodeGetNumSteps"):
        getattr(library, name).argtypes = (c_void_p, c_void_p)
    library.CVodeSetLinearSolver.argtypes = (c_void_p,) * 3
    library.SUNContext_Create.argtypes = (c_int, c_void_p)
    for name in (
        "CVodeFree",
        "N_VDestroy",
        "SUNMatDestroy",
        "SUNLinSolFree",
        "SUNNonlinSolFree",
        "SUNContext_Free",
    ):
        getattr(library, name).argtypes = (c_void_p,)
    library.SUNContext_ClearErrHandlers.argtypes = (c_void_p,)
    return library


def _cvode(kind: int, case: Case, options: SolverOptions) -> Trajectory:
    """Run CVODE: Adams with fixed-point iterations, BDF with the Jacobian of the model and dense LU."""
    lib, own = _sundials(), rates()
    model, _alive = peer_model(case, options.nominal)
    address = ctypes.cast(lib.N_VGetArrayPointer, c_void_p).value
    model.entries, model.columns = address, ctypes.cast(lib.SUNDenseMatrix_Data, c_void_p).value
    y, atol, ny = case.y0.copy(), np.ascontiguousarray(options.atol), case.y0.size
    times = times_of(case)
    rows = np.empty((times.size, ny))
    reached, steps, end, count = c_double(), c_long(), "", 0
    context = c_void_p()
    lib.SUNContext_Create(0, ctypes.byref(context))
    lib.SUNContext_ClearErrHandlers(context)  # what it gives up is told by its return values
    state, tolerances = (lib.N_VMake_Serial(ny, a.ctypes.data, context) for a in (y, atol))
    memory = c_void_p(lib.CVodeCreate(kind, context))
    _done(lib.CVodeInit(memory, ctypes.cast(own.peer_cvode_rates, c_void_p), case.begin, state))
    _done(lib.CVodeSVtolerances(memory, options.tolerance, tolerances))
    _done(lib.CVodeSetUserData(memory, ctypes.addressof(model)))
    _done(lib.CVodeSetStopTime(memory, case.stop))
    _done(lib.CVodeSetMaxStep(memory, case.max_step))
    _done(lib.CVodeSetMaxNumSteps(memory, SLICE))
    matrix = solver = None
    if kind == ADAMS:
        solver = lib.SUNNonlinSol_FixedPoint(state, 0, context)
        _done(lib.CVodeSetNonlinearSolver(memory, solver))
    else:
        matrix = lib.SUNDenseMatrix(ny, ny, context)
        solver = lib.SUNLinSol_Dense(state, matrix, context)
        _done(lib.CVodeSetLinearSolver(memory, solver, matrix))
        if model.jacobian:
            _done(lib.CVodeSetJacFn(memory, ctypes.cast(own.peer_cvode_jacobian, c_void_p)))
    begun = time.thread_time()
    for k, t in enumerate(times.tolist()):
        status = TOO_MUCH_WORK
        while status == TOO_MUCH_WORK and not end:
            status = lib.CVode(memory, t, state, ctypes.byref(reached), NORMAL)
            end = "late" if status == TOO_MUCH_WORK and time.thread_time() - begun > options.seconds else ""
        if end or status < 0:
            end = end or f"CVode returned {status}"
            break
        rows[k] = y
        count = k + 1
    taken = time.thread_time() - begun
    lib.CVodeGetNumSteps(memory, ctypes.byref(steps))
    lib.CVodeFree(ctypes.byref(memory))
    (lib.SUNNonlinSolFree if kind == ADAMS else lib.SUNLinSolFree)(solver)
    if matrix is not None:
        lib.SUNMatDestroy(matrix)
    for vector in (state, tolerances):
        lib.N_VDestroy(vector)
    lib.SUNContext_Free(ctypes.byref(context))
    return found(case, options, rows[:count], steps.value, model.evaluations, taken, end)


def _done(status: int) -> None:
    assert status == 0, f"CVODE returned {status}"
