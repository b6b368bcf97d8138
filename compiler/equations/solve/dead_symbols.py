"""Symbols that stand in a formula without changing its value.

Interning by value may represent a formula by an older node of equal value in which a symbol that has been eliminated
meanwhile still stands, though it cancels. Such functions are built again in a fresh graph, where nothing older is,
with the symbol put at zero. That it cancels is looked at, with another number in its place: a symbol that matters was
forgotten, and must never count as zero.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from fractions import Fraction
from itertools import islice
from random import Random

from msgspec.structs import replace

from ...graph import Graph, Node
from ...graph.evaluate import Tape, multiprecision
from ...graph.rewrite import transfer
from ...mechanics.meaning.questions import PREFIX
from ..model import Equations, Function

ELSEWHERE = Fraction(1_299_709, 1_299_721)
"""Put instead of symbols that should not matter, once: no formula has such a number by itself."""


DIGITS, SMALL, STATES = 60, Fraction(1, 10**40), 12


def _equal(graph: Graph, pairs: Sequence[tuple[Node, Node]]) -> bool:
    """Tell by their numbers at a few states whether formulas are equal, which may be written in two ways: the root of a sum of
    squares as one, or as a number."""
    from mpmath import mp

    given = [n for pair in pairs for n in pair]
    symbols = graph.support(*given)
    random, decided = Random(7), dict.fromkeys(pairs, False)
    with mp.workdps(DIGITS):
        tape = Tape(graph, given, symbols, multiprecision(mp))
        for _ in range(STATES):
            values = tape({s: mp.mpf(random.uniform(-1.5, 1.5)) for s in symbols})
            for a, b in pairs:
                x, y = values[a], values[b]
                if not (mp.isfinite(x) and mp.isfinite(y)):
                    continue
                if abs(x - y) * SMALL.denominator > 1 + abs(x):
                    return False
                decided[a, b] = True
    return all(decided.values())


def built_without(
    source: Graph, outputs: Sequence[Node], dead: Sequence[Node]
) -> tuple[Graph, list[Node]] | None:
    """Build formulas again in a fresh graph without symbols that cancel; None where their values depend on one."""
    target, images, apart = _built_again(source, outputs, dead)
    return None if apart and not _equal(target, apart) else (target, images)


def _built_again(
    source: Graph, outputs: Sequence[Node], dead: Sequence[Node]
) -> tuple[Graph, list[Node], list[tuple[Node, Node]]]:
    """Return a fresh graph, the formulas in it with zero for the symbols, and those that are other nodes with another number."""
    target = Graph(by_value=source.by_value)
    for table in source.tables:
        target.add_table(table)
    images = transfer(source, outputs, target, dict.fromkeys(dead, target.zero))
    others = transfer(source, outputs, target, dict.fromkeys(dead, target.constant(ELSEWHERE)))
    return target, images, [pair for pair in zip(images, others, strict=True) if not target.identical(*pair)]


def without_dead_symbols(equations: Equations) -> Equations:
    """Return equations whose functions contain no symbols but those that have a place at run time."""
    source = equations.graph
    outputs = [n for f in equations.functions for n in f.outputs]
    outputs += [rule.value for rule in equations.parameter_rules]
    dead = [n for n in source.support(*outputs) if n not in equations.layout]
    if not dead:
        return equations
    target, images, apart = _built_again(source, outputs, dead)
    # without identities of values only symbols that cancel term by term are gone
    forgotten = dead if source.by_value else [n for n in dead if source.name(n).startswith(PREFIX)]
    if forgotten and apart and not _equal(target, apart):
        from ...malformed import Malformed

        names = ", ".join(source.name(n) for n in forgotten)
        raise Malformed(
            "equations", f"the values of functions depend on {names}, without a place at run time"
        )
    found: Iterator[Node] = iter(images)
    functions = tuple(
        Function(f.name, f.doc, tuple(islice(found, len(f.outputs)))) for f in equations.functions
    )
    rules = tuple(replace(rule, value=next(found)) for rule in equations.parameter_rules)
    layout = {target.symbol(source.name(n)): slot for n, slot in equations.layout.items()}
    return replace(equations, graph=target, layout=layout, functions=functions, parameter_rules=rules)
