"""Models as people compose them: names of names, parts with a root and a tip, connections by value, all in loops."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import pytest
from composed_loops import composed_loop, forces_at_rest, unbalanced
from scipy.integrate import solve_ivp

import mechc

PARTS = """
model Strut "two bodies and a slider between them that holds its length"
  frame from;
  frame to;
  Body barrel(m = 1 kg, J = 0.1 kg.m^2);
  Body rod(m = 1 kg, J = 0.1 kg.m^2);
  Revolute foot(from -> barrel.a, angle ~ 90 deg);
  Prismatic slide(barrel.a -> rod.a, position ~ 1 m);
  Revolute eye(rod.a -> to);
  drive slide.position = 1 m;
end Strut;

model Arm
  Bar bar(m = 10 kg, l = 2 m);
  frame root = bar.a;
  frame middle = bar.c;
  frame places[2] = {bar.b, bar.c};
end Arm;

model Whole
  Arm arm;
  frame base = arm.root;
  frame grip = arm.middle;
end Whole;
"""

SITE = """
  gravity {0, -9.81} m/s^2;
  Whole p;
  Revolute A(world -> p.base);
  frame near = p.grip;
  frame far = near;
  frame farther = far;
  frame ground = world * trans({1, -1} m);
"""


def solved(text: str) -> mechc.Solution:
    solution = mechc.loads(text).simulate(estimate_error=False)
    assert isinstance(solution, mechc.Solution)
    assert solution.outcome.value == "completed", solution.message
    return solution


def propped(statements: str) -> str:
    return f"import mech.planar.*; {PARTS} model Propped {SITE} {statements} experiment(stop = 1 s); end Propped;"


@pytest.mark.parametrize(
    "end", ["p.arm.bar.c", "p.arm.places[2]", "p.arm.middle", "p.grip", "near", "farther"]
)
def test_a_prop_carries_a_bar_whatever_its_end_is_called(end: str) -> None:
    """A bar on a hinge, propped under its middle: all its weight is on the prop."""
    solution = solved(
        propped(f"Strut s(from = ground, to = {end}); output e = reaction(s.eye); output h = reaction(A);")
    )
    assert [solution["e[1]"][-1], solution["e[2]"][-1]] == pytest.approx([0, 98.1], abs=1e-12)
    assert [solution["h[1]"][-1], solution["h[2]"][-1]] == pytest.approx([0, 0], abs=1e-12)


def test_friction_follows_the_force_in_a_joint_that_leads_to_a_name_of_a_name() -> None:
    """The prop's bearing force N brakes a wheel: w = w0 - r N t/J. Of one run, and of several at once."""
    model = mechc.loads(
        propped(
            "Strut s(ground -> farther); Body wheel(m = 1 kg, J = 0.2 kg.m^2); Revolute axle(world -> wheel.a, der(angle) = 10 rad/s); "
            "parameter r = 4 mm; friction brake: r*norm(reaction(s.eye)) on axle.angle; output w = der(axle.angle);"
        )
    )
    solution = model.simulate(estimate_error=False)
    assert isinstance(solution, mechc.Solution)
    assert solution["w"][-1] == pytest.approx(10 - 4e-3 * 98.1 / 0.2, rel=1e-9)
    runs = model.ensemble({"r": [0.0, 0.004, 0.01]}, "final(w)", errors="none")
    assert runs["final(w)"] == pytest.approx(10 - np.array([0.0, 0.004, 0.01]) * 98.1 / 0.2, rel=1e-9)


@pytest.mark.parametrize(
    ("size", "seed"),
    [
        *((2, seed) for seed in range(4)),
        (3, 3),
        *(pytest.param(2, seed, marks=pytest.mark.slow) for seed in range(4, 60)),
        *(pytest.param(3, seed, marks=pytest.mark.slow) for seed in range(6, 20)),
    ],
)
def test_random_loops_obey_newton_and_euler(size: int, seed: int) -> None:
    """Force and moment in each joint, from the laws of all bodies with all forces as unknowns.

    Systems whose condition is below 1e4 lose less than four of sixteen digits.
    """
    loop = composed_loop(seed, size)
    expected, condition = forces_at_rest(loop)
    assert condition < 1e4
    solution = solved(loop.text)
    for j, wrench in enumerate(expected):
        force = [solution[f"F{j}[{k + 1}]"][0] for k in range(size)]
        moment = [solution[f"M{j}"][0]] if size == 2 else [solution[f"M{j}[{k + 1}]"][0] for k in range(3)]
        wanted = np.hstack([wrench[:size], wrench[5:] if size == 2 else wrench[3:]])
        assert np.hstack([force, moment]) == pytest.approx(wanted, rel=1e-10, abs=1e-10), f"joint {j}"


