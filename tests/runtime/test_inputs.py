"""Tables as inputs: their values, their kinks as ends of steps, and how they are read."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from scipy.interpolate import CubicSpline
from written_problems import compiled_driven, driven

from mechc.runtime import inputs
from mechc.runtime.case import SimulationOptions
from mechc.runtime.inputs import Table, make_table
from mechc.runtime.outcome import SimulationError
from mechc.runtime.problem import Problem
from mechc.runtime.sheets import read_sheet
from mechc.runtime.studies.kinds.motion import simulate

Make = Callable[[], Problem]
BOTH = pytest.mark.parametrize("make", [compiled_driven, driven], ids=["compiled", "called"])

TIMES = np.array([0.5, 1.25, 2.0, 3.5])
VALUES = np.array([1.0, -2.0, 4.0, 3.0])


@BOTH
def test_without_a_table_the_model_has_its_own_input(make: Make) -> None:
    solution = simulate(make(), SimulationOptions(stop=3, tolerance=1e-10))
    assert np.abs(solution["x"] - np.sin(solution.time)).max() < 1e-9
    assert np.abs(solution["u"] - np.cos(solution.time)).max() < 1e-15
    assert np.abs(solution["double"] - 2 * np.cos(solution.time)).max() < 1e-15


@BOTH
def test_a_table_that_ends_within_the_run_is_remarked(make: Make) -> None:
    table = make_table(TIMES, VALUES)
    covered = simulate(make(), SimulationOptions(stop=3.5, inputs={"u": make_table([0, 4], [1, 2])}))
    assert not covered.remarks
    (remark,) = simulate(make(), SimulationOptions(stop=3, inputs={"u": table})).remarks
    assert "'u'" in remark and "0.5 s to 3.5" in remark and "hold" in remark


@BOTH
def test_constant_input(make: Make) -> None:
    solution = simulate(make(), SimulationOptions(stop=3, values={"u": 1.5}))
    assert solution["x"][-1] == pytest.approx(4.5, rel=1e-14)


@BOTH
@pytest.mark.parametrize(
    ("interpolation", "tolerance", "bound"),
    [("linear", 1e-2, 1e-8), ("step", 1e-2, 1e-8), ("spline", 1e-10, 1e-8)],
)
def test_integral_of_a_table(make: Make, interpolation: str, tolerance: float, bound: float) -> None:
    """Linear and step tables: each step sees one polynomial, integrated exactly whatever the tolerance.

    A spline has no kinks but at its ends: at a tolerance of 1e-2 its error is 1e-4. The bound is that of the
    sums below; the runs themselves reach 1e-15.
    """
    table = make_table(TIMES, VALUES, interpolation)
    options = SimulationOptions(stop=5, inputs={"u": table}, tolerance=tolerance, points=11)
    solution = simulate(make(), options)
    fine = np.linspace(0, 5, 500_001)
    u = table(fine)
    weights = u[:-1] if interpolation == "step" else (u[:-1] + u[1:]) / 2
    integral = np.concatenate([[0], np.cumsum(weights) * 1e-5])
    expected = np.interp(solution.time, fine, integral)
    assert np.abs(solution["x"] - expected).max() < bound
    assert np.abs(solution["u"] - table(solution.time)).max() == 0
    assert solution.time.size == 11


@BOTH
def test_step_table_is_continuous_from_the_right_and_holds_beyond_its_ends(make: Make) -> None:
    table = make_table([1.0, 2.0], [3.0, 5.0], "step")
    solution = simulate(make(), SimulationOptions(stop=3, inputs={"u": table}, every=0.5))
    assert solution["u"].tolist() == [3, 3, 3, 3, 5, 5, 5]
    assert solution["x"] == pytest.approx([0, 1.5, 3, 4.5, 6, 8.5, 11], rel=1e-14)


def test_spline_is_the_natural_cubic_spline() -> None:
    spline = make_table(TIMES, VALUES, "spline")
    inside = np.linspace(0.5, 3.5, 100)
    expected = CubicSpline(TIMES, VALUES, bc_type="natural")(inside)
    assert np.abs(spline(inside) - expected).max() < 1e-14
    assert spline(np.array([-1.0, 9.0])).tolist() == [1.0, 3.0]


def test_table_of_one_row_is_a_constant() -> None:
    for interpolation in ("linear", "step", "spline"):
        assert make_table([2.0], [7.0], interpolation)(np.array([0.0, 2.0, 3.0])).tolist() == [7, 7, 7]


def read_tables(
    path: Path, known: dict[str, str], factor: Callable[[str, str], float], column: str | None = None
) -> dict[str, Table]:
    sheet = read_sheet(path, is_unit={"s", "m/s", "kg"}.__contains__)
    return inputs.read_tables(sheet.without_repeats(), known, factor, column)


def write(folder: Path, text: str) -> Path:
    path = folder / "input.csv"
    path.write_text(text, encoding="utf-8")
    return path


@BOTH
@pytest.mark.parametrize(("interpolation", "area"), [("linear", 2.0), ("step", 1.0)])
def test_a_time_that_stands_twice_is_a_jump(make: Make, interpolation: str, area: float) -> None:
    """x' = u: from 0 to 1 at the time 1, where it falls to -1; 2 from 2 on. Steps see one line, so it is exact."""
    table = make_table([0, 1, 1, 2, 2], [0, 1, -1, 0, 2], interpolation)
    solution = simulate(make(), SimulationOptions(stop=3, tolerance=1e-3, inputs={"u": table}))
    assert solution["x"][-1] == pytest.approx(area, rel=1e-12)
    # about the time 2 it goes as far forth as back between two rows: that is no standing still
    assert len(solution.remarks) == 1 and solution.statistics.steps < 50
    assert solution(1.0)["u"] == -1 and solution(2.0)["u"] == solution(9 / 4)["u"] == 2


