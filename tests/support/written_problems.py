"""Problems written by hand for the tests of the runtime: as C models, or as Python functions that the kernel calls."""

from __future__ import annotations

import ctypes
import shutil
import tempfile
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from msgspec.structs import replace
from numpy.typing import NDArray

from mechc.runtime.interface import AssertionEntry, Origin, Quantity
from mechc.runtime.native.build import build_shared, find_compiler, model_flags
from mechc.runtime.native.kernel import kernel_sources
from mechc.runtime.problem import Array, ModelFunction, Problem

ORIGIN = Origin("model.mech", 3, 5, "  coordinate theta = 1;")

SIGNATURE = (
    "(mech_real t, const mech_real *y, const mech_real *u, const mech_real *z, const mech_real *p, "
    "mech_real *out)"
)


def problem(
    name: str,
    *,
    q: Sequence[tuple[str, str]] = (),
    x: Sequence[tuple[str, str]] = (),
    parameters: Sequence[tuple[str, str]] = (),
    defaults: Sequence[float] = (),
    functions: Mapping[str, ModelFunction],
    **more: Any,
) -> Problem:
    """Build a problem of (name, unit) pairs; rates are named der(name)."""
    states = [Quantity(n, "coordinate", u, origin=ORIGIN) for n, u in q]
    states += [Quantity(f"der({n})", "rate", f"{u}/s", origin=ORIGIN) for n, u in q]
    states += [Quantity(n, "state", u, origin=ORIGIN) for n, u in x]

    def fill(p: Array, given: NDArray[np.uint8]) -> None:
        free = given == 0
        p[: len(defaults)][free] = np.asarray(defaults)[free]

    fields: dict[str, Any] = {
        "nq": len(q),
        "nv": len(q),
        "nx": len(x),
        "nh": 0,
        "time": Quantity("time", "time", "s"),
        "states": tuple(states),
        "parameters": tuple(Quantity(n, "parameter", u) for n, u in parameters),
        "inputs": (),
        "discretes": (),
        "outputs": (),
        "known": (True,) * (2 * len(q) + len(x)),
        "rotations": (),
        "assertions": (),
        "experiments": (),
        "functions": functions,
        "parameters_function": fill,
    }
    fields.update(more)
    fields["known"] = (True,) * len(fields["states"])
    made = Problem(name=name, doc="", **fields)
    return called(made) if "rhs" in functions else made


def compiled(
    problem: Problem,
    defaults: Sequence[float],
    bodies: Mapping[str, str],
    jacobian: Sequence[tuple[int, int]] = (),
) -> Problem:
    """Give the same problem with a C model: ``bodies`` holds the statements of each function.

    ``jacobian`` are the rows and columns that the function ``jacobian`` fills.
    """
    values = ", ".join(repr(float(value)) for value in defaults) or "0"
    fill = f"""
    static const double values[] = {{{values}}};
    for (int i = 0; i < {len(defaults)}; i++) if (!set[i]) p[i] = values[i];
"""
    library = build_shared(_sources(problem, "", fill, bodies, jacobian), model_flags(reproducible=True))
    return replace(problem, library=library, functions={}, parameters_function=None)


def _sources(
    problem: Problem,
    head: str,
    fill: str,
    bodies: Mapping[str, str],
    jacobian: Sequence[tuple[int, int]] = (),
) -> dict[str, str]:
    """Return the C files of a model: ``bodies`` of its functions, ``fill`` that of the parameters."""
    if find_compiler() is None:
        pytest.skip("no C compiler")
    outside = {e.function for e in problem.experiments}
    functions = "".join(
        f"{EXPORT if name in outside else 'static'} void {name}{SIGNATURE} {{ {body} }}\n"
        for name, body in bodies.items()
    )
    members = "".join(f", .{name} = {name}" for name in bodies if name not in outside)
    positions = sum(c.level == "position" for c in problem.constraints)
    text = f"""#include <math.h>
#include "model.h"
{head}
{functions}
static const int rotation_indices[] = {{{", ".join(map(str, problem.rotations)) or "0"}}};
static const int rows[] = {{{", ".join(str(i) for i, _ in jacobian) or 0}}};
static const int columns[] = {{{", ".join(str(j) for _, j in jacobian) or 0}}};
static void parameters(mech_real *p, const unsigned char *set) {{{fill}}}
static const mech_model model = {{.version = MECH_MODEL_VERSION, .nq = {problem.nq}, .nv = {problem.nv},
    .nx = {problem.nx}, .nu = {len(problem.inputs)}, .nz = {len(problem.discretes)}, .np = {len(problem.parameters)},
    .nh = {problem.nh}, .n_outputs = {len(problem.outputs)}, .n_assertions = {len(problem.assertions)},
    .n_rotations = {len(problem.rotations)}, .rotations = rotation_indices,
    .n_position = {positions}, .n_velocity = {len(problem.constraints)},
    .n_jacobian = {len(jacobian)}, .jac_row = rows, .jac_col = columns,
    .parameters = parameters{members}}};
{EXPORT} const mech_model *mech_model_get(void) {{ return &model; }}
"""
    return {"model.c": text, "model.h": kernel_sources()["model.h"]}


