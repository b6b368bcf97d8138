"""The functions of a model with its values: of one state in less than a microsecond, of arrays of states in one call into C.

>>> f = model_functions(problem)
>>> f.mass_matrix(y), f.inverse_dynamics(y, a), f.jacobian["tip"](y, t)
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
from msgspec import Struct

from mechc.suggest import suggest

from ..case import SimulationOptions
from ..delays import refuse_delays
from ..functions import Functions
from ..interface import OfferedFunction
from ..native import calls
from ..outcome import SimulationError
from ..problem import Array, Problem
from ..settings import Place
from .operating_point import Site, plan_of, site_of

SEED = "seed"
"""Kind of the numbers after the discrete variables that hold given accelerations."""

Callables = Mapping[str, Callable[..., Any]]


class ModelFunctions:
    """Functions of states y, in SI and in the order of ``states``, with the parameters that the model has.

    Each is called as ``f(y)``, ``f(y, t)`` or ``f(y, t, u)``; ``inverse_dynamics`` as ``f(y, a)`` and so on. y has the shape
    [ny] or [n, ny]; then a and u have one row for each state (u also one for all), and the result has n in front. Without t
    the time is that at which runs begin; without u the inputs have their defaults. ``offers`` says what there is, with the
    names and units of rows and columns. Relations are evaluated at the state; what is closed, sticks or was sampled is as at
    the start of a run.
    """

    accelerations: Callable[..., Any]
    mass_matrix: Callable[..., Any]
    bias: Callable[..., Any]
    inverse_dynamics: Callable[..., Any]
    constraints: Callable[..., Any]
    constraint_jacobian: Callable[..., Any]
    constraint_bias: Callable[..., Any]
    energy: Callable[..., Any]
    kinetic_energy: Callable[..., Any]
    potential_energy: Callable[..., Any]
    rates: Callable[..., Any]

    def __init__(self, problem: Problem, site: Site) -> None:
        self.offers = {o.name: o for o in problem.offers if o.kind == "own"}
        self.states = tuple((q.name, q.unit) for q in problem.states)
        self.inputs = tuple((q.name, q.unit) for q in problem.inputs)
        self.start = site.y
        self._problem = problem
        self._bound = _Bound(problem, site)
        for offer in (o for o in self.offers.values() if not o.later):
            setattr(self, offer.name, self._bound.call([offer]))
        self.output: Callables = self._named("output")
        self.jacobian: Callables = self._named("jacobian")

    def _named(self, kind: str) -> Callables:
        found = {o.name: self._bound.call([o]) for o in self._problem.offers if o.kind == kind}
        return _Named(found, f"'{self._problem.name}' has no output")

    def of_library(self, path: Path, shapes: Mapping[str, tuple[int, ...]]) -> dict[str, Callable[..., Any]]:
        """Return functions of the same states in another library, by their names, with the shapes of their results."""
        bound = _Bound(self._problem, self._bound.site, ctypes.CDLL(str(path)))
        offers = (OfferedFunction(name, name, name, shape, (), (), False) for name, shape in shapes.items())
        return {offer.name: bound.call([offer]) for offer in offers}

    def offer(self, name: str, kind: str = "own") -> OfferedFunction:
        """Say what a function gives; ``kind``: own, output or jacobian (of an output)."""
        return next(o for o in self._problem.offers if (o.name, o.kind) == (name, kind))

    def in_threads(self, function: Callable[..., Any], threads: int, y: Array, *rest: Any) -> Array:
        """Evaluate one of these functions for many states [n, ny] in several threads side by side."""
        places = [part for part in np.array_split(np.arange(len(y)), threads) if part.size]
        time = 1 if rest and np.ndim(rest[0]) == 2 else 0  # after accelerations, which each state has
        each = [np.ndim(x) == 2 or (np.ndim(x) == 1 and k == time) for k, x in enumerate(rest)]

        def part(of: Array) -> Any:
            rows = slice(int(of[0]), int(of[-1]) + 1)
            given = (x[rows] if own else x for x, own in zip(rest, each, strict=True))
            return function(y[rows], *given)

        with ThreadPoolExecutor(max(threads, 1)) as pool:
            return np.concatenate(list(pool.map(part, places)))

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_"):
            raise AttributeError(name)
        if name.startswith("constraint"):
            raise AttributeError(f"'{self._problem.name}' has no constraints between its coordinates")
        raise AttributeError(f"a model has no function '{name}'" + suggest(name, list(self.offers)))

    def __repr__(self) -> str:
        lines = [f"functions of {self._problem.name}: y[{len(self.states)}], t, u[{len(self.inputs)}]"]
        for o in self._problem.offers:
            name = o.name if o.kind == "own" else f'{o.kind}["{o.name}"]'
            units = list(dict.fromkeys(unit or "1" for _, unit in o.rows))
            per = list(dict.fromkeys(unit or "1" for _, unit in o.columns))
            shape = "x".join(map(str, o.shape)) or "number"
            unit = ", ".join(units) + (f" per {', '.join(per)}" if per else "")
            lines.append(f"  {name:28} {shape:8} {unit:32} {o.doc}")
        return "\n".join(lines)


class _Named(dict[str, Callable[..., Any]]):
    """Functions by the names of outputs, with words for a name that is none."""

    def __init__(self, found: Mapping[str, Callable[..., Any]], words: str) -> None:
        super().__init__(found)
        self._words = words

    def __missing__(self, name: str) -> Callable[..., Any]:
        raise KeyError(f"{self._words} '{name}'" + suggest(name, list(self)))


def model_functions(problem: Problem, options: SimulationOptions) -> ModelFunctions:
    """Return the functions that a problem offers, with values and start of ``options``. Raises SimulationError."""
    if not problem.offers:
        raise ValueError(f"problem '{problem.name}' was made without the part 'functions'")
    refuse_delays(problem, "functions of a state are given no past")
    if options.inputs:
        raise SimulationError(
            "functions of a model take their inputs as numbers, not from tables", help="give u: f(y, t, u)"
        )
    return ModelFunctions(problem, site_of(problem, options, Place()))


class _Bound(Struct, frozen=True):
    """A problem at its start, whose functions are given states."""

    problem: Problem
    site: Site
    library: ctypes.CDLL | None = None
    """Of the functions, where it is not that of the model."""

    def address(self, name: str) -> int | None:
        """Give where a function is."""
        if self.library is not None:
            return ctypes.cast(getattr(self.library, name), ctypes.c_void_p).value
        return _address(self.site.case.functions, name)

    def call(self, offers: list[OfferedFunction]) -> Callable[..., Any]:
        """Return a function of states; of several, the rows below each other."""
        record, kept = self.record(offers)
        slow = _Slow(self, offers, record)
        return calls.built_in(record, "mech_call_bound", offers[0].name, offers[0].doc, slow, *kept)

    def record(self, offers: list[OfferedFunction]) -> tuple[calls.CallRecord, tuple[object, ...]]:
        """Fill in what calls.c reads, with what must live as long."""
        problem, site = self.problem, self.site
        functions = site.case.functions
        z, p = np.ascontiguousarray(self.z), np.ascontiguousarray(site.p)
        shape = _shape(offers)
        record = calls.CallRecord()
        begin = 0
        for k, offer in enumerate(offers):
            record.parts[k] = self.address(offer.function)
            record.begins[k] = begin
            begin += int(np.prod(offer.shape))
        record.n_out, record.ny, record.nu, record.nz = begin, problem.ny, len(problem.inputs), z.size
        record.na = problem.nv if offers[0].given else 0
        record.dimensions = len(shape)
        record.shape[: len(shape)] = shape
        record.z, record.p, record.begin = z.ctypes.data, p.ctypes.data, site.t
        if problem.inputs:
            record.inputs = _address(functions, "inputs")
        plan = plan_of(site)
        if plan is not None and plan.n_switches:
            record.indicators, record.n_switches = plan.indicators, plan.n_switches
            record.switches = ctypes.cast(plan.switches, ctypes.c_void_p).value
            record.n_indicators = plan.n_switches + plan.n_rows
        return record, (z, p, functions.library, self.library, plan, site)

    @property
    def z(self) -> Array:
        """The discrete variables, without given accelerations."""
        own = sum(q.kind != SEED for q in self.problem.discretes)
        return self.site.z[:own]


class _Slow:
    """A function of states for whatever is given: lists, other kinds of numbers, arrays of times."""

    def __init__(self, bound: _Bound, offers: list[OfferedFunction], record: calls.CallRecord) -> None:
        self.bound, self.offers, self.record = bound, offers, record

    def __call__(self, y: Any, *rest: Any) -> Any:
        problem, offer = self.bound.problem, self.offers[0]
        y = np.asarray(y, dtype=np.float64, order="C")
        if y.ndim not in (1, 2) or y.shape[-1] != problem.ny:
            raise ValueError(
                f"y has the shape {y.shape}, not ({problem.ny},) or (n, {problem.ny}): the states of '{problem.name}', "
                f"which begin with {', '.join(q.name for q in problem.states[:3])}; all stand in '.states'"
            )
        n = len(y) if y.ndim == 2 else 1
        names = ("a", "t", "u") if offer.given else ("t", "u")
        if len(rest) > len(names) or (offer.given and not rest):
            wanted = "y, a[, t[, u]]" if offer.given else "y[, t[, u]]"
            raise TypeError(f"'{offer.name}' takes ({wanted}), {1 + len(rest)} arguments were given")
        widths = {"a": problem.nv, "t": 0, "u": len(problem.inputs)}
        given: dict[str, Array] = {}
        ways = {"a": 0, "t": 0, "u": 0}
        for name, value in zip(names, rest, strict=False):
            block = np.asarray(value, dtype=np.float64, order="C")
            own = (widths[name],) if name != "t" else ()
            each = y.ndim == 2 and block.shape == (n, *own)
            if not each and not (block.shape == own and (name != "a" or y.ndim == 1)):
                shapes = f"{own} or {(n, *own)}" if y.ndim == 2 else f"{own}"
                raise ValueError(f"{name} has the shape {block.shape}, not {shapes}")
            given[name], ways[name] = np.atleast_1d(block), (widths[name] or 1) if each else 0
        shape = _shape(self.offers)
        out = np.empty((n, int(np.prod(shape))))
        blocks = [(y, problem.ny), *((given.get(name), ways[name]) for name in ("a", "t", "u"))]
        calls.rows_of(self.record, n, blocks, out)
        found = out.reshape((*((n,) if y.ndim == 2 else ()), *shape))
        return found if found.ndim else float(found)


def _shape(offers: list[OfferedFunction]) -> tuple[int, ...]:
    """Return the shape of functions below each other."""
    if len(offers) == 1:
        return offers[0].shape
    width = offers[0].shape[-1]
    return (sum(int(np.prod(o.shape[:-1])) for o in offers), width)


def _address(functions: Functions, name: str) -> int | None:
    """Return where a function is: in the struct of the model, or exported."""
    found: int | None = getattr(functions.struct, name, None)
    if found is None:
        found = ctypes.cast(getattr(functions.library, name), ctypes.c_void_p).value
    return found
