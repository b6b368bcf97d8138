"""The kernel on hand-written C models, in double or quadruple precision, without the layers above it."""

from __future__ import annotations

import ctypes
from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from msgspec import Struct, field
from numpy.typing import NDArray

from mechc.runtime.native.build import build_shared, find_compiler, kernel_flags, model_flags
from mechc.runtime.native.kernel import kernel_sources

Numbers = NDArray[np.float64]

REPORT = [
    "t",
    "dt_min",
    "dt_max",
    "stiff_time",
    "switch_time",
    "drift_position",
    "drift_velocity",
    "seconds",
    "steps",
    "rejected",
    "evaluations",
    "jacobians",
    "factorisations",
    "iterations",
    "switches",
    "n_grid",
    "failed_index",
]

QUAD = ("-DMECH_REAL=__float128", "-DMECH_QUAD")

_PRELUDE = """
#include "model.h"
#if defined(MECH_QUAD)
#include <quadmath.h>
#define sin sinq
#define cos cosq
#define sqrt sqrtq
#define exp expq
#define R(decimal) decimal##Q
#else
#include <math.h>
#define R(decimal) decimal
#endif
#define ARGUMENTS mech_real t, const mech_real *y, const mech_real *u, const mech_real *z, const mech_real *p, \\
    mech_real *out
"""


class Model(Struct, frozen=True):
    """A model in C: ``functions`` holds the statements of each function of ``mech_model`` by its name,
    ``sizes`` its numbers, ``entries`` the pattern (row, column) of its Jacobian."""

    functions: Mapping[str, str]
    nq: int = 0
    nv: int = 0
    nx: int = 0
    entries: tuple[tuple[int, int], ...] = ()
    sizes: Mapping[str, int | str] = field(default_factory=dict)
    rotations: tuple[int, ...] = ()
    prelude: str = ""

    @property
    def ny(self) -> int:
        return self.nq + self.nv + self.nx

    def source(self) -> str:
        """Give its C file."""
        functions = "".join(
            f"static void {name}(ARGUMENTS) {{ {body} }}\n" for name, body in self.functions.items()
        )
        fields = {"nq": self.nq, "nv": self.nv, "nx": self.nx, **self.sizes}
        fields["n_jacobian"], fields["n_rotations"] = len(self.entries), len(self.rotations)
        members = "".join(f".{name} = {value}, " for name, value in fields.items())
        members += "".join(f".{name} = {name}, " for name in self.functions)
        arrays = {
            "rows": [i for i, _ in self.entries],
            "columns": [j for _, j in self.entries],
            "rotation_indices": self.rotations,
        }
        listed = "".join(
            f"static const int {name}[] = {{{', '.join(map(str, values)) or '0'}}};\n"
            for name, values in arrays.items()
        )
        return f"""{_PRELUDE}{self.prelude}
{functions}{listed}
static const mech_model model = {{.version = MECH_MODEL_VERSION, {members}
    .jac_row = rows, .jac_col = columns, .rotations = rotation_indices}};
__attribute__((visibility("default"))) const mech_model *mech_model_get(void) {{ return &model; }}
"""


class Run(Struct, frozen=True):
    """``y`` at the end and ``rows`` on the grid, as sums hi + lo of doubles along their last axis but one."""

    status: int
    y: Numbers
    low: Numbers
    rows: Numbers
    rows_low: Numbers
    report: Mapping[str, float]
    drift: Numbers

    def error(self, exact: Numbers, exact_low: Numbers | float = 0.0) -> float:
        """The largest difference from ``exact`` + ``exact_low``; what both have in common cancels exactly."""
        n = len(exact)
        return float(np.abs((self.y[:n] - exact) + (self.low[:n] - exact_low)).max())


def with_method(sources: Mapping[str, str], name: str) -> dict[str, str]:
    """Add the method of a file of this folder to the sources of the kernel."""
    table = "const mech_method *const mech_methods[] = {"
    assert sources["methods.c"].count(table) == 1
    return {
        **sources,
        f"{name}.c": Path(__file__).with_name(f"{name}.c").read_text(encoding="utf-8"),
        "methods.c": sources["methods.c"].replace(
            table, f"extern const mech_method mech_{name};\n{table} &mech_{name},"
        ),
    }


