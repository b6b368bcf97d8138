"""What leaving out saves: the same model built with a part that it does not need, compared with the lean one."""

from __future__ import annotations

import statistics
import struct
import time
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from ..compiler.equations.needs import EVERYTHING
from ..runtime.case import SimulationOptions, prepare
from ..runtime.functions import load_functions
from ..runtime.outcome import SimulationError

if TYPE_CHECKING:
    from ..model import CompiledModel
    from ..runtime.case import Case
    from ..runtime.problem import Problem

Code = Literal["c", "python", "fmu", "web"]

STEPS = 400
REPEATS = 21
"""Rounds in which all builds are timed, one after the other: what else the machine does meets all of them."""
PAUSE = 0.04
"""Seconds between two rounds: a processor is slower or faster for a tenth of a second at a time, and the interval is to hold both."""
WITHIN = 1
"""How many of the smallest and largest of so many differences lie outside the interval."""
SHORTEST = 3
"""Runs of which a round takes the shortest."""
SHARE = 1e-4
"""Length of the measured steps over that of the experiment: short, so that no motion runs away in them."""
SQUARE = frozenset({"jacobian", "momenta", "structure"})
"""Parts whose size grows with the square of the number of states, or faster."""
LARGEST_SQUARE = 100
"""States above which they are not formed for a comparison."""
LARGEST = 30_000
"""Operations of a program above which it is not compiled to be measured."""
_MAGIC = b"\x7fELF\x02\x01"
"""64 bits, little endian."""
_ALLOCATED, _EXECUTABLE, _WRITABLE = 2, 4, 1
_OWN = (".text", ".rodata", ".data.rel.ro", ".data")


class Cost(Struct, frozen=True):
    """``operations`` of all functions together, ``evaluation`` those of one right-hand side; ``size`` in bytes of the
    compiled code, or of the text or file that the target is; ``nanoseconds`` of processor time of one evaluation with its share of
    all that a step does beside: the median of ``rounds``. None: not measured."""

    operations: int
    evaluation: int
    size: int | None = None
    nanoseconds: float | None = None
    rounds: tuple[float, ...] = ()

    def beyond(self, other: Cost) -> tuple[float, float, float] | None:
        """Return by how many nanoseconds this is slower than another cost that was timed in the same rounds: the median, and the
        interval that holds it. None where one of them was not timed."""
        if not self.rounds or len(self.rounds) != len(other.rounds):
            return None
        apart = sorted(a - b for a, b in zip(self.rounds, other.rounds, strict=True))
        return statistics.median(apart), apart[WITHIN], apart[-1 - WITHIN]


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
    equations, own = model.compilation.equations, model.compilation.parts
    beyond = SQUARE if len(equations.states) > LARGEST_SQUARE else frozenset()
    listed = [choice.part for choice in equations.choices if choice.part and choice.part not in beyond]
    builds = {"": model, "*": model.keeping((EVERYTHING - beyond) | own)}
    builds |= {part: model.keeping(own ^ {part}) for part in listed}
    costs = costs_of(builds, target, measured)
    lean, everything = costs.pop(""), costs.pop("*")
    return Savings(target, lean, everything, costs)


def costs_of(
    builds: Mapping[str, CompiledModel], target: Code = "c", measured: bool = True
) -> dict[str, Cost]:
    """Return what builds of a model cost, timed in turns. Raises CompilerMissing, BuildError."""
    costs = {name: cost(build, target, measured) for name, build in builds.items()}
    return _timed(builds, costs) if measured and target == "c" else costs


def _timed(builds: Mapping[str, CompiledModel], costs: Mapping[str, Cost]) -> dict[str, Cost]:
    """Time all builds in turns: by the compiled code; others are measured by their size alone."""
    cases = {n: default_case(build.problem()) for n, build in builds.items() if costs[n].size is not None}
    rounds: dict[str, list[float]] = {name: [] for name, case in cases.items() if case is not None}
    for k in range(REPEATS):
        time.sleep(PAUSE if k and rounds else 0.0)
        for name, times in rounds.items():
            case = cases[name]
            assert case is not None
            step = (case.stop - case.begin) * SHARE
            times.append(min(_by_kernel(case, step) for _ in range(SHORTEST)))
    return {
        name: replace(cost, nanoseconds=statistics.median(taken), rounds=tuple(taken))
        if (taken := rounds.get(name))
        else cost
        for name, cost in costs.items()
    }


def cost(model: CompiledModel, target: Code = "c", measured: bool = True) -> Cost:
    """Return what one build of a model costs, but for its time. Raises CompilerMissing, BuildError."""
    program = model.compilation.program
    operations = sum(function.operations for function in program.functions)
    rhs = program.function("rhs")
    plain = Cost(operations, rhs.operations if rhs else 0)
    if not measured or operations > LARGEST:
        return plain
    match target:
        case "c":
            problem = model.problem()
            assert problem.library is not None
            return replace(plain, size=code_bytes(problem.library))
        case "python":
            from ..compiler.targets.differentiable import Begin
            from ..compiler.targets.python import emit_python

            return replace(plain, size=len(emit_python(program, Begin(0.0, (), (), {})).encode()))
        case "fmu":
            return replace(plain, size=_fmu_size(model))
        case "web":
            return replace(plain, size=_page_size(model))


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
    begun = time.thread_time()
    done = run_kernel(short, options).statistics
    taken = min(
        done.run_time, time.thread_time() - begun
    )  # by the clock, and by the processor's with what is around it
    return taken / max(done.evaluations, 1) * 1e9


def _page_size(model: CompiledModel) -> int:
    """Return the bytes of the module of a page: the kernel and the model."""
    from ..compiler.targets.wasm.link import linked
    from ..web.kernels import kernel_for, loaded

    program = model.compilation.program
    kernel = kernel_for(model.method(None) or "dop853", events=program.switching is not None)
    return len(linked(program, loaded(kernel)).module)


def _fmu_size(model: CompiledModel) -> int:
    from ..fmu.account import account

    return account(model).binary


def code_bytes(library: Path) -> int:
    """Return the bytes of instructions and constants of a shared library.

    Of formats other than 64-bit ELF, which is all that is read here, the size of the file.
    """
    data = library.read_bytes()
    if not data.startswith(_MAGIC):
        return len(data)
    table, size, count, names = *struct.unpack_from("<Q", data, 40), *struct.unpack_from("<HHH", data, 58)
    headers = [struct.unpack_from("<IIQQQQ", data, table + k * size) for k in range(count)]
    strings = headers[names][4]
    total = 0
    for name, _, _, _, _, length in headers:
        start = strings + name
        title = data[start : data.index(b"\0", start)].decode()
        if any(title == own or title.startswith(f"{own}.") for own in _OWN):
            total += length
    return total
