"""Runs that are taken on piece by piece."""

from __future__ import annotations

import pytest

import mechc
from mechc.runtime.outcome import SimulationError

CART = """\
input Force push = 0 N;
coordinate x = 0 m;
kinetic 1/2*(2 kg)*der(x)^2;
force push on x;
discrete Integer n = 0;
when x > 1 m then n := n + 1; end when;
"""


def test_inputs_jump_between_pieces() -> None:
    with mechc.loads(CART).start() as sim:
        sim.step(1.0)
        assert sim["x"] == 0
        sim["push"] = 4.0
        sim.step(2.0)
        assert sim.time == 2
        assert sim["der(x)"] == pytest.approx(2, rel=1e-12)
        sim["push"] = 0.0
        sim.step(3.0)
        assert sim["x"] == pytest.approx(1 + 2, rel=1e-12)
        assert sim["n"] == 1
        assert sim["energy.supplied"] == pytest.approx(4, rel=1e-12)


def test_a_snapshot_goes_on_bit_for_bit() -> None:
    with mechc.loads(CART).start() as sim:
        sim["push"] = 3.0
        sim.step(0.7)
        saved = sim.snapshot()
        sim.step(2.0)
        first = [sim["x"], sim["der(x)"], sim["n"]]
        sim["push"] = -5.0
        sim.step(3.0)
        sim.restore(saved)
        assert sim.time == 0.7
        sim.step(2.0)
        assert [sim["x"], sim["der(x)"], sim["n"]] == first


def test_only_inputs_can_be_set() -> None:
    with mechc.loads(CART).start() as sim, pytest.raises(SimulationError, match="no input"):
        sim["x"] = 1.0