@cache
def _kernel(quad: bool, further: str) -> ctypes.CDLL:
    sources = with_method(kernel_sources(), further) if further else kernel_sources()
    sources["driver.c"] = Path(__file__).with_name("kernel_driver.c").read_text(encoding="utf-8")
    flags = (*kernel_flags(), *(QUAD if quad else ()))
    return ctypes.CDLL(str(build_shared(sources, flags, name="driven")))


@cache
def _library(source: str, quad: bool) -> ctypes.CDLL:
    flags = (*model_flags(reproducible=True), *(QUAD if quad else ()))
    sources = {"model.c": source, "model.h": kernel_sources()["model.h"]}
    library = ctypes.CDLL(str(build_shared(sources, flags)))
    library.mech_model_get.restype = ctypes.c_void_p
    return library


def has_quad() -> bool:
    """Tell whether the C compiler knows __float128."""
    compiler = find_compiler()
    return compiler is not None and "clang" not in compiler.version


def run(
    model: Model,
    method: str,
    y0: Sequence[float] | Numbers,
    stop: float,
    *,
    begin: float = 0.0,
    step: float = 0.0,
    max_step: float | None = None,
    tolerance: float = 1e-8,
    nominal: Sequence[float] | None = None,
    p: Sequence[float] = (),
    grid: Sequence[float] | Numbers = (),
    low: Sequence[float] | Numbers | None = None,
    slice_steps: int = 1_000_000,
    tables: Sequence[tuple[int, Sequence[float], Sequence[float]]] = (),
    stops: Sequence[float] = (),
    quad: bool = False,
    further: str = "",
) -> Run:
    """Run ``model`` from ``y0`` (+ ``low``) to ``stop``; ``nominal`` defaults to ones. ``further``: see with_method."""
    if find_compiler() is None:
        pytest.skip("no C compiler")
    if quad and not has_quad():
        pytest.skip("no __float128")
    kernel, library = _kernel(quad, further), _library(model.source(), quad)
    ny = model.ny
    y = np.zeros(2 * ny)
    y[:ny] = y0
    if low is not None:
        y[ny:] = low
    numbers = np.array([begin, stop, step, max_step if max_step is not None else stop - begin, tolerance])
    atol = tolerance * (np.ones(ny) if nominal is None else np.asarray(nominal, dtype=float))
    times = np.asarray(grid, dtype=float)
    rows = np.full((2, times.size, ny), np.nan)
    report, drift = np.zeros(len(REPORT)), np.zeros(64)
    data = np.array([x for _, t, v in tables for x in (*t, *v)] or [0.0])
    kinds = np.array([kind for kind, _, _ in tables] or [0], dtype=np.int32)
    counts = np.array([len(t) for _, t, _ in tables] or [0], dtype=np.int32)
    parameters, kinks = np.array([*p, 0.0]), np.array([*stops, 0.0])
    pointer = ctypes.c_void_p
    status = kernel.drive(
        pointer(library.mech_model_get()),
        method.encode(),
        pointer(numbers.ctypes.data),
        pointer(atol.ctypes.data),
        pointer(parameters.ctypes.data),
        pointer(y.ctypes.data),
        ctypes.c_long(times.size),
        pointer(times.ctypes.data),
        pointer(rows.ctypes.data),
        ctypes.c_long(slice_steps),
        len(tables),
        pointer(kinds.ctypes.data),
        pointer(counts.ctypes.data),
        pointer(data.ctypes.data),
        len(stops),
        pointer(kinks.ctypes.data),
        pointer(report.ctypes.data),
        pointer(drift.ctypes.data),
    )
    told = dict(zip(REPORT, report.tolist(), strict=True))
    return Run(status, y[:ny], y[ny:], rows[0], rows[1], told, drift)
