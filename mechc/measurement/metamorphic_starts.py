"""Where a twin begins, if its assembly weighs guesses otherwise than that of the model.

An assembly moves guesses by the least change as shares of their sizes (docs/language.md, section 11), which other units, or
parameters that only the model uses, make others: both starts are right then, and two motions. Such a twin begins at the start of the model,
which its own assembly must not move; and its own start has to fulfil what the start of the model fulfils.
"""

from __future__ import annotations

import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from ..compiler.metamorphic.starts import begun
from ..compiler.metamorphic.twin import Twin
from ..lang.units import parse_unit
from ..runtime.case import Case, inputs_at
from ..runtime.interface import PURE, Quantity
from ..runtime.problem import Array
from ..runtime.start.assembly import Assembly
from ..runtime.start.facts import start_facts
from ..runtime.start.free_state import characteristic_length

ALIKE = 1e-9
"""By how much weights of an assembly may differ by rounding, and a start may miss what it has to fulfil, as shares."""


class Compared(Struct, frozen=True):
    """``name`` of the result that both disagree about most, as shares of its size: the ``difference``, and what is
    ``allowed``; ``at`` which time."""

    name: str
    difference: float
    allowed: float
    at: float

    @property
    def same(self) -> bool:
        return self.difference <= self.allowed


def begun_as(twin: Twin, case: Case, other: Case) -> tuple[Twin, Compared | None]:
    """Return the twin that begins as the model does where its assembly weighs otherwise, with how its own start compares;
    else the twin itself. ``case`` is that of the model, ``other`` that of the twin."""
    if twin.start is not None or case.assembled is None or other.assembled is None:
        return twin, None
    own = dict(zip((q.name for q in other.problem.states), other.y0.tolist(), strict=True))
    moving = [q for q in case.problem.states if q.kind != "account"]
    names = {q.name: twin.names.get(q.name, q.name) for q in moving if twin.means(q.name)}
    places = [case.problem.states[i].name for i in case.problem.partner]
    if not all(names.get(n) in own for n in places) or _weighed_alike(twin, case, other, names):
        return twin, None
    start = {
        names[q.name]: float(y) * _factor(twin, q)
        for q, y in zip(case.problem.states, case.y0, strict=True)
        if names.get(q.name) in own
    }
    mapped = [
        own[names[q.name]] / _factor(twin, q) if names.get(q.name) in own else float(y)
        for q, y in zip(case.problem.states, case.y0, strict=True)
    ]
    return replace(twin, model=begun(twin.model, start), start=start), missed(case, np.array(mapped))


def missed(case: Case, y: Array) -> Compared:
    """Return what a state misses most of what the start of a case fulfils: given values, and its equations, as shares of
    sizes that a change of coordinates has."""
    assert case.assembled is not None and case.functions.assembly is not None
    found = [Compared("", 0.0, ALIKE, case.begin)]
    for q, known, x, stated in zip(case.problem.states, case.known, y, case.y0, strict=True):
        if known:
            off = abs(float(x - stated)) / (abs(float(stated)) or 1.0)
            found.append(Compared(q.name, off, ALIKE, case.begin))
    if case.functions.assembly_jacobian is not None:
        u = inputs_at(case, case.begin)
        made = Assembly.of(case.problem, case.functions, case.begin, case.known, u, case.z, case.p)
        rates = np.abs(y[case.problem.nq : case.problem.nq + case.problem.nv]) * made.weights
        for stage, unit in ((1, 1.0), (2, max(1.0, rates.max(initial=0.0)))):
            rows = made.rows(stage)
            sizes = np.abs(made.gradients(y, stage)).max(axis=1, initial=0.0)
            for row, value, size in zip(rows, made.residuals(y)[rows], sizes, strict=True):
                off = abs(float(value)) / ((size or 1.0) * unit)
                found.append(Compared(case.problem.assembly[row].name, off, ALIKE, case.begin))
    return max(found, key=lambda c: c.difference if np.isfinite(c.difference) else np.inf)


def _weighed_alike(twin: Twin, case: Case, other: Case, names: dict[str, str]) -> bool:
    """Whether both assemblies measure the same change, up to a factor of the whole."""
    mine, theirs = _weights(case), _weights(other)
    states = {q.name: q for q in case.problem.states}
    ratios = [theirs[names[n]] * _factor(twin, states[n]) / weight for n, weight in mine.items()]
    soft = [row for row in case.problem.assembly if row.kind == "initial" and not row.known]
    if soft:
        lengths = [
            characteristic_length(facts, c.p) if (facts := start_facts(c.problem)) else 1.0
            for c in (case, other)
        ]
        ratios += [
            1.0 if row.unit in PURE else lengths[0] / lengths[1] * twin.factor(parse_unit(row.unit).dimension)
            for row in soft
        ]
    return max(ratios, default=1.0) <= (1 + ALIKE) * min(ratios, default=1.0)


def _weights(case: Case) -> dict[str, float]:
    assert case.assembled is not None
    states = case.problem.states
    return {
        states[i].name: float(w) for i, w in zip(case.problem.partner, case.assembled.weights, strict=True)
    }


def _factor(twin: Twin, q: Quantity) -> float:
    return twin.factor(parse_unit(q.unit or "1").dimension)
