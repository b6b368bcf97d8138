"""Constraints: closures of loops and the user's equations."""

from __future__ import annotations

from collections.abc import Sequence
from math import prod
from typing import Literal, Unpack

from mechc.lang.diagnostics import Details, Reporter

from ..flat.model import ClosureEquation, Constraint, Expression, FlatModel, Joint, Kind, Name
from ..graph import DivisionByZero, Graph, Node
from ..graph.differentiate import is_affine
from ..graph.vector import subtract, unit_vector
from .kinematics.frames import Frame, Point
from .kinematics.reactions import VirtualDisplacement, displace
from .kinematics.topology import Topology
from .meaning.lower import Lowering
from .meaning.symbols import Symbols, base_unit
from .meaning.values import Value
from .system import ConstraintRows

HELP = "a constraint is a relation between coordinates or velocities; write what follows a force as a 'force'"


def _differences(lowering: Lowering, left: Expression, right: Expression) -> tuple[Node, ...]:
    a, b = lowering.numbers(left), lowering.numbers(right)
    if len(a) != len(b):  # a scalar 0 fits every shape
        a = a * len(b) if len(a) == 1 else a
        b = b * len(a) if len(b) == 1 else b
    return tuple(lowering.graph.sub(x, y) for x, y in zip(a, b, strict=True))


def _unit(left: Expression, right: Expression) -> str:
    return base_unit(left) or base_unit(right)  # a zero has the unit of the other side


def closure_rows(
    lowering: Lowering,
    model: FlatModel,
    topology: Topology,
    formed: frozenset[str],
    virtual: dict[str, VirtualDisplacement],
    symbols: Symbols,
    reporter: Reporter,
) -> tuple[ConstraintRows, ...]:
    """Return the rows of each closure; an equation for a coordinate of the joint computes that coordinate instead.

    Joints in ``formed`` get a virtual displacement of their ``to`` frame, added to ``virtual``; of all else, only their
    own coordinates see it.
    """
    rows: list[ConstraintRows] = []
    for joint in topology.closures:
        if joint.name in formed:
            frame = lowering.named(joint.target)
            assert isinstance(frame, Frame)
            moved = displace(lowering.graph, lowering.rate, frame, lowering.kinematics.size, joint.name)
            virtual[joint.name] = moved
            with lowering.trial(joint.name):
                lowering.assign(joint.to, moved.frame)
                rows += _joint_rows(lowering, model, joint, symbols, reporter)
                # what acts on its coordinates acts within the joint, too
                computed = _compute(lowering, joint)
            for name, value in computed.items():
                lowering.assign(name, value)
        else:
            rows += _joint_rows(lowering, model, joint, symbols, reporter)
            _compute(lowering, joint)
    return tuple(rows)


def _computed(joint: Joint, left: Expression) -> str:
    """Return the coordinate that a closure equation computes, or nothing if it is a constraint."""
    return left.name if isinstance(left, Name) and left.name in joint.coordinates else ""


def _compute(lowering: Lowering, joint: Joint) -> dict[str, Value]:
    """Give the coordinates of a joint that closures compute their values."""
    computed: dict[str, Value] = {}
    for equation in joint.closures:
        name = _computed(joint, equation.left)
        if name:
            computed[name] = lowering.value(equation.right)
            lowering.assign(name, computed[name])
    return computed


def _check_closure(
    lowering: Lowering,
    joint: Joint,
    equation: ClosureEquation,
    residuals: Sequence[Node],
    symbols: Symbols,
    reporter: Reporter,
) -> None:
    """Report a closure that is not a relation between places: what it asks of forces, and rates."""
    for side in (equation.left, equation.right):
        lowering.questions.refuse(lowering.numbers(side), "a closure", side, HELP)
    support = set(lowering.graph.support(*residuals))
    if support & (symbols.velocities | symbols.accelerations):
        raise reporter.fail(
            "E0501",
            f"the closure of '{joint.name}' contains velocities",
            equation.origin.shown,
            caption="a closure is a relation between coordinates",
            help="write what relates velocities as a 'constraint' in the joint",
        )


def _joint_rows(
    lowering: Lowering, model: FlatModel, joint: Joint, symbols: Symbols, reporter: Reporter
) -> list[ConstraintRows]:
    if not joint.coordinates and not joint.closures:
        return [_connection(lowering, model, joint, reporter)]
    rows = []
    for equation in joint.closures:
        if _computed(joint, equation.left):
            continue
        residuals = lowering.switching(_differences(lowering, equation.left, equation.right))
        _check_closure(lowering, joint, equation, residuals, symbols, reporter)
        unit = _unit(equation.left, equation.right)
        rows.append(
            ConstraintRows(
                joint.name, "position", residuals, (unit,) * len(residuals), "", joint.name, equation.origin
            )
        )
    if not rows:
        _check_free(model, joint, reporter)
    return rows


