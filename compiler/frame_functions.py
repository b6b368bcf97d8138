"""Functions of one frame or point, or of all bodies together, formed of a compilation without forming the model again: pose,
velocities and Jacobian; mass centre and momenta."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

from msgspec import Struct

from mechc.runtime.native.build import build_shared, find_compiler, find_quick_compiler, model_flags

from .compilation import Compilation
from .equations.model import Function
from .graph import Graph, Node
from .graph import vector as v3
from .graph.differentiate import jacobian, jvp
from .graph.rewrite import substitute
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
    made = _functions(compilation, name)
    return None if made is None else _built(compilation, made, quick)


def centroid_functions(compilation: Compilation, *, quick: bool) -> FrameFunctions | None:
    """Build the functions of the mass centre and of the momenta of all bodies; None as ``frame_functions``."""
    made = _of_all_bodies(compilation)
    return None if made is None else _built(compilation, made, quick)


Made = list[tuple[Function, tuple[int, ...]]]


def _built(compilation: Compilation, made: Made, quick: bool) -> FrameFunctions:
    from .problem import header
    from .targets.c import emit_functions

    program = lower_functions(compilation.equations, compilation.program, [f for f, _ in made])
    compiler = find_quick_compiler() if quick else None
    text = emit_functions(program)
    library = build_shared(
        {"model.c": text, "model.h": header()},
        model_flags(compiler is not None),
        compiler=compiler or find_compiler(),
    )
    return FrameFunctions(library, {f.name: shape for f, shape in made}, compiler is not None)


class _State(Struct, frozen=True):
    """What derivatives are taken by: velocities with a place at run time; ``along``: the rates of all that moves; ``driven``: what
    stands for prescribed coordinates."""

    graph: Graph
    velocities: list[Node]
    along: dict[Node, Node]
    driven: dict[Node, Node]
    known: set[Node]

    def settled(self, nodes: Sequence[Node]) -> tuple[Node, ...]:
        return tuple(substitute(self.graph, substitute(self.graph, list(nodes), self.driven), self.driven))

    def by_velocities(self, nodes: Sequence[Node]) -> tuple[Node, ...]:
        rows = jacobian(self.graph, nodes, self.velocities)
        return tuple(row.get(j, self.graph.zero) for row in rows for j in range(len(self.velocities)))

    def rates(self, nodes: Sequence[Node]) -> tuple[Node, ...]:
        """Return time derivatives where accelerations are zero."""
        return tuple(jvp(self.graph, nodes, self.along))

    def known_all(self, made: Made) -> Made | None:
        found = set(self.graph.support(*(n for f, _ in made for n in f.outputs)))
        return made if found <= self.known else None


def _state(compilation: Compilation) -> _State | None:
    from .equations.solve.solved import prescribed_motion

    system, equations = compilation.system, compilation.equations
    graph = system.graph
    if equations.graph is not graph:  # formed again without symbols that cancel
        return None
    by_index = {slot.index: n for n, slot in equations.layout.items() if slot.array == "y"}
    nq, nv = equations.nq, equations.nv
    rhs = next(f for f in equations.functions if f.name == "rhs").outputs
    along = dict(zip((by_index[k] for k in range(nq)), rhs[:nq], strict=True))
    return _State(
        graph,
        [by_index[k] for k in range(nq, nq + nv)],
        {**along, system.symbols.time: graph.one},
        prescribed_motion(system)[0],
        set(equations.layout),
    )


def _functions(compilation: Compilation, name: str) -> Made | None:
    system, state = compilation.system, _state(compilation)
    if state is None:
        return None
    with system.lowering.aside():
        value = system.lowering.named(name)
    kinds = {k: state.settled(n) for k, n in _kinds(system, value)}
    moved = [n for k in ("velocity", "angular_velocity") for n in kinds.get(k, ())]
    shape, size = (len(moved), len(state.velocities)), system.kinematics.size
    dense = state.by_velocities(moved)
    return state.known_all(
        [
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
    )


def _of_all_bodies(compilation: Compilation) -> Made | None:
    """Form the mass centre, and the momenta: linear, then angular about the mass centre."""
    system, state = compilation.system, _state(compilation)
    if state is None or not system.masses:
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
    fields = {one.field for one in system.masses}
    (field,) = fields if len(fields) == 1 else (None,)
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
    return state.known_all(made)


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
