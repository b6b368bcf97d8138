"""What acts said otherwise: energies and weights as forces, bodies as energies written as formulas."""

from __future__ import annotations

from random import Random

from msgspec.structs import replace

from ..flat import types
from ..flat.model import Derivative, Energy, Expression, FlatModel, Load
from .asked import ENERGIES, ModelFacts, defined_by, felt
from .rewriting import apply, dotted, half, measured, negative, number, product, squared, undrawn
from .twin import NotApplicable, Seen, Twin

ACCOUNTS = frozenset({"energy"})
"""Outputs that add up energies by what they are called."""
BODIES = frozenset({"mass_centre", "inertia_tensor"})


def energies_as_forces(model: FlatModel, seen: Seen | None, random: Random) -> Twin:
    """Write potentials of places as the force -1 along the energy itself, weights as forces, dampings as forces."""
    if felt(model, ENERGIES):
        raise NotApplicable("its motion feels its own energies, of which forces are not part")
    facts = ModelFacts(model)
    energies, loads = [], list(model.loads)
    said: dict[str, None] = {}
    for k, one in enumerate(model.energies):
        if one.kind != "potential" or facts.moves(one.value) or facts.jumps(one.value):
            energies.append(one)
            continue
        said["potentials"] = None
        minus = number(-1, types.NUMBER, one.value.span)
        loads.append(
            Load("force", f"potential[{k + 1}] as force", minus, one.value, None, None, None, one.origin)
        )
    masses = []
    for k, mass in enumerate(model.masses):
        masses.append(replace(mass, gravity=None))
        if mass.gravity is None or types.is_zero(mass.gravity):
            continue
        said["weights"] = None
        weight = product(mass.value, mass.gravity)
        loads.append(
            Load("force", f"weight[{k + 1}] as force", weight, mass.at, None, None, None, mass.origin)
        )
    dampings = []
    for damping in model.dampings:
        if damping.on.type.shape or facts.moves(damping.value) or facts.moves(damping.on):
            dampings.append(damping)
            continue
        said["dampings"] = None
        drag = negative(product(damping.value, _rate(model, damping.on)))
        loads.append(Load("force", damping.name, drag, damping.on, None, None, None, damping.origin))
    if not said:
        raise NotApplicable("nothing is stated as a potential, a weight or a damping")
    changed = replace(
        undrawn(model),
        energies=tuple(energies),
        masses=tuple(masses),
        loads=tuple(loads),
        dampings=tuple(dampings),
    )
    apart = ACCOUNTS | defined_by(model, ENERGIES)
    return Twin("energies as forces", ", ".join(said) + " written as forces", changed, apart)


def _rate(model: FlatModel, e: Expression) -> Expression:
    rate = types.real(e.type.dimension / measured(model, "time").dimension, e.type.shape)
    return Derivative(type=rate, span=e.span, operand=e)


def bodies_as_energies(model: FlatModel, seen: Seen | None, random: Random) -> Twin:
    """Write masses and inertias as kinetic and potential energies, which Lagrange's operator takes."""
    if felt(model, ENERGIES | BODIES):
        raise NotApplicable("its motion feels its own energies or bodies")
    facts = ModelFacts(model)
    masses = tuple(m for m in model.masses if facts.constant(m.value))
    inertias = tuple(i for i in model.inertias if facts.constant(i.value))
    if not masses and not inertias:
        raise NotApplicable("there is no mass or inertia that is constant")
    changing = replace(model, masses=masses, inertias=inertias)
    origin = model.origin
    energies = [*model.energies]
    energies += [Energy("kinetic", e, origin) for e in energy_of_bodies(changing)]
    energies += [Energy("potential", e, origin) for e in energy_of_weights(changing)]
    about = defined_by(model, BODIES)
    changed = replace(
        undrawn(model),
        definitions=tuple(d for d in model.definitions if d.name not in about),
        energies=tuple(energies),
        masses=tuple(m for m in model.masses if m not in masses),
        inertias=tuple(i for i in model.inertias if i not in inertias),
    )
    apart = ACCOUNTS | defined_by(model, ENERGIES | BODIES)
    return Twin("bodies as energies", "masses, inertias and weights as formulas of energies", changed, apart)


def energy_of_bodies(model: FlatModel) -> list[Expression]:
    """Return the kinetic energies of masses and inertias as formulas."""
    found: list[Expression] = []
    for mass in model.masses:
        v = apply("vel", measured(model, "velocity", (model.space,)), mass.at)
        found.append(product(half(mass.value), dotted(v, v)))
    for inertia in model.inertias:
        spin = measured(model, "rate", () if model.space == 2 else (3,))
        w = apply("angvel", spin, inertia.on)
        if model.space == 2:
            found.append(product(half(inertia.value), squared(w)))
            continue
        w = apply("components", spin, inertia.on, w)
        spun = types.real(inertia.value.type.dimension * w.type.dimension, (3,))
        found.append(half(dotted(w, apply("multiply", spun, inertia.value, w))))
    return found


def energy_of_weights(model: FlatModel) -> list[Expression]:
    """Return the potential energies of masses in their fields as formulas."""
    found: list[Expression] = []
    for mass in model.masses:
        if mass.gravity is not None and not types.is_zero(mass.gravity):
            place = apply("pos", measured(model, "length", (model.space,)), mass.at)
            found.append(negative(product(mass.value, dotted(mass.gravity, place))))
    return found
