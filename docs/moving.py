"""Make the moving picture at the head of the README: ``python docs/moving.py``; ``make gallery`` does it, too."""

from __future__ import annotations

import tempfile
from pathlib import Path

from PIL import Image, ImageSequence

import mechc
from mechc.presentation.animation import animate, in_few_colours

HERE = Path(__file__).resolve().parent
PICTURE = HERE / "gallery" / "moving_double_pendulum.gif"
STOP = "5 s"
SHARE = 2 / 3
"""Of the size of a moving picture of mechc: a page shows it small, and it is kept."""
EVERY = 2
"""Of the frames one in so many."""


def main() -> None:
    model = mechc.load(HERE.parent / "examples" / "double_pendulum.mech", keep={"scene"})
    with tempfile.TemporaryDirectory() as folder:
        whole = Path(folder) / "motion.gif"
        animate(model.simulate(stop=STOP), whole)
        with Image.open(whole) as file:
            duration = file.info["duration"] * EVERY
            frames = [frame.convert("RGB") for frame in ImageSequence.Iterator(file)][::EVERY]
    size = tuple(round(SHARE * n) for n in frames[0].size)
    small = [frame.resize(size, Image.Resampling.LANCZOS) for frame in frames]
    first, *others = in_few_colours(small)
    first.save(PICTURE, save_all=True, append_images=others, duration=duration, loop=0, optimize=True)


if __name__ == "__main__":
    main()
