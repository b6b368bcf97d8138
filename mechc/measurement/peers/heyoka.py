"""Taylor's method of heyoka: it gets the formulas that series are made from, and compiles its own code."""

from __future__ import annotations

import functools
import time
from typing import TYPE_CHECKING, Any

import numpy as np

from ...compiler.graph import Node
from ...compiler.graph import operations as ops
from ...compiler.pipeline import program_with
from ...compiler.program.slots import NoSeries, SlotGraph, rates_of
from ...runtime.outcome import SimulationError
from .exchange import Exchange, ExchangeUnit, Stopped, exchanged
from .shared import LATE, STEPS, Library, found, refuse, times_of

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from ...compiler.program.model import Program
    from ...model import CompiledModel
    from ...runtime.case import Case
    from ...runtime.integrate.solver import SolverOptions
    from ...runtime.integrate.trajectory import Trajectory
    from ...runtime.reference.work_precision import Peer

COMPACT = 100
"""Operations from which on heyoka's usual mode compiles for many seconds."""
MOST_STEPS = 1_000_000
"""Steps after which heyoka is given up."""
MOST_EVENTS = 10_000


class Heyoka:
    """Runs of a model by heyoka; its code is compiled once for each tolerance, which is not a part of a run."""

    def __init__(self, model: CompiledModel, parts: frozenset[str]) -> None:
        self._model = model
        self._parts = parts
        self._exchange = Exchange(model)
        self._made: dict[float, Any] = {}

    @functools.cached_property
    def _program(self) -> Program:
        return program_with(self._model.compilation, self._parts)

    @functools.cached_property
    def _system(self) -> tuple[list[tuple[Any, Any]], bool]:
        """The equations, and whether they are many. Raises SimulationError for what has no series."""
        try:
            return equations(self._program)
        except (NoSeries, AttributeError) as missing:
            raise SimulationError(f"has no series: {missing}") from None

    def integrator(self, case: Case, tolerance: float, unit: ExchangeUnit | None = None) -> Any:
        """Return the integrator of a tolerance, at the start of a case. Raises SimulationError."""
        import heyoka as hy

        refuse(case)
        if tolerance not in self._made:
            system, compact = self._system
            events = []
            if unit is not None and unit.count:
                events = [
                    hy.t_event(n, direction=hy.event_direction.negative)
                    for n in indicators(self._program, unit.places)
                ]
            self._made[tolerance] = hy.taylor_adaptive(
                system, case.y0.copy(), tol=tolerance, compact_mode=compact, t_events=events
            )
        made = self._made[tolerance]
        made.time = case.begin
        made.state[:] = case.y0
        made.pars[:] = np.r_[case.p, case.z, np.zeros(len(made.pars))][: len(made.pars)]
        return made

    def __call__(self, case: Case, options: SolverOptions) -> Trajectory:
        import heyoka as hy

        unit = self._exchange.unit(case, options, multi_step=False) if exchanged(case) else None
        made = self.integrator(case, options.tolerance, unit)
        times, rows = times_of(case), np.empty((0, case.y0.size))
        steps, n_events, end = 0, 0, ""
        after_steps: dict[str, Any] = {}
        if unit is not None:
            made.state[:] = unit.y
            if case.problem.constraints:
                after_steps = {"callback": functools.partial(_project, unit)}
        begun = time.thread_time()
        while made.time < case.stop and not end and not (unit is not None and unit.ended):
            until = case.stop if unit is None else unit.next
            if unit is not None:
                _put_modes(made, case, unit)
            room = {"max_steps": MOST_STEPS - steps} | after_steps
            if case.grid.size > 1:
                here = times[len(rows) : np.searchsorted(times, until, side="right")]
                asked = np.r_[made.time, here, [until] * int(not here.size or here[-1] < until)]
                outcome, _, _, taken_steps, _, new = made.propagate_grid(asked, **room)
                rows = np.vstack([rows, new[1 : 1 + here.size]])
            else:
                outcome, _, _, taken_steps = made.propagate_until(until, **room)[:4]
            steps += taken_steps
            if outcome == hy.taylor_outcome.step_limit:
                end = STEPS
            elif time.thread_time() - begun > options.seconds:
                end = LATE
            elif outcome != hy.taylor_outcome.time_limit and not _stopped_at_event(outcome, made):
                end = str(outcome)
            elif unit is not None and made.time < case.stop:
                try:
                    made.state[:] = unit.happen(made.time, made.state)
                except Stopped as stopped:
                    end = str(stopped)
                made.reset_cooldowns()
                n_events += 1
                if n_events > MOST_EVENTS:
                    end = f"more than {MOST_EVENTS} events"
        if case.grid.size <= 1:
            rows = np.array(made.state)[None, :]
        taken = time.thread_time() - begun
        return found(case, options, rows, steps, steps, taken, end, made.time)


