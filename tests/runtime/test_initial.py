"""Initial states: nearest to the guesses on the constraints, known values kept, contradictions told."""

from __future__ import annotations

import math

import numpy as np
import pytest

import mechc
from mechc.runtime.nominal import sizes_of
from mechc.runtime.outcome import SimulationError

CIRCLE = "kinetic 1/2*1 kg*(der(x)^2 + der(y)^2);constraint rod: sqrt(x^2 + y^2) = 1 m;"


def start(text: str, set: dict[str, str | float] | None = None) -> dict[str, float]:
    """Return the state at the start by name."""
    solution = mechc.loads(text).simulate(stop=1e-9, estimate_error=False, set=set)
    assert isinstance(solution, mechc.Solution)
    return {q.name: float(solution[q.name][0]) for q in solution.problem.states}


def refusal(text: str, set: dict[str, str | float] | None = None) -> SimulationError:
    with pytest.raises(SimulationError) as caught:
        start(text, set)
    return caught.value


def test_guesses_move_to_the_nearest_point() -> None:
    """Of all points of the circle the one in the direction of the guess; the velocity along the tangent."""
    state = start(f"coordinate x ~ 3 m;coordinate y ~ -4 m;initial der(x) ~ 1 m/s;{CIRCLE}")
    assert (state["x"], state["y"]) == pytest.approx((0.6, -0.8), abs=1e-13)
    assert (state["der(x)"], state["der(y)"]) == pytest.approx((0.64, 0.48), abs=1e-13)


@pytest.mark.parametrize("sign", [1, -1])
def test_known_values_stay_and_the_guess_chooses_the_branch(sign: int) -> None:
    state = start(f"coordinate x = 0.6 m;coordinate y ~ {sign}*0.3 m;initial der(x) = 2 m/s;{CIRCLE}")
    assert (state["x"], state["der(x)"]) == (0.6, 2.0)
    assert state["y"] == pytest.approx(sign * 0.8, abs=1e-13)
    assert state["der(y)"] == pytest.approx(-sign * 1.5, abs=1e-12)


def test_a_value_that_is_set_is_known() -> None:
    text = f"coordinate x ~ 3 m;coordinate y ~ -4 m;{CIRCLE}"
    assert start(text, {"x": 0.8})["y"] == pytest.approx(-0.6, abs=1e-13)


def test_start_where_no_direction_helps() -> None:
    """At the centre of the circle every gradient vanishes: a disturbed guess leads on, always the same way."""
    text = f"coordinate x ~ 0 m;coordinate y ~ 0 m;{CIRCLE.replace('sqrt(x^2 + y^2) = 1 m', 'x^2 + y^2 = 1 m^2')}"
    first, second = start(text), start(text)
    assert np.hypot(first["x"], first["y"]) == pytest.approx(1, abs=1e-12)
    assert first == second


def test_weights_are_characteristic_lengths() -> None:
    """s and a*phi share what is missing: (s/a)^2 + phi^2 is least, whatever the unit of length."""
    text = (
        "parameter a = 0.1 m;coordinate s ~ 0 m;coordinate Angle phi ~ 0 rad;"
        "kinetic 1/2*1 kg*der(s)^2;kinetic 1/2*1 kg.m^2*der(phi)^2;constraint c: s + a*phi = 0.02 m;"
    )
    state = start(text)
    assert state["s"] == pytest.approx(0.01, abs=1e-14)
    assert state["phi"] == pytest.approx(0.1, abs=1e-13)


@pytest.mark.parametrize("unit", ["J/N", "km^2/Mm", "kW.s/kN"])
@pytest.mark.parametrize("use", ["output o = b;", "output o = 2*b;"])
def test_a_length_is_one_in_whatever_units_it_is_written(unit: str, use: str) -> None:
    """b counts among the lengths, by whose mean the change of s is weighed against that of phi."""
    text = (
        f"parameter a = 0.1 m;parameter Length b = 2.5 {unit};coordinate s ~ 0 m;coordinate Angle phi ~ 0 rad;{use}"
        "kinetic 1/2*1 kg*der(s)^2;kinetic 1/2*1 kg.m^2*der(phi)^2;constraint c: s + a*phi = 0.02 m;"
    )
    size = math.sqrt(0.1 * 2.5)
    state = start(text)
    assert state["s"] == pytest.approx(0.02 * size**2 / (size**2 + 0.1**2), abs=1e-14)


