"""What a scene is painted with: one artist of Matplotlib, whose paths all of its backends draw, in space from back to front.

Artists of their own for all lines and balls of a frame take several times as long to be made and drawn.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.artist import Artist, allow_rasterization
from matplotlib.collections import PolyCollection
from matplotlib.colors import to_rgb
from matplotlib.path import Path
from matplotlib.transforms import IdentityTransform
from msgspec import Struct

from mechc.runtime.problem import Array

LIGHT = np.array([2.0, -1.0, 2.0]) / 3
"""Where it comes from in space."""
DARKEST = 0.3
"""What is turned away from the light, over what is turned towards it."""
HIDDEN = -0.1
"""Cosine of the angle to the viewer beyond which a face is hidden: perspective turns it by less than that."""
HEAD, HEAD_IN_SPACE = (4.0, 2.0), (0.2, 0.05)
"""Length and half width of an arrow's head, in points; in space over the arrow's length."""
BEAD = 4.5
"""Points of its radius."""
FILLED = 0.8
"""Opacity of faces in space."""
Ink = tuple[float, float, float]


class FlatStroke(Struct):
    """A path in the plane, by ``transform`` in the picture; strokes of a higher ``order`` cover others."""

    order: int
    path: Path
    transform: Any
    ink: Ink
    width: float
    opacity: float
    filled: bool = False
    head: bool = False


class SpaceLine(Struct):
    """A line [n, 3] in space; ``behind`` all else."""

    points: Array
    ink: Ink
    width: float
    opacity: float
    behind: bool


class SpaceFaces(Struct):
    """Polygons [m, k, 3] in space and their normals [m, 3]."""

    corners: Array
    normals: Array
    ink: Ink
    opacity: float


class Strokes(Artist):
    """What was painted on axes since ``clear``: in space where they are, else ``flat``."""

    def __init__(self, axes: Any, flat: bool) -> None:
        super().__init__()
        self.stage, self.flat = axes, flat
        self.outlines: list[FlatStroke] = []
        self.pieces: list[SpaceLine | SpaceFaces] = []
        self.set_in_layout(False)
        self.set_zorder(2)
        axes.add_artist(self)

    def clear(self) -> None:
        self.outlines.clear()
        self.pieces.clear()

    def line(self, points: Array, ink: str, width: float, opacity: float, behind: bool = False) -> None:
        """Paint a line through points [n, 3]."""
        if self.flat:
            self._outline(2, Path(points[:, :2]), ink, width, opacity)
        else:
            self.pieces.append(SpaceLine(points, to_rgb(ink), width, opacity, behind))

    def faces(self, corners: Array, ink: str, opacity: float, convex: bool = False) -> None:
        """Paint polygons [m, k, 3]; of a body that is ``convex`` those that are not hidden behind it."""
        if not self.flat:
            normals = _normals(corners)
            if convex:
                middles = corners.mean(axis=1)
                outwards = middles - middles.mean(axis=0)
                normals *= np.sign((normals * outwards).sum(axis=1))[:, None]
                seen = normals @ _towards_viewer(self.stage) > HIDDEN
                corners, normals = corners[seen], normals[seen]
            self.pieces.append(SpaceFaces(corners, normals, to_rgb(ink), FILLED * opacity))
            return
        for face in corners[..., :2]:
            closed = Path(np.concatenate([face, face[:1]]), closed=True)
            self._outline(1, closed, ink, 1.2, opacity, filled=True)

    def circle(self, centre: Array, radius: float, ink: str, opacity: float) -> None:
        """Paint a circle in the plane."""
        circle = Path.circle((float(centre[0]), float(centre[1])), radius)
        self._outline(1, circle, ink, 1.0, opacity, filled=True)

    def arrow(self, start: Array, vector: Array, ink: str, opacity: float) -> None:
        """Paint an arrow from a point [3]."""
        end = start + vector
        if self.flat:
            self._outline(3, Path(np.array([start[:2], end[:2]])), ink, 1.6, opacity, filled=True, head=True)
            return
        side = np.cross(vector, _towards_viewer(self.stage))
        size = np.linalg.norm(side)
        side *= HEAD_IN_SPACE[1] * np.linalg.norm(vector) / size if size else 0.0
        neck = end - HEAD_IN_SPACE[0] * vector
        self.line(np.array([start, end, neck + side, end, neck - side]), ink, 1.5, opacity)

    def on_axes(self, points: Array, ink: str, width: float, opacity: float) -> None:
        """Paint a line through points [n, 2] in shares of the axes."""
        self.outlines.append(FlatStroke(2, Path(points), self.stage.transAxes, to_rgb(ink), width, opacity))

    def bead(self, place: Array, ink: str, opacity: float, room: float) -> None:
        """Paint a bead at a place in shares of the axes; ``room``: pixels of its row."""
        box, radius = self.stage.get_window_extent(), min(BEAD * self.stage.figure.dpi / 72, 0.4 * room)
        circle = Path.unit_circle()
        round_ = Path(place + radius / box.size * circle.vertices, circle.codes)
        outline = FlatStroke(2, round_, self.stage.transAxes, to_rgb(ink), 1.0, opacity, filled=True)
        self.outlines.append(outline)

    def _outline(self, order: int, path: Path, ink: str, width: float, opacity: float, **looks: bool) -> None:
        self.outlines.append(
            FlatStroke(order, path, self.stage.transData, to_rgb(ink), width, opacity, **looks)
        )

    # ------------------------------------------------------------ drawn

    @allow_rasterization  # type: ignore[untyped-decorator]
    def draw(self, renderer: Any) -> None:
        """Draw all of it: the name is Matplotlib's."""
        gc = renderer.new_gc()
        gc.set_clip_rectangle(self.stage.bbox)
        gc.set_capstyle("round")
        gc.set_joinstyle("round")
        for outline in sorted(self.outlines, key=lambda o: o.order):
            self._draw_outline(renderer, gc, outline)
        if self.pieces:
            self._draw_pieces(renderer, gc)
        gc.restore()

    def _draw_outline(self, renderer: Any, gc: Any, outline: FlatStroke) -> None:
        path, transform = outline.path, outline.transform
        if outline.head:
            path, transform = self._with_head(path, renderer), IdentityTransform()
        _looks(gc, outline)
        renderer.draw_path(gc, path, transform, outline.ink if outline.filled else None)

    def _with_head(self, path: Path, renderer: Any) -> Path:
        """Return an arrow in the pixels of a picture: its head keeps its size where scales change."""
        start, end = self.stage.transData.transform(path.vertices)
        length = float(np.hypot(*(end - start))) or 1.0
        along = (end - start) / length
        back, side = (renderer.points_to_pixels(size) for size in HEAD)
        neck, across = end - min(back, length) * along, side * np.array([-along[1], along[0]])
        corners = [start, neck, neck + across, end, neck - across, neck]
        codes = [Path.MOVETO, Path.LINETO, Path.MOVETO, Path.LINETO, Path.LINETO, Path.CLOSEPOLY]
        corners[5] = corners[2]
        return Path(np.array(corners), codes)

    def _draw_pieces(self, renderer: Any, gc: Any) -> None:
        """Draw lines and faces from back to front; all lines last where the axes sort nothing."""
        matrix, transform = self.stage.M, self.stage.transData  # as it was when the axes were drawn
        depths, corners, inks = self._seen_faces(matrix)
        lines: list[tuple[float, Array, SpaceLine]] = []
        for piece in self.pieces:
            if isinstance(piece, SpaceLine):
                seen = _projected(piece.points, matrix)
                depth = np.inf if piece.behind else float(np.nanmean(seen[:, 2]))
                lines.append((depth if self.stage.computed_zorder else -np.inf, seen[:, :2], piece))
        lines.sort(key=lambda one: -one[0])
        drawn = 0
        for depth, points, line in [*lines, (-np.inf, np.empty((0, 2)), None)]:
            behind = int(np.searchsorted(-depths, -depth))
            if behind > drawn:
                faces = PolyCollection(
                    corners[drawn:behind],  # type: ignore[arg-type]  # one array is drawn fastest
                    facecolors=inks[drawn:behind],
                    edgecolors="none",
                )
                faces.set_figure(self.figure)
                faces.set_transform(transform)
                faces.set_clip_box(self.stage.bbox)
                faces.draw(renderer)
                drawn = behind
            if line is not None:
                _looks(gc, line)
                renderer.draw_path(gc, Path(points), transform, None)

    def _seen_faces(self, matrix: Array) -> tuple[Array, Array, Array]:
        """Return depths [m] of all faces, the deepest first, their corners [m, k, 2] in the picture and their colours [m, 4].

        Those with fewer corners than others repeat their last one: Matplotlib draws polygons of one array fastest.
        """
        faces = [piece for piece in self.pieces if isinstance(piece, SpaceFaces)]
        if not faces:
            return np.empty(0), np.empty((0, 1, 2)), np.empty((0, 4))
        sizes = [piece.corners.shape[1] for piece in faces]
        column = np.arange(max(sizes))
        each = zip(faces, sizes, strict=True)
        corners = np.concatenate([piece.corners[:, np.minimum(column, size - 1)] for piece, size in each])
        counts = [len(piece.corners) for piece in faces]
        own = column < np.repeat(sizes, counts)[:, None]
        seen = _projected(corners, matrix)
        depths = np.mean(seen[..., 2], axis=1, where=own)
        order = np.argsort(-depths, kind="stable")
        order = order[np.isfinite(depths[order])]
        lit = _lit(np.concatenate([piece.normals for piece in faces]), _towards_viewer(self.stage))
        inks = np.repeat([(*piece.ink, piece.opacity) for piece in faces], counts, axis=0)
        inks[:, :3] *= lit[:, None]
        return depths[order], seen[order, :, :2], inks[order]


