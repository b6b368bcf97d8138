"""Random states, inputs, discrete variables, events, friction and contacts."""

from __future__ import annotations

import math
from fractions import Fraction
from random import Random

from random_models.expressions import Writer
from random_models.loads import writer
from random_models.operators import (
    add,
    call,
    der,
    divide,
    levels,
    multiply,
    negate,
    relation,
    subtract,
    vector,
)
from random_models.questions import question
from random_models.scope import Scope
from random_models.tree import (
    ENERGY,
    FORCE,
    LENGTH,
    NUMBER,
    SPEED,
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
    times,
)

F = Fraction


def state(s: Scope) -> None:
    """Write a first-order state that follows something."""
    d = s.pick((FORCE, LENGTH, NUMBER, ENERGY, SPEED))
    name = s.fresh("x")
    kinds = {FORCE: "Force", LENGTH: "Length", NUMBER: "Real", ENERGY: "Energy", SPEED: "Velocity"}
    if s.chance(0.8):
        s.add(
            "state",
            f"state {kinds[d]} {name}{s.pick((' = ', ' ~ '))}",
            Slot("state.value", s.literal(d, s.number(-1, 1))),
            ";",
            name=name,
            data={"guess": False},
        )
    else:
        s.add("state", f"state {kinds[d]} {name};", name=name)
    x = reference(name, "state", d, level="x")
    s.signals.append(x)
    goal = writer(s).scalar(d, 2)
    tau = s.value(TIME, s.number(0.3, 1.5))
    right = (
        divide(subtract(goal, x), tau)
        if s.chance(0.7)
        else add(negate(divide(x, tau)), writer(s).scalar(over(d, TIME), 1))
    )
    s.add("equation", f"equation der({name}) = ", Slot("equation", right), ";", name=name)


def over_time(s: Scope) -> None:
    """Integrate something over time."""
    name = s.fresh("y")
    e = node(
        "integral.time", "integral(", writer(s).scalar(s.pick((FORCE, LENGTH, NUMBER)), 1), ")", level="x"
    )
    e = E(e.kind, e.parts, times(e.operands[0].dim, TIME), (), e.level | levels("x"))
    s.add("let", f"let {name} = ", Slot("let.value", e), ";", name=name)
    s.signals.append(reference(name, "let", e.dim, level="x"))


def input_(s: Scope) -> None:
    """Declare an input with a default of parameters and time."""
    d = s.pick((FORCE, LENGTH, NUMBER, ENERGY, dim(0, 0, -1)))
    kinds = {FORCE: "Force", LENGTH: "Length", NUMBER: "Real", ENERGY: "Energy", dim(0, 0, -1): "Frequency"}
    name = s.fresh("u")
    default = s.literal(d) if s.chance(0.4) else Writer(s, "t").scalar(d, 1)
    option = s.pick(("", "", '(interpolation = "step")', '(interpolation = "spline")'))
    s.add("input", f"input {kinds[d]} {name}{option} = ", Slot("input.value", default), ";", name=name)
    s.signals.append(reference(name, "input", d, level="u"))
    if s.chance(0.3):
        input_(s)


def discrete(s: Scope) -> None:
    """Declare a discrete variable and something that changes it."""
    kind = s.pick(
        ("Real", "Real", "Real", "Integer") if s.clocks else ("Real", "Integer", "Boolean", "Force")
    )
    name = s.fresh("n")
    d = FORCE if kind == "Force" else NUMBER
    if kind == "Boolean":
        first: E = node(s.pick(("true", "false")), s.pick(("true", "false")), type="boolean")
        first = node(
            str(first.parts[0]), str(first.parts[0]), type="boolean", value=lambda: first.parts[0] == "true"
        )
        s.conditions.append(reference(name, "discrete", NUMBER, level="z", type="boolean"))
    elif kind == "Integer":
        first = node("number", str(s.random.randint(0, 3)), value=lambda: 0)
    else:
        first = s.literal(d, s.number(-1, 1))
    s.add("discrete", f"discrete {kind} {name} = ", Slot("discrete.value", first), ";", name=name)
    n = reference(name, "discrete", d, level="z", type="boolean" if kind == "Boolean" else "real")
    if kind != "Boolean":
        s.signals.append(n)
        if d == NUMBER:
            s.counters.append(n)
    when(s, (n, kind))
    if s.chance(0.5):
        discrete(s)


def _period(s: Scope) -> Fraction:
    """Choose the period of a clock, now and then a multiple of another or a part of it, so that ticks belong together."""
    if s.clocks and s.chance(0.6):
        return s.pick(s.clocks) * s.pick((F(1), F(2), F(3), F(3), F(1, 2), F(1, 3), F(1, 3), F(2, 3)))
    s.clocks.append(s.pick((F(1, 10), F(1, 5), F(1, 20), s.number(0.1, 0.6))))
    return s.clocks[-1]


