"""Seconds of the accelerations of N point masses in absolute angles by CasADi, alone and with k directional derivatives of
all rates: casadi_tangents.py N K ... Instead of N a module that mechc wrote for CasADi: its model.

Forward mode of M and h with LDL, or of the module's function, as generated C that the C compiler optimises.
"""

import ctypes
import os
import runpy
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import casadi as ca
import numpy as np

system, counts = sys.argv[1], [int(word) for word in sys.argv[2:]]
rng = np.random.default_rng(1)


def point_masses(n):
    """State, rates, further symbols and their values."""
    q, u = ca.SX.sym("q", n), ca.SX.sym("u", n)
    m, l, g = ca.SX.sym("m", n), ca.SX.sym("l", n), ca.SX.sym("g")
    x = ca.cumsum(l * ca.sin(q))
    y = -ca.cumsum(l * ca.cos(q))
    vx, vy = ca.jtimes(x, q, u), ca.jtimes(y, q, u)
    L = ca.sum1(m * (vx**2 + vy**2)) / 2 - g * ca.sum1(m * y)
    p = ca.gradient(L, u)
    M, h = ca.jacobian(p, u), ca.gradient(L, q) - ca.jtimes(p, q, u)
    a = ca.ldl_solve(h, *ca.ldl(M))
    return ca.vertcat(q, u), ca.vertcat(u, a), ca.vertcat(m, l, g), np.array([*np.ones(2 * n), 9.81])


def exported(path):
    """The same of a module that mechc wrote."""
    model = runpy.run_path(path)
    values = np.array([float(v) for v in model["all_parameters"]()])
    y, p = ca.SX.sym("y", len(model["STATES"])), ca.SX.sym("p", values.size)
    return y, ca.vertcat(*model["rhs"](0.0, ca.vertsplit(y), [], ca.vertsplit(p))), p, values


state, rates, p, values = exported(system) if system.endswith(".py") else point_masses(int(system))
size = state.numel()
os.chdir(tempfile.mkdtemp())


def measured(k: int) -> float:
    w = ca.SX.sym("w", size, max(k, 1))
    results = [rates] + ([ca.jtimes(rates, state, w)] if k else [])
    f = ca.Function("f", [state, p, w], results, {"cse": True})
    name = f"f{k}"
    f.generate(f"{name}.c")
    flags = ["-O2", "-march=native", "-fno-math-errno", "-shared", "-fPIC"]
    subprocess.run(["cc", *flags, f"{name}.c", "-o", f"{name}.so", "-lm"], check=True)
    loop = (
        "int f(const double**, double**, long long*, double*, int);\n"
        "void loop(const double **a, double **r, double *w, int n) { for (int i = 0; i < n; i++) f(a, r, 0, w, 0); }\n"
    )
    Path("l.c").write_text(loop)
    subprocess.run(["cc", "-O2", "-shared", "-fPIC", "l.c", f"./{name}.so", "-o", f"l{k}.so"], check=True)
    library = ctypes.CDLL(f"./l{k}.so")
    arrays = [rng.uniform(-1, 1, size), values, rng.uniform(-1, 1, size * max(k, 1))]
    out, work = np.empty((1 + k) * size), np.empty(max(1, f.sz_w()))
    pointers = (ctypes.c_void_p * 3)(*(b.ctypes.data for b in arrays))
    given = (ctypes.c_void_p * 2)(out.ctypes.data, out.ctypes.data + 8 * size)
    best = float("inf")
    for _ in range(40):
        begun = time.process_time()
        library.loop(pointers, given, ctypes.c_void_p(work.ctypes.data), 1000)
        best = min(best, (time.process_time() - begun) / 1000)
    return best


print(*(measured(k) for k in (0, *counts)))
