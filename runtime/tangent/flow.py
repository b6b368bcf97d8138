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
from ..delays import refuse_delays
from ..integrate.choose_method import Method
from ..integrate.trajectory import Statistics
from ..methods import refuse_contact_steps
from ..outcome import Failure, SimulationError
from ..problem import Array, Problem
from ..results.accuracy import companion_tolerance
from ..results.evaluate import evaluate_rows
from .augmented import augment
from .coordinates import basis, minimal, projected
from .directions import Direction, as_asked, named
from .pieces import Pieces, Rows, spread
from .sizes import tangent_nominals
from .start import start_tangents

GENERAL = ("auto", "dop853", "radau5", "rk4", "gauss2", "gauss4", "gauss6", "gauss8")
"""Methods for whatever has a right-hand side; a motion by others is differentiated by dop853."""


class TangentFlow(Struct, frozen=True, eq=False):
    """Values and derivatives at ``time`` [n], in SI.

    ``states`` [n, ny], ``tangents`` [n, ny, k]; ``outputs`` [n, m], ``output_tangents`` [n, m, k]: the derivatives in the k
    ``directions``, at fixed time. ``errors`` and ``output_errors``: their estimated errors, in their own units, like them;
    None where no second run was made. ``failure`` tells why the motion could not be followed to the last time; ``ended``, by which
    text ``terminate`` ended it before, and when.
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
    ended: str = ""
    remarks: tuple[str, ...] = ()
    """What is to be known of the derivatives: events that almost graze or coincide."""
    units: tuple[tuple[str, ...], ...] = ()
    """Of the derivatives of states, then of outputs, [ny + m][k]."""
    z: Array | None = None
    dz: Array | None = None
    """Discrete variables [n, nz] and the derivatives of the real ones [n, real ones, k]."""

    @property
    def short(self) -> str:
        """Why it does not reach the last time; nothing where it does."""
        return self.failure.message if self.failure is not None else self.ended

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
    both_sides: bool = False,
) -> TangentFlow:
    """Differentiate a motion in its directions.

    ``directions``: names of parameters, initial values and inputs. A parameter changes with all that follows from it, the
    assembly of the start included; an initial value as far as the start stays consistent; an input by a constant. ``initial``
    [2 nv + nx, m]: further directions, before these, as changes of the initial state in the space of velocities (the whole
    flow: the unit matrix), put onto the constraints. ``times`` [n]: where, instead of the times of the case; ``both_sides``: at
    both sides of each event as well, so that its time stands twice.
    Raises SimulationError where the motion has no derivatives.
    """
    begun = Tangents(case, method, nominal, directions, 0 if initial is None else initial.shape[1])
    w = begun.start(initial)
    grid = case.grid if times is None else np.asarray(times, dtype=np.float64)
    flow = begun.flow(case.begin, case.y0, w, grid, both_sides=both_sides)
    if not estimate_error or flow.short:
        return flow
    other = begun.tighter()
    second = other.flow(case.begin, case.y0, w, grid, both_sides=both_sides)
    if second.short or second.time.size != flow.time.size:
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
    directions of a motion like this; found along the motion without them. A motion of more than ``max_steps`` is given up.
    """

    def __init__(
        self,
        case: Case,
        method: Method,
        nominal: Array,
        directions: Sequence[str] = (),
        states: int = 0,
        sizes: Array | None = None,
        max_steps: int | None = None,
    ) -> None:
        if not directions and not states:
            raise SimulationError("nothing is named in which the motion is to be differentiated")
        refuse_delays(case.problem, "how a motion changes with the past is not followed")
        refuse_contact_steps(method.name)
        asked = named(case, directions)
        by_array = {a: [d for d in asked if d.array == a] for a in "ypu"}
        self.case = case
        self.recording = method
        self.method = method if method.name in GENERAL else Method("dop853", False, 8)
        self.nominal = nominal
        self._vectors = states
        # a free direction, for rates along the motion
        self._probes = 1 if case.problem.hybrid is not None else 0
        first = states + self._probes
        self._listed = (*by_array["y"], *by_array["p"], *by_array["u"])
        self._order = [*range(states), *(first + self._listed.index(d) for d in asked)]
        self.directions = (*(Direction(f"direction {k + 1}", "") for k in range(states)), *asked)
        self.augmented = augment(case, as_asked(case, self._listed, first + len(by_array["y"])))
        self.tolerance = case.tolerance
        self.sizes = sizes
        self.max_steps = max_steps

    def tighter(self) -> Tangents:
        """Give the same with a tighter tolerance, a looser one where it is the tightest, or half the step."""
        other = object.__new__(Tangents)
        other.__dict__.update(self.__dict__)
        other.tolerance = companion_tolerance(self.tolerance)[0]
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
        first = self._vectors + self._probes
        everything = (*(Direction(f"direction {k + 1}", "") for k in range(first)), *self._listed)
        w = np.zeros((problem.ny, self.augmented.count))
        if self._listed:
            w[:, first:] = start_tangents(self.augmented, everything)[:, first:]
        w[:, : self._vectors] = vectors
        if self._vectors and problem.constraints:
            put = projected(self.augmented, case.begin, case.y0, w, case.z)
            w[:, : self._vectors] = put[:, : self._vectors]
        return w[:, self._order]

    def flow(
        self,
        begin: float,
        y: Array,
        w: Array,
        times: Array,
        *,
        z: Array | None = None,
        dz: Array | None = None,
        both_sides: bool = False,
        scheduled: bool = True,
    ) -> TangentFlow:
        """Integrate y [ny] and W [ny, k] from ``begin`` and give both at ``times`` [n], after what happens there;
        ``both_sides``: at each event as well, before and after it.

        ``z`` [nz] and ``dz`` [real ones, k]: discrete variables there and the derivatives of the real ones, those of the start
        without them. Without ``scheduled`` nothing ticks at the last time, so that a flow that begins there goes on.
        """
        augmented = self.augmented
        inner = np.zeros((self.case.problem.ny, augmented.count))
        inner[:, self._order] = w
        if self.sizes is None:
            self.sizes = tangent_nominals(augmented, self.nominal, inner, self.tolerance)
        more = None
        if dz is not None:
            more = np.zeros((len(dz), augmented.count))
            more[:, self._order] = dz
        if self._probes:
            rows = self._across(begin, y, inner, times, z, more)
        else:
            rows = self._smooth(begin, y, inner, times)
        if not scheduled and self._probes:
            rows = rows.before_ticks(self.case, float(times[-1]))
        if not both_sides:
            rows = rows.at(times)
        tangents = rows.w
        if self.case.problem.constraints:
            tangents = np.stack(
                [
                    projected(augmented, *row)
                    for row in zip(rows.t, rows.y, rows.w, rows.z, rows.dz, strict=True)
                ]
            )
        outputs = self._outputs(replace(rows, w=tangents))
        return TangentFlow(
            problem=self.case.problem,
            directions=self.directions,
            time=rows.t,
            states=rows.y,
            tangents=tangents[:, :, self._order],
            outputs=outputs[0],
            output_tangents=outputs[1][:, :, self._order],
            statistics=rows.run.statistics,
            failure=self._named(rows.failure),
            ended="" if rows.run.t[-1] >= times[-1] else rows.run.ending(self.case.problem),
            units=self._units(),
            remarks=rows.remarks,
            z=rows.z,
            dz=rows.dz[:, :, self._order],
        )

    def _named(self, failure: Failure | None) -> Failure | None:
        """Name the directions of the start in what is told: the compiler knows their number only."""
        if failure is None:
            return None
        first = self._vectors
        names = [*("time" for _ in range(self._probes)), *(d.name for d in self._listed if d.array == "y")]
        message = failure.message
        for k in reversed(range(len(names))):
            message = message.replace(f"/d(direction {first + k + 1})", f"/d({names[k]})")
        return replace(failure, message=message)

    def _smooth(self, begin: float, y: Array, w: Array, times: Array) -> Rows:
        """Follow a motion in which nothing switches."""
        augmented = self.augmented
        assert self.sizes is not None
        nominal = augmented.joined(self.nominal, np.maximum(self.sizes, spread(w, self.nominal)))
        z = augmented.discretes(self.case.z)
        joined = augmented.joined(y, w)
        run = augmented.run(self.method, self.tolerance, nominal, begin, joined, z, times, self.max_steps)
        if run.interrupted:
            raise KeyboardInterrupt
        states, tangents = augmented.split(run.y, y.size)
        n = run.t.size
        return Rows(
            run.t,
            states,
            tangents,
            np.tile(self.case.z, (n, 1)),
            np.zeros((n, 0, w.shape[1])),
            run,
            run.failure,
        )

    def _across(
        self, begin: float, y: Array, w: Array, times: Array, z: Array | None, dz: Array | None
    ) -> Rows:
        """Follow a motion across its events."""
        assert self.sizes is not None
        pieces = Pieces(
            self.augmented,
            self.method,
            self.recording,
            self.tolerance,
            self.nominal,
            self._vectors,
            self.max_steps,
        )
        return pieces.follow(begin, y, w, self.sizes, times, z, dz)

    def _units(self) -> tuple[tuple[str, ...], ...]:
        problem, found = self.case.problem, self.augmented.problem
        rows = []
        for quantities, size in ((found.states, problem.ny), (found.outputs, len(problem.outputs))):
            for i in range(size):
                rows.append(tuple(quantities[size * (d + 1) + i].unit for d in self._order))
        return tuple(rows)

    def _outputs(self, rows: Rows) -> tuple[Array, Array]:
        augmented, size = self.augmented, len(self.case.problem.outputs)
        if augmented.functions.outputs is None or not rows.t.size:
            return np.empty((rows.t.size, 0)), np.empty((rows.t.size, 0, augmented.count))
        case = replace(
            self.case,
            problem=augmented.problem,
            functions=augmented.functions,
            p=augmented.p,
            z=augmented.discretes(self.case.z),
        )
        both = np.stack([augmented.joined(y, w) for y, w in zip(rows.y, rows.w, strict=True)])
        z = np.stack([augmented.discretes(z, dz) for z, dz in zip(rows.z, rows.dz, strict=True)])
        return augmented.split(evaluate_rows(case, "outputs", rows.t, both, z), size)
