"""Find what depends on parameters only, so that it is computed once for each run."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping

from ..equations.model import Slot
from ..graph import Graph, Node
from ..graph.operations import CONST, NEG, SELECT, SYMBOL


def hoistable(graph: Graph, layout: Mapping[Node, Slot], outputs: Iterable[Node]) -> list[Node]:
    """Return the operations on parameters and constants whose results enter anything else, ascending.

    A change of sign is not worth a number in memory: its argument is hoisted instead.
    """
    outputs = list(outputs)
    order = graph.reach(outputs)
    op, args = graph.op, graph.args
    codes, left, right = graph._code, graph._left, graph._right
    fixed = bytearray(order[-1] + 1) if order else bytearray()
    wanted: set[Node] = set()
    for n in order:
        code = codes[n]
        if code == CONST:
            fixed[n] = 1
        elif code == SYMBOL:
            fixed[n] = layout[n].array == "p"
        elif code != SELECT and (b := right[n]) >= 0:
            a = left[n]
            if fixed[a]:
                if fixed[b]:
                    fixed[n] = 1
                else:
                    wanted.add(a)
            elif fixed[b]:
                wanted.add(b)
        else:
            operands = args(n)
            constant = [a for a in operands if fixed[a]]
            if len(constant) == len(operands):
                fixed[n] = 1
            elif constant:
                wanted.update(constant)
    wanted.update(n for n in outputs if fixed[n])
    found = {args(n)[0] if op(n) == NEG else n for n in wanted}
    return sorted(n for n in found if op(n) > SYMBOL)


def rule_order(graph: Graph, layout: Mapping[Node, Slot], rules: Mapping[int, Node]) -> list[int]:
    """Return the indices of the parameters so that each comes after those it depends on.

    Raises ValueError where a rule reads anything but parameters, or parameters depend on each other in a
    circle: earlier stages report both.
    """
    reads: dict[int, list[int]] = {}
    for index, value in rules.items():
        slots = [layout[s] for s in graph.support(value)]
        if any(slot.array != "p" for slot in slots):
            raise ValueError(f"the rule of parameter {index} reads more than parameters")
        reads[index] = [slot.index for slot in slots if slot.index in rules]
    return _topological(reads)


def _topological(reads: Mapping[int, Collection[int]]) -> list[int]:
    done: set[int] = set()
    order: list[int] = []
    for start in sorted(reads):
        path = [start]
        entered: set[int] = set()
        while path:
            index = path[-1]
            if index in done:
                path.pop()
                continue
            waiting = [i for i in reads[index] if i not in done]
            if not waiting:
                done.add(index)
                order.append(index)
            elif index in entered:
                raise ValueError(f"parameter {index} depends on itself")
            else:
                entered.add(index)
                path += waiting
    return order
