"""Whether what a model books as dissipated is what its forces, and what happens at an instant, may take (docs/events.md, section 8)."""

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


def misbooked_at_events(solution: Any) -> str:
    """Say how the accounts change at an instant, where it is not as the energy does.

    Laws that jump supply what they bring, of either sign; so looked at is what one `when` throws. What hits what time moves
    is pushed, too, and loses nothing less.
    """
    if not {"energy.total", "energy.supplied", "energy.dissipated"} <= set(solution):
        return ""
    total, supplied, lost = (np.asarray(solution[f"energy.{n}"]) for n in ("total", "supplied", "dissipated"))
    time = np.asarray(solution.time)
    moving = [
        np.asarray(solution[q.name]) for q in solution.problem.states if not q.name.startswith("energy.")
    ]
    kinds: dict[float, list[str]] = {}
    for event in solution.events:
        kinds.setdefault(float(event.time), []).append(event.kind)
    for k in np.flatnonzero(np.diff(time) == 0):
        here = kinds.get(float(time[k]), [])
        if here not in (["when"], ["impact"]) or not any(x[k] != x[k + 1] for x in moving):
            continue  # where nothing is thrown, a law jumps at this instant
        gain = total[k + 1] - total[k]
        want = max(gain, 0.0), max(-gain, 0.0)
        got = supplied[k + 1] - supplied[k], lost[k + 1] - lost[k]
        if here == ["impact"] and got[1] >= 0:
            want = gain + got[1], got[1]
        size = 1 + abs(total[k]) + abs(total[k + 1]) + abs(supplied[k]) + abs(lost[k])
        if np.isfinite(gain) and any(abs(x - y) > RELATIVE * size for x, y in zip(want, got, strict=True)):
            return (
                f"at {time[k]:.6g} s a {here[0]} changes the energy by {gain:.9g} J, what is supplied by {got[0]:.9g} J "
                f"and what is dissipated by {got[1]:.9g} J"
            )
    return ""
