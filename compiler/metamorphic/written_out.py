"""Kinematics and loads written out: what functions and short forms stand for, term by term."""

from __future__ import annotations

from random import Random

from msgspec.structs import replace

from ..flat import types
from ..flat.model import Apply, Array, Contact, Element, Expression, FlatModel, Load, Query
from ..flat.operands import parts, stated
from .rewriting import apply, measured, negative, product, rewritten, total, undrawn
from .rewriting import number as constant
from .twin import ACCOUNTS, NotApplicable, Seen, Twin

TURN = (0.6, 0.8)
"""Cosine and sine of the angle by which the axes of a slip are turned."""


def written_out(model: FlatModel, seen: Seen | None, random: Random) -> Twin:
    """Write relative positions and velocities by those in the world, rotations about the opposite axis, loads with ``in``
    and ``from`` as two in the world, and slips on a surface in turned axes."""
    said: dict[str, None] = {}

    def change(e: Expression) -> Expression:
        found = _relative(model, e) if isinstance(e, Apply) else None
        if found is None:
            return e
        said[f"{e.function}()"] = None  # type: ignore[union-attr]
        return found

    made = rewritten(undrawn(model), change)
    asked = {p.target for p in parts(stated(model)) if isinstance(p, Query) and p.function == "power"}
    loads: list[Load] = []
    for load in made.loads:
        if load.name in asked or (load.frame is None and load.source is None):
            loads.append(load)
            continue
        said["loads"] = None
        loads += _load_and_opposite(load)
    contacts = tuple(_turned(c) for c in made.contacts)
    if contacts != made.contacts:
        said["slips"] = None
    if not said:
        raise NotApplicable(
            "it has no relative positions and velocities, rotations about axes, or loads between two"
        )
    made = replace(made, loads=tuple(loads), contacts=contacts)
    return Twin("written out", ", ".join(said) + " written out", made, ACCOUNTS)


def _relative(model: FlatModel, e: Apply) -> Expression | None:
    n = model.space
    length, velocity = (measured(model, what, (n,)) for what in ("length", "velocity"))
    match e.function, e.arguments:
        case "local", (frame, place):
            between = total(apply("pos", length, place), apply("pos", length, frame), "subtract")
            return apply("components", e.type, frame, between)
        case "vel", (place, frame):
            carried = apply("vel_at", velocity, frame, place)
            return apply(
                "components", e.type, frame, total(apply("vel", velocity, place), carried, "subtract")
            )
        case "angvel", (frame, other):
            spin = apply("angvel", e.type, frame)
            return spin if n == 2 else apply("components", e.type, other, spin)
        case "axis_angle", (axis, angle):
            return apply("axis_angle", e.type, negative(axis), negative(angle))
        case _:
            return None


def _load_and_opposite(load: Load) -> list[Load]:
    """Return a load in the world, and its opposite."""
    value = load.value
    if load.frame is not None and value.type.shape:
        value = apply("direction", types.real(value.type.dimension, value.type.shape), load.frame, value)
    found = [replace(load, value=value, source=None, frame=None)]
    if load.source is not None:
        opposite = negative(value)
        name = f"{load.name} opposite" if load.name else ""
        found.append(replace(found[0], name=name, value=opposite, on=load.source))
    return found


def _turned(contact: Contact) -> Contact:
    """Return a contact whose slip has its components along other axes of the surface: friction is the same along all."""
    along = contact.along
    if along is None or along.type.shape != (2,):
        return contact
    kind = types.element_of(along.type)
    s, t = (Element(type=kind, span=along.span, base=along, indices=(k,)) for k in range(2))
    c, d = (constant(x, types.NUMBER, along.span) for x in TURN)
    entries = (total(product(c, s), product(d, t)), total(product(c, t), product(d, s), "subtract"))
    return replace(contact, along=Array(type=types.numeric(along.type), span=along.span, elements=entries))
