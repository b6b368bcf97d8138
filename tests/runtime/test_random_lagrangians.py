"""No symmetry and no constant is found that is not there: random Lagrangians whose symmetries are known by how they are made.

Each stated formula is looked at along motions that SymPy and SciPy make of the Lagrangian, each generator in Noether's condition.
``python tests/runtime/test_random_lagrangians.py 1000`` goes through so many, or ``400 1000`` from one to the other, and prints what
was stated falsely, what was missed, and the smallest gap of singular values.
"""

from __future__ import annotations

import random
import re
import sys
from pathlib import Path
from typing import Any, NamedTuple

import pytest

import mechc

if __name__ == "__main__":
    sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "support"))

from lagrangian_motions import Motions

EPSILON = 1e-16
"""Below which a singular value relative to the largest is rounding."""

SHARE = 30
"""Of a thousand, in the slow tests."""


class Random(NamedTuple):
    """A random Lagrangian: the ``text`` of its model, its energies and damping, and the numbers of its point symmetries and of its
    independent constants of degree 2."""

    text: str
    kinetic: str
    potential: str
    damping: tuple[float, float]
    symmetries: int
    constants: int


class Judged(NamedTuple):
    """What is wrong with what was stated, what was missed of how many, and the smallest gap of singular values."""

    false: list[str]
    missed: list[str]
    known: int
    gap: float


def lagrangian(seed: int) -> Random:
    chance = random.Random(seed)

    def number(low: float = 0.3, high: float = 2.0) -> str:
        return f"{chance.choice((-1, 1)) * chance.uniform(low, high):.3f}"

    def size() -> str:
        return f"{chance.uniform(0.6, 2.0):.3f}"

    a, b, c = size(), size(), f"{chance.uniform(-0.4, 0.4):.3f}"
    kinetic = f"1/2*{a}*der(x)^2 + 1/2*{b}*der(y)^2 + {c}*der(x)*der(y)"
    powers = [(i, j) for i in range(5) for j in range(5) if 0 < i + j <= 4]
    quartic = " + ".join(f"({number()})*x^{i}*y^{j}" for i, j in powers)
    waves = f"({number()})*cos({number()}*x + {number()}*y) + ({number()})*sin({number()}*x + {number()}*y)"
    kind = seed % 6
    damping, further = (0.0, 0.0), ""
    symmetries, constants = 1, 1
    if kind == 0:
        potential = quartic
    elif kind == 1:
        potential = waves + f" + ({number()})*x^3"
    elif (
        kind == 2
    ):  # x is cyclic: time, momentum, boost; their functions of degree 2 are no more than energy and momentum
        potential = f"({number()})*y^4 + ({number()})*y^3 + ({number()})*cos({number()}*y)"
        symmetries, constants = 3, 2
    elif kind == 3:  # alike in all directions: time and rotation
        kinetic = f"1/2*{a}*(der(x)^2 + der(y)^2)"
        potential = f"({number()})*(x^2 + y^2) + ({number()})*(x^2 + y^2)^2 + ({number()})*(x^2 + y^2)^3"
        symmetries, constants = 2, 2
    elif kind == 4:  # driven: nothing
        potential = f"({quartic})*(1 + 0.3*sin({size()}*time))"
        symmetries, constants = 0, 0
    else:  # damped: nothing
        potential = quartic
        damping = float(size()), float(size())
        further = f"damping {damping[0]} on x; damping {damping[1]} on y;"
        symmetries, constants = 0, 0
    text = f"""\
model Random
  dimensionless;
  coordinate x = 0.4;
  coordinate y = -0.3;
  initial der(x) = 0.7;
  initial der(y) = 0.5;
  kinetic {kinetic};
  potential {potential};
  {further}
end Random;
"""
    return Random(text, kinetic, potential, damping, symmetries, constants)


def _written_out(one: dict[str, Any]) -> str:
    """Return the formula of a symmetry or a constant, without letters for its functions."""
    text = str(one["conserved"] if "conserved" in one else one["formula"])
    for name, function in one.get("where", {}).items():
        text = re.sub(rf"\b{name}\b", f"({function})", text)
    return text


