"""Any order of calls is survived, under the sanitizers for addresses and undefined behaviour."""

from __future__ import annotations

import subprocess
from pathlib import Path

import fmpy
import pytest
from fmu_models import EXAMPLES, REPRESENTATIVE, packed

from mechc.runtime.native.build import find_compiler

CHOSEN = (
    "rotation",
    "closed loop",
    "stiff",
    "contact",
    "friction",
    "input",
    "discrete controller",
    "terminates",
)
MODELS = {
    "free": (EXAMPLES / "damped_oscillator.mech", "dop853"),
    **{name: REPRESENTATIVE[name] for name in CHOSEN},
}


@pytest.mark.slow
@pytest.mark.skipif(find_compiler() is None, reason="needs a C compiler")
@pytest.mark.parametrize("fmi", [2, 3])
@pytest.mark.parametrize("name", MODELS)
def test_random_calls(name: str, fmi: int, tmp_path: Path) -> None:
    source, method = MODELS[name]
    package, start = packed(source, fmi, method)
    for file, data in package.files.items():
        if file.startswith("sources/"):
            (tmp_path / file.removeprefix("sources/")).write_bytes(data)
    driver = f"random_calls{fmi}.c"
    for file in ("random_calls.h", driver):
        (tmp_path / file).write_bytes((Path(__file__).parent / file).read_bytes())
    flags = ["-std=c11", "-O1", "-g", "-fsanitize=address,undefined", "-fno-sanitize-recover=all"]
    headers = Path(fmpy.__file__).parent / "c-code"
    files = [p.name for p in sorted(tmp_path.glob("*.c"))]
    subprocess.run(["cc", *flags, f"-I{headers}", *files, "-o", "calls", "-lm"], cwd=tmp_path, check=True)
    description = package.files["modelDescription.xml"].decode()
    indicators = description.partition('numberOfEventIndicators="')[2].partition('"')[0] or "0"
    done = subprocess.run(
        ["./calls", package.token, str(len(start.problem.states)), indicators],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=300,
    )
    assert (done.returncode, done.stderr) == (0, "")
