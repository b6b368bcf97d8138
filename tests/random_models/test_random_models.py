"""Random models agree with the values of their own text, with the definition of the language, and with their twins."""

from __future__ import annotations

from fractions import Fraction

import pytest
from random_models.checks import compare_twin, examined
from random_models.compiled import compiled
from random_models.generator import generate
from random_models.quantities import quantity
from random_models.shrink import shrunk
from random_models.tree import E, Model, map_expression
from random_models.twins import Twin
from slow_params import slow_but

KNOWN: dict[int, str] = {}
"""Seeds that disagree today, with the reason."""
_EXPORTS = ("exports", "units")
_MOTIONS = ("motion", "motions of twins", "twins")
_SLOW = (*_MOTIONS, *_EXPORTS)


def _seeds(first: int, last: int) -> list[object]:
    return [
        pytest.param(s, marks=pytest.mark.skip(KNOWN[s])) if s in KNOWN else s for s in range(first, last)
    ]


def _check(seed: int, without: tuple[str, ...]) -> None:
    report = examined(generate(seed), seed, without=without)
    assert not report.disagreements, report.disagreements[0]


@pytest.mark.parametrize("seed", slow_but([0, 1, 7], _seeds(0, 8)))
def test_random_model(seed: int) -> None:
    _check(seed, _SLOW)


@pytest.mark.slow
@pytest.mark.parametrize("seed", _seeds(0, 50))
def test_motion_of_a_random_model(seed: int) -> None:
    _check(seed, _EXPORTS)


@pytest.mark.slow
@pytest.mark.parametrize("seed", _seeds(50, 250))
def test_many_random_models(seed: int) -> None:
    _check(seed, _SLOW)


def test_the_same_seed_gives_the_same_text() -> None:
    assert generate(7).text() == generate(7).text()


def _with_another_number(model: Model) -> Model:
    """Change the first mass or length that is a literal of the model by a hundredth."""
    done = False

    def change(e: E) -> E:
        nonlocal done
        if done or e.kind != "quantity" or e.data is None or e.dim[2]:
            return e
        done = True
        return quantity(e.data * Fraction(101, 100), e.dim)

    return model.rebuilt(lambda e, _: map_expression(e, change))


@pytest.mark.slow
def test_a_twin_with_another_number_is_seen() -> None:
    seen = 0
    for seed in (5, 12, 14, 15, 17):
        model = generate(seed)
        found = compare_twin(compiled(model.text()), Twin("changed", _with_another_number(model)), seed)
        seen += bool(found)
    assert seen >= 4


def test_what_fails_becomes_small() -> None:
    model = generate(17)
    small = shrunk(model, lambda m: "kinetic" in m.text() or "Body" in m.text() or "Bar" in m.text(), 20)
    assert len(small.text()) < len(model.text()) / 4
