"""Prescribed motions made of pieces: what is smooth enough runs, a rate that jumps is refused or is an impulse."""

from __future__ import annotations

import numpy as np
import pytest

import mechc

CARRIED = """
parameter T = 1 s;
parameter v = 1 m/s;
coordinate Length x%s;
coordinate Length y = 0 m "in x";
kinetic 1/2*1 kg*(der(x) + der(y))^2;
%s
experiment(stop = 2 s);
"""

JUMPS = [
    "if time < T then 0 m else v*(time - T)",
    "max(0 m, v*(time - T))",
    "v*abs(time - T)",
    "v*T*floor(time/T)",
    "v*mod(time, T)",
    "v*T*sign(time - T)",
    "v*clamp(time, T/2, T)",
    "v*T*max(0, sin(2*pi*time/T))",
]

SMOOTH = [
    "if time < T then 0 m else v/T*(time - T)^2",
    "v*T*(1 - cos(2*pi*mod(time, T)/T))",
    "v*T*max(0, sin(2*pi*time/T))^2",
    "v/T*max(0 s, time - T)^2",
    "v*table(time, {0, 1, 2} s, {0, 1, 1} s)",
]


@pytest.mark.parametrize("motion", JUMPS)
def test_a_drive_that_jumps_is_refused(motion: str) -> None:
    with pytest.raises(mechc.CompileError, match="E0532"):
        mechc.loads(CARRIED % ("", f"drive x = {motion};"))


LINEAR = 'v*table(time, {0, 1, 2} s, {0, 0, 1} s, "linear")'
FRAMES = {
    "a particle": "import mech.planar.*;\nframe f = world * trans({%s, 0 m}); Particle p(m = 1 kg); Prismatic s(f -> p.a);",
    "a bar on a frame of a frame": "import mech.planar.*;\nframe f = world * trans({0 m, %s}); frame g = f; frame h = g * rot(0.3 rad);"
    " Bar b(m = 1 kg, l = 1 m); Revolute s(h -> b.a);",
    "a turn in space": "import mech.spatial.*;\nframe f = world * rotx((%s)/(1 m)); Body b(m = 1 kg, J = identity(3) kg.m^2); Spherical s(f -> b.a);",
    "an array": "import mech.planar.*;\nframe f[2] = {world * trans({%s, i*1 m}) for i in 1:2}; Particle p[2](m = 1 kg);"
    " Prismatic s[2](f -> p.a);",
}


@pytest.mark.parametrize("scene", FRAMES)
@pytest.mark.parametrize("motion", [*JUMPS[:3], LINEAR])
def test_a_frame_with_mass_whose_rate_jumps_is_refused(scene: str, motion: str) -> None:
    """The masses would keep their momentum; they went on with the frame, without a word."""
    text = FRAMES[scene] % motion
    head = text.replace(";\n", ";\nparameter T = 1 s; parameter v = 1 m/s;\n", 1)
    with pytest.raises(mechc.CompileError, match="the rate of a frame that carries a mass jumps"):
        mechc.loads(head)


@pytest.mark.parametrize("motion", [SMOOTH[0], SMOOTH[3], SMOOTH[4]])
def test_a_particle_on_a_smooth_frame_stays(motion: str) -> None:
    """No force acts along the slide, so that the particle keeps its speed in the world."""
    text = FRAMES["a particle"].replace(";\n", ";\nparameter T = 1 s; parameter v = 1 m/s;\n", 1) % motion
    s = mechc.loads(text + "output speed = vel(p.a)[1]; experiment(stop = 2 s);").simulate(tolerance=1e-9)
    assert s["speed"] == pytest.approx(s["speed"][0], abs=1e-6)


def test_a_momentum_that_jumps_with_time_is_refused() -> None:
    with pytest.raises(mechc.CompileError, match=r"E0715.*kinetic energy must not jump(?s:.*)time = 0\.5 s"):
        mechc.loads("coordinate Length x = 0 m; kinetic 1/2*1 kg*der(x + max(0 m, 2 m/s*(time - 0.5 s)))^2;")


def test_a_rate_that_is_driven_may_bend_but_not_jump() -> None:
    mechc.loads(CARRIED % (" = 0 m", "drive der(x) = v*clamp(time/T, 0, 1);"))
    with pytest.raises(mechc.CompileError, match="rate that is prescribed for 'x' jumps"):
        mechc.loads(CARRIED % (" = 0 m", "drive der(x) = if time < T then 0 m/s else v;"))


@pytest.mark.parametrize("motion", SMOOTH)
def test_a_free_body_on_a_carriage_goes_on_as_it_did(motion: str) -> None:
    """No force acts on it, so x + y keeps the speed with which x began."""
    solution = mechc.loads(CARRIED % ("", f"drive x = {motion};")).simulate(tolerance=1e-9)
    start = solution["der(x)"][0]
    assert solution["x"][-1] + solution["y"][-1] == pytest.approx(solution["x"][0] + start * 2, abs=1e-6)
    assert solution["der(x)"][-1] + solution["der(y)"][-1] == pytest.approx(start, abs=1e-6)


@pytest.mark.parametrize(
    "hand", [*(f"x = {motion}" for motion in JUMPS[:3]), "der(x) = if time < T then 0 m/s else v"]
)
def test_a_constraint_whose_rate_jumps_is_an_impulse(hand: str) -> None:
    """A second body under the hand takes the impulse, and what holds them the energy."""
    text = CARRIED % (" ~ 0 m", f"constraint hand: {hand}; kinetic 1/2*1 kg*der(x)^2;")
    solution = mechc.loads(text).simulate()
    start = solution["der(x)"][0] + solution["der(y)"][0]
    assert solution["x"][-1] == pytest.approx(1, abs=1e-12)
    assert solution["x"][-1] + solution["y"][-1] == pytest.approx(solution["x"][0] + 2 * start, abs=1e-12)
    balance = solution["energy.total"] - solution["energy.supplied"]
    assert balance == pytest.approx(np.full(len(balance), balance[0]), abs=1e-12)


@pytest.mark.parametrize("place", ["if time < T then 0 m else v*T", "v*mod(time, T)", "v*T*sign(time - T)"])
def test_a_constraint_does_not_ask_for_another_place_at_once(place: str) -> None:
    with pytest.raises(mechc.CompileError, match="the position that 'hand' asks for jumps"):
        mechc.loads(CARRIED % (" ~ 0 m", f"constraint hand: x = {place};"))


@pytest.mark.parametrize(("begin", "end"), [(5.1, 5.15), (7.3, 7.36), (51, 51.1), (0.511, 0.513)])
def test_a_short_push_that_begins_and_ends_smoothly_does_not_jump(begin: float, end: float) -> None:
    """However few of the times at which is looked lie within."""
    push = f"1 m*sin(pi*(time/(1 s) - {begin})/{end - begin:.6g})^2"
    drive = f"drive x = if time > {begin} s and time < {end} s then {push} else 0 m;"
    assert mechc.loads(CARRIED % ("", drive))
    with pytest.raises(mechc.CompileError, match="the position that is prescribed for 'x' jumps"):
        mechc.loads(CARRIED % ("", drive.replace("sin", "cos")))
