"""Starts that are stationary, accelerations at the start, and parameters that the start finds.

Judges: statics, closed forms and SciPy's root finders; the motion of a start at rest must not move.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from refusals import refused
from scipy.optimize import brentq, fsolve

import mechc
from mechc.runtime.outcome import SimulationError

ARM = """
coordinate Angle a ~ 0.3 rad;
kinetic 1/2*1 kg.m^2*der(a)^2;
potential 1/2*10 N.m/rad*a^2 + 5 N.m*cos(a);
force 1 N.m on a;
experiment(stop = 1 s);
"""
REST = brentq(lambda a: 10 * a - 5 * math.sin(a) - 1, 0, 1, xtol=1e-15)


def start(text: str, **options: Any) -> dict[str, float]:
    solution = mechc.loads(text).simulate(estimate_error=False, **options)
    return {name: float(solution[name][0]) for name in solution.quantities if name != "time"}


@pytest.mark.parametrize(
    "said",
    [
        "initial stationary;",
        "initial stationary a;",
        "initial der(a) = 0 rad/s; initial der(a, 2) = 0;",
    ],
)
def test_an_arm_at_rest(said: str) -> None:
    solution = mechc.loads(ARM + said).simulate(estimate_error=False)
    assert solution["a"] == pytest.approx(REST, rel=1e-14)
    assert solution["der(a)"] == pytest.approx(0, abs=1e-14)


def test_an_acceleration_that_is_asked_for() -> None:
    """10 a - 5 sin a = 1 - 2: pushed with 2 rad/s^2 at the start."""
    found = start(ARM + "initial der(a) = 0; initial der(a, 2) = 2 rad/s^2;")
    assert found["a"] == pytest.approx(brentq(lambda a: 10 * a - 5 * math.sin(a) + 1, -1, 0), rel=1e-13)


def test_terminal_speed() -> None:
    """The rate follows from the acceleration where the place is known: m g = c v^2."""
    found = start(
        "coordinate Length z = 0 m; initial der(z) ~ 5 m/s; kinetic 1/2*3 kg*der(z)^2; force 3 kg*9.81 m/s^2 on z;\n"
        "force -0.4 N.s^2/m^2*der(z)*abs(der(z)) on z; initial der(z, 2) = 0; experiment(stop = 1 s);"
    )
    assert found["der(z)"] == pytest.approx(math.sqrt(3 * 9.81 / 0.4), rel=1e-13)


CONTROLLED = """
parameter k = 3 N/m;
parameter goal = 0.5 m;
coordinate Length x ~ 0.1 m;
kinetic 1/2*1 kg*der(x)^2;
potential 1/2*k*x^2;
damping 0.3 N.s/m on x;
state Force I ~ 0 N;
equation der(I) = 2 N/m/s*(goal - x);
force 5 N/m*(goal - x) + I on x;
initial stationary;
experiment(stop = 1 s);
"""


def test_a_controller_in_steady_state() -> None:
    """The integral part carries the spring: the place follows from the rate of the state, the state from the force."""
    found = start(CONTROLLED)
    assert (found["x"], found["I"]) == pytest.approx((0.5, 1.5), rel=1e-14)
    assert start(CONTROLLED, set={"goal": 0.7})["I"] == pytest.approx(2.1, rel=1e-14)


def test_a_motor_that_runs() -> None:
    """Of what is stated only speed and current may move: u = R i + k w, k i = c w."""
    found = start(
        "coordinate Angle phi = 0 rad; initial der(phi) ~ 10 rad/s; state Current i ~ 0 A;\n"
        "kinetic 1/2*1e-4 kg.m^2*der(phi)^2; damping 0.001 N.m.s on phi; force 0.1 N.m/A*i on phi;\n"
        "equation der(i) = (12 V - 2 Ohm*i - 0.1 N.m/A*der(phi))/1 mH; initial der(phi, 2) = 0; initial der(i) = 0;\n"
        "experiment(stop = 1 s);"
    )
    assert (found["der(phi)"], found["i"]) == pytest.approx((100.0, 1.0), rel=1e-13)


def test_states_that_no_linear_equation_decides() -> None:
    """Two levels of a tank with orifices: a inflow = k sqrt(h1 - h2) = k sqrt(h2)."""
    found = start(
        "state h[2] ~ {2, 0.5} m; equation der(h[1]) = 0.3 m/s - 0.5 m^0.5/s*sqrt(h[1] - h[2]);\n"
        "equation der(h[2]) = 0.5 m^0.5/s*(sqrt(h[1] - h[2]) - sqrt(h[2])); initial stationary; experiment(stop = 1 s);"
    )
    assert (found["h[1]"], found["h[2]"]) == pytest.approx((0.72, 0.36), rel=1e-12)


LOOP = """
import mech.planar.*;
parameter load = 0 N.m;
gravity {0, -9.81} m/s^2;
Bar a(m = 1 kg, l = 1 m);
Bar b(m = 1 kg, l = 1.2 m);
Revolute p(world -> a.a, angle ~ -40 deg);
Revolute q(a.b -> b.a, angle ~ 0 deg);
Revolute r(world * trans({1.5, 0} m) -> b.b);
potential 1/2*5 N.m*(p.angle + 20 deg)^2;
force load on p.angle;
initial stationary;
experiment(stop = 1 s);
"""


def test_a_loop_at_rest() -> None:
    """A triangle of bars has no freedom: only the loop decides, and nothing moves."""
    solution = mechc.loads(LOOP).simulate(estimate_error=False)
    angle = solution["p.angle"][0]
    assert math.hypot(math.cos(angle) - 1.5, math.sin(angle)) == pytest.approx(1.2, rel=1e-12)
    assert np.ptp(solution["p.angle"]) < 1e-12


FOUR_BARS = """
import mech.planar.*;
gravity {0, -9.81} m/s^2;
Bar a(m = 1 kg, l = 0.5 m);
Bar b(m = 1 kg, l = 1.2 m);
Bar c(m = 1 kg, l = 0.9 m);
Revolute p(world -> a.a, angle ~ -60 deg);
Revolute q(a.b -> b.a, angle ~ 60 deg);
Revolute r(b.b -> c.a, angle ~ 70 deg);
Revolute s(c.b -> world * trans({1.5, 0} m));
potential 1/2*3 N.m*(p.angle + 20 deg)^2;
initial stationary;
experiment(stop = 1 s);
"""


def test_a_loop_of_four_bars_at_rest() -> None:
    """Where the potential energy of its one freedom has no slope, by differences of closed positions."""
    found = start(FOUR_BARS)
    side = np.sign(math.sin(found["r.angle"]))

    def energy(crank: float) -> float:
        knee = 0.5 * np.array([math.cos(crank), math.sin(crank)])
        d = np.array([1.5, 0]) - knee
        span = np.linalg.norm(d)
        along = (span**2 + 1.2**2 - 0.9**2) / (2 * span)
        across = math.sqrt(1.2**2 - along**2)
        joint = knee + along * d / span - side * across * np.array([-d[1], d[0]]) / span
        heights = knee[1] / 2 + (knee[1] + joint[1]) / 2 + joint[1] / 2
        return float(9.81 * heights + 1.5 * (crank + math.radians(20)) ** 2)

    crank = found["p.angle"]
    slopes = [(energy(crank + h) - energy(crank - h)) / (2 * h) for h in (1e-3, 5e-4)]
    assert (4 * slopes[1] - slopes[0]) / 3 == pytest.approx(0, abs=1e-8)
    assert np.ptp(mechc.loads(FOUR_BARS).simulate(estimate_error=False)["p.angle"]) < 1e-11


def test_rotations_at_rest() -> None:
    """A body on a ball joint hangs straight down, whatever the guess."""
    text = (
        "import mech.spatial.*; gravity {0, 0, -9.81} m/s^2; Body b(m = 2 kg, com = {0, 0, -0.5} m, J = diag({1, 2, 3} kg.m^2));\n"
        "coordinate Rotation R ~ rotx(20 deg)*roty(10 deg); frame F = world * R; Weld w(F -> b.a); output low = pos(b.a * {0, 0, -1} m);\n"
        "initial stationary; experiment(stop = 1 s);"
    )
    found = start(text)
    assert [found[f"low[{k}]"] for k in (1, 2, 3)] == pytest.approx([0, 0, -1], abs=1e-9)


# ---------------------------------------------------------------- parameters

SPRING = """
import mech.spatial.*;
gravity {0, -9.80665, 0} m/s^2;
parameter Stiffness c ~ 100 N/m;
Body body(m = 1 kg, com = {0.5, 0, 0} m, J = diag({0.001, 0.001, 0.001} kg.m^2));
Revolute rev(world -> body.a, angle = 0 rad, der(angle) = 0 rad/s);
initial der(rev.angle, 2) = 0;
Spring s(world * trans({1, 0.2, 0} m) -> body.a * trans({1, 0, 0} m), k = c, rest = 0.1 m);
output stiffness = c;
experiment(stop = 1 s);
"""


def test_a_spring_that_holds_an_arm() -> None:
    """InitSpringConstant of Modelica's library: m g/2 = c (0.2 m - 0.1 m)."""
    solution = mechc.loads(SPRING).simulate(estimate_error=False)
    assert solution["stiffness"] == pytest.approx(9.80665 / 2 / 0.1, rel=1e-13)
    assert solution.parameters["s.k"] == pytest.approx(9.80665 / 2 / 0.1, rel=1e-13)
    assert solution["rev.angle"] == pytest.approx(0, abs=1e-12)
    assert any("the start finds c = 49.03325" in note for note in solution.remarks)


