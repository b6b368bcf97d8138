"""Forward and reverse differentiation on the graph (Griewank, Walther, Evaluating Derivatives, ch. 3).

What only one branch of a ``select`` needs, generated code evaluates inside that branch, and reverse sweeps let nothing pass
into a branch that is not taken: 0 * NaN is NaN.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence, Set

from msgspec import Struct

from .node import Graph, Node
from .operations import ADD, DERIVED, DIV, MUL, NEG, OPERATIONS, SELECT, SQRT, SUB, SYMBOL
from .rewrite import substitute
from .smooth_roots import half_power, rooted_product


def jvp(graph: Graph, outputs: Sequence[Node], tangents: Mapping[Node, Node]) -> list[Node]:
    """Return the derivative of each output along ``tangents`` (independent node -> its tangent).

    Independent nodes are usually symbols; of any other node the sweep does not look at the arguments.
    """
    return _forward(graph, graph.reach_of(outputs, tangents), outputs, tangents)


def _forward(
    graph: Graph, order: Iterable[Node], outputs: Sequence[Node], tangents: Mapping[Node, Node]
) -> list[Node]:
    code, left, right, zero = graph._code, graph._left, graph._right, graph.zero
    add, mul = graph.add, graph.mul
    d: dict[Node, Node] = {n: t for n, t in tangents.items() if t != zero}
    get = d.get
    rooted: set[Node] = set()  # square roots, and their products
    solutions: list[Node] = []
    for n in order:
        c = code[n]
        if c <= SYMBOL or n in tangents:
            continue
        a, b = left[n], right[n]
        da = get(a)
        if c == SQRT or (rooted and c in (MUL, NEG) and (a in rooted or b in rooted)):
            rooted.add(n)
        # the rules of ``tangent``, written out for the operations that are nearly all
        if b < 0:
            if da is None:
                continue
            r = graph.neg(da) if c == NEG else _chain(graph, n, (da,))
        else:
            db = get(b)
            if c == SELECT:
                third = graph._third[n]
                r = graph.select(a, get(b, zero), get(third, zero))
            elif da is None and db is None:
                continue
            elif c == ADD:
                r = add(da or zero, db or zero)
            elif c == SUB:
                r = graph.sub(da or zero, db or zero)
            elif c == MUL:
                if a == b:
                    r = mul(mul(graph.two, a), da or zero)
                elif (code[a] == SQRT or code[b] == SQRT) and (half := half_power(graph, n, tangents)):
                    factor, whole, root = half
                    r = mul(mul(factor, get(whole, zero)), root)
                elif n in rooted and (product := rooted_product(graph, n, rooted)):
                    moved = [get(f, zero) for f in product.factors]
                    whole = graph.product(product.factors)
                    r = mul(_product_rule(graph, product.factors, moved), product.root)
                    r = add(r, mul(mul(whole, get(product.square, zero)), product.slope))
                else:
                    r = add(mul(da or zero, b), mul(a, db or zero))
            elif c == DIV:
                r = graph.div(graph.sub(da or zero, mul(n, db or zero)), b)
            elif c == DERIVED:
                r = db or zero
                solutions.append(n)
            else:
                r = _chain(graph, n, (da or zero, db or zero))
        if r != zero:
            d[n] = r
    return _with_implicit(graph, solutions, [get(n, zero) for n in outputs])


def _with_implicit(graph: Graph, solutions: Iterable[Node], derivatives: list[Node]) -> list[Node]:
    """Return derivatives through solutions, with these in place of their values, which counted as constants in the formulas of solutions
    (``Graph.derived``): so derivatives of derivatives are those of implicit functions, too."""
    places: dict[Node, Node] = {}
    for n in solutions:
        value, formula = graph.args(n)
        if formula != graph.zero:
            places |= {n: n, graph.derived(value, graph.zero): n}
    return substitute(graph, derivatives, places) if places else derivatives


def tangent(graph: Graph, n: Node, tangents: tuple[Node, ...]) -> Node:
    """Return the derivative of one node from those of its arguments; zero for a leaf."""
    zero, code = graph.zero, graph.op(n)
    if all(t == zero for t in tangents):
        return zero
    match code:
        case c if c == ADD:
            return graph.add(*tangents)
        case c if c == SUB:
            return graph.sub(*tangents)
        case c if c == NEG:
            return graph.neg(*tangents)
        case c if c == MUL:
            (x, y), (dx, dy) = graph.args(n), tangents
            if x == y:
                return graph.mul(graph.mul(graph.two, x), dx)
            if half := half_power(graph, n, ()):
                factor, whole, root = half
                return graph.mul(graph.mul(factor, dx if whole == x else dy), root)
            return graph.add(graph.mul(dx, y), graph.mul(x, dy))
        case c if c == DIV:
            dx, dy = tangents
            return graph.div(graph.sub(dx, graph.mul(n, dy)), graph.args(n)[1])
        case c if c == SELECT:
            return graph.select(graph.args(n)[0], tangents[1], tangents[2])
        case _:
            return _chain(graph, n, tangents)


def _product_rule(graph: Graph, factors: Sequence[Node], tangents: Sequence[Node]) -> Node:
    """Return the derivative of a product from those of its factors."""
    total = graph.zero
    for k, t in enumerate(tangents):
        if t != graph.zero:
            total = graph.add(total, graph.mul(t, graph.product(_without(factors, k))))
    return total


def _without(factors: Sequence[Node], k: int) -> Sequence[Node]:
    return [*factors[:k], *factors[k + 1 :]]


def _chain(graph: Graph, n: Node, tangents: tuple[Node, ...]) -> Node:
    """Return the sum of partial derivatives times tangents, by the rules of the operation."""
    partials = OPERATIONS[graph.op(n)].partials
    arguments = graph.args(n)
    total = graph.zero
    # zip is not strict: no partials means that the derivative vanishes
    for partial, t in zip(partials, tangents, strict=False):
        if t != graph.zero:
            total = graph.add(total, graph.mul(partial(graph, arguments, n), t))
    return total


def vjp(graph: Graph, seeds: Iterable[tuple[Node, Node]], wrt: Sequence[Node]) -> list[Node]:
    """Return the sum over seeds (node, cotangent) of cotangent * d node / d w, for each w.

    The cotangents count as constants. ``wrt`` are usually symbols; the sweep does not pass beyond them.
    """
    seeds = list(seeds)
    if not graph.depend((n for n, _ in seeds), wrt):
        return [graph.zero for _ in wrt]
    code, left, right, zero = graph._code, graph._left, graph._right, graph.zero
    order = graph.reach_of((n for n, _ in seeds), wrt)
    size = (order[-1] if order else -1) + 1
    seeds = [seed for seed in seeds if seed[0] < size]  # the others depend on nothing that is asked for
    leaf = bytearray(size)
    for w in wrt:
        if w < size:
            leaf[w] = 1
    depends = bytearray(leaf) + b"\0"  # the last one is that of arguments that are not there
    branching = False
    dependent: list[Node] = []
    rooted: set[Node] = set()  # square roots, and their products
    for n in order:
        if depends[left[n]] or depends[right[n]]:
            depends[n] = 1
        if code[n] == SELECT:
            branching = True
            if depends[graph._third[n]]:
                depends[n] = 1
        if depends[n]:
            dependent.append(n)
            below = rooted and code[n] in (MUL, NEG) and (left[n] in rooted or right[n] in rooted)
            if (code[n] == SQRT or below) and not leaf[n]:
                rooted.add(n)
    # the results are wanted everywhere, whatever branch they come from
    found = guards(graph, [n for n, _ in seeds]) | dict.fromkeys(wrt) if branching else {}
    sweep = _Reverse(graph, depends, found)
    bars, get, add = sweep.bars, sweep.bars.get, graph.add

    def plainly(n: Node, contribution: Node, user: Node) -> None:
        """Do as ``_Reverse.add_to`` where nothing branches."""
        if depends[n]:
            held = get(n)
            bars[n] = contribution if held is None else add(held, contribution)

    add_to = sweep.add_to if found else plainly
    for n, cotangent in seeds:
        if depends[n] and cotangent != zero:
            held = bars.get(n)
            bars[n] = cotangent if held is None else graph.add(held, cotangent)
    solutions: list[Node] = []
    for n in reversed(dependent):
        bar = get(n)
        if bar is None or bar == zero or leaf[n]:
            continue
        c, a, b = code[n], left[n], right[n]
        if c == ADD:
            add_to(a, bar, n)
            add_to(b, bar, n)
        elif c == SUB:
            add_to(a, bar, n)
            if depends[b]:
                add_to(b, graph.neg(bar), n)
        elif c == MUL:
            if a == b:
                add_to(a, graph.mul(graph.mul(graph.two, a), bar), n)
            elif (code[a] == SQRT or code[b] == SQRT) and (half := half_power(graph, n, wrt)):
                factor, whole, root = half
                add_to(whole, graph.mul(graph.mul(factor, bar), root), n)
            elif n in rooted and (product := rooted_product(graph, n, rooted)):
                through = graph.mul(bar, product.root)
                for k, f in enumerate(product.factors):
                    if depends[f]:
                        add_to(f, graph.mul(through, graph.product(_without(product.factors, k))), n)
                whole = graph.product(product.factors)
                add_to(product.square, graph.mul(graph.mul(bar, whole), product.slope), n)
            else:
                if depends[a]:
                    add_to(a, graph.mul(bar, b), n)
                if depends[b]:
                    add_to(b, graph.mul(bar, a), n)
        elif c == NEG:
            add_to(a, graph.neg(bar), n)
        elif c == DIV:
            quotient = graph.div(bar, b)
            add_to(a, quotient, n)
            if depends[b]:
                add_to(b, graph.neg(graph.mul(quotient, n)), n)
        elif c == SELECT:
            sweep.into_branches(n, bar)
        else:
            if c == DERIVED:
                solutions.append(n)
            arguments = graph.args(n)
            for argument, partial in zip(arguments, OPERATIONS[c].partials, strict=False):
                if depends[argument]:
                    add_to(argument, graph.mul(bar, partial(graph, arguments, n)), n)
    return _with_implicit(graph, solutions, [bars.get(w, zero) for w in wrt])


class _Reverse:
    """The adjoints of a reverse sweep, and the guards they cross."""

    __slots__ = ("bars", "depends", "graph", "guards")

    def __init__(self, graph: Graph, depends: bytearray, found: dict[Node, Guard | None]) -> None:
        self.graph = graph
        self.depends = depends
        self.guards = found
        self.bars: dict[Node, Node] = {}

    def add_to(self, n: Node, contribution: Node, user: Node) -> None:
        """Add to the adjoint of ``n`` what one of its users contributes."""
        if not self.depends[n]:
            return
        if self.guards:
            contribution = self._leave(contribution, self.guards[user], self.guards[n])
        held = self.bars.get(n)
        self.bars[n] = contribution if held is None else self.graph.add(held, contribution)

    def into_branches(self, n: Node, bar: Node) -> None:
        """Pass the adjoint of a select to both branches; each is taken where its condition says so."""
        graph = self.graph
        condition, then, otherwise = graph.args(n)
        for branch, holds in ((then, True), (otherwise, False)):
            if self.depends[branch]:
                inner = Guard(self.guards[n], condition, holds, 0)
                contribution = self._leave(bar, inner, self.guards[branch])
                held = self.bars.get(branch)
                self.bars[branch] = contribution if held is None else graph.add(held, contribution)

    def _leave(self, contribution: Node, inner: Guard | None, outer: Guard | None) -> Node:
        """Make a contribution zero wherever the guards between ``inner`` and ``outer`` do not hold."""
        graph = self.graph
        while inner is not None and not _same(inner, outer):
            chosen = (contribution, graph.zero) if inner.holds else (graph.zero, contribution)
            contribution = graph.select(inner.condition, *chosen)
            inner = inner.outer
        return contribution


def _same(a: Guard, b: Guard | None) -> bool:
    return a is b or (
        b is not None and a.outer is b.outer and a.condition == b.condition and a.holds == b.holds
    )


def gradient(graph: Graph, scalar: Node, wrt: Sequence[Node]) -> list[Node]:
    """Return the derivatives of one node. They are remembered: also for a sum in which nothing else depends on ``wrt``."""
    known, symbols = graph.gradients, tuple(wrt)
    at, negative = scalar, False
    while (at, symbols) not in known:
        opposite = graph._negatives.get(at)
        if opposite is not None and (opposite, symbols) in known:
            at, negative = opposite, not negative
            break
        parts = [k for k, a in enumerate(graph.args(at)) if graph.depend([a], symbols)]
        code = graph.op(at)
        if code not in (ADD, SUB, NEG) or len(parts) != 1:
            at, negative = scalar, False
            known[at, symbols] = vjp(graph, [(scalar, graph.one)], wrt)
            break
        negative ^= code == NEG or (code == SUB and parts == [1])
        at = graph.args(at)[parts[0]]
    if negative and graph.reached_with([at], {SELECT}):
        return vjp(graph, [(scalar, graph.one)], wrt)  # branches have signs of their own
    found = known[at, symbols]
    return [graph.neg(n) for n in found] if negative else list(found)


def jacobian(graph: Graph, outputs: Sequence[Node], wrt: Sequence[Node]) -> list[dict[int, Node]]:
    """Return, for each output, {index in ``wrt``: derivative} of its non-zero derivatives.

    One reverse sweep for each output where they are fewer, else one forward sweep for each w, over the nodes that
    depend on it only.
    """
    if 2 * len(outputs) < len(wrt):
        columns = (vjp(graph, [(n, graph.one)], wrt) for n in outputs)
        return [{j: entry for j, entry in enumerate(row) if entry != graph.zero} for row in columns]
    rows: list[dict[int, Node]] = [{} for _ in outputs]
    users: dict[Node, list[Node]] = {}
    for n in graph.reach(outputs):
        for a in set(graph.args(n)):
            users.setdefault(a, []).append(n)
    for j, w in enumerate(wrt):
        dependent = {w}
        stack = [w]
        while stack:
            for n in users.get(stack.pop(), ()):
                if n not in dependent:
                    dependent.add(n)
                    stack.append(n)
        reached = [i for i, n in enumerate(outputs) if n in dependent]
        column = _forward(graph, sorted(dependent), [outputs[i] for i in reached], {w: graph.one})
        for i, entry in zip(reached, column, strict=True):
            if entry != graph.zero:
                rows[i][j] = entry
    return rows


def is_affine(graph: Graph, nodes: Sequence[Node], symbols: Set[Node]) -> bool:
    """Tell whether nodes are affine in symbols: their derivative in any direction contains none of them."""
    seeds = {s: graph.symbol(f"#direction {k}") for k, s in enumerate(sorted(symbols))}
    return not graph.depend(jvp(graph, nodes, seeds), symbols)


class Guard(Struct, frozen=True, eq=False):
    """Nodes under it matter only where ``condition`` is (``holds``) or is not true, inside ``outer``."""

    outer: Guard | None
    condition: Node
    holds: bool
    depth: int


def guards(graph: Graph, outputs: Iterable[Node]) -> dict[Node, Guard | None]:
    """Return the innermost guard that covers all uses of each node reached; None: always needed.

    Guards are unique: one object for each (outer, condition, holds).
    """
    outputs = list(outputs)
    found: dict[Node, Guard | None] = dict.fromkeys(outputs)
    known: dict[tuple[Guard | None, Node, bool], Guard] = {}
    for n in reversed(graph.reach(outputs)):
        here = found[n]
        arguments = graph.args(n)
        for i, a in enumerate(arguments):
            guard = here
            if i and graph.op(n) == SELECT:
                key = (here, arguments[0], i == 1)
                entered = known.get(key)
                if entered is None:
                    entered = Guard(here, arguments[0], i == 1, here.depth + 1 if here else 1)
                    known[key] = entered
                guard = entered
            found[a] = _common(found[a], guard) if a in found else guard
    return found


def _common(a: Guard | None, b: Guard | None) -> Guard | None:
    """Return the innermost guard that encloses both."""
    while a is not b:
        if a is None or b is None:
            return None
        if a.depth >= b.depth:
            a, b = a.outer, b
        else:
            b = b.outer
    return a
