"""A row of the table of foreign systems, and how a model is compared with what SymPy forms of the same system."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import sympy
from msgspec import Struct, field

import mechc
from mechc.api import Model

STATES = 3
"""At how many random states a system is compared, each with parameters and inputs of its own."""


class Judge(Struct, frozen=True):
    """What SymPy forms: q' = kinematics(q, u), mass [u', multipliers] = forcing, and the constraints on q and on u.

    ``reactions`` are formulas of q, u, u', and the multipliers. What is not a coordinate, speed or multiplier is a parameter or,
    if it depends on time, an input.
    """

    q: Sequence[Any]
    u: Sequence[Any]
    kinematics: Sequence[Any]
    mass: Any
    forcing: Any
    config: Sequence[Any] = ()
    velocity: Sequence[Any] = ()
    multipliers: Sequence[Any] = ()
    reactions: Mapping[str, Any] = field(default_factory=dict)


class System(Struct, frozen=True):
    """A system that is written as a model: where it is from, how it is judged, and the largest relative difference allowed."""

    name: str
    source: str
    compared: str
    text: str
    judge: Callable[[], Judge] | None = None
    names: Mapping[str, str] = field(default_factory=dict)
    """Names in the model of SymPy's coordinates, parameters and inputs, where they differ; '-x' turns the sign."""
    values: Mapping[str, float] = field(default_factory=dict)
    """Of parameters (by SymPy's names) that may not be drawn between 0.5 and 1.5, and of coordinates and speeds between -1 and 1."""
    compare: Callable[[System], float] | None = None
    tolerance: float = 1e-12
    stored: bool = False
    """Whether the numbers of SymPy are kept, because it takes seconds to find them."""
    slow: bool = False
    """Whether mechc takes seconds to compile it."""
    remark: str = ""


class Waiting(Struct, frozen=True):
    """A system that is not compared: what it waits for, or why there is no motion to compare."""

    name: str
    source: str
    reason: str


class Draw(Struct, frozen=True):
    """A state with its parameters and inputs, and what SymPy finds there; coordinates by the names of the model."""

    q: dict[str, float]
    rates: dict[str, float]
    parameters: dict[str, float]
    accelerations: dict[str, float]
    reactions: dict[str, float]


STORED = Path(__file__).with_name("stored.json")
"""The draws of systems that SymPy takes long to form, which ``python -m foreign.page --store`` makes again."""


def drawn(system: System) -> list[Draw]:
    """Form the system with SymPy, and draw states with its answers."""
    assert system.judge is not None
    judge = Evaluated(system.judge(), system.values)
    rng, draws = np.random.default_rng(41), []
    for _ in range(STATES):
        p = judge.parameters(rng)
        q, u = judge.state(rng, p)
        rates, accelerations, reactions = judge.motion(q, u, p)
        of_model = [named(system, judge.q, values) for values in (q, rates, accelerations)]
        draws.append(Draw(of_model[0], of_model[1], p, of_model[2], reactions))
    return draws


def stored() -> dict[str, list[Draw]]:
    return msgspec.json.decode(STORED.read_bytes(), type=dict[str, list[Draw]])


def differences(system: System) -> float:
    """The largest difference of accelerations and reactions from SymPy's at random states, as a share of the largest one."""
    if system.compare is not None:
        return system.compare(system)
    draws = stored()[system.name] if system.stored else drawn(system)
    model, worst = mechc.loads(system.text), 0.0
    for draw in draws:
        expected = {**draw.accelerations, **draw.reactions}
        found = Side(model, system, draw.parameters).answers(draw.q, draw.rates, list(draw.reactions))
        scale = max(1.0, *map(abs, expected.values()))
        worst = max(worst, *(abs(found[k] - v) / scale for k, v in expected.items()))
    return worst


def named(system: System, symbols: Sequence[Any], values: Sequence[float]) -> dict[str, float]:
    """Values of SymPy's coordinates by the names that the model has for them."""
    found = {}
    for symbol, value in zip(symbols, values, strict=True):
        name = system.names.get(plain(symbol), plain(symbol))
        found[name.removeprefix("-")] = -value if name.startswith("-") else value
    return found


def plain(symbol: Any) -> str:
    """The name of a symbol or of a function of time."""
    return str(symbol.func) if isinstance(symbol, sympy.core.function.AppliedUndef) else str(symbol)


