"""Values of stages as bytes: flat models, equations and programs, written and read again.

Equations are written with the part of the graph that their functions need; what is made of them afterwards is the same,
byte for byte. A mechanical system holds functions and frames that know what was computed on them: ``build`` makes it of
its flat model.

A value is a tree of lists: a number that says what the list is, then its parts. What occurs often (places in the text,
types, expressions, which functions of the language share) is in a table, and referred to.
"""

from __future__ import annotations

import sys
from array import array
from collections.abc import Callable, Mapping
from enum import Enum
from fractions import Fraction
from functools import cache
from hashlib import blake2b
from types import ModuleType
from typing import Any, Final, TypeVar, cast

import msgspec
from msgspec import Struct
from msgspec.structs import replace

from mechc.lang.source import SourceFile, Span
from mechc.lang.units import Dimension
from mechc.runtime import interface
from mechc.runtime.interface import ModelInterface

from .equations import crowd_plan
from .equations import model as equations_model
from .equations.model import Equations
from .flat import model as flat_model
from .flat.model import FlatModel, Origin, Type, Typed
from .flat.types import make
from .graph import Samples, Table
from .graph.columns import GraphColumns, columns, graph_of
from .graph.operations import OPERATIONS
from .interpreter import compiling
from .program import model as program_model
from .program.model import LongBody, Program, Statement

VERSION: Final = 2
"""Of the form of the bytes; that of the values is known by the fields of their classes."""

MAGIC: Final = "mechc stage"

_TUPLE, _MAPPING, _SET, _FRACTION, _BIG, _SHARED, _GRAPH, _BODIES, _LONG, _ARRAY, _FIRST_CLASS = range(11)

_SHARED_CLASSES = (Span, SourceFile, Origin, Type, Dimension, Typed)

Stage = TypeVar("Stage", FlatModel, Equations, Program)


class OtherVersion(ValueError):
    """Bytes that another version of the compiler wrote, or none."""


def write(value: FlatModel | Equations | Program) -> bytes:
    """Return a stage's value as bytes."""
    writer = _Writer()
    with compiling():
        content = writer.plain(_compact(value) if isinstance(value, Equations) else value)
        return msgspec.msgpack.encode(
            [MAGIC, VERSION, _fingerprint(), type(value).__name__, writer.shared, content]
        )


def read(data: bytes, stage: type[Stage]) -> Stage:
    """Return the value that bytes hold. Raises OtherVersion where they were not written by this version."""
    try:
        header = msgspec.msgpack.decode(data, type=tuple[str, int, str, str, msgspec.Raw, msgspec.Raw])
    except msgspec.DecodeError as error:
        raise OtherVersion(f"these bytes hold no stage of a model: {error}") from None
    magic, version, fingerprint, name, shared, content = header
    if magic != MAGIC:
        raise OtherVersion("these bytes hold no stage of a model")
    if (version, fingerprint) != (VERSION, _fingerprint()):
        raise OtherVersion("these bytes were written by another version of the compiler")
    if name != stage.__name__:
        raise OtherVersion(f"these bytes hold {name}, not {stage.__name__}")
    reader = _Reader()
    for part in msgspec.msgpack.decode(shared):
        reader.shared.append(reader.value(part))
    value = reader.value(msgspec.msgpack.decode(content))
    assert isinstance(value, stage)
    return value


# ---------------------------------------------------------------- what may be written


@cache
def _classes() -> tuple[type[Struct] | type[Enum], ...]:
    """Return every class of the stages' models, in the order of their definition."""
    found: list[type[Struct] | type[Enum]] = [SourceFile, Span, Dimension, Table, Samples]
    modules: tuple[ModuleType, ...] = (flat_model, interface, equations_model, crowd_plan, program_model)
    for module in modules:
        for item in vars(module).values():
            own = isinstance(item, type) and item.__module__ == module.__name__
            if own and issubclass(item, (Struct, Enum)):
                found.append(item)
    return tuple(found)


@cache
def _fingerprint() -> str:
    """Return what changes with the fields of any class, and with the numbers of operations."""
    described: list[object] = [(o.code, o.name, o.arity) for o in OPERATIONS]
    for known in (*_classes(), GraphColumns):
        fields = known.__struct_fields__ if issubclass(known, Struct) else [e.name for e in known]
        described.append((known.__name__, *fields))
    return blake2b(repr(described).encode(), digest_size=8).hexdigest()


def _compact(equations: Equations) -> Equations:
    """Return equations whose graph is the ``GraphColumns`` of what they need, in the numbers of its rows."""
    outputs = [*equations.layout, *(n for f in equations.functions for n in f.outputs)]
    outputs += [rule.value for rule in equations.parameter_rules]
    graph, row = columns(equations.graph, outputs)
    return replace(
        equations,
        graph=graph,
        layout={row[n]: slot for n, slot in equations.layout.items()},
        functions=tuple(replace(f, outputs=tuple([row[n] for n in f.outputs])) for f in equations.functions),
        parameter_rules=tuple(replace(rule, value=row[rule.value]) for rule in equations.parameter_rules),
    )


# ---------------------------------------------------------------- fractions, in digits that nothing limits


def _to_text(value: object) -> str:
    if isinstance(value, Fraction):
        return f"{value.numerator:x}/{value.denominator:x}"
    raise TypeError(f"a {type(value).__name__} is not a part of a stage")


def _from_text(wanted: type, text: str) -> Fraction:
    assert wanted is Fraction
    numerator, _, denominator = text.partition("/")
    return Fraction(int(numerator, 16), int(denominator, 16))


