"""From the text of a file, or its syntax tree, to the flat model: the steps in order."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from contextlib import suppress
from fractions import Fraction
from pathlib import Path

from msgspec.structs import replace

from mechc.lang import ast
from mechc.lang.diagnostics import Reporter
from mechc.lang.grammar.keywords import KEYWORDS
from mechc.lang.parser import parse
from mechc.lang.source import SourceFile
from mechc.suggest import closest

from ..interpreter import compiling
from . import model, types
from .checks.cycles import check_cycles
from .checks.oversights import inside_of, lint, warn_of_unset, warn_of_unused
from .checks.signal_loops import solve_linear_loops
from .checks.unknowns import check_unknowns
from .expressions.elaborate import elaborate
from .filters import filtered
from .instances.instantiate import make_instance
from .instances.overrides import Given, check_known, exact
from .model import FlatModel, Role, Unlike
from .names.classes import Class, Classes
from .names.files import search_path
from .names.instance import ComponentMember, Instance, VariableMember, let_go
from .names.namespace import Namespace, SourceLibrary
from .names.scope import Flattening, Poisoned, Scope, skip
from .names.space import look_ahead
from .statements.drawings import drawings
from .statements.elaborate import run
from .statements.energies import note_fields
from .statements.experiments import experiments
from .statements.initial_values import all_stationary
from .statements.record import StatementRecord
from .statements.relations import hold_released_drives, keep_by_unknowns
from .statements.servo import check_impacts, find_inputs
from .statements.studies import studies
from .statements.variables import variable
from .statements.variations import name_independent, variation

_FILE_LEVEL = (ast.Import, ast.Model, ast.Function, ast.Type)


def flatten(
    file: ast.File,
    reporter: Reporter,
    *,
    model: str | None = None,
    structural: Mapping[str, Given] | None = None,
    search: tuple[Path, ...] = (),
    further: tuple[ast.Statement, ...] = (),
    space: int = 0,
    each_pair: bool = False,
) -> FlatModel:
    """Return one model of a file, flat and checked; without ``model`` the last one that is not partial.

    ``structural`` gives values to structural parameters by name; ``search`` are further folders for imports;
    ``further`` statements follow those of the model. ``space``: 2 or 3 for a part that is planar or spatial by what
    uses it. ``each_pair``: no contacts are a family of one formula.
    Raises CompileError with everything found.
    """
    known = len(reporter.diagnostics)
    library = SourceLibrary(search_path(file, search), reporter)
    namespace = library.register(file)
    namespace.resolve()
    chosen = _choose(file, namespace, model, reporter)
    if further:
        chosen = replace(chosen, body=(*chosen.body, *further))
    classes = Classes(reporter)
    flattening = Flattening(reporter, library, classes, elaborate, _make, exact(structural or {}))
    flattening.each_pair = each_pair
    flattening.space.size = space
    with compiling():
        try:
            return _flatten(classes.of(chosen, namespace), flattening)
        except Unlike:
            reporter.withdraw(known)
        except RecursionError:
            raise reporter.fail(
                "E0207",
                "definitions depend on each other in too long a chain",
                chosen.name_span,
                help="declare names before they are used",
            ) from None
    return flatten(
        file,
        reporter,
        model=model,
        structural=structural,
        search=search,
        further=further,
        space=space,
        each_pair=True,
    )


# ---------------------------------------------------------------- which model


def _make(member: ComponentMember) -> None:
    """Make the instances of a shape or of a contact of shapes."""
    from .statements.contacts_of_shapes import make

    make(member)


def _choose(file: ast.File, namespace: Namespace, name: str | None, reporter: Reporter) -> ast.Model:
    """Return the model that is asked for."""
    models = {m.name: m for m in namespace.models}
    bare = tuple(item for item in file.items if not isinstance(item, _FILE_LEVEL))
    if bare:
        anonymous = _anonymous(file, bare)
        models[anonymous.name] = anonymous
    if name is None:
        whole = [m for m in models.values() if not m.partial]
        if not whole:
            raise reporter.fail(
                "E0214",
                f"'{file.source.name}' holds no model",
                None,
                help="a file holds statements, or 'model Name ... end Name;'"
                if not models
                else "a partial model is completed by one that extends it",
            )
        return whole[-1]
    shape = namespace.look_up_shape(name, file.span)
    if name not in models and shape is not None and shape.namespace is namespace:
        assert isinstance(shape.definition, ast.Model)
        return shape.definition
    chosen = models.get(name)
    if chosen is None:
        near = closest(name, models)
        raise reporter.fail(
            "E0214",
            f"'{file.source.name}' holds no model '{name}'",
            None,
            help=f"did you mean '{near}'?" if near else f"it holds {', '.join(models)}" if models else "",
        )
    if chosen.partial:
        raise reporter.fail(
            "E0214",
            f"'{name}' is partial: it must be extended",
            chosen.name_span,
            help=f"write 'model Mine extends {name}; ... end Mine;'",
        )
    return chosen


def _anonymous(file: ast.File, statements: tuple[ast.Statement, ...]) -> ast.Model:
    """Return the model that the bare statements of a file are, named after the file."""
    stem = Path(file.source.name).stem or "model"
    name = "".join(c if c.isalnum() or c == "_" else "_" for c in stem)
    first = statements[0].span
    return ast.Model(name=name, name_span=first, body=statements, span=first.to(statements[-1].span))


# ---------------------------------------------------------------- the steps


def _flatten(cls: Class, flattening: Flattening) -> FlatModel:
    reporter = flattening.reporter
    if cls.broken:
        reporter.stop_on_errors()
    flattening.dimensionless = cls.dimensionless
    if cls.dimensionless:
        flattening.time_type = types.NUMBER
    instance = make_instance(flattening, cls, "", None, None, [])
    _name_independent(instance)
    check_known(instance, reporter)
    look_ahead(flattening, cls)
    record = StatementRecord()
    run(instance, record)
    hold_released_drives(record)
    note_fields(record, flattening.reporter)
    all_stationary(record)
    keep_by_unknowns(record)
    find_inputs(record)
    declared = _variables(record)
    curve = variation(instance, record)
    found = experiments(instance)
    asked = studies(instance)
    _add_integrals(flattening, record)  # all that was elaborated until here may hold some
    variables = (*declared, *record.hidden)
    space = flattening.space.size
    draws = drawings(record.draws, flattening)
    inside = () if reporter.has_errors else inside_of(instance)
    if not reporter.has_errors:
        _check_gravity(instance, record)
        lint(instance, inside)
    if not reporter.has_errors:
        solve_linear_loops(record)
        check_cycles(variables, tuple(record.definitions), reporter)
    reporter.stop_on_errors()
    warn_of_unused(instance, inside)
    warn_of_unset(instance, record, found)
    flat = FlatModel(
        name=cls.model.name,
        doc=cls.model.doc,
        space=space,
        dimensionless=cls.dimensionless,
        independent=flattening.independent,
        structural=_structural(flattening),
        data=flattening.data,
        variables=variables,
        definitions=tuple(record.definitions),
        energies=tuple(record.energies),
        masses=tuple(record.masses),
        inertias=tuple(record.inertias),
        loads=tuple(record.loads),
        dampings=tuple(record.dampings),
        frictions=tuple(record.frictions),
        constraints=tuple(record.constraints),
        drives=tuple(record.drives),
        contacts=tuple(record.contacts),
        families=tuple(record.families),
        joints=_joints(record),
        initials=tuple(record.initials),
        equations=tuple(record.equations),
        events=tuple(record.events),
        assertions=tuple(record.assertions),
        exacts=tuple(record.exacts),
        experiments=found,
        studies=asked,
        origin=model.Origin(cls.model.span),
        draws=draws,
        quiet=tuple(record.quiet),
        variation=curve,
        unknowns=tuple(record.unknowns),
        implicit=tuple(record.implicit),
        files=tuple(flattening.files.values()),
    )
    flat = filtered(flat, flattening.time_type.dimension, reporter)
    check_impacts(flat, record.servos, reporter)
    check_unknowns(flat, reporter)
    reporter.stop_on_errors()
    let_go(instance)
    return flat


def _name_independent(instance: Instance) -> None:
    """Rename time where the model says ``independent``, and open the interval of a curve."""
    for stated in instance.cls.statements:
        if isinstance(stated.statement, ast.Independent):
            scope = Scope(instance.flattening, instance, stated.namespace)
            with suppress(Poisoned):  # reported; the model goes on with seconds
                name_independent(scope, stated.statement)
            if stated.statement.lower is not None:
                instance.flattening.reporter.stop_on_errors()  # all else would be told of a motion


def _add_integrals(flattening: Flattening, record: StatementRecord) -> None:
    """Make a hidden state of each running integral."""
    for name, body, type, origin in flattening.integrals:
        record.equations.append(model.StateEquation(name, (), body, origin))
        zero = model.Literal(type=type, span=origin.span, value=Fraction(0))
        start = model.StartValue(zero, False, origin)
        record.hidden.append(model.Variable(name, Role.STATE, type, origin, start=start))


def _variables(record: StatementRecord) -> tuple[model.Variable, ...]:
    result: list[model.Variable] = []
    for member in record.variables:
        try:
            result.append(variable(member, member.value, record))
        except Poisoned:
            skip(member.scope.flattening.reporter)
    return tuple(result)


def _joints(record: StatementRecord) -> tuple[model.Joint, ...]:
    """Return the joints with their targets followed through connections to the frame that is meant."""
    values = {d.name: d.value for d in record.definitions if d.role is model.DefinitionRole.FRAME}
    result = []
    for joint in record.joints:
        target = joint.target
        seen = {target}
        while isinstance(value := values.get(target), model.Name) and value.name in values:
            target = value.name
            if target in seen:
                break
            seen.add(target)
        result.append(joint if target == joint.target else replace(joint, target=target))
    return tuple(result)


def _structural(flattening: Flattening) -> dict[str, Fraction | bool | str]:
    """Return the scalar structural parameters of all instances with their values."""
    return {
        name: member.constant.value
        for name, member in flattening.variables.items()
        if isinstance(member, VariableMember)
        and member.structural
        and isinstance(member.constant, model.Literal)
    }


def _check_gravity(instance: Instance, record: StatementRecord) -> None:
    """Warn of a field that reaches no mass."""
    if instance.gravity_span is not None and id(instance) not in record.reached:
        instance.flattening.reporter.warning(
            "W0401",
            "gravity reaches no mass",
            instance.gravity_span,
            help="it acts on 'mass' statements, here and in components; an energy written out needs "
            "'potential m*g*h'",
        )


def flat_model_of(
    source: SourceFile,
    reporter: Reporter,
    *,
    model: str | None,
    structural: Collection[tuple[str, Fraction | bool | str]],
    search: tuple[Path, ...],
    formulas: Collection[tuple[str, str]],
    each_pair: bool = False,
) -> tuple[ast.File, FlatModel]:
    """Return the syntax tree and the flat model of one model of a text, with ``each_pair`` no contacts as families. Raises
    CompileError."""
    tree = parse(source, reporter)
    flat = flatten(
        tree,
        reporter,
        model=model,
        structural=dict(structural),
        search=search,
        further=tuple(_output(name, text, reporter) for name, text in formulas),
        each_pair=each_pair,
    )
    return tree, flat


def _output(name: str, text: str, reporter: Reporter) -> ast.Statement:
    """Read a formula from outside, which holds no semicolon, as an output of the model. Raises CompileError."""
    shown = name.removeprefix("asked_")  # messages show it as it was asked for
    if shown in KEYWORDS:
        shown = name
    (statement,) = parse(SourceFile(shown, f"output {shown} = {text};"), reporter).items
    assert isinstance(statement, ast.Output)
    return replace(statement, name=name)
