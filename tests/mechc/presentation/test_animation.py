"""Moving pictures play: frames are counted, and the first and the last compared with the scene."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from PIL import Image

import mechc
from mechc.cli.main import run
from mechc.presentation.animation import animate, frame_times, frames_of, snapshot
from mechc.presentation.painting import Painter
from mechc.requests.parse_values import UsageMistake

BALL = """
parameter v = 1 m/s;
coordinate Length x = 0 m;
initial der(x) = v;
kinetic 1/2*1 kg*der(x)^2;
draw sphere(10 cm) at {x, 0 m}, colour = "red";
experiment(stop = 1 s);
"""


def solution(text: str = BALL) -> mechc.Solution:
    return mechc.loads(text, keep={"scene"}).simulate()


def red(frame: Any) -> float:
    """Return where the red of a frame is, as a share of its width."""
    pixels: Any = np.asarray(frame.convert("RGB"), dtype=int)
    _, columns = np.nonzero((pixels[..., 0] > 180) & (pixels[..., 1] < 110) & (pixels[..., 2] < 110))
    assert columns.size, "nothing is red"
    found: float = float(columns.mean()) / pixels.shape[1]
    return found


def places(found: mechc.Solution) -> list[float]:
    """Return where the ball is in the scene at the start and the end, as shares of the width."""
    painter = Painter(found, np.array([0.0, 1.0]))
    painter.paint(0)
    painter.figure.draw_without_rendering()
    return [float(painter.axes.transData.transform((x, 0.0))[0]) / 640 for x in (0.0, 1.0)]


@pytest.mark.slow
@pytest.mark.parametrize("ending", ["gif", "webp"])
def test_frames_are_those_of_the_motion(ending: str, tmp_path: Path) -> None:
    found, path = solution(), tmp_path / f"motion.{ending}"
    count = animate(found, path)
    assert count == len(frame_times(found, 25 if ending == "gif" else 30))
    with Image.open(path) as picture:
        assert picture.n_frames == count  # type: ignore[attr-defined]
        first = red(picture.copy())
        picture.seek(count - 1)
        last = red(picture.copy())
    assert np.allclose([first, last], places(found), rtol=0, atol=2 / 640), "within two pixels"


def test_what_stands_still_is_drawn_once() -> None:
    """Frames drawn over one ground are those that are drawn whole, in the plane and in space."""
    turned = "coordinate Angle a = 0 rad; initial der(a) = 3 rad/s; frame f = world * rotx(a) * trans({0, 0, 1} m); mass 1 kg at f; experiment(stop = 1 s);"
    for text in (BALL, turned):
        found = solution(text)
        times = np.array([0.0, 0.4, 0.9])
        frames = [np.asarray(frame, dtype=int) for frame in frames_of(Painter(found, times))]
        for k, frame in enumerate(frames):
            painter = Painter(found, times)
            painter.paint(k)
            canvas = FigureCanvasAgg(painter.figure)
            canvas.draw()  # type: ignore[no-untyped-call]
            whole = np.asarray(canvas.buffer_rgba())[..., :3].astype(int)  # type: ignore[no-untyped-call]
            assert np.abs(frame - whole).max() <= 2 and whole.std() > 1
        assert np.abs(frames[0] - frames[2]).max() > 100, "it moves"


# of the reader, where its process ends late
@pytest.mark.filterwarnings("ignore:unclosed file:ResourceWarning")
@pytest.mark.slow
@pytest.mark.skipif(
    importlib.util.find_spec("imageio_ffmpeg") is None, reason="needs pip install imageio-ffmpeg"
)
def test_mp4_plays(tmp_path: Path) -> None:
    import imageio_ffmpeg

    found, path = solution(), str(tmp_path / "motion.mp4")
    count = animate(found, path)
    reader = imageio_ffmpeg.read_frames(path)
    size = next(reader)["size"]
    frames = [Image.frombytes("RGB", size, frame) for frame in reader]
    assert len(frames) == count == imageio_ffmpeg.count_frames_and_secs(path)[0]
    ends = [red(frames[0]), red(frames[-1])]
    assert np.allclose(ends, places(found), rtol=0, atol=3 / 640), (
        "within three pixels of a compressed picture"
    )


def test_what_cannot_be_shown_is_said(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    found = solution()
    with pytest.raises(UsageMistake, match="lies outside of the motion"):
        snapshot(found, tmp_path / "s.png", [0.0, 2.0])
    with pytest.raises(UsageMistake, match="has the ending"):
        animate(found, tmp_path / "motion.avi")
    with monkeypatch.context() as bare, pytest.raises(UsageMistake, match="mp4 needs an encoder"):
        bare.setattr(importlib.util, "find_spec", lambda name: None)
        animate(found, tmp_path / "motion.mp4")
    with pytest.raises(UsageMistake, match="nothing of 'model' is drawn"):
        snapshot(
            solution(BALL.replace('draw sphere(10 cm) at {x, 0 m}, colour = "red";', "draw none;")),
            tmp_path / "s.png",
            [0],
        )


def test_the_command_writes_a_snapshot(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "ball.mech").write_text(BALL)
    monkeypatch.chdir(tmp_path)
    assert run(["run", "ball.mech", "-q", "--snapshot", "0,0.5,1"]) == 0
    with Image.open(tmp_path / "ball_snapshot.png") as picture:
        assert picture.size == (960, 720)
    assert run(["run", "ball.mech", "-q", "--snapshot", "now"]) == 2


SPINNING = """
coordinate Rotation R;
initial der(R) = {0.1, 3, 0.1} rad/s;
inertia diag({1, 2, 3} kg.m^2) on world*R;
output w = der(R)[1];
experiment(stop = 1 s);
"""


def test_tracks_of_an_array_have_one_scale() -> None:
    """The shape of a mode is seen; what goes much farther has a scale of its own, and so has an angle."""
    found = solution(
        "coordinate Length x[3] = {1 mm, 2 mm, 1 mm}; coordinate Length far = 0 m; coordinate Angle phi = 0 rad; initial der(far) = 1 m/s;"
        "initial der(phi) = 1 rad/s; kinetic 1/2*1 kg*(dot(der(x), der(x)) + der(far)^2) + 1/2*1 kg.m^2*der(phi)^2;"
        "potential 1/2*10 N/m*dot(x, x); experiment(stop = 2 s);"
    )
    painter = Painter(found, np.array([0.0, 1.0]), small=0.02)
    assert [last for *_, last in painter.tracks.values()] == [False, False, True, True, True]
    for name, ends in {"x[1]": (-2e-3, 2e-3), "x[3]": (-2e-3, 2e-3), "far": (0, 2)}.items():
        assert painter.tracks[name][:2] == pytest.approx(ends, rel=1e-4, abs=1e-9)


def test_an_endless_plane_lies_across_the_picture(tmp_path: Path) -> None:
    """A line over nine tenths of the width in the plane; in space a face that is wider than what moves."""
    flat = solution(
        "coordinate x = 0 m; coordinate y = 0.1 m; kinetic 1/2*1 kg*(der(x)^2 + der(y)^2); draw sphere(5 cm) at {x, y};"
        'draw plane(axis = {0, 1}) at {0, 0} m, colour = "#0000ff"; initial der(x) = 1 m/s; experiment(stop = 1 s);'
    )
    snapshot(flat, tmp_path / "flat.png", [0.5])
    with Image.open(tmp_path / "flat.png") as picture:
        seen = np.asarray(picture.convert("RGB")).astype(int)
        blue = (seen[..., 2] > seen[..., 0] + 60).any(axis=0)
        assert blue.mean() > 0.8
    deep = solution(
        "coordinate Length r[3] = {0, 0, 1} m; kinetic 1/2*1 kg*dot(der(r), der(r)); draw sphere(5 cm) at r;"
        'draw plane() at {0, 0, 0.95} m, colour = "#0000ff"; initial der(r) = {1, 0, 0} m/s; experiment(stop = 1 s);'
    )
    snapshot(deep, tmp_path / "deep.png", [0.5])
    with Image.open(tmp_path / "deep.png") as picture:
        seen = np.asarray(picture.convert("RGB")).astype(int)
        assert (seen[..., 2] > seen[..., 0] + 30).any(axis=0).mean() > 0.25


def test_dials_of_a_model_in_space_stand_in_the_plane_of_the_picture(tmp_path: Path) -> None:
    """Nothing of it has a place, so that its output is shown by a dial."""
    found = solution(SPINNING)
    scene = found.problem.scene
    assert (
        scene is not None and {shape.kind for shape in scene.shapes} <= {"dial", "bead"} and scene.size == 2
    )
    snapshot(found, tmp_path / "dials.png", [0.1, 0.9])
    with Image.open(tmp_path / "dials.png") as picture:
        assert np.asarray(picture.convert("L")).min() < 100


def test_bare_pictures_do_not_see_the_one_before() -> None:
    """They share their axes: nothing of another model, with a name and a dial, stays on them."""
    found = solution()
    other = solution(
        "model Dial coordinate Angle q ~ 1; kinetic 1/2*(1 kg.m^2)*der(q)^2; experiment(stop = 1 s); end Dial;"
    )

    def pictures(of: mechc.Solution) -> list[bytes]:
        painter = Painter(of, np.array([0.0, 1.0]), inches=(2.4, 1.8), bare=True)
        return [frame.tobytes() for frame in frames_of(painter)]

    alone = pictures(found)
    assert pictures(other) != alone == pictures(found)
