"""Small models in which nothing switches, with inputs that go on with time: what Python modules and step by step exports are made of."""

from __future__ import annotations

from random import Random

from random_models.arithmetic import following
from random_models.coordinates import coordinate, half, mass_for, square
from random_models.everyday import starting
from random_models.expressions import Writer
from random_models.formulas import chain
from random_models.operators import der
from random_models.scope import File, Scope
from random_models.signals import signal
from random_models.tree import ENERGY, FORCE, LENGTH, NUMBER, SPEED, TIME, E, Slot, over, to_power
from random_models.within import resting

SHARE = 0.04
"""Of the models."""
SEPARABLE = 0.3
"""Of these have accelerations that depend on places and time alone, as some methods want them."""
RESTING = 0.3
"""Of the others have a part that begins at rest."""


def is_quiet(seed: int) -> bool:
    """Whether the model of a seed is one of these: of none that is known to catch a mutant."""
    return Random(f"smoothly {seed}").random() < SHARE


def quiet(seed: int) -> Scope:
    """Write the statements of one."""
    s = Scope(File(Random(f"a quiet model {seed}")))
    places = [coordinate(s, s.pick((LENGTH, LENGTH, NUMBER))) for _ in range(s.pick((1, 2, 2, 3)))]
    if Random(f"separable {seed}").random() < SEPARABLE:
        return _separable(s, places)
    for q in places:
        _energies(s, q)
    for _ in range(s.pick((1, 1, 2))):
        signal(s, quiet=True)
    if s.chance(0.5):
        chain(s)
    w = Writer(s, "tqvxu", kinks=False)
    for d in s.random.sample((LENGTH, FORCE, ENERGY, NUMBER, SPEED), 2):
        _output(s, w.scalar(d, 2))
    _output(s, der(places[0], 2))
    with s.apart(f"followers of {seed}"):
        if s.chance(0.4):
            following(s, seed)
        elif s.chance(0.5):
            starting(s)
    with s.apart(f"rest 9 of {seed}"):
        if s.chance(RESTING):
            resting(s)
    return s


def _separable(s: Scope, places: list[E]) -> Scope:
    """Write masses that nothing but places, time and inputs moves."""
    w = Writer(s, "q", kinks=False)
    for q in places:
        mass, stiffness = mass_for(s, q.dim), s.value(over(ENERGY, to_power(q.dim, 2)), s.number(0.5, 3))
        for what, e in (
            ("kinetic", half(s, mass, square(der(q)))),
            ("potential", half(s, stiffness, square(q))),
        ):
            s.add("energy", f"{what} ", Slot(what, e), ";", data={"what": what})
    s.add("energy", "potential ", Slot("potential", w.scalar(ENERGY, 1)), ";", data={"what": "potential"})
    if s.chance(0.5):
        signal(s, quiet=True)
    for q in places:
        push = Writer(s, "tqu", kinks=False).scalar(over(ENERGY, q.dim), 1)
        s.add(
            "force",
            "force ",
            Slot("force.value", push),
            " on ",
            Slot("force.on", q),
            ";",
            data={"on": "scalar"},
        )
    _output(s, w.scalar(LENGTH, 2))
    _output(s, der(places[0], 2))
    return s


def _energies(s: Scope, q: E) -> None:
    w = Writer(s, "q", kinks=False)
    kinetic, stiffness = mass_for(s, q.dim), s.value(over(ENERGY, to_power(q.dim, 2)), s.number(0.5, 3))
    s.add(
        "energy", "kinetic ", Slot("kinetic", half(s, kinetic, square(der(q)))), ";", data={"what": "kinetic"}
    )
    s.add(
        "energy",
        "potential ",
        Slot("potential", half(s, stiffness, square(q))),
        ";",
        data={"what": "potential"},
    )
    if s.chance(0.5):
        s.add("energy", "potential ", Slot("potential", w.scalar(ENERGY, 1)), ";", data={"what": "potential"})
    if s.chance(0.6):
        c = s.value(over(over(ENERGY, to_power(q.dim, 2)), to_power(TIME, -1)), s.number(0.05, 0.4))
        s.add("damping", "damping ", Slot("damping.value", c), " on ", Slot("damping.on", q), ";")


def _output(s: Scope, e: E) -> None:
    name = s.fresh("o")
    s.add("output", f"output {name} = ", Slot("output.value", e), ";", name=name)
