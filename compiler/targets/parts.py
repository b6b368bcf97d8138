"""Which functions a part of the equations (equations/needs.py) brings into the code of a model, whatever the target."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

FUNCTIONS: Final[Mapping[str, tuple[str, ...]]] = {
    "jacobian": ("jacobian",),
    "local_derivatives": ("local_derivatives",),
    "second_order": ("second_order", "bias"),
    "momenta": ("momentum", "force", "mass"),
    "phase": ("phase", "phase_rate", "phase_gradient"),
    "matter": ("matter",),
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
"""Parts that are not here change functions that every model has."""