EXPORT = '__attribute__((visibility("default")))'
_ALIVE: list[object] = []
"""Libraries, and the functions that they call."""


def called(problem: Problem) -> Problem:
    """Return a problem whose functions in Python the kernel calls."""
    functions = {name: f for name, f in problem.functions.items() if _size(problem, name)}
    head = f"""typedef void call{SIGNATURE};
typedef void filling(mech_real *p, const unsigned char *set);
static call *calls[{len(functions)}];
static filling *filled;
{EXPORT} void set_call(int k, call *f) {{ calls[k] = f; }}
{EXPORT} void set_filling(filling *f) {{ filled = f; }}"""
    bodies = {name: f"calls[{k}](t, y, u, z, p, out);" for k, name in enumerate(functions)}
    made = build_shared(_sources(problem, head, "filled(p, set);", bodies), model_flags(reproducible=True))
    own = Path(tempfile.mkdtemp()) / made.name  # each problem has functions of its own
    shutil.copy(made, own)
    library = ctypes.CDLL(str(own))
    kind, filling = (
        ctypes.CFUNCTYPE(None, ctypes.c_double, *[ctypes.c_void_p] * 5),
        ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_void_p),
    )
    calls = [kind(_caller(problem, f, _size(problem, name))) for name, f in functions.items()]
    for k, call in enumerate(calls):
        library.set_call(k, call)
    count = len(problem.parameters)

    def fill(p: int, given: int) -> None:
        if problem.parameters_function is not None:
            set = (
                np.ctypeslib.as_array((ctypes.c_uint8 * count).from_address(given))
                if count
                else np.empty(0, np.uint8)
            )
            problem.parameters_function(_at(p, count + problem.nh), set)

    filled = filling(fill)
    library.set_filling(filled)
    _ALIVE.extend((library, calls, filled))
    return replace(problem, library=own)


def _size(problem: Problem, name: str) -> int:
    sizes = {
        "rhs": problem.ny,
        "initial": problem.ny,
        "inputs": len(problem.inputs),
        "discretes": len(problem.discretes),
        "outputs": len(problem.outputs),
        "assertions": len(problem.assertions),
        "displace": problem.nq,
        "project_position": problem.nv + sum(c.level == "position" for c in problem.constraints),
        "project_velocity": problem.nv + len(problem.constraints),
        **{e.function: len(e.options) + len(e.settings) for e in problem.experiments},
    }
    return sizes[name]


def _at(address: int | None, size: int) -> Array:
    if not size or not address:
        return np.empty(0)
    return np.ctypeslib.as_array((ctypes.c_double * size).from_address(address))


def _caller(problem: Problem, function: ModelFunction, size: int) -> Callable[..., None]:
    sizes = (problem.ny, len(problem.inputs), len(problem.discretes), len(problem.parameters) + problem.nh)

    def call(t: float, *addresses: int) -> None:
        with np.errstate(all="ignore"):
            given = [_at(a, n).copy() for a, n in zip(addresses[:4], sizes, strict=True)]
            _at(addresses[4], size)[:] = function(t, *given)

    return call


PENDULUM_DEFAULTS = (1.0, 9.81)


def pendulum() -> Problem:
    """Simple pendulum of unit mass, released at 1 rad: l, g; kinetic, potential and total energy."""

    def rhs(t: float, y: Array, u: Array, z: Array, p: Array) -> Array:
        return np.array([y[1], -p[1] / p[0] * np.sin(y[0])])

    def outputs(t: float, y: Array, u: Array, z: Array, p: Array) -> Array:
        kinetic, potential = 0.5 * p[0] ** 2 * y[1] ** 2, -p[1] * p[0] * np.cos(y[0])
        return np.array([kinetic, potential, kinetic + potential])

    return problem(
        "Pendulum",
        q=[("theta", "rad")],
        parameters=[("l", "m"), ("g", "m/s2")],
        defaults=PENDULUM_DEFAULTS,
        functions={
            "rhs": rhs,
            "initial": lambda t, y, u, z, p: np.array([1.0, 0.0]),
            "outputs": outputs,
        },
        outputs=tuple(Quantity(n, "energy", "J") for n in ("kinetic", "potential", "energy")),
        conserved=(2,),
        energy_balance=(2, -1, -1),
    )


