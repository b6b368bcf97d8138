"""The C text of a function as loops (``program/loops``)."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence

from msgspec.structs import replace

from ..graph.operation import ATOM
from ..program.loops.rolled import (
    NUMBERS,
    Carried,
    Carry,
    Compute,
    Index,
    Item,
    Local,
    Loop,
    LoopNumber,
    LoopRegister,
    Operand,
    Put,
    Read,
    Rolled,
)
from ..program.model import Lookup, Operate, Program
from ..verification import is_asked
from .c_blocks import Copy, Way, are_sums, copies_of, copying, in_blocks, way_of
from .c_forms import DIALECT
from .c_sincos_batch import TURN, Ahead, ahead, is_cosine, is_turn, operands_of
from .expressions import Text, applied, fitting

ON_STACK = 16_384
"""Most numbers of a workspace that lies on the stack, of which threads may have little."""

THREADS = """\
#if defined(_MSC_VER)
#define THREAD_LOCAL static __declspec(thread)
#elif defined(__TINYC__) /* which knows no such storage: on the stack */
#define THREAD_LOCAL
#else
#define THREAD_LOCAL static _Thread_local
#endif
"""
"""Where ``needs_threads``."""

SIDE_BY_SIDE = """\
#if defined(__GNUC__) && !defined(__clang__)
#define APART _Pragma("GCC ivdep")
#else
#define APART
#endif
"""
"""Where ``are_apart``: nothing is carried from one iteration of a loop to another."""

BLOCK = 64
"""Iterations that are done side by side."""

PLACES_IN_LINE, NUMBERS_IN_LINE = 24, 8


def loops_of(program: Program) -> dict[str, Rolled]:
    """Return what becomes loops of the long functions of a program, by name."""
    long = [f for f in (program.parameters_function, *program.functions) if f.made]
    if not long:
        return {}
    from ..program.loops.replay import verify
    from ..program.loops.roll import roll

    found = {f.name: rolled for f in long if (rolled := roll(f)) is not None}
    if is_asked():
        for function in long:
            if function.name in found:
                verify(function, found[function.name])
    return found


def loop_tables(name: str, rolled: Rolled) -> Iterator[str]:
    """Yield the tables that the indices of a function read, and its constants."""
    if rolled.numbers:
        yield f"static const mech_real {_numbers(name)}[{len(rolled.numbers)}] = {{"
        for begin in range(0, len(rolled.numbers), NUMBERS_IN_LINE):
            shown = (DIALECT.literal(n)[0] for n in rolled.numbers[begin : begin + NUMBERS_IN_LINE])
            yield f"    {', '.join(shown)},"
        yield "};"
    for k, table in enumerate(rolled.tables):
        kind = "unsigned short" if min(table) >= 0 and max(table) < 65536 else "int"
        yield f"static const {kind} {_table(name, k)}[{len(table)}] = {{"
        for begin in range(0, len(table), PLACES_IN_LINE):
            yield f"    {', '.join(map(str, table[begin : begin + PLACES_IN_LINE]))},"
        yield "};"


def loop_lines(name: str, rolled: Rolled, sizes: Mapping[str, int], turns: bool) -> Iterator[str]:
    """Yield the lines of the body of a function, without its braces; ``sizes`` of the arrays that it reads. ``sincos_batch``: sines
    and cosines are formed ahead by ``sincos_batch.h``."""
    storage = "" if rolled.workspace <= ON_STACK else "THREAD_LOCAL "
    if rolled.workspace:
        yield f"{storage}mech_real w[{rolled.workspace}];"
    copies = copies_of(rolled, sizes, ON_STACK - rolled.workspace)
    yield from copying(copies)
    text = _Loops(name, copies, turns)
    for counter in sorted(_numbered(rolled.items)):
        yield f"int n{counter} = 0;"
    yield from text.lines(rolled.items)


def touched(items: Sequence[Item]) -> set[str]:
    """Return the arrays that are read or written."""
    found: set[str] = set()
    for item in items:
        if isinstance(item, Loop):
            found |= touched(item.body)
            continue
        found |= {o.array for o in operands_of(item) if isinstance(o, Read)}
        if isinstance(item, Put):
            found |= {item.array, "set"} if item.guarded else {item.array}
    return found


def needs_threads(rolled: Rolled) -> bool:
    """Whether a workspace is too large for the stack: each thread has one of its own."""
    return rolled.workspace > ON_STACK


def _numbered(items: Sequence[Item]) -> Iterator[int]:
    for item in items:
        if type(item) is Loop:
            if item.numbered:
                yield item.counter
            yield from _numbered(item.body)


def _numbers(name: str) -> str:
    return f"{name}_{NUMBERS}"


def _table(name: str, number: int) -> str:
    return f"{name}_at_{number}"


class _Loops:
    def __init__(self, name: str, copies: Mapping[Way, Copy], turns: bool) -> None:
        self.name = name
        self.turns = turns
        self.copies = copies
        self.conditions: set[int] = set()
        """Numbers of values that are truth values."""
        self.gathered: dict[Operand, str] = {}
        """What blocks have gathered, and where it lies."""
        self.held: dict[tuple[int, int], str] = {}
        """Entries of tables (which, counted by which loop) that a block reads once."""

    def lines(self, items: Sequence[Item]) -> Iterator[str]:
        for item in items:
            match item:
                case Compute():
                    yield from self.compute(item)
                case Put(array, index, operand, guarded):
                    value = fitting(self.text(operand), 0, False, DIALECT)
                    if array == "p" or array == "out":
                        at = self.index(index)
                        guard = f"if (!set[{at}]) " if guarded else ""
                        yield f"{guard}{array}[{at}] = {value};"
                    else:
                        yield f"{array}[{self.index(index)}] = {value};"
                case Loop():
                    yield from self.loop(item)

    def compute(self, item: Compute, operands: list[Text] | None = None) -> Iterator[str]:
        if operands is None:
            operands = [self.text(operand) for operand in item.operands]
        if type(item.statement) is Operate:
            second = len(operands) == 2 and type(item.operands[1]) is LoopNumber
            value = applied(item.statement.code, operands, second, DIALECT)
        else:
            assert type(item.statement) is Lookup
            at = fitting(operands[0], 0, False, DIALECT)
            value = Text(DIALECT.lookup(item.statement.table, item.statement.order, at), ATOM)
        if value.condition:
            self.conditions.add(item.number)
        yield DIALECT.declare(f"v{item.number}", value.text, value.condition)
        named = Text(f"v{item.number}", ATOM, value.condition)
        if item.kept:
            yield f"s{item.number} = {named.text};"
        if item.place is not None:
            yield f"w[{self.index(item.place)}] = {fitting(named, 0, False, DIALECT)};"

    def loop(self, item: Loop) -> Iterator[str]:
        if in_blocks(item):
            yield from self.blocks(item)
            return
        i, trips = f"i{item.counter}", self.index(item.trips)
        for number, place in item.kept:
            yield f"mech_real s{number} = w[{self.index(place)}];"
        for carry in item.carried:
            yield f"mech_real before{carry.number} = w[{self.index(carry.first)}];"
        first = ahead(item) if self.turns else None
        if first is None:
            yield f"for (int {i} = 0; {i} < {trips}; {i}++) {{"
            yield from (f"    {line}" for line in (*self.lines(item.body), *self.carry(item.carried)))
            yield "}"
        else:
            yield from self.turned(item, first)
        for number, place in item.kept:
            yield f"w[{self.index(place)}] = s{number};"
        for carry in item.carried:
            if carry.last is not None:
                yield f"w[{self.index(carry.last)}] = before{carry.number};"
        if item.numbered:
            yield f"n{item.counter} += {trips};"

    def carry(self, carried: Iterable[Carry]) -> Iterator[str]:
        for carry in carried:
            source = Text(f"v{carry.source}", ATOM, carry.source in self.conditions)
            yield f"before{carry.number} = {fitting(source, 0, False, DIALECT)};"

    def turned(self, item: Loop, first: Ahead) -> Iterator[str]:
        """Yield a loop in blocks of iterations, whose angles are formed before their sines and cosines, and these before the
        rest."""
        c, trips = item.counter, self.index(item.trips)
        at = f"[i{c} - b{c}]"
        arrays = {angle: [f"{name}{c}_{k}" for name in TURN] for k, angle in enumerate(first.angles)}
        formed = {number: f"a{number}" if number in first.needed else "" for number in first.statements}
        head = f"    for (int i{c} = b{c}; i{c} < e{c}; i{c}++) {{"
        yield f"for (int b{c} = 0; b{c} < {trips}; b{c} += {BLOCK}) {{"
        yield f"    const int e{c} = b{c} + {BLOCK} < {trips} ? b{c} + {BLOCK} : {trips};"
        for number in sorted(first.needed):
            yield f"    mech_real a{number}[{BLOCK}];"
        for names in arrays.values():
            yield f"    mech_real {', '.join(f'{name}[{BLOCK}]' for name in names)};"
        yield head
        for one in item.body:
            if isinstance(one, Compute) and one.number in first.statements:
                yield from (f"        {line}" for line in self.compute(replace(one, place=None)))
                if one.number in first.needed:
                    yield f"        a{one.number}{at} = v{one.number};"
        for angle, (name, *_) in arrays.items():
            yield f"        {name}{at} = {fitting(self.text(angle), 0, False, DIALECT)};"
        carried = [carry for carry in item.carried if carry.number in first.carried]
        yield from (f"        {line}" for line in self.carry(carried))
        yield "    }"
        for names in arrays.values():
            yield f"    mech_turn_row(e{c} - b{c}, {', '.join(names)});"
        yield head
        for one in item.body:
            if isinstance(one, Compute) and (is_turn(one) or one.number in formed):
                name = arrays[one.operands[0]][1 + is_cosine(one)] if is_turn(one) else formed[one.number]
                if name:
                    yield f"        const mech_real v{one.number} = {name}{at};"
                if one.place is not None:
                    yield f"        w[{self.index(one.place)}] = v{one.number};"
            else:
                yield from (f"        {line}" for line in self.lines([one]))
        carried = [carry for carry in item.carried if carry.number not in first.carried]
        yield from (f"        {line}" for line in self.carry(carried))
        yield "    }"
        yield "}"

    def blocks(self, item: Loop) -> Iterator[str]:
        """Yield a loop whose iterations compilers do side by side, some at a time: what lies scattered is gathered before, what
        is added to numbers in registers is added afterwards, in order; in parts where the order of sums does not matter."""
        c, trips = item.counter, self.index(item.trips)
        gathered: dict[Operand, str] = {}
        addends: list[str] = []
        inside: list[str] = []
        at_once: list[str] = []
        yield from self.held_in(item)
        for one in item.body:
            if isinstance(one, Compute):
                operands = tuple([self.staged(o, c, gathered) for o in one.operands])
                if one.kept:
                    (k,) = (k for k, o in enumerate(one.operands) if type(o) is LoopRegister)
                    addend = self.shown(operands[1 - k])
                    addends.append(f"a{one.number}")
                    inside.append(f"a{one.number}[i{c} - b{c}] = {addend.text};")
                    at_once.append(self.added(one, addend))
                    continue
                lines = [*self.compute(one, [self.shown(o) for o in operands])]
            else:
                assert isinstance(one, Put)
                value = fitting(self.shown(self.staged(one.operand, c, gathered)), 0, False, DIALECT)
                lines = [f"{one.array}[{self.index(one.index)}] = {value};"]
            inside += lines
            at_once += lines
        for number, place in item.kept:
            yield f"mech_real s{number} = w[{self.index(place)}];"
        in_parts = f"#pragma omp simd reduction(+:{','.join(f's{n}' for n, _ in item.kept)})"
        whole = are_sums(item) and not gathered
        if whole:
            yield "#ifdef MECH_UNORDERED"
            yield in_parts
            yield f"for (int i{c} = 0; i{c} < {trips}; i{c}++) {{"
            yield from (f"    {line}" for line in at_once)
            yield "}"
            yield "#else"
        yield f"for (int b{c} = 0; b{c} < {trips}; b{c} += {BLOCK}) {{"
        yield f"    const int e{c} = b{c} + {BLOCK} < {trips} ? b{c} + {BLOCK} : {trips};"
        if scattered := [*gathered.values(), *addends]:
            yield f"    mech_real {', '.join(f'{name}[{BLOCK}]' for name in scattered)};"
        head = f"    for (int i{c} = b{c}; i{c} < e{c}; i{c}++) {{"
        if gathered:
            yield head
            for operand, name in gathered.items():
                yield f"        {name}[i{c} - b{c}] = {self.text(operand).text};"
            yield "    }"
        yield "    APART"
        yield head
        yield from (f"        {line}" for line in inside)
        yield "    }"
        if addends:
            if are_sums(item) and not whole:
                yield from ("#ifdef MECH_UNORDERED", f"    {in_parts}", "#endif")
            yield head
            for one in item.body:
                if isinstance(one, Compute) and one.kept:
                    yield f"        {self.added(one, Text(f'a{one.number}[i{c} - b{c}]', ATOM))}"
            yield "    }"
        yield "}"
        if whole:
            yield "#endif"
        for number, place in item.kept:
            yield f"w[{self.index(place)}] = s{number};"
        self.held = {}
        if item.numbered:
            yield f"n{c} += {trips};"

    def held_in(self, item: Loop) -> Iterator[str]:
        """Yield the entries of tables that are the same in all iterations of a block."""
        self.held = {}
        for one in item.body:
            assert not isinstance(one, Loop)
            found = [o.index for o in operands_of(one) if type(o) is Read]
            found += [place for place in (one.place if isinstance(one, Compute) else one.index,) if place]
            for index in found:
                key = (index.table, index.numbered)
                if index.table >= 0 and index.numbered != item.counter and key not in self.held:
                    name = f"q{item.counter}_{len(self.held)}"
                    yield f"const int {name} = {self.entry(index)};"
                    self.held[key] = name

    def added(self, one: Compute, addend: Text) -> str:
        """Return the statement that adds to a number in a register."""
        assert isinstance(one.statement, Operate)
        parts = [addend, Text(f"s{one.number}", ATOM)]
        first = 1 if type(one.operands[0]) is LoopRegister else 0
        added = applied(one.statement.code, [parts[first], parts[1 - first]], False, DIALECT)
        return f"s{one.number} = {added.text};"

    def staged(self, operand: Operand, counter: int, gathered: dict[Operand, str]) -> Operand:
        """Note what a block reads from places that are not side by side, of arrays that nobody writes."""
        if isinstance(operand, Read) and operand.array in ("y", "u", "z", "p"):
            index = operand.index
            way = way_of(operand, counter)
            if way is not None and way in self.copies:
                self.gathered[operand] = f"{self.copies[way].name}[i{counter}]"
                return operand
            stride = dict(index.strides).get(counter, 0)
            if abs(stride) > 1 or index.numbered == counter:
                gathered.setdefault(operand, f"r{counter}_{len(gathered)}")
                self.gathered[operand] = f"{gathered[operand]}[i{counter} - b{counter}]"
        return operand

    def shown(self, operand: Operand) -> Text:
        """Return an operand in a block, where it may have been gathered."""
        name = self.gathered.get(operand)
        return self.text(operand) if name is None else Text(name, ATOM)

    def text(self, operand: Operand) -> Text:
        match operand:
            case Read("t", _):
                return Text("t", ATOM)
            case Read("numbers", index):
                return Text(f"{_numbers(self.name)}[{self.index(index)}]", ATOM)
            case Read(array, index):
                return Text(f"{array}[{self.index(index)}]", ATOM)
            case Local(number):
                return Text(f"v{number}", ATOM, number in self.conditions)
            case LoopRegister(number):
                return Text(f"s{number}", ATOM)
            case Carried(number):
                return Text(f"before{number}", ATOM)
            case LoopNumber(value):
                return Text(*DIALECT.literal(value))

    def index(self, index: Index) -> str:
        parts = []
        if index.table >= 0:
            parts.append(self.held.get((index.table, index.numbered)) or self.entry(index))
        if index.base or not (parts or index.strides):
            parts.append(str(index.base))
        text = " + ".join(parts)
        for counter, stride in index.strides:
            term = f"i{counter}" if abs(stride) == 1 else f"{abs(stride)} * i{counter}"
            if stride < 0:
                text = f"{text} - {term}" if text else f"-{term}"
            else:
                text = f"{text} + {term}" if text else term
        return text

    def entry(self, index: Index) -> str:
        """Return the entry of its table that an index reads."""
        return f"{_table(self.name, index.table)}[n{index.numbered} + i{index.numbered}]"