def test_it_is_found_anew_for_another_start() -> None:
    model = mechc.loads(SPRING)
    assert model.simulate(set={"body.m": 2.0}, estimate_error=False)["stiffness"][0] == pytest.approx(
        98.0665, rel=1e-13
    )
    angle = 0.1
    tip, end = np.array([math.cos(angle), math.sin(angle)]), np.array([1.0, 0.2])
    span = np.linalg.norm(end - tip)
    pull = (end - tip) / span
    moment = tip[0] * pull[1] - tip[1] * pull[0]
    expected = 9.80665 * 0.5 * math.cos(angle) / (moment * (span - 0.1))
    found = model.simulate(set={"rev.angle": angle}, estimate_error=False)
    assert found["stiffness"][0] == pytest.approx(expected, rel=1e-12)
    assert np.ptp(found["rev.angle"]) < 1e-8


def test_two_parameters_and_a_place_at_once() -> None:
    """a and b of the force a x + b x^3 such that it is 5 N at 1 m, and its momentum 3 kg.m/s: solved with fsolve."""
    text = (
        "parameter a ~ 1 N/m; parameter Mass m ~ 2 kg; coordinate Length x = 1 m; initial der(x) = 2 m/s;\n"
        "kinetic 1/2*m*der(x)^2; force -a*x - 0.5 N/m^3*x^3 on x; initial der(x, 2) = -4 m/s^2; initial momentum(x) = 3 kg.m/s;\n"
        "output A = a; output M = m; experiment(stop = 1 s);"
    )
    found = start(text)
    a, m = fsolve(lambda v: [v[1] * 2 - 3, (-v[0] - 0.5) / v[1] + 4], [1, 2], xtol=1e-14)
    assert (found["A"], found["M"]) == pytest.approx((a, m), rel=1e-12)


