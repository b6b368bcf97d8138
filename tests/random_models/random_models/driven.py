"""Everything that can be driven: rotations, arrays and their elements, joints of several freedoms, by place and by rate."""

from __future__ import annotations

import math
from fractions import Fraction

from random_models.bodies import WORLD, joint_kinds, mod
from random_models.coordinates import half, square
from random_models.operators import add, call, der, element, multiply, vector
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
    TIME,
    Dim,
    E,
    S,
    Seq,
    Slot,
    dim,
    node,
    over,
    reference,
    statement,
)

SHARE = 0.1
"""Of the models."""
F = Fraction


def driven(s: Scope, seed: int) -> None:
    """Write what is driven, and what it carries along. Its random numbers are its own: models keep all else."""
    with s.apart(f"driven of {seed}"):
        if not s.chance(SHARE):
            return
        kinds = (
            [(1.0, _array)] + ([(2.0, _joint)] if s.space else []) + ([(2.0, _turn)] if s.space == 3 else [])
        )
        s.weighted(kinds)(s)


def course(s: Scope, d: Dim) -> E:
    """Return a smooth function of time."""
    w = multiply(s.value(RATE), reference("time", "time", TIME, level="t"))
    name = s.pick(("sin", "cos", "tanh"))
    moved = multiply(s.value(d, s.number(0.2, 0.8)), call(name, w, value=getattr(math, name)))
    return add(s.literal(d, s.number(-0.5, 0.5), angle=d == NUMBER), moved)


def turning(s: Scope) -> E:
    """Return a rotation that changes with time, about one axis or one after the other."""

    def one() -> E:
        angle = course(s, NUMBER)
        if s.chance(0.4):
            axis = vector(*(s.literal(NUMBER, s.number(-1, 1) or F(1)) for _ in range(3)))
            return call("axis_angle", axis, angle, type="pose")
        return call(s.pick(("rotx", "roty", "rotz")), angle, type="pose")

    if s.chance(0.25):
        return one()
    return node("pose*", (one(), PRODUCT), " * ", (one(), SIGNED), binding=PRODUCT, type="pose")


def drive(s: Scope, target: E, value: E) -> None:
    """Prescribe a coordinate, or its rate, and ask for the force that this needs."""
    name = target.ref or str(target)
    s.add("drive", "drive ", Slot("drive.target", target), " = ", Slot("drive.value", value), ";", name=name)


def ask(s: Scope, e: E) -> None:
    """Tell a value."""
    name = s.fresh("o")
    s.add("output", f"output {name} = ", Slot("output.value", e), ";", name=name)


def _slider(s: Scope, frame: E) -> None:
    """A bead on a spring that slides in what is driven, so that its motion feels how that turns."""
    n, name = s.space, s.fresh("q")
    value = Slot("coordinate.value", s.literal(LENGTH, s.number(0.2, 0.8)))
    s.add("coordinate", f"coordinate Length {name} = ", value, ";", name=name, data={"guess": False})
    q = reference(name, "coordinate", LENGTH, level="q")
    way = s.random.randrange(n)
    at = vector(*(q if k == way else s.literal(LENGTH, s.number(-0.5, 0.5)) for k in range(n)))
    place = node("frame*point", (frame, PRODUCT), " * ", (at, SIGNED), dim=LENGTH, type="point")
    mass = s.value(MASS, s.number(0.5, 2))
    s.add("mass", "mass ", Slot("mass.value", mass), " at ", Slot("mass.at", place), ";")
    spring = half(s, s.value(dim(1, 0, -2), s.number(3, 9)), square(q))
    s.add("energy", "potential ", Slot("potential", spring), ";", data={"what": "potential"})


def _turn(s: Scope) -> None:
    """A rotation of its own, given by poses or by its rate in its own axes."""
    name = s.fresh("r")
    by_rate = s.chance(0.3)
    if by_rate:
        start = Slot(
            "coordinate.value", call("rotx", s.literal(NUMBER, s.number(-1, 1), angle=True), type="pose")
        )
        s.add("rotation", f"coordinate Rotation {name} = ", start, ";", name=name)
    else:
        s.add("rotation", f"coordinate Rotation {name};", name=name)
    r = reference(name, "rotation", NUMBER, (4,), level="q", type="pose")
    w = der(r)
    w = E(w.kind, w.parts, RATE, (3,), w.level)
    drive(s, w if by_rate else r, vector(*(course(s, RATE) for _ in range(3))) if by_rate else turning(s))
    pose = node("frame*", (WORLD, PRODUCT), " * ", (r, SIGNED), dim=LENGTH, type="frame")
    f = s.fresh("f")
    s.add("frame", f"frame {f} = ", Slot("frame.value", pose), ";", name=f)
    frame = reference(f, "frame", LENGTH, level="q", type="frame")
    if s.chance(0.7):
        size = vector(*(s.literal(INERTIA, s.number(0.2, 0.35)) for _ in range(3)))
        j = call("diag", size, dim=INERTIA, shape=(3, 3))
        s.add("inertia", "inertia ", Slot("inertia.value", j), " on ", Slot("inertia.on", frame), ";")
    _slider(s, frame)
    ask(s, call("angvel", frame, dim=RATE, shape=(3,), level="qv"))
    ask(s, w)
    ask(s, call("reaction", r, dim=ENERGY, shape=(3,), level="qva"))


