"""Rules of events: edges, order, samples, switching, messages. Known systems with events are in the gallery."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest

import mechc
from mechc.runtime.outcome import Outcome
from mechc.solution import Solution

BALL = """\
parameter m = 0.1 kg;
parameter g = 9.81 m/s^2;
parameter e = 0.8;
coordinate h = 1 m;
kinetic 1/2*m*der(h)^2;
potential m*g*h;
"""


def run(text: str, **options: object) -> Solution:
    return mechc.loads(text).simulate(**({"estimate_error": False} | options))  # type: ignore[arg-type]


def times(solution: Solution, kind: str) -> list[float]:
    return [e.time for e in solution.events if e.kind == kind]


def closes(solution: Solution, relative: float = 1e-8) -> bool:
    drift = solution.accuracy.energy
    return drift is not None and drift.relative is not None and drift.relative < relative


def test_reinit_bounces_at_the_times_of_free_flight() -> None:
    text = "discrete Integer n = 0;\nwhen h < 0 m then reinit(der(h), -e*der(h)); n := n + 1; end when;\n"
    solution = run(BALL + text, stop=3)
    first = math.sqrt(2 / 9.81)
    exact = [first * (1 + 2 * sum(0.8**k for k in range(1, n + 1))) for n in range(6)]
    assert times(solution, "when") == pytest.approx(exact, rel=1e-13)
    assert solution["n"][-1] == 6
    assert closes(solution, 1e-13)
    # both sides of each event are rows
    rows = np.flatnonzero(np.diff(solution.time) == 0)
    assert len(rows) == 6
    for i in rows:
        assert solution["der(h)"][i + 1] == pytest.approx(-0.8 * solution["der(h)"][i], rel=1e-12)


def test_raw_events_that_pile_up_name_the_condition_and_contact() -> None:
    solution = run(BALL + "when h < 0 m then reinit(der(h), -e*der(h)); end when;\n", stop=5)
    assert solution.outcome is Outcome.FAILED
    assert "h < 0 m" in solution.message and "'contact'" in solution.message


@pytest.mark.parametrize("floor", ["0 m", "1 m", "1000 m"])
@pytest.mark.parametrize("e", [0.03, 0.2, 0.5])
def test_raw_events_that_pile_up_fast_do_not_fall_through(e: float, floor: str) -> None:
    """After few bounces their height is below the rounding of the position, long before fifty are counted.

    The fall takes sqrt(2/g), the bounces 2 e/(1 - e) of that; stopped within 1e-5 of the first bounce of the end.
    """
    text = "coordinate h = FLOOR + 1 m; kinetic 1/2*1 kg*der(h)^2; potential 9.81 N*h;"
    bounce = f"when h < FLOOR then reinit(der(h), -{e}*der(h)); end when;"
    s = run((text + bounce).replace("FLOOR", floor), stop=9.0)
    assert s.outcome is Outcome.FAILED and "write a 'contact'" in s.message
    fall = math.sqrt(2 / 9.81)
    assert s.time[-1] == pytest.approx(fall * (1 + 2 * e / (1 - e)), abs=2e-5 * e * fall)


def test_a_condition_that_holds_at_the_start_does_not_fire() -> None:
    text = "discrete Integer n = 0;\nwhen h > 0.5 m then n := n + 1; end when;\n"
    assert run(BALL + text, stop=0.2)["n"][-1] == 0


def test_assignments_run_from_top_to_bottom_and_pre_is_before() -> None:
    text = """\
coordinate x = 0 m;
initial der(x) = 1 m/s;
kinetic 1/2*(1 kg)*der(x)^2;
discrete Real a = 1;
discrete Real b = 0;
discrete Real c = 0;
when x > 1 m then
  a := a + 1;
  b := a;
  c := pre(a);
end when;
"""
    solution = run(text, stop=2)
    assert [solution[n][-1] for n in "abc"] == [2, 2, 1]


def test_sampling_is_exact_and_begins_at_the_start() -> None:
    text = """\
