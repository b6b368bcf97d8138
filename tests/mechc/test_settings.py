"""Values given outside a model: numbers, units, lists, and what is said when they are wrong."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import mechc
from mechc.requests.in_si import settings_in_si
from mechc.requests.input_tables import factor_of
from mechc.requests.parse_values import (
    Given,
    UsageMistake,
    elements_of,
    read_value,
    split_assignment,
    structural_value,
)

UNITS = {
    "l": "m",
    "theta": "rad",
    "der(theta)": "rad/s",
    "mu": "",
    "r[1]": "m",
    "r[2]": "m",
    "der(R)[1]": "rad/s",
    **{f"Q[{k}]": "" for k in range(1, 5)},
    **{f"grid[{i},{j}].m": "kg" for i in (1, 2) for j in (1, 2)},
    **{f"der(grid[{i},{j}].x[{k}])": "m/s" for i in (1, 2) for j in (1, 2) for k in (1, 2)},
}


@pytest.mark.parametrize(
    ("text", "number", "unit"),
    [
        ("1.5", 1.5, None),
        ("-2e-3 m", -2e-3, "m"),
        ("80cm", 80.0, "cm"),
        ("5 N.m/rad", 5.0, "N.m/rad"),
        ("pi/3", math.pi / 3, None),
        ("-pi", -math.pi, None),
        ("2*pi/3 rad", 2 * math.pi / 3, "rad"),
        ("1/4 m", 0.25, "m"),
        ("3 m/s", 3.0, "m/s"),
        (".5", 0.5, None),
    ],
)
def test_numbers_and_units(text: str, number: float, unit: str | None) -> None:
    value = read_value(text)
    assert value.numbers == (number,)
    assert (value.unit.symbol if value.unit else None) == unit


def test_settings_are_converted_to_si() -> None:
    given: dict[str, Given] = {"l": "80 cm", "theta": "30 deg", "mu": 0.3, "r": "{1, 2} mm", "der(R)": [4.0]}
    settings = settings_in_si(given, UNITS)
    assert settings == pytest.approx(
        {"l": 0.8, "theta": math.pi / 6, "mu": 0.3, "r[1]": 1e-3, "r[2]": 2e-3, "der(R)[1]": 4.0}, rel=1e-15
    )


def test_one_value_fills_all_elements_and_single_ones_go_first() -> None:
    grid = [f"grid[{i},{j}].m" for i in (1, 2) for j in (1, 2)]
    assert settings_in_si({"grid.m": "30 g"}, UNITS) == dict.fromkeys(grid, 0.03)
    assert settings_in_si({"grid[2,1].m": 5, "grid.m": 3}, UNITS) == dict(
        zip(grid, [3, 3, 5, 3], strict=True)
    )
    assert settings_in_si({"grid.m": "{1, 2, 3, 4} kg"}, UNITS) == dict(zip(grid, [1, 2, 3, 4], strict=True))
    assert settings_in_si({"r": "1 mm"}, UNITS) == {"r[1]": 1e-3, "r[2]": 1e-3}
    assert list(settings_in_si({"der(grid[1,2].x)": 1}, UNITS)) == [
        "der(grid[1,2].x[1])",
        "der(grid[1,2].x[2])",
    ]
    assert len(settings_in_si({"der(grid.x)": 1}, UNITS)) == 8
    assert list(settings_in_si({"der(grid[2,2].x)[2]": 1}, UNITS)) == ["der(grid[2,2].x[2])"]


@pytest.mark.parametrize(
    "name", ["grid[1].m", "grid.n", "grid", "rid.m", "grid.m[1]", "der(grid.m)", "der(grid.x", "r[3]"]
)
def test_names_that_stand_for_nothing(name: str) -> None:
    assert elements_of(name, UNITS) == []


def test_numbers_of_numpy_are_numbers() -> None:
    given: dict[str, Given] = {
        "l": np.int64(2),
        "theta": np.array(0.5),
        "r": np.array([1, 2]),
        "mu": np.float32(0.5),
    }
    assert settings_in_si(given, UNITS) == {"l": 2.0, "theta": 0.5, "r[1]": 1.0, "r[2]": 2.0, "mu": 0.5}


def test_rotations_are_written_as_in_models() -> None:
    """Products turn the outer frame first; SciPy's Rotation has its scalar part last."""
    of_scipy = Rotation.from_euler("z", 30, degrees=True) * Rotation.from_rotvec(
        0.2 * np.array([1, 2, 2]) / 3
    )
    found = settings_in_si({"Q": " rotz(30 deg) * axis_angle({1, 2, 2}, 0.2)"}, UNITS, {"Q"})
    np.testing.assert_allclose([found[f"Q[{k}]"] for k in (2, 3, 4, 1)], of_scipy.as_quat(), atol=1e-15)