def _project(unit: ExchangeUnit, made: Any) -> bool:
    """Move the state of an integrator onto the constraints, and let it go on."""
    made.state[:] = unit.project(made.time, made.state)
    return True


def _stopped_at_event(outcome: Any, made: Any) -> bool:
    """Return whether a terminal event ended a propagation: event k gives -k - 1."""
    return bool(made.with_events and -len(made.t_events) <= int(outcome) < 0)


def _put_modes(made: Any, case: Case, unit: ExchangeUnit) -> None:
    """Give the integrator the discrete variables, and signs and amounts of indicators, behind the parameters."""
    if not unit.count:
        return
    np_, values = case.p.size, np.concatenate(unit.modes())
    made.pars[np_:] = values[: len(made.pars) - np_]


def equations(program: Program) -> tuple[list[tuple[Any, Any]], bool]:
    """Return the rates of a program as heyoka's expressions beside their states, from the formulas that series are made from;
    and whether they are so many that heyoka should compile them in compact mode. Raises NoSeries, and AttributeError for a
    function that heyoka has not."""
    rhs = program.function("rhs")
    assert rhs is not None
    form, rates = rates_of(rhs, program.tables, located=program.switching is not None)
    for n in form.graph.reach(rates):
        if n in form.refusals:
            raise NoSeries(form.refusals[n])
    made = _expressions(form, rates, program, pieces=False)
    return list(zip(_states(program), made, strict=True)), rhs.operations > COMPACT


def indicators(program: Program, places: Sequence[int]) -> list[Any]:
    """Return the event indicators at these places as expressions, each times its sign and with what is added to it. Raises
    SimulationError."""
    import heyoka as hy

    function = program.function("indicators")
    assert function is not None
    form = SlotGraph(program.tables, located=True)
    results = form.read(function)
    try:
        made = _expressions(form, [results[k] for k in places], program, pieces=True)
    except AttributeError as missing:
        raise SimulationError(f"cannot write the events: {missing}") from None
    behind = program.size("p") + program.size("z")
    return [hy.par[behind + i] * n + hy.par[behind + len(places) + i] for i, n in enumerate(made)]


def _states(program: Program) -> list[Any]:
    import heyoka as hy

    return [hy.make_vars(f"y{i}") for i in range(len(program.states))]


def _expressions(form: SlotGraph, nodes: Sequence[Node], program: Program, *, pieces: bool) -> list[Any]:
    """Return nodes as heyoka's expressions; ``pieces``: with choices and absolute values, which only events may hold."""
    import heyoka as hy

    graph = form.graph
    made: dict[int, Any] = {}
    states = _states(program)
    places = {n: key for key, n in form.symbols.items()}
    first = {"p": 0, "z": program.size("p")}
    for n in graph.reach(nodes):
        x = [made[a] for a in graph.args(n)]
        match graph.op(n):
            case ops.CONST:
                made[n] = hy.expression(float(graph.value(n)))
            case ops.SYMBOL:
                array, index = places[n]
                if array == "t":
                    made[n] = hy.time
                else:
                    made[n] = states[index] if array == "y" else hy.par[first[array] + index]
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
            case ops.SELECT:
                made[n] = hy.select(*x)
            case ops.ABS if pieces:
                made[n] = hy.select(hy.lt(x[0], hy.expression(0.0)), -x[0], x[0])
            case code:
                made[n] = getattr(hy, ops.OPERATIONS[code].name)(x[0])
    return [made[n] for n in nodes]


def _runs(model: CompiledModel, parts: frozenset[str]) -> Mapping[str, Peer]:
    return {"heyoka:Taylor": Heyoka(model, parts)}


HEYOKA = Library(
    "heyoka",
    "heyoka",
    f"Taylor series of the equations as mechc forms them, compiled by heyoka for each tolerance; compact mode from {COMPACT} operations on",
    _runs,
    by_unit="its own events, found on the series; it projects onto constraints after each step",
)
