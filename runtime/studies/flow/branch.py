"""A branch of periodic motions along a parameter, stable or not, from a motion that has settled."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from ...case import SimulationOptions
from ...problem import Array, Problem
from ...results.solution import Solution
from ..runs.simulate import Plan, plan_run, run_from
from .following import FollowedPlace, Follower, OrbitBifurcation
from .linearised import Linearised
from .shooting import close
from .time_dependence import after_initial_events, depends_on_time


class FollowedBranch(Struct, frozen=True, eq=False):
    """Orbits in the order in which they were followed, two rounds of each, what happened on the way, and why it ended early."""

    places: list[FollowedPlace]
    rounds: list[tuple[Plan, Solution]]
    specials: list[OrbitBifurcation]
    message: str


def follow_branch(
    problem: Problem,
    options: SimulationOptions,
    name: str,
    values: Array,
    settled: Solution,
    period: float,
    length: Callable[[Plan], float],
    interrupted: Callable[[], bool],
) -> FollowedBranch:
    """Follow the orbit to which a motion has settled at the first of ``values``, with a ``period`` there; ``length`` of a plan is
    that of driven models. Raises SimulationError where no orbit is found."""

    begin = float(settled.time[0])
    options = replace(options, stop=begin + period)

    def planned(value: float) -> Plan:
        return after_initial_events(
            plan_run(problem, replace(options, values={**options.values, name: value}))
        )

    first = planned(float(values[0]))
    linear, driven = Linearised(first), depends_on_time(first)
    turns = math.floor((float(settled.time[-1]) - begin) / period * (1 + 1e-12))
    at = np.array([min(begin + turns * period, float(settled.time[-1]))])
    z = settled.motion.states_at(at)[1] if settled.motion.states_at is not None else None
    start = linear.joined(settled.motion.at(at)[0, : problem.ny], first.case.z if z is None else z[0])
    follower = Follower(
        linear, planned, lambda plan: length(plan) if driven else None, abs(float(values[-1] - values[0])),
        free=not driven,
    )  # fmt: skip
    places = [follower.told(float(values[0]), linear, close(linear, start, period, free=not driven))]
    message = ""
    for value in values[1:].tolist():
        if interrupted():
            break
        message = follower.reach(places, value)
        if message:
            message = f"the branch is lost at {name} = {value:.6g}: {message}"
            break
    rounds = []
    for place in places:
        at_value = replace(options, values={**options.values, name: place.value})
        plan = planned(place.value)
        longer = plan_run(problem, replace(at_value, stop=plan.case.begin + 2 * place.orbit.period))
        y, z = linear.split(place.orbit.whole)
        rounds.append((longer, run_from(longer, y, z)))
    return FollowedBranch(places, rounds, follower.specials, message)
