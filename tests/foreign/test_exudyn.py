"""Systems of Exudyn's tests and examples: what moves comes to the same place."""

from __future__ import annotations

import pytest
from foreign.exudyn_table import BOUND, EXAMPLES, Example, agreement, reference

KEPT = reference()


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda e: e.name)
def test_a_system_ends_where_exudyn_has_it(example: Example) -> None:
    assert agreement(example, KEPT[example.name]) < BOUND


def test_each_reference_belongs_to_a_system() -> None:
    assert set(KEPT) == {example.name for example in EXAMPLES}
