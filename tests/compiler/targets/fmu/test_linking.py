"""Sources of several FMUs in one program: every name that the linker sees takes the prefix of the standard."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import fmpy
import pytest
from fmu_models import packed

from mechc.runtime.native.build import find_compiler

pytestmark = pytest.mark.skipif(
    find_compiler() is None or shutil.which("nm") is None or shutil.which("cc") is None,
    reason="needs a C compiler and nm",
)

HEADERS = str(Path(fmpy.__file__).parent / "c-code")

SPRING = """
model {name} "a mass on a spring"
  parameter k = {k} N/m;
  coordinate x = 0.5 m;
  kinetic 1/2*(2 kg)*der(x)^2;
  potential 1/2*k*x^2;
  {event}
  experiment(stop = 1 s);
end {name};
"""
EVENT = "when x < 0 m then reinit(der(x), -der(x)); end when;"

PROGRAM = """
#include <stdio.h>
#include "fmi3FunctionTypes.h"

#define DECLARE(name) \\
    fmi3InstantiateModelExchangeTYPE name##fmi3InstantiateModelExchange; \\
    fmi3EnterInitializationModeTYPE name##fmi3EnterInitializationMode; \\
    fmi3ExitInitializationModeTYPE name##fmi3ExitInitializationMode; \\
    fmi3GetContinuousStateDerivativesTYPE name##fmi3GetContinuousStateDerivatives; \\
    fmi3FreeInstanceTYPE name##fmi3FreeInstance;
#define RUN(name, token, n) \\
    do { \\
        fmi3Instance c = name##fmi3InstantiateModelExchange("one", token, NULL, 0, 0, NULL, NULL); \\
        double rates[4] = {0}; \\
        if (!c || name##fmi3EnterInitializationMode(c, 0, 0, 0, 0, 0)) return 1; \\
        if (name##fmi3ExitInitializationMode(c)) return 2; \\
        if (name##fmi3GetContinuousStateDerivatives(c, rates, n)) return 3; \\
        name##fmi3FreeInstance(c); \\
        printf("%.17g\\n", rates[1]); \\
    } while (0)

DECLARE(First_)
DECLARE(Second_)

int main(void)
{
    RUN(First_, "FIRST", 2);
    RUN(Second_, "SECOND", 4); /* with the energies that events take and give */
    return 0;
}
"""


def objects(folder: Path, source: str, fmi: int, prefix: str) -> str:
    """Compile the sources of an FMU in a folder; return its token."""
    package, _ = packed(source, fmi)
    folder.mkdir()
    names = [name for name in package.files if name.startswith("sources/") and name.endswith((".c", ".h"))]
    for name in names:
        (folder / Path(name).name).write_bytes(package.files[name])
    files = [Path(name).name for name in names if name.endswith(".c")]
    command = ["cc", "-std=c11", "-O0", "-c", f"-DFMI{fmi}_FUNCTION_PREFIX={prefix}", "-I", HEADERS, *files]
    subprocess.run(command, cwd=folder, check=True)
    return package.token


def visible(folder: Path) -> list[str]:
    """Return the global names that the objects of a folder define."""
    command = ["nm", "-g", "--defined-only", *map(str, folder.glob("*.o"))]
    lines = subprocess.run(command, capture_output=True, text=True, check=True).stdout.splitlines()
    return [line.split()[-1] for line in lines if len(line.split()) == 3]


@pytest.mark.slow
def test_two_models_in_one_program(tmp_path: Path) -> None:
    first = objects(tmp_path / "a", SPRING.format(name="First", k=8, event=""), 3, "First_")
    second = objects(tmp_path / "b", SPRING.format(name="Second", k=20, event=EVENT), 3, "Second_")
    (tmp_path / "main.c").write_text(PROGRAM.replace("FIRST", first).replace("SECOND", second))
    parts = [str(path) for folder in ("a", "b") for path in sorted((tmp_path / folder).glob("*.o"))]
    program = tmp_path / "program"
    command = ["cc", "-std=c11", "-I", HEADERS, str(tmp_path / "main.c"), *parts, "-o", str(program), "-lm"]
    subprocess.run(command, check=True)
    done = subprocess.run([program], capture_output=True, text=True)
    assert done.returncode == 0
    # -k x/m, each by its own code and parameters
    assert [float(line) for line in done.stdout.split()] == [-2.0, -5.0]


@pytest.mark.parametrize("fmi", [pytest.param(2, marks=pytest.mark.slow), 3])
def test_no_name_is_without_prefix(fmi: int, tmp_path: Path) -> None:
    objects(tmp_path / "a", SPRING.format(name="Spring", k=8, event=EVENT), fmi, "Spring_")
    names = visible(tmp_path / "a")
    assert f"Spring_fmi{fmi}GetVersion" in names
    assert [name for name in names if not name.startswith("Spring_")] == []
