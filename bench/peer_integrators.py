"""Integrators of others beside the kernel, in one process and on the same model: CVODE, LSODA of numbalsoda, heyoka.

CVODE is the one that FMPy brings, called through ctypes; it and numbalsoda call the compiled functions of the model without Python
between. heyoka gets the formulas that series are made from, and compiles its own code. Each is taken where it is installed.
"""

from __future__ import annotations

import ctypes
import functools
import importlib.util
import time
from ctypes import c_double, c_int, c_long, c_void_p
from pathlib import Path
from typing import Any

import numpy as np

import mechc
from mechc.compiler.graph import operations as ops
from mechc.compiler.pipeline import program_with
from mechc.compiler.problem import HEADER, header
from mechc.compiler.program.model import Program
from mechc.compiler.program.slots import NoSeries, rates_of
from mechc.runtime.case import Case
from mechc.runtime.integrate.scipy_compiled import peer_lacks
from mechc.runtime.integrate.solver_options import SolverOptions
from mechc.runtime.integrate.trajectory import Statistics, Trajectory, with_unit_rotations
from mechc.runtime.native.build import build_shared, kernel_flags
from mechc.runtime.outcome import SimulationError, given_up, step_too_small
from mechc.runtime.problem import Array
from mechc.runtime.reference.work_precision import Peer

RATES = Path(__file__).parent / "peers" / "rates.c"
COMPACT = 100
"""Operations from which on heyoka's usual mode compiles for many seconds."""
MOST_STEPS = 1_000_000
"""Steps after which heyoka is given up."""
SLICE = 20_000
"""Steps between two looks at the clock."""
PACKAGES = {"cvode": "fmpy", "numbalsoda": "numbalsoda", "heyoka": "heyoka"}
"""The package that each peer comes with."""

ADAMS, BDF = 1, 2
NORMAL, TOO_MUCH_WORK = 1, -1
"""Constants of cvode.h."""


METHODS = {"Adams": ADAMS, "BDF": BDF}


def absent() -> list[str]:
    """Return the peers that are not installed."""
    return [peer for peer, package in PACKAGES.items() if importlib.util.find_spec(package) is None]


def peers(model: mechc.Model) -> dict[str, Peer]:
    """Return the runs of a model by the peers that are installed, by the names of their methods."""
    made: dict[str, Peer] = {}
    missing = absent()
    if "cvode" not in missing:
        made |= {f"cvode:{name}": functools.partial(_cvode, kind) for name, kind in METHODS.items()}
    if "numbalsoda" not in missing:
        made["numbalsoda:LSODA"] = _lsoda
    if "heyoka" not in missing:
        made["heyoka:Taylor"] = Heyoka(model)
    return made


class PeerModel(ctypes.Structure):
    """peer_model of rates.c"""

    _fields_ = (
        *(
            (name, c_void_p)
            for name in ("rhs", "jacobian", "row", "col", "z", "p", "size", "entries", "columns")
        ),
        *((name, c_void_p) for name in ("state", "values")),
        *((name, c_long) for name in ("ny", "n_jacobian", "evaluations")),
    )


@functools.cache
def _rates() -> ctypes.CDLL:
    sources = {"rates.c": RATES.read_text(encoding="utf-8"), HEADER: header()}
    return ctypes.CDLL(str(build_shared(sources, kernel_flags(), name="peer")))


def _peer_model(case: Case, nominal: Array) -> tuple[PeerModel, list[Array]]:
    """Return a model as rates.c reads it, and the arrays that must stay alive with it. Raises SimulationError."""
    lacks = "has no contacts, friction or other events here" if case.problem.hybrid is not None else ""
    if lacks := lacks or peer_lacks(case.problem, case.functions):
        raise SimulationError(lacks)
    struct = case.functions.struct
    assert struct is not None
    sizes, state, values = np.ascontiguousarray(nominal), np.empty(case.y0.size), np.empty(struct.n_jacobian)
    made = PeerModel(
        rhs=struct.rhs,
        jacobian=struct.jacobian,
        row=ctypes.cast(struct.jac_row, c_void_p),
        col=ctypes.cast(struct.jac_col, c_void_p),
        z=case.z.ctypes.data,
        p=case.p.ctypes.data,
        size=sizes.ctypes.data,
        state=state.ctypes.data,
        values=values.ctypes.data,
        ny=case.y0.size,
        n_jacobian=struct.n_jacobian,
    )
    return made, [sizes, state, values]


def _times(case: Case) -> Array:
    """Return the times behind the start at which the state is wanted: those of the grid, or the end alone."""
    return case.grid[case.grid > case.begin] if case.grid.size > 1 else np.array([case.stop])


