"""The first systems: elements alone and in pairs; their numbers are made by ``exudyn/exudyn_first.py``."""

from __future__ import annotations

from foreign.exudyn_case import Example, planar, spatial, xy, xyz

SYSTEMS = (
    Example(
        "mass_spring_damper",
        "Examples/springDamperTutorial, springDamperTutorialNew, SpringDamperMassUserFunction; TestModels/springDamperUserFunctionTest",
        """coordinate Length x = -0.08 m;
initial der(x) = 1 m/s;
kinetic 1/2*1.6 kg*der(x)^2;
potential 1/2*4000 N/m*x^2;
damping 8 N.s/m on x;
force 80 N on x;""",
        ("x",),
    ),
    Example(
        "cartesian_springs",
        "Examples/cartesianSpringDamper; TestModels/ObjectConnectorCartesianSpringDamper",
        spatial(
            "Particle p(m = 5 kg);",
            "Translation t(world -> p.a, position = {0, 0, 0} m, der(position) = {0.3, -0.2, 0.1} m/s);",
            "parameter k[3] = {300, 400, 500} N/m;",
            "parameter c[3] = {3, 4, 5} N.s/m;",
            "for i in 1:3 loop",
            "  potential 1/2*k[i]*t.position[i]^2;",
            "  damping c[i] on t.position[i];",
            "end for;",
        ),
        xyz("t.position"),
    ),
    Example(
        "two_on_springs",
        "TestModels/ObjectConnectorSpringDamper, sparseMatrixSpringDamperTest; Examples/SpringDamperMasspointSystem",
        spatial(
            "Particle a(m = 2 kg);",
            "Particle b(m = 1 kg);",
            "Translation ta(world -> a.a, position = {1, 0, 0} m, der(position) = {0, 1, 0} m/s);",
            "Translation tb(world -> b.a, position = {1, 1, 0} m, der(position) = {0, 0, 0.5} m/s);",
            "Spring s1(world -> a.a, k = 2000 N/m, rest = 1 m);",
            "Damper d1(world -> a.a, c = 2 N.s/m);",
            "Spring s2(a.a -> b.a, k = 1000 N/m, rest = 1 m);",
            "Damper d2(a.a -> b.a, c = 1 N.s/m);",
        ),
        xyz("ta.position", "tb.position"),
    ),
    Example(
        "free_rotation",
        "Examples/gyroStability; TestModels/explicitLieGroupIntegratorTest",
        """import mech.spatial.*;
Body b(m = 10 kg, J = diag({1, 2, 3} kg.m^2));
Spherical s(world -> b.a, orientation = rotx(0 deg), der(orientation) = {0.01, 5, 0.02} rad/s);
output w[3] = der(s.orientation);
output e[3] = direction(b.a, {1, 0, 0});""",
        xyz("w", "e"),
    ),
    Example(
        "heavy_top",
        "TestModels/heavyTop, LieGroupIntegrationUnitTests, explicitLieGroupMBSTest",
        spatial(
            "Body b(m = 15 kg, J = diag({0.234375, 0.46875, 0.234375} kg.m^2), com = {0, 1, 0} m);",
            "Spherical s(world -> b.a, orientation = rotx(0 deg), der(orientation) = {0, 150, -4.61538} rad/s);",
            "output c[3] = pos(b.a * trans({0, 1, 0} m));",
        ),
        xyz("c"),
    ),
    Example(
        "skew_double_pendulum",
        "TestModels/createFunctionsTest, jointArgsTest; Examples/addRevoluteJoint, rigidBodyTutorial3, rigidBodyTutorial3withMarkers",
        spatial(
            "Body a(m = 2 kg, J = diag({0.05, 0.4, 0.45} kg.m^2), com = {0.5, 0, 0} m);",
            "Body b(m = 1 kg, J = diag({0.02, 0.1, 0.11} kg.m^2), com = {0.4, 0, 0} m);",
            "Revolute first(world -> a.a, axis = {0, 1, 0}, angle = 0 rad, der(angle) = 0 rad/s);",
            "frame knee = a.a * trans({1, 0, 0} m);",
            "Revolute second(knee -> b.a, axis = {0.6, 0.8, 0}, angle = 0 rad, der(angle) = 0 rad/s);",
            "output ca[3] = pos(a.a * trans({0.5, 0, 0} m));",
            "output cb[3] = pos(b.a * trans({0.4, 0, 0} m));",
        ),
        xyz("ca", "cb"),
    ),
    Example(
        "spinning_on_a_ball_joint",
        "TestModels/sphericalJointTest; Examples/rigidRotor3Dnutation",
        spatial(
            "Body b(m = 1 kg, J = diag({0.02, 0.01, 0.015} kg.m^2), com = {0.3, 0, 0.1} m);",
            "Spherical s(world -> b.a, orientation = rotx(0 deg), der(orientation) = {20, 0, 1} rad/s);",
            "output c[3] = pos(b.a * trans({0.3, 0, 0.1} m));",
            "output w[3] = der(s.orientation);",
        ),
        xyz("c", "w"),
    ),
    Example(
        "slider_on_an_arm",
        "TestModels/revoluteJointPrismaticJointTest; Examples/addPrismaticJoint",
        spatial(
            "Body a(m = 3 kg, J = diag({0.1, 0.5, 0.5} kg.m^2), com = {0.5, 0, 0} m);",
            "Body b(m = 1 kg, J = diag({0.02, 0.03, 0.04} kg.m^2));",
            "Revolute hinge(world -> a.a, axis = {0, 1, 0}, angle = 0 rad, der(angle) = 0 rad/s);",
            "Prismatic slide(a.a -> b.a, position = 0.6 m, der(position) = 0 m/s);",
            "Spring s(world -> b.a, k = 200 N/m, rest = 0.6 m);",
            "Damper d(world -> b.a, c = 2 N.s/m);",
            "output ca[3] = pos(a.a * trans({0.5, 0, 0} m));",
            "output cb[3] = pos(b.a);",
        ),
        xyz("ca", "cb"),
    ),
    Example(
        "masses_at_fixed_distances",
        "TestModels/ObjectConnectorDistance; Examples/3SpringsDistance, pendulum",
        spatial(
            "Particle a(m = 2 kg);",
            "Particle b(m = 1 kg);",
            "Translation ta(world -> a.a, position = {1, 0, 0} m, der(position) = {0, 1, 0} m/s);",
            "Translation tb(world -> b.a, position = {2, 0, 0} m, der(position) = {0, 2, 0} m/s);",
            "constraint norm(ta.position) = 1 m;",
            "constraint norm(tb.position - ta.position) = 1 m;",
        ),
        xyz("ta.position", "tb.position"),
    ),
    Example(
        "four_bars",
        "TestModels/fourBarMechanismTest, fourBarMechanismIftomm; Examples/fourBarMechanism3D",
        planar(
            "Body a(m = 1 kg, J = 0.021 kg.m^2);",
            "Body b(m = 2 kg, J = 0.2 kg.m^2);",
            "Body c(m = 1.5 kg, J = 0.04 kg.m^2);",
            "frame foot = a.a * trans({-0.25, 0} m);",
            "frame left = b.a * trans({-0.5, 0} m);",
            "frame knee = c.a * trans({0.25, 0} m);",
            "Revolute j1(world -> foot, angle = 90 deg, der(angle) = 0 rad/s);",
            "Revolute j2(a.a * trans({0.25, 0} m) -> left, angle ~ -90 deg, der(angle) ~ 0 rad/s);",
            "Revolute j3(b.a * trans({0.5, 0} m) -> knee, angle ~ 90 deg, der(angle) ~ 0 rad/s);",
            "cut Revolute j4(world * trans({1, 0} m) -> c.a * trans({-0.25, 0} m));",
            "torque -0.8 N.m on a.a;",
            "output pa[2] = pos(a.a);",
            "output pb[2] = pos(b.a);",
            "output pc[2] = pos(c.a);",
        ),
        xy("pa", "pb", "pc"),
    ),
    Example(
        "slider_crank",
        "Examples/SliderCrank, slidercrankWithMassSpring; TestModels/sliderCrankFloatingTest",
        planar(
            "Body crank(m = 2 kg, J = 0.03 kg.m^2);",
            "Body rod(m = 1 kg, J = 0.025 kg.m^2);",
            "frame foot = crank.a * trans({-0.1, 0} m);",
            "parameter Length half = sqrt(0.05)*1 m;",
            "frame pin = rod.a * trans({-half, 0 m});",
            "Revolute j1(world -> foot, angle = 90 deg, der(angle) = 0 rad/s);",
            "Revolute j2(crank.a * trans({0.1, 0} m) -> pin, angle ~ -90 deg - atan(0.5), der(angle) ~ 0 rad/s);",
            "point end1 = rod.a * {half, 0 m};",
            "constraint pos(end1)[2] = 0 m;",
            "torque -2 N.m on crank.a;",
            "output pc[2] = pos(crank.a);",
            "output pr[2] = pos(rod.a);",
        ),
        xy("pc", "pr"),
    ),
    Example(
        "torsional_spring",
        "TestModels/ObjectConnectorTorsionalSpringDamper, ObjectRotationalMass1D, driveTrainTest",
        """import mech.spatial.*;
Body b(m = 1 kg, J = diag({0.02, 0.03, 0.05} kg.m^2));
Revolute hinge(world -> b.a, angle = 0 rad, der(angle) = 2 rad/s);
TorsionSpring s(angle = hinge.angle, k = 4 N.m/rad);
TorsionDamper d(angle = hinge.angle, c = 0.02 N.m.s);
torque {0, 0, 0.5} N.m on b.a;
output w = der(hinge.angle);
output e[3] = direction(b.a, {1, 0, 0});""",
        ("w", "e[1]", "e[2]"),
    ),
    Example(
        "body_on_three_springs",
        "TestModels/rigidBodyCOMtest, rigidBodySpringDamperIntrinsic; Examples/rigid3Dexample",
        spatial(
            "Body b(m = 20 kg, J = diag({0.8, 1.2, 1.6} kg.m^2));",
            "Free f(world -> b.a, position = {0, 0, 0} m, der(position) = {0, 0, 0} m/s,",
            "       orientation = rotx(0 deg), der(orientation) = {0.5, -0.4, 1} rad/s);",
            "parameter Length corner[3, 3] = {{0.5, 0.3, 0}, {-0.5, 0.3, 0}, {0, -0.4, 0.1}} m;",
            "parameter k[3] = {2000, 1500, 3000} N/m;",
            "parameter c[3] = {20, 15, 30} N.s/m;",
            "for i in 1:3 loop",
            "  for j in 1:3 loop",
            "    potential 1/2*k[j]*(pos(b.a * trans({corner[i, 1], corner[i, 2], corner[i, 3]}))[j] - corner[i, j])^2;",
            "    damping c[j] on pos(b.a * trans({corner[i, 1], corner[i, 2], corner[i, 3]}))[j];",
            "  end for;",
            "end for;",
            "output place[3] = pos(b.a);",
            "output held[3] = pos(b.a * trans({0.5, 0.3, 0} m));",
        ),
        xyz("place", "held"),
    ),
    Example(
        "gravity_between_two",
        "TestModels/ObjectConnectorGravity, connectorGravityTest",
        """import mech.spatial.*;
Particle a(m = 4 kg);
Particle b(m = 1 kg);
Translation ta(world -> a.a, position = {0, 0, 0} m, der(position) = {0, -0.2, 0} m/s);
Translation tb(world -> b.a, position = {1, 0, 0} m, der(position) = {0, 0.8, 0.1} m/s);
potential -0.25 N.m^2/kg^2*a.m*b.m/norm(tb.position - ta.position);""",
        xyz("ta.position", "tb.position"),
    ),
    Example(
        "pushed_by_a_sine",
        "TestModels/loadUserFunctionTest, mainSystemUserFunctionsTest, rigidBodyAsUserFunctionTest",
        """import mech.spatial.*;
Body b(m = 2 kg, J = diag({0.1, 0.2, 0.25} kg.m^2));
Free f(world -> b.a, position = {0, 0, 0} m, der(position) = {0, 0, 0} m/s,
       orientation = rotx(0 deg), der(orientation) = {0, 0, 0} rad/s);
point grip = b.a * {0.1 m, 0.2 m, 0 m};
force {3 N*sin(5*time/(1 s)), 0 N, 1 N} on grip;
torque {0 N.m, 0.4 N.m*cos(3*time/(1 s)), 0.2 N.m} on b.a;
output place[3] = pos(b.a);
output w[3] = der(f.orientation);""",
        xyz("place", "w"),
    ),
    Example(
        "rolling_coin",
        "TestModels/rollingCoinTest, createRollingDiscTest, rollingDiscTangentialForces",
        spatial(
            "parameter Length r = 0.05 m;",
            "parameter m = 0.2 kg;",
            "Body b(m = m, J = diag({m*r^2/2, m*r^2/4, m*r^2/4}));",
            "Free f(world -> b.a, position = {r*sin(20 deg), 0 m, r*cos(20 deg)}, der(position) ~ {0, 1, 0} m/s,",
            "       orientation = roty(20 deg), der(orientation) = {-20 + 3*sin(20 deg), 0, -3*cos(20 deg)} rad/s);",
            "RollingDisk rolls(world -> b.a, r = r, axis = {1, 0, 0});",
            "output place[3] = pos(b.a);",
        ),
        xyz("place"),
    ),
    Example(
        "sliding_and_turning",
        "TestModels/genericJointUserFunctionTest, ObjectJointRevoluteZ, createFunctionsTest",
        """import mech.spatial.*;
gravity {0, -9.81, -1} m/s^2;
Body b(m = 2 kg, J = diag({0.1, 0.2, 0.15} kg.m^2), com = {0.4, 0, 0.1} m);
Cylindrical j(world -> b.a, axis = {0, 0, 1}, angle = 0 rad, der(angle) = 0 rad/s, position = 0 m, der(position) = 0 m/s);
Spring s(world * trans({0, 0, 1} m) -> b.a * trans({0.4, 0, 0.1} m), k = 50 N/m, rest = 1 m);
output c[3] = pos(b.a * trans({0.4, 0, 0.1} m));
output p[3] = pos(b.a * trans({0.4, 0.5, 0.1} m));""",
        xyz("c", "p"),
    ),
    Example(
        "in_a_plane",
        "TestModels/ObjectRigidBody2D, rigidBody2Dtest, scissorPrismaticRevolute2D",
        planar(
            "Body b(m = 2 kg, J = 0.15 kg.m^2);",
            "Free f(world -> b.a, x = 0.3 m, y = 0.2 m, der(x) = 0.5 m/s, der(y) = 0 m/s, angle = 0 rad, der(angle) = 4 rad/s);",
            "frame tip = b.a * trans({0.2, 0} m);",
            "Spring s(world -> tip, k = 300 N/m, rest = 0.3 m);",
            "Damper d(world -> tip, c = 3 N.s/m);",
            "output c[2] = pos(b.a);",
            "output p[2] = pos(tip);",
        ),
        xy("c", "p"),
    ),
    Example(
        "five_in_a_row",
        "Examples/nMassOscillator, nMassOscillatorEigenmodes; TestModels/perfSpringDamperExplicit, ObjectMass1D",
        """coordinate Length x[5] = 0 m;
for i in 1:5 loop
  kinetic 1/2*(1 + 0.1*(i - 1))*1 kg*der(x[i])^2;
end for;
potential 1/2*800 N/m*x[1]^2;
damping 4 N.s/m on x[1];
for i in 2:5 loop
  potential 1/2*800 N/m*(x[i] - x[i - 1])^2;
  damping 4 N.s/m on x[i] - x[i - 1];
end for;
force 20 N on x[5];""",
        tuple(f"x[{k}]" for k in range(1, 6)),
    ),
    Example(
        "three_link_arm",
        "TestModels/serialRobotTest, kinematicTreeTest, createKinematicTreeTest; Examples/serialRobotTSD, kinematicTreePendulum",
        spatial(
            "Body a(m = 3 kg, J = diag({0.02, 0.1, 0.1} kg.m^2), com = {0.1, 0, 0} m);",
            "Body b(m = 2 kg, J = diag({0.02, 0.1, 0.1} kg.m^2), com = {0.25, 0, 0} m);",
            "Body c(m = 1 kg, J = diag({0.02, 0.1, 0.1} kg.m^2), com = {0.2, 0, 0} m);",
            "Revolute j1(world -> a.a, axis = {0, 0, 1}, angle = 0 rad, der(angle) = 0 rad/s);",
            "Revolute j2(a.a * trans({0.2, 0, 0} m) -> b.a, axis = {0, 1, 0}, angle = 0 rad, der(angle) = 0 rad/s);",
            "Revolute j3(b.a * trans({0.5, 0, 0} m) -> c.a, axis = {0, 1, 0}, angle = 0 rad, der(angle) = 0 rad/s);",
            "torque {0, 0, 1.5} N.m on a.a;",
            "point hand = c.a * {0.4 m, 0 m, 0 m};",
            "force {0, 0, 12} N on hand;",
            "output pa[3] = pos(a.a * trans({0.1, 0, 0} m));",
            "output pb[3] = pos(b.a * trans({0.25, 0, 0} m));",
            "output pc[3] = pos(c.a * trans({0.2, 0, 0} m));",
        ),
        xyz("pa", "pb", "pc"),
    ),
    Example(
        "first_order",
        "TestModels/ObjectGenericODE1, solverExplicitODE1ODE2test",
        """state x = 1;
state y = 0;
state z = -0.5;
equation der(x) = (-x + 4*y)/(1 s);
equation der(y) = (-4*x - y + z + 2)/(1 s);
equation der(z) = (0.5*x - 2*z + 1)/(1 s);""",
        ("x", "y", "z"),
    ),
    Example(
        "three_masses_by_matrices",
        "TestModels/ObjectGenericODE2, genericODE2test, objectGenericODE2Test, linearFEMgenericODE2",
        """parameter Mass M[3, 3] = {{2, 0.1, 0}, {0.1, 3, 0.2}, {0, 0.2, 1}} kg;
parameter Stiffness K[3, 3] = {{200, -100, 0}, {-100, 300, -200}, {0, -200, 200}} N/m;
coordinate Length q[3] = {0.1, 0, -0.2} m;
initial der(q) = {0, 1, 0} m/s;
kinetic 1/2*dot(der(q), M*der(q));
potential 1/2*dot(q, K*q);
dissipation 1/2*(0.004 s)*dot(der(q), K*der(q));
force 5 N on q[2];""",
        ("q[1]", "q[2]", "q[3]"),
    ),
    Example(
        "geared_discs",
        "TestModels/ObjectConnectorCoordinate, ObjectConnectorCoordinateSpringDamper, coordinateVectorConstraint, driveTrainTest",
        """coordinate Angle a = 0 rad;
coordinate Angle b ~ 0 rad;
kinetic 1/2*0.2 kg.m^2*der(a)^2 + 1/2*0.05 kg.m^2*der(b)^2;
constraint -0.4*b = a;
potential 1/2*6 N.m*b^2;
damping 0.1 N.m.s on b;
force 3 N.m on a;""",
        ("a", "b"),
    ),
)