def test_nominal_values_of_one_unit_are_shared_in_whatever_way_it_is_written() -> None:
    """A coordinate at zero has the size of the one that it feels."""
    sizes = []
    for unit in ("m", "J/N"):
        text = (
            f"parameter Length far = 300 {unit};coordinate Length x = 0 {unit};coordinate Length y = 2 m;"
            "kinetic 1/2*1 kg*(der(x)^2 + der(y)^2);potential 1 N/m*(x - y)^2;potential 1 N/m*(x - far)*y;"
        )
        problem = mechc.loads(text).problem(quick=True)
        found = sizes_of(problem)
        assert found.units[0] == found.units[1]
        sizes.append(found.parameter_units[0])
    assert sizes[0] == sizes[1] == found.units[0]


def test_rotations_turn_by_the_smallest_angle() -> None:
    """One axis of a body is to point upwards: the rotation from the guess is about the normal of both."""
    text = (
        "coordinate Rotation R ~ rotx(50 deg)*roty(20 deg);frame body = world * R;"
        "mass 1 kg at body * {0, 0, 1} m;inertia 1 kg.m^2*diag({1, 1, 1}) on body;"
        "constraint upright: direction(body, {0, 0, 1})[1:2] = {0, 0};output z = direction(body, {0, 0, 1});"
    )
    state = start(text)
    q = np.array([state[f"R[{k}]"] for k in range(1, 5)])
    assert np.linalg.norm(q) == pytest.approx(1, abs=1e-14)
    half = np.radians([50, 20]) / 2
    a = np.array([np.cos(half[0]), np.sin(half[0]), 0, 0])
    b = np.array([np.cos(half[1]), 0, np.sin(half[1]), 0])
    guess = np.array([a[0] * b[0] - a[1:] @ b[1:], *(a[0] * b[1:] + b[0] * a[1:] + np.cross(a[1:], b[1:]))])
    z = 1 - 2 * (guess[1] ** 2 + guess[2] ** 2)
    assert 2 * np.arccos(abs(q @ guess)) == pytest.approx(np.arccos(z), abs=1e-7)


def test_conditions_on_expressions() -> None:
    """An angle fixes both coordinates; energy then fixes the rates, of two roots the one near the guess."""
    text = (
        f"coordinate x ~ 0.5 m;coordinate y ~ -0.9 m;{CIRCLE}potential 9.81 N*y;"
        "initial atan2(x, -y) = 30 deg;initial energy() = 1 J;initial der(x) ~ {v} m/s;"
    )
    for v in (1, -1):
        state = start(text.replace("{v}", str(v)))
        assert (state["x"], state["y"]) == pytest.approx((0.5, -np.sqrt(0.75)), abs=1e-12)
        speed = np.sqrt(2 * (1 + 9.81 * np.sqrt(0.75)))
        assert np.hypot(state["der(x)"], state["der(y)"]) == pytest.approx(speed, abs=1e-11)
        assert np.sign(state["der(x)"]) == v


def test_conditions_without_constraints() -> None:
    state = start("coordinate x = 2 m;kinetic 1/2*3 kg*der(x)^2;initial momentum(x) = 6 kg.m/s;")
    assert state == pytest.approx({"x": 2, "der(x)": 2}, abs=1e-13)


def test_wishes_are_weighed_against_guesses() -> None:
    """x ~ 0 and 2*x ~ 1, both in metres: least squares give x = 2/5."""
    state = start("coordinate x ~ 0 m;kinetic 1/2*1 kg*der(x)^2;initial 2*x ~ 1 m;")
    assert state["x"] == pytest.approx(0.4, abs=1e-13)


