"""Taylor series of few slots as one loop over orders: its coefficients by the definition of the slots, its bits in vectors of all widths."""

from __future__ import annotations

import ctypes
from pathlib import Path

import numpy as np
import pytest
from native_code import KERNEL, REPRODUCIBLE, Floats, compile_c

import mechc
from mechc.compiler.pipeline import program_with
from mechc.compiler.program import Program
from mechc.compiler.program import model as limits
from mechc.compiler.program.series import padded
from mechc.compiler.targets.c import emit_c
from mechc.compiler.targets.c_data import SERIES_INCLUDED
from mechc.runtime.native.contract import ModelStruct

ORDER = 24

PLANAR = "coordinate x = 1 m; coordinate y = 0.5 m; kinetic 1/2*1 kg*(der(x)^2 + der(y)^2);"

MODELS = {
    "no slots": (
        "parameter k = 2; state x = 1; state v = 0; equation der(x) = v/1 s;"
        "equation der(v) = -(k*x + 0.1*v)/1 s + time/1 s^2;",
        0,
        0,
    ),
    "products one by one": (
        PLANAR + "potential -1 N.m^2/sqrt(x^2 + y^2); force 0.3 N*time/1 s on x;",
        1,
        8,
    ),
    "vectors": (
        PLANAR
        + "potential 1 J*sin(x/1 m)*cos(y/1 m) + 1 N.m^2/sqrt(x^2 + y^2) + 1 J*exp(x*y/1 m^2);"
        + "force -0.1 N*atan(x/1 m)*log(1 + time/1 s) on y;",
        17,
        limits.FEW_SLOTS,
    ),
}
"""Text, the least and the most slots: each form that the loop has, beside time."""

WIDTHS = {"sse2": (), "avx": ("-mavx",), "avx512f": ("-mavx512f",)}

DRIVER = """
EXPORT void begin(const mech_real *y, const mech_real *p, mech_real *out)
{
    series_start(real(0.5), y, NULL, NULL, p, out);
}
"""
EXPANDED = """
EXPORT void expanded(int order, const mech_real *kept, const mech_real *p, mech_real *x, mech_real *rows)
{
    series_expand(order, kept, p, x, rows);
}
"""
FOLLOWED = """
EXPORT void followed(int k, const mech_real *y, const mech_real *u, const mech_real *z, const mech_real *p, mech_real *out)
{
    series_next(k, y, u, z, p, out);
}
"""


class Series:
    """The series of a compiled text at one state."""

    def __init__(self, program: Program, text: str, folder: Path, flags: tuple[str, ...]) -> None:
        assert program.series is not None
        self.library = ctypes.CDLL(str(compile_c(text, folder, (*REPRODUCIBLE, *flags))))
        self.ny, self.plan = len(program.arrays["y"]), program.series
        self.y = np.linspace(0.7, 1.3, self.ny)
        self.p = np.zeros(program.size("p") + 1)
        self.library.mech_model_get.restype = ctypes.POINTER(ModelStruct)
        unset = np.zeros(self.p.size, np.uint8)
        prototype = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_void_p)
        prototype(self.library.mech_model_get().contents.parameters)(self.p.ctypes.data, unset.ctypes.data)
        self.found = np.zeros(self.ny + self.plan.n_kept)
        self.library.begin(*pointers(self.y, self.p, self.found))

    def expanded(self) -> Floats:
        """Coefficients by the loop; what it must not read is not finite."""
        x, rows = aligned((ORDER + 1) * padded(self.ny)), aligned(ORDER * 2 * padded(self.plan.n_slots))
        table = x.reshape(ORDER + 1, -1)
        table[0, : self.ny], table[1, : self.ny] = self.y, self.found[: self.ny]
        self.library.expanded(ORDER, *pointers(self.found[self.ny :], self.p, x, rows))
        return table[:, : self.ny]

    def followed(self) -> Floats:
        """The same order by order, with the sums as model.h defines them."""
        states, slots, count = padded(self.ny), padded(self.plan.n_slots), self.plan.n_slots
        table = np.zeros((ORDER + 1, self.ny))
        table[0], table[1] = self.y, self.found[: self.ny]
        a, b = np.zeros((2, ORDER, count))
        for k in range(1, ORDER):
            u, out = np.zeros(slots + 2), np.zeros(states + 2 * slots)
            u[:count] = sum((a[j] * b[k - j] for j in range(1, k)), np.zeros(count))
            u[slots:] = 1 / k, k == 1
            self.library.followed(k, *pointers(table[k], u, self.found[self.ny :], self.p, out))
            table[k + 1] = out[: self.ny] / (k + 1)
            a[k], b[k] = out[states : states + count], out[states + slots : states + slots + count]
        return table


def pointers(*arrays: Floats) -> list[ctypes.c_void_p]:
    return [ctypes.c_void_p(a.ctypes.data) for a in arrays]


def aligned(count: int) -> Floats:
    """Numbers, none of them finite, that begin where a line of the cache does."""
    numbers = np.full(count + 8, np.nan)
    return numbers[-numbers.ctypes.data // 8 % 8 :][:count]


def known_widths() -> list[str]:
    """The vectors that this processor has."""
    try:
        known = Path("/proc/cpuinfo").read_text().split()
    except OSError:
        known = []
    return [name for name in WIDTHS if name in known]


def test_the_kernel_knows_how_many_slots_are_few() -> None:
    """It adds up their products in the order of the loop, and takes as many orders."""
    assert f"MECH_FEW_SLOTS = {limits.FEW_SLOTS} " in (KERNEL / "series.h").read_text(encoding="utf-8")


@pytest.mark.parametrize("name", MODELS)
def test_coefficients(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """To rounding those by the definition of the slots, and the same bits in vectors of all widths and one by one."""
    text, least, most = MODELS[name]
    program = program_with(mechc.loads(text).compilation, {"series"})
    assert program.series is not None
    assert least <= program.series.n_slots <= most
    loop = emit_c(program) + DRIVER + EXPANDED
    found = {}
    for width in known_widths():
        (tmp_path / width).mkdir()
        found[width] = Series(program, loop, tmp_path / width, WIDTHS[width]).expanded()
    (tmp_path / "alone").mkdir()
    assert SERIES_INCLUDED in loop
    alone = loop.replace(SERIES_INCLUDED, f"#undef __GNUC__\n{SERIES_INCLUDED}")
    found["alone"] = Series(program, alone, tmp_path / "alone", ()).expanded()
    monkeypatch.setattr(limits, "FEW_SLOTS", -1)
    followed = Series(program, emit_c(program) + DRIVER + FOLLOWED, tmp_path, ()).followed()
    for width, coefficients in found.items():
        assert coefficients.tobytes() == found["alone"].tobytes(), width
    sizes = np.abs(followed).max(axis=1, keepdims=True)
    assert np.all(np.abs(found["alone"] - followed) <= 1e-14 * np.arange(1, ORDER + 2)[:, None] * sizes)