def test_a_spline_has_no_jumps() -> None:
    with pytest.raises(SimulationError, match="a spline has no jumps, but the time 1 stands twice"):
        make_table([0, 1, 1, 2], [0, 1, 2, 3], "spline")


def convert(name: str, unit: str) -> float:
    factors = {("time", "s"): 1.0, ("time", "ms"): 1e-3, ("u", "cm/s"): 1e-2, ("u", "m/s"): 1.0}
    try:
        return factors[name, unit]
    except KeyError:
        raise SimulationError(f"'{name}' is no {unit}") from None


def test_read_tables_with_units(tmp_path: Path) -> None:
    path = write(tmp_path, "\ufefftime [ms], u [cm/s]\r\n0, 100\r\n\r\n500,-50\r\n")
    table = read_tables(path, {"u": "linear"}, convert)["u"]
    assert table.times.tolist() == [0, 0.5]
    assert table.values.tolist() == [1, -0.5]
    other = read_tables(write(tmp_path, "time [s],speed [m/s]\n0,1\n1,2"), {"u": "step"}, convert, column="u")
    assert other["u"].interpolation == "step"


@pytest.mark.parametrize(
    ("header", "expected"),
    [
        ("u[1] [m/s]", {"u[1]": 1.0}),
        ('"u[2,1] [cm/s]"', {"u[2,1]": 0.01}),
        ('"u[2, 1]"', {"u[2,1]": 1.0}),
        ("u[1]", {"u[1]": 1.0}),
        ("u[m/s]", {"u": 1.0}),
        ("part[1].u [m/s]", {"part[1].u": 1.0}),
        ("part[1].u", {"part[1].u": 1.0}),
    ],
)
def test_headers_with_indices(header: str, expected: dict[str, float], tmp_path: Path) -> None:
    def factor(name: str, unit: str) -> float:
        return {"": 1.0, "s": 1.0, "m/s": 1.0, "cm/s": 0.01}[unit]

    known = dict.fromkeys(("u", "u[1]", "u[2,1]", "part[1].u"), "linear")
    tables = read_tables(write(tmp_path, f"time [s],{header}\n0,1\n1,1\n"), known, factor)
    assert {name: table.values[0] for name, table in tables.items()} == expected


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            "time [s],u [m/s]\n1,1\n0,2\n",
            "times of a table must not fall, but in line 3 of .*input.csv the time 0 follows 1",
        ),
        (
            "time [s],u [m/s]\n1,1\n1,2\n1,3\n",
            "the time 1 stands more than twice, the third time in line 4 of",
        ),
        ("time [s],u [m/s]\n0,1\n1\n", "line 3 of .* has 1 cell, not 2"),
        ("time [s],u [m/s]\n0,one\n", "line 2 of .* holds 'one', which is not a finite number"),
        ("time [s],u [m/s]\n0,1\n\n1,nan\n", "line 4 of .* has no value of 'u'"),
        ("time [s],u [m/s]\n0,1\n,2\n", "line 3 of .* has no value of 'time'"),
        ("time [s],u [m/s]\n0,inf\n", "line 2 of .* holds 'inf', which is not a finite number"),
        ("time [s],u [m/s]\n0,1e999\n", "line 2 of .* holds '1e999'"),
        ("time [s],u [m/s]\n0,1_0\n", "line 2 of .* holds '1_0'"),
        ("time [s],u [m/s]\n0,\u0661\n", "line 2 of .* holds '\u0661'"),
        ("time [s],u [m/s]\n0,0x10\n", "line 2 of .* holds '0x10'"),
        ("0,1\n1,2\n", "line 1 of .* holds numbers alone"),
        ("time [s],w [m/s]\n0,1\n", "a column 'w', which is not an input \\(inputs: u\\)"),
        ("time [s],u [m/s],u [m/s]\n0,1,2\n", "two columns 'u'"),
        ("time [s],u [kg]\n0,1\n", "'u' is no kg"),
        ("time [s],u [m/s\n0,1\n", "headed 'name \\[unit\\]', not 'u \\[m/s'"),
        ("", "is empty"),
        ("time [s],u [m/s]\n", "has no rows below"),
    ],
)
def test_wrong_tables(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(SimulationError, match=message):
        read_tables(write(tmp_path, text), {"u": "linear"}, convert)


def test_one_input_of_a_wide_table(tmp_path: Path) -> None:
    path = write(tmp_path, "time [ms],w [kg],u [cm/s]\n0,7,100\n500,7,-50\n")
    tables = read_tables(path, {"u": "linear"}, convert, column="u")
    assert list(tables) == ["u"] and tables["u"].values.tolist() == [1, -0.5]
    with pytest.raises(SimulationError, match="or one headed 'v'; it has 'w', 'u'"):
        read_tables(path, {"v": "linear"}, convert, column="v")


def test_unreadable_tables(tmp_path: Path) -> None:
    with pytest.raises(SimulationError, match=r"cannot read .*absent\.csv"):
        read_tables(tmp_path / "absent.csv", {"u": "linear"}, convert)
    path = tmp_path / "other.csv"
    text = "time [s],u [m/s]\n0,1\n1,2 \u00b0\n"
    for written, words in (
        (b"\xff\xfe" + text.encode("utf-16-le")[:-1], "it begins as UTF-16 and goes on otherwise"),
        (text.replace("\u00b0", "").encode("utf-16-le"), "it is not a text"),
        (text.encode("latin-1"), "line 3 of .* holds '2 °', which is not a finite number"),
    ):
        path.write_bytes(written)
        with pytest.raises(SimulationError, match=words):
            read_tables(path, {"u": "linear"}, convert)


def test_an_input_given_twice_or_unknown() -> None:
    table = make_table([0.0], [1.0])
    with pytest.raises(SimulationError, match="the input 'u' is given twice"):
        simulate(driven(), SimulationOptions(stop=1, values={"u": 1.0}, inputs={"u": table}))
    with pytest.raises(SimulationError, match="'x' is not an input of 'Driven'"):
        simulate(driven(), SimulationOptions(stop=1, inputs={"x": table}))
