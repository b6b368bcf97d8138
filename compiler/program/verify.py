"""What holds for every program."""

from __future__ import annotations

from ..graph.operations import LOOKUP, OPERATIONS, SYMBOL
from ..graph.table import answers
from ..malformed import Malformed, excerpt
from .model import (
    SERIES_NEXT,
    Body,
    Literal,
    Load,
    Lookup,
    Operate,
    Program,
    ProgramFunction,
    Statement,
    Store,
    operands_of,
)
from .series import padded
from .show import line

READABLE = ("t", "y", "u", "z", "p", "g", "s")


def verify(program: Program) -> None:
    """Raise Malformed where the program is not well formed.

    Values are computed before they are used, every output is stored once (in functions of events what changes), every place that is
    read exists and has been written, operations have their number of operands.
    """
    for function in (program.parameters_function, *program.functions):
        _Check(program, function).run()
    for k, solution in enumerate(program.solutions):
        for function in (solution.guess, solution.rows):
            _Check(program, function).run()
        if not all(0 <= i < k for i in solution.inner):
            raise Malformed(f"program, solution {k}", f"{solution.inner} are not found before")
        rows, left = divmod(solution.rows.n_out - len(solution.places), 2)
        if left or not all(0 <= i < rows and 0 <= j < solution.count for i, j in solution.places):
            raise Malformed(f"program, solution {k}", f"derivatives at {solution.places} of {rows} rows")


class _Check:
    def __init__(self, program: Program, function: ProgramFunction) -> None:
        self.program = program
        self.function = function
        self.writes_p = function is program.parameters_function
        self.stored: set[tuple[str, int]] = set()
        self.body: Body = ()

    def run(self) -> None:
        for body in self.function.bodies:
            self.body = body
            stores = set[int]()
            for position, statement in enumerate(body):
                for operand in operands_of(statement):
                    if not 0 <= operand < position or operand in stores:
                        self.fail(position, "reads a value that is not computed before")
                if type(statement) is Store:
                    stores.add(position)
                self.check(position, statement)
        acts = self.function.name in self.program.actions
        first = self.program.size("y") + self.program.size("z") if acts else 0
        missing = [i for i in range(first, self.function.n_out) if ("out", i) not in self.stored]
        if missing:
            self.fail(None, f"does not store out{missing}")

    def check(self, position: int, statement: Statement) -> None:
        if type(statement) is Operate:  # most are, and a match takes long
            code, count = statement.code, len(statement.operands)
            if not SYMBOL < code < len(OPERATIONS) or code == LOOKUP:
                self.fail(position, f"has no operation {code}")
            elif count != OPERATIONS[code].arity:
                self.fail(position, f"gives {count} operands to {OPERATIONS[code].name}")
            return
        match statement:
            case Load(array, index):
                self.check_load(position, array, index)
            case Store(array, index, _, guarded):
                self.check_store(position, array, index, guarded)
            case Lookup(table, order, _):
                if not 0 <= table < len(self.program.tables) or not answers(
                    self.program.tables[table], order
                ):
                    self.fail(position, f"asks question {order} of table {table}")
            case Literal():
                pass

    def check_load(self, position: int, array: str, index: int) -> None:
        if array == "w":
            known = ("w", index) in self.stored
        elif self.writes_p and array == "p" and index >= len(self.program.arrays["p"]):
            known = ("p", index) in self.stored
        else:
            known = array in READABLE and 0 <= index < self.size(array)
        if not known:
            self.fail(position, f"reads {array}[{index}], which does not exist or is not written yet")
        if self.writes_p and array not in ("p", "w"):
            self.fail(position, f"reads {array}, but parameters depend on nothing else")

    def size(self, array: str) -> int:
        """Return how many numbers the function is given in an array."""
        if array == "s":
            return sum(s.count for s in self.program.solutions)
        series = self.program.series
        if self.function.name == SERIES_NEXT and series is not None:
            own = {"z": series.n_kept, "u": padded(series.n_slots) + 2}
            return own[array] if array in own else self.program.size(array)
        return self.program.size(array)

    def check_store(self, position: int, array: str, index: int, guarded: bool) -> None:
        size = {
            "out": self.function.n_out,
            "w": self.function.workspace,
            "p": self.program.size("p") if self.writes_p else 0,
        }.get(array, 0)
        if not 0 <= index < size:
            self.fail(position, f"writes {array}[{index}], which does not exist")
        if array != "w" and (array, index) in self.stored:
            self.fail(position, f"writes {array}[{index}] twice")
        if guarded != (array == "p" and index < len(self.program.arrays["p"])):
            self.fail(position, f"writes {array}[{index}] with the wrong guard")
        self.stored.add((array, index))

    def fail(self, position: int | None, what: str) -> None:
        """Say what is wrong with a statement of the present body, or with the function."""
        where = f"program, function {self.function.name}"
        if position is None:
            raise Malformed(where, what)
        around = excerpt(
            len(self.body),
            position,
            lambda k: line(self.program, k, self.body[k]),
            operands_of(self.body[position]),
        )
        raise Malformed(f"{where}, statement {position}", what, around)
