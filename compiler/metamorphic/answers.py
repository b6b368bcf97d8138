"""Questions about energies written out: the formulas that they stand for."""

from __future__ import annotations

from fractions import Fraction
from functools import reduce
from random import Random

from ..flat import types
from ..flat.model import Apply, Derivative, Expression, FlatModel, Literal, Query
from ..flat.operands import children, parts, stated
from .asked import RATES, ModelFacts
from .energies import energy_of_bodies, energy_of_weights
from .rewriting import number, rewritten, total, undrawn
from .twin import NotApplicable, Seen, Twin

WRITTEN = frozenset({"energy", "kinetic_energy", "potential_energy"})


def answers_written_out(model: FlatModel, seen: Seen | None, random: Random) -> Twin:
    """Write kinetic_energy() and potential_energy() as the sums that they are, energy() as both where that is the energy."""
    asked = {p.function for p in parts(stated(model)) if isinstance(p, Query)} & WRITTEN
    if not asked:
        raise NotApplicable("nothing asks for its energies")
    facts = ModelFacts(model)
    own = [e.value for e in model.energies]
    if any(f"{q}?" in facts.within(*own) for q in WRITTEN):
        raise NotApplicable("an energy asks for another")
    kinetic = [e.value for e in model.energies if e.kind == "kinetic"]
    potential = [e.value for e in model.energies if e.kind == "potential"]
    plain = (
        not model.drives
        and not any(e.kind == "lagrangian" for e in model.energies)
        and not any("time" in facts.within(p) for p in (*kinetic, *[m.at for m in model.masses]))
        and not any("time" in facts.within(j.value) for j in model.joints)
        and not any(facts.moves(p) for p in potential)
        and all(_degree(p) == 2 for p in kinetic)
    )
    if "energy" in asked and not plain:
        raise NotApplicable(
            "its energy is not the sum of a quadratic kinetic and a potential energy of places"
        )
    T = _sum(model, [*kinetic, *energy_of_bodies(model)])
    V = _sum(model, [*potential, *energy_of_weights(model)])
    formulas = {"kinetic_energy": T, "potential_energy": V, "energy": total(T, V)}

    def change(e: Expression) -> Expression:
        return formulas.get(e.function, e) if isinstance(e, Query) and not e.arguments and not e.target else e

    says = ", ".join(f"{name}()" for name in sorted(asked)) + " written as the formulas that they stand for"
    return Twin("answers written out", says, rewritten(undrawn(model), change))


def _sum(model: FlatModel, terms: list[Expression]) -> Expression:
    dimension = types.NUMBER.dimension if model.dimensionless else types.ENERGY
    zero = number(0, types.real(dimension), model.origin.span)
    return reduce(total, terms) if terms else zero


def _degree(e: Expression) -> Fraction | None:
    """Return the degree of an expression in the rates that are written in it, None where it has none."""
    match e:
        case Derivative(order=1):
            return Fraction(1)
        case Apply(function=function) if function in RATES:
            return Fraction(1)
        case Apply(function="multiply" | "dot", arguments=(a, b)):
            x, y = _degree(a), _degree(b)
            return None if x is None or y is None else x + y
        case Apply(function="divide", arguments=(a, b)) if _degree(b) == 0:
            return _degree(a)
        case Apply(function="power", arguments=(a, Literal(value=Fraction() as n))):
            x = _degree(a)
            return None if x is None else x * n
        case Apply(function="add" | "subtract", arguments=(a, b)):
            x, y = _degree(a), _degree(b)
            return x if x == y else None
        case Apply(function="negate", arguments=(a,)):
            return _degree(a)
        case _:
            inside = {_degree(x) for x in children(e)}
            return Fraction(0) if inside <= {Fraction(0)} else None
