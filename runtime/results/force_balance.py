"""Do the forces on each body, reactions as they are reported, account for its motion? And do joints hold?

Looked at at a few instants of a run. At each instant the laws hold to rounding, whatever the errors of the motion. Near a
position in which constraints depend on each other rounding may be large, so that a law counts as broken where it is at
several instants.
"""

from __future__ import annotations

import math

from ..case import Case, inputs_at
from ..functions import named_function
from ..start.facts import start_facts
from ..start.free_state import characteristic_length
from .doubts import Contradiction
from .evaluate import Table

INSTANTS, BROKEN = 5, 2
"""At how many instants a run is looked at, and at how many of them a law has to be broken."""
TOLERANCE = {"force": 1e-6, "moment": 1e-6, "place": 1e-4, "direction": 1e-4}
"""Of the size of the terms. Closed loops are met to the tolerance of their projection only."""
ROUNDING = {"force": 0.0, "moment": 0.0, "place": 1e-12, "direction": 0.0}
"""Of the characteristic length of the model: places near the origin have terms of no size."""


def broken_laws(case: Case, table: Table) -> tuple[Contradiction, ...]:
    """Return the bodies whose forces do not account for their motion, and the joints that do not hold."""
    checked = case.problem.balance
    if not checked or not len(table):
        return ()
    last = len(table) - 1
    rows = sorted({round(k * last / (INSTANTS - 1)) for k in range(INSTANTS)})
    looked = _looked_at(case, table, rows)
    facts = start_facts(case.problem)
    length = 1.0 if facts is None else characteristic_length(facts, case.p)
    found = []
    for k, quantity in enumerate(checked):
        beyond: list[tuple[float, float, float]] = []
        for row, numbers in zip(rows, looked, strict=True):
            off, size = math.sqrt(numbers[2 * k]), math.sqrt(numbers[2 * k + 1])
            allowed = max(TOLERANCE[quantity.kind] * size, ROUNDING[quantity.kind] * length)
            if off > allowed:  # what is undefined is not
                beyond.append((off, allowed, float(table.t[row])))
        if len(beyond) >= min(BROKEN, len(rows)):
            off, allowed, _ = max(beyond)
            since = beyond[0][2]
            found.append(
                Contradiction(quantity.kind, quantity.name, quantity.unit, off, allowed, since, None)
            )
    return tuple(found)


def _looked_at(case: Case, table: Table, rows: list[int]) -> list[list[float]]:
    """Give what the function ``balance`` says at some rows."""
    function = named_function(case.problem, case.functions, "balance", 2 * len(case.problem.balance))
    found = []
    for row in rows:
        t, z = float(table.t[row]), case.z if table.z is None else table.z[row].copy()
        found.append(function(t, table.y[row].copy(), inputs_at(case, t), z, case.p).tolist())
    return found
