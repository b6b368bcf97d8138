"""Laws that jump in time and space, by all methods: every jump is met, however short what lies between two of them."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest

import mechc

METHODS = ("dop853", "radau5", "rk4", "verlet", "gauss4", "rattle", "lobatto4", "lobatto6")
FIXED = METHODS[2:]

POINT = """
coordinate Length x = 0 m;
initial der(x) = 1 m/s;
kinetic 1/2*1 kg*der(x)^2;
force 1 N*(%s) on x;
experiment(stop = 1 s);
"""


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(
    ("law", "speed"),
    [
        ("if time < 0.505 s then 1 else 0", 1.505),
        ("if x < 0.505 m then 1 else 0", math.sqrt(1 + 2 * 0.505)),
        ("floor(time/0.1 s)", 1 + 4.5),
    ],
)
def test_pieces_of_constant_force(method: str, law: str, speed: float) -> None:
    """Within a piece every one of these methods is exact; 0.013 s hits no jump."""
    step = "13 ms" if method in FIXED else None
    solution = mechc.loads(POINT % law).simulate(method=method, step=step, estimate_error=False)
    assert solution["der(x)"][-1] == pytest.approx(speed, abs=1e-11)


@pytest.mark.parametrize(("method", "error"), [("rattle", 1e-5), ("lobatto4", 1e-9), ("lobatto6", 1e-12)])
def test_a_force_on_a_constrained_point_ends(method: str, error: float) -> None:
    """On the unit circle a force along it of 1 N, for 0.505 s, gives the angle a t^2/2, then a constant rate."""
    model = mechc.loads("""
    coordinate Length x = 1 m;
    coordinate Length y = 0 m;
    kinetic 1/2*1 kg*(der(x)^2 + der(y)^2);
    constraint rim: x^2 + y^2 = 1 m^2;
    let push = if time < 0.505 s then 1 N else 0;
    force -push*y/1 m on x;
    force push*x/1 m on y;
    experiment(stop = 1 s);
    """)
    solution = model.simulate(method=method, step="13 ms", estimate_error=False)
    angle = 0.505**2 / 2 + 0.505 * (1 - 0.505)
    assert math.atan2(solution["y"][-1], solution["x"][-1]) == pytest.approx(angle, abs=error)


def test_short_pulses_of_a_period_are_all_met() -> None:
    """Eleven pulses of 1 N.s, each of a millisecond, in free flight, where steps are as long as they may be."""
    solution = mechc.loads(POINT % "if mod(time, 1 s) < 1 ms then 1000 else 0").simulate(stop=10.5)
    assert solution["der(x)"][-1] == pytest.approx(12, abs=1e-8)


@pytest.mark.parametrize(
    ("law", "python"),
    [
        ("-floor(x/0.1 m)", lambda x: -math.floor(x / 0.1)),
        ("-ceil(x/0.1 m)", lambda x: -math.ceil(x / 0.1)),
        ("mod(x, 0.3 m)/1 m", lambda x: x % 0.3),
        ("-1 - mod(x, -0.3 m)/1 m", lambda x: -1 - x % -0.3),
        ("-floor(floor(x/0.1 m)/2)", lambda x: -math.floor(math.floor(x / 0.1) / 2)),
        ("if mod(x, 0.3 m) < 0.1 m then -2 else 1", lambda x: -2 if x % 0.3 < 0.1 else 1),
        ("if floor(x/0.1 m) == 2 then -2 else 1", lambda x: -2 if math.floor(x / 0.1) == 2 else 1),
        ("if floor(x/0.1 m) >= 2 then -2 else 1", lambda x: -2 if math.floor(x / 0.1) >= 2 else 1),
        ("if sign(x) <= -1 then 2 else -1", lambda x: 2 if x < 0 else -1),
    ],
)
def test_work_of_a_force_of_stairs(law: str, python: Callable[[float], float]) -> None:
    """The kinetic energy is the area under the law; sums of 200000 strips have it to 2e-5."""
    solution = mechc.loads(POINT % law).simulate(set={"x": 0.35, "der(x)": -1}, stop=3, estimate_error=False)
    for k in (100, 250, -1):
        edges = np.linspace(0.35, solution["x"][k], 200001)
        work = np.mean([python(x) for x in (edges[1:] + edges[:-1]) / 2]) * (edges[-1] - edges[0])
        assert solution["der(x)"][k] ** 2 / 2 == pytest.approx(0.5 + work, abs=2e-5)


@pytest.mark.parametrize("x", [-1.0, 0.0, 1.0, 2.0, 3.0, 0.1 * 3 / 0.1])
def test_a_whole_number_at_rest_is_its_own_whole_part(x: float) -> None:
    model = mechc.loads("""
    coordinate Length x = 0 m;
    coordinate Length y = 0 m;
    kinetic 1/2*1 kg*(der(x)^2 + der(y)^2);
    force 2 N*floor(x/1 m) on y;
    experiment(stop = 1 s);
    """)
    assert model.simulate(set={"x": x})["y"][-1] == pytest.approx(round(x), abs=1e-12)


def test_steps_of_a_potential_of_stairs() -> None:
    """Each stair of 0.1 J takes its energy; the fifth is too high for the 0.08 J left, and all are passed on the way back."""
    solution = mechc.loads("""
    coordinate Length x = 0.05 m;
    initial der(x) = sqrt(0.96)*1 m/s;
    kinetic 1/2*1 kg*der(x)^2;
    potential 0.1 J*floor(x/0.1 m);
    """).simulate(stop=1.3)
    kinds = [event.kind for event in solution.events]
    assert kinds == ["crossing"] * 4 + ["reflection"] + ["crossing"] * 3
    assert solution["energy.total"] == pytest.approx(np.full(len(solution.time), 0.48), abs=1e-12)
    speeds = [abs(event.before["der(x)"]) for event in solution.events[:5]]
    assert speeds == pytest.approx([math.sqrt(0.96 - 0.2 * k) for k in range(5)], rel=1e-12)


@pytest.mark.parametrize(
    "law",
    [
        "potential 1/2*(if time < 1 s then 1 N/m else 4 N/m)*x^2;",
        "lagrangian -1/2*(if time < 1 s then 1 N/m else 4 N/m)*x^2;",
        "discrete Stiffness k = 1 N/m; when time > 1 s then k := 4 N/m; end when; potential 1/2*k*x^2;",
    ],
)
def test_a_spring_that_becomes_stiffer_is_given_energy(law: str) -> None:
    """At 1 s the position is cos(1) m; three quarters of the energy of the spring are new then."""
    solution = mechc.loads(f"coordinate Length x = 1 m; kinetic 1/2*1 kg*der(x)^2; {law}").simulate(stop=3)
    assert solution.energy is not None
    assert solution.energy.supplied_at_events == pytest.approx(1.5 * math.cos(1) ** 2, rel=1e-7)
    assert solution["x"][-1] == pytest.approx(
        math.cos(1) * math.cos(4) - math.sin(1) / 2 * math.sin(4), abs=1e-7
    )
    balance = solution["energy.total"] - solution["energy.supplied"]
    assert balance == pytest.approx(np.full(len(balance), 0.5), abs=1e-6)


@pytest.mark.parametrize(
    ("step", "speed"),
    [
        ("if x < v*time then 0 J else 0.1 J", 0.5 + math.sqrt(0.05)),
        ("if x < v*time then 0 J else 0.1 J*x/2 m", None),
        ("if x < v*time then 0 J else 1 J", 0),
        ("if x < wall then 0 J else 0.1 J", 0.5 + math.sqrt(0.05)),
    ],
)
def test_a_step_that_moves(step: str, speed: float | None) -> None:
    """Where the step rests the speed of 1/2 m/s loses what 0.1 J take, or is thrown back; the mover does work."""
    solution = mechc.loads(f"""
    parameter v = 0.5 m/s;
    coordinate Length wall;
    drive wall = v*time;
    coordinate Length x = -1 m;
    initial der(x) = 1 m/s;
    kinetic 1/2*1 kg*der(x)^2;
    potential {step};
    """).simulate(stop=2.5)
    (event,) = solution.events
    assert event.time == pytest.approx(2, rel=1e-12)
    jump = 0.1 if speed is not None else 0.05
    expected = 0.5 + math.sqrt(0.25 - 2 * jump) if speed is None else speed
    assert event.after["der(x)"] == pytest.approx(expected, abs=1e-12)
    balance = solution["energy.total"] - solution["energy.supplied"]
    assert balance == pytest.approx(np.full(len(balance), 0.5), abs=1e-12)


def test_a_step_of_the_lagrangian_is_one_of_the_potential() -> None:
    solution = mechc.loads("""
    coordinate Length x = 0 m;
    initial der(x) = 1 m/s;
    lagrangian 1/2*1 kg*der(x)^2 - (if x > 1 m then 0.4 J else 0);
    """).simulate(stop=2)
    assert solution["der(x)"][-1] == pytest.approx(math.sqrt(0.2), rel=1e-12)


@pytest.mark.parametrize("word", ["kinetic", "lagrangian"])
@pytest.mark.parametrize("condition", ["time < 1 s", "x < 1 m"])
def test_an_inertia_that_jumps_is_refused(word: str, condition: str) -> None:
    """The momentum would go on, so the speed would jump; which of them, an event has to say."""
    with pytest.raises(mechc.CompileError, match="E0715"):
        mechc.loads(f"""
        coordinate Length x = 0 m;
        {word} 1/2*(if {condition} then 1 kg else 2 kg)*der(x)^2;
        """).simulate(stop=2, set={"der(x)": 1})


def test_an_initial_value_that_asks_for_another() -> None:
    """The branch is that of the initial state, though nothing has been located yet."""
    model = mechc.loads("""
    coordinate Length x = 2 m;
    coordinate Length y = 0 m;
    initial der(y) = if x > 1 m then 1 m/s else -1 m/s;
    kinetic 1/2*1 kg*(der(x)^2 + der(y)^2);
    force (if x > 1 m then 1 N else 0) on x;
    """)
    assert model.simulate(stop=1)["der(y)"][0] == 1
    assert model.simulate(stop=1, set={"x": 0.5})["der(y)"][0] == -1


@pytest.mark.parametrize(
    "law",
    [
        "potential if x > 0.5 m then 1 N*x + 2 N*y else 3 N*y;",
        "potential (if x > y then 1 N*x else 3 N*y) + (if x > 0.6 m then 0.2 J else 0.3 J) + 1 N*max(x, y);",
        "lagrangian if x > 0.5 m then -1 N*x else -3 N*y;",
    ],
)
def test_switch_beside_a_lagrangian(law: str) -> None:
    """Half of the kinetic energy is written as ``lagrangian``: the motion, and its steps, are the same."""
    start = "coordinate Length x = 0.3 m; coordinate Length y = 0.1 m; initial der(x) = 1 m/s;"
    energy = "1/2*2 kg*(1 + x^2/(1 m^2))*der(x)^2 + 1/2*1 kg*der(y)^2 + 0.1 kg*der(x)*der(y)"
    ours, theirs = (
        mechc.loads(f"{start} {kind} {energy}; {law}").simulate(stop=1, tolerance=1e-10)
        for kind in ("lagrangian", "kinetic")
    )
    assert [e.kind for e in ours.events] == [e.kind for e in theirs.events]
    for name in ("x", "y", "der(x)", "der(y)"):
        assert ours[name][-1] == pytest.approx(theirs[name][-1], rel=1e-9, abs=1e-9)


def test_a_motion_along_the_energy_at_which_its_law_changes_comes_to_an_end() -> None:
    """Each turn leads some 1e-13 s on: a thousand of them were too long for a moment, and 1e13 would have been the way."""
    text = (
        "coordinate x = 0 m;initial der(x) = 1 m/s;kinetic 1/2*2 kg*der(x)^2;coordinate y = 0.3 m;kinetic 1/2*1 kg*der(y)^2;"
        "potential 1/2*3 N/m*(y - 1 m)^2;force if energy() < 2.435 J then 2 N else -0.5 N on x;force -0.1 N.s/m*der(y) on y;"
        "experiment(stop = 1 s);"
    )
    run = mechc.loads(text).simulate(tolerance=1e-9, estimate_error=False)
    assert "the motion slides along it" in run.message


def test_the_rate_of_a_state_in_the_equation_of_another() -> None:
    """E' = z' z with z = exp(-t): E = (exp(-2 t) - 1)/2, in whichever order they stand."""
    for text in (
        "equation der(E) = der(z)*z; equation der(z) = -z;",
        "equation der(z) = -z; equation der(E) = der(z)*z;",
    ):
        model = mechc.loads("dimensionless; state z = 1; state E = 0;" + text + "experiment(stop = 1);")
        solution = model.simulate(tolerance=1e-11, estimate_error=False)
        assert solution["E"] == pytest.approx((np.exp(-2 * solution.time) - 1) / 2, abs=1e-10)


def test_rates_that_depend_on_each_other_are_refused() -> None:
    text = "dimensionless; state a = 1; state b = 0; equation der(a) = der(b) + 1; equation der(b) = der(a);"
    with pytest.raises(mechc.CompileError, match=r"'der\(a\)' is defined by itself"):
        mechc.loads(text)