def test_by_a_modification_and_known_again() -> None:
    part = (
        "model Held\n parameter Force F = 1 N; coordinate Length x = 1 m; initial der(x) = 0 m/s; kinetic 1/2*1 kg*der(x)^2;\n"
        " potential 1/2*3 N/m*x^2; force F on x; end Held;\n"
    )
    text = (
        part
        + "model M\n Held h(F ~ 0 N); initial der(h.x, 2) = 0; output F = h.F; experiment(stop = 1 s); end M;"
    )
    assert start(text)["F"] == pytest.approx(3.0, rel=1e-14)
    outer = (
        part.replace("F = 1 N", "F ~ 1 N")
        + "model M\n Held h(F = 2 N); output F = h.F; experiment(stop = 1 s); end M;"
    )
    assert start(outer)["F"] == 2.0


def test_it_cannot_be_set() -> None:
    with pytest.raises(SimulationError, match="finds the parameter 'c'"):
        mechc.loads(SPRING).simulate(set={"c": 50.0})
    with pytest.raises(SimulationError, match=r"finds the parameter 's\.k'"):
        mechc.loads(SPRING).simulate(set={"s.k": 50.0})


@pytest.mark.parametrize("by", ["set", "experiment"])
def test_a_state_that_the_start_finds_cannot_be_set(by: str) -> None:
    with pytest.raises(SimulationError, match="finds the state 'I'"):
        if by == "set":
            mechc.loads(CONTROLLED).simulate(set={"I": 1.0})
        else:
            mechc.loads(CONTROLLED + "experiment other(I = 1 N, stop = 1 s);").simulate(experiment="other")


