"""A model that went through mechc, evaluated at states by name; refusals are told from failures."""

from __future__ import annotations

import re
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from msgspec.structs import replace

import mechc
from mechc.requests.in_si import settings_in_si
from mechc.requests.parse_values import settable_units
from mechc.runtime.case import Case, SimulationOptions, inputs_at, prepare
from mechc.runtime.functions import Functions, load_functions
from mechc.runtime.integrate.solver import Solver
from mechc.runtime.native.kernel import load_kernel
from random_models.states import on_constraints

TOLERANCE = 1e-8
"""Of the run that begins at a state, whose sizes are one."""
Values = dict[str, float]
Given = float | list[float]
"""Numbers by the names that results have."""


@dataclass
class Refused(Exception):
    """mechc says in words that a model is wrong."""

    codes: tuple[str, ...]
    text: str


class NoMotion(Exception):
    """No motion begins at a state, or it begins elsewhere, behind an event."""


@dataclass
class Compiled:
    """A compiled model with its start. ``z``: the discrete variables and flags with which its functions are evaluated."""

    model: Any
    problem: Any
    functions: Functions
    case: Case
    z: Any = None
    text: str = ""
    told: bool = False
    """Whether it was given values, which its own text does not say."""
    elsewhere: list[Values] | None = None
    """A random state on its constraints, or none, once it was looked for."""

    @property
    def switches(self) -> bool:
        """Whether flags that a run owns enter the functions."""
        return self.problem.hybrid is not None

    def settle(self, state: Values) -> Values:
        """Let a run begin at a state, and keep what it decides: what touches, sticks, on which side all is, and what ticks then.

        Returns the state behind the events of this instant; raises ``NoMotion`` where there is none.
        """
        if not self.switches:
            return state
        self.z = None
        y, _, t = self._arguments(state)
        case = replace(self.case, y0=y, begin=t, stop=t, grid=np.array([t]))
        with Solver(load_kernel(False), case, "dop853", TOLERANCE, np.full(len(y), TOLERANCE)) as solver:
            status = solver.advance(t, 1)
            if status < 0:
                raise NoMotion(status.name)
            after, self.z = solver.report()[1], solver.discretes()
        if np.allclose(after, y, rtol=1e-9, atol=1e-9):
            return state
        return state | dict(zip(self.states, map(float, after), strict=True))

    @property
    def relative(self) -> float:
        """How well values are known, relative to their size: three times what the model says of its integrals when it is compiled
        and, of their slopes, too, at its start."""
        said = [
            re.search(r"known to (\S+) of its size", d.message) for d in self.model.compilation.diagnostics
        ]
        at_start = self.outputs(self.start())
        told = [at_start[q.name] for q in self.problem.outputs if q.kind == "quadrature"]
        return max([1e-8, *(3 * float(found[1]) for found in said if found), *(3 * x for x in told if x < 1)])

    @property
    def states(self) -> list[str]:
        return [s.name for s in self.problem.states]

    @property
    def rotations(self) -> tuple[int, ...]:
        return tuple(self.problem.rotations)

    @property
    def constrained(self) -> bool:
        """Whether not every state is one of the model."""
        return bool(self.problem.constraints)

    def start(self) -> Values:
        """Return the assembled start by name."""
        return dict(zip(self.states, map(float, self.case.y0), strict=True)) | {"time": self.case.begin}

    def parameters(self) -> Values:
        """Return the values of the parameters."""
        return {q.name: float(v) for q, v in zip(self.problem.parameters, self.case.p, strict=False)}

    def discretes(self) -> Values:
        """Return the discrete variables with which its functions are evaluated."""
        pairs = zip(self.problem.discretes, () if self._z is None else self._z, strict=False)
        return {q.name: float(v) for q, v in pairs if q.kind != "mode"}

    def released(self) -> Values:
        """Return what the definition has to know of constraints and joints that hold no more."""
        contacts = {c.name for c in self.model.compilation.flat.contacts}
        modes = zip(self.problem.discretes, () if self._z is None else self._z, strict=False)
        names = [q.name[7:-1] for q, v in modes if q.name.startswith("closed(") and v < 0.5]
        return {f"held({name})": 0.0 for name in names if name not in contacts}

    def rhs(self, state: Values) -> Values:
        """Return the derivative of each state."""
        y, u, t = self._arguments(state)
        with warnings.catch_warnings(), np.errstate(all="ignore"):
            warnings.simplefilter("ignore")
            f = self.functions.rhs(t, y, u, self._z, self.case.p)
        return {f"d {name}": float(v) for name, v in zip(self.states, f, strict=True)}

    def outputs(self, state: Values) -> Values:
        """Return the outputs."""
        y, u, t = self._arguments(state)
        with warnings.catch_warnings(), np.errstate(all="ignore"):
            warnings.simplefilter("ignore")
            assert self.functions.outputs is not None
            f = self.functions.outputs(t, y, u, self._z, self.case.p)
        return {q.name: float(v) for q, v in zip(self.problem.outputs, f, strict=True)}

    def everything(self, state: Values) -> Values:
        """Return derivatives and outputs."""
        return self.rhs(state) | self.outputs(state)

    @property
    def _z(self) -> Any:
        return self.case.z if self.z is None else self.z

    def _arguments(self, state: Values) -> tuple[Any, Any, float]:
        y = np.array([state[name] for name in self.states])
        t = state.get("time", 0.0)
        u = np.empty(0)
        if self.problem.inputs:
            u = inputs_at(self.case, t)  # as the experiment sets them
            u = np.array([state.get(q.name, v) for q, v in zip(self.problem.inputs, u, strict=True)])
        return y, u, t

    def random_states(self, rng: np.random.Generator, n: int) -> list[Values]:
        """Return states near the start; on the constraints, where there are any, the start and another one."""
        states = [self.start()]
        if self.constrained:
            if self.elsewhere is None:
                flat = self.model.compilation.flat
                self.elsewhere = [] if self.told else on_constraints(flat, self.states, rng)
            return states + self.elsewhere
        for _ in range(n):
            y = self.case.y0 + 0.3 * rng.standard_normal(len(self.case.y0))
            for r in self.rotations:
                y[r : r + 4] /= np.linalg.norm(y[r : r + 4])
            states.append(
                dict(zip(self.states, map(float, y), strict=True)) | {"time": float(rng.uniform(0, 1))}
            )
        return states


