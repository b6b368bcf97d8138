"""Methods of diffsol: it gets the formulas that series are made from as a text in its own language, and compiles them by LLVM."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Any

import numpy as np

from ...compiler.graph import Node
from ...compiler.graph import operations as ops
from ...compiler.pipeline import program_with
from ...compiler.program.slots import NoSeries, SlotGraph, rates_of
from ...runtime.outcome import SimulationError
from .exchange import Exchange, Stopped
from .shared import LATE, Library, found, refuse, times_of

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from ...compiler.program.model import Program
    from ...model import CompiledModel
    from ...runtime.case import Case
    from ...runtime.integrate.solver import SolverOptions
    from ...runtime.integrate.trajectory import Trajectory
    from ...runtime.reference.work_precision import Peer

MOST_EVENTS = 10_000
METHODS = ("tsit45", "bdf", "esdirk34")
SIGNS = {ops.ADD: "+", ops.SUB: "-", ops.MUL: "*", ops.DIV: "/"}
FUNCTIONS = frozenset({"sin", "cos", "tan", "exp", "log", "sqrt", "abs", "sinh", "cosh", "tanh"})


class Diffsol:
    """Runs of a model by one method. Its text is compiled once for each set of nominal values, which is not a part of a run."""

    def __init__(self, model: CompiledModel, parts: frozenset[str], method: str) -> None:
        self._model = model
        self._parts = parts
        self._method = method
        self._exchange = Exchange(model)
        self._made: dict[bytes, Any] = {}

    def _text(self, places: Sequence[int]) -> str:
        """Return the equations. Raises SimulationError for what diffsol has no function for."""
        try:
            return text(program_with(self._model.compilation, self._parts), places)
        except NoSeries as missing:
            raise SimulationError(f"has no formulas: {missing}") from None

    def __call__(self, case: Case, options: SolverOptions) -> Trajectory:
        import pydiffsol

        refuse(case, constraints=True)
        unit = (
            self._exchange.unit(case, options, multi_step=True) if case.problem.hybrid is not None else None
        )
        sizes = np.ascontiguousarray(options.nominal)
        key = sizes.tobytes()
        if key not in self._made:
            self._made[key] = pydiffsol.Ode(
                self._text([] if unit is None else unit.places), matrix_type=pydiffsol.nalgebra_dense
            )
        ode = self._made[key]
        ode.ode_solver = getattr(pydiffsol, self._method)
        ode.rtol = ode.atol = options.tolerance
        ode.h0 = 1e-3 * (case.stop - case.begin)
        t, y, times = case.begin, case.y0 if unit is None else unit.y, times_of(case)
        rows, end, n_events = np.empty((0, sizes.size)), "", 0
        modes = np.empty(0)
        begun = time.thread_time()
        while t < case.stop and not end and not (unit is not None and unit.ended):
            until = case.stop if unit is None else unit.next
            if unit is not None and unit.count:
                modes = np.concatenate(unit.modes())
            elif unit is not None:
                modes = unit.modes()[0]
            here = times[len(rows) : np.searchsorted(times, until, side="right")]
            asked = np.r_[here, [until] * int(not here.size or here[-1] < until)]
            ode.t0 = t
            try:
                found_by = ode.solve_dense(np.concatenate([y / sizes, sizes, case.p, modes]), asked)
            except Exception as error:  # what it raises is not a class of its own
                end = str(error) or "failed"
                break
            new, at = np.asarray(found_by.ys).T * sizes, np.asarray(found_by.ts)
            t, y = float(at[-1]), new[-1]
            rows = np.vstack([rows, new[: np.searchsorted(here, t, side="right")]])
            if time.thread_time() - begun > options.seconds:
                end = LATE
            elif unit is not None and t < case.stop:
                try:
                    y = unit.happen(t, y)
                except Stopped as stopped:
                    end = str(stopped)
                n_events += 1
                if n_events > MOST_EVENTS:
                    end = f"more than {MOST_EVENTS} events"
        taken = time.thread_time() - begun
        return found(case, options, rows, 0, 0, taken, end)


def text(program: Program, places: Sequence[int] = ()) -> str:
    """Return the rates of a program in diffsol's language, over states divided by their nominal values, as it knows one absolute
    tolerance; parameters are the start, the nominal values, those of the model, and where indicators stand at ``places`` the discrete
    variables, then signs and what is added, with which indicators stop a run. Raises NoSeries, SimulationError."""
    rhs = program.function("rhs")
    assert rhs is not None
    form, rates = rates_of(rhs, program.tables, located=program.switching is not None)
    ny, np_ = len(rates), program.size("p")
    nz = program.size("z") if program.switching is not None else 0
    rows: list[str] = []
    names = _written(form, rates, rows)
    stops = []
    if places:
        function = program.function("indicators")
        assert function is not None
        form = SlotGraph(program.tables, located=True)
        results = form.read(function)
        said = _written(form, [results[k] for k in places], rows)
        stops = [f"stop_i {{ {', '.join(f'g{i} * {n} + m{i}' for i, n in enumerate(said))} }}"]
    given = [
        *(f"a{i} = 0" for i in range(ny)),
        *(f"s{i} = 1" for i in range(ny)),
        *(f"p{i} = 1" for i in range(np_)),
        *(f"z{i} = 0" for i in range(nz)),
        *(f"g{i} = 1" for i in range(len(places))),
        *(f"m{i} = 0" for i in range(len(places))),
    ]
    return "\n".join(
        [
            f"in_i {{ {', '.join(given)} }}",
            f"u_i {{ {', '.join(f'x{i} = a{i}' for i in range(ny))} }}",
            *(f"y{i} {{ x{i} * s{i} }}" for i in range(ny)),
            *rows,
            f"F_i {{ {', '.join(f'{n} / s{i}' for i, n in enumerate(names))} }}",
            *stops,
        ]
    )


def _written(form: SlotGraph, nodes: Sequence[Node], rows: list[str]) -> list[str]:
    """Write nodes, one row each, and return their names. Raises SimulationError."""
    graph = form.graph
    places = {n: key for key, n in form.symbols.items()}
    names: dict[int, str] = {}
    for n in graph.reach(nodes):
        x = [names[a] for a in graph.args(n)]
        match graph.op(n):
            case ops.CONST:
                names[n] = f"({float(graph.value(n))!r})"
                continue
            case ops.SYMBOL:
                array, index = places[n]
                names[n] = "t" if array == "t" else f"{array}{index}"
                continue
            case op if op in SIGNS:
                said = f"{x[0]} {SIGNS[op]} {x[1]}"
            case ops.NEG:
                said = f"-{x[0]}"
            case ops.POW:
                said = f"pow({x[0]}, {x[1]})"
            case ops.SELECT if graph.op(graph.args(n)[0]) == ops.SYMBOL:  # a mode, which is 0 or 1
                said = f"{x[0]} * {x[1]} + (1 - {x[0]}) * {x[2]}"
            case code:
                name = ops.OPERATIONS[code].name
                if name not in FUNCTIONS:
                    raise SimulationError(f"has no function '{name}'")
                said = f"{name}({x[0]})"
        names[n] = f"v{len(rows)}"
        rows.append(f"{names[n]} {{ {said} }}")
    return [names[n] for n in nodes]


def _runs(model: CompiledModel, parts: frozenset[str]) -> Mapping[str, Peer]:
    return {f"diffsol:{method}": Diffsol(model, parts, method) for method in METHODS}


DIFFSOL = Library(
    "diffsol",
    "pydiffsol",
    "equations as mechc forms them in its own language, compiled by LLVM with derivatives of its own, dense matrices; states over their "
    "nominal values, as it knows one absolute tolerance",
    _runs,
    by_unit="its own stop conditions, where its runs end and begin again",
)
