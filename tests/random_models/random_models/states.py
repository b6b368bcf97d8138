"""States by name at which a model is compared with its definition: the start, random ones, at rest, on a contact, sliding."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from oracle import Meaning, NotCovered, Undetermined
from oracle.series import real
from oracle.start import project

Values = dict[str, float]
_STEP = 1e-6
_SETTLED = 1e-13


def looks(meaning: Any, rng: np.random.Generator, n: int, begin: float = 0.0) -> Iterator[tuple[str, Values]]:
    """Yield states with what they are; at rest only where something may stick, on a contact where one can be reached."""
    start = _floats(meaning.start(begin))
    yield "start", start
    for _ in range(n - 1):
        yield "random", _floats(meaning.random(rng))
    dry = [c for c in meaning.flat.contacts if c.friction is not None]
    if meaning.flat.frictions or dry:
        state = _floats(meaning.random(rng, moves=False))
        yield "at rest", at_rest(meaning, state)
    contacts = list(meaning.flat.contacts)
    if contacts:
        contact = contacts[int(rng.integers(len(contacts)))]
        touching = on(meaning, at_rest(meaning, _floats(meaning.random(rng, moves=False))), contact)
        if touching is not None:
            yield "on a contact", touching
            moving = sliding(meaning, touching, contact, rng) if contact.friction is not None else None
            if moving is not None:
                yield "sliding", moving


def on_constraints(flat: Any, names: Sequence[str], rng: np.random.Generator) -> list[Values]:
    """Return a random state on the constraints of a model, or none where the definition finds none."""
    try:
        state = _floats(Meaning(flat, experiment="").random(rng))
    except (NotCovered, Undetermined):
        return []
    return [{n: state.get(n, 0.0) for n in names} | {"time": state.get("time", 0.0)}]


def at_rest(meaning: Any, state: Values) -> Values:
    """Take the rates out of a state, as far as what drives it allows."""
    still = {n: 0.0 if n in set(meaning.rates) else v for n, v in state.items()}
    return _floats(meaning.project(still))


def on(meaning: Any, state: Values, contact: Any) -> Values | None:
    """Move a state at rest until a contact touches; nothing where that cannot be done, or it does not stay there."""
    names = [n for n in meaning.coordinates if "[" not in n or n.split("[")[0] not in _rotations(meaning)]
    for _ in range(30):
        gap = _gap(meaning, state, contact)
        if abs(gap) < _SETTLED:
            break
        slopes = {n: _slope(meaning, state, contact, n) for n in names}
        size = sum(x * x for x in slopes.values())
        if not size:
            return None
        shift = max(-1.0, min(1.0, gap / size))
        state = {n: v - shift * slopes.get(n, 0.0) for n, v in state.items()}
        state = _floats(meaning.project(state))
    else:
        return None
    later = {n: v for n, v in state.items() if n not in meaning.driven} | {"time": state["time"] + _STEP}
    moved = _gap(meaning, _floats(meaning.fill(later)), contact) - _gap(meaning, state, contact)
    others = [c for c in meaning.flat.contacts if c is not contact]
    if abs(moved) > 1e-12 or any(_gap(meaning, state, c) <= 0 for c in others):
        return None
    return state


def sliding(meaning: Any, touching: Values, contact: Any, rng: np.random.Generator) -> Values | None:
    """Let what touches move at random, and go on touching."""
    rates = {n: float(rng.normal()) for n in meaning.rates}
    try:
        state = _floats(project(meaning, touching | rates, lambda point: [point.at(contact.gap)]))
    except Undetermined:
        return None
    others = [c for c in meaning.flat.contacts if c is not contact]
    return None if any(_gap(meaning, state, c) <= 0 for c in others) else state


def approaching(meaning: Any, rng: np.random.Generator) -> Values | None:
    """Move towards a contact that will touch within some hundredths of a second; nothing where that cannot be done."""
    contacts = list(meaning.flat.contacts)
    contact = contacts[int(rng.integers(len(contacts)))]
    state = on(meaning, at_rest(meaning, _floats(meaning.random(rng, moves=False))), contact)
    if state is None:
        return None
    pairs = [p for p in zip(meaning.coordinates, meaning.rates, strict=False) if p[1] == f"der({p[0]})"]
    rates = {q: float(rng.normal()) for q, _ in pairs}
    slope = sum(_slope(meaning, state, contact, q) * v for q, v in rates.items())
    sign = -1.0 if slope > 0 else 1.0
    state = state | {"time": 0.0} | {r: sign * rates[q] for q, r in pairs}
    state |= {q: state[q] - 0.03 * sign * rates[q] for q, _ in pairs}
    gaps = [_gap(meaning, state, c) for c in contacts]
    return state if min(gaps) > 0 else None


def _gap(meaning: Any, state: Values, contact: Any) -> float:
    """Return a gap, which no force enters: without a search for the forces, which may take long."""
    return real(meaning.point(meaning.fill(state)).at(contact.gap))


def _slope(meaning: Any, state: Values, contact: Any, name: str) -> float:
    ahead = _gap(meaning, {**state, name: state[name] + _STEP}, contact)
    return (ahead - _gap(meaning, {**state, name: state[name] - _STEP}, contact)) / (2 * _STEP)


def _rotations(meaning: Any) -> set[str]:
    return {name for name, shape, *_ in meaning.coordinate_layout if shape is None}


def _floats(state: Any) -> Values:
    return {n: float(v) for n, v in state.items()}
