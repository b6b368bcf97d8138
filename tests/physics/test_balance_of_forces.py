"""Newton's and Euler's laws of each body, checked in every run: planted faults are told, and what is right is not."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest
from composed_loops import composed_loop
from msgspec.structs import replace

import mechc
from mechc.compiler.equations.model import BALANCE
from mechc.compiler.equations.rows import residual
from mechc.compiler.equations.solve import queries, solved
from mechc.compiler.mechanics import build, closures, forces
from mechc.compiler.mechanics.kinematics import planar, spatial, topology
from mechc.compiler.mechanics.kinematics.frames import Point
from mechc.compiler.mechanics.matter import Matter
from mechc.compiler.targets.alone import standing_alone

PROPPED = """
import mech.planar.*;
model Strut
  frame from; frame to;
  Body barrel(m = 1 kg, J = 0.1 kg.m^2);
  Body rod(m = 1 kg, J = 0.1 kg.m^2);
  Revolute foot(from -> barrel.a, angle ~ 90 deg);
  Prismatic slide(barrel.a -> rod.a, position ~ 1 m);
  Revolute eye(rod.a -> to);
  drive slide.position = 1 m;
end Strut;
model Propped
  gravity {0, -9.81} m/s^2;
  Bar bar(m = 10 kg, l = 2 m);
  Revolute A(world -> bar.a);
  frame near = bar.c; frame far = near;
  Strut s(world * trans({1, -1} m) -> far);
  output e = reaction(s.eye);
  experiment(stop = 0.1 s);
end Propped;
"""
HELD = """
import mech.planar.*;
model Held
  gravity {0, -9.81} m/s^2;
  Bar p(m = 1 kg, l = 0.5 m);
  Bar q(m = 1 kg, l = 0.5 m, a = p.b);
  Revolute hp(world -> p.a);
  Revolute hq(world * trans({1, 0} m) -> q.b);
  experiment(stop = 1 s);
end Held;
"""
PLANE = """
import mech.planar.*;
model Plane
  gravity {0, -9.81} m/s^2;
  Bar a(m = 2 kg, l = 1 m);
  Body b(m = 1 kg, J = 0.2 kg.m^2, com = {0.4, 0.1} m);
  Revolute A(world -> a.a, angle = 30 deg, der(angle) = 2 rad/s);
  Revolute B(a.b -> b.a, angle = 20 deg, der(angle) = 3 rad/s);
  Bar c(m = 3 kg, l = 1 m);
  Revolute C(world * trans({1, 1} m) -> c.a, angle ~ 70 deg);
  constraint rod: norm(pos(c.b) - pos(a.b)) = 1.2 m;
  Spring s(a.c * trans({0, 0.2} m) -> b.a * trans({1, 0} m), k = 20 N/m, rest = 0.3 m);
  Damper d(world -> b.a * trans({0.5, 0} m), c = 2 N.s/m);
  coordinate Length x = 0.1 m;
  frame f = b.a * rot(x/(1 m) + 0.4 rad/s*time);
  mass 0.4 kg at f * {x, 0.2 m};
  potential 1/2*30 N/m*x^2;
  force {3, 4} N on b.a * {0.3, 0.1} m from a.b;
  force {1, 2} N on b.a at world * {0.3, 0.1} m;
  torque 2 N.m on b.a from a.a;
  damping 0.3 N.m.s on B.angle;
  output g = reaction(B);
  experiment(stop = 0.1 s);
end Plane;
"""
SPACE = """
import mech.spatial.*;
model Space
  gravity {0, 0, -9.81} m/s^2;
  Body a(m = 2 kg, J = diag({1, 2, 2.5} * 1 kg.m^2), com = {0.1, 0.2, 0.3} m);
  Body b(m = 1 kg, J = diag({0.1, 0.2, 0.25} * 1 kg.m^2), com = {0.3, 0, 0.1} m);
  Spherical A(world -> a.a, der(orientation) = {1, 2, 3} rad/s);
  Prismatic B(a.a * trans({1, 0, 0.2} m) * rotx(0.4 rad) -> b.a, axis = {0, 1, 1}, der(position) = 2 m/s);
  Spring s(world * trans({0, 0, 1} m) -> b.a * trans({0.1, 0.2, 0} m), k = 20 N/m, rest = 0.3 m);
  force 5 N on B.position;
  torque {1, 2, 3} N.m on b.a from a.a in a.a;
  force {1, 2, 3} N on b.a * {0.1, 0.2, 0.3} m in b.a;
  output f = reaction(A);
  output m = moment(B);
  experiment(stop = 0.1 s);
