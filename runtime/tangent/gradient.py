"""The gradient of one number of a motion in many parameters, backwards along the steps of the run (discrete adjoint).

>>> plan = plan_run(problem, options)
>>> found = gradient(plan.case, plan.nominal, "energy.total", ["m", "l", "theta"])
>>> found.value, found.derivatives         # [3]
"""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from ctypes import c_double, c_int, c_ssize_t, c_void_p
from functools import cache
from pathlib import Path

import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from ..case import Case
from ..functions import Functions, load_functions
from ..integrate.kernel_failure import kernel_failure
from ..integrate.solver import Solver
from ..native import kernel as native
from ..native.build import build_shared, kernel_flags
from ..native.kernel import Status
from ..outcome import Failure, SimulationError
from ..problem import Adjoint, Array, Problem
from .directions import Direction, chosen, named

METHOD = "dop853"
SOURCE = Path(__file__).with_name("adjoint.c")
FIRST, MOST_NUMBERS = 256, 4_000_000
"""Steps of a run before it is looked at; later it is looked at after more, of so many numbers."""

MOST_BYTES = 2e9
"""Of the states at the beginning of all steps."""


class Gradient(Struct, frozen=True, eq=False):
    """``value`` of the goal and its ``derivatives`` [k] in the ``directions``, in SI, with their units; ``steps`` of the
    run, ``memory`` in bytes of the states that were kept; ``end``: the last state."""

    value: float
    unit: str
    directions: tuple[Direction, ...]
    units: tuple[str, ...]
    derivatives: Array
    steps: int
    memory: int
    end: Array


class SweepRecord(ctypes.Structure):
    """sweep_record"""

    _fields_ = (
        *((name, c_void_p) for name in ("rhs", "inputs", "goal", "pull_back")),
        *((n, c_ssize_t) for n in ("ny", "nu", "nz", "n_free", "n_steps", "n_tabled", "n_rotations")),
        *((name, c_void_p) for name in ("rotations", "tabled", "z", "p", "t", "h", "y", "from_tables")),
        ("rate", c_double),
        *((name, c_void_p) for name in ("lambda", "gradient", "integral")),
    )


