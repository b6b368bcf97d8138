"""Taylor series of the rates from their program, for the method ``taylor``.

Each operation that is not linear is one or two *slots*, pairs (A, B) of series for which the kernel forms
    M_k = A_1 B_(k-1) + ... + A_(k-1) B_1;
given these sums, the coefficients of order k are linear in each other. So two functions serve every order:

``series_start``: like ``rhs``, and after the rates the numbers that every order reads.
``series_next``: t = k, y = coefficients of order k of the state, u = the sums of the slots, then 1/k and that of t,
z = the numbers kept; gives the coefficients of order k of the rates, of all A and of all B. Each of these three begins
at a multiple of ``LANES``.

A. Jorba, M. Zou, A software package for the numerical integration of ODEs by means of high-order Taylor methods, Exp.
Math. 14, 2005; rules for functions: A. Griewank, A. Walther, Evaluating Derivatives, ch. 13.

Elimination turns two linear equations for two unknowns into a quotient. The equations are recovered:
    q = (N + l u f) / (a - m u w)   with   w q   in the other one
is
    a q = N + u s,   s = l f + m w q.
Their series needs only the products u s and w q, instead of u w, u f, w q and q times the denominator.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Sequence
from typing import Final, NamedTuple

from msgspec.structs import replace

from ..equations.model import Function, Slot
from ..graph import Graph, Node
from ..graph import operations as ops
from ..graph.operations import ADD, MUL, NEG, OPERATIONS, SUB
from ..graph.rewrite import substitute
from .lower import lower_function
from .model import SERIES_NEXT, SERIES_START, Load, Program, ProgramFunction, SeriesPlan
from .slots import HALF, NoSeries, SlotGraph, rates_of

LANES: Final = 8
"""Numbers that the kernel adds at once."""

LARGEST_ROOT: Final = 4
"""Powers by halves up to this are formed by products and a root."""


def with_series(program: Program) -> Program:
    """Return the program with the two functions, or with the reason why there are none."""
    rhs = program.function("rhs")
    if rhs is None:
        return program
    if program.arrays["u"]:
        return replace(program, no_series="it has inputs, of which nothing gives Taylor series")
    if program.switching is not None and program.switching.delays is not None:
        return replace(program, no_series="it has delays, and nothing gives Taylor series of the past")
    places = {share.beside for share in program.switching.shares} if program.switching is not None else set()
    if any(type(s) is Load and s.array == "z" and s.index in places for body in rhs.bodies for s in body):
        return replace(program, no_series="numbers find how loads in it are shared")
    try:
        series = _Series(*rates_of(rhs, program.tables, located=program.switching is not None))
    except NoSeries as reason:
        return replace(program, no_series=str(reason))
    return replace(program, functions=(*program.functions, *series.functions()), series=series.plan())


def without_series(program: Program) -> Program:
    """Return the program without the two functions, which only the kernel calls."""
    functions = tuple(f for f in program.functions if f.name not in (SERIES_START, SERIES_NEXT))
    return replace(program, functions=functions, series=None, no_series="")


def padded(count: int) -> int:
    """Return the next multiple of LANES."""
    return -(-count // LANES) * LANES


def _with_roots(graph: Graph, results: Sequence[Node]) -> tuple[Node, ...]:
    """Return formulas in which powers by small odd halves are square roots, times and over the base: they take a third of the time."""
    known: dict[Node, Node] = {}
    for n in graph.reach(results):
        if graph.op(n) != ops.POW or graph.op(graph.args(n)[1]) != ops.CONST:
            continue
        exponent = graph.value(graph.args(n)[1])
        if exponent.denominator == 2 and abs(exponent) <= LARGEST_ROOT:
            (base,) = substitute(graph, graph.args(n)[:1], known)
            root = graph.mul(graph.power(base, abs(exponent) - HALF), graph.sqrt(base))
            known[n] = root if exponent > 0 else graph.div(graph.one, root)
    return tuple(substitute(graph, results, known))


class _Series:
    """The coefficients of order k of every node, as formulas in those of the state and the sums of the slots."""

    def __init__(self, form: SlotGraph, rates: Sequence[Node]) -> None:
        self.form = form
        self.graph = graph = form.graph
        self.rates = rates
        self.order, self.over, self.time = (graph.symbol(name) for name in ("k", "1/k", "time"))
        self.parameters = {n for (array, _), n in form.symbols.items() if array == "p"}
        self.kept: dict[Node, Node] = {}
        self.slots: dict[tuple[Node, Node, bool], Node] = {}
        self.wanted = frozenset(graph.reach(rates))
        self.states: dict[int, Node] = {}
        self.coefficients: dict[Node, Node] = {}
        for (array, index), n in [*form.symbols.items()]:
            if array == "y":
                self.states[index] = graph.symbol(f"y[{index}]_k")
                self.coefficients[n] = graph.zero if form.constant(n) else self.states[index]
            elif array == "t":
                self.coefficients[n] = self.time
        for n in rates:
            self.find(n)
        self.live(rates)

    def live(self, rates: Sequence[Node]) -> None:
        """Keep the slots and numbers that the rates need; slots need further series, as that of a sine the cosine."""
        slot_of = {n: slot for slot, n in self.slots.items()}
        read, waiting = set[Node](), list(rates)
        while waiting:
            n = waiting.pop()
            self.find(n)
            slot_of |= {n: slot for slot, n in self.slots.items()}
            for m in self.graph.support(self.coefficients[n]):
                if m not in read:
                    read.add(m)
                    waiting += slot_of[m][:2] if m in slot_of else ()
        self.slots = {slot: n for slot, n in self.slots.items() if n in read}
        self.kept = {n: symbol for n, symbol in self.kept.items() if symbol in read}

    def find(self, n: Node) -> None:
        """Find the coefficients of a node and of all below it."""
        if n in self.coefficients:
            return
        still = filter(self.form.constant, self.graph.reach([n], self.coefficients))
        self.coefficients |= dict.fromkeys(still, self.graph.zero)
        for m in self.graph.reach([n], self.coefficients):  # what is below a constant has no say
            self.coefficients[m] = self.rule(m)

    def keep(self, n: Node) -> Node:
        """Return a number of order 0 as the orders read it."""
        if self.graph.is_constant(n) or n in self.parameters:
            return n
        if n not in self.kept:
            self.kept[n] = self.graph.symbol(f"kept[{len(self.kept)}]")
        return self.kept[n]

    def slot(self, a: Node, b: Node, rising: bool = False) -> Node:
        """Return the sum of a new slot, of the series of two nodes; ``rising``: of the first one times the order."""
        key = (a, b, rising)
        if key not in self.slots:
            self.slots[key] = self.graph.symbol(f"sum[{len(self.slots)}]")
        return self.slots[key]

    def rule(self, n: Node) -> Node:
        """Return the coefficient of an operation whose arguments have theirs. Raises NoSeries."""
        if n in self.form.refusals:
            raise NoSeries(self.form.refusals[n])
        graph, form, keep = self.graph, self.form, self.keep
        code, args = graph.op(n), graph.args(n)
        c = [self.coefficients[a] for a in args]
        match code:
            case ops.ADD:
                return graph.add(*c)
            case ops.SUB:
                return graph.sub(*c)
            case ops.NEG:
                return graph.neg(*c)
            case ops.SELECT:
                return graph.select(keep(args[0]), c[1], c[2])
            case ops.MUL if form.constant(args[0]):
                return graph.mul(keep(args[0]), c[1])
            case ops.MUL if form.constant(args[1]):
                return graph.mul(keep(args[1]), c[0])
            case ops.MUL if args[0] == args[1]:
                return graph.add(
                    graph.mul(keep(graph.mul(graph.two, args[0])), c[0]), self.slot(args[0], args[1])
                )
            case ops.MUL:
                cross = graph.add(graph.mul(keep(args[1]), c[0]), self.slot(args[0], args[1]))
                return graph.add(graph.mul(keep(args[0]), c[1]), cross)
            case ops.DIV if (pair := coupled(graph, n, form.constant, self.wanted)) is not None:
                return self.solved(n, pair)
            case ops.DIV:  # q d = n; the denominator, which is late, is one operation from the result
                rest = graph.sub(c[0], self.slot(n, args[1]))
                inverse = n if args[0] == graph.one else graph.div(graph.one, args[1])
                slope = keep(graph.neg(graph.mul(n, inverse)))
                return graph.add(graph.mul(slope, c[1]), graph.mul(keep(inverse), rest))
            case ops.SQRT:  # s s = x
                return graph.mul(keep(graph.div(graph.constant(HALF), n)), graph.sub(c[0], self.slot(n, n)))
            case ops.POW if form.constant(args[1]):
                return self.power(n, *args)
            case ops.POW:  # w' = w (e log x)'; its own partial derivatives would be powers without end
                inner = graph.mul(args[1], graph.log(args[0]))
                self.find(inner)
                rising = graph.mul(self.over, self.slot(inner, n, rising=True))
                return graph.add(graph.mul(keep(n), self.coefficients[inner]), rising)
            case _:
                return self.chain(n, args)

    def solved(self, q: Node, pair: Coupled) -> Node:
        """One of two unknowns: a q = N + u s, with the part of s that q has in it brought to the left."""
        graph, keep, c = self.graph, self.keep, self.coefficients
        factors = graph.args(pair.product)
        product = graph.add(graph.mul(keep(q), c[pair.w]), self.slot(factors[0], factors[1]))
        s = graph.add(
            graph.mul(keep(pair.before_f), c[pair.f]), graph.mul(keep(pair.before_product), product)
        )
        right = graph.add(graph.mul(keep(pair.u), s), self.slot(pair.u, pair.s))
        right = graph.add(graph.mul(keep(pair.s), c[pair.u]), right)
        rest = graph.sum(graph.mul(keep(before), c[n]) for before, n in pair.rest)
        return graph.mul(keep(graph.div(graph.one, graph.args(q)[1])), graph.add(rest, right))

    def power(self, n: Node, x: Node, exponent: Node) -> Node:
        """x w' = e w x'"""
        graph, keep = self.graph, self.keep
        rising = graph.mul(self.over, self.slot(x, n, rising=True))
        rest = graph.sub(graph.mul(keep(graph.add(exponent, graph.one)), rising), self.slot(x, n))
        slope = keep(graph.mul(exponent, graph.div(n, x)))
        inverse = keep(graph.div(graph.one, x))
        return graph.add(graph.mul(slope, self.coefficients[x]), graph.mul(inverse, rest))

    def chain(self, n: Node, args: tuple[Node, ...]) -> Node:
        """F' = the sum of partial derivatives times the rates of the arguments."""
        graph = self.graph
        row = OPERATIONS[graph.op(n)]
        if not row.partials:
            raise NoSeries(f"its rates hold '{row.name}', which has no Taylor series")
        total = graph.zero
        for partial, a in zip(row.partials, args, strict=True):
            if self.form.constant(a):
                continue
            slope = partial(graph, args, n)
            falls = graph.op(slope) == ops.NEG
            slope = graph.args(slope)[0] if falls else slope
            rising = graph.mul(self.over, self.slot(a, slope, rising=True))
            term = graph.add(graph.mul(self.keep(slope), self.coefficients[a]), rising)
            total = graph.sub(total, term) if falls else graph.add(total, term)
        return total

    # ------------------------------------------------------------ what it gives

    def functions(self) -> tuple[ProgramFunction, ProgramFunction]:
        """Return ``series_start`` and ``series_next``."""
        graph, zero = self.graph, self.graph.zero
        place = {n: Slot(array, index) for (array, index), n in self.form.symbols.items()}
        given = _with_roots(graph, (*self.rates, *self.kept))
        start = Function(SERIES_START, "rates, then what all orders of their series read", given)
        a, b = list[Node](), list[Node]()
        for first, second, rising in self.slots:
            c = self.coefficients[first]
            a.append(graph.mul(self.order, c) if rising else c)
            b.append(self.coefficients[second])
        rows = ([self.coefficients[n] for n in self.rates], a, b)
        following = Function(
            SERIES_NEXT,
            "coefficients of order t of the rates, and of both sides of the slots",
            tuple(n for row in rows for n in (*row, *[zero] * (padded(len(row)) - len(row)))),
        )
        layout = {n: slot for n, slot in place.items() if slot.array == "p"}
        layout |= {n: Slot("y", index) for index, n in self.states.items()}
        layout |= {n: Slot("z", index) for index, n in enumerate(self.kept.values())}
        layout |= {n: Slot("u", index) for index, n in enumerate(self.slots.values())}
        behind = padded(len(self.slots))
        layout |= {self.order: Slot("t", 0), self.over: Slot("u", behind), self.time: Slot("u", behind + 1)}
        return (
            lower_function(graph, place, start),
            lower_function(graph, layout, following),
        )

    def plan(self) -> SeriesPlan:
        return SeriesPlan(len(self.slots), len(self.kept))


