"""The tangent of a model: a model whose state holds, beside y, the derivatives of y in several directions.

Its equations are y' = f and W' = (df/dy) W + df/dp for each direction, by forward differentiation of the same graph, so
that the directions share what they have in common. All that works on equations works on these: both targets, every
method for general systems, error control, dense output. Nothing switches in it: it is for the pieces of a motion between
events, with the discrete variables that hold there.

Layout. y: the states of the model, then those of each direction. z: the discrete variables, then for each
direction the derivatives of the real ones, then for each direction that of the time at which something happens.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING

from msgspec.structs import replace

from mechc.lang.units import parse_unit
from mechc.runtime.interface import Quantity

from ..graph import Node
from ..graph.differentiate import jvp
from .model import Equations, Function, Slot, quantity
from .sensitivities import total
from .solve.shares import shares_in, undefined

if TYPE_CHECKING:
    from mechc.runtime.problem import Directions

TANGENT = "tangent"
"""Kind of the entries that hold derivatives."""

KEPT = (
    "assertions",
    "closeness",
    "constraints",
    "displace",
    "inputs",
    "project_position",
    "project_velocity",
    "timed_arguments",
)
"""Functions that are those of the model itself."""

AT_EVENTS = ("indicators", "crossing_times", "row_values", "respond")
"""Functions that tell of events, differentiated along the time as well."""

EVENTS = frozenset({"events", "modes"})
"""Facts that do not hold between events."""


def tangent_equations(equations: Equations, directions: Directions) -> Equations:
    """Return the equations of the motion and its derivatives in ``directions``.

    ``initial``, ``discretes`` and ``outputs`` give values, then derivatives; ``tangent_NAME`` the derivatives of function
    NAME alone, one direction after the other, along the derivatives in y and z.
    """
    return _Tangents(equations, directions).equations()


class _Tangents:
    def __init__(self, equations: Equations, directions: Directions) -> None:
        self.base = equations
        self.graph = equations.graph
        self.places = {slot: n for n, slot in equations.layout.items()}
        self.functions = {f.name: f for f in equations.functions}
        self.directions = directions
        self.names = (
            *((f"direction {k + 1}", unit) for k, unit in enumerate(self.units())),
            *((equations.parameters[i].name, equations.parameters[i].unit) for i in directions.parameters),
            *((equations.inputs[i].name, equations.inputs[i].unit) for i in directions.inputs),
        )
        self.reals = [
            k for k, e in enumerate(equations.discretes) if e.kind == "discrete" and e.type == "real"
        ]
        self.shares = shares_in(equations.switching, equations.layout)
        ny, nz, count = len(equations.states), len(equations.discretes), len(self.names)
        symbol = self.graph.symbol
        self.w = [[symbol(f"d({e.name}) along {d}") for e in equations.states] for d in range(count)]
        self.dz = [[symbol(f"d(discrete {j}) along {d}") for j in self.reals] for d in range(count)]
        self.dt = [symbol(f"d(time) along {d}") for d in range(count)]
        moving = directions.tables if equations.switching is not None else ()
        self.input_rates = {i: symbol(f"d({equations.inputs[i].name})/d(time)") for i in moving}
        self.slots = {
            n: Slot("y", ny * (d + 1) + i) for d, row in enumerate(self.w) for i, n in enumerate(row)
        }
        self.at_events = (*self.dt, *self.input_rates.values())
        flat = [*(n for row in self.dz for n in row), *self.at_events]
        self.slots |= {n: Slot("z", nz + i) for i, n in enumerate(flat)}
        rules = {r.index: r.value for r in equations.parameter_rules}
        fixed = {
            i for i in range(len(equations.parameters)) if i not in rules or not self.graph.support(rules[i])
        }
        self.independent = sorted(fixed | {*directions.given, *directions.parameters})

    def equations(self) -> Equations:
        base = self.base
        rates = self.own("rhs")
        functions = [
            Function(
                "rhs", "time derivative of the state and of its derivatives", (*rates, *self.along(rates))
            ),
            Function("initial", "initial state and its derivatives", self.at_start("initial")),
            Function(
                "outputs",
                "everything reported beside the state, and its derivatives",
                (*self.own("outputs"), *self.along(self.own("outputs"))),
            ),
            *(self.functions[name] for name in KEPT if name in self.functions),
        ]
        if base.discretes:
            starts = self.at_start("discretes", self.reals)
            zeros = (self.graph.zero,) * len(self.at_events)
            functions.append(
                Function("discretes", "initial discrete variables and derivatives", (*starts, *zeros))
            )
        elif self.dt:
            zeros = (self.graph.zero,) * len(self.at_events)
            functions.append(Function("discretes", "derivatives of no discrete variables", zeros))
        pattern: tuple[tuple[int, int], ...] = ()
        if "jacobian" in self.functions:
            entries, ny = self.functions["jacobian"].outputs, len(base.states)
            blocks = range(len(self.names) + 1)
            pattern = tuple((b * ny + i, b * ny + j) for b in blocks for i, j in base.jacobian_pattern)
            doc = "the Jacobian of the model, once for the state and for each direction"
            functions.append(Function("jacobian", doc, entries * len(blocks)))
        functions += self.further()
        return replace(
            base,
            layout={**base.layout, **self.slots},
            nx=base.nx + len(base.states) * len(self.names),
            states=(*base.states, *self.entries(base.states)),
            discretes=(
                *base.discretes,
                *self.entries([base.discretes[k] for k in self.reals]),
                *self.times(),
            ),
            outputs=(*base.outputs, *self.entries(base.outputs)),
            known=(True,) * (len(base.states) * (len(self.names) + 1)),
            starts=(None,) * (len(base.states) * (len(self.names) + 1)),
            functions=tuple(functions),
            experiments=(),
            sought=(),
            balance=(),
            needs=(base.needs - EVENTS) | self.time(functions[0]),
            conserved=(),
            energy_balance=(),
            jacobian_pattern=pattern,
            dependent=(),
            assembly=(),
            separable=False,
            hybrid=None,
            switching=None,
            scene=None,
            # what describes functions that are not among those of the tangent
            patterns={},
            phase=(),
            matter=(),
            offers=(),
        )

    # ------------------------------------------------------------ functions

    def time(self, rates: Function) -> frozenset[str]:
        """Return the fact that rates depend on time: derivatives do where inputs do."""
        return frozenset({"time"} if self.places[Slot("t", 0)] in self.graph.support(*rates.outputs) else ())

    def own(self, name: str) -> tuple[Node, ...]:
        return self.functions[name].outputs

    def along(self, nodes: Sequence[Node], *, time: bool = False) -> tuple[Node, ...]:
        """Return the derivatives of nodes in all directions; ``time``: also along that of the time."""
        nodes = total(self.base, self.independent, nodes)
        found = (jvp(self.graph, nodes, self.tangents(d, time)) for d in range(len(self.names)))
        none = [undefined(self.graph, self.shares, n) for n in nodes]
        return tuple(self.graph.add(n, extra) for row in found for n, extra in zip(row, none, strict=True))

    def at_start(self, name: str, wanted: Sequence[int] | None = None) -> tuple[Node, ...]:
        """Return the results of a function that is called before the state is known, and those ``wanted`` differentiated."""
        own = self.own(name)
        return (*own, *self.along(own if wanted is None else [own[k] for k in wanted]))

    def further(self) -> Iterable[Function]:
        """Yield the derivatives of what is called once or at events."""
        nv = self.base.nv
        at_times = {
            "initial_of_others": None,
            "assembly": None,
            "assembly_jacobian": None,
            "project_position": nv,
            "project_velocity": nv,
            **{plan.function: None for plan in self.base.experiments},
        }
        for name, count in at_times.items():
            if name in self.functions:
                doc = f"derivatives of '{name}' in all directions"
                yield Function(f"tangent_{name}", doc, self.along(self.own(name)[:count]))
        if self.base.switching is None:
            return
        new = len(self.base.states) + len(self.base.discretes)
        for name in (*AT_EVENTS, *(branch.function for branch in self.base.switching.branches)):
            if name in self.functions:
                doc = f"derivatives of '{name}' in all directions, where the time changes too"
                own = self.own(name) if name in AT_EVENTS else self.own(name)[:new]
                yield Function(f"tangent_{name}", doc, self.along(own, time=True))

    def tangents(self, d: int, time: bool) -> Mapping[Node, Node]:
        """Return what changes in a direction: state, discrete variables, a parameter or an input, and what follows."""
        base, graph, given = self.base, self.graph, self.directions
        found = {self.places[Slot("y", i)]: n for i, n in enumerate(self.w[d])}
        found |= {self.places[Slot("z", k)]: n for k, n in zip(self.reals, self.dz[d], strict=True)}
        moved: dict[Node, Node] = {self.places[Slot("t", 0)]: self.dt[d]} if time else {}
        k = d - given.states
        if 0 <= k < len(given.parameters):
            moved[self.places[Slot("p", given.parameters[k])]] = graph.one
        elif k >= len(given.parameters):
            found[self.places[Slot("u", given.inputs[k - len(given.parameters)])]] = graph.one
        if base.inputs and moved:
            defaults = total(base, self.independent, self.own("inputs"))
            changes = list(jvp(graph, defaults, moved))
            for i in given.tables:
                changes[i] = graph.mul(self.input_rates[i], self.dt[d]) if time else graph.zero
            for i, change in enumerate(changes):
                place = self.places[Slot("u", i)]
                found[place] = graph.add(found.get(place, graph.zero), change)
        return {**found, **moved}

    # ------------------------------------------------------------ names

    def units(self) -> tuple[str, ...]:
        """Return the units of the directions of the initial state."""
        known = self.directions.units
        return (*("",) * (self.directions.states - len(known)), *known)

    def entries(self, entries: Sequence[Quantity]) -> list[Quantity]:
        return [
            replace(quantity(f"d({e.name})/d({name})", TANGENT, quotient(e.unit, unit)), origin=e.origin)
            for name, unit in self.names
            for e in entries
        ]

    def times(self) -> list[Quantity]:
        return [
            quantity(f"d(time)/d({n})", TANGENT, quotient(self.base.time.unit, unit))
            for n, unit in self.names
        ] + [
            quantity(f"d({e.name})/d(time)", TANGENT, quotient(e.unit, self.base.time.unit))
            for e in (self.base.inputs[i] for i in self.input_rates)
        ]


def quotient(above: str, below: str) -> str:
    """Return the SI unit of a derivative; radians stay where they do not cancel: rad/s over m is rad/m/s."""
    if not below:
        return above
    dimension = parse_unit(above or "1").dimension / parse_unit(below or "1").dimension
    angles = ("rad" in above) - ("rad" in below)
    text = str(dimension)
    if angles > 0:
        return f"rad{text[1:]}" if text.startswith("1") else f"rad.{text}"
    if angles < 0:
        return f"{text}/rad"
    return "" if dimension.is_none else text