def test_ensembles_find_it_for_each_member() -> None:
    text = (
        "parameter Stiffness c ~ 1 N/m; parameter Mass m = 1 kg; coordinate Length x = 0.1 m; initial der(x) = 0 m/s;\n"
        "kinetic 1/2*m*der(x)^2; potential 1/2*c*x^2; force m*9.81 m/s^2 on x; initial der(x, 2) = 0; output stiffness = c;\n"
        "experiment(stop = 1 s, m in linspace(1 kg, 3 kg, 3), keep = {final(stiffness)});"
    )
    found = mechc.loads(text).ensemble()
    assert np.asarray(found["final(stiffness)"]).ravel() == pytest.approx([98.1, 196.2, 294.3], rel=1e-12)


# ---------------------------------------------------------------- what is stated with others follows the assembly

FOLLOWING = """
parameter wide = 3 m;
coordinate Length a ~ 1 m;
coordinate Length b = 2*a;
state Length x = a + b;
equation der(x) = -x/(1 s);
kinetic 1/2*1 kg*(der(a)^2 + der(b)^2);
constraint a = wide;
experiment(stop = 1 s);
"""


def test_values_stated_with_others_follow_the_assembly() -> None:
    found = start(FOLLOWING)
    assert (found["a"], found["b"], found["x"]) == pytest.approx((3, 6, 9), rel=1e-14)


def test_their_derivatives_do_too() -> None:
    solution = mechc.loads(FOLLOWING).simulate(sensitivity=["wide"], estimate_error=False)
    assert np.asarray(solution.sensitivity("x", "wide"))[0] == pytest.approx(3.0, rel=1e-9)


@pytest.mark.parametrize(
    ("declared", "said", "name"),
    [
        ("state u ~ 0; equation der(u) = -u/(1 s);", "initial a*u + v = 1;", "v"),
        ("state u ~ 0; equation der(u) = -u/(1 s);", "initial a*u + k*v + w = 1;", "w"),
        ("coordinate u ~ 0; kinetic 1/2*1 J.s^2*der(u)^2;", "initial a*u + v = 1;", "v"),
        ("coordinate u ~ 0; kinetic 1/2*1 J.s^2*der(u)^2;", "initial a*der(u)*1 s + k*v = 1;", "v"),
    ],
)
def test_a_condition_in_which_an_unknown_has_the_factor_zero_is_for_another(
    declared: str, said: str, name: str
) -> None:
    """The first state in the text took it, and began at 1/0."""
    found = start(
        f"parameter Real a = 0; parameter Real k = 1; {declared} state v ~ 0; equation der(v) = -v/(1 s);\n"
        f"state w ~ 0; equation der(w) = -w/(1 s); {said} experiment(stop = 1 s);"
    )
    assert {n: found[n] for n in ("u", "v", "w")} == {n: float(n == name) for n in ("u", "v", "w")}


