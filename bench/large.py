"""Large models: what it takes from the text to the library, and one evaluation, as loops and as straight lines."""

from __future__ import annotations

import ctypes
import resource
import subprocess
import tempfile
import time
from fractions import Fraction
from pathlib import Path
from statistics import median

import numpy as np
from msgspec import Struct
from msgspec.structs import replace
from numpy.typing import NDArray

from mechc.compiler.pipeline import compile_source
from mechc.compiler.problem import HEADER, TURNS, header
from mechc.compiler.program import Program
from mechc.compiler.targets.c import emit_c
from mechc.lang.source import SourceFile
from mechc.runtime.native.build import find_compiler, model_flags
from mechc.runtime.native.contract import ModelStruct

from .machine import table, write
from .systems import BARS, SPATIAL, STAR

BODIES = """
model Bodies
  dimensionless;
  structural parameter Integer n = 7;
  parameter Real m[n] = 1;
  parameter G = 1;
  coordinate Real r[n, 3] = {{cos(i*1.7)*i, sin(i*1.7)*i, 0.3*i} for i in 1:n};
  for i in 1:n loop
    kinetic 1/2*m[i]*dot(der(r[i]), der(r[i]));
    for j in i+1:n loop
      potential -G*m[i]*m[j]/norm(r[i] - r[j]);
    end for;
  end for;
  experiment(stop = 3);
end Bodies;
"""

CASES = (
    ("bars on hinges", BARS, (100,), (100, 1000)),
    ("spatial chain", SPATIAL, (100,), (100, 400)),
    ("free base with spherical arms", STAR, (30,), (30, 60)),
    ("bodies in pairs", BODIES, (30,), (30, 60, 100)),
)
"""Name, text, sizes for a quick look and all of them."""

IN_TURNS = 15


class Library(Struct):
    """Compiled functions, with the parameters of a run; ``seconds`` of the C compiler."""

    model: ModelStruct
    p: NDArray[np.float64]
    seconds: float
    kept: ctypes.CDLL


def straight_lines(program: Program) -> Program:
    """Return the program without what finds loops."""
    return replace(
        program,
        parameters_function=replace(program.parameters_function, made=()),
        functions=tuple(replace(f, made=()) for f in program.functions),
    )


def built(program: Program, text: str, reproducible: bool, folder: str) -> Library:
    compiler = find_compiler()
    assert compiler is not None, "large models are measured with a C compiler"
    source = Path(tempfile.mkdtemp(dir=folder))
    (source / "model.c").write_text(text, encoding="utf-8")
    for name in (HEADER, *TURNS):
        (source / name).write_text(header(name), encoding="utf-8")
    flags = model_flags(reproducible, program.long)
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    command = [*compiler.command, *flags, "-shared", "model.c", "-o", "model.so", "-lm"]
    subprocess.run(command, cwd=source, check=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    library = ctypes.CDLL(str(source / "model.so"))
    library.mech_model_get.restype = ctypes.POINTER(ModelStruct)
    model = library.mech_model_get().contents
    p = np.zeros(program.size("p"))
    given = np.zeros(p.size, np.uint8)
    complete = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_void_p)(model.parameters)
    complete(p.ctypes.data, given.ctypes.data)
    seconds = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return Library(model, p, seconds, library)


def rates(library: Library, y: NDArray[np.float64], times: int) -> tuple[NDArray[np.float64], float]:
    """Return the derivatives, and the processor time of one call."""
    out = np.empty_like(y)
    function = ctypes.CFUNCTYPE(None, ctypes.c_double, *[ctypes.c_void_p] * 5)(library.model.rhs)
    arguments = (0.3, *(a.ctypes.data for a in (y, y, y, library.p, out)))
    begun = time.process_time()
    for _ in range(times):
        function(*arguments)
    return out, (time.process_time() - begun) / times


def measure(name: str, text: str, n: int, folder: str) -> list[str]:
    begun = time.process_time()
    source = SourceFile("model.mech", text)
    program = compile_source(source, structural={"n": Fraction(n)}).program
    formed = time.process_time()
    as_loops = emit_c(program, turns=True)
    written = time.process_time()
    plain = straight_lines(program)
    straight = emit_c(plain, turns=True)
    y = np.random.default_rng(1).uniform(-1, 1, program.nq + program.nv + program.nx)
    exact = [built(each, emit_c(each), True, folder) for each in (program, plain)]
    one, other = (rates(library, y, 1)[0] for library in exact)
    differing = int(np.count_nonzero((one != other) & ~(np.isnan(one) & np.isnan(other))))
    fast = [built(program, as_loops, False, folder), built(plain, straight, False, folder)]
    rhs = program.function("rhs")
    assert rhs is not None
    times = max(3, 4_000_000 // max(1, rhs.operations))
    taken: list[list[float]] = [[], []]
    for _ in range(IN_TURNS):
        for k, library in enumerate(fast):
            taken[k].append(rates(library, y, times)[1])
    loops_us, straight_us = (1e6 * median(t) for t in taken)
    return [
        name,
        str(n),
        str(rhs.operations),
        f"{formed - begun:.2f}",
        f"{written - formed:.2f}",
        f"{len(as_loops) // 1000}",
        f"{len(straight) // 1000}",
        f"{fast[0].seconds:.2f}",
        f"{fast[1].seconds:.2f}",
        f"{formed - begun + written - formed + fast[0].seconds:.2f}",
        f"{loops_us:.2f}",
        f"{straight_us:.2f}",
        f"{loops_us / straight_us:.2f}",
        f"{differing} of {y.size}",
    ]


def main(quick: bool = False) -> None:
    # imports are not part of it
    compile_source(SourceFile("model.mech", BARS), structural={"n": Fraction(3)})
    with tempfile.TemporaryDirectory() as folder:
        rows = [
            measure(name, text, n, folder)
            for name, text, few, all_sizes in CASES
            for n in (few if quick else all_sizes)
        ]
    words = (
        "Processor seconds from the text to the library: forming and lowering, writing C (with the search for loops), the C compiler; "
        "microseconds of one evaluation of all derivatives, medians of calls in turns. 'Loops' is what a run takes; where a "
        "model is not large, it is the same text as 'straight'. Both form sines and cosines four at a time. The last column "
        "compares the numbers of both as `--reproducible` builds them, at a random state."
    )
    head = [
        "model",
        "n",
        "operations",
        "form, s",
        "write, s",
        "loops, kB",
        "straight, kB",
        "C loops, s",
        "C straight, s",
    ]
    head += ["sum with loops, s", "loops, us", "straight, us", "ratio", "numbers that differ"]
    write("large", "Large models", [words, table(head, rows)])


if __name__ == "__main__":
    main()
