"""What the statuses of the kernel mean in the words of the model: how a run, or an event in it, failed."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Literal, TypeVar, assert_never

from msgspec import Struct

from ..interface import Hybrid, Origin, SwitchedRow
from ..native.status import Status
from ..outcome import (
    Failure,
    assertion_failed,
    no_series,
    not_converged,
    not_finite,
    off_constraints,
    state_at,
    step_too_small,
    time_text,
    value_text,
    velocities_jump,
)
from ..problem import Array, Problem

if TYPE_CHECKING:
    from ..native.kernel import ReportStruct

MOST_ROWS = 512
"""That may be chosen among at an instant: MECH_MOST_ROWS of the kernel."""

BY_STEPS = "steps of 'method = \"moreau\"' go on where events do not"

T = TypeVar("T")

_OfConditions = Literal[
    Status.EVENT_LOOP,
    Status.ZENO,
    Status.CHATTER,
    Status.BRANCH_ASSERTION,
    Status.NO_PERIOD,
    Status.NO_DELAY,
    Status.NO_MEMORY,
    Status.UNDEFINED_JUMP,
]
_OfRows = Literal[
    Status.PENETRATION,
    Status.ENERGY_RAISED,
    Status.APART,
    Status.NO_MODE,
    Status.NO_IMPACT,
    Status.OUT_OF_RANGE,
]
_AtEvent = _OfConditions | _OfRows


class _Told(Struct, frozen=True):
    """A failure at an event; ``name`` is the row that is to blame, if one is."""

    kind: str
    message: str
    name: str = ""
    origin: Origin | None = None


def kernel_failure(problem: Problem, status: Status, report: ReportStruct, y: Array) -> Failure | None:
    """Give the failure that ended a run of the kernel in state y [ny]; None where the status is that of no failure."""
    match status:
        case (
            Status.RUNNING
            | Status.REACHED
            | Status.RECORD_FULL
            | Status.TERMINATED
            | Status.EVENTS_FULL
            | Status.AT_EVENT
        ):
            return None
        case Status.NOT_FINITE:
            return not_finite(problem, report.failed_index, report.failed_value, report.t, y)
        case Status.NO_SERIES:
            return no_series(problem, report.failed_index, report.t, y)
        case Status.STEP_TOO_SMALL:
            return step_too_small(problem, report.failed_index, report.t, y)
        case Status.ASSERTION:
            return assertion_failed(problem, report.failed_index, report.t, y)
        case Status.NOT_CONVERGED:
            return not_converged(problem, report.t, y)
        case Status.OFF_CONSTRAINTS:
            return off_constraints(problem, report.t, y)
        case Status.JUMPING:
            return velocities_jump(problem, report.t, y)
        case (
            Status.NEEDS_JACOBIAN
            | Status.NEEDS_SEPARABLE
            | Status.NEEDS_MOMENTA
            | Status.NEEDS_SERIES
            | Status.NEEDS_ROWS
            | Status.NEEDS_STEPS
        ):
            raise AssertionError(f"a run began although {status.name}: methods.py refuses it before")
        case _:
            return _at_event(problem, status, report, y)


def _at_event(problem: Problem, status: _AtEvent, report: ReportStruct, y: Array) -> Failure:
    hybrid = problem.hybrid
    assert hybrid is not None
    at = time_text(problem, report.t)
    match status:
        case (
            Status.EVENT_LOOP
            | Status.ZENO
            | Status.CHATTER
            | Status.BRANCH_ASSERTION
            | Status.NO_PERIOD
            | Status.NO_DELAY
            | Status.NO_MEMORY
            | Status.UNDEFINED_JUMP
        ):
            told = _of_conditions(hybrid, status, report, at)
        case _:
            told = _of_rows(hybrid, status, report, at)
    return Failure(told.kind, report.t, told.name, told.message, told.origin, state_at(problem, y))


def _of_conditions(hybrid: Hybrid, status: _OfConditions, report: ReportStruct, at: str) -> _Told:
    """Tell what is wrong with branches of ``when`` and with switches."""
    k = report.failed_index
    branch = _entry(hybrid.branches, k)
    match status:
        case Status.EVENT_LOOP if branch is not None and not report.failed_part:
            conditions = ", ".join(f"'{b.text}'" for b in hybrid.branches)
            return _Told(
                "event loop",
                f"the events at {at} do not come to rest: 'when {branch.text}' fires again and again "
                f"(of {conditions})",
                origin=branch.origin,
            )
        case Status.EVENT_LOOP:
            strike = f": contacts strike again and again; {BY_STEPS}" if hybrid.rows else ""
            return _Told("event loop", f"the events at {at} do not come to rest{strike}")
        case Status.ZENO:
            assert branch is not None
            return _Told(
                "zeno",
                f"'when {branch.text}' fires in ever shorter intervals, until {at}: "
                "for something that bounces or rests, write a 'contact', which comes to rest",
                origin=branch.origin,
            )
        case Status.CHATTER if report.failed_part == 1:
            return _Told(
                "chattering",
                f"impacts follow each other without end where a gap bends, until {at}: a body in a corner touches both sides, "
                "but a gap has only one side at a time; write a contact for each side",
            )
        case Status.CHATTER if report.failed_part == 3:
            return _Told(
                "chattering",
                f"the motion goes from side to side without end where a constraint bends, until {at}: "
                "a corner has no tangent; round the corner, or write a contact for each side",
            )
        case Status.CHATTER if report.failed_part == 2:
            return _Told(
                "chattering",
                f"a condition changes its sign millions of times within one step at {at}: "
                "it oscillates much faster than the motion, or it is a difference of equal numbers",
            )
        case Status.CHATTER if report.failed_part == 4:
            surface = f" at '{text}'" if (text := _entry(hybrid.switches, k)) else ""
            return _Told(
                "chattering",
                f"the motion comes to rest where a force jumps{surface}: until {at} it has crossed that surface a thousand times "
                "within its tolerance, ever faster. mechc cannot follow a motion that stays on such a surface. Let the force change over a "
                "short distance, or round the kink of the energy",
            )
        case Status.CHATTER:
            return _Told(
                "chattering",
                f"a condition in the equations of motion goes to and fro at {at}: "
                "the motion slides along it; write it as 'friction' or 'contact'. First-order states slide along one such "
                "surface by themselves; along several at once it is not followed",
            )
        case Status.BRANCH_ASSERTION:
            assert branch is not None
            check = branch.checks[report.failed_part]
            if not check.stated:
                return _Told("constraints", f"at {at} {check.message}", origin=check.origin)
            return _Told("assertion", f"assertion failed at {at}: {check.message}", origin=check.origin)
        case Status.NO_PERIOD:
            return _Told(
                "clock", f"a 'sample' has the period {report.failed_value:.6g} (SI): a period is positive"
            )
        case Status.NO_DELAY:
            delay = _entry(hybrid.delays, k)
            what = f"the delay of '{delay.text}'" if delay is not None else "a delay"
            origin = delay.origin if delay is not None else None
            return _Told(
                "delay", f"{what} is {report.failed_value:.6g} s: a delay is positive", origin=origin
            )
        case Status.NO_MEMORY:
            return _Told(
                "memory",
                f"there is not enough memory at {at} for the past that delays need: longer steps or shorter delays need less",
            )
        case Status.UNDEFINED_JUMP:
            return _Told(
                "not finite",
                f"a potential energy is {value_text(report.failed_value)} beyond the surface that is reached at {at}: "
                "the motion can neither cross it nor be reflected",
            )
        case _:
            assert_never(status)


def _of_rows(hybrid: Hybrid, status: _OfRows, report: ReportStruct, at: str) -> _Told:
    """Tell what is wrong with contacts, friction and constraints that switch."""
    known = 0 <= report.failed_index < hybrid.n_rows
    row, size = hybrid.row(report.failed_index) if known else None, report.failed_value
    name, origin = (row.name, row.origin) if row is not None else ("", None)
    match status:
        case Status.PENETRATION:
            message = f"contact '{name}' is penetrated at {at}: its gap is {size:.6g} (SI); "
            message += "a gap is positive where things are apart: change the start, the gap or its sign"
            return _Told("penetration", message, name, origin)
        case Status.ENERGY_RAISED:
            message = (
                f"the impact of '{name}' at {at} would raise the energy: Newton's restitution and Coulomb's "
                "friction are incompatible here; use a smaller restitution or no friction"
            )
            return _Told("impact", message, name, origin)
        case Status.APART:
            message = f"'{name}' is engaged at {at}, but does not hold there: its sides are {abs(size):.6g} (SI) apart"
            return _Told("engage", message, name, origin)
        case Status.OUT_OF_RANGE:
            return _Told("coefficient", _out_of_range(row, size, at), name, origin)
        case Status.NO_MODE if hybrid.n_rows > MOST_ROWS and report.failed_index < 0:
            message = (
                f"more than {MOST_ROWS} rows of contacts and friction, of {hybrid.n_rows}, touch or may touch at once "
                f"at {at}, or more than two contacts for each velocity press, which is the limit with located events; {BY_STEPS}"
            )
            return _Told("modes", message)
        case Status.NO_MODE if row is not None and not math.isfinite(size):
            message = (
                f"the force of '{name}' is {value_text(size)} at {at}: something in it is undefined there: "
                "its gap, its slip, its coefficient, or the accelerations"
            )
            return _Told("not finite", message, name, origin)
        case Status.NO_MODE:
            which = f"'{name}'" if name else "the contacts"
            if not hybrid.lines and all(other.kind != "friction" for other in hybrid.rows):
                message = (
                    f"at {at} it is not found which contacts press and which open, {which} among them: they jam, so that no "
                    "acceleration keeps all gaps, or change their modes again and again without getting on; a 'rest' ends bounces"
                )
                return _Told("modes", message, name, origin)
            if report.failed_part == 1:
                message = (
                    f"at {at} contacts and frictions change their modes again and again without getting on, {which} among them; "
                    f"{BY_STEPS}"
                )
                return _Told("modes", message, name, origin)
            message = (
                f"no combination of touching, sticking and sliding fits for {which} at {at}: "
                f"Coulomb's law has no solution, or more than one; {BY_STEPS}"
            )
            return _Told("modes", message, name, origin)
        case Status.NO_IMPACT:
            return _Told("impact", f"the impacts at {at} have no solution", name, origin)
        case _:
            assert_never(status)


def _out_of_range(row: SwitchedRow | None, size: float, at: str) -> str:
    assert row is not None
    if row.kind == "contact":
        return f"the restitution of '{row.name}' is {size:.6g} at {at}; it lies between 0 and 1"
    return (
        f"the friction of '{row.name}' has a negative coefficient or limit at {at}, {size:.6g} (SI): "
        "it is a magnitude; where the normal force can change its sign, write a 'contact' with friction"
    )


def _entry(entries: Sequence[T], index: int) -> T | None:
    return entries[index] if 0 <= index < len(entries) else None
