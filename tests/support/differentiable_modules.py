"""Modules for NumPy, CasADi and JAX, written and loaded."""

from __future__ import annotations

import importlib.util
from collections.abc import Sequence
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import pytest

from mechc.compiler.program import Program
from mechc.compiler.targets.differentiable import CASADI, EXPORTED, JAX, Begin, emit_differentiable
from mechc.compiler.targets.python import emit_python

LIBRARIES = {"casadi": CASADI, "jax": JAX}
NOWHERE = Begin(0.0, (), (), {})


def wanted(name: str) -> None:
    """Skip the test where a library is missing."""
    pytest.importorskip(name, reason=f"needs {name}: pip install 'mechc[{name}]'")


def module(path: Path) -> ModuleType:
    """Load a module from its file."""
    spec = importlib.util.spec_from_file_location(path.stem, path)
    assert spec is not None
    assert spec.loader is not None
    found = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(found)
    return found


def plain_text(program: Program) -> str:
    """Return the text of the Python module of a program that begins nowhere."""
    return emit_python(program, NOWHERE)


def plain_module(program: Program) -> Any:
    """Return what that module holds."""
    namespace: dict[str, Any] = {"__name__": "generated"}
    exec(plain_text(program), namespace)
    return SimpleNamespace(**namespace)


def module_of(program: Program, library: str, folder: Path, exported: Sequence[str] = EXPORTED) -> ModuleType:
    """Write the module of a program, and load it."""
    wanted(library)
    path = folder / f"{program.name}_{library}.py".replace(" ", "_")
    path.write_text(emit_differentiable(program, LIBRARIES[library], NOWHERE, exported), encoding="utf-8")
    return module(path)
