"""Any order of calls is survived, under the sanitizers for addresses and undefined behaviour."""

from __future__ import annotations

import subprocess
from pathlib import Path

import fmpy
import pytest

from mechc.api import load
from mechc.compiler.targets.fmu.export import make_package, start_of
from mechc.runtime.build import find_compiler

EXAMPLES = Path(__file__).parents[4] / "examples"


@pytest.mark.slow
@pytest.mark.skipif(find_compiler() is None, reason="needs a C compiler")
@pytest.mark.parametrize("name", ["damped_oscillator", "heavy_top_rotation", "double_pendulum_bars"])
def test_random_calls(name: str, tmp_path: Path) -> None:
    model = load(EXAMPLES / f"{name}.mech")
    start = start_of(model.problem("c", reproducible=True))
    package = make_package(model.compilation.equations, start, fmi=3, method="dop853", platforms=())
    for file, data in package.files.items():
        if file.startswith("sources/"):
            (tmp_path / file.removeprefix("sources/")).write_bytes(data)
    (tmp_path / "random_calls.c").write_bytes((Path(__file__).parent / "random_calls.c").read_bytes())
    flags = ["-std=c11", "-O1", "-g", "-fsanitize=address,undefined", "-fno-sanitize-recover=all"]
    headers = Path(fmpy.__file__).parent / "c-code"
    files = [p.name for p in sorted(tmp_path.glob("*.c"))]
    subprocess.run(["cc", *flags, f"-I{headers}", *files, "-o", "calls", "-lm"], cwd=tmp_path, check=True)
    done = subprocess.run(
        ["./calls", package.token], cwd=tmp_path, capture_output=True, text=True, timeout=300
    )
    assert (done.returncode, done.stderr) == (0, "")
