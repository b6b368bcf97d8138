"""The table of all variables of an FMU: what is listed, in which order, and what depends on what."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence

from msgspec import Struct, field
from msgspec.structs import replace

from mechc.lang.units import parse_unit
from mechc.runtime.interface import Quantity, derived_among

from ...equations.model import Equations, Slot
from ...equations.sensitivities import SEED, dependencies
from ...graph import Node
from .variables import FmuVariable, Start, VariableTable


def variable_table(equations: Equations, start: Start) -> VariableTable:
    """Return the table: time, states, their rates, inputs, parameters, outputs, discrete variables, event indicators."""
    settable = settable_parameters(equations, start.given_parameters)
    crossings = moving_indicators(equations)
    constrained = bool(equations.constraints or equations.assembly)
    following = set(equations.dependent)  # other initial values, which an importer may set
    free = [
        not constrained and (i in start.given_states or not (i in following or equations.graph.support(n)))
        for i, n in enumerate(_outputs_of(equations, "initial"))
    ]
    listing = Listing(equations, start)
    listing.add(Slot("t", 0), equations.time, causality="independent", initial="")
    _list_states(listing, free)
    derivatives = _list_rates(listing)
    _list_inputs(listing)
    _list_parameters(listing, settable)
    _list_outputs(listing)
    indicators = _list_indicators(listing, len(crossings))
    table = _with_dependencies(listing, derivatives, settable, free, constrained or bool(following))
    return replace(table, indicators=indicators, zero_crossings=crossings)


def settable_parameters(equations: Equations, given: Iterable[int]) -> tuple[int, ...]:
    """Return the parameters that do not follow from others, those that the experiment sets among them."""
    rules = {r.index: r.value for r in equations.parameter_rules}
    fixed = set(given)
    return tuple(
        i
        for i in range(len(equations.parameters))
        if i not in equations.found
        and (i in fixed or i not in rules or not equations.graph.support(rules[i]))
    )


def shown_discretes(equations: Equations) -> tuple[Quantity, ...]:
    """Return the discrete variables of the user, which stand first in z."""
    return tuple(e for e in equations.discretes if e.kind == "discrete")


def moving_indicators(equations: Equations) -> tuple[int, ...]:
    """Return the places of the event indicators that are not constant."""
    found = [f.outputs for f in equations.functions if f.name == "indicators"]
    return tuple(
        k for outputs in found for k, node in enumerate(outputs) if not equations.graph.is_constant(node)
    )


def _outputs_of(equations: Equations, function: str) -> tuple[Node, ...]:
    return next(f.outputs for f in equations.functions if f.name == function)


# ---------------------------------------------------------------- what is listed


_NAME = r"[A-Za-z_][A-Za-z0-9_]*(?:\[\d+(?:,\d+)*\])?"
_STRUCTURED = re.compile(rf"(?:{_NAME}(?:\.{_NAME})*|der\({_NAME}(?:\.{_NAME})*(?:,\d+)?\))")
_RATE = re.compile(r"der\((?P<of>.*?)(?:,(?P<order>\d+))?\)")


class Names:
    """Gives each name once, in the structured convention of FMI."""

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


class Listing(Struct):
    """The variables as they come; ``place``: the position of each slot in the list, from 1.

    ``first``: the value reference of the first number of each array, as in the C code: array after array.
    """

    equations: Equations
    start: Start
    names: Names = field(default_factory=Names)
    rows: list[FmuVariable] = field(default_factory=list)
    place: dict[Slot, int] = field(default_factory=dict)
    first: dict[str, int] = field(default_factory=dict)

    def __post_init__(self) -> None:
        equations, first = self.equations, 0
        ny = len(equations.states)
        sizes = {
            "t": 1,
            "y": ny,
            "dy": ny,
            "u": len(equations.inputs),
            "p": len(equations.parameters),
            "out": len(equations.outputs),
            "z": len(shown_discretes(equations)),
            "w": 0,
        }
        for array, size in sizes.items():
            self.first[array] = first
            first += size

    def add(
        self,
        slot: Slot,
        entry: Quantity,
        *,
        name: str = "",
        causality: str,
        initial: str,
        variability: str = "continuous",
        start: float | None = None,
        nominal: float | None = None,
        derivative: int = 0,
        reinit: bool = False,
    ) -> int:
        """Add a variable under a ``name`` that is already given, or that of its entry; return its position."""
        self.place[slot] = index = len(self.rows) + 1
        if entry.type != "real" and variability == "continuous":
            variability = "discrete"
        variable = FmuVariable(
            index,
            self.first[slot.array] + slot.index,
            name or self.names.new(entry.name),
            causality,
            variability,
            initial,
            entry,
            start,
            nominal,
            derivative,
            reinit=reinit,
        )
        self.rows.append(variable)
        return index


def _list_states(listing: Listing, free: Sequence[bool]) -> None:
    equations, start = listing.equations, listing.start
    jumps = bool(equations.switching or equations.rotations or equations.constraints)
    reported = {e.name for e in equations.outputs}
    for i, entry in enumerate(equations.states):
        listing.add(
            Slot("y", i),
            entry,
            causality="output" if entry.name in reported else "local",
            initial="exact" if free[i] else "approx",
            start=float(start.case.y0[i]),
            nominal=float(start.nominal[i]),
            reinit=jumps,
        )


def _list_rates(listing: Listing) -> tuple[int, ...]:
    """List the rates that are not states themselves; return the positions of all, in the order of the states."""
    equations = listing.equations
    symbols = {slot: n for n, slot in equations.layout.items()}
    rates = _outputs_of(equations, "rhs")
    index = {entry.name: i for i, entry in enumerate(equations.states)}
    per_time = "/s" if equations.time.unit else ""
    derivatives: list[int] = []
    for i, entry in enumerate(equations.states):
        state = index.get(f"der({entry.name})")
        if state is not None and symbols.get(Slot("y", state)) == rates[i]:
            k = listing.place[Slot("y", state)]
            listing.rows[k - 1] = replace(listing.rows[k - 1], derivative=i + 2)
        else:
            unit = f"{entry.unit or '1'}{per_time}" if per_time else ""
            name = listing.names.rate(entry.name)
            rate = Quantity(name, "rate", _rate_unit(unit), doc=f"time derivative of {entry.name}")
            k = listing.add(
                Slot("dy", i), rate, name=name, causality="local", initial="calculated", derivative=i + 2
            )
        derivatives.append(k)
    return tuple(derivatives)


BETWEEN_ROWS = "between rows of a table: "
"""Before the interpolation that the model states for an input, in its description."""


def _list_inputs(listing: Listing) -> None:
    """List the inputs, and those that drive together with their derivatives."""
    inputs = listing.equations.inputs
    driving = derived_among([e.name for e in inputs])
    orders = {k: (i, order) for i, both in driving.items() for order, k in enumerate(both, 1)}
    for i, entry in enumerate(inputs):
        value = float(listing.start.inputs[i])
        if i in listing.equations.held_inputs:  # its rate is taken to be zero
            listing.add(
                Slot("u", i), entry, causality="parameter", variability="fixed", initial="exact", start=value
            )
            continue
        name = ""
        if i in orders:
            of, order = orders[i]
            name = listing.names.new(f"der({inputs[of].name})" if order == 1 else f"der({inputs[of].name},2)")
            words = f"derivative {order} of the input '{inputs[of].name}', which drives a coordinate: set all three"
            entry = replace(entry, doc=words)
        elif entry.interpolation != "linear":  # FMI has no place for it, and importers draw straight lines
            entry = replace(entry, doc=f"{entry.doc} ({BETWEEN_ROWS}{entry.interpolation})".strip())
        listing.add(Slot("u", i), entry, name=name, causality="input", initial="", start=value)


def _list_parameters(listing: Listing, settable: Sequence[int]) -> None:
    chosen = set(settable)
    for i, entry in enumerate(listing.equations.parameters):
        own = i in chosen
        listing.add(
            Slot("p", i),
            entry,
            causality="parameter" if own else "calculatedParameter",
            variability="tunable",
            initial="exact" if own else "calculated",
            start=float(listing.start.case.p[i]) if own else None,
        )


def _list_outputs(listing: Listing) -> None:
    """List the outputs that are not states, and the discrete variables."""
    states = {e.name for e in listing.equations.states}
    for i, entry in enumerate(listing.equations.outputs):
        if entry.name not in states:
            listing.add(Slot("out", i), entry, causality="output", initial="calculated")
    for i, entry in enumerate(shown_discretes(listing.equations)):
        listing.add(Slot("z", i), entry, causality="output", variability="discrete", initial="calculated")


def _list_indicators(listing: Listing, count: int) -> tuple[int, ...]:
    places = []
    for i in range(count):
        name = listing.names.new(f"event_indicator[{i + 1}]")
        entry = Quantity(name, "indicator", "", doc="an event is where it falls below zero")
        places.append(listing.add(Slot("w", i), entry, name=name, causality="local", initial="calculated"))
    return tuple(places)


def _rate_unit(unit: str) -> str:
    """Write ``1/s/s`` as ``1/s^2``, and the like."""
    if not unit:
        return ""
    parsed = parse_unit(unit)
    text = str(parsed.dimension)
    return unit if parsed.angle else text


# ---------------------------------------------------------------- what depends on what


def _with_dependencies(
    listing: Listing,
    derivatives: tuple[int, ...],
    settable: tuple[int, ...],
    free: Sequence[bool],
    entangled: bool,
) -> VariableTable:
    """Return the table with what each unknown depends on; ``entangled``: initial values on each other."""
    equations, rows, place = listing.equations, listing.rows, listing.place
    seeds = {Slot("z", i) for i, e in enumerate(equations.discretes) if e.kind == SEED}
    at_start = dependencies(equations, settable, _outputs_of(equations, "initial"))

    def known(slots: frozenset[Slot]) -> frozenset[int]:
        return frozenset(place[s] for s in slots - seeds if s.array != "z")

    def initially(slots: frozenset[Slot]) -> frozenset[int] | None:
        if entangled:
            return None
        found: set[Slot] = set()
        for s in slots:
            found |= at_start[s.index] if s.array == "y" and not free[s.index] else {s}
        return known(frozenset(found))

    by_index: dict[int, frozenset[Slot]] = {}
    for k, slots in zip(
        derivatives, dependencies(equations, settable, _outputs_of(equations, "rhs")), strict=True
    ):
        by_index[k] = slots
    for i, slots in enumerate(dependencies(equations, settable, _outputs_of(equations, "outputs"))):
        if Slot("out", i) in place:
            by_index[place[Slot("out", i)]] = slots
    rules = {r.index: r.value for r in equations.parameter_rules}
    dependent = sorted(set(range(len(equations.parameters))).difference(settable))
    for i, slots in zip(
        dependent, dependencies(equations, settable, [rules[i] for i in dependent]), strict=True
    ):
        by_index[place[Slot("p", i)]] = slots
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
    return VariableTable(
        variables,
        derivatives,
        outputs,
        unknowns,
        settable,
        indicators=(),
        zero_crossings=(),
        inputs_move=_inputs_move(equations, listing.start),
        free_initial=all(free),
    )


def _inputs_move(equations: Equations, start: Start) -> bool:
    time = {n for n, slot in equations.layout.items() if slot.array == "t"}
    defaults = [n for f in equations.functions if f.name == "inputs" for n in f.outputs]
    return any(
        i not in start.given_inputs and bool(time & set(equations.graph.support(n)))
        for i, n in enumerate(defaults)
    )
