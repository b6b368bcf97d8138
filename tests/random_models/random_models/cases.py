"""Laws by cases, some of which ask for a force: what only one branch contains is no less a part of the equations."""

from __future__ import annotations

from random_models.expressions import Writer
from random_models.operators import add, choose, divide, multiply, subtract
from random_models.questions import question
from random_models.scope import Scope
from random_models.tree import (
    ENERGY,
    FORCE,
    LENGTH,
    NUMBER,
    TIME,
    Dim,
    E,
    Slot,
    node,
    over,
    reference,
)

SHARE = 0.25
"""Of the models, as far as they have a force that can be asked for."""
_TRIES = 6


def cases(s: Scope, seed: int) -> None:
    """Write one or two laws by cases. Their random numbers are their own: models keep all else."""
    with s.apart(f"cases of {seed}"):
        if s.chance(SHARE):
            for _ in range(s.pick((1, 1, 2))):
                s.weighted(((3, _force), (1, _state)))(s)


def _answer(s: Scope) -> E | None:
    """Ask for something that only the solution of the equations tells."""
    asked = [question(s) for _ in range(_TRIES)]
    return next((e for e in asked if e is not None and "a" in e.level), None)


def _branch(s: Scope, d: Dim, asked: E | None) -> E:
    plain = node("number", "0", value=lambda: 0) if s.chance(0.4) else s.literal(d, s.number(-1, 1))
    if asked is None:
        return plain
    share = multiply(s.value(over(d, asked.dim), s.number(0.05, 0.4)), asked)
    if s.chance(0.3):
        share = multiply(s.literal(over(d, asked.dim), s.number(-0.4, -0.05)), asked)
    return share if s.chance(0.6) else add(s.literal(d, s.number(-1, 1)), share)


def _by_cases(s: Scope, d: Dim, asked: E) -> E:
    """Return a choice of which any branch may ask, and at least one does."""
    w = Writer(s, "tqv", kinks=False)
    n = s.pick((2, 2, 2, 3))
    asks = [s.chance(0.3) for _ in range(n)]
    asks[s.random.randrange(n)] = True
    branches = [_branch(s, d, asked if a else None) for a in asks]
    e = branches.pop()
    while branches:
        e = choose(w.condition(0), branches.pop(), e)
    return e


def _force(s: Scope) -> None:
    asked = _answer(s)
    free = [q for q in s.coordinates if q not in s.driven]
    if asked is None or not free:
        return
    q = s.pick(free)
    e = _by_cases(s, over(ENERGY, q.dim), asked)
    s.add("force", "force ", Slot("force.value", e), " on ", Slot("force.on", q), ";", data={"on": "scalar"})


def _state(s: Scope) -> None:
    asked = _answer(s)
    if asked is None:
        return
    d = s.pick((FORCE, LENGTH, NUMBER))
    name = s.fresh("x")
    kind = {FORCE: "Force", LENGTH: "Length", NUMBER: "Real"}[d]
    first = Slot("state.value", s.literal(d, s.number(-1, 1)))
    s.add("state", f"state {kind} {name} = ", first, ";", name=name, data={"guess": False})
    x = reference(name, "state", d, level="x")
    rate = divide(subtract(_by_cases(s, d, asked), x), s.value(TIME, s.number(0.3, 1.5)))
    s.add("equation", f"equation der({name}) = ", Slot("equation", rate), ";", name=name)