def test_second_position_near_a_dead_centre_is_told() -> None:
    text = (
        "import mech.planar.*;Bar a(l = 1 m);Bar b(l = 1 m);Revolute p(world -> a.a, angle ~ 6 deg);"
        "Revolute k(a.b -> b.a, angle ~ -12 deg);cut Revolute c(b.b -> world * trans({1.99, 0} m));"
    )
    solution = mechc.loads(text).simulate(stop=1e-9, estimate_error=False)
    assert isinstance(solution, mechc.Solution)
    assert any("dead centre" in remark for remark in solution.remarks)
    assert solution["p.angle"][0] == pytest.approx(np.arccos(1.99 / 2), abs=1e-9)
    far = mechc.loads(text.replace("1.99", "1.2")).simulate(stop=1e-9, estimate_error=False)
    assert isinstance(far, mechc.Solution)
    assert not any("dead centre" in remark for remark in far.remarks)


def test_what_contradicts_is_listed() -> None:
    error = refusal(f"coordinate x = 0.6 m;coordinate y = 0.9 m;{CIRCLE}")
    assert error.code == "E0604"
    assert [note.split(" (")[0] for note in error.notes] == [
        "'rod' is off by 0.08167 m",
        "x = 0.6 m is given",
        "y = 0.9 m is given",
    ]
    error = refusal(
        f"coordinate x = 0.6 m;coordinate y ~ 0.9 m;{CIRCLE}initial der(x) = 1 m/s;initial der(y) = 1 m/s;"
    )
    assert error.code == "E0604"
    assert [note.split(" (")[0] for note in error.notes] == [
        "the rate of 'rod' is off by 1.4 m/s",
        "der(x) = 1 m/s is given",
        "der(y) = 1 m/s is given",
    ]


def test_dropped_equations_are_checked_with_the_parameters_of_the_run() -> None:
    """Two equations that agree by default; with another parameter they contradict."""
    text = (
        "parameter a = 1 m;coordinate x ~ 0 m;coordinate y = 0 m;"
        "kinetic 1/2*1 kg*(der(x)^2 + der(y)^2);constraint one: x = 1 m;constraint two: x = a;"
    )
    assert start(text)["x"] == pytest.approx(1, abs=1e-14)
    error = refusal(text, {"a": 1.5})
    assert error.code == "E0605"
    assert {note.split(" (")[0] for note in error.notes} == {
        "'one' is off by 0.25 m",
        "'two' is off by 0.25 m",
    }


def test_parts_that_do_not_reach() -> None:
    text = (
        "import mech.planar.*;Bar a(l = {l} m);Bar b(l = 0.5 m);Revolute p(world -> a.a, angle ~ 30 deg);"
        "Revolute q(world * trans({1, 0} m) -> b.a, angle ~ 150 deg);cut Revolute tip(a.b -> b.b);"
    )
    assert refusal(text.replace("{l}", "0.4")).code == "E0606"
    state = start(text.replace("{l}", "0.6"))
    angle = np.arccos((0.36 + 1 - 0.25) / 1.2)
    assert state["p.angle"] == pytest.approx(angle, abs=1e-12)


@pytest.mark.parametrize("guess", ["0.5", "0"])
def test_a_distance_of_zero_has_no_direction(guess: str) -> None:
    """Met exactly, or from a guess beside it; a short distance has one."""
    text = f"coordinate x ~ {guess} m;coordinate y ~ 0 m;{CIRCLE}"
    error = refusal(text.replace("= 1 m;", "= 0 m;"))
    assert error.code == "E0608" and error.message.startswith("'rod' has no direction")
    state = start(text.replace("= 1 m;", "= 1 um;"))
    assert np.hypot(state["x"], state["y"]) == pytest.approx(1e-6, rel=1e-9)


def test_a_constraint_without_a_value_is_named() -> None:
    error = refusal("coordinate x ~ -5 m;kinetic 1/2*1 kg*der(x)^2;constraint c: sqrt(x/1 m) = 2;")
    assert error.code == "E0608" and error.message == "'c' has no value at the guesses"


CRANK = (
    "coordinate Length s ~ 0.3 m;drive der(phi) = 2 rad/s;kinetic 1/2*1 kg*der(s)^2;"
    "constraint rod: (s - 0.1 m*cos(phi))^2 + (0.1 m*sin(phi))^2 = (0.3 m)^2;"
)


