"""The kernels that pages hold: WebAssembly that was built before (``build_kernels.py``) and waits for a model."""

from __future__ import annotations

from functools import cache
from pathlib import Path

from msgspec import Struct

from mechc.compiler.targets.wasm.link import Kernel
from mechc.runtime.methods import KERNEL_METHODS

FOLDER = Path(__file__).parent / "kernel"


class WebKernel(Struct, frozen=True):
    """``methods`` by name, in the order in which the kernel numbers them; ``events``: it runs models that switch."""

    name: str
    methods: tuple[str, ...]
    events: bool

    @property
    def file(self) -> Path:
        return FOLDER / f"{self.name}.wasm"


KERNELS = (
    WebKernel("plain", ("dop853",), events=False),
    WebKernel("events", ("dop853",), events=True),
    WebKernel("all", tuple(KERNEL_METHODS), events=True),
)
"""From the smallest to the largest."""


def kernel_for(method: str, *, events: bool) -> WebKernel:
    """Return the smallest kernel that has this method, and locates events if it is to."""
    return next(k for k in KERNELS if method in k.methods and k.events >= events)


@cache
def loaded(kernel: WebKernel) -> Kernel:
    return Kernel(kernel.file.read_bytes())
