"""Systems that change at given times, vehicles, slots, curves and motors; their numbers are made by ``exudyn/exudyn_events.py``."""

from __future__ import annotations

from foreign.exudyn_case import Example, cells, elements, planar, spatial, xy, xyz

SOFT = """import mech.spatial.*;
function box(Mass m, Length x, Length y, Length z)
    = diag({m/12*(y^2 + z^2), m/12*(x^2 + z^2), m/12*(x^2 + y^2)});
model SoftDisc "wheel about x on ground that gives; its friction grows with the slip"
  frame to;
  parameter Length r = 0.4 m;
  parameter Damping c = 1e3 N.s/m;
  parameter Real mu[2] = {0.8, 0.8} "along the axis and across, both turned by `lean`";
  parameter Angle lean = 0 rad;
  let Real n[3] = {0, 0, 1};
  let Real e[3] = direction(to, {1, 0, 0});
  let Real along[3] = cross(e, n)/norm(cross(e, n));
  let Real side[3] = cross(n, along);
  let Length arm[3] = r*cross(e, along);
  let Velocity v[3] = vel(to) + cross(angvel(to), arm);
  let Force N = -1e5 N/m*(pos(to) + arm)[3] - c*v[3];
  let Real turn[2, 2] = {{cos(lean), -sin(lean)}, {sin(lean), cos(lean)}};
  let Force f[2] = -N/(2 m/s)*(transpose(turn)*diag(mu)*turn*{dot(v, side), dot(v, along)});
  let Force F[3] = f[1]*side + f[2]*along + N*n;
  force F on to;
  torque cross(arm, F) on to;
end SoftDisc;
model Vehicle
  gravity {0, 0, -9.81} m/s^2;
  {body}
end Vehicle;"""


def soft(*lines: str) -> str:
    return SOFT.replace("{body}", "\n  ".join(lines))


