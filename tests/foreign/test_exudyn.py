"""Systems of Exudyn's tests and examples: what moves comes to the same place."""

from __future__ import annotations

import pytest
from foreign.exudyn_case import Example
from foreign.exudyn_table import BOUND, EXAMPLES, QUICK, agreement, reference
from msgspec.structs import replace

KEPT = reference()
NAMED = {e.name: e for e in EXAMPLES}


@pytest.mark.parametrize(
    "example",
    [pytest.param(e, id=e.name, marks=[] if e.name in QUICK else [pytest.mark.slow]) for e in EXAMPLES],
)
def test_a_system_ends_where_exudyn_has_it(example: Example) -> None:
    assert agreement(example, KEPT[example.name]) < BOUND


@pytest.mark.parametrize(
    "name, right, wrong",
    [
        ("springs_that_break", "> 400 N", "> 500 N"),
        ("two_arms_on_oil", "0.008", "0.0081"),
        ("slider_crank_in_space", "com = r/2", "com = 0.501*r"),
        ("train_of_gears", "ratio = -1/3", "ratio = -0.333"),
    ],
)
def test_a_wrong_model_is_seen(name: str, right: str, wrong: str) -> None:
    example = NAMED[name]
    assert right in example.text
    assert agreement(replace(example, text=example.text.replace(right, wrong)), KEPT[name]) > 1e-5


def test_each_reference_belongs_to_a_system() -> None:
    assert set(KEPT) == {example.name for example in EXAMPLES}
