"""What mechc says of a curve beside what the reference says."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np

import mechc
from mechc.runtime.outcome import SimulationError

from .jets import Numbers
from .posed import Posed
from .ritz import Ritz
from .tree import coordinate

LEVELS = ((1, 9), (1, 13), (2, 13), (3, 15), (5, 15), (10, 16))
SHARES = np.array([0.0, 0.07, 0.21, 0.38, 0.5, 0.63, 0.79, 0.94, 1.0])


@dataclass
class Report:
    """``refused`` where mechc said no, ``unknown`` where the reference did not settle, ``compared`` otherwise."""

    refused: str = ""
    unknown: str = ""
    compared: list[tuple[str, float, float, float]] = field(default_factory=list)
    disagreements: list[str] = field(default_factory=list)


def answered(model: Posed) -> Any:
    loaded = mechc.loads(model.text)
    return loaded.solve(set=model.given or None, experiment=model.experiment)


def references(model: Posed, found: Any) -> tuple[Ritz, Ritz]:
    """Return the reference on its two finest discretisations, refined until the value settles."""

    def start(x: Numbers) -> tuple[Numbers, float]:
        low, high = found.interval
        inside = np.clip(x, low, high)
        rows = np.stack([np.array([float(found(float(v))[n]) for v in inside]) for n in names], axis=1)
        return rows, high

    names = model.names[: len(model.sizes)]
    before: Ritz | None = None
    for pieces, degree in LEVELS:
        now = Ritz(model, pieces, degree)
        if before is None:
            now.begin(start)
        else:
            now.begin(partial(carried, model, before))
        try:
            now.solve()
        except ArithmeticError:  # too coarse for this curve
            if (pieces, degree) == LEVELS[-1]:
                raise
            continue
        if before is not None:
            last = (pieces, degree) == LEVELS[-1]
            if settled(model, before, now, 1e4 if last else 1.0):
                return before, now
        before = now
    raise ArithmeticError("the reference does not settle")


def carried(model: Posed, ritz: Ritz, x: Numbers) -> tuple[Numbers, float]:
    s = (x - ritz.a) / (ritz.upper - ritz.a)
    rows = [ritz.curve(coordinate(i), s) for i in range(len(model.sizes))]
    return np.stack(rows, axis=1), ritz.upper


def settled(model: Posed, a: Ritz, b: Ritz, share: float) -> bool:
    first, second = (r.outer(model.stationary)[0].value for r in (a, b))
    curves = [
        np.abs(a.curve(coordinate(i), SHARES) - b.curve(coordinate(i), SHARES)).max() / size
        for i, size in enumerate(model.sizes)
    ]
    return abs(first - second) < share * 1e-11 * (1e-3 * b.size + abs(second)) and max(curves) < share * 1e-9


def compare(model: Posed) -> Report:
    """Return how mechc's answer compares with the reference."""
    report = Report()
    try:
        found = answered(model)
    except mechc.CompileError as error:
        report.refused = " ".join(sorted({d.code for d in error.diagnostics})) + ": " + str(error)
        return report
    except (SimulationError, mechc.UsageMistake) as error:
        report.refused = f"{type(error).__name__}: {error}"
        return report
    if found.doubted:
        report.unknown = found.remarks[-1]
        return report
    try:
        coarse, fine = references(model, found)
    except (ArithmeticError, np.linalg.LinAlgError, ValueError) as error:
        report.unknown = str(error)
        return report
    Comparison(model, found, coarse, fine, report).all()
    return report


