"""What stands in each statement of a model, listed once for all who look for oversights."""

from __future__ import annotations

from collections.abc import Sequence

from mechc.lang import ast

from ..names.classes import Stated
from ..names.instance import Instance
from ..names.space import nodes

Inside = Sequence[tuple[Stated, Sequence[ast.Node]]]
"""The statements of a model, inherited ones too, each with all nodes in it."""


def inside_of(instance: Instance) -> Inside:
    """List the nodes of each statement of a model."""
    return [(stated, tuple(nodes(stated.statement))) for stated in instance.cls.statements]
