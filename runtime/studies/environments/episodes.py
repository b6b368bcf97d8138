"""Episodes of a task: environments that begin at random, are seen and rewarded, and begin again where they end."""

from __future__ import annotations

from types import TracebackType

import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

from ...ensembles.members import Spread, quantile
from ...problem import Array, Problem
from .environments import Environments


class Rules(Struct, frozen=True):
    """``observe`` and ``reward``: columns of the states, then of the outputs (``place_of``); ``over``: of the outputs, above a half
    where an episode ends; ``acting``: columns of the inputs; ``starts``: states that begin at random; an episode has ``steps``
    control steps that last a ``period``."""

    observe: tuple[int, ...]
    reward: int
    over: int | None
    acting: tuple[int, ...]
    starts: tuple[tuple[int, Spread], ...]
    period: float
    steps: int


class Seen(Struct, frozen=True, eq=False):
    """Of each environment after a control step: the observations [n, k], the reward, whether the episode has ended, and
    whether it is cut off at the end of its time."""

    observed: Array
    reward: Array
    over: NDArray[np.bool_]
    late: NDArray[np.bool_]


def place_of(problem: Problem, name: str) -> int:
    """Give the column of a quantity among states and outputs."""
    return next(k for k, q in enumerate((*problem.states, *problem.outputs)) if q.name == name)


class Episodes:
    """``begin`` again where an episode is wanted, act through ``env.u``, ``step``. Use as a context."""

    def __init__(self, problem: Problem, env: Environments, rules: Rules) -> None:
        self.problem, self.env, self.rules = problem, env, rules
        self.age = np.zeros(env.n, dtype=np.int64)
        held = [problem.inputs[k] for k in (env.held[i] for i in rules.acting)]
        self.bounds = np.array([[q.minimum, q.maximum] for q in held], dtype=float).reshape(-1, 2)
        """The least and the largest value [actions, 2] of each input by which is acted."""
        self._idle = env.u[0].copy()

    def __enter__(self) -> Episodes:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.env.close()

    def begin(self, random: np.random.Generator, where: NDArray[np.intp] | None = None) -> None:
        """Let these environments, or all, begin an episode."""
        env, problem = self.env, self.problem
        rows = np.arange(env.n) if where is None else where
        y = np.tile(env.start, (rows.size, 1))
        for place, spread in self.rules.starts:
            y[:, place] = quantile(spread, np.clip(random.random(rows.size), 2.0**-54, 1 - 2.0**-53))
        env.u[rows] = self._idle
        if self.rules.starts:
            nq, nv = problem.nq, problem.nv
            env.reset(y[:, :nq], y[:, nq : nq + nv], y[:, nq + nv :], rows)
        else:
            env.reset(where=rows)
        self.age[rows] = 0

    def observed(self) -> Array:
        """Give the observations [n, k] as they are now."""
        return self._table()[:, list(self.rules.observe)]

    def step(self) -> Seen:
        """Take a control step with the inputs of ``env.u``."""
        env, rules = self.env, self.rules
        env.step()
        self.age += 1
        now = self._table()
        over = env.status != 1
        if rules.over is not None:
            over |= now[:, self.problem.ny + rules.over] > 0.5
        return Seen(
            now[:, list(rules.observe)], now[:, rules.reward], over, (self.age >= rules.steps) & ~over
        )

    def _table(self) -> Array:
        return np.hstack([self.env.states, self.env.y])
