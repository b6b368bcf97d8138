"""Taylor's method of heyoka: it gets the formulas that series are made from, and compiles its own code."""

from __future__ import annotations

import functools
import time
from typing import TYPE_CHECKING, Any

import numpy as np

from ...compiler.graph import operations as ops
from ...compiler.pipeline import program_with
from ...compiler.program.slots import NoSeries, rates_of
from ...runtime.outcome import SimulationError
from .shared import Library, found, times_of

if TYPE_CHECKING:
    from collections.abc import Mapping

    from ...compiler.program.model import Program
    from ...model import CompiledModel
    from ...runtime.case import Case
    from ...runtime.integrate.solver_options import SolverOptions
    from ...runtime.integrate.trajectory import Trajectory
    from ...runtime.reference.work_precision import Peer

COMPACT = 100
"""Operations from which on heyoka's usual mode compiles for many seconds."""
MOST_STEPS = 1_000_000
"""Steps after which heyoka is given up."""


class Heyoka:
    """Runs of a model by heyoka; its code is compiled once for each tolerance, which is no part of a run."""

    def __init__(self, model: CompiledModel, parts: frozenset[str]) -> None:
        self._model = model
        self._parts = parts
        self._made: dict[float, Any] = {}

    @functools.cached_property
    def _system(self) -> tuple[list[tuple[Any, Any]], bool]:
        """The equations, and whether they are many. Raises SimulationError for what has no series."""
        try:
            return equations(program_with(self._model.compilation, self._parts))
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
        times = times_of(case)
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
            end = str(outcome)
        return found(case, options, rows, steps, steps, taken, end)


def equations(program: Program) -> tuple[list[tuple[Any, Any]], bool]:
    """Return the rates of a program as heyoka's expressions beside their states, from the formulas that series are made from;
    and whether they are so many that heyoka should compile them in compact mode. Raises NoSeries, and AttributeError for a
    function that heyoka has not."""
    import heyoka as hy

    rhs = program.function("rhs")
    assert rhs is not None
    form, rates = rates_of(rhs, program.tables, located=program.switching is not None)
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


def _runs(model: CompiledModel, parts: frozenset[str]) -> Mapping[str, Peer]:
    return {"heyoka:Taylor": Heyoka(model, parts)}


HEYOKA = Library(
    "heyoka",
    "heyoka",
    f"Taylor series of the equations as mechc forms them, compiled by heyoka for each tolerance; compact mode from {COMPACT} operations on",
    _runs,
)
