"""Moving thumbnails of the gallery: the scene without scales, four seconds long, as WebP; and where nobody wants motion, one picture of it."""

from __future__ import annotations

from pathlib import Path

import numpy as np

import mechc
from mechc.presentation.animation import frames_of
from mechc.presentation.painting import Painter

INCHES = (2.4, 1.8)
FRAMES, MILLISECONDS = 24, 165
STILL = FRAMES // 3
"""The frame that stands for the motion."""


def write_thumbnail(solution: mechc.Solution, path: Path) -> None:
    """Write a moving picture (webp), and beside it one that stands still (png)."""
    times = np.linspace(float(solution.time[0]), float(solution.time[-1]), FRAMES)
    painter = Painter(solution, times, small=0.02, inches=INCHES, bare=True)
    frames = list(frames_of(painter))
    frames[STILL].save(path.with_suffix(".png"))
    frames[0].save(
        path,
        save_all=True,
        append_images=frames[1:],
        duration=MILLISECONDS,
        loop=0,
        quality=70,
        method=0,
        kmax=0,
    )  # only the first frame is whole: half the time, two thirds of the size
