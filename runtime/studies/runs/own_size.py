"""Runs whose errors were measured against sizes that a state does not come near: a length of nanometres that starts at zero
takes the size of one of kilometres (``runtime/nominal.py``, rule 4), and only its motion tells better."""

from __future__ import annotations

import sys

import numpy as np
from msgspec.structs import replace
from numpy.typing import NDArray

from ...case import Case, Progress
from ...integrate.nominal_run import nominal_of
from ...integrate.trajectory import Trajectory
from ...interface import PURE, Quantity
from ...memo import once
from ...nominal import NOISE, with_nominal
from ...problem import Array, Problem
from ...results.accuracy import EPSILON
from ...results.evaluate import evaluate_rows
from .companion import Plan, trajectory_of

FAR = 1e-3
"""Share of its nominal value below which a state that has stayed there all the time was not measured by its own size."""
SAME = 3
"""What a motion reaches in two runs differs by less; else it was an error of the first one, which is made again."""
ROUNDS = 6
"""Runs that are made at most: each one finds what a state reaches by a factor of about a tolerance better."""
ROUNDING = 16 * EPSILON
"""Of what is computed from lengths of another part of the machine, which a state need not feel."""
PLACES, SHAKES, SHARE = 8, 4, 1e-6
"""Where and how often all states are moved at random, by which share of what they reach, to see what rounding of them does."""
HEARD = 1e-3
"""Share of what changes a state below which rounding does not matter to it."""
COSTLY, AT_LEAST = 10, 1000
"""A repeated run that takes more steps than so many times those of the first, and so many more, follows rounding: the first
one stands."""


def by_own_size(
    plan: Plan, main: Trajectory, progress: Progress | None
) -> tuple[Plan, Trajectory, tuple[str, ...]]:
    """Repeat a run in which states stay far below what their errors are measured against, by what they reach; say so.

    Steps of one size stay as they are, and so do those of an implicit method: what it keeps small follows the rest, as the
    stretch of a stiff spring does, and steps that resolved it would grow in number with the stiffness.
    """
    sizeless = _sizeless(plan.case.problem)
    if main.failure is not None or main.interrupted or sizeless is None or not main.y.size:
        return plan, main, ()
    if not main.t[-1] > main.t[0]:
        return plan, main, ()
    reached = main.reached
    far = _small(sizeless, plan.nominal, reached)
    small = _no_rounding(plan, main, reached, far) if far else []
    if not small:
        return plan, main, ()
    again, motion, first = replace(plan, nominal=_with_sizes(plan.nominal, reached, small)), main, small[0]
    as_it_is = plan.method.fixed_step or main.statistics.jacobians > 0
    rounds = 0 if as_it_is else ROUNDS
    most = COSTLY * main.statistics.steps + AT_LEAST
    for _ in range(rounds):
        bounded = replace(again, options=replace(plan.options, max_steps=most, stiff_after=None))
        motion = trajectory_of(bounded, plan.options.dense, progress)
        if motion.interrupted:
            return again, motion, ()
        now = motion.reached
        if motion.failure is not None or not motion.y.size or np.any(now[small] > reached[small] * SAME):
            return plan, main, ()
        wrong = [i for i in small if now[i] < reached[i] / SAME]  # they had reached that by errors
        reached = now
        if not wrong:
            break
        if _no_rounding(again, motion, now, wrong) != wrong:
            return plan, main, ()
        small = wrong
        again = replace(again, nominal=_with_sizes(again.nominal, reached, small))
    else:
        if rounds:
            return plan, main, ()
    q, size = plan.case.problem.states[first], reached[first]
    what = f"'{q.name}' stays below {size:.2g} {q.unit}, far below the {plan.nominal[first]:.2g} {q.unit} of others"
    done = "errors are measured" if as_it_is else "the run was repeated with errors measured"
    return again, motion, (f"{what}: {done} against what it reaches",)


def own_sizes(before: Plan, after: Plan) -> dict[str, float]:
    """Give the nominal values, by name, whose declaration makes the rules give those that ``by_own_size`` has left: the ones that
    it changed, and others to which the rules would lend these."""
    case, declared = before.case, np.flatnonzero(before.nominal != after.nominal)
    while True:
        sizes = {case.problem.states[i].name: float(after.nominal[i]) for i in declared.tolist()}
        if not sizes:
            return sizes
        ruled = nominal_of(replace(case, problem=with_nominal(case.problem, sizes)))
        lent = np.setdiff1d(np.flatnonzero(ruled != after.nominal), declared)
        if not lent.size:
            return sizes
        declared = np.union1d(declared, lent)


def sizes_in_run(plan: Plan) -> dict[str, float]:
    """Run a plan, and give the nominal values of states that stay far below those of others, by which its run is repeated."""
    if _sizeless(plan.case.problem) is None:
        return {}
    main = trajectory_of(plan, False, None)
    again, motion, _ = by_own_size(plan, main, None)
    return own_sizes(plan, again) if motion is not main else {}


def _with_sizes(nominal: Array, reached: Array, small: list[int]) -> Array:
    sizes = np.array(nominal)
    sizes[small] = reached[small]
    return sizes


def _small(sizeless: NDArray[np.bool_], nominal: Array, reached: Array) -> list[int]:
    """List those of the states without a size of their own that stay far below their nominal value."""
    found: list[int] = np.flatnonzero((reached > 0) & (reached < FAR * nominal) & sizeless).tolist()
    return found


