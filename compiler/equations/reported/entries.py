"""Names, units and places at run time of every number of a model."""

from __future__ import annotations

from collections.abc import Collection, Mapping

from msgspec import Struct
from msgspec.structs import replace

from mechc.lang.units import DIMENSIONLESS, parse_unit, unit_of
from mechc.runtime.interface import Quantity

from ...flat.model import Definition, Kind, Variable
from ...flat.operands import idle_parameters
from ...graph import Node
from ...graph.operations import SELECT
from ...mechanics.defaults import default_formulas
from ...mechanics.meaning.symbols import Scalar
from ...mechanics.modes import ImpulseAction, SetAction
from ...mechanics.system import ConstraintRows, DriveRow, MechanicalSystem
from ..model import ParameterRule, Slot, quantity
from ..solve.energies import Energies, supplied_at_instants

_TYPES = {Kind.INTEGER: "integer", Kind.BOOLEAN: "boolean"}


class Layout(Struct, frozen=True):
    """``q_indices``, ``v_indices``: coordinates and velocities that are in y (driven ones are not); ``first_order``: coordinates
    without mass whose rate the balance of forces gives, which are in x; ``guesses``: drives whose guesses follow the motion, after
    them in x as accounts that nobody reads; ``accounts``: energy accounts appended to x. ``slots`` gives the place of every symbol."""

    nq: int
    nv: int
    nx: int
    q_indices: tuple[int, ...]
    v_indices: tuple[int, ...]
    first_order: tuple[int, ...]
    guesses: tuple[DriveRow, ...]
    accounts: tuple[str, ...]
    account_symbols: Mapping[str, Node]
    slots: Mapping[Node, Slot]
    time: Quantity
    states: tuple[Quantity, ...]
    parameters: tuple[Quantity, ...]
    inputs: tuple[Quantity, ...]
    discretes: tuple[Quantity, ...]
    energy: str
    length: str
    dimensionless: bool
    constrained: bool

    @property
    def without_effect(self) -> frozenset[Node]:
        """Guesses in y: whatever they are, the same is found from them."""
        return frozenset(row.guess[0] for row in self.guesses if row.guess is not None)

    def entry(self, scalar: Scalar, kind: str, *, rate: bool = False) -> Quantity:
        """Return the description of one number of a variable."""
        return _entry(scalar, kind, self.dimensionless, rate=rate)


def booked_by_events(system: MechanicalSystem) -> frozenset[str]:
    """Return the accounts that impacts and actions need, whatever the powers are."""
    jumps = any(
        isinstance(action, ImpulseAction) or (isinstance(action, SetAction) and action.moves)
        for branch in system.branches
        for action in branch.actions
    )
    switched = any(rows.mode is not None or _bends(system, rows) for rows in system.constraints)
    names = {"energy.dissipated"} if jumps or switched else set()
    return frozenset(names | ({"energy.supplied"} if jumps else set()))


def _bends(system: MechanicalSystem, rows: ConstraintRows) -> bool:
    """Tell whether a constraint turns somewhere on the way, where it takes what the velocity has across it."""
    graph, reached = system.graph, system.graph.reach(list(rows.residuals))
    asked = [graph.args(n)[0] for n in reached if graph.op(n) == SELECT]
    asked += [n for n in reached if n in system.lowering.tables.points]
    moving = system.symbols.positions | system.symbols.velocities
    return not moving.isdisjoint(graph.support(*asked))