class Gradients:
    """A case whose goal is differentiated, made ready once: ``at`` runs it and goes back."""

    def __init__(self, case: Case, goal: str, directions: Sequence[str], *, integral: bool = False) -> None:
        problem = case.problem
        _check(case)
        self.case, self.integral = case, integral
        self.directions = named(case, directions)
        by_caller, by_experiment = chosen(case)
        arrays = {a: tuple(d.index for d in self.directions if d.array == a) for a in "ypu"}
        stated = {s.index for s in by_caller if s.array == "y"}
        set_late = {s.index for s in by_experiment if s.array == "y"}
        for d in self.directions:
            if d.array == "y" and d.index in set(problem.dependent) - stated - set_late:
                raise SimulationError(
                    f"'{d.name}' begins with a value that is stated with those of others: no direction by itself",
                    help=f"give it a value of its own, as in set={{'{d.name}': ...}}",
                )
        asked = Adjoint(
            goal=_place_of(problem, goal),
            integral=integral,
            parameters=arrays["p"],
            inputs=arrays["u"],
            given=tuple(sorted({s.index for s in by_caller | by_experiment if s.array == "p"})),
            tables=tuple(sorted(case.tables)),
            stated=tuple(sorted(stated)),
            settled=tuple(sorted((s.array, s.index) for s in by_caller if s.array != "y")),
            experiment=case.experiment if case.asked is not None else "",
        )
        assert problem.adjoints is not None
        try:
            self.problem = problem.adjoints(asked)
        except ValueError as error:
            raise SimulationError(str(error), help="give it a number, as in set={'name': ...}") from None
        self.functions = load_functions(self.problem)
        self.p = np.concatenate([case.p[: len(problem.parameters)], np.full(self.problem.nh, np.nan)])
        self.functions.parameters(self.p, np.ones(len(problem.parameters), dtype=np.uint8))

    def at(self, nominal: Array, tolerance: float) -> Gradient:
        """Run the case and differentiate its goal. Raises SimulationError where the run does not reach its end."""
        case, problem = self.case, self.case.problem
        t, h, y = _steps(case, nominal, tolerance)
        end = y[-1]
        free = len(self.directions) - sum(d.array == "y" for d in self.directions)
        back, total, integral = np.zeros(problem.ny), np.zeros(free), np.zeros(1)
        address = {name: _address(self.functions, name) for name in ("goal", "pull_back", "start_pull_back")}
        seeds = np.zeros(problem.ny + 1)
        value = 0.0
        if not self.integral:
            seeds[-1] = 1.0
            u = self._inputs(case.stop)
            value = float(_call(address["goal"], case.stop, end, u, seeds, self.p, 1)[0])
            pulled = _call(address["pull_back"], case.stop, end, u, seeds, self.p, problem.ny + free)
            back, total = pulled[: problem.ny].copy(), pulled[problem.ny :].copy()
        arrays = [np.ascontiguousarray(a, dtype=np.float64) for a in (t, h, y, back, total, integral)]
        tables = [(index, table) for index, table in sorted(case.tables.items())]
        stages = _library().mech_adjoint_stages()
        times = np.minimum(t[:, None] + _nodes(stages) * h[:, None], np.nextafter(t + h, t)[:, None])
        given = np.stack([table(times.ravel()) for _, table in tables], axis=-1) if tables else np.empty(0)
        given = np.ascontiguousarray(given)
        tabled = np.array([index for index, _ in tables], dtype=np.intc)
        rotations = np.array(problem.rotations, dtype=np.intc)
        struct = self.functions.struct
        assert struct is not None
        record = SweepRecord(
            rhs=getattr(struct, "rhs"),  # noqa: B009, a field of the struct
            inputs=getattr(struct, "inputs"),  # noqa: B009
            goal=address["goal"],
            pull_back=address["pull_back"],
            ny=problem.ny,
            nu=len(problem.inputs),
            n_free=free,
            n_steps=t.size,
            n_tabled=len(tables),
            n_rotations=rotations.size,
            rotations=rotations.ctypes.data,
            tabled=tabled.ctypes.data,
            p=self.p.ctypes.data,
            t=arrays[0].ctypes.data,
            h=arrays[1].ctypes.data,
            y=arrays[2].ctypes.data,
            from_tables=given.ctypes.data,
            rate=float(self.integral),
            gradient=arrays[4].ctypes.data,
            integral=arrays[5].ctypes.data,
        )
        setattr(record, "lambda", arrays[3].ctypes.data)
        if not _library().mech_adjoint_sweep(ctypes.byref(record)):
            raise MemoryError
        back, total = arrays[3], arrays[4]
        seeds = np.concatenate([back, [0.0]])
        start = _call(
            address["start_pull_back"],
            case.begin,
            case.y0,
            self._inputs(case.begin),
            seeds,
            self.p,
            problem.ny + free,
        )
        by_values, by_others = start[: problem.ny], start[problem.ny :] + total
        places = {("p", d.index): k for k, d in enumerate(d for d in self.directions if d.array == "p")}
        first = len(places)
        places |= {
            ("u", d.index): first + k for k, d in enumerate(d for d in self.directions if d.array == "u")
        }
        derivatives = np.array(
            [
                by_values[d.index] if d.array == "y" else by_others[places[d.array, d.index]]
                for d in self.directions
            ]
        )
        goal, rows = self.problem.offers[0], self.problem.offers[1].rows
        units = [
            rows[d.index if d.array == "y" else problem.ny + places[d.array, d.index]][1]
            for d in self.directions
        ]
        return Gradient(
            value=float(arrays[5][0]) if self.integral else value,
            unit=goal.rows[0][1],
            directions=self.directions,
            units=tuple(units),
            derivatives=derivatives,
            steps=t.size,
            memory=t.nbytes + h.nbytes + y.nbytes + given.nbytes,
            end=end,
        )

    def _inputs(self, t: float) -> Array:
        from ..case import input_values

        return input_values(self.functions, self.case.tables, t, self.p, len(self.case.problem.inputs))


def _check(case: Case) -> None:
    """Refuse what has no such gradient, or none that is built."""
    problem = case.problem
    instead = "derivatives along the motion go through that: sensitivity=[...] of a run"
    if problem.adjoints is None:
        raise SimulationError(
            f"the functions of '{problem.name}' were not made by the compiler, which alone differentiates them"
        )
    if case.functions.struct is None:
        raise SimulationError(
            "gradients are computed backwards by compiled code", help="this needs a C compiler: mechc doctor"
        )
    if problem.hybrid is not None:
        raise SimulationError(
            f"'{problem.name}' has events or laws that switch, at which the backward sweep would have to jump: gradients are "
            "for motions that are smooth",
            help=instead,
        )
    if problem.discretes:
        raise SimulationError(
            f"'{problem.name}' has discrete variables, which are not pulled back", help=instead
        )
    if problem.constraints or problem.assembly:
        raise SimulationError(
            f"'{problem.name}' has constraints that its run projects onto after each step, and these projections are not "
            "pulled back",
            help=instead,
        )
    if case.method not in ("auto", METHOD):
        raise SimulationError(
            f"the gradient is that of a run by {METHOD}; the steps of '{case.method}' are not pulled back",
            help=f"leave the method out, or say method = {METHOD}; " + instead,
        )


