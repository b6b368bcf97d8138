"""The accuracy report against true errors, and nominal values."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pytest
from msgspec.structs import replace
from numpy.typing import NDArray
from written_problems import (
    called,
    compiled,
    compiled_kepler,
    compiled_pendulum,
    compiled_rigid_body,
    kepler,
    kepler_position,
    pendulum,
    problem,
)

import mechc
from mechc.runtime.case import SimulationOptions, prepare
from mechc.runtime.functions import load_functions
from mechc.runtime.integrate.nominal_run import nominal_of
from mechc.runtime.interface import Quantity
from mechc.runtime.problem import Array, ModelFunction, Problem
from mechc.runtime.results.accuracy import companion_tolerance
from mechc.runtime.studies.kinds.motion import simulate
from mechc.runtime.studies.runs import companion


@pytest.mark.parametrize("tolerance", [1e-5, 1e-7, 1e-9, 1e-11, 2e-13])
@pytest.mark.parametrize("make", [compiled_kepler, kepler], ids=["compiled", "called"])
def test_estimated_error_is_near_the_true_one(make: Callable[[], Problem], tolerance: float) -> None:
    solution = simulate(make(), SimulationOptions(stop=12, tolerance=tolerance, points=100))
    exact = kepler_position(solution.time, 1.0, 1.0, 0.6)
    # Nominal: 0.4, the start at the pericentre, for both coordinates.
    true = {
        name: np.abs(solution[name] - exact[:, i]) / (0.4 + np.abs(exact[:, i]))
        for i, name in enumerate("xy")
    }
    error = solution.accuracy.error
    assert error is not None
    for name in "xy":
        assert error.by_state[name] == pytest.approx(true[name].max(), rel=0.5)
        assert true[name][-1] / 30 < error.by_state_at_end[name] < 30 * true[name][-1]
    assert error.largest == max(error.by_state.values())
    assert error.at_end == max(error.by_state_at_end.values())


def test_estimated_error_of_a_fixed_step_method() -> None:
    for p in (kepler(), compiled_kepler()):
        options = SimulationOptions(stop=12, method="rk4", step=0.01, points=100)
        solution = simulate(p, options)
        exact = kepler_position(solution.time, 1.0, 1.0, 0.6)[:, 0]
        true = (np.abs(solution["x"] - exact) / (0.4 + np.abs(exact))).max()
        assert solution.accuracy.error is not None
        assert solution.accuracy.error.by_state["x"] == pytest.approx(true, rel=0.05)
        assert solution.accuracy.error.tolerance == 0.005


def test_estimate_at_the_tightest_tolerances_is_an_upper_bound() -> None:
    assert companion_tolerance(1e-8) == pytest.approx((1e-10, 1 / 0.99))
    assert companion_tolerance(1e-13)[0] == 1e-14
    assert companion_tolerance(1e-14) == pytest.approx((1e-13, 1.0))
    solution = simulate(compiled_kepler(), SimulationOptions(stop=12, tolerance=1e-14, points=50))
    exact = kepler_position(solution.time, 1.0, 1.0, 0.6)[:, 0]
    assert solution.accuracy.error is not None
    assert (np.abs(solution["x"] - exact) / (0.4 + np.abs(exact))).max() < 2 * solution.accuracy.error.largest


def test_no_estimate_where_none_is_wanted() -> None:
    solution = simulate(compiled_kepler(), SimulationOptions(stop=1, estimate_error=False))
    assert solution.accuracy.error is None
    assert solution.accuracy.remark == "no companion run was asked for"


def test_energy_balance_and_momenta() -> None:
    loose, tight = (
        simulate(compiled_pendulum(), SimulationOptions(stop=50, tolerance=tolerance))
        for tolerance in (1e-5, 1e-10)
    )
    for solution in (loose, tight):
        drift = solution.accuracy.energy
        assert drift is not None
        largest = max(np.abs(solution[name]).max() for name in ("kinetic", "potential", "energy"))
        assert drift.absolute == np.abs(solution["energy"] - solution["energy"][0]).max()
        assert drift.relative == pytest.approx(drift.absolute / largest)
        assert solution.accuracy.conserved[0].absolute == drift.absolute
        assert solution.accuracy.conserved[0].name == "energy"
    assert loose.accuracy.energy is not None and tight.accuracy.energy is not None
    assert 1e-7 < loose.accuracy.energy.absolute < 1e-2
    assert tight.accuracy.energy.absolute < loose.accuracy.energy.absolute * 1e-3
    body = simulate(compiled_rigid_body(), SimulationOptions(stop=20, tolerance=1e-12))
    assert body.accuracy.conserved[0].absolute < 1e-10


def test_balance_counts_what_is_dissipated_and_supplied() -> None:
    """x' = -1 + 2: total = x, dissipated = t, supplied = 2 t."""
    p = problem(
        "Account",
        x=[("x", "J")],
        functions={
            "rhs": lambda t, y, u, z, p: np.ones(1),
            "initial": lambda t, y, u, z, p: np.zeros(1),
            "outputs": lambda t, y, u, z, p: np.array([y[0], t, 2 * t]),
        },
        outputs=tuple(Quantity(n, "energy", "J") for n in ("total", "lost", "given")),
        energy_balance=(0, 1, 2),
    )
    drift = simulate(p, SimulationOptions(stop=3)).accuracy.energy
    assert drift is not None and drift.absolute < 1e-14
    wrong = simulate(replace(p, energy_balance=(0, 1, -1)), SimulationOptions(stop=3)).accuracy.energy
    assert wrong is not None and wrong.absolute == pytest.approx(6)
    assert wrong.relative == pytest.approx(1)