def test_a_controller_behind_another_begins_with_an_answer() -> None:
    """Without a derivative, the lag of the first one has no say in the answer of the second one."""
    found = start(
        "import mech.control.*;\nmodel M coordinate Length x = 2 m; kinetic 1/2*1 kg*der(x)^2;\n"
        "PID place(target = 0 m, measured = x, k = 3 s^-1, I = 0 m/s);\n"
        "PID speed(target = place.y, measured = der(x), k = 5 N.s/m);\n"
        "force speed.y on x; initial der(x) = 0.5 m/s; initial speed.y = 7 N; experiment(stop = 1 s); end M;"
    )
    assert found["speed.y"] == pytest.approx(7, rel=1e-14)
    assert found["speed.I"] == pytest.approx(7 - 5 * (-3 * 2 - 0.5), rel=1e-14)


# ---------------------------------------------------------------- wrong models

BODY = "coordinate Length x ~ 1 m; kinetic 1/2*1 kg*der(x)^2;\n"


@pytest.mark.parametrize(
    ("text", "code"),
    [
        (BODY + "force 2 N on x; initial stationary;", "E0609"),
        (BODY + "initial stationary y;", "E0201"),
        (BODY + "potential 9.81 N*x; contact floor: x; initial stationary;", "E0609"),
        (BODY + "parameter k = 1; initial stationary k;", "E0420"),
        (BODY + "initial der(x, 3) = 0;", "E0590"),
        (BODY + "damping 1 N.s/m on x; potential 1 N/m*x^2; initial der(x, 2) = 1 m/s^2;", "E0612"),
        (
            "parameter Stiffness c ~ 1 N/m; coordinate Length x = 1 m; kinetic 1/2*1 kg*der(x)^2; potential c*x^2;",
            "E0610",
        ),
        (BODY + "structural parameter n ~ 3;", "E0134"),
        (BODY + "initial stationary; initial der(x) = 1 m/s;", "E0409"),
        (
            "parameter Length c ~ 1 m; coordinate Length x = c; kinetic 1/2*1 kg*der(x)^2; potential 1 N/m*(x - 2*c)^2;\n"
            "initial der(x, 2) = 0;",
            "E0601",
        ),
        (BODY + "input Force u ~ 3 N;", "E0110"),
    ],
)
def test_wrong_models(text: str, code: str) -> None:
    caught = refused(text)
    assert caught[0].code == code, [d.message for d in caught]


def test_the_printer_and_the_formatter_keep_them(tmp_path: Path) -> None:
    from mechc.cli.main import run

    text = "parameter Stiffness c ~ 100 N/m;\ninitial stationary;\ninitial stationary x, p.angle, y[1];\n"
    file = tmp_path / "m.mech"
    file.write_text(text)
    assert run(["fmt", str(file)]) == 0
    assert file.read_text() == text


def test_modules_of_functions_refuse_what_the_start_finds(tmp_path: Path) -> None:
    from mechc.cli.main import run

    file = tmp_path / "m.mech"
    file.write_text(SPRING)
    assert run(["compile", str(file), "--target", "jax", "-o", str(tmp_path / "m.py")]) != 0


def test_a_module_of_python_finds_it(tmp_path: Path) -> None:
    from mechc.cli.main import run

    file = tmp_path / "arm.mech"
    file.write_text(SPRING)
    assert run(["compile", str(file), "-o", str(tmp_path / "arm.py")]) == 0
    module: dict[str, object] = {"__name__": "arm"}
    exec(compile((tmp_path / "arm.py").read_text(), "arm.py", "exec"), module)
    motion = module["simulate"]()  # type: ignore[operator]
    assert motion["stiffness"][-1] == pytest.approx(49.03325, rel=1e-12)
    assert np.abs(motion["rev.angle"]).max() < 1e-9  # of rest, at a tolerance of 1e-8


