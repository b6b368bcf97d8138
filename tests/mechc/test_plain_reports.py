"""The report of a run is the same text with and without NumPy, and most runs that are kept do not load it."""

from __future__ import annotations

import re
import subprocess
import sys

import numpy
import pytest
from gallery import EXAMPLES

from mechc.cli.main import run
from mechc.runtime.arrays import choice

NAMES = sorted(path.stem for path in EXAMPLES.glob("*.mech"))
SOME = ("double_pendulum", "bouncing_ball", "four_bar", "heavy_top_rotation")
"""Bars with damping, events, a loop whose start is assembled, a rotation."""
NEVER = ("beam", "normal_modes")
"""What takes long."""


def reported(
    name: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, **plain: bool
) -> tuple[int, str, str]:
    """Give exit code and texts of ``mechc run``, without the time that it took; ``plain``: how with plain arrays."""
    assert numpy.__name__ in sys.modules, (
        "where it is loaded, plain arrays are taken only if that is asked for"
    )
    arrays = choice.plain_arrays
    with monkeypatch.context() as patch:
        if plain:
            patch.setattr(choice, "plain_arrays", lambda: arrays(**plain))
        code = run(["run", str(EXAMPLES / f"{name}.mech")])
    told = capsys.readouterr()
    return code, re.sub(r"run time .*", "", told.out), told.err


@pytest.mark.parametrize(
    "name", [n if n in SOME else pytest.param(n, marks=pytest.mark.slow) for n in NAMES if n not in NEVER]
)
def test_the_text_is_the_same(
    name: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """With plain arrays until something needs NumPy, as in a process that begins, and all the way."""
    expected = reported(name, capsys, monkeypatch)
    for until_needed in (True, False):
        assert reported(name, capsys, monkeypatch, beside_numpy=True, until_needed=until_needed) == expected


@pytest.mark.parametrize("name", ["double_pendulum", "bouncing_ball"])
def test_a_kept_run_loads_no_numpy(name: str) -> None:
    """Neither it nor what forms or reads a model or starts a process, where the report is all that is asked for."""
    file = EXAMPLES / f"{name}.mech"
    told = (
        "import sys\nfrom mechc.cli.main import run\n"
        f"code = run(['run', {str(file)!r}])\n"
        "print(code, [n for n in ('numpy', 'sympy', 'lark', 'scipy', 'subprocess') if n in sys.modules])"
    )
    for _ in range(3):  # the first ones may form it
        done = subprocess.run([sys.executable, "-c", told], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "0 []"
