"""What programs hold that a library differentiates: formulas with the derivatives of what steps find, and of these no derivative.

Derivatives of the steps are no good: a choice that is not taken may have an infinite one, and 0 * NaN is NaN. So the steps count as
constants, ``derived(value, 0)``, where they are written out, and where the library repeats them in a loop (``Program.solutions``).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import chain

from msgspec import Struct
from msgspec.structs import replace

from ..equations.model import Equations, Function, Slot
from ..graph import Graph, Node
from ..graph.operations import ACOS, ADD, DERIVED
from ..graph.rewrite import substitute
from ..graph.signs import one_sign
from ..graph.solution import Solution, SolutionImage, SolutionPart


class SolutionPlan(Struct, frozen=True):
    """A solution that is lowered to a ``ProgramSolution``."""

    guess: Function
    rows: Function
    symbols: tuple[Node, ...]
    places: tuple[tuple[int, int], ...]
    needs: tuple[int, ...]
    inner: tuple[int, ...]


def in_formulas(equations: Equations, loops: bool) -> tuple[Equations, Sequence[SolutionPlan]]:
    """Return the equations with formulas in place of what has their derivatives; with ``loops`` what they read, and where it lies."""
    graph = equations.graph
    formulas, parameters = Formulas(graph, loops), Formulas(graph, False)
    outputs = [n for f in equations.functions for n in f.outputs]
    chosen = dict(zip(outputs, formulas.of(outputs), strict=True))
    rules = parameters.of([rule.value for rule in equations.parameter_rules])
    changed = replace(
        equations,
        functions=tuple(replace(f, outputs=tuple(chosen[n] for n in f.outputs)) for f in equations.functions),
        parameter_rules=tuple(
            replace(r, value=n) for r, n in zip(equations.parameter_rules, rules, strict=True)
        ),
        layout={**equations.layout, **formulas.slots()},
    )
    return changed, formulas.in_order()


class Formulas:
    """What stands for nodes; with ``loops`` also for solutions, and how these are found."""

    def __init__(self, graph: Graph, loops: bool) -> None:
        self.graph, self.loops = graph, loops
        self.known: dict[Node, Node] = {}
        self.images: dict[tuple[int, ...], Solution] = {}
        self.symbols: dict[tuple[Node, ...], tuple[Node, ...]] = {}
        """What stands for the numbers of solutions, by all of their formulas."""
        self.of_symbol: dict[Node, int] = {}
        self.open: list[int] = []
        """Solutions whose formulas are being looked through, in which others may lie that read the unknowns."""
        self.plans: dict[int, SolutionPlan] = {}
        """By the index of their symbols, each after those that it reads."""
        self.within: dict[int, tuple[int, ...]] = {}
        """The solutions whose unknowns one reads, the outermost one first."""

    def of(self, nodes: Sequence[Node]) -> list[Node]:
        """Return nodes with formulas in place of what has their derivatives."""
        graph = self.graph
        ends = {n for n in graph.reached_with(nodes, {DERIVED, ACOS}) if self._ends(n)}
        for n in graph.depth_first(nodes, ends):
            if n in ends and n not in self.known:
                self.known[n] = self._image(n)
        return substitute(graph, nodes, self.known)

    def _ends(self, n: Node) -> bool:
        """Tell whether something else stands for a node."""
        return self.graph.op(n) == DERIVED or _beyond(self.graph, *self.graph.args(n))

    def _image(self, n: Node) -> Node:
        graph = self.graph
        if graph.op(n) == ACOS:
            return graph.acos(graph.two)  # the same, without a derivative
        value, formula = graph.args(n)
        found = self._looped(graph.derived(value, graph.zero)) if self.loops else None
        if found is not None:
            return found
        if formula != graph.zero:
            return self.of([formula])[0]
        return graph.derived(self.of([value])[0], graph.zero) if self.loops else self.of([value])[0]

    def _looped(self, n: Node) -> Node | None:
        """Return the symbol of a number that a loop finds; None where its equations are not known."""
        graph = self.graph
        part = _part_of(graph, n, self.images)
        if part is None:
            return None
        raw = part.solution
        slopes = [m for row in raw.slopes for m in row.values()]
        terms = [m for row in raw.terms for m in row]
        key = (*raw.unknowns, *raw.guess, *raw.rows, *slopes, *terms)
        if key not in self.symbols:
            begin, index = len(self.of_symbol), len(self.symbols)
            symbols = tuple(graph.symbol(f"#found {begin + k}") for k in range(len(raw.unknowns)))
            self.symbols[key] = symbols
            self.of_symbol |= dict.fromkeys(symbols, index)
            self.open.append(index)
            sizes = [graph.sum(map(graph.abs, row)) for row in raw.terms]
            own = dict(zip(raw.unknowns, symbols, strict=True))
            rest = substitute(graph, [*raw.rows, *sizes, *slopes], own)
            guess, rest = self.of(raw.guess), self.of(rest)
            self.open.pop()
            places = tuple((i, j) for i, row in enumerate(raw.slopes) for j in row)
            self._plan(index, guess, rest, symbols, places)
        return self.symbols[key][part.index]

    def _plan(
        self,
        index: int,
        guess: Sequence[Node],
        rows: Sequence[Node],
        symbols: tuple[Node, ...],
        places: tuple[tuple[int, int], ...],
    ) -> None:
        """State how a solution is found, and which others before it, or inside of its rows."""
        support = self.graph.support(*guess, *rows)
        reads = {self.of_symbol[n] for n in support if n in self.of_symbol} - {index}
        inner = [k for k in self.plans if self.within[k][-1:] == (index,)]
        needs = reads.union(*(self.plans[k].needs for k in inner)) - {index, *inner}
        outer = needs.union(*(self.within.get(k, ()) for k in needs))
        self.within[index] = tuple(k for k in self.open if k in outer)
        self.plans[index] = SolutionPlan(
            Function(f"guess_{index}", "What a solution is looked for from.", tuple(guess)),
            Function(f"rows_{index}", "Rows that vanish, sizes of their terms, derivatives.", tuple(rows)),
            symbols,
            places,
            tuple(sorted(needs)),
            tuple(inner),
        )

    def slots(self) -> dict[Node, Slot]:
        """Return where the symbols of solutions lie."""
        return {n: Slot("s", k) for k, n in enumerate(self.of_symbol)}

    def in_order(self) -> list[SolutionPlan]:
        """Return the solutions, each after those that it needs, by their new numbers."""
        place = {index: k for k, index in enumerate(self.plans)}
        return [
            replace(
                plan,
                needs=tuple(sorted(place[k] for k in plan.needs if k in place)),
                inner=tuple(place[k] for k in plan.inner),
            )
            for plan in self.plans.values()
        ]


def _beyond(graph: Graph, argument: Node) -> bool:
    """Tell whether an argument is seen to be two and more: an inverse cosine of that says that there is no number."""
    if graph.op(argument) != ADD or graph.two not in graph.args(argument):
        return False
    (rest,) = (a for a in graph.args(argument) if a != graph.two)
    return one_sign(graph, [(rest, graph.one)], {}, 1)


def _part_of(graph: Graph, n: Node, found: dict[tuple[int, ...], Solution]) -> SolutionPart | None:
    """Return what a node is of which solution, with own symbols for the unknowns; None where that is not known. ``found``: those that
    were asked for."""
    steps: list[Mapping[Node, Node]] = []
    known = graph.solutions.get(n)
    while isinstance(known, SolutionImage):
        steps.append(known.replacements)
        known = graph.solutions.get(known.of)
    if known is None:
        return None
    key = (known.solution.number, *map(id, steps))
    if key not in found:
        found[key] = _image_of(graph, known.solution, steps)
    return SolutionPart(found[key], known.index)


def _image_of(graph: Graph, solution: Solution, steps: Sequence[Mapping[Node, Node]]) -> Solution:
    """Return what replacements, the last ones first, make of a solution with own symbols for its unknowns."""
    own = {u: graph.symbol(f"#unknown {solution.number}.{k}") for k, u in enumerate(solution.unknowns)}
    guess = list(solution.guess)
    rest = [
        *solution.rows,
        *chain.from_iterable(row.values() for row in solution.slopes),
        *chain.from_iterable(solution.terms),
    ]
    rest = substitute(graph, rest, own)
    for replacements in reversed(steps):
        both = substitute(graph, [*guess, *rest], replacements)
        guess, rest = both[: len(guess)], both[len(guess) :]
    numbers = iter(rest)
    rows = tuple(next(numbers) for _ in solution.rows)
    slopes = tuple({j: next(numbers) for j in row} for row in solution.slopes)
    terms = tuple(tuple(next(numbers) for _ in row) for row in solution.terms)
    return Solution(solution.number, tuple(own.values()), tuple(guess), rows, slopes, terms)
