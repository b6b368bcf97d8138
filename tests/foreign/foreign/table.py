"""The table: every system of SymPy's tests of mechanics and of PyDy's examples, and why some are not compared."""

from __future__ import annotations

from foreign import bicycle, bodies, joints, kane_levinson, large, linear, oscillators, pendulums, rolling
from foreign.case import System, Waiting

SYSTEMS: tuple[System, ...] = (
    *oscillators.SYSTEMS,
    *pendulums.SYSTEMS,
    *rolling.SYSTEMS,
    *bodies.SYSTEMS,
    *joints.SYSTEMS,
    *kane_levinson.SYSTEMS,
    *large.SYSTEMS,
    *bicycle.SYSTEMS,
    *linear.SYSTEMS,
)

WAITING: tuple[Waiting, ...] = (
    Waiting(
        "particle on a rod that also turns about itself",
        "SymPy test_kane: test_issue_24887",
        "a coordinate without any mass. SymPy's mass matrix is singular: three angles of a particle, of which the turn about the "
        "rod moves nothing. mechc refuses it (E0520)",
    ),
    Waiting(
        "musculotendon units",
        "SymPy physics.biomechanics (not part of these tests)",
        "a length that is found from a balance of forces within the motion",
    ),
)
"""What the language lacks."""

NO_MOTION: tuple[Waiting, ...] = (
    Waiting(
        "generalised forces of a disc without mass",
        "SymPy test_kane2: test_sub_qdot2; PyDy Kane1985 Ex8.3",
        "no bodies: the disc itself is compared above",
    ),
    Waiting(
        "constraints that are not linear in velocities",
        "SymPy test_linearity_of_velocity_constraints: test_linearity_of_motion_constraints",
        "both refuse it",
    ),
    Waiting(
        "wrong arguments, classes, printing",
        "SymPy test_kane, test_lagrange: test_invalid_coordinates; test_system, test_system_class, test_method, test_actuator, "
        "test_pathway: constructors and their errors",
        "about the interface in Python",
    ),
    Waiting(
        "parts of formulas",
        "SymPy test_body, test_functions, test_inertia, test_loads, test_particle, test_rigidbody",
        "momenta, energies, mass centres and inertias of bodies given as formulas: no equations of motion. What test_body moves, "
        "a block with two pendulums and a cart with a pole, is compared above",
    ),
    Waiting(
        "places and velocities of joints",
        "SymPy test_joint: the other joints; test_jointsmethod: errors",
        "kinematics alone; ball joints have three angles in SymPy, a quaternion in the library: Astrobee and the free body are "
        "written with both",
    ),
    Waiting(
        "lengths of geodesics",
        "SymPy test_wrapping_geometry",
        "geometry alone; strings on a cylinder and on a sphere pull a bead above",
    ),
    Waiting(
        "kinematics of robots",
        "PyDy antropomorphic_robot, body_with_arm, differential_drive, scara_arm: Kinematics; Kane1985 chapters 2 and 3, Ex11.3, "
        "kane-levinson-1985-chapter-02, -03, inertia_of_torus",
        "angular velocities, inertias, places: no equations of motion",
    ),
    Waiting(
        "forces at rest, energies and generalised forces",
        "PyDy Kane1985 chapters 4 and 5, but for the exercises above",
        "no equations of motion",
    ),
    Waiting(
        "how to compute",
        "PyDy language_templates, parallel-execution, tutorials",
        "about tools",
    ),
)
"""What is not a system, or has no motion to compare."""
