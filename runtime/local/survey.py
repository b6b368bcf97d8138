"""Whether a list of equilibria can be complete: the signs of det K must add up to the degree of the forces.

Poincare and Hopf: on the boundary of a region the directions of the forces determine the sum over all zeros inside of the sign of
the determinant of their derivatives (J. Milnor, Topology from the Differentiable Viewpoint, 1965). On products of circles and
rotations it is 0; where a potential grows outwards the signs of det V'' add up to 1. In one and two dimensions the same count on the
cells of a grid finds zeros that Newton's method passed by, and points at which forces have no direction, as the place of a charge.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

from ..outcome import SimulationError
from ..problem import Array
from .equilibrium import REGULAR, at_rest, rest
from .operating_point import Site
from .search import MOST_FOUND, Search, spread_evenly
from .vibration import mass_matrix

CELLS = {1: 601, 2: 47}
"""Along each coordinate; odd, so that no node lies at the middle, where models like to be singular."""
FINER, LEVELS = {1: 27, 2: 9}, 6
"""Cells along each coordinate into which a cell and its neighbours are divided, and how often."""
MOST_CELLS = 600
"""That are divided."""
WIDER = (4.0, 16.0)
"""Boxes so many times as wide must have the same sum, where the model states no bounds."""
ROUND, FACE = 256, 64
"""Places along an edge of a rectangle, and on a face of a box of more dimensions."""
CLEAR, BETWEEN = 2.6, 17
"""Turns of the forces between two neighbours of a grid, above which their sense is looked for at so many places between them."""
BEYOND = 24
"""Guesses in the first of these boxes, from which equilibria beyond the bounds are looked for."""
STEEPER, ASCENT, PLACES, PEAKS = 1e9, 80, 512, 48
"""Growth of a force on the way to a point at which it has no bound, most steps of the way, places within the bounds, and those
of the largest forces, from which such ways begin."""

Field = Callable[[Array], Array]


class Survey(Struct, frozen=True):
    """``signs``: what the signs of det K of the equilibria add up to, ``expected``: what those of all add up to; None where it
    is not known. ``singular``: values of the coordinates at which forces have no direction. ``why``: in words."""

    signs: int | None
    expected: int | None
    singular: tuple[tuple[float, ...], ...]
    why: str

    @property
    def confirmed(self) -> bool:
        return self.signs is not None and self.signs == self.expected


def surveyed(search: Search) -> Survey:
    """Count signs within the bounds of a search, and look where the count finds more. Adds equilibria to the search."""
    site, box = search.site, search.box
    count = len(box.moved)
    reason = _reason(site, count)
    if not reason and any(search.goes_on(one) for one in search.found):
        reason = "equilibria that are not isolated cannot be counted"
    if len(search.found) >= MOST_FOUND:
        reason = f"the search ends with {MOST_FOUND} of them"
    if reason:
        return Survey(None, None, (), f"no count confirms that the list is complete: {reason}")
    field = _field(search)
    turning = box.periodic | search.turns()
    bounded = ~turning
    low, high = box.low.copy(), box.high.copy()
    singular: list[tuple[Array, int]] = []
    if count in CELLS and not search.turns().any():
        singular = _cells(search, field, low, high)
    elif bounded.any() and _unbounded(search, field):
        return Survey(
            None, None, (), "no count confirms that the list is complete: forces grow without bound"
        )
    degree = _degree(field, low, high, turning)
    middle, half = (low + high) / 2, (high - low) / 2
    open_sides = bounded & ~box.stated
    if open_sides.any():
        for factor in WIDER:
            reach = np.where(open_sides, factor * half, half)
            _look_beyond(search, field, middle - reach, middle + reach, factor == WIDER[0])
            if search.outside:
                why = f"others lie beyond the bounds: {search.outside[0]}"
                return Survey(None, None, _places(singular), why)
            if degree is not None and _degree(field, middle - reach, middle + reach, turning) != degree:
                return Survey(
                    None,
                    None,
                    _places(singular),
                    "the forces far beyond the bounds are of another kind: others may lie there",
                )
    signs = _signs(search, field)
    if degree is None or signs is None:
        why = (
            "the forces on the bounds do not decide it"
            if degree is None
            else "the stiffness at one of them is singular"
        )
        return Survey(None, None, _places(singular), f"no count confirms that the list is complete: {why}")
    # of F = -dV the signs are those of det(-K)
    expected = (-1) ** count * (degree - sum(index for _, index in singular))
    if signs == expected:
        return Survey(
            signs,
            expected,
            _places(singular),
            f"the signs of det K add up to {signs}, as they must where none is missing",
        )
    return Survey(
        signs,
        expected,
        _places(singular),
        f"the signs of det K add up to {signs} and must add up to {expected}: some are missing, or forces jump",
    )


def _look_beyond(search: Search, field: Field, low: Array, high: Array, guessed: bool) -> None:
    """Look for equilibria in a box that is wider than the bounds; the search notes those that lie outside."""
    start, count = at_rest(search.site, search.site.y), len(low)
    guesses = list(spread_evenly(BEYOND * guessed, count))
    if count in CELLS and not search.turns().any():
        guesses += [(place + 0.5) / CELLS[count] for place in _turned(field, low, high, CELLS[count])]
    inside = [search.box.low, search.box.high]
    for guess in guesses:
        values = low + guess * (high - low)
        if ((values < inside[0]) | (values > inside[1])).any() and not search.outside:
            search.again(search.placed(start, values))


def _reason(site: Site, count: int) -> str:
    if site.problem.hybrid is not None:
        return "forces switch"
    if site.problem.constraints:
        return "the model has constraints"
    return "" if count else "nothing depends on the coordinates"


def _field(search: Search) -> Field:
    """Return the generalised forces and rates of states [m] as a function of the values of the coordinates."""
    site, nv = search.site, search.site.problem.nv
    start = at_rest(site, site.y)
    rows = search.rows()

    def field(values: Array) -> Array:
        y = search.placed(start, values)
        rates = site.rates(y)[site.chart.nd :]
        mass = mass_matrix(site, y)
        found: Array = np.concatenate([mass @ rates[:nv], rates[nv:]])[rows]
        return found

    return field


def _places(singular: list[tuple[Array, int]]) -> tuple[tuple[float, ...], ...]:
    return tuple(tuple(float(v) for v in place) for place, _ in singular)


# ---------------------------------------------------------------- the sum


def _degree(field: Field, low: Array, high: Array, turning: NDArray[np.bool_]) -> int | None:
    """Return the degree of the forces on a box; None where what is seen on its boundary does not tell it."""
    count = len(low)
    bounded = np.flatnonzero(~turning)
    if not len(bounded):
        return 0
    if count == 1:
        ends = [float(field(side)[0]) for side in (low, high)]
        return (
            int(np.sign(ends[1]) - np.sign(ends[0])) // 2 if np.isfinite(ends).all() and all(ends) else None
        )
    if count == 2:
        return _around(field, low, high, turning)
    faces = []
    for j in bounded:
        for side in (low, high):
            places = low + spread_evenly(FACE, count) * (high - low)
            places[:, j] = side[j]
            faces.append((int(j), places, np.array([field(p) for p in places])))
    if not all(np.isfinite(forces).all() for _, _, forces in faces):
        return None
    across = [np.sign(forces[:, j]) for j, _, forces in faces]
    middle = ((low + high) / 2)[bounded]
    outwards = np.concatenate(
        [((places[:, bounded] - middle) * forces[:, bounded]).sum(axis=1) for _, places, forces in faces]
    )
    if all(abs(signs.sum()) == len(signs) for signs in across):
        product = 1
        for k in range(len(bounded)):
            product *= int(across[2 * k + 1][0] - across[2 * k][0]) // 2
    elif (outwards < 0).all() or (outwards > 0).all():
        product = int(np.sign(outwards[0])) ** len(bounded)
    else:
        return None
    return 0 if turning.any() else product


def _around(field: Field, low: Array, high: Array, turning: NDArray[np.bool_]) -> int | None:
    """Return how often the forces turn round on the way about a rectangle, or along both ends of a strip that closes."""
    share = np.linspace(0.0, 1.0, ROUND + 1)

    def turns(begin: Array, end: Array) -> float:
        forces = np.array([field(begin + s * (end - begin)) for s in share])
        steps = _wrapped(np.diff(np.arctan2(forces[:, 1], forces[:, 0])))
        straight = np.isfinite(steps).all() and np.abs(steps).max() < 2.0 and np.abs(forces).max(axis=1).all()
        return float(steps.sum()) / (2 * np.pi) if straight else np.nan

    corners = [low, np.array([high[0], low[1]]), high, np.array([low[0], high[1]])]
    sides = [turns(corners[k], corners[(k + 1) % 4]) for k in range(4) if not turning[(k + 1) % 2]]
    total = float(np.sum(sides))
    return round(total) if np.isfinite(total) and abs(total - round(total)) < 1e-6 else None


def _wrapped(angles: Array) -> Array:
    return (angles + np.pi) % (2 * np.pi) - np.pi


def _signs(search: Search, field: Field) -> int | None:
    """Return what the signs of det K add up to; None where one of them is singular."""
    total, rows = 0, search.rows()
    count = len(rows)
    for one in search.found:
        if one.free.size:
            return None
        if one.condition < REGULAR:
            try:
                here = rest(search.site, one.y, search.box.moved)
            except SimulationError:  # a derivative is undefined there
                return None
            slopes = _weighed(search, one.y, here.slopes)[rows]
            total += int(np.sign(np.linalg.det(-slopes / max(float(np.abs(slopes).max()), 1e-300))))
            continue
        values = search.values(one.y)
        near = 1e-3 * np.maximum(1e-3 * (search.box.high - search.box.low), 10 * one.errors[search.box.moved])
        index = _degree(field, values - near, values + near, np.zeros(count, dtype=bool))
        if index is None:
            return None
        total += (-1) ** count * index
    return total


def _weighed(search: Search, y: Array, slopes: Array) -> Array:
    """Return derivatives of forces from those of accelerations, at a state where forces vanish."""
    site, nv = search.site, search.site.problem.nv
    mass = mass_matrix(site, y)
    return np.vstack([mass @ slopes[:nv], slopes[nv:]])


# ---------------------------------------------------------------- cells


def _cells(search: Search, field: Field, low: Array, high: Array) -> list[tuple[Array, int]]:
    """Look in cells round which the forces turn, and finer about them; return singular points with their index."""
    count = len(low)
    singular: list[tuple[Array, int]] = []
    span = high - low
    # a zero at 180 degrees, as so many are, would lie on both ends of a turn
    shift = np.where(search.box.periodic, 0.0371 * span, 0.0)
    first = span / CELLS[count]
    pending = [(low - shift, high - shift, CELLS[count], 0)]
    seen: set[tuple[int, ...]] = set()
    looked = 0
    while len(seen) < MOST_CELLS:
        if not pending:
            if looked == len(search.found):
                break
            # beside every equilibrium, too: another one and a charge in the same cell make no turn
            known = search.values(search.found[looked].y)
            for level in range(LEVELS):
                width = first * (3.0 / FINER[count]) ** level
                pending.append(_beside(known, width, low - shift, high - shift, level + 1))
            looked += 1
        a, b, cells, level = pending.pop(0)
        width = (b - a) / cells
        for place in _turned(field, a, b, cells):
            centre = a + (place + 0.5) * width
            if level and not _known(search, singular, centre, width):
                search.again(search.placed(at_rest(search.site, search.site.y), centre))
            mark = (level, *np.rint(centre / width).astype(int).tolist())
            if level < LEVELS and mark not in seen:
                seen.add(mark)
                pending.append(_beside(centre, width, a, b, level + 1))
            elif level == LEVELS and not _known(search, singular, centre, width):
                index = _degree(field, centre - 2 * width, centre + 2 * width, np.zeros(count, dtype=bool))
                if index:
                    singular.append((centre, index))
    return singular


def _beside(
    centre: Array, width: Array, low: Array, high: Array, level: int
) -> tuple[Array, Array, int, int]:
    """Return a finer grid over a cell and its neighbours."""
    begin, end = np.maximum(centre - 1.5 * width, low), np.minimum(centre + 1.5 * width, high)
    return begin, end, FINER[len(centre)], level


def _known(search: Search, singular: list[tuple[Array, int]], centre: Array, width: Array) -> bool:
    """Whether an equilibrium or a singular point is known in a cell, or just beside it."""
    moved = search.box.moved  # a flat one is known less well than the finest cells are wide
    places = [(search.values(one.y), np.maximum(width, 10 * one.errors[moved])) for one in search.found]
    places += [(place, width) for place, _ in singular]
    turn = np.where(search.box.periodic, 2 * np.pi, np.inf)
    for place, near in places:
        d = place - centre
        d = np.where(np.isfinite(turn), _wrapped(d), d)
        if (np.abs(d) <= near).all():
            return True
    return False


def _turned(field: Field, low: Array, high: Array, cells: int) -> list[NDArray[np.intp]]:
    """Return the cells of a grid about which the forces turn round, by their numbers."""
    count = len(low)
    axes = [np.linspace(a, b, cells + 1) for a, b in zip(low, high, strict=True)]
    nodes = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, count)
    forces = np.array([field(node) for node in nodes])
    if count == 1:
        index = np.diff(np.sign(forces[:, 0])) / 2
    else:
        shape = (cells + 1, cells + 1)
        angles, places = np.arctan2(forces[:, 1], forces[:, 0]).reshape(shape), nodes.reshape(*shape, 2)
        along, up = (_clear(field, angles, places, axis) for axis in (0, 1))
        index = (along[:, :-1] + up[1:, :] - along[:, 1:] - up[:-1, :]) / (2 * np.pi)
    return list(np.argwhere(np.isfinite(index) & (np.rint(index) != 0)))


def _clear(field: Field, angles: Array, places: Array, axis: int) -> Array:
    """Return how far forces turn from one place to the next; not-a-number where their sense is not seen between them either."""
    steps = _wrapped(np.diff(angles, axis=axis))
    before, after = (np.take(places, range(k, places.shape[axis] - 1 + k), axis=axis) for k in (0, 1))
    for place in np.argwhere(np.abs(steps) >= CLEAR):
        k = tuple(place)
        forces = np.array([field(p) for p in np.linspace(before[k], after[k], BETWEEN)])
        finer = _wrapped(np.diff(np.arctan2(forces[:, 1], forces[:, 0])))
        steps[k] = finer.sum() if np.abs(finer).max() < CLEAR else np.nan
    return steps


def _unbounded(search: Search, field: Field) -> bool:
    """Whether the forces grow without bound on the way to a point within the bounds: their logarithm is followed upwards."""
    site, box = search.site, search.box
    start = at_rest(site, site.y)
    points = spread_evenly(2 * PLACES, len(box.moved))
    places = box.low + points[:PLACES] * (box.high - box.low)
    if search.found:  # and about what is found
        known = np.array([search.values(one.y) for one in search.found])
        span = np.where(search.turns(), box.high - box.low, np.ptp(known, axis=0))
        about = known.mean(axis=0) + (points[PLACES:] - 0.5) * 1.5 * span
        places = np.vstack([places, np.clip(about, box.low, box.high)])
    with np.errstate(all="ignore"):
        sizes = np.array([float(np.linalg.norm(field(p))) for p in places])
    if not np.isfinite(sizes).all():
        return True
    for k in np.argsort(-sizes)[:PEAKS]:
        values, first = places[k], max(float(sizes[k]), 1e-300)
        for _ in range(ASCENT):
            try:
                here = rest(site, search.placed(start, values), box.moved)
            except SimulationError:
                return True
            size = float(np.linalg.norm(here.forces))
            if size > STEEPER * first:
                return True
            slope = here.slopes.T @ here.forces / max(size, 1e-300) ** 2
            steep = float(slope @ slope)
            if not steep > 0:
                break
            values = values + slope / steep
            if ((values < box.low) | (values > box.high)).any():
                break
    return False
