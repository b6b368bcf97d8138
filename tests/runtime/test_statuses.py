"""Every status of the kernel has its own words, in Python and in FMUs."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from hand_made import pendulum_problem
from msgspec.structs import replace

from mechc.runtime.integrate.kernel_failure import kernel_failure
from mechc.runtime.interface import AssertionEntry, Hybrid, HybridBranch, SwitchedRow
from mechc.runtime.native.kernel import ReportStruct
from mechc.runtime.native.status import Status

KERNEL = Path(__file__).resolve().parents[2] / "runtime" / "kernel"
NEEDS = {
    *(Status.NEEDS_JACOBIAN, Status.NEEDS_SEPARABLE, Status.NEEDS_MOMENTA),
    *(Status.NEEDS_SERIES, Status.NEEDS_ROWS, Status.NEEDS_STEPS),
}
"""Told before a run begins, by methods.py."""
FAILURES = [s for s in Status if s < 0 and s not in NEEDS]


def text_of(name: str) -> str:
    (path,) = KERNEL.rglob(name)
    return path.read_text(encoding="utf-8")


def test_python_has_the_statuses_of_the_header() -> None:
    (listed,) = re.findall(r"enum mech_status \{(.*?)\};", text_of("solver.h"), re.DOTALL)
    stated = {name: int(number) for name, number in re.findall(r"MECH_(\w+) = (-?\d+)", listed)}
    assert {s.name: s.value for s in Status} == stated


def words(status: Status, *rows: SwitchedRow) -> str | None:
    """What a run that ends with a status says, in a model that has one of everything, and further rows."""
    during, at_event = AssertionEntry("it holds", None), AssertionEntry("it holds at the event", None)
    hybrid = Hybrid((), (HybridBranch("x > 1", (at_event,), None),), (SwitchedRow("floor", "contact"), *rows))
    problem = replace(pendulum_problem(), hybrid=hybrid, assertions=(during,))
    failure = kernel_failure(problem, status, ReportStruct(), np.zeros(len(problem.states)))
    return None if failure is None else failure.message


def test_every_failure_has_its_own_words() -> None:
    told = {status.name: words(status) for status in FAILURES}
    assert None not in told.values()
    assert len(set(told.values())) == len(FAILURES), told


def test_coulomb_is_blamed_only_where_something_rubs() -> None:
    smooth, rough = words(Status.NO_MODE), words(Status.NO_MODE, SwitchedRow("floor.friction", "friction"))
    assert smooth is not None and rough is not None
    assert "Coulomb" in rough and "Coulomb" not in smooth and "which contacts press" in smooth


def test_what_is_no_failure_has_none() -> None:
    assert {words(s) for s in Status if s >= 0} == {None}


@pytest.mark.parametrize("status", sorted(NEEDS), ids=lambda s: s.name)
def test_a_run_cannot_have_begun_without_what_its_method_needs(status: Status) -> None:
    with pytest.raises(AssertionError, match=status.name):
        words(status)


def test_no_number_passes_for_another_status() -> None:
    with pytest.raises(ValueError, match="-99"):
        Status(-99)


def test_fmus_tell_each_failure_as_well() -> None:
    """What is not listed there gets the words of a method that does not fit."""
    told = set(re.findall(r"case MECH_(\w+):", text_of("phases.c") + text_of("fmi_events.c")))
    assert {s.name for s in FAILURES} - told == set()
