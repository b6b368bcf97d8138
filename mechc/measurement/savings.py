"""What leaving out saves: the same model built with a part that it does not need, compared with the lean one."""

from __future__ import annotations

import itertools
import math
import os
import statistics
import struct
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from ..compiler.equations.needs import EVERYTHING
from ..runtime.case import SimulationOptions, prepare
from ..runtime.functions import load_functions
from ..runtime.integrate.solver import Solver
from ..runtime.native.kernel import kernel_for
from ..runtime.outcome import SimulationError
from ..watchdog import Crashed, Hung, Watchdog

if TYPE_CHECKING:
    from ..model import CompiledModel
    from ..runtime.case import Case
    from ..runtime.problem import Problem

    _Question = tuple[dict[str, Case], int, float]

Code = Literal["c", "python", "fmu", "web"]

STEPS = 400
"""Steps of a timed run: so short a run is seldom interrupted."""
OPERATIONS = 100_000
"""Of a right-hand side times steps, at most: large models take fewer steps."""
PROCESSES = 5
"""In which all builds are timed, one after the other, as in some a small model is slower by a quarter throughout: the interval is without
the smallest and the largest difference."""
SECONDS = 0.8
"""Of timing in each process. Beside other work on the same core code is slower by a third or more, on one processor for up to 3 s on a
busy machine; on several in turns some runs have the core to themselves, and the shortest ones count."""
PATIENCE = 120.0
"""Seconds that such a process may take."""
RUNS = 3
"""Of one build in its turn: the first finds others' code in the caches."""
MARGIN = 0.01
"""Of the interval on both sides, relative to the longest evaluation: the same code differed by 0.7 % between processes."""
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
    compiled code, or of the text or file that the target is; ``processes``: least nanoseconds of processor time of one evaluation, with its
    share of all that a step does beside, in each of several processes. None, empty: not measured."""

    operations: int
    evaluation: int
    size: int | None = None
    processes: tuple[float, ...] = ()

    @property
    def nanoseconds(self) -> float | None:
        return statistics.median(self.processes) if self.processes else None

    @property
    def interval(self) -> tuple[float, float] | None:
        """What holds ``nanoseconds`` in other processes too."""
        return _interval(self.processes, MARGIN * max(self.processes)) if self.processes else None

    def beyond(self, other: Cost) -> tuple[float, float, float] | None:
        """Return by how many nanoseconds this is slower than another cost that was timed in the same processes: the median, and the
        interval that holds it in other processes too. None where one of them was not timed."""
        if not self.processes or len(self.processes) != len(other.processes):
            return None
        apart = [a - b for a, b in zip(self.processes, other.processes, strict=True)]
        return statistics.median(apart), *_interval(apart, MARGIN * max(*self.processes, *other.processes))


def _interval(found: Sequence[float], margin: float) -> tuple[float, float]:
    low, high = sorted(found)[1], sorted(found)[-2]
    return low - margin, high + margin


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
    """Time all builds in turns, in several processes."""
    problems = {name: build.problem() for name, build in builds.items() if costs[name].size is not None}
    cases = {name: case for name, problem in problems.items() if (case := default_case(problem))}
    heaviest = max((costs[name].evaluation for name in cases), default=0)
    steps = max(5, min(STEPS, OPERATIONS // max(heaviest, 1)))
    found = [_in_a_process(cases, steps) for _ in range(PROCESSES if cases else 0)]
    return {
        name: replace(cost, processes=tuple(least[name] for least in found)) if name in cases else cost
        for name, cost in costs.items()
    }


def _in_a_process(cases: Mapping[str, Case], steps: int) -> dict[str, float]:
    """Find the least times in a process of its own, whose memory lies elsewhere. Raises SimulationError."""
    alone = {"parameters_function": None, "tangents": None, "adjoints": None}
    sent = {
        name: replace(case, functions=None, assembled=None, problem=replace(case.problem, **alone))
        for name, case in cases.items()
    }
    process: Watchdog[_Question, dict[str, float]] = Watchdog(_timer)
    with process:
        found = process.ask((sent, steps, SECONDS), PATIENCE)
    match found:
        case Crashed(how):
            raise SimulationError(f"the process that times the model failed: {how}")
        case Hung(seconds):
            raise SimulationError(f"the process that times the model takes longer than {seconds:g} s")
    return found


def _timer() -> Callable[[_Question], dict[str, float]]:
    def answer(question: _Question) -> dict[str, float]:
        sent, steps, seconds = question
        cases = {n: replace(case, functions=load_functions(case.problem)) for n, case in sent.items()}
        return least_times(cases, steps, seconds)

    return answer


def least_times(cases: Mapping[str, Case], steps: int, seconds: float) -> dict[str, float]:
    """Return the nanoseconds of the shortest run of each, as they run in turns, on one processor after another where the
    system lets a program choose."""
    least = dict.fromkeys(cases, math.inf)
    own = os.sched_getaffinity(0) if sys.platform == "linux" else {0}
    end = time.perf_counter() + seconds
    for processor in itertools.cycle(sorted(own)):
        if sys.platform == "linux":
            os.sched_setaffinity(0, {processor})
        for name, case in cases.items():
            least[name] = min(least[name], *(_by_kernel(case, steps) for _ in range(RUNS)))
        if time.perf_counter() > end:
            break
    if sys.platform == "linux":
        os.sched_setaffinity(0, own)
    return least


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


def _by_kernel(case: Case, steps: int) -> float:
    """Return the nanoseconds of an evaluation in steps of the classical Runge-Kutta method: the same ones in every build."""
    step = (case.stop - case.begin) * SHARE
    kernel = kernel_for(case.functions.struct, method="rk4")
    with Solver(kernel, case, "rk4", case.tolerance, np.ones(case.problem.ny), step) as solver:
        solver.advance(case.stop, steps)
        done = solver.progress()
        return done.seconds / max(done.evaluations, 1) * 1e9


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
