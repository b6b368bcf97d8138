"""Bodies that hang the other way round, and such that a weld holds together, with all that is asked of them."""

from __future__ import annotations

from random_models.bodies import WORLD, given, joint_kinds, mod
from random_models.closing import direction, hung, placed, push
from random_models.driven import ask
from random_models.operators import call, der, vector
from random_models.parts import frame_of, told
from random_models.scope import Scope
from random_models.tree import (
    ENERGY,
    FORCE,
    INERTIA,
    LENGTH,
    MASS,
    NUMBER,
    RATE,
    E,
    S,
    Slot,
    dim,
    over,
    reference,
    statement,
)

SHARE = 0.06
"""Of the models with bodies."""


def hanging(s: Scope, seed: int) -> None:
    """Write one. Its random numbers are its own: models keep all else."""
    if not s.space:
        return
    with s.apart(f"hanging of {seed}"):
        if s.chance(SHARE):
            s.pick((_backwards, _welded))(s)


def _backwards(s: Scope) -> None:
    """A body whose joint is written from the body to the world, or to a frame that is there."""
    n, name, hinge = s.space, s.fresh("b"), s.fresh("j")
    kind, freedoms = s.pick([(k, c) for k, c in joint_kinds(n) if c and not k.startswith("Rolling")])
    told(s, "Body", name, [*_inertia(s)])
    frame = frame_of(f"{name}.a")
    mods = [
        statement(
            "bind",
            Slot("component.from", placed(s, frame) if s.chance(0.5) else frame),
            " -> ",
            Slot("component.to", WORLD),
            name="->",
        )
    ]
    if n == 3 and kind in ("Revolute", "Prismatic", "Cylindrical", "Screw") and s.chance(0.7):
        mods.append(mod("axis", "=", "modification.structural", direction(s)))
    if kind == "Screw":
        mods.append(given(s, "pitch", LENGTH, s.number(0.2, 0.6)))
    for coordinate, what in freedoms:
        d = LENGTH if what.startswith("length") else NUMBER
        count = {"lengths": n, "angles": 2, "rotation": 3}.get(what, 0)
        rates = [s.literal(over(d, dim(0, 0, 1)), s.number(-1, 1)) for _ in range(count or 1)]
        start: E
        if what == "rotation":
            start = call(
                s.pick(("rotx", "roty")), s.literal(NUMBER, s.number(-1, 1), angle=True), type="pose"
            )
        else:
            places = [s.literal(d, s.number(-0.6, 0.6), angle=d == NUMBER) for _ in range(count or 1)]
            start = vector(*places) if count else places[0]
        mods.append(mod(coordinate, "=", "modification.initial", start))
        mods.append(
            mod(f"der({coordinate})", "=", "modification.rate", vector(*rates) if count else rates[0])
        )
    told(s, kind, hinge, mods)
    push(s, frame)
    ask(s, call("angvel", frame, dim=RATE, shape=() if n == 2 else (3,), level="qv"))
    ask(s, call("vel", placed(s, frame), dim=over(LENGTH, dim(0, 0, 1)), shape=(n,), level="qv"))
    _loads(s, hinge)


def _welded(s: Scope) -> None:
    """Two bodies that a weld holds together, whose reaction is asked for, as what they are as one body is."""
    n = s.space
    first, _ = hung(s, "Revolute", WORLD)
    name, weld = s.fresh("b"), s.fresh("j")
    told(s, "Body", name, [*_inertia(s)])
    second = frame_of(f"{name}.a")
    with s.apart(f"turned {weld} of {len(s.statements)}"):
        turn = s.pick(("rotx", "roty", "rotz")) if n == 3 else "rot"
        angle = s.literal(NUMBER, s.number(-2, 2), angle=True)
        turned = call(turn, angle, type="pose") if s.chance(0.7) else None
    ends = [Slot("component.from", placed(s, first, turned)), Slot("component.to", second)]
    told(s, "Weld", weld, [statement("bind", ends[0], " -> ", ends[1], name="->")])
    push(s, second)
    _loads(s, weld)
    with s.apart(f"accelerations of {weld}"):
        for frame in (first, second):
            ask(s, der(call("pos", placed(s, frame), dim=LENGTH, shape=(n,), level="q", type="real"), 2))
    asked = s.pick((first, second))
    ask(s, call("mass_centre", asked, dim=LENGTH, shape=(n,), level="q"))
    ask(
        s,
        call(
            "inertia_tensor", asked, dim=INERTIA, shape=() if n == 2 else (3, 3), level="" if n == 2 else "q"
        ),
    )


def _inertia(s: Scope) -> list[S]:
    """What a body is that turns about every line."""
    n = s.space
    size: E = s.value(INERTIA, s.number(0.1, 0.5))
    if n == 3:
        size = call(
            "diag",
            vector(*(s.literal(INERTIA, s.number(0.2, 0.35)) for _ in range(3))),
            dim=INERTIA,
            shape=(3, 3),
        )
    centre = vector(*(s.literal(LENGTH, s.number(-0.4, 0.4)) for _ in range(n)))
    return [
        given(s, "m", MASS, s.number(0.5, 2)),
        mod("J", "=", "modification.parameter", size),
        mod("com", "=", "modification.parameter", centre),
    ]


def _loads(s: Scope, name: str) -> None:
    """Ask for what a joint holds."""
    joint = reference(name, "joint")
    ask(s, call("reaction", joint, dim=FORCE, shape=(s.space,), level="qva"))
    ask(s, call("moment", joint, dim=ENERGY, shape=() if s.space == 2 else (3,), level="qva"))
