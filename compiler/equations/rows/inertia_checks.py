"""Masses and moments of inertia that no body has, found with the default values of the parameters.

Parts may have negative masses, as holes have; what moves as one must not. With J about the mass centre, the second
moments of a body are S = 1/2 tr(J) 1 - J, and no distribution of mass has a negative one: this is the triangle
inequality of the principal moments, and holds for every part of the matrix.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from itertools import combinations

from msgspec import Struct

from mechc.lang.diagnostics import Reporter

from ...flat.model import Origin
from ...graph import Node
from ...graph.evaluate import evaluate
from ...mechanics.defaults import default_values
from ...mechanics.kinematics.frames import Frame
from ...mechanics.kinematics.pose import Translate, rotation_of
from ...mechanics.system import MechanicalSystem, PointMass, RotaryInertia

ROUNDING = 1e-9
"""Relative to the body; moments of thin rods and disks are at the limit."""

LOST = 1e-13
"""Relative to the largest mass, or moment about the frame of a body, of the model: what is less is rounding of the tool that
turned and shifted the tensors (some 1e-20 kg.m^2 in descriptions of robots), and lost where moments are added up."""

Numbers = tuple[float, ...]
Table = list[list[float]]


class _Body(Struct, frozen=True):
    """What moves as one: point masses with their ``sizes`` [kg], parts with their ``tensors`` [kg.m^2]."""

    masses: tuple[PointMass, ...]
    sizes: tuple[float, ...]
    parts: tuple[RotaryInertia, ...]
    tensors: tuple[Table, ...]


def check_rigid_bodies(system: MechanicalSystem, reporter: Reporter) -> None:
    """Report negative masses and impossible inertias of everything that moves as one."""
    if not system.masses and not system.inertias:
        return
    from ...mechanics.bodies import carrier

    values = default_values(system)
    nodes = {m.mass for m in system.masses}
    nodes |= {x for part in system.inertias for row in part.inertia for x in row}
    known = values | dict(zip(nodes, evaluate(system.graph, list(nodes), values), strict=True))
    bodies: dict[int, tuple[list[PointMass], list[RotaryInertia]]] = {}
    for mass in system.masses:
        fixed = all(system.graph.is_zero(system.rate(x)) for x in mass.point.offset)
        owner = carrier(system, mass.point.frame) if fixed else mass
        bodies.setdefault(id(owner), ([], []))[0].append(mass)
    for part in system.inertias:
        bodies.setdefault(id(carrier(system, part.frame)), ([], []))[1].append(part)
    made = [
        _Body(
            tuple(masses),
            tuple(known[m.mass] for m in masses),
            tuple(parts),
            tuple([[known[x] for x in row] for row in part.inertia] for part in parts),
        )
        for masses, parts in bodies.values()
    ]
    if doubtful := [body for body in made if not _plain(body)]:
        lost_mass = LOST * max((abs(m) for body in made for m in body.sizes), default=0.0)
        lost_moment = LOST * max(_moment(system, body, known) for body in made)
        for body in doubtful:
            _check(system, body, known, lost_mass, lost_moment, reporter)


def _plain(body: _Body) -> bool:
    """Tell whether every single part of a body is possible: so is every sum of them."""
    return (
        all(_symmetric(tensor) for tensor in body.tensors)
        and all(m >= 0 for m in body.sizes)
        and all(_positive(_second_moments(tensor)) for tensor in body.tensors)
    )


def _moment(system: MechanicalSystem, body: _Body, values: Mapping[Node, float]) -> float:
    """Return the size of the moments that are added up about the frame which carries a body."""
    entries = [abs(x) for tensor in body.tensors for row in tensor for x in row]
    arms = zip(body.sizes, _places(system, body, values), strict=True)
    sizes = [*entries, *(abs(m) * _dot(p, p) for m, p in arms)]
    return max((x for x in sizes if math.isfinite(x)), default=0.0)


def _check(
    system: MechanicalSystem,
    body: _Body,
    values: Mapping[Node, float],
    lost_mass: float,
    lost_moment: float,
    reporter: Reporter,
) -> None:
    sizes = body.sizes
    for part, tensor in zip(body.parts, body.tensors, strict=True):
        if not _symmetric(tensor, lost_moment):
            reporter.error(
                "E0531",
                "an inertia matrix is symmetric",
                part.origin.shown,
                caption="this one is not",
                help="write J[i,j] = J[j,i] = -(integral of x[i]*x[j] over the mass)",
            )
            return
    total = math.fsum(sizes)
    if total < -max(ROUNDING * max(map(abs, sizes), default=0.0), lost_mass):
        unit = "" if system.model.dimensionless else " kg"
        _, lightest = min(zip(sizes, body.masses, strict=True), key=lambda pair: pair[0])
        _impossible(
            reporter, "mass", f"the sum of all that moves with it is {total:.6g}{unit}", lightest.origin
        )
    elif body.parts:
        _check_moments(
            _about_centre(system, body, values, total), lost_moment, body.parts[0].origin, reporter
        )


def _check_moments(tensor: Table, lost: float, origin: Origin, reporter: Reporter) -> None:
    if not all(math.isfinite(x) for row in tensor for x in row):
        return
    if not _positive(tensor, lost):
        which = "its moment of inertia is" if len(tensor) == 1 else "one of its moments of inertia is"
        _impossible(reporter, "moment of inertia", f"about its mass centre {which}", origin)
    elif not _positive(_second_moments(tensor), lost) and not _spins_alone(tensor):
        moments = ", ".join(f"{tensor[i][i]:.6g}" for i in range(3))
        reporter.note(
            "N0533",
            "no body has these moments of inertia",
            origin.shown,
            caption=f"about the mass centre of all that moves with it, about its axes: {moments}",
            help="each principal moment is at most the sum of the other two; of a thin disk it is the sum",
        )


def _spins_alone(tensor: Table) -> bool:
    """Whether there is one moment alone, as of a rotor whose other moments are those of the body that carries it."""
    pairs = [(i, j) for i in range(len(tensor)) for j in range(i)]
    minors = math.fsum(tensor[i][i] * tensor[j][j] - tensor[i][j] ** 2 for i, j in pairs)
    return minors <= ROUNDING * math.fsum(tensor[i][i] for i in range(len(tensor))) ** 2


def _impossible(reporter: Reporter, what: str, caption: str, origin: Origin) -> None:
    reporter.error(
        "E0530",
        f"negative {what}",
        origin.shown,
        caption=caption,
        help="a hole takes its negative mass and inertia from the body that it is rigidly connected to",
    )


def _about_centre(system: MechanicalSystem, body: _Body, values: Mapping[Node, float], total: float) -> Table:
    """Return the inertia of a body about its mass centre: 1x1 in the plane, 3x3 in space."""
    planar = system.kinematics.size == 2
    count = 1 if planar else 3
    result = [[0.0] * count for _ in range(count)]
    for part, tensor in zip(body.parts, body.tensors, strict=True):
        turned = tensor
        if not planar:
            axes, _ = _place(system, part.frame, values)
            half = [[_dot(row, column) for column in zip(*tensor, strict=True)] for row in axes]
            turned = [[_dot(row, other) for other in axes] for row in half]
        result = [[a + b for a, b in zip(r, s, strict=True)] for r, s in zip(result, turned, strict=True)]
    places = _places(system, body, values)
    centre = tuple(
        math.fsum(m * p[i] for m, p in zip(body.sizes, places, strict=True)) / total if total else 0.0
        for i in range(3)
    )
    for m, place in zip(body.sizes, places, strict=True):
        arm = tuple(p - c for p, c in zip(place, centre, strict=True))
        square = _dot(arm, arm)
        for i in range(count):
            for j in range(count):
                result[i][j] += m * ((square if i == j else 0.0) - (0.0 if planar else arm[i] * arm[j]))
    return result


def _places(system: MechanicalSystem, body: _Body, values: Mapping[Node, float]) -> list[Numbers]:
    """Return where the masses of a body are, on its carrier."""
    places = []
    for mass in body.masses:
        axes, origin = _place(system, mass.point.frame, values)
        offset = _in_space(evaluate(system.graph, list(mass.point.offset), values))
        places.append(tuple(o + _dot(row, offset) for o, row in zip(origin, axes, strict=True)))
    return places


def _place(system: MechanicalSystem, frame: Frame, values: Mapping[Node, float]) -> tuple[Table, Numbers]:
    """Return the axes (rows: of the carrier; columns: of the frame) and the origin of a frame on its carrier."""
    from ...mechanics.bodies import carrier

    graph, top = system.graph, carrier(system, frame)
    axes, origin = [[float(i == j) for j in range(3)] for i in range(3)], (0.0, 0.0, 0.0)
    at = frame
    while at is not top:
        assert at.step is not None and at.parent is not None
        if isinstance(at.step, Translate):
            offset = _in_space(evaluate(graph, list(at.step.offset), values))
            origin = (origin[0] + offset[0], origin[1] + offset[1], origin[2] + offset[2])
        else:
            turn = [evaluate(graph, list(row), values) for row in rotation_of(graph, at.step)]
            axes = [[_dot(row, column) for column in zip(*axes, strict=True)] for row in turn]
            x, y, z = (_dot(row, origin) for row in turn)
            origin = (x, y, z)
        at = at.parent
    return axes, origin


def _in_space(vector: Sequence[float]) -> Numbers:
    return (*vector, 0.0)[:3]


def _dot(a: Sequence[float], b: Sequence[float]) -> float:
    return sum(x * y for x, y in zip(a, b, strict=True))


def _symmetric(tensor: Table, lost: float = 0.0) -> bool:
    allowed = max(ROUNDING * max(abs(x) for row in tensor for x in row), lost)
    pairs = combinations(range(len(tensor)), 2)
    return not any(abs(tensor[i][j] - tensor[j][i]) > allowed for i, j in pairs)


def _second_moments(tensor: Table) -> Table:
    """Return S of J; in the plane, where nothing relates the only moment to others, J itself."""
    if len(tensor) == 1:
        return tensor
    half = sum(tensor[i][i] for i in range(3)) / 2
    return [[(half if i == j else 0.0) - tensor[i][j] for j in range(3)] for i in range(3)]


def _positive(tensor: Table, lost: float = 0.0) -> bool:
    """Tell whether a symmetric matrix is positive semidefinite: none of its principal minors is negative.

    ``lost``: what is nothing, added to its diagonal.
    """
    tensor = [[x + lost if i == j else x for j, x in enumerate(row)] for i, row in enumerate(tensor)]
    size = max(abs(x) for row in tensor for x in row)
    for order in range(1, len(tensor) + 1):
        for rows in combinations(range(len(tensor)), order):
            if _determinant([[tensor[i][j] for j in rows] for i in rows]) < -ROUNDING * size**order:
                return False
    return True


def _determinant(matrix: Table) -> float:
    if len(matrix) == 1:
        return matrix[0][0]
    signs = (1, -1, 1)
    smaller = ([row[:j] + row[j + 1 :] for row in matrix[1:]] for j in range(len(matrix)))
    return sum(s * x * _determinant(rest) for s, x, rest in zip(signs, matrix[0], smaller, strict=False))
