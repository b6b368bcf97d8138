"""Systems of points, coordinates and states of the first order; their numbers are made by ``exudyn/exudyn_masses.py``."""

from __future__ import annotations

from collections.abc import Sequence

from foreign.exudyn_case import Example, xy, xyz

CORNERS = [(x, y, z) for x in (0, 0.1, 0.2) for y in (0, 0.2) for z in (0, 0.2)]
PAIRS = [
    (a + 1, b + 1)
    for a in range(12)
    for b in range(max(a + 1, 4), 12)
    if sum((p - q) ** 2 for p, q in zip(CORNERS[a], CORNERS[b], strict=True)) < 0.23**2
]


def matrix(rows: Sequence[Sequence[float]]) -> str:
    return "{" + ", ".join("{" + ", ".join(map(str, row)) + "}" for row in rows) + "}"


SYSTEMS = (
    Example(
        "spring_for_two_seconds",
        "TestModels/velocityVerletTest, manualExplicitIntegrator",
        """coordinate Length x = 0 m;
initial der(x) = 1 m/s;
kinetic 1/2*10 kg*der(x)^2;
potential 1/2*1000 N/m*x^2;""",
        ("x",),
    ),
    Example(
        "hardening_spring",
        "TestModels/MiniExamples/ObjectConnectorCoordinateSpringDamper",
        """parameter k = 5000 N/m;
coordinate Length x = 0 m;
kinetic 1/2*5 kg*der(x)^2;
potential 0.1*1/2*k*x^2 + 1/4*k*x^4/1 m^2;
damping 80 N.s/m on x;
force 1 N on x;""",
        ("x",),
    ),
    Example(
        "slider_on_a_spring",
        "TestModels/MiniExamples/ObjectConnectorLinearSpringDamper",
        """import mech.spatial.*;
Body b(m = 1 kg, J = identity(3)*1 kg.m^2);
Prismatic slide(world -> b.a, axis = {1, 0, 0}, position = 0 m, der(position) = 0 m/s);
potential 1/2*2000 N/m*slide.position^2;
damping 20 N.s/m on slide.position;
force {1, 0, 0} N on b.a;""",
        ("slide.position",),
    ),
    Example(
        "twelve_in_a_row",
        "Examples/nMassOscillatorInteractive, ComputeSensitivitiesExample",
        """coordinate Length x[12] = 0 m;
let Length stretch[i in 1:12] = x[i] - (if i == 1 then 0 m else x[i - 1]);
kinetic 1/2*1 kg*dot(der(x), der(x));
for i in 1:12 loop
  potential 1/2*800 N/m*stretch[i]^2;
  damping 2 N.s/m on stretch[i];
end for;
force 10 N*sin(3.55 rad/s*time) on x[12];""",
        tuple(f"x[{k}]" for k in range(1, 13)),
    ),
    Example(
        "thrown",
        "TestModels/MiniExamples/LoadMassProportional, ObjectMassPoint, ObjectMassPoint2D; TestModels/mainSystemExtensionsTests",
        """import mech.spatial.*;
gravity {0, 0, -9.81} m/s^2;
Particle p(m = 2 kg);
Translation t(world -> p.a, position = {1, 0, 0} m, der(position) = {2, 5, 0.5} m/s);""",
        xyz("t.position"),
    ),
    Example(
        "seen_from_the_origin",
        "TestModels/sensorUserFunctionTest",
        """import mech.spatial.*;
Particle p(m = 1 kg);
Translation t(world -> p.a, position = {1, 0, 0} m, der(position) = {0, 1, 0} m/s);
output Angle seen = atan2(t.position[2], t.position[1]);""",
        ("seen",),
    ),
    Example(
        "hard_springs_in_space",
        "Examples/cartesianSpringDamperUserFunction",
        """import mech.spatial.*;
gravity {0, 0, -9.81} m/s^2;
Particle p(m = 5 kg);
Translation t(world -> p.a, position = {0, 0, 0} m, der(position) = {0.8, -0.6, 0.5} m/s);
parameter Stiffness k[3] = {300, 400, 500} N/m;
parameter Damping c[3] = {3, 4, 5} N.s/m;
for i in 1:3 loop
  potential k[i]*(t.position[i]^2/2 + 20 m^-2*t.position[i]^4/4);
  damping c[i] on t.position[i];
end for;""",
        xyz("t.position"),
    ),
    Example(
        "friction_that_weakens",
        "Examples/springMassFriction",
        """coordinate Length x = 0 m;
kinetic 1/2*1 kg*der(x)^2;
potential 1/2*1600 N/m*x^2;
let v = der(x)/1 m/s;
force 120 N + 80 N*cos(1 rev/s*time) - 20 N*(1 + 0.5*exp(-abs(v)))*tanh(v/0.1) on x;""",
        ("x",),
    ),
    Example(
        "mass_on_a_band",
        "Examples/massSpringFrictionInteractive",
        """coordinate Length x = 0 m;
initial der(x) = 4 m/s;
kinetic 1/2*0.5 kg*der(x)^2;
potential 1/2*400 N/m*x^2;
damping 0.05 N.s/m on x;
let slip = der(x)/1 m/s - 4;
force -(40 N + 10 N*exp(-abs(slip)/0.5))*tanh(slip/0.1) on x;""",
        ("x",),
    ),
    Example(
        "bristles",
        "Examples/lugreFrictionODE1, lugreFrictionTest",
        """parameter k = 1e5 N/m;
coordinate Length x = 0 m;
state Length z = 0 m;
kinetic 1/2*1 kg*der(x)^2;
let limit = 1 N + 0.5 N*exp(-(der(x)/1 mm/s)^2);
equation der(z) = der(x) - z*abs(der(x))*k/limit;
force 2 N/m*(0.1 m/s*time - x) - k*z - sqrt(1e5) N.s/m*der(z) - 0.4 N.s/m*der(x) on x;""",
        ("x", "der(x)", "z"),
    ),
    Example(
        "floor_that_gives",
        "TestModels/contactCoordinateTest, postNewtonStepContactTest",
        """coordinate Length y = 0.05 m;
kinetic 1/2*0.25 kg*der(y)^2;
potential 0.25 kg*9.81 m/s^2*y;
force 20000 N/m*max(-y, 0 m) on y;""",
        ("y",),
    ),
    Example(
        "stops_at_both_ends",
        "TestModels/coordinateSpringDamperExt",
        """coordinate Length x = 0 m;
initial der(x) = 10 m/s;
kinetic 1/2*0.5 kg*der(x)^2;
potential 1/2*100 N/m*x^2;
damping 0.5 N.s/m on x;
force -1e4 N/m*deadzone(x, 0.9 m)*(1 + 0.05 s/m*abs(der(x))) on x;""",
        ("x",),
    ),
    Example(
        "soft_mesh",
        "TestModels/coordinateSpringDamperExt, Examples/coordinateSpringDamper",
        """coordinate Angle a = 0 rad;
coordinate Angle b;
initial der(a) = 1 rev/s;
kinetic 1/2*1 kg.m^2*(der(a)^2 + der(b)^2);
drive b = -1 rev/s*time/3;
potential 1/2*1e3 N.m*(a/3 + b)^2;
damping 10 N.m.s on a/3 + b;
force -10 N.m on a;""",
        ("a", "b"),
    ),
    Example(
        "three_stars",
        "TestModels/connectorGravityTest",
        """import mech.spatial.*;
parameter Mass m[3] = {4, 1, 2} kg;
Particle p[3](m = m);
Translation t[3](world -> p.a, position = {{0, 0, 0}, {1, 0, 0}, {0, 1.5, 0.3}} m,
                 der(position) = {{0, -0.3, 0.02}, {0, 1, 0}, {-0.6, 0, 0.1}} m/s);
for i in 1:2 loop
  for j in i + 1:3 loop
    potential -0.25 N.m^2/kg^2*m[i]*m[j]/norm(t[i].position - t[j].position);
  end for;
end for;""",
        xyz("t[1].position", "t[2].position", "t[3].position"),
    ),
    Example(
        "balls_that_meet",
        "TestModels/createContactSphereSphere, generalContactSpheresTest; Examples/symbolicUserFunctionMasses",
        """import mech.spatial.*;
Particle p[3](m = {1, 1.5, 2} kg);
Translation t[3](world -> p.a, position = {{-0.5, 0, 0}, {0.5, 0.1, 0}, {0, -0.4, 0.05}} m,
                 der(position) = {{1, 0.05, 0}, {-1, 0, 0.05}, {0, 1, 0}} m/s);
for i in 1:2 loop
  for j in i + 1:3 loop
    potential 0.4*3e4 N/m^1.5*max(0.2 m - norm(t[i].position - t[j].position), 0 m)^2.5;
  end for;
end for;""",
        xyz("t[1].position", "t[2].position", "t[3].position"),
    ),
    Example(
        "cradle",
        "Examples/newtonsCradle",
        """import mech.planar.*;
gravity {0, -9.81} m/s^2;
parameter Length r = 2 cm;
parameter m = 7800 kg/m^3*4/3*pi*r^3;
Body ball[3](m = m, J = 0.4*m*r^2, com = {0, -0.25} m);
Revolute hook[i in 1:3](world * trans({2.04*r*(i - 1), 0 m}) -> ball[i].a,
                        angle = if i == 3 then 1 rad else 0 rad, der(angle) = 0 rad/s);
let Length gap[i in 1:2] = norm(mass_centre(ball[i + 1].a) - mass_centre(ball[i].a)) - 2*r;
potential sum(0.4*1e6 N/m^1.5*max(-gap[i], 0 m)^2.5 for i in 1:2);""",
        tuple(f"hook[{k}].angle" for k in (1, 2, 3)),
    ),
    Example(
        "block_of_points",
        "Examples/symbolicUserFunctionMasses, SpringDamperMasspointSystem",
        f"""gravity {{0, -9.81, 0}} m/s^2;
structural parameter Length corner[12, 3] = {matrix(CORNERS)} m;
structural parameter Integer pair[{len(PAIRS)}, 2] = {matrix(PAIRS)};
coordinate Length p[8, 3] = corner[5:12, :];
for i in 1:8 loop
  mass 0.1 kg at world * p[i, :];
end for;
let Length all[:, :] = concat(corner[1:4, :], p);
for s in 1:{len(PAIRS)} loop
  potential 1/2*200 N/m*(norm(all[pair[s, 2], :] - all[pair[s, 1], :])
                         - norm(corner[pair[s, 2], :] - corner[pair[s, 1], :]))^2;
  damping 0.1 N.s/m on norm(all[pair[s, 2], :] - all[pair[s, 1], :]);
end for;""",
        tuple(f"p[{i},{k}]" for i in range(5, 9) for k in (1, 2, 3)),
    ),
    Example(
        "train_of_gears",
        "TestModels/driveTrainTest",
        """import mech.rotational.*;
Rotor a(J = 0.3 kg.m^2, angle = 0 rad, der(angle) = 0 rad/s);
Rotor b(J = 0.004 kg.m^2);
Rotor c(J = 0.3 kg.m^2);
Rotor d(J = 0.004 kg.m^2);
Rotor e(J = 0.5 kg.m^2, angle = 0 rad, der(angle) = 0 rad/s);
Gear first(a.angle -> b.angle, ratio = -1/3);
constraint c.angle = b.angle;
Gear second(c.angle -> d.angle, ratio = -1/3);
SpringDamper shaft(d.angle -> e.angle, k = 50 N.m/rad, c = 0.2 N.m.s);
force 40 N.m*sin(4 rad/s*time) on a.angle;""",
        tuple(f"{n}.angle" for n in "abcde"),
    ),
    Example(
        "two_points_on_functions",
        "TestModels/coordinateVectorConstraintGenericODE2, coordinateVectorConstraint",
        """gravity {0, -9.81} m/s^2;
coordinate Length a[2] = {0.8, 0} m;
coordinate Length b[2] = {1.6, 0} m;
initial der(a) ~ {0, 0} m/s;
initial der(b) ~ {0, 0} m/s;
mass 2.5 kg at world * a;
mass 2.5 kg at world * b;
constraint norm(a) = 0.8 m;
constraint norm(b - a) = 0.8 m;""",
        xy("a", "b"),
    ),
    Example(
        "hung_on_a_moving_end",
        "Examples/SpringWithConstraints, lugreFrictionTest",
        """coordinate Length a;
coordinate Length b = 0 m;
drive a = 5 cm*sin(4 rad/s*time);
kinetic 1/2*1 kg*der(a)^2 + 1/2*2 kg*der(b)^2;
potential 1/2*100 N/m*(b - a)^2 + 2 kg*9.81 m/s^2*b;
damping 1 N.s/m on b - a;""",
        ("a", "b"),
    ),
    Example(
        "pendulum_of_a_point",
        "Examples/pendulumIftommBenchmark, pendulumVerify",
        """gravity {0, -9.81} m/s^2;
coordinate Length p[2] = {-1, 0} m;
initial der(p) ~ {0, 0} m/s;
mass 1 kg at world * p;
constraint norm(p) = 1 m;""",
        xy("p"),
    ),
)