def when(s: Scope, sets: tuple[E, str] | None = None) -> None:
    """Write an event."""
    w = Writer(s, "tzxqv", kinks=False)
    r = s.random.random()
    if r < (0.7 if s.clocks and sets else 0.4) or not s.signals:
        period = s.literal(TIME, _period(s))
        tail: list[str | Slot] = (
            [", ", Slot("sample.start", s.literal(TIME, s.number(0.05, 0.3)))] if s.chance(0.15) else []
        )
        condition: list[str | Slot] = ["sample(", Slot("sample.period", period), *tail, ")"]
    elif r < 0.6:
        t = reference("time", "time", TIME, level="t")
        condition = [
            Slot("when.condition", relation(s.pick((">=", ">")), t, s.literal(TIME, s.number(0.05, 0.9))))
        ]
    else:
        e = w.signal() or reference("time", "time", TIME, level="t")
        condition = [
            Slot("when.condition", relation(s.pick(("<", ">")), e, s.literal(e.dim, s.number(-1, 1))))
        ]
    actions: list[S] = []
    look = Writer(s, "tzxqvu", kinks=True)
    if sets is not None:
        n, kind = sets
        if kind == "Boolean":
            value = (
                node("not", "not ", (n, 3), type="boolean", binding=3) if s.chance(0.6) else look.condition(1)
            )
        elif kind == "Integer":
            value = (
                add(n, node("number", "1"))
                if s.chance(0.7)
                else add(node("pre", "pre(", n, ")", level="z"), node("number", "2"))
            )
        elif kind == "Real" and len(s.counters) > 1 and s.chance(0.7):
            value = add(multiply(s.literal(NUMBER, F("0.7")), n), s.pick(s.counters))
        else:
            value = look.scalar(n.dim, 1)
        actions.append(statement("assign", f"{n.ref} := ", Slot("assign.value", value), ";", name=n.ref))
    if sets is None or s.chance(0.3):
        free = [q for q in s.coordinates if q not in s.driven and "held:" + q.ref not in s.notes]
        if free and not s.locked:
            q = s.pick(free)
            value = multiply(
                s.literal(NUMBER, s.number(0.3, 0.9)),
                der(q) if s.chance(0.6) else node("pre", "pre(", der(q), ")", dim=over(q.dim, TIME)),
            )
            actions.append(
                statement(
                    "reinit",
                    "reinit(",
                    Slot("reinit.target", der(q)),
                    ", ",
                    Slot("reinit.value", value),
                    ");",
                )
            )
        elif s.space and s.bodies:
            j = vector(*(s.literal(times(FORCE, TIME), s.number(-0.3, 0.3)) for _ in range(s.space)))
            actions.append(
                statement(
                    "impulse",
                    "impulse ",
                    Slot("impulse.value", j),
                    " on ",
                    Slot("impulse.on", s.pick(s.bodies)),
                    ";",
                )
            )
    if not actions:
        return
    if sets is not None and sets[1] in ("Integer", "Real") and s.chance(0.5):
        actions.append(_after(s, sets[0]))
    others: list[str | Slot | Seq] = []
    if s.chance(0.25):  # another branch whose turn it is at the same instants, or at others
        there: list[str | Slot] = (
            condition
            if s.chance(0.5)
            else [Slot("when.condition", relation(">", reference("time", "time", TIME, level="t"), s.literal(TIME, F("0.3"))))]
        )  # fmt: skip
        others = [" elsewhen ", *there, " then", Seq((_after(s, sets[0] if sets else None),))]
    s.add("when", "when ", *condition, " then", Seq(tuple(actions)), *others, "end when;")


def _after(s: Scope, n: E | None) -> S:
    """Set a discrete variable of its own, by what another was before the event."""
    name = s.fresh("k")
    first = s.literal(NUMBER, s.number(-1, 1))
    s.add("discrete", f"discrete Real {name} = ", Slot("discrete.value", first), ";", name=name)
    k = reference(name, "discrete", NUMBER, level="z")
    s.signals.append(k)
    others = [c for c in s.counters if n is None or c.ref != n.ref]
    step = multiply(s.literal(NUMBER, F("0.4")), s.pick(others)) if others and s.chance(0.6) else None
    s.counters.append(k)
    value: E = add(k, step or s.literal(NUMBER, F("0.5")))
    if n is not None and n.type == "real" and n.dim == NUMBER:
        before = node("pre", "pre(", n, ")", level="z")
        value = add(multiply(s.literal(NUMBER, s.number(0.3, 0.9)), before), k)
    return statement("assign", f"{name} := ", Slot("assign.value", value), ";", name=name)


