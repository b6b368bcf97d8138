"""Scattering: the angle by which a particle is deflected, and the cross section, over the impact parameter.

The start gives the asymptote on which the particle comes, with its speed, and not a place on the way: it is put back along the
line to distances R, 2R, 4R, ..., followed out to the same distance, and the angle extrapolated to infinity in powers of
1/R (Richardson), so that forces of long range are served too.
"""

from __future__ import annotations

import itertools
import math
from functools import partial
from typing import Annotated, Any

import numpy as np
from msgspec import Struct
from msgspec.structs import replace
from scipy.optimize import brentq, minimize_scalar

from ..integrate.interruption import noted_interruptions
from ..integrate.kernel_run import run_kernel
from ..integrate.solver_options import SolverOptions
from ..integrate.trajectory import DenseOutput
from ..outcome import Outcome, SimulationError
from ..problem import Array, Problem
from ..results.files import json_number
from ..settings import Range, settable
from .findings import Curve, Findings, Panel, Table, Value
from .masses import mass_matrix
from .pieces import with_horizon
from .simulate import Plan, plan_run
from .study import Study

TOLERANCE = 1e-12
VALUES = 41
LEVELS, FEWEST_LEVELS = 9, 3
"""Distances that the start is put back to, each twice the one before."""
SETTLED = 1e-12
FINE, COARSE = 100.0, 20.0
"""Steps of the free motion on the way from the start to the centre, at least, and farther away: what is smaller than such a
step may be missed."""
PATIENCE = 40.0
"""Times of free flight after which a particle that has not left is said to be kept."""
STENCIL = 2e-3
"""Of an impact parameter: the differences by which the angle is differentiated."""
ROUNDS = 2 * math.pi


class Scattering(Study, frozen=True, kw_only=True):
    """Angle and cross section ``over`` the impact parameter, which the start of the model must hold: one particle in two or
    three Cartesian coordinates that comes towards a centre at the origin."""

    over: Annotated[tuple[Range, ...], settable('The impact parameter: "b = 0.1 .. 5, 50".', "ranges")] = ()

    def solve(self, problem: Problem) -> Findings:
        """Follow the particle for each impact parameter. Raises SimulationError."""
        if len(self.over) > 1:
            raise SimulationError("scattering is asked over one parameter, the impact parameter")
        options = with_horizon(problem, self, 1.0, TOLERANCE)
        wanted = self.over[0] if self.over else None
        beam = _Beam(problem, options, wanted.name if wanted else "")
        if wanted is None:
            return _findings(problem, "", "", [beam.passage(math.nan)], [], Outcome.COMPLETED)
        axis = np.linspace(wanted.low, wanted.high, wanted.count or VALUES)
        found: list[Passage] = []
        outcome = Outcome.COMPLETED
        with noted_interruptions() as interrupted:
            for k, b in enumerate(axis):
                if interrupted():
                    outcome = Outcome.INTERRUPTED
                    break
                found.append(beam.differentiated(float(b)))
                if self.progress is not None:
                    self.progress((k + 1) / len(axis))
        rainbows = _rainbows(beam, found) if outcome is Outcome.COMPLETED else []
        return _findings(problem, wanted.name, wanted.unit, found, rainbows, outcome)


class Passage(Struct, frozen=True):
    """One particle: impact parameter ``b``, ``deflection`` with its ``error`` (positive: away from the centre; nan where it
    does not come out), and the derivative ``slope`` by b."""

    b: float
    deflection: float
    error: float
    slope: float = math.nan

    @property
    def angle(self) -> float:
        """The angle between both asymptotes, from 0 to pi."""
        return abs(math.remainder(self.deflection, ROUNDS))

    @property
    def cross_section(self) -> float:
        """b/(sin(angle) |d(angle)/db|)."""
        below = math.sin(self.angle) * abs(self.slope)
        return abs(self.b) / below if below else math.nan


