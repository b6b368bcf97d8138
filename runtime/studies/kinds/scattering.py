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

from ...case import inputs_at
from ...integrate.interruption import NotedInterruptions
from ...integrate.kernel_run import run_kernel
from ...integrate.solver import SolverOptions
from ...integrate.trajectory import DenseOutput
from ...methods import RUNS_ALL
from ...numerics.roots import minimum, root
from ...outcome import Outcome, SimulationError
from ...problem import Array, Problem
from ...results.accuracy import companion_tolerance
from ...results.files import json_number
from ...settings import Range, settable
from ..findings import Curve, Findings, Panel, Table, Value
from ..flow.mass_matrix import mass_matrix
from ..flow.pieces import with_horizon
from ..runs.simulate import Plan, plan_run
from ..study import Study

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
PROBES = (1.0, 0.3, 0.1, 0.03)
"""Shares of the place of the start at which forces are compared."""
SAME = 1e-9
"""Relative difference within which impact parameters, velocities and forces are the same."""
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
            return _findings(problem, "", "", [beam.passage(math.nan)], [], Outcome.COMPLETED, "")
        axis = np.linspace(wanted.low, wanted.high, wanted.count or VALUES)
        found: list[Passage] = []
        outcome = Outcome.COMPLETED
        with NotedInterruptions() as interrupted:
            for k, b in enumerate(axis):
                if interrupted():
                    outcome = Outcome.INTERRUPTED
                    break
                found.append(beam.differentiated(float(b)))
                if self.progress is not None:
                    self.progress((k + 1) / len(axis))
        lines = [(one.b, one.beam) for one in found]
        if found:  # one value alone may be equal to the impact parameter by chance
            beside = found[0].b * (1 + STENCIL) or STENCIL
            lines.append((beside, beam.line(beam.plan(beside))))
        other = _no_impact_parameter(wanted.name, lines)
        rainbows = _rainbows(beam, found) if outcome is Outcome.COMPLETED and not other else []
        return _findings(problem, wanted.name, wanted.unit, found, rainbows, outcome, other)


class Beam(Struct, frozen=True, eq=False):
    """The line on which a particle comes: its ``impact`` parameter, the distance of the line from the origin; the velocity
    [nq] on it; the ``forces`` [m, nq], as accelerations at places that are the same for all."""

    impact: float
    velocity: Array
    forces: Array


class Passage(Struct, frozen=True):
    """One particle: the varied quantity ``b``, its ``beam``, ``deflection`` with its ``error`` (positive: away from the
    centre; nan where it does not come out), and the derivative ``slope`` by b."""

    b: float
    beam: Beam
    deflection: float
    error: float
    slope: float = math.nan

    @property
    def angle(self) -> float:
        """The angle between both asymptotes, from 0 to pi."""
        return abs(math.remainder(self.deflection, ROUNDS))

    @property
    def cross_section(self) -> float:
        """b/(sin(angle) |d(angle)/db|), where b is the impact parameter."""
        below = math.sin(self.angle) * abs(self.slope)
        return abs(self.b) / below if below else math.nan


