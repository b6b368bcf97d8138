"""Runs whose errors were measured against sizes that a state does not come near: a length of nanometres that starts at zero
takes the size of one of kilometres (``runtime/nominal.py``, rule 4), and only its motion tells better."""

from __future__ import annotations

import numpy as np
from msgspec.structs import replace

from ...case import Progress
from ...integrate.trajectory import Trajectory
from ...nominal import NOISE
from ...problem import PURE, Array, Problem, Quantity
from ...results.accuracy import EPSILON
from .companion import Plan, trajectory_of

FAR = 1e-3
"""Share of its nominal value below which a state that has stayed there all the time was not measured by its own size."""
SAME = 3
"""What a motion reaches in both runs differs by less; else it was the error of the first one."""
ROUNDING = 16 * EPSILON
"""Of what is computed from lengths of another part of the machine, which a state need not feel."""
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
    if main.failure is not None or main.interrupted or not main.y.size:
        return plan, main, ()
    reached = _reached(main)
    small = _small(plan.case.problem, plan.nominal, reached)
    if not small:
        return plan, main, ()
    nominal = np.array(plan.nominal)
    nominal[small] = reached[small]
    again, motion = replace(plan, nominal=nominal), main
    as_it_is = plan.method.fixed_step or main.statistics.jacobians > 0
    if not as_it_is:
        most = COSTLY * main.statistics.steps + AT_LEAST
        bounded = replace(again, options=replace(plan.options, max_steps=most))
        motion = trajectory_of(bounded, plan.case.tolerance, plan.case.step, plan.options.dense, progress)
        now = _reached(motion)[small] if motion.failure is None and motion.y.size else np.zeros(len(small))
        if np.any(now < reached[small] / SAME) or np.any(now > reached[small] * SAME):
            return plan, main, ()  # what the first run showed was its error
    first = small[0]
    q = plan.case.problem.states[first]
    what = f"'{q.name}' stays below {reached[first]:.2g} {q.unit}, far below the {plan.nominal[first]:.2g} {q.unit} of others"
    done = "errors are measured" if as_it_is else "the run was repeated with errors measured"
    return again, motion, (f"{what}: {done} against what it reaches",)


def _reached(run: Trajectory) -> Array:
    """Give the largest size of each state."""
    columns = (run.y[:, i] for i in range(run.y.shape[1]))  # one by one: of many points no copy is made
    return np.array([np.abs(np.where(np.isfinite(column), column, 0.0)).max() for column in columns])


def _small(problem: Problem, nominal: Array, reached: Array) -> list[int]:
    """List states that stay far below their nominal value and are no rounding beside those that they feel.

    Angles and pure numbers have a size of their own, and so has what the model declares.
    """
    low = (reached > 0) & (reached < FAR * nominal)
    if not low.any():
        return []
    partner = dict(zip(range(problem.nq, problem.nq + problem.nv), problem.partner, strict=True))
    groups = problem.groups or (0,) * problem.ny
    found = []
    for i, q in enumerate(problem.states):
        moved = problem.states[partner.get(i, i)]
        if not low[i] or _has_size(q) or _has_size(moved):
            continue
        alike = [k for k, other in enumerate(problem.states) if other.unit == q.unit]
        felt = max(reached[k] for k in alike if groups[k] == groups[i])
        if reached[i] > max(NOISE * felt, ROUNDING * max(reached[k] for k in alike)):
            found.append(i)
    return found


def _has_size(q: Quantity) -> bool:
    return q.nominal is not None or q.kind == "account" or q.unit in PURE
