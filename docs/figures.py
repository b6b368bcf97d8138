"""Make docs/gallery.md, the pictures of the gallery and its page with all of them: ``make gallery``, or
``python docs/figures.py [EXAMPLE ...]``.

One line for each system: rows of the source texts, the example, its test, what the picture shows.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator, Sequence
from functools import cache
from pathlib import Path

import numpy as np
from msgspec import Struct

import mechc
from mechc.lang import ast
from mechc.lang.diagnostics import Reporter
from mechc.lang.parser import parse
from mechc.lang.read import read_source

HERE = Path(__file__).resolve().parent
EXAMPLES = HERE.parent / "examples"
PICTURES = HERE / "gallery"
ALL = PICTURES / "README.md"
"""The page with all pictures, which lies beside them and is not kept."""

SHOWN = (
    "double_pendulum",
    "kepler_four_orbits",
    "pendulum_phase_portrait",
    "cone",
    "string_pendulum",
    "masse_shot",
    "dominoes",
)
"""Examples whose pictures docs/gallery.md shows; they alone are kept."""


class Row(Struct, frozen=True):
    """``y`` against ``x``, for each of the experiments ("" is the default one)."""

    rows: str
    example: str
    test: str
    x: tuple[str, ...]
    y: tuple[str, ...]
    experiments: tuple[str, ...] = ("",)
    stop: float | None = None

    def curves(self) -> tuple[tuple[str, str], ...]:
        """Pair one x with all y, or as many x with as many y."""
        return tuple(zip(self.x if len(self.x) > 1 else self.x * len(self.y), self.y, strict=True))

    def in_a_plane(self) -> bool:
        """Say whether the picture is a path in a plane, to be drawn to one scale."""
        ends = (self.x[0][-2:-1] or self.x[0], self.y[0][-2:-1] or self.y[0])
        return ends in {("x", "y"), ("1", "2"), ("1", "3")}


def row(
    rows: str, example: str, test: str, x: str, y: str, experiments: str = "", stop: float | None = None
) -> Row:
    """Write a row briefly: several names in one text, separated by blanks; ``-`` is the default experiment."""
    chosen = tuple("" if e == "-" else e for e in experiments.split()) or ("",)
    return Row(rows, example, test, tuple(x.split()), tuple(y.split()), chosen, stop)


def stars(axis: int) -> str:
    return " ".join(f"r[{i},{axis}]" for i in range(1, 8))


PENDULUMS, DOUBLE, DRIVEN = "test_pendulums.py", "test_double_pendulums.py", "test_driven_pendulums.py"
LINEAR, NONLINEAR, CENTRAL = "test_oscillators.py", "test_nonlinear_oscillators.py", "test_central_forces.py"
SURFACES, DRAG, FAST = "test_surfaces.py", "test_drag.py", "test_relativistic.py"
FRAMES, BODIES = "test_moving_frames.py", "test_rigid_bodies.py"
CONSTRAINTS, MECHANISMS = "test_constraints.py", "test_mechanisms.py"
ROLLING = "test_rolling.py"
FRICTION, REACTIONS = "test_friction.py", "test_friction_of_reactions.py"
IMPACTS, HEAPS = "test_impacts.py", "test_heaps.py"
LEAVING, THRESHOLDS = "test_leaving.py", "test_thresholds.py"
CONTROLLERS = "test_controllers.py"
T = "time"

ASKED, REMAINING = "test_asked.py", "test_rows.py"
PERIODS, SECTIONS = "../runtime/test_period.py", "../runtime/test_section.py"
PORTRAITS = "../runtime/test_portrait.py"
ORBITS, EXPONENTS = "../runtime/test_orbit.py", "../runtime/test_lyapunov.py"

ROWS = (
    row("", "double_pendulum", "../test_examples.py", "tip[1]", "tip[2]"),
    row("K1", "double_pendulum_bars", DOUBLE, "B[1]", "B[2]", "- caseB"),
    row("K1", "double_pendulum_cases", DOUBLE, T, "apart", "- published"),
    row("K2", "double_pendulum_3d", DOUBLE, "trajectory[1]", "trajectory[2]"),
    row("K3", "kepler_four_orbits", CENTRAL, "x", "y", "- orbit2 orbit3 orbit4"),
    row("K4, U84", "pendulum_phase_portrait", PENDULUMS, "theta", "der(theta)", "- rotation separatrix", 2),
    row("V1", "two_masses_spring", LINEAR, T, "x1 x2 centre"),
    row("V2", "forced_oscillator", LINEAR, T, "x"),
    row("V3, reference", "double_pendulum_points", DOUBLE, "tip[1]", "tip[2]"),
    row("V4", "cone", SURFACES, T, "rho"),
    row("V6", "double_bars", DOUBLE, "tip[1]", "tip[2]"),
    row("V7", "vibrating_base", LINEAR, T, "y", "", 5),
    row("V8", "pendulum_driven_base", DRIVEN, T, "theta", "- vertical"),
    row("V10", "coupled_pendulums", PENDULUMS, T, "th1 th2"),
    row("V11", "bar_pendulum", PENDULUMS, T, "hinge.angle"),
    row("P3", "two_bodies", CENTRAL, "r1[1]", "r1[2]"),
    row("U112, T5, P4", "orbit_equation", CENTRAL, "phi", "r", "- circle parabola hyperbola"),
    row("P11", "thrown_and_dropped", FRAMES, T, "east", "- dropped"),
    row("U145, T13, P13, reference", "heavy_symmetric_top", BODIES, T, "theta"),
    row("P14, T7", "three_springs", LINEAR, T, "x1 x2"),
    row("P18", "kink", "test_fields.py", T, "u[20] u[40] u[60]"),
    row("P17", "elastic_rod", LINEAR, T, "x[1] x[5] x[10]", "", 2),
    row("T8", "forced_resonance", LINEAR, T, "x", "- beats"),
    row("T9", "damped_oscillator", LINEAR, T, "x", "- critical heavy"),
    row("T10", "forced_damped_oscillator", LINEAR, T, "x", "- resonance", 30),
    row("T12", "compound_pendulum_axis", PENDULUMS, T, "theta"),
    row("T14", "lagrange_top", BODIES, "axis[1]", "axis[2]", "- loops waves"),
    row("T11, T15", "free_symmetric_top", BODIES, "e3[1]", "e3[2]"),
    row("T16", "paraboloid", SURFACES, "x", "y", "- free"),
    row("T3, T18, U78", "tan_squared_well", NONLINEAR, T, "x"),
    row("T19", "inverse_square_potential", CENTRAL, T, "r", "- falls bound spiral"),
    row("T20", "ring_of_masses", LINEAR, T, "u[1] u[2]", "", 4),
    row("T22", "torqued_top", BODIES, T, "phi W3"),
    row("T26", "relativistic_charge", FAST, "x", "y", "magnetic"),
    row("U8", "swirl", LINEAR, "x", "y"),
    row("U9", "saddle_xy", LINEAR, "x", "y"),
    row("U11", "exponential_force", NONLINEAR, T, "x der(x)"),
    row("", "drive_train", "../stdlib/test_drive_trains.py", T, "der(drum.angle)"),
    row("", "hydraulic_axis", "../stdlib/test_drive_trains.py", T, "load.s"),
    row("", "screw_press", "../stdlib/test_drive_trains.py", T, "ram.s"),
    row("", "belt_drive", "../stdlib/test_machines.py", T, "belt.tight belt.slack"),
    row("", "damper_rig", "../stdlib/test_machines.py", T, "damper.pull"),
    row("", "front_loader", "../stdlib/test_machines.py", T, "forces[1] forces[2]"),
    row("", "geared_servo", "../stdlib/test_machines.py", T, "load.angle"),
    row("", "helicopter_blade", "../stdlib/test_machines.py", T, "tip[2]"),
    row("", "lane_change", "../stdlib/test_machines.py", "pose.x", "pose.y"),
    row("", "elbow", "../stdlib/test_machines.py", T, "elbow.angle"),
    row("", "quarter_car", "../stdlib/test_machines.py", T, "body.s wheel.s"),
    row("", "excavator", "../stdlib/test_machines.py", T, "reach[1] reach[2] reach[3]"),
    row("", "half_car", "../stdlib/test_machines.py", T, "z wheel[1].s wheel[2].s"),
    row("", "satellite", "../stdlib/test_machines.py", T, "angle_left"),
    row("", "ground_resonance", "../stdlib/test_machines.py", "x", "y"),
    row("", "wishbone_corner", "../stdlib/test_suspensions.py", T, "left.camber left.toe"),
    row("", "wheelset_hunting", "../stdlib/test_rails.py", T, "y"),
    row("", "four_wheels", "../stdlib/test_suspensions.py", T, "roll yaw_rate"),
    row("", "gear_shift", "../stdlib/test_machines.py", T, "der(engine.angle) der(car.angle)"),
    row("", "current_limit", "../stdlib/test_machines.py", T, "der(rotor.angle)"),
    row("", "conveyor", "../stdlib/test_machines.py", T, "parcel[1].s parcel[4].s"),
    row("", "catamaran", "../stdlib/test_machines.py", T, "pose.angle"),
    row("", "rope_hoist", "../stdlib/test_machines.py", T, "rope.tension"),
    row("", "tower_crane", "../stdlib/test_machines.py", T, "load.angle"),
    row("", "valve_train", "../stdlib/test_machines.py", T, "cam.gap"),
    row("", "cart_servo", "../stdlib/test_control.py", T, "x"),
    row("", "thermostat", "../stdlib/test_control.py", T, "room.y"),
    row("", "filters", "../stdlib/test_control.py", T, "bessel_answer"),
    row("U12", "parabola_of_safety", REMAINING, "x", "z safe"),
    row("U15", "lennard_jones", NONLINEAR, "r", "der(r)"),
    row("U16", "saddle", LINEAR, "x", "y"),
    row("U24", "stokes_drag", DRAG, T, "der(fall.position[2])"),
    row("U26", "drag_reynolds", DRAG, T, "der(y)", "- small grain", 5),
    row("U28", "mixed_drag", DRAG, T, "der(y)"),
    row("U30 (b, c)", "horizontal_drag", DRAG, T, "x", "- quadratic"),
    row("U31", "linear_quadratic_drag", DRAG, T, "x", "", 20),
    row("U32", "shuttlecock", DRAG, T, "y"),
    row("U38", "wedge", SURFACES, T, "s X"),
    row("U43", "pendulum", PENDULUMS, T, "theta"),
    row("U43, points", "pendulum_point", PENDULUMS, "theta", "der(theta)"),
    row("U43, parts", "pendulum_parts", PENDULUMS, "pin.angle", "der(pin.angle)"),
    row("U45, reference", "elastic_pendulum", SURFACES, "x", "y"),
    row("reference", "elastic_pendulum_parts", SURFACES, "guide.position[1]", "guide.position[2]"),
    row("U46", "pendulum_accelerating_support", PENDULUMS, T, "theta"),
    row("U47", "mass_on_spring", LINEAR, T, "x", "", 4),
    row("U48", "heavy_spring", LINEAR, T, "x", "", 4),
    row("U49", "hanging_spring", LINEAR, T, "x", "- massless", 4),
    row("U52", "double_pendulum_momenta", DOUBLE, T, "p1 p2"),
    row("U53", "sprung_pair", LINEAR, T, "x1 x2", "", 4),
    row("U54", "varying_length", DRIVEN, T, "theta"),
    row("U55", "harmonic_and_constant", LINEAR, "x", "y"),
    row("U56", "bead_on_oscillating_hoop", DRIVEN, T, "theta"),
    row("U57", "helix", SURFACES, T, "z"),
    row("U58", "pendulum_driven_support", DRIVEN, "theta", "der(theta)"),
    row("U66", "sliding_support", PENDULUMS, T, "X theta"),
    row("U67", "isotropic_oscillator", CENTRAL, "x", "y"),
    row("U70", "relativistic_orbit", FAST, "x", "y"),
    row("U74", "relativistic_constant_force", FAST, T, "v"),
    row("U79", "particle_on_sphere", SURFACES, "phi", "theta"),
    row("U80, reference", "spherical_pendulum", SURFACES, "bob[1]", "bob[2]"),
    row("U82, U83", "pendulum_period", PENDULUMS, T, "theta"),
    row("U86", "ear_drum", NONLINEAR, "x", "der(x)", "- large edge"),
    row("U10, U87", "duffing_free", NONLINEAR, "x", "der(x)", "- inner outer"),
    row("U88, U151, U152", "forced_pendulum", DRIVEN, T, "theta", "strong"),
    row("U89", "parametric_pendulum", DRIVEN, T, "theta"),
    row("U100", "accelerated_frame", FRAMES, "r[1]", "r[2]"),
    row("U101", "moving_frame", FRAMES, "r[1]", "r[2]"),
    row("U102", "falling_body_east", FRAMES, "y", "z"),
    row("U103", "bullet_up", FRAMES, "y", "z"),
    row("U109, reference", "rotating_hoop", DRIVEN, "theta", "der(theta)"),
    row("U110", "gravitating_pair", CENTRAL, "separation[1]", "separation[2]"),
    row("U112, T5, reference", "kepler", CENTRAL, "x", "y"),
    row("U113, U153", "table_hole_string", CENTRAL, "phi", "r"),
    row("U114", "inverse_cube_force", CENTRAL, "theta", "r"),
    row("U115", "precessing_ellipse", CENTRAL, "phi", "r"),
    row("U116", "capture", CENTRAL, "x", "y", "- captured"),
    row("U123", "physical_pendulum", PENDULUMS, T, "axis.angle"),
    row("U137", "euler_equations", BODIES, T, "w1 w2 w3"),
    row("U138", "earth_wobble", BODIES, "pole[1]", "pole[2]", "", 300 * 86164),
    row("U139", "tennis_racket", BODIES, T, "der(R)[1] der(R)[2] der(R)[3]"),
    row("U145", "heavy_top_rotation", BODIES, "tip[1]", "tip[2]"),
    row("U154", "schwarzschild", CENTRAL, "x", "y"),
    row("textbook", "bertrand", CENTRAL, "r", "phi"),
    row("reference", "figure_eight", CENTRAL, "r[1,1]", "r[1,2]"),
    row("reference", "pleiades", CENTRAL, stars(1), stars(2)),
    row("reference", "dzhanibekov", BODIES, T, "axis2[2]"),
    row("reference", "beam", NONLINEAR, T, "theta[10] theta[40]"),
    row("reference", "duffing_double_well", NONLINEAR, "x", "der(x)"),
    row("U91, U151, reference", "driven_pendulum", DRIVEN, "theta", "der(theta)", "- doubled"),
    row("reference", "van_der_pol", NONLINEAR, "x", "v"),
    row("reference", "hanging_chain", PENDULUMS, T, "joint[1].angle joint[5].angle"),
    row("reference", "pendulum_row", PENDULUMS, T, "theta[1] theta[2] theta[3]"),
    row("V5", "pendulum_tension", CONSTRAINTS, T, "tension"),
    row("P7", "ladder", CONSTRAINTS, T, "by_wall by_floor"),
    row("K1, free bars", "double_pendulum_cartesian", MECHANISMS, "B[1]", "B[2]"),
    row("U44", "bead_on_hyperbola", CONSTRAINTS, "x", "y"),
    row("U50", "rope_over_edge", CONSTRAINTS, T, "y"),
    row(
        "U42",
        "jointed_chain",
        CONSTRAINTS,
        "free[1].position[2] free[5].position[2]",
        "free[1].position[3] free[5].position[3]",
    ),
    row("U95", "rolling_cylinder", ROLLING, "path[1]", "path[2]"),
    row("U122", "cylinder_and_shell", ROLLING, T, "left.position right.position"),
    row("U125, T21", "cavity_pendulum", BODIES, T, "pin.angle"),
    row("U126", "rolling_down_incline", ROLLING, T, "guide.position"),
    row("U128", "rod_in_circle", CONSTRAINTS, "x", "y"),
    row("U130", "rolling_ball_with_cavity", CONSTRAINTS, T, "s"),
    row("U132", "ball_in_bowl", ROLLING, T, "bowl.angle"),
    row("U134", "hinge_reaction", CONSTRAINTS, T, "F[1] F[2]"),
    row("U136", "tilted_rod", CONSTRAINTS, T, "N[1] N[2] N[3]"),
    row("U140", "block_about_diagonal", CONSTRAINTS, T, "N[1] N[2] N[3]"),
    row("U141", "edge_runner", ROLLING, T, "shaft.angle bearing.angle"),
    row("U142", "cylinder_about_diagonal", CONSTRAINTS, T, "N[1] N[2] N[3]", "- balanced"),
    row("U143", "spun_lamina", CONSTRAINTS, T, "N[1] N[2] N[3]"),
    row("U144", "free_lamina", BODIES, T, "w[1] w[2] w[3]"),
    row("reference", "pendulum_from_horizontal", CONSTRAINTS, T, "tension"),
    row("reference", "fekete", CONSTRAINTS, T, "p[1,1] p[2,1] p[3,1] p[4,1]", "", 20),
    row("reference", "pendulum_cartesian", CONSTRAINTS, T, "x y lambda"),
    row("reference", "chaplygin_sleigh", CONSTRAINTS, "x", "y"),
    row("reference", "ball_on_turntable", CONSTRAINTS, "p[1]", "p[2]"),
    row("reference", "squeezing_mechanism", MECHANISMS, "F[1]", "F[2]"),
    row("reference", "bricard", MECHANISMS, "P3[1]", "P3[2]"),
    row("reference", "n_four_bar", MECHANISMS, T, "B[1] B[2]"),
    row("engineering", "slider_crank", MECHANISMS, T, "stroke"),
    row("engineering", "four_bar", MECHANISMS, "curve[1]", "curve[2]"),
    row("engineering", "stewart_platform", MECHANISMS, T, "height"),
    row("engineering", "peaucellier", MECHANISMS, "tip[1]", "tip[2]"),
    row("engineering", "watt_linkage", MECHANISMS, "middle[1]", "middle[2]"),
    row("engineering", "five_bar", MECHANISMS, "path[1]", "path[2]"),
    row("engineering", "universal_joint_shaft", MECHANISMS, T, "speed"),
    row("engineering", "rolling_coin", ROLLING, "pose.position[1]", "pose.position[2]"),
    row("engineering", "bicycle_wheel", ROLLING, T, "path[3]", "- dropped"),
    row("engineering", "wheel_on_curve", ROLLING, "pose.x", "pose.y"),
    row("engineering", "differential", CONSTRAINTS, T, "der(left) der(right)"),
    row("U18, U22, U23", "block_on_incline", FRICTION, T, "s", "- stops"),
    row("U21", "tilted_plane", FRICTION, T, "s"),
    row("U30 (a)", "sliding_block", FRICTION, T, "x der(x)"),
    row("U19, reference", "stick_slip_belt", FRICTION, "y", "s", "- slow"),
    row("U20", "belt_with_rosin", FRICTION, "x", "der(x)", "- damped"),
    row("reference", "coulomb_block", FRICTION, T, "x"),
    row("textbook", "coulomb_pendulum", FRICTION, "theta", "der(theta)"),
    row("textbook", "bead_on_rough_hoop", FRICTION, "theta", "der(theta)"),
    row("reference", "bouncing_ball", IMPACTS, T, "h"),
    row("textbook", "touching_balls", IMPACTS, T, "x[1] x[2] x[3] x[4] x[5]", "at_once"),
    row("engineering", "newtons_cradle", IMPACTS, T, "theta[1] theta[2] theta[5]"),
    row("textbook", "dominoes", HEAPS, T, " ".join(f"lean[{i}]" for i in range(1, 9))),
    row("textbook", "ball_on_plate", IMPACTS, T, "z level", "", 0.3),
    row("textbook", "rocking_block", IMPACTS, T, "theta"),
    row("engineering", "double_pendulum_stops", IMPACTS, T, "shoulder.angle elbow.angle"),
    row("engineering", "slider_crank_stop", IMPACTS, T, "guide.position", "", 1),
    row("engineering", "slider_crank_friction", REACTIONS, T, "side sliding", "coasting"),
    row("U133", "car_door", IMPACTS, T, "hinge.angle"),
    row("textbook", "billiard_circle", IMPACTS, "x", "y"),
    row("textbook", "billiard_stadium", IMPACTS, "x", "y"),
    row("U51", "shaken_incline", LEAVING, T, "h", "rattling"),
    row("U77", "string_pendulum", LEAVING, "x", "y", "- swings turns"),
    row("reference", "particle_on_dome", LEAVING, "path[1]", "path[2]"),
    row("U127, reference", "sphere_on_sphere", LEAVING, "path[1]", "path[2]"),
    row("U135", "cylinder_on_cylinder", LEAVING, "path[1]", "path[2]"),
    row("P7, leaving; reference", "ladder_leaves_wall", LEAVING, T, "by_wall by_floor"),
    row("engineering", "catapult", LEAVING, "flight.position[1]", "flight.position[2]"),
    row("U69", "potential_step", THRESHOLDS, "x", "y", "- reflected"),
    row("U73", "drag_in_region", THRESHOLDS, "x", "y"),
    row("U111", "collapse", THRESHOLDS, T, "r"),
    row("U27", "drop_with_drag", THRESHOLDS, T, "h der(h)"),
    row("U29", "half_speed", THRESHOLDS, T, "der(y)"),
    row("reference", "chain_off_table", THRESHOLDS, T, "x"),
    row("engineering", "relay_attitude", CONTROLLERS, "a", "der(a)"),
    row("engineering", "cart_pendulum", CONTROLLERS, T, "u", "", 3),
    row("engineering", "sampled_controller", CONTROLLERS, T, "x", "", 3),
    row("textbook", "bowling_ball", FRICTION, T, "der(x) rim"),
    row("U126, limit", "slide_or_roll", FRICTION, T, "der(a)", "- steep"),
    row("engineering", "clutch", FRICTION, T, "der(a) der(b)"),
    row("textbook", "spinning_bounce", IMPACTS, "path[1]", "path[2]", "- slow"),
    row("engineering", "balls_on_a_box", IMPACTS, T, "flight[1].x flight[2].x load", "", 2),
    row("engineering", "balls_in_a_box", IMPACTS, T, "flight[1].x flight[2].x lying.x load", "", 2),
    row("engineering", "crates", IMPACTS, T, "free[1].x free[2].x load", "", 2),
    row("textbook", "spinning_coin", IMPACTS, T, "lean"),
    row("engineering", "falling_box", IMPACTS, T, "free.position[3] height", "", 2),
    row("textbook", "masse_shot", FRICTION, "x", "y"),
    row("U75, U76", "rotor", PERIODS, T, "der(theta)"),
    row("K5", "henon_heiles", SECTIONS, "q1", "q2"),
    row("U1, U2, U3, U6, U7, U98", "vectors", ASKED, T, "angle_ab angle_wires"),
    row("U4, U5", "lorentz_inferred", ASKED, T, "B[1] B[2] B[3]"),
    row("U34", "field_of_potentials", ASKED, "x", "y"),
    row("U35", "vortex", ASKED, "x", "y"),
    row("U36", "curl_of_field", ASKED, "x", "y"),
    row("U34, U35, U36", "field_operators", ASKED, T, "force[1] force[2] other_turn[3]"),
    row("U37", "curl_of_two", ASKED, "x", "y"),
    row("U37", "product_field", ASKED, "x", "y"),
    row("U118", "hemisphere", ASKED, T, "centre[3]"),
    row("U119, K6, U124", "box_at_corner", ASKED, T, "free.position[1]"),
    row("T11, U120, U124", "three_points", ASKED, T, "turn"),
    row("U121", "round_bodies", ASKED, T, "one.angle"),
    row("U129", "square_at_corner", ASKED, T, "free.position[1]"),
    row("U93, U106, T13, P9", "euler_angles", ASKED, T, "turned[1] turned[2] turned[3]"),
    row("U94", "turned_vector", ASKED, T, "active[2] passive[2]"),
    row("P8", "axis_and_angle", ASKED, T, "x"),
    row("U97", "racing_car", ASKED, "car[1]", "car[2]"),
    row("U99", "spinning_sphere", ASKED, "place[1]", "place[2]"),
    row("U104, U105, U107, U108, P10", "coriolis", ASKED, T, "coriolis[2]"),
    row("T25", "uniform_force", "test_printed_answers.py", T, "S expected"),
    row("U146, U148, P15, P16, T24, T25, U65", "hamilton_spring", ASKED, T, "q"),
    row("U147, U149", "hamilton_pendulum", ASKED, T, "theta"),
    row("T23", "relativistic_particle", ASKED, "x", "y"),
    row("T17, U150", "angular_momentum", ASKED, "x", "y"),
    row("T2, P18, K5", "noether", ASKED, "x1", "y1"),
    row("textbook", "kovalevskaya", ASKED, T, "der(R)[3]"),
    row("textbook", "toda", ASKED, T, "q1 q2 q3"),
    row("U89", "vertically_driven_pendulum", ORBITS, T, "theta"),
    row("textbook", "van_der_pol_cycle", ORBITS, "x", "der(x)"),
    row("textbook", "lorenz", EXPONENTS, "x", "z"),
    row("U13", "pebble_down_slope", "../runtime/test_optimum.py", "x", "z"),
    row("U14", "car_from_rest_to_rest", "../runtime/test_optimum.py", T, "x"),
    row("U92", "forced_drum", "../runtime/test_threshold.py", T, "x", "", 100),
    row("textbook", "governor", "../runtime/test_steady.py", T, "theta"),
    row("U85, U149", "damped_pendulum", PORTRAITS, "theta", "der(theta)", "- heavy"),
    row("T6", "rutherford", "../runtime/test_scattering.py", "x", "y"),
    row("U17", "external_force", REMAINING, T, "Fx Fy"),
    row("U19", "slider_blocks", REMAINING, T, "x[1] x[2] x[3] x[4] x[5]"),
    row("U25", "scale_model", REMAINING, T, "speed[1] speed[2] speed[3]"),
    row("U33, U81", "quartic_well", REMAINING, T, "q", "- heavy stiff energetic"),
    row("U39, U40", "rigid_points", REMAINING, T, "r[1,3] r[2,3]"),
    row("U62, V9", "lagrangian_with_acceleration", REMAINING, T, "q"),
    row("U68, T1", "gauge", REMAINING, T, "q momenta"),
    row("U72", "charged_bead", REMAINING, T, "theta", "- strong"),
    row("U86", "ear_drum_tones", REMAINING, T, "x", "", 100),
    row("U88", "superharmonic", REMAINING, T, "theta"),
    row("U89, U152", "vertical_foldover", REMAINING, T, "theta"),
    row("U90", "mathieu", REMAINING, T, "x"),
    row("U96", "curvilinear", ASKED, T, "a_r"),
    row("U117, U131", "pushed_body", REMAINING, T, "N[1] N[2] N[3]"),
    row("U155", "falling_strip", REMAINING, "x", "y", "- tumbles"),
    row("K3, U112", "keplers_equation", REMAINING, "x", "y"),
    row("K5", "jupiters_pull", REMAINING, T, "moved"),
    row("T4", "fall_to_the_centre", REMAINING, "phi", "r", "- misses"),
    row("P1", "logarithmic_well", REMAINING, "x", "y", "", 40),
    row("P2", "generalised_force", REMAINING, T, "theta"),
    row("P6", "skate_on_slope", REMAINING, "y", "x"),
    row("P12", "poinsot", REMAINING, "pole[1]", "pole[2]"),
    row("textbook", "uniform_field", REMAINING, T, "M[1] M[2] M[3]"),
    row("textbook", "free_particle", REMAINING, T, "S"),
)

HEAD = """# Gallery