def test_a_prescribed_rate_moves_what_hangs_on_it() -> None:
    """A crank of given speed: the slider starts where the angle says, with the rate that follows, and stays there."""
    solution = mechc.loads(f"coordinate Angle phi = 60 deg;{CRANK}").simulate(stop=3, tolerance=1e-10)
    assert isinstance(solution, mechc.Solution) and solution.outcome.value == "completed"
    phi = np.radians(60) + 2 * solution.time
    root = np.sqrt(0.3**2 - (0.1 * np.sin(phi)) ** 2)
    assert solution["s"] == pytest.approx(0.1 * np.cos(phi) + root, abs=1e-9)
    rate = -0.2 * np.sin(phi) - 0.02 * np.sin(phi) * np.cos(phi) / root
    assert solution["der(s)"] == pytest.approx(rate, abs=1e-8)


def test_a_coordinate_of_prescribed_rate_stays_where_it_is_said() -> None:
    error = refusal(f"coordinate Angle phi ~ 50 deg;{CRANK.replace('~ 0.3 m', '= 0.33 m')}")
    assert error.code == "E0604"
    assert "phi = 0.872665 rad stays as it is said: its rate is prescribed" in error.notes


def test_far_guesses_reach_the_constraint() -> None:
    """The search for the nearest point may come to rest beside the constraint: the shortest steps lead on to it."""
    text = """
    import mech.planar.*;
    import mech.couplings.*;
    Body b0(m = 2.26 kg, J = 0.2 kg.m^2);
    Prismatic j0(world -> b0.a, axis = {-0.418, -0.855});
    Body b1(m = 1.48 kg, J = 0.27 kg.m^2);
    Prismatic j1(b0.a * trans({-0.080, -0.053} m)*rot(1.49 rad) -> b1.a, axis = {-0.284, -0.479});
    Body b2(m = 1.88 kg, J = 0.17 kg.m^2);
    Revolute j2(b1.a * trans({0.487, 0.211} m)*rot(-1.40 rad) -> b2.a);
    Body b3(m = 2.64 kg, J = 0.12 kg.m^2);
    Revolute j3(b2.a * trans({0.152, -0.756} m)*rot(-0.90 rad) -> b3.a);
    Body b4(m = 1.97 kg, J = 0.19 kg.m^2);
    PinSlot j4(b3.a * trans({0.596, 0.299} m)*rot(-1.55 rad) -> b4.a, axis = {0.028, -0.612});
    frame tip = b4.a * trans({-0.076, -0.451} m);
    frame post = world * trans({-0.795, 0.636} m);
    Distance c(tip -> post, l = 0.36 m);
    output length = norm(pos(tip) - pos(post));
    """
    solution = mechc.loads(text).simulate(stop=1e-9, estimate_error=False)
    assert isinstance(solution, mechc.Solution)
    assert solution["length"][0] == pytest.approx(0.36, abs=1e-11)


def test_rounding_of_the_assembly_is_no_size() -> None:
    """A loop that hangs on a hinge which nothing turns: its angle is zero but for rounding, and the run goes on."""
    text = """
    import mech.planar.*;
    gravity {0.3, -9.81} m/s^2;
    Body b0(m = 3 kg, J = 0.056 kg.m^2, com = {-0.189, -0.228} m);
    Prismatic j0(world * trans({0.162, 0.691} m) -> b0.a, axis = {-0.537, 0.919});
    Body b1(m = 2.81 kg, J = 0.221 kg.m^2, com = {0.125, -0.271} m);
    Revolute j1(b0.a * trans({-0.303, -0.496} m) -> b1.a);
    Body b3(m = 2.89 kg, J = 0.115 kg.m^2, com = {-0.113, 0.169} m);
    Translation j3(b1.a * trans({-0.353, -0.367} m) -> b3.a);
    cut Revolute c1(b3.a * trans({-0.081, -0.248} m) -> b1.a * trans({0.035, -0.181} m));
    """
    solution = mechc.loads(text).simulate(stop=1, tolerance=1e-9)
    assert isinstance(solution, mechc.Solution) and solution.outcome.value == "completed"
    assert all(drift.after < 1e-12 for drift in solution.accuracy.constraints)


