"""Systems in a plane; their numbers are made by ``exudyn/exudyn_planar.py``."""

from __future__ import annotations

from foreign.exudyn_case import Example, cells, elements, planar

ROW = """structural parameter Integer n = {n};
Body link[n](m = 1 kg, J = 1 kg.m^2, com = {{0.5, 0}} m);
Revolute joint[i in 1:n]((if i == 1 then world else link[i - 1].a * trans({{1, 0}} m)) -> link[i].a,
                         angle = 0 rad, der(angle) = 0 rad/s);
output c[n, 2] = {{mass_centre(link[i].a)[k] for i in 1:n, k in 1:2}};"""

OIL = """model Oil "pushes with the pressures of two chambers"
  frame from;
  frame to;
  parameter Real opening[2] "of the valves: from the pump where positive, to the tank where negative";
  parameter Area A[2] = {0.01, 0.008} m^2;
  parameter flow = 2e-5 m^3/s/Pa^0.5;
  state Pressure p[2] = 2e6 Pa;
  let Velocity v = der(norm(pos(to) - pos(from)));
  for i in 1:2 loop
    equation der(p[i]) = 1e9 Pa/1 m^3*((2*i - 3)*A[i]*v
        + opening[i]*flow*(if opening[i] >= 0 then sqrt(2e7 Pa - p[i]) else sqrt(p[i] - 1e5 Pa)));
  end for;
  force p[1]*A[1] - p[2]*A[2] - 2e5 N.s/m*v on norm(pos(to) - pos(from));
end Oil;
"""


def with_oil(*lines: str) -> str:
    body = "\n".join(lines)
    return f"""import mech.planar.*;
{OIL}
model Arms
  gravity {{0, -9.81}} m/s^2;
  {body}
end Arms;"""


