"""Systems in space; their numbers are made by ``exudyn/exudyn_spatial.py``."""

from __future__ import annotations

from foreign.exudyn_case import Example, cells, elements, spatial, xyz

BOX = """function box(Mass m, Length x, Length y, Length z)
    = diag({m/12*(y^2 + z^2), m/12*(x^2 + z^2), m/12*(x^2 + y^2)});"""

GOVERNOR = (
    BOX,
    "parameter Mass m = 5.3 kg;",
    "parameter Length com = (0.3*0.5 + 5)/5.3*1 m;",
    "parameter Inertia thin = 0.3 kg/12*(0.01 m)^2*2;",
    "parameter Inertia wide = 0.3 kg/12*((1 m)^2 + (0.01 m)^2) + 0.3 kg*(com - 0.5 m)^2 + 5 kg*(1 m - com)^2;",
    "Body shaft(m = 0.3 kg, J = box(0.3 kg, 0.01 m, 0.01 m, 1 m));",
    "Body slider(m = 3 kg, J = box(3 kg, 0.1 m, 0.1 m, 0.1 m));",
    "Body rod[2](m = m, J = diag({thin, wide, wide}), com = {com, 0 m, 0 m});",
    "Revolute spin(world * trans({0, 0, 0.5} m) -> shaft.a, axis = {0, 0, 1}, angle = 0 rad, der(angle) = 0.16 rev/s);",
    "Prismatic slide(shaft.a -> slider.a, axis = {0, 0, 1}, position = 0 m, der(position) = 0 m/s);",
    "Revolute hinge[i in 1:2](shaft.a * trans({0.05*(3 - 2*i), 0, 0.5} m) * roty(if i == 1 then 30 deg else 150 deg) -> rod[i].a,",
    "                         axis = {0, 1, 0}, angle = 0 rad, der(angle) = 0 rad/s);",
    "frame ear[i in 1:2] = slider.a * trans({0.05*(3 - 2*i), 0, 0} m);",
    "frame middle[i in 1:2] = rod[i].a * trans({0.5, 0, 0} m);",
)

ROTOR = """import mech.spatial.*;
import mech.elements.*;
parameter Length at = {at};
parameter Length off = {off};
parameter Mass m = 2 kg;
parameter Inertia across = m*(0.75 m)^2/4 + m*(0.2 m)^2/12;
parameter Damping d = 2*sqrt(800)*0.002*2 N.s/m;
Body rotor(m = m, J = diag({{m*(0.75 m)^2/2, across, across}}));
Free f(world -> rotor.a, position = {{at - 0.5 m, off, 0 m}}, der(position) = {{0, 0, 0}} m/s,
       orientation = rotx(0 deg), der(orientation) = {{{spin}, 0, 0}} rad/s);
CartesianSpring left(world * trans({{-0.5, 0, 0}} m) -> rotor.a * trans({{-at, -off, 0 m}}), k = 800 N/m, c = d);
CartesianSpring right(world * trans({{0.5, 0, 0}} m) -> rotor.a * trans({{1 m - at, -off, 0 m}}),
                      k = {{0, 800, 800}} N/m, c = {{0 N.s/m, d, d}});
output w[3] = der(f.orientation);
"""