Systems with known answers. Each is one file in `examples/`; its test in `tests/physics/` compares a run with
the answer that the source states, and states its own bound. The rows name the source: K a thesis on the
double pendulum, T questions of advanced mechanics, V a text on variation principles, P a chapter of classical
mechanics, U lecture notes (Physics 206); *reference* marks test problems of the literature with 30-digit
solutions in `tests/physics/data/`; *textbook* and *engineering* mark common systems, whose answers the tests
derive, or integrate from equations written by hand. `make gallery` makes this page, and the pictures of all
systems in `docs/gallery/`. [What the sources ask](sources.md) lists every row with its answer.
"""


def page() -> str:
    """Return the text of gallery.md."""
    shown = " ".join(f"![{name}](gallery/{name}.png)" for name in SHOWN)
    return f"{HEAD}\n{shown}\n\n{table()}"


def table(up: str = "../", pictures: bool = False) -> str:
    """Return the table of all systems, described by the models' own doc strings.

    ``up`` leads from the page to the top of the repository.
    """
    head = ["row", "system", "model", "test", *["figure"] * pictures]
    lines = [f"| {' | '.join(head)} |", f"|{'---|' * len(head)}"]
    for r in ROWS:
        place = r.test.removeprefix("../") if "/" in r.test else f"physics/{r.test}"
        test = f"[{r.test.rpartition('/')[2]}]({up}tests/{place})"
        model = f"[{r.example}]({up}examples/{r.example}.mech)"
        cells = [r.rows, description(r.example), model, test, *[f"![]({r.example}.png)"] * pictures]
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


class Subject(Struct, frozen=True):
    """A part of the gallery of the site: examples of these tests, and of others those whose name or description has such words."""

    name: str
    tests: tuple[str, ...]
    words: str


SUBJECTS = (
    Subject("Double pendulums", (DOUBLE,), r"[Dd]ouble pendulum"),
    Subject("Pendulums", (PENDULUMS, DRIVEN), r"[Pp]endul|hoop"),
    Subject(
        "Oscillators and waves",
        (LINEAR, NONLINEAR),
        r"oscillat|spring|Duffing|van der Pol|drum|wave|shaken|Mathieu|kx|k x",
    ),
    Subject(
        "Orbits and scattering",
        (CENTRAL,),
        r"planet|orbit|Kepler|gravitat|scatter|galaxy|Jupiter|Schwarzschild",
    ),
    Subject(
        "Rigid bodies, tops and gyroscopes",
        (BODIES,),
        r"\btop\b|rigid|gyro|inertia|lamina|rotation|Euler|angular momentum|governor",
    ),
    Subject(
        "Constraints and surfaces",
        (CONSTRAINTS, SURFACES, "test_leaving.py"),
        r"\bbead|surface|sphere|rope|constraint|ladder",
    ),
    Subject("Linkages", (MECHANISMS,), r"linkage|crank|four-bar"),
    Subject("Friction and rolling", (FRICTION, REACTIONS, ROLLING), r"frict|rolls|belt"),
    Subject("Impacts and contacts", (IMPACTS, HEAPS), r"bounc|impact|restitution|billiard|plate"),
    Subject(
        "Machines, vehicles and control",
        ("test_controllers.py", "../stdlib/"),
        r"\bcar\b|motor|controller|relay",
    ),
    Subject(
        "Fields, charges and relativity",
        (FAST, "test_fields.py"),
        r"field|potential|charge|magnet|relativi|curl|vortex",
    ),
    Subject("Moving frames", (FRAMES,), r"Coriolis|turning frame|turns with"),
    Subject("Drag, throws and falls", (DRAG,), r"drag|thrown|shell|fall|slope"),
)
FURTHER = "Further"


def subject(r: Row) -> str:
    """Return the subject under which the gallery of the site shows an example."""
    if r.example.startswith("curves/"):
        return "Curves"
    said = f"{r.example.replace('_', ' ')}: {description(r.example)}"
    by_test = (one.name for one in SUBJECTS if any(r.test.startswith(test) for test in one.tests))
    by_words = (one.name for one in SUBJECTS if re.search(one.words, said))
    return next(by_test, next(by_words, FURTHER))


@cache
def description(example: str) -> str:
    """Return the doc string of the model that an example runs; of a bare file, its first comment."""
    source = read_source(EXAMPLES / f"{example}.mech")
    file = parse(source, Reporter())
    models = [item for item in file.items if isinstance(item, ast.Model) and not item.partial]
    text = models[-1].doc if models else file.comments[0].text.removeprefix("//").strip()
    return text.replace("|", "\\|")


def draw(r: Row) -> None:
    """Run an example and write its picture."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot as plt

    model = mechc.load(EXAMPLES / f"{r.example}.mech")
    figure, axes = plt.subplots(figsize=(4.2, 3.0), dpi=80, layout="constrained")
    for experiment in r.experiments:
        solution = model.simulate(experiment=experiment or None, stop=r.stop)
        assert isinstance(solution, mechc.Solution)
        assert solution.outcome.value in ("completed", "terminated"), solution.message
        t = np.linspace(solution.time[0], solution.time[-1], 3000)
        smooth = solution(t)
        for x, y in r.curves():
            label = [y] * (len(r.y) > 1) + [experiment or "default"] * (len(r.experiments) > 1)
            axes.plot(t if x == T else smooth[x], smooth[y], linewidth=0.9, label=", ".join(label))
    axes.set_xlabel(caption(solution, r.x))
    axes.set_ylabel(caption(solution, r.y))
    if 1 < len(r.y) * len(r.experiments) < 7:
        axes.legend(fontsize="small", frameon=False)
    low, high = axes.get_xlim()
    bottom, top = axes.get_ylim()
    if r.in_a_plane() and 0.25 < (top - bottom) / (high - low) < 4:
        axes.set_aspect("equal", adjustable="datalim")
    axes.spines[["top", "right"]].set_visible(False)
    PICTURES.mkdir(exist_ok=True)
    figure.savefig(PICTURES / f"{r.example}.png", metadata={"Software": None})
    plt.close(figure)


def caption(solution: mechc.Solution, names: Sequence[str]) -> str:
    """Return the names, the first and the last of many, with their units."""
    shown = names if len(names) < 4 else (names[0], "..", names[-1])
    units = dict.fromkeys(solution.unit(n) for n in names)
    text = ", ".join(u for u in units if u not in ("", "1"))
    return ", ".join(shown) + (f" [{text}]" if text else "")


def chosen(names: Sequence[str]) -> Iterator[Row]:
    return (r for r in ROWS if not names or r.example in names)


def main(names: Sequence[str]) -> None:
    (HERE / "gallery.md").write_text(page(), encoding="utf-8")
    for r in chosen(names):
        draw(r)
    ALL.write_text(f"# Pictures of all systems\n\n{table('../../', pictures=True)}", encoding="utf-8")


if __name__ == "__main__":
    main(sys.argv[1:])
