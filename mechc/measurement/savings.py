"""What leaving out saves: the same model built with a part that it does not need, compared with the lean one."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from contextlib import suppress
from typing import TYPE_CHECKING, Literal

import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from ..compiler.equations.needs import EVERYTHING
from ..runtime.case import SimulationOptions, prepare
from ..runtime.functions import load_functions
from ..runtime.native.object_code import code_bytes
from ..runtime.outcome import SimulationError

if TYPE_CHECKING:
    from ..model import CompiledModel
    from ..runtime.case import Case
    from ..runtime.problem import Problem

Code = Literal["c", "python", "fmu"]

STEPS = 400
REPEATS = 9
SHARE = 1e-4
"""Length of the measured steps over that of the experiment: short, so that no motion runs away in them."""
SQUARE = frozenset({"jacobian", "momenta", "structure"})
"""Parts whose size grows with the square of the number of states, or faster."""
LARGEST_SQUARE = 100
"""States above which they are not formed for a comparison."""
LARGEST = 30_000
"""Operations of a program above which it is not compiled to be measured."""


class Cost(Struct, frozen=True):
    """``operations`` of all functions together, ``evaluation`` those of one right-hand side; ``size`` in bytes of the
    compiled code, or of the text or file that the target is; ``nanoseconds`` of one evaluation with its share of all
    that a step does beside. None: not measured."""

    operations: int
    evaluation: int
    size: int | None = None
    nanoseconds: float | None = None


class Savings(Struct, frozen=True):
    """``parts``: cost of the model with one part more, by name; without those that a large model does not form."""

    target: Code
    lean: Cost
    everything: Cost
    parts: Mapping[str, Cost]


def savings(model: CompiledModel, target: Code = "c", *, measured: bool = True) -> Savings:
    """Build a model lean, with each part that it does without, and with all of them.

    ``measured``: sizes and times too, for which code is compiled. Raises CompilerMissing, BuildError.
    """
    equations = model.compilation.equations
    beyond = SQUARE if len(equations.states) > LARGEST_SQUARE else frozenset()
    absent = [choice.part for choice in equations.choices if choice.part and choice.part not in beyond]
    lean = model.keeping(())
    return Savings(
        target,
        cost(lean, target, measured),
        cost(lean.keeping(EVERYTHING - beyond), target, measured),
        {part: cost(lean.keeping((part,)), target, measured) for part in absent},
    )


def cost(model: CompiledModel, target: Code = "c", measured: bool = True) -> Cost:
    """Return what one build of a model costs. Raises CompilerMissing, BuildError."""
    program = model.compilation.program
    operations = sum(function.operations for function in program.functions)
    rhs = program.function("rhs")
    plain = Cost(operations, rhs.operations if rhs else 0)
    if not measured or operations > LARGEST:
        return plain
    match target:
        case "c":
            problem = model.problem("c")
            assert problem.library is not None
            return replace(
                plain, size=code_bytes(problem.library), nanoseconds=nanoseconds(problem, _by_kernel)
            )
        case "python":
            from ..compiler.targets.python import emit_python

            problem = model.problem("python")
            size = len(emit_python(program).encode())
            return replace(plain, size=size, nanoseconds=nanoseconds(problem, _by_python))
        case "fmu":
            return replace(plain, size=_fmu_size(model))


def nanoseconds(problem: Problem, measure: Callable[[Case, float], float]) -> float | None:
    """Return the time of one evaluation at the start of the motion; None where the motion cannot begin."""
    case = default_case(problem)
    return None if case is None else measure(case, (case.stop - case.begin) * SHARE)


def default_case(problem: Problem) -> Case | None:
    """Return the default experiment, of one second where the model says no stop; None where no motion can begin."""
    functions = load_functions(problem)
    for stop in (None, 1.0):
        with suppress(SimulationError):
            return prepare(problem, functions, SimulationOptions(points=2, stop=stop))
    return None


def _by_kernel(case: Case, step: float) -> float:
    """Steps of the classical Runge-Kutta method: the same ones in every build."""
    from ..runtime.integrate.kernel_run import run_kernel
    from ..runtime.integrate.solver_options import SolverOptions

    short = replace(case, stop=case.begin + (STEPS + 1) * step, grid=np.array([case.begin]), method="rk4")
    options = SolverOptions("rk4", case.tolerance, np.ones(case.problem.ny), step, max_steps=STEPS)
    times = []
    for _ in range(REPEATS):
        done = run_kernel(short, options)
        times.append(done.statistics.run_time / max(done.statistics.evaluations, 1))
    return min(times) * 1e9


def _by_python(case: Case, step: float) -> float:
    times = []
    u = np.zeros(len(case.problem.inputs))
    for _ in range(REPEATS):
        begun = time.perf_counter()
        for _ in range(STEPS // 10):
            case.functions.rhs(case.begin, case.y0, u, case.z, case.p)
        times.append((time.perf_counter() - begun) / (STEPS // 10))
    return min(times) * 1e9


def _fmu_size(model: CompiledModel) -> int:
    from ..fmu.account import account

    return account(model).binary
