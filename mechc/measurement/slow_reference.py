"""A reference in arithmetic of any precision, by mpmath: for machines whose C compiler has nothing beyond double."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from ..compiler.graph.evaluate import Tape, multiprecision
from ..runtime.reference.extrapolation import NoConvergence, extrapolate
from ..runtime.reference.high_precision import PrecisionReference, ReferenceFailed

if TYPE_CHECKING:
    from ..model import CompiledModel
    from ..runtime.case import Case
    from ..runtime.problem import Array

DIGITS = 36
TOLERANCES = (1e-18, 1e-22)


def slow_reference(model: CompiledModel, case: Case, nominal: Array, seconds: float) -> PrecisionReference:
    """Solve a case at the times of its grid. ``seconds``: how long one run may take.

    Raises ReferenceFailed for models with constraints, events or tables, which need the kernel, and where mpmath is not
    installed.
    """
    try:
        from mpmath.ctx_mp import MPContext
    except ImportError:
        raise ReferenceFailed(
            "the C compiler has no numbers of more than 53 bits, and mpmath is not installed"
        ) from None
    equations = model.compilation.equations
    if equations.constraints or equations.switching is not None or case.tables:
        raise ReferenceFailed(
            "constraints, events and tables need a C compiler with numbers of more than 53 bits"
        )
    context = MPContext()
    context.dps = DIGITS
    begun = time.process_time()
    counted = [0]
    rates = _rates(model, case, context, counted, begun + 2 * seconds)
    start = [context.mpf(float(v)) for v in case.y0]
    sizes = [context.mpf(float(v)) for v in nominal]
    times = [context.mpf(float(t)) for t in case.grid]
    runs: list[tuple[Array, Array]] = []
    try:
        for tolerance in TOLERANCES:
            rows = extrapolate(rates, context.mpf(case.begin), start, times, sizes, context.mpf(tolerance))
            high = np.array([[float(v) for v in row] for row in rows])
            low = np.array(
                [
                    [float(v - context.mpf(h)) for v, h in zip(row, top, strict=True)]
                    for row, top in zip(rows, high.tolist(), strict=True)
                ]
            )
            runs.append((high, low))
    except NoConvergence as failure:
        raise ReferenceFailed(f"extrapolation does not converge {failure}") from None
    (high, low), (best, rest) = runs
    doubt = (np.abs((high - best) + (low - rest)) / (nominal + np.abs(best))).max(axis=1)
    taken = time.process_time() - begun
    return PrecisionReference(
        case.grid,
        best,
        rest,
        doubt,
        nominal,
        f"mpmath, {DIGITS} digits",
        "extrapolation",
        TOLERANCES[-1],
        taken,
        counted[0],
    )


def _rates(
    model: CompiledModel, case: Case, context: Any, counted: list[int], deadline: float
) -> Callable[[Any, list[Any]], list[Any]]:
    """Return dy/dt in the numbers of a context; raises ReferenceFailed after the deadline."""
    equations = model.compilation.equations
    rhs = next(f for f in equations.functions if f.name == "rhs")
    if equations.inputs:
        raise ReferenceFailed("inputs need a C compiler with numbers of more than 53 bits")
    slots = {n: equations.layout[n] for n in equations.graph.support(*rhs.outputs)}
    play = Tape(equations.graph, rhs.outputs, slots, multiprecision(context))
    fixed = {n: context.mpf(float(case.p[s.index])) for n, s in slots.items() if s.array == "p"}
    fixed |= {n: context.mpf(float(case.z[s.index])) for n, s in slots.items() if s.array == "z"}
    moving = {n: s.index for n, s in slots.items() if s.array == "y"}
    clock = [n for n, s in slots.items() if s.array == "t"]
    unit = equations.rotations

    def rates(t: Any, y: list[Any]) -> list[Any]:
        counted[0] += 1
        if time.process_time() > deadline:
            raise ReferenceFailed("a run in mpmath takes too long")
        if unit:
            y = list(y)
            for first in unit:
                norm = context.sqrt(sum(v * v for v in y[first : first + 4]))
                y[first : first + 4] = [v / norm for v in y[first : first + 4]]
        values = play({**fixed, **{n: y[i] for n, i in moving.items()}, **dict.fromkeys(clock, t)})
        return [context.mpf(values[n]) for n in rhs.outputs]

    return rates