class Coupled(NamedTuple):
    """What stands in both equations, by the letters above; ``rest``: the terms of N, with the constants before them."""

    rest: tuple[tuple[Node, Node], ...]
    before_f: Node
    f: Node
    u: Node
    w: Node
    before_product: Node
    product: Node
    s: Node


def coupled(
    graph: Graph, q: Node, constant: Callable[[Node], bool], wanted: Collection[Node]
) -> Coupled | None:
    """Return the equations that a quotient comes from, if it does; ``wanted``: nodes whose series are formed anyhow."""
    numerator, denominator = graph.args(q)
    moving = [(before, n) for before, n in _terms(graph, denominator, constant) if not constant(n)]
    if len(moving) != 1 or graph.op(moving[0][1]) != MUL:
        return None
    before, (a, b) = moving[0][0], graph.args(moving[0][1])
    terms = [*_terms(graph, numerator, constant)]
    for u, w in ((a, b), (b, a)):
        product = graph.mul(w, q)
        for k, (before_f, n) in enumerate(terms):
            if product in wanted and graph.op(n) == MUL and u in graph.args(n):
                first, second = graph.args(n)
                f = second if first == u else first
                back = graph.neg(before)
                s = graph.add(graph.mul(before_f, f), graph.mul(back, product))
                return Coupled((*terms[:k], *terms[k + 1 :]), before_f, f, u, w, back, product, s)
    return None


def _terms(graph: Graph, n: Node, constant: Callable[[Node], bool]) -> Iterator[tuple[Node, Node]]:
    """Yield the terms of a sum: a constant, and what it is times."""
    waiting = [(graph.one, n)]
    while waiting:
        before, n = waiting.pop()
        args = graph.args(n)
        match graph.op(n):
            case _ if constant(n):
                yield before, n
            case code if code in (ADD, SUB):
                second = before if code == ADD else graph.neg(before)
                waiting += [(second, args[1]), (before, args[0])]
            case code if code == NEG:
                waiting.append((graph.neg(before), args[0]))
            case code if code == MUL and constant(args[0]):
                waiting.append((graph.mul(before, args[0]), args[1]))
            case code if code == MUL and constant(args[1]):
                waiting.append((graph.mul(before, args[1]), args[0]))
            case _:
                yield before, n
