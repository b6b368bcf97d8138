"""What the statuses of the kernel mean in the words of the model: how a run, or an event in it, failed."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TypeVar

from msgspec import Struct

from . import native
from .outcome import (
    Failure,
    assertion_failed,
    not_converged,
    not_finite,
    off_constraints,
    state_at,
    step_too_small,
    time_text,
    value_text,
)
from .problem import Array, Hybrid, Origin, Problem, SwitchedRow

MOST_ROWS = 64
"""That may be chosen among at an instant: MECH_MOST_ROWS of the kernel."""

T = TypeVar("T")


class _Told(Struct, frozen=True):
    """A failure at an event; ``name`` is the row that is to blame, if one is."""

    kind: str
    message: str
    name: str = ""
    origin: Origin | None = None


def kernel_failure(problem: Problem, status: int, report: native.ReportStruct, y: Array) -> Failure | None:
    """Give the failure that ended a run of the kernel in state y [ny]; None where the status is that of no failure."""
    match status:
        case native.NOT_FINITE:
            return not_finite(problem, report.failed_index, report.failed_value, report.t, y)
        case native.STEP_TOO_SMALL:
            return step_too_small(problem, report.failed_index, report.t, y)
        case native.ASSERTION:
            return assertion_failed(problem, report.failed_index, report.t, y)
        case native.NOT_CONVERGED:
            return not_converged(problem, report.t, y)
        case native.OFF_CONSTRAINTS:
            return off_constraints(problem, report.t, y)
    hybrid = problem.hybrid
    if hybrid is None or status > native.EVENT_LOOP:
        return None
    at = time_text(problem, report.t)
    told = _of_conditions(hybrid, status, report, at) or _of_rows(hybrid, status, report, at)
    return Failure(told.kind, report.t, told.name, told.message, told.origin, state_at(problem, y))


def _of_conditions(hybrid: Hybrid, status: int, report: native.ReportStruct, at: str) -> _Told | None:
    """Tell what is wrong with branches of ``when`` and with switches; None where it is something else."""
    k = report.failed_index
    branch = _entry(hybrid.branches, k)
    match status:
        case native.EVENT_LOOP if branch is not None and not report.failed_part:
            conditions = ", ".join(f"'{b.text}'" for b in hybrid.branches)
            return _Told(
                "event loop",
                f"the events at {at} do not come to rest: 'when {branch.text}' fires again and again "
                f"(of {conditions})",
                origin=branch.origin,
            )
        case native.EVENT_LOOP:
            return _Told("event loop", f"the events at {at} do not come to rest")
        case native.ZENO:
            assert branch is not None
            return _Told(
                "zeno",
                f"'when {branch.text}' fires in ever shorter intervals, until {at}: "
                "for something that bounces or rests, write a 'contact', which comes to rest",
                origin=branch.origin,
            )
        case native.CHATTER:
            return _Told(
                "chattering",
                f"a condition in the equations of motion goes to and fro at {at}: "
                "the motion slides along it; write it as 'friction' or 'contact'",
            )
        case native.BRANCH_ASSERTION:
            assert branch is not None
            check = branch.checks[report.failed_part]
            return _Told("assertion", f"assertion failed at {at}: {check.message}", origin=check.origin)
        case native.NO_PERIOD:
            return _Told(
                "clock", f"a 'sample' has the period {report.failed_value:.6g} (SI): a period is positive"
            )
        case native.UNDEFINED_JUMP:
            return _Told(
                "not finite",
                f"a potential energy is {value_text(report.failed_value)} behind the surface that is reached at {at}: "
                "the motion can neither pass there nor be thrown back",
            )
    return None


def _of_rows(hybrid: Hybrid, status: int, report: native.ReportStruct, at: str) -> _Told:
    """Tell what is wrong with contacts, friction and constraints that switch."""
    row, size = _entry(hybrid.rows, report.failed_index), report.failed_value
    name, origin = (row.name, row.origin) if row is not None else ("", None)
    match status:
        case native.PENETRATION:
            message = f"contact '{name}' is penetrated at {at}: its gap is {size:.6g} (SI)"
            return _Told("penetration", message, name, origin)
        case native.ENERGY_RAISED:
            message = (
                f"the impact of '{name}' at {at} would raise the energy: Newton's restitution and Coulomb's "
                "friction do not fit together here; use a smaller restitution or no friction"
            )
            return _Told("impact", message, name, origin)
        case native.APART:
            message = f"'{name}' is engaged at {at}, but does not hold there: its sides are {abs(size):.6g} (SI) apart"
            return _Told("engage", message, name, origin)
        case native.OUT_OF_RANGE:
            return _Told("coefficient", _out_of_range(row, size, at), name, origin)
        case native.NO_MODE if len(hybrid.rows) > MOST_ROWS:
            message = (
                f"the model has {len(hybrid.rows)} rows of contacts, friction and constraints that switch; "
                f"a run decides over {MOST_ROWS} at once: replace some by potentials, or by friction "
                'with law = "regularized"'
            )
            return _Told("modes", message)
        case native.NO_MODE if row is not None and not math.isfinite(size):
            message = (
                f"the force of '{name}' is {value_text(size)} at {at}: something in it is undefined there, "
                "its gap, its slip, its coefficient, or the accelerations"
            )
            return _Told("not finite", message, name, origin)
        case native.NO_MODE:
            which = f"'{name}'" if name else "the contacts"
            message = (
                f"no combination of touching, sticking and sliding fits for {which} at {at}: "
                "Coulomb's law has no solution, or more than one"
            )
            return _Told("modes", message, name, origin)
        case _:
            return _Told("impact", f"the impacts at {at} have no solution", name, origin)


def _out_of_range(row: SwitchedRow | None, size: float, at: str) -> str:
    assert row is not None
    if row.kind == "contact":
        return f"the restitution of '{row.name}' is {size:.6g} at {at}; it lies between 0 and 1"
    return (
        f"the friction of '{row.name}' has a negative coefficient or limit at {at}, {size:.6g} (SI): "
        "it is a size; where the normal force can change its sign, write a 'contact' with friction"
    )


def _entry(entries: Sequence[T], index: int) -> T | None:
    return entries[index] if 0 <= index < len(entries) else None