class _Beam:
    """Particles that differ in their impact parameter."""

    def __init__(self, problem: Problem, options: Scattering, name: str) -> None:
        self.problem, self.options, self.name = problem, options, name
        nq = problem.nq
        if problem.constraints or problem.rotations or problem.nx > sum(q.kind == "account" for q in problem.states) or nq not in (2, 3):  # fmt: skip
            raise SimulationError(
                f"scattering is asked of one particle in two or three Cartesian coordinates; '{problem.name}' is another "
                "model",
                help="of two bodies, write the relative motion with the reduced mass",
            )
        plan = plan_run(problem, options)
        random = np.random.default_rng(2)
        here = mass_matrix(plan, plan.case.begin, plan.case.y0)
        for _ in range(2):
            y = plan.case.y0.copy()
            y[:nq] *= 1 + 0.3 * random.random(nq)
            if not np.allclose(
                mass_matrix(plan, plan.case.begin, y), here, rtol=1e-9, atol=1e-12 * np.abs(here).max()
            ):
                raise SimulationError(
                    f"the coordinates of '{problem.name}' are not Cartesian: its kinetic energy depends on them",
                    help="write the particle in x and y",
                )
        self.root = np.linalg.cholesky(here).T  # lengths in the metric of the kinetic energy

    def passage(self, b: float) -> Passage:
        """Follow one particle; without a name the start as it is."""
        values = {**self.options.values, **({self.name: b} if self.name else {})}
        plan = plan_run(self.problem, replace(self.options, values=values))
        nq = self.problem.nq
        place, speed = self.root @ plan.case.y0[:nq], self.root @ plan.case.y0[nq : 2 * nq]
        rate = float(np.linalg.norm(speed))
        if not rate > 0:
            raise SimulationError(f"the particle of '{self.problem.name}' is at rest: it comes from nowhere")
        ahead = -float(place @ speed) / rate
        if not ahead > 0:
            raise SimulationError(
                f"the particle of '{self.problem.name}' moves away from the origin, where the centre is to be"
            )
        angles: list[float] = []
        before = error = previous = math.nan
        for level in range(LEVELS):
            angle = self._angle(plan, place, speed, ahead, 2.0**level)
            if math.isnan(angle):
                return Passage(b, math.nan, math.nan)
            angles.append(angle)
            limit = _extrapolated(angles)
            error = abs(limit - before)
            if len(angles) >= FEWEST_LEVELS and error < SETTLED * max(1.0, abs(limit)):
                break
            if len(angles) > FEWEST_LEVELS + 2 and error > previous:  # rounding has the word
                limit, error = before, previous
                break
            before, previous = limit, error
        return Passage(b, limit, max(error, 1e-14))

    def differentiated(self, b: float) -> Passage:
        """Give a passage with the derivative of its angle."""
        here = self.passage(b)
        if math.isnan(here.deflection) or b == 0:
            return here
        h = STENCIL * abs(b)
        a = [self.passage(b + k * h).deflection for k in (-2, -1, 1, 2)]
        return Passage(b, here.deflection, here.error, (a[0] - 8 * a[1] + 8 * a[2] - a[3]) / (12 * h))

    def _angle(self, plan: Plan, place: Array, speed: Array, ahead: float, factor: float) -> float:
        """Give the deflection between two places at ``factor`` times the distance of the start; nan if it is kept."""
        case, nq = plan.case, self.problem.nq
        rate = float(np.linalg.norm(speed))
        far = ahead * factor
        back = place - speed / rate * (far - ahead)
        y = case.y0.copy()
        y[:nq] = np.linalg.solve(self.root, back)
        reach, begin = float(np.linalg.norm(back)), case.begin
        turned, passed = 0.0, 0.0
        direction = speed
        while passed < PATIENCE * 2 * far / rate:
            distance = float(np.linalg.norm(self.root @ y[:nq]))
            near = passed > 0.0 or far <= ahead
            coming = far - ahead
            if not near:
                span, longest = coming / rate, far / rate / COARSE
            elif distance < 1.1 * ahead:
                span, longest = 1.2 * ahead / rate, ahead / rate / FINE
            else:
                span, longest = 2.0 * far / rate, far / rate / COARSE
            grid = np.array([begin + span])
            part = replace(case, y0=y, begin=begin, stop=begin + span, grid=grid, max_step=longest)
            made = run_kernel(part, SolverOptions(plan.method.name, case.tolerance, plan.nominal, dense=True))
            if made.interrupted:
                raise KeyboardInterrupt
            if made.failure is not None:
                raise SimulationError(made.failure.message)
            assert isinstance(made.dense, DenseOutput)
            t = np.append(made.dense.begin, begin + span)
            rows = self._states(made.dense, t)
            t, rows = self._up_to(made.dense, t, rows, reach)
            velocities = rows[:, nq : 2 * nq] @ self.root.T
            if nq == 2:
                headings = np.arctan2(velocities[:, 1], velocities[:, 0])
                first = math.atan2(direction[1], direction[0])
                turned += float(np.unwrap(np.r_[first, headings])[-1] - first)
            out = float(np.linalg.norm(rows[-1, :nq] @ self.root.T)) >= reach * (1 - 1e-12)
            y, begin, passed, direction = made.y[-1], begin + span, passed + span, velocities[-1]
            if out and float(rows[-1, :nq] @ self.root.T @ velocities[-1]) > 0:
                return self._signed(turned, place, speed, velocities[-1])
        return math.nan

    def _states(self, dense: DenseOutput, t: Array) -> Array:
        return dense(t)

    def _up_to(self, dense: DenseOutput, t: Array, rows: Array, reach: float) -> tuple[Array, Array]:
        """Cut a way where the particle is out at a distance."""
        nq = self.problem.nq
        distance = np.linalg.norm(rows[:, :nq] @ self.root.T, axis=1)
        outward = np.einsum("ij,ij->i", rows[:, :nq] @ self.root.T, rows[:, nq : 2 * nq] @ self.root.T) > 0
        gone = np.flatnonzero((distance >= reach) & outward)
        gone = gone[gone > 0]
        if not gone.size:
            return t, rows
        k = int(gone[0])

        def beyond(s: float) -> float:
            return float(np.linalg.norm(self.root @ dense(np.array([s]))[0, :nq])) - reach

        low = float(t[k - 1])
        at = brentq(beyond, low, float(t[k]), xtol=1e-300, rtol=1e-15) if beyond(low) < 0 else float(t[k])
        last = dense(np.array([at]))
        return np.append(t[:k], at), np.vstack([rows[:k], last])

    def _signed(self, turned: float, place: Array, speed: Array, leaving: Array) -> float:
        """Give the deflection, positive where it leads away from the centre."""
        rate = float(np.linalg.norm(speed))
        foot = place - speed / rate * float(place @ speed) / rate
        if len(speed) == 2:
            side = speed[0] * foot[1] - speed[1] * foot[0]
            return math.copysign(1.0, side) * turned if side else abs(turned)
        across = np.linalg.norm(np.cross(speed, leaving))
        angle = math.atan2(float(across), float(speed @ leaving))
        return math.copysign(angle, float(foot @ leaving)) if float(foot @ leaving) else angle


