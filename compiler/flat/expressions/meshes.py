"""Solids inside triangles: ``mesh_volume``, ``mesh_centre``, ``mesh_inertia`` of a file, or of listed corners and faces.

What is known when compiling is summed exactly; corners that are parameters or move make a formula.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from pathlib import Path

from mechc.lang.source import Span

from .. import types
from ..model import Apply, Expression, Kind, Literal
from ..moments import Moments, flaw, moments, repeated, two_sided
from ..names.scope import Poisoned, Scope
from ..values.evaluate import Value, constant, not_structural, to_expression
from ..values.mesh_files import READERS, triangles
from .files import noted, path_of, text_of
from .signature import ElaboratedCall

POWERS = {"mesh_volume": 3, "mesh_centre": 1, "mesh_inertia": 5}
"""Power of a length in what each function gives."""

MESHES = "an STL, OBJ, DAE or GLB file"
ENDS = [f"'{end}'" for end in READERS]

_OUTWARDS = "the corners of each triangle run counterclockwise, seen from outside"


def mesh(call: ElaboratedCall) -> Expression:
    """Return the volume, centre or inertia of unit density of a closed surface of triangles."""
    if call.arguments[0].type.kind is Kind.STRING:
        return _of_file(call)
    return _of_corners(call)


def mesh_path(scope: Scope, value: Expression, node_span: Span) -> Path:
    """Return the path of a mesh file."""
    return path_of(scope, value, node_span, READERS, "E1004", MESHES, f"{', '.join(ENDS[:-1])} or {ENDS[-1]}")


def _of_file(call: ElaboratedCall) -> Expression:
    scope, span = call.scope, call.nodes[0].span
    name = text_of(call, 0, "the name of a file")
    if call.scalar(1).dimension != call.dimension(types.LENGTH):
        raise call.wrong(1, "the length that 1 in the file is")
    path = mesh_path(scope, call.arguments[0], span)
    known = scope.flattening.meshes
    if str(path) not in known:
        try:
            noted(scope, name, path)
            surface = triangles(path)
        except (OSError, ValueError) as error:
            raise scope.fail("E1004", str(error), span) from None
        places = {corner: k for k, corner in enumerate(dict.fromkeys(c for t in surface for c in t))}
        try:
            corners = [tuple(map(Fraction, corner)) for corner in places]
        except (ValueError, OverflowError):
            raise scope.fail("E1004", f"a corner in '{path.name}' is not a number", span) from None
        faces = [tuple(places[c] for c in t) for t in surface]
        known[str(path)] = _enclosed(
            scope, span, corners, faces, [f"({x:g}, {y:g}, {z:g})" for x, y, z in places]
        )
    return _scaled(call, known[str(path)])


def _enclosed(
    scope: Scope,
    span: Span,
    corners: Sequence[Sequence[Fraction]],
    faces: Sequence[Sequence[int]],
    names: Sequence[str],
) -> Moments:
    same: dict[tuple[Fraction, ...], int] = {}
    merged = [same.setdefault(tuple(corner), k) for k, corner in enumerate(corners)]
    _check_single(scope, span, [[merged[k] for k in face] for face in faces], names)
    _check_closed(scope, span, faces, names)
    found = moments(corners, faces)
    if found is None or found.volume < 0:
        raise scope.fail(
            "E0337",
            "the triangles enclose nothing" if found is None else "the triangles face inwards",
            span,
            caption="each of them stands beside one that faces the other way" if two_sided(faces) else "",
            help=_OUTWARDS,
        )
    _check_pieces(scope, span, corners, faces, names)
    return found


def _check_pieces(
    scope: Scope,
    span: Span,
    corners: Sequence[Sequence[Fraction]],
    faces: Sequence[Sequence[int]],
    names: Sequence[str],
) -> None:
    """Report a piece of the surface within another one, or one that faces inwards and is not a hole."""
    from ..winding import misplaced

    if (wrong := misplaced(corners, faces)) is None:
        return
    face, count = wrong
    a, b, c = (names[k] for k in faces[face])
    raise scope.fail(
        "E0337",
        f"the surface encloses the same place {count} times"
        if count > 0
        else "a piece of the surface faces inwards, and is not a hole of another",
        span,
        caption=f"beside the triangle from {a} to {b} and {c}",
        help="what lies within pieces that overlap would count for each of them; a hole faces inwards"
        if count > 0
        else _OUTWARDS,
    )


def _check_single(scope: Scope, span: Span, faces: Sequence[Sequence[int]], names: Sequence[str]) -> None:
    if (double := repeated(faces)) is not None:
        first, count = double
        raise scope.fail(
            "E0337",
            f"{count} of the triangles stand more than once"
            if count > 1
            else "a triangle stands more than once",
            span,
            caption=f"as the one from {names[first[0]]} to {names[first[1]]} and {names[first[2]]}",
            help="what is inside would count more than once; a program for meshes removes double triangles",
        )


def _check_closed(scope: Scope, span: Span, faces: Sequence[Sequence[int]], names: Sequence[str]) -> None:
    found = flaw(faces)
    if found is None:
        return
    turned, p, q = found
    assert isinstance(p, int) and isinstance(q, int)
    edge = f"the edge from {names[p]} to {names[q]}"
    raise scope.fail(
        "E0337",
        "triangles that meet face opposite sides" if turned else "the surface is not closed",
        span,
        caption=f"both run along {edge}" if turned else f"{edge} has a triangle on one side only",
        help=_OUTWARDS
        if turned
        else "each edge belongs to two triangles, whose corners there are the same to the last digit",
    )


def _scaled(call: ElaboratedCall, found: Moments) -> Expression:
    """Return what is asked of a solid, times a power of the length that 1 in its file is."""
    value, shape = _moment(call.name, found)
    power = POWERS[call.name]
    scale, span = call.arguments[1], call.node.span
    dimension = scale.type.dimension**power
    exponent = Literal(type=types.INTEGER, span=span, value=Fraction(power))
    size: Expression = Apply(
        type=types.real(dimension), span=span, function="power", arguments=(scale, exponent)
    )
    return Apply(
        type=types.real(dimension, shape),
        span=span,
        function="multiply",
        arguments=(to_expression(value, types.real(shape=shape), span), size),
    )


def _moment(name: str, found: Moments) -> tuple[Value, tuple[int, ...]]:
    match name:
        case "mesh_volume":
            return found.volume, ()
        case "mesh_centre":
            return found.centre, (3,)
        case _:
            return found.tensor, (3, 3)


# ---------------------------------------------------------------- listed corners and faces


def _of_corners(call: ElaboratedCall) -> Expression:
    type = types.numeric(call.arguments[0].type)
    if type.kind is not Kind.REAL or len(type.shape) != 2 or type.shape[1] != 3:
        raise call.wrong(0, "the name of a file, or corners, a row of three lengths for each", "E0305")
    if type.dimension != call.dimension(types.LENGTH):
        raise call.wrong(0, "corners in lengths")
    faces = _faces(call, type.shape[0])
    power = POWERS[call.name]
    shape = {1: (3,), 3: (), 5: (3, 3)}[power]
    result = types.real(type.dimension**power, shape)
    corners = constant(call.arguments[0])
    names = [f"corner {k + 1}" for k in range(type.shape[0])]
    if isinstance(corners, tuple):
        rows: list[tuple[Fraction, ...]] = [tuple(row) for row in corners]  # type: ignore[arg-type]
        found = _enclosed(call.scope, call.node.span, rows, faces, names)
        return to_expression(_moment(call.name, found)[0], result, call.node.span)
    _check_single(call.scope, call.nodes[1].span, faces, names)
    _check_closed(call.scope, call.nodes[1].span, faces, names)
    return call.apply(result)


def _faces(call: ElaboratedCall, count: int) -> list[tuple[int, ...]]:
    """Return the corners of each triangle, counted from 0."""
    given = call.arguments[1]
    if given.type.kind not in types.NUMERIC or len(given.type.shape) != 2 or given.type.shape[1] != 3:
        raise call.wrong(1, "faces, a row of the numbers of three corners for each", "E0305")
    rows = constant(given)
    if not isinstance(rows, tuple):
        raise not_structural(call.scope, call.nodes[1], given, "which corners make a face")
    found = []
    for row in rows:
        assert isinstance(row, tuple)
        for x in row:
            if not isinstance(x, Fraction) or x.denominator != 1 or not 1 <= x <= count:
                raise _no_corner(call, x, count)
        found.append(tuple(int(x) - 1 for x in row if isinstance(x, Fraction)))
    return found


def _no_corner(call: ElaboratedCall, number: object, count: int) -> Poisoned:
    shown = f"{float(number):g}" if isinstance(number, Fraction) else str(number)
    return call.scope.fail(
        "E0337",
        f"there is no corner {shown}",
        call.nodes[1].span,
        help=f"corners are counted from 1 to {count}",
    )


MESH_RULES = dict.fromkeys(POWERS, mesh)
