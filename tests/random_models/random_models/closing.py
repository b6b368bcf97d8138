"""Loops that joints of every kind close, with forces and moments that are asked for: in the order of the text, or cut."""

from __future__ import annotations

from fractions import Fraction

from random_models.bodies import WORLD, joint_kinds, mod
from random_models.coordinates import half, square
from random_models.driven import ask
from random_models.operators import call, der, vector
from random_models.scope import Scope
from random_models.tree import (
    ENERGY,
    FORCE,
    INERTIA,
    LENGTH,
    MASS,
    NUMBER,
    PRODUCT,
    RATE,
    SIGNED,
    SPEED,
    E,
    S,
    Seq,
    Slot,
    dim,
    node,
    reference,
    statement,
)

SHARE = 0.1
"""Of the models with bodies."""
F = Fraction
_CARRIERS = {
    2: ("Revolute", "Prismatic", "PinSlot"),
    3: ("Revolute", "Prismatic", "Spherical", "Cylindrical"),
}
_TOLD = {
    "Planar": ("x", "y"),
    "Cylindrical": ("position",),
    "Prismatic": ("position",),
    "PinSlot": ("position",),
}
"""Coordinates that a joint tells where it closes a loop, whichever way round a shuffled text hangs it."""
_ELEMENTS = {"Translation": ("position[1]", "position[2]")}
"""Of joints of which only elements are said to begin somewhere."""
TURNED = 0.6
"""Of the ends of these are turned."""
BEGUN = 0.3
"""Of these say where they begin."""


def closing(s: Scope, seed: int) -> None:
    """Write a body that moves freely, but for a joint. Its random numbers are its own: models keep all else."""
    if not s.space:
        return
    with s.apart(f"closing of {seed}"):
        if s.chance(SHARE):
            _close(s, seed)


def _close(s: Scope, seed: int) -> None:
    n = s.space
    carrier = s.chance(0.6)
    kinds = [
        k
        for k, _ in joint_kinds(n)
        if k not in ("Free", "Rolling", "RollingOnCircle") and (n, k) != (2, "Planar")
    ]
    kind = s.pick([k for k in kinds if carrier or k != "Weld"])
    base = hung(s, s.pick(_CARRIERS[n]), WORLD)[0] if carrier else WORLD
    body, _ = hung(s, "Planar" if n == 2 else "Free", WORLD)
    with s.apart(f"turn of what closes {seed}"):
        turn = _turned(s)
    end = placed(s, body, turn) if s.chance(0.5) or turn is not None else body
    start = placed(s, base) if s.chance(0.7) else base
    name = s.fresh("j")
    mods: list[S] = [
        statement("bind", Slot("component.from", start), " -> ", Slot("component.to", end), name="->")
    ]
    if (
        kind in ("Revolute", "Prismatic", "PinSlot", "Cylindrical", "Screw")
        and (n == 3 or kind != "Revolute")
        and s.chance(0.7)
    ):
        mods.append(mod("axis", "=", "modification.structural", direction(s)))
    if kind == "Universal" and s.chance(0.7):
        first, second = s.pick((((1, 0, 0), (0, 0, 1)), ((0, 2, 0), (1, 0, 0)), ((0, 0, -1), (0, 1, 0))))
        for what, axis in (("first", first), ("second", second)):
            mods.append(
                mod(what, "=", "modification.structural", vector(*(s.literal(NUMBER, F(x)) for x in axis)))
            )
    if kind == "Screw":
        mods.append(mod("pitch", "=", "modification.parameter", s.literal(LENGTH, s.number(0.2, 0.6))))
    with s.apart(f"start of what closes {seed}"):
        mods += _begun(s, kind)
    cut = "cut " if s.chance(0.4) else ""
    s.add("component", f"{cut}{kind} {name}", Seq(tuple(mods), "list"), ";", name=name, data={"class": kind})
    push(s, body)
    joint = reference(name, "joint")
    ask(s, call("reaction", joint, dim=FORCE, shape=(n,), level="qva"))
    ask(s, call("moment", joint, dim=ENERGY, shape=() if n == 2 else (3,), level="qva"))
    ask(s, call("pos", body, dim=LENGTH, shape=(n,), level="q"))
    told = [reference(f"{name}.{q}", "coordinate", LENGTH, level="q") for q in _TOLD.get(kind, ())]
    for q in told:
        ask(s, q)
    if told and s.chance(0.7):
        _act(s, s.pick(told))


def _begun(s: Scope, kind: str) -> list[S]:
    """Say where the joint begins, or how fast, which the bodies then follow."""
    told = _TOLD.get(kind, _ELEMENTS.get(kind, ()))
    if not told or not s.chance(BEGUN):
        return []
    q = s.pick(told)
    place = mod(q, "=", "modification.initial", s.literal(LENGTH, s.number(-0.6, 0.6)))
    rate = mod(f"der({q})", "=", "modification.rate", s.literal(SPEED, s.number(-0.6, 0.6)))
    return s.pick(([place], [rate], [place, rate]))


