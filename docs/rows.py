"""All 216 rows of the source texts: those of the examples (docs/figures.py), and the others with their tests, or why not."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping

from msgspec import Struct

COUNTS = {"U": 155, "K": 6, "T": 26, "V": 11, "P": 18}
"""Rows of each source."""

REMAINING = "physics/test_rows.py"
CURVES, CLASSICAL = "physics/test_curves.py", "physics/test_classical_curves.py"
PERIODS, CONSTANTS, MODES = "runtime/test_period.py", "physics/test_asked.py", "runtime/test_modes.py"
PHASE, TOPS = "physics/test_phase_space.py", "physics/test_rigid_bodies.py"


class Asked(Struct, frozen=True):
    """A row without an example in the gallery: ``tests`` below tests/ as ``file::function``, or what is to be said instead."""

    asks: str
    tests: tuple[str, ...] = ()
    curve: str = ""
    said: str = ""


def asked(asks: str, *tests: str, curve: str = "", said: str = "") -> Asked:
    return Asked(asks, tests, curve, said)


OTHERS: Mapping[str, Asked] = {
    "U1": asked("products of vectors, a x (b x c)", f"{REMAINING}::test_products_of_vectors"),
    "U10": asked("k = V''(a), w = sqrt(k/m)", f"{REMAINING}::test_small_oscillations_about_a_minimum"),
    "U17": asked(
        "is there an external force on three particles?",
        said="the signs of its data are lost in the text: there is nothing to compare with",
    ),
    "U25": asked("scale models at the same Reynolds number", f"{REMAINING}::test_a_model_in_another_medium"),
    "U33": asked(
        "twice the mass, twice the potential", f"{REMAINING}::test_similar_motions_take_similar_times"
    ),
    "U39": asked(
        "degrees of freedom of a dumbbell",
        f"{REMAINING}::test_rigid_points_lose_a_freedom_for_each_distance",
    ),
    "U40": asked(
        "degrees of freedom of a rigid triangle",
        f"{REMAINING}::test_rigid_points_lose_a_freedom_for_each_distance",
    ),
    "U41": asked(
        "kinds of constraints",
        said="definitions, without an answer; models of each kind: velocity constraints [chaplygin_sleigh](../examples/chaplygin_sleigh.mech), "
        "inequalities [bouncing_ball](../examples/bouncing_ball.mech), moving ones [moving_frame](../examples/moving_frame.mech)",
    ),
    "U59": asked(
        "curve of fastest descent",
        f"{CURVES}::test_the_curve_of_fastest_descent_begins_steeply",
        f"{CURVES}::test_fastest_descents_along_four_cycloids",
        curve="brachistochrone",
    ),
    "U60": asked(
        "elastic band under a load",
        "physics/test_curve_order.py::test_an_elastic_band_under_a_load",
        curve="rubber_band",
    ),
    "U61": asked(
        "line of fixed length", f"{CURVES}::test_a_hanging_line_of_given_length", curve="clothesline"
    ),
    "U62": asked(
        "Lagrangian with q''",
        "compiler/equations/test_unusual_systems.py::test_lagrangian_with_second_derivatives_integrates_by_parts",
    ),
    "U63": asked(
        "Fermat's principle",
        f"{CURVES}::test_light_through_two_media_bends_where_they_meet",
        f"{CURVES}::test_light_bends_through_a_medium_that_changes_with_height",
        curve="fermat",
    ),
    "U64": asked(
        "soap film between rings",
        f"{CURVES}::test_both_soap_films",
        "physics/test_curve_branches.py::test_where_the_soap_film_tears",
        "physics/test_curve_directions.py::test_two_discs_are_told_where_they_are_less_than_the_film",
        curve="soap_film",
    ),
    "U68": asked(
        "gauge terms, Galilean boosts",
        f"{REMAINING}::test_gauge_terms_change_nothing",
        f"{REMAINING}::test_a_boost_adds_a_rate_to_the_lagrangian",
    ),
    "U71": asked(
        "geodesic of the half plane",
        f"{CURVES}::test_a_geodesic_of_the_half_plane_is_a_circle",
        curve="half_plane_geodesic",
    ),
    "U72": asked(
        "charged bead on a vertical circle",
        "runtime/test_equilibria.py::test_a_charged_bead_on_a_hoop",
        "runtime/test_equilibria.py::test_the_far_side_of_the_charge_forks",
    ),
    "U78": asked("period in V0 tan^2 x", f"{REMAINING}::test_period_by_integration"),
    "U81": asked("period in k q^4", f"{REMAINING}::test_similar_motions_take_similar_times"),
    "U90": asked(
        "Hill's and Mathieu's equations",
        f"{REMAINING}::test_stability_of_mathieus_equation",
        "runtime/test_orbit.py::test_a_vertically_driven_pendulum",
    ),
    "U96": asked(
        "velocity and acceleration in polar, cylindrical and spherical coordinates",
        f"{CONSTANTS}::test_curvilinear_coordinates",
    ),
    "U98": asked("d/dt [r.(v x a)]", f"{REMAINING}::test_derivative_of_a_triple_product"),
    "U117": asked(
        "kinetic energy of a body about any point", f"{REMAINING}::test_kinetic_energy_about_any_point"
    ),
    "U131": asked("momenta, and torque about another point", f"{REMAINING}::test_torque_about_another_point"),
    "U149": asked(
        "Liouville's theorem",
        f"{REMAINING}::test_volume_of_states",
        f"{PHASE}::test_volume_of_states_of_two_freedoms",
    ),
    "U155": asked(
        "falling paper strip",
        said="its equations are in a paper that the source cites, and no number is stated: there is nothing to compare with",
    ),
    "T1": asked("L and L + df/dt", f"{REMAINING}::test_gauge_terms_change_nothing"),
    "T3": asked("period by quadrature", f"{REMAINING}::test_period_by_integration"),
    "T4": asked("fall to the centre", f"{REMAINING}::test_fall_to_the_centre"),
    "T7": asked("det(k - w^2 m) = 0", "runtime/test_modes.py::test_a_chain_of_springs"),
    "T11": asked(
        "symmetric and spherical tops, regular precession",
        f"{CONSTANTS}::test_what_moments_are_like",
        f"{TOPS}::test_precession_in_space_and_in_the_body",
    ),
    "V9": asked(
        "L(q, q', q'', t)",
        "compiler/equations/test_unusual_systems.py::test_lagrangian_with_second_derivatives_integrates_by_parts",
    ),
    "P1": asked("virial theorem", f"{REMAINING}::test_a_virial_of_forces"),
    "P2": asked("generalised forces", f"{REMAINING}::test_generalised_forces"),
    "P5": asked(
        "several dependent variables",
        f"{CLASSICAL}::test_a_classical_problem",
        f"{CLASSICAL}::test_two_dependent_variables_along_the_curve",
        curve="two_variables",
    ),
    "P6": asked("multipliers of velocity constraints", f"{REMAINING}::test_multipliers_of_rates"),
    "P12": asked("Poinsot's motion", f"{REMAINING}::test_poinsots_motion"),
}

FURTHER: Mapping[str, tuple[str, ...]] = {
    "U8": (f"{CONSTANTS}::test_swirl_and_saddle",),
    "U9": (f"{CONSTANTS}::test_swirl_and_saddle",),
    "U13": ("runtime/test_optimum.py::test_a_pebble_down_a_slope",),
    "U14": ("runtime/test_optimum.py::test_a_car_goes_farthest_without_a_pause",),
    "U42": ("physics/test_constraints.py::test_freedoms_of_jointed_chains",),
    "U75": ("runtime/test_period.py::test_turning_points_and_the_series_of_a_rotor",),
    "U76": ("runtime/test_period.py::test_a_rotor_of_twice_the_energy",),
    "U84": ("runtime/test_portrait.py::test_pendulum_has_a_centre_saddles_and_separatrices_between_them",),
    "K4": ("runtime/test_portrait.py::test_pendulum_has_a_centre_saddles_and_separatrices_between_them",),
    "U86": ("runtime/test_threshold.py::test_an_ear_drum_escapes_from_rest_beyond_one_half",),
    "U87": ("runtime/test_portrait.py::test_double_well_and_its_separatrix",),
    "U88": ("runtime/test_hysteresis.py::test_weakly_forced_it_does_not",),
    "U91": (
        "runtime/test_section.py::test_stroboscopic_points_of_a_driven_pendulum",
        "runtime/test_section.py::test_stroboscopic_points_without_damping_are_on_closed_curves",
        "runtime/test_section.py::test_a_chaotic_section_says_how_far_its_points_can_be_trusted",
        "runtime/test_orbit.py::test_a_driven_orbit_and_its_doubling",
    ),
    "U93": (f"{CONSTANTS}::test_order_of_turns",),
    "U101": ("physics/test_moving_frames.py::test_lagrangian_of_a_turning_and_accelerated_frame",),
    "U105": ("physics/test_moving_frames.py::test_sea_level_across_a_channel",),
    "U107": ("physics/test_moving_frames.py::test_from_what_height_it_misses",),
    "U108": ("physics/test_moving_frames.py::test_horizontal_motion_is_turned_to_the_right_in_the_north",),
    "U152": ("runtime/test_hysteresis.py::test_a_forced_pendulum_folds_over",),
    "U138": (f"{TOPS}::test_precession_in_space_and_in_the_body",),
    "U150": (f"{PHASE}::test_rate_of_a_quantity_is_its_bracket_with_h",),
    "U151": (
        f"{REMAINING}::test_neighbours_on_a_cycle_and_on_a_strange_attractor",
        f"{REMAINING}::test_a_strange_attractor_is_the_same_from_any_start",
    ),
    "U153": (f"{PERIODS}::test_a_mass_on_a_table_with_a_string_through_a_hole",),
    "T5": (
        f"{CONSTANTS}::test_runge_lenz_vector_of_kepler",
        "physics/test_central_forces.py::test_conic_from_energy_and_angular_momentum",
    ),
    "T13": (f"{TOPS}::test_free_symmetric_top_in_euler_angles",),
    "T17": (f"{PHASE}::test_angular_momenta_in_four_dimensions",),
    "T20": (f"{MODES}::test_the_sources",),
    "T24": (f"{PHASE}::test_generated_transformations",),
    "T25": (f"{PHASE}::test_action_in_a_uniform_field",),
    "V10": (f"{MODES}::test_the_sources",),
    "P10": ("physics/test_moving_frames.py::test_pseudo_forces",),
    "P14": (f"{MODES}::test_the_sources",),
    "P16": (f"{PHASE}::test_symplectic_matrices",),
}
"""Tests of what a row asks for beside the motion of its example."""

ASKS = {
    "U65": "m a = -dV/dx from the action",
    "U75": "pendulum over its energy: rest, swings between +-acos(-e), turns; period by quadrature",
    "U76": "period of a turning pendulum, and its series",
    "U82": "period of a pendulum over its amplitude, 4 K(sin(amplitude/2))",
    "U83": "period of a pendulum at 60 deg, 6.7430014",
    "U93": "matrices of rotation, Euler angles z-x-z, the order of turns",
    "U104": "Coriolis and centrifugal force on 1 kg that goes north at 45 degrees with 1 km/s",
    "U105": "tilt of the sea across a channel with a current: 0.0683 m, the south coast is higher",
    "U106": "(1, 1, 1) in axes turned by Euler angles: (0, sqrt(2), 1)",
    "U107": "least height from which what falls to the east misses: 670 m for 0.25 m",
    "U108": "horizontal Coriolis force, the same in all directions",
    "U91": "stroboscopic points of the driven pendulum: fixed, several, strange attractor, closed curves",
}
"""What a row asks, where it shares an example with others."""

SAID = {
    "K1": "the potential of the thesis is wrong, and its chaos follows from that ([more](explanation/what_a_sign_can_do.md))",
    "K5": "named as future work, no number stated",
    "U6": "no number stated: the model says how far a place is from the three surfaces",
    "U36": "the sign of its second field, (y, x, z^3), is lost in the text: it is conservative for plus, not for minus",
    "U38": "the notes misprint M X'' in one of two equations",
    "U110": "the notes' v^2 = r'^2 + r phi'^2 lacks a square of r, and their potential its sign",
    "U112": "the notes' eccentricity (a^2 - b^2)/a^2 lacks a root: sqrt(a^2 - b^2)/a",
    "U77": "an older problem of the notes counts time otherwise: 2 theta'' + sin(theta) = 0",
    "U84": "the notes' separatrix of the energy zero counts from another zero; here it is at m g r",
    "U88": "the list of answers prints 0.08677211, its formula gives 0.08677218",
    "U89": "the list of answers prints 1.36711556 without damping; it is 1.36711536. The notes' small amplitudes lack the factor theta "
    "beside sin(w t), T has r for r^2, and tongues at 2 w0/n are called 1/2, 1/3 of w0",
    "U92": "the edge is a fractal: the stated values are among several",
    "U138": "the rate that the notes give for space is that in the body; in space it is l/I1",
    "U150": "the notes' bracket has the opposite sign",
    "P7": "the printed equation is wrong; right: theta'' = 3 g/(2 L) sin(theta)",
}
"""Errors of the sources, and rows that state no number."""


def ids() -> list[str]:
    """Return the names of all rows in the order of the sources."""
    return [f"{letter}{k}" for letter, count in COUNTS.items() for k in range(1, count + 1)]


def of_examples(rows: Iterable[tuple[str, str, str]]) -> dict[str, list[tuple[str, str]]]:
    """Return examples and tests by the row that they are for, from what the gallery says of each."""
    found: dict[str, list[tuple[str, str]]] = {}
    for text, example, test in rows:
        for name in re.findall(r"\b[UKTVP]\d+\b", text):
            found.setdefault(name, []).append((example, test))
    return found


def table(rows: Iterable[tuple[str, str, str]], describe: Mapping[str, str]) -> str:
    """Return the table of all rows; ``rows`` are texts, examples and test files (below tests/) of the gallery."""
    examples = of_examples(rows)
    lines = ["| row | asks | models | tests | remark |", "|---|---|---|---|---|"]
    for name in ids():
        models = [f"[{e}](../examples/{e}.mech)" for e, _ in examples.get(name, ())]
        tests = [_test(test) for _, test in examples.get(name, ())]
        tests += [_test(test) for test in FURTHER.get(name, ())]
        asks, said = "", SAID.get(name, "")
        if name in OTHERS:
            other = OTHERS[name]
            asks, said = other.asks, other.said or said
            models += [f"[{other.curve}](../examples/curves/{other.curve}.mech)"] if other.curve else []
            tests += [_test(test) for test in other.tests]
        elif examples.get(name):
            asks = re.sub(r" \((?:[UKTVP]\d+)[^()]*\)", "", describe[examples[name][0][0]])
        asks = ASKS.get(name, asks)
        cells = (name, asks, ", ".join(models), ", ".join(dict.fromkeys(tests)), said)
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


def _test(test: str) -> str:
    file, _, function = test.partition("::")
    return f"[{function or file.rpartition('/')[2]}](../tests/{file})"
