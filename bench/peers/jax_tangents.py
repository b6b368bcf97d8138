"""Seconds of the accelerations of N point masses in absolute angles by JAX, alone and with k directional derivatives of
all rates: jax_tangents.py N K ... Instead of N a module that mechc wrote for JAX: its model.

``jvp`` vectorised over the directions, compiled by XLA for one thread in double precision; many states in one call.
"""

import os
import runpy
import sys
import time

os.environ.setdefault("XLA_FLAGS", "--xla_cpu_multi_thread_eigen=false intra_op_parallelism_threads=1")

import jax
import jax.numpy as jnp
import numpy as np

jax.config.update("jax_enable_x64", True)
system, counts = sys.argv[1], [int(word) for word in sys.argv[2:]]
STATES = 64


def lagrangian(q, u):
    x, y = jnp.cumsum(jnp.sin(q)), -jnp.cumsum(jnp.cos(q))
    vx, vy = jnp.cumsum(jnp.cos(q) * u), jnp.cumsum(jnp.sin(q) * u)
    return (vx @ vx + vy @ vy) / 2 - 9.81 * y.sum() + 0 * x.sum()


def point_masses(state):
    n = state.size // 2
    q, u = state[:n], state[n:]
    _, turned = jax.jvp(lambda q: jax.grad(lagrangian, 1)(q, u), (q,), (u,))
    mass = jax.hessian(lagrangian, 1)(q, u)
    return jnp.concatenate([u, jnp.linalg.solve(mass, jax.grad(lagrangian)(q, u) - turned)])


if system.endswith(".py"):
    model = runpy.run_path(system)
    size, parameters = len(model["STATES"]), jnp.asarray(model["all_parameters"]())

    def rates(state):
        return jnp.stack(model["rhs"](0.0, state, jnp.zeros(0), parameters))
else:
    size, rates = 2 * int(system), point_masses


def measured(k):
    rng = np.random.default_rng(1)
    states = jnp.array(rng.uniform(-1, 1, (STATES, size)))
    w = jnp.array(rng.uniform(-1, 1, (STATES, max(k, 1), size)))

    def one(state, w):
        if not k:
            return rates(state)
        value, push = jax.linearize(rates, state)
        return value, jax.vmap(push)(w)

    call = jax.jit(jax.vmap(one))
    jax.block_until_ready(call(states, w))
    best = float("inf")
    for _ in range(60):
        begun = time.process_time()
        jax.block_until_ready(call(states, w))
        best = min(best, (time.process_time() - begun) / STATES)
    return best


print(*(measured(k) for k in (0, *counts)))
