"""Outputs that equations determine: further solutions at the start, and jumps between solutions along a run, by closed forms."""

from __future__ import annotations

import json
from math import asin, atan2, cos, pi, sin, sqrt
from pathlib import Path

import numpy as np
import pytest

import mechc
from mechc.cli.main import run
from mechc.compiler.targets.alone import standing_alone

BODY = "dimensionless; coordinate x = 1; kinetic 1/2*der(x)^2; potential 1/2*x^2; "
FOLD = asin(1 / (3 * sqrt(3)))
"""Where |2 sin t| = 2/(3 sqrt 3), at which two solutions of y^3 - y = 2 sin t meet."""
QUIET = {
    "kepler": "parameter e = 0.9; output kepler ~ 2*time + e*sin(2*time); equation kepler - e*sin(kepler) = 2*time;",
    "steep": "parameter f = 0.999999; output steep ~ 2*time + f*sin(2*time); equation steep - f*sin(steep) = 2*time;",
    "sudden": "output sudden ~ 0; equation sudden + 0.1*sudden^3 = tanh(1e4*(time - 5));",
    "linear": "output linear ~ 1; equation 3*linear = sin(time);",
    "array": "output array[2] ~ {1, 1}; equation {{2, 1}, {1, 2 + sin(time)}}*array = {cos(time), 3};",
    "pole": "output pole ~ 1; equation (time - 7.3)*pole = 1;",
    "its equations jump": "output own ~ 1; equation own^3 + own = if time > 3.3 then 5 else sin(time) + 2;",
    "its equations step": "output stair ~ 1; equation stair^3 + stair = floor(time);",
    "a range": "output Real ranged(min = 0) ~ 1; equation ranged^2 = 1 + x^2;",
    "near a meeting": "output Real near(min = 0) ~ 1; equation near^2 = 1.000001 + sin(time);",
}
"""Outputs with one solution, or with one in their range, of which nothing is to be said."""
ROD = """
    output a ~ 0.5; output b ~ 1.5;
    equation cos(time) + 3*cos(a) = 2.5 + 2*cos(b);
    equation sin(time) + 3*sin(a) = 2*sin(b);
"""
"""A crank of 1 that turns with time, a coupler of 3 and a rocker of 2 on a base of 2.5."""


def ran(text: str, stop: float, **options: object) -> mechc.Solution:
    model = mechc.loads(BODY + text + f" experiment(stop = {stop});")
    return model.simulate(estimate_error=False, **options)  # type: ignore[arg-type]


@pytest.fixture(scope="module")
def cubic() -> mechc.Model:
    """The guess is on the upper branch, until that ends."""
    return mechc.loads(
        BODY
        + "output y ~ if 2*sin(time) > -2/(3*sqrt(3)) then 1.2 else -1.2; equation y^3 - y = 2*sin(time);"
        "output other = 2*y; experiment(stop = 10);"
    )


def check_cubic(solution: mechc.Solution) -> None:
    assert [(j.kind.value, j.names) for j in solution.jumps] == [
        ("fold", ("y",)),
        ("jump", ("y",)),
        ("fold", ("y",)),
    ]
    expected = [pi + FOLD, 2 * pi - FOLD, 3 * pi + FOLD]
    assert [j.time for j in solution.jumps] == pytest.approx(expected, abs=1e-9)
    fold = solution.jumps[0]
    assert (*fold.before, *fold.after) == pytest.approx((1 / sqrt(3), -2 / sqrt(3)), abs=1e-5)


def test_folds_of_a_cubic_are_told_by_time(cubic: mechc.Model) -> None:
    solution = cubic.simulate(estimate_error=False)
    check_cubic(solution)
    assert any(
        "'y' jumps at t = 3.33525" in r and "in a fold" in r and "again at 9.6184" in r
        for r in solution.remarks
    )
    (several,) = solution.further_solutions
    assert several.taken == (1.0,) and sorted(several.others) == [(-1.0,), pytest.approx((0.0,), abs=1e-12)]


def test_jumps_do_not_depend_on_the_spacing_of_results(cubic: mechc.Model) -> None:
    few, many = (cubic.simulate(every=h, estimate_error=False) for h in (2.5, 0.005))
    check_cubic(few)
    check_cubic(many)
    assert few["y"] == pytest.approx(many["y"][::500], rel=1e-14)


