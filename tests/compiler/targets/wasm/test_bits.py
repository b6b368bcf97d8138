"""The functions of models have the bits that clang, as zig brings it, makes of their C text."""

from __future__ import annotations

import importlib.util
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from gallery import EXAMPLES
from msgspec.structs import replace
from native_code import KERNEL, bits
from wasm_module import Floats, Instance, WasmModel, needs_wasmtime

import mechc
from mechc.compiler.pipeline import program_with
from mechc.compiler.program import Program
from mechc.compiler.targets.alone import standing_alone
from mechc.compiler.targets.c import emit_c
from mechc.compiler.targets.model_data import EXPAND, MODEL_FUNCTIONS, is_emitted
from mechc.web.build_kernels import FLAGS
from mechc.web.kernels import KERNELS

pytestmark = [
    pytest.mark.slow,
    needs_wasmtime,
    pytest.mark.skipif(importlib.util.find_spec("ziglang") is None, reason="needs pip install ziglang"),
]

CHAIN = """
import mech.planar.*;
model Chain
  structural parameter Integer n = 30;
  gravity {0, -9.81 m/s^2};
  Bar link[i in 1:n](m = 1 kg, l = 1 m);
  Revolute joint[i in 1:n]((if i == 1 then world else link[i-1].b) -> link[i].a, angle = 0.1*i*1 rad);
  experiment(stop = 1 s);
end Chain;
"""

MOTIONS = {path.stem: path for path in sorted(EXAMPLES.glob("*.mech"))}
"""All examples; the chain has functions as loops."""

DRIVER = """
#define EXPORTED(name) __attribute__((export_name(#name))) name
const mech_model *mech_model_get(void);
void EXPORTED(complete)(mech_real *p, const unsigned char *set) { mech_model_get()->parameters(p, set); }
void EXPORTED(drive)(int k, mech_real t, const mech_real *y, const mech_real *u, const mech_real *z, const mech_real *p, mech_real *out)
{
    switch (k) {
"""


def of_zig(program: Program, names: list[str], folder: Path) -> Instance:
    """Return the functions of the C text, as ``drive``."""
    lines = [
        f"    case {k}: {f'mech_model_get()->{name}' if name in MODEL_FUNCTIONS else name}(t, y, u, z, p, out); break;\n"
        for k, name in enumerate(names)
    ]
    (folder / "model.c").write_text(emit_c(program) + DRIVER + "".join(lines) + "    }\n}\n")
    include = [f"-I{KERNEL / room}" for room in (".", "algebra", "events", "run")]
    link = [
        "-mexec-model=reactor",
        "-Wl,--strip-all",
        "-Wl,--export-table",
        "-lm",
        "-o",
        str(folder / "model.wasm"),
    ]
    command = [sys.executable, "-m", "ziglang", "cc", *FLAGS, *include, str(folder / "model.c"), *link]
    subprocess.run(command, check=True)
    return Instance((folder / "model.wasm").read_bytes())


@pytest.mark.parametrize("name", [*MOTIONS, "chain"])
def test_functions_have_the_bits_of_clang(name: str, tmp_path: Path) -> None:
    model = mechc.loads(CHAIN) if name == "chain" else mechc.load(MOTIONS[name])
    parts = {*model.compilation.parts, "scene", "jacobian"}
    program = standing_alone(program_with(model.compilation, parts))
    crowd = program.switching is not None and program.switching.crowd is not None
    names = [f.name for f in program.functions if is_emitted(f) and f.name != EXPAND]
    names = [n for n in names if not (crowd and n in ("rhs", "outputs"))]
    ours, theirs = WasmModel(replace(program), KERNELS[2]), of_zig(program, names, tmp_path)
    sizes = [program.size(a) for a in ("y", "u", "z", "p")]
    sizes[1] += len(program.arrays.get("g", ()))
    sizes.append(max(f.n_out for f in program.functions))
    begin = theirs.room(8 * sum(sizes) + sizes[3])
    places = [int(begin + 8 * n) for n in np.cumsum([0, *sizes])]
    p = ours.default_parameters()
    theirs.call("complete", places[3], places[5])
    assert bits(p) == bits(theirs.view(places[3], sizes[3]))
    rng = np.random.default_rng(1)
    total = 0
    for _ in range(6):
        y, u = rng.normal(size=sizes[0]), rng.normal(size=sizes[1])
        z = (rng.random(sizes[2]) > 0.5).astype(float)
        for at, array in zip(places, (y, u, z), strict=False):
            theirs.view(at, len(array))[:] = array
        for k, name_ in enumerate(names):
            found = ours.call(name_, 0.7, y, u, z, p)
            theirs.view(places[4], len(found))[:] = 777.0
            theirs.call("drive", k, 0.7, *places[:5])
            known: Floats = theirs.view(places[4], len(found))
            assert bits(found) == bits(known), name_
            total += len(found)
    assert total >= 6 * sizes[0]
