"""Examples of Modelica's mechanical libraries beside what others computed of them.

Rows of the Modelica Standard Library are short extracts of the reference results that its makers publish; the others are
compared with ``modelica_computed``.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

import numpy as np
from modelica_computed import computed_reference
from modelica_table import COMPUTED, EXAMPLES, FOLDER, Example

import mechc

AGREED = 1e-3
"""Root of the mean square of the differences, as a share of the largest value of the reference."""


def reference(example: Example) -> dict[str, Any]:
    """Return the rows of an example of the standard library: ``time`` and what ``reads`` names."""
    rows = json.loads((FOLDER / "references.json").read_text(encoding="utf-8"))[example.name]
    return {name: np.array(values) for name, values in rows.items()}


def value(solution: Any, formula: str, time: float) -> float:
    """Return a quantity of a motion, or a difference of two: ``a``, ``-a`` or ``a - b``."""
    first, _, second = formula.removeprefix("-").partition(" - ")
    at = solution(time)
    result = -float(at[first]) if formula.startswith("-") else float(at[first])
    return result - float(at[second]) if second else result


def disagreement(example: Example, rows: Mapping[str, Any], tolerance: float = 1e-8) -> dict[str, float]:
    """Run an example and return how far each quantity is from ``rows``, as a share of its largest value there."""
    times = rows["time"]
    solution = mechc.load(example.path).simulate(
        stop=float(times[-1]), tolerance=tolerance, estimate_error=False, inputs=example.inputs()
    )
    found = {}
    for name, formula in example.reads.items():
        ours = np.array([value(solution, formula, time) for time in times])
        theirs = rows[name]
        found[name] = float(np.sqrt(np.mean((ours - theirs) ** 2)) / np.max(np.abs(theirs)))
    return found


def rows(measure: bool = False) -> list[tuple[str, str, str]]:
    """Return what a page says: the name, how far it agrees (or ""), what is to be said.

    Agreement is measured again if ``measure`` is true, which runs every example.
    """
    said = []
    for example in EXAMPLES:
        agreement = ""
        if measure:
            theirs = computed_reference(example.name) if example.source == COMPUTED else reference(example)
            agreement = f"{max(disagreement(example, theirs).values()):.0e}"
        said.append((example.name, agreement, example.note))
    return said
