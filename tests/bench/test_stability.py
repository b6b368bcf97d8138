"""The stability suite: complete, each expectation with its fault; a few cases run, and seen to fail."""

from __future__ import annotations

import pytest

from bench.stability.case import Known, Row
from bench.stability.faults import FAULTS, KernelEdit
from bench.stability.page import line
from bench.stability.perform import Question, case_of, maker, questions, titles, watched
from mechc.watchdog import Watchdog

FEW = {
    "fast mode damped",
    "light lower bob",
    "collision course",
    "Rotation, past it by 1e-7",
    "separatrix, 25 time units",
    "parallelogram",
    "ball without a contact",
    "stick-slip for 1000 cycles",
    "bond of two atoms in SI",
    "coupler too short",
    "mass zero from the start",
    "table with kinks",
}
"""Cases of a second each, of most groups and faults."""


def test_all_groups_are_there_and_every_fault_is_used() -> None:
    assert sorted(titles()) == list(range(1, 25))
    cases = [case_of(q) for q in questions(quick=False)]
    assert len({(q[0], case_of(q).name) for q in questions(quick=False)}) == len(cases)
    assert {case.fault for case in cases} == set(FAULTS)
    assert {case.name for case in cases} >= FEW
    assert all(not case.full for case in cases if case.name in FEW)


def test_every_mutant_of_the_kernel_fits_its_text() -> None:
    edits = [fault.plant for fault in FAULTS.values() if isinstance(fault.plant, KernelEdit)]
    assert len(edits) >= 5
    for edit in edits:
        assert edit.instead in edit.edited()[edit.file]


def test_an_answer_outside_its_claim_is_called_silent() -> None:
    import mechc

    solution = mechc.loads(
        "coordinate Length x = 1 m;\nkinetic 1/2*1 kg*der(x)^2;\nexperiment(stop = 1 s);"
    ).simulate()
    right = Known("stays", {"x": 1.0}, 1e-9).judge(solution)
    assert not right.silent and not right.problems and right.error == 0
    wrong = Known("moves", {"x": 2.0}, 1e-9).judge(solution)
    assert wrong.silent and wrong.problems


@pytest.mark.slow
def test_a_few_cases_are_met_and_fail_under_their_faults() -> None:
    few = [q for q in questions(quick=True) if case_of(q).name in FEW]
    with Watchdog[Question, Row](maker, "") as dog:
        rows = [watched(dog, q) for q in few]
    assert [line(row) for row in rows if row.kind != "met"] == []
    for fault in ("sign", "loose", "missed events", "no projection", "massless starts unchecked"):
        with Watchdog[Question, Row](maker, fault) as dog:
            for q in few:
                if case_of(q).fault == fault:
                    assert watched(dog, q).kind != "met", case_of(q).name