def layout_of(
    system: MechanicalSystem,
    driven: Mapping[Node, Node],
    energies: Energies,
    parts: Collection[str] = (),
) -> Layout:
    """Return where every symbol of a model lives at run time. ``parts``: see needs.py."""
    graph, symbols = system.graph, system.symbols
    pure = system.model.dimensionless
    first_order = first_order_coordinates(system)
    q_indices = tuple(k for k, s in enumerate(system.q) if s.node not in driven and k not in first_order)
    v_indices = tuple(i for i, s in enumerate(system.v) if s.node not in driven)
    powers = {"energy.supplied": energies.supplied, "energy.dissipated": energies.dissipated}
    booked = frozenset(powers) if "accounts" in parts else booked_by_events(system)
    if not energies.reason and supplied_at_instants(system, energies.total):
        booked |= {"energy.supplied"}
    accounts = tuple(name for name, power in powers.items() if name in booked or not graph.is_zero(power))
    guesses = tuple(row for row in system.drives if row.guess is not None)
    if not (q_indices or v_indices or symbols.states or first_order or accounts):
        accounts = ("energy.supplied",)  # everything is prescribed: the run still needs a state
    account_symbols = {name: graph.symbol(f"?{name}") for name in accounts}
    joule = "" if pure else "J"
    states = (
        *(_entry(system.q[k], "coordinate", pure) for k in q_indices),
        *(_entry(system.v[i], "rate", pure, rate=True) for i in v_indices),
        *(_entry(s, "state", pure) for s in symbols.states),
        *(_entry(system.q[k], "state", pure) for k in first_order),
        *(_guess(_entry(system.q[row.q[0]], "account", pure)) for row in guesses),
        *(quantity(name, "account", joule) for name in accounts),
    )
    nodes = (
        *(system.q[k].node for k in q_indices),
        *(system.v[i].node for i in v_indices),
        *(s.node for s in symbols.states),
        *(system.q[k].node for k in first_order),
        *(row.guess[0] for row in guesses if row.guess is not None),
        *account_symbols.values(),
    )
    idle = idle_parameters(system.model)
    slots = {symbols.time: Slot("t", 0)}
    slots |= {n: Slot("y", k) for k, n in enumerate(nodes)}
    for array, scalars in (("u", symbols.inputs), ("z", symbols.discretes), ("p", symbols.parameters)):
        slots |= {s.node: Slot(array, k) for k, s in enumerate(scalars)}
    return Layout(
        nq=len(q_indices),
        nv=len(v_indices),
        nx=len(symbols.states) + len(first_order) + len(guesses) + len(accounts),
        q_indices=q_indices,
        v_indices=v_indices,
        first_order=first_order,
        guesses=guesses,
        accounts=accounts,
        account_symbols=account_symbols,
        slots=slots,
        time=quantity(system.model.independent or "time", "time", "" if pure else "s"),
        states=states,
        parameters=tuple(
            _entry(s, "idle" if s.variable.name in idle else "parameter", pure) for s in symbols.parameters
        ),
        inputs=tuple(_entry(s, "input", pure) for s in symbols.inputs),
        discretes=tuple(_entry(s, "discrete", pure) for s in symbols.discretes),
        energy=joule,
        length="" if pure else "m",
        dimensionless=pure,
        constrained=bool(system.constraints),
    )


def _guess(entry: Quantity) -> Quantity:
    return replace(
        entry, name=f"guess({entry.name})", doc="from where the balance of forces is solved", nominal=None
    )


def first_order_coordinates(system: MechanicalSystem) -> tuple[int, ...]:
    """Return the indices in q of coordinates without mass that are first-order states."""
    rates = {i for row in system.drives if row.balanced and not row.q for i in row.v}
    if not rates:
        return ()
    found, first_q, first_v = [], 0, 0
    for coordinate in system.symbols.coordinates:
        found += [first_q + k for k in range(len(coordinate.v)) if first_v + k in rates]
        first_q, first_v = first_q + len(coordinate.q), first_v + len(coordinate.v)
    return tuple(found)


def _entry(scalar: Scalar, kind: str, pure: bool, *, rate: bool = False) -> Quantity:
    variable = scalar.variable
    attributes = variable.attributes
    rotation = variable.type.kind is Kind.ROTATION
    dimension = variable.type.dimension
    angle = variable.type.angle or (rotation and rate)
    if rate and not pure:
        dimension = dimension / parse_unit("s").dimension
        unit = f"{unit_of(DIMENSIONLESS, angle) or '1'}/s" if variable.type.dimension == DIMENSIONLESS else ""
    else:
        unit = ""
    unit = unit or unit_of(dimension, angle, "" if rate else attributes.display)
    return quantity(
        scalar.name,
        kind,
        unit,
        "" if rate else attributes.display,
        None if rate else attributes.nominal,
        None if rate else attributes.minimum,
        None if rate else attributes.maximum,
        variable.doc,
        variable.origin.span,
        attributes.options.get("interpolation", "linear"),
        _TYPES.get(variable.type.kind, "real"),
    )


def declared(of: Variable | Definition, name: str, kind: str, unit: str | None = None) -> Quantity:
    """Return the description of one number of what a model declares; ``unit``: in place of that of its type."""
    said, type = of.attributes, of.type
    if unit is None:
        unit = unit_of(type.dimension, type.angle, said.display)
    numbers = said.nominal, said.minimum, said.maximum
    return quantity(name, kind, unit, said.display, *numbers, of.doc, of.origin.span)


def momentum_unit(scalar: Scalar, layout: Layout) -> str:
    """Return the unit of the momentum of a velocity: J divided by the unit of the rate."""
    if layout.dimensionless:
        return ""
    second = parse_unit("s").dimension
    dimension = parse_unit("J").dimension * second / scalar.variable.type.dimension
    return unit_of(dimension, angle=False)


def parameter_rules(system: MechanicalSystem) -> tuple[ParameterRule, ...]:
    """Return how parameters follow from others."""
    formulas = default_formulas(system, system.symbols.parameters)
    return tuple(
        ParameterRule(k, formulas[s.node])
        for k, s in enumerate(system.symbols.parameters)
        if s.node in formulas
    )
