"""Random models of curves agree with polynomials on few elements whose equations are written out by hand.

The reference (``tests/support/random_curves``) was written from docs/curves.md alone and shares no code with the compiler. Compared
are the value of what is stationary, the curve at nine places, outputs, multipliers and their densities, ends that are found, and
what kind of extremum it is. Bounds are thirty times the claimed error, and three times how far two discretisations of the
reference are apart; see ``random_curves.compare`` for what no error is claimed of.
"""

from __future__ import annotations

import pytest
from random_curves.compare import compare
from random_curves.statements import generate

REFUSED = ("no stationary curve", "has no curve")
"""Of some random models there is no curve, or Newton's method does not come from a random guess; that is said in words."""

NONE = {1}
"""A load that is more than a string of constant tension bears: there is no curve."""
QUICK = [seed for seed in range(25) if seed not in NONE]


def check(seed: int) -> bool:
    """Compare a model; tell whether there was something to compare."""
    model = generate(seed)
    report = compare(model)
    assert not report.disagreements, "\n".join([*report.disagreements, model.text])
    assert not report.refused or any(words in report.refused for words in REFUSED), report.refused
    return bool(report.compared)


@pytest.mark.parametrize("seed", QUICK)
def test_random_curve(seed: int) -> None:
    assert check(seed)


@pytest.mark.slow
@pytest.mark.parametrize("first", range(1000, 1200, 20))
def test_many_random_curves(first: int) -> None:
    compared = sum(check(seed) for seed in range(first, first + 20))
    assert compared >= 12
