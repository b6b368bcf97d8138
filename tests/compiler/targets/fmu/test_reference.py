"""Reference results: what differences are measured by."""

from __future__ import annotations

import numpy as np
import pytest

from mechc.compiler.targets.fmu.reference import SMALL, FmuReference, deviation, parse_reference, sizes


def test_what_is_small_counts_by_the_largest_of_its_unit() -> None:
    columns = {"a": np.array([1.0, -4.0]), "b": np.array([1e-9, 0.0]), "c": np.array([2e-9, 0.0])}
    assert sizes(columns, {"a": "m", "b": "m", "c": "s"}) == {"a": 4.0, "b": 4.0 * SMALL, "c": 2e-9}


def test_a_rate_of_what_rests_counts_by_its_coordinate() -> None:
    columns = {"a": np.array([2.0, 2.0]), "der(a)": np.array([0.0, 1e-14])}
    assert sizes(columns, {"a": "rad", "der(a)": "rad/s"}, 4.0)["der(a)"] == SMALL * 2.0 / 4.0


def test_where_all_of_a_unit_are_zero_differences_count_as_they_are() -> None:
    time, zero = np.array([0.0, 1.0]), np.zeros(2)
    found = deviation(FmuReference("r.csv", time, {"a": zero}), time, {"a": zero + 1e-12}, {"a": "J"})
    assert found is not None and found.size == pytest.approx(1e-12)


def test_booleans_and_arrays_in_references() -> None:
    found = parse_reference("r.csv", 'time,b,y,"z[1,2]"\n0,true,1 2 3,5\n1,False,4 5 6,7\n')
    assert found.columns["b"].tolist() == [1.0, 0.0] and found.columns["z[1,2]"].tolist() == [5.0, 7.0]
    assert [found.columns[f"y[{k}]"].tolist() for k in (1, 2, 3)] == [[1.0, 4.0], [2.0, 5.0], [3.0, 6.0]]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("time,x\n", "there are no rows"),
        ("time,x\n0,1\n1\n", "not as long as the head"),
        ("time,x\n0,1\n1,1 2\n", "inhomogeneous"),
        ("time,x\n0,one\n", "one"),
        ("time,x\n1,0\n0,0\n", "no column 'time' that rises"),
    ],
)
def test_wrong_references(text: str, words: str) -> None:
    with pytest.raises(ValueError, match=words):
        parse_reference("r.csv", text)