def _looks(gc: Any, of: FlatStroke | SpaceLine) -> None:
    gc.set_alpha(of.opacity)
    gc.set_foreground((*of.ink, of.opacity), isRGBA=True)
    gc.set_linewidth(of.width)


def _towards_viewer(axes: Any) -> Array:
    elevation, azimuth = np.deg2rad([axes.elev, axes.azim])
    return np.array(
        [np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)]
    )


def _projected(points: Array, matrix: Array) -> Array:
    """Return points [..., 3] of space in the picture, and how deep they lie in it."""
    seen = points @ matrix[:, :3].T + matrix[:, 3]
    found: Array = seen[..., :3] / seen[..., 3:]
    return found


def _lit(normals: Array, towards: Array) -> Array:
    """Return how bright each face is [m], over its colour: the light falls on the side that is seen."""
    lit = np.sign(normals @ towards) * (normals @ LIGHT)
    found: Array = DARKEST + (1 - DARKEST) * (1 + lit) / 2
    return found


def _normals(corners: Array) -> Array:
    """Return the unit normal [m, 3] of each polygon; zero where it has none."""
    a, b = corners[:, 2] - corners[:, 0], corners[:, -1] - corners[:, 1]
    normals = a[:, [1, 2, 0]] * b[:, [2, 0, 1]] - a[:, [2, 0, 1]] * b[:, [1, 2, 0]]  # np.cross takes longer
    sizes = np.linalg.norm(normals, axis=1)
    found: Array = normals / np.where(sizes > 0, sizes, 1.0)[:, None]
    return found
