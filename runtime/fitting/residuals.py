"""Measured minus computed, with its derivatives: what a search makes small.

Each measured motion is one run of the model, together with its derivatives in what is free of it (``runtime/tangent``).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Protocol

import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from ..case import Case, SimulationOptions, prepare
from ..inputs import Table
from ..integrate.choose_method import Method
from ..outcome import TOO_MANY_STEPS, SimulationError
from ..problem import Array, Problem
from ..tangent.flow import Tangents
from .measured import Measured

LONGER, LEAST_STEPS = 50, 5000
"""A trial motion may take so many times the steps of the first one, and so many at least: one that takes more is not followed."""


class FitUnknown(Struct, frozen=True):
    """One number that is searched, in SI, between ``low`` and ``high`` from ``first``. ``name`` is that of a parameter, an
    initial value or an input; ``motion``: the measured motion to which it belongs alone, None for all of them."""

    name: str
    unit: str
    low: float
    high: float
    first: float
    motion: int | None = None

    @property
    def size(self) -> float:
        """How large it is, as a unit of its changes."""
        bounds = self.high - self.low
        return abs(self.first) or (bounds if np.isfinite(bounds) else 1.0)


class Computed(Struct, frozen=True, eq=False):
    """What the model gives for each measured motion: ``values[d]`` [n, m] and ``derivatives[d]`` [n, m, k] of its m outputs
    in all k unknowns; ``reason`` why a motion did not reach its last measured time."""

    values: tuple[Array, ...]
    derivatives: tuple[Array, ...]
    reason: str = ""
    help: str = ""
    """What helps where a motion is refused, whatever the values."""


class FitPlan(Protocol):
    """A run that can begin: its case, its method, and what errors are measured against."""

    @property
    def case(self) -> Case: ...

    @property
    def method(self) -> Method: ...

    @property
    def nominal(self) -> Array: ...


def options_of(options: SimulationOptions, motion: Measured) -> SimulationOptions:
    """Return the options of the run that is compared with one measured motion; ``start`` of a fit is when that begins."""
    begin = float(motion.times[0])
    if begin == motion.times[-1]:
        raise SimulationError(f"{motion.source} has one row: nothing moves between two times")
    return replace(
        options,
        inputs={**options.inputs, **motion.inputs},
        start=begin,
        begin=options.start,
        stop=float(motion.times[-1]),
        every=None,
        points=2,
        dense=False,
        estimate_error=False,
        progress=None,
    )


class Motions:
    """The measured motions of a model, computed for any values of the unknowns. ``plan`` makes a run ready."""

    def __init__(
        self,
        problem: Problem,
        plan: Callable[[Problem, SimulationOptions], FitPlan],
        options: SimulationOptions,
        data: Sequence[Measured],
        unknowns: Sequence[FitUnknown],
        outputs: Sequence[str],
    ) -> None:
        self.problem = problem
        self._plan = plan
        self.data = tuple(data)
        self.unknowns = tuple(unknowns)
        self.outputs = tuple(outputs)
        self.evaluations = 0
        self.given_up = 0
        """Trial motions that were not followed to their end, as they took too many steps."""
        states, reported = [q.name for q in problem.states], [q.name for q in problem.outputs]
        self._columns = [
            reported.index(name) if name in reported else len(reported) + states.index(name)
            for name in outputs
        ]
        self.options = [options_of(options, motion) for motion in data]
        # whose sizes and method serve the next one
        self._begun: list[Tangents | None] = [None] * len(self.data)
        self._kept: tuple[bytes, Computed] | None = None

    @property
    def most_steps(self) -> int:
        """How many steps a trial motion may take; each measured motion has a bound of its own."""
        return max((begun.max_steps or 0 for begun in self._begun if begun is not None), default=0)

    def at(self, values: Array, share: float = 1.0) -> Computed:
        """Compute all motions. ``values`` [k]: of the unknowns; ``share``: how much of each motion, from its begin."""
        key = values.tobytes() + bytes(str(share), "ascii")
        if self._kept is None or self._kept[0] != key:
            self._kept = key, self._computed(values, share)
        return self._kept[1]

    def under(self, values: Array, inputs: Sequence[Mapping[str, Table]]) -> Computed:
        """Compute all motions under other tables of the inputs, one mapping for each."""
        kept = self.options
        self.options = [
            replace(options, inputs={**options.inputs, **tables})
            for options, tables in zip(kept, inputs, strict=True)
        ]
        try:
            return self._computed(values, 1.0)
        finally:
            self.options = kept

    def _computed(self, values: Array, share: float) -> Computed:
        self.evaluations += 1
        rows, slopes = [], []
        for d in range(len(self.data)):
            mine = [k for k, unknown in enumerate(self.unknowns) if unknown.motion in (None, d)]
            given = {self.unknowns[k].name: float(values[k]) for k in mine}
            times = self._times(d, share)
            try:
                found, slope = self._run(d, given, times)
            except SimulationError as error:
                return Computed((), (), error.message, error.help)
            if isinstance(found, str):
                return Computed((), (), found)
            rows.append(found)
            whole = np.zeros((*found.shape, len(self.unknowns)))
            whole[:, :, mine] = slope
            slopes.append(whole)
        return Computed(tuple(rows), tuple(slopes))

    def _times(self, d: int, share: float) -> Array:
        times = self.data[d].times
        return times if share == 1.0 else times[: max(2, round(share * times.size))]

    def _run(self, d: int, given: Mapping[str, float], times: Array) -> tuple[Array | str, Array]:
        """Return the outputs [n, m] and their derivatives [n, m, len(given)], or why there are none."""
        options = self.options[d]
        asked = replace(options, values={**options.values, **given})
        begun = self._begun[d]
        if begun is None:
            plan = self._plan(self.problem, asked)
            begun = Tangents(plan.case, plan.method, plan.nominal, list(given))
        else:
            case = prepare(self.problem, begun.case.functions, asked)
            most = begun.max_steps
            begun = Tangents(
                case, begun.method, begun.nominal, list(given), sizes=begun.sizes, max_steps=most
            )
        flow = begun.flow(begun.case.begin, begun.case.y0, begun.start(), times)
        if begun.max_steps is None:
            begun.max_steps = max(LONGER * flow.statistics.steps, LEAST_STEPS)
        self._begun[d] = begun
        self.given_up += flow.failure is not None and flow.failure.kind == TOO_MANY_STEPS
        if flow.short:
            return flow.short, np.empty(0)
        values = np.hstack([flow.outputs, flow.states])[:, self._columns]
        slopes = np.concatenate([flow.output_tangents, flow.tangents], axis=1)[:, self._columns]
        return values, slopes

    def residuals(self, computed: Computed, weights: Array) -> Array:
        """Give computed minus measured, times the weights [m] of the outputs: [N], without what was not measured."""
        return np.concatenate(
            [
                ((values - measured) * weights)[there]
                for values, measured, there in zip(computed.values, *self._measured(computed), strict=True)
            ]
        )

    def persistence(self, computed: Computed, weights: Array) -> float:
        """Give the correlation of residuals with the next ones of their column: 0 for independent errors."""
        above = below = 0.0
        for values, measured in zip(computed.values, self._measured(computed)[0], strict=True):
            r = np.nan_to_num((values - measured) * weights)
            above, below = above + float((r[1:] * r[:-1]).sum()), below + float((r**2).sum())
        return above / below if below else 0.0

    def farthest(self, computed: Computed, k: int) -> tuple[Array, Measured, int]:
        """Give the squares of all residuals of an output, and the motion and the row of the largest."""
        pairs = zip(computed.values, self._measured(computed)[0], strict=True)
        squares = [np.nan_to_num(values[:, k] - measured[:, k]) ** 2 for values, measured in pairs]
        d = max(range(len(squares)), key=lambda d: float(squares[d].max(initial=0.0)))
        return np.concatenate(squares), self.data[d], int(np.argmax(squares[d]))

    def jacobian(self, computed: Computed, weights: Array) -> Array:
        """Give the derivatives [N, k] of the residuals."""
        _, there = self._measured(computed)
        return np.concatenate(
            [(s * weights[:, None])[here] for s, here in zip(computed.derivatives, there, strict=True)]
        )

    def _measured(self, computed: Computed) -> tuple[list[Array], list[Array]]:
        found = []
        for motion, values in zip(self.data, computed.values, strict=True):
            nothing = np.full(motion.times.size, np.nan)
            found.append(
                np.column_stack([motion.columns.get(name, nothing) for name in self.outputs])[: len(values)]
            )
        return found, [np.isfinite(one) for one in found]

    def output_of(self, computed: Computed) -> Array:
        """Give, for each residual, which output it is of: [N]."""
        _, there = self._measured(computed)
        return np.concatenate([np.broadcast_to(np.arange(len(self.outputs)), t.shape)[t] for t in there])


def counted(r: Array, loss: str) -> Array:
    """Give how much each residual counts under a loss of scipy: the derivative of rho at its square."""
    z = r**2
    match loss:
        case "linear":
            return np.ones_like(z)
        case "soft_l1":
            return 1.0 / np.sqrt(1.0 + z)
        case "huber":
            return np.where(z <= 1.0, 1.0, 1.0 / np.sqrt(np.maximum(z, 1.0)))
        case "cauchy":
            return 1.0 / (1.0 + z)
    return 1.0 / (1.0 + z**2)
