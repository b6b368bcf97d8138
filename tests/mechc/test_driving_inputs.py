"""Inputs that drive: forces of measured motions, against splines of SciPy and textbook formulas."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline

import mechc
from mechc.cli.main import mechc as program
from mechc.lang.diagnostics import CompileError
from mechc.requests.parse_values import UsageMistake
from mechc.runtime.outcome import SimulationError

ARM = """
model Arm
  parameter m = 2 kg;
  parameter l = 0.5 m;
  input Angle measured(interpolation = "spline") = 0.3 rad;
  coordinate Angle theta;
  kinetic 1/2*m*l^2*der(theta)^2;
  potential -m*(9.81 m/s^2)*l*cos(theta);
  damping 0.1 N.m.s on theta;
  drive theta = 2*measured;
  output torque = reaction(theta);
  experiment(stop = 2 s);
end Arm;
"""

TIMES = np.array([0, 0.1, 0.25, 0.5, 0.7, 1.0, 1.4, 1.5, 1.8, 2.0])
ANGLES = 0.4 * np.sin(3 * TIMES) + 0.1 * TIMES**2


@pytest.fixture(scope="module")
def arm() -> mechc.Model:
    return mechc.loads(ARM)


def written(path: Path, times: Any, values: Any, head: str = "measured [rad]") -> Path:
    rows = [f"{t!r},{a!r}" for t, a in zip(times.tolist(), values.tolist(), strict=True)]
    path.write_text("\n".join([f"time [s],{head}", *rows]))
    return path


@pytest.fixture(scope="module")
def table(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return written(tmp_path_factory.mktemp("data") / "m.csv", TIMES, ANGLES)


@pytest.mark.parametrize("method", ["dop853", "radau5"])
def test_the_torque_of_a_measured_motion(arm: mechc.Model, table: Path, method: str) -> None:
    """m l^2 theta'' + c theta' + m g l sin theta, with the natural spline of SciPy: nothing is integrated but rounding."""
    found = arm.simulate(inputs={"measured": table}, method=method)
    spline = CubicSpline(TIMES, ANGLES, bc_type="natural")
    theta, omega, alpha = (2 * spline(found.time, k) for k in range(3))
    expected = 2 * 0.25 * alpha + 0.1 * omega + 2 * 9.81 * 0.5 * np.sin(theta)
    np.testing.assert_allclose(found["theta"], theta, atol=1e-13)
    np.testing.assert_allclose(found["der(theta)"], omega, atol=1e-12)
    np.testing.assert_allclose(found["torque"], expected, atol=1e-11)
    np.testing.assert_allclose(found["der(der(measured))"], alpha / 2, atol=1e-11)


def test_a_constant_holds(arm: mechc.Model) -> None:
    found = arm.simulate(set={"measured": "0.2 rad"})
    np.testing.assert_allclose(found["torque"], 9.81 * np.sin(0.4), atol=1e-14)
    assert not found["der(theta)"].any()


def test_the_work_of_the_drive_is_booked(arm: mechc.Model, table: Path) -> None:
    """The balance of energies is integrated; the tolerance is 1e-10 of 10 J."""
    found = arm.simulate(inputs={"measured": table}, tolerance=1e-10)
    balance = found["energy.total"] + found["energy.dissipated"] - found["energy.supplied"]
    np.testing.assert_allclose(balance, balance[0], atol=1e-8)


def test_what_hangs_on_what_is_measured_moves_as_under_a_formula(tmp_path: Path) -> None:
    """A pendulum on a cart whose place is measured, beside one whose cart is driven by the cubic itself."""
    text = """
    input Length s(interpolation = "spline") = 0 m;
    coordinate Length x; coordinate Angle theta = 0.5 rad;
    kinetic 1/2*1 kg*(der(x)^2 + 2*(1 m)*cos(theta)*der(x)*der(theta) + (1 m)^2*der(theta)^2);
    potential -(9.81 N)*(1 m)*cos(theta);
    drive x = %s;
    experiment(stop = 1 s, tolerance = 1e-11);
    """
    measured = mechc.loads(text % "s")
    by_formula = mechc.loads(text.replace("input", "parameter").replace('(interpolation = "spline")', "")
                             % "time^2*(3 s - time)*(0.2 m/s^3)")  # fmt: skip
    # not the natural end conditions: the spline of these rows is the cubic only away from them, so rows are dense
    times = np.linspace(-1, 2, 601)
    rows = written(tmp_path / "s.csv", times, 0.2 * times**2 * (3 - times), "s [m]")
    a = measured.simulate(inputs={"s": rows})
    b = by_formula.simulate()
    np.testing.assert_allclose(a["theta"], b["theta"], atol=1e-9)


