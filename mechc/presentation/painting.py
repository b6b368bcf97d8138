"""The shapes of a scene on a Matplotlib figure, in the plane and in space."""

from __future__ import annotations

import re
from collections.abc import Sequence
from functools import cache, cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from mechc.presentation.letters import axis_label
from mechc.presentation.surfaces import drawn_triangles
from mechc.requests.parse_values import UsageMistake

if TYPE_CHECKING:
    from mechc.presentation.strokes import Strokes
    from mechc.runtime.interface import ShapeEntry
    from mechc.runtime.problem import Array
    from mechc.solution import Solution

INKS = ("#3572b0", "#c8553d", "#3f8f5f", "#8a6fb0", "#b08430", "#3a8f96", "#5a6068")
AXES = ("#d1493f", "#3f9b57", "#3572b0")
"""Of x, y and z of a frame."""
TRAIL, ROUGH = 1500, 200
"""Points of a path; times at which it is looked at how far all goes."""
FLAT = 8
"""What extends over less than this part of a scale has one of its own."""
NAMED = 12
"""Pixels of rows that have their names in thumbnails."""
INDICES = re.compile(r"\[[^\]]*\]")

GAUGES = ("bead", "dial")
"""Shapes without a place."""
ROADS = 6
"""Of more bodies no paths are drawn."""
TICKS, TICKS_IN_SPACE = 8, 5
"""Numbers along the longest side, in the plane and in space."""
SMALL = 0.012
"""Of the whole picture: radius of what has no size of its own."""


