"""A curve that was found, as data: its values with their errors, what kind of extremum it is, and the curve at any place."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..interface import Quantity
from ..outcome import Outcome
from ..problem import Array, Problem
from ..results.files import json_number, write_results
from ..results.quantities import Display
from .conjugate_points import conjugate_points, plain
from .divergence import diverging
from .exchanged import parameters_at, rates
from .optimality_checks import along, contradiction, drifting
from .posed import Posed
from .search import FoundCurve, reported_z
from .starts import densities, evaluate, turns_back

BESIDE = 1e-12
"""Share of the range beside a kink at which its two sides are taken."""
ASIDE = 1e-9
"""Share of the range beside the border of an element at which slopes are compared."""
CORNER = 0.01
"""Part of their range by which slopes leap at a corner."""
POINTS = 501
"""Places at which the curve is written and drawn, beside the borders of its elements."""


class CurveSolution:
    """A mapping from names to arrays over ``places``: coordinates, their slopes, outputs that vary, multipliers.

    ``stationary`` is the value of what is stationary with its ``error``; ``outputs``, ``multipliers`` are numbers by name;
    ``negative_directions`` and ``kind`` tell a minimum from a saddle; ``interval`` the ends of the range;
    ``conjugate_points`` to its lower end, where one integral of one coordinate decides between given ends. All in SI.
    """

    def __init__(
        self, posed: Posed, answer: FoundCurve, *, coarse: FoundCurve | None, seconds: float
    ) -> None:
        self.problem: Problem = posed.problem
        self.model = posed.problem.name
        self.experiment = posed.experiment.name if posed.experiment else ""
        self.tolerance = posed.tolerance
        self.parameters: Mapping[str, float] = {
            q.name: float(v) for q, v in zip(self.problem.parameters, posed.p, strict=False)
        }
        self._posed, self._answer = posed, answer
        self.seconds = seconds
        self.stationary = answer.value
        self.error = answer.value_error
        self.interval = posed.range(answer.solved.whole[: posed.curve.unknown])
        self.remarks: list[str] = list(dict.fromkeys(answer.remarks))
        self._z = reported_z(posed, answer.discrete, answer.solved)
        self.negative_directions, self.kind = _kind(posed, answer, coarse)
        self.conjugate_points: list[float] = conjugate_points(posed, answer) if plain(posed) else []
        self._kinks = posed.bends()
        self.places = self._sample()
        self._table = self._tabulated()
        self.outputs: dict[str, float] = {}
        self.output_errors: dict[str, float] = {}
        for q, varies, value, error in zip(
            self.problem.outputs, posed.curve.varying, answer.outputs, answer.output_errors, strict=True
        ):
            if not varies:
                self.outputs[q.name] = float(value)
                self.output_errors[q.name] = float(error)
        self.multipliers = self._multipliers()
        self.first_integrals = self._drifts()
        self.doubted = False

    # ------------------------------------------------------------ the curve

    def __call__(self, x: float | Array) -> dict[str, Any]:
        """Return everything that varies at places of the range."""
        a, b = self.interval
        at = np.atleast_1d(np.asarray(x, dtype=float))
        low, high = a - 1e-12 * (b - a), b + 1e-12 * (b - a)
        if np.any(at < low) or np.any(at > high):
            raise ValueError(f"the range goes from {a:g} to {b:g}")
        if self._posed.curve.exchanged:
            if turns_back(self._answer.discrete, self._answer.solved):
                raise ValueError(f"the curve is not a function of '{self.problem.time.name}': it turns back")
            table = self._values(parameters_at(self._answer, at))
        else:
            s = (at - a) / (b - a)
            for kink in self._kinks:  # there the values of its right side
                s = np.where(np.abs(s - kink) < BESIDE, kink + BESIDE, s)
            table = self._values(s)
        return {n: v if np.ndim(x) else float(v[0]) for n, v in table.items()}

    def __getitem__(self, name: str) -> Array:
        return self._table[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._table)

    def __contains__(self, name: object) -> bool:
        return name in self._table

    def __len__(self) -> int:
        return len(self._table)

    @property
    def names(self) -> tuple[str, ...]:
        """What varies along the curve, the independent variable first."""
        return (self.problem.time.name, *self._table)

    @property
    def coordinates(self) -> tuple[str, ...]:
        curve = self._posed.curve
        return tuple(q.name for q in self.problem.states[: curve.coordinates - curve.exchanged])

    def unit(self, name: str) -> str:
        """Return the SI unit of what varies along the curve."""
        if name == self.problem.time.name:
            return self.problem.time.unit
        known = {q.name: q.unit for q in (*self.problem.states, *self.problem.outputs)}
        if name in known:
            return known[name]
        if name.startswith("der("):
            over = self.problem.time.unit
            unit = known.get(name[4:-1], "")
            return f"{unit or '1'}/{over}" if over else unit
        return ""

    def _sample(self) -> Array:
        nodes = self._answer.discrete.mesh.nodes
        s = np.unique(np.concatenate([np.linspace(0, 1, POINTS), nodes[(nodes > 1e-9) & (nodes < 1 - 1e-9)]]))
        for kink in self._kinks:  # both sides of it, each with its own slope
            s = np.concatenate([s[s < kink - BESIDE], [kink - BESIDE, kink + BESIDE], s[s > kink + BESIDE]])
        a, b = self.interval
        self._s = s
        return rates(self._answer, s)[0] if self._posed.curve.exchanged else a + (b - a) * s

    def _tabulated(self) -> dict[str, Array]:
        return self._values(self._s)

    def _along(self, s: Array) -> Array:
        """Return coordinates, their derivatives by s, and densities of multipliers: (height, places)."""
        curve, answer = self._posed.curve, self._answer
        y = evaluate(answer.discrete, answer.solved, s, curve.depth)
        if curve.points:  # no curve with such conditions has its variables exchanged
            length = self.interval[1] - self.interval[0]
            y[curve.coordinates * (curve.depth + 1) :] = densities(answer.discrete, answer.solved, s) / length
        return y

    def _values(self, s: Array) -> dict[str, Array]:
        posed, answer = self._posed, self._answer
        curve, n = posed.curve, posed.curve.coordinates
        y = self._along(s)
        length: Any = y[2 * n - 1] if curve.exchanged else self.interval[1] - self.interval[0]
        height = n * (curve.depth + 1)
        names = self.coordinates
        table = {name: y[k] for k, name in enumerate(names)}
        if curve.depth >= 1:
            with np.errstate(divide="ignore", invalid="ignore"):  # slopes may be infinite
                table |= {f"der({name})": y[n + k] / length for k, name in enumerate(names)}
        varying = [k for k, v in enumerate(curve.varying) if v]
        if varying:
            found = answer.discrete.call("outputs", s, y, self._z)
            table |= {self.problem.outputs[k].name: found[k] for k in varying}
        table |= {f"multiplier({row.name})": y[height + k] for k, row in enumerate(curve.points)}
        return table

    def failed_assertions(self) -> list[tuple[int, float]]:
        """Return assertions of the model that do not hold, by index, each with the first place where it does not."""
        if not self.problem.assertions:
            return []
        y = self._along(self._s)
        holds = self._answer.discrete.call("assertions", self._s, y, self._z) > 0.5
        return [(k, float(self.places[np.argmin(row)])) for k, row in enumerate(holds) if not row.all()]

    # ------------------------------------------------------------ numbers of the whole

    def _multipliers(self) -> dict[str, float]:
        curve = self._posed.curve
        start = curve.unknown + 2 * len(curve.numbers)
        return {
            row.name: float(self._z[start + k]) for k, row in enumerate(curve.wholes) if row.kind == "whole"
        }

    def _drifts(self) -> dict[str, tuple[float, float]]:
        """Return each first integral with its largest deviation from the mean."""
        posed, answer = self._posed, self._answer
        if not posed.curve.first:
            return {}
        discrete = answer.discrete
        inner = discrete.inner
        y = discrete.rows(answer.solved, inner)
        height = posed.curve.coordinates * (posed.curve.depth + 1)
        if posed.curve.points:
            found = densities(discrete, answer.solved, inner.s.ravel())
            y[height:] = found.reshape(len(found), *inner.s.shape) / (self.interval[1] - self.interval[0])
        values = discrete.call("first_integrals", inner.s, y, self._z)
        weights = inner.weights / inner.weights.sum()
        drifts = {}
        for row, value in zip(posed.curve.first, values, strict=True):
            mean = float(np.sum(weights * value))
            off = np.sqrt(max(float(np.sum(weights * (value - mean) ** 2)), 0.0))
            drifts[row.name] = (mean, float(off))
        return drifts

    # ------------------------------------------------------------ what reports and files show

    @property
    def outcome(self) -> Outcome:
        return Outcome.DOUBTFUL if self._doubts() else Outcome.COMPLETED

    @property
    def size(self) -> float:
        """Of what is stationary: its value, or that of its guess where it is nothing but rounding."""
        return max(abs(self.stationary), self._answer.size)

    def _doubts(self) -> bool:
        size = self.size
        return (
            self.doubted or not np.isfinite(self.error) or self.error > max(1e3 * self.tolerance, 1e-6) * size
        )

    @property
    def deciding(self) -> frozenset[str]:
        """Names of the integrals on which the curve depends."""
        return frozenset(row.name for row in self._posed.curve.numbers if row.kind == "integral")

    def corners(self) -> list[float]:
        """Return the places at which slopes leap though no formula is special there."""
        posed = self._posed
        curve = posed.curve
        if curve.exchanged or curve.bends or any(row.bound for row in curve.points):
            return []
        nodes = self._answer.discrete.mesh.nodes[1:-1]
        special = np.array([0.0, 1.0, *posed.borders()])
        nodes = nodes[np.min(np.abs(nodes[:, None] - special[None, :]), axis=1) > 2 * ASIDE]
        if not nodes.size:
            return []
        n = curve.coordinates
        before, behind = (self._along(nodes + side)[n : 2 * n] for side in (-ASIDE, ASIDE))
        along = self._along(self._s)[: 2 * n]
        ranges = np.ptp(along[n:], axis=1)
        sizes = np.max(np.abs(along), axis=1).reshape(2, n).max(axis=0)
        with np.errstate(invalid="ignore"):
            # no leaps of rounding along straight lines, or where a coordinate is zero
            least = np.maximum(np.maximum(ranges, 1e-3 * sizes), 1e-9)
            leaps = np.abs(behind - before) > CORNER * least[:, None]
        a, b = self.interval
        return [float(a + (b - a) * s) for s in nodes[leaps.any(axis=0)]]

    def endless(self) -> dict[str, str]:
        """Return integrals that have no finite value, by name, with the place that they fail at; empty where errors are small."""
        known = [
            (self.stationary, self.error),
            *((v, self.output_errors[n]) for n, v in self.outputs.items()),
        ]
        if all(error <= max(1e3 * self.tolerance, 1e-6) * abs(value) for value, error in known):
            return {}
        return diverging(self._posed, self._answer.discrete, self._answer.solved, self._z)

    def contradicted(self) -> str:
        """Say what contradicts the curve: a first integral that is not the same along it, Legendre's or Weierstrass' condition."""
        low, high = self.interval
        ranges = {name: float(np.ptp(self._table[name])) for name in self.coordinates}
        said = drifting(self.first_integrals, self.size, ranges, high - low)
        posed, answer = self._posed, self._answer
        return said or contradiction(posed, along(posed, answer.discrete, answer.solved), self.kind)

    @property
    def runs(self) -> tuple[()]:
        return ()

    def quantity(self, name: str) -> Quantity | None:
        return next((q for q in (*self.problem.states, *self.problem.outputs) if q.name == name), None)

    def statistics(self) -> dict[str, Any]:
        return {
            "newton_steps": self._answer.steps,
            "unknowns": self._answer.count,
            "elements": self._answer.discrete.mesh.count,
            "degree": self._answer.discrete.mesh.degree,
            "seconds": self.seconds,
        }

    def summary(self) -> dict[str, Any]:
        """Return the answer as JSON knows it, in SI."""
        varying = {n: v for n, v in self._table.items() if n in {q.name for q in self.problem.outputs} or n.startswith("multiplier(")}  # fmt: skip
        unknown = self.problem.discretes[: self._posed.curve.unknown]
        return {
            "study": "curve",
            "model": self.model,
            "experiment": self.experiment,
            "outcome": self.outcome.value,
            "stationary": json_number(self.stationary),
            "unit": self._posed.curve.unit,
            "kind": self.kind,
            "negative_directions": self.negative_directions,
            "conjugate_points": [json_number(x) for x in self.conjugate_points],
            "interval": [json_number(x) for x in self.interval],
            "unknown": {q.name: json_number(float(v)) for q, v in zip(unknown, self._z, strict=False)},
            "outputs": {name: json_number(v) for name, v in self.outputs.items()},
            "ranges": {
                n: [json_number(float(v.min())), json_number(float(v.max()))] for n, v in varying.items()
            },
            "multipliers": {name: json_number(v) for name, v in self.multipliers.items()},
            "parameters": {name: json_number(v) for name, v in self.parameters.items()},
            "accuracy": {
                "tolerance": self.tolerance,
                "estimated_error": json_number(self.error),
                "outputs": {name: json_number(v) for name, v in self.output_errors.items()},
                "first_integrals": {
                    name: {"value": json_number(v), "drift": json_number(d)}
                    for name, (v, d) in self.first_integrals.items()
                },
            },
            "statistics": self.statistics(),
            "remarks": self.remarks,
        }

    def save(
        self, path: str | Path, names: Sequence[str] | None = None, display: Display | None = None
    ) -> None:
        """Write the curve: csv, npz or json. ``display`` gives (unit, factor) by name and SI unit; SI without it."""
        over = self.problem.time.name
        columns = {over: (self.unit(over), self.places)}
        columns |= {n: (self.unit(n), v) for n, v in self._table.items() if not names or n in names}
        if display is not None:
            for name, (unit, values) in columns.items():
                shown, factor = display(name, unit)
                columns[name] = (shown, values * factor)
        write_results(Path(path), columns, self.summary())


def _kind(posed: Posed, answer: FoundCurve, coarse: FoundCurve | None) -> tuple[int, str]:
    """Return the number of negative directions and what that makes of the curve."""
    negative = answer.negative
    positive = answer.free - negative
    if posed.curve.gauge:  # the speed is kept by directions of its own, all positive
        mesh = answer.discrete.mesh
        positive -= mesh.count * mesh.degree - 1
    if not answer.definite:
        return negative, "degenerate"
    if negative == 0:
        return 0, "minimum"
    if positive <= 0:
        return negative, "maximum"
    return negative, "saddle"
