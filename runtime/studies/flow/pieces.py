"""A long motion piece by piece: times between which little happens, and the states at any time of a piece."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import TypeVar

import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from ...case import Case, SimulationOptions, find_experiment, inputs_at
from ...integrate.kernel_failure import kernel_failure
from ...integrate.solver import Solver
from ...integrate.trajectory import DenseOutput
from ...native import contract
from ...native import kernel as native
from ...native.status import Status
from ...outcome import Failure
from ...problem import Array, Problem
from ...results.evaluate import evaluate_rows
from ..runs.simulate import Plan

S = TypeVar("S", bound=SimulationOptions)

FIRST_STEPS, MOST_BYTES = 512, 16_000_000
"""Steps of the first piece; later ones grow up to so much memory."""
WITHIN = (0.0, 1 / 3, 2 / 3)
"""Places in each step at which it is looked at."""


FEW_STATES = 24


class Piece(Struct, frozen=True, eq=False):
    """Some steps of a motion: increasing times ``t`` [n], the states there ``y`` [n, ny], and ``at``, which gives them
    at other times between the first and the last."""

    t: Array
    y: Array
    at: Callable[[Array], Array]


class Ending(Struct):
    """How a motion in pieces ended: by a failure, by ``terminate``, or as somebody pressed Ctrl-C."""

    failure: Failure | None = None
    terminated: str = ""
    interrupted: bool = False
    steps: int = 0


def pieces(
    plan: Plan,
    stop: float,
    ending: Ending,
    interrupted: Callable[[], bool],
    *,
    looked_at: bool = True,
) -> Iterator[Piece]:
    """Yield the motion of a plan up to ``stop``, for models in which nothing switches, by the compiled kernel.

    ``looked_at``: within the steps; else a piece has its first and its last time alone. ``ending`` is filled when the last piece was given. Raises SimulationError where there is no kernel.
    """
    case = plan.case
    kernel = native.kernel_for(case.functions.struct, plan.options.reproducible, plan.method.name)
    with Solver(
        kernel, case, plan.method.name, case.tolerance, case.tolerance * plan.nominal, case.step or 0.0
    ) as solver:
        status, steps = Status.RUNNING, FIRST_STEPS
        most = max(FIRST_STEPS, MOST_BYTES // (8 * (2 + solver.n_dense * solver.ny)))
        while status in (Status.RUNNING, Status.RECORD_FULL) and not interrupted():
            solver.start_record(steps)
            status = solver.advance(stop, steps)
            steps = min(2 * steps, most)
            report, y = solver.report()
            ending.steps = report.steps
            rows = solver.recorded(report.n_record)
            if len(rows):
                dense = DenseOutput(rows, solver.ny)
                yield _looked_at(dense, stop) if looked_at else _whole(dense, stop)
            if status.value < 0:
                ending.failure = kernel_failure(case.problem, status, report, y)
        ending.interrupted = status in (Status.RUNNING, Status.RECORD_FULL) and interrupted()


def _looked_at(dense: DenseOutput, stop: float) -> Piece:
    """Give the steps of some polynomials as a piece."""
    count, c = len(WITHIN), dense.coefficients
    t, y = np.empty(count * len(c) + 1), np.empty((count * len(c) + 1, c.shape[2]))
    t[:-1] = (dense.begin[:, None] + dense.length[:, None] * np.array(WITHIN)).ravel()
    weights = np.array([_weights(c.shape[1], s) for s in WITHIN])
    if c.shape[2] <= FEW_STATES:  # one product of matrices
        whole = np.kron(weights.T, np.eye(c.shape[2]))
        y[:-1] = (c.reshape(len(c), -1) @ whole).reshape(-1, c.shape[2])
    else:
        y[:-1] = np.einsum("fk,nkj->nfj", weights, c).reshape(-1, c.shape[2])
    t[-1] = min(stop, dense.begin[-1] + dense.length[-1])
    y[-1] = dense(t[-1:])[0]
    return Piece(t, y, dense)


def _whole(dense: DenseOutput, stop: float) -> Piece:
    """Give some polynomials as a piece of two times."""
    t = np.array([dense.begin[0], min(stop, dense.begin[-1] + dense.length[-1])])
    return Piece(t, dense(t), dense)


def _weights(count: int, s: float) -> Array:
    """Give the weights of the coefficients of a step's polynomial at a share ``s`` of it."""
    weights = np.empty(count)
    factor = 1.0
    for k in range(count):
        weights[k] = factor
        factor *= 1 - s if k % 2 else s
    return weights


def with_horizon(problem: Problem, options: S, stop: float, tolerance: float | None = None) -> S:
    """Return options that say when to stop, and how exact to be, where neither the caller nor the experiment does."""
    experiment = find_experiment(problem, options.experiment)
    said = experiment.options if experiment else ()
    if options.stop is None and "stop" not in said:
        options = replace(options, stop=stop)
    if tolerance is not None and options.tolerance is None and "tolerance" not in said:
        options = replace(options, tolerance=tolerance)
    return options


def column_at(case: Case, name: str) -> Callable[[Array, Array], Array]:
    """Give a function of times [n] and states [n, ny]: the values [n] of a state or an output."""
    problem = case.problem
    for k, quantity in enumerate(problem.states):
        if quantity.name == name:
            return lambda t, y: y[:, k]
    (index,) = (k for k, quantity in enumerate(problem.outputs) if quantity.name == name)
    return lambda t, y: evaluate_rows(case, "outputs", t, y)[:, index]


def periodic(case: Case, index: int, period: float = 2 * math.pi) -> bool:
    """Whether the motion is the same when the state ``index``, an angle, is larger by a turn: tried at a few states, with what
    switches and what happens then."""
    problem = case.problem
    if index >= problem.nq or problem.states[index].unit not in ("rad", "", "1"):
        return False
    random = np.random.default_rng(1)
    size = np.abs(case.y0) + 1.0
    for _ in range(3):
        y = case.y0 + 0.1 * size * random.standard_normal(case.y0.size)
        turned = y.copy()
        turned[index] += period
        u = inputs_at(case, case.begin)
        here, there = (case.functions.rhs(case.begin, x, u, case.z, case.p) for x in (y, turned))
        pairs = [(here, there)]
        pairs += zip(_of_events(case, y, u), _of_events(case, turned, u, index, period), strict=True)
        for one, other in pairs:
            near = 1e-9 * float(np.abs(one).max(initial=0.0))
            if not np.allclose(one, other, rtol=1e-9, atol=near, equal_nan=True):
                return False
    return True


def _of_events(case: Case, y: Array, u: Array, index: int = 0, further: float = 0.0) -> list[Array]:
    """Give the indicators of events at a state, then the state and the discrete variables after each branch; the state
    ``index`` of these less what it is ``further``."""
    struct, found = case.functions.struct, list[Array]()
    if not struct.hybrid:
        return found
    hybrid = contract.HybridStruct.from_address(struct.hybrid)
    if hybrid.crowd:
        return found
    arrays = [np.ascontiguousarray(a) for a in (y, u, case.z, case.p)]

    def called(function: int | None, out: Array) -> Array:
        if function is not None and out.size:
            contract.MODEL_FUNCTION(function)(case.begin, *(a.ctypes.data for a in arrays), out.ctypes.data)
        return out

    found.append(called(hybrid.indicators, np.zeros(hybrid.n_switches + hybrid.n_rows)))
    for k in range(hybrid.n_branches):
        branch = hybrid.branches[k]
        behind = called(branch.act, np.concatenate([y, case.z, np.zeros(branch.n_checks)]))
        behind[index] -= further
        found.append(behind)
    return found