coordinate x = 0 m;
initial der(x) = 1 m/s;
kinetic 1/2*(1 kg)*der(x)^2;
discrete Length seen = 0 m;
discrete Integer n = 0;
when sample(0.1 s) then seen := x; n := n + 1; end when;
"""
    solution = run(text, stop=1)
    assert times(solution, "when") == [k * 0.1 for k in range(11)]
    assert solution["n"][-1] == 11
    assert solution["seen"][-1] == pytest.approx(1.0, rel=1e-13)


def test_a_time_event_needs_no_search() -> None:
    text = "discrete Integer n = 0;\nwhen time >= 0.25 s then n := 1; end when;\n"
    assert times(run(BALL + text, stop=0.4), "when") == [0.25]


def test_a_touch_within_one_step_is_found() -> None:
    """The condition holds for a thousandth of the run; steps are as long as they can be."""
    text = """\
parameter w = 1 rad/s;
coordinate x = 1 m;
kinetic 1/2*(1 kg)*der(x)^2;
potential 1/2*(1 kg)*w^2*x^2;
discrete Integer n = 0;
when x < -0.9999999 m then n := n + 1; end when;
"""
    solution = run(text, stop=20, tolerance=1e-11)
    assert solution["n"][-1] == 3


def test_a_branch_ends_the_run() -> None:
    solution = run(BALL + 'when h < 0 m then terminate("it is down"); end when;\n', stop=5)
    assert solution.outcome is Outcome.TERMINATED
    assert solution.message.startswith("it is down")
    assert solution.time[-1] == pytest.approx(math.sqrt(2 / 9.81), rel=1e-13)


STEP = """\
parameter U = -1 J;
coordinate x = 0 m;
coordinate y = 1 m;
initial der(x) = sin(45 deg)*(1 m/s);
initial der(y) = -cos(45 deg)*(1 m/s);
kinetic 1/2*(1 kg)*(der(x)^2 + der(y)^2);
potential if y > 0 m then 0 else U;
"""


def test_a_block_stays_where_friction_holds_it() -> None:
    text = """\
coordinate s = 0 m;
initial der(s) = 2 m/s;
kinetic 1/2*(1 kg)*der(s)^2;
friction 4 N on s;
"""
    solution = run(text, stop=2)
    assert times(solution, "stick") == pytest.approx([0.5], rel=1e-13)
    assert solution["s"][-1] == pytest.approx(0.5, rel=1e-12)
    assert solution["der(s)"][-1] == 0
    assert solution["energy.dissipated"][-1] == pytest.approx(2, rel=1e-12)


def test_a_constraint_is_released_and_engaged() -> None:
    text = """\
coordinate a = 0 m;
coordinate b = 0 m;
initial der(a) = 1 m/s;
initial der(b) = 1 m/s;
kinetic 1/2*(1 kg)*der(a)^2 + 1/2*(3 kg)*der(b)^2;
force 4 N on a;
constraint hold: der(a) = der(b);
when time >= 1 s then release hold; end when;
when time >= 2 s then engage hold; end when;
"""
    solution = run(text, stop=3)
    assert [(e.time, e.kind) for e in solution.events if e.name == "hold"] == [(1, "release"), (2, "engage")]
    # together 1 m/s^2; apart a gains 4 m/s; the impact shares the momentum 1*(2 + 4) + 3*2
    assert solution(1.999999)["der(a)"] == pytest.approx(2 + 4 * 0.999999, rel=1e-9)
    assert solution["der(a)"][-1] == pytest.approx(12 / 4 + 1, rel=1e-12)
    assert solution["der(b)"][-1] == pytest.approx(12 / 4 + 1, rel=1e-12)
    assert closes(solution, 1e-12)


@pytest.mark.parametrize(
    "law, left", [("", 2 - 0.3 * math.sqrt(2)), (', law = "regularized", v_stick = 1 mm/s', 2.0)]
)
def test_impacts_of_contacts_with_regularized_friction_are_smooth_and_told(law: str, left: float) -> None:
    """Coulomb's impulse is 0.3 times that of the floor, m sqrt(2 g h) without rebound; a smooth force gives none."""
    text = f"""
coordinate h = 1 m;
coordinate x = 0 m;
initial der(x) = 2 m/s;
kinetic 1/2*1 kg*(der(h)^2 + der(x)^2);
potential 1 N*h;
contact floor: h friction 0.3 along der(x){law};
"""
    warned = [d.code for d in mechc.loads(text).diagnostics]
    assert warned == (["W0723"] if law else [])
    solution = run(text, stop=2)
    (impact,) = [e for e in solution.events if e.kind == "impact"]
    assert impact.after.get("der(x)", 2.0) == pytest.approx(left, rel=1e-12)