def scaled_kepler(length: float) -> Problem:
    """An orbit about the sun from its pericentre; ``length`` is the unit of length in metres."""
    defaults = (1.327e20 / length**3, 1.5e11 / length, 0.3)
    return compiled_kepler(defaults)


def test_units_change_no_step() -> None:
    year = 3.156e7
    options = SimulationOptions(stop=3 * year, tolerance=1e-9, points=50)
    metres, kilometres, exact = (simulate(scaled_kepler(unit), options) for unit in (1.0, 1e3, 2.0**37))
    for other in (kilometres, exact):
        assert other.statistics.steps == metres.statistics.steps
        assert other.statistics.rejected == metres.statistics.rejected
        assert other.statistics.evaluations == metres.statistics.evaluations
        assert other.statistics.longest_step == pytest.approx(metres.statistics.longest_step, rel=1e-7)
        assert metres.accuracy.error is not None and other.accuracy.error is not None
        assert other.accuracy.error.largest == pytest.approx(metres.accuracy.error.largest, rel=1e-3)
    # A power of two changes no digit at all.
    assert (exact["x"] * 2.0**37).tobytes() == metres["x"].tobytes()


def oscillator(length: float, x0: float) -> Problem:
    p = problem(
        "Oscillator",
        q=[("x", "m")],
        parameters=[("l", "m"), ("k", "1/s2")],
        defaults=(2 * length, 4.0),
        functions={},
    )
    bodies = {
        "rhs": "out[0] = y[1]; out[1] = -p[1] * y[0] + p[0];",
        "initial": f"out[0] = {x0!r}; out[1] = 0;",
    }
    return compiled(p, (2 * length, 4.0), bodies)


@pytest.mark.parametrize("x0", [0.0, 1.0])
def test_units_change_no_step_where_the_start_is_zero(x0: float) -> None:
    runs = [
        simulate(oscillator(unit, x0 * unit), SimulationOptions(stop=10)).statistics for unit in (1.0, 1024.0)
    ]
    assert runs[0].steps == runs[1].steps
    assert runs[0].longest_step == runs[1].longest_step


