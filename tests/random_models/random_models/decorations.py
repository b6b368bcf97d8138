"""What is put onto a skeleton, with weights, and what is asked of every model."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction

from random_models.expressions import Writer
from random_models.holding import constraint, coupling, drive, loop
from random_models.loads import (
    EVERYTHING,
    damping,
    dissipation,
    element_of_library,
    force,
    kinetic,
    lagrangian,
    point_force,
    potential,
    torque,
)
from random_models.operators import (
    call,
    der,
    relation,
)
from random_models.scope import Scope
from random_models.switching import contact, discrete, friction, input_, over_time, state, when
from random_models.tree import (
    ENERGY,
    FORCE,
    LENGTH,
    NUMBER,
    SPEED,
    TIME,
    E,
    Slot,
    over,
    reference,
)

F = Fraction


def outputs(s: Scope) -> None:
    """Ask for a few values: of every kind of question, accelerations, and anything."""
    for q in s.coordinates[:2]:
        _output(s, der(q, 2))
    if s.joints and s.space:
        for name in s.joints[:2]:
            r = reference(name, "joint")
            _output(s, call("reaction", r, dim=FORCE, shape=(s.space,), level="qva"))
            _output(s, call("moment", r, dim=ENERGY, shape=() if s.space == 2 else (3,), level="qva"))
    for name, d, _ in s.constraints:
        _output(s, call("multiplier", reference(name, "constraint"), dim=over(ENERGY, d), level="qva"))
    for q in s.driven:
        _output(s, call("reaction", q, dim=over(ENERGY, q.dim), level="qva"))
    for name in s.powers[:2]:
        _output(s, call("power", reference(name, "load"), level="qva"))
    if s.vectors and s.chance(0.5):
        _output(s, s.pick(s.vectors))
    w = Writer(s, EVERYTHING + "a", questions=True)
    for _ in range(s.random.randint(1, 3)):
        d = s.pick((LENGTH, FORCE, ENERGY, NUMBER, SPEED))
        _output(s, w.vector(s.space or 2, d, 1) if s.chance(0.25) else w.scalar(d, 3))
    free = [q for q in s.coordinates if q not in s.driven]
    if free and s.chance(0.5):
        q = s.pick(free)
        _output(s, call("momentum", q, level="qv"))


def _output(s: Scope, e: E) -> None:
    name = s.fresh("o")
    s.add("output", f"output {name} = ", Slot("output.value", e), ";", name=name)


def claim(s: Scope) -> None:
    """Assert something that holds."""
    t = reference("time", "time", TIME, level="t")
    s.add(
        "assert",
        "assert ",
        Slot("assert.condition", relation(">=", t, s.literal(TIME, F(-1)))),
        ', "time is late enough";',
    )


Decoration = Callable[[Scope], None]


EVERYWHERE: tuple[tuple[float, Decoration], ...] = (
    (3, force), (2, damping), (3, potential), (1, kinetic), (1, lagrangian), (1.5, dissipation), (1.5, state),
    (1.2, input_), (0.6, over_time), (0.9, discrete), (0.5, when), (0.8, friction), (1, contact), (0.2, claim),
)  # fmt: skip


ON_BODIES: tuple[tuple[float, Decoration], ...] = ((4, point_force), (2, torque), (4, element_of_library))


HOLDING: tuple[tuple[float, Decoration], ...] = ((2, constraint), (1.5, coupling), (1.5, loop), (1, drive))
