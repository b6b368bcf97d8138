"""Environments: control steps are those of runs, one does not feel the others, and what fails ends alone."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import mechc
from mechc.runtime.native.build import CompilerMissing
from mechc.runtime.outcome import SimulationError

ACROBOT = """\
import mech.planar.*;
model Acrobot
  input Torque u = 0.3 N.m;
  gravity {0, -9.81} m/s^2;
  Bar a(m = 1 kg, l = 1 m);
  Bar b(m = 1 kg, l = 1 m);
  Revolute s(world -> a.a, angle = -80 deg);
  Revolute e(a.b -> b.a, angle = 10 deg);
  force u on e.angle;
  output Length height = pos(b.b)[2];
  experiment(stop = 1 s);
end Acrobot;
"""

HYBRID = """\
input Force push = 0.2 N;
coordinate Length h = 1 m;
coordinate Length x = 0 m;
initial der(x) = 1.962 m/s;
kinetic 1/2*(1 kg)*(der(h)^2 + der(x)^2);
potential (9.81 N)*h + 1/2*(1 N/m)*x^2;
contact floor: h restitution 0.7;
friction 2 N static 3 N on x - time*(1.962 m/s);
force push on x;
discrete Integer ticks = 0;
discrete Force pull = 0 N;
when sample(0.3 s) then ticks := ticks + 1; pull := -(0.1 N.s/m)*der(x); end when;
when der(h) > 2 m/s then pull := 2*pull; end when;
force pull on x;
experiment(stop = 1 s);
"""

PAST = """\
input Force push = 0.2 N;
coordinate Length x = 1 m;
kinetic 1/2*(1 kg)*der(x)^2;
force -(3 N/m)*delay(x, 0.15 s) on x;
force (0.1 N)*noise(7, 0.05 s) on x;
force push on x;
experiment(stop = 1 s);
"""

LOOP = """\
import mech.planar.*;
model FourBar
  input Torque u = 0.1 N.m;
  gravity {0, -9.81} m/s^2;
  Bar a(m = 1 kg, l = 0.5 m);
  Bar b(m = 1 kg, l = 1.2 m);
  Bar c(m = 1 kg, l = 0.9 m);
  Revolute p(world -> a.a, angle = 60 deg);
  Revolute q(a.b -> b.a, angle ~ -40 deg);
  Revolute r(world * trans({1 m, 0 m}) -> c.a, angle ~ 60 deg);
  Revolute t(b.b -> c.b);
  force u on p.angle;
  experiment(stop = 1 s);
end FourBar;
"""

TOP = """\
import mech.spatial.*;
model Top
  input Torque u = 0.02 N.m;
  gravity {0, 0, -9.81} m/s^2;
  Body b(m = 1 kg, com = {0, 0, 0.1} m, J = diag({0.01, 0.01, 0.02} kg.m^2));
  Spherical j(world -> b.a);
  initial angvel(b.a) = {0.3, 0, 30} rad/s;
  torque {0 N.m, u, 0 N.m} on b.a;
  experiment(stop = 1 s);
