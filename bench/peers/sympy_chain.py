"""ns of the accelerations of N point masses in absolute angles by SymPy's LagrangesMethod: sympy_chain.py N"""

import sys
import time

import numpy as np
import sympy as sp
from sympy.physics.mechanics import LagrangesMethod, dynamicsymbols

n = int(sys.argv[1])
q = dynamicsymbols(f"q:{n}")
t = dynamicsymbols._t
m, l, g = sp.symbols(f"m:{n}"), sp.symbols(f"l:{n}"), sp.Symbol("g")
x = [sum(l[k] * sp.sin(q[k]) for k in range(i + 1)) for i in range(n)]
y = [-sum(l[k] * sp.cos(q[k]) for k in range(i + 1)) for i in range(n)]
T = sum(m[i] * (x[i].diff(t) ** 2 + y[i].diff(t) ** 2) for i in range(n)) / 2
method = LagrangesMethod(T - sum(m[i] * g * y[i] for i in range(n)), q)
method.form_lagranges_equations()
state = [*q, *(c.diff(t) for c in q)]
plain = sp.symbols(f"s:{2 * n}")
parts = [
    part.xreplace(dict(zip(state[n:], plain[n:], strict=True))).xreplace(dict(zip(q, plain, strict=False)))
    for part in (method.mass_matrix, method.forcing)
]
f = sp.lambdify([plain, m, l, g], parts, cse=True)
s, ones, best = np.random.default_rng(1).uniform(-1, 1, 2 * n), np.ones(n), float("inf")
for _ in range(30):
    begun = time.perf_counter()
    for _ in range(50):
        M, h = f(s, ones, ones, 9.81)
        np.linalg.solve(M, h)
    best = min(best, (time.perf_counter() - begun) / 50)
print(best * 1e9)