ARM = """import mech.spatial.*;
model Link "from its joint to the next by the rule of Denavit and Hartenberg"
  frame base;
  parameter Length a = 0 m;
  parameter Length d = 0 m;
  parameter Angle alpha = 0 rad;
  parameter Mass m;
  parameter Inertia I[3];
  parameter Length c[3] = {0, 0, 0} m;
  frame tip = base * trans({a, 0 m, d}) * rotx(alpha);
  Body body(m = m, J = diag(I), com = c, a = tip);
end Link;

model Arm
  gravity {0, 0, -9.81} m/s^2;
  {more}
  parameter Real quarter[6] = {1, 0, -1, 1, -1, 0};
  Link link[6](m = {20, 17.4, 4.8, 0.82, 0.34, 0.09} kg, a = {0, 0.4318, 0.0203, 0, 0, 0} m,
               d = {0, 0, 0.15, 0.4318, 0, 0} m, alpha = quarter*90 deg,
               I = {{1e-8, 0.35, 1e-8}, {0.13, 0.524, 0.539}, {0.066, 0.086, 0.0125},
                    {0.0018, 0.0013, 0.0018}, {0.0003, 0.0004, 0.0003}, {0.00015, 0.00015, 4e-5}} kg.m^2,
               c = {{0, 0, 0}, {-0.3638, 0.006, 0.2275}, {-0.0203, -0.0141, 0.07},
                    {0, 0.019, 0}, {0, 0, 0}, {0, 0, 0.032}} m);
  Revolute joint[i in 1:6]((if i == 1 then {foot} else link[i - 1].tip) -> link[i].base,
                           axis = {0, 0, 1}, angle = 0 rad, der(angle) = 0 rad/s);
  parameter RotationalStiffness k[6] = {4000, 4000, 4000, 100, 100, 10} N.m/rad;
  parameter RotationalDamping c[6] = {400, 400, 100, 1, 1, 0.1} N.m.s;
  parameter Angle aim[6] = {0.5, pi/8, pi/4, 0.2, pi/8, 0.3} rad;
  for i in 1:6 loop
    potential 1/2*k[i]*(joint[i].angle - aim[i])^2;
    damping c[i] on joint[i].angle;
  end for;
end Arm;"""


def arm(foot: str, *more: str) -> str:
    return ARM.replace("{foot}", foot).replace("{more}", "\n  ".join(more))