def _connection(lowering: Lowering, model: FlatModel, joint: Joint, reporter: Reporter) -> ConstraintRows:
    """Return what holds a frame where a value or a ``place`` without freedoms puts it, though others place it, too.

    Of the rotation, tan(angle/2), in space times the axis: it vanishes without rotation alone.
    """
    graph, kinematics = lowering.graph, lowering.kinematics
    value, target = lowering.frame(joint.value), lowering.named(joint.to)
    assert isinstance(target, Frame)
    size = kinematics.size
    none = (graph.zero,) * size
    off = subtract(graph, kinematics.position(Point(target, none)), kinematics.position(Point(value, none)))
    axes = [
        kinematics.to_frame(value, kinematics.to_world(target, unit_vector(graph, k, size)))
        for k in range(size)
    ]
    if size == 2:
        twice, cosine = [axes[0][1]], axes[0][0]
    else:
        twice = [graph.sub(axes[j][k], axes[k][j]) for j, k in ((1, 2), (2, 0), (0, 1))]
        cosine = graph.sum(axes[k][k] for k in range(3))
    try:
        turned = [graph.div(x, graph.add(graph.one, cosine)) for x in twice]
    except DivisionByZero:
        raise reporter.fail(
            "E0529",
            f"the loop that '{joint.name}' closes cannot close: its two sides are half a turn apart in every position",
            joint.origin.shown,
            help="look at the directions of the parts around the loop",
        ) from None
    length = "" if model.dimensionless else "m"
    units = (length,) * size + ("",) * len(turned)
    return ConstraintRows(joint.name, "position", (*off, *turned), units, "", joint.name, joint.origin)


def _check_free(model: FlatModel, joint: Joint, reporter: Reporter) -> None:
    """Report a joint that closes a loop and holds nothing there, though it leaves fewer freedoms than a body has."""
    own = [v.type for v in model.variables if v.name in joint.coordinates]
    freedoms = sum(3 if type.kind is Kind.ROTATION else prod(type.shape) for type in own)
    of_a_body = 3 if model.space == 2 else 6
    if freedoms < of_a_body:
        raise reporter.fail(
            "E0570",
            f"joint '{joint.name}' closes a loop, and its model does not say what holds there",
            joint.origin.shown,
            caption=f"it leaves {freedoms} of {of_a_body} freedoms, and no 'closure' equation holds the others",
            help="add 'closure' equations to the model of the joint, as in 'closure pos(to) = pos(from);', or close the "
            "loop with another joint",
        )


def constraint_rows(
    lowering: Lowering, model: FlatModel, symbols: Symbols, reporter: Reporter
) -> tuple[ConstraintRows, ...]:
    """Return the user's constraints with the level that their residuals have."""
    rows = []
    for constraint in model.constraints:
        residuals = _differences(lowering, constraint.left, constraint.right)
        for side in (constraint.left, constraint.right):
            lowering.questions.refuse(lowering.numbers(side), "a constraint", side, HELP)
        residuals = lowering.switching(residuals)
        level = _level(lowering.graph, constraint, residuals, symbols, reporter)
        if level is not None:
            units = (_unit(constraint.left, constraint.right),) * len(residuals)
            name, asserted = constraint.name, constraint.asserted
            rows.append(ConstraintRows(name, level, residuals, units, asserted, "", constraint.origin))
    return tuple(rows)


def _level(
    graph: Graph, constraint: Constraint, residuals: Sequence[Node], symbols: Symbols, reporter: Reporter
) -> Literal["position", "velocity"] | None:
    """Return the level of a constraint; None where it is not a constraint, which is reported."""

    def refuse(code: str, why: str, **details: Unpack[Details]) -> None:
        reporter.error(code, f"constraint '{constraint.name}' {why}", constraint.origin.shown, **details)

    support = set(graph.support(*residuals))
    velocities = symbols.velocities & support
    if symbols.accelerations & support:
        refuse(
            "E0501",
            "contains accelerations",
            caption="a constraint is a relation between coordinates or velocities",
            help="integrate it once, or write it as a force",
        )
    elif not velocities and not symbols.positions & support:
        refuse("E0503", "contains no coordinate", caption="nothing here can move")
    elif velocities and not is_affine(graph, residuals, velocities):
        refuse(
            "E0501",
            "is not affine in the velocities",
            caption="velocities may only enter as factors of the first power",
            help="write it with coordinates alone, or as A(q)*der(q) + b(q) = 0",
        )
    elif velocities and constraint.asserted == "holonomic":
        why = "is asserted holonomic but contains velocities"
        refuse("E0502", why, help="write it on position level, or drop the word 'holonomic'")
    elif not velocities and constraint.asserted == "nonholonomic":
        why = "is asserted nonholonomic but contains no velocity"
        refuse("E0502", why, help="drop the word 'nonholonomic'")
    else:
        return "velocity" if velocities else "position"
    return None
