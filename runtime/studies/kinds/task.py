"""What is to be learnt on a model: observations, a reward, where an episode ends, and where it begins."""

from __future__ import annotations

import math
from typing import Annotated, ClassVar

import numpy as np
from msgspec.structs import replace

from ...ensembles.members import Axis, Listed, Spread
from ...outcome import Outcome, SimulationError
from ...problem import Problem
from ...settings import Formula, settable
from ..environments.environments import Environments, Wishes, control_steps
from ..environments.episodes import Episodes, Rules, place_of
from ..findings import Curve, Findings, Panel, Value
from ..study import Study

EPISODES = 100
PURE = ("", "1", "rad")
"""Units of numbers."""


class Task(Study, frozen=True, kw_only=True):
    """Episodes of control steps that last ``every`` and end at ``stop``, where ``terminate`` holds, or where the model ends or fails.
    Its answer is what comes of inputs that stay as they begin; a program that acts asks for it by ``Model.gym``.
    """

    of_past = True
    of_environments: ClassVar[bool] = True
    unused: ClassVar[frozenset[str]] = frozenset({"start", "step", "estimate_error"})

    observe: Annotated[
        tuple[Formula, ...],
        settable('Observations: "sin(a), cos(a), der(a)*(0.1 s)", numbers or angles.', "formulas"),
    ] = ()
    reward: Annotated[
        Formula | None, settable("Reward: a number, at the end of a control step.", "formula")
    ] = None
    terminate: Annotated[
        Formula | None, settable('Condition that ends an episode early: "abs(x) > 2 m".', "condition")
    ] = None
    vary: Annotated[
        tuple[Axis | Spread | Listed, ...],
        settable(
            'Random starts: "a ~ uniform(-10 deg, 10 deg)", of coordinates, rates and states.', "varying"
        ),
    ] = ()
    actions: Annotated[
        tuple[str, ...], settable("Inputs that an agent sets (default: all that can be set).", "directions")
    ] = ()
    substeps: Annotated[
        int, settable("Steps of a method with a fixed step in each control step.", "count")
    ] = 1
    episodes: Annotated[
        int | None, settable(f"Number of episodes to evaluate (default: {EPISODES}).", "count")
    ] = None
    seed: Annotated[int, settable("Seed of the random numbers (default: 1).", "count")] = 1
    wishes: Wishes | None = None

    def solve(self, problem: Problem) -> Findings:
        """Play episodes in which nobody acts. Raises SimulationError for what does not fit the model."""
        n = self.episodes or EPISODES
        with self.environments(problem, replace(self.wishes or Wishes(), n=n), acting=False) as played:
            random = np.random.default_rng(self.seed)
            played.begin(random)
            returns, lengths, alive = np.zeros(n), np.zeros(n), np.ones(n, dtype=bool)
            mean: list[float] = []
            reasons: list[str] = []
            for k in range(played.rules.steps):
                seen = played.step()
                returns += np.where(alive, seen.reward, 0.0)
                lengths += alive
                mean.append(float(returns.mean()))
                whys = [played.env.why(int(row)) for row in np.flatnonzero(alive & seen.over)]
                reasons += [why.message for why in whys if why is not None]
                alive &= ~seen.over
                if self.progress is not None:
                    self.progress((k + 1) / played.rules.steps)
                if not alive.any():
                    break
        spread = [float(a.std(ddof=1) / math.sqrt(n)) if n > 1 else None for a in (returns, lengths)]
        unit, period = problem.time.unit, played.rules.period
        ended = float((~alive).mean())
        times = period * np.arange(1, len(mean) + 1)
        return Findings(
            study="task",
            model=problem.name,
            outcome=Outcome.COMPLETED,
            message=f"nobody acts: the reward adds up to {returns.mean():.6g} on average over {n} episodes, {100 * ended:.3g} % of which end early",
            values=(
                Value("return", "", float(returns.mean()), spread[0]),
                Value("length", unit, float(lengths.mean() * period), None if spread[1] is None else spread[1] * period),
                Value("ended early", "", ended),
            ),
            errors_from="the scatter of the episodes",
            remarks=(f"{len(reasons)} of {n} end as the motion does, the first so: {reasons[0]}",) if reasons else (),
            panels=(Panel("mean return", "time", unit, "return", "", (Curve("return", np.asarray(times, dtype=np.float64), np.array(mean)),)),),
            details={
                "returns": returns.tolist(),
                "observations": [one.text for one in self.observe],
                "actions": [played.env.names.u[k] for k in played.rules.acting],
                "every": period,
                "stop": period * played.rules.steps,
            },
        )  # fmt: skip

    def environments(self, problem: Problem, wishes: Wishes, *, acting: bool = True) -> Episodes:
        """Make environments with the rules of the task. ``acting``: somebody acts, so that there must be actions, with bounds.

        Raises SimulationError.
        """
        if not self.observe or self.reward is None:
            raise SimulationError(
                "a task states what is observed and what is rewarded",
                help='as in study swing = task(observe = "sin(a), der(a)*(1 s)", reward = "cos(a)", every = 20 ms, stop = 10 s)',
            )
        if self.every is None:
            raise SimulationError("how long a control step lasts is missing", help="say every = 20 ms")
        for one in (*self.observe, self.reward):
            (unit,) = {q.unit for q in (*problem.states, *problem.outputs) if q.name == one.name}
            if unit not in PURE:
                raise SimulationError(
                    f"what is observed and rewarded are numbers: '{one.text}' has the unit {unit}",
                    help="divide it by a size of its own kind, as in der(a)/(5 rad/s)",
                )
        period = self.every
        env = Environments(problem, *control_steps(self, wishes, period, self.substeps))
        stop = env.stop
        steps = round(stop / period)
        if steps < 1 or abs(steps * period - stop) > 1e-9 * stop:
            raise SimulationError(
                f"the episode of {stop:g} is not a whole number of control steps of {period:g}"
            )
        outputs = [q.name for q in problem.outputs]
        rules = Rules(
            observe=tuple(place_of(problem, one.name) for one in self.observe),
            reward=place_of(problem, self.reward.name),
            over=None if self.terminate is None else outputs.index(self.terminate.name),
            acting=self._acting(problem, env.names.u, acting),
            starts=tuple(_start(problem, one) for one in self.vary),
            period=period,
            steps=steps,
        )
        return Episodes(problem, env, rules)

    def _acting(self, problem: Problem, known: tuple[str, ...], acting: bool) -> tuple[int, ...]:
        """Give the columns of inputs by which is acted."""
        for name in self.actions:
            if name not in known:
                raise SimulationError(
                    f"'{name}' is not an input that can be set while the model runs",
                    help=f"there are {', '.join(known) or 'none'}",
                )
        found = [known.index(name) for name in self.actions or known]
        if not acting:
            return tuple(found)
        if not found:
            raise SimulationError(
                f"'{problem.name}' has no input to act by",
                help="as in input Torque u(min = -5 N.m, max = 5 N.m) = 0;",
            )
        bounds = {q.name: (q.minimum, q.maximum) for q in problem.inputs}
        for k in found:
            if None in bounds[known[k]]:
                raise SimulationError(
                    f"'{known[k]}' has no bounds, so no value of it can be chosen",
                    help=f"state them in the model: input ... {known[k]}(min = ..., max = ...)",
                )
        return tuple(found)


def _start(problem: Problem, one: Axis | Spread | Listed) -> tuple[int, Spread]:
    """Give the place of a state that begins at random, and how. Raises SimulationError for anything else."""
    if not isinstance(one, Spread):
        raise SimulationError(
            "an episode begins in a random state, not in one of a list",
            help='as in vary = "a ~ uniform(-10 deg, 10 deg)"',
        )
    if one.kind == "normal" and len(one.numbers) == 1:
        raise SimulationError(f"the normal distribution of '{one.name}' has no standard deviation")
    for k, state in enumerate(problem.states):
        if state.name == one.name:
            return k, one
    raise SimulationError(
        f"'{one.name}' is not a coordinate, rate or state: all episodes share it",
        help="vary states here; for other values of parameters, make other models with model.with_values",
    )
