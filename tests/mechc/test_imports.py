"""No command imports what it does not use."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest
from slow_params import slow_but

HEAVY = ("numpy", "scipy", "sympy", "mpmath", "matplotlib", "fmpy", "pandas", "lark", "mechc.runtime.case")
"""``lark`` makes the parser's tables, once per installation: they are cached."""

UNUSED_BY_A_RUN = (
    "concurrent.futures",
    "csv",
    "json",
    "lark",
    "mechc.compiler.pipeline",
    "mechc.compiler.mechanics",
    "mechc.lang.parser",
    "mechc.presentation.animation",
    "mechc.runtime.ensembles",
    "mechc.runtime.fitting",
    "mechc.runtime.studies.runs.sensitivity",
    "mechc.runtime.tangent",
    "scipy",
    "subprocess",
    "sympy",
    "traceback",
)
"""What a run of a model that is kept does without: others are parsed, built, differentiated, fitted and drawn."""

EXAMPLES = Path(__file__).parents[2] / "examples"
TREE, LOOP = str(EXAMPLES / "double_pendulum.mech"), str(EXAMPLES / "four_bar.mech")


def imported(*arguments: str, folder: Path) -> set[str]:
    """Return the names of all modules that a command loads."""
    done = subprocess.run(
        [sys.executable, "-X", "importtime", "-m", "mechc", *arguments],
        capture_output=True,
        text=True,
        cwd=folder,
    )
    assert done.returncode == 0, done.stderr
    rows = done.stderr.splitlines()
    return {row.rpartition("|")[2].strip() for row in rows if row.startswith("import time:")}


@pytest.mark.parametrize(
    ("arguments", "used"),
    [
        (["--help"], set()),
        (["new", "swing"], set()),
        (["fmt", "--check", TREE], set()),
        (["check", TREE], {"numpy", "mechc.runtime.case"}),  # its first instant is looked at
        pytest.param(["check", LOOP], {"numpy", "mechc.runtime.case"}, marks=pytest.mark.slow),
        (["show", "system", TREE], set()),
        (["explain", "E0301"], set()),
        (["run", TREE], {"numpy", "mechc.runtime.case"}),
        (["compile", TREE, "--target", "c", "-o", "out"], {"numpy", "mechc.runtime.case"}),
        (["equations", TREE], {"sympy", "mpmath"}),
        (
            ["bench", TREE, "--methods", "dop853", "--tolerances", "1e-6", "--stop", "1"],
            {"numpy", "mechc.runtime.case"},
        ),
    ],
    ids=lambda value: " ".join(Path(v).stem for v in value) if isinstance(value, list) else "",
)
def test_command_imports_what_it_uses(arguments: list[str], used: set[str], tmp_path: Path) -> None:
    assert imported(*arguments, folder=tmp_path) & {*HEAVY} == used


def test_run_of_a_kept_model_imports_what_it_uses(tmp_path: Path) -> None:
    for _ in range(2):  # the second one finds the code by what its program was kept as
        imported("run", TREE, folder=tmp_path)
    assert sorted(imported("run", TREE, folder=tmp_path) & {*UNUSED_BY_A_RUN}) == []


LOADED = """
import sys
from mechc.cli.main import run
run(["run", sys.argv[1]])
own = [name for name in sys.modules if name.startswith("mechc.")]
others = {name.partition(".")[0] for name in sys.modules} - set(sys.stdlib_module_names)
libraries = {row.split()[-1] for row in open("/proc/self/maps") if ".so" in row and "site-packages" in row}
print("loaded", len(own), ",".join(sorted(others)), len(libraries))
"""
OTHERS = {"click", "msgspec", "numpy", "platformdirs", "typing_extensions"}
"""What runs use of others; ``__editable__...`` and ``_distutils_hack`` are the installer's."""
MOST_MODULES, MOST_LIBRARIES = 138, 8
"""Measured 126 to 129 of some 780 modules, and 6 libraries: two of NumPy, its linear algebra with what that needs, msgspec."""


@pytest.mark.skipif(not Path("/proc/self/maps").exists(), reason="libraries are read from /proc")
@pytest.mark.parametrize("name", slow_but(["four_bar"], ["double_pendulum", "four_bar", "bouncing_ball"]))
def test_what_a_scene_does_not_load(name: str, tmp_path: Path) -> None:
    """The house leaves out as well: of its own modules a run of a kept model loads a sixth."""
    for _ in range(3):
        command = [sys.executable, "-c", LOADED, str(EXAMPLES / f"{name}.mech")]
        done = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path, check=True)
    _, modules, others, libraries = done.stdout.splitlines()[-1].split()
    assert int(modules) <= MOST_MODULES and int(libraries) <= MOST_LIBRARIES
    foreign = {one for one in others.split(",") if not one.startswith("_") and one != "mechc"}
    assert foreign <= OTHERS


FIRST = """
import sys, mechc
mechc.load(sys.argv[1]).simulate()
print("loaded", sum(name.startswith("mechc.") for name in sys.modules))
"""
MOST_OF_FIRST = 310
"""Measured 300: everything from the parser to the kernel, for two bars."""


def test_what_a_first_scene_does_not_load(tmp_path: Path) -> None:
    """A model that nobody has compiled before loads no step of the compiler that it does not need."""
    command = [sys.executable, "-c", FIRST, str(EXAMPLES / "double_pendulum_bars.mech")]
    given = {**os.environ, "MECHC_CACHE": str(tmp_path / "cache")}
    done = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path, check=True, env=given)
    assert int(done.stdout.split()[-1]) <= MOST_OF_FIRST
