"""Total momenta that runs are told to keep: not those that contacts, inputs or moving joints change."""

from __future__ import annotations

from compiled import compiled, outcome

import mechc


def conserved(text: str) -> set[str]:
    equations = mechc.loads(text).compilation.equations
    return {equations.outputs[k].name for k in equations.conserved}


POINTS = """
coordinate x = 0 m; coordinate y = 0 m; coordinate X = 0 m; coordinate Y = 1 m;
point a = world * {x, y};
point b = world * {X, Y};
mass 1 kg at a;
mass 2 kg at b;
"""


def test_contacts_break_the_momenta_that_their_impulses_change() -> None:
    everything = {"momentum.x", "momentum.y", "angular_momentum.z"}
    assert conserved(POINTS + "contact meet: norm(b - a) - 0.1 m;") == everything
    of_b = {"momentum(X)", "momentum(Y)"}
    assert conserved(POINTS + "contact edge: 5 m - norm(a);") == of_b | {"angular_momentum.z"}
    assert conserved(POINTS + "contact floor: Y;") >= {"momentum.x"}
    assert "momentum.y" not in conserved(POINTS + "contact floor: Y;")
    # flat in the middle only
    assert conserved(POINTS + "contact edge: 5 m - norm({deadzone(x, 1 m), y});") == of_b


def test_inputs_and_moving_joints_break_momenta() -> None:
    assert "momentum.x" not in conserved(POINTS + "input Force f = 0 N; force {f, 0*f} on a;")
    text = """
    import mech.planar.*;
    Bar door(m = 20 kg, l = 1 m);
    Revolute hinge(world * trans({1/2*(1 m/s^2)*time^2, 0}) -> door.a, angle = 90 deg);
    """
    assert conserved(text) == set()


def test_momentum_of_a_rotation_is_its_angular_momentum_in_the_body() -> None:
    text = """
    coordinate Rotation R;
    inertia diag({1, 2, 4} kg.m^2) on world * R;
    output L = momentum(R);
    output second = momentum(R)[2];
    """
    rates = {"der(R)[1]": 5.0, "der(R)[2]": 2.0, "der(R)[3]": 3.0}
    found = outcome(compiled(text), "outputs", rates)
    assert [found[f"L[{k}]"] for k in (1, 2, 3)] == [5.0, 4.0, 12.0]
    assert found["second"] == 4.0
