"""What a model says of its states on which the motion does not depend: a displacement of them changes nothing else."""

from __future__ import annotations

import math

import numpy as np

from random_models.compiled import Compiled, NoMotion, Values
from random_models.tree import Model

FAR = 0.37


def misjudged(model: Model, base: Compiled, seed: int) -> list[str]:
    """Say which states are taken for such wrongly."""
    if not base.problem.nq + base.problem.nv:
        return []
    following = {base.states[k] for k in base.problem.followers}
    if not following:
        return []
    found: list[str] = []
    rng = np.random.default_rng(seed)
    for state in base.random_states(rng, 2):
        here = _rates(base, state)
        for name in sorted(following):
            there = _rates(base, state | {name: state[name] + FAR * (1 + abs(state[name]))})
            moved = [
                n
                for n in here
                if n in there and not math.isclose(here[n], there[n], rel_tol=1e-9, abs_tol=1e-9)
            ]
            moved = [n for n in moved if n[2:] not in following and not n.startswith("d energy.")]
            found += [f"'{name}' is said to follow, and changes {n}" for n in moved[:1]]
    return found


def _rates(base: Compiled, state: Values) -> Values:
    base.z = None
    try:
        return base.rhs(base.settle(state))
    except NoMotion:
        return {}