class _Beam:
    """Particles that differ in their impact parameter."""

    def __init__(self, problem: Problem, options: Scattering, name: str) -> None:
        self.problem, self.options, self.name = problem, options, name
        nq = problem.nq
        if problem.constraints or problem.rotations or len(problem.own) > nq + problem.nv or nq not in (2, 3):  # fmt: skip
            raise SimulationError(
                f"scattering is asked of one particle in two or three Cartesian coordinates; '{problem.name}' is another "
                "model",
                help="of two bodies, write the relative motion with the reduced mass",
            )
        plan = plan_run(problem, options)
        if plan.method.fixed_step:
            raise SimulationError(
                f"scattering takes steps that grow with the distance, and '{plan.method.name}' is not a method that does",
                help=RUNS_ALL,
            )
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
        self.probes = [plan.case.y0 * share for share in PROBES]

    def plan(self, b: float) -> Plan:
        """Plan the run of one particle; without a name the start as it is."""
        values = {**self.options.values, **({self.name: b} if self.name else {})}
        return plan_run(self.problem, replace(self.options, values=values))

    def line(self, plan: Plan) -> Beam:
        """Give the line on which a particle comes."""
        case, nq = plan.case, self.problem.nq
        place, speed = self.root @ case.y0[:nq], self.root @ case.y0[nq : 2 * nq]
        foot = np.linalg.solve(self.root, place - speed * float(place @ speed) / float(speed @ speed))
        u, rhs = inputs_at(case, case.begin), case.functions.rhs
        forces = [rhs(case.begin, y, u, case.z, case.p)[nq : 2 * nq] for y in self.probes]
        return Beam(float(np.linalg.norm(foot)), case.y0[nq : 2 * nq], np.array(forces))

    def passage(self, b: float, *, checked: bool = True) -> Passage:
        """Follow one particle. ``checked``: its error holds what a tighter tolerance changes."""
        plan = self.plan(b)
        nq = self.problem.nq
        place, speed = self.root @ plan.case.y0[:nq], self.root @ plan.case.y0[nq : 2 * nq]
        rate = float(np.linalg.norm(speed))
        if not rate > 0:
            raise SimulationError(f"the particle of '{self.problem.name}' is at rest: it comes from nowhere")
        ahead = -float(place @ speed) / rate
        if not ahead > 0:
            raise SimulationError(
                f"the particle of '{self.problem.name}' moves away from the origin, where the centre must be"
            )
        beam = self.line(plan)
        angles: list[float] = []
        before = error = previous = math.nan
        for level in range(LEVELS):
            angle = self._angle(plan, place, speed, ahead, 2.0**level)
            if math.isnan(angle):
                return Passage(b, beam, math.nan, math.nan)
            angles.append(angle)
            limit = extrapolated(angles)
            error = abs(limit - before)
            if len(angles) >= FEWEST_LEVELS and error < SETTLED * max(1.0, abs(limit)):
                break
            if len(angles) > FEWEST_LEVELS + 2 and error > previous:  # rounding has the word
                limit, error = before, previous
                break
            before, previous = limit, error
        if checked:
            tolerance, factor = companion_tolerance(plan.case.tolerance)
            beside = replace(plan, case=replace(plan.case, tolerance=tolerance))
            error += factor * abs(self._angle(beside, place, speed, ahead, 1.0) - angles[0])
        return Passage(b, beam, limit, max(error, 1e-14))

    def differentiated(self, b: float) -> Passage:
        """Give a passage with the derivative of its angle."""
        here = self.passage(b)
        if math.isnan(here.deflection) or b == 0:
            return here
        h = STENCIL * abs(b)
        a = [self.passage(b + k * h, checked=False).deflection for k in (-2, -1, 1, 2)]
        return replace(here, slope=(a[0] - 8 * a[1] + 8 * a[2] - a[3]) / (12 * h))

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
            if why := made.ending(self.problem):
                raise SimulationError(f"the particle does not come out: {why}")
            assert isinstance(made.dense, DenseOutput)
            t = np.append(made.dense.begin, begin + span)
            rows = made.dense(t)
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
        at = root(beyond, low, float(t[k])) if beyond(low) < 0 else float(t[k])
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


def _signed_deflection(beam: _Beam, sign: float, b: float) -> float:
    return sign * beam.passage(b, checked=False).deflection


def _rainbows(beam: _Beam, found: list[Passage]) -> list[Passage]:
    """Find the impact parameters at which the deflection is extreme: there the cross section has no bound."""
    rainbows = []
    for one, other in itertools.pairwise(found):
        if not (one.slope * other.slope < 0 and abs(one.deflection - other.deflection) < 1.0):
            continue
        turned = partial(_signed_deflection, beam, 1.0 if one.slope < 0 else -1.0)
        rainbows.append(beam.passage(minimum(turned, one.b, other.b, 1e-6 * abs(one.b))[0]))
    return rainbows


