"""The equations of one model: what every later stage may ask for, and nothing else.

Normal form. State y = (q, v, x) with sizes nq, nv, nx; inputs u, discrete variables z, parameters p:

    q' = N(q) v          r(q, v, a, x, u, z, p, t) - K(q, t)^T lam = 0          v' = a
    x' = f(t, y, u, z, p)          phi(q, t, p) = 0,  K v + b = 0,  K a + gamma = 0

All functions of the emitted program share one signature (t, y, u, z, p) -> out; ``functions`` lists them.
"""

from __future__ import annotations

from collections.abc import Mapping

from msgspec import Struct

from mechc.lang.source import Span
from mechc.lang.units import UnitError, parse_unit, preferred_unit
from mechc.runtime.interface import PURE, Delay, HybridBranch, ModelInterface, Origin, Quantity, SoughtOutputs

from ..graph import Graph, Node
from .crowd_plan import CrowdPlan

SINGULAR = "singular positions"
"""The topic of the choice that gives multipliers a compliance (singular.py)."""

SINGULAR_MASS = "singular mass matrix"
"""The topic of the choice that gives constraints weights (weights.py)."""


class Slot(Struct, frozen=True):
    """Where a symbol of the graph lives at run time: ``array`` is t, y, u, z or p; of functions of crowds also g, what they
    are given after the inputs."""

    array: str
    index: int


class Function(Struct, frozen=True):
    """One function of the program: ``outputs`` are its results in order."""

    name: str
    doc: str
    outputs: tuple[Node, ...]


class ParameterRule(Struct, frozen=True):
    """How a parameter gets its value: a number, or an expression of other parameters."""

    index: int
    value: Node


EXCHANGED = "exchanged"
"""The part of a curve in which its independent variable is a coordinate, too, over a parameter that nothing knows."""


class Choice(Struct, frozen=True):
    """A decision and its reason, for ``mechc explain``: what was chosen or left out, and why.

    ``fact`` and ``part``: what it is about, where that has a name in needs.py; of a choice among forms ``fact`` says on what it rests:
    inertia, coordinates, constraints, massless.
    """

    topic: str
    decision: str
    reason: str
    fact: str = ""
    part: str = ""


class SwitchText(Struct, frozen=True):
    """A relation that is frozen between events: its index in z, and what it says. ``after``: see ``HybridPlan``."""

    index: int
    text: str
    after: int = 0


class BranchPlan(Struct, frozen=True):
    """One branch of event number ``event``: its function, and how it is shown."""

    event: int
    function: str
    shown: HybridBranch


class RowPlan(Struct, frozen=True):
    """A row that can be switched (``mech_row`` of the kernel); indices into z, -1 for none.

    ``kind``: contact, friction, freewheel, constraint, step. ``normal``: the row of the contact of a friction, the switch of a
    step.
    """

    kind: str
    name: str
    normal: int
    flag: int
    sign: int
    impulse: int
    enabled: int
    span: Span | None = None


class DelayPlan(Struct, frozen=True):
    """What looks back: ``sources`` (array, index) in the order of y, u, z and t; ``delayed`` (index in z, source, delay), by
    ``delays``, of which the function ``delay_times`` gives the values."""

    sources: tuple[tuple[str, int], ...]
    delayed: tuple[tuple[int, int, int], ...]
    delays: tuple[Delay, ...]


class SharePlan(Struct, frozen=True):
    """What a row may share (``mech_share_row`` of the kernel): indices into z of whether it rests on others and of what it carries
    beside its force in the modes; rows of one ``sort`` have forces of one unit. All -1 for a row that shares nothing."""

    rests: int = -1
    beside: int = -1
    sort: int = -1


