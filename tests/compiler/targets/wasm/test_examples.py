"""Every example is a valid module that runs its experiment to the end."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from gallery import EXAMPLES
from wasm_module import WasmRun, needs_wasmtime

import mechc
from mechc.compiler.targets.wasm.link import linked
from mechc.web.kernels import kernel_for, loaded

NUMBERS = 14
"""The place of the numbers of the experiment among the arrays of ``web.c``."""

MOTIONS = sorted(path for path in EXAMPLES.rglob("*.mech") if path.parent.name != "curves")


@pytest.mark.slow
@needs_wasmtime
@pytest.mark.parametrize("path", MOTIONS, ids=lambda path: path.stem)
def test_it_runs_to_the_end(path: Path) -> None:
    program = mechc.load(path, keep={"scene"}).compilation.program
    experiment = program.experiments[0] if program.experiments else None
    kernel = kernel_for("auto", events=program.switching is not None)
    module = linked(program, loaded(kernel), experiment.name if experiment else None).module
    machine = WasmRun(module, rows=11)
    assert machine.instance.call("web_settle") == 0
    names = [*experiment.options] if experiment else []
    numbers = dict(zip(names, machine.array(NUMBERS, len(names)), strict=True))
    status, rows = machine.run(numbers.get("stop", 10.0), kernel.methods.index("dop853"), 1e-8)
    assert status in (1, 3), "it reached the end, or ended itself"
    assert np.isfinite(rows).all()
