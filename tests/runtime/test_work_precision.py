"""References in higher precision, and errors that are measured on them."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner
from msgspec.structs import replace

import mechc
from mechc.cli.main import mechc as program
from mechc.measurement import references
from mechc.measurement.benchmark import benchmark
from mechc.measurement.benchmark_report import report
from mechc.runtime.case import Case, SimulationOptions, prepare
from mechc.runtime.functions import load_functions
from mechc.runtime.integrate import kernel_run
from mechc.runtime.reference import reference_cache, work_precision
from mechc.runtime.reference.high_precision import (
    LADDERS,
    PrecisionReference,
    ReferenceFailed,
    best_precision,
    has_precision,
    reference,
)
from mechc.runtime.reference.work_precision import WorkPrecisionPoint, fastest, time_to_reach

OSCILLATOR = """
model Oscillator
  parameter m = 1 kg;
  parameter k = 4 N/m;
  coordinate x = 1 m;
  kinetic 1/2*m*der(x)^2;
  potential 1/2*k*x^2;
  experiment(stop = 10 s);
end Oscillator;
"""


def point(error: float | None, seconds: float) -> WorkPrecisionPoint:
    return WorkPrecisionPoint("dop853", 1e-6, error, error, seconds, 0.0, 1, 1)


def test_reference_agrees_with_the_closed_solution_beyond_double_precision() -> None:
    made = benchmark(mechc.loads(OSCILLATOR), methods=("dop853",), tolerances=(1e-6,)).reference
    if best_precision() != "__float128":
        pytest.skip("this C compiler has no __float128")
    mpmath = pytest.importorskip("mpmath")
    with mpmath.workdps(40):
        for t, high, low in zip(made.t, made.high[:, 0], made.low[:, 0], strict=True):
            # rounding errors of double precision are 1e-16; the times are doubles, exactly as given
            assert abs(mpmath.cos(2 * mpmath.mpf(float(t))) - mpmath.mpf(high) - mpmath.mpf(low)) < 1e-20
    assert made.doubt.max() < 1e-20


def test_errors_are_those_against_the_closed_solution_and_fall_with_the_tolerance() -> None:
    model = mechc.loads(OSCILLATOR)
    made = benchmark(model, methods=("dop853",), tolerances=(1e-4, 1e-7, 1e-10))
    errors = [p.error_at_end for p in made.points]
    for p, error in zip(made.points, errors, strict=True):
        run = model.simulate(tolerance=p.setting, method="dop853", estimate_error=False)
        exact = np.array([np.cos(20.0), -2 * np.sin(20.0)])
        y = np.array([run["x"][-1], run["der(x)"][-1]])
        nominal = made.reference.nominal
        assert error == pytest.approx(np.max(np.abs(y - exact) / (nominal + np.abs(exact))), rel=0.1)
    assert errors[0] and errors[1] and errors[2]
    assert errors[0] > 100 * errors[1] > 100 * 100 * errors[2]


def test_chaotic_motion_is_measured_up_to_where_the_reference_is_known(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setitem(LADDERS, "taylor", (1e-16, 1e-17))  # as if there were no time for more
    text = (Path(__file__).parents[2] / "examples" / "double_pendulum_points.mech").read_text()
    made = benchmark(mechc.loads(text), methods=("dop853",), tolerances=(1e-9,), stop=30.0)
    assert made.reference.doubt[-1] <= 1e-14
    assert made.horizon < made.stop


def test_reference_is_kept_by_content(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MECHC_CACHE", str(tmp_path))
    problem = mechc.loads(OSCILLATOR).problem()
    functions = load_functions(problem)
    made: list[float] = []

    def kept(case: Case, seconds: float = 1.0) -> PrecisionReference:
        def make() -> PrecisionReference:
            made.append(seconds)
            zero = np.zeros((2, 2))
            t = np.array([0.0, 1.0])
            return PrecisionReference(
                t, zero + 1 / 3, zero, t, np.ones(2), "exactly", "dop853", 1e-25, 0.5, 7
            )

        return reference_cache.kept_reference(
            Path("model-0"),
            case,
            np.ones(2),
            np.array([0.0, 1.0]),
            precision=best_precision(),
            method="dop853",
            seconds=seconds,
            make=make,
        )

    case = prepare(problem, functions, SimulationOptions())
    first, second = kept(case), kept(case)
    assert (first.cached, second.cached, len(made)) == (False, True, 1)
    assert (second.high == first.high).all() and second.precision == "exactly" and second.evaluations == 7
    other = prepare(problem, functions, SimulationOptions(values={"x": 1.1}))
    assert not kept(other).cached and not kept(case, seconds=2.0).cached
    assert len(made) == 3


def test_closed_solution_takes_the_place_of_a_reference_that_cannot_be_had(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    text = OSCILLATOR.replace("  experiment", "  exact x = 1 m*cos(sqrt(k/m)*time);\n  experiment")
    with_reference = benchmark(mechc.loads(text), methods=("dop853",), tolerances=(1e-6,))
    assert with_reference.closed["x"] < 1e-15

    def fail(*arguments: object) -> None:
        raise ReferenceFailed("no")

    monkeypatch.setattr("mechc.measurement.benchmark._reference", fail)
    without = benchmark(mechc.loads(text), methods=("dop853",), tolerances=(1e-6,))
    assert without.reference.method == "closed solution"
    a, b = with_reference.points[0].error, without.points[0].error
    assert a and b and b <= a * 1.001  # der(x) has no closed solution here, and is not measured
    with pytest.raises(ReferenceFailed):
        benchmark(mechc.loads(OSCILLATOR), methods=("dop853",), tolerances=(1e-6,))


def test_run_that_the_model_ends_is_measured_up_to_there() -> None:
    ends = OSCILLATOR.replace(
        "  experiment", '  when x < -0.5 m then\n    terminate("far");\n  end when;\n  experiment'
    )
    made = benchmark(mechc.loads(ends), methods=("dop853",), tolerances=(1e-8,))
    assert made.ended and 1.0 <= made.horizon <= np.arccos(-0.5) / 2  # x = cos 2t
    assert made.points[0].error is not None and made.points[0].error < 1e-6
    assert "the model ends its run" in report(made)


def test_rates_that_depend_on_nothing_have_a_jacobian_without_entries() -> None:
    free = OSCILLATOR.replace("  potential 1/2*k*x^2;", "  potential m*9.81 m/s^2*x;")
    made = benchmark(mechc.loads(free), methods=("radau5",), tolerances=(1e-8,))
    text = free.replace("kinetic 1/2*m*der(x)^2;\n  potential m*9.81 m/s^2*x;", "kinetic 1/2*m*der(x)^2;")
    assert made.points[0].error is not None and made.points[0].error < 1e-12
    still = mechc.loads(text.replace("coordinate x = 1 m;", "coordinate x = 1 m;\n  initial der(x) = 1 m/s;"))
    assert still.simulate(method="radau5")["x"][-1] == pytest.approx(11.0, abs=1e-9)


def test_without_wide_numbers_in_c_the_reference_is_made_by_mpmath(monkeypatch: pytest.MonkeyPatch) -> None:
    usual = benchmark(mechc.loads(OSCILLATOR), methods=("dop853",), tolerances=(1e-6,))

    def none() -> str:
        raise ReferenceFailed("the C compiler has no numbers of more than 53 bits")

    monkeypatch.setattr("mechc.measurement.benchmark.best_precision", none)
    slow = benchmark(mechc.loads(OSCILLATOR), methods=("dop853",), tolerances=(1e-6,))
    assert slow.reference.precision == "mpmath, 36 digits" and slow.digits >= 17
    a, b = usual.reference, slow.reference
    assert np.abs((a.high - b.high) + (a.low - b.low)).max() < 1e-19
    with pytest.raises(ReferenceFailed, match="events"):
        benchmark(
            mechc.loads(
                OSCILLATOR.replace(
                    "  experiment", "  when x < 0 m then\n    reinit(x, 0 m);\n  end when;\n  experiment"
                )
            )
        )


def test_a_busy_machine_prolongs_no_times(monkeypatch: pytest.MonkeyPatch) -> None:
    """Times measured in turns were those of the clock: ten times as long beside a dozen programs on two cores."""
    run = kernel_run.run_kernel

    def waits(*given: Any) -> Any:
        made = run(*given)
        return replace(made, statistics=replace(made.statistics, run_time=10 + made.statistics.run_time))

    monkeypatch.setattr(work_precision, "run_kernel", waits)
    made = benchmark(mechc.loads(OSCILLATOR), methods=("dop853", "radau5"), tolerances=(1e-9, 1e-11))
    assert any(p.rounds for p in made.points)
    assert all(max(p.seconds, *p.rounds, 0.0) < 1 for p in made.points)


def test_ladder_ends_where_a_run_is_given_up_or_accurate_enough() -> None:
    stiff = mechc.loads(OSCILLATOR.replace("4 N/m", "1e12 N/m").replace("10 s", "1e-4 s"))
    tolerances = (1e-9, 1e-11, 1e-13)
    made = benchmark(stiff, methods=("dop853",), against=("scipy:DOP853",), tolerances=tolerances, enough=1.0)
    assert [len(points) for points in made.by_method().values()] == [
        3,
        1,
    ]  # a peer stops, the kernel does not
    given_up = benchmark(
        stiff, methods=("dop853",), against=("scipy:RK45",), tolerances=tolerances, longest=0.0
    )
    for points in given_up.by_method().values():
        assert len(points) < 3 and points[-1].given_up and "given up after" in points[-1].failure


@pytest.mark.slow
def test_numbers_of_the_processor_take_over_where_the_reference_takes_too_long(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    if best_precision() != "__float128" or not has_precision("long double"):
        pytest.skip("this C compiler has no two wide numbers")
    model = mechc.loads(OSCILLATOR)
    usual = benchmark(model, methods=("dop853",), tolerances=()).reference

    def slow(*arguments: Any, **options: Any) -> PrecisionReference:
        if options["precision"] == "__float128":
            options["seconds"] = 0.0
        return reference(*arguments, **options)

    monkeypatch.setattr(references, "reference", slow)
    monkeypatch.setenv("MECHC_CACHE", str(tmp_path))
    fast = benchmark(model, methods=("dop853",), tolerances=()).reference
    assert (usual.precision, fast.precision) == ("__float128", "long double")
    # measured 2e-17: rounding of 64 bits, 5e-20, over some thousand stages
    assert np.abs((usual.high - fast.high) + (usual.low - fast.low)).max() < 1e-16
    assert fast.doubt.max() < 1e-15


def test_command_prints_one_object(tmp_path: Path) -> None:
    model = tmp_path / "oscillator.mech"
    model.write_text(OSCILLATOR)
    arguments = ["bench", str(model), "--methods", "dop853,rk4", "--tolerances", "1e-6", "--json", "-"]
    done = CliRunner().invoke(program, arguments)
    assert done.exit_code == 0, done.output
    made = json.loads(done.output)
    assert {p["method"] for p in made["points"]} == {"dop853", "rk4"}
    assert made["reference"]["doubt"] < 1e-16


def test_method_that_does_not_fit_is_named_with_its_reason() -> None:
    damped = OSCILLATOR.replace("  experiment", "  damping 1 kg/s on x;\n  experiment")
    made = benchmark(mechc.loads(damped), methods=("verlet",), tolerances=(1e-6,))
    assert [name for name, _ in made.skipped] == ["verlet"]
    assert "velocities" in made.skipped[0][1]


def test_times_between_two_runs_lie_on_the_line_of_their_logarithms() -> None:
    points = [point(1e-4, 1.0), point(1e-8, 4.0), point(None, 0.1)]
    assert time_to_reach(points, 1e-6) == pytest.approx(2.0)
    assert time_to_reach(points, 1e-9) is None
    assert fastest(points, 1e-5) == points[1]
    assert time_to_reach([point(0.0, 3.0)], 1e-9) == 3.0


def test_unknown_method_is_told_before_anything_is_computed() -> None:
    model = mechc.loads("coordinate x = 1 m; kinetic 1/2*1 kg*der(x)^2; experiment(stop = 1 s);")
    with pytest.raises(mechc.SimulationError, match=r"no method 'dop854'.*did you mean 'dop853'"):
        benchmark(model, methods=["radau5", "dop854"], seconds=0.0)