def test_derivatives_by_parameters(arm: mechc.Model, table: Path) -> None:
    """d(torque)/dm by the tangents: torque is linear in m but for damping."""
    found = arm.simulate(inputs={"measured": table}, sensitivity=["m"])
    spline = CubicSpline(TIMES, ANGLES, bc_type="natural")
    theta, alpha = 2 * spline(found.time), 2 * spline(found.time, 2)
    np.testing.assert_allclose(
        found.sensitivity("torque", "m"), 0.25 * alpha + 9.81 * 0.5 * np.sin(theta), atol=1e-10
    )


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (
            {"inputs": {"measured": "TABLE"}, "stop": 2.5},
            "reaches from 0 s to 2 s, the run from 0 s to 2.5 s",
        ),
        ({"inputs": {"measured": "TABLE"}, "start": -1.0}, "the run from -1 s to 2 s"),
        ({"set": {"der(measured)": 1.0}}, r"'der\(measured\)' follows from 'measured'"),
        ({"inputs": {"der(measured)": "TABLE"}}, r"'der\(measured\)' follows from 'measured'"),
    ],
)
def test_motions_with_jumps_are_refused(
    arm: mechc.Model, table: Path, options: dict[str, dict[str, object]], message: str
) -> None:
    if "inputs" in options:
        (name,) = options["inputs"]
        if name != "measured":
            table = written(table.with_name("rates.csv"), TIMES, ANGLES, f"{name} [rad/s]")
        options = {**options, "inputs": {name: table}}
    with pytest.raises(SimulationError, match=message):
        arm.simulate(**options)  # type: ignore[arg-type]


@pytest.mark.parametrize("target", ["python", "c", "web"])
def test_targets_that_are_told_no_derivative_refuse(target: str, tmp_path: Path) -> None:
    path = tmp_path / "arm.mech"
    path.write_text(ARM)
    endings = {"python": ".py", "web": ".html", "c": ""}
    output = str(tmp_path / f"out{endings[target]}")
    done = CliRunner().invoke(program, ["compile", str(path), "--target", target, "-o", output])
    assert isinstance(done.exception, UsageMistake) or done.exit_code == 2
    assert "drives a coordinate, which needs its derivatives too" in str(done.exception) + done.output
    assert not Path(output).exists()


@pytest.mark.parametrize(
    ("declared", "words"),
    [
        ("input Angle u = 0 rad", "has no second derivative"),
        ('input Angle u(interpolation = "step") = 0 rad', "has no second derivative"),
        ('input Angle u(interpolation = "spline") = 0.1*time/(1 s)', "the default of 'u' changes with time"),
    ],
)
def test_inputs_without_second_derivative_do_not_drive(declared: str, words: str) -> None:
    text = f"{declared}; coordinate Angle x; kinetic 1/2*1 kg.m^2*der(x)^2; drive x = u;"
    with pytest.raises(CompileError) as raised:
        mechc.loads(text).compilation  # noqa: B018
    assert [d.code for d in raised.value.diagnostics] == ["E0504"]
    assert words in raised.value.diagnostics[0].caption


