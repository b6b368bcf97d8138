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
from random_models.lists import element_by_element
from random_models.measures import SHOP, UNITS, put_together
from random_models.mutants import texts
from random_models.placed import is_alone
from random_models.settings import settings
from random_models.tree import ENERGY, LENGTH, MASS, NUMBER, RATE, TIME, Model, Seq, dim, statement
from random_models.twins import Twin, other_units, plain_units
from random_models.wording import _with_other_imports, other_words

from mechc.lang.units import UNIT_NAMES, parse_unit

SEED = 119
"""Of a model without switches that has formulas of parameters."""
FORMULA = r"parameter [^;\n]*= [^;\n]*\bp\d"


@pytest.mark.slow
def test_units_are_what_they_are_by_definition() -> None:
    """Every unit with every prefix, alone and put together with others, has the size that the tables of the language give it."""
    random, seen = Random(1), set()
    for _ in range(12000):
        d = random.choice((MASS, LENGTH, TIME, RATE, ENERGY, NUMBER, dim(0, 0, 1, 1), dim(1, 0, -2)))
        text, size = put_together(d, random, {**UNITS, **SHOP})
        unit = parse_unit(text)
        assert float(unit.factor / size) == pytest.approx(1, rel=1e-14), text
        assert unit.dimension.exponents == (*d, 0, 0, 0), text
        seen |= set(re.findall("[A-Za-z]+|%", text))
    assert seen == set(UNIT_NAMES)


@pytest.mark.slow
def test_models_are_written_in_many_units() -> None:
    written = "\n".join(generate(seed).text() for seed in range(200))
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
    assert differs_from_text(model, compiled(base.text.replace("sin(", "cos(")), SEED)


@pytest.mark.slow
def test_inputs_go_on_with_time() -> None:
    written = [generate(seed).text() for seed in range(120)]
    own = [t for t in written if re.search(r"input [^;]*\btime\b", t)]
    assert any(re.search(r"(force|damping|output|equation) [^;]*\bu\d", t) for t in own)
    assert len(own) > 8


def test_lists_mean_what_they_mean_element_by_element() -> None:
    """What the twin says has no loop, no case and no index that is not a number; with another number in it it is another model."""
    seed = next(
        s
        for s in range(200)
        if "for i" in generate(s).text() and "structural parameter Integer N" in generate(s).text()
    )
    base = compiled(generate(seed).text(), quick=False)
    twin = element_by_element(generate(seed), Random(1))
    assert twin is not None and compare_twin(base, twin, 1) == []
    first = next(s for s in twin.model.top.seq().items if s.kind == "list" and "kinetic" in str(s.parts[0]))
    wrong = statement("list", str(first.parts[0]).replace("1/2", "2", 1))
    top = tuple(wrong if s is first else s for s in twin.model.top.seq().items)
    assert compare_twin(base, Twin("wrong", twin.model.with_top(top)), 1)


def test_other_words_are_the_same_model() -> None:
    twins = [other_words(generate(SEED), Random(k)) for k in range(5)]
    said = "\n".join(twin.model.text() for twin in twins if twin is not None)
    assert all(word in said for word in ("independent ", "//", "experiment other("))
    base = compiled(generate(SEED).text())
    assert all(compare_twin(base, twin, 1) == [] for twin in twins if twin is not None)


def test_other_imports_reach_the_classes_of_a_file() -> None:
    """A class that is one text holds parts of the library, too, and goes before a model of that name there."""
    held = statement("class", "model Held Body body; frame root = body.a; end Held;", name="Held")
    own = statement("class", "model Weld Weld2 inner; end Weld;", name="Weld")
    imports = (statement("import", "import mech.planar.*;"), statement("import", "import mech.fields.*;"))
    parts = [
        statement("component", line, name=line.split()[1]) for line in ("Revolute j", "Held b", "Weld w")
    ]
    model = Model((*imports, held, own, statement("model", "model M", Seq(tuple(parts)), "end M;", name="M")))
    said = {_with_other_imports(model, Random(k)).text() for k in range(9)}
    braces, alias = sorted(said, key=lambda text: "Lib" in text)
    assert "mech.planar.{Body, Revolute};" in braces
    assert all(line in alias for line in ("Lib.Body body;", "Lib.Revolute j", " Held b", " Weld w"))


@pytest.mark.slow
def test_every_list_can_be_written() -> None:
    written = [generate(seed).text() for seed in range(600)]
    assert sum("structural parameter Integer N" in text for text in written) > 25


@pytest.mark.parametrize("seed", [54, 63, 165])
def test_relations_mean_the_same_wherever_they_stand(seed: int) -> None:
    assert is_alone(seed)
    model = generate(seed)
    twin = element_by_element(model, Random(seed))
    assert twin is not None and "Plain" in twin.model.text()
    assert compare_twin(compiled(model.text()), twin, seed) == []
