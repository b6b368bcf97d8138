"""What the start finds beside coordinates and velocities: states that shall not change, and parameters that are guessed.

Each takes one condition of ``initial`` statements. They are solved together, by Newton's method in the graph, as formulas of
the coordinates, velocities and parameters; the assembly then solves the rest of the conditions with these formulas put in.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from enum import IntEnum
from math import isfinite, sqrt

from msgspec import Struct
from msgspec.structs import replace

from mechc.lang.diagnostics import Label, Reporter

from ...graph import DivisionByZero, Graph, Node
from ...graph.differentiate import jacobian
from ...graph.elimination.newton import newton
from ...graph.evaluate import evaluate
from ...graph.rewrite import substitute
from ...mechanics.defaults import default_formulas, default_values
from ...mechanics.meaning.symbols import Scalar
from ...mechanics.system import InitialRow, InitialValue, MechanicalSystem
from ..solve.solved import Solved
from .entries import Layout


class Factor(IntEnum):
    """What an unknown is multiplied with in a condition: the smaller, the better it is found from there."""

    NUMBER = 0
    FORMULA = 1
    ZERO = 2


class StartCondition(Struct, frozen=True):
    """What an initial state must fulfil, with its residual in numbers that have a place; ``late``: it contains accelerations,
    rates of states or forces, so that all it depends on counts as coordinates do."""

    row: InitialRow
    residual: Node
    late: bool


class InitialUnknowns(Struct, frozen=True):
    """``starts`` of the state with those that the conditions decide; the ``conditions`` that are left; ``parameters`` by index,
    those that follow from others of them too."""

    starts: tuple[InitialValue, ...]
    conditions: tuple[StartCondition, ...]
    parameters: Mapping[int, Node]
    states: tuple[int, ...] = ()


def initial_unknowns(
    system: MechanicalSystem,
    solved: Solved,
    layout: Layout,
    starts: Sequence[InitialValue],
    reporter: Reporter,
) -> InitialUnknowns:
    """Return what the start finds; report parameters that nothing decides, and conditions that cannot hold."""
    graph = system.graph
    guessed = [s for s in system.symbols.parameters if s.variable.found]
    rules = _rules(system, {s.node for s in guessed})
    highest = {*system.a, *(system.rate(x) for x in system.xdot)}
    forces = {n for n, q in system.queries.items() if system.lowering.questions.is_force(q)}
    conditions = []
    for row in system.initials:
        late = graph.depend([row.residual], highest | forces)
        (residual,) = substitute(graph, solved.resolve([row.residual]), rules)
        if late and graph.is_constant(residual):
            if not graph.is_zero(residual):
                reporter.error(
                    "E0609",
                    f"the initial condition on '{row.name}' cannot hold",
                    row.origin.shown,
                    caption=f"for every start, this is off by {float(graph.value(residual)):.6g}",
                    help="nothing at the start changes it",
                )
            continue
        conditions.append(StartCondition(row, residual, late))
    first = layout.nq + layout.nv
    states = [s for k, s in enumerate(system.symbols.states, first) if not starts[k].known]
    _refuse_in_starts(system, starts, rules, [s.node for s in guessed], reporter)
    claimed = _claimed(system, layout, conditions, starts, guessed, states)
    for scalar in guessed:
        if scalar.node not in claimed:
            reporter.error(
                "E0610",
                f"no initial condition determines the parameter '{scalar.name}'",
                scalar.variable.origin.shown,
                caption="its value is a guess",
                help=f"add one more initial condition, such as 'initial der(q, 2) = 0;', or write '{scalar.name} = ..'",
            )
    reporter.stop_on_errors()
    if not claimed:
        return InitialUnknowns(tuple(starts), tuple(conditions), {})
    everything = _values(system, layout, starts)
    guesses = {**default_formulas(system, guessed), **everything}
    solution = _solved(system, conditions, claimed, guesses, reporter)
    rest = [c for k, c in enumerate(conditions) if k not in claimed.values()]
    residuals = substitute(graph, [c.residual for c in rest], solution)
    values = list(starts)
    for k, scalar in enumerate(system.symbols.states, first):
        if scalar.node in solution:
            node = solution[scalar.node]
            (value,) = substitute(graph, [node], everything)
            values[k] = replace(starts[k], value=value, by_others=node)
    return InitialUnknowns(
        tuple(values),
        tuple(replace(c, residual=n) for c, n in zip(rest, residuals, strict=True)),
        _parameters(system, solution, rules),
        tuple(k for k, s in enumerate(system.symbols.states, first) if s.node in solution),
    )


def _parameters(
    system: MechanicalSystem, solution: Mapping[Node, Node], rules: Mapping[Node, Node]
) -> dict[int, Node]:
    """Return what is found by index, then what follows from it."""
    graph, places = system.graph, {s.node: k for k, s in enumerate(system.symbols.parameters)}
    found = {places[n]: value for n, value in solution.items() if n in places}
    values = substitute(graph, list(rules.values()), solution)
    return found | {places[n]: value for n, value in zip(rules, values, strict=True) if found}


def _rules(system: MechanicalSystem, found: set[Node]) -> dict[Node, Node]:
    """Return the formulas of the parameters that follow from what is found, in parameters that do not."""
    if not found:
        return {}
    graph = system.graph
    formulas = default_formulas(system, system.symbols.parameters)
    rules: dict[Node, Node] = {}
    for _ in formulas:
        more = {
            n: f
            for n, f in formulas.items()
            if n not in found | rules.keys() and (found | rules.keys()) & set(graph.support(f))
        }
        if not more:
            break
        rules |= more
    for _ in rules:
        rules = dict(zip(rules, substitute(graph, list(rules.values()), rules), strict=True))
    return rules


def _refuse_in_starts(
    system: MechanicalSystem,
    starts: Sequence[InitialValue],
    rules: Mapping[Node, Node],
    found: Sequence[Node],
    reporter: Reporter,
) -> None:
    """Report initial values that are stated by a parameter that follows from them."""
    graph, ours = system.graph, {*found, *rules}
    for start in starts:
        if start.start is not None and (reads := ours.intersection(graph.support(start.value))):
            name = graph.name(min(reads))
            reporter.error(
                "E0601",
                f"an initial value depends on '{name}', which the start finds",
                start.start.origin.shown,
                caption="stated here",
                help="state a number, or a guess with '~'",
            )


def _claimed(
    system: MechanicalSystem,
    layout: Layout,
    conditions: Sequence[StartCondition],
    starts: Sequence[InitialValue],
    guessed: Sequence[Scalar],
    states: Sequence[Scalar],
) -> dict[Node, int]:
    """Return which condition decides each parameter and each state that is found.

    Parameters come first, each by the condition on which it weighs most, then each state by its own rate, then coordinates and
    velocities, then states by what is left, first those that stand there with a number as their factor, and last whatever has the
    factor zero: a matching of conditions, in which what has one keeps one (H. W. Kuhn 1955).
    """
    if not (guessed or states):
        return {}
    graph = system.graph
    supports = [set(graph.support(c.residual)) if c.row.known else set() for c in conditions]
    owner: dict[int, Node] = {}

    def find(node: Node, allowed: Iterable[int], seen: set[int], most: Factor = Factor.ZERO) -> bool:
        fit = [k for k in allowed if node in supports[k] and factors.get((node, k), most) <= most]
        for k in sorted(fit, key=owner.__contains__):  # what is free first
            if k in seen:
                continue
            seen.add(k)
            if k not in owner or find(owner[k], orders.get(owner[k], every), seen, most):
                owner[k] = node
                return True
        return False

    moving = [system.q[i].node for k, i in enumerate(layout.q_indices) if not starts[k].known]
    moving += [system.v[i].node for k, i in enumerate(layout.v_indices, layout.nq) if not starts[k].known]
    every = range(len(conditions))
    orders = _orders(system, conditions, [s.node for s in guessed], moving)
    factors: dict[tuple[Node, int], Factor] = {}
    for s in guessed:
        find(s.node, orders[s.node], set())
    for s in states:
        rate = system.rate(s.node)
        own = [k for k in every if k not in owner and rate in graph.support(conditions[k].row.residual)]
        find(s.node, own, set())
    others = [s.node for s in states if s.node not in owner.values()]
    if others and any(k not in owner for k in every):
        factors = _factors(system, conditions, [*moving, *others])
    passes = [(moving, Factor.FORMULA), *((others, f) for f in Factor), (moving, Factor.ZERO)]
    for nodes, most in passes:
        for node in nodes:
            if node not in owner.values():
                find(node, every, set(), most)
    ours = {s.node for s in (*guessed, *states)}
    return {node: k for k, node in owner.items() if node in ours}


def _factors(
    system: MechanicalSystem, conditions: Sequence[StartCondition], nodes: Sequence[Node]
) -> dict[tuple[Node, int], Factor]:
    """Return what each unknown is multiplied with in each condition, with the parameters by default and away from the guesses."""
    graph = system.graph
    rows = jacobian(graph, [c.residual for c in conditions], nodes)
    places = [(nodes[j], k, n) for k, row in enumerate(rows) for j, n in row.items()]
    try:
        given = default_values(system)
        given |= {node: given[node] + sqrt(2 + j) for j, node in enumerate(nodes)}
        values = evaluate(graph, [n for _, _, n in places], given)
    except (ArithmeticError, ValueError, KeyError):
        values = [1.0] * len(places)
    return {
        (node, k): Factor.ZERO if x == 0 else Factor.NUMBER if graph.is_constant(n) else Factor.FORMULA
        for (node, k, n), x in zip(places, values, strict=True)
    }


def _orders(
    system: MechanicalSystem,
    conditions: Sequence[StartCondition],
    guessed: Sequence[Node],
    moving: Sequence[Node],
) -> dict[Node, list[int]]:
    """Return the conditions that may decide each parameter, first those on which it weighs most at the guesses, as a share of all
    that may change there.

    A condition that a parameter only scales, as the balance of two springs of one stiffness, does not decide it: at zero it would
    hold for every position.
    """
    if not guessed:
        return {}
    graph, weights = system.graph, dict[tuple[Node, int], float]()
    rows = jacobian(graph, [c.residual for c in conditions], [*guessed, *moving])
    try:
        given = default_values(system)
        found = iter(evaluate(graph, [n for row in rows for n in row.values()], given))
    except (ArithmeticError, ValueError, KeyError):
        given, found = {}, iter(())
    scaled = set()
    for k, (condition, row) in enumerate(zip(conditions, rows, strict=True)):
        shares = {j: abs(next(found, 0.0)) for j in row}
        shares |= {j: shares[j] * abs(given.get(node, 0.0)) for j, node in enumerate(guessed) if j in shares}
        whole = sum(shares.values())
        for j in range(len(guessed)):
            if _scales(graph, guessed[j], condition.residual):
                scaled.add((guessed[j], k))
            if j in shares and isfinite(whole) and whole:
                weights[guessed[j], k] = shares[j] / whole
    return {
        node: sorted(
            (k for k in range(len(conditions)) if (node, k) not in scaled),
            key=lambda k: -weights.get((node, k), 0.0),
        )
        for node in guessed
    }


def _scales(graph: Graph, parameter: Node, residual: Node) -> bool:
    """Tell whether a residual is zero where the parameter is."""
    try:
        return graph.is_zero(*substitute(graph, [residual], {parameter: graph.zero}))
    except DivisionByZero:
        return False


def _solved(
    system: MechanicalSystem,
    conditions: Sequence[StartCondition],
    claimed: Mapping[Node, int],
    guesses: Mapping[Node, Node],
    reporter: Reporter,
) -> dict[Node, Node]:
    """Return the formulas of what is found."""
    unknowns = list(claimed)
    rows = [conditions[k].residual for k in claimed.values()]
    try:
        values = newton(system.graph, rows, unknowns, [guesses[n] for n in unknowns])
    except DivisionByZero:
        first, *others = [conditions[k].row for k in claimed.values()]
        names = ", ".join(f"'{system.graph.name(n)}'" for n in unknowns)
        raise reporter.fail(
            "E0609",
            f"what is said of the start does not determine {names}",
            first.origin.shown,
            labels=tuple(Label(row.origin.shown, "and this") for row in others[:3]),
            help="guess another value, or state something else of the start",
        ) from None
    return dict(zip(unknowns, values, strict=True))


def _values(system: MechanicalSystem, layout: Layout, starts: Sequence[InitialValue]) -> dict[Node, Node]:
    """Return the initial value of each number of the state, as a formula of parameters."""
    nodes = [
        *(system.q[k].node for k in layout.q_indices),
        *(system.v[i].node for i in layout.v_indices),
        *(s.node for s in system.symbols.states),
    ]
    return {n: s.value for n, s in zip(nodes, starts, strict=False)}
