"""Six linkages through positions in which another motion branches off, against independent coordinates by hand, for masses of 1e-6 to 1e6 kg."""

from __future__ import annotations

import numpy as np
import pytest
from singular_linkages import LINKAGES

import mechc
from mechc.measurement.stress_targets import TARGETS, answer_of

CLAIMED = 10.0
"""A true error may be larger than the claimed one by this."""
SPACED = 25


@pytest.mark.parametrize("mass", [1e-6, 1.0, 1e6])
@pytest.mark.parametrize("name", LINKAGES)
def test_a_linkage_goes_on_through_a_singular_position(name: str, mass: float) -> None:
    ran = mechc.loads(LINKAGES[name].text, name=name).simulate(set={"M": mass})
    _is_right(name, ran, 1e-6)


def test_a_longer_lighter_slower_linkage_is_the_same() -> None:
    """With its values set for lengths of 1e5 m it was locked in the position that it passes in metres."""
    sizes = {"M": 1e-7, "g": 98.1, "l": 1e5, "s": 7e4, "a[1]": -3e4, "b[1]": 8e4}
    ran = mechc.loads(LINKAGES["kite"].text, name="kite").simulate(set=sizes, stop=200.0)
    known = LINKAGES["kite"].motion(ran.time[1::SPACED] / 100)
    for quantity, true in known.items():
        assert np.abs(ran[quantity][1::SPACED] / 1e5 - true).max() < 1e-6


@pytest.mark.parametrize("name", LINKAGES)
def test_tight_runs_claim_no_more_than_they_know(name: str) -> None:
    ran = mechc.loads(LINKAGES[name].text, name=name).simulate(tolerance=1e-12)
    _is_right(name, ran, 1e-7)


def _is_right(name: str, ran: mechc.Solution, useful: float) -> None:
    """Fail where a run is off by more than it claims, or claims nothing of use."""
    assert ran.message.startswith("completed")
    claims = ran.accuracy.error
    assert claims is not None and claims.largest < useful
    times = ran.time[1::SPACED]
    known = LINKAGES[name].motion(times)
    passed = LINKAGES[name].passes(known)
    assert passed.min() < 0 < passed.max()
    for quantity, true in known.items():
        off = np.abs(ran[quantity][1::SPACED] - true).max()
        if quantity in claims.nominal:
            owed = CLAIMED * claims.by_state[quantity] * (claims.nominal[quantity] + np.abs(true).max())
            assert off < owed + 1e-11 * (1 + np.abs(true).max()), (
                f"{quantity}: {off:.1e}, {owed:.1e} are owed"
            )
        else:
            assert off < useful * np.abs(true).max(), quantity


@pytest.mark.slow
@pytest.mark.parametrize("target", TARGETS)
@pytest.mark.parametrize("name", LINKAGES)
def test_targets_follow_or_refuse(name: str, target: str) -> None:
    """Modules of Python went astray, without a word."""
    model = mechc.loads(LINKAGES[name].text, name=name)
    if target == "python":
        with pytest.raises(mechc.SimulationError, match="depend on each other"):
            answer_of(target, model, [], 60)
        return
    answer = answer_of(target, model, [q.name for q in model.problem().states], 60)
    after = answer["time"] > 0
    for quantity, true in LINKAGES[name].motion(answer["time"][after]).items():
        if quantity in answer:
            assert np.abs(answer[quantity][after] - true).max() < 1e-6 * (1 + np.abs(true).max()), quantity
