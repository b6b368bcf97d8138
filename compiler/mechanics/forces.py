"""Forces, torques and dampers as virtual power: pairs of a rate and the effort that works on it."""

from __future__ import annotations

from mechc.lang.diagnostics import Reporter

from ..flat.model import Damping, Expression, FlatModel, Kind, Load
from ..graph import Graph, Node
from ..graph.differentiate import is_affine, jvp
from ..graph.vector import Vector, cross, cross_planar, negate, subtract
from .kinematics.frames import Frame, Point
from .kinematics.reactions import undisplaced, virtual_rates
from .meaning.lower import Lowering
from .meaning.symbols import Symbols
from .system import EffortPairs

Pairs = list[tuple[Node, Node]]


def efforts(
    lowering: Lowering, model: FlatModel, symbols: Symbols, reporter: Reporter
) -> tuple[EffortPairs, ...]:
    """Return every force and torque of a model."""
    graph = lowering.graph
    outside = {symbols.time, *(s.node for s in symbols.inputs)}
    result = []
    for load in model.loads:
        pairs = virtual_power(lowering, load, symbols)
        _check_line(lowering, load, reporter)
        support = set(graph.support(*(effort for _, effort in pairs)))
        if support & symbols.accelerations:
            _no_inertia(load.kind, load.value, reporter)
        brakes = not support & outside and (
            _always(lowering, pairs, -1) or _always(lowering, _as_written(lowering, load, symbols), -1)
        )
        if not brakes and support & symbols.velocities and _always(lowering, pairs, 1):
            reporter.warning(
                "W0532",
                f"this {load.kind} pushes along every motion: it feeds in energy without limit",
                load.origin.shown,
                help="a drag is written 'damping c on q', or as a force with the opposite sign",
            )
        result.append(EffortPairs(load.name, tuple(pairs), not brakes, load.origin))
    return tuple(result)


def _no_inertia(kind: str, value: Expression, reporter: Reporter) -> None:
    reporter.error(
        "E0519",
        f"a {kind} must not depend on accelerations",
        value.span,
        caption="this contains a second derivative",
        help="write the inertia as 'kinetic', 'mass' or 'inertia'",
    )


def _always(lowering: Lowering, pairs: Pairs, sign: int) -> bool:
    """Tell whether the power of a force has one sign whatever the motion, with the default values of parameters."""
    from ..graph.signs import one_sign

    if not pairs:
        return False
    graph = lowering.graph
    pairs = [(undisplaced(graph, rate), undisplaced(graph, effort)) for rate, effort in pairs]
    known = lowering.integrals.settled(graph.support(*(n for pair in pairs for n in pair)))
    return one_sign(graph, pairs, known, sign)


def _as_written(lowering: Lowering, load: Load, symbols: Symbols) -> Pairs:
    """Return the power of a force in the axes of the world, with the rate of one end against the other, as a law of a drag is
    written; nothing where no law asks for velocities."""
    kinematics = lowering.kinematics
    values = lowering.questions.settle(lowering.numbers(load.value))
    if not symbols.velocities & set(lowering.graph.support(*values)):
        return []
    ends = [end for end in (load.on, load.source) if end is not None]
    if load.on.type.kind not in (Kind.FRAME, Kind.POINT):
        rates = [rate_of(lowering, end, symbols) for end in ends]
        values = values * len(rates[0]) if len(values) == 1 else values
    else:
        if load.frame is not None:
            values = kinematics.to_world(lowering.frame(load.frame), values)
        if load.kind == "torque":
            frames = [lowering.frame(end) for end in ends]
            rates = [kinematics.spin_from_natural(f, kinematics.angular_velocity(f)) for f in frames]
        elif load.at is not None:
            point = lowering.point(load.at)
            rates = [kinematics.velocity_at(lowering.frame(end), point) for end in ends]
        else:
            points = [lowering.point(end) for end in ends]
            rates = [kinematics.from_natural(p.frame, kinematics.velocity(p)) for p in points]
    rate = rates[0] if len(rates) == 1 else subtract(lowering.graph, *rates)
    return _pairs(lowering.questions.settle(rate), values)


def virtual_power(lowering: Lowering, load: Load, symbols: Symbols) -> Pairs:
    """Return the pairs (rate, effort) of a load; their products are its power [W]."""
    if load.on.type.kind not in (Kind.FRAME, Kind.POINT):
        pairs = _on_scalar(lowering, load, symbols)
    elif load.kind == "torque":
        pairs = _torque(lowering, load)
    else:
        pairs = _force(lowering, load, symbols)
    settled = lowering.questions.settle([n for pair in pairs for n in pair])
    return list(zip(settled[::2], settled[1::2], strict=True))