class HybridPlan(Struct, frozen=True):
    """What switches, and the accounts that impacts are booked in (indices in y; -1: none).

    ``times``: switches that change at a known time, to ``after``; ``clocks``: (pulse, count) in z; ``initial``: the
    number in z that is 1 at the start only; ``total``: the output whose balance is kept; ``carried``: it has a part that is linear in
    the velocities, or a constraint moves by itself, so that what drives the model works at impacts. The functions are
    indicators, indicator_rates, crossing_times, conditions, row_values, respond, and one for each branch. ``slides``: for each switch
    the one of the mode in which the motion slides along its surface, -1 where there is none; empty where no motion slides. ``shares``:
    of each row; empty where no row may share a load that is asked for. ``leading``: how many switches and branches, the first ones, change
    before others are asked. ``told``: the index in z of the number that is 1 while steps that solve for contacts form their rates, and how many
    numbers behind it the function ``told`` gives (told_laws.py).
    """

    switches: tuple[SwitchText, ...]
    times: tuple[SwitchText, ...]
    clocks: tuple[tuple[int, int], ...]
    initial: int
    branches: tuple[BranchPlan, ...]
    rows: tuple[RowPlan, ...]
    simultaneous: bool
    dissipated: int
    supplied: int
    total: int
    crowd: CrowdPlan | None = None
    carried: bool = False
    slides: tuple[int, ...] = ()
    delays: DelayPlan | None = None
    shares: tuple[SharePlan, ...] = ()
    leading: tuple[int, int] = (0, 0)
    told: tuple[int, int] = (-1, 0)


BALANCE = "balance"
"""The function of the laws of bodies and of what joints hold (reported/balance.py)."""
SOUGHT = "sought"
"""The function of the systems of equations for outputs."""


def results_of(sought: SoughtOutputs) -> int:
    """Return how many numbers of the function ``sought`` belong to a system."""
    return len(sought.outputs) + 2 * sought.rows + sought.rows * len(sought.outputs)


class CompilerInterface(ModelInterface, frozen=True, kw_only=True):
    """The interface with what only code reads that is made of the equations."""

    jacobian_pattern: tuple[tuple[int, int], ...] = ()
    """(row, column) of each output of the function ``jacobian``."""
    separable: bool = False
    """q' = v, no first-order states, and accelerations that do not depend on velocities."""
    switching: HybridPlan | None = None
    """None where nothing switches."""
    given: tuple[Quantity, ...] = ()
    """Numbers after the inputs that functions of crowds and the outputs are given (hybrid/crowd.py), then those of ``sought``."""

    @property
    def actions(self) -> frozenset[str]:
        """Functions of events: ``out`` holds y and z when they are called, and they write what changes."""
        return frozenset(b.function for b in self.switching.branches) if self.switching else frozenset()


class Equations(CompilerInterface, frozen=True, kw_only=True):
    """Sizes agree; ``layout`` covers every symbol that ``functions`` use; the graph is acyclic and interned."""

    graph: Graph
    layout: Mapping[Node, Slot]
    parameter_rules: tuple[ParameterRule, ...]
    functions: tuple[Function, ...]
    needs: frozenset[str]
    choices: tuple[Choice, ...]


def quantity(
    name: str,
    kind: str,
    unit: str,
    display: str = "",
    nominal: float | None = None,
    minimum: float | None = None,
    maximum: float | None = None,
    doc: str = "",
    span: Span | None = None,
    interpolation: str = "linear",
    type: str = "real",
) -> Quantity:
    """Return a number of an array, with its place in the source and how its unit is usually written."""
    return Quantity(
        name,
        kind,
        unit,
        display,
        nominal,
        minimum,
        maximum,
        doc,
        origin(span),
        interpolation,
        _usual(unit),
        type,
        _exponents(unit),
    )


def origin(span: Span | None) -> Origin | None:
    """Return a place in the source as plain data, with the text of its line."""
    if span is None:
        return None
    line, column = span.file.position(span.start)
    return Origin(span.file.name, line, column, span.file.line(line))


def _exponents(unit: str) -> tuple[str, ...]:
    """Return the exponents of the base units, as fractions; nothing for a pure number."""
    try:
        dimension = parse_unit(unit).dimension
    except UnitError:
        return ()
    return () if dimension.is_none else tuple(str(one) for one in dimension.exponents)


def _usual(unit: str) -> str:
    """Return how a unit is usually written, or nothing where it is."""
    if unit in PURE or "rad" in unit:
        return ""
    try:
        usual = preferred_unit(parse_unit(unit).dimension)
    except UnitError:  # a quotient that is made for a reader
        return ""
    return "" if usual == unit else usual
