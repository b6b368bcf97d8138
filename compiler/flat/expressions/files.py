"""Files that a model names: where they are, and the numbers in them."""

from __future__ import annotations

from collections.abc import Collection
from fractions import Fraction
from pathlib import Path

from mechc.lang.source import Span
from mechc.lang.units import UnitError, parse_unit, to_si

from .. import types
from ..model import Expression, Kind, Literal, ReadFile
from ..names.file_dependencies import note
from ..names.scope import Scope
from ..values.evaluate import check_size, constant, not_structural
from ..values.indexing import stack
from ..values.value_files import READERS, FileNumbers, NoNumbers, numbers
from .signature import ElaboratedCall

_KINDS = "'.csv', '.txt', '.dat', '.npz', '.npy' or '.mtx'"


def path_of(
    scope: Scope, value: Expression, span: Span, endings: Collection[str], code: str, kinds: str, named: str
) -> Path:
    """Return the path of a file, which is told from the folder of the text that names it, and must be there."""
    name = constant(value)
    assert isinstance(name, str)
    path = Path(name)
    if not path.is_absolute():
        path = Path(value.span.file.name).parent / path
    if path.suffix.casefold() not in endings:
        raise scope.fail(code, f"'{name}' is not {kinds}", span, help=f"its name ends with {named}")
    if not note(path).is_file():
        raise scope.fail(
            code,
            f"there is no file '{name}'",
            span,
            help="the path is relative to the folder of the file that names it",
        )
    return path


def text_of(call: ElaboratedCall, index: int, purpose: str) -> str:
    """Return an argument that is a text known when compiling."""
    argument = call.arguments[index]
    if argument.type.kind is not Kind.STRING or argument.type.shape:
        raise call.wrong(index, "a text", "E0308", "write it in quotes")
    found = constant(argument)
    if not isinstance(found, str):
        raise not_structural(call.scope, call.nodes[index], argument, purpose)
    return found


def noted(scope: Scope, name: str, path: Path) -> None:
    """Tell the model that it depends on a file. Raises OSError."""
    from hashlib import sha256

    scope.flattening.files[name] = ReadFile(name, sha256(path.read_bytes()).hexdigest())


def file(call: ElaboratedCall) -> Expression:
    """Return the numbers of a file, in the unit that it says."""
    scope, span = call.scope, call.nodes[0].span
    name = text_of(call, 0, "the name of a file")
    wanted = text_of(call, 1, "the name in a file") if len(call.arguments) > 1 else ""
    path = path_of(scope, call.arguments[0], span, READERS, "E0823", "a file of numbers", _KINDS)
    known, key = scope.flattening.numbers, (str(path), wanted)
    if key not in known:
        try:
            noted(scope, name, path)
            found = numbers(path, wanted)
        except OSError as error:
            raise scope.fail("E0823", f"'{name}' cannot be read: {error.strerror}", span) from None
        except NoNumbers as error:
            raise scope.fail("E0823", f"'{name}': {error}", call.node.span, help=error.help) from None
        known[key] = _expression(call, name, found)
    return known[key]


def _expression(call: ElaboratedCall, name: str, found: FileNumbers) -> Expression:
    scope, span = call.scope, call.node.span
    check_size(scope, len(found.values), span)
    factor, type = Fraction(1), types.NUMBER
    if found.unit:
        try:
            unit = parse_unit(found.unit)
        except UnitError as error:
            raise scope.fail("E0823", f"'{name}': {error}", span) from None
        factor = to_si(Fraction(1), unit)
        if not scope.flattening.dimensionless:
            type = types.real(unit.dimension, angle=unit.angle)
    elif all(x.denominator == 1 for x in found.values):
        type = types.INTEGER
    literals: list[Expression] = [Literal(type=type, span=span, value=x * factor) for x in found.values]
    return stack(literals, found.shape, span) if found.shape else literals[0]


FILE_RULES = {"file": file}