def _no_impact_parameter(name: str, lines: list[tuple[float, Beam]]) -> str:
    """Tell why particles over a quantity have no cross section: it is another one, or changes more than the impact parameter."""
    largest = max((abs(b) for b, _ in lines), default=0.0)
    for b, beam in lines:
        if not math.isclose(abs(b), beam.impact, rel_tol=SAME, abs_tol=SAME * largest):
            return (
                f"'{name}' is not the impact parameter, which is {beam.impact:.6g} where {name} = {b:.6g}: there is no "
                "cross section over it"
            )
        for what in ("velocity", "forces"):
            first, here = (np.atleast_2d(getattr(one, what)) for one in (lines[0][1], beam))
            size = np.abs(first).max(axis=1, keepdims=True)
            if (np.abs(here - first) > SAME * size).any():
                return f"'{name}' changes the {what} too, not the impact parameter alone: there is no cross section over it"
    return ""


def _findings(
    problem: Problem,
    name: str,
    unit: str,
    found: list[Passage],
    rainbows: list[Passage],
    outcome: Outcome,
    other: str,
) -> Findings:
    kept = [one.b for one in found if math.isnan(one.deflection)]
    round_ = [one.b for one in found if abs(one.deflection) > ROUNDS / 2 * 1.0001]
    remarks = [other] if other else []
    for one in rainbows:
        remarks.append(
            f"a rainbow at {name} = {one.b:.8g}: the deflection is extreme there, {one.deflection:.10g} rad, and the cross "
            "section has no bound"
        )
    if round_:
        between = f"between {name} = {min(round_):.6g} and {max(round_):.6g}"
        remarks.append(f"orbiting: {between} the particle goes round the centre by more than half a turn")
    if kept:
        remarks.append(f"kept: at {name} = {min(kept):.6g} to {max(kept):.6g} it does not escape again")
    length = problem.states[0].unit
    area = f"{length}^2" if length and length != "1" else ""
    first = (name or "start", unit)
    head = (first, *((column, "rad") for column in ("angle", "error", "deflection")), ("cross section", area))
    rows = tuple(
        (
            one.b,
            *(
                None if math.isnan(v) else v
                for v in (one.angle, one.error, one.deflection, math.nan if other else one.cross_section)
            ),
        )
        for one in found
    )
    b = np.array([one.b for one in found])
    deflection = np.array([one.deflection for one in found])
    angle = np.array([one.angle for one in found])
    section = np.array([math.nan if other else one.cross_section for one in found])
    impact = np.array([one.beam.impact for one in found])
    errors = np.array([one.error for one in found])
    largest = float(np.nanmax(errors)) if np.isfinite(errors).any() else None
    words = f"{len(found)} particles" if name else f"the angle is {found[0].angle:.10g} rad"
    details: dict[str, Any] = {
        "parameter": {name: b.tolist()} if name else {},
        "angle": [json_number(v) for v in angle.tolist()],
        "impact_parameter": impact.tolist(),
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
    )[: 1 if other else 2]  # fmt: skip
    values = tuple(
        Value(f"rainbow {k + 1}", "rad", one.deflection, one.error) for k, one in enumerate(rainbows)
    )
    return Findings(
        study="scattering",
        model=problem.name,
        outcome=outcome,
        message=words + (f", angles within {largest:.1e}" if largest is not None else ""),
        values=values,
        errors_from="extrapolation from one distance less, and a tighter tolerance",
        remarks=tuple(remarks),
        tables=(Table("", head, rows) if name else Table("", head[1:], tuple(row[1:] for row in rows)),),
        panels=panels,
        details=details,
        arrays={name or "start": b, "angle": angle, "deflection": deflection, "cross_section": section}
        | {"impact_parameter": impact},
    )


def extrapolated(values: list[float]) -> float:
    """Give the limit of values at 1/R, 1/(2R), 1/(4R), ... by their polynomial at zero (Neville)."""
    row = list(values)
    for order in range(1, len(row)):
        row = [(2.0**order * row[k + 1] - row[k]) / (2.0**order - 1) for k in range(len(row) - 1)]
    return row[0]
