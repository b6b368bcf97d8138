"""Questions about the motion: the symbols that stand for their answers, and where these come from.

A question is lowered to symbols such as ``?energy()``. What the state decides (energies, momenta, mass centres, whether
a contact is closed) is a formula, found when something first needs it; ``settle`` puts it into formulas that are
differentiated or solved, and rates look through the symbols. Answers about forces are unknowns beside accelerations
and multipliers: their symbols stay until the equations are solved (equations/solve/unknown_forces.py).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from typing import NamedTuple

from mechc.lang.diagnostics import Label, Reporter
from mechc.lang.source import Span

from ...flat.model import Expression, Query
from ...flat.subscripts import element_name
from ...graph import Graph, Node
from ...graph.rewrite import substitute
from ..kinematics.rates import TotalDerivative
from .delays import Delayed
from .symbols import Scalar
from .values import Value, filled

FORCES = frozenset({"reaction", "moment", "multiplier"})
"""Questions whose answers need accelerations or multipliers; so does ``power`` of a friction."""

PREFIX = "?"

Answer = Callable[[Query], Sequence[Node] | None]
"""The numbers of an answer that the state decides, in row-major order; None where there is none."""


class _Step(NamedTuple):
    """One link of a chain of needs: what is needed, and where it is written."""

    words: str
    span: Span | None


def title(query: Query) -> str:
    """Return a question as the user would write it."""
    if query.arguments:
        return query.span.text
    return f"{query.function}({query.target})"


class Questions:
    """All questions of one model. ``answer`` is set once names have a meaning; ``frictions`` are names of such."""

    def __init__(
        self,
        graph: Graph,
        rate: TotalDerivative,
        frictions: frozenset[str],
        unknown_rates: dict[Node, Scalar | Query | Delayed],
        reporter: Reporter,
    ) -> None:
        self.asked: dict[Node, Query] = {}
        self.answer: Answer = lambda query: None
        self.modes: dict[Node, None] = {}
        """Flags of contacts and constraints that answers contain."""
        self._graph = graph
        self._rate = rate
        self._frictions = frictions
        self.unknown_rates = unknown_rates
        self._reporter = reporter
        self._numbered: dict[int, str] = {}
        self._formulas: dict[Node, Node] = {}
        self._open: dict[object, _Step] = {}

    def ask(self, query: Query) -> Value:
        """Return the symbols that stand for the answer to a question."""
        graph = self._graph
        text = title(query)
        if query.arguments:  # which may be lengthy; a question that is lowered again keeps its symbols
            text = self._numbered.setdefault(id(query), f"{query.function}()#{len(self.asked)}")

        def symbol_of(indices: tuple[int, ...]) -> Node:
            symbol = graph.symbol(f"{PREFIX}{element_name(text, indices)}")
            if symbol not in self.asked:
                self.asked[symbol] = query
                self._give_rate(symbol, query)
            return symbol

        return filled(query.type.shape, symbol_of)

    def is_force(self, query: Query) -> bool:
        """Tell whether an answer needs accelerations or multipliers."""
        return query.function in FORCES or (query.function == "power" and query.target in self._frictions)

    def symbols_in(self, nodes: Iterable[Node]) -> list[Node]:
        """Return the symbols of answers on which formulas depend."""
        return [n for n in self._graph.support(*nodes) if n in self.asked] if self.asked else []

    def forces_in(self, nodes: Iterable[Node]) -> list[Node]:
        """Return the symbols of answers about forces on which formulas depend."""
        return [n for n in self.symbols_in(nodes) if self.is_force(self.asked[n])]

    def settle(self, nodes: Sequence[Node]) -> tuple[Node, ...]:
        """Return formulas with every answer that the state decides put in."""
        known = {n: f for n in self.symbols_in(nodes) if (f := self._formula(n)) is not None}
        return tuple(substitute(self._graph, nodes, known)) if known else tuple(nodes)

    def refuse(self, nodes: Sequence[Node], place: str, value: Expression, help: str) -> None:
        """Report a question about forces, or about what is closed, in what must be a function of the state."""
        found = self.forces_in(nodes)
        if found:
            why = "the answer is known only once forces are, and these depend on this"
            self._refuse(self.asked[found[0]], place, value, why, help)
        elif self.modes and self.modes.keys() & set(self._graph.support(*nodes)):
            query = next((q for q in self.asked.values() if q.function == "closed"), None)
            assert query is not None
            self._refuse(query, place, value, "the answer jumps where a contact opens or closes", help)

    def refuse_all(self, nodes: Sequence[Node], place: str, value: Expression, help: str) -> bool:
        """Report any question whose answer is not put in yet; return whether there is none."""
        found = self.symbols_in(nodes)
        if found:
            why = "the answer depends on where the masses are"
            self._refuse(self.asked[found[0]], place, value, why, help)
        return not found

    def _refuse(self, query: Query, place: str, value: Expression, why: str, help: str) -> None:
        message = f"{place} must not depend on '{title(query)}'"
        self._reporter.error("E0535", message, value.span, caption=why, help=help)

    @contextmanager
    def need(self, key: object, words: str, span: Span | None) -> Iterator[None]:
        """Note that something is about to be formed; report it where it is needed for itself."""
        if key in self._open:
            raise self._circle(key)
        self._open[key] = _Step(words, span)
        try:
            yield
        finally:
            del self._open[key]

    # ------------------------------------------------------------ inside

    def _formula(self, symbol: Node) -> Node | None:
        """Return what the state decides; None for a force, and for what has no answer, which is reported later."""
        query = self.asked[symbol]
        if symbol not in self._formulas and not self.is_force(query):
            with self.need(title(query), f"'{title(query)}'", query.span):
                found = self.answer(query)
                if found is None:
                    return None
                numbers = self.settle(found)
            symbols = [n for n, other in self.asked.items() if other is query]
            self._formulas |= zip(symbols, numbers, strict=True)
        return self._formulas.get(symbol)

    def _give_rate(self, symbol: Node, query: Query) -> None:
        """Let rates look through the symbol; those of forces are unknown."""
        rate = self._unknown_rate if self.is_force(query) else self._rate_of
        self._rate.define_later(symbol, lambda: rate(symbol))

    def _unknown_rate(self, symbol: Node) -> Node:
        node = symbol
        for order in (1, 2):
            following = self._graph.symbol(f"#rate {order} of {self._graph.name(symbol)}")
            self._rate.define(node, following)
            self.unknown_rates[following] = self.asked[symbol]
            node = following
        return self._rate(symbol)

    def _rate_of(self, symbol: Node) -> Node:
        formula = self._formula(symbol)
        return self._graph.zero if formula is None else self._rate(formula)

    def _circle(self, key: object) -> Exception:
        """Report a question that is needed for its own answer, with the chain in between."""
        keys = list(self._open)
        chain = [self._open[k] for k in keys[keys.index(key) :]]
        at = next((k for k, step in enumerate(chain) if step.words.startswith("'")), 0)
        chain = [*chain[at:], *chain[:at]]
        first, *others = chain
        circle = " → ".join(step.words for step in (*chain, first))
        return self._reporter.fail(
            "E0534",
            f"{first.words} depends on itself",
            first.span,
            caption="asked for here",
            labels=tuple(Label(step.span, "which is part of its answer") for step in others if step.span),
            help=f"the loop is {circle}; write one of them as a formula of coordinates and their rates",
        )
