"""What questions from outside begin with, as plain data: what a model is called, what may be asked of it, and what its problem
is like. It is read where nothing is formed, so that nothing that forms is imported for it."""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction
from typing import TYPE_CHECKING, Any

import msgspec
from msgspec import Struct

from mechc.runtime.interface import ModelInterface, interface_of
from mechc.runtime.methods import SOLVING_CONTACTS, parts_for

if TYPE_CHECKING:
    from .flat.model import FlatModel
    from .program.model import Program

    Exact = Fraction | bool | str
    """A structural value: numbers exactly, in SI."""
else:
    Exact = Any  # msgspec reads no unions with classes that it does not know


class ExperimentOutline(Struct, frozen=True):
    """An experiment: the ``words`` are its options that are written as literals."""

    name: str
    words: Mapping[str, str]
    structural: Mapping[str, Exact]
    swept: Mapping[str, tuple[Exact, ...]]
    """Structural values that it sweeps."""
    sweeps: bool
    """Whether it sweeps anything."""
    unfit: tuple[str, ...] = ()
    """What it sets where the model at hand has no such elements."""


class StatedStudy(Struct, frozen=True):
    """A question that the file puts: its ``kind``, and its settings as they are written outside of files."""

    name: str
    kind: str
    settings: Mapping[str, str | bool]
    doc: str


class Outline(Struct, frozen=True):
    """What is told of a flat model."""

    name: str
    doc: str
    structural: Mapping[str, Exact]
    experiments: tuple[ExperimentOutline, ...]
    studies: tuple[StatedStudy, ...]

    def experiment(self) -> ExperimentOutline | None:
        """Find the experiment that is run without a name: the unnamed one, else the first."""
        return next((e for e in self.experiments if not e.name), next(iter(self.experiments), None))

    @property
    def parts(self) -> frozenset[str]:
        """The parts that are formed with the model, since its own run works on them: a crowd of contacts takes long to form."""
        own = self.experiment()
        method = own.words.get("method", "") if own is not None else ""
        return parts_for(method) if method in SOLVING_CONTACTS else frozenset()


class Summary(Struct, frozen=True):
    """What is told of a program without its statements. ``operations``: how many; ``loops``: its code may hold loops; ``offers``:
    it holds functions for others, which may be evaluated over balls of numbers."""

    description: ModelInterface
    operations: int
    loops: bool
    offers: bool


def outline_of(flat: FlatModel) -> Outline:
    """Return the outline of a flat model."""
    from .flat.model import Literal

    def literal(value: object) -> Exact:
        if not isinstance(value, Literal):
            raise TypeError("a swept structural parameter takes literal values")
        return value.value

    experiments = (
        ExperimentOutline(
            e.name,
            {name: str(said.value) for name, said in e.options.items() if isinstance(said, Literal)},
            e.structural,
            {s.target: tuple(map(literal, s.values)) for s in e.sweeps if s.structural},
            bool(e.sweeps),
            e.unfit,
        )
        for e in flat.experiments
    )
    studies = (StatedStudy(s.name, s.kind, s.settings, s.doc) for s in flat.studies)
    return Outline(flat.name, flat.doc, flat.structural, tuple(experiments), tuple(studies))


def summary_of(program: Program) -> Summary:
    """Return the summary of a program."""
    return Summary(
        ModelInterface(**interface_of(program)),
        sum(function.operations for function in (program.parameters_function, *program.functions)),
        program.long or program.few_slots,
        program.function("bias") is not None,
    )


# ---------------------------------------------------------------- as bytes


def write(value: Outline | Summary) -> bytes:
    """Return an outline or a summary as bytes."""
    return msgspec.msgpack.encode(value, enc_hook=_digits)


def read_outline(data: bytes) -> Outline:
    """Return the outline that bytes hold."""
    return msgspec.msgpack.decode(data, type=Outline, ext_hook=_fraction)


def read_summary(data: bytes) -> Summary:
    """Return the summary that bytes hold."""
    return msgspec.msgpack.decode(data, type=Summary)


def _digits(value: Fraction) -> msgspec.msgpack.Ext:
    """Return a fraction as bytes: its numerator and denominator in hexadecimal digits, which nothing limits."""
    return msgspec.msgpack.Ext(1, f"{value.numerator:x}/{value.denominator:x}".encode())


def _fraction(code: int, digits: memoryview) -> Fraction:
    numerator, denominator = digits.tobytes().split(b"/")
    return Fraction(int(numerator, 16), int(denominator, 16))