class Painter:
    """A figure on which the scene of a solution is painted at one of its ``times`` [n] after another.

    ``axes``: where to paint, if not on a figure of its own, which has ``inches`` and, unless it is ``bare``, scales; ``also``:
    points [n, 3] for which there is to be room; ``small``: radius of what has no size of its own, over the whole picture. The next
    bare painter of this size takes the axes of this one.
    """

    def __init__(
        self,
        solution: Solution,
        times: Array,
        axes: Any = None,
        also: Sequence[Array] = (),
        small: float = SMALL,
        inches: tuple[float, float] = (6.4, 4.8),
        bare: bool = False,
    ) -> None:
        staged = solution.staged()
        if staged is None:
            raise UsageMistake(
                "this run was made without a picture",
                "ask for it: simulate of a model loaded with keep={'scene'}",
            )
        scene, pictured = staged
        if not scene.shapes:
            raise UsageMistake(
                f"nothing of '{solution.model}' is drawn",
                "'draw' statements define what is shown: draw sphere() at {x, y};",
            )
        self.scene, self.times, self.solution = scene, times, solution
        self.rows = pictured(times)
        self.between = pictured
        self.flat = scene.size == 2
        self.moved = np.concatenate([self.rows, pictured(self._spread(ROUGH))])
        self.low, self.high = self._box(also)
        self.size = float(np.linalg.norm(self.high - self.low)) or 1.0
        self.small = small * self.size
        self.heaviest = max(
            (abs(self.rows[0, s.numbers[3]]) for s in scene.shapes if s.kind == "mass"), default=1.0
        )
        names = list(dict.fromkeys(s.name for s in scene.shapes))
        self.gauges = [s for s in scene.shapes if s.kind in GAUGES]
        self.inks = [
            s.colour
            or (INKS[1] if s.kind == "trail" else INKS[(names.index(s.name) + 6 * s.relative) % len(INKS)])
            for s in scene.shapes
        ]
        self.whole, self.bare = axes is None, bare
        self.axes: Any = self._own_axes(inches) if axes is None else axes
        self.prepared = False
        self.strokes: Strokes

    def _spread(self, count: int) -> Array:
        """Return times from the begin to the end."""
        return np.linspace(self.solution.time[0], self.solution.time[-1], count)

    @cached_property
    def fine(self) -> Array:
        """The times of paths."""
        return np.union1d(self._spread(TRAIL), self.times)

    @cached_property
    def paths(self) -> Array:
        """All numbers of the scene at these times."""
        return self.between(self.fine)

    def _own_axes(self, inches: tuple[float, float]) -> Any:
        if self.bare:
            axes = blank_axes(inches, (0.0, 0.0, 1.0, 1.0), self.flat)
        else:
            axes = _new_axes(
                inches, (0.115, 0.1, 0.865, 0.84) if self.flat else (0.04, 0.04, 0.9, 0.94), self.flat
            )
        self.figure = axes.figure
        if not self.flat:
            return axes
        wide, high = axes.get_window_extent().size
        spans = np.maximum(self.high - self.low, 1e-12 * self.size)[:2]
        room = np.maximum(spans, spans[::-1] * (wide / high, high / wide)) - spans  # what fills the figure
        self.low[:2] -= room / 2
        self.high[:2] += room / 2
        return axes

    def _box(self, also: Sequence[Array]) -> tuple[Array, Array]:
        """Return two corners [3] that hold all that is drawn."""
        points: list[Array] = [*also]
        for shape in (s for s in self.scene.shapes if s.kind not in (*GAUGES, "plane")):
            values = self.moved[:, list(shape.numbers)]
            if shape.kind in ("line", "spring"):
                count = 6 if shape.kind == "spring" else values.shape[1]
                points += [values[:, k : k + 3] for k in range(0, count, 3)]
            elif shape.kind in ("trail", "text", "mass", "arrow"):
                points.append(values[:, :3])
            elif shape.kind in ("polygon", "curve", "surface", "mesh"):
                axes = values[:, 3:12].reshape(-1, 3, 3)
                local = (
                    values[:, 12:].reshape(len(values), -1, 3)
                    if shape.kind != "mesh"
                    else _box_of(shape, values)
                )
                points += list(values[:, None, :3] + np.einsum("npk,nkj->npj", local, axes))
            else:
                sizes = np.zeros(3) if shape.relative else np.nanmax(np.abs(values[:, 12:14]), initial=0.0)
                if shape.kind == "box":
                    sizes = np.nanmax(np.abs(values[:, 12:15]), initial=0.0) / 2
                points += [values[:, :3] - sizes, values[:, :3] + sizes]
        found = np.concatenate([*points, np.empty((0, 3))])
        found = found[np.isfinite(found).all(axis=1)]
        if not len(found):
            return np.full(3, -1.0), np.ones(3)
        low, high = found.min(axis=0), found.max(axis=0)
        room = 0.05 * (float(np.linalg.norm(high - low)) or 1.0)
        return low - room, high + room

    def paint(self, k: int, *, opacity: float = 1.0, clear: bool = True) -> None:
        """Paint the scene at the time number ``k``; ``clear`` what was painted before."""
        if clear:
            self.prepare()
        for shape, ink in zip(self.scene.shapes, self.inks, strict=True):
            values = self.rows[k, list(shape.numbers)]
            if shape.kind in GAUGES:
                self._hand(shape, values[0], ink, opacity)
                continue
            if shape.kind == "trail":
                upto = int(np.searchsorted(self.fine, self.times[k], side="right"))
                path = self.paths[:upto, list(shape.numbers)]
                self.strokes.line(path, ink, 1.0, 0.8 * opacity, behind=True)
            elif np.isfinite(values).all():
                self._shape(shape, values, ink, opacity)
        if clear:
            self.tell(f"{self.times[k]:.3g}")

    def tell(self, times: str) -> Any:
        """Write times above the picture, and return what was written."""
        unit = self.solution.problem.time.unit
        return self.axes.set_title(
            f"{times} {unit}".rstrip(), fontsize=9, loc="right", y=1.01 if self.flat else 0.95
        )

    def trails(self) -> list[Array]:
        """Return the paths [n, 3] that are drawn."""
        return [self.paths[:, list(s.numbers)] for s in self.scene.shapes if s.kind == "trail"]

    def roads(self) -> list[Array]:
        """Return the paths [n, 3] of masses and balls, where there are few."""
        balls = [s for s in self.scene.shapes if s.kind in ("mass", "sphere")]
        return [self.paths[:, list(s.numbers[:3])] for s in balls] if len(balls) <= ROADS else []

    def prepare(self) -> None:
        """Clear the axes; draw scales and grid, and what stands still of gauges."""
        from mechc.presentation.strokes import Strokes  # it brings Matplotlib

        axes = self.axes
        if self.prepared:
            axes.clear()
        self.prepared, self.strokes = True, Strokes(axes, self.flat)
        axes.set_xlim(self.low[0], self.high[0])
        axes.set_ylim(self.low[1], self.high[1])
        if self.flat:
            axes.set_aspect("equal", adjustable="box")
        else:
            axes.set_zlim(self.low[2], self.high[2])
            spans = np.maximum(self.high - self.low, 0.2 * self.size)
            axes.set_box_aspect(spans, zoom=1.1 if self.whole else 1.0)
            axes.view_init(elev=18, azim=-60)
        for shape in self.gauges:
            self._gauge(shape)
        if self.bare or self.gauges:
            axes.set_axis_off()
        else:
            self._scales()

    def _scales(self) -> None:
        """Draw scales and grid."""
        axes, spans = self.axes, self.high - self.low
        for axis, span in zip("xy" if self.flat else "xyz", spans, strict=False):  # numbers that have room
            most = TICKS if self.flat else TICKS_IN_SPACE
            axes.locator_params(axis=axis, nbins=max(1, round(most * span / max(spans))), min_n_ticks=1)
        if self.whole:
            unit = "" if all(q.unit in ("", "1") for q in self.solution.problem.states) else "m"
            for axis in "xy" if self.flat else "xyz":
                getattr(axes, f"set_{axis}label")(axis_label(axis, unit), fontsize=9)
            axes.tick_params(labelsize=8)
        if self.flat:
            axes.grid(color="#e5e7eb", linewidth=0.6)
            axes.set_axisbelow(True)
            for side in axes.spines.values():
                side.set_color("#9ca3af")

    # ------------------------------------------------------------ shapes

    def _shape(self, shape: ShapeEntry, v: Array, ink: str, opacity: float) -> None:
        small = self.small
        match shape.kind:
            case "line":
                self.strokes.line(v.reshape(-1, 3), ink, 2.0, opacity)
            case "spring":
                self.strokes.line(_coil(v, v[6] * small if shape.relative else v[6]), ink, 1.3, opacity)
            case "mass":
                self._ball(v[:3], 2.2 * small * np.cbrt(abs(v[3]) / (self.heaviest or 1.0)), ink, opacity)
            case "text":
                self._text(v, shape.text, opacity)
            case "arrow":
                self.arrow(v[:3], v[3:6], ink, opacity)
            case "frame":
                length = v[12] * 6 * small if shape.relative else v[12]
                self.frame(v, length, opacity)
            case "sphere":
                self._ball(v[:3], small if shape.relative else v[12], ink, opacity)
            case "mesh":
                corners = np.array(drawn_triangles(shape.text)).reshape(-1, 3) * v[12:15]
                self.strokes.faces(_placed(v, corners).reshape(-1, 3, 3), ink, opacity)
            case "plane":
                self._plane(v, ink, opacity)
            case "polygon":
                corners = _placed(v, v[12:].reshape(-1, 3))
                self.strokes.faces(corners[None], ink, opacity)
            case "curve":
                self.strokes.line(_placed(v, v[12:].reshape(-1, 3)), ink, 1.5, opacity)
            case "surface":
                self._surface(_placed(v, v[12:].reshape(-1, 3)).reshape(*shape.grid, 3), ink, opacity)
            case _:
                self._solid(shape, v, ink, opacity, small)

    def _solid(self, shape: ShapeEntry, v: Array, ink: str, opacity: float, small: float) -> None:
        match shape.kind:
            case "box":
                edges = v[12:15] / 2
                if self.flat:
                    signs = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
                    self.strokes.faces(_placed(v, signs * edges)[None], ink, opacity)
                    return
                faces = [
                    np.roll([[s, a, b] for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))], k, axis=1)
                    for k in range(3)
                    for s in (-1, 1)
                ]
                corners = np.stack([_placed(v, face * edges) for face in faces])
                self.strokes.faces(corners, ink, opacity, convex=True)
            case "disk":
                radius = small if shape.relative else v[12]
                self._turned(v, v[13:16], np.array([[0.0, 0.0], [0.0, radius]]), ink, opacity)
            case "torus":
                angle = np.linspace(0, 2 * np.pi, 13)
                profile = np.column_stack([v[13] * np.sin(angle), v[12] + v[13] * np.cos(angle)])
                self._turned(v, v[14:17], profile, ink, opacity)
            case "cone":
                profile = np.array([[0, 0], [0, v[12]], [v[13], 0]])
                self._turned(v, v[14:17], profile, ink, opacity, convex=True)
            case _:
                h = v[13] / 2
                profile = np.array([[-h, 0], [-h, v[12]], [h, v[12]], [h, 0]])
                self._turned(v, v[14:17], profile, ink, opacity, convex=True)

    def _plane(self, v: Array, ink: str, opacity: float) -> None:
        """Paint what of an endless plane lies in the picture."""
        normal = v[12:15] @ v[3:12].reshape(3, 3)
        normal = normal / (np.linalg.norm(normal) or 1.0)
        middle = (self.low + self.high) / 2
        middle = middle - ((middle - v[:3]) @ normal) * normal
        side = np.cross(normal, np.eye(3)[2 if self.flat else int(np.argmin(np.abs(normal)))])
        if not (length := float(np.linalg.norm(side))):
            return  # the plane of the picture
        a = side / length
        b = np.cross(normal, a)
        half = 0.35 * self.size
        if not self.flat:
            corners = np.array([a + b, a - b, -a - b, -a + b]) * half
            self.strokes.faces((middle + corners)[None], ink, 0.3 * opacity)
            return
        spans = [(self.high[k] - self.low[k]) / abs(a[k]) for k in range(2) if abs(a[k]) > 1e-9]
        half = min(spans) / 2
        self.strokes.line(middle + np.outer([-half, half], a), ink, 1.5, opacity)

    def _turned(
        self, v: Array, axis: Array, profile: Array, ink: str, opacity: float, convex: bool = False
    ) -> None:
        """Paint a profile [n, 2] of places along an axis and radii, turned about it; in the plane its outline."""
        e = axis / (np.linalg.norm(axis) or 1.0)
        side = np.array([0.0, 0.0, 1.0]) if abs(e[2]) < 0.9 else np.array([1.0, 0.0, 0.0])
        a = np.cross(side, e)
        a /= np.linalg.norm(a)
        b = np.cross(e, a)
        if self.flat and abs(e[2]) < 0.9:
            outline = np.concatenate([profile, profile[::-1] * [1, -1]])
            self.strokes.faces(_placed(v, outline[:, :1] * e + outline[:, 1:] * a)[None], ink, opacity)
            return
        angle = np.linspace(0, 2 * np.pi, 25)
        around = np.cos(angle)[:, None] * a + np.sin(angle)[:, None] * b
        if self.flat:
            self.strokes.faces(_placed(v, around * profile[:, 1].max())[None], ink, opacity)
            self.strokes.line(_placed(v, np.array([[0.0, 0, 0], a * profile[:, 1].max()])), ink, 1.2, opacity)
            return
        points = profile[:, None, :1] * e + profile[:, None, 1:] * around[None]
        self._surface(_placed(v, points.reshape(-1, 3)).reshape(*points.shape), ink, opacity, convex)

    def _gauge(self, shape: ShapeEntry) -> None:
        """Draw the name of a gauge and its dial or scale, in a row of the picture."""
        axes, place, height = self.axes, self.axes.transAxes, self._height(shape)
        named = not self.bare or self._row() > NAMED
        if named:
            axes.text(0.02, height, shape.text, transform=place, va="center", fontsize=9)
        if shape.kind == "dial":
            turn = np.linspace(0, 2 * np.pi, 61)
            self.axes.plot(*self._on_dial(shape, turn).T, color="#9ca3af", lw=1, transform=place)
            return
        axes.plot([0.25, 0.95], [height, height], color="#9ca3af", lw=1, transform=place)
        *ends, last = self.tracks[shape.text]
        for x, end in zip((0.25, 0.95), ends, strict=True) if last and named else ():
            axes.text(x, height - 0.02, f"{end:.3g}", transform=place, va="top", ha="center", fontsize=7)

    def _hand(self, shape: ShapeEntry, value: float, ink: str, opacity: float) -> None:
        """Paint a value as a hand on a dial, or as a bead between its smallest and largest one."""
        height = self._height(shape)
        if shape.kind == "dial":
            hand = np.vstack([[0.6, height], self._on_dial(shape, np.array([value]))])
            self.strokes.on_axes(hand, ink, 2.0, opacity)
            return
        low, high, _ = self.tracks[shape.text]
        share = (value - low) / (high - low) if high > low else 0.5
        if np.isfinite(share):
            self.strokes.bead(np.array([0.25 + 0.7 * share, height]), ink, opacity, self._row())

    def _height(self, shape: ShapeEntry) -> float:
        return 1 - (list(self.tracks).index(shape.text) + 0.5) / len(self.gauges)

    def _row(self) -> float:
        """Return the pixels of the height of a gauge."""
        return float(self.axes.get_window_extent().height) / len(self.gauges)

    def _on_dial(self, shape: ShapeEntry, angle: Array) -> Array:
        """Return points [n, 2] of a dial, in shares of the axes."""
        box = self.axes.get_window_extent()
        reach = 0.4 / len(self.gauges)
        wide = reach * box.height / box.width
        return np.column_stack([0.6 + wide * np.cos(angle), self._height(shape) + reach * np.sin(angle)])

    @cached_property
    def tracks(self) -> dict[str, tuple[float, float, bool]]:
        """The ends of the scale of each gauge from above, and whether it is the last one on it. Those of one array share one, those of one
        unit do if none would hardly move on it."""
        problem = self.solution.problem
        units = {q.name: q.unit for q in (*problem.states, *problem.outputs)}
        own = {s.text: self.paths[:, s.numbers[0]] for s in self.gauges}
        ends = {text: (float(np.nanmin(values)), float(np.nanmax(values))) for text, values in own.items()}
        by_unit: dict[str, dict[str, list[str]]] = {}
        for shape in self.gauges:
            unit = shape.text if shape.kind == "dial" else f"in {units.get(shape.text, '')}"
            array = INDICES.sub("", shape.text)
            by_unit.setdefault(unit, {}).setdefault(array, []).append(shape.text)

        def span(names: Sequence[str]) -> tuple[float, float]:
            return min(ends[n][0] for n in names), max(ends[n][1] for n in names)

        found: dict[str, tuple[float, float, bool]] = {}
        for arrays in by_unit.values():
            every = [name for names in arrays.values() for name in names]
            sizes = [high - low for low, high in map(span, arrays.values())]
            low, high = span(every)
            together = all(size == 0 or high - low < FLAT * size for size in sizes)
            for names in [every] if together else arrays.values():
                found |= {name: (*span(names), name == names[-1]) for name in names}
        return found

    # ------------------------------------------------------------ strokes

    def _surface(self, points: Array, ink: str, opacity: float, convex: bool = False) -> None:
        if self.flat:
            for row in points:
                self.strokes.line(row, ink, 0.8, opacity)
            return
        self.strokes.faces(_patches(points), ink, opacity, convex)

    def _ball(self, centre: Array, radius: float, ink: str, opacity: float) -> None:
        fine = 2 if radius > 3 * self.small else 1
        if self.flat:
            self.strokes.circle(centre, radius, ink, opacity)
            return
        self.strokes.faces(centre + radius * _unit_ball(fine), ink, opacity, convex=True)

    def frame(self, v: Array, length: float, opacity: float = 1.0) -> None:
        """Paint the axes of a frame: its origin and three unit vectors [12]."""
        for axis, colour in zip(v[3:12].reshape(3, 3), AXES, strict=True):
            self.arrow(v[:3], axis * length, colour, opacity)

    def arrow(self, start: Array, vector: Array, ink: str, opacity: float) -> None:
        """Paint an arrow from a point [3]."""
        if np.linalg.norm(vector) > 0:
            self.strokes.arrow(start, vector, ink, opacity)

    def _text(self, place: Array, text: str, opacity: float) -> None:
        self.axes.text(*(place[:2] if self.flat else place[:3]), f" {text}", fontsize=9, alpha=opacity)


