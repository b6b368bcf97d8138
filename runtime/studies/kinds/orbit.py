"""Periodic orbits with their Floquet multipliers; over a parameter, with what happens to them on the way."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from typing import Annotated

import numpy as np
from msgspec.structs import replace

from ...integrate.interruption import NotedInterruptions
from ...integrate.kernel_run import run_kernel
from ...integrate.solver import SolverOptions
from ...outcome import ENDED, Outcome, SimulationError, time_text
from ...problem import Array, Problem
from ...results.solution import Solution
from ...settings import Formula, Range, settable
from ..findings import Curve, Findings, Panel, Table, Value, known_digits
from ..flow.following import FollowedPlace, Follower, special_words
from ..flow.linearised import Linearised, compared
from ..flow.liouville import contradicted
from ..flow.pieces import column_at, with_horizon
from ..flow.shooting import CLOSED, OrbitEnergy, Shooter, close, least
from ..flow.shooting import ShootingOrbit as Found
from ..flow.time_dependence import after_initial_events, depends_on_time, scheduled
from ..runs.companion import closer
from ..runs.simulate import Plan, plan_run, run
from ..study import Study

TOLERANCE = 1e-11
HORIZON = 100.0
LOOKS = 20_000
"""Places of a motion at which it is looked whether it has come back."""
NEAR, LEFT = 0.1, 0.3
"""Shares of the extent of the motion: so near has come back, what was so far away before."""
LATE, STILL = 0.1, 1e-6
"""Last share of a run in which the motion has come to rest, where it moves by less than that of its size."""
LONGER = (1.0, 5.0, 25.0)
"""Of the span of the run, in which a return is looked for."""
VALUES = 41
RESTS = 10.0
"""Residuals of an orbit which its state would move through within a period: so little is none."""
SETTLING = 100
"""Periods after which a motion that is driven may have settled."""
MOST_SETTLED = 3
"""Modes of a motion in which an orbit is begun."""
MOST_NAMED, NAUGHT = 4, 1e-12
AT_REST = (
    "a damped motion that nothing drives ends at rest; 'modes' tells how it swings there. Another motion: "
    '--set NAME="...", or --period with a first guess'
)
SAME = 1e-6
"""In which multipliers and points of an orbit are the same."""


class Orbit(Study, frozen=True, kw_only=True):
    """The periodic motion near the start, with its period and multipliers. Of a model that depends on time, the
    ``period`` is given; of another one it is found, and a given one is the first guess."""

    needs = frozenset({"jacobian"})
    of_own_states = True

    period: Annotated[
        float | Formula | None, settable('The period, or a first guess: "2*pi/w".', "interval")
    ] = None
    energy: Annotated[
        float | None,
        settable("The energy, where orbits come in families (default: that of the start).", "energy"),
    ] = None
    over: Annotated[
        tuple[Range, ...],
        settable('Follow the orbit over a parameter: "g = 1 .. 2, 50" gives 50 values.', "ranges"),
    ] = ()

    def solve(self, problem: Problem) -> Findings:
        """Find the orbit. Raises SimulationError where there is none near."""
        options = with_horizon(problem, self, HORIZON, TOLERANCE)
        plan = after_initial_events(plan_run(problem, options))
        linear = Linearised(plan)
        driven = depends_on_time(plan)
        given = given_period(plan, self.period)

        def found(begin: float, y: Array, z: Array, period: float) -> Findings:
            there, at, settings = linear, plan, options
            if begin != plan.case.begin:
                settings = replace(options, begin=begin)
                at = plan_run(problem, settings)
                there = linear.renewed(at)
            start = there.joined(y, z)
            if self.over:
                return _followed(problem, settings, there, start, period, free=not driven)
            return self._alone(at, there, start, period, driven)

        if given is None and driven:
            raise SimulationError(
                f"'{problem.name}' depends on time: its periodic motions have the period of that, or a multiple",
                help='say it: --period "2*pi/w"',
            )
        starts = _after(problem, options, plan, given) if given else _returns(problem, options, plan)
        failure: SimulationError | None = None
        for begin, y, z, period in starts:
            try:
                if failure is not None and kept_energy(plan, linear, linear.joined(y, z), period, None):
                    break  # it settles nowhere
                return found(begin, y, z, period)
            except SimulationError as error:
                failure = error if failure is None or given is None else failure
        assert failure is not None
        raise failure

    def _alone(self, plan: Plan, linear: Linearised, start: Array, period: float, driven: bool) -> Findings:
        """Find the orbit near a start. Raises SimulationError where there is none."""
        problem = plan.case.problem
        energy = kept_energy(plan, linear, start, period, self.energy) if not driven else None
        loose = close(linear, start, period, free=not driven, energy=energy)
        loose = loose if driven else least(linear, loose, energy)
        if not driven:
            refuse_rest(plan, linear, loose)
        beside = after_initial_events(plan_run(problem, replace(plan.options, **closer(plan)[0])))
        tight = Linearised(beside)
        exact = close(tight, loose.whole, loose.period, free=not driven, energy=energy)
        if beside.case.tolerance > plan.case.tolerance:  # the tightest there is has a looser one beside it
            loose, exact = exact, loose
        doubt = contradicted(linear, exact)
        return _findings(problem, plan, tight, loose, exact, driven, doubt)


def given_period(plan: Plan, period: float | Formula | None) -> float | None:
    """Give the period that was asked for, as a number. Raises SimulationError where it is none."""
    if isinstance(period, Formula):
        case = plan.case
        period = float(column_at(case, period.name)(np.array([case.begin]), case.y0[None, :])[0])
    if period is not None and not (math.isfinite(period) and period > 0):
        raise SimulationError(f"the period is positive, it is {period:g}")
    return period


def kept_energy(
    plan: Plan, linear: Linearised, start: Array, period: float, energy: float | None
) -> OrbitEnergy | None:
    """Give the condition that an orbit has an energy, where motions keep it. Raises SimulationError."""
    problem = plan.case.problem
    name = problem.outputs[problem.energy_balance[0]].name if problem.energy_balance else ""
    if name:
        end, y = linear.map(plan.case.begin, start, period, checked=False).end, linear.split(start)[0]
        column = column_at(plan.case, name)
        here, there = column(np.full(2, plan.case.begin), np.vstack([y, end]))
        size = max(abs(here), abs(float(column(np.array([plan.case.begin]), (y * 1.1)[None, :])[0]) - here))
        if abs(there - here) < 1e-7 * size:  # not where nothing has energy
            return OrbitEnergy(name, float(here) if energy is None else energy)
    if energy is not None:
        raise SimulationError(f"'{problem.name}' does not keep an energy that its orbits could have")
    return None


def refuse_rest(plan: Plan, linear: Linearised, found: Found) -> None:
    """Refuse a state at which nothing moves: it closes with any period. Raises SimulationError."""
    problem = plan.case.problem
    change = Shooter(linear, True, None).rate(plan.case.begin, found.whole, found.map.z) * found.period
    if float(np.abs(change[linear.kept]).max(initial=0.0)) <= RESTS * max(CLOSED, found.residual):
        raise SimulationError(
            f"what '{problem.name}' comes back to is a state of rest, {_place(plan, found.start)}: it has no period",
            help=AT_REST,
        )


def _place(plan: Plan, y: Array) -> str:
    """Tell where a state is: its first coordinates, and states of first order; 0 for what is none of their size."""
    problem, y = plan.case.problem, np.where(np.abs(y) < NAUGHT * plan.nominal, 0.0, y)
    shown = [k for k in problem.own if problem.states[k].kind in ("coordinate", "state")]
    texts = [
        f"{problem.states[k].name} = {y[k]:.6g} {problem.states[k].unit}".rstrip() for k in shown[:MOST_NAMED]
    ]
    return ", ".join(texts) + ", ..." * (len(shown) > MOST_NAMED)


Start = tuple[float, Array, Array, float]
"""Where an orbit may begin: time, state, discrete variables, and the period."""


def _after(problem: Problem, options: Orbit, plan: Plan, period: float) -> Iterator[Start]:
    """Yield the start, and states to which the motion has settled after many periods, in each of its modes."""
    begin = plan.case.begin
    yield begin, plan.case.y0, plan.case.z, period
    passed = begin + SETTLING * period
    solution = run(
        problem,
        replace(options, stop=passed + period, start=None, period=None, estimate_error=False, points=2),
    )
    if solution.outcome is Outcome.COMPLETED:
        t = np.linspace(passed, passed + period, LOOKS)
        for first in [0] if scheduled(plan) else _settled(solution, t, plan):
            shift = float(t[first] - passed)
            yield begin + shift, _rows(solution, t[[first]])[0], _discretes(solution, t[first], plan), period


def _returns(problem: Problem, options: Orbit, plan: Plan) -> Iterator[Start]:
    """Yield states with their discrete variables, all taken as those at the begin, and the time after which the motion comes near to each of them again: first the
    start, then where the motion has settled, in each of its modes. Raises SimulationError where it comes near to none."""
    own = np.array(problem.own)
    begin, any_near = plan.case.begin, False
    for factor in LONGER:
        stop = begin + factor * (plan.case.stop - begin)
        solution = run(
            problem, replace(options, stop=stop, start=None, period=None, estimate_error=False, points=2)
        )
        if solution.outcome not in ENDED or solution.outcome is Outcome.TERMINATED:
            raise SimulationError(f"the motion from the start ends: {solution.message}")
        t = np.linspace(begin, float(solution.time[-1]), LOOKS)
        y = _rows(solution, t)
        extent = whole = np.maximum(np.ptp(y[:, own], axis=0), 1e-9 * plan.nominal[own])
        for first in (
            *([] if any_near else [0]),
            *_settled(solution, t[LOOKS // 2 : -LOOKS // 4], plan, LOOKS // 2),
        ):
            if first:
                extent = np.maximum(np.ptp(y[LOOKS // 2 :, own], axis=0), STILL * whole)
            far = np.sqrt(np.mean(((y[first:, own] - y[first, own]) / extent) ** 2, axis=1))
            away = np.flatnonzero(far > LEFT)
            if not away.size:
                continue
            later = far[away[0] :]
            dips = np.flatnonzero(
                (later[1:-1] < NEAR) & (later[1:-1] <= later[:-2]) & (later[1:-1] < later[2:])
            )
            if dips.size:
                any_near = True
                found = first + away[0] + 1 + int(dips[0])
                yield begin, y[first], _discretes(solution, t[first], plan), float(t[found] - t[first])
    late = t >= t[-1] - LATE * (t[-1] - t[0])
    if (np.ptp(y[late][:, own], axis=0) <= STILL * np.maximum(whole, plan.nominal[own])).all():
        raise SimulationError(
            f"the motion of '{problem.name}' comes to rest, {_place(plan, y[-1])}: it has no period",
            help=AT_REST,
        )
    if not any_near:
        raise SimulationError(
            f"the motion of '{problem.name}' does not come near to where it was until t = {stop:g}",
            help='begin nearer to a periodic motion, --set NAME="...", say a longer --stop, or --period with a first '
            "guess; a damped motion that nothing drives has none",
        )


def _settled(solution: Solution, t: Array, plan: Plan, first: int = 0) -> list[int]:
    """Give indices of times, counted from ``first``: the middle of the longest stretch in each mode, the longest first. An orbit
    that begins where something switches, or while it sticks, may have no derivative."""
    modes = [k for k, q in enumerate(plan.case.problem.discretes) if q.kind == "mode"]
    z = None if solution.motion.states_at is None or not modes else solution.motion.states_at(t)[1]
    if z is None:
        return [first]
    ends = np.flatnonzero((z[1:, modes] != z[:-1, modes]).any(axis=1)) + 1
    stretches = sorted(itertools.pairwise([0, *ends.tolist(), len(z)]), key=lambda one: one[0] - one[1])
    longest: dict[bytes, int] = {}
    for a, b in stretches:
        longest.setdefault(z[a, modes].tobytes(), first + (a + b) // 2)
    return list(longest.values())[:MOST_SETTLED]


def _discretes(solution: Solution, t: float, plan: Plan) -> Array:
    """Give the discrete variables of a motion at a time; at its start those before what happens there."""
    if plan.case.problem.hybrid is None or not t > plan.case.begin or solution.motion.states_at is None:
        return plan.case.z
    _, z = solution.motion.states_at(np.array([t]))
    return plan.case.z if z is None else z[0]


def _rows(solution: Solution, t: Array) -> Array:
    return solution.motion.at(t)[:, : solution.problem.ny]


def _findings(
    problem: Problem, plan: Plan, linear: Linearised, loose: Found, exact: Found, driven: bool, doubt: str
) -> Findings:
    values, errors = compared(exact.map, loose.map, free=not driven)
    error = (
        max(abs(exact.period - loose.period), 8 * np.finfo(float).eps * exact.period) if not driven else 0.0
    )
    own = problem.own
    names = [problem.states[k].name for k in own]
    start = {name: float(exact.start[k]) for name, k in zip(names, own, strict=True)}
    kept, remarks = _kept(linear, loose, exact), linear.unreturned(exact.whole, exact.map)
    start |= {value.name: value.value for value in kept}
    stable, words, further = stability(values, errors, free=not driven)
    remarks += further
    if plan.options.begin is not None and driven:
        remarks.append(
            f"told at {time_text(problem, plan.case.begin)}: where the motion begins, it sticks or switches"
        )
    if doubt:
        remarks.append(doubt)
    if exact.iterations > 10:
        remarks.append(f"it took {exact.iterations} corrections: the start was far from this orbit")
    unit = problem.time.unit
    rows = tuple((complex(v), float(abs(v)), float(e)) for v, e in zip(values, errors, strict=True))
    return Findings(
        study="orbit",
        model=problem.name,
        outcome=Outcome.COMPLETED,
        message=f"a periodic motion, {words}, with the period {known_digits(exact.period, error, unit)}",
        values=(
            Value("period", unit, exact.period, error),
            *(
                Value(name, problem.states[k].unit, float(exact.start[k]), _off(plan, exact, loose, k))
                for name, k in zip(names, own, strict=True)
            ),
            *kept,
        ),
        errors_from="the same at a looser tolerance, or with twice the step; multipliers: conditions of the eigenvalues, too",
        remarks=tuple(remarks),
        tables=(Table("multipliers", (("multiplier", ""), ("size", ""), ("error", "")), rows),),
        panels=_picture(problem, plan, linear, exact),
        details={
            "period": exact.period,
            "start": start,
            "begin": plan.case.begin,
            "multipliers": [[float(v.real), float(v.imag)] for v in values],
            "multiplier_errors": errors.tolist(),
            "stable": stable,
            "residual": exact.residual,
        },
    )


def _kept(linear: Linearised, loose: Found, exact: Found) -> list[Value]:
    """Give the discrete variables that the motion keeps and reads again, at the start."""
    found, least = [], max(exact.residual, float(np.finfo(float).eps))
    (_, z), (_, other) = linear.split(exact.whole), linear.split(loose.whole)
    for j in exact.map.memory:
        k = linear.reals[j]
        q, off = linear.problem.discretes[k], least * float(linear.scale[linear.states + j])
        found.append(Value(q.name, q.unit, float(z[k]), max(float(abs(z[k] - other[k])), off)))
    return found


def _off(plan: Plan, exact: Found, loose: Found, k: int) -> float:
    least = max(exact.residual, float(np.finfo(float).eps)) * float(plan.nominal[k])
    return max(float(abs(exact.start[k] - loose.start[k])), least)


def stability(values: Array, errors: Array, *, free: bool) -> tuple[bool | None, str, list[str]]:
    """Tell whether an orbit is stable, in one word, and why it may not be told.

    Of a model that does not depend on time one multiplier is 1, that of a shift along the orbit; it says nothing.
    """
    remarks: list[str] = []
    others = np.arange(len(values))
    if free:
        trivial = int(np.argmin(np.abs(values - 1)))
        others = np.delete(others, trivial)
    if not len(others):
        return None, "neutral", remarks
    largest = others[int(np.argmax(np.abs(values[others])))]
    size = float(abs(values[largest]))
    # eigenvalues of a family of orbits coincide at 1, where they are known to the root of an error only
    noise = max(float(errors[largest]), SAME if abs(values[largest] - 1) < 1e-3 else 1e-9)
    if abs(size - 1) <= noise:
        remarks.append(
            f"the largest multiplier is 1 in size within {noise:.0e}: stability cannot be told by it; that is so for "
            "orbits of conservative models, which lie in families"
        )
        return None, "neutral", remarks
    return size < 1, "stable" if size < 1 else "unstable", remarks


def _picture(problem: Problem, plan: Plan, linear: Linearised, orbit: Found) -> tuple[Panel, ...]:
    """Draw one round: the first coordinate over its rate, or two coordinates."""
    options = replace(
        plan.options, stop=plan.case.begin + orbit.period, start=None, every=None, estimate_error=False, progress=None,
        values={**plan.options.values, **{problem.states[k].name: float(orbit.start[k]) for k in problem.own}},
    )  # fmt: skip
    if problem.rotations or problem.constraints or not problem.nq:
        return ()
    if hasattr(options, "period"):
        options = replace(options, period=None)
    y, z = linear.split(orbit.whole)
    if plan.case.functions.struct.kept is None and np.array_equal(z, plan.case.z):
        solution = run(problem, options)
        t = np.linspace(float(solution.time[0]), float(solution.time[-1]), 1000)
        y = _rows(solution, t)
    else:  # no option sets discrete variables, nor what happens at the start
        t = plan.case.begin + np.linspace(0.0, orbit.period, 1000)
        case = replace(plan.case, y0=y, z=z, wanted=y, assembled=None, grid=t, stop=float(t[-1]))
        step = case.step if plan.method.fixed_step else None
        y = run_kernel(case, SolverOptions(plan.method.name, case.tolerance, plan.nominal, step)).y
    pairs = [(k, problem.nq + k) for k in range(min(problem.nq, 3))]
    return tuple(
        Panel(f"orbit of {problem.states[i].name}", problem.states[i].name, problem.states[i].unit,
              problem.states[j].name, problem.states[j].unit, (Curve("", y[:, i], y[:, j]),), tall=len(pairs) == 1)
        for i, j in pairs
    )  # fmt: skip


def _followed(
    problem: Problem, study: Orbit, linear: Linearised, start: Array, period: float, *, free: bool
) -> Findings:
    """Follow the orbit over a parameter, and tell what happens to it on the way."""
    if len(study.over) > 1:
        raise SimulationError("an orbit is followed over one parameter")
    wanted = study.over[0]
    axis = np.linspace(wanted.low, wanted.high, wanted.count or VALUES)

    def planned(value: float) -> Plan:
        return after_initial_events(
            plan_run(problem, replace(study, values={**study.values, wanted.name: value}))
        )

    follower = Follower(
        linear, planned, lambda plan: given_period(plan, study.period), wanted.high - wanted.low, free=free
    )
    places, rows, message = [_first(follower, float(axis[0]), start, period, study.energy)], [0], ""
    outcome, doubts = Outcome.COMPLETED, list[str]()
    with NotedInterruptions() as interrupted:
        for k, value in enumerate(axis[1:], 1):
            if interrupted():
                outcome = Outcome.INTERRUPTED
                break
            message = follower.reach(places, float(value))
            if message:
                message = f"lost at {wanted.name} = {value:.6g}: {message}"
                break
            rows.append(len(places) - 1)
            doubt = contradicted(follower.linear.renewed(planned(places[-1].value)), places[-1].orbit)
            if doubt:
                doubts.append(f"at {wanted.name} = {places[-1].value:.6g}: {doubt}")
            if study.progress is not None:
                study.progress((k + 1) / len(axis))
    found_on_the_way = sorted(follower.specials, key=lambda one: one.value)
    special = [
        {"kind": one.kind, "value": one.value, "between": list(one.between)}
        | ({"events": one.note} if one.note else {})
        for one in found_on_the_way
    ]
    remarks = [special_words(one, wanted.name) for one in found_on_the_way]
    remarks += doubts[:1]
    remarks += follower.linear.unreturned(places[-1].orbit.whole, places[-1].orbit.map)
    if message:
        remarks.append(message)
    x = np.array([place.value for place in places])
    largest = np.array([float(np.abs(place.multipliers).max(initial=0.0)) for place in places])
    last = places[-1]
    return Findings(
        study="orbit",
        model=problem.name,
        outcome=outcome,
        message=f"followed from {wanted.name} = {x[0]:.6g} to {x[-1]:.6g}",
        values=(Value("orbits", "", float(len(rows)), 0.0),),
        errors_from="each orbit closes within 1e-8 of its size",
        remarks=tuple(remarks),
        tables=(Table("", (
            (wanted.name, wanted.unit), ("period", problem.time.unit), ("largest multiplier", "")
        ), tuple((float(x[k]), float(places[k].orbit.period), float(largest[k])) for k in rows)),),
        panels=(
            Panel("largest multiplier", wanted.name, wanted.unit, "size", "", (
                Curve("largest multiplier", x, largest), Curve("1", x, np.ones(len(x)), "dashed"))),
            Panel("period", wanted.name, wanted.unit, "period", problem.time.unit,
                  (Curve("", x, np.array([place.orbit.period for place in places])),)),
        ),
        details={
            "orbits": [
                {"parameter": {wanted.name: places[k].value}, "period": places[k].orbit.period,
                 "multipliers": [[float(v.real), float(v.imag)] for v in places[k].multipliers]}
                for k in rows
            ],
            "special": special,
            "period": last.orbit.period,
            "multipliers": [[float(v.real), float(v.imag)] for v in last.multipliers],
            "start": {problem.states[k].name: float(last.orbit.start[k]) for k in problem.own},
        },
    )  # fmt: skip


def _first(
    follower: Follower, value: float, start: Array, period: float, energy: float | None
) -> FollowedPlace:
    """Give the first orbit, with the least period where that is free; the energy that it keeps is that of all."""
    plan = follower.planned(value)
    linear = follower.linear.renewed(plan)
    given = follower.length(plan)
    if not follower.free:
        return follower.told(value, linear, close(linear, start, given or period, free=False))
    follower.kept = kept_energy(plan, linear, start, period, energy)
    found = close(linear, start, period, free=True, energy=follower.kept)
    orbit = least(linear, found, follower.kept)
    refuse_rest(plan, linear, orbit)
    return follower.told(value, linear, orbit)
