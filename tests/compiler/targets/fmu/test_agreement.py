"""How far two integrators may be apart."""

from __future__ import annotations

import numpy as np
import pytest

from mechc.compiler.targets.fmu.agreement import (
    AGREED,
    SAFETY,
    FmuMotion,
    agreement,
    apart,
    distance,
    motion_of,
    pace_of,
)

TIMES = np.linspace(0.0, 4.0, 5)


def test_distance_is_over_sizes_and_as_long_as_both_runs() -> None:
    a = np.array([[1.0, 10.0], [2.0, 20.0], [3.0, 30.0]])
    b = np.array([[1.5, 10.0], [2.0, 26.0]])
    assert distance(a, b, np.array([1.0, 3.0])).tolist() == [0.5, 2.0]


def saw(late: float, drop: float = 1.0) -> FmuMotion:
    """A state that rises at 1/s and falls by ``drop`` at 1.5 s and a little later, where it is 1.5."""
    states = TIMES[:, None] - drop * (TIMES[:, None] > 1.5 + late)
    sides = np.array([[[1.5 + late], [1.5 + late - drop]]])
    return FmuMotion(TIMES, 1.0, states, np.array([1.5 + late]), sides, np.ones(1))


def test_events_at_other_times_are_as_far_apart_as_they_are_in_time() -> None:
    size = np.array([2.0])
    pace = pace_of(saw(0.0), size)
    assert pace == 2.0
    found = apart(saw(0.0).states, saw(0.75), size, pace)
    assert found == pytest.approx([0, 0, 0.125, 0, 0]), (
        "a quarter of a second later it has risen by 0.25 and falls to 1.25"
    )
    late, early = saw(0.5 + 1e-6), saw(0.5 - 1e-6)
    assert distance(late.states, early.states, size)[2] == 0.5
    assert apart(late.states, early, size, pace) == pytest.approx([0, 0, 5e-7, 0, 0], abs=1e-9)


def test_events_excuse_no_other_motion() -> None:
    size = np.array([2.0])
    found = apart(saw(0.0, drop=1.1).states, saw(0.0), size, 2.0)
    assert found == pytest.approx([0, 0, 0.05, 0.05, 0.05])
    lost = saw(0.0).states.copy()
    lost[3] = np.nan
    assert np.isnan(apart(lost, saw(0.0), size, 2.0)[3])


def test_a_run_without_events_is_compared_at_the_same_times() -> None:
    quiet = motion_of(TIMES, 1.0, TIMES[:, None], [])
    assert apart(TIMES[:, None] + 0.5, quiet, np.ones(1), 1.0).tolist() == [0.5] * 5
    assert pace_of(quiet, np.ones(1)) == 0.0


def test_a_difference_within_the_errors_passes() -> None:
    error = np.array([0.0, 1e-6, 1e-5, 1e-5, 1e-4])
    found = agreement(TIMES, 0.5 * error, error, 1e-9)
    assert found.passed
    assert found.time == 4.0 and found.until == 4.0
    assert found.bound == 1e-4 + SAFETY * 1e-9


def test_a_difference_beyond_the_errors_so_far_fails() -> None:
    error = np.array([0.0, 1e-5, 1e-6, 1e-6, 1e-6])
    assert agreement(TIMES, np.array([0, 0, 9e-6, 0, 0]), error, 1e-9).passed, "errors that went by count on"
    found = agreement(TIMES, np.array([0, 2e-6, 0, 2e-5, 1.5e-5]), error, 1e-9)
    assert not found.passed
    assert found.time == 3.0
    assert str(found) == "2.0e-05 at time 3, the bound there is 1.0e-05"


def test_tolerances_are_allowed_where_errors_vanish() -> None:
    nothing = np.zeros(5)
    assert agreement(TIMES, nothing + 0.9 * SAFETY * 1e-9, nothing, 1e-9).passed
    assert not agreement(TIMES, nothing + 1.1 * SAFETY * 1e-9, nothing, 1e-9).passed


def test_chaos_ends_the_comparison() -> None:
    error = np.array([0.0, 1e-6, 1e-3, 2 * AGREED, 1e-6])
    found = agreement(TIMES, np.array([0, 0, 0, 1.0, 1.0]), error, 1e-9)
    assert found.passed
    assert found.until == 2.0


def test_what_is_no_number_fails() -> None:
    difference = np.array([0, 0, np.nan, 0, 0])
    assert not agreement(TIMES, difference, np.full(5, 1e-6), 1e-9).passed


def test_an_error_that_is_no_number_ends_the_comparison() -> None:
    error = np.array([0, 1e-6, np.nan, 1e-6, 1e-6])
    assert agreement(TIMES, np.zeros(5), error, 1e-9).until == 1.0
