"""Pages run alike by both ways: mechc's own WebAssembly, and the C text of the same model by clang, as zig brings it, behind the
same kernel. Rows, outputs, pictures and events of the experiment have the same bits."""

from __future__ import annotations

import importlib.util
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from gallery import EXAMPLES
from msgspec.structs import replace
from wasm_module import WasmRun, needs_wasmtime

import mechc
from mechc.compiler.program import Program
from mechc.compiler.targets.alone import standing_alone
from mechc.compiler.targets.c import emit_c
from mechc.compiler.targets.c_data import record_text
from mechc.compiler.targets.wasm.link import linked
from mechc.compiler.targets.wasm.plan import web_plan
from mechc.web.build_kernels import FLAGS, LINK, sources
from mechc.web.kernels import KERNELS, loaded

pytestmark = [
    pytest.mark.slow,
    needs_wasmtime,
    pytest.mark.skipif(importlib.util.find_spec("ziglang") is None, reason="needs pip install ziglang"),
]

KERNEL = KERNELS[2]
EVERY_ROW = 101
NUMBERS, ROWS, OUTPUTS, PICTURE, EVENTS = 14, 8, 9, 10, 11
"""Places among the arrays of ``web.c``."""
EVENT = 4
"""Numbers of 64 bits of an event."""

MOTIONS = sorted(path for path in EXAMPLES.rglob("*.mech") if path.parent.name != "curves")


def zig(arguments: Sequence[str], folder: Path) -> None:
    subprocess.run([sys.executable, "-m", "ziglang", "cc", *FLAGS, *arguments], cwd=folder, check=True)


@pytest.fixture(scope="module")
def kernel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the objects of the kernel, and its headers."""
    folder = tmp_path_factory.mktemp("kernel")
    files = sources(KERNEL)
    for name, text in files.items():
        (folder / name).write_text(text, encoding="utf-8")
    for name in sorted(name for name in files if name.endswith(".c")):
        zig(["-c", name], folder)
    return folder


def by_clang(program: Program, experiment: str | None, kernel: Path, folder: Path) -> bytes:
    """Return the module of a program's C text, linked to the kernel."""
    program = standing_alone(program)
    plan = web_plan(program, experiment)
    plan = replace(plan, fields={name: value for name, value in plan.fields.items() if name != "model"})
    named = [*(f.name for f in program.functions if f.name in ("scene", "scene_still"))]
    named += [e.function for e in program.experiments if e.name == experiment]
    lines = ['#include "web_plan.h"', "const mech_model *mech_model_get(void);"]
    lines += [f"mech_function {name};" for name in named]
    lines += [*record_text(plan), "static web_plan whole;"]
    lines.append("__attribute__((constructor)) static void fill(void)")
    lines.append("{ whole = plan; whole.model = mech_model_get(); web_slot = &whole; }")
    (folder / "model.c").write_text(emit_c(program), encoding="utf-8")
    (folder / "plan.c").write_text("\n".join(lines) + "\n", encoding="utf-8")
    objects = [str(file) for file in sorted(kernel.glob("*.o"))]
    zig([f"-I{kernel}", "model.c", "plan.c", *objects, "-o", "page.wasm", *LINK], folder)
    return (folder / "page.wasm").read_bytes()


def told(module: bytes, options: Sequence[str]) -> tuple[list[int], list[np.ndarray]]:
    """Return how the run of an experiment ended, with its counts, and all its numbers."""
    machine = WasmRun(module, EVERY_ROW)
    call = machine.instance.call
    assert call("web_settle") == 0
    numbers = dict(zip(options, machine.array(NUMBERS, len(options)), strict=True))
    status, rows = machine.run(numbers.get("stop", 10.0), KERNEL.methods.index("dop853"), 1e-8)
    ny, _, _, _, _, n_outputs = machine.sizes()
    n_scene = int(machine.instance.view(call("web_sizes"), 7, np.int32)[6])
    counts = [int(call(name)) for name in ("web_n_grid", "web_n_events", "web_steps")]
    arrays = [rows.ravel(), machine.array(OUTPUTS, counts[0] * n_outputs)]
    arrays += [machine.array(PICTURE, counts[0] * n_scene), machine.array(EVENTS, counts[1] * EVENT)]
    return [status, ny, *counts], [array.view(np.int64) for array in arrays]


@pytest.mark.parametrize("path", MOTIONS, ids=lambda path: path.stem)
def test_whole_runs_have_the_bits_of_clang(path: Path, kernel: Path, tmp_path: Path) -> None:
    program = mechc.load(path, keep={"scene"}).compilation.program
    first = program.experiments[0] if program.experiments else None
    experiment, options = (first.name, [*first.options]) if first else (None, [])
    modules = (
        linked(program, loaded(KERNEL), experiment).module,
        by_clang(program, experiment, kernel, tmp_path),
    )
    (ours, found), (theirs, known) = (told(module, options) for module in modules)
    assert ours == theirs
    assert ours[0] in (1, 3), "it reached the end, or ended itself"
    for one, other in zip(found, known, strict=True):
        np.testing.assert_array_equal(one, other)
    assert len(found[0]) > ours[1], "more rows than that of the start"
