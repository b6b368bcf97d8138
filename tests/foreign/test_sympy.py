"""Systems of SymPy's tests and of PyDy's examples move in mechc as SymPy says: accelerations and reactions at random states."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import pytest
import sympy
from foreign import page
from foreign.case import System, differences, drawn, stored
from foreign.table import NO_MOTION, SYSTEMS, WAITING
from msgspec.structs import astuple, replace

import mechc

NAMED = {s.name: s for s in SYSTEMS}
STORED = [s for s in SYSTEMS if s.stored]


@pytest.mark.parametrize(
    "system", [pytest.param(s, id=s.name, marks=[pytest.mark.slow] if s.slow else []) for s in SYSTEMS]
)
def test_agrees_with_sympy(system: System) -> None:
    assert differences(system) < system.tolerance


@pytest.mark.parametrize(
    "name, right, wrong",
    [
        ("simple pendulum", "cos(theta)", "cos(1.001*theta)"),
        ("rolling disc, from its contact", "1/2, 1/4", "1/2, 0.2501"),
        ("rolling disc, from its contact", "multiplier(across)", "-multiplier(across)"),
        ("four-bar linkage", "J4(link[3].b -> world)", "J4(link[3].c -> world)"),
    ],
)
def test_a_wrong_model_is_seen(name: str, right: str, wrong: str) -> None:
    system = NAMED[name]
    assert right in system.text
    assert differences(replace(system, text=system.text.replace(right, wrong))) > 1e-5


ROD = """
parameter l = 1 m;
gravity {0, -9.81 m/s^2, 0};
coordinate q1 = 0.1 rad;
coordinate q2 = 0.2 rad;
coordinate q3 = 0.3 rad;
mass 1 kg at world * rotz(q1) * rotx(q2) * roty(q3) * {0, -l, 0};
experiment(stop = 1 s);
"""


@pytest.mark.slow
@pytest.mark.parametrize("system", STORED, ids=[s.name for s in STORED])
def test_numbers_that_are_kept_are_those_of_sympy(system: System) -> None:
    for kept, now in zip(stored()[system.name], drawn(system), strict=True):
        for a, b in zip(astuple(kept), astuple(now), strict=True):
            assert a == pytest.approx(b, rel=1e-12, abs=1e-12)


def test_an_undetermined_turn_is_refused() -> None:
    """Three angles of a particle on a rod: nothing says how the rod turns about itself."""
    with pytest.raises(mechc.CompileError, match="nothing with mass moves with 'q3'"):
        mechc.loads(ROD)


def test_page_is_up_to_date() -> None:
    kept = page.PAGE.read_text(encoding="utf-8")
    assert page.page() == kept, "PYTHONPATH=tests/foreign python -m foreign.page writes it again"


@pytest.mark.skipif(
    not sympy.__version__.startswith("1.14"), reason="the table is of the tests of SymPy 1.14"
)
def test_no_test_of_sympy_is_left_out() -> None:
    """Each test of a module of which single tests are named is named, in a system or with a reason."""
    folder = Path(sympy.__file__).parent / "physics" / "mechanics" / "tests"
    if not folder.is_dir():
        pytest.skip("this SymPy comes without its tests")
    sources = [*(s.source for s in SYSTEMS), *(w.source for w in (*WAITING, *NO_MOTION))]
    named = " ".join(sources)
    for file in sorted(folder.glob("test_*.py")):
        assert re.search(rf"\b{file.stem}\b", named), file.stem
    for file in sorted(folder.glob("test_*.py")):
        if file.stem not in ("test_kane", "test_lagrange", "test_linearize") and not re.fullmatch(
            r"test_(kane|lagrange)\d|test_linearity_.*", file.stem
        ):
            continue
        for node in ast.parse(file.read_text(encoding="utf-8")).body:
            if isinstance(node, ast.FunctionDef) and node.name.startswith("test_"):
                assert re.search(rf"\b{node.name}\b", named), f"{file.stem}: {node.name}"