def rate_of(
    lowering: Lowering, expression: Expression, symbols: Symbols, *, linear: bool = True
) -> tuple[Node, ...]:
    """Return the rates on which a force on ``expression`` works: itself if it is a rate, else its derivative.

    ``linear``: what a force acts along is displaced by it; a damping, which is half a power, may be of any rate.
    """
    graph, questions = lowering.graph, lowering.questions
    nodes = lowering.numbers(expression)
    if questions.forces_in(nodes):
        raise _no_rate(
            lowering, expression, "an answer about forces is not a place, and has no rate that is known"
        )
    support = set(graph.support(*nodes))
    if support & symbols.accelerations:
        raise _no_rate(lowering, expression, "this contains accelerations")
    velocities = support & symbols.velocities
    if not velocities:
        return questions.settle([lowering.rate(n) for n in nodes])
    if linear and not is_affine(graph, nodes, velocities):
        raise _no_rate(lowering, expression, "it is not affine in the velocities, so nothing moves along it")
    if not _stated_rate(lowering, expression, symbols):
        raise _no_rate(lowering, expression, "a potential with velocities is neither a place nor a rate")
    return nodes


def _stated_rate(lowering: Lowering, expression: Expression, symbols: Symbols) -> bool:
    """Tell whether an expression contains velocities for other reasons than those of a potential energy."""
    asked = lowering.questions.asked
    support = lowering.graph.support(*lowering.reported(expression))
    return any(
        n in symbols.velocities or (n in asked and asked[n].function != "potential_energy") for n in support
    )


def _no_rate(lowering: Lowering, expression: Expression, why: str) -> Exception:
    return lowering.reporter.fail(
        "E0539",
        "a force, a damping or a friction acts on a coordinate, on what moves with it, or on a rate",
        expression.span,
        caption=why,
        help="write what follows an energy into the force itself: 'force -c*energy()*der(q) on q'",
    )


def _on_scalar(lowering: Lowering, load: Load, symbols: Symbols) -> Pairs:
    rates = rate_of(lowering, load.on, symbols)
    values = lowering.numbers(load.value)
    values = values * len(rates) if len(values) == 1 else values
    pairs = list(zip(rates, values, strict=True))
    if load.source is not None:
        sources = rate_of(lowering, load.source, symbols)
        pairs += [(r, lowering.graph.neg(v)) for r, v in zip(sources, values, strict=True)]
    return pairs


def _force(lowering: Lowering, load: Load, symbols: Symbols) -> Pairs:
    kinematics, graph = lowering.kinematics, lowering.graph
    value = lowering.numbers(load.value)
    axes = None if load.frame is None else lowering.frame(load.frame)
    if load.at is not None:
        world = value if axes is None else kinematics.to_world(axes, value)
        point = lowering.point(load.at)
        pairs = _on_body(lowering, lowering.frame(load.on), point, world, symbols)
        if load.source is not None:
            pairs += _on_body(lowering, lowering.frame(load.source), point, negate(graph, world), symbols)
        return pairs
    pairs = []
    for end, sign in ((load.on, 1), (load.source, -1)):
        if end is None:
            continue
        point = lowering.point(end)
        force = _seen_from(lowering, point.frame, axes, value)
        pairs += _pairs(kinematics.velocity(point), force if sign > 0 else negate(graph, force))
    return pairs


def _on_body(lowering: Lowering, frame: Frame, point: Point, force: Vector, symbols: Symbols) -> Pairs:
    """Let a force act on the material point of ``frame`` that is now at ``point``.

    Virtual displacements leave the arm as it is; one that follows velocities is put into the moment, which they do not vary.
    """
    kinematics, graph = lowering.kinematics, lowering.graph
    origin = Point(frame, (graph.constant(0),) * kinematics.size)
    arm = subtract(graph, kinematics.position(point), kinematics.position(origin))
    settled = lowering.questions.settle(arm)
    follows = symbols.velocities & set(graph.support(*settled)) or any(
        virtual_rates(graph, n) for n in settled
    )
    if not follows and not lowering.questions.symbols_in(settled):
        return _pairs(kinematics.velocity_at(frame, point), force)
    pairs = _pairs(kinematics.velocity(origin), kinematics.to_natural(frame, force))
    turning = kinematics.angular_velocity(frame)
    if kinematics.size == 2:
        return pairs + _pairs(turning, (cross_planar(graph, arm, force),))
    return pairs + _pairs(turning, kinematics.to_natural(frame, cross(graph, arm, force)))


