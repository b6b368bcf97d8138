"""Experiments: settings, options, sweeps, structural parameters."""

from __future__ import annotations

import pytest
from flat_models import codes, flat, number, said, value

import mechc
from mechc.lang.diagnostics import CompileError
from mechc.requests.parse_values import UsageMistake

MODEL = """
model Part
  parameter k = 1 N/m;
  coordinate Angle angle = 0;
  kinetic 1/2*1 kg.m^2*der(angle)^2;
end Part;

model M
  structural parameter Integer n = 2;
  structural parameter Boolean closed = false;
  parameter m = 1 kg;
  parameter Length l[2] = 1 m;
  input Force u = 0;
  state Force f = 0;
  coordinate x = 0 m;
  let twice = 2*m;
  kinetic 1/2*m*der(x)^2;
  equation der(f) = (u - f)/1 s;
  Part part[2];
  EXPERIMENT
end M;
"""


def with_experiment(settings: str) -> str:
    return MODEL.replace("EXPERIMENT", f"experiment({settings});")


def test_options_and_settings_are_told_apart() -> None:
    (experiment,) = flat(
        with_experiment(
            'stop = 10 s, every = 1/3*1 s, tolerance = 1e-9, method = "rk4", record = der(x), m = 2 kg, x ~ 1 m, '
            "der(x) = 2 m/s, part[2].angle = 30 deg, l[1] = 3 m, u = 3 N, f = 1 N"
        )
    ).experiments
    assert number(experiment.options["stop"]) == 10 and number(experiment.options["every"]) == pytest.approx(
        1 / 3
    )
    assert value(experiment.options["method"]) == '"rk4"' and value(experiment.options["record"]) == "der(x)"
    found = [(s.target, s.indices, s.rate, s.guess, value(s.value)) for s in experiment.settings]
    assert [f[:4] for f in found] == [
        ("m", (), False, False),
        ("x", (), False, True),
        ("x", (), True, False),
        ("part[2].angle", (), False, False),
        ("l", (0,), False, False),
        ("u", (), False, False),
        ("f", (), False, False),
    ]
    assert found[5][4] == "3"


def test_values_see_the_model() -> None:
    (experiment,) = flat(with_experiment("m = 3 kg, x = 2 m*m/1 kg, stop = 1 s")).experiments
    assert value(experiment.settings[1].value) == "2*m/1"


def test_slices_are_set_element_by_element() -> None:
    (experiment,) = flat(with_experiment("part.angle = {1, 2} rad, stop = 1 s")).experiments
    assert [(s.target, value(s.value)) for s in experiment.settings] == [
        ("part[1].angle", "1"),
        ("part[2].angle", "2"),
    ]


def test_structural_parameters() -> None:
    (experiment,) = flat(with_experiment("n = 5, closed = true, stop = 1 s")).experiments
    assert experiment.structural == {"n": 5, "closed": True}
    assert flat(MODEL.replace("EXPERIMENT", ""), structural={"n": 7}).structural == {"n": 7, "closed": False}


@pytest.mark.parametrize("given", [{"nn": 3}, {"m": 3}])
def test_unknown_structural_values(given: dict[str, int]) -> None:
    assert [d.code for d in said(MODEL.replace("EXPERIMENT", ""), structural=given)] == ["E0801"]


@pytest.mark.parametrize("given", [{"n": 2.5}, {"n": True}, {"n": "2"}, {"closed": 1}])
def test_structural_values_of_another_type(given: dict[str, int | float | bool | str]) -> None:
    assert [d.code for d in said(MODEL.replace("EXPERIMENT", ""), structural=given)] == ["E0303"]


def test_sweeps() -> None:
    (experiment,) = flat(
        with_experiment("m in linspace(1 kg, 2 kg, 3), x in {1, 2} cm, n in 2:2:6, stop = 1 s")
    ).experiments
    assert [(s.target, s.structural, [number(v) for v in s.values]) for s in experiment.sweeps] == [
        ("m", False, [1, 1.5, 2]),
        ("x", False, [0.01, 0.02]),
        ("n", True, [2, 4, 6]),
    ]


def test_sweeps_of_elements_and_rates() -> None:
    (experiment,) = flat(
        with_experiment("l[2] in {3, 4} cm, part[1].angle in {1, 2} rad, der(x) in {0, 5} m/s, stop = 1 s")
    ).experiments
    assert [(s.target, s.indices, s.rate, [number(v) for v in s.values]) for s in experiment.sweeps] == [
        ("l", (1,), False, [0.03, 0.04]),
        ("part[1].angle", (), False, [1, 2]),
        ("x", (), True, [0, 5]),
    ]


def test_rates_of_all_components_are_set_at_once() -> None:
    (experiment,) = flat(
        with_experiment("der(part.angle) = {1, 2} rad/s, part.angle ~ 1 rad, stop = 1 s")
    ).experiments
    assert [(s.target, s.rate, s.guess, number(s.value)) for s in experiment.settings] == [
        ("part[1].angle", True, False, 1),
        ("part[2].angle", True, False, 2),
        ("part[1].angle", False, True, 1),
        ("part[2].angle", False, True, 1),
    ]
    assert codes(with_experiment("der(part.angle) = {1, 2, 3} rad/s, stop = 1 s")) == ["E0305"]