def test_what_assembly_leaves_of_a_zero_is_no_size() -> None:
    """A slider that closes a loop turns its body to angle zero, but for rounding: drifts are not multiples of that."""
    text = """
    import mech.planar.*;
    Body b(m = 2 kg, J = 0.39 kg.m^2, com = {-0.32 m, -0.31 m});
    Planar free(world -> b.a, x ~ -16 cm, y ~ -0.26 m, angle ~ 0.1 rad, der(angle) ~ 20 deg/s);
    Prismatic guide(world * trans({90 mm, 0.08 m}) -> b.a * trans({-0.25 m, 0.22 m}));
    force {-1.31 N, 0.47 N} on b.a in b.a;
    """
    solution = mechc.loads(text).simulate(stop=1)
    assert isinstance(solution, mechc.Solution) and solution.outcome.value == "completed"
    assert abs(float(solution["free.angle"][0])) < 1e-14
    assert all(drift.after < 1e-12 for drift in solution.accuracy.constraints)


CURVED = """
coordinate x ~ {x} m; coordinate y ~ {y} m;
kinetic 1/2*1 kg*(der(x)^2 + der(y)^2);
constraint wave: y = 0.4 m*sin(x/(0.1 m));
"""


@pytest.mark.parametrize(("x", "y"), [(0.12, 1.5), (0.17, 0.9), (0.5, -1.1), (0.47, 0.0)])
def test_the_nearest_point_of_a_curve_that_bends_more_than_it_is_far(x: float, y: float) -> None:
    """Far beyond the centre of its curvature, where a step along the tangent leads back by more than it came from."""
    solution = mechc.loads(CURVED.format(x=x, y=y)).simulate(stop=1e-9, estimate_error=False)
    assert isinstance(solution, mechc.Solution)
    s, h = float(solution["x"][0]), float(solution["y"][0])
    assert h == pytest.approx(0.4 * math.sin(s / 0.1), abs=1e-14)
    gradient = (s - x) + (h - y) * 4 * math.cos(s / 0.1)
    curvature = 1 + (4 * math.cos(s / 0.1)) ** 2 - (h - y) * 40 * math.sin(s / 0.1)
    assert curvature > 0, "it is a nearest point"
    assert abs(gradient / curvature) < 1e-11


WAVE = """
coordinate x(nominal = 1 m) ~ {x} m; coordinate y(nominal = 1 m) ~ {y} m;
kinetic 1/2*1 kg*(der(x)^2 + der(y)^2);
constraint wave: y = {a} m*sin({k} m^-1*x);
"""


@pytest.mark.parametrize(
    ("a", "k", "x", "y"),
    [
        (0.32, 8.72, 0.29, 2.68),
        (0.98, 3.19, -0.31, 2.96),
        (0.82, 2.94, 0.78, -2.54),
        (1.1, 1.62, 0.87, 2.71),
        # here the search ends beside the curve
        (1.033832, 8.076172, -0.366683, -2.871217),
        (0.843429, 8.559167, 0.624894, 2.877037),
    ],
)
def test_the_nearest_point_where_steps_go_to_and_fro(a: float, k: float, x: float, y: float) -> None:
    solution = mechc.loads(WAVE.format(a=a, k=k, x=x, y=y)).simulate(stop=1e-9, estimate_error=False)
    assert isinstance(solution, mechc.Solution)
    s, h = float(solution["x"][0]), float(solution["y"][0])
    assert h == pytest.approx(a * math.sin(k * s), abs=1e-14)
    gradient = (s - x) + (h - y) * a * k * math.cos(k * s)
    curvature = 1 + (a * k * math.cos(k * s)) ** 2 - (h - y) * a * k**2 * math.sin(k * s)
    assert curvature > 0, "it is a nearest point"
    assert abs(gradient / curvature) < 1e-11