def _extrapolated(angles: list[float]) -> float:
    """Give the limit of values at 1/R, 1/(2R), 1/(4R), ... by their polynomial at zero (Neville)."""
    row = list(angles)
    for order in range(1, len(row)):
        row = [(2.0**order * row[k + 1] - row[k]) / (2.0**order - 1) for k in range(len(row) - 1)]
    return row[0]


def _signed_deflection(beam: _Beam, sign: float, b: float) -> float:
    return sign * beam.passage(b).deflection


def _rainbows(beam: _Beam, found: list[Passage]) -> list[Passage]:
    """Find the impact parameters at which the deflection is extreme: there the cross section has no bound."""
    rainbows = []
    for one, other in itertools.pairwise(found):
        if not (one.slope * other.slope < 0 and abs(one.deflection - other.deflection) < 1.0):
            continue
        best = minimize_scalar(
            partial(_signed_deflection, beam, 1.0 if one.slope < 0 else -1.0),
            bounds=(one.b, other.b),
            method="bounded",
            options={"xatol": 1e-6 * abs(one.b)},
        )
        rainbows.append(beam.passage(float(best.x)))
    return rainbows


def _findings(
    problem: Problem, name: str, unit: str, found: list[Passage], rainbows: list[Passage], outcome: Outcome
) -> Findings:
    kept = [one.b for one in found if math.isnan(one.deflection)]
    round_ = [one.b for one in found if abs(one.deflection) > ROUNDS / 2 * 1.0001]
    remarks = []
    for one in rainbows:
        remarks.append(
            f"a rainbow at {name} = {one.b:.8g}: the deflection is extreme there, {one.deflection:.10g} rad, and the cross "
            "section has no bound"
        )
    if round_:
        remarks.append(
            f"orbiting: between {name} = {min(round_):.6g} and {max(round_):.6g} the particle goes round the centre by more "
            "than half a turn"
        )
    if kept:
        remarks.append(f"kept: at {name} = {min(kept):.6g} to {max(kept):.6g} it does not come out again")
    area = f"{unit}^2" if unit and unit != "1" else ""
    head = (
        (name or "start", unit),
        ("angle", "rad"),
        ("error", "rad"),
        ("deflection", "rad"),
        ("cross section", area),
    )
    rows = tuple(
        (
            one.b,
            *(
                None if math.isnan(v) else v
                for v in (one.angle, one.error, one.deflection, one.cross_section)
            ),
        )
        for one in found
    )
    b = np.array([one.b for one in found])
    deflection = np.array([one.deflection for one in found])
    angle = np.array([one.angle for one in found])
    section = np.array([one.cross_section for one in found])
    errors = np.array([one.error for one in found])
    largest = float(np.nanmax(errors)) if np.isfinite(errors).any() else None
    words = f"{len(found)} particles" if name else f"the angle is {found[0].angle:.10g} rad"
    details: dict[str, Any] = {
        "parameter": {name: b.tolist()} if name else {},
        "angle": [json_number(v) for v in angle.tolist()],
        "cross_section": [json_number(v) for v in section.tolist()],
        "deflection": [json_number(v) for v in deflection.tolist()],
        "angle_errors": [json_number(v) for v in errors.tolist()],
        "rainbows": [{name: one.b, "deflection": one.deflection} for one in rainbows],
        "orbiting": round_,
        "kept": kept,
    }
    panels = () if not name else (
        Panel("deflection", name, unit, "deflection", "rad", (Curve("", b, deflection),)),
        Panel("cross section", "angle", "rad", "cross section", area,
              (Curve("", angle, section, "points"),), logarithmic="y"),
    )  # fmt: skip
    values = tuple(
        Value(f"rainbow {k + 1}", "rad", one.deflection, one.error) for k, one in enumerate(rainbows)
    )
    return Findings(
        study="scattering",
        model=problem.name,
        outcome=outcome,
        message=words + (f", angles within {largest:.1e}" if largest is not None else ""),
        values=values,
        errors_from="extrapolation from one distance less",
        remarks=tuple(remarks),
        tables=(Table("", head, rows),),
        panels=panels,
        details=details,
        arrays={name or "start": b, "angle": angle, "deflection": deflection, "cross_section": section},
    )
