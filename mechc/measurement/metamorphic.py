"""The same mechanics said otherwise (``compiler/metamorphic``): each twin of a model must give its motion, within what both
runs claim.

A run and its twin share the time, the language and the kernel, but neither the formulas nor their rounding. Of a state both
may be off by ``FACTOR`` times their estimated errors, as in every other check of a run (``runtime/results/consistency``);
of an output by what these errors do to it. Where a contact or a constraint moves a state without a force, that is allowed
beside.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from random import Random

import numpy as np
from msgspec import Struct
from msgspec.structs import replace
from numpy.typing import NDArray

from ..compiler.flat.model import Definition, DefinitionRole, Expression, Role
from ..compiler.flat.subscripts import element_name, subscripts
from ..compiler.metamorphic.reversal import is_rate
from ..compiler.metamorphic.table import TWINS
from ..compiler.metamorphic.twin import Seen, Twin
from ..compiler.metamorphic.twin import size as scale
from ..lang.units import parse_unit
from ..model import CompiledModel
from ..requests.request import Asked
from ..runtime.interface import PURE
from ..runtime.problem import Array
from ..runtime.results.accuracy import COMPANION_RATIO
from ..runtime.results.consistency import CONDITION, FACTOR, TOUCH, spread
from ..runtime.results.evaluate import evaluate_rows
from ..runtime.studies.runs.simulate import Plan
from ..session import answered, plan
from ..solution import Solution
from .metamorphic_starts import Compared, begun_as

Indices = NDArray[np.intp]
EPSILON = float(np.finfo(float).eps)
SEED = 1
NEAR = 1e-6
"""Share of a run around an event in which nothing is compared: both have it there at other instants."""
MATCH = 1e-3
"""Share of that within which two times are one."""
DISSIPATED, SUPPLIED = "energy.dissipated", "energy.supplied"
NONE = (0.0, 0.0)
MOST_TIMES = 64
"""At which the errors of outputs are looked at."""


class Base(Struct, frozen=True):
    """A model with the run that its twins are compared with. ``own``: of a twin that begins as the model does, how the start
    that it has by itself compares."""

    model: CompiledModel
    request: Asked
    plan: Plan
    solution: Solution
    own: Compared | None = None

    @staticmethod
    def of(model: CompiledModel, request: Asked, solution: Solution, own: Compared | None = None) -> Base:
        return Base(model, request, plan(model, request), solution, own)


def twin_of(name: str, base: Base) -> Twin:
    """Make a twin. Raises NotApplicable."""
    return TWINS[name](base.model.compilation.flat, _seen(base), Random(SEED))


def _seen(base: Base) -> Seen:
    case, solution = base.plan.case, base.solution
    names, estimate = [q.name for q in case.problem.states], solution.accuracy.error
    solved = _solved_for(base)
    largest = {n: float(np.nanmax(np.abs(solution[n]))) for n in (*names, *solved)}
    first = dict(zip(names, map(float, case.y0), strict=True)) | {n: float(solution[n][0]) for n in solved}
    last = {n: float(solution[n][-1]) for n in (*names, *solved)}
    nominal = dict(zip(names, map(float, base.plan.nominal), strict=True))
    sizes = nominal if estimate is None else estimate.nominal
    sizes = {**{n: largest[n] for n in solved}, **sizes}

    def evaluated(expressions: Sequence[Expression]) -> list[list[float]]:
        flat = base.model.compilation.flat
        asked = tuple(
            Definition(f"probe {k}", DefinitionRole.OUTPUT, e.type, e, flat.origin)
            for k, e in enumerate(expressions)
        )
        probe = base.model.of(replace(flat, definitions=(*flat.definitions, *asked)), base.model.settings)
        there = plan(probe, base.request).case
        row = evaluate_rows(there, "outputs", np.array([there.begin]), there.y0[None, :])[0]
        called = [q.name for q in there.problem.outputs]
        return [
            [float(x) for n, x in zip(called, row, strict=True) if n.partition("[")[0] == f"probe {k}"]
            for k in range(len(expressions))
        ]

    return Seen(case.begin, float(solution.time[-1]), first, last, largest, sizes, evaluated)


def _solved_for(base: Base) -> list[str]:
    """List the coordinates that a balance without mass gives, and that are not states: those of a twin may be others."""
    known = {q.name for q in base.plan.case.problem.states}
    moving = [v for v in base.model.compilation.flat.variables if v.role is Role.COORDINATE]
    named = [element_name(v.name, index) for v in moving for index in subscripts(v.type.shape)]
    return [n for n in named if n not in known and n in base.solution]


def disturbed_twin(name: str, base: Base) -> Twin | None:
    """Return a twin that begins elsewhere, by what the run may be off there; None where it begins as the model does.

    What begins at the end of a run has its error, which may grow on the way back.
    """
    estimate = base.solution.accuracy.error
    assert estimate is not None
    seen = _seen(base)
    errors = (
        (n, x, estimate.by_state_at_end[n] * (estimate.nominal[n] + abs(x)))
        for n, x in seen.last.items()
        if n in estimate.by_state_at_end
    )
    last = dict(seen.last) | {n: x + (e if k % 2 else -e) for k, (n, x, e) in enumerate(errors)}
    twin = TWINS[name](base.model.compilation.flat, replace(seen, last=last), Random(SEED))
    return twin if twin.backwards else None


def beside(twin: Twin, base: Base) -> Base:
    """Return what a twin is compared with: the model as it was run, or run again with further outputs."""
    if twin.beside is None:
        return base
    ran, answer = answered(base.model.of(twin.beside, base.model.settings), base.request)
    assert isinstance(answer, Solution)
    return Base.of(ran, base.request, answer)


def run_twin(twin: Twin, base: Base) -> Base:
    """Run a twin as the model itself was run, from the start that is to be compared. Raises CompileError, SimulationError,
    UsageMistake."""
    case, own = base.plan.case, None
    if twin.start is None and case.assembled is not None:
        model, request = posed(twin, base)
        twin, own = begun_as(twin, case, plan(model, request).case)
    model, request = posed(twin, base)
    ran, answer = answered(model, request)
    assert isinstance(answer, Solution)
    return Base.of(ran, request, answer, own)


def posed(twin: Twin, base: Base, further: Mapping[str, float] | None = None) -> tuple[CompiledModel, Asked]:
    """Return a twin with the settings of the model and ``further`` ones, and what is asked about it."""
    units = base.model.settable_units()
    moving = {q.name for q in base.plan.case.problem.states}
    settings = {
        name: value * twin.factor(parse_unit(units[name] or "1").dimension)
        for name, value in base.model.settings.items()
        if twin.start is None or name not in moving
    }
    by = twin.factor(parse_unit(base.plan.case.problem.time.unit or "1").dimension)
    given = {
        n: x * by if n in ("stop", "start", "every", "step") and isinstance(x, (int, float)) else x
        for n, x in base.request.given.items()
    }
    return base.model.of(twin.model, settings | dict(further or {})), replace(base.request, given=given)


def compare(base: Base, twin: Twin, found: Base, disturbed: Base | None = None) -> Compared | None:
    """Compare both motions; None where there is nothing to compare. ``disturbed``: the twin from a start as far off as it
    may be, by which it may differ, too."""
    other = found.solution
    if found.own is not None and not found.own.same:
        return found.own
    mine, theirs = _rows(base, other, twin)
    if not mine.size:
        return None
    ours = _allowed(base.solution, base.plan, mine)
    others = _allowed(other, found.plan, theirs)
    flat = base.model.compilation.flat
    states = {v.name for v in flat.variables if v.role is Role.STATE}
    named = {q.name for q in base.plan.case.problem.states}
    turned = _turned(base, other, twin, mine, theirs)
    worst: Compared | None = None
    for name, (size, allowed) in ours.items():
        called = twin.names.get(name, name)
        if not twin.means(name) or called not in others or (name == SUPPLIED and DISSIPATED in ours):
            continue
        by = twin.factor(parse_unit(base.solution.unit(name) or "1").dimension)
        sign = -1.0 if twin.backwards and is_rate(name, states) else 1.0
        x = _booked(base.solution, name)[mine]
        y = sign * _booked(other, called)[theirs] / by * turned.get(name, 1.0)
        there_allowed = others[called][1] / by
        if name == DISSIPATED:
            allowed = allowed + ours.get(SUPPLIED, NONE)[1]
            there_allowed = there_allowed + others.get(SUPPLIED, NONE)[1] / by
        off = np.abs(x - y)
        if disturbed is not None and disturbed.solution.time.size == other.time.size:
            moved = np.abs(other[called] - disturbed.solution[called])[theirs] / by
            there_allowed = there_allowed + FACTOR * np.maximum.accumulate(np.nan_to_num(moved)[::-1])[::-1]
        off, least = np.where(np.isfinite(off), off, 0.0), allowed + there_allowed
        if name not in named:
            off = np.minimum(off, _beside(off))
        ratio = np.divide(off, least, out=np.where(off > 0, np.inf, 0.0), where=least > 0)
        k = int(np.argmax(ratio))
        one = Compared(
            name, float(off[k] / size[k]), float(least[k] / size[k]), float(base.solution.time[mine][k])
        )
        if worst is None or one.difference * worst.allowed > worst.difference * one.allowed:
            worst = one
    return worst


def _booked(solution: Solution, name: str) -> Array:
    """Give a result; of what is dissipated less what is supplied: which of them a force counts as, its text decides."""
    if name == DISSIPATED and SUPPLIED in solution:
        both: Array = solution[DISSIPATED] - solution[SUPPLIED]
        return both
    return solution[name]


def _turned(base: Base, other: Solution, twin: Twin, mine: Indices, theirs: Indices) -> dict[str, Array]:
    """Give the sign of the entries of rotations along the rows: q and -q are one."""
    states = base.plan.case.problem.states
    found: dict[str, Array] = {}
    for first in base.plan.case.problem.rotations:
        names = [q.name for q in states[first : first + 4]]
        if all(twin.means(n) and twin.names.get(n, n) in other for n in names):
            product = sum(base.solution[n][mine] * other[twin.names.get(n, n)][theirs] for n in names)
            found |= dict.fromkeys(names, np.where(product < 0, -1.0, 1.0))
    return found


def _beside(off: Array) -> Array:
    """Give the larger one of both neighbours: an output that jumps may be on either side at the time itself, by rounding."""
    if off.size < 3:
        return off
    padded = np.concatenate([off[1:2], off, off[-2:-1]])
    found: Array = np.maximum(padded[:-2], padded[2:])
    return found


def _rows(base: Base, other: Solution, twin: Twin) -> tuple[Indices, Indices]:
    """Give the rows of both at the times that they share, away from their events."""
    second = twin.factor(parse_unit(base.solution.unit("time") or "1").dimension)
    t, there = base.solution.time, other.time / second
    happened = np.concatenate(
        [
            [float(e.time) for e in base.solution.events],
            [float(e.time) / second for e in other.events],
            _instants(t),
            _instants(there),
        ]
    )
    if twin.backwards:
        there = base.plan.case.begin + t[-1] - there
    near = NEAR * float(t[-1] - t[0])
    order = np.argsort(there, kind="stable")
    place = np.searchsorted(there[order], t - MATCH * near).clip(max=order.size - 1)
    fits = np.abs(there[order][place] - t) <= MATCH * near
    if happened.size:
        fits &= np.abs(t[:, None] - happened[None, :]).min(axis=1) > near
    return np.flatnonzero(fits), order[place][fits]


def _instants(t: Array) -> Array:
    """Give the times with rows of both sides: a law may change there that lists no event."""
    repeated: Array = t[1:][t[1:] == t[:-1]]
    return repeated


def _allowed(solution: Solution, plan: Plan, rows: Indices) -> dict[str, tuple[Array, Array]]:
    """Give by name the size of a result and what it may be off by, along the rows."""
    estimate = solution.accuracy.error
    assert estimate is not None
    problem = plan.case.problem
    # what single steps may be off by that a run and its companion share; a method of fixed step shares none
    beside = 0.0 if plan.method.fixed_step else plan.case.tolerance / COMPANION_RATIO
    beside += TOUCH if problem.hybrid is not None and problem.hybrid.rows else 0.0
    beside += CONDITION * EPSILON if problem.constraints else 0.0
    # integrals that are known less well than the motion, as the report of a run says
    coarse = [q.name for q in problem.outputs if q.kind == "quadrature"]
    rough = max((float(np.nanmax(np.abs(solution[name][rows]))) for name in coarse), default=0.0)
    beside += rough
    stated = {name: error + beside for name, error in estimate.by_state.items()}
    found: dict[str, tuple[Array, Array]] = {}
    left = _not_followed(solution)
    for q in problem.states:
        size = estimate.nominal[q.name] + np.abs(solution[q.name][rows])
        if left:
            stated[q.name] += left * _fastest(solution.time[rows], solution[q.name][rows]) / float(size.max())
        found[q.name] = size, FACTOR * stated[q.name] * size
    if problem.outputs and solution.motion.states_at is not None:
        t = solution.time[rows]
        chosen = np.unique(np.linspace(0, t.size - 1, min(t.size, MOST_TIMES)).astype(int))
        y, z = solution.motion.states_at(t[chosen])
        off = spread(
            plan.case, (t[chosen], y, z), replace(estimate, by_state=stated), solution.statistics.steps
        )
        alike = dict.fromkeys(PURE, 1.0)
        for q in (*problem.states, *problem.outputs):
            if q.kind != "quadrature":
                largest = float(np.nan_to_num(np.abs(solution[q.name][rows])).max(initial=0.0))
                alike[q.unit] = max(alike.get(q.unit, 0.0), largest)
        bases = _bases(plan, alike)
        for q, error in zip(problem.outputs, off, strict=True):
            if q.kind == "quadrature":
                continue
            own = float(np.nanmax(np.abs(solution[q.name][rows]))) if t.size else 0.0
            natural = scale(parse_unit(q.unit or "1").dimension, bases)
            # of what cancels to nothing, as all that are alike may do
            rounding = CONDITION * EPSILON * max(own, alike.get(q.unit, 0.0), natural)
            found.setdefault(
                q.name,
                (np.full(t.size, own or 1.0), np.full(t.size, FACTOR * (error + rough * own) + rounding)),
            )
    return found


def _not_followed(solution: Solution) -> float:
    """Give the longest time that bounces went on after the last one that was followed: a law that asks `closed` may begin by as much
    too early, in a run and in its companion."""
    hits = [(e.name, float(e.time)) for e in solution.events if e.kind == "impact"]
    rests = [(e.name, float(e.time)) for e in solution.events if e.kind == "rest"]
    return max((t - max((s for m, s in hits if m == n and s <= t), default=t) for n, t in rests), default=0.0)


def _fastest(t: Array, x: Array) -> float:
    """Give the fastest change of a result from row to row."""
    apart = np.diff(t)
    return float(np.max(np.abs(np.diff(x)[apart > 0]) / apart[apart > 0], initial=0.0))


def _bases(plan: Plan, largest: Mapping[str, float]) -> tuple[float, float, float, float]:
    """Give the sizes of kg, m, s and A in a model, of which other units are made."""
    case = plan.case
    found = dict(largest)
    for q, value in zip(case.problem.parameters, case.p, strict=False):
        found[q.unit] = max(found.get(q.unit, 0.0), abs(float(value)))
    found["s"] = case.stop - case.begin
    kg, m, s, a = (found.get(unit, 0.0) or 1.0 for unit in ("kg", "m", "s", "A"))
    return kg, m, s, a