end Space;
"""
RUBBED = """
import mech.planar.*;
model Rubbed
  gravity {0, -9.81} m/s^2;
  Body cart(m = 2 kg, J = 1 kg.m^2);
  Prismatic rail(world -> cart.a, der(position) = 2 m/s);
  friction rub: 0.1*norm(reaction(rail)) on rail.position;
  Body ball(m = 1 kg, J = 0.1 kg.m^2);
  Free fall(world -> ball.a, y = 0.01 m, der(x) = 1 m/s, der(angle) = 2 rad/s);
  contact floor: pos(ball.a)[2] friction 0.3 along vel(ball.a)[1] + 0.2 m*angvel(ball.a);
  experiment(stop = 0.2 s);
end Rubbed;
"""
MASSLESS = """
import mech.planar.*;
model Massless
  gravity {0, -9.81} m/s^2;
  Bar rod(m = 0 kg, l = 0.3 m);
  Body crank(m = 0 kg, J = 0.02 kg.m^2);
  Particle slider(m = 2 kg);
  Revolute main(world -> crank.a, angle = 0.3 rad, der(angle) = 10 rad/s);
  Revolute pin(crank.a * trans({0.1, 0} m) -> rod.a, angle ~ -0.4 rad);
  Prismatic guide(world -> slider.a, position ~ 0.39 m);
  Revolute wrist(rod.b -> slider.a);
  output f = reaction(wrist);
  experiment(stop = 0.1 s);
end Massless;
"""
UNLOADED = """
import mech.planar.*;
model Unloaded "nothing acts, so that all that is left is rounding"
  Body plate(m = 2 kg, J = 0.3 kg.m^2, com = {0.2, 0.1} m);
  Free free(world -> plate.a, der(x) = 1 m/s, der(angle) = 3 rad/s);
  output f = reaction(free);
  experiment(stop = 1 s);
end Unloaded;
"""
LOOP = composed_loop(5, 2, stop=0.05).text
MODELS = {
    "propped": PROPPED,
    "held": HELD,
    "plane": PLANE,
    "space": SPACE,
    "rubbed": RUBBED,
    "massless": MASSLESS,
    "unloaded": UNLOADED,
    "loop": LOOP,
}

Patch = Callable[[pytest.MonkeyPatch], None]


def told(text: str) -> set[tuple[str, str]]:
    solution = mechc.loads(text).simulate(estimate_error=False)
    assert isinstance(solution, mechc.Solution)
    found = {(c.kind, c.name) for c in solution.accuracy.contradictions}
    assert solution.outcome.value == ("doubtful" if found else "completed"), solution.message
    return found


@pytest.mark.parametrize("name", MODELS)
def test_what_is_right_is_not_told(name: str) -> None:
    assert told(MODELS[name]) == set()


def test_nothing_is_formed_that_nobody_asks_for() -> None:
    """A tree of joints without reactions holds no check, and what stands alone never does."""
    text = SPACE.replace("output f = reaction(A);", "").replace("output m = moment(B);", "")
    assert not mechc.loads(text).compilation.equations.balance
    looped = mechc.loads(LOOP).compilation.program
    assert BALANCE in {f.name for f in looped.functions}
    assert BALANCE not in {f.name for f in standing_alone(looped).functions}


# ---------------------------------------------------------------- planted faults


def _instead(module: object, name: str, made: Callable[[Any], Any]) -> Patch:
    """Return what exchanges a function for one that is made of it."""

    def plant(patch: pytest.MonkeyPatch) -> None:
        patch.setattr(module, name, made(getattr(module, name)))

    return plant


def _no_name_of_a_name(patch: pytest.MonkeyPatch) -> None:
    """Displace at a closing joint the frame that is meant, and not the joint's own name of it."""
    original = closures.closure_rows

    def rows(lowering: Any, model: Any, found: Any, *rest: Any) -> Any:
        joints = tuple(replace(joint, to=joint.target) for joint in found.closures)
        return original(lowering, model, replace(found, closures=joints), *rest)

    patch.setattr(build, "closure_rows", rows)


