"""Tasks: what is stated of them is checked, and Gymnasium gets what the model says."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mechc
from mechc.cli.main import run
from mechc.lang.diagnostics import CompileError
from mechc.runtime.outcome import SimulationError

PENDULUM = """\
model Pendulum
  input Torque u(min = -2 N.m, max = 2 N.m) = 0 N.m;
  parameter m = 1 kg;
  coordinate Angle a = 0 rad;
  kinetic 1/2*m*(1 m^2)*der(a)^2;
  potential -(9.81 N.m)*cos(a);
  force u on a;
  study swing = task(
    observe = "sin(a), cos(a), der(a)/(2 rad/s)",
    reward = -cos(a) - 0.01*(u/(1 N.m))^2,
    terminate = abs(der(a)) > 2 rad/s or a > 100 deg,
    vary = "a ~ uniform(-80 deg, 80 deg), der(a) ~ normal(0 rad/s, 0.5 rad/s)",
    every = 50 ms, stop = 1 s, method = rk4);
end Pendulum;
"""


@pytest.fixture(scope="module")
def model() -> mechc.Model:
    return mechc.loads(PENDULUM)


def test_nobody_acts(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """The return is that of runs of the model from the same starts."""
    monkeypatch.chdir(tmp_path)
    Path("p.mech").write_text(PENDULUM.replace("or a > 100 deg", ""))
    assert run(["study", "p.mech", "swing", "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    told = said["studies"]["swing"] if "studies" in said else said
    returns = np.array(told["returns"])
    assert returns.size == 100
    random, model = np.random.default_rng(1), mechc.load("p.mech")
    angles = np.deg2rad(-80 + 160 * random.random(100))
    from scipy.special import ndtri

    rates = 0.5 * ndtri(random.random(100))
    for k in range(5):
        motion = model.simulate(set={"a": angles[k], "der(a)": rates[k]}, stop=1, every=0.05, tolerance=1e-10)
        fast = np.flatnonzero(np.abs(motion["der(a)"]) > 2)
        last = fast[0] if fast.size else 20
        assert returns[k] == pytest.approx(-np.cos(motion["a"][1 : last + 1]).sum(), abs=1e-5)


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (("der(a)/(2 rad/s)", "der(a)"), "'der.a.' has the unit rad/s"),
        (("reward = -cos(a)", "reward = 1 N.m*cos(a)"), "is an energy"),
        (
            ("reward = -cos(a) - 0.01*(u/(1 N.m))^2", "reward = energy.kinetic"),
            "'energy.kinetic' has the unit J",
        ),
        (("a ~ uniform(-80 deg, 80 deg)", "m ~ uniform(1 kg, 2 kg)"), "not a coordinate, rate or state"),
        (("every = 50 ms, ", ""), "how long a control step lasts"),
        (("every = 50 ms", "every = 30 ms"), "not a whole number of control steps"),
        (("method = rk4", "method = rk4, actions = {a}"), "not an input that can be set"),
    ],
)
def test_what_is_no_task(change: tuple[str, str], says: str) -> None:
    with pytest.raises((SimulationError, mechc.UsageMistake, CompileError), match=says):
        mechc.loads(PENDULUM.replace(*change)).study("swing")


def test_inputs_that_the_model_moves_go_on_moving() -> None:
    """An input that is a function of the time is held by nobody: a = 1 - cos t."""
    text = "input AngularAcceleration w = cos(time/(1 s))*(1 rad/s^2);\ncoordinate Angle a = 0 rad;\nkinetic 1/2*(1 kg.m^2)*der(a)^2;\n"
    text += "force (1 kg.m^2)*w on a;\n"
    found: Any = mechc.loads(text).study("task", observe="a", reward="a", every=0.5, stop=1.0, episodes=2)
    assert found.details["returns"] == pytest.approx([2 - math.cos(0.5) - math.cos(1.0)] * 2, rel=1e-6)
    assert found.details["actions"] == []


@pytest.mark.filterwarnings("ignore:.*we recommend using a symmetric and normalized space")  # ours is in SI
@pytest.mark.filterwarnings("ignore:.*A Box observation space m")  # what is observed has no bounds
def test_the_checker_of_gymnasium_passes(model: mechc.Model) -> None:
    pytest.importorskip("gymnasium")
    from gymnasium.utils.env_checker import check_env

    check_env(model.gym("swing"), skip_render_check=True)


def test_many_are_as_one(model: mechc.Model) -> None:
    """The same observations, rewards and ends, with episodes that begin again within the step."""
    gymnasium = pytest.importorskip("gymnasium")
    many = model.gym("swing", 5, lanes="on")
    assert many.metadata["autoreset_mode"] == gymnasium.vector.AutoresetMode.SAME_STEP
    seen, info = many.reset(seed=4)
    assert seen.shape == (5, 3)
    assert many.observation_space.contains(seen)
    random, ended, begun = np.random.default_rng(0), 0, seen.copy()
    ages = np.zeros(5)
    for _ in range(60):
        actions = random.uniform(-2, 2, (5, 1)).astype(np.float32)
        before = many.episodes.env.states.copy()
        after, reward, over, late, info = many.step(actions)
        ages += 1
        for k in range(5):
            one = model.env(0.05, method="rk4")
            one.reset(q=before[k, :1], v=before[k, 1:2])
            one.u[:] = actions[k]
            one.step()
            (a,), (w,) = one.q, one.v
            assert reward[k] == pytest.approx(-math.cos(a) - 0.01 * float(actions[k, 0]) ** 2, abs=1e-9)
            assert over[k] == (abs(w) > 2 or a > math.radians(100))
            assert late[k] == (ages[k] == 20 and not over[k])
            last = info["final_obs"][k] if over[k] or late[k] else after[k]
            assert last == pytest.approx([math.sin(a), math.cos(a), w / 2], abs=1e-6)
            if over[k] or late[k]:
                ended, ages[k] = ended + 1, 0
                assert info["_final_obs"][k]
                assert abs(math.atan2(after[k, 0], after[k, 1])) < math.radians(80.1)
        begun = after
    assert ended > 5
    assert begun.dtype == np.float32
    again, _ = many.reset(seed=4)
    assert again.tobytes() == seen.tobytes()


def test_what_gymnasium_cannot_have(model: mechc.Model) -> None:
    pytest.importorskip("gymnasium")
    with pytest.raises(mechc.UsageMistake, match="no task 'swings'"):
        model.gym("swings")
    with pytest.raises(SimulationError, match="has no bounds"):
        mechc.loads(PENDULUM.replace("u(min = -2 N.m, max = 2 N.m)", "u")).gym("swing")
