"""Where energy goes (events, section 8): what brakes whatever the motion dissipates, all other forces supply.

What a page leaves open is said as a choice: whether a force that brakes wherever one looks does so by its form.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from mechc.compiler.flat import model as flat
from oracle.expressions import der
from oracle.point import Point, now
from oracle.questions import IMPLICIT, load_power
from oracle.series import real
from oracle.values import NotCovered

if TYPE_CHECKING:
    from oracle.meaning import Meaning

State = dict[str, float]
LOOKS = 24
"""States at which a force is asked whether it brakes."""
MOST = 8
"""Forces of which each may count on either side."""


def dissipated(meaning: Meaning, state: State) -> list[float]:
    """The powers [W] that may be booked as dissipated at a state: one for each choice."""
    point = meaning.solution(state).point
    sure = resisted(meaning, point) + rubbed(meaning, point)
    open_ones = []
    for load in meaning.flat.loads:
        power = real(load_power(point, load))
        if _once(meaning, load, is_drag):
            sure -= power
        elif power <= 0 and _once(meaning, load, brakes):
            open_ones.append(-power)
    if len(open_ones) > MOST:
        raise NotCovered("many forces that may brake")
    shares = itertools.product(*((0.0, p) for p in open_ones))
    return [sure + sum(share) for share in shares]


def _once(meaning: Meaning, load: flat.Load, asked: Callable[[Meaning, flat.Load], bool]) -> bool:
    """What is asked of a force, which no state changes: found once for all states."""
    key = asked.__name__, id(load)
    if key not in meaning.braking:
        meaning.braking[key] = asked(meaning, load)
    return meaning.braking[key]


def resisted(meaning: Meaning, point: Point) -> float:
    """What Rayleigh's functions take: the sum of v dR/dv over all velocities, of dampings also what time carries away."""
    total: Any = 0.0
    for e in [point.at(e.value) for e in meaning.flat.energies if e.kind == "dissipation"]:
        total = total + _along(point, e)
    still = meaning.point({**point.state, **dict.fromkeys(meaning.all_rates, 0.0)})
    for damping in meaning.flat.dampings:
        total = total + _along(point, point.damped(damping))
        carried = zip(point.rates(damping.on), still.rates(damping.on), strict=True)
        sizes = np.broadcast_to(
            np.ravel(np.asarray(point.at(damping.value), object)), (len(point.rates(damping.on)),)
        )
        total = total + sum(now(c) * now(s) * now(s0) for c, (s, s0) in zip(sizes, carried, strict=True))
    return float(np.real(np.ravel(total)[0]))


def _along(point: Point, value: Any) -> Any:
    v = [point.state[name] for name in point.meaning.all_rates]
    return sum((x * row for x, row in zip(v, point.moved(value, True), strict=False)), 0.0)


def rubbed(meaning: Meaning, point: Point) -> float:
    """What dry friction takes, with the whole rate of what it acts on; nothing where it sticks."""
    total: Any = 0.0
    for f in meaning.flat.frictions:
        rate = der(point.at(f.on))
        limit = now(point.at(f.kinetic))
        total = total + _lost(meaning, f.options, point, limit, [rate], point.modes.get(f.name, "slip"))
    for c in meaning.flat.contacts:
        mode = point.modes.get(c.name, "open")
        if c.friction is not None and mode != "open":
            limit = now(point.at(c.friction)) * point.unknowns.forces[c.name]
            total = total + _lost(meaning, c.options, point, limit, point.slip(c), mode)
    return float(np.real(np.ravel(total)[0]))


def _lost(meaning: Meaning, options: Any, point: Point, limit: Any, slip: list[Any], mode: str) -> Any:
    speed = np.sqrt(sum(real(s) ** 2 for s in slip))
    if mode == "stick":
        return 0.0
    return (
        limit
        * speed
        * (np.tanh(speed / now(point.at(options["v_stick"]))) if meaning.smooth(options) else 1.0)
    )


def brakes(meaning: Meaning, load: flat.Load) -> bool:
    """Whether the power of a force is positive nowhere, as far as one looks; what follows from other forces may be."""
    return all(power <= _ROUNDING for power, _ in _looks(meaning, load))


def is_drag(meaning: Meaning, load: flat.Load) -> bool:
    """Whether a force is opposite to a velocity, and as large as a constant times it, or times its square, by a formula without cases."""
    outside = {
        "time",
        meaning.flat.independent,
        *(v.name for v in meaning.flat.variables if v.role in _OUTSIDE),
    }
    named = [e for x in (load.value, load.on) for e in meaning.expressions(x)]
    if load.source is not None or load.at is not None or load.kind == "torque":
        return False
    if any(
        isinstance(e, (flat.Query, flat.Select)) or (isinstance(e, flat.Name) and e.name in outside)
        for e in named
    ):
        return False
    sizes: dict[int, list[float]] = {2: [], 3: []}
    looks = 0
    for power, speed in _looks(meaning, load):
        if speed <= 1e-6:
            return False
        looks += 1
        sizes = {k: [*found, power / speed**k] for k, found in sizes.items()}
        sizes = {k: found for k, found in sizes.items() if max(found) < 0 and _alike(found)}
        if not sizes:
            return False
    return looks == LOOKS


def _alike(sizes: list[float]) -> bool:
    return max(sizes) - min(sizes) < _ROUNDING * max(abs(x) for x in sizes)


_OUTSIDE = (flat.Role.INPUT, flat.Role.DISCRETE)
_ROUNDING = 1e-9


def _looks(meaning: Meaning, load: flat.Load) -> Iterator[tuple[float, float]]:
    """Yield the power of a force at states far and near, and the speed of what it acts on; nothing where forces decide."""
    told = [e for x in (load.value, load.at) if x is not None for e in meaning.expressions(x)]
    if any(isinstance(e, flat.Query) and e.function in IMPLICIT for e in told):
        return
    rng = np.random.default_rng(5)
    names = (*meaning.all_coordinates, *meaning.all_rates, *meaning.states)
    for k in range(LOOKS):
        state = {x: float(rng.normal(scale=0.3 * 1.3**k)) for x in names}
        state |= dict.fromkeys(meaning.discretes, 1.0) | {"time": float(rng.uniform(0, 2))}
        try:
            point = meaning.point(state)
            plain = load.at is None and load.kind == "force"
            speed = np.sqrt(sum(real(s) ** 2 for s in point.rates(load.on))) if plain else 0.0
            yield float(np.real(np.ravel(now(load_power(point, load)))[0])), float(speed)
        except (NotCovered, ValueError, ZeroDivisionError, OverflowError):
            continue
