"""``min`` and ``max`` of inputs, and periods of noise, hold whatever gives the values: a call, a table, a function, a formula of the
model, a stepper, an environment, an ensemble, an FMU, a module of Python."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mechc
from mechc.fmu.export import FmuOptions, export_fmu

PUSHED = """
model Pushed
  parameter Mass m(min = 0.1 kg, max = 2 kg) = 1 kg;
  input Force F(min = 0 N, max = 1 N) = 0.5 N;
  coordinate Length x = 0 m;
  kinetic 1/2*m*der(x)^2;
  force F on x;
  output far = x;
  experiment(stop = 1 s);
end Pushed;
"""

SHAKEN = """
model Shaken
  parameter Time T = 20 ms;
  coordinate Length x = 0 m;
  kinetic 1/2*(1 kg)*der(x)^2;
  force 1 N*noise(1, T) on x;
  output far = x;
  experiment(stop = 0.1 s);
end Shaken;
"""


@pytest.fixture(scope="module")
def pushed() -> mechc.Model:
    return mechc.loads(PUSHED)


@pytest.fixture(scope="module")
def shaken() -> mechc.Model:
    return mechc.loads(SHAKEN)


@pytest.mark.parametrize(
    ("force", "words"), [(1.5, "above its maximum 1 N"), (-0.1, "below its minimum 0 N")]
)
def test_values_out_of_the_range_are_refused(pushed: mechc.Model, force: float, words: str) -> None:
    with pytest.raises(mechc.SimulationError, match=f"the input 'F' is .* N, {words}"):
        pushed.simulate(set={"F": force})
    with pytest.raises(mechc.SimulationError, match=words):
        pushed.linearize(set={"F": force})
    table = pushed.simulate(inputs={"F": (np.array([0.0, 0.5, 1.0]), np.array([0.5, force, 0.5]))})
    assert table.outcome.value == "failed" and f"the input 'F' is {words}" in table.message
    signal = pushed.simulate(inputs={"F": lambda t: 0.5 + (force - 0.5) * np.sin(np.pi * t)})
    assert signal.outcome.value == "failed" and f"the input 'F' is {words}" in signal.message
    some = pushed.ensemble({"F": [0.5, force]}, "final(x)")
    assert np.isfinite(np.asarray(some["final(x)"]).ravel()).tolist() == [True, False]


@pytest.mark.parametrize("function", [lambda t: abs(np.sin(20 * t)), lambda t: max(0.0, np.sin(20 * t))])
def test_values_at_the_ends_of_the_range_are_within(pushed: mechc.Model, function: Any) -> None:
    """What a fit of the function is off by, and rounding, is no reason."""
    assert pushed.simulate(inputs={"F": function}).outcome.value == "completed"
    assert pushed.simulate(set={"F": "1000 mN"}).outcome.value == "completed"


def test_a_torque_is_told_in_the_unit_of_its_type() -> None:
    """Not in J, which has the same dimension."""
    text = (
        PUSHED.replace("Force F", "Torque F")
        .replace(" N", " N.m")
        .replace("Length x = 0 m", "Angle x = 0 rad")
    )
    model = mechc.loads(text.replace("*m*der", "*m*1 m^2*der"))
    found = model.simulate(inputs={"F": lambda t: 1.5 * t}, estimate_error=False)
    assert found.message.endswith("the input 'F' is above its maximum 1 N.m")


def test_a_stepper_refuses_a_value_and_goes_on(pushed: mechc.Model) -> None:
    with pushed.start() as run:
        run.step(0.1)
        with pytest.raises(mechc.SimulationError, match=r"the input 'F' is 3 N, above its maximum 1 N"):
            run["F"] = 3.0
        run["F"] = 1.0
        run.step(0.2)
        assert run["x"] == pytest.approx(0.5 * 0.5 * 0.1**2 + 0.05 * 0.1 + 0.5 * 0.1**2, rel=1e-9)
    env = pushed.env(0.01)
    env.u[:] = 5.0
    with pytest.raises(mechc.SimulationError, match="above its maximum 1 N"):
        env.step()


def test_inputs_of_blocks_keep_their_ranges() -> None:
    model = mechc.loads("""
        model Valve
          input Real u(min = 0, max = 1);
          output Real y = 2*u;
        end Valve;
        model Plant
          Valve valve(u = 3*time/(1 s));
          state s = 0;
          equation der(s) = valve.y/(1 s);
        end Plant;
    """)
    assert model.simulate(stop=0.3).outcome.value == "completed"
    found = model.simulate(stop=1.0)
    assert "the value of 'valve.u' is above its maximum 1" in found.message


@pytest.mark.parametrize("period", [0.0, -0.02])
def test_a_period_of_noise_is_positive_at_run_time_too(
    shaken: mechc.Model, period: float, tmp_path: Path
) -> None:
    words = "the period of a noise is positive"
    found = shaken.simulate(set={"T": period})
    assert found.outcome.value == "failed" and words in found.message
    some = shaken.ensemble({"T": [0.02, period]}, "final(x)")
    assert np.isfinite(np.asarray(some["final(x)"]).ravel()).tolist() == [True, False]
    (path,) = shaken.compile("python", tmp_path / "shaken.py")
    module: dict[str, Any] = {"__name__": "generated"}
    exec(path.read_text(), module)
    with pytest.raises(Exception, match=words):
        module["simulate"](values={"T": period})


@pytest.mark.slow
@pytest.mark.parametrize("fmi", ["2", "3"])
def test_units_refuse_what_is_out_of_range(
    pushed: mechc.Model, shaken: mechc.Model, fmi: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("fmpy")
    from mechc.fmu.run import run_fmu

    def unit(model: mechc.Model, name: str) -> Path:
        (path,) = export_fmu(
            model, tmp_path / f"{name}.fmu", FmuOptions(fmi, "cs", None, False, False, ("host",), False)
        )
        return path

    first, second = unit(pushed, "pushed"), unit(shaken, "shaken")
    for path, values, words in (
        (first, {"m": "5"}, "the parameter 'm' is 5 kg, above its maximum 2 kg"),
        (first, {"m": "0.05"}, "the parameter 'm' is 0.05 kg, below its minimum 0.1 kg"),
        (first, {"F": "1.5"}, "the input 'F' is above its maximum 1 N"),
        (second, {"T": "0"}, "the period of a noise is positive"),
        (second, {"T": "-1"}, "the period of a noise is positive"),
    ):
        with pytest.raises(Exception) as raised:
            run_fmu(path, kind="cs", values=values)
        assert words in str(raised.value) + "".join(capfd.readouterr())
    assert run_fmu(first, kind="cs", values={"m": "2"})["far"][-1] == pytest.approx(0.125, rel=1e-6)
