"""Moving pictures and stroboscopic ones of a motion, from the same scene as a live page."""

from __future__ import annotations

import importlib.util
import itertools
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from mechc.requests.parse_values import UsageMistake

from .painting import Painter

if TYPE_CHECKING:
    from mechc.runtime.problem import Array
    from mechc.solution import Solution

ENDINGS = (".mp4", ".gif", ".webp")
FRAMES_PER_SECOND = 30
LONGEST, SHORTEST, SHOWN = 30.0, 1.0, 10.0
"""A motion of another duration than between the first two takes as many seconds as the last."""
SIZE = (6.4, 4.8)
DOTS = 100
COLOURS, LOOKED_AT = 64, 6
"""Of a gif; pictures from which they are chosen."""


def frame_times(solution: Solution, rate: float = FRAMES_PER_SECOND) -> Array:
    """Return the times [n] of the frames: the first and the last are those of the solution."""
    first, last = float(solution.time[0]), float(solution.time[-1])
    duration = last - first
    seconds = duration if SHORTEST <= duration <= LONGEST else SHOWN
    return np.linspace(first, last, max(2, round(seconds * rate) + 1))


def animate(solution: Solution, path: str | Path) -> int:
    """Write a moving picture (mp4, gif, webp) and return the number of its frames.

    Raises UsageMistake where the ending is another, nothing is drawn, or mp4 lacks its encoder.
    """
    path = Path(path)
    if path.suffix not in ENDINGS:
        raise UsageMistake(
            f"'{path}' has the ending '{path.suffix}'", f"moving pictures end with {', '.join(ENDINGS)}"
        )
    if path.suffix == ".mp4" and importlib.util.find_spec("imageio_ffmpeg") is None:
        raise UsageMistake(
            "mp4 needs an encoder, which is not installed",
            "pip install imageio-ffmpeg; gif and webp need none",
        )
    rate = 25 if path.suffix == ".gif" else FRAMES_PER_SECOND  # gif counts hundredths of a second
    times = frame_times(solution, rate)
    frames = frames_of(Painter(solution, times))
    if path.suffix == ".mp4":
        _write_mp4(path, frames, rate)
        return len(times)
    images = list(frames)
    if path.suffix == ".gif":
        images = in_few_colours(images)
    options: dict[str, Any] = {"lossless": False, "quality": 80} if path.suffix == ".webp" else {}
    images[0].save(
        path, save_all=True, append_images=images[1:], duration=round(1000 / rate), loop=0, **options
    )
    return len(times)


def snapshot(solution: Solution, path: str | Path, times: Sequence[float]) -> None:
    """Write one picture (png, pdf, svg) of the motion at several times, earlier ones paler.

    Raises UsageMistake for a time outside of the motion.
    """
    first, last = float(solution.time[0]), float(solution.time[-1])
    for time in times:
        if not first <= time <= last:
            raise UsageMistake(f"{time:g} lies outside of the motion, which goes from {first:g} to {last:g}")
    painter = Painter(solution, np.array(sorted(times), dtype=float))
    for k in range(len(times)):
        painter.paint(k, opacity=1.0 if len(times) == 1 else 0.25 + 0.75 * k / (len(times) - 1), clear=k == 0)
    painter.tell(", ".join(f"{t:.3g}" for t in sorted(times)))
    painter.figure.savefig(path, dpi=1.5 * DOTS)


def frames_of(painter: Painter) -> Iterator[Any]:
    """Yield each frame as a picture of Pillow: scales and grid, which stand still, are drawn once."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from PIL import Image

    axes: Any = painter.axes
    canvas: Any = FigureCanvasAgg(painter.figure)
    painter.prepare()
    canvas.draw()
    ground, renderer = canvas.copy_from_bbox(painter.figure.bbox), canvas.get_renderer()
    still = set(axes.get_children())
    for k, time in enumerate(painter.times):
        canvas.restore_region(ground)
        painter.strokes.clear()
        painter.paint(k, clear=False)
        painter.strokes.draw(renderer)
        texts = set(axes.get_children()) - still
        for text in texts if painter.bare else {*texts, painter.tell(f"{time:.3g}")}:
            text.draw(renderer)
        yield Image.frombytes("RGB", canvas.get_width_height(), canvas.buffer_rgba(), "raw", "RGBX")
        for text in texts:
            text.remove()


def in_few_colours(images: Sequence[Any]) -> list[Any]:
    """Return pictures of the same 64 colours, which are chosen from some of them."""
    from PIL import Image

    chosen = images[:: max(1, len(images) // LOOKED_AT)]
    width, height = chosen[0].size
    strip = Image.new("RGB", (width, height * len(chosen)))
    for k, image in enumerate(chosen):
        strip.paste(image, (0, k * height))
    palette = strip.quantize(COLOURS, method=Image.Quantize.MAXCOVERAGE)
    return [image.quantize(palette=palette, dither=Image.Dither.NONE) for image in images]


def _write_mp4(path: Path, frames: Iterator[Any], rate: int) -> None:
    import imageio_ffmpeg

    first = next(frames)
    writer = imageio_ffmpeg.write_frames(str(path), first.size, fps=rate, quality=7)
    writer.send(None)
    for frame in itertools.chain([first], frames):
        writer.send(frame.tobytes())
    writer.close()
