"""The action of a path: the integral of L dt, of p dq, and the action variable of an oscillation."""

from __future__ import annotations

import numpy as np
from msgspec.structs import replace
from scipy.integrate import simpson

from ...case import Case, find_experiment, inputs_at
from ...outcome import ENDED, SimulationError
from ...problem import Array, Problem
from ...results.energy_accounts import EnergyAccounts
from ..findings import Curve, Findings, Panel, Value
from ..formulas.combination import stop_of, tracked
from ..runs.companion import closer
from ..runs.simulate import plan_run
from ..study import Study
from .symmetries import case_of

SAMPLES = 4000
"""Of a path; half of them give the error of the integrals."""


class Action(Study, frozen=True, kw_only=True):
    """S, the integral of L dt along the motion; W, that of p dq (Hamilton's characteristic function, W = S + E t); for one
    coordinate that swings, the action variable I = W/(2 pi) of whole swings."""

    needs = frozenset({"phase"})

    def solve(self, problem: Problem) -> Findings:
        """Integrate along the run. Raises SimulationError where nothing says when to stop."""
        if not stop_of(find_experiment(problem, self.experiment), self):
            raise SimulationError(
                f"'{problem.name}' does not say when to stop",
                help="the action is that of a path in time: --stop '10 s'",
            )
        case = case_of(problem, self)
        track = tracked(case, self)
        assert track is not None, "there is a stop"
        solution = track.solution
        begin, end = float(solution.time[0]), float(solution.time[-1])
        times = np.linspace(begin, end, 2 * (SAMPLES // 2) + 1)
        good = solution.outcome in ENDED
        lagrangian, flow = _along(case, solution, times)
        values = _values(case, solution, times, lagrangian, flow) if good else []
        if good:
            settings, _ = closer(plan_run(problem, self))
            other = replace(self, stop=end, progress=None, **settings)
            beside = tracked(case_of(problem, other), other)
            assert beside is not None, "there is a stop"
            if beside.solution.outcome in ENDED and float(beside.solution.time[-1]) == end:
                along = _along(case, beside.solution, times)
                found = _values(case, beside.solution, times, *along)
                looser = settings.get("tolerance", 0.0) > case.tolerance
                values = _differing(found, values) if looser else _differing(values, found)
            else:
                values = [replace(value, error=None) for value in values]
        running = np.concatenate([[0.0], np.cumsum(np.diff(times) * (lagrangian[1:] + lagrangian[:-1]) / 2)])
        whole = np.concatenate([[0.0], np.cumsum(np.diff(times) * (flow[1:] + flow[:-1]) / 2)])
        return Findings(
            study="action",
            model=problem.name,
            outcome=solution.outcome,
            message=solution.message,
            values=tuple(values),
            errors_from="the same at a looser tolerance, or with twice the step, and Simpson's rule with half of the points",
            remarks=_beside_lagrangian(solution.energy),
            panels=(
                Panel(
                    "action along the path",
                    "time",
                    problem.time.unit,
                    "S, W",
                    "J.s" if problem.time.unit else "",
                    (Curve("S", times, running), Curve("W", times, whole)),
                ),
            ),
            runs=(solution,),
        )


def _beside_lagrangian(energy: EnergyAccounts | None) -> tuple[str, ...]:
    """Say what acted along the path without being a part of L, as far as the accounts of energy tell."""
    if energy is None:
        return ()
    told = []
    if energy.dissipated:
        told.append(
            f"friction, damping and impacts, which are not part of L, take {energy.dissipated:.4g} {energy.unit}".rstrip()
            + ": this path makes no action stationary"
        )
    if energy.supplied:
        told.append(
            f"{energy.supplied:.4g} {energy.unit}".rstrip()
            + " come from outside: potentials that depend on time are in L, forces are not"
        )
    return tuple(told)


def _values(case: Case, solution: object, times: Array, lagrangian: Array, flow: Array) -> list[Value]:
    """Return what a run gives, with the errors of the integrals."""
    problem = case.problem
    unit = "J.s" if problem.time.unit else ""
    values = [_integral("S", unit, times, lagrangian), _integral("W", unit, times, flow)]
    return values + (
        _swings(case, solution, times, unit) if problem.nv == 1 and not problem.rotations else []
    )


def _differing(loose: list[Value], tight: list[Value]) -> list[Value]:
    """Return the values of the tighter run, with their differences from the other in the errors."""
    before = {value.name: value.value for value in loose}
    return [
        replace(
            one, error=(one.error or 0.0) + abs(one.value - before[one.name]) if one.name in before else None
        )
        for one in tight
    ]


def _along(case: Case, solution: object, times: Array) -> tuple[Array, Array]:
    """Return L and p q' at times [n]."""
    problem, functions = case.problem, case.functions
    columns = solution(times)  # type: ignore[operator]
    y = np.array([columns[state.name] for state in problem.states]).T
    momenta = [k for k, q in enumerate(problem.phase) if q.kind == "momentum"]
    energy = next(k for k, q in enumerate(problem.phase) if q.kind == "energy")
    assert functions.phase is not None, "the part phase"
    found = np.array(
        [
            functions.phase(float(t), state, inputs_at(case, float(t)), case.z, case.p)
            for t, state in zip(times, y, strict=True)
        ]
    )
    nq, nv = problem.nq, problem.nv
    flow: Array = (found[:, momenta] * y[:, nq : nq + nv]).sum(axis=1)
    return flow - found[:, energy], flow


def _integral(name: str, unit: str, times: Array, values: Array) -> Value:
    fine, coarse = float(simpson(values, x=times)), float(simpson(values[::2], x=times[::2]))
    return Value(name, unit, fine, abs(fine - coarse) + 1e-15 * abs(fine))


def _swings(case: Case, solution: object, times: Array, unit: str) -> list[Value]:
    """Return I of the whole swings between turning points of one kind, if there are two of them."""
    name = case.problem.states[case.problem.nq].name
    speeds = solution(times)[name]  # type: ignore[operator]
    turns = [k for k in range(len(times) - 1) if speeds[k] > 0 >= speeds[k + 1]]
    if len(turns) < 2:
        return []
    ends = []
    for k in (turns[0], turns[-1]):
        low, high = float(times[k]), float(times[k + 1])
        for _ in range(60):
            middle = 0.5 * (low + high)
            if float(solution(middle)[name]) > 0:  # type: ignore[operator]
                low = middle
            else:
                high = middle
        ends.append(0.5 * (low + high))
    grid = np.linspace(ends[0], ends[1], 2 * (SAMPLES // 2) + 1)
    _, flow = _along(case, solution, grid)
    count = len(turns) - 1
    whole = _integral("I", unit, grid, flow)
    share = 2 * np.pi * count
    period = (ends[1] - ends[0]) / count
    return [
        Value("I", unit, whole.value / share, (whole.error or 0.0) / share),
        Value("period", case.problem.time.unit, period, 1e-15 * period),
    ]
