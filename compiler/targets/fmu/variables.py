"""The table of variables from which the C description and both model descriptions are written."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass, replace

from mechc.lang.units import parse_unit
from mechc.runtime.case import Case
from mechc.runtime.problem import Array, Problem

from ...equations.model import Entry, Equations, Slot
from ...equations.sensitivities import SEED, dependencies

_NAME = r"[A-Za-z_][A-Za-z0-9_]*(?:\[\d+(?:,\d+)*\])?"
_STRUCTURED = re.compile(rf"(?:{_NAME}(?:\.{_NAME})*|der\({_NAME}(?:\.{_NAME})*(?:,\d+)?\))")
_RATE = re.compile(r"der\((?P<of>.*?)(?:,(?P<order>\d+))?\)")


@dataclass(frozen=True, slots=True)
class Variable:
    """One scalar. ``index``: its position in the list, from 1; ``reference``: the value reference.

    ``derivative``: the index of the state of which this is the derivative, else 0. ``depends``: positions
    of the knowns of a derivative or an output; None where this is no unknown. ``initially``: the same for
    the initial value; None also where it depends on everything.
    """

    index: int
    reference: int
    name: str
    causality: str
    variability: str
    initial: str
    entry: Entry
    start: float | None = None
    nominal: float | None = None
    derivative: int = 0
    depends: frozenset[int] | None = None
    initially: frozenset[int] | None = None
    reinit: bool = False
    """A state that events or projections change."""


@dataclass(frozen=True, slots=True)
class Table:
    """All variables in the order of the model description; derivatives in the order of the states."""

    variables: tuple[Variable, ...]
    derivatives: tuple[int, ...]
    outputs: tuple[int, ...]
    initial_unknowns: tuple[int, ...]
    settable_parameters: tuple[int, ...]
    indicators: tuple[int, ...]
    """Positions of the event indicators in the list."""
    zero_crossings: tuple[int, ...]
    """For each of them, its place among the outputs of the function ``indicators``."""
    inputs_move: bool
    """An input that nobody sets depends on time."""
    free_initial: bool
    """Whether no initial value depends on other quantities."""

    def at(self, index: int) -> Variable:
        return self.variables[index - 1]


@dataclass(frozen=True, slots=True)
class Start:
    """What the exported experiment begins with: the case, inputs at its start, sizes of the states."""

    problem: Problem
    case: Case
    inputs: Array
    nominal: Array
    given_parameters: frozenset[int]
    given_states: frozenset[int]
    given_inputs: frozenset[int]


def settable_parameters(equations: Equations, given: Iterable[int]) -> tuple[int, ...]:
    """Return the parameters that do not follow from others, those that the experiment sets among them."""
    rules = {r.index: r.value for r in equations.parameter_rules}
    fixed = set(given)
    return tuple(
        i
        for i in range(len(equations.parameters))
        if i in fixed or i not in rules or not equations.graph.support(rules[i])
    )


def variable_table(equations: Equations, start: Start) -> Table:
    """Return the table; value references as in the C code: time, y, dy/dt, u, p, outputs, discrete variables,
    event indicators."""
    ny, nu, n_p = len(equations.states), len(equations.inputs), len(equations.parameters)
    discretes = shown_discretes(equations)
    base = {"t": 0, "y": 1, "dy": 1 + ny, "u": 1 + 2 * ny, "p": 1 + 2 * ny + nu, "out": 1 + 2 * ny + nu + n_p}
    base["z"] = base["out"] + len(equations.outputs)
    base["w"] = base["z"] + len(discretes)
    jumps = bool(equations.hybrid or equations.rotations or equations.constraints)
    functions = {f.name: f for f in equations.functions}
    settable = settable_parameters(equations, start.given_parameters)
    symbols = {slot: n for n, slot in equations.layout.items()}
    names = _Names()
    rows: list[Variable] = []
    place: dict[Slot, int] = {}

    def add(
        slot: Slot,
        entry: Entry,
        name: str,
        *,
        causality: str,
        initial: str,
        variability: str = "continuous",
        start: float | None = None,
        nominal: float | None = None,
        derivative: int = 0,
        reinit: bool = False,
    ) -> int:
        place[slot] = index = len(rows) + 1
        reference = base[slot.array] + slot.index
        rows.append(
            Variable(
                index,
                reference,
                name,
                causality,
                variability,
                initial,
                entry,
                start,
                nominal,
                derivative,
                reinit=reinit,
            )
        )
        return index

    constrained = bool(equations.constraints or equations.assembly)
    rates, initial = functions["rhs"].outputs, functions["initial"].outputs
    free = [
        not constrained and (i in start.given_states or not equations.graph.support(n))
        for i, n in enumerate(initial)
    ]
    add(
        Slot("t", 0),
        equations.time,
        names.new("time"),
        causality="independent",
        initial="",
    )
    shown = {e.name for e in equations.states}
    reported = {e.name for e in equations.outputs}
    for i, entry in enumerate(equations.states):
        add(
            Slot("y", i),
            entry,
            names.new(entry.name),
            causality="output" if entry.name in reported else "local",
            initial="exact" if free[i] else "approx",
            start=float(start.case.y0[i]),
            nominal=float(start.nominal[i]),
            reinit=jumps,
        )
    derivatives: list[int] = []
    for i, entry in enumerate(equations.states):
        same = [j for j in range(ny) if symbols.get(Slot("y", j)) == rates[i] and j != i]
        named = [j for j in same if equations.states[j].name == f"der({entry.name})"]
        if named:
            k = place[Slot("y", named[0])]
            rows[k - 1] = replace(rows[k - 1], derivative=i + 2)
        else:
            unit = (
                f"{entry.unit}/s"
                if equations.time.unit and entry.unit
                else "1/s"
                if equations.time.unit
                else ""
            )
            rate = Entry(
                names.rate(entry.name), "rate", _rate_unit(unit), doc=f"time derivative of {entry.name}"
            )
            k = add(
                Slot("dy", i),
                rate,
                rate.name,
                causality="local",
                initial="calculated",
                derivative=i + 2,
            )
        derivatives.append(k)
    for i, entry in enumerate(equations.inputs):
        add(
            Slot("u", i),
            entry,
            names.new(entry.name),
            causality="input",
            initial="",
            start=float(start.inputs[i]),
        )
    for i, entry in enumerate(equations.parameters):
        own = i in settable
        add(
            Slot("p", i),
            entry,
            names.new(entry.name),
            causality="parameter" if own else "calculatedParameter",
            variability="tunable",
            initial="exact" if own else "calculated",
            start=float(start.case.p[i]) if own else None,
        )
    for i, entry in enumerate(equations.outputs):
        if entry.name not in shown:
            add(
                Slot("out", i),
                entry,
                names.new(entry.name),
                causality="output",
                initial="calculated",
            )
    for i, entry in enumerate(discretes):
        add(
            Slot("z", i),
            entry,
            names.new(entry.name),
            causality="output",
            variability="discrete",
            initial="calculated",
        )
    crossings = moving_indicators(equations)
    for i in range(len(crossings)):
        name = names.new(f"event_indicator[{i + 1}]")
        entry = Entry(name, "indicator", "", doc="an event is where it falls below zero")
        add(Slot("w", i), entry, name, causality="local", initial="calculated")
    table = _finish(equations, rows, place, tuple(derivatives), settable, free, constrained, start)
    indicators = tuple(place[Slot("w", i)] for i in range(len(crossings)))
    return replace(table, indicators=indicators, zero_crossings=crossings)


def shown_discretes(equations: Equations) -> tuple[Entry, ...]:
    """Return the discrete variables of the user, which stand first in z."""
    return tuple(e for e in equations.discretes if e.kind == "discrete")


def moving_indicators(equations: Equations) -> tuple[int, ...]:
    """Return the places of the event indicators that are not constant."""
    found = [f.outputs for f in equations.functions if f.name == "indicators"]
    return tuple(
        k for outputs in found for k, node in enumerate(outputs) if not equations.graph.is_constant(node)
    )


def _finish(
    equations: Equations,
    rows: list[Variable],
    place: dict[Slot, int],
    derivatives: tuple[int, ...],
    settable: tuple[int, ...],
    free: list[bool],
    constrained: bool,
    start: Start,
) -> Table:
    """Add what each unknown depends on."""
    functions = {f.name: f for f in equations.functions}
    seeds = {Slot("z", i) for i, e in enumerate(equations.discretes) if e.kind == SEED}
    at_start = dependencies(equations, settable, functions["initial"].outputs)

    def known(slots: frozenset[Slot]) -> frozenset[int]:
        return frozenset(place[s] for s in slots - seeds if s.array != "z")

    def initially(slots: frozenset[Slot]) -> frozenset[int] | None:
        if constrained:
            return None
        found: set[Slot] = set()
        for s in slots:
            found |= at_start[s.index] if s.array == "y" and not free[s.index] else {s}
        return known(frozenset(found))

    by_index: dict[int, frozenset[Slot]] = {}
    for k, slots in zip(
        derivatives, dependencies(equations, settable, functions["rhs"].outputs), strict=True
    ):
        by_index[k] = slots
    for i, slots in enumerate(dependencies(equations, settable, functions["outputs"].outputs)):
        if Slot("out", i) in place:
            by_index[place[Slot("out", i)]] = slots
    rules = {r.index: r.value for r in equations.parameter_rules}
    for i in range(len(equations.parameters)):
        if i not in settable:
            (by_index[place[Slot("p", i)]],) = dependencies(equations, settable, [rules[i]])
    start_of = dict(by_index)
    for i in range(len(equations.states)):
        k = place[Slot("y", i)]
        start_of[k] = frozenset({Slot("y", i)})
        if rows[k - 1].causality == "output" and k not in by_index:
            by_index[k] = start_of[k]
    variables = tuple(
        replace(
            v,
            depends=known(by_index[v.index]) if v.index in by_index else None,
            initially=initially(start_of[v.index]) if v.index in start_of else None,
        )
        for v in rows
    )
    outputs = tuple(v.index for v in variables if v.causality == "output")
    states = [place[Slot("y", i)] for i in range(len(equations.states))]
    wanted = {*outputs, *derivatives, *states}
    unknowns = tuple(
        v.index
        for v in variables
        if v.causality == "calculatedParameter"
        or (v.index in wanted and v.initial in ("calculated", "approx"))
    )
    return Table(
        variables, derivatives, outputs, unknowns, settable, (), (), _inputs_move(equations, start), all(free)
    )


def _inputs_move(equations: Equations, start: Start) -> bool:
    time = {n for n, slot in equations.layout.items() if slot.array == "t"}
    defaults = [n for f in equations.functions if f.name == "inputs" for n in f.outputs]
    return any(
        i not in start.given_inputs and bool(time & set(equations.graph.support(n)))
        for i, n in enumerate(defaults)
    )


def _rate_unit(unit: str) -> str:
    """Write ``1/s/s`` as ``1/s^2``, and the like."""
    if not unit:
        return ""
    parsed = parse_unit(unit)
    text = str(parsed.dimension)
    return unit if parsed.angle else text


class _Names:
    """Names that fit the structured convention, each given once."""

    def __init__(self) -> None:
        self.used: set[str] = set()

    def new(self, name: str) -> str:
        if not _STRUCTURED.fullmatch(name):
            escaped = name.replace("\\", "\\\\").replace("'", "\\'")
            name = f"'{escaped}'"
        while name in self.used:
            name = f"'{name.strip(chr(39))} '"
        self.used.add(name)
        return name

    def rate(self, of: str) -> str:
        """Name the derivative of a state: of ``der(a)`` it is ``der(a,2)``."""
        found = _RATE.fullmatch(of)
        if found:
            order = int(found["order"] or 1) + 1
            return self.new(f"der({found['of']},{order})")
        return self.new(f"der({of})")