def _array(s: Scope) -> None:
    """Coordinates in an array, all of them or one driven, tied to another by their energy."""
    n, name = s.random.randint(2, 3), s.fresh("q")
    by_rate, whole = s.chance(0.4), s.chance(0.5)
    k = s.random.randint(1, n)
    q = reference(name, "coordinate", LENGTH, (n,), level="q")
    s.add("coordinate", f"coordinate Length {name}[{n}];", name=name)
    for i in range(1, n + 1):
        if by_rate or not (whole or i == k):
            text = f"{name}[{i}]"
            start = Slot("initial.value", s.literal(LENGTH, s.number(-0.5, 0.5)))
            s.add("initial", f"initial {text} = ", start, ";", name=text, data={"guess": False})
    moved = q if whole else element(q, k)
    d = over(LENGTH, TIME) if by_rate else LENGTH
    value = vector(*(course(s, d) for _ in range(n))) if whole else course(s, d)
    drive(s, der(moved) if by_rate else moved, value)
    other = s.fresh("q")
    start = Slot("coordinate.value", s.literal(LENGTH, s.number(-0.5, 0.5)))
    s.add("coordinate", f"coordinate Length {other} = ", start, ";", name=other, data={"guess": False})
    y = reference(other, "coordinate", LENGTH, level="q")
    energy = half(
        s,
        s.value(MASS, s.number(0.5, 2)),
        add(call("dot", der(q), der(q), dim=dim(0, 2, -2)), square(der(y))),
    )
    s.add("energy", "kinetic ", Slot("kinetic", energy), ";", data={"what": "kinetic"})
    shift = multiply(
        s.literal(dim(1, -2), s.number(0.05, 0.2)), multiply(y, element(q, s.random.randint(1, n)))
    )
    tie = multiply(shift, multiply(der(element(q, k)), der(y)))
    s.add("energy", "kinetic ", Slot("kinetic", tie), ";", data={"what": "kinetic"})
    stretch = add(y, element(q, k))
    spring = half(s, s.value(dim(1, 0, -2), s.number(1, 5)), square(stretch))
    s.add("energy", "potential ", Slot("potential", spring), ";", data={"what": "potential"})
    if whole:
        ask(s, call("reaction", q, dim=FORCE, shape=(n,), level="qva"))
    ask(s, der(y, 2))


def _joint(s: Scope) -> None:
    """A body on a joint of which some freedoms are driven, and a bead that slides in it."""
    n, body, name = s.space, s.fresh("b"), s.fresh("j")
    kind, freedoms = s.pick([(k, c) for k, c in joint_kinds(n) if c])
    mods: list[S] = [mod("m", "=", "modification.parameter", s.value(MASS, s.number(0.5, 2)))]
    if n == 2:
        inertia = s.value(INERTIA, s.number(0.1, 0.5))
    else:
        size = vector(*(s.literal(INERTIA, s.number(0.2, 0.35)) for _ in range(3)))
        inertia = call("diag", size, dim=INERTIA, shape=(3, 3))
    centre = vector(*(s.literal(LENGTH, s.number(-0.4, 0.4)) for _ in range(n)))
    mods += [
        mod("J", "=", "modification.parameter", inertia),
        mod("com", "=", "modification.parameter", centre),
    ]
    s.add("component", f"Body {body}", Seq(tuple(mods), "list"), ";", name=body, data={"class": "Body"})
    bind = statement("bind", Slot("component.from", WORLD), f" -> {body}.a", name="->")
    later: list[tuple[E, E]] = []
    starts: list[S] = []
    certain = s.random.randrange(len(freedoms))
    for number, (coordinate, what) in enumerate(freedoms):
        d = LENGTH if what.startswith("length") else NUMBER
        count = {"lengths": n, "angles": 2}.get(what, 0)
        full = f"{name}.{coordinate}"
        if what == "rotation":
            q = reference(full, "rotation", NUMBER, (4,), level="q", type="pose")
            if number == certain or s.chance(0.5):
                later.append((q, turning(s)))
            continue
        q = reference(full, "coordinate", d, (count,) if count else (), level="q")
        by_rate = s.chance(0.35)
        rd = over(d, TIME) if by_rate else d
        if number == certain or s.chance(0.4):
            value = vector(*(course(s, rd) for _ in range(count))) if count else course(s, rd)
            later.append((der(q) if by_rate else q, value))
            if not by_rate:
                continue
        start = (
            vector(*(s.literal(d, s.number(-0.5, 0.5)) for _ in range(count)))
            if count
            else s.literal(d, s.number(-0.5, 0.5))
        )
        starts.append(mod(coordinate, "=", "modification.initial", start))
    s.add("component", f"{kind} {name}", Seq((bind, *starts), "list"), ";", name=name, data={"class": kind})
    frame = reference(f"{body}.a", "frame", LENGTH, level="q", type="frame")
    _slider(s, frame)
    for q, value in later:
        drive(s, q, value)
    told = reference(name, "joint")
    ask(s, call("reaction", told, dim=FORCE, shape=(n,), level="qva"))
    ask(s, call("moment", told, dim=ENERGY, shape=() if n == 2 else (3,), level="qva"))
    ask(s, call("angvel", frame, dim=RATE, shape=() if n == 2 else (3,), level="qv"))
    q = later[0][0]
    if q.kind.startswith("ref:"):
        turned = q.kind == "ref:rotation"
        ask(s, call("reaction", q, dim=over(ENERGY, q.dim), shape=(3,) if turned else q.shape, level="qva"))