def nominal(
    p: Problem,
    y0: list[float],
    rates: list[float],
    parameters: list[float],
    duration: float,
    energies: Sequence[float] = (),
) -> Array:
    """Return the nominal values of a motion with constant rates."""

    def fill(p: Array, given: NDArray[np.uint8]) -> None:
        p[:] = parameters

    functions: dict[str, ModelFunction] = {
        "rhs": lambda t, y, u, z, p: np.array(rates),
        "initial": lambda t, y, u, z, p: np.array(y0),
        "outputs": lambda t, y, u, z, p: np.array(energies),
    }
    outputs = tuple(Quantity(f"E{k}", "energy", "J") for k in range(len(energies)))
    made = called(replace(p, functions=functions, parameters_function=fill, outputs=outputs))
    return nominal_of(prepare(made, load_functions(made), SimulationOptions(stop=duration)))


def test_nominal_values_follow_their_rules() -> None:
    p = pendulum()
    g = 9.81
    # An initial value; a rate from the acceleration.
    assert nominal(p, [0.25, 0], [0, -4.0], [1, g], 10) == pytest.approx([0.25, 1.0])
    # An angle that starts at zero, with a rate.
    assert nominal(p, [0, 3], [3, 0], [1, g], 10) == pytest.approx([1, 3])
    # Nothing known of the rate: once around in the duration of the run.
    assert nominal(p, [0, 0], [0, 0], [1, g], 10) == pytest.approx([1, 0.1])
    # Declared.
    declared = replace(p.states[0], nominal=7.0)
    assert nominal(replace(p, states=(declared, p.states[1])), [0.25, 0], [0, 0], [1, g], 1)[0] == 7
    ranged = replace(p.states[0], minimum=-2.0, maximum=3.0)
    assert nominal(replace(p, states=(ranged, p.states[1])), [0, 0], [0, 0], [1, g], 1)[0] == 3


def test_rounding_is_no_size() -> None:
    """What assembly leaves of a zero counts as zero: its nominal is that of the others, not a millionth of it."""
    p = kepler()
    exact = nominal(p, [5, 0, 0, 0.1], [0, 0.1, -0.002, 0], [1, 1, 0.6], 1)
    rounded = nominal(p, [5, 1e-16, -1e-18, 0.1], [1e-18, 0.1, -0.002, 1e-17], [1, 1, 0.6], 1)
    assert rounded.tolist() == exact.tolist()
    turning = problem("Turning", q=[("x", "m"), ("a", "rad")], functions={})
    falling = nominal(turning, [1, 0.5, 0, 0], [0, 0, -10, 0], [], 1)
    rounded = nominal(turning, [1, 0.5, 0, 1e-17], [0, 0, -10, -1e-15], [], 1)
    assert rounded.tolist() == falling.tolist()
    # All rates may be what is left of zeros.
    resting = nominal(turning, [1, 0.5, 0, 0], [0, 0, 0, 0], [], 10)
    rounded = nominal(turning, [1, 0.5, 1e-18, -4e-32], [1e-18, -4e-32, 1e-18, 3e-32], [], 10)
    assert rounded.tolist() == resting.tolist() == [1, 0.5, 0.1, 0.05]


def test_nominal_values_of_lengths() -> None:
    p = kepler()
    # What starts at zero gets the size of the other one of its unit.
    assert nominal(p, [5, 0, 0, 0.1], [0, 0.1, -0.002, 0], [1, 1, 0.6], 1) == pytest.approx([5, 5, 0.1, 0.1])
    # All zero: the parameter of the same unit.
    assert nominal(p, [0, 0, 0, 0], [0, 0, 0, 0], [1, 30, 0.6], 10) == pytest.approx([30, 30, 3, 3])
    # A tiny one is kept above rounding of the others.
    assert nominal(p, [5, 1e-9, 0, 1], [0, 1e-5, 0, 0], [1, 1, 0], 1)[1] == pytest.approx(5e-6)