@pytest.mark.parametrize(
    ("given", "message", "help"),
    [
        ({"l": "3 s"}, "'l' is given in s; it has the unit m", ""),
        ({"mu": "3 m"}, "'mu' is given in m; it is a pure number", ""),
        ({"tehta": "3"}, "the model has no parameter or initial value 'tehta'", "did you mean 'theta'?"),
        ({"tehta": "true"}, "the model has no parameter or initial value 'tehta'", "did you mean 'theta'?"),
        ({"l": "3 metres"}, "'l': unknown unit 'metres'", "did you mean 'm'?"),
        ({"l": "long"}, "'l': 'long' is not a number", 'a number with its unit, as in "80 cm" or "30 deg"'),
        (
            {"Q": 1},
            "'Q' is a rotation, which has 4 numbers",
            "give it whole, as in Q='rotz(30 deg)*rotx(0.2)', or as a unit quaternion: Q={1, 0, 0, 0}",
        ),
        (
            {"l": [1.0, 2.0]},
            "'l' is one number, 2 were given",
            "run once for each, or write an experiment with 'l in {...}'",
        ),
        ({"l": math.nan}, "'l' takes finite numbers, not nan", ""),
        (
            {"r": [[1.0], [2.0]]},
            "'r' takes a number, a text such as \"80 cm\" or a list of numbers, not [[1.0], [2.0]]",
            "",
        ),
        ({"r": "{1, 2, 3} m"}, "'r' has 2 element(s), 3 were given", ""),
        (
            {"r": "{1 m, 2}"},
            "'r': '{1 m, 2}' is not a list of numbers",
            "the unit stands after the brace: {1, 2} mm",
        ),
        ({"r": "{1, 2"}, "'r': '{1, 2' has no closing brace", ""),
        ({"Q": "rotx(2 m)"}, "'Q': 'the angle' is given in m; it has the unit rad", ""),
        (
            {"Q": "rotx(1)*rotz(1"},
            "'Q': 'rotz(1' is not a rotation",
            "one is written as rotz(30 deg)*axis_angle({1, 1, 0}, 0.2)",
        ),
        (
            {"Q": "axis_angle(1, 2)"},
            "'Q': axis_angle takes an axis and an angle, not '1, 2'",
            "axis_angle({1, 1, 0}, 0.2)",
        ),
        ({"Q": "axis_angle({0, 0, 0}, 2)"}, "'Q': the axis {0, 0, 0} has no direction", ""),
    ],
)
def test_mistakes(given: dict[str, Given], message: str, help: str) -> None:
    with pytest.raises(UsageMistake) as caught:
        settings_in_si(given, UNITS, ["Q"])
    assert (caught.value.message, caught.value.help) == (message, help)
    assert str(caught.value) == (f"{message}; {help}" if help else message), "what a traceback shows"


def test_assignments() -> None:
    assert split_assignment("der(theta) = 2 rad/s") == ("der(theta)", "2 rad/s")
    assert split_assignment("grid[2, 1].m=3") == ("grid[2,1].m", "3")
    for wrong in ("l", "=3", "l="):
        with pytest.raises(UsageMistake):
            split_assignment(wrong)


def test_structural_values() -> None:
    values = [structural_value(text) for text in ("true", "7", "2.5", "stick", '"stick"', "1_0")]
    assert values == [True, 7, 2.5, "stick", "stick", "1_0"]
    assert type(values[1]) is int


PLACES = """\
model M
  parameter l = 1 m;
  coordinate theta = 0 rad;
  coordinate Length x[2];
  kinetic 1/2*(1 kg)*(l^2*der(theta)^2 + der(x[1])^2 + der(x[2])^2);
end M;
"""


def _read(kind: str, given: object) -> object:
    import mechc
    from mechc.requests.question import _READ
    from mechc.runtime.settings import QuestionSetting

    return _READ[kind](
        QuestionSetting("at", "Where.", kind, "at"), given, mechc.loads(PLACES).problem(quick=True)
    )


