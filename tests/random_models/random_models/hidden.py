"""What a model says of its states on which the motion does not depend: a displacement of them changes nothing else.

Where nothing switches and nothing is held, those are looked for, too: what follows the motion and on which nothing that moves depends.
"""

from __future__ import annotations

import math

import numpy as np

from random_models.compiled import Compiled, NoMotion, Values
from random_models.tree import Model

FAR = 0.37
STEPS = (FAR, -FAR, 1e-3)
"""Displacements by which it is looked whether anything depends on a state at all."""


def misjudged(model: Model, base: Compiled, seed: int) -> list[str]:
    """Say which states are taken for such wrongly."""
    if not base.problem.nq + base.problem.nv:
        return []
    following = {base.states[k] for k in base.problem.followers}
    rng = np.random.default_rng(seed)
    found = [f"'{name}' follows the motion, and is not said to" for name in _missed(base, following, rng)]
    if not following:
        return found
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


def _missed(base: Compiled, following: set[str], rng: np.random.Generator) -> list[str]:
    """Return states that depend on the motion, but on which it does not, directly or through others, beside those that are known."""
    count = base.problem.nq + base.problem.nv
    moving = set(base.states[:count])
    states = [n for n in base.states[count:] if not n.startswith("energy.")]
    if base.switches or base.constrained or set(states) <= following:
        return []
    read: dict[str, set[str]] = {n: set() for n in base.states}
    for state in base.random_states(rng, 3):
        here = base.rhs(state)
        for name in (*moving, *states):
            for step in STEPS:
                there = base.rhs(state | {name: state[name] + step * (1 + abs(state[name]))})
                for n in base.states:
                    if here[f"d {n}"] != there[f"d {n}"]:
                        read[n].add(name)
    needed = _through(read, moving)
    return [n for n in states if n not in needed | following and _through(read, {n}) & moving]


def _through(read: dict[str, set[str]], names: set[str]) -> set[str]:
    """Return names, and all on which they depend."""
    found, waiting = set(names), list(names)
    while waiting:
        new = read[waiting.pop()] - found
        found |= new
        waiting += new
    return found


def _rates(base: Compiled, state: Values) -> Values:
    base.z = None
    try:
        return base.rhs(base.settle(state))
    except NoMotion:
        return {}
