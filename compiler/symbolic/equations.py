"""What there is to write about a model: its Lagrangian, equations of motion, constraints, momenta."""

from __future__ import annotations

from fractions import Fraction
from math import pi

import sympy as sp
from msgspec import Struct

from ..equations.rows.constraints import rows_of
from ..equations.rows.residual import residual
from ..equations.solve.energies import energies
from ..equations.solve.solved import prescribed_motion
from ..graph import Node
from ..graph.rewrite import substitute
from ..mechanics.modes import Mode
from ..mechanics.system import MechanicalSystem
from .abbreviations import Abbreviations, written_size
from .express import express, factored
from .names import latex_name, symbols_of
from .trigonometry import shorten

LARGEST_FRACTION = 16
"""Fractions with larger denominators are written as decimals where these end."""

LARGEST_SHARE = 720
"""Numbers are recognised as shares of pi with denominators up to this; other long fractions become decimals."""

EPSILON = 2.0**-52

SWITCHED = {
    "contact": ("Contacts", "gaps and their forces are never negative, and one of both is zero"),
    "friction": ("Dry friction", "the velocity of sliding is zero, or the force is at its limit"),
    "freewheel": (
        "Friction of one way",
        "the velocity of sliding is never negative; it is zero, or the force is at its limit",
    ),
    "regularized": (
        "Regularized friction",
        "the force is its limit times tanh of this velocity over v_stick",
    ),
}
"""Title and meaning of what switches, by its kind."""

LONG = 600
"""Expressions that would be written with more operations than this are not simplified."""

LONG_LINE = 160
"""Where an expression has more operations than this when simplified, what stands in several places gets a name."""

SHOW_LIMIT = 5000
"""Where there are more operations than this in all expressions, with names for parts, none is shown but its size."""


class EquationLine(Struct, frozen=True):
    """``left = right``; ``right`` None where the expression is too large to be shown (``operations``)."""

    left: str
    right: sp.Expr | None
    operations: int


class EquationSection(Struct, frozen=True):
    """Statements under a title, and in ``meaning`` what they say if that is not plain."""

    title: str
    statements: tuple[EquationLine, ...]
    meaning: str = ""


class EquationList(Struct, frozen=True):
    """What is written about a model: ``equations`` are residuals that vanish, one for each free velocity.

    ``constraints`` vanish always, ``switched`` are gaps and the velocities on which dry friction acts.
    ``prescribed`` are the driven coordinates, ``states`` the rates of first-order states. ``events``: how many
    branches of `when` there are, which are not written.
    """

    name: str
    doc: str
    lagrangian: EquationLine
    dissipation: EquationLine | None
    equations: tuple[EquationLine, ...]
    states: tuple[EquationLine, ...]
    prescribed: tuple[EquationLine, ...]
    constraints: tuple[EquationLine, ...]
    switched: tuple[EquationSection, ...]
    momenta: tuple[EquationLine, ...]
    cyclic: tuple[str, ...]
    events: int
    abbreviations: tuple[EquationLine, ...] = ()
    further: tuple[EquationSection, ...] = ()

    def sections(self) -> tuple[EquationSection, ...]:
        """Return what is written, in its order; nothing is empty. ``further``: all there is of a curve."""
        if self.further:
            return self.further
        listed = (
            EquationSection("Lagrangian", (self.lagrangian,) if self.equations or self.prescribed else ()),
            EquationSection(
                "Dissipation function", (self.dissipation,) if self.dissipation is not None else ()
            ),
            EquationSection("Equations of motion", self.equations),
            EquationSection("Equations of further states", self.states),
            EquationSection("Prescribed motion", self.prescribed),
            EquationSection("Constraints", self.constraints, "each expression vanishes"),
            *self.switched,
            EquationSection("Momenta", self.momenta),
            EquationSection("Abbreviations", self.abbreviations),
        )
        return tuple(section for section in listed if section.statements)