_encoder = msgspec.msgpack.Encoder(enc_hook=_to_text)
_bodies = msgspec.msgpack.Decoder(tuple[tuple[Statement, ...], ...], dec_hook=_from_text)
_numbers = msgspec.msgpack.Decoder(tuple[Fraction, ...], dec_hook=_from_text)
_columns = msgspec.msgpack.Decoder(GraphColumns, dec_hook=_from_text)


# ---------------------------------------------------------------- columns, the same bytes on every machine


def _bytes_of(column: array[int]) -> bytes:
    if sys.byteorder == "big":
        column = column[:]
        column.byteswap()
    return column.tobytes()


def _array_of(typecode: str, data: bytes) -> array[int]:
    column = array(typecode, data)
    if sys.byteorder == "big":
        column.byteswap()
    return column


# ---------------------------------------------------------------- writing


class _Writer:
    def __init__(self) -> None:
        self.shared: list[object] = []
        self._numbers: dict[object, int] = {}
        self._ways: dict[type[Struct], tuple[bool, bool, int]] = {}
        """Of each class: whether its values are shared, whether by identity, and its code."""
        self._codes = {known: k for k, known in enumerate(_classes(), _FIRST_CLASS)}

    def plain(self, value: object) -> object:
        """Return a value as lists, texts and numbers."""
        kind = value.__class__
        if value is None or kind in (bool, float, str, bytes):
            return value
        if kind is int:
            assert isinstance(value, int)
            return value if -(1 << 63) <= value < 1 << 63 else [_BIG, f"{value:x}"]
        if kind is tuple:
            return [_TUPLE, *map(self.plain, cast("tuple[object, ...]", value))]
        if isinstance(value, GraphColumns):
            return [_GRAPH, _encoder.encode(value)]
        if isinstance(value, Struct):
            return self._struct(value)
        if isinstance(value, tuple):
            return [_TUPLE, *map(self.plain, value)]
        if isinstance(value, Mapping):
            return [_MAPPING, *(self.plain(x) for item in value.items() for x in item)]
        if isinstance(value, frozenset):
            return [_SET, *sorted(value)]
        if isinstance(value, Fraction):
            return [_FRACTION, _to_text(value)]
        if isinstance(value, Enum):
            return [self._codes[value.__class__], value.value]
        if isinstance(value, array):
            return [_ARRAY, value.typecode, _bytes_of(value)]
        if isinstance(value, LongBody):
            columns = (value.kinds, value.first, value.second, value.third)
            return [_LONG, *map(self.plain, columns), _encoder.encode(value.numbers)]
        raise TypeError(f"a {kind.__name__} is not a part of a stage")

    def _struct(self, value: Struct) -> list[object]:
        kind = value.__class__
        if kind not in self._ways:
            self._ways[kind] = issubclass(kind, _SHARED_CLASSES), issubclass(kind, Typed), self._codes[kind]
        shared, typed, code = self._ways[kind]
        if not shared:
            return self._fields(value)
        key: object = id(value) if typed else (kind, value)
        number = self._numbers.get(key)
        if number is None:
            plain = self.plain
            fields = [
                code,
                *[plain(getattr(value, name)) for name in value.__struct_fields__],
            ]  # they come first
            number = self._numbers[key] = len(self.shared)
            self.shared.append(fields)
        return [_SHARED, number]

    def _fields(self, value: Struct) -> list[object]:
        code = self._codes[value.__class__]
        if isinstance(value, program_model.ProgramFunction):
            long = any(isinstance(body, LongBody) for body in value.bodies)
            bodies = self.plain(value.bodies) if long else [_BODIES, _encoder.encode(value.bodies)]
            return [
                code,
                *(bodies if n == "bodies" else self.plain(getattr(value, n)) for n in _names(value)),
            ]
        return [code, *[self.plain(getattr(value, name)) for name in _names(value)]]


def _names(value: Struct) -> tuple[str, ...]:
    return value.__struct_fields__


# ---------------------------------------------------------------- reading


class _Reader:
    def __init__(self) -> None:
        self.shared: list[object] = []
        self._make: tuple[Callable[[list[Any]], object], ...] = (
            lambda x: tuple([self.value(part) for part in x[1:]]),
            lambda x: {self.value(k): self.value(v) for k, v in zip(x[1::2], x[2::2], strict=True)},
            lambda x: frozenset(x[1:]),
            lambda x: _from_text(Fraction, x[1]),
            lambda x: int(x[1], 16),
            lambda x: self.shared[x[1]],
            lambda x: graph_of(_columns.decode(x[1])),
            lambda x: _bodies.decode(x[1]),
            lambda x: LongBody(*[self.value(part) for part in x[1:5]], _numbers.decode(x[5])),  # type: ignore[call-arg,arg-type]
            lambda x: _array_of(x[1], x[2]),
            *(self._maker(known) for known in _classes()),
        )

    def value(self, plain: object) -> object:
        """Return what lists, texts and numbers stand for."""
        return self._make[plain[0]](plain) if plain.__class__ is list else plain

    def _maker(self, known: type[Struct] | type[Enum]) -> Callable[[list[Any]], object]:
        value = self.value
        if issubclass(known, Enum):
            return lambda x: known(x[1])
        if known is Type:  # equal types are one object
            return lambda x: make(*[value(part) for part in x[1:]])  # type: ignore[arg-type]
        if issubclass(known, (Typed, ModelInterface)):  # by keywords alone
            names = known.__struct_fields__
            made: Callable[..., object] = known
            return lambda x: made(**{n: value(part) for n, part in zip(names, x[1:], strict=True)})
        return lambda x: known(*[value(part) for part in x[1:]])
