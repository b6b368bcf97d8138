"""The same model in units of another size: every number with a dimension is multiplied by powers of two.

All results must be those of the model times their own powers of two, to the last digits: nothing in a compiler knows what
a metre is.
"""

from __future__ import annotations

from fractions import Fraction
from random import Random
from typing import Any

import numpy as np

from random_models.compiled import Compiled, compiled, differences
from random_models.operators import multiply
from random_models.quantities import quantity
from random_models.tree import NUMBER, Dim, E, Model, map_expression, node

_GIVEN = {
    "Body": "m", "Bar": "m l", "Rod": "m l", "Disk": "m r", "Box": "m size", "Sphere": "m r", "Cylinder": "m r l",
    "Particle": "m", "Rolling": "r", "Screw": "pitch", "RollingOnCircle": "r track", "Spring": "k rest", "Damper": "c",
    "CentralField": "V0 r0", "InverseSquare": "k", "Gravitation": "m1 m2 G", "Coulomb": "q1 q2 epsilon0",
    "LinearDrag": "c", "QuadraticDrag": "k", "TorsionSpring": "k", "TorsionDamper": "c", "SpeedMotor": "gain",
    "UniformMagneticField": "q B", "Gear": "r1 r2", "Belt": "r1 r2", "Rack": "r", "Planetary": "r_sun r_ring", "Distance": "l",
}  # fmt: skip
"""What must be given, since the library has numbers with dimensions of its own there."""


def _size(d: Any, scale: tuple[int, int, int]) -> float:
    return float(2.0 ** float(sum(Fraction(e) * k for e, k in zip(d, scale, strict=False))))


def rescaled(model: Model, scale: tuple[int, int, int]) -> Model | None:
    """Multiply all quantities; None where the library's own numbers enter."""
    for s in model.top.seq().items:
        kind = str((s.data or {}).get("class", "")) if s.kind == "component" else ""
        if set(_GIVEN.get(kind, "").split()) - {m.name for m in (s.seq().items if kind else ())}:
            return None

    def change(e: E) -> E:
        if e.dim == NUMBER:
            return e
        if e.kind == "quantity" and e.data is not None:
            new = e.data * Fraction(_size(e.dim, scale))
            unit = str(quantity(1, e.dim)).partition(" ")[2]
            return node("quantity", f"{float(new):.17g} {unit}", dim=e.dim, binding=e.binding, data=new)
        if e.kind == "unit of a brace" or (e.kind == "quantity" and e.data is None):
            return multiply(node("number", repr(_size(e.dim, scale))), e)
        return e

    return model.rebuilt(lambda e, _: map_expression(e, change))


def _dimensions(base: Compiled) -> dict[str, Dim]:
    flat = base.model.compilation.flat
    found = {v.name: v.type.dimension.exponents for v in flat.variables}
    return found | {d.name: d.type.dimension.exponents for d in flat.definitions}


def factor(name: str, dimensions: dict[str, Dim], scale: tuple[int, int, int]) -> float | None:
    """Return by what a result is larger in the other units."""
    if name.startswith("d "):
        inner = factor(name[2:], dimensions, scale)
        return None if inner is None else inner * 2.0 ** -scale[2]
    if name == "time":
        return 2.0 ** scale[2]
    if name.startswith("energy."):
        return _size((1, 2, -2), scale)
    rate = name.startswith("der(")
    stem = name.removeprefix("der(").split("[")[0].split(")")[0]
    whole = name.removeprefix("der(").rstrip(")")
    d = dimensions.get(whole, dimensions.get(stem))
    if d is None:
        longest = max((n for n in dimensions if whole.startswith(n)), key=len, default=None)
        d = (
            dimensions[longest]
            if longest is not None and whole[len(longest) :].lstrip(")").startswith("[")
            else None
        )
    if d is None:
        return None
    return _size(d, scale) * (2.0 ** -scale[2] if rate else 1.0)


def scaled_difference(model: Model, base: Compiled, seed: int) -> list[tuple[str, float, float]] | None:
    """Compare at random states."""
    random = Random(seed)
    scale = (random.randint(-3, 3), random.randint(-3, 3), random.randint(-3, 3))
    other = rescaled(model, scale)
    if other is None:
        return None
    twin = compiled(other.text())
    if twin.switches or base.switches:
        return None
    dimensions = _dimensions(base)
    rng = np.random.default_rng(seed)
    for state in base.random_states(rng, 2):
        factors = {n: factor(n, dimensions, scale) for n in state}
        if any(f is None for f in factors.values()):
            return None
        there = {n: v * (factors[n] or 1.0) for n, v in state.items()}
        mine: dict[str, float] = {}
        theirs: dict[str, float] = {}
        values = twin.everything(there)
        for n, v in base.everything(state).items():
            f = factor(n, dimensions, scale)
            if f is not None:
                mine[n], theirs[n] = v, values[n] / f
        wrong = differences(mine, theirs, relative=1e-9)
        if wrong:
            return wrong
    return []
