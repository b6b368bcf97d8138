"""What peers have in common: compiled functions in the forms that they want, and what is made of their answers."""

from __future__ import annotations

import ctypes
import functools
from collections.abc import Callable, Mapping
from ctypes import c_long, c_void_p
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from msgspec import Struct

from ...compiler.problem import HEADER, header
from ...runtime.integrate.solver import SolverOptions
from ...runtime.integrate.trajectory import Statistics, Trajectory, with_unit_rotations
from ...runtime.native.build import build_shared, kernel_flags
from ...runtime.outcome import Failure, SimulationError, given_up, too_many_steps
from ...runtime.reference.work_precision import Peer

if TYPE_CHECKING:
    from ...model import CompiledModel
    from ...runtime.case import Case
    from ...runtime.problem import Array

RATES = Path(__file__).parent / "rates.c"
SLICE = 20_000
"""Steps between two looks at the clock."""
LATE, STEPS = "late", "steps"
"""Ends of a run that took too many seconds or steps."""


class Library(Struct, frozen=True):
    """An integrator of others. ``package``: the module that must be installed; ``runs`` gives its runs of a model by the names of their
    methods, for a case of the model with these parts (hoisted constants are numbered by what is built); ``mode``: how it is set up here,
    and ``by_unit`` of a model with events or constraints (exchange.py)."""

    name: str
    package: str
    mode: str
    runs: Callable[[CompiledModel, frozenset[str]], Mapping[str, Peer]]
    by_unit: str = ""


class PeerModel(ctypes.Structure):
    """peer_model of rates.c"""

    _fields_ = (
        *(
            (name, c_void_p)
            for name in ("rhs", "jacobian", "row", "col", "z", "p", "size", "entries", "columns")
        ),
        *((name, c_void_p) for name in ("state", "values")),
        *((name, c_long) for name in ("ny", "n_jacobian", "evaluations")),
    )


@functools.cache
def rates() -> ctypes.CDLL:
    """Return the library of ``rates.c``."""
    sources = {"rates.c": RATES.read_text(encoding="utf-8"), HEADER: header()}
    return ctypes.CDLL(str(build_shared(sources, kernel_flags(), name="peer")))


def refuse(case: Case, *, events: bool = False, constraints: bool = False) -> None:
    """Refuse a case with inputs; ``events``, ``constraints``: one with these, too. Raises SimulationError."""
    if case.problem.inputs:
        raise SimulationError("is compared on models without inputs")
    if events and case.problem.hybrid is not None:
        raise SimulationError("is compared on models without events")
    if constraints and case.functions.struct.closeness:
        raise SimulationError(
            "has no way back onto constraints, which a motion through singular positions needs"
        )


def peer_model(case: Case, nominal: Array) -> tuple[PeerModel, list[Array]]:
    """Return a model as rates.c reads it, and the arrays that must stay alive with it."""
    struct = case.functions.struct
    sizes, state, values = np.ascontiguousarray(nominal), np.empty(case.y0.size), np.empty(struct.n_jacobian)
    made = PeerModel(
        rhs=struct.rhs,
        jacobian=struct.jacobian,
        row=ctypes.cast(struct.jac_row, c_void_p),
        col=ctypes.cast(struct.jac_col, c_void_p),
        z=case.z.ctypes.data,
        p=case.p.ctypes.data,
        size=sizes.ctypes.data,
        state=state.ctypes.data,
        values=values.ctypes.data,
        ny=case.y0.size,
        n_jacobian=struct.n_jacobian,
    )
    return made, [sizes, state, values]


def times_of(case: Case) -> Array:
    """Return the times after the start at which the state is wanted: those of the grid, or the end alone."""
    return case.grid[case.grid > case.begin] if case.grid.size > 1 else np.array([case.stop])


def found(
    case: Case,
    options: SolverOptions,
    rows: Array,
    steps: int,
    evaluations: int,
    taken: float,
    end: str,
    reached: float | None = None,
) -> Trajectory:
    """Return what a peer made of a case: states at ``times_of``; ``end``: how it failed, if it did; ``reached``: where, if it tells."""
    problem, t = case.problem, times_of(case)[: len(rows)]
    if case.grid.size > 1 and case.grid[0] <= case.begin:
        t, rows = np.r_[case.begin, t], np.vstack([case.y0, rows])
    failure = None
    if end == STEPS and reached is not None:
        failure = too_many_steps(problem, steps, reached, case.y0)
    elif end == LATE and reached is not None:
        failure = given_up(problem, taken, evaluations, reached, case.y0)
    elif end == LATE:
        failure = Failure("given up", case.begin, "", f"given up after {taken:.2g} s", None, {})
    elif end:
        failure = failure_of(options, case.begin, end)
    return Trajectory(
        t=t,
        y=with_unit_rotations(problem.rotations, rows),
        dense=None,
        statistics=Statistics(options.method, steps, None, evaluations, taken),
        failure=failure,
    )


def failure_of(options: SolverOptions, t: float, said: str) -> Failure:
    """Return the failure of a peer, with its words."""
    library = options.method.partition(":")[0]
    return Failure("of a peer", t, "", f"{library} says: {said}", None, {})
