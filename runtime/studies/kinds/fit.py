"""Parameters and starts found from measured motions, with confidence intervals and what the data cannot tell.

Least squares with the exact derivatives of the motions (Gauss-Newton in a trust region, scipy.optimize.least_squares). Where
the noise of the outputs is not given, it is estimated with the parameters: outputs are weighted by the scatter of their
own residuals (maximum likelihood of independent normal errors). Intervals are those of the linearised model at the
solution (Seber, Wild, Nonlinear Regression, ch. 5).
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any

import numpy as np
from msgspec import field
from msgspec.structs import replace

from ...allowed_values import bounds_of
from ...case import prepare
from ...fitting.input_errors import (
    DRAWS,
    FEW_DRAWS,
    Smoothers,
    carried,
    differentiated,
    roughness,
    said_of,
    smoothed,
    smoothers_of,
    widened,
)
from ...fitting.measured import Measured
from ...fitting.remarks import endless_of, remarks_of
from ...fitting.residuals import Computed, FitUnknown, Motions, options_of
from ...fitting.search import FitSearch, SearchResult
from ...fitting.uncertainty import CONFIDENCE, FitErrors, judge
from ...functions import load_functions
from ...limits_of_time import DEFAULT_TOLERANCE
from ...outcome import TOO_MANY_STEPS, Outcome, SimulationError
from ...problem import Array, Problem
from ...results.solution import Solution
from ...settings import Free, settable
from ..findings import Cell, Curve, Findings, Panel, Table, Value
from ..runs.simulate import plan_run, run
from ..study import Study

LOSSES = ("linear", "soft_l1", "huber", "cauchy", "arctan")


class Fit(Study, frozen=True, kw_only=True):
    """Values of parameters and initial values with which the model moves as it was measured.

    Each measured motion has initial values of its own, unless they are ``shared``. Bounds come from ``vary``, else from the
    ``min`` and ``max`` of the model.
    """

    data: Annotated[tuple[Measured, ...], settable("Measured motions: CSV files.", "data")] = ()
    vary: Annotated[
        tuple[Free, ...],
        settable('Free parameters, initial values and inputs: "m, l, theta = 0 .. 1 rad".', "free"),
    ] = ()
    outputs: Annotated[
        tuple[str, ...], settable("Which columns to compare, instead of all that the model has.", "names")
    ] = ()
    noise: Annotated[
        Mapping[str, float],
        settable(
            'Standard deviations of outputs (default: estimated) and of measured inputs: "theta = 1 mrad".',
            "amounts",
        ),
    ] = field(default_factory=dict)
    smooth: Annotated[
        tuple[str, ...],
        settable("Measured inputs to smooth, by a spline that is found by cross-validation.", "names"),
    ] = ()
    shared: Annotated[
        tuple[str, ...], settable("Initial values that all measured motions have in common.", "names")
    ] = ()
    start: Annotated[float | None, settable("When the motion begins; earlier data are ignored.", "time")] = (
        None
    )
    loss: Annotated[
        str, settable(f"Loss function, which sets the weight of outliers: {', '.join(LOSSES)}.", "text")
    ] = "linear"
    starts: Annotated[int, settable("Number of starts of the search, spread over the bounds.", "count")] = 1

    def _first_run(self, problem: Problem, motions: Motions) -> Solution:
        """Run the first motion where the search begins: whether it is stiff is seen there."""
        first = {unknown.name: unknown.first for unknown in motions.unknowns if unknown.motion in (None, 0)}
        options = motions.options[0]
        found = run(problem, replace(options, values={**options.values, **first}))
        if found.outcome is Outcome.INTERRUPTED:
            raise KeyboardInterrupt
        return found

    def solve(self, problem: Problem) -> Findings:
        """Search. Raises SimulationError for data that do not fit the model, and where no motion can be computed."""
        if self.loss not in LOSSES:
            raise SimulationError(f"the loss is {', '.join(LOSSES)}, not '{self.loss}'")
        if timed := [name for name in ("stop", "every") if getattr(self, name) is not None]:
            raise SimulationError(f"the measured times decide when a fit ends, not '{timed[0]}'")
        if not self.data:
            raise SimulationError("a fit needs measured motions", help="mechc fit MODEL data.csv --vary m,l")
        raw = self.data
        if self.start is not None:
            raw = tuple(motion.since(self.start) for motion in raw)
        smoothers = smoothers_of(raw, self.smooth)
        return replace(self, data=smoothed(raw, smoothers))._fitted(problem, smoothers)

    def _fitted(self, problem: Problem, smoothers: Smoothers) -> Findings:
        """Search with the data as they are smoothed."""
        outputs = _outputs(problem, self)
        unknowns = _unknowns(problem, self)
        motions = Motions(problem, plan_run, self, self.data, unknowns, outputs)
        search = FitSearch(
            motions,
            noise=np.array([self.noise.get(name, np.nan) for name in outputs]),
            loss=self.loss,
            starts=self.starts,
            finest=self.tolerance or DEFAULT_TOLERANCE,
            progress=self.progress,
        )
        first = self._first_run(problem, motions)
        if first.failure is not None and first.failure.kind == TOO_MANY_STEPS:
            return _not_begun(problem, first)
        found = search.run()
        answer = _findings(self, search, found, first, smoothers)
        if self.progress is not None:
            self.progress(1.0)
        return answer


# ---------------------------------------------------------------- what is compared and what is searched


def _outputs(problem: Problem, study: Fit) -> tuple[str, ...]:
    """Give the quantities that are compared: those asked for, else all columns. Raises SimulationError."""
    there = list(dict.fromkeys(name for motion in study.data for name in motion.columns))
    chosen = study.outputs or tuple(there)
    computed = {q.name for q in (*problem.states, *problem.outputs)}
    for name in chosen:
        if name not in there:
            raise SimulationError(
                f"'{name}' is in none of the measured motions: they have {', '.join(there)}"
            )
        if name not in computed:
            raise SimulationError(f"'{name}' is given to the model, so nothing is compared with it")
    if not chosen:
        raise SimulationError("the data have no column of the model beside the inputs")
    driving = {name for motion in study.data for name in motion.inputs}
    for name in study.noise:
        if name not in chosen and name not in driving:
            raise SimulationError(f"the noise of '{name}' is given, which is not compared and drives nothing")
    return chosen


def _unknowns(problem: Problem, study: Fit) -> tuple[FitUnknown, ...]:
    """Give the numbers that are searched, with their bounds and first values. Raises SimulationError."""
    if not study.vary:
        raise SimulationError("nothing is free", help="name what is searched: --vary m,l")
    case = prepare(problem, load_functions(problem), options_of(study, study.data[0]))
    inputs = case.functions.inputs
    parameters = {q.name: (q, case.p[i]) for i, q in enumerate(problem.parameters)}
    states = {q.name: (q, case.y0[i]) for i, q in enumerate(problem.states)}
    found: list[FitUnknown] = []
    for free in study.vary:
        initial = free.name in states
        if initial or free.name in parameters:
            quantity, value = (states if initial else parameters)[free.name]
        else:
            index = [q.name for q in problem.inputs].index(free.name)
            if any(free.name in motion.inputs for motion in study.data):
                raise SimulationError(f"'{free.name}' was measured, so it is not searched")
            assert inputs is not None
            quantity, value = (
                problem.inputs[index],
                inputs(case.begin, case.y0, np.empty(0), case.z, case.p)[index],
            )
        low, high = bounds_of(problem, free)
        if not np.isfinite(value):
            value = 0.0
        if not low <= value <= high:
            if free.low is None or free.high is None:
                raise SimulationError(
                    f"'{free.name}' begins at {value:g}, outside of its bounds {low:g} to {high:g}"
                )
            value = (low + high) / 2
        own = initial and free.name not in study.shared and len(study.data) > 1
        found += [
            FitUnknown(free.name, quantity.unit, low, high, float(value), motion)
            for motion in (range(len(study.data)) if own else (None,))
        ]
    for name in study.shared:
        if name not in {free.name for free in study.vary}:
            raise SimulationError(f"'{name}' is shared, but not free")
    numbers = sum(motion.count(_outputs(problem, study)) for motion in study.data)
    if numbers <= len(found):
        raise SimulationError(
            f"{numbers} measured numbers cannot tell {len(found)} unknowns and their errors"
        )
    return tuple(found)


# ---------------------------------------------------------------- the answer


def _name(motions: Motions, k: int) -> str:
    """Return the name of an unknown; of one that belongs to one measured motion, with that."""
    unknown = motions.unknowns[k]
    if unknown.motion is None:
        return unknown.name
    sources = [motion.source for motion in motions.data]
    source = sources[unknown.motion]
    which = source if sources.count(source) == 1 else f"{source}, number {unknown.motion + 1}"
    return f"{unknown.name} ({which})"


def _not_begun(problem: Problem, first: Solution) -> Findings:
    """Return what a motion that takes too many steps leaves: it is asked again with a method for stiff ones."""
    return Findings(
        study="fit",
        model=problem.name,
        outcome=first.outcome,
        message=first.message,
        errors_from="",
        runs=(first,),
    )


def _findings(
    study: Fit,
    search: FitSearch,
    found: SearchResult,
    first: Solution,
    smoothers: Smoothers,
) -> Findings:
    motions = search.motions
    names = [_name(motions, k) for k in range(len(motions.unknowns))]
    judged, driven = _with_inputs(study, search, found, smoothers, names)
    values = tuple(
        Value(name, unknown.unit, float(x), float(half) if np.isfinite(half) else None)
        for name, unknown, x, half in zip(names, motions.unknowns, found.x, judged.half, strict=True)
    )
    units = {q.name: q.unit for q in (*motions.problem.states, *motions.problem.outputs)}
    endless = endless_of(search, found, names)
    computed = motions.at(found.x)
    rms = {name: float(s) for name, s in zip(motions.outputs, _rms(motions, computed), strict=True)}
    return Findings(
        study="fit",
        model=motions.problem.name,
        outcome=Outcome.COMPLETED if found.converged and not endless else Outcome.DOUBTFUL,
        message=_message(search, found),
        values=values,
        errors_from=f"half of the {CONFIDENCE:.0%} confidence intervals of the linearised model",
        remarks=(*endless, *driven, *remarks_of(search, found, judged, names)),
        tables=(_residual_table(motions, rms, units), *_correlation_table(names, judged)),
        panels=_panels(motions, computed, units),
        details=_details(motions, names, judged, rms, units),
        runs=(first,),
        arrays={"x": found.x, "stderr": judged.errors, "correlation": judged.correlation},
    )


def _with_inputs(
    study: Fit,
    search: FitSearch,
    found: SearchResult,
    smoothers: Smoothers,
    names: list[str],
) -> tuple[FitErrors, list[str]]:
    """Judge, with the noise of measured inputs: as given, or as smoothing left it; else say where it matters."""
    motions, judged = search.motions, judge(search, found, names)
    units = {q.name: q.unit for q in motions.problem.inputs}
    noise = {name: size for name, size in study.noise.items() if name in units}
    if noise or any(smoothers):
        spread = carried(motions, found, noise, smoothers, DRAWS)
        judged = judged if spread is None else widened(judged, spread)
        return judged, said_of(judged, spread, names, units, study.smooth, held=True)
    rough = roughness(motions.data, differentiated(motions.problem, motions.data))
    if not rough:
        return judged, []
    spread = carried(motions, found, rough, smoothers, FEW_DRAWS)
    return judged, said_of(judged, spread, names, units, (), held=False)


def _rms(motions: Motions, computed: Computed) -> Array:
    r, of = motions.residuals(computed, np.ones(len(motions.outputs))), motions.output_of(computed)
    return np.array([np.sqrt(np.mean(r[of == m] ** 2)) for m in range(len(motions.outputs))])


def _message(search: FitSearch, found: SearchResult) -> str:
    numbers = search.motions.residuals(search.motions.at(found.x), found.weights).size
    data = search.motions.data
    text = f"{numbers} numbers of {len(data)} measured motion{'s' if len(data) > 1 else ''}, "
    text += f"{search.motions.evaluations} evaluations"
    return text if found.converged else f"{text}; the search did not converge: {found.message}"


def _residual_table(motions: Motions, rms: Mapping[str, float], units: Mapping[str, str]) -> Table:
    rows: list[tuple[Cell, ...]] = [(name, value, units[name] or "1") for name, value in rms.items()]
    return Table("residuals", (("output", ""), ("root mean square", ""), ("unit", "")), tuple(rows))


def _correlation_table(names: list[str], judged: FitErrors) -> list[Table]:
    """Give the correlation of what the data tell."""
    seen = [k for k in range(len(names)) if np.isfinite(judged.errors[k])]
    if len(seen) < 2:
        return []
    rows: list[tuple[Cell, ...]] = [
        (names[k], *(round(float(judged.correlation[k, other]), 3) for other in seen)) for k in seen
    ]
    return [Table("correlation", (("", ""), *((names[k], "") for k in seen)), tuple(rows))]


def _details(
    motions: Motions, names: list[str], judged: FitErrors, rms: Mapping[str, float], units: Mapping[str, str]
) -> dict[str, Any]:
    """Give what the JSON object holds beside the values; what cannot be told is null."""

    def plain(value: float) -> float | None:
        return float(value) if np.isfinite(value) else None

    same = len({units[name] for name in rms}) == 1
    everything = np.sqrt(np.mean([v**2 for v in rms.values()])) if same else judged.relative
    return {
        "stderr": {name: plain(e) for name, e in zip(names, judged.errors, strict=True)},
        "interval": {name: plain(e) for name, e in zip(names, judged.half, strict=True)},
        "correlation": {
            name: {other: plain(c) for other, c in zip(names, row, strict=True)}
            for name, row in zip(names, judged.correlation, strict=True)
        },
        "unseen": list(judged.unseen.texts),
        "residual_rms": float(everything),
        "residual_rms_of": dict(rms),
        "evaluations": motions.evaluations,
    }


def _panels(motions: Motions, computed: Computed, units: Mapping[str, str]) -> tuple[Panel, ...]:
    """Give, for each output, what was measured with what the model gives, and the difference."""
    panels = []
    time = motions.problem.time
    for m, name in enumerate(motions.outputs):
        both, apart = [], []
        for d, motion in enumerate(motions.data):
            if name not in motion.columns:
                continue
            values, measured = computed.values[d][:, m], motion.columns[name]
            label = f" ({motion.source})" if len(motions.data) > 1 else ""
            both += [
                Curve(f"measured{label}", motion.times, measured, "points", d),
                Curve(f"model{label}", motion.times, values, "line", d),
            ]
            apart.append(Curve(f"measured - model{label}", motion.times, measured - values, "points", d))
        unit = units[name]
        panels += [
            Panel(name, "time", time.unit, name, unit, tuple(both)),
            Panel(f"residuals of {name}", "time", time.unit, "measured - model", unit, tuple(apart)),
        ]
    return tuple(panels)
