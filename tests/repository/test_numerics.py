"""Rank, roots and Newton's method stand in one room, ``runtime/numerics``, which says what its tolerances are relative to."""

from __future__ import annotations

import ast
import re
from pathlib import Path

from .test_layout import ROOT, SOURCES, python_files

OWN = re.compile(
    r"svd|svdvals|lstsq|lsq_linear|pinvh?|matrix_rank|cond|null_space|orth|lsmr|lsqr"
    r"|brentq|brenth|ridder|bisect|toms748|newton|newton_krylov|root|root_scalar|fsolve|minimize_scalar"
)
"""Functions of NumPy's and SciPy's ``linalg`` and ``optimize``."""
LEFT = {
    "runtime/start/impossible_start.py": 1,
    "runtime/start/initial.py": 2,
}
"""Calls elsewhere; the list may only become shorter."""


def calls(text: str) -> list[str]:
    """Return the names that a text takes from ``linalg`` or ``optimize`` and that belong to the room."""
    found = []
    for node in ast.walk(ast.parse(text)):
        match node:
            case ast.ImportFrom(module=str(module), names=names) if module.split(".")[-1] in (
                "linalg",
                "optimize",
            ):
                found += [alias.name for alias in names]
            case ast.Attribute(
                value=ast.Attribute(attr="linalg" | "optimize") | ast.Name(id="linalg" | "optimize")
            ):
                found.append(node.attr)
    return [name for name in found if OWN.fullmatch(name)]


def test_calls_are_seen() -> None:
    text = "import numpy as np\nfrom scipy.optimize import brentq, minimize\nnp.linalg.svd(a)\nnp.linalg.norm(a)\n"
    assert sorted(calls(text)) == ["brentq", "svd"]
    assert calls("from scipy import linalg\nlinalg.null_space(a)\n") == ["null_space"]


def test_no_other_room_decides_what_counts_as_zero() -> None:
    elsewhere: dict[str, int] = {}
    for path in python_files(*SOURCES):
        name = path.relative_to(ROOT).as_posix()
        if Path(name).parent != Path("runtime/numerics") and (
            count := len(calls(path.read_text(encoding="utf-8")))
        ):
            elsewhere[name] = count
    assert {name: n for name, n in elsewhere.items() if n > LEFT.get(name, 0)} == {}
