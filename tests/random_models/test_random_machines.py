"""Random machines with nodes without mass, frictions on them, laws by functions, delays and noise, against an integrator of their own."""

from __future__ import annotations

import pytest
from random_models.machines import examined
from slow_params import slow_but


@pytest.mark.parametrize("seed", slow_but([4, 123], range(60)))
def test_a_random_machine(seed: int) -> None:
    assert not examined(seed)


@pytest.mark.slow
@pytest.mark.parametrize("first", range(60, 300, 40))
def test_many_random_machines(first: int) -> None:
    assert not {seed: found for seed in range(first, first + 40) if (found := examined(seed))}