@cache
def compiled_pendulum() -> Problem:
    return compiled(
        pendulum(),
        PENDULUM_DEFAULTS,
        {
            "rhs": "out[0] = y[1]; out[1] = -p[1] / p[0] * sin(y[0]);",
            "initial": "out[0] = 1; out[1] = 0;",
            "outputs": "out[0] = 0.5 * p[0] * p[0] * y[1] * y[1]; out[1] = -p[1] * p[0] * cos(y[0]);"
            "out[2] = out[0] + out[1];",
        },
    )


KEPLER_DEFAULTS = (1.0, 1.0, 0.6)
KEPLER_BODIES = {
    "rhs": "double r = sqrt(y[0]*y[0] + y[1]*y[1]), k = -p[0]/(r*r*r);"
    "out[0] = y[2]; out[1] = y[3]; out[2] = k*y[0]; out[3] = k*y[1];",
    "initial": "out[0] = p[1]*(1 - p[2]); out[1] = 0; out[2] = 0;"
    "out[3] = sqrt(p[0]/p[1]*(1 + p[2])/(1 - p[2]));",
    "outputs": "out[0] = y[0]*y[3] - y[1]*y[2];",
}


def kepler(defaults: Sequence[float] = KEPLER_DEFAULTS) -> Problem:
    """Kepler orbit from its pericentre: mu, a, e; its areal momentum is conserved."""

    def rhs(t: float, y: Array, u: Array, z: Array, p: Array) -> Array:
        k = -p[0] / np.hypot(y[0], y[1]) ** 3
        return np.array([y[2], y[3], k * y[0], k * y[1]])

    def initial(t: float, y: Array, u: Array, z: Array, p: Array) -> Array:
        return np.array([p[1] * (1 - p[2]), 0, 0, np.sqrt(p[0] / p[1] * (1 + p[2]) / (1 - p[2]))])

    return problem(
        "Kepler",
        q=[("x", "m"), ("y", "m")],
        parameters=[("mu", "m3/s2"), ("a", "m"), ("e", "")],
        defaults=defaults,
        functions={
            "rhs": rhs,
            "initial": initial,
            "outputs": lambda t, y, u, z, p: np.array([y[0] * y[3] - y[1] * y[2]]),
        },
        outputs=(Quantity("momentum", "momentum", "m2/s"),),
        conserved=(0,),
    )


@cache
def compiled_kepler(defaults: tuple[float, ...] = KEPLER_DEFAULTS) -> Problem:
    return compiled(kepler(defaults), defaults, KEPLER_BODIES)


def kepler_position(t: Array, mu: float, a: float, e: float) -> Array:
    """Exact [n, 2], by Newton's method on Kepler's equation."""
    anomaly = np.sqrt(mu / a**3) * t
    eccentric = anomaly + e * np.sin(anomaly)
    for _ in range(50):
        eccentric -= (eccentric - e * np.sin(eccentric) - anomaly) / (1 - e * np.cos(eccentric))
    return a * np.column_stack([np.cos(eccentric) - e, np.sqrt(1 - e**2) * np.sin(eccentric)])


VAN_DER_POL_DEFAULTS = (5.0,)


def van_der_pol() -> Problem:
    def rhs(t: float, y: Array, u: Array, z: Array, p: Array) -> Array:
        return np.array([y[1], p[0] * (1 - y[0] ** 2) * y[1] - y[0]])

    return problem(
        "VanDerPol",
        x=[("x1", ""), ("x2", "")],
        parameters=[("mu", "")],
        defaults=VAN_DER_POL_DEFAULTS,
        functions={"rhs": rhs, "initial": lambda t, y, u, z, p: np.array([2.0, 0.0])},
    )


@cache
def compiled_van_der_pol() -> Problem:
    return compiled(
        van_der_pol(),
        VAN_DER_POL_DEFAULTS,
        {
            "rhs": "out[0] = y[1]; out[1] = p[0]*(1 - y[0]*y[0])*y[1] - y[0];",
            "initial": "out[0] = 2; out[1] = 0;",
        },
    )


@cache
def stiff_van_der_pol() -> Problem:
    """The same with its Jacobian."""
    return compiled(
        van_der_pol(),
        VAN_DER_POL_DEFAULTS,
        {
            "rhs": "out[0] = y[1]; out[1] = p[0]*(1 - y[0]*y[0])*y[1] - y[0];",
            "initial": "out[0] = 2; out[1] = 0;",
            "jacobian": "out[0] = 1; out[1] = -2*p[0]*y[0]*y[1] - 1; out[2] = p[0]*(1 - y[0]*y[0]);",
        },
        jacobian=[(0, 1), (1, 0), (1, 1)],
    )