def test_arrays_of_inputs_drive(tmp_path: Path) -> None:
    text = """
    input Length u[2](interpolation = "spline") = {1 m, 2 m};
    coordinate Length x[2];
    kinetic 1/2*1 kg*(der(x[1])^2 + der(x[2])^2);
    drive x = u;
    output f = reaction(x[2]);
    experiment(stop = 1 s);
    """
    times = np.linspace(0, 1, 21)
    found = mechc.loads(text).simulate(
        inputs={"u[2]": written(tmp_path / "u.csv", times, np.cos(times), "u[2] [m]")}
    )
    np.testing.assert_allclose(
        found["f"], CubicSpline(times, np.cos(times), bc_type="natural")(found.time, 2), atol=1e-11
    )
    assert (found["x[1]"] == 1).all()


FILTERED = """\
model Filtered
  input Length road = 0 m;
  parameter Time tau = 20 ms;
  state Length s = road;
  state Velocity r = 0 m/s;
  equation der(s) = r;
  equation der(r) = (road - s)/tau^2 - 2*r/tau;
  coordinate Length axle;
  coordinate Length body = 0 m;
  kinetic 1/2*3 kg*der(body)^2 + 1/2*2 kg*der(axle)^2;
  potential 1/2*800 N/m*(body - axle)^2;
  damping 5 N.s/m on body - axle;
  drive axle = s;
  output push = reaction(axle);
  experiment(stop = 0.5 s, tolerance = 1e-10);
end Filtered;
"""


