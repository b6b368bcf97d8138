"""Strokes cover each other as bodies do: colours of single pixels, against the laws of blending."""

from __future__ import annotations

import io
from typing import Any

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from mechc.presentation.strokes import DARKEST, FILLED, LIGHT, Strokes

SQUARE = np.array([[-0.5, 0, -0.5], [0.5, 0, -0.5], [0.5, 0, 0.5], [-0.5, 0, 0.5]])
"""Across the y axis, along which one looks."""
ACROSS = np.array([[-0.9, 0, 0], [0.9, 0, 0]])


def stage() -> tuple[Any, Strokes]:
    """Return axes in space, which are seen from negative y, and strokes on them."""
    axes: Any = Figure(figsize=(2, 2), dpi=100).add_axes((0, 0, 1, 1), projection="3d")
    axes.set(xlim=(-1, 1), ylim=(-1, 1), zlim=(-1, 1))
    axes.view_init(elev=0, azim=-90)
    axes.set_axis_off()
    return axes, Strokes(axes, flat=False)


def middle(axes: Any) -> Any:
    """Return the colour in the middle of the picture."""
    canvas: Any = FigureCanvasAgg(axes.figure)
    canvas.draw()
    return np.asarray(canvas.buffer_rgba())[100, 100, :3] / 255


def at(y: float) -> Any:
    return np.array([0.0, y, 0.0])


@pytest.mark.parametrize("first", [0, 1])
def test_what_is_near_covers_what_is_far(first: int) -> None:
    axes, strokes = stage()
    pieces = [(SQUARE + at(-0.5), "#ff0000"), (SQUARE + at(0.5), "#0000ff")]
    for corners, ink in pieces[first:] + pieces[:first]:
        strokes.faces(corners[None], ink, 1.0)
    shade = DARKEST + (1 - DARKEST) * (1 - LIGHT[1]) / 2
    far = FILLED * shade * np.array([0, 0, 1]) + (1 - FILLED)  # on white
    near = FILLED * shade * np.array([1, 0, 0]) + (1 - FILLED) * far
    assert np.allclose(middle(axes), near, rtol=0, atol=2 / 255), "two roundings to a byte"


@pytest.mark.parametrize("y", [-0.1, 0.1])
def test_faces_of_different_sizes_cover_each_other_by_the_depth_of_their_own_corners(y: float) -> None:
    """A triangle before a square and one behind it: that it is drawn with a corner twice does not move it."""
    axes, strokes = stage()
    triangle = np.array([[-0.5, -0.45, -0.5], [0.5, -0.45, -0.5], [0, 0.9, 0.5]])  # its middle is at y = 0
    square = SQUARE + at(y)
    strokes.faces(square[None], "#0000ff", 1.0)
    strokes.faces(triangle[None], "#ff0000", 1.0)
    seen = middle(axes)
    assert (seen[0] > seen[2]) == (y > 0), "red is before blue where the square is farther than the middle"


def test_a_line_is_hidden_by_a_face_before_it_and_covers_one_behind_it() -> None:
    for y, expected in ((-0.5, np.array([0, 1, 0])), (0.5, None)):
        axes, strokes = stage()
        strokes.faces(SQUARE[None], "#ff0000", 1.0)
        strokes.line(ACROSS + at(y), "#00ff00", 12.0, 1.0)
        seen = middle(axes)
        if expected is not None:
            assert np.allclose(seen, expected, rtol=0, atol=2 / 255)
        else:
            assert seen[1] < 1 - FILLED + 2 / 255 < seen[0]


def test_of_a_convex_body_the_front_alone_is_drawn() -> None:
    """The ground shines through one layer of its faces, not through two."""
    corners = np.array([SQUARE + at(-0.4), SQUARE + at(0.4)])
    shade = DARKEST + (1 - DARKEST) * (1 - LIGHT[1]) / 2
    for convex, layers in ((True, 1), (False, 2)):
        axes, strokes = stage()
        strokes.faces(corners, "#0000ff", 1.0, convex=convex)
        assert middle(axes)[0] == pytest.approx((1 - FILLED) ** layers, abs=2 / 255)
        assert middle(axes)[2] == pytest.approx(shade + (1 - shade) * (1 - FILLED) ** layers, abs=2 / 255)


def test_the_head_of_an_arrow_keeps_its_size() -> None:
    """Its path in pixels is the same in a picture of ten times the scale, but for the length of the shaft."""
    widths = []
    for scale in (1.0, 10.0):
        axes: Any = Figure(figsize=(2, 2), dpi=72).add_axes((0, 0, 1, 1))
        axes.set(xlim=(0, scale), ylim=(0, scale))
        axes.set_axis_off()
        strokes = Strokes(axes, flat=True)
        strokes.arrow(np.array([0.2, 0.5, 0]) * scale, np.array([0.6, 0, 0]) * scale, "#ff0000", 1.0)
        canvas: Any = FigureCanvasAgg(axes.figure)
        canvas.draw()
        red = np.asarray(canvas.buffer_rgba())[..., 1] < 128
        widths.append((red.sum(axis=0).max(), red.sum(axis=1).max(), red.sum()))
    assert widths[0] == widths[1] and 4 <= widths[0][0] <= 8 and 80 <= widths[0][1] <= 92


def test_vectors_stay_vectors() -> None:
    """An SVG holds a path for each face and line, and no picture of points."""
    axes, strokes = stage()
    strokes.faces(SQUARE[None], "#ff0000", 1.0)
    strokes.line(ACROSS, "#00ff00", 12.0, 1.0)
    written = io.StringIO()
    axes.figure.savefig(written, format="svg")
    assert "<image" not in written.getvalue() and "#00ff00" in written.getvalue()