@pytest.mark.parametrize(
    ("size", "seed"),
    [
        *((2, seed) for seed in (0, 1)),
        *(pytest.param(2, seed, marks=pytest.mark.slow) for seed in (3, *range(5, 20))),
        *(pytest.param(3, seed, marks=pytest.mark.slow) for seed in range(10)),
    ],
)
def test_random_loops_in_motion_are_balanced(size: int, seed: int) -> None:
    """Of each body at all times: mass times acceleration, and the rate of its spin, are the forces in its joints and its
    weight. What is left is rounding, of loops that come near dead centres some thousand times that of one operation."""
    loop = composed_loop(seed, size, stop=0.2)
    assert unbalanced(loop, solved(loop.text)) < 1e-11


# ---------------------------------------------------------------- connections by value


def test_a_connection_by_value_holds_in_a_loop() -> None:
    """Two bars, connected into one, between two hinges: nothing moves, each hinge carries half the weight."""
    solution = solved(
        "import mech.planar.*; model Held gravity {0, -9.81} m/s^2; Bar p(m = 1 kg, l = 0.5 m); "
        "Bar q(m = 1 kg, l = 0.5 m, a = p.b); Revolute hp(world -> p.a); Revolute hq(world * trans({1, 0} m) -> q.b); "
        "output gap = pos(q.a) - pos(p.b); output f = reaction(hp)[2]; output g = reaction(hq)[2]; experiment(stop = 1 s); end Held;"
    )
    assert [solution["gap[1]"][-1], solution["gap[2]"][-1]] == pytest.approx([0, 0], abs=1e-12)
    assert [solution["f"][-1], solution["g"][-1]] == pytest.approx([9.81, 9.81], rel=1e-9)


def test_a_part_with_its_own_root_stands_in_a_loop() -> None:
    """Two bars that lean on each other: the force at the top from the moments about both feet."""
    solution = solved(
        "import mech.planar.*; model Trestle gravity {0, -9.81} m/s^2; frame root; Bar bar(m = 10 kg, l = 2 m, a = root); "
        "Revolute A(world -> root, angle ~ 30 deg); Bar c(m = 1 kg, l = 2 m); Revolute K(world * trans({2 m, 0 m}) -> c.a, angle ~ 150 deg); "
        "Revolute t(bar.b -> c.b); output f = reaction(A); experiment(stop = 1 s); end Trestle;"
    )
    g, top, other = 9.81, np.array([1, 3**0.5]), np.array([-1, 3**0.5])
    # of the bar: top x F = 10 g/2; of the other one, on which -F acts: other x -F = -1 g/2
    F = np.linalg.solve([[-top[1], top[0]], [other[1], -other[0]]], [10 * g / 2, -g / 2])
    assert [solution["f[1]"][-1], solution["f[2]"][-1]] == pytest.approx([-F[0], 10 * g - F[1]], rel=1e-10)


CONNECTED = (
    "import mech.{space}.*; model Ring gravity {{{down}}} m/s^2; Bar p(m = 1 kg, l = 1 m, a = q.b * {turn}(180 deg)); "
    "Bar q(m = 1 kg, l = 1 m, a = p.b * {turn}({angle})); Revolute h(world -> p.a{axis}, angle = 10 deg); "
    "experiment(stop = 1 s, tolerance = 1e-10); end Ring;"
)
SPACES = {
    "planar": {"space": "planar", "down": "0, -9.81", "turn": "rot", "axis": ""},
    "spatial": {"space": "spatial", "down": "0, -9.81, 0", "turn": "rotz", "axis": ", axis = {0, 0, 1}"},
}


@pytest.mark.parametrize("space", SPACES)
def test_connections_that_form_a_loop_among_themselves(space: str) -> None:
    """Two bars, each connected to the other's end: what fits repeats itself, what does not is refused."""
    model = mechc.loads(CONNECTED.format(**SPACES[space], angle="180 deg"))
    assert [d.code for d in model.diagnostics] == ["W0513"]
    swing = model.simulate(estimate_error=False)
    # p and q lie on each other: m l^2/12 + m l^2/4 each, so l_eff = 2/3 m
    assert isinstance(swing, mechc.Solution)
    w2 = 2 * 9.81 / (2 / 3) * (np.sin(np.radians(10)) - np.sin(swing["h.angle"]))
    assert swing["der(h.angle)"] ** 2 == pytest.approx(w2, abs=1e-7)
    for angle, words in (("170 deg", "is off by|do not reach"), ("0 deg", "half a turn apart")):
        with pytest.raises(mechc.CompileError, match=words):
            mechc.loads(CONNECTED.format(**SPACES[space], angle=angle)).simulate()


HINGE = "model Hinge frame from; frame to; coordinate Angle angle ~ 0 rad; place to = from * rot(angle); {closure} end Hinge;"


@pytest.mark.parametrize("closure", ["", "closure angle = heading(to) - heading(from);"])
def test_a_joint_that_holds_nothing_in_a_loop_is_refused(closure: str) -> None:
    with pytest.raises(mechc.CompileError, match="does not say what holds there"):
        mechc.loads(
            f"import mech.planar.*; {HINGE.format(closure=closure)} model M gravity {{0, -9.81}} m/s^2; Bar bar; Hinge A(world -> bar.a); "
            "Hinge B(world * trans({1, 0} m) -> bar.b); experiment(stop = 1 s); end M;"
        )