def test_the_creep_of_regularized_friction_is_reported() -> None:
    """Half of the limit pulls: tanh(v/v_stick) = 1/2. Sliding faster than v_stick is no creep."""
    text = """
coordinate s = 0 m;
initial der(s) = 0.1 m/s;
kinetic 1/2*(1 kg)*der(s)^2;
friction 4 N on s, law = "regularized", v_stick = 1 mm/s;
force 2 N on s;
"""
    solution = run(text, stop=1)
    creep = 1e-3 * math.atanh(0.5)
    assert solution["creep(friction[1])"][-1] == pytest.approx(creep, rel=1e-6)
    assert solution["creep(friction[1])"][0] == 0 and solution.unit("creep(friction[1])") == "m/s"
    assert np.max(solution["creep(friction[1])"]) < 1e-3
    assert any("'friction[1]' creeps where it ought to stick" in remark for remark in solution.remarks)
    sliding = run(text.replace("force 2 N", "force 6 N"), stop=1)
    assert not any("creeps" in remark for remark in sliding.remarks)


def test_chattering_stops_with_advice() -> None:
    text = """\
coordinate s = 0 m;
initial der(s) = 1 m/s;
kinetic 1/2*(1 kg)*der(s)^2;
force -(1 N)*sign(der(s)) on s;
"""
    solution = run(text, stop=3)
    assert solution.outcome is Outcome.FAILED
    assert "'friction'" in solution.message
    assert solution.time[-1] == pytest.approx(1, rel=1e-12)


def test_a_contact_that_starts_penetrated_is_told() -> None:
    solution = run(BALL.replace("h = 1 m", "h = -1 m") + "contact floor: h restitution e;\n", stop=1)
    assert solution.outcome is Outcome.FAILED
    assert "penetrated" in solution.message and "its gap is -1 (SI)" in solution.message


@pytest.mark.parametrize("speed", [-1, 7])
def test_a_contact_that_is_engaged_beyond_its_surface_is_told(speed: float) -> None:
    """Also where the body is on its way back."""
    solution = mechc.loads(f"""
    coordinate Length x = 1 m;
    kinetic 1/2*1 kg*der(x)^2;
    potential 10 N*x;
    contact floor: x restitution 0.5;
    when initial() then
      release floor;
    end when;
    when time > 0.6 s then
      reinit(der(x), {speed} m/s);
      engage floor;
    end when;
    """).simulate(stop=1, estimate_error=False)
    assert solution.outcome is Outcome.FAILED
    assert "'floor' is penetrated at t = 0.6 s: its gap is -0.8 (SI)" in solution.message


def test_a_constraint_that_is_engaged_elsewhere_is_told() -> None:
    text = """
coordinate a = 0 m;
coordinate b = 1 m;
initial der(a) = 1 m/s;
kinetic 1/2*(1 kg)*(der(a)^2 + der(b)^2);
constraint hold: a = b - 1 m;
when time >= 1 s then release hold; impulse 1 N.s on a; end when;
when time >= 1.5 s then engage hold; end when;
"""
    solution = run(text, stop=3)
    assert solution.outcome is Outcome.FAILED
    assert "'hold' is engaged at t = 1.5 s" in solution.message
    assert "its sides are 0.5 (SI) apart" in solution.message


def test_events_that_never_end_are_told() -> None:
    text = """\
coordinate x = 0 m;
initial der(x) = 1 m/s;
kinetic 1/2*(1 kg)*der(x)^2;
discrete Boolean on = false;
when x > 1 m then on := true; end when;
when on then on := false; end when;
when not on and x > 0.5 m then on := true; end when;
"""
    solution = run(text, stop=3)
    assert solution.outcome is Outcome.FAILED
    assert "on" in solution.message


