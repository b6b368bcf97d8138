"""Random constraints, couplings, loops and prescribed motion."""

from __future__ import annotations

import math
from fractions import Fraction

from random_models.bodies import WORLD, given, mod
from random_models.expressions import Writer
from random_models.operators import (
    add,
    call,
    der,
    divide,
    multiply,
    vector,
)
from random_models.scope import Scope
from random_models.tree import (
    LENGTH,
    NUMBER,
    PRODUCT,
    SIGNED,
    TIME,
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

F = Fraction


def constraint(s: Scope) -> None:
    """Write a constraint between coordinates that can be fulfilled."""
    if len(s.coordinates) < 2:
        return
    a, b = s.random.sample(s.coordinates, 2)
    if "known:" + a.ref in s.notes:
        a, b = b, a
    if a in s.driven or b in s.driven or "held:" + a.ref in s.notes or "held:" + b.ref in s.notes:
        return
    s.notes |= {"held:" + a.ref}
    name = s.fresh("h")
    unit = over(a.dim, b.dim)
    r = s.random.random()
    if r < 0.25:  # between velocities, not integrable
        w = Writer(s, "q", kinks=False)
        c = multiply(s.literal(unit, s.number(0.2, 0.8)), call("sin", w.number(0), value=math.sin))
        left, right, word = der(a), multiply(c, der(b)), s.pick(("", "", "nonholonomic "))
    else:
        look = reference(b.ref, "coordinate", b.dim, level="q")
        x: E = look if b.dim == NUMBER else divide(look, s.value(b.dim))
        if s.chance(0.15):
            right = multiply(s.value(a.dim, s.number(0.2, 0.9)), Writer(s, "q").table(x))
        elif s.chance(0.5):
            right = multiply(s.value(a.dim, s.number(0.2, 0.9)), call("sin", x, value=math.sin))
        else:
            right = multiply(s.literal(unit, s.number(-0.9, 0.9)), b)
        left, word = a, s.pick(("", "", "holonomic "))
        if s.chance(0.3):
            t = reference("time", "time", TIME, level="t")
            right = add(
                right,
                multiply(
                    s.literal(a.dim, s.number(0.05, 0.3)),
                    call("sin", multiply(s.literal(dim(0, 0, -1)), t), value=math.sin),
                ),
            )
    if s.chance(0.3):
        left, right = right, left
    label = f"{name}: " if s.chance(0.85) else ""
    s.add(
        "constraint",
        f"{word}constraint {label}",
        Slot("constraint.left", left),
        " = ",
        Slot("constraint.right", right),
        ";",
        name=name if label else "",
    )
    if label:
        s.constraints.append((name, a.dim, False))


def coupling(s: Scope) -> None:
    """Put in a gear, belt, rack, planetary set or rod of the library."""
    angles = [
        q for q in s.coordinates if q.dim == NUMBER and "held:" + q.ref not in s.notes and q not in s.driven
    ]
    lengths = [
        q for q in s.coordinates if q.dim == LENGTH and "held:" + q.ref not in s.notes and q not in s.driven
    ]
    name = s.fresh("k")
    mods: list[S]
    s.notes.add("couplings")
    kind = s.pick(("Gear", "Belt", "Rack", "Planetary", "Distance"))
    r1, r2 = given(s, "r1", LENGTH, s.number(0.3, 0.8)), given(s, "r2", LENGTH, s.number(0.3, 0.8))
    if kind in ("Gear", "Belt") and len(angles) > 1:
        a, b = s.random.sample(angles, 2)
        mods = [
            mod("angle1", "=", "modification.input", a),
            mod("angle2", "=", "modification.input", b),
            r1,
            r2,
        ]
        s.notes.add("held:" + a.ref)
        if s.chance(0.5):
            mods.append(mod("offset", "=", "modification.parameter", s.literal(LENGTH, s.number(-0.3, 0.3))))
        s.constraints.append((f"{name}.{'mesh' if kind == 'Gear' else 'strand'}", LENGTH, False))
    elif kind == "Rack" and angles and lengths:
        a, b = s.pick(angles), s.pick(lengths)
        mods = [
            mod("angle", "=", "modification.input", a),
            mod("position", "=", "modification.input", b),
            given(s, "r", LENGTH, s.number(0.3, 0.8)),
        ]
        s.notes.add("held:" + a.ref)
        s.constraints.append((f"{name}.mesh", LENGTH, False))
    elif kind == "Planetary" and len(angles) > 2:
        a, b, c = s.random.sample(angles, 3)
        mods = [mod(k, "=", "modification.input", x) for k, x in (("sun", a), ("ring", b), ("carrier", c))]
        mods += [
            given(s, "r_sun", LENGTH, s.number(0.2, 0.5)),
            given(s, "r_ring", LENGTH, s.number(0.6, 0.9)),
        ]
        s.notes.add("held:" + a.ref)
        s.constraints.append((f"{name}.mesh", LENGTH, False))
    else:
        return
    s.add("component", f"{kind} {name}", Seq(tuple(mods), "list"), ";", name=name, data={"class": kind})


def loop(s: Scope) -> None:
    """Close a loop by a joint or a rod between the last body and the world, where lengths allow it."""
    n = s.space
    moving = [
        f for f in s.frames if f.type == "frame" and f.ref != "world" and f.ref.endswith((".b", ".c", ".a"))
    ]
    if not moving or len(s.coordinates) < (3 if n == 2 else 7):
        return
    end = moving[-1]
    anchor = s.fresh("f")
    offset = vector(*(s.literal(LENGTH, s.number(-0.4, 0.4)) for _ in range(n)))
    pose = node(
        "frame*",
        (WORLD, PRODUCT),
        " * ",
        (call("trans", offset, type="pose"), SIGNED),
        dim=LENGTH,
        type="frame",
    )
    s.add("frame", f"frame {anchor} = ", Slot("frame.value", pose), ";", name=anchor)
    name = s.fresh("j")
    kind = s.pick(("Revolute", "PinSlot", "Distance") if n == 2 else ("Spherical", "Distance"))
    mods = [
        statement(
            "bind",
            Slot("component.from", reference(anchor, "frame", LENGTH, type="frame")),
            " -> ",
            Slot("component.to", end),
            name="->",
        )
    ]
    if kind == "Distance":
        mods.append(given(s, "l", LENGTH, s.number(0.5, 1)))
        s.constraints.append((f"{name}.rod", LENGTH, False))
        s.notes.add("couplings")
    else:
        s.joints.append(name)
    cut = "cut " if kind != "Distance" and s.chance(0.3) else ""
    s.add("component", f"{cut}{kind} {name}", Seq(tuple(mods), "list"), ";", name=name, data={"class": kind})
    s.notes.add("loop")


def drive(s: Scope) -> None:
    """Prescribe a coordinate of its own, that moves something."""
    free = [
        q
        for q in s.coordinates
        if "." not in q.ref and "[" not in q.ref and q not in s.driven and "held:" + q.ref not in s.notes
    ]
    if not free or len(s.coordinates) < 2:
        return
    q = s.pick(free)
    t = reference("time", "time", TIME, level="t")
    w = multiply(s.value(dim(0, 0, -1)), t)
    value = add(
        s.literal(q.dim, s.number(-0.5, 0.5)),
        multiply(s.value(q.dim, s.number(0.1, 0.6)), call(s.pick(("sin", "cos")), w, value=math.sin)),
    )
    s.driven.append(q)
    kept = []
    for st in s.statements:  # a driven coordinate takes no initial value
        if st.kind == "initial" and st.name in (q.ref, f"der({q.ref})"):
            continue
        if st.kind == "coordinate" and st.name == q.ref and st.slots:
            kind = "Length" if q.dim == LENGTH else "Angle"
            st = statement("coordinate", f"coordinate {kind} {q.ref};", name=q.ref)
        kept.append(st)
    s.statements[:] = kept
    s.add("drive", "drive ", Slot("drive.target", q), " = ", Slot("drive.value", value), ";", name=q.ref)
