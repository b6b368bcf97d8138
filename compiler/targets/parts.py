"""Which functions a part of the equations (equations/needs.py) brings into the code of a model, whatever the target."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

FUNCTIONS: Final[Mapping[str, tuple[str, ...]]] = {
    "jacobian": ("jacobian",),
    "local_derivatives": ("local_derivatives",),
    "second_order": ("second_order", "bias"),
    "momenta": ("momentum", "force", "mass"),
    "series": ("series_start", "series_next"),
    "phase": ("phase", "phase_rate", "phase_gradient"),
    "matter": ("matter",),
    "functions": (
        "accelerations",
        "mass_matrix",
        "bias",
        "inverse_dynamics",
        "constraint_bias",
        "energy",
        "kinetic_energy",
        "potential_energy",
    ),
    "scene": ("scene", "scene_still"),
    "projection": (
        "project_position",
        "project_velocity",
        "displace",
        "constraints",
        "constraint_jacobian",
    ),
    "events": ("discretes", "indicators", "indicator_rates"),
}
"""Of ``functions`` also output_1, jacobian_1 and so on. Parts that are not here change functions that every model has."""