def test_impulses_respect_constraints() -> None:
    text = """\
gravity {0, -9.81 m/s^2};
coordinate x = 0 m;
coordinate y = -1 m;
point P = world * {x, y};
mass 2 kg at P;
constraint rod: x^2 + y^2 = 1 m^2;
when time >= 1 s then impulse {3, 5} N.s on P; end when;
"""
    solution = run(text, stop=1)
    assert solution["der(x)"][-1] == pytest.approx(1.5, rel=1e-9)
    assert abs(solution["der(y)"][-1]) < 1e-9


def test_ten_thousand_bounces_are_all_found() -> None:
    """Elastic: the period is exact, none is lost and none found twice."""
    first = math.sqrt(2 / 9.81)
    solution = run(BALL + "contact floor: h restitution 1;\n", stop=2e4 * first, tolerance=1e-10)
    hits = times(solution, "impact")
    assert len(hits) == 10_000
    assert all(b - a == pytest.approx(2 * first, rel=1e-9) for a, b in pairwise(hits))
    assert closes(solution)


def test_a_model_without_events_has_no_code_for_them() -> None:
    from mechc.compiler.targets.c import emit_c

    text = emit_c(mechc.loads(BALL).compilation.program)
    assert "indicators" not in text and "hybrid" not in text


def test_momenta_that_events_change_are_not_called_constant() -> None:
    assert not mechc.loads(STEP).compilation.equations.conserved


@pytest.mark.parametrize("e", [0.3, 0.99, 0.999])
def test_a_ball_rests_after_many_bounces(e: float) -> None:
    rest = (1 + e) / (1 - e) * math.sqrt(2 / 9.81)
    solution = run(BALL + "contact floor: h restitution e;\n", stop=rest + 1, set={"e": e})
    assert times(solution, "rest") == pytest.approx([rest], rel=1e-11)


def test_a_rocking_block_turns_from_corner_to_corner() -> None:
    """Each hit keeps 1 - 3/2 sin(alpha)^2 of the turning rate (G. W. Housner 1963), tan(alpha) = b/h."""
    text = """\
parameter b = 0.2 m;
parameter h = 0.8 m;
parameter start = 0.15 rad;
gravity {0, -9.81} m/s^2;
coordinate Angle theta = start;
coordinate Length x = -b + b*cos(start) - h*sin(start);
coordinate Length y = b*sin(start) + h*cos(start);
frame block = world * trans({x, y}) * rot(theta);
mass 1 kg at block;
inertia (1 kg)*(b^2 + h^2)/3 on block;
point left = block * {-b, -h};
point right = block * {b, -h};
contact on_left: left[2] friction 10 along vel(left)[1];
contact on_right: right[2] friction 10 along vel(right)[1];
"""
    solution = run(text, stop=5)
    impacts = [e for e in solution.events if e.kind == "impact"]
    assert [e.name for e in impacts[:6]] == ["on_right", "on_left"] * 3
    kept = 1 - 1.5 * 0.2**2 / (0.2**2 + 0.8**2)
    for event in impacts:
        assert event.after["der(theta)"] / event.before["der(theta)"] == pytest.approx(kept, rel=1e-8)
    assert closes(solution, 1e-7)


def test_a_lift_off_is_one_event() -> None:
    """Closed contacts stay on their surfaces, so that the drift of a step is not an impact."""
    text = """\
gravity {0, -9.81} m/s^2;
coordinate Angle theta = 30 deg;
coordinate Length x = (1 m)*sin(30 deg);
coordinate Length y = (1 m)*cos(30 deg);
frame rod = world * trans({x, y}) * rot(theta);
mass 10 kg at rod;
inertia (10 kg)*(2 m)^2/12 on rod;
point top = rod * {0, 1 m};
point foot = rod * {0, -1 m};
contact floor: foot[2];
contact wall: top[1];
"""
    for tolerance in (1e-6, 1e-8):
        solution = run(text, stop=0.6, tolerance=tolerance)
        assert [(e.kind, e.name) for e in solution.events] == [("lift-off", "wall")]


