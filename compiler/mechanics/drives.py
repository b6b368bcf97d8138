"""Prescribed motions: coordinates, rotations or rates that follow given functions of time."""

from __future__ import annotations

from mechc.lang.diagnostics import Reporter

from ..flat.model import Derivative, Drive, Expression, FlatModel
from ..graph import Node
from .driving_inputs import can_drive
from .kinematics.frames import displaced
from .meaning.lower import Lowering
from .meaning.questions import title
from .meaning.symbols import CoordinateSymbols, Scalar, Symbols
from .meaning.values import Placement, elements
from .system import DriveRow


def drive_rows(
    lowering: Lowering, model: FlatModel, symbols: Symbols, reporter: Reporter
) -> tuple[DriveRow, ...]:
    """Return the prescribed motions; report what cannot be prescribed."""
    rows: list[DriveRow] = []
    for drive in model.drives:
        row = _row(lowering, drive, symbols)
        if row is None:
            reporter.error(
                "E0507",
                "the motion of this coordinate cannot be prescribed",
                drive.target.span,
                caption="its joint closes a loop, so it is not a coordinate of the tree",
            )
            continue
        if any(set(row.v) & set(other.v) for other in rows):
            reporter.error(
                "E0505", "this coordinate is driven twice", drive.origin.span, caption="second drive"
            )
        rows.append(row)
    q = [s.node for c in symbols.coordinates for s in c.q]
    v = [s.node for c in symbols.coordinates for s in c.v]
    a = [n for c in symbols.coordinates for n in c.a]
    driven = {n for row in rows for n in (*(q[k] for k in row.q), *(n for i in row.v for n in (v[i], a[i])))}
    for drive in model.drives:
        _check_known(lowering, drive, symbols, {*q, *v, *a} - driven, reporter)
    return tuple(rows)


def _check_known(
    lowering: Lowering, drive: Drive, symbols: Symbols, free: set[Node], reporter: Reporter
) -> None:
    smooth = [s for s in symbols.inputs if can_drive(s)]
    forbidden = {
        s.node for s in (*symbols.inputs, *symbols.discretes)
    }  # states are looked at with their equations
    forbidden -= {s.node for s in smooth}
    value = lowering.value(drive.value)
    if isinstance(value, Placement):
        from .meaning.quaternions import rotation_quaternion

        support = lowering.graph.support(*rotation_quaternion(lowering.graph, lowering, drive.value))
    else:
        support = lowering.graph.support(*elements(value))
    if forbidden.intersection(support):
        caption = "this contains an input or a discrete variable, which has no second derivative"
        help = "use a stiff 'force' that follows it"
        if rough := [s for s in symbols.inputs if s.node in forbidden.intersection(support)]:
            name = rough[0].variable.name
            help = f'an input with a spline has one, {name}(interpolation = "spline"), and so does a filtered one, {name}(filter = 1 ms)'
    elif moving := [s for s in smooth if s.node in support and _moves(lowering, s, symbols)]:
        caption = f"the default of '{moving[0].variable.name}' changes with time"
        help = "drive by the formula itself, or give the input a constant default"
    elif asked := lowering.questions.symbols_in(support):
        caption = f"this asks for '{title(lowering.questions.asked[asked[0]])}', which nothing but the motion decides"
        help = "use a stiff 'force' that follows it"
    elif free.intersection(support):
        caption = "this contains a coordinate that moves freely and would feel nothing of the drive"
        help = f"write 'constraint {drive.target.span.text} = {drive.value.span.text}': both feel it"
    else:
        return
    reporter.error(
        "E0504",
        "a drive may depend on time, parameters, smooth inputs and other drives only",
        drive.value.span,
        caption=caption,
        help=help,
    )


def _moves(lowering: Lowering, scalar: Scalar, symbols: Symbols) -> bool:
    """Tell whether the default of an input is a function of time, of which its derivatives would know nothing."""
    value = scalar.variable.value
    return value is not None and symbols.time in lowering.graph.support(*lowering.numbers(value))


def _row(lowering: Lowering, drive: Drive, symbols: Symbols) -> DriveRow | None:
    target: Expression = drive.target
    of_rate = isinstance(target, Derivative)
    first_q = first_v = 0
    for coordinate in symbols.coordinates:
        places = _places(lowering, target, coordinate)
        if places is not None:
            v = tuple(first_v + k for k in places)
            q = (
                tuple(range(first_q, first_q + 4))
                if coordinate.is_rotation
                else tuple(first_q + k for k in places)
            )
            values, rates = _values(lowering, drive, coordinate, len(v), of_rate)
            names = tuple(coordinate.v[k].of for k in places)
            return DriveRow(names, () if of_rate else q, v, values, rates, drive.origin)
        first_q, first_v = first_q + len(coordinate.q), first_v + len(coordinate.v)
    return None


def _places(lowering: Lowering, target: Expression, coordinate: CoordinateSymbols) -> tuple[int, ...] | None:
    """Return which velocities of a coordinate the target of a drive means."""
    value = lowering.value(target)
    if isinstance(value, Placement):
        whole = lowering.value(target) is lowering.named(coordinate.variable.name)
        return (0, 1, 2) if whole and coordinate.is_rotation else None
    nodes = tuple(elements(value))
    scalars = coordinate.v if isinstance(target, Derivative) else coordinate.q
    index = {s.node: k for k, s in enumerate(scalars)}
    return tuple(index[n] for n in nodes) if all(n in index for n in nodes) else None


def _values(
    lowering: Lowering, drive: Drive, coordinate: CoordinateSymbols, count: int, of_rate: bool
) -> tuple[tuple[Node, ...], tuple[Node, ...]]:
    """Return the formulas of the positions (none for a driven rate) and of the velocities."""
    value = lowering.value(drive.value)
    if isinstance(value, Placement):
        from .meaning.quaternions import rotation_quaternion

        kinematics = lowering.kinematics
        frame = displaced(lowering.graph, kinematics.world, value.pose)
        return rotation_quaternion(lowering.graph, lowering, drive.value), kinematics.angular_velocity(frame)
    numbers = tuple(elements(value))
    numbers = numbers * count if len(numbers) == 1 else numbers
    if of_rate:
        return (), numbers
    return numbers, tuple(lowering.rate(n) for n in numbers)
