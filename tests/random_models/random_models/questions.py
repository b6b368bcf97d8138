"""Questions about the motion."""

from __future__ import annotations

from collections.abc import Callable

from random_models.operators import (
    call,
    element,
)
from random_models.scope import Scope
from random_models.tree import (
    ENERGY,
    FORCE,
    LENGTH,
    POWER,
    TIME,
    E,
    over,
    reference,
    times,
)


def question(s: Scope) -> E | None:
    """Ask about the motion."""
    n = s.space
    options: list[tuple[float, Callable[[], E]]] = [
        (1, lambda: call("energy", dim=ENERGY, level="qv")),
        (1, lambda: call("kinetic_energy", dim=ENERGY, level="qv")),
        (1, lambda: call("potential_energy", dim=ENERGY, level="qv")),
    ]
    free = [q for q in s.coordinates if q not in s.driven]
    if free:

        def momentum() -> E:
            q = s.pick(free)
            return call("momentum", q, dim=over(times(ENERGY, TIME), q.dim), level="qv")

        options.append((1, momentum))
    if s.powers:
        options.append(
            (1, lambda: call("power", reference(s.pick(s.powers), "load"), dim=POWER, level="qva"))
        )
    if s.constraints:

        def multiplier() -> E:
            name, d, _ = s.pick(s.constraints)
            return call("multiplier", reference(name, "constraint"), dim=over(ENERGY, d), level="qva")

        options.append((1.5, multiplier))
    if s.driven:

        def driving() -> E:
            q = s.pick(s.driven)
            return call("reaction", q, dim=over(ENERGY, q.dim), level="qva")

        options.append((1, driving))
    if n and s.joints:

        def reaction() -> E:
            name = reference(s.pick(s.joints), "joint")
            if s.chance(0.35):
                m = call("moment", name, dim=ENERGY, shape=() if n == 2 else (3,), level="qva")
                return m if n == 2 else element(m, s.random.randint(1, 3))
            return element(call("reaction", name, dim=FORCE, shape=(n,), level="qva"), s.random.randint(1, n))

        options.append((2.5, reaction))
    if n and s.bodies:

        def centre() -> E:
            e = (
                call("mass_centre", dim=LENGTH, shape=(n,), level="q")
                if s.chance(0.5)
                else call("mass_centre", s.pick(s.bodies), dim=LENGTH, shape=(n,), level="q")
            )
            return element(e, s.random.randint(1, n))

        options.append((0.6, centre))
    return s.weighted(options)()
