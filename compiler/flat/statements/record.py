"""The flat model while it is being collected."""

from __future__ import annotations

from msgspec import Struct, field

from mechc.lang import ast
from mechc.lang.source import Span

from .. import model
from ..names.instance import Instance, Rank, VariableMember
from ..names.scope import Scope
from ..subscripts import Index
from ..values.evaluate import whole_number


class StatedStart(Struct, frozen=True):
    """An initial value of one variable, or of one element or the rate of it, wherever it is stated.

    ``rank`` as in ``Modifier``.
    """

    member: VariableMember
    indices: Index
    rate: bool
    start: model.StartValue
    rank: Rank
    span: Span


class StatementRecord(Struct):
    """Everything in the order of its statements; ``variables`` get their values last (variables.py)."""

    variables: list[VariableMember] = field(default_factory=list)
    definitions: list[model.Definition] = field(default_factory=list)
    energies: list[model.Energy] = field(default_factory=list)
    masses: list[model.Mass] = field(default_factory=list)
    inertias: list[model.Inertia] = field(default_factory=list)
    loads: list[model.Load] = field(default_factory=list)
    dampings: list[model.Damping] = field(default_factory=list)
    frictions: list[model.Friction] = field(default_factory=list)
    constraints: list[model.Constraint] = field(default_factory=list)
    drives: list[model.Drive] = field(default_factory=list)
    contacts: list[model.Contact] = field(default_factory=list)
    families: list[model.ContactFamily] = field(default_factory=list)
    joints: list[model.Joint] = field(default_factory=list)
    initials: list[model.InitialCondition] = field(default_factory=list)
    equations: list[model.StateEquation] = field(default_factory=list)
    events: list[model.Event] = field(default_factory=list)
    unknowns: list[model.UnknownOutput] = field(default_factory=list)
    implicit: list[model.ImplicitEquation] = field(default_factory=list)
    assertions: list[model.Assertion] = field(default_factory=list)
    exacts: list[model.ExactSolution] = field(default_factory=list)
    draws: list[tuple[ast.Draw, Scope]] = field(default_factory=list)
    quiet: list[str] = field(default_factory=list)
    ends: list[model.End] = field(default_factory=list)
    functional: model.Expression | None = None
    servos: dict[str, Span] = field(default_factory=dict)
    """Where it is said what keeps a constraint by something else than its own force, by the name of the constraint."""
    servo_inputs: list[tuple[VariableMember, model.Expression]] = field(default_factory=list)
    held: list[tuple[Scope, ast.Equation]] = field(default_factory=list)
    """Equations between coordinates, beside outputs that equations determine."""
    stationary: list[tuple[Scope, ast.StationaryStart]] = field(default_factory=list)
    starts: dict[str, list[StatedStart]] = field(default_factory=dict)
    hidden: list[model.Variable] = field(default_factory=list)
    fields: dict[int, Span] = field(default_factory=dict)
    """Where gravity is stated as a function of the place, by its instance."""
    reached: set[int] = field(default_factory=set)
    placed: dict[str, Span] = field(default_factory=dict)
    counts: dict[str, int] = field(default_factory=dict)

    def numbered(self, kind: str) -> str:
        """Return ``constraint[2]``, the name of a statement without a label."""
        self.counts[kind] = self.counts.get(kind, 0) + 1
        return f"{kind}[{self.counts[kind]}]"


class JointParts(Struct):
    """The ``place`` and ``closure`` statements of one instance."""

    instance: Instance
    places: list[tuple[str, model.Expression, Span]] = field(default_factory=list)
    closures: list[model.ClosureEquation] = field(default_factory=list)


def label_name(scope: Scope, label: ast.LabelName | None, kind: str, record: StatementRecord) -> str:
    """Return the dotted name of a statement, or a number where it has no label."""
    if label is None:
        return record.numbered(kind)
    text = label.name
    if label.indices:
        index = [whole_number(scope, i, "the index of a name") for i in label.indices]
        text += f"[{','.join(map(str, index))}]"
    return f"{scope.path}.{text}" if scope.path else text
