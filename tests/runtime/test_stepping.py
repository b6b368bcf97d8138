"""The solver in slices: the same bits however it is cut, saved and restored."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
import pytest
from scipy.special import ellipj
from written_problems import compiled_driven, compiled_kepler

import mechc
from mechc.runtime.case import Case, SimulationOptions, prepare
from mechc.runtime.functions import load_functions
from mechc.runtime.inputs import make_table
from mechc.runtime.integrate.solver import Solver
from mechc.runtime.native.kernel import load_kernel
from mechc.runtime.native.status import Status
from mechc.runtime.outcome import SimulationError
from mechc.runtime.problem import Array, Problem

STOP = 20.0


@contextmanager
def solver(problem: Problem, method: str, options: SimulationOptions) -> Iterator[tuple[Solver, Case]]:
    functions = load_functions(problem)
    case = prepare(problem, functions, options)
    step = 1e-2 if method == "rk4" else 0.0
    atol = np.full(problem.ny, 1e-9)
    with Solver(load_kernel(), case, method, 1e-9, atol, step) as made:
        yield made, case


def result(solver: Solver) -> tuple[bytes, bytes, tuple[int, int, int]]:
    report, y = solver.report()
    counts = (report.steps, report.rejected, report.evaluations)
    return y.tobytes(), solver.grid_rows(report.n_grid)[1].tobytes(), counts


def cases() -> list[tuple[Problem, str, SimulationOptions]]:
    table = make_table(np.arange(0.5, 15, 1.3), np.sin(np.arange(0.5, 15, 1.3)), "step")
    driven = SimulationOptions(stop=STOP, inputs={"u": table}, points=77)
    return [
        (compiled_kepler(), "dop853", SimulationOptions(stop=STOP, points=77)),
        (compiled_kepler(), "rk4", SimulationOptions(stop=STOP, points=77)),
        (compiled_driven(), "dop853", driven),
    ]


@pytest.mark.parametrize("index", range(3), ids=["dop853", "rk4", "table"])
def test_slices_give_the_same_bits_as_one_go(index: int) -> None:
    problem, method, options = cases()[index]
    with solver(problem, method, options) as (whole, _):
        assert whole.advance(STOP, 10**9) == Status.REACHED
        expected = result(whole)
    with solver(problem, method, options) as (cut, _):
        count = 0
        while (status := cut.advance(STOP, 1 + count % 5)) == Status.RUNNING:
            count += 1
        assert status == Status.REACHED
        assert count > 5
        assert result(cut) == expected


@pytest.mark.parametrize("index", range(3), ids=["dop853", "rk4", "table"])
def test_saved_and_restored_run_goes_on_bit_for_bit(index: int) -> None:
    problem, method, options = cases()[index]
    with solver(problem, method, options) as (made, _):
        assert made.advance(STOP, 7) == Status.RUNNING
        memory = made.save()
        assert made.advance(STOP, 10**9) == Status.REACHED
        expected = result(made)
        made.load(memory)
        assert made.report()[0].steps == 7
        assert made.advance(STOP, 10**9) == Status.REACHED
        assert result(made) == expected


@pytest.mark.parametrize("method", ["radau5", "gauss4", "dop853"])
def test_a_saved_run_goes_on_in_another_solver(method: str) -> None:
    """Nothing of the first one is used: its memory has been overwritten by a third."""
    text = "dimensionless;\nstate x = 2;\nstate v = 0;\nequation der(x) = v;\nequation der(v) = 5*(1 - x^2)*v - x;\n"
    problem = mechc.loads(text).problem(method=method)
    functions = load_functions(problem)
    case = prepare(problem, functions, SimulationOptions(stop=STOP, points=2))

    def made() -> Solver:
        return Solver(load_kernel(), case, method, 1e-8, np.full(2, 1e-8), 1e-2)

    with made() as whole:
        assert whole.advance(STOP, 10**9) == Status.REACHED
        expected = whole.report()[1]
    with made() as second:
        with made() as first:
            assert first.advance(STOP, 50) == Status.RUNNING
            memory = first.save()
            first.advance(STOP, 70)
        with made() as third:
            third.advance(1.0, 10**9)
            second.load(memory)
            assert second.advance(STOP, 10**9) == Status.REACHED
            assert np.array_equal(second.report()[1], expected)


def test_landing_on_intermediate_times() -> None:
    with solver(compiled_kepler(), "dop853", SimulationOptions(stop=STOP)) as (made, _):
        for stop in (0.1, 0.1, 5.0, STOP):
            assert made.advance(stop, 10**9) == Status.REACHED
            assert made.report()[0].t == stop


def test_a_new_state_at_the_present_time() -> None:
    """From the apocentre, with the velocity of the circle there, the orbit becomes a circle."""
    with solver(compiled_kepler(), "dop853", SimulationOptions(stop=STOP, points=2)) as (made, _):
        assert made.advance(np.pi, 10**9) == Status.REACHED
        _, y = made.report()
        assert y[0] == pytest.approx(-1.6, abs=1e-7)
        made.write(np.array([-1.6, 0, 0, -np.sqrt(1 / 1.6)]))
        assert made.advance(STOP, 10**9) == Status.REACHED
        assert np.hypot(*made.report()[1][:2]) == pytest.approx(1.6, abs=1e-7)


def test_record_is_renewed_when_full() -> None:
    def record(capacity: int) -> Array:
        rows = []
        with solver(compiled_kepler(), "dop853", SimulationOptions(stop=STOP)) as (made, _):
            made.start_record(capacity)
            while (status := made.advance(STOP, 10**9)) == Status.RECORD_FULL:
                rows.append(made.recorded(made.report()[0].n_record))
                made.start_record(capacity)
            assert status == Status.REACHED
            rows.append(made.recorded(made.report()[0].n_record))
            return np.concatenate(rows)

    assert record(3).tobytes() == record(10_000).tobytes()


def test_many_solvers_at_once() -> None:
    options = SimulationOptions(stop=STOP, points=5)
    with solver(compiled_kepler(), "dop853", options) as (alone, _):
        alone.advance(STOP, 10**9)
        expected = result(alone)
    with (
        solver(compiled_kepler(), "dop853", options) as (first, _),
        solver(compiled_kepler(), "dop853", options) as (second, _),
    ):
        done = [False, False]
        while not all(done):
            done = [s.advance(STOP, n) == Status.REACHED for s, n in ((first, 3), (second, 2))]
        assert result(first) == result(second) == expected


@pytest.mark.parametrize("terms", [4, 6, 8])
def test_polynomials_have_the_bits_of_their_nested_form(terms: int) -> None:
    kernel, random = load_kernel(reproducible=True), np.random.default_rng(terms)
    for n in range(1, 12):
        c, s = random.standard_normal((terms, n)), random.random()
        nested, found = c[-1], np.empty(n)
        for k in range(terms - 2, -1, -1):
            nested = c[k] + (1 - s if k % 2 else s) * nested
        kernel.mech_dense_at(c.ctypes.data, terms, n, s, found.ctypes.data)
        assert found.tobytes() == nested.tobytes()


FLEEING = """\
model Fleeing
  input Force u = 0 N;
  coordinate Length x = 1 m;
  kinetic 1/2*1 kg*der(x)^2;
  force 1 N/m^3*x^3 + u on x;
  experiment(stop = 1 s);