TRAIN = """
model Cart
  input Force f = 0 N;
  coordinate Length x = 0 m;
  kinetic 1/2*1 kg*der(x)^2;
  damping 0.3 N.s/m on x;
  force f on x;
  output Length seen = x;
end Cart;
model Controller
  input Length target;
  input Length measured;
  parameter Ts = 20 ms;
  discrete Force u = 0 N;
  discrete Length last = 0 m;
  when sample(Ts) then
    u := 30 N/m*(target - measured) - 3 N.s/m*(measured - last)/Ts;
    last := measured;
  end when;
end Controller;
model Unit
  input Length target;
  parameter Ts = 20 ms;
  Controller control(target = target, Ts = Ts, measured = cart.seen);
  Cart cart(f = control.u);
  output Length place = cart.seen;
end Unit;
model Train
  structural parameter Integer n = 3;
  Unit unit[i in 1:n](Ts = {20, 30, 50}[i]*1 ms, target = if i == 1 then 1 m else delay(unit[i-1].place, 70 ms));
  experiment(stop = 2 s, tolerance = 1e-10);
end Train;
"""


def test_sampled_carts_follow_the_delayed_place_of_the_one_before() -> None:
    """Each cart between samples: v relaxes to u/c. Samples and delays fall on multiples of 10 ms, between which that is exact."""
    solution = solved(TRAIN)
    step, c = 0.01, 0.3
    fade = np.exp(-c * step)
    x, v, u, last = np.zeros((4, 3))
    past = [x]
    for k in range(201):
        for i, period in enumerate((2, 3, 5)):
            if k % period == 0:
                target = 1.0 if i == 0 else past[max(k - 7, 0)][i - 1]
                u[i], last[i] = 30 * (target - x[i]) - 3 * (x[i] - last[i]) / (period * step), x[i]
        if k < 200:
            rest = u / c
            x, v = x + rest * step + (v - rest) * (1 - fade) / c, rest + (v - rest) * fade
            past.append(x)
    assert [solution[f"unit[{i}].place"][-1] for i in (1, 2, 3)] == pytest.approx(x, rel=1e-12)


CRANES = """
import mech.planar.*;
model Crane "a driven crab from which a bar hangs"
  frame from;
  input Length want = 0 m;
  Particle crab(m = 10 kg);
  Bar load(m = 5 kg, l = 2 m);
  Prismatic rail(from -> crab.a, position ~ 0 m);
  Revolute pivot(crab.a -> load.a, angle ~ -90 deg);
  constraint hold: rail.position = want by force on rail.position;
  output Force F = multiplier(hold);
end Crane;
model Gain
  input Force u;
  parameter k = 1;
  output y = k*u;
end Gain;
model Two
  gravity {0, -9.81} m/s^2;
  Crane c[2](from = {world, world*trans({0, 3} m)*rot(10 deg)},
    want = {0.1 m*time^2/(1 s^2), 0.2 m*sin(time/1 s)}, pivot.angle ~ {-90, -100} deg);
  Gain first(u = c[1].F - 0.5*second.y, k = 2);
  Gain second(u = first.y + c[2].F, k = 0.5);
  output Force signal = first.y;
  experiment(stop = 2 s, tolerance = 1e-10);
end Two;
"""


def crane(want2: Callable[[float], float], slope: float, angle: float) -> float:
    """Return the force along the rail at 2 s, from Lagrange's equation of the bar under the given acceleration of the crab."""
    m, whole, g = 5.0, 15.0, 9.81
    along = np.array([np.cos(slope), np.sin(slope)])

    def rates(t: float, y: Sequence[float]) -> list[float]:
        a = y[0] + slope
        across = np.array([-np.sin(a), np.cos(a)]) @ along
        return [y[1], -(m * g * np.cos(a) + m * across * want2(t)) / (m * 4 / 3)]

    end = solve_ivp(rates, (0, 2), [angle, 0], method="DOP853", rtol=1e-11, atol=1e-12).y[:, -1]
    a = end[0] + slope
    across, out = np.array([-np.sin(a), np.cos(a)]) @ along, np.array([np.cos(a), np.sin(a)]) @ along
    inertial = m * (rates(2.0, end)[1] * across - end[1] ** 2 * out)
    return float(whole * want2(2.0) + inertial + whole * g * np.sin(slope))


def test_servo_forces_of_parts_in_an_array_go_round_a_circle_of_signals() -> None:
    """first = 2 (F1 - second/2), second = (first + F2)/2: first = (2 F1 - F2/2)/1.5."""
    solution = solved(CRANES)
    f1 = crane(lambda t: 0.2, 0.0, np.radians(-90))
    f2 = crane(lambda t: -0.2 * np.sin(t), np.radians(10), np.radians(-100))
    assert [solution["c[1].F"][-1], solution["c[2].F"][-1]] == pytest.approx([f1, f2], abs=1e-7)
    assert solution["signal"][-1] == pytest.approx((2 * f1 - f2 / 2) / 1.5, abs=1e-7)
