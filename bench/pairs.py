"""Bodies that attract each other in pairs: one evaluation beside a loop in C that people write by hand, with the same operations."""

from __future__ import annotations

import ctypes
import subprocess
import tempfile
from fractions import Fraction
from pathlib import Path
from statistics import median

import numpy as np
from msgspec.structs import replace

from mechc.compiler.pipeline import compile_source
from mechc.compiler.targets.c import emit_c
from mechc.lang.source import SourceFile
from mechc.runtime.native.build import find_compiler
from mechc.runtime.native.contract import ModelStruct

from .large import BODIES, Library, built, rates
from .machine import table, write

BY_HAND = """
#include <math.h>
#include <string.h>
static double X[N], Y[N], Z[N], A[N], B[N], C[N];
/* p: masses, then G; each pair once, with one root and three divisions, as in the derivatives of -G m m / r */
void rhs(double t, const double *restrict y, const double *u, const double *z, const double *restrict p, double *restrict out)
{
    const double *m = p, G = p[N];
    for (int i = 0; i < N; i++) {
        X[i] = y[3*i]; Y[i] = y[3*i + 1]; Z[i] = y[3*i + 2];
        A[i] = B[i] = C[i] = 0;
    }
    for (int i = 1; i < N; i++) {
        double ax = 0, ay = 0, az = 0, x = X[i], yy = Y[i], zz = Z[i], Gm = G * m[i];
        #pragma omp simd reduction(+:ax,ay,az)
        for (int j = 0; j < i; j++) {
            double dx = X[j] - x, dy = Y[j] - yy, dz = Z[j] - zz, r = sqrt(dx*dx + dy*dy + dz*dz);
            double f = ((Gm * m[j] / r) * (-1.0 / r)) * (0.5 / r);
            double fx = f*(2*dx), fy = f*(2*dy), fz = f*(2*dz);
            ax += fx; ay += fy; az += fz;
            A[j] -= fx; B[j] -= fy; C[j] -= fz;
        }
        A[i] += ax; B[i] += ay; C[i] += az;
    }
    memcpy(out, y + 3*N, 3*N*sizeof(double));
    for (int i = 0; i < N; i++) {
        double q = -1 / m[i];
        out[3*N + 3*i] = q*A[i]; out[3*N + 3*i + 1] = q*B[i]; out[3*N + 3*i + 2] = q*C[i];
    }
}
"""
FLAGS = (
    "-O3",
    "-march=native",
    "-ffp-contract=fast",
    "-fno-math-errno",
    "-fno-trapping-math",
    "-fopenmp-simd",
)
TURNS = 25


def by_hand(n: int, folder: str) -> Library:
    compiler = find_compiler()
    assert compiler is not None, "the loop is written in C"
    source = Path(folder, f"hand{n}.c")
    source.write_text(BY_HAND.replace("[N]", f"[{n}]"), encoding="utf-8")
    library = source.with_suffix(".so")
    command = [
        *compiler.command,
        *FLAGS,
        f"-DN={n}",
        "-fPIC",
        "-shared",
        str(source),
        "-o",
        str(library),
        "-lm",
    ]
    subprocess.run(command, check=True)
    kept = ctypes.CDLL(str(library))
    model = ModelStruct()
    model.rhs = ctypes.cast(kept.rhs, ctypes.c_void_p).value
    return Library(model, np.ones(n + 1), 0.0, kept)


def measure(n: int, folder: str) -> list[str]:
    program = compile_source(SourceFile("model.mech", BODIES), structural={"n": Fraction(n)}).program
    text = emit_c(program)
    straight = replace(program, functions=tuple(replace(f, made=()) for f in program.functions))
    libraries = {
        "as it runs": built(program, text, False, folder),
        "reproducible": built(program, text, True, folder),
        "by hand": by_hand(n, folder),
    }
    y = np.random.default_rng(1).uniform(-1, 1, program.nq + program.nv)
    times = max(3, 12_000_000 // (n * n * 30))
    taken: dict[str, list[float]] = {name: [] for name in libraries}
    found = {}
    for _ in range(TURNS):
        for name, library in libraries.items():
            found[name], seconds = rates(library, y, times)
            taken[name].append(1e6 * seconds)
    hand = median(taken["by hand"])
    off = np.abs(found["as it runs"] - found["by hand"]).max() / np.abs(found["by hand"]).max()
    differing = ""
    if n <= 100:
        plain = built(straight, emit_c(straight), True, folder)
        differing = f"{np.count_nonzero(rates(plain, y, 1)[0] != found['reproducible'])} of {y.size}"
    return [
        str(n),
        *(f"{median(taken[name]):.2f}" for name in libraries),
        *(f"{median(taken[name]) / hand:.2f}" for name in libraries if name != "by hand"),
        f"{off:.0e}",
        differing,
    ]


def main(quick: bool = False) -> None:
    with tempfile.TemporaryDirectory() as folder:
        rows = [measure(n, folder) for n in ((30, 100) if quick else (30, 100, 200))]
    words = (
        "Microseconds of one evaluation of all derivatives, medians of calls in turns: as a run takes it, with `--reproducible`, and a loop "
        "over arrays that is written by hand for this model, whose sums are formed in vectors and which computes the same "
        "operations (one root and three divisions for each pair). Then the times of mechc as parts of that of the loop by hand, the largest "
        "difference of the first from the last, relative to the largest derivative, and the numbers that differ between `--reproducible` and "
        "straight-line code."
    )
    head = ["bodies", "as it runs, us", "reproducible, us", "by hand, us", "ratio", "reproducible, ratio"]
    head += ["largest difference", "bits that differ"]
    write("pairs", "Bodies in pairs beside a loop by hand", [words, table(head, rows)])


if __name__ == "__main__":
    main()