def test_a_place_is_a_word_or_values_of_the_state() -> None:
    from mechc.runtime.settings import Place

    assert _read("place", "equilibrium") == Place("equilibrium")
    assert _read("place", "theta = 30 deg, x[ 2 ] = 2 cm,der(theta)=1") == Place(
        "start", {"theta": math.radians(30), "x[2]": 0.02, "der(theta)": 1.0}
    )
    assert _read("place", "x = {1, 2} cm, l = 2") == Place("start", {"x[1]": 0.01, "x[2]": 0.02, "l": 2.0})
    assert _read("place", {"theta": "90 deg"}) == Place("start", {"theta": math.radians(90)})
    with pytest.raises(UsageMistake, match="'at' is start, equilibrium, or values of the state"):
        _read("place", "equilibrum")
    with pytest.raises(UsageMistake, match="did you mean 'theta'"):
        _read("place", "teta = 1")


def test_ranges_have_units_and_may_have_a_number_of_values() -> None:
    from mechc.runtime.settings import Range

    assert _read("ranges", "l = 0 .. 50 cm") == (Range("l", "m", 0.0, 0.5),)
    assert _read("ranges", "l=10 cm..2 m, 20, x[1] = -1 .. 1e-3, 3") == (
        Range("l", "m", 0.1, 2.0, 20),
        Range("x[1]", "m", -1.0, 1e-3, 3),
    )
    assert _read("ranges", {"l": (1, 2, 5)}) == (Range("l", "m", 1.0, 2.0, 5),)
    for wrong, message in (
        ("l = 3", "the values of 'l' are a range"),
        ("l = 3 .. 1", "from a lower to a higher value"),
        ("k = 0 .. 1", "no parameter, initial value or input 'k'"),
        ("l = 0 s .. 1 s", "l"),
    ):
        with pytest.raises(UsageMistake, match=message):
            _read("ranges", wrong)


COUNTED = """\
parameter Integer n = 3;
parameter Boolean soft = true;
coordinate x = 1 m;
kinetic 1/2*1 kg*der(x)^2;
potential 1/2*n*1 N/m*x^2*(if soft then 1 else 4);
experiment(stop = 1 s);
"""


def test_whole_numbers_and_truth_values_are_set_as_such() -> None:
    """x = cos(w t), w^2 = n or 4 n; 3.5 and 0.5 were taken without a word, and 'false' was not a number."""
    model = mechc.loads(COUNTED)
    for given, stiffness in (
        ({"n": 4}, 4),
        ({"soft": "false"}, 12),
        ({"soft": False, "n": 1}, 4),
        ({"soft": "true"}, 3),
    ):
        assert model.simulate(set=given)["x"][-1] == pytest.approx(np.cos(np.sqrt(stiffness)), abs=1e-7)
    for name, value, words in (
        ("n", 3.5, "a whole number, not 3.5"),
        ("soft", 0.5, "true or false, 1 or 0, not 0.5"),
    ):
        with pytest.raises(mechc.SimulationError, match=words):
            model.simulate(set={name: value})
    with pytest.raises(mechc.UsageMistake, match="'true' is not a number"):
        model.simulate(set={"n": "true"})
    assert model.ensemble({"n": [1, 2]}, keep="final(x)")["final(x)"] == pytest.approx(
        np.cos(np.sqrt([1, 2])), abs=1e-7
    )
    for vary in ("n = 1 .. 2, 3", "n ~ uniform(1, 2)"):
        with pytest.raises(mechc.SimulationError, match="the parameter 'n' is a whole number"):
            model.ensemble(vary, keep="final(x)", samples=4 if "~" in vary else None)


@pytest.mark.parametrize("unit", ["Hz", "kHz", "min^-1", "1/min"])
def test_a_turn_is_no_radian(unit: str) -> None:
    """3000 1/min was read as 50 rad/s, where 3000 turns are 314 rad/s."""
    with pytest.raises(UsageMistake, match="a turn is 2 pi rad") as told:
        settings_in_si({"der(theta)": f"3000 {unit}"}, UNITS)
    assert "rpm" in told.value.help
    assert settings_in_si({"der(theta)": "3000 rpm"}, UNITS)["der(theta)"] == pytest.approx(100 * math.pi)
    assert settings_in_si({"der(theta)": "3000 s^-1"}, UNITS) == {"der(theta)": 3000.0}
    assert settings_in_si({"f": f"3000 {unit}"}, {"f": "1/s"})["f"] > 0
    with pytest.raises(UsageMistake, match=r"the column 'n' of log.csv is in .*: a turn is 2 pi rad"):
        factor_of("log.csv", "n", "rad/s", unit)
    assert factor_of("log.csv", "f", "Hz", unit) == pytest.approx({"Hz": 1, "kHz": 1000}.get(unit, 1 / 60))
