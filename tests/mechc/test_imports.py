"""No command imports what it does not use."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

HEAVY = ("numpy", "scipy", "sympy", "mpmath", "matplotlib", "fmpy", "pandas", "lark", "mechc.runtime")
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
    "mechc.runtime.studies.runs.condition",
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
        (["check", TREE], {"numpy", "mechc.runtime"}),  # its first instant is looked at
        (["check", LOOP], {"numpy", "mechc.runtime"}),
        (["show", "system", TREE], set()),
        (["explain", "E0301"], set()),
        (["run", TREE], {"numpy", "mechc.runtime"}),
        (["compile", TREE, "--target", "c", "-o", "out"], {"numpy", "mechc.runtime"}),
        (["equations", TREE], {"sympy", "mpmath"}),
        (
            ["bench", TREE, "--methods", "dop853", "--tolerances", "1e-6", "--stop", "1"],
            {"numpy", "mechc.runtime"},
        ),
    ],
    ids=lambda value: " ".join(Path(v).stem for v in value) if isinstance(value, list) else "",
)
def test_command_imports_what_it_uses(arguments: list[str], used: set[str], tmp_path: Path) -> None:
    assert imported(*arguments, folder=tmp_path) & {*HEAVY} == used


def test_run_of_a_kept_model_imports_what_it_uses(tmp_path: Path) -> None:
    for _ in range(2):  # the second one finds the code by what its program was kept as
        imported("run", TREE, folder=tmp_path)
    assert not imported("run", TREE, folder=tmp_path) & {*UNUSED_BY_A_RUN}
