"""From equations to a program: hoist, order, and turn nodes into statements."""

from __future__ import annotations

from collections.abc import Mapping, Sequence, Set

from msgspec import Struct
from msgspec.structs import replace

from mechc.runtime.interface import interface_of

from ..equations.followers import followers
from ..equations.model import CompilerInterface, Equations, Function, Slot
from ..graph import Graph, Node
from ..graph.operations import CONST, EQUAL, LOOKUP, OPERATIONS, SYMBOL
from .hoist import hoistable, rule_order
from .independent_groups import groups
from .model import (
    Body,
    Literal,
    Load,
    Lookup,
    Operate,
    Program,
    ProgramFunction,
    Statement,
    Store,
    Value,
    codes_of,
)
from .schedule import schedule

NARROW = frozenset(row.code for row in OPERATIONS if row.narrow)
"""Operations whose results may change within a small part of the range of what they are of, and tables."""

BENT = frozenset(row.code for row in OPERATIONS if row.kinks or row.jumps) - {EQUAL}
"""Operations whose results or derivatives jump; where events locate that, a discrete variable stands in their place. Tables
have derivatives of second order that jump."""

LONG = 10_000
"""Statements of a function that is worth looking through for loops. In shorter ones straight lines are as fast."""

SHORT = 500
"""Statements of a function that stays as it is where another one of the program is long."""

RUN_ONCE = ("initial", "initial_of_others", "discretes")
"""Functions that a run calls once, as those of the experiments: nothing is gained by hoisting from them."""


def lower(equations: Equations, *, hoist: bool = True) -> Program:
    """Return the program of all functions of the equations, each one in a single body.

    ``hoist``: what depends on parameters alone is computed once for each run.
    """
    graph, layout = equations.graph, equations.layout
    once = {*RUN_ONCE, *(e.function for e in equations.experiments)}
    repeated = [n for f in equations.functions if f.name not in once for n in f.outputs]
    hoisted = hoistable(graph, layout, repeated) if hoist else []
    n_parameters = len(equations.parameters)
    constants = {n: n_parameters + i for i, n in enumerate(hoisted)}
    plans = [_plan(f, {} if f.name in once else constants) for f in equations.functions]
    parameters, *functions = _lowered(graph, layout, [_parameters(equations, constants), *plans])
    return Program(
        **interface_of(equations, CompilerInterface)
        | {
            "nh": len(hoisted),
            "groups": _groups(equations, functions),
            "followers": followers(equations),
            "narrow": _derived_by(functions, NARROW),
            "bent": _derived_by(functions, BENT),
        },
        tables=tuple(graph.tables),
        parameters_function=parameters,
        functions=tuple(functions),
    )


def lower_functions(equations: Equations, program: Program, functions: Sequence[Function]) -> Program:
    """Return a program of other functions of the same arguments alone, which hoist nothing."""
    graph = equations.graph
    made = _lowered(graph, equations.layout, [_plan(f, {}) for f in functions])
    return replace(program, tables=tuple(graph.tables), functions=tuple(made), switching=None)


def _derived_by(functions: Sequence[ProgramFunction], codes: Set[int]) -> bool:
    """Whether derivatives hold one of some operations, or a table, of what changes during a run."""
    wanted = {*codes, LOOKUP}
    return any(wanted & codes_of(body) for f in functions if f.name == "rhs" for body in f.bodies)


def _groups(equations: Equations, functions: Sequence[ProgramFunction]) -> tuple[int, ...]:
    """Number the groups of states that have to do with each other."""
    rhs = next((f for f in functions if f.name == "rhs"), None)
    accounts = [i for i, entry in enumerate(equations.states) if entry.kind == "account"]
    return () if rhs is None else groups(rhs, accounts, len(equations.states))


