"""Planted faults: each fits the text that it changes, and what they come to is judged as the page says."""

from __future__ import annotations

from pathlib import Path

import pytest
from msgspec.structs import replace

import mechc
from bench.mutants import energy, former
from bench.mutants.fault import DoesNotFit, Fault, changed, edit
from bench.mutants.judged import DOUBTFUL, Found, Judge, Run, Stressed
from bench.mutants.page import row

EVERY = (*energy.FAULTS, *former.FAULTS)


def test_every_fault_fits_the_text_that_it_changes() -> None:
    assert len(energy.FAULTS) >= 20 and all(not f.point for f in energy.FAULTS)
    assert {f.point for f in former.FAULTS} == {"1", "2", "3", "4", "5", "6", "7", "8", "9", "12", "13"}
    assert len({f.text for f in EVERY}) == len(EVERY)
    for fault in EVERY:
        assert all(text for text in changed(fault.edits).values())


def test_text_that_changed_is_told() -> None:
    with pytest.raises(DoesNotFit, match="0 times in"):
        changed(edit("mechc/__main__.py", "no such text", ""))


@pytest.mark.parametrize("text", sorted({f.model for f in EVERY if "velocities jump" not in f.text}))
def test_models_of_faults_are_right_ones(text: str) -> None:
    """They compile; that they run without a doubt the page itself says."""
    assert mechc.loads(text).name


RIGHT = Run("completed", 0, 1e-9, 1e-9, 1.0, (1.0,))
LOUD = Run("completed, but", DOUBTFUL, 1e-3, 1e-9, 1.0, (1.0,))
CALM = Stressed(0, {"": "right"})
FAULT = Fault("a fault", (), "")


@pytest.mark.parametrize(
    ("mutant", "stressed", "point", "good"),
    [
        (LOUD, Stressed(DOUBTFUL, {"": "doubtful"}), "", True),
        (replace(LOUD, code=0), CALM, "", False),
        (replace(LOUD, code=1), Stressed(1, {"": "wrong"}), "", False),
        (replace(RIGHT, off=9e-9), CALM, "", True),
        (replace(RIGHT, off=9e-9), CALM, "3", False),
        (replace(RIGHT, off=9e-9), Stressed(0, {"": "rough"}), "3", True),
    ],
)
def test_what_is_as_it_must_be(mutant: Run, stressed: Stressed, point: str, good: bool) -> None:
    found = Found(replace(FAULT, point=point), RIGHT, CALM, mutant, stressed)
    assert found.good is good
    assert not replace(found, sound=LOUD).good
    assert len(row(found)) == 6


@pytest.mark.slow
def test_a_fault_in_the_kernel_and_one_in_the_compiler_are_told(tmp_path: Path) -> None:
    judge = Judge(tmp_path.resolve())
    few = [f for f in EVERY if f.text.startswith(("events: the loss", "books: what a damper"))]
    assert len(few) == 2
    for fault in few:
        found = judge(fault)
        assert found.owed and found.good, found