def _check_line(lowering: Lowering, load: Load, reporter: Reporter) -> None:
    """Warn of a force whose reaction acts elsewhere and not along the line: it makes angular momentum."""
    kinematics, graph = lowering.kinematics, lowering.graph
    ends = (Kind.FRAME, Kind.POINT)
    if load.kind != "force" or load.source is None or load.at is not None or load.on.type.kind not in ends:
        return
    first, second = lowering.point(load.on), lowering.point(load.source)
    if any(all(map(graph.is_zero, kinematics.velocity(end))) for end in (first, second)):
        return  # what does not move takes up any moment
    value = lowering.numbers(load.value)
    if load.frame is not None:
        value = kinematics.to_world(lowering.frame(load.frame), value)
    arm = subtract(graph, kinematics.position(first), kinematics.position(second))
    moment = (cross_planar(graph, arm, value),) if kinematics.size == 2 else cross(graph, arm, value)
    if not all(graph.is_zero(x) for x in moment):
        reporter.warning(
            "W0530",
            "this force and its reaction act at different points, and not along their line",
            load.origin.shown,
            caption="together they change the angular momentum",
            help="write 'force F on body at P from other' to let both act at one point",
        )


def _torque(lowering: Lowering, load: Load) -> Pairs:
    kinematics, graph = lowering.kinematics, lowering.graph
    value = lowering.numbers(load.value)
    axes = None if load.frame is None else lowering.frame(load.frame)
    pairs = []
    for end, sign in ((load.on, 1), (load.source, -1)):
        if end is None:
            continue
        frame = lowering.frame(end)
        moment = value if kinematics.size == 2 else _seen_from(lowering, frame, axes, value)
        pairs += _pairs(kinematics.angular_velocity(frame), moment if sign > 0 else negate(graph, moment))
    return pairs


def _seen_from(lowering: Lowering, frame: Frame, axes: Frame | None, vector: Vector) -> Vector:
    """Turn a vector given in ``axes`` (None: world) into natural components at ``frame``."""
    kinematics = lowering.kinematics
    if axes is frame and kinematics.size == 3:
        return vector
    world = vector if axes is None else kinematics.to_world(axes, vector)
    return kinematics.to_natural(frame, world)


def _pairs(rates: Vector, values: Vector) -> Pairs:
    return list(zip(rates, values, strict=True))


def damping(lowering: Lowering, model: FlatModel, symbols: Symbols) -> Node:
    """Return the Rayleigh function 1/2 c s^2 of all ``damping`` statements [W]."""
    graph: Graph = lowering.graph
    total = graph.constant(0)
    for item in model.dampings:
        pairs = resistances(lowering, item, symbols)
        if graph.depend([c for c, _ in pairs], symbols.accelerations):
            _no_inertia("damping", item.value, lowering.reporter)
        for c, rate in pairs:
            half = graph.mul(graph.half, c)
            total = graph.add(total, graph.mul(half, graph.mul(rate, rate)))
    return total


def damping_power(lowering: Lowering, item: Damping, symbols: Symbols) -> Node:
    """Return the power of the forces of one ``damping`` statement [W].

    With the rate that is c s^2; where the coefficient depends on velocities, the Rayleigh function 1/2 c s^2 has a derivative
    by these too.
    """
    graph = lowering.graph
    pairs = resistances(lowering, item, symbols)
    settled = lowering.questions.settle([c for c, _ in pairs])
    bent = jvp(graph, settled, {s.node: s.node for q in symbols.coordinates for s in q.v})
    factors = [graph.add(c, graph.mul(graph.half, more)) for (c, _), more in zip(pairs, bent, strict=True)]
    squares = [graph.mul(rate, rate) for _, rate in pairs]
    return graph.neg(graph.dot(factors, squares))


def resistances(lowering: Lowering, item: Damping, symbols: Symbols) -> Pairs:
    """Return the coefficients and the rates of a ``damping`` statement."""
    rates = rate_of(lowering, item.on, symbols, linear=False)
    coefficients = lowering.numbers(item.value)
    coefficients = coefficients * len(rates) if len(coefficients) == 1 else coefficients
    return list(zip(coefficients, rates, strict=True))
