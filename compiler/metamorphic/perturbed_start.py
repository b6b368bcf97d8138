"""Starts moved by tiny amounts: all that moves, and contacts that are closed, by parameters that are zero."""

from __future__ import annotations

from random import Random

from msgspec.structs import replace

from ..flat import types
from ..flat.model import Contact, Expression, FlatModel, InitialCondition, Role, StartValue, Variable
from .rewriting import named, number, product, total, undrawn
from .starts import MOVING, begun
from .twin import NotApplicable, Seen, Twin

SHAKE, LIFT = "start.shake", "start.lift"
"""Parameters of the twin: shares of sizes by which its start is moved."""
LEAST, MOST = 0.5, 1.0
"""Of its size: how far each state is moved."""
CLOSED = 1e-6
"""Share of the largest size up to which a gap counts as closed at the start."""


def start_perturbed(model: FlatModel, seen: Seen | None, random: Random) -> Twin:
    """Move the start of all that moves by shares of its sizes, some up, some down; hold, or open, what is closed."""
    if seen is None:
        raise NotApplicable("the sizes of what moves are not known")
    if not any(v.role in MOVING for v in model.variables):
        raise NotApplicable("nothing of it moves")
    span, sizes = model.origin.span, seen.sizes
    shake = named(SHAKE, types.NUMBER, span)

    def moved(name: str, value: Expression) -> Expression:
        far = random.choice((-1.0, 1.0)) * random.uniform(LEAST, MOST) * sizes.get(name, 1.0)
        return total(value, product(shake, number(far, value.type, span)))

    made = begun(undrawn(model), seen.first, moved)
    length = max(map(abs, sizes.values()), default=0.0)
    gaps = seen.evaluated([c.gap for c in model.contacts]) if model.contacts else []
    closed = [c for c, gap in zip(model.contacts, gaps, strict=True) if abs(gap[0]) <= CLOSED * length]
    shakes = (SHAKE, LIFT) if closed else (SHAKE,)
    zero = number(0, types.NUMBER, span)
    parameters = tuple(Variable(n, Role.PARAMETER, types.NUMBER, model.origin, value=zero) for n in shakes)
    made = replace(
        made,
        variables=(*parameters, *made.variables),
        initials=tuple(_opened(c, length) for c in closed),
    )
    says = "the start moved by tiny amounts" + (f", {len(closed)} closed contacts opened" if closed else "")
    return Twin("start perturbed", says, made, start=seen.first, shakes=shakes)


def _opened(contact: Contact, length: float) -> InitialCondition:
    """Return the condition that a gap is as far open as the parameter says."""
    span = contact.origin.span
    width = product(named(LIFT, types.NUMBER, span), number(length, contact.gap.type, span))
    return InitialCondition(contact.gap, StartValue(width, False, contact.origin), contact.origin)