@pytest.mark.parametrize(
    ("settings", "code"),
    [
        ("stopp = 1 s", "E0801"),
        ("y = 1 m", "E0801"),
        ("part[3].angle = 1 rad", "E0314"),
        ("part[1].agle = 1 rad", "E0202"),
        ("twice = 1 kg", "E0802"),
        ("2*m = 1 kg", "E0127"),
        ("der(m) = 1 kg/s", "E0802"),
        ("der(x, 2) = 1 m/s^2", "E0802"),
        ("m ~ 1 kg", "E0403"),
        ("m = 1", "E0303"),
        ("x = 1 s", "E0303"),
        ("l = {1, 2, 3} m", "E0305"),
        ("m = 1 kg, m = 2 kg", "E0409"),
        ("stop = 1", "E0804"),
        ("stop = 1 m", "E0804"),
        ("stop ~ 1 s", "E0804"),
        ("stop in {1, 2} s", "E0804"),
        ("method = 1", "E0804"),
        ("tolerance = 1 m", "E0804"),
        ("record = l", "E0804"),
        ("n = 2.5", "E0303"),
        ("n = m/1 kg", "E0315"),
        ("n = {1, 2}", "E0305"),
        ("m in 3 kg", "E0305"),
        ("l in {1, 2} m", "E0809"),
        ("part.angle in {1, 2} rad", "E0809"),
        ("der(part.angle) in {1, 2} rad/s", "E0809"),
        ("part.angle ~ uniform(1 rad, 2 rad)", "E0809"),
        ("l[3] in {1, 2} m", "E0314"),
        ("l[1] in {1, 2} s", "E0303"),
        ("der(m) in {1, 2} kg/s", "E0802"),
        ("m in {1, 2} s", "E0303"),
        ("m in {m, 2*m}", "E0315"),
        ("world -> world", "E0801"),
    ],
)
def test_wrong_settings(settings: str, code: str) -> None:
    assert codes(with_experiment(settings)) == [code]


@pytest.mark.parametrize("setting", ["method", "display"])
def test_a_text_without_quotes_is_told_how_to_be_one(setting: str) -> None:
    (one,) = said(with_experiment(f"{setting} = moreau"))
    assert (one.code, one.message) == ("E0804", f"'{setting}' must be a text")
    assert one.help == f"a text stands in quotes: '{setting} = \"moreau\"'"
    assert codes(with_experiment(f"{setting} = m")) == ["E0804"]
    assert codes(with_experiment("tolerance = unknown")) == ["E0201"]


def test_names_of_experiments_and_settings() -> None:
    text = MODEL.replace("EXPERIMENT", "experiment a(stop = 1 s); experiment a(stop = 2 s);")
    assert codes(text) == ["E0803"]
    assert codes(MODEL.replace("EXPERIMENT", "parameter stop = 1 s; experiment(tolerance = 1e-6);")) == [
        "E0805"
    ]


def test_settings_of_time_in_models_without_units() -> None:
    model = flat("dimensionless; coordinate x = 0; kinetic der(x)^2; experiment(stop = 10, every = 2*pi);")
    assert number(model.experiments[0].options["stop"]) == 10


@pytest.mark.parametrize(
    "setting",
    [
        "u = 1 N*sin(time/1 s)",
        "m = 1 kg*time/1 s",
        "f = x*1 N/m",
        "x = part[1].angle*1 m",
        "stop = x*1 s/m",
        "f ~ u",
    ],
)
def test_settings_that_depend_on_the_motion_are_refused(setting: str) -> None:
    assert codes(with_experiment(setting)) == ["E0812"]


@pytest.mark.parametrize("default", ["x*1 N/m", "f", "1 N*sin(time/1 s)*y/1 m", "der(x)*1 N.s/m", "other"])
def test_defaults_of_inputs_that_depend_on_the_motion_are_refused(default: str) -> None:
    text = MODEL.replace(
        "input Force u = 0;", f"input Force other = 1 N; let y = 2*x; input Force u = {default};"
    )
    assert codes(text.replace("EXPERIMENT", "")) == ["E0811"]


def test_defaults_of_inputs_may_use_time_and_parameters() -> None:
    text = MODEL.replace("input Force u = 0;", "let s = 2*time; input Force u = m*s*1 m/s^3;")
    assert not codes(text.replace("EXPERIMENT", ""))


SIZES = """
model Row
  structural parameter Integer n = 2;
  coordinate Length x[n] = {i*1 m for i in 1:n};
  kinetic sum(1/2*1 kg*der(x[i])^2 for i in 1:n);
  experiment three(stop = 1 s, x = {4, 5, 6} m, n = 3);
  experiment five(stop = 1 s, n = 5, x[5] = 7 m, der(x[4]) = 1 m/s);
end Row;
"""


def test_experiments_of_different_sizes_stand_side_by_side() -> None:
    """Each was checked with the sizes of the model alone, and none of these could run."""
    model = mechc.loads(SIZES)
    three, five = (model.simulate(experiment=name, estimate_error=False) for name in ("three", "five"))
    assert [three[f"x[{i}]"][-1] for i in (1, 2, 3)] == [4, 5, 6]
    assert [five[f"x[{i}]"][-1] for i in (3, 4, 5)] == pytest.approx([3, 5, 7])


def test_an_experiment_that_does_not_fit_its_own_size_is_told() -> None:
    wrong = mechc.loads(SIZES.replace("x[5] = 7 m", "x[6] = 7 m"))
    with pytest.raises(CompileError) as caught:
        wrong.for_experiment("five")
    assert [d.code for d in caught.value.diagnostics] == ["E0314"]
    with pytest.raises(
        UsageMistake, match=r"experiment 'five' sets 'x\[5\]', which .* in this size where n = 2"
    ):
        mechc.loads(SIZES).with_values({"n": 2}).for_experiment("five")
