"""Expressions of the flat model to values: nodes, tuples of nodes, poses, frames and points."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from fractions import Fraction
from typing import assert_never

from mechc.lang.diagnostics import Reporter
from mechc.lang.source import Span

from ...flat.model import (
    Apply,
    Array,
    Definition,
    Derivative,
    Element,
    Expression,
    FieldDerivative,
    FlatModel,
    Kind,
    Literal,
    Name,
    Origin,
    Previous,
    Quadrature,
    Query,
    Select,
    Unknown,
    Where,
)
from ...graph import DivisionByZero, Graph, Node
from ...graph import operations as ops
from ...graph.rewrite import substitute
from ...graph.vector import quaternion_rotation
from ..kinematics.frames import Frame, FrameKinematics, Point
from ..kinematics.pose import Turn
from ..kinematics.rates import TotalDerivative
from ..modes import Clock
from .delays import Delays
from .functions import FUNCTIONS
from .integrals import Integrals
from .questions import Questions, title
from .symbols import Symbols
from .tables import Tables
from .unknowns import UnknownSystems
from .values import Placement, Value, each, elements, filled, node

RELATIONS = frozenset({"less", "less_equal", "greater", "greater_equal", "equal", "not_equal", "sign"})
"""Functions that jump where their arguments pass each other, so that a run stops there."""

STAIRS = frozenset({"floor", "ceil", "round", "mod", "div"})
"""Functions that jump with the whole part of a number; a run stops there, too."""


class Lowering:
    """Lowers expressions of one model. Definitions are lowered once, when first asked for.

    ``place`` gives the frame of a free frame by name (topology.py). Values keep the symbols of ``questions``; what
    formulas are made of (``scalar``, ``numbers``, ``point``) has the answers that the state decides put in.
    """

    def __init__(
        self,
        graph: Graph,
        symbols: Symbols,
        definitions: Mapping[str, Definition],
        rate: TotalDerivative,
        kinematics: FrameKinematics,
        place: Callable[[Definition], Frame],
        questions: Questions,
        reporter: Reporter,
        model: FlatModel,
    ) -> None:
        self.graph = graph
        self.rate = rate
        self.kinematics = kinematics
        self._symbols = symbols
        self._definitions = definitions
        self._place = place
        self.questions = questions
        self.reporter = reporter
        self._values: dict[str, Value] = dict(symbols.values)
        self._open: dict[str, None] = {}
        self._previous: dict[Node, Node] = {}
        self.unknowns = UnknownSystems(self, model)
        self.integrals = Integrals(graph, symbols, self.numbers, reporter)
        self.delays = Delays(graph, symbols, rate, questions.unknown_rates)
        self.tables = Tables(graph, self.numbers, model.data, self._locate, reporter)
        self.periods: dict[Node, tuple[Node, str, Origin]] = {}
        """What must hold of periods of noise that parameters tell."""
        self.apart: dict[str, tuple[Node, str, Origin]] = {}
        """What must hold of shapes whose distance nothing changes, by the name of their contact."""
        self.relations: dict[Node, None] = {}
        """Conditions that compare numbers, signs and whole parts, as the user wrote them."""
        self.leading: dict[Node, str] = {}
        """Those of them that decide whether a friction sticks, which turn before others are asked, with what they are called."""
        self.clocks: dict[tuple[Node, Node], Clock] = {}
        self.initial: Node | None = None
        """The symbol of ``initial()``, if it is used."""
        self.instants: dict[Node, Span] = {}
        """Where ``sample()`` and ``initial()`` stand, by their symbols: 1 at single instants, 0 at all other times."""
        for coordinate in symbols.coordinates:
            if coordinate.is_rotation:
                q = tuple(s.node for s in coordinate.q)
                spin = tuple(s.node for s in coordinate.v)
                turn = Turn(quaternion_rotation(graph, q), spin, q)
                self._values[coordinate.variable.name] = Placement((turn,))
        self._values["world"] = kinematics.world
        self._values["time"] = symbols.time

    def value(self, expression: Expression) -> Value:
        """Return the value of an expression."""
        if isinstance(expression, Apply):  # most of them
            return self._applied(expression)
        match expression:
            case Literal(value=value):
                return self._literal(value)
            case Name(name=name):
                return self.named(name, expression.span)
            case Element(base=base, indices=indices):
                result = self.value(base)
                if isinstance(result, Placement) and isinstance(base, Name):
                    # R[1] is the scalar part of the quaternion
                    result = self._symbols.values[self._renamed(base.name)]
                if isinstance(result, Point):
                    result = self.kinematics.position(result)
                for i in indices:
                    assert isinstance(result, tuple)
                    result = result[i]
                return result
            case Derivative(operand=operand, order=order):
                self._check_rate(expression, operand)
                return self._derivative(operand, order)
            case Array(elements=items):
                return tuple(self._numbers(self.value(x)) for x in items)
            case Select(condition=condition, then=then, otherwise=otherwise):
                test = node(self.value(condition))
                if self.graph.is_constant(test):  # the other branch may be without a value
                    return self._numbers(self.value(then if test == self.graph.one else otherwise))
                return each(
                    lambda a, b: self.graph.select(test, a, b),
                    self._numbers(self.value(then)),
                    self._numbers(self.value(otherwise)),
                )
            case Query():
                return self.questions.ask(expression)
            case Previous(operand=operand):
                return each(self._pre, self.value(operand))
            case Quadrature():
                return self._quadrature(expression)
            case Unknown(name=name):
                return self.unknowns.value(name)
            case FieldDerivative():
                return self._field_derivative(expression)
            case Where(names=names, values=values, body=body):
                for local, meaning in zip(names, values, strict=True):
                    self._values[local] = self.value(meaning)
                try:
                    return self.value(body)
                finally:
                    for local in names:
                        del self._values[local]
            case _:
                assert_never(expression)

    def _applied(self, expression: Apply) -> Value:
        """Return the value of a function; those that belong to the whole model come first."""
        function, arguments = expression.function, expression.arguments
        match function:
            case "table":
                return self.tables.value(*arguments)
            case "sample":
                pulse = self._sample(*(self.scalar(x) for x in arguments))
                self.instants.setdefault(pulse, expression.span)
                return pulse
            case "initial":
                if self.initial is None:
                    self.initial = self.graph.symbol("initial()")
                    self.instants[self.initial] = expression.span
                return self.initial
            case "delay":
                return self._delayed(expression)
            case "noise":
                from .noise import check_noise, noise, over_period, positive_period

                seed, period = (self.scalar(x) for x in arguments)
                check_noise(self.graph, self._symbols, seed, period, expression.span, self.reporter)
                if self.graph.is_constant(period):
                    return noise(self.graph, seed, self.graph.div(self._symbols.time, period))
                self.periods.setdefault(period, positive_period(self.graph, period, expression.span))
                return noise(self.graph, seed, over_period(self.graph, self._symbols.time, period))
        values = tuple([self.value(x) for x in arguments])
        if function == "eigenvalues":
            self._check_eigenvalues(expression, values[0])
        try:
            result = FUNCTIONS[function](self.kinematics, self.rate, values)
        except DivisionByZero:
            singular = function in ("inverse", "solve")
            raise self.reporter.fail(
                "E0518",
                "the matrix is always singular"
                if singular
                else "division by an expression that is always zero",
                expression.span,
                caption=f"the {'determinant' if singular else 'divisor'} is zero whatever the values",
            ) from None
        if function in RELATIONS:
            self.relations[self.graph.unsigned(node(result))] = None
        if function in STAIRS:
            self.relations |= dict.fromkeys(self._whole_parts(node(result)))
        return result

    def _delayed(self, expression: Apply) -> Value:
        """Return a value as it was; what it compares is located as it comes again."""
        value = self._numbers(self.value(expression.arguments[0]))
        now = self.questions.settle(tuple(elements(value)))
        images = self.delays.images(now, self.scalar(expression.arguments[1]), expression.span, self.reporter)
        within = set(self.graph.reach(list(now)))
        for known in (self.relations, self.unknowns.found):
            asked = [n for n in known if n in within]
            known |= dict.fromkeys(substitute(self.graph, asked, images))
        then = iter(substitute(self.graph, now, images))
        return filled(expression.type.shape, lambda _: next(then))

    def _locate(self, relation: Node) -> None:
        self.relations[relation] = None

    def _check_eigenvalues(self, expression: Apply, value: Value) -> None:
        """Refuse matrices that move, whose eigenvalues may meet, and those that are not symmetric as they are written."""
        matrix = [tuple(elements(row)) for row in value] if isinstance(value, tuple) else []
        if any(not self.graph.is_zero(self.rate(x)) for row in matrix for x in row):
            raise self.reporter.fail(
                "E0315",
                "eigenvalues are those of a matrix of numbers and parameters",
                expression.span,
                caption="this matrix depends on the motion",
                help="'linearize' and 'modes' give the eigenvalues of a motion",
            )
        if any(matrix[i][k] != matrix[k][i] for i in range(len(matrix)) for k in range(i)):
            raise self.reporter.fail(
                "E0315",
                "of parameters a matrix with eigenvalues must be symmetric as it is written",
                expression.span,
                help="declare its parameters 'structural': they are known when compiling, and the matrix may be any",
            )

    def _whole_parts(self, result: Node) -> list[Node]:
        return [n for n in self.graph.reach([result]) if self.graph.op(n) in (ops.FLOOR, ops.MODULO)]

    def _check_rate(self, expression: Expression, operand: Expression) -> None:
        """Report the derivative of an answer about the motion, whose formula is found only afterwards."""
        value = self.value(operand)
        if isinstance(value, Placement):
            return
        for symbol in self.questions.forces_in(elements(self._numbers(value))):
            asked = title(self.questions.asked[symbol])
            raise self.reporter.fail(
                "E0528",
                f"the derivative of '{asked}' is not supported",
                expression.span,
                caption="the answer is a force, whose rate nothing determines",
                help="write the formula itself, in terms of coordinates and their rates",
            )

    def scalar(self, expression: Expression) -> Node:
        """Return the value of a scalar expression."""
        return self.questions.settle((node(self.value(expression)),))[0]

    def numbers(self, expression: Expression) -> tuple[Node, ...]:
        """Return the entries of a numeric expression in row-major order; a point gives its position."""
        return self.questions.settle(self.reported(expression))

    def switching(self, nodes: Sequence[Node]) -> tuple[Node, ...]:
        """Return nodes whose kinks and jumps are switches like those of ``if``: where their rates jump, a run stops."""
        from ...graph.kinks import COMPARING, as_choices

        symbols = self._symbols
        fixed = {s.node for s in (*symbols.parameters, *symbols.discretes)}
        found = self.unknowns.found
        whole = {*found, *self.relations}  # where these change a run stops anyway
        bent = as_choices(self.graph, nodes, fixed, whole)
        compared = (n for n in self.graph.reach(bent, found) if self.graph.op(n) in COMPARING)
        self.relations |= dict.fromkeys(compared)
        return bent

    def reported(self, expression: Expression) -> tuple[Node, ...]:
        """Return the entries of what nothing depends on: its questions are answered when the equations are solved."""
        return tuple(elements(self._numbers(self.value(expression))))

    def frame(self, expression: Expression) -> Frame:
        """Return the frame that an expression of kind FRAME denotes."""
        value = self.value(expression)
        assert isinstance(value, Frame), value
        return value

    def point(self, expression: Expression) -> Point:
        """Return a frame's origin, a point, or world components as a point."""
        value = self.value(expression)
        match value:
            case Point(frame, offset):
                return Point(frame, self.questions.settle(offset))
            case Frame():
                return Point(value, (self.graph.constant(0),) * self.kinematics.size)
            case _:
                return Point(self.kinematics.world, self.questions.settle(tuple(elements(value))))

    def assign(self, name: str, value: Value) -> None:
        """State the value of a name: a placed frame, a coordinate computed by a closure."""
        self._values[name] = value

    @contextmanager
    def aside(self) -> Iterator[None]:
        """Forget all that is lowered inside, and what it compares and integrates."""
        relations, errors, opened = dict(self.relations), dict(self.integrals.errors), self._open
        self._open = {}  # an unknown may be asked for by what its own equations contain
        with self.trial():
            yield
        self.relations, self.integrals.errors, self._open = relations, errors, opened

    @contextmanager
    def trial(self, without: str = "") -> Iterator[None]:
        """Forget all that is lowered inside; ``without`` lowers the names of this instance again."""
        saved = dict(self._values)
        if without:
            own = (name for name in self._definitions if name.startswith(f"{without}."))
            for name in own:
                self._values.pop(name, None)
        yield
        self._values = saved

    @contextmanager
    def anew(self) -> Iterator[None]:
        """Lower all definitions again inside, and forget them."""
        with self.aside():
            for name in self._definitions:
                self._values.pop(name, None)
            yield

    def knows(self, name: str) -> bool:
        """Whether a name has a value."""
        return name in self._values or name in self._definitions

    def named(self, name: str, span: Span | None = None) -> Value:
        """Return the value of a variable or definition."""
        if name in self._values:
            return self._values[name]
        if name not in self._definitions:
            raise self.reporter.fail(
                "E0517",
                f"'{name}' is a coordinate of a joint that closes a loop, so it has no value here",
                span,
                help="use a coordinate of a joint of the tree, or give the joint model a 'closure' for it",
            )
        definition = self._definitions[name]
        assert name not in self._open, f"{name} is defined by itself"  # the flat model has no cycles
        self._open[name] = None
        value = self._place(definition) if definition.value is None else self.value(definition.value)
        del self._open[name]
        self._values[name] = value
        return value

    def _renamed(self, name: str) -> str:
        """Return the variable after a name, through definitions that only give it another one."""
        while name in self._definitions and isinstance(other := self._definitions[name].value, Name):
            name = other.name
        return name

    # ------------------------------------------------------------ kinds of expressions

    def _literal(self, value: Fraction | bool | str) -> Value:
        if isinstance(value, str):
            return value
        if isinstance(value, bool):
            return self.graph.one if value else self.graph.zero
        return self.graph.constant(value)

    def _numbers(self, value: Value) -> Value:
        return self.kinematics.position(value) if isinstance(value, Point) else value

    def _derivative(self, operand: Expression, order: int) -> Value:
        result: Value
        if operand.type.kind is Kind.ROTATION and isinstance(operand, Name):
            result = self._symbols.rates[self._renamed(operand.name)]
            order -= 1
        else:
            result = self._numbers(self.value(operand))
        for _ in range(order):
            result = each(self.rate, result)
        return result

    def _pre(self, operand: Node) -> Node:
        """Return the symbol that stands for the value of a node before the event."""
        symbol = self._previous.get(operand)
        if symbol is None:
            symbol = self._previous[operand] = self.graph.symbol(f"pre({len(self._previous)})")
        return symbol

    def _sample(self, period: Node, start: Node) -> Node:
        """Return the pulse of a clock."""
        key = (period, start)
        if key not in self.clocks:
            number = len(self.clocks) + 1
            pulse, count = self.graph.symbol(f"tick({number})"), self.graph.symbol(f"ticks({number})")
            self.clocks[key] = Clock(period, start, pulse, count)
        return self.clocks[key].pulse

    @property
    def known(self) -> Mapping[str, Value]:
        """What names of variables and definitions have been lowered to."""
        return self._values

    @property
    def previous(self) -> Mapping[Node, Node]:
        """Symbols for values before an event, by the node they are the earlier value of."""
        return self._previous

    def _quadrature(self, expression: Quadrature) -> Value:
        def integrand(place: Node) -> Node:
            self._values[expression.variable] = place
            try:
                return node(self.value(expression.body))
            finally:
                del self._values[expression.variable]

        lower, upper = self.scalar(expression.lower), self.scalar(expression.upper)
        return self.integrals.value(expression, integrand, lower, upper)

    def _field_derivative(self, expression: FieldDerivative) -> Value:
        """Return a derivative by place; what the field compares is looked for at the place itself."""
        from .fields import derivative_of_field

        place = self._numbers(self.value(expression.place))

        def field(at: Value) -> Value:
            self._values[expression.variable] = at
            try:
                return self._numbers(self.value(expression.body))
            finally:
                del self._values[expression.variable]

        compared = dict(self.relations)
        symbols = filled(
            expression.place.type.shape, lambda i: self.graph.symbol(f"?{expression.variable}{list(i)}")
        )
        value = field(symbols)
        self.relations = compared
        field(place)
        return derivative_of_field(self.graph, expression.operator, value, symbols, place)