@once
def _sizeless(problem: Problem) -> NDArray[np.bool_] | None:
    """Tell [ny] which states have no size of their own, nor their coordinates; None where there is no such state.

    Angles and pure numbers have a size of their own, and so has what the model declares.
    """
    partner = dict(zip(range(problem.nq, problem.nq + problem.nv), problem.partner, strict=True))
    found = [
        not _has_size(q) and not _has_size(problem.states[partner.get(i, i)])
        for i, q in enumerate(problem.states)
    ]
    return np.array(found, dtype=bool) if any(found) else None


def _no_rounding(plan: Plan, run: Trajectory, reached: Array, small: list[int]) -> list[int]:
    """Keep those that are more than rounding beside the states of their unit; a velocity whose coordinate is rounding is rounding, too."""
    problem = plan.case.problem
    judged = _by_size(plan, reached, small) if problem.constraints else _by_feeling(plan, run, reached, small)
    coordinates, rounding = dict(enumerate(problem.partner, problem.nq)), set(small).difference(judged)
    return [i for i in judged if coordinates.get(i) not in rounding]


def _by_feeling(plan: Plan, run: Trajectory, reached: Array, small: list[int]) -> list[int]:
    """Keep those that feel little of rounding, and where contacts hold them are more than rounding beside the nominal values."""
    problem = plan.case.problem
    if not small:
        return []
    heard = _heard(plan.case, run, reached)
    held = problem.hybrid is not None and problem.hybrid.rows
    least = ROUNDING * plan.nominal if held else np.zeros(problem.ny)
    return [i for i in small if heard[i] < HEARD and reached[i] > least[i]]


def _by_size(plan: Plan, reached: Array, small: list[int]) -> list[int]:
    """Keep those that are more than rounding where projections round: by their size, also beside the nominal values and, of a velocity,
    beside all others, each over the nominal value of its coordinate."""
    problem, found = plan.case.problem, []
    groups = problem.groups or (0,) * problem.ny
    speeds = np.zeros(problem.ny)
    for velocity, q in enumerate(problem.partner, problem.nq):
        speeds[velocity] = reached[velocity] / plan.nominal[q]
    for i in small:
        alike = [k for k, other in enumerate(problem.states) if other.measure == problem.states[i].measure]
        told = reached[i] > ROUNDING * plan.nominal[i]
        for size in (np.where(np.isin(np.arange(problem.ny), alike), reached, 0.0), speeds):
            felt = max(size[k] for k in range(problem.ny) if groups[k] == groups[i])
            told = told and (size[i] > max(NOISE * felt, ROUNDING * size.max()) or not size[i])
        if told:
            found.append(i)
    return found


def _heard(case: Case, run: Trajectory, reached: Array) -> Array:
    """Give [ny] what rounding does to each state, over what it does: by the rates, for a coordinate those of its velocity,
    and by the jumps at events.

    States are moved at random by a small share of what they reach, which shows how strongly they are felt, and by roundings,
    with the time, which shows what cancels.
    """
    from ...start.free_state import even_numbers

    problem = case.problem
    rows = np.array(sorted(set(np.linspace(0, len(run.t) - 1, PLACES).astype(int).tolist())), dtype=int)
    t, y = np.repeat(run.t[rows], SHAKES + 1), np.repeat(run.y[rows], SHAKES + 1, axis=0)
    z = None if run.happened is None else np.repeat(run.happened.grid_z[rows], SHAKES + 1, axis=0)
    signs = np.where(even_numbers(1, len(t) * (problem.ny + 1)) < 0, -1.0, 1.0).reshape(len(t), -1)
    signs[:: SHAKES + 1] = 0.0
    noise, own = np.zeros(problem.ny), reached / max(float(run.t[-1] - run.t[0]), sys.float_info.min)
    for size, share, counts in ((reached, SHARE, EPSILON / SHARE), (np.abs(y), 2 * EPSILON, 1.0)):
        at = t * (1 + EPSILON * signs[:, -1]) if counts == 1 else t
        rates = evaluate_rows(case, "rhs", at, y + share * size * signs[:, :-1], z)
        rates = rates.reshape(len(rows), SHAKES + 1, -1)
        noise = np.maximum(noise, np.abs(rates[:, 1:] - rates[:, :1]).max(axis=(0, 1)) * counts)
        own = np.maximum(own, np.abs(rates[:, 0]).max(axis=0))
    for velocity, q in enumerate(problem.partner, problem.nq):
        own[q], noise[q] = own[velocity], noise[velocity]
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.maximum(np.where(noise > 0, noise / own, 0.0), _jumps(problem, run) / reached)


def _jumps(problem: Problem, run: Trajectory) -> Array:
    """Give [ny] by what rounding of the jumps at events moves the states that these move."""
    if run.happened is None or not run.happened.times.size:
        return np.zeros(problem.ny)
    jumps = np.abs(run.happened.after - run.happened.before)[:, : problem.ny]
    alike = np.array([[a.measure == b.measure for b in problem.states] for a in problem.states])
    largest = np.array([jumps[:, own].max(axis=1) for own in alike]).T
    noise: Array = EPSILON * np.where(jumps > 0, largest, 0.0).sum(axis=0)
    for velocity, q in enumerate(problem.partner, problem.nq):
        noise[q] = max(noise[q], noise[velocity] * float(run.t[-1] - run.t[0]))
    return noise


def _has_size(q: Quantity) -> bool:
    return q.nominal is not None or q.kind == "account" or q.unit in PURE