def _place_of(problem: Problem, goal: str) -> tuple[str, int]:
    for array, quantities in (("out", problem.outputs), ("y", problem.states)):
        for k, quantity in enumerate(quantities):
            if quantity.name == goal:
                return array, k
    raise SimulationError(f"'{problem.name}' has no state and no output '{goal}'")


def _steps(case: Case, nominal: Array, tolerance: float) -> tuple[Array, Array, Array]:
    """Run a case; give its steps (beginning, length) [n] and the states [n + 1, ny] at their ends."""
    case = replace(case, grid=np.array([case.stop]), tolerance=tolerance)
    kernel, made, ny = native.load_kernel(False), _library(), case.y0.size
    times, states = [np.array([case.begin])], [case.y0[None, :]]
    room, size, count, report = FIRST, 0, ctypes.c_ssize_t(), native.ReportStruct()
    calls = [ctypes.cast(f, c_void_p) for f in (kernel.mech_advance, kernel.mech_read)]
    with Solver(kernel, case, METHOD, tolerance, tolerance * nominal) as solver:
        status = Status.RUNNING
        while status is Status.RUNNING:
            t, y = np.empty(room), np.empty((room, ny))
            ends = (
                ctypes.byref(report),
                c_void_p(t.ctypes.data),
                c_void_p(y.ctypes.data),
                ctypes.byref(count),
            )
            status = Status(
                made.mech_adjoint_steps(
                    c_void_p(solver.handle),
                    *calls,
                    c_double(case.stop),
                    c_ssize_t(ny),
                    c_ssize_t(room),
                    *ends,
                )
            )
            times.append(t[: count.value])
            states.append(y[: count.value])
            size += 8 * count.value * (1 + ny)
            room = min(2 * room, max(FIRST, MOST_NUMBERS // ny))
            if size > MOST_BYTES:
                raise SimulationError(
                    f"the states of all steps up to t = {report.t:g} fill {size / 1e9:.2g} GB: the gradient goes back over all "
                    "of them",
                    help="a shorter run, or a looser tolerance",
                )
            if report.stiff_time == report.stiff_time:  # a number
                raise SimulationError(
                    f"the motion is stiff from t = {report.stiff_time:.4g} on, and the gradient goes back over explicit steps",
                    help="derivatives along a stiff motion: sensitivity=[...] of a run with method = radau5",
                )
        if status != Status.REACHED:
            failure: Failure | None = kernel_failure(case.problem, status, report, y[count.value - 1])
            raise SimulationError(
                f"the run ends before its last time: {failure.message if failure else status.name.lower()}"
            )
    t = np.concatenate(times)
    return t[:-1].copy(), np.diff(t), np.concatenate(states)


@cache
def _library() -> ctypes.CDLL:
    sources = {**native.kernel_sources(), SOURCE.name: SOURCE.read_text(encoding="utf-8")}
    headers = {name: text for name, text in sources.items() if name.endswith(".h") or name == SOURCE.name}
    loaded = ctypes.CDLL(str(build_shared(headers, kernel_flags(), name="adjoint")))
    loaded.mech_adjoint_sweep.restype = c_int
    return loaded


def _nodes(stages: int) -> Array:
    """Give the places of the stages in a step."""
    from scipy.integrate._ivp import dop853_coefficients

    return np.asarray(dop853_coefficients.C[:stages])


def _address(functions: Functions, name: str) -> int:
    found = ctypes.cast(getattr(functions.library, name), c_void_p).value
    assert found is not None
    return found


def _call(address: int, t: float, y: Array, u: Array, z: Array, p: Array, size: int) -> Array:
    out = np.empty(size)
    arrays = [np.ascontiguousarray(a) for a in (y, u, z, p, out)]
    native.MODEL_FUNCTION(address)(t, *(a.ctypes.data for a in arrays))
    return out