def _new_axes(inches: tuple[float, float], place: tuple[float, float, float, float], flat: bool) -> Any:
    """Return axes at a place of a figure of their own."""
    from matplotlib.figure import Figure

    return Figure(figsize=inches, dpi=100).add_axes(place, projection=None if flat else "3d")


_kept_axes = cache(_new_axes)


def blank_axes(inches: tuple[float, float], place: tuple[float, float, float, float], flat: bool) -> Any:
    """Return axes for a picture without scales, those of the one before: new ones take longer than some pictures."""
    axes = _kept_axes(inches, place, flat)
    for artist in (*axes.artists, *axes.lines, *axes.texts):
        artist.remove()
    axes.set_position(place)
    return axes


def _box_of(shape: ShapeEntry, values: Array) -> Array:
    """Return the corners [n, 8, 3] of the box around a mesh, in its axes."""
    corners = np.array(drawn_triangles(shape.text)).reshape(-1, 3)
    low, high = corners.min(axis=0), corners.max(axis=0)
    box = np.array([[(low, high)[i >> k & 1][k] for k in range(3)] for i in range(8)])
    placed: Array = values[:, None, 12:15] * box
    return placed


def _placed(v: Array, local: Array) -> Array:
    """Return points [n, 3] of a frame in the world."""
    found: Array = v[:3] + local @ v[3:12].reshape(3, 3)
    return found


