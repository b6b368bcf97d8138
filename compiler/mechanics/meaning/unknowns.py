"""Outputs that equations determine, as formulas: Newton's method in the graph, from their guesses."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from msgspec import Struct

from mechc.lang.diagnostics import Label

from ...flat.model import FlatModel, Origin
from ...flat.unknowns import UnknownGroup, felt, groups
from ...graph import DivisionByZero, Node
from ...graph.differentiate import jvp
from ...graph.elimination.newton import linear_solution, newton
from ...graph.rewrite import substitute
from .values import Value, elements, filled

if TYPE_CHECKING:
    from .lower import Lowering

POLISH = 2
"""Last steps of what the motion depends on: equations of motion hold second derivatives of energies, and implicit methods
differentiate them once more."""

LARGEST = 1e300
"""Numbers above it are none."""


class SolvedCondition(Struct, frozen=True):
    """Whether a system has been solved, with what to say where it has not."""

    holds: Node
    message: str
    origin: Origin


class UnknownSystem(Struct, frozen=True):
    """Rows that vanish for what is sought: the symbols of ``unknowns`` [n] and their guesses; ``names`` of the outputs."""

    names: tuple[str, ...]
    unknowns: tuple[Node, ...]
    guess: tuple[Node, ...]
    rows: tuple[Node, ...]


class UnknownSystems:
    """Solves each system when one of its unknowns is first asked for."""

    def __init__(self, lowering: Lowering, model: FlatModel) -> None:
        self._lowering = lowering
        self._groups = {u.name: group for group in groups(model) for u in group.unknowns}
        self._shapes = {d.name: d.type.shape for d in model.definitions}
        self._felt = felt(model)
        self._values: dict[str, Value] = {}
        self.found: dict[Node, None] = {}
        """All numbers found: what Newton's method compares inside them is not a condition of the model."""
        self.conditions: list[SolvedCondition] = []
        self.systems: list[UnknownSystem] = []

    def value(self, name: str) -> Value:
        if name not in self._values:
            self._solve(self._groups[name])
        return self._values[name]

    def _solve(self, group: UnknownGroup) -> None:
        from ...graph.elimination.clashes import clash, linear

        lowering, graph = self._lowering, self._lowering.graph
        symbols = {
            u.name: filled(self._shapes[u.name], lambda i, u=u: graph.symbol(f"?{u.name}{list(i)}"))  # type: ignore[misc]
            for u in group.unknowns
        }
        guess = [n for u in group.unknowns for n in lowering.reported(u.guess)]
        known = set(lowering.integrals.errors)
        with lowering.aside():
            for name, value in symbols.items():
                lowering.assign(name, value)
            rows = [
                graph.sub(a, b)
                for e in group.equations
                for a, b in zip(lowering.reported(e.left), lowering.reported(e.right), strict=True)
            ]
            integrals = {k: i for k, i in lowering.integrals.errors.items() if k not in known}
        unknowns = [n for u in group.unknowns for n in elements(symbols[u.name])]
        stated = rows
        rows = [row for row in rows if not graph.is_zero(row)]
        self._check(group, stated, rows, unknowns)
        # what the state enters may agree where the constraints hold
        alone = not set(graph.support(*rows)) - set(unknowns)
        if (
            alone
            and len(rows) > len(unknowns)
            and linear(graph, rows, unknowns)
            and clash(graph, rows, unknowns, guess)
        ):
            raise self._contradicting(group, everywhere=True)
        try:
            polish = POLISH if any(u.name in self._felt for u in group.unknowns) else 1
            found = dict(zip(unknowns, newton(graph, rows, unknowns, guess, polish), strict=True))
        except DivisionByZero:
            if clash(graph, rows, unknowns, guess):
                raise self._contradicting(group, everywhere=linear(graph, rows, unknowns)) from None
            raise self._undetermined(group, "at the guess they leave it open") from None
        self.found |= dict.fromkeys(found.values())
        if polish > 1:
            self._offer_rates(rows, unknowns, list(found.values()))
        names = tuple(u.name for u in group.unknowns)
        lowering.integrals.errors |= {k: i.where(graph, found) for k, i in integrals.items()}
        self.systems.append(UnknownSystem(names, tuple(unknowns), tuple(guess), tuple(rows)))
        for name, value in symbols.items():
            shape = self._shapes[name]
            numbers = iter(elements(value))
            self._values[name] = filled(shape, lambda i, numbers=numbers: found[next(numbers)])  # type: ignore[misc]
        holds = graph.one
        limit = graph.constant(LARGEST)
        for x in found.values():
            holds = graph.logical_and(holds, graph.less_equal(graph.abs(x), limit))
        message = f"no solution for {group.words} is found from the guess"
        self.conditions.append(SolvedCondition(holds, message, group.unknowns[0].origin))

    def _offer_rates(self, rows: Sequence[Node], unknowns: Sequence[Node], values: Sequence[Node]) -> None:
        """Say how the rates of what is found follow from the equations, and the rates of these rates likewise."""
        graph, rate = self._lowering.graph, self._lowering.rate
        made: list[Node] = []

        def rates() -> list[Node]:
            if not made:
                symbols = [graph.symbol(f"{graph.name(u)}'") for u in unknowns]
                along = jvp(graph, rows, dict(zip(unknowns, symbols, strict=True)))
                further = [graph.add(a, rate(row)) for a, row in zip(along, rows, strict=True)]
                further = substitute(graph, further, dict(zip(unknowns, values, strict=True)))
                made.extend(linear_solution(graph, further, symbols))
                self.found |= dict.fromkeys(made)
                self._offer_rates(further, symbols, made)
            return made

        for k, node in enumerate(values):
            rate.offer(node, lambda k=k: rates()[k])  # type: ignore[misc]

    def _check(self, group: UnknownGroup, stated: list[Node], rows: list[Node], unknowns: list[Node]) -> None:
        """Report equations that cannot hold, and too few that say something."""
        graph = self._lowering.graph
        for row in rows:
            if graph.is_constant(row):
                raise self._lowering.reporter.fail(
                    "E0339",
                    f"the equations for {group.words} contradict each other",
                    group.unknowns[0].origin.span,
                    caption="one of them is a false equation between numbers",
                )
        if len(rows) < len(unknowns):
            raise self._undetermined(group, f"{len(stated) - len(rows)} of them hold whatever it is")

    def _contradicting(self, group: UnknownGroup, *, everywhere: bool) -> BaseException:
        numbers = "number" if group.count == 1 else "numbers"
        found = f"no {numbers} fulfil{'s' * (group.count == 1)} them all"
        return self._lowering.reporter.fail(
            "E0339",
            f"the equations for {group.words} contradict each other",
            group.unknowns[0].origin.span,
            caption=found if everywhere else f"from the guess, {found}",
            labels=tuple(Label(e.origin.span, "one of them") for e in group.equations[:4]),
            help="one of them is to be left out, or says something else than is meant",
        )

    def _undetermined(self, group: UnknownGroup, why: str) -> BaseException:
        return self._lowering.reporter.fail(
            "E0339",
            f"the equations do not determine {group.words}",
            group.unknowns[0].origin.span,
            caption=why,
            help="guess another value, or state another equation",
        )