end Top;
"""

KINDS = {"smooth": ACROBOT, "hybrid": HYBRID, "past": PAST, "loop": LOOP, "rotation": TOP}


@pytest.fixture(scope="module")
def models() -> dict[str, Any]:
    return {name: mechc.loads(text) for name, text in KINDS.items()}


@pytest.mark.parametrize("kind", KINDS)
def test_control_steps_are_those_of_a_run(models: dict[str, Any], kind: str) -> None:
    """By a method with steps of one size, inputs that stay, and code of the same bits. The input of the run has a row at each
    end of a control step, so that its steps end there: after an event they would go on from that. Delays carry such rows on,
    so that steps end a delay after them, too: rounding."""
    model = models[kind]
    with model.env(0.01, method="rk4", reproducible=True) as env:
        (name,), times = env.names.u, 0.01 * np.arange(101)
        held = {name: (times, np.full(101, env[name]))}
        run = model.simulate(
            inputs=held, method="rk4", step=0.01, every=0.01, estimate_error=False, reproducible=True
        )
        for _ in range(100):
            env.step()
        assert env.time == 1.0
        for name in (*env.names.q, *env.names.v, *env.names.x):
            assert env[name] == pytest.approx(run[name][-1], rel=1e-13 if kind == "past" else 0), name


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("how", [{"method": "rk4", "substeps": 2}, {"tolerance": 1e-7}])
def test_a_batch_has_the_bits_of_single_ones(models: dict[str, Any], kind: str, how: dict[str, Any]) -> None:
    """Whatever the number of threads, with other inputs and other starts; saved ones go on bit for bit."""
    model, random = models[kind], np.random.default_rng(3)
    n, steps = 37, 30
    actions = random.standard_normal((steps, n, 1))
    with model.batch(n, 0.02, threads=3, **how) as batch, model.env(0.02, **how) as env:
        starts = batch.v + 0.1 * random.standard_normal(batch.v.shape)
        batch.reset(v=starts)
        for k in range(steps):
            batch.u[:] = actions[k]
            batch.step()
        assert (batch.status == 1).all()
        for e in (0, 20, 36):
            env.reset(v=starts[e])
            for k in range(steps // 2):
                env.u[:] = actions[k, e]
                env.step()
            saved = env.save()
            for turn in range(2):
                for k in range(steps // 2, steps):
                    env.u[:] = actions[k, e]
                    env.step()
                for ours, theirs in ((env.q, batch.q), (env.v, batch.v), (env.z, batch.z), (env.y, batch.y)):
                    assert ours.tobytes() == theirs[e].tobytes()
                if not turn:
                    env.load(saved)
        assert len({row.tobytes() for row in batch.q}) == n


def test_lanes_have_the_same_bits_for_every_number_of_environments(models: dict[str, Any]) -> None:
    """And differ from solvers by rounding: 60 steps of an acrobot multiply it by less than 1e4."""
    for kind in ("smooth", "rotation"):
        model, random = models[kind], np.random.default_rng(5)
        actions = random.standard_normal((60, 11, 1))
        batches = [
            model.batch(11, 0.01, method="rk4", lanes="on", threads=2),
            model.batch(1, 0.01, method="rk4", lanes="on"),
            model.batch(11, 0.01, method="rk4", lanes="off"),
        ]
        assert "lanes" in batches[0].by
        for u in actions:
            batches[0].u[:] = batches[2].u[:] = u
            batches[1].u[:] = u[8]
            for batch in batches:
                batch.step()
        many, one, scalar = batches
        assert many.q[8].tobytes() == one.q[0].tobytes()
        assert many.v == pytest.approx(scalar.v, rel=1e-11, abs=1e-11)
        assert many.y == pytest.approx(scalar.y, rel=1e-11, abs=1e-11)
        assert many.time.tobytes() == scalar.time.tobytes()


def test_the_classical_method_in_numpy() -> None:
    """A pendulum with a torque, written once more."""
    model = mechc.loads(
        "input Torque u = 0;\ncoordinate Angle a = 1 rad;\nkinetic 1/2*(2 kg.m^2)*der(a)^2;\n"
        "potential -(3 N.m)*cos(a);\nforce u - (0.1 N.m.s)*der(a) on a;\nexperiment(stop = 1 s);"
    )

    def rates(y: Any, u: float) -> Any:
        return np.array([y[1], (u - 0.1 * y[1] - 3 * np.sin(y[0])) / 2])

    h, y = 0.05, np.array([1.0, 0.0])
    batch = model.batch(2, 0.1, method="rk4", substeps=2, lanes="on")
    env = model.env(0.1, method="rk4", substeps=2)
    for k in range(20):
        env.u[0] = u = np.sin(k)
        batch.u[:] = u
        env.step()
        batch.step()
        for _ in range(2):
            k1 = rates(y, u)
            k2 = rates(y + h / 2 * k1, u)
            k3 = rates(y + h / 2 * k2, u)
            k4 = rates(y + h * k3, u)
            y = y + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
    assert [env.q[0], env.v[0]] == pytest.approx(y, rel=1e-14)
    assert batch.v[1, 0] == pytest.approx(y[1], rel=1e-14)


RUNAWAY = """\
input Force u = 0 N;
coordinate Length x = 1 m;
kinetic 1/2*(1 kg)*der(x)^2;
force (1 N/m^3)*x^3 + u on x;
assert x < 1e6 m, "far away";
experiment(stop = 1 s);
"""


@pytest.mark.parametrize(
    "how", [{"tolerance": 1e-8}, {"method": "rk4"}, {"method": "rk4", "lanes": "on"}], ids=str
)
def test_what_diverges_ends_alone(how: dict[str, Any]) -> None:
    """x'' = x^3 from rest at 1 is infinite at 1.854 s; the others are pulled back before."""
    model = mechc.loads(RUNAWAY)
    with model.batch(9, 0.01, **how) as batch, model.batch(9, 0.01, **how) as calm:
        for _ in range(190):
            for each in (batch, calm):
                each.u[:] = -2 * each.v - each.q**3
            batch.u[4] = 0
            batch.step()
            calm.step()
        assert batch.status[4] == -3
        assert 1.8 < batch.time[4] < 1.9
        assert "far away" in str(batch.why(4)) or "assertion" in str(batch.why(4))
        others = np.arange(9) != 4
        assert (batch.status[others] == 1).all()
        assert batch.q[others].tobytes() == calm.q[others].tobytes()
        batch.reset(where=[4])
        assert batch.status[4] == 1
        assert batch.time[4] == 0


def test_a_single_one_raises_and_a_budget_is_kept() -> None:
    with mechc.loads(RUNAWAY).env(3.0) as env:
        with pytest.raises(SimulationError, match=r"failed at t = 1.854.*far away"):
            env.step()
        with pytest.raises(SimulationError, match="far away"):
            env.step()
        env.reset()
        assert env["x"] == 1
    with mechc.loads(RUNAWAY).batch(3, 1.0, max_steps=3) as batch:
        batch.step()
        assert (batch.status == 0).all()
        reached = batch.time.copy()
        assert (reached < 1).all()
        batch.step()
        assert (batch.time > reached).all()
        while (batch.status == 0).all():
            batch.step()
        assert (batch.time == 1).all()


def test_a_start_off_the_constraints_is_moved_onto_them(models: dict[str, Any]) -> None:
    """The crank stays, as the model states it; the other two bars follow."""
    with models["loop"].env(0.01) as env:
        q = env.q.copy()
        q[0] += 0.2
        env.reset(q=q)
        a, b, c = env.q[0], env.q[0] + env.q[1], env.q[2]
        assert a == q[0]
        gap = 0.5 * np.exp(1j * a) + 1.2 * np.exp(1j * b) - 1 - 0.9 * np.exp(1j * c)
        assert abs(gap) < 1e-12
    short = models["loop"].with_values({"c.l": 0.5})  # so that the rocker holds the crank back
    with short.env(0.01) as env, pytest.raises(SimulationError, match="constraints"):
        env.reset(q=[0, 1, 1])


def test_a_penetrated_contact_ends_the_one_that_begins_there(models: dict[str, Any]) -> None:
    with models["hybrid"].batch(3, 0.01) as batch:
        batch.reset(q=[[1, 0], [-0.5, 0], [1, 0]])
        batch.step()
        assert batch.status.tolist() == [1, -22, 1]
        assert "penetrat" in str(batch.why(1))


def test_what_does_not_fit_is_refused(models: dict[str, Any]) -> None:
    model = models["hybrid"]
    with pytest.raises(SimulationError, match="events"):
        model.batch(4, 0.01, method="rk4", lanes="on")
    with pytest.raises(SimulationError, match="lanes"):
        models["smooth"].batch(4, 0.01, lanes="on")
    with pytest.raises(SimulationError, match="substeps"):
        model.env(0.01, substeps=3)
    with pytest.raises(mechc.UsageMistake, match="time above zero"):
        model.env(0.0)
    with model.env("10 ms") as env:
        with pytest.raises(SimulationError, match="numbers are given"):
            env.reset(q=[1, 2, 3])
        with pytest.raises(SimulationError, match="finite"):
            env.reset(q=[np.nan, 0])
        with pytest.raises(ValueError, match="read-only"):
            env.q[0] = 2.0
    with pytest.raises(SimulationError, match="closed"):
        env.step()


def test_inputs_of_time_go_on() -> None:
    """What the model moves is not a column of u."""
    text = "input Force a = if time > 0.5 s then 4 N else 0 N;\ninput Force b = 1 N;\ncoordinate x = 0 m;\n"
    model = mechc.loads(text + "kinetic 1/2*(2 kg)*der(x)^2;\nforce a + b on x;\nexperiment(stop = 1 s);")
    with model.env(0.25, tolerance=1e-10) as env:
        assert env.names.u == ("b",)
        for _ in range(4):
            env.step()
        assert env["a"] == 4
        assert env.v[0] == pytest.approx(0.5 * 1 + 0.5 * 4 / 2, rel=1e-8)


@pytest.mark.parametrize("threads", [1, 2])
def test_environments_that_are_done_wait_for_those_that_are_interrupted(
    monkeypatch: pytest.MonkeyPatch, threads: int
) -> None:
    """A call ends after a while, so that a signal is heard; where that cuts some environments only, the others take one control
    step all the same."""
    model = mechc.loads(HYBRID)
    places = np.linspace(0.1, 3.0, 20)[:, None] * [1.0, 0.0]
    whole = model.batch(20, "0.4 s", threads=threads)
    monkeypatch.setattr("mechc.runtime.studies.environments.environments.LONGEST_CALL", 1e-9)
    cut = model.batch(20, "0.4 s", threads=threads)
    for many in (whole, cut):
        many.reset(q=places)
        for k in range(3):
            many.u[:, 0] = 0.1 * k
            many.step()
    assert cut.time == pytest.approx(np.full(20, 1.2), abs=1e-12)
    for ours, theirs in ((cut.q, whole.q), (cut.v, whole.v), (cut.z, whole.z), (cut.y, whole.y)):
        np.testing.assert_array_equal(ours, theirs)


def test_a_reset_ends_what_was_interrupted(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("mechc.runtime.studies.environments.environments.LONGEST_CALL", 1e-9)
    many = mechc.loads(HYBRID).batch(3, "0.4 s")
    many.reset(q=[[0.1, 0.0], [1.0, 0.0], [3.0, 0.0]])
    assert many._step() > 0  # as where a signal ends the step here
    many.reset()
    many.step()
    assert many.time == pytest.approx(np.full(3, 0.4), abs=1e-12)


def test_without_built_in_functions_of_python(
    models: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    usual = models["smooth"].env("20 ms")

    def missing() -> None:
        raise CompilerMissing("no C compiler was found")

    monkeypatch.setattr("mechc.runtime.native.calls.library", missing)
    plain = models["smooth"].env("20 ms")
    for env in (usual, plain):
        for k in range(5):
            env.u[:] = 0.1 * k
            env.step()
    np.testing.assert_array_equal(plain.q, usual.q)
    np.testing.assert_array_equal(plain.y, usual.y)
    plain.close()
    with pytest.raises(SimulationError, match="closed"):
        plain.step()