def _act(s: Scope, q: E) -> None:
    """Let a spring, a damping or a force act on a coordinate of the joint itself."""
    kind = s.pick(("potential", "damping", "force", "dissipation"))
    if kind == "potential":
        energy = half(s, s.value(dim(1, 0, -2), s.number(0.5, 4)), square(q))
        s.add("energy", "potential ", Slot("potential", energy), ";", data={"what": "potential"})
    elif kind == "damping":
        c = s.value(dim(1, 0, -1), s.number(0.1, 0.6))
        s.add("damping", "damping ", Slot("damping.value", c), " on ", Slot("damping.on", q), ";")
    elif kind == "dissipation":
        power = half(s, s.value(dim(1, 0, -1), s.number(0.1, 0.6)), square(der(q)))
        s.add("energy", "dissipation ", Slot("dissipation", power), ";", data={"what": "dissipation"})
    else:
        value, at = Slot("force.value", s.literal(FORCE, s.number(-1, 1))), Slot("force.on", q)
        s.add("force", "force ", value, " on ", at, ";", data={"on": "scalar"})


def direction(s: Scope) -> E:
    return vector(*(s.literal(NUMBER, s.number(-1, 1) or F(1)) for _ in range(s.space)))


def hung(s: Scope, kind: str, base: E, *, axis: bool = True) -> tuple[E, str]:
    """Hang a body with inertia about every line on a joint whose start is a guess; return its frame, and the joint's name."""
    n, name, joint = s.space, s.fresh("b"), s.fresh("j")
    inertia: E
    if n == 2:
        inertia = s.value(INERTIA, s.number(0.1, 0.5))
    else:
        sizes = vector(*(s.literal(INERTIA, s.number(0.2, 0.35)) for _ in range(3)))
        inertia = call("diag", sizes, dim=INERTIA, shape=(3, 3))
    centre = vector(*(s.literal(LENGTH, s.number(-0.4, 0.4)) for _ in range(n)))
    mods = (
        mod("m", "=", "modification.parameter", s.value(MASS, s.number(0.5, 2))),
        mod("J", "=", "modification.parameter", inertia),
        mod("com", "=", "modification.parameter", centre),
    )
    s.add("component", f"Body {name}", Seq(mods, "list"), ";", name=name, data={"class": "Body"})
    starts: list[S] = [statement("bind", Slot("component.from", base), f" -> {name}.a", name="->")]
    if axis and n == 3 and kind in ("Revolute", "Prismatic", "Cylindrical") and s.chance(0.5):
        starts.append(mod("axis", "=", "modification.structural", direction(s)))
    freedoms = dict(joint_kinds(n))[kind]
    for coordinate, what in freedoms:
        d = LENGTH if what.startswith("length") else NUMBER
        count = {"lengths": n, "rotation": 3}.get(what, 0)
        rates = [s.literal(SPEED if d == LENGTH else RATE, s.number(-0.6, 0.6)) for _ in range(count or 1)]
        if what == "rotation":
            start: E = call(
                s.pick(("rotx", "roty", "rotz")),
                s.literal(NUMBER, s.number(-0.4, 0.4), angle=True),
                type="pose",
            )
        else:
            places = [s.literal(d, s.number(-0.3, 0.3), angle=d == NUMBER) for _ in range(count or 1)]
            start = vector(*places) if count else places[0]
        starts.append(mod(coordinate, "~", "modification.initial", start))
        starts.append(
            mod(f"der({coordinate})", "~", "modification.rate", vector(*rates) if count else rates[0])
        )
    s.add("component", f"{kind} {joint}", Seq(tuple(starts), "list"), ";", name=joint, data={"class": kind})
    return reference(f"{name}.a", "frame", LENGTH, level="q", type="frame"), joint


def _turned(s: Scope) -> E | None:
    """Return a turn by anything, so that a loop may begin far from closed."""
    if not s.chance(TURNED):
        return None
    about = "rot" if s.space == 2 else s.pick(("rotx", "roty", "rotz"))
    return call(about, s.literal(NUMBER, s.number(-3, 3), angle=True), type="pose")


def placed(s: Scope, frame: E, turn: E | None = None) -> E:
    """Return a frame beside another, turned or not."""
    offset = vector(*(s.literal(LENGTH, s.number(-0.3, 0.3)) for _ in range(s.space)))
    pose = node(
        "frame*",
        (frame, PRODUCT),
        " * ",
        (call("trans", offset, type="pose"), SIGNED),
        dim=LENGTH,
        type="frame",
    )
    if turn is not None:
        pose = node("frame*", (pose, PRODUCT), " * ", (turn, SIGNED), dim=LENGTH, type="frame")
    name = s.fresh("f")
    s.add("frame", f"frame {name} = ", Slot("frame.value", pose), ";", name=name)
    return reference(name, "frame", LENGTH, level="q", type="frame")


def push(s: Scope, body: E) -> None:
    """Load a body by a force and a torque, in the axes of the world or in its own."""
    n = s.space
    force = vector(*(s.literal(FORCE, s.number(-2, 2)) for _ in range(n)))
    own: list[str | Slot] = [" in ", Slot("force.in", body)] if s.chance(0.5) else []
    s.add(
        "force",
        "force ",
        Slot("force.vector", force),
        " on ",
        Slot("force.point", body),
        *own,
        ";",
        data={"on": "point"},
    )
    sizes = [s.literal(ENERGY, s.number(-1, 1)) for _ in range(1 if n == 2 else 3)]
    torque = sizes[0] if n == 2 else vector(*sizes)
    s.add("torque", "torque ", Slot("torque.value", torque), " on ", Slot("torque.on", body), ";")
