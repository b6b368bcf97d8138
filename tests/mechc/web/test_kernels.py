"""The kernels of pages are those of the sources that stand beside them."""

from __future__ import annotations

import importlib.metadata
import importlib.util

import pytest

from mechc.compiler.targets import c_tables
from mechc.compiler.targets.c_forms import CALLED, OWN
from mechc.compiler.targets.wasm.operations import LIBRARY, OF_KERNEL
from mechc.runtime.methods import KERNEL_METHODS
from mechc.runtime.native.kernel import kernel_sources
from mechc.web import build_kernels
from mechc.web.kernels import KERNELS, WebKernel, kernel_for, loaded


def test_they_are_up_to_date() -> None:
    """Sources, flags and compiler are those of the last build, and the bytes those that it gave."""
    told = "what the kernels of pages are built from has changed: run `make kernel`"
    assert build_kernels.SUMS.read_text(encoding="utf-8") == build_kernels.sums_text(), told


def test_a_change_of_a_source_shows(monkeypatch: pytest.MonkeyPatch) -> None:
    plain, events, everything = map(build_kernels.digest, KERNELS)
    sources = kernel_sources()
    changed = sources | {"radau5.c": sources["radau5.c"] + "\n"}
    monkeypatch.setattr(build_kernels, "kernel_sources", lambda: changed)
    assert [*map(build_kernels.digest, KERNELS)] == [plain, events, build_kernels.digest(KERNELS[2])]
    assert build_kernels.digest(KERNELS[2]) != everything


@pytest.mark.parametrize("kernel", KERNELS, ids=lambda k: k.name)
def test_they_offer_what_models_call(kernel: WebKernel) -> None:
    functions = loaded(kernel).functions
    assert functions.keys() >= {
        *LIBRARY,
        *(OF_KERNEL + CALLED[code] for code in OWN),
        *(OF_KERNEL + name for name in c_tables.FUNCTIONS),
    }
    assert ("rhs_of_all" in functions) == kernel.events


def test_the_smallest_is_taken() -> None:
    assert kernel_for("dop853", events=False).name == "plain"
    assert kernel_for("dop853", events=True).name == "events"
    for method in KERNEL_METHODS.keys() - {"dop853"}:
        assert kernel_for(method, events=False).name == "all"


def _zig() -> str:
    found = importlib.util.find_spec("ziglang")
    return importlib.metadata.version("ziglang") if found else "none"


@pytest.mark.slow
@pytest.mark.skipif(_zig() != build_kernels.ZIG, reason=f"needs pip install ziglang=={build_kernels.ZIG}")
@pytest.mark.parametrize("kernel", KERNELS, ids=lambda k: k.name)
def test_they_are_built_again_byte_for_byte(kernel: WebKernel) -> None:
    assert build_kernels.build(kernel) == kernel.file.read_bytes()
