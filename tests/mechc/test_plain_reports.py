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
SOME = ("double_pendulum", "bouncing_ball", "four_bar", "heavy_top_rotation", "sampled_controller")
"""Bars with damping, events, a loop whose start is assembled, a rotation, many events."""
LOADING = {
    "bricard": "it has a warning, so that it is formed each time",
    "beam": "many states",
    "dominoes": "many states",
    "elastic_rod": "many states",
    "fekete": "many states",
    "jointed_chain": "many states",
    "pleiades": "many states",
    "stewart_platform": "many states",
    "exponential_force": "its steps are looked at for what is narrow",
    "toda": "its steps are looked at for what is narrow",
    "lorentz_inferred": "its outputs follow a solution of equations",
    "peaucellier": "it begins near a dead centre",
    "pendulum_cartesian": "it begins near a dead centre",
}
"""What loads NumPy though it is kept, and why: what is done then takes longer without."""
HEAVY = ("numpy", "sympy", "lark", "scipy", "subprocess")
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


@pytest.mark.parametrize(
    "name",
    [n if n in SOME[:3] else pytest.param(n, marks=pytest.mark.slow) for n in NAMES if n not in LOADING],
)
def test_a_kept_run_loads_no_numpy(name: str) -> None:
    """Neither it nor what forms or reads a model or starts a process, where the report is all that is asked for."""
    assert loaded(name) == []


@pytest.mark.slow
@pytest.mark.parametrize("name", LOADING)
def test_what_is_said_to_load_numpy_does(name: str) -> None:
    assert "numpy" in loaded(name)


def loaded(name: str) -> list[str]:
    """Give what a run loads of all this, once its model is kept."""
    file = EXAMPLES / f"{name}.mech"
    told = (
        "import sys\nfrom mechc.cli.main import run\n"
        f"code = run(['run', {str(file)!r}])\n"
        f"print(code, *[n for n in {HEAVY} if n in sys.modules])"
    )
    for _ in range(3):  # the first ones may form it
        done = subprocess.run([sys.executable, "-c", told], capture_output=True, text=True, check=True)
    code, *found = done.stdout.splitlines()[-1].split()
    assert code == "0", done.stderr
    return found