def test_nominal_values_of_what_does_not_feel_each_other() -> None:
    two = problem("Two", q=[("x", "m"), ("y", "m")], functions={})
    apart = replace(two, groups=(0, 1, 0, 1))
    assert nominal(two, [1e-9, 1e5, 0, 0], [0, 0, -4e-8, -1e5], [], 1)[0] == 1e5
    assert nominal(apart, [1e-9, 1e5, 0, 0], [0, 0, -4e-8, -1e5], [], 1) == pytest.approx(
        [1e-9, 1e5, (4e-8 * 1e-9) ** 0.5, 1e5]
    )
    # What starts at zero asks those that it feels first, then the others of its unit.
    three = problem("Three", q=[("x", "m"), ("y", "m"), ("z", "m")], functions={})
    groups = (0, 1, 1, 0, 1, 1)
    assert nominal(replace(three, groups=groups), [2, 0, 5, 0, 0, 0], [0] * 6, [], 1)[1] == 5
    assert nominal(replace(three, groups=groups), [0, 3, 5, 0, 0, 0], [0] * 6, [], 1)[0] == 3


def test_nominal_values_of_falls_rotations_and_accounts() -> None:
    fall = problem("Fall", q=[("h", "m")], functions={})
    assert nominal(fall, [0, 0], [0, -10.0], [], 3) == pytest.approx([90, 30])
    body = compiled_rigid_body()
    assert nominal(body, [1, 0, 0, 0, 0, 2, 0], [0] * 7, [], 1) == pytest.approx([1, 1, 1, 1, 2, 2, 2])
    account = problem("Account", x=[("E", "J")], functions={})
    account = replace(account, states=(Quantity("E", "account", "J"),))
    assert nominal(account, [0], [0], [], 1, [-40.0, 3.0]) == 40


def test_the_estimate_sees_errors_of_steps_that_only_their_bound_limits() -> None:
    import mechc

    example = Path(__file__).parents[2] / "examples" / "shuttlecock.mech"
    loose = mechc.load(example).simulate(tolerance=1e-4, method="dop853")
    tight = mechc.load(example).simulate(tolerance=1e-12, method="dop853")
    assert loose.accuracy.error is not None
    names = [name for name in loose.accuracy.error.nominal if not name.startswith("energy")]
    true = max(
        abs(loose[n][-1] - tight[n][-1]) / (loose.accuracy.error.nominal[n] + abs(tight[n][-1]))
        for n in names
    )
    assert true / 100 <= loose.accuracy.error.at_end <= 1000 * true


def test_companion_that_takes_too_many_steps_gives_way_to_a_looser_one(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(companion, "FEW_STEPS", 1)
    monkeypatch.setattr(companion, "COMPANION_STEPS", 1)
    solution = simulate(compiled_kepler(), SimulationOptions(stop=12, tolerance=1e-7, points=100))
    exact = kepler_position(solution.time, 1.0, 1.0, 0.6)
    error = solution.accuracy.error
    assert error is not None
    assert error.tolerance == pytest.approx(1e-6)
    true = np.max(np.abs(solution["x"] - exact[:, 0]) / (0.4 + np.abs(exact[:, 0])))
    assert true < error.by_state["x"] < 1000 * true


SPRING = """\
coordinate Length x = 0 m;
initial der(x) = 1 m/s;
kinetic 1/2*(1 kg)*der(x)^2;
potential 1/2*(1 N/m)*x^2;
"""


def test_estimate_of_a_run_that_its_model_ends_between_output_times() -> None:
    """The end lies between those of the two runs, and just there is an output time: one run has a row more."""
    text = f'{SPRING}when x > {math.sin(1 - 5e-9)!r} m then terminate("there"); end when;\n'
    run = mechc.loads(text).simulate(stop=10, every=0.1, tolerance=1e-5)
    assert run.outcome.value == "terminated" and len(run.time) == 13  # both sides of the end
    assert run.accuracy.error is not None
    true = np.abs(run["x"] - np.sin(run.time)).max()
    assert true / 10 < run.accuracy.error.by_state["x"] < 10 * true


def test_no_estimate_where_the_companion_run_ends_otherwise() -> None:
    """The swing just reaches what ends the run, and the error of the main run keeps it from there."""
    text = f'{SPRING}when x > {1 - 1e-8!r} m then terminate("there"); end when;\n'
    run = mechc.loads(text).simulate(stop=20, tolerance=1e-4)
    assert run.outcome.value == "completed"
    assert run.accuracy.error is None
    assert "the companion run was ended by 'there'" in run.accuracy.remark
