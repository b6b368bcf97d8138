"""The same mechanics said otherwise: each twin of a model must move as the model does."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from random import Random

import numpy as np

from random_models.measures import put_together, sized
from random_models.operators import (
    call,
    der,
    divide,
    element,
    multiply,
    negate,
    power,
    two,
)
from random_models.quantities import quantity
from random_models.tree import (
    FORCE,
    LENGTH,
    NUMBER,
    TIME,
    Dim,
    E,
    Model,
    S,
    Slot,
    map_expression,
    node,
    statement,
)

_ENERGIES = {"energy", "kinetic_energy", "potential_energy", "power"}
_BODIES = {"mass_centre", "inertia_tensor"}


@dataclass(frozen=True)
class Twin:
    """A model that must do the same; ``ignored``: outputs that may differ (what energies are called)."""

    name: str
    model: Model
    ignored: tuple[str, ...] = ()
    names: Mapping[str, str] = field(default_factory=dict)
    """What is called otherwise there: heads of names."""
    base: Model | None = None
    """The model that it is a twin of, where that is not the one that was given."""


_HEAD = re.compile(r"^(d )?(der\()?(\w+)")


def renamed_name(twin: Twin, name: str) -> str:
    """Return what a state, an output or a parameter is called in the twin."""
    return _HEAD.sub(lambda m: f"{m[1] or ''}{m[2] or ''}{twin.names.get(m[3], m[3])}", name)


def _kinds(model: Model) -> set[str]:
    return {kind for kind, _ in model.pairs()}


def _energy_outputs() -> tuple[str, ...]:
    names = tuple(f"energy.{n}" for n in ("kinetic", "potential", "total", "supplied", "dissipated"))
    return names + tuple(f"d {n}" for n in names)


def shuffled(model: Model, random: Random) -> Twin | None:
    """Put the statements into another order, but what is due at one instant, which acts in the order of the text."""
    items = list(model.top.seq().items)
    whens = iter([s for s in items if s.kind == "when"])
    random.shuffle(items)
    items = [next(whens) if s.kind == "when" else s for s in items]
    return Twin("shuffled", model.with_top(tuple(items)))


def plain_units(model: Model, random: Random) -> Twin | None:
    """Write every quantity in SI."""

    def change(e: E) -> E:
        if e.kind != "quantity" or e.data is None:
            return e
        digits = f"{float(e.data):.17g}"
        plain = str(quantity(1, e.dim)).partition(" ")[2] if e.dim != NUMBER else "rad"
        if _cancels(e):
            return node("quantity", digits, dim=e.dim, binding=e.binding, value=e.value, data=e.data)
        return node("quantity", f"{digits} {plain}", dim=e.dim, binding=e.binding, value=e.value, data=e.data)

    return Twin("plain units", model.rebuilt(lambda e, _: map_expression(e, change)))


def other_units(model: Model, random: Random) -> Twin | None:
    """Write quantities in any units there are, and vectors of quantities in one unit behind the brace."""

    said: dict[tuple[Fraction, Dim], str] = {}

    def otherwise(e: E) -> str:
        if random.random() < 0.5:
            return str(e)
        text, size = put_together(e.dim, random) if e.dim != NUMBER else sized("rev", random)
        digits = f"{float(e.data / size):.17g}"
        if e.dim == TIME and Fraction(digits) * size != e.data:  # ticks belong together
            return str(e)
        return f"{digits} {text}"

    def change(e: E) -> E:
        if e.kind == "vector" and random.random() < 0.5:
            return _in_one_unit(e, random) or e
        if e.kind != "quantity" or e.data is None or _cancels(e):
            return e
        key = (
            Fraction(e.data),
            e.dim,
        )  # what stands twice stays the same to the last digit: laws may be told by it
        if key not in said:
            said[key] = otherwise(e)
        return node("quantity", said[key], dim=e.dim, binding=e.binding, value=e.value, data=e.data)

    return Twin("other units", model.rebuilt(lambda e, _: map_expression(e, change)))


def _cancels(e: E) -> bool:
    """Tell whether a number is written in units that cancel: unlike an angle it may stand in braces that have a unit."""
    return e.dim == NUMBER and any(sign in str(e).partition(" ")[2] for sign in "/^.")


def _in_one_unit(e: E, random: Random) -> E | None:
    """Write a vector of quantities as numbers with one unit behind the brace."""
    d = e.operands[0].dim if e.operands else NUMBER
    exact = [_exact(o) for o in e.operands]
    if None in exact or any(o.dim != d or _cancels(o) for o in e.operands):
        return None
    text, size = put_together(d, random) if d != NUMBER else sized("deg", random)
    digits = ", ".join(f"{float(x / size):.17g}" for x in exact if x is not None)
    values = [float(x) for x in exact if x is not None]
    return node("vector", f"{{{digits}}} {text}", dim=d, shape=e.shape, value=lambda: np.array(values))


def _exact(e: E) -> Fraction | None:
    """Return the value of a quantity, perhaps behind a sign, None of anything else."""
    if e.kind == "negate":
        inner = _exact(e.operands[0])
        return None if inner is None else -inner
    return Fraction(e.data) if e.kind == "quantity" and e.data is not None else None


def dampings_as_functions(model: Model, random: Random) -> Twin | None:
    """Write dampings as Rayleigh functions, or as forces where their coefficient knows no velocity."""
    changed = False
    energies = bool(_kinds(model) & _ENERGIES)

    def change(s: S) -> S | None:
        nonlocal changed
        if s.kind != "damping" or s.name:
            return s
        c, q = s.slot("damping.value"), s.slot("damping.on")
        changed = True
        if random.random() < 0.5 and not c.level & frozenset("v") and not energies:
            value = multiply(negate(c), der(q))
            return statement("force", "force ", Slot("force.value", value), " on ", Slot("force.on", q), ";")
        e = multiply(divide(c, two()), power(der(q), two(), Fraction(2)))
        return statement("energy", "dissipation ", Slot("dissipation", e), ";")

    other = model.rebuilt(lambda e, _: e, change)
    return Twin("dampings as functions", other, _energy_outputs()) if changed else None


def forces_by_components(model: Model, random: Random) -> Twin | None:
    """Write a force at a point as forces on the components of its position, a plane torque on the angle."""
    changed = False
    n = 3 if any("mech.spatial" in str(s.parts[0]) for s in model.items) else 2
    new: list[S] = []
    for s in model.top.seq().items:
        places = {x.place for x in s.slots}
        if s.kind == "force" and places == {"force.vector", "force.point"} and not s.name:
            f, p = s.slot("force.vector"), s.slot("force.point")
            name = f"component{len(new)}"
            new.append(statement("let", f"let {name} = ", Slot("let.value", f), ";", name=name))
            whole = E("ref:let", (), FORCE, (n,), f.level, 9, None, name)
            position = call("pos", p, dim=LENGTH, shape=(n,))
            new += [
                statement(
                    "force",
                    "force ",
                    Slot("force.value", element(whole, i)),
                    " on ",
                    Slot("force.on", element(position, i)),
                    ";",
                )
                for i in range(1, n + 1)
            ]
            changed = True
        elif s.kind == "torque" and n == 2 and places == {"torque.value", "torque.on"} and not s.name:
            angle = call("heading", s.slot("torque.on"))
            new.append(
                statement(
                    "force",
                    "force ",
                    Slot("force.value", s.slot("torque.value")),
                    " on ",
                    Slot("force.on", angle),
                    ";",
                )
            )
            changed = True
        else:
            new.append(s)
    return Twin("forces by components", model.with_top(tuple(new))) if changed else None


TWINS: tuple[Callable[[Model, Random], Twin | None], ...] = (
    shuffled, plain_units, dampings_as_functions, forces_by_components, other_units,
)  # fmt: skip