@pytest.mark.parametrize("guess", [0.5, 6.9, 15.0, 100.0])
def test_a_stiffness_that_scales_a_whole_balance_is_found_by_another(guess: float) -> None:
    """A plate on two springs of one stiffness: the balance across holds for none, too, so that of the weight decides.

    SciPy: forces and moment of both springs and of the weight by hand.
    """

    def balance(unknown: np.ndarray) -> np.ndarray:
        x, angle, k = unknown
        turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        arm, weight = turn @ [0.01, 0], np.array([0, -2 * 9.81])
        force, moment = weight, arm[0] * weight[1] - arm[1] * weight[0]
        for side in (-1, 1):
            arm = turn @ [0.3 * side, 0.1]
            way = np.array([side - x, 2.0]) - arm
            pull = k * (np.hypot(*way) - 0.5) * way / np.hypot(*way)
            force, moment = force + pull, moment + arm[0] * pull[1] - arm[1] * pull[0]
        return np.array([*force, moment])

    solution = mechc.loads(f"""
    import mech.planar.*;
    parameter Stiffness k ~ {guess} N/m;
    gravity {{0, -9.81}} m/s^2;
    Body plate(m = 2 kg, com = {{0.01, 0}} m, J = 0.1 kg.m^2);
    Free free(world -> plate.a, y = -1 m);
    Spring s[2]({{world * trans({{-1, 1}} m), world * trans({{1, 1}} m)}}
                -> {{plate.a * trans({{-0.3, 0.1}} m), plate.a * trans({{0.3, 0.1}} m)}}, k = k, rest = 0.5 m);
    initial stationary;
    output stiffness = k;
    experiment(stop = 0.1 s);
    """).simulate()
    found = [float(solution[name][0]) for name in ("free.x", "free.angle", "stiffness")]
    assert found == pytest.approx(fsolve(balance, [0, 0, 7], xtol=1e-13), abs=1e-9)
    assert np.abs(balance(np.array(found))).max() < 1e-12
    assert np.ptp(solution["free.angle"]) < 1e-9


def test_a_stiffness_that_only_scales_what_must_be_zero_is_not_decided() -> None:
    caught = refused(
        "parameter Stiffness k ~ 5 N/m; coordinate Length x ~ 1 m; kinetic 1/2*1 kg*der(x)^2;"
        "potential 1/2*k*x^2; initial stationary;"
    )
    assert caught[0].code == "E0610"


@pytest.mark.slow
@pytest.mark.parametrize("target", ["fmu", "c"])
def test_exports_find_it(tmp_path: Path, target: str, capsys: pytest.CaptureFixture[str]) -> None:
    from mechc.cli.main import run

    file = tmp_path / "arm.mech"
    file.write_text(SPRING)
    out = tmp_path / ("arm.fmu" if target == "fmu" else "arm_c")
    assert run(["compile", str(file), "--target", target, "-o", str(out)]) == 0
    if target == "fmu":
        capsys.readouterr()
        assert run(["fmu", "run", str(out), "--set", "body.m=2", "--stop", "0.1"]) == 0
        assert "98.0665" in capsys.readouterr().out
    else:
        import subprocess

        subprocess.run("cc -O1 -o run *.c -lm", shell=True, cwd=out, check=True)
        rows = subprocess.run(
            ["./run", "1"], cwd=out, check=True, capture_output=True, text=True
        ).stdout.splitlines()
        found = dict(zip(rows[0].replace('"', "").split(","), rows[-1].split(","), strict=True))
        assert float(found["stiffness [N/m]"]) == pytest.approx(49.03325, rel=1e-12)
