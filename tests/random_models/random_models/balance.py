"""The account of energy at a state: what is supplied and not dissipated is what the total gains along the motion."""

from __future__ import annotations

import numpy as np

from random_models.compiled import Compiled, Values

STEP = 1e-5
"""Of time; a central difference is off by its square, and by rounding over it: 1e-10 and 1e-11 of moderate numbers."""
RELATIVE = 1e-5


def unaccounted(base: Compiled, state: Values) -> str:
    """Say how the powers that a model books differ from the rate of its total energy; nothing where it has no balance."""
    if not base.problem.energy_balance:
        return ""
    rates = base.rhs(state)
    booked = rates.get("d energy.supplied", 0.0) - rates.get("d energy.dissipated", 0.0)
    totals = []
    for h in (STEP, STEP / 2):
        ahead, behind = (base.outputs(_moved(base, state, rates, x))["energy.total"] for x in (h, -h))
        totals.append((ahead - behind) / (2 * h))
    sizes = [abs(rates.get(f"d energy.{a}", 0.0)) for a in ("supplied", "dissipated")]
    size = 1 + abs(base.outputs(state)["energy.total"]) + sum(sizes) + abs(totals[0])
    if not np.all(np.isfinite([booked, size])) or abs(totals[0] - totals[1]) > 0.1 * RELATIVE * size:
        return ""  # the motion bends here, or is too steep to tell
    if abs(totals[1] - booked) <= RELATIVE * size:
        return ""
    return f"the energy changes by {totals[1]:.9g} W, booked are {booked:.9g} W\n"


def _moved(base: Compiled, state: Values, rates: Values, h: float) -> Values:
    """Return a state a little later, by its rates."""
    there = {n: state.get(n, 0.0) + h * rates[f"d {n}"] for n in base.states}
    return there | {"time": state.get("time", 0.0) + h}