SYSTEMS = (
    Example(
        "torques_in_turns",
        "Examples/rigidBodyIMUtest",
        """import mech.spatial.*;
Body b(m = 2 kg, J = diag({0.1, 0.15, 0.2} kg.m^2));
Free f(world -> b.a, position = {0, 0, 0} m, der(position) = {0, 0, 0} m/s, der(orientation) = {0, 0, 0} rad/s);
torque (if time < 0.3 s then {2, 0, 0} elseif time < 0.6 s then {-2, 0, 0}
        elseif time < 0.9 s then {0, 0, 2} else {0, 1, -2})*1 N.m on b.a in b.a;
output p[3] = pos(b.a * trans({0.1, 0.2, 0.3} m));
output w[3] = der(f.orientation);""",
        xyz("p", "w"),
    ),
    Example(
        "springs_that_break",
        "Examples/springsDeactivateConnectors",
        """gravity {0, -9} m/s^2;
structural parameter Integer pair[8, 2] = {{1, 3}, {3, 5}, {2, 4}, {4, 6}, {3, 4}, {5, 6}, {1, 4}, {3, 6}};
structural parameter Length start[6, 2] = {{0, 0}, {0, 1}, {1, 0}, {1, 1}, {2, 0}, {2, 1}} m;
coordinate Length p[4, 2] = start[3:6, :];
let Length all[:, :] = concat(start[1:2, :], p);
for i in 1:4 loop
  mass 10 kg at world * p[i, :];
end for;
let Length span[s in 1:8] = norm(all[pair[s, 2], :] - all[pair[s, 1], :]);
let Force tension[s in 1:8] = 4000 N/m*(span[s] - norm(start[pair[s, 2], :] - start[pair[s, 1], :])) + 10 N.s/m*der(span[s]);
discrete Real whole[8] = 1;
for s in 1:8 loop
  force -whole[s]*tension[s] on span[s];
  when sample(10 ms) then
    whole[s] := if abs(whole[s]*tension[s]) > 400 N then 0 else whole[s];
  end when;
end for;""",
        ("p[1,1]", "p[1,2]", "p[2,1]", "p[2,2]", "p[3,1]", "p[3,2]", "p[4,1]", "p[4,2]"),
    ),
    Example(
        "hand_that_samples",
        "TestModels/movingGroundRobotTest, doublePendulum2DControl",
        planar(
            "Body link[2](m = {2, 1} kg, J = {0.1, 0.05} kg.m^2, com = {{0.25, 0}, {0.2, 0}} m);",
            "parameter Angle first[2] = {0, 0.3} rad;",
            "Revolute joint[i in 1:2]((if i == 1 then world else link[1].a * trans({0.5, 0} m)) -> link[i].a,",
            "                         angle = first[i], der(angle) = 0 rad/s);",
            "parameter Angle aim[2] = {0.5, -0.4} rad;",
            "parameter RotationalStiffness k[2] = {60, 20} N.m/rad;",
            "parameter RotationalDamping d[2] = {4, 1} N.m.s;",
            "discrete Torque u[2] = 0 N.m;",
            "for i in 1:2 loop",
            "  when sample(20 ms) then",
            "    u[i] := k[i]*(aim[i] - joint[i].angle) - d[i]*der(joint[i].angle);",
            "  end when;",
            "  force u[i] on joint[i].angle;",
            "end for;",
        ),
        ("joint[1].angle", "joint[2].angle"),
    ),
    Example(
        "rod_that_is_let_go",
        "Examples/switchingConstraintsPendulum",
        planar(
            "Body rod(m = 12 kg, J = 1 kg.m^2);",
            "Particle ball(m = 2 kg);",
            "Free f(world -> rod.a, x = -0.5 m, y = 0 m, angle = 0 rad, der(x) = 0 m/s, der(y) = 2 m/s, der(angle) = 4 rad/s);",
            "Translation t(world -> ball.a, position = {-0.5, 0} m, der(position) = {0, 2} m/s);",
            "constraint hold: pos(ball.a) = pos(rod.a);",
            "cut Revolute hinge(world * trans({-1, 0} m) -> rod.a * trans({-0.5, 0} m));",
            "when time >= 0.1 s then",
            "  release hold;",
            "end when;",
            "when time >= 0.3 s then",
            "  release hinge;",
            "end when;",
            "output c[3, 2] = {pos(rod.a), pos(ball.a), pos(rod.a * trans({1, 0} m))};",
        ),
        cells("c", 3, 2),
    ),
    Example(
        "three_wheeler",
        "TestModels/rollingDiscTangentialForces",
        spatial(
            "parameter Length r = 0.3 m;",
            "Body chassis(m = 20 kg, J = diag({1, 2, 2.5} kg.m^2), com = {0.4, 0, 0.2} m);",
            "Body fork(m = 2 kg, J = diag({0.05, 0.06, 0.03} kg.m^2), com = {0, 0, -0.1} m);",
            "Body wheel[3](m = 1.5 kg, J = diag({0.04, 0.07, 0.04} kg.m^2));",
            "Free f(world -> chassis.a, position = {0, 0, 0.3} m, der(position) ~ {2, 0, 0} m/s, der(orientation) ~ {0, 0, 0} rad/s);",
            "Revolute steer(chassis.a * trans({1, 0, 0.2} m) -> fork.a, axis = {0, 0, 1}, angle = 0 rad, der(angle) = 0 rad/s);",
            "Revolute hub[i in 1:3](if i == 1 then chassis.a * trans({0, 0.4, 0} m)",
            "                       elseif i == 2 then chassis.a * trans({0, -0.4, 0} m) else fork.a * trans({0, 0, -0.2} m)",
            "                       -> wheel[i].a, axis = {0, 1, 0}, angle ~ 0 rad);",
            "RollingDisk rolls[3](world -> wheel.a, r = r, axis = {0, 1, 0});",
            "initial der(hub[1].angle) = (2/0.3) rad/s;",
            "potential 1/2*40 N.m*(steer.angle - 0.4 rad)^2;",
            "damping 4 N.m.s on steer.angle;",
            "torque {0, 3, 0} N.m on wheel[1].a in wheel[1].a;",
            "output p[5, 3] = {mass_centre(chassis.a), mass_centre(fork.a), pos(wheel[1].a), pos(wheel[2].a), pos(wheel[3].a)};",
        ),
        cells("p", 5, 3),
    ),
    Example(
        "pin_in_a_slot",
        "TestModels/scissorPrismaticRevolute2D",
        planar(
            "Body arm(m = 2 kg, J = 0.15 kg.m^2, com = {0.45, 0} m);",
            "Body crank(m = 1 kg, J = 0.01 kg.m^2, com = {0.1, 0} m);",
            "Revolute foot(world -> arm.a, angle ~ atan(2.5), der(angle) ~ 0 rad/s);",
            "Revolute main(world * trans({0, 0.5} m) -> crank.a, angle = 0 rad, der(angle) = 0 rad/s);",
            "cut PinSlot slot(arm.a -> crank.a * trans({0.2, 0} m));",
            "torque 5 N.m on crank.a;",
            "output c[2, 2] = {mass_centre(arm.a), mass_centre(crank.a)};",
        ),
        cells("c", 2, 2),
    ),
    Example(
        "bead_on_a_curve",
        "TestModels/coordinateVectorConstraint; Examples/contactCurvePolynomial, contactCurveWithLongCurve",
        """import mech.planar.*;
import mech.couplings.*;
model Wire
  extends PointOnCurve;
  let off = p[2] - p[1]^2/2 m - 0.1 m*sin(p[1]*3 m^-1);
end Wire;
model Bead
  gravity {0, -9.81} m/s^2;
  Particle bead(m = 2 kg);
  Translation t(world -> bead.a, position = {1, 0.5 + 0.1*sin(3)} m, der(position) ~ {0, 0} m/s);
  Wire wire(world -> bead.a);
end Bead;""",
        xy("t.position"),
    ),
    Example(
        "disc_on_a_slope",
        "TestModels/createRollingDiscTest",
        spatial(
            "frame slope = world * roty(0.3 rad);",
            "Body b(m = 3 kg, J = diag({0.04, 0.07, 0.04} kg.m^2));",
            "Free f(slope -> b.a, position = {0, 0, 0.2} m, der(position) ~ {0.8, -0.1, 0} m/s, der(orientation) = {0.5, 4, 1} rad/s);",
            "RollingDisk rolls(slope -> b.a, r = 0.2 m, axis = {0, 1, 0});",
            "output p[3] = pos(b.a);",
            "output w[3] = der(f.orientation);",
        ),
        xyz("p", "w"),
    ),
    Example(
        "joint_that_moves",
        "TestModels/genericJointUserFunctionTest",
        spatial(
            "Body b(m = 2 kg, J = diag({0.02, 0.1, 0.1} kg.m^2), com = {0.3, 0, 0} m);",
            "frame held;",
            "Translation t(world -> held);",
            "drive t.position[1] = 0.1 m*sin(4 rad/s*time);",
            "drive t.position[2] = 0 m;",
            "drive t.position[3] = 0.05 m*(1 - cos(3 rad/s*time));",
            "Revolute hinge(held -> b.a, axis = {0, 1, 0}, angle = 0 rad, der(angle) = 0 rad/s);",
            "output c[2, 3] = {pos(held), mass_centre(b.a)};",
        ),
        cells("c", 2, 3),
    ),
    Example(
        "geared_motor",
        "TestModels/driveTrainTest; Examples/serialRobotInteractiveLimits",
        """import mech.spatial.*;
import mech.rotational.{Rotor, Gear};
gravity {0, 0, -9.81} m/s^2;
Body a(m = 4 kg, J = diag({0.01, 0.1, 0.1} kg.m^2), com = {0.25, 0, 0} m);
Body b(m = 2 kg, J = diag({0.01, 0.05, 0.05} kg.m^2), com = {0.2, 0, 0} m);
Revolute one(world -> a.a, axis = {0, 1, 0}, angle ~ 0 rad, der(angle) ~ 0 rad/s);
Revolute two(a.a * trans({0.5, 0, 0} m) -> b.a, axis = {0, 1, 0}, angle = 0 rad, der(angle) = 0 rad/s);
Rotor rotor(J = 0.002 kg.m^2, angle = 0 rad, der(angle) = 0 rad/s);
Gear gear(rotor.angle -> one.angle, ratio = -50);
force 0.02 N.m.s*(150 rad/s - der(rotor.angle)) on rotor.angle;""",
        ("one.angle", "two.angle", "rotor.angle"),
    ),
    Example(
        "lopsided_body",
        "TestModels/rigidBodyCOMtest, rigidBodyAsUserFunctionTest",
        spatial(
            "import mech.elements.*;",
            "Body b(m = 4 kg, J = {{0.3, 0.05, -0.02}, {0.05, 0.4, 0.03}, {-0.02, 0.03, 0.5}} kg.m^2, com = {0.1, 0.2, -0.1} m);",
            "Free f(world -> b.a, position = {0, 0, 0} m, der(position) = {0.2, 0, 0.1} m/s, der(orientation) = {1, -2, 0.5} rad/s);",
            "CartesianSpring one(world -> b.a * trans({0.3, 0, 0.2} m), k = {300, 400, 500} N/m, c = {3, 4, 5} N.s/m, rest = {0.3, 0, 0.2} m);",
            "CartesianSpring two(world -> b.a * trans({-0.3, 0.2, 0} m), k = {400, 300, 300} N/m, c = {4, 3, 3} N.s/m, rest = {-0.3, 0.2, 0} m);",
            "torque {0.5, 0, 1} N.m on b.a in b.a;",
            "output c[3] = mass_centre(b.a);",
            "output w[3] = der(f.orientation);",
        ),
        xyz("f.position", "c", "w"),
    ),
    Example(
        "follower_on_a_cam",
        "Examples/camFollowerExample; TestModels/contactCurveExample",
        """coordinate Length x = 6 cm;
kinetic 1/2*0.3 kg*der(x)^2;
potential 1/2*1000 N/m*(x - 4 cm)^2;
damping 20 N.s/m on x;
parameter Length r[2] = {50, 35} mm;
parameter Length e[2] = {0, 25} mm;
for i in 1:2 loop
  force 2e5 N/m*max(r[i] + e[i]*cos(4 rev/s*time) - x, 0 m) on x;
end for;""",
        ("x",),
    ),
    Example(
        "six_bars",
        "TestModels/PARTS_ATEs_moving",
        planar(
            "Body crank(m = 1 kg, J = 0.01 kg.m^2, com = {0.1, 0} m);",
            "Body rod(m = 2 kg, J = 0.05 kg.m^2, com = {0.25, 0} m);",
            "Body rocker(m = 1 kg, J = 0.02 kg.m^2, com = {0.2, 0} m);",
            "Body link(m = 1 kg, J = 0.03 kg.m^2, com = {0.25, 0} m);",
            "Body arm(m = 1 kg, J = 0.02 kg.m^2, com = {0.2, 0} m);",
            "Revolute j1(world -> crank.a, angle = 1 rad, der(angle) = 0 rad/s);",
            "Revolute j2(crank.a * trans({0.2, 0} m) -> rod.a, angle ~ -0.5 rad, der(angle) ~ 0 rad/s);",
            "Revolute j3(world * trans({0.6, 0} m) -> rocker.a, angle ~ 1.6 rad, der(angle) ~ 0 rad/s);",
            "cut Revolute j4(rod.a * trans({0.5, 0} m) -> rocker.a * trans({0.4, 0} m));",
            "Revolute j5(rod.a * trans({0.25, 0.15} m) -> link.a, angle ~ 0.5 rad, der(angle) ~ 0 rad/s);",
            "Revolute j6(world * trans({0.9, 0.6} m) -> arm.a, angle ~ 2.2 rad, der(angle) ~ 0 rad/s);",
            "cut Revolute j7(link.a * trans({0.5, 0} m) -> arm.a * trans({0.4, 0} m));",
            "torque 6 N.m on crank.a;",
            "output c[5, 2] = {mass_centre(crank.a), mass_centre(rod.a), mass_centre(rocker.a), mass_centre(link.a), mass_centre(arm.a)};",
        ),
        cells("c", 5, 2),
    ),
    Example(
        "plate_on_posts",
        "TestModels/sphericalJointTest; Examples/rigid3Dexample",
        spatial(
            "Body b(m = 3 kg, J = diag({0.1, 0.2, 0.28} kg.m^2));",
            "Free f(world -> b.a, position = {0, 0, 0} m, der(position) = {0, 0, 0} m/s, der(orientation) = {0.5, 0, 0} rad/s);",
            "cut PointOnLine post(world * trans({-0.4, 0, 0} m) -> b.a * trans({-0.4, 0, 0} m), axis = {0, 0, 1});",
            "PointOnPlane wall(world * rotx(90 deg) -> b.a * trans({0.4, 0, 0} m));",
            "parameter Length foot[3, 3] = {{-0.4, 0, 0}, {0.4, 0, 0}, {0, 0.3, 0}} m;",
            "parameter Stiffness k[3] = {400, 600, 300} N/m;",
            "let Length height[i in 1:3] = pos(b.a * trans(foot[i, :]))[3];",
            "for i in 1:3 loop",
            "  potential 1/2*k[i]*height[i]^2;",
            "  damping 2 N.s/m on height[i];",
            "end for;",
            "output p[3] = pos(b.a * trans({0, 1, 0} m));",
            "output w[3] = der(f.orientation);",
        ),
        xyz("f.position", "p", "w"),
    ),
    Example(
        "car_on_soft_wheels",
        "TestModels/carRollingDiscTest, createRollingDiscPenaltyTest",
        soft(
            "parameter Mass m = 500 kg/m^3*pi*(0.4 m)^2*0.1 m;",
            "parameter Inertia J = m*0.49 m^2/12;",
            "parameter Length at[4, 3] = {{-1, -1.5, 0}, {1, -1.5, 0}, {-1, 1.5, 0}, {1, 1.5, 0}} m;",
            "parameter Angle turn[4] = {0, 0, 0.2, 0.15} rad;",
            "Body car(m = 500 kg, J = box(500 kg, 2 m, 3 m, 0.4 m));",
            "Body wheel[4](m = m, J = diag({m*0.08 m^2, J, J}));",
            "Free f(world -> car.a, position = {0, 0, 0.4} m, der(position) = {0, 3, 0} m/s, der(orientation) = {0, 0, 0} rad/s);",
            "Revolute hub[i in 1:4](car.a * trans(at[i, :]) * rotz(turn[i]) -> wheel[i].a, axis = {1, 0, 0},",
            "                       angle = 0 rad, der(angle) = (-3/0.4) rad/s);",
            "SoftDisc ground[4](to = wheel.a);",
            "for i in 1:2 loop",
            "  torque {-200, 0, 0} N.m on wheel[i].a in wheel[i].a;",
            "end for;",
            "output p[5, 3] = {(if i == 1 then pos(car.a) else pos(wheel[i - 1].a))[k] for i in 1:5, k in 1:3};",
            "output w[3] = components(wheel[1].a, angvel(wheel[1].a));",
        ),
        cells("p", 5, 3) + elements("w", 3),
    ),
    Example(
        "wheels_with_rollers",
        "TestModels/mecanumWheelRollingDiscTest, laserScannerTest; Examples/mobileMecanumWheelRobotWithLidar",
        soft(
            "parameter Mass m = 500 kg/m^3*pi*(0.4 m)^2*0.2 m;",
            "parameter Inertia J = m*0.52 m^2/12;",
            "parameter Length at[4, 3] = {{-1.5, -1.5, 0}, {1.5, -1.5, 0}, {-1.5, 1.5, 0}, {1.5, 1.5, 0}} m;",
            "parameter Torque M[4] = {100, -60, -80, 120} N.m;",
            "Body car(m = 500 kg, J = box(500 kg, 3 m, 3 m, 0.4 m));",
            "Body wheel[4](m = m, J = diag({m*0.08 m^2, J, J}));",
            "Free f(world -> car.a, position = {0, 0, 0.4} m, der(position) = {0, 0, 0} m/s, der(orientation) = {0, 0, 0} rad/s);",
            "Revolute hub[i in 1:4](car.a * trans(at[i, :]) -> wheel[i].a, axis = {1, 0, 0}, angle = 0 rad, der(angle) = 0 rad/s);",
            "SoftDisc ground[4](to = wheel.a, mu = {1, 0}, lean = {-45, 45, 45, -45} deg);",
            "for i in 1:4 loop",
            "  torque {M[i], 0 N.m, 0 N.m} on wheel[i].a in wheel[i].a;",
            "end for;",
            "output p[5, 3] = {(if i == 1 then pos(car.a) else pos(wheel[i - 1].a))[k] for i in 1:5, k in 1:3};",
            "output w[3] = der(f.orientation);",
        ),
        cells("p", 5, 3) + elements("w", 3),
    ),
    Example(
        "coin_on_soft_ground",
        "TestModels/rollingCoinPenaltyTest",
        soft(
            "Body coin(m = 2 kg, J = diag({0.04, 0.02, 0.02} kg.m^2));",
            "Free f(world -> coin.a, position = {0, 0, 0.2*cos(0.2)} m, der(position) = {0, 1.6, 0} m/s,",
            "       orientation = roty(0.2 rad), der(orientation) = {-8 + sin(0.2), 0, -cos(0.2)} rad/s);",
            "SoftDisc ground(to = coin.a, r = 0.2 m, c = 100 N.s/m, mu = {0.8, 0.6});",
            "output w[3] = der(f.orientation);",
        ),
        xyz("f.position", "w"),
    ),
    Example(
        "ten_links",
        "TestModels/createKinematicTreeTest; Examples/kinematicTreePendulum",
        spatial(
            "Body link[10](m = 1 kg, J = diag({0.001, 0.01, 0.01} kg.m^2), com = {0.15, 0.01, 0} m);",
            "Revolute joint[i in 1:10]((if i == 1 then world else link[i - 1].a * trans({0.3, 0, 0} m)) -> link[i].a,",
            "    axis = (if mod(i, 2) == 1 then {0, 0, 1} else {0, 1, 0}), angle = 0 rad,",
            "    der(angle) = if i == 1 then 1 rad/s else 0 rad/s);",
        ),
        tuple(f"joint[{k}].angle" for k in range(1, 11)),
    ),
)
