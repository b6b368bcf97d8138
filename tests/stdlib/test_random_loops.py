"""Random closed loops of the library's joints: it must not matter which of the joints is cut."""

from __future__ import annotations

import random

import numpy as np
import pytest

import mechc

FREEDOMS = {
    2: {"Revolute": 1, "Prismatic": 1, "PinSlot": 2},
    3: {"Revolute": 1, "Cylindrical": 2, "Screw": 1, "Universal": 2, "Spherical": 3},
}
AXES = {"Prismatic": 1, "PinSlot": 1, "Cylindrical": 1, "Screw": 1, "Universal": 2}


def vector(numbers: random.Random, size: int, scale: float = 1.0) -> str:
    return "{" + ", ".join(f"{numbers.uniform(-scale, scale):.3f}" for _ in range(size)) + "}"


def joint(numbers: random.Random, size: int, kind: str) -> str:
    """The settings of a joint, for its axes are random, too."""
    if kind == "Universal":
        return f", first = {vector(numbers, 3)}, second = {vector(numbers, 3)}"
    if kind in AXES or (size == 3 and kind == "Revolute"):
        return f", axis = {vector(numbers, size)}" + (", pitch = 0.7 m" if kind == "Screw" else "")
    return ""


def loop(seed: int, size: int, bodies: int = 3) -> tuple[str, list[tuple[str, str, str]]]:
    """The bodies of a loop, and its joints as (kind, ends and settings, name). It is closed where all joints are at
    zero; it has a freedom at least."""
    numbers = random.Random(seed)
    closing = 3 if size == 2 else 6
    kinds: list[str] = []
    while sum(FREEDOMS[size][k] for k in kinds) <= closing:
        kinds = [numbers.choice(list(FREEDOMS[size])) for _ in range(bodies + 1)]
    if size == 3:
        kinds[-1] = "Spherical"
    text = f"import mech.{'planar' if size == 2 else 'spatial'}.*;\n"
    text += f"gravity {vector(numbers, size, 9)} m/s^2;\n"
    joints = []
    from_side = closed = "world"
    for i, kind in enumerate(kinds):
        settings = joint(numbers, size, kind)
        target = f"b{i}.a" if i < bodies else closed
        joints.append((kind, f"({from_side} -> {target}{settings})", f"j{i}"))
        if i < bodies:
            inertia = "0.2 kg.m^2" if size == 2 else "diag({0.3, 0.4, 0.5} kg.m^2)"
            mass = numbers.uniform(0.5, 3)
            text += f"Body b{i}(m = {mass:.2f} kg, J = {inertia}, com = {vector(numbers, size, 0.3)} m);\n"
            turn = f"{numbers.uniform(-2, 2):.2f} rad"
            pose = f"trans({vector(numbers, size, 0.8)} m)*{'rot' if size == 2 else 'rotx'}({turn})"
            from_side, closed = f"b{i}.a * {pose}", f"{closed} * {pose}"
    return text, joints


def run(text: str, joints: list[tuple[str, str, str]], cut: int) -> dict[str, list[float]]:
    """Places of the mass centres and all reactions, with one of the joints cut."""
    for i, (kind, ends, name) in enumerate(joints):
        text += f"{'cut ' if i == cut else ''}{kind} {name}{ends};\n"
        text += f"output F{i} = reaction({name});\noutput M{i} = moment({name});\n"
    for i in range(len(joints) - 1):
        text += f"output p{i} = pos(b{i}.a * trans(b{i}.com));\n"
    solution = mechc.loads(text).simulate(stop=0.2, tolerance=1e-11, estimate_error=False)
    assert isinstance(solution, mechc.Solution)
    assert solution.outcome.value == "completed", solution.message
    return {n: solution[n][::100].tolist() for n in solution if n[0] in "FMp" and n[1].isdigit()}


@pytest.mark.parametrize(
    ("size", "seed"),
    [(2, 1), (2, 2), (2, 3), *(pytest.param(3, k, marks=pytest.mark.slow) for k in range(1, 10))],
)
def test_any_joint_may_be_cut(size: int, seed: int) -> None:
    """Tree edges, closures, edges walked backwards and places on bodies: one motion, the same reactions."""
    text, joints = loop(seed, size)
    first = run(text, joints, 0)
    assert max(np.ptp(values) for name, values in first.items() if name[0] == "p") > 1e-3
    for cut in range(1, len(joints)):
        other = run(text, joints, cut)
        for name, values in first.items():
            scale = 1 + np.max(np.abs(values))
            assert other[name] == pytest.approx(values, abs=1e-6 * scale), (cut, name)


LONG_LOOP = """
import mech.spatial.*;
gravity {0.3,1,-9.81} m/s^2;
Body b0(m = 1.52 kg, J = diag({0.4, 0.4, 0.7} kg.m^2), com = {0.282, -0.043, 0.211} m);
Revolute j0(world -> b0.a, axis = {-0.149, 0.491, 0.656});
Body b1(m = 1.73 kg, J = diag({0.3, 0.4, 0.4} kg.m^2), com = {-0.277, -0.144, -0.194} m);
Universal j1(b0.a * trans({0.251, 0.036, 0.405} m)*rotx(-0.21 rad)*rotz(1.50 rad) -> b1.a, first = {-0.750, -0.745, -0.559}, second = {0.582, -0.604, 0.967});
Body b2(m = 1.80 kg, J = diag({0.5, 0.5, 0.7} kg.m^2), com = {-0.205, 0.033, -0.091} m);
Screw j2(b1.a * trans({-0.412, -0.241, -0.708} m)*rotx(-1.22 rad)*rotz(-0.46 rad) -> b2.a, axis = {0.140, -0.362, -0.424}, pitch = 0.3 m);
Body b3(m = 1.90 kg, J = diag({0.6, 0.4, 0.7} kg.m^2), com = {-0.267, -0.291, -0.092} m);
Spherical j3(b2.a * trans({-0.001, 0.338, 0.785} m)*rotx(0.60 rad)*rotz(1.55 rad) -> b3.a);
Body b4(m = 0.59 kg, J = diag({0.5, 0.6, 0.7} kg.m^2), com = {-0.154, 0.090, 0.210} m);
Spherical j4(b3.a * trans({-0.488, 0.290, 0.468} m)*rotx(-1.18 rad)*rotz(-0.13 rad) -> b4.a);
cut Planar c(b4.a * trans({0.770, 0.152, 0.227} m)*rotx(1.59 rad)*rotz(-0.43 rad) -> world*trans({0.111, -0.497, 0.923} m));
"""


@pytest.mark.slow
def test_long_loop_whose_definitions_lose_their_order() -> None:
    """Unknowns that exchange rows leave definitions that depend on younger ones; sweeps may meet one of them twice."""
    solution = mechc.loads(LONG_LOOP).simulate(stop=0.2, tolerance=1e-9, estimate_error=False)
    assert isinstance(solution, mechc.Solution) and solution.outcome.value == "completed"
    balance = solution.accuracy.energy
    assert balance is not None and balance.relative is not None and balance.relative < 1e-7
