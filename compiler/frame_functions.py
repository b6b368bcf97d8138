"""Functions of one frame or point, or of all bodies together, formed of a compilation without forming the model again: pose,
velocities and Jacobian; mass centre and momenta; derivatives of the rates."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import islice
from pathlib import Path

from msgspec import Struct
from msgspec.structs import replace

from mechc.runtime.native.build import build_shared, find_compiler, find_quick_compiler, model_flags

from .compilation import Compilation
from .equations.model import Equations, Function, Slot
from .graph import Graph, Node
from .graph import vector as v3
from .graph.differentiate import jacobian, jvp
from .graph.rewrite import substitute, transfer
from .mechanics.kinematics.frames import Frame, Point
from .mechanics.system import MechanicalSystem
from .program.lower import lower_functions


class FrameFunctions(Struct, frozen=True):
    """The library, and of each function in it its name and the shape of its result."""

    library: Path
    shapes: dict[str, tuple[int, ...]]
    quick: bool


def is_frame_or_point(compilation: Compilation, name: str) -> bool:
    """Tell whether a name is that of a frame or a point."""
    lowering = compilation.system.lowering
    with lowering.aside():
        return lowering.knows(name) and isinstance(lowering.named(name), (Frame, Point))


def frame_functions(compilation: Compilation, name: str, *, quick: bool) -> FrameFunctions | None:
    """Build the functions of a frame or point; None where its motion is not one of the states alone, as after a drive that balances
    find. Raises BuildError and CompilerMissing."""
    return _built(compilation, _functions(compilation, name), quick)


def centroid_functions(compilation: Compilation, *, quick: bool) -> FrameFunctions | None:
    """Build the functions of the mass centre and of the momenta of all bodies; None as ``frame_functions``."""
    made = _of_all_bodies(compilation)
    return None if made is None else _built(compilation, made, quick)


def rates_jacobian_function(compilation: Compilation, *, quick: bool) -> FrameFunctions:
    """Build the derivatives of the rates by the state."""
    from .equations.offered import rates_jacobian

    equations = compilation.equations
    made = rates_jacobian(equations), (len(equations.states),) * 2
    return _compiled(compilation, replace(equations, functions=made[:1]), [made], quick)


Made = list[tuple[Function, tuple[int, ...]]]


def _built(compilation: Compilation, made: Made, quick: bool) -> FrameFunctions | None:
    placed = _of_the_states(compilation, [f for f, _ in made])
    return None if placed is None else _compiled(compilation, placed, made, quick)


def _compiled(compilation: Compilation, placed: Equations, made: Made, quick: bool) -> FrameFunctions:
    from .problem import header
    from .targets.c import emit_functions

    program = lower_functions(placed, compilation.program, placed.functions)
    compiler = find_quick_compiler() if quick else None
    text = emit_functions(program)
    library = build_shared(
        {"model.c": text, "model.h": header()},
        model_flags(compiler is not None),
        compiler=compiler or find_compiler(),
    )
    return FrameFunctions(library, {f.name: shape for f, shape in made}, compiler is not None)


def _of_the_states(compilation: Compilation, functions: Sequence[Function]) -> Equations | None:
    """Return equations with other functions, formulas of the graph of the system; None where these depend on what has no place at run
    time."""
    from .equations.solve.dead_symbols import built_without

    graph, equations = compilation.system.graph, compilation.equations
    layout = _layout(compilation)
    outputs = [n for f in functions for n in f.outputs]
    dead = [n for n in graph.support(*outputs) if n not in layout]
    if not dead:
        return replace(equations, graph=graph, layout=layout, functions=tuple(functions))
    found = built_without(graph, outputs, dead)
    if found is None:
        return None
    fresh, images = found
    nodes = iter(images)
    return replace(
        equations,
        graph=fresh,
        layout={fresh.symbol(graph.name(n)): slot for n, slot in layout.items()},
        functions=tuple(Function(f.name, f.doc, tuple(islice(nodes, len(f.outputs)))) for f in functions),
    )


def _layout(compilation: Compilation) -> dict[Node, Slot]:
    """Return the places of symbols of the graph of the system; equations may have been formed again in another graph."""
    graph, equations = compilation.system.graph, compilation.equations
    if equations.graph is graph:
        return dict(equations.layout)
    return {graph.symbol(equations.graph.name(n)): slot for n, slot in equations.layout.items()}


class _State(Struct, frozen=True):
    """What derivatives are taken by: velocities with a place at run time; ``along``: the rates of all that moves; ``known``: what
    stands for prescribed coordinates, and the zeros of virtual displacements."""

    graph: Graph
    velocities: list[Node]
    along: dict[Node, Node]
    known: dict[Node, Node]

    def settled(self, nodes: Sequence[Node]) -> tuple[Node, ...]:
        return tuple(substitute(self.graph, substitute(self.graph, list(nodes), self.known), self.known))

    def by_velocities(self, nodes: Sequence[Node]) -> tuple[Node, ...]:
        rows = jacobian(self.graph, nodes, self.velocities)
        return tuple(row.get(j, self.graph.zero) for row in rows for j in range(len(self.velocities)))

    def rates(self, nodes: Sequence[Node]) -> tuple[Node, ...]:
        """Return time derivatives where accelerations are zero."""
        return tuple(jvp(self.graph, nodes, self.along))


def _state(compilation: Compilation) -> _State:
    from .equations.solve.energies import still
    from .equations.solve.solved import prescribed_motion

    system, equations = compilation.system, compilation.equations
    graph = system.graph
    by_index = {slot.index: n for n, slot in _layout(compilation).items() if slot.array == "y"}
    nq, nv = equations.nq, equations.nv
    rates = next(f for f in equations.functions if f.name == "rhs").outputs[:nq]
    if equations.graph is not graph:
        rates = tuple(transfer(equations.graph, rates, graph))
    along = dict(zip((by_index[k] for k in range(nq)), rates, strict=True))
    return _State(
        graph,
        [by_index[k] for k in range(nq, nq + nv)],
        {**along, system.symbols.time: graph.one},
        {**prescribed_motion(system)[0], **still(system)},
    )


def _functions(compilation: Compilation, name: str) -> Made:
    system, state = compilation.system, _state(compilation)
    with system.lowering.aside():
        value = system.lowering.named(name)
    kinds = {k: state.settled(n) for k, n in _kinds(system, value)}
    moved = [n for k in ("velocity", "angular_velocity") for n in kinds.get(k, ())]
    shape, size = (len(moved), len(state.velocities)), system.kinematics.size
    dense = state.by_velocities(moved)
    return [
        *(
            (Function(k, k.replace("_", " "), n), (size, size) if k == "rotation" else (len(n),))
            for k, n in kinds.items()
        ),
        (Function("frame_jacobian", "velocities by those of the model", dense), shape),
        (Function("jacobian_rate", "time derivative of the Jacobian", state.rates(dense)), shape),
        (
            Function("drift", "accelerations where those of the model are zero", state.rates(moved)),
            shape[:1],
        ),
    ]


def _of_all_bodies(compilation: Compilation) -> Made | None:
    """Form the mass centre, and the momenta: linear, then angular about the mass centre."""
    system, state = compilation.system, _state(compilation)
    if not system.masses:
        return None
    graph, kinematics = system.graph, system.kinematics
    size = kinematics.size
    mass = graph.zero
    moment = linear = (graph.zero,) * size
    places, speeds = [], []
    for one in system.masses:
        place = kinematics.position(one.point)
        speed = kinematics.from_natural(one.point.frame, kinematics.velocity(one.point))
        mass = graph.add(mass, one.mass)
        moment = v3.add(graph, moment, v3.scale(graph, one.mass, place))
        linear = v3.add(graph, linear, v3.scale(graph, one.mass, speed))
        places.append(place)
        speeds.append(speed)
    centre = tuple(graph.div(n, mass) for n in moment)
    angular: tuple[Node, ...] = (graph.zero,) * (3 if size == 3 else 1)
    for one, place, speed in zip(system.masses, places, speeds, strict=True):
        arm, push = v3.subtract(graph, place, centre), v3.scale(graph, one.mass, speed)
        turned = v3.cross(graph, arm, push) if size == 3 else (v3.cross_planar(graph, arm, push),)
        angular = v3.add(graph, angular, turned)
    for body in system.inertias:
        spin = v3.matvec(graph, body.inertia, kinematics.angular_velocity(body.frame))
        angular = v3.add(graph, angular, kinematics.spin_from_natural(body.frame, spin))
    field = _field_of_all(system)
    momentum = state.settled((*linear, *angular))
    matrix = state.by_velocities(momentum)
    shape = (len(momentum), len(state.velocities))
    made: Made = [
        (Function("total_mass", "mass of all bodies", state.settled([mass])), ()),
        (Function("centre", "mass centre", state.settled(centre)), (size,)),
        (Function("momenta", "linear momentum, then angular about the mass centre", momentum), shape[:1]),
        (Function("momenta_matrix", "momenta by the velocities of the model", matrix), shape),
        (
            Function(
                "momenta_drift", "rates of the momenta where accelerations are zero", state.rates(momentum)
            ),
            shape[:1],
        ),
    ]
    if field is not None:
        made.append((Function("gravity", "acceleration of gravity", state.settled(field)), (size,)))
    return made


def _field_of_all(system: MechanicalSystem) -> tuple[Node, ...] | None:
    """Return the acceleration of gravity of all masses, zero without one; None where it is not the same for all.

    A field of the place is an energy or a force that the statement of the mass brings.
    """
    weights = {e.origin for e in system.model.energies} | {load.origin for load in system.model.loads}
    fields = {one.field for one in system.masses}
    if len(fields) > 1 or any(one.origin in weights for one in system.masses):
        return None
    (field,) = fields
    return (system.graph.zero,) * system.kinematics.size if field is None else tuple(field)


def _kinds(system: MechanicalSystem, value: object) -> Iterator[tuple[str, tuple[Node, ...]]]:
    kinematics, graph = system.kinematics, system.graph
    if isinstance(value, Point):
        yield "position", kinematics.position(value)
        yield "velocity", kinematics.from_natural(value.frame, kinematics.velocity(value))
        return
    assert isinstance(value, Frame)
    origin = Point(value, (graph.zero,) * kinematics.size)
    yield "position", kinematics.position(origin)
    yield "velocity", kinematics.from_natural(value, kinematics.velocity(origin))
    yield (
        "angular_velocity",
        kinematics.spin_from_natural(value, kinematics.angular_velocity(value)),
    )
    yield "rotation", tuple(n for row in _rotation(system, value, graph) for n in row)


def _rotation(system: MechanicalSystem, frame: Frame, graph: Graph) -> v3.Matrix:
    """Return the matrix that maps components in the axes of the frame to those of the world."""
    size = system.kinematics.size
    axes = [tuple(graph.one if i == k else graph.zero for i in range(size)) for k in range(size)]
    return v3.transpose(tuple(system.kinematics.to_world(frame, axis) for axis in axes))
