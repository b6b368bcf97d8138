"""Mechanical systems that are broken by hand are found, and shown with what surrounds the place."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest
from compiled import compiled
from msgspec.structs import replace

from mechc.compiler.malformed import Malformed
from mechc.compiler.mechanics.kinematics.frames import Frame, Point
from mechc.compiler.mechanics.kinematics.pose import Rotate
from mechc.compiler.mechanics.system import MechanicalSystem
from mechc.compiler.mechanics.verify import verify

TEXT = """
import mech.planar.*;
model Crank
  parameter m = 1 kg;
  gravity {0, -9.81} m/s^2;
  Bar one(m = m, l = 1 m);
  Bar two(m = m, l = 1 m);
  Revolute a(world -> one.a, angle = 60 deg);
  Revolute b(one.b -> two.a, angle = -60 deg);
  Prismatic slide(world -> two.b);
  coordinate z = 0 m;
  kinetic 1/2*m*der(z)^2;
  potential m*9.81 m/s^2*z;
  coordinate turn = 0 rad;
  kinetic 1/2*1 kg.m^2*der(turn)^2;
  drive turn = 2 rad/s*time;
  damping 0.1 N.s/m on z;
  contact floor: z + 1 m restitution 0.5;
  state s = 0;
  equation der(s) = sin(turn)/1 s;
  output height = z;
  output push = reaction(b);
  when s > 0.5 then
    reinit(s, 0);
  end when;
end Crank;
"""


@pytest.fixture(scope="module")
def crank() -> MechanicalSystem:
    return compiled(TEXT).system


def test_systems_as_they_are_made_pass(crank: MechanicalSystem) -> None:
    assert crank.topology.closures and crank.drives and crank.virtual and crank.branches
    verify(crank)


def at(system: MechanicalSystem, collection: str, index: int, **changes: Any) -> MechanicalSystem:
    elements = list(getattr(system, collection))
    elements[index] = replace(elements[index], **changes)
    return replace(system, **{collection: tuple(elements)})


def on_frame(system: MechanicalSystem, frame: Frame) -> MechanicalSystem:
    return at(system, "masses", 0, point=Point(frame, system.masses[0].point.offset))


def circle() -> Frame:
    first = Frame(None, Rotate(2, 0), 1)  # type: ignore[arg-type]
    second = Frame(first, Rotate(2, 0), 2)  # type: ignore[arg-type]
    first.parent = second
    return second


def first_rotation(system: MechanicalSystem) -> MechanicalSystem:
    return replace(system, rotations=((0, 0),))


def alien(system: MechanicalSystem) -> MechanicalSystem:
    graph = system.graph
    return replace(system, potential=graph.add(system.potential, graph.symbol("alien")))


def twice_driven(system: MechanicalSystem) -> MechanicalSystem:
    return replace(system, drives=system.drives * 2)


def tree(system: MechanicalSystem, **changes: Any) -> MechanicalSystem:
    return replace(system, topology=replace(system.topology, **changes))


BREAKS: dict[str, tuple[Callable[[MechanicalSystem], MechanicalSystem], str]] = {
    "q and a": (lambda s: replace(s, a=s.a[:-1]), "system, a: has 3 numbers instead of 4"),
    "qdot": (lambda s: replace(s, qdot=(*s.qdot, s.qdot[0])), "qdot: has 5"),
    "starts": (lambda s: replace(s, start_v=()), "start_v: has 0"),
    "states": (lambda s: replace(s, xdot={}), "xdot: has 0"),
    "rates of others": (lambda s: replace(s, xdot={s.q[0].node: s.q[0].node}), "is not of the states"),
    "symbol twice": (
        lambda s: replace(s, q=(s.q[1], *s.q[1:])),
        "is the symbol of",
    ),
    "symbol of another name": (
        lambda s: at(s, "q", 0, name="other"),
        "is not the symbol of its name",
    ),
    "rotation": (first_rotation, "has the numbers of"),
    "loose frame": (lambda s: on_frame(s, Frame(None, None, 0)), "does not hang on world"),
    "circle of frames": (lambda s: on_frame(s, circle()), "hangs on itself"),
    "depth": (
        lambda s: on_frame(s, Frame(s.kinematics.world, Rotate(2, s.q[0].node), 7)),
        "not a step deeper",
    ),
    "joint lost": (lambda s: tree(s, closures=()), "does not hold each joint once"),
    "root twice": (
        lambda s: tree(s, tree=tuple(replace(edge, root="one.a") for edge in s.topology.tree)),
        "places 'one.a' twice",
    ),
    "unknown symbol": (alien, "potential: depends on the unknown symbol 'alien'"),
    "potential of accelerations": (lambda s: replace(s, potential=s.a[0]), "must not depend on"),
    "kinetic of accelerations": (lambda s: replace(s, kinetic=s.a[0]), "must not depend on"),
    "mass of positions": (lambda s: at(s, "masses", 0, mass=s.q[0].node), r"masses\[0\]: must not depend on"),
    "level": (
        lambda s: at(s, "constraints", 0, residuals=(s.v[0].node,), units=("",)),
        "must not depend on 'der",
    ),
    "units": (lambda s: at(s, "constraints", 0, units=()), "0 units"),
    "drive": (lambda s: at(s, "drives", 0, v=(9,)), "prescribes"),
    "formulas of a drive": (lambda s: at(s, "drives", 0, rates=()), "other numbers of formulas"),
    "driven twice": (twice_driven, "prescribes what another one does"),
    "no such node": (lambda s: replace(s, dissipation=s.graph.constant(1) + 10**7), "is node 10000001 of"),
    "output twice": (lambda s: replace(s, outputs=s.outputs * 2), "is there twice"),
    "origin": (lambda s: at(s, "masses", 0, origin=None), "has no origin"),
    "start of a start": (lambda s: at(s, "start_q", 0, value=s.q[1].node), r"start_q\[0\]: must not depend on"),
}  # fmt: skip


@pytest.mark.parametrize("name", BREAKS)
def test_broken_systems_are_found(crank: MechanicalSystem, name: str) -> None:
    spoil, message = BREAKS[name]
    with pytest.raises(Malformed, match=message):
        verify(spoil(crank))


def test_a_message_shows_the_way_to_a_symbol() -> None:
    system = alien(compiled("coordinate x = 1 m; kinetic 1/2*2 kg*der(x)^2; potential 3 N*x;").system)
    graph = system.graph
    top, symbol = system.potential, graph.symbol("alien")
    with pytest.raises(Malformed) as caught:
        verify(system)
    left, right = graph.args(top)
    assert str(caught.value) == (
        "system, potential: depends on the unknown symbol 'alien'\n"
        f"    %{top} = add %{left} %{right}\n"
        f"    %{symbol} = symbol alien"
    )