class Side:
    """The side of mechc: the functions of a model with the parameters and inputs of one draw."""

    def __init__(self, model: Model, system: System, p: Mapping[str, float]) -> None:
        given = {system.names.get(k, k): v for k, v in p.items()}
        inputs = {e.name: e for e in model.inputs}
        self.functions: Any = model.with_values({k: v for k, v in given.items() if k not in inputs}).functions
        self.states = [e.name for e in model.problem().states]
        self.u = np.array([given.get(name, 0.0) for name, _ in self.functions.inputs])

    def answers(
        self, q: Mapping[str, float], rates: Mapping[str, float], outputs: Sequence[str]
    ) -> dict[str, float]:
        """Accelerations by coordinate, and outputs. What the model has beyond ``q`` follows from its constraints."""
        f, y = self.functions, self.functions.start.copy()
        speeds = [k for k, s in enumerate(self.states) if s.startswith("der(")]
        held = [self.states.index(s) for s in q]
        assert len(held) == len(q)
        y[held] = list(q.values())
        y[[self.states.index(f"der({s})") for s in rates]] = list(rates.values())
        free = [n for n, k in enumerate(speeds) if self.states[k][4:-1] not in q]
        if free:
            self._follow(y, speeds, free)
        a = f.accelerations(y, 0.0, self.u)
        found = {self.states[k][4:-1]: float(a[n]) for n, k in enumerate(speeds)}
        return found | {name: float(f.output[name](y, 0.0, self.u)) for name in outputs}

    def _follow(self, y: Any, speeds: Sequence[int], free: Sequence[int]) -> None:
        """Move the coordinates and speeds that only the model has until its constraints hold."""
        f = self.functions
        coordinates = [self.states.index(self.states[speeds[n]][4:-1]) for n in free]
        for _ in range(20):
            jacobian = f.constraint_jacobian(y, 0.0, self.u)
            rows = len(jacobian)
            left = f.constraints(y, 0.0, self.u)
            positions = len(left) - rows
            if positions:
                y[coordinates] -= np.linalg.pinv(jacobian[:positions, free]) @ left[:positions]
            jacobian = f.constraint_jacobian(y, 0.0, self.u)
            left = f.constraints(y, 0.0, self.u)[positions:]
            y[np.take(speeds, free)] -= np.linalg.pinv(jacobian[:, free]) @ left
        assert np.abs(f.constraints(y, 0.0, self.u)).max() < 1e-13


class Evaluated:
    """A judge in numbers."""

    def __init__(self, judge: Judge, values: Mapping[str, float]) -> None:
        self.judge, self.values = judge, values
        self.q, q, u = list(judge.q), list(judge.q), list(judge.u)
        t = sympy.physics.mechanics.dynamicsymbols._t
        self.rates = [sympy.Symbol(f"rate_{k}") for k in range(len(u))]
        kinematics = sympy.Matrix(list(judge.kinematics))
        by_rate = dict(zip([s.diff(t) for s in u], self.rates, strict=True))
        to_speeds = dict(zip([s.diff(t) for s in q], kinematics, strict=True))
        reactions = [e.xreplace(by_rate).subs(to_speeds) for e in judge.reactions.values()]
        config, velocity = sympy.Matrix(list(judge.config)), sympy.Matrix(list(judge.velocity))
        formulas = {
            "rates": kinematics,
            "mass": sympy.Matrix(judge.mass),
            "forcing": sympy.Matrix(judge.forcing),
            "rates by q": kinematics.jacobian(q),
            "rates by u": kinematics.jacobian(u),
            "config": config,
            "config by q": config.jacobian(q) if judge.config else config,
            "velocity": velocity,
            "velocity by u": velocity.jacobian(u) if judge.velocity else velocity,
            "reactions": sympy.Matrix(reactions),
        }
        forms = {name: e.subs(to_speeds) for name, e in formulas.items()}
        lam, known = list(judge.multipliers), {*q, *u, *judge.multipliers, *self.rates, t}
        loose: set[Any] = set().union(
            *(e.free_symbols | e.atoms(sympy.core.function.AppliedUndef) for e in forms.values())
        )
        self.symbols = sorted(loose - known, key=str)
        given = [q, u, self.rates, lam, self.symbols]
        self._functions = {name: sympy.lambdify(given, e, cse=True) for name, e in forms.items()}

    def _of(
        self,
        form: str,
        q: Any,
        u: Any,
        p: Mapping[str, float],
        a: Sequence[float] = (),
        lam: Sequence[float] = (),
    ) -> Any:
        """One of the forms in numbers; without accelerations and multipliers, those that need none."""
        rates, multipliers = a or [0.0] * len(self.rates), lam or [0.0] * len(self.judge.multipliers)
        return np.asarray(self._functions[form](q, u, rates, multipliers, list(p.values())), float)

    def parameters(self, rng: np.random.Generator) -> dict[str, float]:
        """One draw of all parameters and inputs."""
        return {plain(s): self.values.get(plain(s), rng.uniform(0.5, 1.5)) for s in self.symbols}

    def state(self, rng: np.random.Generator, p: Mapping[str, float]) -> tuple[list[float], list[float]]:
        """One draw of coordinates and speeds, which satisfies the constraints."""
        q = np.array([self.values.get(plain(s), rng.uniform(-1, 1)) for s in self.q])
        u = np.array([self.values.get(plain(s), rng.uniform(-1, 1)) for s in self.judge.u])
        for _ in range(20 if self.judge.config else 0):
            q -= (np.linalg.pinv(self._of("config by q", q, u, p)) @ self._of("config", q, u, p)).ravel()
        if self.judge.velocity:
            for _ in range(2):
                u -= (
                    np.linalg.pinv(self._of("velocity by u", q, u, p)) @ self._of("velocity", q, u, p)
                ).ravel()
        return [float(x) for x in q], [float(x) for x in u]

    def motion(
        self, q: list[float], u: list[float], p: Mapping[str, float]
    ) -> tuple[list[float], list[float], dict[str, float]]:
        """Rates and accelerations of the coordinates, and the reactions."""
        rates = self._of("rates", q, u, p).ravel()
        solved = np.linalg.solve(self._of("mass", q, u, p), self._of("forcing", q, u, p)).ravel()
        a, lam = list(solved[: len(u)]), list(solved[len(u) :])
        accelerations = self._of("rates by q", q, u, p) @ rates + self._of("rates by u", q, u, p) @ a
        reactions = self._of("reactions", q, u, p, a, lam).ravel() if self.judge.reactions else []
        return (
            [*map(float, rates)],
            [*map(float, accelerations)],
            dict(zip(self.judge.reactions, map(float, reactions), strict=True)),
        )
