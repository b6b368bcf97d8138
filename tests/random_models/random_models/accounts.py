"""Whether what a model books as dissipated is what its forces may take (docs/events.md, section 8)."""

from __future__ import annotations

from typing import Any

import numpy as np
from oracle.accounts import dissipated

from random_models.compiled import Compiled, Values

RELATIVE = 1e-8
"""Of the powers that are booked: both sides are formulas of the same state."""


def misbooked(base: Compiled, meaning: Any, here: Values, state: Values) -> str:
    """Say how the power that is booked as dissipated at a state differs from all that the page allows."""
    booked = base.rhs(here)
    lost = booked.get("d energy.dissipated", 0.0)
    size = 1 + abs(lost) + abs(booked.get("d energy.supplied", 0.0))
    allowed = dissipated(meaning, state)
    if not np.isfinite(size) or any(abs(lost - x) <= RELATIVE * size for x in allowed):
        return ""
    near = min(allowed, key=lambda x: abs(x - lost))
    return (
        f"{lost:.9g} W are booked as dissipated, {near:.9g} W by definition, the nearest of {len(allowed)}\n"
    )