@dataclass
class Comparison:
    """Both answers, and where what differs is written."""

    model: Posed
    found: Any
    coarse: Ritz
    fine: Ritz
    report: Report

    def note(self, name: str, ours: float, both: list[float], size: float, claimed: float) -> None:
        """Compare one number; ``claimed`` is what mechc says of its error, ``size`` what rounding is a share of."""
        coarse, fine = both
        bound = 30 * claimed + 3 * abs(fine - coarse) + 1e-11 * size
        self.report.compared.append((name, abs(ours - fine), bound, size))
        if not abs(ours - fine) <= bound:
            self.report.disagreements.append(
                f"{name}: {ours!r} of mechc, {fine!r} (+- {abs(fine - coarse):.1g})"
            )

    def all(self) -> None:
        model, found, coarse, fine = self.model, self.found, self.coarse, self.fine
        values = [r.outer(model.stationary)[0].value for r in (coarse, fine)]
        rough = max(abs(values[1]), 1e-3 * fine.size)
        self.note("stationary", found.stationary, values, rough, found.error)
        claims = getattr(found, "output_errors", {})
        for name, e in model.outputs.items():
            both = [r.outer(e)[0].value for r in (coarse, fine)]
            self.note(
                name, found.outputs[name], both, 1 + abs(both[1]), self.curve_claim + claims.get(name, 0.0)
            )
        for name, condition in model.multipliers.items():
            both = [r.multiplier(condition) for r in (coarse, fine)]
            size = abs(both[1]) + rough
            self.note(name, found.outputs[name], both, size, self.curve_claim * size)
            self.note(f"multiplier {name}", found.multipliers[condition], both, size, self.curve_claim * size)
        self.along_the_curve()
        self.kind()

    curve_claim = 1e-9
    """docs/curves.md claims no error of the curve itself; elements are halved until polynomials end within 1e-10."""

    def along_the_curve(self) -> None:
        model, found, coarse, fine = self.model, self.found, self.coarse, self.fine
        low, high = found.interval
        s_of = [(r.upper - r.a) for r in (coarse, fine)]
        if model.unknown_end:
            self.note("end", high, [coarse.upper, fine.upper], fine.upper, 1e-9 * fine.upper)
        breaks = [] if model.unknown_end else [(model.number(b) - fine.a) / s_of[1] for b in model.breaks]
        for share in SHARES:
            s = np.array([share])
            ours = found(float(low + share * (high - low)))
            for i, size in enumerate(model.sizes):
                both = [float(r.curve(coordinate(i), s)[0]) for r in (coarse, fine)]
                self.note(
                    f"{model.names[i]} at {share}",
                    float(ours[model.names[i]]),
                    both,
                    size,
                    self.curve_claim * size,
                )
            if min((abs(share - b) for b in breaks), default=1) < 1e-3:
                continue
            x = float(low + share * (high - low))
            for name, e in model.along.items():
                both = [float(r.curve(e, s)[0]) for r in (coarse, fine)]
                size = 1 + abs(both[1])
                self.note(
                    f"{name} at {share}", self.beside(name, x), both, size, 100 * self.curve_claim * size
                )
            for name, condition in model.densities.items():
                if 0 < share < 1:
                    both = [float(r.density(condition, s)[0]) for r in (coarse, fine)]
                    size = abs(both[1]) + fine.size
                    self.note(f"{name} at {share}", self.beside(name, x), both, size, 1e-6 * size)

    def beside(self, name: str, x: float) -> float:
        """Return an output along the curve at a place."""
        return float(self.found(x)[name])

    def kind(self) -> None:
        values = self.fine.directions()
        small = np.abs(values) < 1e-4 * np.median(np.abs(values))
        if small.any():
            return
        down, up = int((values < 0).sum()), int((values > 0).sum())
        kind = "minimum" if not down else "maximum" if not up else "saddle"
        said = self.found.kind
        self.report.compared.append((f"kind {kind}", 0.0, 0.0, 0.0))
        if said != kind:
            self.report.disagreements.append(f"kind: {said!r} of mechc, {kind!r}: {down} of {up + down}")
        elif kind == "saddle":
            many = down > len(values) / 4
            if not many and self.found.negative_directions != down:
                self.report.disagreements.append(
                    f"directions: {self.found.negative_directions} of mechc, {down}"
                )
