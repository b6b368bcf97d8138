"""``%load_ext mechc``: cells that hold models (``%%mech``), mistakes shown as in the terminal, answers with pictures."""

from __future__ import annotations

import shlex
from collections.abc import Callable
from typing import Any

from IPython.core.error import UsageError
from IPython.core.magic import Magics, cell_magic, magics_class

from ..lang.diagnostics import CompileError
from ..runtime.studies.findings import Findings
from .bundles import findings_bundle
from .render import render
from .style import Style


@magics_class
class MechMagics(Magics):
    """The magics of mechc; ``loads`` compiles a text."""

    def __init__(self, shell: Any, loads: Callable[..., Any]) -> None:
        super().__init__(shell)
        self.loads = loads

    @cell_magic
    def mech(self, line: str, cell: str) -> Any:
        """Compile the cell: ``%%mech [NAME]`` keeps the model as the variable NAME, ``model`` if none is given.

        What is wrong is shown as in the terminal, and the variable stays as it was.
        """
        words = shlex.split(line)
        if len(words) > 1 or (words and not words[0].isidentifier()):
            raise UsageError("%%mech takes one name at most, that of the variable: '%%mech pendulum'")
        try:
            model = self.loads(cell, name="cell.mech")
        except CompileError as error:
            print(render(error.diagnostics, Style(colour=True)))
            return None
        if model.diagnostics:
            print(render(model.diagnostics, Style(colour=True)))
        assert self.shell is not None
        self.shell.user_ns[words[0] if words else "model"] = model
        return model


def register(shell: Any, loads: Callable[..., Any]) -> None:
    """Register the magics, and how answers of studies are shown."""
    shell.register_magics(MechMagics(shell, loads))
    formatter = shell.display_formatter.mimebundle_formatter
    formatter.for_type(Findings, lambda found, **_: findings_bundle(found))
