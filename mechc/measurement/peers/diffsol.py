"""Methods of diffsol: it gets the formulas that series are made from as a text in its own language, and compiles them by LLVM."""

from __future__ import annotations

import functools
import time
from typing import TYPE_CHECKING, Any

import numpy as np

from ...compiler.graph import operations as ops
from ...compiler.pipeline import program_with
from ...compiler.program.slots import NoSeries, rates_of
from ...runtime.outcome import SimulationError
from .shared import Library, found, times_of

if TYPE_CHECKING:
    from collections.abc import Mapping

    from ...compiler.program.model import Program
    from ...model import CompiledModel
    from ...runtime.case import Case
    from ...runtime.integrate.solver_options import SolverOptions
    from ...runtime.integrate.trajectory import Trajectory
    from ...runtime.reference.work_precision import Peer

METHODS = ("tsit45", "bdf", "esdirk34")
SIGNS = {ops.ADD: "+", ops.SUB: "-", ops.MUL: "*", ops.DIV: "/"}
FUNCTIONS = frozenset({"sin", "cos", "tan", "exp", "log", "sqrt", "abs", "sinh", "cosh", "tanh"})


class Diffsol:
    """Runs of a model by one method. Its text is compiled once for each set of nominal values, which is no part of a run."""

    def __init__(self, model: CompiledModel, parts: frozenset[str], method: str) -> None:
        self._model = model
        self._parts = parts
        self._method = method
        self._made: dict[bytes, Any] = {}

    @functools.cached_property
    def _text(self) -> str:
        """The equations. Raises SimulationError for what diffsol has no function for."""
        try:
            return text(program_with(self._model.compilation, self._parts))
        except NoSeries as missing:
            raise SimulationError(f"has no formulas: {missing}") from None

    def __call__(self, case: Case, options: SolverOptions) -> Trajectory:
        import pydiffsol

        if case.problem.hybrid is not None or case.problem.inputs:
            raise SimulationError("is compared on models without events and inputs")
        sizes = np.ascontiguousarray(options.nominal)
        key = sizes.tobytes()
        if key not in self._made:
            self._made[key] = pydiffsol.Ode(self._text, matrix_type=pydiffsol.nalgebra_dense)
        ode = self._made[key]
        ode.ode_solver = getattr(pydiffsol, self._method)
        ode.rtol = ode.atol = options.tolerance
        ode.t0, ode.h0 = case.begin, 1e-3 * (case.stop - case.begin)
        given, times, failure = np.concatenate([case.y0 / sizes, sizes, case.p]), times_of(case), ""
        begun = time.thread_time()
        try:
            rows = np.asarray(ode.solve_dense(given, times).ys).T * sizes
        except Exception as error:  # what it raises is no class of its own
            rows, failure = np.empty((0, sizes.size)), str(error) or "failed"
        taken = time.thread_time() - begun
        return found(case, options, rows, 0, 0, taken, "late" if taken > options.seconds else failure)


def text(program: Program) -> str:
    """Return the rates of a program in diffsol's language, over states divided by their nominal values, as it knows one absolute
    tolerance; parameters are the start, the nominal values and those of the model. Raises NoSeries, SimulationError."""
    rhs = program.function("rhs")
    assert rhs is not None
    form, rates = rates_of(rhs, program.tables, located=program.switching is not None)
    graph, ny, np_ = form.graph, len(rates), program.size("p")
    places = {n: key for key, n in form.symbols.items()}
    names: dict[int, str] = {}
    rows: list[str] = []
    for n in graph.reach(rates):
        x = [names[a] for a in graph.args(n)]
        match graph.op(n):
            case ops.CONST:
                names[n] = f"({float(graph.value(n))!r})"
                continue
            case ops.SYMBOL:
                array, index = places[n]
                names[n] = {"t": "t", "y": f"y{index}", "p": f"p{index}"}[array]
                continue
            case op if op in SIGNS:
                said = f"{x[0]} {SIGNS[op]} {x[1]}"
            case ops.NEG:
                said = f"-{x[0]}"
            case ops.POW:
                said = f"pow({x[0]}, {x[1]})"
            case code:
                name = ops.OPERATIONS[code].name
                if name not in FUNCTIONS:
                    raise SimulationError(f"has no function '{name}'")
                said = f"{name}({x[0]})"
        names[n] = f"v{len(rows)}"
        rows.append(f"{names[n]} {{ {said} }}")
    given = [
        *(f"a{i} = 0" for i in range(ny)),
        *(f"s{i} = 1" for i in range(ny)),
        *(f"p{i} = 1" for i in range(np_)),
    ]
    return "\n".join(
        [
            f"in_i {{ {', '.join(given)} }}",
            f"u_i {{ {', '.join(f'x{i} = a{i}' for i in range(ny))} }}",
            *(f"y{i} {{ x{i} * s{i} }}" for i in range(ny)),
            *rows,
            f"F_i {{ {', '.join(f'{names[n]} / s{i}' for i, n in enumerate(rates))} }}",
        ]
    )


def _runs(model: CompiledModel, parts: frozenset[str]) -> Mapping[str, Peer]:
    return {f"diffsol:{method}": Diffsol(model, parts, method) for method in METHODS}


DIFFSOL = Library(
    "diffsol",
    "pydiffsol",
    "equations as mechc forms them in its own language, compiled by LLVM with derivatives of its own, dense matrices; states over their "
    "nominal values, as it knows one absolute tolerance",
    _runs,
)
