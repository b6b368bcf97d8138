"""The adjoint of a model: its rates, its start and a goal, pulled back to the state, parameters and inputs.

For a scalar goal the transposed derivative costs a few evaluations of the rates, however many parameters there are. The seeds
are further numbers after the discrete variables: one for each rate, then one for the goal; or one for each row of the assembly.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from msgspec.structs import replace

from mechc.lang.units import parse_unit
from mechc.runtime.interface import OfferedFunction

from ..graph import Node
from ..graph.differentiate import vjp
from ..graph.rewrite import substitute
from .model import Equations, Function, Slot, quantity
from .sensitivities import SEED, total
from .solve.shares import shares_in, undefined
from .tangents import quotient

if TYPE_CHECKING:
    from mechc.runtime.problem import Adjoint


def adjoint_equations(equations: Equations, asked: Adjoint) -> Equations:
    """Return the equations with the functions ``goal``, ``pull_back`` and ``start_pull_back``.

    ``pull_back``: the transposed derivative of rates and goal times the seeds, out[ny + free]: by the state, by parameters and
    by inputs; ``start_pull_back`` the same of the initial state. What follows from parameters (other parameters, defaults of
    inputs, initial values) is in both. With constraints ``pull_back_position``, ``pull_back_velocity`` and ``pull_back_assembly``
    are the same of the projections and of the assembly. Raises ValueError where an experiment lets two of them change at once.
    """
    return _Adjoints(equations, asked).equations()


class _Adjoints:
    def __init__(self, base: Equations, asked: Adjoint) -> None:
        self.base, self.asked, self.graph = base, asked, base.graph
        self.functions = {f.name: f for f in base.functions}
        self.places = {slot: n for n, slot in base.layout.items()}
        rules = {r.index: r.value for r in base.parameter_rules}
        fixed = {i for i in range(len(base.parameters)) if i not in rules or not self.graph.support(rules[i])}
        self.independent = sorted(fixed | {*asked.given, *asked.parameters})
        self.y = [self.places[Slot("y", i)] for i in range(len(base.states))]
        self.p = [self.places[Slot("p", i)] for i in asked.parameters]
        self.u = [self.places[Slot("u", i)] for i in asked.inputs]
        count = max(len(self.y) + 1, len(self.own("assembly")))
        self.seeds = [self.graph.symbol(f"seed of the adjoint {i}") for i in range(count)]

    def equations(self) -> Equations:
        base, asked = self.base, self.asked
        array, index = asked.goal
        goal = self.own("outputs")[index] if array == "out" else self.y[index]
        entry = (base.outputs if array == "out" else base.states)[index]
        rates = {k: (n, self.seeds[k]) for k, n in enumerate(self.own("rhs")) if k not in self.unread(goal)}
        nodes, seeds = zip(*rates.values(), (goal, self.seeds[len(self.y)]), strict=True)
        pulled = self.pulled(nodes, seeds, self.y)
        free = [*(base.parameters[i] for i in asked.parameters), *(base.inputs[i] for i in asked.inputs)]
        rows = [*base.states, *free]
        unit = entry.unit if not asked.integral else _times(entry.unit, base.time.unit)
        labels = tuple((r.name, quotient(unit, r.unit)) for r in rows)
        doc = "transposed derivative of the rates and the goal, times the seeds"
        zeros = (self.graph.zero,) * len(self.seeds)
        made = [
            Function("goal", "what is differentiated", (goal,)),
            Function("pull_back", doc, tuple(pulled)),
            Function("start_pull_back", "the same of the initial state", tuple(self.start())),
            *self.constrained(),
        ]
        return replace(
            base,
            layout={**base.layout, **{n: Slot("z", i) for i, n in enumerate(self.seeds)}},
            discretes=tuple(quantity(f"seed[{i + 1}]", SEED, "") for i in range(len(self.seeds))),
            functions=(
                *base.functions,
                Function("discretes", "seeds", zeros),
                *made,
            ),
            offers=(
                OfferedFunction(
                    entry.name, "goal", made[0].doc, (), ((entry.name, unit),), (), True, "adjoint"
                ),
                *(
                    OfferedFunction(f.name, f.name, f.doc, (len(rows),), labels, (), True, "adjoint")
                    for f in made[1:]
                ),
            ),
        )

    def unread(self, goal: Node) -> frozenset[int]:
        """Return the accounts of energy, on which nothing depends but what reports them: their seeds stay zero."""
        accounts = {n: k for k, n in enumerate(self.y) if self.base.states[k].kind == "account"}
        read = set(self.graph.support(*self.own("rhs"), goal))
        return frozenset(k for n, k in accounts.items() if n not in read)

    def own(self, name: str) -> tuple[Node, ...]:
        found = self.functions.get(name)
        return found.outputs if found is not None else ()

    def pulled(self, nodes: Sequence[Node], seeds: Sequence[Node], states: Sequence[Node]) -> list[Node]:
        """Return what nodes times seeds are by ``states``, parameters and inputs, with the defaults of inputs after them."""
        graph, base = self.graph, self.base
        nodes = total(base, self.independent, nodes)
        inputs = [self.places[Slot("u", i)] for i in range(len(base.inputs))]
        wanted = [*states, *self.p, *inputs]
        found = vjp(graph, list(zip(nodes, seeds, strict=True)), wanted)
        shares = shares_in(base.switching, base.layout)
        for node, seed in zip(nodes, seeds, strict=True):
            none = undefined(graph, shares, node)
            if none != graph.zero:
                none = graph.select(graph.less(graph.zero, graph.abs(seed)), none, graph.zero)
                found = [graph.add(n, none) for n in found]
        first = len(states)
        own, by_inputs = found[: first + len(self.p)], found[first + len(self.p) :]
        defaults = total(base, self.independent, self.own("inputs"))
        moving = [(n, by_inputs[i]) for i, n in enumerate(defaults) if i not in self.asked.tables]
        through = vjp(graph, moving, self.p) if moving else []
        for k, more in enumerate(through):
            own[first + k] = graph.add(own[first + k], more)
        return [*own, *(by_inputs[i] for i in self.asked.inputs)]

    def constrained(self) -> Iterator[Function]:
        """Yield the same of both projections, of what they change, and of the residuals of the assembly."""
        base, nq, nv = self.base, self.base.nq, self.base.nv
        if self.own("project_position"):
            corrections = self.own("project_position")[:nv]
            in_places = dict(zip(self.y[nq : nq + nv], corrections, strict=True))
            moves = substitute(self.graph, self.own("displace"), in_places)
            velocities = self.own("project_velocity")[:nv]
            for name, nodes, first in (("position", moves, 0), ("velocity", velocities, nq)):
                seeds = self.seeds[first : first + len(nodes)]
                doc = f"the same of the {name} correction onto the constraints"
                yield Function(f"pull_back_{name}", doc, tuple(self.pulled(nodes, seeds, self.y)))
        if base.assembly:
            rows = self.own("assembly")
            doc = "the same of the residuals of the assembly"
            yield Function(
                "pull_back_assembly", doc, tuple(self.pulled(rows, self.seeds[: len(rows)], self.y))
            )

    def start(self) -> list[Node]:
        """Return the initial state times the seeds, by initial values, parameters and inputs."""
        base, graph, zero = self.base, self.graph, self.graph.zero
        held = set(self.asked.stated)
        nodes = list(self.own("initial"))
        for k, node in self.set_by_experiment():
            nodes[k] = node
            held.add(k)
        for k in self.asked.stated:
            nodes[k] = zero
        others = dict(zip(base.dependent, self.own("initial_of_others"), strict=True))
        others = {k: n for k, n in others.items() if k not in held}
        for k in others:
            nodes[k] = others[k]
        for _ in others:  # one of them may be stated with another
            at_start = dict(zip(self.y, nodes, strict=True))
            for k, n in others.items():
                (nodes[k],) = substitute(graph, [n], at_start)
        seeds = self.seeds[: len(nodes)]
        by_parameters = self.pulled(nodes, seeds, ())
        direct = (
            vjp(graph, [(n, seeds[k]) for k, n in others.items()], self.y) if others else [zero] * len(self.y)
        )
        by_values = [seeds[k] if k not in others else zero for k in range(len(nodes))]
        return [*(graph.add(a, b) for a, b in zip(by_values, direct, strict=True)), *by_parameters]

    def set_by_experiment(self) -> list[tuple[int, Node]]:
        """Return the initial values that the experiment sets. Raises ValueError where it sets parameters or inputs by others."""
        base = self.base
        plan = next((e for e in base.experiments if e.name == self.asked.experiment), None)
        if plan is None:
            return []
        nodes = self.own(plan.function)[len(plan.options) :]
        found = []
        for setting, node in zip(plan.settings, total(base, self.independent, nodes), strict=True):
            if setting.array == "y" and setting.index not in self.asked.stated:
                found.append((setting.index, node))
            elif setting.array != "y":
                place = self.places[Slot(setting.array, setting.index)]
                moving = [n for n in self.p if n != place and n in self.graph.support(node)]
                if moving and (setting.array, setting.index) not in self.asked.settled:
                    entries = base.parameters if setting.array == "p" else base.inputs
                    names = entries[setting.index].name, base.parameters[base.layout[moving[0]].index].name
                    raise ValueError(
                        f"the experiment sets '{names[0]}' by a formula with '{names[1]}': both would change at once"
                    )
        return found


def _times(unit: str, other: str) -> str:
    if not other:
        return unit
    return str(parse_unit(unit or "1").dimension * parse_unit(other).dimension)
