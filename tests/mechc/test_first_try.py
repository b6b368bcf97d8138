"""A run without a method is begun explicitly: what is not stiff is run once, what is stiff again with the Jacobian."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import mechc
from mechc.runtime.integrate.kernel_run import run_kernel
from mechc.runtime.native.build import find_compiler

pytestmark = pytest.mark.skipif(find_compiler() is None, reason="no C compiler")

OSCILLATOR = """model Oscillator
  dimensionless;
  parameter mu = {mu};
  coordinate Real x = 2;
  kinetic 1/2*der(x)^2;
  potential 1/2*x^2;
  force mu*(1 - x^2)*der(x) on x;
  experiment(stop = {stop});
end Oscillator;
"""


@pytest.fixture
def tries(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Return the steps of each run that the kernel makes."""
    made: list[int] = []

    def counted(*given: Any) -> Any:
        found = run_kernel(*given)
        made.append(found.statistics.steps)
        return found

    monkeypatch.setattr("mechc.runtime.studies.runs.companion.run_kernel", counted)
    monkeypatch.setattr("mechc.session.FEW_STEPS", 200)
    return made


def test_what_is_not_stiff_goes_on(tries: list[int]) -> None:
    model = mechc.loads(OSCILLATOR.format(mu=0.5, stop=400))
    found = model.simulate(estimate_error=False)
    assert tries == [found.statistics.steps]
    assert tries[0] > 1000
    asked = model.simulate(estimate_error=False, method="dop853")
    assert np.array_equal(found["x"], asked["x"])


def test_what_is_stiff_is_begun_again(tries: list[int]) -> None:
    found = mechc.loads(OSCILLATOR.format(mu=500.0, stop=100)).simulate(estimate_error=False)
    assert tries[0] == 200
    assert len(tries) == 2
    assert found.statistics.method == "radau5"
    assert found.outcome.value == "completed"