def _no_connections(patch: pytest.MonkeyPatch) -> None:
    """Take joints before connections, and drop a connection that closes a loop."""
    original = closures._joint_rows
    patch.setattr(topology, "_connections", lambda model, definitions: iter(()))
    patch.setattr(
        closures,
        "_joint_rows",
        lambda lowering, model, joint, *rest: (
            original(lowering, model, joint, *rest) if joint.coordinates or joint.closures else []
        ),
    )


def _moments_reversed(original: Any) -> Any:
    def reactions(system: Any, multipliers: Any) -> Any:
        found = original(system, multipliers)
        return {n: (f, tuple(system.graph.neg(x) for x in m)) for n, (f, m) in found.items()}

    return reactions


def _at_the_other_joint(original: Any) -> Any:
    def force(system: Any, replies: Any, query: Any) -> Any:
        other = max(replies.joint_reactions, default=query.target)
        return original(
            system, replies, replace(query, target=other) if query.function == "reaction" else query
        )

    return force


def _doubled(original: Any) -> Any:
    return lambda lowering, *rest: lowering.graph.mul(lowering.graph.constant(2), original(lowering, *rest))


def _off_centre(original: Any) -> Any:
    def mass(self: Matter, stated: Any) -> Any:
        found = original(self, stated)
        offset = tuple(self.graph.mul(self.graph.half, x) for x in found.point.offset)
        return replace(found, point=Point(found.point.frame, offset))

    return mass


def _no_coriolis(original: Any) -> Any:
    return lambda graph, factor, a: a if factor == graph.constant(2) else original(graph, factor, a)


def _without_arm(original: Any) -> Any:
    return lambda self, frame, point: self.velocity(Point(frame, (self.graph.zero,) * 2))


def _without_constraints(original: Any) -> Any:
    def seeds(system: Any, multipliers: Any) -> Any:
        zero = system.graph.zero
        kept = [
            lam if rows.joint else (zero,) * len(lam)
            for lam, rows in zip(multipliers, system.constraints, strict=True)
        ]
        return original(system, kept)

    return seeds


def _nothing(original: Any) -> Any:
    return lambda graph, a, b: (graph.zero,) * 3


FAULTS: dict[str, tuple[Patch, str, str]] = {
    "the reaction of a joint at a name of a name": (_no_name_of_a_name, "propped", "bar"),
    "a connection by value that closes a loop": (_no_connections, "held", "q.a"),
    "the sign of moments": (_instead(solved, "joint_reactions", _moments_reversed), "plane", "b"),
    "the reaction of another joint": (_instead(queries, "_force", _at_the_other_joint), "plane", "b"),
    "loads left out of reactions": (
        _instead(queries, "seeds_of", lambda _: lambda system, _: residual.inertia_seeds(system)),
        "space",
        "b",
    ),
    "energies left out of reactions": (
        _instead(queries, "energy_efforts", lambda _: lambda s, m: [s.graph.zero] * 6),
        "space",
        "b",
    ),
    "a constraint left out of reactions": (
        _instead(queries, "seeds_of", _without_constraints),
        "plane",
        "c",
    ),
    "mass centres halfway": (_instead(Matter, "_mass", _off_centre), "plane", "b"),
    "no gyroscopic moment": (_instead(residual, "cross", _nothing), "space", "a"),
    "no Coriolis acceleration": (_instead(spatial, "scale", _no_coriolis), "space", "b"),
    "forces and torques on the source as on the target": (
        _instead(forces, "negate", lambda _: lambda graph, a: tuple(a)),
        "plane",
        "a",
    ),
    "forces without their arm": (_instead(planar.Planar, "velocity_at", _without_arm), "plane", "b"),
    "dampings twice as strong": (_instead(build, "damping", _doubled), "plane", "b"),
    "reactions in the axes of the joint": (
        _instead(spatial.Spatial, "to_world", lambda _: lambda self, frame, vector: tuple(vector)),
        "space",
        "b",
    ),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_planted_faults_are_told(fault: str, monkeypatch: pytest.MonkeyPatch) -> None:
    plant, model, body = FAULTS[fault]
    plant(monkeypatch)
    assert body in {name for _, name in told(MODELS[model])}