def filtered(t: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A step of 0.1 m at 0.1 s after the critically damped filter, with its rate and acceleration."""
    T = 0.02
    x = np.maximum(t - 0.1, 0) / T
    decay = 0.1 * np.exp(-x)
    behind = t >= 0.1
    return behind * (0.1 - decay * (1 + x)), behind * decay * x / T, behind * decay * (1 - x) / T**2


def test_a_filter_lets_a_step_drive() -> None:
    """The closed form of the filter; the body by SciPy; the force by Newton's law; and the energy that the drive supplies."""
    model = mechc.loads(FILTERED)
    found = model.simulate(inputs={"road": ([0, 0.1, 0.1, 1], [0, 0, 0.1, 0.1])})
    s, rate, acceleration = filtered(found.time)

    def rates(t: float, y: np.ndarray) -> list[float]:
        place, speed, _ = (float(x) for x in filtered(np.array(t)))
        return [y[1], (-800 * (y[0] - place) - 5 * (y[1] - speed)) / 3]

    body = solve_ivp(
        rates, (0.1, 0.5), [0, 0], t_eval=found.time[found.time >= 0.1], rtol=1e-11, atol=1e-13
    ).y
    late = found.time >= 0.1
    np.testing.assert_allclose(found["axle"], s, atol=2e-9)
    np.testing.assert_allclose(found["der(axle)"], rate, atol=2e-7)
    np.testing.assert_allclose(found["body"][late], body[0], atol=1e-8)
    force = 2 * acceleration[late] + 800 * (s[late] - body[0]) + 5 * (rate[late] - body[1])
    after = found.time[late] > 0.1 + 1e-9  # at the jump it has two values
    np.testing.assert_allclose(found["push"][late][after], force[after], atol=1e-4)
    balance = found["energy.total"] + found["energy.dissipated"] - found["energy.supplied"]
    np.testing.assert_allclose(balance, balance[0], atol=1e-7)


def test_the_poles_of_a_filter() -> None:
    """Twice -1/tau, beside those of the body."""
    found = mechc.loads(FILTERED).linearize(inputs="road")
    poles = np.linalg.eigvals(found.arrays["A"])
    own = np.roots([3, 5, 800])
    expected = np.sort_complex(np.concatenate([own, [-50, -50]]))
    np.testing.assert_allclose(np.sort_complex(poles), expected, atol=1e-4)


@pytest.mark.parametrize(
    ("states", "words"),
    [
        ("state Length s = 0 m; equation der(s) = (u - s)/tau;", "depends on 'u', which may jump"),
        (
            "state Length s = 0 m; equation der(s) = (y - s)/tau;",
            "depends on 'y', which may jump or moves freely",
        ),
        (
            "state Length s = 0 m; state Velocity r = 0 m/s; equation der(s) = r; equation der(r) = (y - s)/tau^2 - 2*r/tau;",
            "depends on 'y', which may jump or moves freely",
        ),
        (
            "state Length s = 0 m; state Velocity r = 0 m/s; equation der(s) = r; equation der(r) = (u - s)/tau^2 - 2*r/tau;"
            "when time > 1 s then reinit(r, 1 m/s); end when;",
            "an event sets the state 'r' again",
        ),
        (
            "state Length s = 0 m; state Velocity r = 0 m/s; equation der(s) = if time > 1 s then r else 2*r;"
            "equation der(r) = (u - s)/tau^2 - 2*r/tau;",
            "the rate of 's' switches",
        ),
    ],
)
def test_states_that_do_not_drive(states: str, words: str) -> None:
    text = f"""input Length u = 0 m; parameter Time tau = 5 ms; coordinate Length x; coordinate Length y = 0 m;
      kinetic 1/2*1 kg*(der(x)^2 + der(y)^2); potential 1/2*1e3 N/m*(x - y)^2; {states} drive x = s;"""
    with pytest.raises(CompileError) as raised:
        mechc.loads(text).compilation  # noqa: B018
    found = [d for d in raised.value.diagnostics if d.code == "E0504"]
    assert len(found) == 1 and words in found[0].caption


@pytest.mark.slow
def test_a_filtered_input_drives_in_an_fmu(tmp_path: Path) -> None:
    """By a ramp of 1 m/s the filter follows t - 2 tau + (t + 2 tau) exp(-t/tau)."""
    pytest.importorskip("fmpy")
    from mechc.fmu.run import run_fmu

    (tmp_path / "f.mech").write_text(FILTERED)
    done = CliRunner().invoke(
        program, ["compile", str(tmp_path / "f.mech"), "--target", "fmu", "-o", str(tmp_path / "f.fmu")]
    )
    assert done.exit_code == 0, done.output
    ramp = written(tmp_path / "ramp.csv", np.array([0, 1]), np.array([0, 1]), "road [m]")
    found = run_fmu(tmp_path / "f.fmu", kind="cs", stop=0.5, every=1e-3, inputs={"road": str(ramp)})
    t = np.maximum(found.time - 5e-4, 0)  # held over a communication step, the ramp lags by half of it
    np.testing.assert_allclose(found["axle"], t - 0.04 + (t + 0.04) * np.exp(-t / 0.02), atol=1e-5)


TROLLEY = """
import mech.translational.*;
input Velocity v{filter}{default};
Slider trolley(m = 3 kg, der(s) ~ 0 m/s);
SpeedSource motor(from = trolley.s, speed = v);
"""


def test_a_speed_source_keeps_a_speed_from_outside() -> None:
    """Its state follows the input, and its constraint needs the rate of that: zero by the constant default."""
    model = mechc.loads(TROLLEY.format(filter="", default=" = 0.5 m/s"))
    for given, speed in (({}, 0.5), ({"v": 2.0}, 2.0)):
        solution = model.simulate(stop=1, set=given)
        assert solution["trolley.s"][-1] == pytest.approx(speed, rel=1e-12)
    with pytest.raises(SimulationError, match="as its default is a constant") as found:
        model.simulate(stop=1, inputs={"v": ([0, 1], [0, 1])})
    assert found.value.help == "let formulas read it through a filter, which has rates: v(filter = 1 ms)"


def test_a_speed_source_follows_an_input_behind_a_filter() -> None:
    """Behind two lags of tau, a ramp a t is a (t - 2 tau) after a while, and its integral a (t^2/2 - 2 tau t + 3 tau^2)."""
    with pytest.raises(CompileError, match="the equations need the rate of the input 'v'"):
        mechc.loads(TROLLEY.format(filter="", default="")).compiled()
    model = mechc.loads(TROLLEY.format(filter="(filter = 1 ms)", default=""))
    solution = model.simulate(stop=1, inputs={"v": ([0, 1], [0, 3])}, tolerance=1e-11)
    wanted = 3 * (1 / 2 - 2e-3 + 3e-6)
    assert solution["trolley.s"][-1] == pytest.approx(wanted, rel=1e-9)
