"""Runs that are taken on piece by piece."""

from __future__ import annotations

import math

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
    with mechc.loads(CART).start() as sim, pytest.raises(SimulationError, match="not an input"):
        sim["x"] = 1.0


SWITCHED_ON = """\
input Force push = if time > 5 s then 4 N else 0 N;
coordinate x = 0 m;
kinetic 1/2*(2 kg)*der(x)^2;
force push on x;
assert x < 3 m, "the end of the rail";
"""


def test_an_input_that_the_model_moves_goes_on_moving() -> None:
    """Even one that stands still at first; it cannot be set."""
    with mechc.loads(SWITCHED_ON).start() as sim:
        with pytest.raises(SimulationError, match="function of time"):
            sim["push"] = 1.0
        sim.step(6.0)
        assert sim["x"] == pytest.approx(1, rel=1e-6)


def test_an_assertion_that_fails_is_told_and_ends_the_run() -> None:
    with mechc.loads(SWITCHED_ON).start() as sim:
        saved = sim.snapshot()
        for until in (8.0, 9.0):
            with pytest.raises(SimulationError, match="the end of the rail"):
                sim.step(until)
        sim.restore(saved)
        sim.step(6.0)
        assert sim["x"] == pytest.approx(1, rel=1e-6)


def test_a_run_that_has_ended_does_not_go_on_by_another_input() -> None:
    text = CART.replace("n := n + 1;", 'terminate("there");')
    with mechc.loads(text).start() as sim:
        sim["push"] = 4.0
        for _ in range(2):
            with pytest.raises(SimulationError, match="there at t = 1 s"):
                sim.step(3.0)
            sim["push"] = 0.0
        with pytest.raises(KeyError, match="did you mean 'push'"):
            sim["pushh"]


HYBRID = """\
input Force push = 0 N;
coordinate Length h = 1 m;
coordinate Length x = 0 m;
initial der(x) = 1.962 m/s;
kinetic 1/2*(1 kg)*(der(h)^2 + der(x)^2);
potential (9.81 N)*h + 1/2*(1 N/m)*x^2;
contact floor: h restitution 0.7;
friction 2 N static 3 N on x - time*(1.962 m/s);
force push on x;
discrete Integer ticks = 0;
discrete Force pull = 0 N;
when sample(0.3 s) then ticks := ticks + 1; pull := -(0.1 N.s/m)*der(x); end when;
force pull on x;
"""


def test_a_snapshot_between_events_goes_on_bit_for_bit() -> None:
    """Modes, clocks, held conditions and the sizes of what is watched belong to what is saved."""
    names = ("h", "der(h)", "x", "der(x)", "ticks", "pull", "energy.dissipated", "energy.supplied")
    with mechc.loads(HYBRID).start() as sim:
        for at in (0.2, 0.9, 1.8, 2.9, 4.1):
            sim.step(at)
            saved = sim.snapshot()
            sim.step(at + 3)
            there = [sim[name] for name in names]
            sim["push"] = 7.0
            sim.step(at + 4)
            sim.restore(saved)
            assert sim.time == at
            sim.step(at + 3)
            assert [sim[name] for name in names] == there
            sim.restore(saved)


def test_steps_may_be_repeated_with_smaller_ones() -> None:
    """A tenth of a second is far too long a step for a spring that swings a thousand times in it."""
    spring = "coordinate x = 1 m;\nkinetic 1/2*(1 kg)*der(x)^2;\npotential 1/2*(1e10 N/m)*x^2;\n"
    with mechc.loads(spring).start() as sim:
        sim.step(1e-3)
        assert sim["x"] == pytest.approx(math.cos(100), rel=1e-5)
