"""What large runs of random models found, made small: each now agrees with the definition, or is refused in words."""

from __future__ import annotations

from random import Random

import pytest
from random_models.compiled import Refused, compiled
from random_models.definition import undone

PLANE = "import mech.planar.*;\n"
AGREE = {
    "a force that moves nothing acts on the reaction that it follows": (
        PLANE
        + """gravity {1, 1} m/s^2;
        Sphere b(m = 2 kg, r = 0.1 m);
        Prismatic j(world -> b.a);
        force reaction(j)[2] on pos(b.a)[1] from j.position;
        output o = reaction(j);"""
    ),
    "a force that moves nothing is half of the reaction that it acts on": (
        PLANE
        + """gravity {1, 1} m/s^2;
        Sphere b(m = 2 kg, r = 0.1 m);
        Prismatic j(world -> b.a, position = 0.3 m);
        force 0.5*reaction(j)[1] on pos(b.a)[1] from j.position;
        output o = reaction(j);"""
    ),
    "a torque between both sides of a joint jumps with the joint's own moment, and cancels in the equations": (
        PLANE
        + """Bar b1;
        Revolute j2(world -> b1.a);
        Rod b5;
        Revolute j6(b1.a -> b5.a);
        Body b8;
        Rolling j9(b5.b -> b8.a);
        torque T: if moment(j9) >= 1 N.m then 1920 mJ else 1 J on b8.a from b5.b;
        output o = moment(j9);"""
    ),
    "two bodies welded together are one, whose reaction is asked for": (
        """import mech.spatial.*;
        Disk disk(r = 0.2 m);
        Revolute hinge(world -> disk.a, angle = 0.3 rad);
        Bar bar;
        Weld weld(disk.a -> bar.a);
        output centre = mass_centre(bar.a);
        output J = inertia_tensor(disk.a);
        output held = reaction(weld);"""
    ),
    "a connection whose pose follows a joint waits for its turn among the joints, and closes the loop": (
        """import mech.spatial.*;
        Body wheel(m = 1.2 kg, J = diag({0.2, 0.3, 0.25} kg.m^2), com = {0.1, 0.05, 0} m);
        Revolute hinge(world -> wheel.a, angle ~ 0.3 rad, der(angle) ~ 0.5 rad/s);
        frame moved = world * trans({0.2, 0, 0.1} m) * rotx(0.7*hinge.angle) * roty(0.4*hinge.angle);
        Free free(world -> body.a, position ~ {0.1, 0.1, 0} m);
        Body body(m = 0.8 kg, J = diag({0.1, 0.2, 0.15} kg.m^2), com = {0, 0.2, 0.1} m, a = moved);
        force {0.4, -0.7, 1.1} N on body.a;
        output held = reaction(hinge);
        output carried = reaction(free);"""
    ),
    "bodies that only slide against each other are two": (
        """import mech.spatial.*;
        Bar bar;
        Prismatic rail(world -> bar.a);
        Body body;
        Translation guide(world -> body.a, position = {0.1, 0.2, 0.3} m);
        output centre = mass_centre(body.a);"""
    ),
    "a question about a frame before the bodies that tell how many components it has": (
        """import mech.spatial.*;
        output o = pos(disk.a)[3];
        Disk disk;
        Prismatic rail(world -> disk.a, axis = {0, 0, -1}, position = 0.2 m);"""
    ),
    "a maximum of a potential and an input, written by 'if'": (
        """coordinate Length q = 0.4 m;
        kinetic 1 kg*der(q)^2;
        input Force u = 1 N;
        potential if 1 N*q > u*1 m then 1 N*q else u*1 m;
        output o = der(q, 2);"""
    ),
    "a body that turns on a frame of its own is not part of one that is welded to the world": (
        """import mech.spatial.*;
        frame held;
        mass 1 kg at held;
        Weld weld(world -> held);
        coordinate Rotation turn = rotx(0.4);
        frame turning = world*turn;
        mass 1 kg at turning*{1 m, 1 m, 1 m};
        inertia diag({1, 1, 1} kg.m^2) on turning;
        output centre = mass_centre(held);"""
    ),
    "a dissipation that bends at a rate that a joint keeps at zero gives no one force there": (
        """import mech.spatial.*;
        frame f;
        inertia diag({1, 1, 0.2} kg.m^2) on f;
        Spherical ball(world -> f);
        dissipation 1 N*abs(der(pos(f)[2]));
        output held = reaction(ball);"""
    ),
    "a torque that follows a moment which it changes alone, so that three moments agree with it": (
        """import mech.spatial.*;
        gravity {0.1, 0, 0} m/s^2;
        Body b(m = 1 kg, com = {0, 0, 0.2} m);
        Prismatic rail(world -> b.a, axis = {0, 0, 1});
        torque atan(1.24*moment(rail)[2]/(1 N.m))*{0, -1.4, 0} N.m on b.a;
        output held = moment(rail);"""
    ),
    "the slope of an integral with bends that are not split is known as well as is told": (
        """coordinate Angle q = 0.28;
        kinetic 1.16 kg.m^2*der(q)^2/2;
        potential 1.16 J*integral(abs(sin(7.34*(s - 0.41*tanh(q)))) for s in 0:1.04);
        output o = der(q, 2);"""
    ),
    "the power of a force, between two laws that are one": (
        """coordinate Length q = 1 m;
        initial der(q) = 1 m/s;
        kinetic 1 kg*der(q)^2;
        force F: if power(F) > 1 W then 1 N else 1 N on q;
        output o = der(q, 2);"""
    ),
}
STOP = "\nexperiment(stop = 1 s);"
REFUSED = {
    "a gap that nothing changes, beside a reaction that is asked for": (
        PLANE
        + """Sphere b;
        Sphere c;
        Revolute hinge(world -> c.a);
        Revolute elbow(b.a -> c.a);
        contact C: 1 m - pos(b.a)[1];
        output o = reaction(elbow);""",
        "E0702",
    ),
    "a potential that jumps where an input says": (
        """coordinate Length q = 0.4 m;
        kinetic 1 kg*der(q)^2;
        input Force u = 1 N;
        potential if 1 N*q > u*1 m then 1 N*q else 2 N*q;""",
        "E0523",
    ),
    "a value before an event in the period of a clock": (
        """coordinate Length q = 0.4 m;
        kinetic 1 kg*der(q)^2;
        discrete Real n = 1;
        when sample(pre(n)*1 s) then n := n + 1; end when;""",
        "E0709",
    ),
    "a value before an event in the start of a clock": (
        """coordinate Length q = 0.4 m;
        kinetic 1 kg*der(q)^2;
        discrete Real n = 1;
        when sample(1 s, pre(n)*1 s) then n := n + 1; end when;""",
        "E0709",
    ),
}


@pytest.mark.parametrize("name", AGREE)
def test_agrees_with_the_definition(name: str) -> None:
    assert undone(compiled(AGREE[name] + STOP), seed=Random(name).randrange(1000), states=3) == []


@pytest.mark.parametrize("name", REFUSED)
def test_is_refused(name: str) -> None:
    text, code = REFUSED[name]
    with pytest.raises(Refused) as refused:
        compiled(text + STOP)
    assert refused.value.codes == (code,)