HILLS = """
coordinate x(nominal = 1 m) ~ {x} m; coordinate y(nominal = 1 m) ~ {y} m; coordinate z(nominal = 1 m) ~ {z} m;
kinetic 1/2*1 kg*(der(x)^2 + der(y)^2 + der(z)^2);
constraint hills: z = 1.4 m*sin(4 m^-1*x)*cos(5 m^-1*y);
initial 0.2*x + y - z = 0.4 m;
"""


@pytest.mark.parametrize(
    ("x", "y", "z"), [(0.3, 0.1, 2.5), (-0.8, 0.5, -2.1), (1.1, -0.7, 1.9), (0.05, 0.9, -3)]
)
@pytest.mark.parametrize("wish", ["", "~"])
def test_the_nearest_point_among_hills(x: float, y: float, z: float, wish: str) -> None:
    """Without the condition, and with one that is wished: two directions are left, of second derivatives of their own."""
    text = HILLS.format(x=x, y=y, z=z)
    condition = "initial 0.2*x + y - z = 0.4 m;"
    text = text.replace(condition, condition.replace("=", "~") if wish else "")
    solution = mechc.loads(text).simulate(stop=1e-9, estimate_error=False)
    assert isinstance(solution, mechc.Solution)
    at = np.array([float(solution["x"][0]), float(solution["y"][0])])

    def size(p: np.ndarray) -> float:
        height = 1.4 * math.sin(4 * p[0]) * math.cos(5 * p[1])
        far = float(p[0] - x) ** 2 + (p[1] - y) ** 2 + (height - z) ** 2
        return float(far + ((0.2 * p[0] + p[1] - height - 0.4) ** 2 if wish else 0)) / 2

    h = 1e-4  # differences of fourth order: 1e-16 of rounding, over h, and h^4
    steps = h * np.eye(2)
    gradient = [
        (8 * (size(at + d) - size(at - d)) - size(at + 2 * d) + size(at - 2 * d)) / (12 * h) for d in steps
    ]
    curvature = [
        [
            (size(at + d + e) - size(at + d - e) - size(at - d + e) + size(at - d - e)) / (4 * h * h)
            for e in steps
        ]
        for d in steps
    ]
    assert np.all(np.linalg.eigvalsh(curvature) > 0), "it is a nearest point"
    assert np.abs(np.linalg.solve(curvature, gradient)).max() < 1e-9


BESIDE = """
coordinate a[3] ~ {0.52, 0.19, 0.79};
coordinate Angle b = 0.3 rad; initial der(b) ~ 0.7 rad/s;
coordinate c ~ 0.31;
coordinate p ~ 0.2; coordinate q ~ 0.2; initial der(p) ~ 0.1/(1 s); initial der(q) ~ 0.1/(1 s);
coordinate Rotation R ~ rotz(30 deg)*rotx(0.7 rad); initial der(R) ~ {0.3, -0.1, 0.7} rad/s;
kinetic 1/2*1 kg.m^2*(norm(der(R))^2 + sum(der(a[i])^2 for i in 1:3) + der(b)^2 + der(c)^2 + der(p)^2 + der(q)^2);
constraint tied: a[3] = 0.75*c + 0.2*sin(1.7 s^-1*time);
constraint held: p = q;
"""


def test_what_no_constraint_moves_keeps_every_bit() -> None:
    """Neither what no row turns on, nor what rows connect that hold to the last bit: conditions may be at their edge."""
    solution = mechc.loads(BESIDE).simulate(stop=1e-9, estimate_error=False)
    assert isinstance(solution, mechc.Solution)
    first = {q.name: float(solution[q.name][0]) for q in solution.problem.states}
    assert first["a[3]"] == pytest.approx(0.75 * first["c"], abs=1e-14) and first["a[3]"] != 0.79
    kept = {"a[1]": 0.52, "a[2]": 0.19, "der(a[1])": 0.0, "der(a[2])": 0.0, "b": 0.3, "der(b)": 0.7}
    kept |= {"der(R)[1]": 0.3, "der(R)[2]": -0.1, "der(R)[3]": 0.7}
    kept |= {"p": 0.2, "q": 0.2, "der(p)": 0.1, "der(q)": 0.1}
    assert {name: first[name] for name in kept} == kept
