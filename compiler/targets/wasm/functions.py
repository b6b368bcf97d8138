"""The functions of a program, placed after a kernel."""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction
from itertools import chain
from typing import Final

from ...graph.table import Samples
from ...program import Program, ProgramFunction
from ...program.branches import mostly_branches
from ...program.chunk import chunk
from ...program.loops.rolled import Rolled
from ...program.model import Body
from ...program.shared_bodies import in_common
from ..c_loops import ON_STACK, loops_of
from ..c_tables import LARGE, used_tables
from ..model_data import OF_SHARES, is_emitted, readers
from . import binary as b
from .place import PARAMETER, PIECE, MemoryPlace
from .rolled import Loops
from .straight import Arrays, FunctionWriter, number

WITH_SHARES: Final = "with_shares"
"""The function of the kernel (``mechc/web/kernel/web_shares.c``)."""

LONGEST: Final = 3000
"""Operations of one body. Ones of 800 or 1600 are as fast within the noise (Stewart platform, Fekete points, V8), but pass more through
the workspace, of which pages are longer; V8 takes no longer ones than 7.6 MB."""

ALIGNED: Final = 16
"""Bytes of which the stack takes multiples."""


def place_functions(program: Program, place: MemoryPlace) -> None:
    """Write all functions of a program."""
    loops = loops_of(program)
    whole = {*loops, *(f.name for f in program.functions if mostly_branches(f))}
    program = chunk(in_common(program, LONGEST, whole), LONGEST, whole)
    tables = {}
    for i, table in used_tables(program):
        if isinstance(table, Samples):
            numbers = table.values
        else:
            numbers = tuple(chain(*zip(table.points, table.values, table.slopes, strict=True)))
        if len(table.values) < LARGE:
            numbers = tuple(number(Fraction(x)) for x in numbers)
        tables[i] = (place.numbers(numbers), len(table.values))
    functions = _Functions(program, place, tables)
    shared = readers(program)
    for function in (program.parameters_function, *program.functions):
        if is_emitted(function):
            name = f"{function.name}{OF_SHARES}" if function.name in shared else function.name
            functions.add(function, name, loops.get(function.name))
            if function.name in shared:
                place.function(function.name, 0, functions.reader(name, shared[function.name]))


class _Functions:
    def __init__(self, program: Program, place: MemoryPlace, tables: Mapping[int, tuple[int, int]]) -> None:
        self.program = program
        self.place = place
        self.tables = tables
        self.inputs = program.size("u")
        self.pieces: dict[tuple[int, Body], int] = {}
        """Bodies that were placed, by kind."""

    def add(self, function: ProgramFunction, name: str, rolled: Rolled | None) -> None:
        parameters = function is self.program.parameters_function
        kind = PARAMETER if parameters else 0
        if rolled is not None:
            body = self._looped(rolled, parameters)
        elif len(function.bodies) == 1:
            body = self._straight(function, 0, parameters, piece=False)
        else:
            body = self._in_pieces(function, parameters)
        self.place.function(name, kind, body)

    def reader(self, name: str, count: int) -> bytes:
        """Return the body of a function that calls one of so many results with shares of loads."""
        where = arguments(parameters=False, piece=False)
        writer = FunctionWriter(self.place, len(where), {})
        given = b.i32(self.place.pointer(name)) + b.i32(count) + b"".join(map(b.get, where.values()))
        writer.flush(given + self.place.call(WITH_SHARES))
        return writer.body()

    def _straight(self, function: ProgramFunction, k: int, parameters: bool, *, piece: bool) -> bytes:
        where = arguments(parameters, piece=piece)
        writer = FunctionWriter(self.place, len(where), self.tables)
        writer.write(function.bodies[k], Arrays(where, self.inputs))
        return writer.body()

    def _in_pieces(self, function: ProgramFunction, parameters: bool) -> bytes:
        """Place the bodies of a function, and return one that runs them one after the other."""
        kind = PIECE | (PARAMETER if parameters else 0)
        for k, body in enumerate(function.bodies):
            if (kind, body) not in self.pieces:
                code = self._straight(function, k, parameters, piece=True)
                self.pieces[kind, body] = self.place.function(f"{function.name}_{k + 1}", kind, code)
        where = arguments(parameters, piece=False)
        writer = FunctionWriter(self.place, len(where), self.tables)
        end = self._workspace(writer, where, max(1, function.workspace))
        given = b"".join(b.get(where[array]) for array in arguments(parameters, piece=True))
        writer.flush(b"".join(given + b.call(self.pieces[kind, body]) for body in function.bodies) + end)
        return writer.body()

    def _looped(self, rolled: Rolled, parameters: bool) -> bytes:
        where = arguments(parameters, piece=False)
        writer = FunctionWriter(self.place, len(where), self.tables)
        end = self._workspace(writer, where, rolled.workspace)
        Loops(writer, rolled, Arrays(where, self.inputs)).items(rolled.items)
        writer.flush(end)
        return writer.body()

    def _workspace(self, writer: FunctionWriter, where: dict[str, int], numbers: int) -> bytes:
        """Make room for w, on the stack if it is not too large; return the code that gives it back."""
        if not numbers:
            return b""
        w = where["w"] = writer.local(b.I32)
        size = -(-8 * numbers // ALIGNED) * ALIGNED
        if numbers > ON_STACK:  # one run at a time goes through an instance
            writer.flush(b.i32(self.place.put(bytes(size), ALIGNED)) + b.put(w))
            return b""
        stack = self.place.stack_pointer
        writer.flush(b.get_global(stack) + b.i32(size) + b.I32_SUB + b.tee(w) + b.put_global(stack))
        return b.get(w) + b.i32(size) + b.I32_ADD + b.put_global(stack)


def arguments(parameters: bool, *, piece: bool) -> dict[str, int]:
    """Return the parameters of a function, by the names of arrays."""
    names: tuple[str, ...]
    if parameters:
        names = ("p", "set", "w") if piece else ("p", "set")
    else:
        names = ("t", "y", "u", "z", "p", "w", "out") if piece else ("t", "y", "u", "z", "p", "out")
    return {array: k for k, array in enumerate(names)}
