"""The tangent flow: a motion and its derivatives in initial values, parameters and inputs, with estimated errors.

>>> plan = plan_run(problem, options)
>>> flow = tangent_flow(plan.case, plan.method, plan.nominal, ["l", "theta"])
>>> flow.tangents[-1]          # [ny, 2]: d(state)/d(l), d(state)/d(theta) at the end
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from ..case import Case
from ..integrate.methods import Method
from ..integrate.scipy_methods import PREFIX
from ..integrate.trajectory import Statistics
from ..outcome import Failure, SimulationError
from ..problem import Array, Problem
from ..results.evaluate import evaluate_rows
from .augmented import augment
from .coordinates import basis, minimal
from .directions import Direction, as_asked, named
from .sizes import tangent_nominals
from .start import start_tangents

TIGHTER = 100.0
"""Ratio of the tolerances of both runs, whose difference is the estimated error."""

LOWEST = 1e-14
"""Tightest tolerance of the second run."""

GENERAL = ("auto", "dop853", "radau5", "rk4", "gauss2", "gauss4", "gauss6", "gauss8")
"""Methods for whatever has a right-hand side; a motion by others is differentiated by dop853."""


class TangentFlow(Struct, frozen=True, eq=False):
    """Values and derivatives at ``time`` [n], in SI.

    ``states`` [n, ny], ``tangents`` [n, ny, k]; ``outputs`` [n, m], ``output_tangents`` [n, m, k]: the derivatives in the k
    ``directions``, at fixed time. ``errors`` and ``output_errors``: their estimated errors, in their own units, like them;
    None where no second run was made. ``failure`` tells why the motion ended before the last time.
    """

    problem: Problem
    directions: tuple[Direction, ...]
    time: Array
    states: Array
    tangents: Array
    outputs: Array
    output_tangents: Array
    statistics: Statistics
    errors: Array | None = None
    output_errors: Array | None = None
    failure: Failure | None = None
    units: tuple[tuple[str, ...], ...] = ()
    """Of the derivatives of states, then of outputs, [ny + m][k]."""

    def minimal(self, row: int = -1) -> Array:
        """Give the derivatives at one time in the space of velocities, [2 nv + nx, k] (tangent/coordinates.py)."""
        return minimal(self.problem, self.states[row], self.tangents[row])


def tangent_flow(
    case: Case,
    method: Method,
    nominal: Array,
    directions: Sequence[str] = (),
    *,
    initial: Array | None = None,
    times: Array | None = None,
    estimate_error: bool = True,
) -> TangentFlow:
    """Differentiate a motion in its directions.

    ``directions``: names of parameters, initial values and inputs. A parameter changes with all that follows from it, the
    assembly of the start included; an initial value as far as the start stays consistent; an input by a constant. ``initial``
    [2 nv + nx, m]: further directions, before these, as changes of the initial state in the space of velocities (the whole
    flow: the unit matrix), put onto the constraints. ``times`` [n]: where, instead of the times of the case.
    Raises SimulationError where the motion has no derivatives.
    """
    begun = Tangents(case, method, nominal, directions, 0 if initial is None else initial.shape[1])
    w = begun.start(initial)
    grid = case.grid if times is None else np.asarray(times, dtype=np.float64)
    flow = begun.flow(case.begin, case.y0, w, grid)
    if not estimate_error or flow.failure is not None:
        return flow
    other = begun.tighter()
    second = other.flow(case.begin, case.y0, w, grid)
    if second.failure is not None or second.time.size != flow.time.size:
        return flow
    return replace(
        flow,
        errors=np.abs(flow.tangents - second.tangents),
        output_errors=np.abs(flow.output_tangents - second.output_tangents),
    )


class Tangents:
    """A case made ready to be differentiated: from any state at any time, as often as one likes.

    ``states``: how many directions are changes of the initial state alone; they come first, and ``directions`` by name
    after them. ``sizes``: what errors of the derivatives are measured against, as found by another one for the same
    directions of a motion like this; found along the motion without them.
    """

    def __init__(
        self,
        case: Case,
        method: Method,
        nominal: Array,
        directions: Sequence[str] = (),
        states: int = 0,
        sizes: Array | None = None,
    ) -> None:
        if case.problem.hybrid is not None:
            raise SimulationError(
                f"'{case.problem.name}' switches: its motion is not differentiated across events"
            )
        asked = named(case, directions)
        by_array = {a: [d for d in asked if d.array == a] for a in "ypu"}
        self.case = case
        self.method = method if method.name in GENERAL or not method.in_kernel else _general(case)
        self.nominal = nominal
        self._vectors = states
        self._listed = (*by_array["y"], *by_array["p"], *by_array["u"])
        self._order = [*range(states), *(states + self._listed.index(d) for d in asked)]
        self.directions = (*(Direction(f"direction {k + 1}", "") for k in range(states)), *asked)
        self.augmented = augment(case, as_asked(case, self._listed, states + len(by_array["y"])))
        self.tolerance = case.tolerance
        self.sizes = sizes

    def tighter(self) -> Tangents:
        """Give the same with a tighter tolerance, or half the step."""
        other = object.__new__(Tangents)
        other.__dict__.update(self.__dict__)
        other.tolerance = max(self.tolerance / TIGHTER, LOWEST)
        if self.method.fixed_step and self.case.step is not None:
            other.augmented = replace(self.augmented, case=replace(self.case, step=self.case.step / 2))
        else:  # where the longest step bounds both runs, they would make the same error
            other.augmented = replace(
                self.augmented, case=replace(self.case, max_step=self.case.max_step / 2)
            )
        return other

    def start(self, initial: Array | None = None) -> Array:
        """Give W [ny, k] at the start. ``initial`` [2 nv + nx, states]: see ``tangent_flow``."""
        case, problem = self.case, self.case.problem
        size = 2 * problem.nv + problem.nx
        if initial is None and self._vectors:
            raise ValueError(f"{self._vectors} directions of the initial state are needed")
        vectors = np.zeros((problem.ny, 0))
        if initial is not None:
            if initial.shape != (size, self._vectors):
                raise ValueError(f"directions of the initial state have the shape {size} x {self._vectors}")
            vectors = basis(problem, case.y0) @ initial
        everything = (*self.directions[: self._vectors], *self._listed)
        w = np.zeros((problem.ny, self.augmented.count))
        if self._listed:
            w[:, self._vectors :] = start_tangents(self.augmented, everything)[:, self._vectors :]
        w[:, : self._vectors] = vectors
        if self._vectors and problem.constraints:
            w[:, : self._vectors] = self.onto(case.begin, case.y0, w)[:, : self._vectors]
        return w[:, self._order]

    def flow(self, begin: float, y: Array, w: Array, times: Array) -> TangentFlow:
        """Integrate y [ny] and W [ny, k] from ``begin`` and give both at ``times`` [n]."""
        augmented, ny = self.augmented, self.case.problem.ny
        inner = np.empty_like(w)
        inner[:, self._order] = w
        if self.sizes is None:
            self.sizes = tangent_nominals(augmented, self.nominal, inner, self.tolerance)
        row = augmented.joined(y, inner)
        nominal = augmented.joined(self.nominal, np.maximum(self.sizes, _spread(inner, self.nominal)))
        z = augmented.discretes(self.case.z)
        run = augmented.run(self.method, self.tolerance, nominal, begin, row, z, times)
        if run.interrupted:
            raise KeyboardInterrupt
        states, tangents = augmented.split(run.y, ny)
        if self.case.problem.constraints:
            tangents = np.stack(
                [self.onto(float(t), y, v) for t, y, v in zip(run.t, states, tangents, strict=True)]
            )
        outputs = self._outputs(run.t, states, tangents)
        return TangentFlow(
            problem=self.case.problem,
            directions=self.directions,
            time=run.t,
            states=states,
            tangents=tangents[:, :, self._order],
            outputs=outputs[0],
            output_tangents=outputs[1][:, :, self._order],
            statistics=run.statistics,
            failure=run.failure,
            units=self._units(),
        )

    def _units(self) -> tuple[tuple[str, ...], ...]:
        problem, found = self.case.problem, self.augmented.problem
        rows = []
        for quantities, size in ((found.states, problem.ny), (found.outputs, len(problem.outputs))):
            for i in range(size):
                rows.append(tuple(quantities[size * (d + 1) + i].unit for d in self._order))
        return tuple(rows)

    def onto(self, t: float, y: Array, w: Array) -> Array:
        """Move W [ny, k], in the order of ``augmented``, onto the linearised constraints by the derivative of the projection."""
        augmented, problem = self.augmented, self.case.problem
        nq, nv = problem.nq, problem.nv
        turn, u, z = basis(problem, y)[:, :nv], augmented.inputs(t), augmented.discretes(self.case.z)
        for name, into in (("project_position", turn), ("project_velocity", None)):
            change = augmented.function(f"tangent_{name}", nv)(t, augmented.joined(y, w), u, z, augmented.p)
            d = change.reshape(-1, nv).T
            w = w.copy()
            if into is not None:
                w += into @ d
            else:
                w[nq : nq + nv] += d
        return w

    def _outputs(self, t: Array, states: Array, tangents: Array) -> tuple[Array, Array]:
        augmented, size = self.augmented, len(self.case.problem.outputs)
        if augmented.functions.outputs is None or not t.size:
            return np.empty((t.size, 0)), np.empty((t.size, 0, augmented.count))
        case = replace(
            self.case,
            problem=augmented.problem,
            functions=augmented.functions,
            p=augmented.p,
            z=augmented.discretes(self.case.z),
        )
        both = np.stack([augmented.joined(y, w) for y, w in zip(states, tangents, strict=True)])
        rows = evaluate_rows(case, "outputs", t, both)
        return augmented.split(rows, size)


def _spread(w: Array, nominal: Array) -> Array:
    """Give sizes [ny, k] by how far the directions reach now: they may have been scaled since the start."""
    far: Array = np.abs(w / nominal[:, None]).max(axis=0)
    return nominal[:, None] * far


def _general(case: Case) -> Method:
    """Give the method by which a motion of a special one is differentiated."""
    if case.functions.struct is None:
        return Method(PREFIX + "DOP853", False, False, 8)
    return Method("dop853", True, False, 8)