def _patches(points: Array) -> Array:
    """Return the corners [m, 4, 3] of the faces between the points [n, k, 3] of a grid."""
    corners = (points[:-1, :-1], points[1:, :-1], points[1:, 1:], points[:-1, 1:])
    return np.stack(corners, axis=2).reshape(-1, 4, 3)


@cache
def _unit_ball(fine: int) -> Array:
    """Return the corners [m, 4, 3] of the faces of a ball."""
    angle, up = np.linspace(0, 2 * np.pi, 12 * fine + 1), np.linspace(0, np.pi, 6 * fine + 1)[:, None]
    points = np.stack(
        [np.sin(up) * np.cos(angle), np.sin(up) * np.sin(angle), np.cos(up) + 0 * angle], axis=-1
    )
    return _patches(points)


def _coil(v: Array, radius: float) -> Array:
    """Return the points of a spring from end to end."""
    begin, end, turns = v[:3], v[3:6], v[7]
    along = end - begin
    length = float(np.linalg.norm(along)) or 1e-12
    e = along / length
    a = np.array([-e[1], e[0], 0.0]) if np.hypot(e[0], e[1]) > 1e-9 else np.array([1.0, 0.0, 0.0])
    a /= np.linalg.norm(a)
    b = np.cross(e, a)
    s = np.linspace(0, 1, int(16 * turns) + 1)[:, None]
    coil = begin + (0.08 + 0.84 * s) * along
    coil = coil + radius * (np.sin(2 * np.pi * turns * s) * a + (np.cos(2 * np.pi * turns * s) - 1) * b)
    return np.vstack([begin, coil, end])
