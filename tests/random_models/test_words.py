"""What random models say in words of the language: units, formulas of parameters, settings of experiments."""

from __future__ import annotations

import re
from collections.abc import Callable
from random import Random

import pytest
from random_models.checks import compare_twin
from random_models.compiled import compiled
from random_models.from_outside import chosen, differs_from_text
from random_models.generator import generate
from random_models.measures import put_together
from random_models.planted import texts
from random_models.settings import settings
from random_models.tree import ENERGY, LENGTH, MASS, NUMBER, RATE, TIME, Model, dim
from random_models.twins import Twin, other_units, plain_units

from mechc.lang.units import UNIT_NAMES, parse_unit

SEED = 119
"""Of a model without switches that has formulas of parameters."""
FORMULA = r"parameter [^;\n]*= [^;\n]*\bp\d"


def test_units_are_what_they_are_by_definition() -> None:
    """Every unit with every prefix, alone and put together with others, has the size that the tables of the language give it."""
    random, seen = Random(1), set()
    for _ in range(12000):
        d = random.choice((MASS, LENGTH, TIME, RATE, ENERGY, NUMBER, dim(0, 0, 1, 1), dim(1, 0, -2)))
        text, size = put_together(d, random)
        unit = parse_unit(text)
        assert float(unit.factor / size) == pytest.approx(1, rel=1e-14), text
        assert unit.dimension.exponents == (*d, 0, 0, 0), text
        seen |= set(re.findall("[A-Za-z]+", text))
    assert seen == set(UNIT_NAMES)


def test_models_are_written_in_many_units() -> None:
    written = "\n".join(generate(seed).text() for seed in range(60))
    assert all(
        re.search(rf"\d [\w.^/()-]*\b{unit}\b", written)
        for unit in ("rpm", "rev", "h", "bar", "eV", "Wb", "au")
    )


@pytest.mark.parametrize("twin_of", [other_units, plain_units])
def test_other_units_are_the_same_model(twin_of: Callable[[Model, Random], Twin | None]) -> None:
    model = generate(SEED)
    twin = twin_of(model, Random(1))
    assert twin is not None and twin.model.text() != model.text()
    assert compare_twin(compiled(model.text()), twin, 1) == []


def test_experiments_set_parameters_whose_texts_are_formulas() -> None:
    """Of what they set some is a formula in the text, some a number in the place of a formula, some inside of components."""
    model = generate(SEED)
    base = compiled(model.text())
    twins = [settings(model, Random(k)) for k in range(6)]
    told = [t for t in twins if t is not None and re.search(FORMULA, t.model.text())]
    assert told and all(compare_twin(base, t, 1) == [] for t in told)
    assert any(re.search(r"experiment\([^;]*\w\.\w+ = ", texts(s)) for s in range(20))


def test_runs_are_given_what_a_text_may_say() -> None:
    model = generate(SEED)
    base = compiled(model.text())
    assert chosen(model, Random(1))
    assert differs_from_text(model, base, SEED) == []
    base.text = base.text.replace("sin(", "cos(")
    assert differs_from_text(model, base, SEED)


def test_inputs_go_on_with_time() -> None:
    written = [generate(seed).text() for seed in range(120)]
    own = [t for t in written if re.search(r"input [^;]*\btime\b", t)]
    assert any(re.search(r"(force|damping|output|equation) [^;]*\bu\d", t) for t in own)
    assert len(own) > 8