class _Statements:
    """The body under construction."""

    def __init__(self, graph: Graph, layout: Mapping[Node, Slot], constants: Mapping[Node, int]) -> None:
        self.graph = graph
        self.layout = layout
        self.constants = constants
        self.body: list[Statement] = []
        self.place: dict[Node, Value] = {}

    def compute(self, nodes: Sequence[Node]) -> None:
        """Append the statements of nodes in computing order."""
        graph, body, place, constants = self.graph, self.body, self.place, self.constants
        op, args = graph.op, graph.args
        for n in nodes:
            if n in place:
                continue
            statement: Statement
            code = op(n)
            if n in constants:
                statement = Load("p", constants[n])
            elif code == CONST:
                statement = Literal(graph.value(n))
            elif code == SYMBOL:
                slot = self.layout[n]
                statement = Load(slot.array, slot.index)
            elif code == LOOKUP:
                table, order = graph.table_of(n)
                statement = Lookup(table, order, place[args(n)[0]])
            else:
                statement = Operate(code, tuple([place[a] for a in args(n)]))
            place[n] = len(body)
            body.append(statement)

    def store(self, array: str, index: int, n: Node, guarded: bool) -> None:
        self.body.append(Store(array, index, self.place[n], guarded))


def lower_function(
    graph: Graph, layout: Mapping[Node, Slot], function: Function, constants: Mapping[Node, int]
) -> ProgramFunction:
    """Return a function in one body; ``constants``: places in p of nodes that are known."""
    (lowered,) = _lowered(graph, layout, [_plan(function, constants)])
    return lowered


class _Plan(Struct, frozen=True):
    """A function to be lowered: its ``stores`` (array, index, node, guarded), as soon as each is known or ``in_order``."""

    name: str
    doc: str
    n_out: int
    stores: Sequence[tuple[str, int, Node, bool]]
    constants: Mapping[Node, int]
    in_order: bool = False


def _plan(function: Function, constants: Mapping[Node, int]) -> _Plan:
    stores = [("out", i, n, False) for i, n in enumerate(function.outputs)]
    return _Plan(function.name, function.doc, len(function.outputs), stores, constants)


def _parameters(equations: Equations, constants: Mapping[Node, int]) -> _Plan:
    """Plan the function that completes p: defaults and dependent parameters, then hoisted constants."""
    graph, layout = equations.graph, equations.layout
    rules = {rule.index: rule.value for rule in equations.parameter_rules}
    order = rule_order(graph, layout, rules)  # a parameter is stored before others load it
    stores = [("p", index, rules[index], True) for index in order]
    stores += [("p", index, n, False) for n, index in constants.items()]
    doc = "Complete p: dependent parameters that are not set, then constants of the run."
    return _Plan("parameters", doc, 0, stores, {}, in_order=True)


def _lowered(graph: Graph, layout: Mapping[Node, Slot], plans: Sequence[_Plan]) -> list[ProgramFunction]:
    """Return functions of one body each; with the order in which they were made, where one of them is long."""
    orders = [schedule(graph, [n for _, _, n, _ in plan.stores], plan.constants) for plan in plans]
    sizes = [len(order) + len(plan.stores) for order, plan in zip(orders, plans, strict=True)]
    functions = []
    for plan, order, size in zip(plans, orders, sizes, strict=True):
        if size > SHORT and max(sizes) > LONG:
            from .columns import long_body, made_order

            stated = plan.stores, plan.constants, order
            columns, nodes = long_body(graph, layout, *stated, in_order=plan.in_order)
            bodies: tuple[Body, ...] = (columns,)
            made = made_order(columns, nodes)
        else:
            bodies, made = (_body(graph, layout, plan, order),), ()
        functions.append(ProgramFunction(plan.name, plan.doc, plan.n_out, bodies, made=made))
    return functions


def _body(graph: Graph, layout: Mapping[Node, Slot], plan: _Plan, order: Sequence[Node]) -> Body:
    """Return the statements that compute the nodes of ``order``, with the stores of a plan."""
    statements = _Statements(graph, layout, plan.constants)
    position = {n: k for k, n in enumerate(order)}
    stores = plan.stores if plan.in_order else sorted(plan.stores, key=lambda store: position[store[2]])
    start = 0
    for array, index, n, guarded in stores:
        stop = max(start, position[n] + 1)
        statements.compute(order[start:stop])
        start = stop
        statements.store(array, index, n, guarded)
    return tuple(statements.body)
