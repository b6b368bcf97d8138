"""Questions that are put again with other values: nothing of the one before is left in the answer."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import mechc
from mechc.model import set_singly
from mechc.requests.parse_values import UsageMistake
from mechc.runtime.native.build import find_compiler

MODEL = """model M
  structural parameter Integer n = 2;
  parameter m = 1 kg;
  parameter r[2] = {1, 2} m;
  coordinate x = 1 m;
  coordinate Rotation turn;
  input Force push = 0 N;
  kinetic 1/2*m*der(x)^2;
  frame body = world * turn;
  inertia diag({1, 2, 3})*(1 kg.m^2) on body;
  potential 1/2*n*1 N/m*x^2;
  force push on x;
  output Length far = r[1] + r[2];
  experiment(stop = 1 s);
  experiment Longer(stop = 2 s, m = 3 kg);
end M;
"""
PLAIN = """model P
  parameter m = 1 kg;
  parameter r[2] = {1, 2} m;
  coordinate x = 1 m;
  kinetic 1/2*m*der(x)^2;
  potential 1/2*1 N/m*x^2;
  input Force push = 0 N;
  force push on x;
  output Length far = r[1] + r[2];
  experiment(stop = 1 s);
  experiment Longer(stop = 2 s, m = 3 kg);
end P;
"""

pytestmark = pytest.mark.skipif(find_compiler() is None, reason="needs a C compiler")


@pytest.fixture(scope="module")
def model() -> mechc.Model:
    return mechc.loads(PLAIN)


def at_end(model: mechc.Model, **asked: object) -> float:
    return float(model.simulate(**asked)["x"][-1])  # type: ignore[arg-type]


def test_each_value_has_its_own_answer(model: mechc.Model) -> None:
    """cos(t/sqrt(m)), whatever was asked before."""
    for mass in (1.0, 2.0, 5.0, 1.0):
        assert at_end(model, set={"m": mass}) == pytest.approx(np.cos(mass**-0.5), rel=1e-7)
    assert at_end(model, set={"x": 2.0}) == pytest.approx(2 * np.cos(1.0), rel=1e-7)
    assert at_end(model) == pytest.approx(np.cos(1.0), rel=1e-7)
    assert at_end(model, experiment="Longer") == pytest.approx(np.cos(2 * 3**-0.5), rel=1e-7)
    assert at_end(model, experiment="Longer", set={"m": 1.0}) == pytest.approx(np.cos(2.0), rel=1e-7)
    assert at_end(model, set={"m": 4}) == pytest.approx(np.cos(0.5), rel=1e-7)
    assert at_end(model, set={"m": "4000 g"}) == at_end(model, set={"m": 4})


def test_settings_of_equal_value_and_other_type_are_told_apart(model: mechc.Model) -> None:
    assert model.simulate(estimate_error=True).accuracy.error is not None
    with pytest.raises(UsageMistake, match="True or False"):
        model.simulate(estimate_error=1)  # type: ignore[arg-type]
    assert model.simulate(estimate_error=False).accuracy.error is None
    assert model.simulate(stop=1).time[-1] == model.simulate(stop=1.0).time[-1] == 1.0


def test_a_table_is_read_each_time(model: mechc.Model, tmp_path: Path) -> None:
    found = []
    for value in (0.0, 1.0):
        (tmp_path / "push.csv").write_text(f"time,push\n0,{value}\n2,{value}\n")
        found.append(at_end(model, inputs={"push": tmp_path / "push.csv"}))
    assert found[0] == pytest.approx(np.cos(1.0), rel=1e-7)
    assert found[1] == pytest.approx(1.0, rel=1e-7), "held where the spring pulls as much"


def test_a_streamed_file_is_written_each_time(model: mechc.Model, tmp_path: Path) -> None:
    for mass in (1.0, 4.0):
        model.simulate(set={"m": mass}, to=str(tmp_path / "motion.csv"))
        last = (tmp_path / "motion.csv").read_text().splitlines()[-1].split(",")
        assert float(last[1]) == pytest.approx(np.cos(mass**-0.5), rel=1e-6)


def test_measured_data_are_read_each_time(model: mechc.Model, tmp_path: Path) -> None:
    """A question that names a file is posed again."""
    for mass in (1.0, 2.0):
        solution = model.simulate(set={"m": mass}, estimate_error=False)
        solution.save(tmp_path / "measured.csv", ["x"])
        fitted = model.fit(str(tmp_path / "measured.csv"), "m", set={"m": 1.5})
        assert fitted["m"] == pytest.approx(mass, rel=1e-4)


@pytest.mark.parametrize("given", [{"m": float("nan")}, {"m": float("inf")}, {"nothing": 1.0}, {"r": 1.0}])
def test_what_is_no_plain_number_goes_the_long_way(model: mechc.Model, given: dict[str, float]) -> None:
    if "r" in given:
        assert float(model.simulate(set=given)["far"][0]) == 2.0, "all elements"
        return
    with pytest.raises(UsageMistake):
        model.simulate(set=given)


def test_rotations_and_structural_values_are_none_that_are_set_singly() -> None:
    singly = set_singly(mechc.loads(MODEL).compilation)
    assert {"m", "r[1]", "r[2]", "x", "push"} <= singly
    assert not {name for name in singly if name.startswith("turn")} and "n" not in singly