def rigid_body() -> Problem:
    """Free rigid body, principal moments 1, 2, 3, as quaternion and angular velocity in the body."""

    def rhs(t: float, y: Array, u: Array, z: Array, p: Array) -> Array:
        a, b, c, d, w1, w2, w3 = y
        return np.array(
            [
                (-b * w1 - c * w2 - d * w3) / 2,
                (a * w1 + c * w3 - d * w2) / 2,
                (a * w2 + d * w1 - b * w3) / 2,
                (a * w3 + b * w2 - c * w1) / 2,
                (2 - 3) / 1 * w2 * w3,
                (3 - 1) / 2 * w3 * w1,
                (1 - 2) / 3 * w1 * w2,
            ]
        )

    names = [f"R[{k}]" for k in range(1, 5)]
    states = [Quantity(n, "coordinate", "") for n in names]
    states += [Quantity(f"der(R)[{k}]", "rate", "rad/s") for k in range(1, 4)]
    return problem(
        "RigidBody",
        functions={
            "rhs": rhs,
            "initial": lambda t, y, u, z, p: np.array([2.0, 0, 0, 0, 0.1, 1.0, 0.1]),
            "outputs": lambda t, y, u, z, p: np.array([_momentum_along_z(y)]),
        },
        nq=4,
        nv=3,
        states=tuple(states),
        rotations=(0,),
        outputs=(Quantity("Lz", "momentum", ""),),
        conserved=(0,),
    )


def _momentum_along_z(y: Array) -> float:
    """Third component of the angular momentum in space: last row of the rotation matrix times J w."""
    a, b, c, d, w1, w2, w3 = y
    row = (2 * (b * d - a * c), 2 * (c * d + a * b), a * a - b * b - c * c + d * d)
    return float(row[0] * w1 + row[1] * 2 * w2 + row[2] * 3 * w3)


@cache
def compiled_rigid_body() -> Problem:
    return compiled(
        rigid_body(),
        (),
        {
            "rhs": "double a=y[0], b=y[1], c=y[2], d=y[3], w1=y[4], w2=y[5], w3=y[6];"
            "out[0]=(-b*w1-c*w2-d*w3)/2; out[1]=(a*w1+c*w3-d*w2)/2;"
            "out[2]=(a*w2+d*w1-b*w3)/2; out[3]=(a*w3+b*w2-c*w1)/2;"
            "out[4]=(2.-3.)/1*w2*w3; out[5]=(3.-1.)/2*w3*w1; out[6]=(1.-2.)/3*w1*w2;",
            "initial": "for (int i = 0; i < 7; i++) out[i] = 0; out[0]=2; out[4]=0.1; out[5]=1; out[6]=0.1;",
            "outputs": "double a=y[0], b=y[1], c=y[2], d=y[3];"
            "out[0]=2*(b*d-a*c)*y[4]+2*(c*d+a*b)*2*y[5]+(a*a-b*b-c*c+d*d)*3*y[6];",
        },
    )


def driven() -> Problem:
    """x' = u with the input u, by default cos(t); x is its integral."""
    return problem(
        "Driven",
        x=[("x", "m")],
        functions={
            "rhs": lambda t, y, u, z, p: np.array([u[0]]),
            "initial": lambda t, y, u, z, p: np.zeros(1),
            "inputs": lambda t, y, u, z, p: np.array([np.cos(t)]),
            "outputs": lambda t, y, u, z, p: np.array([2 * u[0]]),
        },
        inputs=(Quantity("u", "input", "m/s"),),
        outputs=(Quantity("double", "output", "m/s"),),
    )


@cache
def compiled_driven() -> Problem:
    return compiled(
        driven(),
        (),
        {
            "rhs": "out[0] = u[0];",
            "initial": "out[0] = 0;",
            "inputs": "out[0] = cos(t);",
            "outputs": "out[0] = 2 * u[0];",
        },
    )


def scalar(name: str, rhs: str, initial: str = "1", assertion: str = "") -> Problem:
    """One state x with a derivative in C; an assertion "x stays small" if one is given."""
    bodies = {"rhs": f"out[0] = {rhs};", "initial": f"out[0] = {initial};"}
    if assertion:
        bodies["assertions"] = f"out[0] = {assertion};"
    assertions = (AssertionEntry("x stays small", ORIGIN),) if assertion else ()
    return compiled(problem(name, x=[("x", "")], functions={}, assertions=assertions), (), bodies)
