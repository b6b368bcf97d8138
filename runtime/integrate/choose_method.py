"""Which methods there are for a problem, and which one is taken."""

from __future__ import annotations

import ctypes

from msgspec import Struct

from ..case import Case
from ..memo import once
from ..methods import FIXED_RUNS_ALL, RUNS_ALL, check_step, unknown_method
from ..native import contract
from ..native import kernel as native
from ..native.status import NEEDS, Status
from ..outcome import SimulationError
from ..problem import Problem

EXPLICIT = "dop853"
"""What ``auto`` begins with, and stays with where the model has no Jacobian."""


class Method(Struct, frozen=True):
    """``fixed_step``: the user gives the step, and the error falls as its power ``order``."""

    name: str
    fixed_step: bool
    order: int


def choose_method(case: Case, reproducible: bool = False) -> Method:
    """Find the method that a case asks for, and check that it fits. Raises ``SimulationError``."""
    known, key = _found(case.problem), (case.method, reproducible)
    if key not in known:
        known[key] = _find(case.functions.struct, case.method, reproducible, case.problem.no_series)
    method = known[key]
    name = method.name if method.fixed_step else case.method
    check_step(name, fixed=method.fixed_step, given=case.step is not None)
    return method


@once
def _found(problem: Problem) -> dict[tuple[str, bool], Method]:
    """What was found for a problem before, by the name that was asked for and whether it is to be reproducible."""
    return {}


def check_name(wanted: str) -> None:
    """Raise SimulationError where no method for compiled models has this name."""
    known = native.kernel_methods(native.load_kernel())
    if wanted not in known:
        raise unknown_method(wanted, known)


def _find(model: contract.ModelStruct, wanted: str, reproducible: bool, no_series: str) -> Method:
    if wanted == "auto" and not model.jacobian:
        wanted = EXPLICIT  # as that does without one
    kernel = native.kernel_for(model, reproducible, wanted)
    index = int(kernel.mech_method_index(wanted.encode()))
    if index < 0:
        raise unknown_method(wanted, native.kernel_methods(kernel))
    lacks = Status(kernel.mech_method_lacks(index, ctypes.addressof(model)))
    if lacks == Status.NEEDS_SERIES and no_series:
        raise SimulationError(
            f"'{wanted}' cannot run this model: {no_series}",
            help=RUNS_ALL,
        )
    if lacks != Status.RUNNING:
        obstacles = _obstacles(model, lacks)
        if not obstacles:
            raise SimulationError(f"'{wanted}' {NEEDS[lacks]}")
        raise SimulationError(
            f"'{wanted}' cannot run this model: it has {' and '.join(obstacles)}",
            help=FIXED_RUNS_ALL,
        )
    fixed_step = not kernel.mech_method_is_adaptive(index)
    return Method(wanted, fixed_step, int(kernel.mech_method_order(index)))


def _obstacles(model: contract.ModelStruct, lacks: Status) -> list[str]:
    """Say what a model has that methods for coordinates with momenta, or for positions alone, cannot take."""
    if lacks in (Status.NEEDS_JACOBIAN, Status.NEEDS_SERIES, Status.NEEDS_ROWS, Status.NEEDS_STEPS):
        return []
    obstacles = []
    if model.n_rotations:
        obstacles.append("rotations, whose rates are not derivatives of coordinates")
    elif model.nq != model.nv:
        obstacles.append("a coordinate of which the rate alone is prescribed")
    if model.nx > model.n_accounts:
        obstacles.append("first-order states, as coordinates without mass are")
    if lacks == Status.NEEDS_SEPARABLE and model.n_velocity:
        obstacles.append("constraints, for which there are 'rattle', 'lobatto4' and 'lobatto6'")
    elif model.n_velocity > model.n_position:
        obstacles.append("constraints between velocities")
    if (
        lacks == Status.NEEDS_MOMENTA
        and model.hybrid
        and contract.HybridStruct.from_address(model.hybrid).n_rows
    ):
        obstacles.append("contacts, dry friction or constraints that switch")
    if lacks == Status.NEEDS_SEPARABLE and not obstacles:
        obstacles.append("accelerations that depend on velocities")
    return obstacles