SYSTEMS = (
    Example(
        "two_links",
        "Examples/doublePendulum2D, testGymDoublePendulum, openAIgymNLinkContinuous; TestModels/plotSensorTest",
        planar(ROW.format(n=2)),
        cells("c", 2, 2),
    ),
    Example(
        "four_links",
        "Examples/simple4linkPendulumBing; TestModels/pickleCopyMbs",
        planar(ROW.format(n=4)),
        cells("c", 4, 2),
    ),
    Example(
        "two_links_led",
        "TestModels/doublePendulum2DControl",
        planar(
            ROW.format(n=2),
            "let Angle aim = 90 deg*sin(time*90 deg/1 s);",
            "for i in 1:2 loop",
            "  force -5000 N.m/rad*(joint[i].angle - (3 - 2*i)*aim)",
            "        - 100 N.m.s*(der(joint[i].angle) - (3 - 2*i)*der(aim)) on joint[i].angle;",
            "end for;",
        ),
        cells("c", 2, 2),
    ),
    Example(
        "eccentric_rotor",
        "Examples/lavalRotor2Dtest",
        """import mech.planar.*;
import mech.elements.*;
Body rotor(m = 1.6 kg, J = 0.4 kg.m^2);
Free f(world -> rotor.a, x = 0 m, y = 1 cm, der(x) = 0 m/s, der(y) = 0 m/s, angle = 0 rad, der(angle) = 25 rad/s);
CartesianSpring shaft(world -> rotor.a * trans({0, -1} cm), k = 4000 N/m, c = 0.8 N.s/m);
output place[2] = 100*pos(rotor.a);
output rim[2] = pos(rotor.a * trans({1, 0} m));""",
        elements("place", 2) + elements("rim", 2),
    ),
    Example(
        "two_four_bars",
        "TestModels/fourBarMechanismIftomm",
        planar(
            "Body up[3](m = 1 kg, J = (1/12) kg.m^2, com = {0.5, 0} m);",
            "Body across[2](m = 1 kg, J = (1/12) kg.m^2, com = {0.5, 0} m);",
            "Revolute foot[i in 1:3](world * trans({i - 1, 0} m) -> up[i].a, angle = 90 deg, der(angle) = -1 rad/s);",
            "Revolute left[i in 1:2](up[i].a * trans({1, 0} m) -> across[i].a, angle ~ -90 deg, der(angle) ~ 1 rad/s);",
            "cut Revolute right[i in 1:2](across[i].a * trans({1, 0} m) -> up[i + 1].a * trans({1, 0} m));",
            "output u[3, 2] = {mass_centre(up[i].a)[k] for i in 1:3, k in 1:2};",
            "output a[2, 2] = {mass_centre(across[i].a)[k] for i in 1:2, k in 1:2};",
        ),
        ("u[1,1]", "u[1,2]", "a[1,1]", "a[1,2]", "u[2,1]", "u[2,2]", "a[2,1]", "a[2,2]", "u[3,1]", "u[3,2]"),
    ),
    Example(
        "crank_slider_and_spring",
        "Examples/slidercrankWithMassSpring, geneticOptimizationSliderCrank",
        """import mech.planar.*;
Body crank(m = 0.36 kg, J = 0.0027 kg.m^2, com = {0.15, 0} m);
Body rod(m = 0.15 kg, J = 0.0045 kg.m^2, com = {0.3, 0} m);
Particle slider(m = 0.1 kg);
Particle load(m = 0.7 kg);
Revolute main(world -> crank.a, angle = 90 deg, der(angle) = 0 rad/s);
Revolute big(crank.a * trans({0.3, 0} m) -> rod.a, angle ~ -120 deg, der(angle) ~ 0 rad/s);
Prismatic guide(world -> slider.a, position ~ 0.52 m, der(position) ~ 0 m/s);
cut Revolute small(rod.a * trans({0.6, 0} m) -> slider.a);
Prismatic rail(world -> load.a, position = sqrt(0.27)*1 m + 0.2 m, der(position) = 0 m/s);
potential 1/2*1000 N/m*(rail.position - guide.position - 0.2 m)^2;
torque 1 N.m on crank.a;
output c[4, 2] = {mass_centre(crank.a), mass_centre(rod.a), pos(slider.a), pos(load.a)};""",
        cells("c", 4, 2),
    ),
    Example(
        "scissors",
        "TestModels/scissorPrismaticRevolute2D",
        """import mech.planar.*;
gravity {3, -9.81} m/s^2;
parameter h = 0.4 m/cos(0.6);
Body arm[4](m = 1 kg, J = 0.1 kg.m^2);
Revolute centre(world -> arm[1].a, angle = 0.6 rad, der(angle) = 0 rad/s);
Revolute crossing(arm[1].a -> arm[2].a, angle ~ -1.2 rad, der(angle) ~ 0 rad/s);
constraint crossing.angle = -2*centre.angle;
Revolute upper(arm[1].a * trans({h, 0 m}) -> arm[4].a * trans({-h, 0 m}), angle ~ -1.2 rad, der(angle) ~ 0 rad/s);
Revolute lower(arm[2].a * trans({h, 0 m}) -> arm[3].a * trans({-h, 0 m}), angle ~ 1.2 rad, der(angle) ~ 0 rad/s);
cut Revolute last(arm[3].a -> arm[4].a);
potential 1/2*40 N.m*(centre.angle - 1 rad)^2;
damping 2 N.m.s on centre.angle;
output c[4, 2] = {pos(arm[i].a)[k] for i in 1:4, k in 1:2};""",
        cells("c", 4, 2),
    ),
    Example(
        "arm_on_oil",
        "TestModels/hydraulicActuatorSimpleTest; Examples/HydraulicsUserFunction, HydraulicActuatorStaticInitialization",
        with_oil(
            "Body arm(m = 120 kg, J = 10 kg.m^2, com = {0.5, 0} m);",
            "Revolute foot(world -> arm.a, angle = 0 rad, der(angle) = 0 rad/s);",
            "Oil oil(world * trans({0, -0.25} m) -> arm.a * trans({0.25, 0} m), opening = {0.1, -0.1});",
            "output seen[2] = 1e-7*oil.p;",
        ),
        ("foot.angle", *elements("seen", 2)),
    ),
    Example(
        "two_arms_on_oil",
        "Examples/HydraulicActuator2Arms",
        with_oil(
            "Body arm[2](m = 120 kg, J = 10 kg.m^2, com = {0.5, 0} m);",
            "Revolute foot(world -> arm[1].a, angle = 0 rad, der(angle) = 0 rad/s);",
            "Revolute knee(arm[1].a * trans({1, 0} m) -> arm[2].a, angle = -90 deg, der(angle) = 0 rad/s);",
            "Oil first(world * trans({0, -0.3} m) -> arm[1].a * trans({0.25, -0.05} m), opening = {0.15, -0.1});",
            "Oil second(arm[1].a * trans({0.75, -0.05} m) -> arm[2].a * trans({0.25, -0.05} m), opening = {-0.1, 0.1});",
            "output one[2] = 1e-7*first.p;",
            "output two[2] = 1e-7*second.p;",
        ),
        ("foot.angle", "knee.angle", *elements("one", 2), *elements("two", 2)),
    ),
    Example(
        "rod_rubbing_at_its_tip",
        "TestModels/pendulumFriction",
        planar(
            "Body rod(m = 2.5 kg, J = 2.5/12*(0.8^2 + 0.025^2) kg.m^2, com = {0.4, 0} m);",
            "Revolute pin(world -> rod.a, angle = 0 rad, der(angle) = 0 rad/s);",
            "point tip = rod.a * {0.8, 0} m;",
            "force -3 N*vel(tip)/sqrt(dot(vel(tip), vel(tip)) + 0.01 m^2/s^2) on tip;",
        ),
        ("pin.angle",),
    ),
    Example(
        "bars_for_a_beam",
        "Examples/finiteSegmentMethod",
        planar(
            "Body bar[5](m = 0.5 kg, J = 0.002 kg.m^2, com = {0.1, 0} m);",
            "Revolute joint[i in 1:5]((if i == 1 then world else bar[i - 1].a * trans({0.2, 0} m)) -> bar[i].a,",
            "                         angle = 0 rad, der(angle) = 0 rad/s);",
            "for i in 1:5 loop",
            "  potential 1/2*(if i == 1 then 400 N.m else 200 N.m)*joint[i].angle^2;",
            "  damping (if i == 1 then 0.4 N.m.s else 0.2 N.m.s) on joint[i].angle;",
            "end for;",
            "point tip = bar[5].a * {0.2, 0} m;",
            "force {0, -5} N on tip;",
            "output c[5, 2] = {mass_centre(bar[i].a)[k] for i in 1:5, k in 1:2};",
        ),
        cells("c", 5, 2),
    ),
    Example(
        "crank_at_one_speed",
        "TestModels/sliderCrankFloatingTest",
        planar(
            "Body crank(m = 2 kg, J = 0.03 kg.m^2, com = {0.1, 0} m);",
            "Body rod(m = 1 kg, J = 0.025 kg.m^2, com = {0.25, 0} m);",
            "Particle piston(m = 0.5 kg);",
            "Particle load(m = 2 kg);",
            "Revolute main(world -> crank.a);",
            "drive main.angle = 1 rev/s*time;",
            "Revolute big(crank.a * trans({0.2, 0} m) -> rod.a, angle ~ 0 rad);",
            "Prismatic guide(world -> piston.a, position ~ 0.7 m);",
            "cut Revolute small(rod.a * trans({0.5, 0} m) -> piston.a);",
            "Prismatic rail(world -> load.a, position = 1 m, der(position) = 0 m/s);",
            "potential 1/2*50 N/m*(rail.position - guide.position - 0.3 m)^2;",
            "damping 1 N.s/m on rail.position - guide.position;",
            "output c[4, 2] = {mass_centre(crank.a), mass_centre(rod.a), pos(piston.a), pos(load.a)};",
        ),
        cells("c", 4, 2),
    ),
    Example(
        "cart_and_poles",
        "Examples/testGymCartpole, testGymCartpoleEnv, openAIgymNLinkAdvanced, openAIgymTriplePendulum, reinforcementLearningRobot",
        planar(
            "Particle cart(m = 2 kg);",
            "Body pole[3](m = {0.5, 0.4, 0.3} kg, J = 0.02 kg.m^2, com = {0, 0.3} m);",
            "parameter Angle start[3] = {0.1, -0.2, 0.1} rad;",
            "Prismatic rail(world -> cart.a, position = 0 m, der(position) = 0 m/s);",
            "Revolute pin[i in 1:3]((if i == 1 then cart.a else pole[i - 1].a * trans({0, 0.6} m)) -> pole[i].a,",
            "                       angle = start[i], der(angle) = 0 rad/s);",
            "force 5 N*sin(3 rad/s*time) on rail.position;",
        ),
        ("rail.position", "pin[1].angle", "pin[2].angle", "pin[3].angle"),
    ),
    Example(
        "tree_closed_to_four_bars",
        "Examples/FurtherExamples/fourBarKinematicTreeGravity, fourBarKinematicTreeLoadDep, fourBarKinematicTreeUF, fourBarKinematicTreeRobot",
        planar(
            "parameter Length knee[2] = {0.8*cos(0.2), 0.4 + 0.8*sin(0.2)} m;",
            "parameter Length l = norm({0.9, 0} m - knee);",
            "Body a(m = 1 kg, J = 0.02 kg.m^2, com = {0.2, 0} m);",
            "Body b(m = 2 kg, J = 0.1 kg.m^2, com = {0.4, 0} m);",
            "Body c(m = 1.5 kg, J = 0.03 kg.m^2, com = {l/2, 0 m});",
            "Revolute j1(world -> a.a, angle = 90 deg, der(angle) = 0 rad/s);",
            "Revolute j2(a.a * trans({0.4, 0} m) -> b.a, angle ~ -90 deg + 0.2 rad, der(angle) ~ 0 rad/s);",
            "Revolute j3(b.a * trans({0.8, 0} m) -> c.a, angle ~ -1.6 rad, der(angle) ~ 0 rad/s);",
            "cut Revolute j4(c.a * trans({l, 0 m}) -> world * trans({0.9, 0} m));",
            "torque -4 N.m*cos(2 rad/s*time) on a.a;",
        ),
        ("j1.angle", "j2.angle", "j3.angle"),
    ),
    Example(
        "chain_behind_a_slider",
        "TestModels/kinematicTreeConstraintTest, kinematicTreeAndMBStest",
        planar(
            "Particle base(m = 25 kg);",
            "Body link[4](m = 5 kg, J = 0.11 kg.m^2, com = {0, 0.25} m);",
            "Prismatic rail(world -> base.a, position = 0 m, der(position) = 0.5 m/s);",
            "Revolute joint[i in 1:4]((if i == 1 then base.a else link[i - 1].a * trans({0, 0.5} m)) -> link[i].a,",
            "                         angle = (if i == 1 then -90 deg else 0 deg), der(angle) = 0 rad/s);",
            "constraint pos(link[4].a * trans({0, 0.5} m))[2] = 0 m;",
            "potential 1/2*20000 N/m*rail.position^2;",
            "damping 400 N.s/m on rail.position;",
        ),
        ("rail.position", *(f"joint[{k}].angle" for k in range(1, 5))),
    ),
    Example(
        "radial_engine",
        "TestModels/driveTrainTest; Examples/pistonEngine, openVRengine",
        """import mech.planar.*;
Body crank(m = 3 kg, J = 0.02 kg.m^2);
Revolute main(world -> crank.a, angle = 0 rad, der(angle) = 0 rad/s);
Body rod[4](m = 0.8 kg, J = 0.017 kg.m^2, com = {0.25, 0} m);
Particle piston[4](m = {0.2, 0.2, 0.2, 0.3} kg);
parameter Angle lean[4] = {0, 101.5, 180, -101.5} deg;
parameter Length reach[4] = {0.6, 0.49, 0.4, 0.49} m;
Revolute big[4](crank.a * trans({0.1, 0} m) -> rod.a, angle ~ lean, der(angle) ~ 0 rad/s);
Prismatic guide[i in 1:4](world * rot((i - 1)*90 deg) -> piston[i].a, position ~ reach[i], der(position) ~ 0 m/s);
cut Revolute small[i in 1:4](rod[i].a * trans({0.5, 0} m) -> piston[i].a);
coordinate Angle wheel;
kinetic 1/2*0.05 kg.m^2*der(wheel)^2;
damping 0.05 N.m.s on wheel;
constraint wheel = -3*main.angle;
torque 20 N.m*sin(3 rad/s*time) on crank.a;
output r[4, 2] = {mass_centre(rod[i].a)[k] for i in 1:4, k in 1:2};
output p[4, 2] = {pos(piston[i].a)[k] for i in 1:4, k in 1:2};""",
        (*(f"{n}[{i},{k}]" for i in range(1, 5) for n in "rp" for k in (1, 2)), "wheel"),
    ),
    Example(
        "branching_tree",
        "Examples/leggedRobot, FurtherExamples/spotModel; TestModels/kinematicTreeTest",
        planar(
            "Body trunk(m = 4 kg, J = 0.2 kg.m^2, com = {0.05, 0.02} m);",
            "Body upper[2](m = 1 kg, J = 0.02 kg.m^2, com = {0, -0.2} m);",
            "Body lower[2](m = 0.6 kg, J = 0.01 kg.m^2, com = {0, -0.15} m);",
            "Free f(world -> trunk.a, x = 0 m, y = 0 m, der(x) = 0 m/s, der(y) = 3 m/s, angle = 0.2 rad, der(angle) = 1 rad/s);",
            "Revolute hip[i in 1:2](trunk.a * trans({0.25*(2*i - 3), -0.1} m) -> upper[i].a,",
            "                       angle = 0.3 rad*(2*i - 3), der(angle) = 0 rad/s);",
            "Revolute knee[i in 1:2](upper[i].a * trans({0, -0.4} m) -> lower[i].a,",
            "                        angle = -0.4 rad, der(angle) = (2*i - 3)*1 rad/s);",
            "parameter Angle bent[2] = {0.8, 0.4} rad;",
            "for i in 1:2 loop",
            "  potential 1/2*30 N.m*(hip[i].angle - 0.5 rad*(2*i - 3))^2 + 1/2*20 N.m*(knee[i].angle - bent[i])^2;",
            "  damping 0.3 N.m.s on hip[i].angle;",
            "  damping 0.2 N.m.s on knee[i].angle;",
            "end for;",
        ),
        ("f.x", "f.y", "f.angle", "hip[1].angle", "knee[1].angle", "hip[2].angle", "knee[2].angle"),
    ),
)
