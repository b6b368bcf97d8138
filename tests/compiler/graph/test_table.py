"""Cubic tables, and samples."""

import math
from fractions import Fraction

import numpy as np
import pytest
from scipy.interpolate import PchipInterpolator

from mechc.compiler.graph import Graph, Samples, Table, monotone_table
from mechc.compiler.graph.table import CELL, ELEMENT

POINTS = (0.0, 0.5, 2.0, 2.25, 4.0)


@pytest.mark.parametrize(
    "values", [(0.0, 1.0, 1.5, 3.0, 9.0), (1.0, -1.0, 4.0, 4.0, 0.0), (0.0, 5.0, 0.0, 1.0, 1.0)]
)
def test_agrees_with_scipy_inside(values: tuple[float, ...]) -> None:
    table = monotone_table(POINTS, values)
    peer = PchipInterpolator(POINTS, values)
    for x in np.linspace(0.0, 3.99, 57):
        for order in range(3):
            assert table(x, order) == pytest.approx(float(peer(x, order)), rel=1e-12, abs=1e-12)


def test_slopes_at_the_ends_are_limited() -> None:
    """The three-point formula gives 4.5 and would overshoot; three times the secant is allowed."""
    table = monotone_table((0.0, 1.0, 2.0), (0.0, 1.0, -5.0))
    assert table(0.0, 1) == 3.0
    assert float(PchipInterpolator((0.0, 1.0, 2.0), (0.0, 1.0, -5.0))(0.0, 1)) == 3.0
    assert monotone_table((0.0, 1.0, 2.0), (0.0, 1.0, 9.0))(0.0, 1) == 0.0


def test_goes_on_straight_outside() -> None:
    table = monotone_table(POINTS, (0.0, 1.0, 1.5, 3.0, 9.0))
    for end, x in ((0.0, -2.0), (4.0, 7.0)):
        slope = table(end, 1)
        assert table(x) == pytest.approx(table(end) + slope * (x - end), rel=1e-15)
        assert [table(x, k) for k in (1, 2, 3)] == [slope, 0.0, 0.0]
    assert np.isnan(table(float("nan")))


def test_value_and_slope_are_continuous() -> None:
    table = monotone_table(POINTS, (1.0, -1.0, 4.0, 4.0, 0.0))
    for x in POINTS:
        assert table(x - 1e-12) == pytest.approx(table(x), abs=1e-10)
        assert table(x - 1e-12, 1) == pytest.approx(table(x, 1), abs=1e-9)


def test_two_points_are_a_line() -> None:
    table = monotone_table((1.0, 3.0), (2.0, -2.0))
    assert [table(x) for x in (0.0, 1.5, 5.0)] == [4.0, 1.0, -6.0]


def test_bad_tables_are_refused() -> None:
    with pytest.raises(ValueError):
        monotone_table((0.0,), (1.0,))
    with pytest.raises(ValueError):
        monotone_table((0.0, 0.0), (1.0, 2.0))
    with pytest.raises(ValueError):
        monotone_table((0.0, 1.0), (1.0,))
    with pytest.raises(ValueError):
        Table((1.0, 0.0), (0.0, 0.0), (0.0, 0.0))


def test_samples_are_read_by_index_and_searched() -> None:
    """Beyond the ends the first and last ones stand; not-a-number is in the first cell, and what is read there by it is one, too."""
    samples = Samples((-1.0, 0.0, 2.0, 5.0))
    assert [samples(k, ELEMENT) for k in (-3.0, 0.0, 1.0, 3.0, 9.0)] == [-1.0, -1.0, 0.0, 5.0, 5.0]
    at = (-9.0, -1.0, -0.5, 0.0, 1.9, 2.0, 4.0, 5.0, 9.0, math.nan)
    assert [samples(x, CELL) for x in at] == [0, 0, 0, 1, 1, 2, 2, 2, 2, 0]
    assert [Samples((0.0, 1.0))(x, CELL) for x in (-1.0, 0.5, 3.0)] == [0, 0, 0]


def test_numbers_at_known_places_are_known() -> None:
    """So the drawn surface of a terrain is a list of numbers, not formulas of each of its points."""
    g = Graph()
    table = g.add_table(Samples((0.25, 1.5, 4.0)))
    index = g.cell(table, g.constant(2))
    assert g.value(index) == 1
    assert g.value(g.element(table, index)) == Fraction(3, 2)
    assert g.value(g.element(table, g.constant(7))) == 4
    assert not g.is_constant(g.element(table, g.symbol("i")))