SYSTEMS = (
    Example(
        "bricard",
        "TestModels/bricardMechanism",
        """import mech.spatial.*;
gravity {0, -9.81, 0} m/s^2;
parameter Real along[5, 3] = {{1, 0, 0}, {0, -1, 0}, {0, 0, 1}, {-1, 0, 0}, {0, 1, 0}};
structural parameter Real axis[5, 3] = {{0, 1, 0}, {0, 0, 1}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
parameter Inertia J[5, 3, 3] = {(if i == k then 0.0841666666666667 else 0)*1 kg.m^2
    + (1/600 - 0.0841666666666667)*along[b, i]*along[b, k]*1 kg.m^2 for b in 1:5, i in 1:3, k in 1:3};
Body bar[b in 1:5](m = 1 kg, J = J[b, :, :], com = along[b, :]*0.5 m);
Revolute hinge[b in 1:5]((if b == 1 then world else bar[b - 1].a * trans(along[b - 1, :]*1 m)) -> bar[b].a,
                         axis = axis[b, :], angle ~ 0 rad, der(angle) ~ 0 rad/s);
cut Revolute last(bar[5].a * trans({0, 1, 0} m) -> world * trans({0, 0, 1} m), axis = {1, 0, 0});
output c[5, 3] = {mass_centre(bar[b].a)[k] for b in 1:5, k in 1:3};""",
        cells("c", 5, 3),
    ),
    Example(
        "bent_shaft",
        "Examples/universalJoint",
        """import mech.spatial.*;
Body driving(m = 9 kg, J = diag({2, 3, 5} kg.m^2));
Body centre(m = 1 kg, J = diag({0.1, 0.2, 0.3} kg.m^2));
Body driven(m = 3 kg, J = diag({1, 1, 2} kg.m^2), com = {0, 0, 0.5} m);
frame bend = world * trans({0, 0, 0.5} m) * rotx(45 deg);
Revolute main(world -> driving.a, axis = {0, 0, 1});
drive main.angle = 10 rad/s*time;
Revolute first(driving.a * trans({0, 0, 0.5} m) * rotx(45 deg) -> centre.a, axis = {1, 0, 0}, angle ~ 0 rad);
Revolute second(centre.a -> driven.a, axis = {0, 1, 0}, angle ~ 0 rad);
cut PointOnLine bearing(bend -> driven.a * trans({0, 0, 1} m), axis = {0, 0, 1});
output p[3, 3] = {pos(driving.a * trans({1, 0, 0} m)), pos(centre.a * trans({1, 0, 0} m)),
                  pos(driven.a * trans({1, 0, 0.5} m))};
output w[3] = components(driven.a, angvel(driven.a));""",
        cells("p", 3, 3) + elements("w", 3),
    ),
    Example(
        "stiff_governor",
        "Examples/stiffFlyballGovernorKT",
        spatial(
            *GOVERNOR,
            "Spring spring[2](ear -> middle, k = 8e5 N/m, rest = 0.5 m);",
            "Damper damper[2](ear -> middle, c = 4e4 N.s/m);",
        ),
        ("spin.angle", "slide.position", "hinge[1].angle", "hinge[2].angle"),
    ),
    Example(
        "soft_governor",
        "TestModels/stiffFlyballGovernor; Examples/stiffFlyballGovernor2",
        spatial(
            *GOVERNOR,
            "Spring spring[2](ear -> middle, k = 4000 N/m, rest = 0.5 m);",
            "Damper damper[2](ear -> middle, c = 200 N.s/m);",
            "output p[3] = pos(slider.a);",
            "output c[2, 3] = {mass_centre(rod[i].a)[k] for i in 1:2, k in 1:3};",
            "output w[3] = components(shaft.a, angvel(shaft.a));",
        ),
        elements("p", 3) + cells("c", 2, 3) + elements("w", 3),
    ),
    Example(
        "slider_crank_in_space",
        "TestModels/sliderCrank3Dbenchmark, sliderCrank3Dtest",
        spatial(
            "parameter Length r[3] = {0.2, -0.1, -0.2} m;",
            "parameter Real x[3] = r/0.3 m;",
            "parameter Real n[3] = cross({0, 0.1, 0.2}, {1, 0, 0});",
            "Body crank(m = 0.12 kg, J = diag({0.0001, 0.0001, 0.00001} kg.m^2), com = {0, 0, 0.04} m);",
            "Body rod(m = 0.5 kg, J = 0.004 kg.m^2*identity(3) - 0.0036 kg.m^2*outer(x, x), com = r/2);",
            "Body slider(m = 2 kg, J = 0.0001 kg.m^2*identity(3));",
            "Revolute main(world * trans({0, 0.1, 0.12} m) -> crank.a, axis = {1, 0, 0}, angle = 0 rad, der(angle) = 6 rad/s);",
            "Spherical big(crank.a * trans({0, 0, 0.08} m) -> rod.a, der(orientation) ~ {-4, -1, 0.5} rad/s);",
            "Prismatic guide(world -> slider.a, axis = {1, 0, 0}, position ~ 0.2 m, der(position) ~ 0.24 m/s);",
            "cut Spherical small(rod.a * trans(r) -> slider.a);",
            "constraint dot(direction(slider.a, {1, 0, 0}), direction(rod.a, n)) = 0;",
            "output c[3, 3] = {mass_centre(crank.a), mass_centre(rod.a), pos(slider.a)};",
            "output w = der(main.angle);",
        ),
        (*cells("c", 3, 3), "w"),
    ),
    Example(
        "rotor_running_up",
        "Examples/rigidRotor3Drunup, rigidRotor3DbasicBehaviour",
        ROTOR.format(at="0.5 m", off="1.48 mm", spin="0")
        + "torque {2, 0, 0} N.m on rotor.a;\noutput p[3] = 100*f.position;",
        xyz("p", "w"),
    ),
    Example(
        "rotor_pushed_backwards",
        "Examples/rigidRotor3DFWBW, flexibleRotor3Dtest",
        ROTOR.format(at="0.9 m", off="0 m", spin="15")
        + "let Angle turn = 12 rad/s*time;\nforce {0 N, -10 N*cos(turn), 10 N*sin(turn)} on rotor.a;\noutput p[3] = 10*f.position;",
        xyz("p", "w"),
    ),
    Example(
        "torques_of_its_own",
        "Examples/rigidBodyIMUtest",
        """import mech.spatial.*;
Body b(m = 2 kg, J = diag({0.1, 0.25, 0.2} kg.m^2));
Free f(world -> b.a, position = {0, 0, 0} m, der(position) = {0, 0, 0} m/s,
       orientation = rotx(0 deg), der(orientation) = {0, 0, 0} rad/s);
let t = time/1 s;
torque {1.2*cos(4*t), 0.5*sin(3*t), 0.8*cos(2*t)} N.m on b.a in b.a;
force {20*cos(3*t), 4*t, 0} N on b.a;
output p[3] = pos(b.a * trans({0.05, 0.05, 0.05} m));
output w[3] = der(f.orientation);""",
        xyz("p", "w"),
    ),
    Example(
        "skew_tree",
        "Examples/kinematicTreeAndMBS; TestModels/kinematicTreeAndMBStest, MiniExamples/ObjectKinematicTree",
        f"""import mech.spatial.*;
{BOX}
gravity {{0, -10, 0}} m/s^2;
Body link[5](m = 20 kg, J = box(20 kg, 2 m, 0.1 m, 0.1 m), com = {{1, 0, 0}} m);
Revolute joint[i in 1:5](
    (if i == 1 then world else link[i - 1].a * trans({{2, 0, 0}} m) * rotx(if i == 4 then 0 deg else 90 deg) * roty(45 deg)) -> link[i].a,
    axis = {{0, 0, 1}}, angle = 0 rad, der(angle) = 0 rad/s);""",
        tuple(f"joint[{k}].angle" for k in range(1, 6)),
    ),
    Example(
        "arm_of_six",
        "TestModels/serialRobotTest; Examples/serialRobotTSD, serialRobotKinematicTree, serialRobotInteractiveLimits",
        arm("world"),
        tuple(f"joint[{k}].angle" for k in range(1, 7)),
    ),
    Example(
        "arm_on_a_sledge",
        "TestModels/movingGroundRobotTest; Examples/serialRobotKinematicTreeDigging",
        arm(
            "sledge.a",
            "Particle sledge(m = 50 kg);",
            "Prismatic rail(world -> sledge.a, axis = {1, 0, 0}, position = 0 m, der(position) = 0 m/s);",
            "potential 1/2*20000 N/m*(rail.position - 0.1 m)^2;",
            "damping 200 N.s/m on rail.position;",
        ),
        ("rail.position", *(f"joint[{k}].angle" for k in range(1, 7))),
    ),
    Example(
        "coupled_joints",
        "TestModels/relativeRotationTranslationMechanism",
        f"""import mech.spatial.*;
{BOX}
gravity {{0, -9.81, 0}} m/s^2;
Body link[4](m = 4 kg, J = box(4 kg, 0.4 m, 0.1 m, 0.1 m), com = {{0.2, 0, 0}} m);
Prismatic slide(world -> link[1].a, axis = {{1, 0, 0}});
drive slide.position = 0.3 m*(1 - cos(1 rev/s*time));
frame e[i in 1:3] = link[i].a * trans({{0.4, 0, 0}} m);
Revolute j1(e[1] * roty(90 deg) -> link[2].a, axis = {{1, 0, 0}}, angle ~ 0 rad);
Revolute j2(e[2] -> link[3].a, axis = {{0, 1, 0}}, angle ~ 0 rad);
Revolute j3(e[3] -> link[4].a, axis = {{0, 0, 1}}, angle = 0.5 rad, der(angle) = 0 rad/s);
constraint j1.angle = 2*pi*slide.position/1 m;
constraint -j2.angle = j1.angle;""",
        ("slide.position", "j1.angle", "j2.angle", "j3.angle"),
    ),
    Example(
        "wheel_on_a_turntable",
        "TestModels/rotatingTableTest",
        """import mech.spatial.*;
import mech.elements.*;
gravity {0, -9.81, 0} m/s^2;
parameter Mass m = 1000 kg/m^3*pi*(0.5 m)^2*0.1 m;
parameter Inertia J = m*0.76 m^2/12;
Body wheel(m = m, J = diag({J, J, m*0.125 m^2}));
Body table(m = 100 kg, J = 1000 kg.m^2*identity(3));
Free f(world -> wheel.a, position = {0, 0, 3} m, der(position) = {0, 0, 0} m/s, der(orientation) = {0, 0, 0} rad/s);
Revolute pivot(world * trans({0, -0.5, 0} m) -> table.a, axis = {0, 1, 0}, angle = 0 rad, der(angle) = 0 rad/s);
CartesianSpring hub(world -> wheel.a * trans({0, 0, -3} m), k = 1e5 N/m, c = 1e4 N.s/m);
RollingDisk rolls(table.a * rotx(-90 deg) -> wheel.a, r = 0.5 m);
torque {0, 0, 20} N.m on wheel.a in wheel.a;
output p[3] = pos(wheel.a * trans({0.5, 0, 0} m));
output w[3] = der(f.orientation);
output t[3] = {0 rad/s, der(pivot.angle), 0 rad/s};""",
        xyz("p", "w", "t"),
    ),
    Example(
        "disc_that_tips",
        "TestModels/createRollingDiscTest",
        spatial(
            "parameter Length r = 0.2 m;",
            "parameter Mass m = 5000 kg/m^3*pi*r^2*0.02 m;",
            "parameter Inertia J = m*(3*r^2 + (0.02 m)^2)/12;",
            "Body b(m = m, J = diag({m*r^2/2, J, J}));",
            "Free f(world -> b.a, position = {1, 0, 0.2} m, der(position) ~ {0.6, 3.77, 0} m/s,",
            "       der(orientation) = {-6*pi, 3, 0} rad/s);",
            "RollingDisk rolls(world -> b.a, r = r, axis = {1, 0, 0});",
            "output w[3] = der(f.orientation);",
        ),
        xyz("f.position", "w"),
    ),
    Example(
        "bicycle",
        "Examples/bicycleIftommBenchmark, FurtherExamples/bicycleIftommBenchmarkMarkerBasedJoints",
        spatial(
            "parameter Length middle[3] = {0.3, 0, 0.9} m;",
            "parameter Length bars[3] = {0.9, 0, 0.7} m;",
            "parameter Length head[3] = {0.82188470506, 0, 0.85595086466} m;",
            "Body back(m = 2 kg, J = diag({0.0603, 0.12, 0.0603} kg.m^2));",
            "Body fore(m = 3 kg, J = diag({0.1405, 0.28, 0.1405} kg.m^2));",
            "Body rider(m = 85 kg, J = {{9.2, 0, -2.4}, {0, 11, 0}, {-2.4, 0, 2.8}} kg.m^2);",
            "Body fork(m = 4 kg, J = {{0.05892, 0, 0.00756}, {0, 0.06, 0}, {0.00756, 0, 0.00708}} kg.m^2);",
            "Free f(world -> rider.a, position = middle, der(position) ~ {4, -0.045, 0} m/s, der(orientation) = {0.05, 0, 0} rad/s);",
            "Revolute hub(rider.a * trans({0, 0, 0.3} m - middle) -> back.a, axis = {0, 1, 0}, angle = 0 rad, der(angle) = (4/0.3) rad/s);",
            "Revolute steer(rider.a * trans(head - middle) -> fork.a * trans(head - bars), axis = {-sin(pi/10), 0, cos(pi/10)},",
            "               angle = 0 rad, der(angle) = 0 rad/s);",
            "Revolute nose(fork.a * trans({1.02, 0, 0.35} m - bars) -> fore.a, axis = {0, 1, 0}, angle = 0 rad, der(angle) ~ 11 rad/s);",
            "RollingDisk rear(world -> back.a, r = 0.3 m, axis = {0, 1, 0});",
            "RollingDisk front(world -> fore.a, r = 0.35 m, axis = {0, 1, 0});",
            "output p[4, 3] = {pos(back.a), pos(fore.a), pos(rider.a), pos(fork.a)};",
        ),
        cells("p", 4, 3),
    ),
    Example(
        "bodies_on_stiff_springs",
        "Examples/rigid3Dexample; TestModels/perf3DRigidBodies",
        """import mech.spatial.*;
gravity {0, -9.81, 0} m/s^2;
Body b[4](m = 2 kg, J = diag({0.6, 0.1, 0.6} kg.m^2));
Free f[i in 1:4](world -> b[i].a, position = {0.6*(i - 1), 0, 0} m, der(position) = {0, 0, 0} m/s, der(orientation) = {0, 0, 0} rad/s);
let Length d[i in 1:4, k in 1:3] = pos(b[i].a * trans({-0.3, 0, 0.1} m))[k]
    - (if i == 1 then {-0.3, 0, 0.1}[k]*1 m else pos(b[i - 1].a * trans({0.3, 0, 0.1} m))[k]);
potential sum(1/2*1e4 N/m*d[i, k]^2 for i in 1:4, k in 1:3);
dissipation sum(1/2*20 N.s/m*der(d[i, k])^2 for i in 1:4, k in 1:3);
output p[4, 3] = {pos(b[i].a)[k] for i in 1:4, k in 1:3};""",
        cells("p", 4, 3),
    ),
    Example(
        "chain_of_ball_joints",
        "TestModels/perfRigidPendulum; Examples/rigidBodyTutorial2, rigidPendulum",
        spatial(
            "Body b[4](m = 1 kg, J = diag({0.02, 0.05, 0.06} kg.m^2), com = {0.25, 0, 0} m);",
            "Spherical ball[i in 1:4]((if i == 1 then world else b[i - 1].a * trans({0.5, 0, 0} m)) -> b[i].a,",
            "                         der(orientation) = (if i == 1 then {1, 0, 0} else {0, 0, 0})*1 rad/s);",
            "point tip = b[4].a * {0.5, 0, 0} m;",
            "force {0, 3, 0} N on tip;",
            "output c[4, 3] = {mass_centre(b[i].a)[k] for i in 1:4, k in 1:3};",
        ),
        cells("c", 4, 3),
    ),
    Example(
        "cranks_and_a_rod",
        "TestModels/MiniExamples/ObjectConnectorDistance, TestModels/fourBarMechanismTest",
        spatial(
            "import mech.couplings.*;",
            "Body a(m = 1 kg, J = diag({0.01, 0.02, 0.03} kg.m^2), com = {0, 0.1, 0} m);",
            "Body b(m = 2 kg, J = diag({0.03, 0.04, 0.02} kg.m^2), com = {0, 0, 0.25} m);",
            "Revolute one(world -> a.a, axis = {1, 0, 0}, angle = 0 rad, der(angle) = 5 rad/s);",
            "Revolute two(world * trans({0.8, 0.3, 0} m) -> b.a, axis = {0, 1, 0}, angle = 0 rad, der(angle) ~ 1 rad/s);",
            "Distance rod(a.a * trans({0, 0.2, 0} m) -> b.a * trans({0, 0, 0.5} m), l = sqrt(0.9)*1 m);",
            "output c[2, 3] = {mass_centre(a.a), mass_centre(b.a)};",
            "output w[2, 3] = {{der(one.angle), 0 rad/s, 0 rad/s}, {0 rad/s, der(two.angle), 0 rad/s}};",
        ),
        cells("c", 2, 3) + cells("w", 2, 3),
    ),
    Example(
        "turned_cardan",
        "TestModels/mainSystemExtensionsTests, genericJointUserFunctionTest",
        f"""import mech.spatial.*;
{BOX}
gravity {{0, -9.81, 0}} m/s^2;
Body b(m = 50 kg, J = box(50 kg, 1 m, 0.1 m, 0.1 m), com = {{0.5, 0, 0}} m);
Universal joint(world * trans({{0.5, 0, 0}} m) * rotx(22.5 deg) -> b.a * rotx(22.5 deg), first = {{0, 1, 0}}, second = {{0, 0, 1}},
                angle = {{0, 0}} rad, der(angle) = {{2*cos(pi/8), -2*sin(pi/8)}} rad/s);
point end1 = b.a * {{1, 0, 0}} m;
force {{0, 20, 0}} N on end1;
torque {{0, 8, 5}} N.m*(time/1 s)^2 on b.a;
output c[3] = mass_centre(b.a);
output p[3] = pos(b.a * trans({{0.5, 1, 0}} m));""",
        xyz("c", "p"),
    ),
    Example(
        "skew_pair_on_springs",
        "TestModels/computeODE2AEeigenvaluesTest, complexEigenvaluesTest, computeODE2EigenvaluesTest",
        f"""import mech.spatial.*;
import mech.elements.*;
{BOX}
gravity {{0, -9.81, 0}} m/s^2;
Body b[2](m = 0.5 kg, J = box(0.5 kg, 0.1 m, 0.01 m, 0.02 m), com = {{0.05, 0, 0}} m);
Revolute hinge(world -> b[1].a, axis = {{0, 0, 1}}, angle = 0 rad, der(angle) = 0 rad/s);
frame tip = b[1].a * trans({{0.1, 0, 0}} m);
Spherical ball(tip -> b[2].a, orientation = rotz(-45 deg)*roty(45 deg), der(orientation) = {{0, 0, 0}} rad/s);
parameter Length start[3] = {{0.1 + 0.05, -0.05, -0.1*sin(pi/4)}} m;
CartesianSpring s(world -> b[2].a * trans({{0.1, 0, 0}} m), k = 100 N/m, c = 0.1 N.s/m, rest = start);
output c[2, 3] = 10*{{mass_centre(b[1].a), mass_centre(b[2].a)}};
output p[3] = pos(b[2].a * trans({{0.05, 1, 0}} m));""",
        cells("c", 2, 3) + elements("p", 3),
    ),
    Example(
        "gyroscope",
        "Examples/rigidRotor3Dnutation, gyroStability",
        spatial(
            "Body ring(m = 1 kg, J = diag({0.03, 0.03, 0.05} kg.m^2));",
            "Body inner(m = 0.6 kg, J = diag({0.02, 0.01, 0.01} kg.m^2), com = {0, 0.02, -0.05} m);",
            "Body wheel(m = 2 kg, J = diag({0.01, 0.02, 0.01} kg.m^2), com = {0, 0.1, 0} m);",
            "Revolute one(world -> ring.a, axis = {0, 0, 1}, angle = 0 rad, der(angle) = 0.5 rad/s);",
            "Revolute two(ring.a -> inner.a, axis = {1, 0, 0}, angle = 0.4 rad, der(angle) = 0 rad/s);",
            "Revolute three(inner.a -> wheel.a, axis = {0, 1, 0}, angle = 0 rad, der(angle) = 100 rad/s);",
        ),
        ("one.angle", "two.angle", "three.angle"),
    ),
    Example(
        "body_on_three_angles",
        "TestModels/LieGroupIntegrationUnitTests, explicitLieGroupIntegratorPythonTest",
        spatial(
            "Body b(m = 3 kg, J = diag({0.1, 0.2, 0.25} kg.m^2), com = {0.2, 0.1, -0.1} m);",
            "Gimbal g(world -> b.a, angle = {0, 0.3, 0} rad, der(angle) = {1, 0, 3} rad/s);",
        ),
        xyz("g.angle"),
    ),
    Example(
        "springs_of_the_joints",
        "TestModels/createFunctionsTest, jointArgsTest, MiniExamples/ObjectConnectorTorsionalSpringDamper",
        """import mech.spatial.*;
Body a(m = 3 kg, J = diag({0.2, 0.3, 0.4} kg.m^2), com = {0.3, 0, 0} m);
Body b(m = 1 kg, J = diag({0.02, 0.03, 0.04} kg.m^2));
gravity {0, 0, -9.81} m/s^2;
Revolute hinge(world -> a.a, axis = {0.6, 0.8, 0}, angle = 0 rad, der(angle) = 2 rad/s);
Prismatic slide(a.a * trans({0.5, 0, 0.2} m) -> b.a, axis = {0.6, 0, 0.8}, position = 0 m, der(position) = 0 m/s);
potential 1/2*20 N.m*hinge.angle^2 + 1/2*150 N/m*(slide.position - 0.05 m)^2;
damping 0.3 N.m.s on hinge.angle;
damping 2 N.s/m on slide.position;
output c[2, 3] = {mass_centre(a.a), pos(b.a)};
output p[3] = pos(a.a * trans({0.3, 1, 0} m));""",
        cells("c", 2, 3) + elements("p", 3),
    ),
)