def _found(
    case: Case, options: SolverOptions, rows: Array, steps: int, evaluations: int, taken: float, end: str
) -> Trajectory:
    """Return what a peer made of a case: states at ``_times``; ``end``: how it failed, if it did."""
    problem, t = case.problem, _times(case)[: len(rows)]
    if case.grid.size > 1 and case.grid[0] <= case.begin:
        t, rows = np.r_[case.begin, t], np.vstack([case.y0, rows])
    failure = None
    if end == "late":
        failure = given_up(problem, taken, evaluations, case.begin, case.y0)
    elif end:
        failure = step_too_small(problem, 0, case.begin, case.y0)
    return Trajectory(
        t=t,
        y=with_unit_rotations(problem.rotations, rows),
        dense=None,
        statistics=Statistics(options.method, steps, None, evaluations, taken),
        failure=failure,
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
    lib, own = _sundials(), _rates()
    model, _alive = _peer_model(case, options.nominal)
    address = ctypes.cast(lib.N_VGetArrayPointer, c_void_p).value
    model.entries, model.columns = address, ctypes.cast(lib.SUNDenseMatrix_Data, c_void_p).value
    y, atol, ny = case.y0.copy(), np.ascontiguousarray(options.atol), case.y0.size
    times = _times(case)
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
            end = end or "failed"
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
    return _found(case, options, rows[:count], steps.value, model.evaluations, taken, end)


def _done(status: int) -> None:
    assert status == 0, f"CVODE returned {status}"


def _lsoda(case: Case, options: SolverOptions) -> Trajectory:
    """Run LSODA of numbalsoda; it cannot be interrupted, and counts no steps."""
    from numbalsoda import lsoda

    model, _alive = _peer_model(case, options.nominal)
    sizes, times = _alive[0], _times(case)
    data = np.frombuffer(memoryview(model).cast("B"), dtype=np.float64)
    address = ctypes.cast(_rates().peer_lsoda_rates, c_void_p).value
    asked = np.r_[case.begin, times]
    begun = time.thread_time()
    found, success = lsoda(
        address,
        case.y0 / sizes,
        asked,
        data=data,
        rtol=options.tolerance,
        atol=options.tolerance,
        mxstep=SLICE,
    )
    taken = time.thread_time() - begun
    return _found(case, options, found[1:] * sizes, 0, model.evaluations, taken, "" if success else "failed")


class Heyoka:
    """Runs of a model by heyoka; its code is compiled once for each tolerance, which is no part of a run."""

    def __init__(self, model: mechc.Model) -> None:
        self._model = model
        self._made: dict[float, Any] = {}

    @functools.cached_property
    def _system(self) -> tuple[list[tuple[Any, Any]], bool]:
        """The equations, and whether they are many. Raises SimulationError for what has no series."""
        try:
            return equations(program_with(self._model.compilation, {"series"}))
        except (NoSeries, AttributeError) as missing:
            raise SimulationError(f"has no series: {missing}") from None

    def integrator(self, case: Case, tolerance: float) -> Any:
        """Return the integrator of a tolerance, at the start of a case. Raises SimulationError."""
        import heyoka as hy

        if case.problem.hybrid is not None or case.problem.inputs:
            raise SimulationError("is compared on models without events and inputs")
        if tolerance not in self._made:
            system, compact = self._system
            self._made[tolerance] = hy.taylor_adaptive(
                system, case.y0.copy(), tol=tolerance, compact_mode=compact
            )
        made = self._made[tolerance]
        made.time = case.begin
        made.state[:] = case.y0
        made.pars[:] = case.p[: len(made.pars)]
        return made

    def __call__(self, case: Case, options: SolverOptions) -> Trajectory:
        import heyoka as hy

        made = self.integrator(case, options.tolerance)
        times = _times(case)
        begun = time.thread_time()
        if case.grid.size > 1:
            asked = np.r_[case.begin, times]
            outcome, _, _, steps, _, rows = made.propagate_grid(asked, max_steps=MOST_STEPS)
            rows = rows[1:]
        else:
            outcome, _, _, steps = made.propagate_until(case.stop, max_steps=MOST_STEPS)[:4]
            rows = np.array(made.state)[None, :]
        taken, end = time.thread_time() - begun, ""
        if outcome == hy.taylor_outcome.step_limit or taken > options.seconds:
            end = "late"
        elif outcome != hy.taylor_outcome.time_limit:
            end = "failed"
        return _found(case, options, rows, steps, steps, taken, end)


def equations(program: Program) -> tuple[list[tuple[Any, Any]], bool]:
    """Return the rates of a program as heyoka's expressions beside their states, from the formulas that series are made from;
    and whether they are so many that heyoka should compile them in compact mode. Raises NoSeries, and AttributeError for a
    function that heyoka has not."""
    import heyoka as hy

    rhs = program.function("rhs")
    assert rhs is not None
    form, rates = rates_of(rhs)
    graph = form.graph
    made: dict[int, Any] = {}
    states = [hy.make_vars(f"y{i}") for i in range(len(rates))]
    places = {n: key for key, n in form.symbols.items()}
    for n in graph.reach(rates):
        x = [made[a] for a in graph.args(n)]
        match graph.op(n):
            case ops.CONST:
                made[n] = hy.expression(float(graph.value(n)))
            case ops.SYMBOL:
                array, index = places[n]
                made[n] = {"t": hy.time}.get(array) or (states if array == "y" else hy.par)[index]
            case ops.ADD:
                made[n] = x[0] + x[1]
            case ops.SUB:
                made[n] = x[0] - x[1]
            case ops.MUL:
                made[n] = x[0] * x[1]
            case ops.DIV:
                made[n] = x[0] / x[1]
            case ops.NEG:
                made[n] = -x[0]
            case ops.POW:
                made[n] = x[0] ** float(graph.value(graph.args(n)[1]))
            case code:
                made[n] = getattr(hy, ops.OPERATIONS[code].name)(x[0])
    return list(zip(states, [made[n] for n in rates], strict=True)), rhs.operations > COMPACT