def test_json_and_terminal_tell_jumps(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "ends.mech"
    path.write_text(BODY + "output y ~ 1; equation y^2 = 1 - time; experiment(stop = 2);", encoding="utf-8")
    assert run(["run", str(path), "--json"]) != 0
    told = json.loads(capsys.readouterr().out)
    (jump,) = told["jumps"]
    assert jump["kind"] == "fold" and jump["names"] == ["y"] and jump["after"] == [None]
    assert jump["time"] == pytest.approx(1.0, abs=1e-9)
    (several,) = told["further_solutions"]
    assert several["taken"] == [1.0] and several["others"] == [[-1.0]]
    assert sum("'y'" in r and "fold" in r for r in told["remarks"]) == 1


def test_solutions_that_meet() -> None:
    """y = sqrt(1 + sin t) touches -sqrt(1 + sin t) at 3 pi/2: neither ends, and the guess takes the upper one after it."""
    solution = ran("output y ~ 1; equation y^2 = 1 + sin(time);", 12.0)
    assert [j.kind.value for j in solution.jumps] == ["meeting", "meeting"]
    assert [j.time for j in solution.jumps] == pytest.approx([1.5 * pi, 3.5 * pi], abs=2e-6)


def test_a_guess_that_passes_to_another_solution() -> None:
    """The guess is another one from t = 2 on, and both solutions of y^2 = 4 + x^2 go on."""
    solution = ran("output y ~ if time < 2 then 2 else -2; equation y^2 = 4 + x^2;", 3.0)
    (jump,) = solution.jumps
    assert jump.kind.value == "jump" and jump.time == pytest.approx(2.0, abs=1e-11)
    y = sqrt(4 + cos(jump.time) ** 2)
    assert (*jump.before, *jump.after) == pytest.approx((y, -y), rel=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("names", [("kepler", "its equations step"), pytest.param(tuple(QUIET), marks=pytest.mark.slow)], ids=["few", "all"])  # fmt: skip
def test_what_changes_fast_or_by_itself_is_no_jump(names: tuple[str, ...]) -> None:
    solution = ran(" ".join(QUIET[name] for name in names), 20.0)
    assert solution.outcome.value == "completed"
    assert solution.jumps == () and solution.further_solutions == ()
    assert not [r for r in solution.remarks if "solution" in r]


@pytest.mark.slow
def test_events_are_no_jumps() -> None:
    """The rate of a bouncing ball changes its sign, and with it what the equation says."""
    text = (
        "dimensionless; coordinate x = 1; kinetic 1/2*der(x)^2; potential x; discrete Real side = 1; "
        "when x < 0 then reinit(der(x), -der(x)); side := -side; end when; "
        "output y ~ 1; equation y^3 + y = der(x); output z ~ side; equation z^2 = 2 + x; experiment(stop = 10);"
    )
    solution = mechc.loads(text).simulate(estimate_error=False)
    assert len(solution.events) > 3 and np.ptp(np.sign(solution["z"])) == 2
    assert solution.jumps == () and [s.names for s in solution.further_solutions] == [("z",)]


def assemblies(t: float) -> list[tuple[float, float]]:
    """Both positions of coupler and rocker: circles around the ends of crank and base meet in two points."""
    p = complex(cos(t), sin(t))
    d = 2.5 - p
    along = (abs(d) ** 2 + 9 - 4) / (2 * abs(d))
    found = []
    for side in (1, -1):
        joint = p + d / abs(d) * complex(along, side * sqrt(9 - along**2))
        found.append((atan2((joint - p).imag, (joint - p).real), atan2(joint.imag, joint.real - 2.5)))
    return found


@pytest.mark.slow
def test_both_assemblies_of_a_four_bar() -> None:
    solution = ran(ROD, 6.0)
    (several,) = solution.further_solutions
    assert several.names == ("a", "b")
    upper, lower = assemblies(0.0)
    assert several.taken == pytest.approx(upper, rel=1e-9)
    assert list(several.others) == [pytest.approx(lower, rel=1e-9)]  # whole turns are not others
    assert any(
        "'a', 'b' = (0.634184, 1.09468)" in r and "(-0.634184, -1.09468)" in r for r in solution.remarks
    )
    assert solution.jumps == ()


def test_a_range_says_which_one_is_meant() -> None:
    text = "output Real y({}) ~ 1; equation y^2 = 1 + x^2;"
    assert list(ran(text.format("max = 5"), 1.0).further_solutions[0].others) == [pytest.approx((-sqrt(2),))]
    assert ran(text.format("min = 0"), 1.0).further_solutions == ()
    solution = ran(text.format("max = 0"), 1.0)
    assert solution.further_solutions[0].outside
    assert any("lies outside of the range" in r and "-1.41421" in r for r in solution.remarks)


def test_a_sweep_tells_the_first_run_that_jumps(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The guess changes its sign at t = 0.5."""
    path = tmp_path / "swept.mech"
    path.write_text(
        BODY + "parameter k = 1; output Real y(min = 0) ~ if time < 0.5 then 1 else -1; equation y^2 = k;"
        "experiment(stop = 0.4); experiment scan(k in {1, 4}, stop = 1);",
        encoding="utf-8",
    )
    assert run(["run", str(path), "--experiment", "scan"]) == 0
    notes = [line for line in capsys.readouterr().out.splitlines() if "note:" in line]
    assert len(notes) == 1
    assert "'y' jumps at t = 0.5 from 1 to -1" in notes[0] and "(first with k = 1)" in notes[0]


def test_models_without_motion() -> None:
    solution = mechc.loads("output Length r ~ 1 m; equation r^2 = 2 m^2; experiment(stop = 0 s);").simulate()
    assert any("'r' = 1.41421 m at t = 0 s" in r and "-1.41421 m" in r for r in solution.remarks)


def test_what_stands_alone_holds_nothing_of_it(cubic: mechc.Model, tmp_path: Path) -> None:
    program = cubic.compilation.program
    assert program.function("sought") is not None
    alone = standing_alone(program)
    assert alone.function("sought") is None and not alone.sought and "g" not in alone.arrays
    cubic.compile("python", tmp_path / "cubic.py")
    assert "sought" not in (tmp_path / "cubic.py").read_text(encoding="utf-8")


def test_other_models_know_nothing_of_it() -> None:
    solution = ran("output y = 2*x;", 0.1)
    assert solution.problem.sought == () and solution.motion.sought is None
    assert "jumps" not in solution.report and "further_solutions" not in solution.report