def test_a_plate_rocks_itself_to_rest() -> None:
    """Hits of one edge lift the other; the sequence ends where the edges rise no more than rounding."""
    text = """\
gravity {0, -9.81} m/s^2;
coordinate Angle theta = 0.1 rad;
coordinate Length x = 0 m;
coordinate Length y = 0.3*cos(0.1 rad)*(1 m) + 0.4*sin(0.1 rad)*(1 m);
frame plate = world * trans({x, y}) * rot(theta);
mass 1 kg at plate;
inertia 0.1 kg.m^2 on plate;
point left = plate * {-0.4, -0.3} m;
point right = plate * {0.4, -0.3} m;
contact on_left: left[2] friction 0.7 along vel(left)[1];
contact on_right: right[2] friction 0.7 along vel(right)[1];
output angle = theta;
"""
    solution = run(text, stop=2)
    assert solution.outcome is Outcome.COMPLETED
    assert abs(solution["angle"][-1]) < 1e-12
    assert len(times(solution, "impact")) < 60
    assert closes(solution, 1e-7)


@pytest.mark.parametrize(
    ("statement", "words"),
    [
        ("contact floor: h restitution wrong;", "the restitution of 'floor' is 1.5"),
        ("contact floor: h friction -wrong along der(h);", "negative coefficient"),
        ("friction (1 - wrong)*(9 N) on h;", "-4.5"),
        ("friction (0.5 N)*h/(1 m) on h;", "negative coefficient or limit"),
    ],
)
def test_coefficients_that_parameters_put_out_of_range_are_told(statement: str, words: str) -> None:
    solution = run(BALL + "parameter wrong = 1.5;\n" + statement + "\n", stop=2)
    assert solution.outcome is Outcome.FAILED
    assert words in solution.message


@pytest.mark.parametrize("tolerance", [1.2e-7, 3e-8, 1e-11, 1e-14])
def test_the_end_of_rocking_does_not_depend_on_rounding(tolerance: float) -> None:
    """With rebounds as low as rounding, one of these found impacts of noise at one instant for ever."""
    text = """\
parameter b = 0.2 m;
parameter h = 0.8 m;
gravity {0, -9.81} m/s^2;
coordinate Angle theta = 0.02 rad;
coordinate Length x = -b + b*cos(0.02 rad) - h*sin(0.02 rad);
coordinate Length y = b*sin(0.02 rad) + h*cos(0.02 rad);
frame block = world * trans({x, y}) * rot(theta);
mass 1 kg at block;
inertia (1 kg)*(b^2 + h^2)/3 on block;
point left = block * {-b, -h};
point right = block * {b, -h};
contact on_left: left[2] friction 10 along vel(left)[1];
contact on_right: right[2] friction 10 along vel(right)[1];
"""
    solution = run(text, stop=8, tolerance=tolerance)
    assert solution.outcome is Outcome.COMPLETED, solution.message
    assert abs(solution["theta"][-1]) < 1e-11


def test_more_rows_than_a_run_decides_over_are_told() -> None:
    masses = (
        "".join(
            f"coordinate Length x{i} = 1 m;\nmass 1 kg at world*{{x{i}, 0}} m;\nfriction 1 N on x{i};\n"
            for i in range(65)
        )
        .replace("} m;", "};")
        .replace(", 0}", ", 0 m}")
    )
    with pytest.raises(mechc.CompileError, match=r"65 rows .* that switch, more than 64") as caught:
        mechc.loads(masses)
    assert [d.code for d in caught.value.diagnostics] == ["E0720"]


@pytest.mark.parametrize("restitution", [0.0, 0.5])
def test_a_rest_shows_the_state_at_rest(restitution: float) -> None:
    """The last impact has its own: a rest that repeats its speed is none."""
    solution = mechc.loads(
        "coordinate Length h = 1 m; kinetic 1/2*(1 kg)*der(h)^2; potential (9.81 N)*h; "
        f"contact floor: h restitution {restitution};"
    ).simulate(stop=3, estimate_error=False)
    *_, impact, rest = solution.events
    assert (impact.kind, rest.kind) == ("impact", "rest")
    assert impact.before["der(h)"] < 0 == impact.after["der(h)"]
    assert rest.before == rest.after
    assert rest.after["der(h)"] == 0 and abs(rest.after.get("h", 0.0)) < 1e-15
