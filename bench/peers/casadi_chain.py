"""ns of the accelerations of N point masses in absolute angles by CasADi: casadi_chain.py N

M and h by automatic differentiation, solved symbolically by LDL, as generated C that the C compiler optimises.
"""

import ctypes
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import casadi as ca
import numpy as np

n = int(sys.argv[1])
q, u = ca.SX.sym("q", n), ca.SX.sym("u", n)
m, l, g = ca.SX.sym("m", n), ca.SX.sym("l", n), ca.SX.sym("g")
x = ca.cumsum(l * ca.sin(q))
y = -ca.cumsum(l * ca.cos(q))
vx, vy = ca.jtimes(x, q, u), ca.jtimes(y, q, u)
L = ca.sum1(m * (vx**2 + vy**2)) / 2 - g * ca.sum1(m * y)
p = ca.gradient(L, u)
M, h = ca.jacobian(p, u), ca.gradient(L, q) - ca.jtimes(p, q, u)
a = ca.solve(ca.densify(M), h, "symbolicqr") if n == 1 else ca.ldl_solve(h, *ca.ldl(M))
f = ca.Function("f", [q, u, m, l, g], [a], {"cse": True})
os.chdir(tempfile.mkdtemp())
f.generate("f.c")
subprocess.run(
    ["cc", "-O2", "-march=native", "-fno-math-errno", "-shared", "-fPIC", "f.c", "-o", "f.so", "-lm"],
    check=True,
)
loop = "int f(const double**, double**, long long*, double*, int);\nvoid loop(const double **a, double **r, double *w, int n) { for (int i = 0; i < n; i++) f(a, r, 0, w, 0); }\n"
Path("l.c").write_text(loop)
subprocess.run(["cc", "-O2", "-shared", "-fPIC", "l.c", "./f.so", "-o", "l.so"], check=True)
library = ctypes.CDLL("./l.so")
rng = np.random.default_rng(1)
arrays = [rng.uniform(-1, 1, n), rng.uniform(-1, 1, n), np.ones(n), np.ones(n), np.array([9.81])]
result, work = np.empty(n), np.empty(max(1, f.sz_w()))
pointers = (ctypes.c_void_p * 5)(*(b.ctypes.data for b in arrays))
results = (ctypes.c_void_p * 1)(result.ctypes.data)
best = float("inf")
for _ in range(40):
    begun = time.perf_counter()
    library.loop(pointers, results, ctypes.c_void_p(work.ctypes.data), 1000)
    best = min(best, (time.perf_counter() - begun) / 1000)
print(best * 1e9)
