"""The targets of ``mechc compile`` that are modules of Python: a row each, which the command line and exports read."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module

from msgspec import Struct


class ModuleTarget(Struct, frozen=True):
    """``title``: what people call it; ``file``: pattern of its name, which is that of no library; ``emit``: the function that prints it,
    ``module:function`` of ``compiler/targets``, from a program and a ``Begin``; ``runs``: it runs the model, with what happens on the way,
    and else differentiates it, inputs that drive coordinates included; ``noise``: it has the whole numbers of 64 bits for that;
    ``longest_table``: numbers of a table that it can hold; ``parts`` of the equations that its programs are made with."""

    title: str
    file: str
    emit: str
    runs: bool = False
    noise: bool = True
    longest_table: float = float("inf")
    parts: frozenset[str] = frozenset()

    def emitter(self) -> Callable[..., str]:
        """Import the function that prints it; the others stay unread."""
        module, _, name = self.emit.partition(":")
        found: Callable[..., str] = getattr(import_module(f".compiler.targets.{module}", __package__), name)
        return found


MODULES = {
    "python": ModuleTarget("Python", "{}.py", "python:emit_python", runs=True),
    "casadi": ModuleTarget(
        "CasADi",
        "{}_casadi.py",
        "differentiable:emit_casadi",
        noise=False,
        longest_table=2000,
        parts=frozenset(("formulas",)),
    ),
    "jax": ModuleTarget(
        "JAX",
        "{}_jax.py",
        "differentiable:emit_jax",
        noise=False,
        parts=frozenset(("formulas", "loops")),
    ),
}