def compiled(text: str, *, quick: bool = True) -> Compiled:
    """Compile a text and find its start; raises ``Refused`` where mechc says what is wrong. ``quick``: by libtcc."""
    return prepared(lambda: mechc.loads(text), None, text, quick=quick)


def prepared(
    made: Callable[[], Any], values: Mapping[str, Given] | None, text: str, *, quick: bool = True
) -> Compiled:
    """Make a model, and find its start; raises ``Refused``."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            model = made().for_experiment(None)
            problem = model.problem(quick=quick)
            functions = load_functions(problem)
            given = settings_in_si(values or {}, settable_units(problem))
            case = prepare(problem, functions, SimulationOptions(values=given))
    except mechc.CompileError as error:
        wrong = [d for d in error.diagnostics if d.code.startswith("E")]
        raise Refused(tuple(d.code for d in wrong), mechc.render(wrong)) from None
    except (mechc.SimulationError, mechc.UsageMistake) as error:
        raise Refused(("run",), str(error)) from None
    except Exception as error:
        error.add_note(text)
        raise
    return Compiled(model, problem, functions, case, text=text, told=bool(values))


def differences(
    a: Values, b: Values, nearby: Sequence[Values] = (), ignored: Sequence[str] = (), relative: float = 1e-8
) -> list[tuple[str, float, float]]:
    """List what differs by more than rounding can explain.

    ``nearby``: values of ``a`` at states that differ by 1e-12 of their size: what they change is multiplied by 1e3
    (the states themselves are known to 1e-16, and cancel by up to the same factor) and allowed on top of ``relative`` of
    the largest value of the same kind.
    """
    wrong = []
    accelerations = max(
        (abs(v) for k, v in a.items() if k.startswith("d der(") and np.isfinite(v)), default=0.0
    )
    for name in a.keys() & b.keys():
        if name in ignored:
            continue
        x, y = a[name], b[name]
        if not np.isfinite(x) and not np.isfinite(y):
            continue
        around = max((abs(near[name] - x) for near in nearby if np.isfinite(near[name])), default=0.0)
        scale = 1 + abs(x) + (0.1 * accelerations if name.startswith("d der(") else 0)
        if not abs(x - y) <= relative * scale + 1e3 * around:
            wrong.append((name, x, y))
    return sorted(wrong)


def shaken(state: Values, rng: np.random.Generator) -> Values:
    """Return a state that differs by 1e-12 of its size."""
    return {k: v + 1e-12 * (1 + abs(v)) * float(rng.standard_normal()) for k, v in state.items()}