def account_of(system: MechanicalSystem, *, latex: bool) -> EquationList:
    """Return what there is to write, with symbols named for text or for LaTeX."""
    graph = system.graph
    symbols = symbols_of(system, latex)
    driven, prescribed = prescribed_motion(system)
    still = {n: graph.zero for moved in system.virtual.values() for n in moved.values}
    replace = {**driven, **still}
    free = [i for i in range(len(system.v)) if i not in prescribed]
    multipliers, titles = _multipliers(system, symbols, latex)
    rows = residual(system, multipliers)
    r = substitute(graph, [rows[i] for i in free], replace)
    energy = energies(system, replace, free, graph.zero, graph.zero)
    (further,) = substitute(graph, [system.lagrangian], replace)
    lagrangian = graph.add(graph.sub(energy.kinetic, energy.potential), further)
    constraints = rows_of(system, multipliers, replace)
    positions = [row.rate if row.position is None else row.position for row in constraints]
    given = [(symbols[node].name, value) for node, value in driven.items() if node not in system.a]
    rates = [(symbols[system.rate(state)].name, rate) for state, rate in system.xdot.items()]
    state_rates = substitute(graph, [rate for _, rate in rates], replace)
    momenta = [energy.momenta[i] for i in free]
    shown = [lagrangian, system.dissipation, *r, *positions, *state_rates, *(n for _, n in given)]
    write = _Writer(system, [*shown, *(m for m in momenta if m is not None)], symbols, latex=latex)
    kinds: dict[str, list[EquationLine]] = {"constraint": [], **{kind: [] for kind in SWITCHED}}
    for row, position, title in zip(constraints, positions, titles, strict=True):
        kinds[_kind(row.constraint.mode)].append(write(title, position))
    cyclic = tuple(system.v[i].of for i in energy.cyclic)
    has_dissipation = not graph.is_constant(system.dissipation)
    return EquationList(
        system.model.name,
        system.model.doc,
        write("L", lagrangian),
        write("R", system.dissipation) if has_dissipation else None,
        tuple(write("0", n) for n in r),
        tuple(write(name, n) for (name, _), n in zip(rates, state_rates, strict=True)),
        tuple(write(name, n) for name, n in given),
        tuple(kinds["constraint"]),
        tuple(
            EquationSection(title, tuple(kinds[kind]), meaning) for kind, (title, meaning) in SWITCHED.items()
        ),
        tuple(
            write(rf"p_{{{latex_name(system.v[i].of)}}}" if latex else f"p[{system.v[i].of}]", m)
            for i, m in zip(free, momenta, strict=True)
            if m is not None
        ),
        cyclic,
        len(system.branches),
        write.abbreviations(),
    )


class _Writer:
    """Writes expressions: simplified where all of them are short then, else with names for what stands in several places."""

    def __init__(
        self, system: MechanicalSystem, nodes: list[Node], symbols: dict[Node, sp.Symbol], *, latex: bool
    ) -> None:
        graph = system.graph
        self.graph = graph
        self.plain: dict[Node, sp.Expr] = {}
        self.short: Abbreviations | None = None
        if written_size(graph, nodes, symbols) > LONG:
            if graph.count_operations(nodes) <= SHOW_LIMIT:
                self.short = Abbreviations(graph, nodes, symbols, latex=latex)
            return
        written = dict(zip(nodes, express(graph, nodes, symbols), strict=True))
        longest, total, named = 0, 0, -1
        for node in sorted(written, key=lambda n: -graph.count_operations([n])):
            self.plain[node] = _tidy(written[node], symbols, system)
            size = int(sp.count_ops(self.plain[node]))
            longest, total = max(longest, size), total + size
            if longest <= LONG_LINE:
                continue
            if named < 0:
                short = Abbreviations(graph, nodes, symbols, latex=latex)
                named = short.size(nodes)
            if named < total:  # whatever the others come to
                self.short = short
                return

    def __call__(self, left: str, node: Node) -> EquationLine:
        operations = self.graph.count_operations([node])
        if self.short is not None:
            return EquationLine(left, decimals(self.short.express(node)), operations)
        return EquationLine(left, decimals(self.plain[node]) if self.plain else None, operations)

    def abbreviations(self) -> tuple[EquationLine, ...]:
        """Return what the names stand for."""
        if self.short is None:
            return ()
        count = self.graph.count_operations
        return tuple(EquationLine(name, decimals(e), count([node])) for name, node, e in self.short.defined)