def friction(s: Scope) -> None:
    """Write dry friction on a coordinate or a length."""
    free = [
        q
        for q in s.coordinates
        if q not in s.driven and "rubs:" + q.ref not in s.notes and "held:" + q.ref not in s.notes
    ]
    if not free:
        return
    q = s.pick(free)
    s.notes.add("rubs:" + q.ref)
    name = s.fresh("R")
    limit = s.value(over(ENERGY, q.dim), s.number(0.1, 0.6))
    r = s.random.random()
    if r < 0.25:
        asked = question(s)
        if asked is not None and not s.in_class:
            limit = multiply(
                s.literal(over(limit.dim, asked.dim), s.number(0.05, 0.2)), call("abs", asked, dim=asked.dim)
            )
    elif r < 0.5:
        w = Writer(s, "tqx", kinks=False)
        limit = multiply(limit, add(s.literal(NUMBER, F("1.3")), call("sin", w.number(0), value=math.sin)))
    on: E = q
    if s.chance(0.3):
        t = reference("time", "time", TIME, level="t")
        on = subtract(q, multiply(s.literal(over(q.dim, TIME), s.number(0.05, 0.3)), t))
    label = f"{name}: " if s.chance(0.6) else ""
    if label:
        s.powers.append(name)
    tail = ', law = "regularized", v_stick = ' if s.chance(0.3) else ""
    options: list[str | Slot] = (
        [tail, Slot("friction.v_stick", s.literal(over(q.dim, TIME), F("0.05")))] if tail else _usual_law(s)
    )
    static: list[str | Slot] = []
    if s.chance(0.3) and not tail:
        static = [" static ", Slot("friction.static", multiply(s.literal(NUMBER, F("1.4")), limit))]
    s.add(
        "friction",
        f"friction {label}",
        Slot("friction.value", limit),
        *static,
        " on ",
        Slot("friction.on", on),
        *options,
        ";",
        name=name if label else "",
    )
    s.notes.add("hybrid")


def _rubbing(s: Scope, slips: list[E]) -> list[str | Slot]:
    """Let a contact rub along one velocity, or along two."""
    low = s.number(0.05, 0.3)
    parts: list[str | Slot] = [" friction ", Slot("contact.friction", s.value(NUMBER, low))]
    smooth = s.chance(0.3)
    if not smooth and s.chance(0.5):
        parts += [" static ", Slot("contact.static", s.value(NUMBER, 2 * low))]
    two_ways = len(slips) > 1 and s.chance(0.6)
    along = vector(*s.random.sample(slips, 2)) if two_ways else s.pick(slips)
    parts += [" along ", Slot("contact.along", along)]
    if smooth:
        return [
            *parts,
            ', law = "regularized", v_stick = ',
            Slot("contact.v_stick", s.literal(SPEED, F("0.05"))),
        ]
    return parts + _usual_law(s)


def _usual_law(s: Scope) -> list[str | Slot]:
    """Name now and then the law that holds without a name, by a random number of its own: models keep all else."""
    return [', law = "stick"'] if Random(hash(s.random.getstate()[1])).random() < 0.25 else []


def contact(s: Scope) -> None:
    """Write a contact that is open at the start."""
    free = [q for q in s.coordinates if q not in s.driven]
    if not free:
        return
    q = s.pick(free)
    name = s.fresh("C")
    sign = s.chance(0.5)
    far, rate = s.number(1, 1.8), s.starts.get(f"der({q.ref})")
    near = q.ref in s.starts and s.chance(0.75)
    if near:  # reached soon
        sign = rate < 0 if rate else sign
        far = s.number(0.01, 0.12) + (-1 if sign else 1) * s.starts[q.ref]
    edge = s.literal(q.dim, far)
    gap = add(edge, q) if sign else subtract(edge, q)
    if s.chance(0.3):
        t = reference("time", "time", TIME, level="t")
        gap = add(
            gap,
            multiply(
                s.literal(q.dim, s.number(0.05, 0.15)),
                call("sin", multiply(s.literal(dim(0, 0, -1)), t), value=math.sin),
            ),
        )
    elif s.chance(0.3) and len(free) > 1:
        other = s.pick([o for o in free if o != q])
        unit: E = other if other.dim == NUMBER else divide(other, s.literal(other.dim))
        shape = s.pick(("abs", "max") if near else ("abs", "sin", "max"))
        bend = (
            call("abs", unit)
            if shape == "abs"
            else call("sin", unit)
            if shape == "sin"
            else call("max", unit, node("number", "0"))
        )
        gap = add(gap, multiply(s.literal(q.dim, s.number(0.1, 0.3)), bend))
    parts: list[str | Slot] = [f"contact {name}: ", Slot("contact.gap", gap)]
    if s.chance(0.6):
        parts += [" restitution ", Slot("contact.restitution", s.value(NUMBER, s.number(0.2, 0.9)))]
    slips = [
        der(o) if o.dim == LENGTH else multiply(s.literal(LENGTH, s.number(0.2, 0.6)), der(o))
        for o in free
        if o != q and o.dim in (LENGTH, NUMBER)
    ]
    if q.dim == LENGTH and s.chance(0.65) and slips:
        parts += _rubbing(s, slips)
    if s.chance(0.15):
        parts += [', impacts = "simultaneous"'] if not any(p == " friction " for p in parts) else []
    s.add("contact", *parts, ";", name=name)
    s.constraints.append((name, q.dim, True))
    s.conditions.append(call("closed", reference(name, "contact"), type="boolean", level="e"))
    s.notes.add("hybrid")
    s.notes.add("contact")