def judged(seed: int) -> Judged:
    """Find symmetries and constants of a random Lagrangian, and look at each of them."""
    random = lagrangian(seed)
    model = mechc.loads(random.text)
    symmetries, invariants = model.symmetries(), model.invariants()
    told, constants = symmetries.details["symmetries"], invariants.details["invariants"]
    motions = Motions(random.kinetic, random.potential, random.damping, seed)
    false, missed = [], []
    formulas = [
        [_written_out(one) for one in group] for group in (told, constants, invariants.details["dependent"])
    ]
    false += [motions.false(text) for group in formulas for text in group]
    false += [motions.unsymmetric(one["generator"], one["conserved"]) for one in told]
    independent = motions.independent(formulas[1])
    if independent < len(constants):
        false.append(f"{len(constants)} constants, of which {independent} are independent")
    for what, found, there in (
        ("symmetries", len(told), random.symmetries),
        ("constants", len(constants), random.constants),
    ):
        if found > there:
            false.append(f"{found} {what} where there are {there}")
        elif found < there:
            missed += [what] * (there - found)
    gaps = [study.details["accuracy"]["gap"] for study in (symmetries, invariants)]
    gap = min(one["next"] / max(one["largest_zero"], EPSILON) for one in gaps)
    return Judged([text for text in false if text], missed, random.symmetries + random.constants, gap)


@pytest.mark.parametrize("seed", range(6))
def test_random_lagrangians(seed: int) -> None:
    found = judged(seed)
    assert not found.false and not found.missed


def test_what_is_false_is_told() -> None:
    """A number off by 1e-5, a term too many, a constant twice, digits that cancel, a wrong factor of a generator."""
    random = lagrangian(14)
    motions = Motions(random.kinetic, random.potential)
    energy = (
        "3/8*der(x)^2 + 0.792*der(y)^2 + 0.122*der(x)*der(y) - 19/25*y^4 - 1.124*y^3 + 1.151*cos(-0.506*y)"
    )
    momentum = "3/4*der(x) + 0.122*der(y)"
    assert not motions.false(energy) and not motions.false(momentum)
    assert "changes" in motions.false(energy.replace("0.792", "0.79201"))
    assert "changes" in motions.false(f"{momentum} + 1e-5*y")
    assert "no digit" in motions.false(f"1e-8*({momentum}) + sin(y)^2 + cos(y)^2")
    assert motions.independent([energy, momentum, f"{energy} + ({momentum})^2"]) == 2
    boost = "0.122*time*der(y) + 3/4*time*der(x) - 3/4*x - 0.122*y"
    assert not motions.unsymmetric("time*d/dx, F = 3/4*x + 0.122*y", boost)
    assert "not a symmetry" in motions.unsymmetric("time*d/dx, F = 3/4*x + 0.123*y", boost)
    assert "not the generator" in motions.unsymmetric("d/dt", momentum)


@pytest.mark.parametrize("seed", [20, 80])
def test_nearly_dependent_functions_are_no_part_of_a_momentum(seed: int) -> None:
    """Of y and sin(w y) rates nearly cancel; with 1e-8 of them a constant momentum was told as a long formula, and products of it
    fitted so badly that the momentum with such terms took the place of the energy."""
    text = lagrangian(seed).text
    numbers = re.search(r"kinetic 1/2\*(\S+)\*der\(x\)\^2 .* \+ (\S+)\*der\(x\)\*der\(y\);", text)
    assert numbers is not None
    a, c = map(float, numbers.groups())
    formula = mechc.loads(text).invariants().details["invariants"][0]["formula"]
    first, _, second = formula.partition(" + ")
    assert first == "der(x)" and second.endswith("*der(y)")
    assert float(second.removesuffix("*der(y)")) == pytest.approx(c / a, rel=1e-6)


@pytest.mark.parametrize("seed", range(6, SHARE))
@pytest.mark.slow
def test_more_random_lagrangians(seed: int) -> None:
    found = judged(seed)
    assert not found.false and not found.missed


def main(first: int, last: int) -> None:
    false = missed = known = 0
    gap = float("inf")
    for seed in range(first, last):
        found = judged(seed)
        false, missed, known = false + len(found.false), missed + len(found.missed), known + found.known
        if found.gap < gap:
            gap = found.gap
            print(f"{seed}: the smallest gap so far, {gap:.1e}", flush=True)
        for words in (
            *(f"false: {text}" for text in found.false),
            *(f"missed: {text}" for text in found.missed),
        ):
            print(f"{seed}: {words}", flush=True)
        if seed % 100 == 99:
            print(f"{seed + 1}: {false} false, {missed} missed of {known}", flush=True)
    print(f"{first} to {last}: {false} false, {missed} missed of {known}, smallest gap {gap:.1e}")


if __name__ == "__main__":
    bounds = [int(text) for text in sys.argv[1:]]
    main(*(bounds if len(bounds) == 2 else (0, bounds[0])))