def _kind(mode: Mode | None) -> str:
    if mode is None:
        return "constraint"
    return "regularized" if mode.smooth is not None else mode.kind


def _multipliers(
    system: MechanicalSystem, symbols: dict[Node, sp.Symbol], latex: bool
) -> tuple[list[tuple[Node, ...]], list[str]]:
    """Return a symbol for the multiplier of each constraint row, and the title of each row."""
    multipliers, titles = [], []
    for n, constraint in enumerate(system.constraints):
        nodes = []
        for k in range(len(constraint.residuals)):
            node = system.graph.symbol(f"#shown {n}.{k}")
            title = constraint.name if len(constraint.residuals) == 1 else f"{constraint.name}[{k + 1}]"
            name = rf"\lambda_{{{latex_name(title)}}}" if latex else f"lambda[{title}]"
            symbols[node] = sp.Symbol(name)
            nodes.append(node)
            titles.append(title)
        multipliers.append(tuple(nodes))
    return multipliers, titles


def _tidy(expression: sp.Expr, symbols: dict[Node, sp.Symbol], system: MechanicalSystem) -> sp.Expr:
    """Simplify small expressions and order them by accelerations."""
    simple = shorten(expression)
    accelerations = [symbols[a] for a in system.a if a in symbols]
    present = [a for a in accelerations if simple.has(a)]
    if not present:
        quotients = any(power.base.is_Add and power.exp.is_negative for power in simple.atoms(sp.Pow))
        factors = quotients and sp.count_ops(simple) <= LONG_LINE
        return factored(simple) if factors else simple
    return _collected(simple, present)


def _collected(expression: sp.Expr, accelerations: list[sp.Symbol]) -> sp.Expr:
    """Return a sum ordered by accelerations, common factors of each share taken out."""
    shares: dict[sp.Expr, list[sp.Expr]] = {}
    for term in sp.Add.make_args(expression):
        found = [factor for factor in sp.Mul.make_args(term) if factor in accelerations]
        rest = term / found[0] if found else term
        if not rest.free_symbols.isdisjoint(accelerations):  # not linear in them as it stands
            return sp.collect(expression, accelerations, sp.factor_terms)
        shares.setdefault(found[0] if found else sp.S.One, []).append(rest)
    return sp.Add(*(_common_factors(terms) * what for what, terms in shares.items()))


def _common_factors(terms: list[sp.Expr]) -> sp.Expr:
    """Return a sum with common factors taken out, also of sums within its terms."""
    if len(terms) == 1 and not terms[0].has(sp.Add):
        return terms[0]
    return sp.factor_terms(sp.Add(*terms))


def decimals(expression: sp.Expr) -> sp.Expr:
    """Write fractions such as 981/200 as the decimal that a reader expects, angles as shares of pi."""
    exchange: dict[sp.Rational, sp.Expr] = {}
    for number in expression.atoms(sp.Rational):
        size = float(abs(number))
        turns = Fraction(size / pi).limit_denominator(LARGEST_SHARE)
        if number.q <= LARGEST_FRACTION:
            continue
        if number.q > LARGEST_SHARE and turns and abs(float(turns) * pi - size) <= 4 * EPSILON * size:
            shown = sp.pi * sp.Rational(turns.numerator, turns.denominator)
        elif set(sp.factorint(number.q, limit=7)) <= {2, 5} or number.q > LARGEST_SHARE:
            shown = sp.Symbol(f"{size:.12g}", positive=True)
        else:
            continue
        exchange[number] = -shown if number < 0 else shown
    return expression.xreplace(exchange)