end Fleeing;
"""


def test_a_motion_that_flees_ends_within_its_bound_of_steps() -> None:
    """x'' = x^3 from rest at 1 is 1/cn(t, 1/2), infinite at K(1/2) = 1.8540747 s: no number of steps leads to 2 s."""
    with mechc.loads(FLEEING).start() as sim, pytest.raises(SimulationError) as caught:
        sim.step(1.0)
        assert sim["x"] == pytest.approx(1 / ellipj(1, 0.5)[1], rel=1e-5)
        sim.step(2.0, max_steps=50)
    assert "50 steps lead to t = 1.8" in caught.value.message
    assert "der(x) =" in caught.value.message and "max_steps" in (caught.value.help or "")


def test_a_step_that_takes_long_ends_within_its_bound_of_time() -> None:
    """An input that oscillates a million times a second keeps the steps short."""
    text = FLEEING.replace("1 N/m^3*x^3", "1 N*sin(1e8 Hz*time)")
    with mechc.loads(text).start() as sim:
        begun = time.perf_counter()
        with pytest.raises(SimulationError, match=r"0.2 s of computing lead to t = "):
            sim.step(100.0, max_steps=10**9, seconds=0.2)
        assert time.perf_counter() - begun < 5
        reached = sim.time
        assert 0 < reached < 100
        sim.step(reached + 1e-6)
        assert sim.time == reached + 1e-6


def test_a_call_of_limited_length_cuts_the_run_without_a_change_of_bits() -> None:
    problem, method, options = cases()[0]
    with solver(problem, method, options) as (whole, _):
        assert whole.advance(STOP, 10**9) == Status.REACHED
        expected = result(whole)
    with solver(problem, method, options) as (cut, _):
        cut._options.longest_call = 1e-9
        cut._create()
        calls = 1
        while cut.advance(STOP, 10**9) == Status.RUNNING:
            calls += 1
        assert calls > 1
        assert result(cut) == expected
