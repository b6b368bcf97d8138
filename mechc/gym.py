"""Tasks of models as environments of Gymnasium: one, or a vector of them that is stepped in compiled code."""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from .runtime.studies.environments.episodes import Episodes, Seen


def _spaces(episodes: Episodes) -> tuple[gymnasium.spaces.Box, gymnasium.spaces.Box]:
    """Give the spaces of observations, and of actions between the bounds of the inputs, in SI."""
    count = len(episodes.rules.observe)
    low, high = episodes.bounds.T.astype(np.float32)
    return (
        gymnasium.spaces.Box(-np.inf, np.inf, (count,), np.float32),
        gymnasium.spaces.Box(low, high, dtype=np.float32),
    )


def _acted(episodes: Episodes, actions: Any) -> None:
    """Put actions into the inputs, within their bounds."""
    low, high = episodes.bounds.T
    episodes.env.u[:, list(episodes.rules.acting)] = np.clip(actions, low, high)


class OneEnv(gymnasium.Env[Any, Any]):
    """A task of a model. Observations are numbers; actions are inputs in SI, held for a control step."""

    metadata: dict[str, Any] = {"render_modes": []}  # noqa: RUF012 - as Gymnasium declares it

    def __init__(self, episodes: Episodes) -> None:
        self.episodes = episodes
        self.observation_space, self.action_space = _spaces(episodes)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        super().reset(seed=seed)
        self.episodes.begin(self.np_random)
        return self.episodes.observed()[0].astype(np.float32), {}

    def step(self, action: Any) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        _acted(self.episodes, action)
        seen = self.episodes.step()
        observed = seen.observed[0].astype(np.float32)
        return observed, float(seen.reward[0]), bool(seen.over[0]), bool(seen.late[0]), {}

    def close(self) -> None:
        self.episodes.env.close()


class ManyEnvs(VectorEnv[Any, Any, Any]):
    """The same, ``num_envs`` of them. An episode that ends begins again in the same step: its last observation is
    ``info["final_obs"]``, and what is returned is the first one of the next."""

    metadata: dict[str, Any] = {"render_modes": [], "autoreset_mode": AutoresetMode.SAME_STEP}  # noqa: RUF012

    def __init__(self, episodes: Episodes) -> None:
        self.episodes = episodes
        self.num_envs = episodes.env.n
        self.single_observation_space, self.single_action_space = _spaces(episodes)
        self.observation_space = batch_space(self.single_observation_space, self.num_envs)
        self.action_space = batch_space(self.single_action_space, self.num_envs)

    def reset(self, *, seed: Any = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        super().reset(seed=seed if seed is None or isinstance(seed, int) else seed[0])
        self.episodes.begin(self.np_random)
        return self.episodes.observed().astype(np.float32), {}

    def step(self, actions: Any) -> tuple[Any, Any, Any, Any, dict[str, Any]]:
        _acted(self.episodes, actions)
        seen: Seen = self.episodes.step()
        observed, info = seen.observed.astype(np.float32), {}
        ended = seen.over | seen.late
        if ended.any():
            info = {"final_obs": observed.copy(), "_final_obs": ended}
            rows = np.flatnonzero(ended)
            self.episodes.begin(self.np_random, rows)
            observed[rows] = self.episodes.observed()[rows]
        return observed, seen.reward, seen.over, seen.late, info

    def close_extras(self, **kwargs: Any) -> None:
        self.episodes.env.close()
