"""Quantities of a state with their rates and gradients, for studies that look for what is constant.

Momenta and the energy; linear and angular momentum of all bodies; the functions of which the Lagrangian is made (sines,
cosines, exponentials, reciprocals: *atoms*); declared outputs. Each entry is named by its formula in the language where that
is short; ``doc`` says in words what it is.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from fractions import Fraction
from random import Random

from msgspec import Struct

from mechc.runtime.interface import Quantity

from ...graph import Graph, Node
from ...graph import operations as ops
from ...graph.differentiate import jacobian, jvp, vjp
from ...graph.evaluate import evaluate
from ...graph.vector import Vector, add, cross, scale
from ...mechanics.energies import kinetic_energy, potential_energy
from ...mechanics.system import MechanicalSystem
from ..model import Function, quantity
from ..solve.solved import Solved
from .entries import Layout, momentum_unit
from .momenta import MOST_BODIES, totals

ARBITRARY = Fraction(1_299_709, 1_299_721)
"""The rate of every input, which nothing knows: nothing can be constant thanks to it."""

SHORT = 60
"""Characters of a momentum that is written out; a longer one is asked for by its name."""

MOST_ATOMS = 40

SINGULAR = 1e-10
"""Share of its usual value below which the determinant of a mass matrix vanishes."""

_FUNCTIONS = frozenset(
    row.code
    for row in ops.OPERATIONS
    if (row.partials or row.code == ops.SELECT)
    and not row.form
    and not row.jumps
    and row.code not in (ops.SIN, ops.COS, ops.SQRT)
)
"""All that is neither arithmetic nor a jump, but for those that are looked at apart."""


class Phase(Struct, frozen=True):
    """``entries`` describe the results of ``phase`` and, in this order, the rows of its rates and gradients."""

    entries: tuple[Quantity, ...]
    functions: tuple[Function, ...]


class _Found(Struct, frozen=True):
    kind: str
    doc: str
    unit: str
    node: Node
    name: str = ""
    """Instead of its formula."""


def phase_functions(system: MechanicalSystem, solved: Solved, layout: Layout, rates: Sequence[Node]) -> Phase:
    """Return the quantities of a model with their rates along the motion and their gradients by coordinates and
    velocities. ``rates``: those of the state, in its order."""
    from ...graph.to_source import written

    graph = system.graph
    names = _names(layout)
    found = [
        *_momenta(system, solved, layout, names),
        _Found("energy", "energy function", layout.energy, solved.energies.total, ""),
        _Found("potential", "potential energy", layout.energy, solved.energies.potential),
        *_world(system, layout),
        *_atoms(system, solved, layout),
        *(_Found("output", "output", "", row.node, row.name) for row in system.outputs),
    ]
    nodes = solved.resolve([one.node for one in found])
    entries = tuple(
        quantity(
            one.name or written(graph, node, names),
            one.kind,
            one.unit,
            doc=one.doc,
        )
        for one, node in zip(found, nodes, strict=True)
    )
    by_index = {slot.index: n for n, slot in layout.slots.items() if slot.array == "y"}
    states = [by_index[k] for k in range(len(by_index))]
    along = dict(zip(states, rates, strict=True))
    along |= {n: graph.constant(ARBITRARY) for n, slot in layout.slots.items() if slot.array == "u"}
    along |= {n: graph.one for n, slot in layout.slots.items() if slot.array == "t"}
    moving = states[: layout.nq + layout.nv]
    gradients = jacobian(graph, nodes, moving)
    dense = [row.get(j, graph.zero) for row in gradients for j in range(len(moving))]
    return Phase(
        entries,
        (
            Function("phase", "quantities of the state", nodes),
            Function("phase_rate", "their rates along the motion", tuple(jvp(graph, nodes, along))),
            Function("phase_gradient", "their derivatives by q and v, row by row", tuple(dense)),
        ),
    )


def _names(layout: Layout) -> dict[Node, str]:
    entries = {
        "t": (layout.time,),
        "y": layout.states,
        "u": layout.inputs,
        "z": layout.discretes,
        "p": layout.parameters,
    }
    return {n: entries[slot.array][slot.index].name for n, slot in layout.slots.items()}


def _momenta(
    system: MechanicalSystem, solved: Solved, layout: Layout, names: Mapping[Node, str]
) -> list[_Found]:
    """Return the momentum of each free velocity: written out where that is short, else asked for by its name."""
    turning = {first + k for _, first in system.rotations for k in range(3)}
    found = []
    for i in solved.free:
        from ...graph.to_source import written

        momentum, scalar = solved.energies.momenta[i], system.v[i]
        assert momentum is not None, "free velocities have momenta"
        (node,) = solved.resolve([momentum])
        text = written(system.graph, node, names, SHORT)
        if not text and i not in turning:
            text = f"momentum({scalar.of})"
        what = f"momentum of {scalar.of}" if i not in turning else f"angular momentum {scalar.of}"
        found.append(_Found("momentum", what, momentum_unit(scalar, layout), momentum, text))
    return found


def _world(system: MechanicalSystem, layout: Layout) -> list[_Found]:
    """Return linear and angular momentum of all bodies and the moment of their masses, in the axes of the world."""
    found = _turns(system, layout)
    if not (system.masses or system.inertias) or len(system.masses) > MOST_BODIES:
        return found
    graph, kinematics = system.graph, system.kinematics
    linear, angular = totals(system)
    moment: Vector = (graph.zero,) * kinematics.size
    for mass in system.masses:
        moment = add(graph, moment, scale(graph, mass.mass, kinematics.position(mass.point)))
    pure = layout.dimensionless
    units = ("", "", "") if pure else ("kg.m/s", "kg.m^2/s", "kg.m")
    axes = "xyz" if len(angular) == 3 else "z"
    found += [
        _Found("linear", f"momentum along {'xyz'[k]} of all bodies", units[0], n)
        for k, n in enumerate(linear)
    ]
    found += [
        _Found("angular", f"angular momentum about {axes[k]} of all bodies, about the origin", units[1], n)
        for k, n in enumerate(angular)
    ]
    found += [
        _Found("moment", f"mass times {'xyz'[k]} of the mass centre", units[2], n)
        for k, n in enumerate(moment)
    ]
    return found


def _turns(system: MechanicalSystem, layout: Layout) -> list[_Found]:
    """Return the angular momentum that belongs to each rotation, in the axes that it turns against."""
    graph = system.graph
    velocities = [s.node for s in system.v]
    lagrangian = graph.add(
        graph.sub(kinetic_energy(system, system.kinetic), potential_energy(system, system.potential)),
        system.lagrangian,
    )
    momenta = vjp(graph, [(lagrangian, graph.one)], velocities)
    unit = "" if layout.dimensionless else "kg.m^2/s"
    found = []
    for first, v in system.rotations:
        rows, name = _axes(system, first), system.q[first].variable.name
        found += [
            _Found(
                "spin", f"angular momentum of {name} about {axis}", unit, graph.dot(row, momenta[v : v + 3])
            )
            for axis, row in zip("xyz", rows, strict=True)
        ]
    return found


# ---------------------------------------------------------------- atoms


def _atoms(system: MechanicalSystem, solved: Solved, layout: Layout) -> list[_Found]:
    """Return the functions of coordinates of which the energies are made, sines with their cosines."""
    graph, energy = system.graph, solved.energies
    nodes = list(solved.resolve([energy.kinetic, energy.potential, system.lagrangian]))
    places = [n for n, slot in layout.slots.items() if slot.array == "y" and slot.index < layout.nq]
    order = graph.reach(nodes)
    depends: dict[Node, bool] = {}
    still: dict[Node, bool] = {}
    velocities = system.symbols.velocities
    for n in order:
        arguments = graph.args(n)
        depends[n] = n in places or any(depends[a] for a in arguments)
        still[n] = n not in velocities and all(still[a] for a in arguments)
    divisors = {graph.args(n)[1] for n in order if graph.op(n) == ops.DIV}
    turned = {k for first, _ in system.rotations for k in range(first, first + 4)}
    rotating = [system.q[k].node for k in sorted(turned)]
    atoms: dict[Node, str] = {}

    def keep(n: Node, words: str) -> None:
        if not graph.is_constant(n) and set(places).intersection(graph.support(n)):
            atoms.setdefault(n, words)

    for n in order:
        if not (depends[n] and still[n]):
            continue
        code = graph.op(n)
        if code in (ops.SIN, ops.COS):
            (argument,) = graph.args(n)
            keep(graph.sin(argument), "sine")
            keep(graph.cos(argument), "cosine")
        elif code == ops.SQRT and n not in divisors:
            keep(n, "root")
        elif code in _FUNCTIONS:
            keep(n, ops.OPERATIONS[code].name)
        if n in divisors:
            keep(graph.div(graph.one, _base(graph, n)), "reciprocal")
    for k, scalar in enumerate(system.q):
        if scalar.node in places and k not in turned and _unit_of(layout, scalar.node) == "rad":
            keep(graph.sin(scalar.node), "sine")
            keep(graph.cos(scalar.node), "cosine")
    for n in _divided_by(system, solved):
        keep(graph.div(graph.one, n), "reciprocal")
    if rotating and set(rotating).intersection(graph.support(*nodes)):
        for k, n in enumerate(_directions(system)):
            keep(n, f"direction cosine {k + 1}")
    found = [_Found("atom", words, "", n) for n, words in list(atoms.items())[:MOST_ATOMS]]
    hidden = _hidden(graph, nodes, places)
    plain = [
        s for k, s in enumerate(system.q) if s.node in places and k not in turned and s.node not in hidden
    ]
    return [
        *(_Found("place", "coordinate", "", s.node) for s in plain if _unit_of(layout, s.node) != "rad"),
        *found,
    ]


def _hidden(graph: Graph, nodes: Sequence[Node], places: Sequence[Node]) -> frozenset[Node]:
    """Return the coordinates that occur within sines, exponentials and the like alone."""
    bare: set[Node] = set()
    waiting, seen = list(nodes), set(nodes)
    while waiting:
        n = waiting.pop()
        bare.add(n)
        if graph.op(n) in _FUNCTIONS or graph.op(n) in (ops.SIN, ops.COS):
            continue
        for a in graph.args(n):
            if a not in seen:
                seen.add(a)
                waiting.append(a)
    return frozenset(set(places) & set(graph.support(*nodes)) - bare)


def _unit_of(layout: Layout, node: Node) -> str:
    return layout.states[layout.slots[node].index].unit


def _base(graph: Graph, n: Node) -> Node:
    """Return x of x^2, x^4 and so on, and of their products with numbers: 1/x makes all of their reciprocals."""
    while graph.op(n) == ops.MUL:
        a, b = graph.args(n)
        if a == b:
            n = a
        elif graph.is_constant(a):
            n = b
        elif graph.is_constant(b):
            n = a
        else:
            break
    return n


def _divided_by(system: MechanicalSystem, solved: Solved) -> list[Node]:
    """Return coordinates that stand in the mass matrix as lengths: the Hamiltonian is divided by them."""
    graph = system.graph
    momenta = solved.resolve([p for p in solved.energies.momenta if p is not None])
    rows = jacobian(graph, momenta, [system.v[i].node for i in solved.free])
    mass = [n for row in rows for n in row.values()]
    angles = {s.node for s in system.q if s.variable.type.angle}
    turned = {system.q[k].node for first, _ in system.rotations for k in range(first, first + 4)}
    support = set(graph.support(*mass)) if mass else set()
    found = [s.node for s in system.q if s.node in support and s.node not in angles | turned]
    squared = [
        graph.args(n)[0]
        for n in graph.reach(mass)
        if graph.op(n) == ops.MUL and graph.args(n)[0] == graph.args(n)[1]
    ]
    return [n for n in squared if n in found] + _vanishing_sines(system, rows, angles & support)


def _vanishing_sines(
    system: MechanicalSystem, rows: Sequence[Mapping[int, Node]], angles: set[Node]
) -> list[Node]:
    """Return the sines of angles at whose zeros the mass matrix is singular, as at the poles of a sphere."""
    import numpy as np

    graph = system.graph
    random = Random(7)
    n = len(rows)
    dense = [row.get(j, graph.zero) for row in rows for j in range(n)]
    values = {symbol: random.uniform(0.5, 1.5) for symbol in graph.support(*dense)}

    def size(at: Mapping[Node, float]) -> float:
        matrix = np.reshape(evaluate(graph, dense, at), (n, n))
        return float(abs(np.linalg.det(matrix))) if np.isfinite(matrix).all() else np.inf

    usual = size(values) if n else 0.0
    found = []
    for angle in sorted(angles):
        if size({**values, angle: 0.0}) < SINGULAR * usual:
            found.append(graph.sin(angle))
    return found


def _directions(system: MechanicalSystem) -> list[Node]:
    """Return, for each rotation, the components of the outer axes in the turned ones on which the energies depend.

    Energies that a turn about an outer axis leaves as they are depend on that axis alone.
    """
    graph = system.graph
    potential = potential_energy(system, system.potential)
    energies = [kinetic_energy(system, system.kinetic), potential, system.lagrangian]
    found: list[Node] = []
    for first, _ in system.rotations:
        w, *v = (system.q[k].node for k in range(first, first + 4))
        still = []
        for axis in range(3):
            e = [graph.one if k == axis else graph.zero for k in range(3)]
            turned = [graph.neg(v[axis]), *add(graph, scale(graph, w, e), cross(graph, tuple(e), tuple(v)))]
            along = dict(zip((w, *v), turned, strict=True))
            still.append(all(graph.is_zero(n) for n in jvp(graph, energies, along)))
        if all(still):
            continue
        for axis, row in enumerate(_axes(system, first)):
            if still[axis] or not any(still):
                found += row
    return found


def _axes(system: MechanicalSystem, first: int) -> tuple[tuple[Node, Node, Node], ...]:
    """Return the matrix of a rotation, row by row: components of the outer axes in the turned ones."""
    graph = system.graph
    w, x, y, z = (system.q[k].node for k in range(first, first + 4))

    def twice(a: tuple[Node, Node], b: tuple[Node, Node], sign: int) -> Node:
        left, right = graph.mul(*a), graph.mul(*b)
        return graph.mul(graph.two, graph.add(left, right) if sign > 0 else graph.sub(left, right))

    def diagonal(own: Node, one: Node, other: Node) -> Node:
        positive = graph.add(graph.mul(w, w), graph.mul(own, own))
        return graph.sub(positive, graph.add(graph.mul(one, one), graph.mul(other, other)))

    return (
        (diagonal(x, y, z), twice((x, y), (w, z), -1), twice((x, z), (w, y), 1)),
        (twice((x, y), (w, z), 1), diagonal(y, x, z), twice((y, z), (w, x), -1)),
        (twice((x, z), (w, y), -1), twice((y, z), (w, x), 1), diagonal(z, x, y)),
    )
