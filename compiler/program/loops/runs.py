"""Periodic runs in a sequence of tokens: what follows itself at least some times becomes one item, then nests are found.

A period is the distance of equal windows; a run goes on as long as each token is that of one period before.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

LEVELS = ((24, 6, 40), (6, 4, 40), (4, 4, 40))
"""Tokens in a window, least repeats, least statements of a run; the next level sees runs as single tokens."""


class IterationRun:
    """Iterations of equal shape: each a list of items; ``size`` statements in all."""

    __slots__ = ("iterations", "size")

    def __init__(self, iterations: list[Sequence[Entry]], size: int) -> None:
        self.iterations = iterations
        self.size = size


Entry = int | IterationRun
"""A statement by its position, or a run."""


def runs(tokens: NDArray[np.int64], operands: NDArray[np.int64]) -> Sequence[Entry]:
    """Return the statements with runs put together."""
    items: Sequence[Entry] = range(len(tokens))
    sizes = np.ones(len(tokens), np.int64)
    for window, repeats, least in LEVELS:
        items, tokens, sizes = _level(items, tokens, sizes, operands, window, repeats, least)
    return items


def count_of_sites(entries: Sequence[Entry]) -> int:
    """Return how many statements the text with these runs as loops would have."""
    return sum(count_of_sites(entry.iterations[0]) if type(entry) is IterationRun else 1 for entry in entries)


def _level(
    items: Sequence[Entry],
    tokens: NDArray[np.int64],
    sizes: NDArray[np.int64],
    operands: NDArray[np.int64],
    window: int,
    repeats: int,
    least: int,
) -> tuple[Sequence[Entry], NDArray[np.int64], NDArray[np.int64]]:
    n = len(items)
    if n < 2 * window:
        return items, tokens, sizes
    weight = np.concatenate([[0], np.cumsum(sizes)])
    found = list(_periodic(tokens, window, repeats, least, weight))
    if not found:
        return items, tokens, sizes
    out: list[Entry] = []
    shapes: list[object] = []
    counts: list[NDArray[np.int64]] = []
    done = 0
    for start, end, period in found:
        first = start + _phase(items, operands, start, end, period)
        count = (end - first) // period
        if count < repeats:
            first, count = start, (end - start) // period
        out += items[done:first]
        shapes += tokens[done:first].tolist()
        counts += sizes[done:first], weight[[first + count * period]] - weight[first]
        done = first + count * period
        iterations = [items[k : k + period] for k in range(first, done, period)]
        out.append(IterationRun(iterations, int(weight[done] - weight[first])))
        shapes.append(tuple(tokens[first : first + period].tolist()))
    out += items[done:]
    shapes += tokens[done:].tolist()
    numbers: dict[object, int] = {}
    numbered = np.array([numbers.setdefault(shape, len(numbers)) for shape in shapes], np.int64)
    return out, numbered, np.concatenate([*counts, sizes[done:]])


def _periodic(
    tokens: NDArray[np.int64], window: int, repeats: int, least: int, weight: NDArray[np.int64]
) -> Iterator[tuple[int, int, int]]:
    """Yield begin, end and period of runs from left to right."""
    before = _equal_before(tokens, window)
    tried: dict[int, int] = {}
    done = skip = 0
    n = len(tokens)
    windows = np.flatnonzero(before >= 0).tolist()
    listed = tokens.tolist()
    at = 0
    while at < len(windows):
        j = windows[at]
        if j < skip:
            at = bisect_left(windows, skip, at)
            continue
        at += 1
        i = int(before[j])
        period = j - i
        last = i + repeats * period - 1
        if i < done or tried.get(period, -1) > j or last >= n or listed[last] != listed[last - period]:
            continue
        end = _end(tokens, i, period)
        tried[period] = end
        if end - i >= repeats * period and weight[end] - weight[i] >= least:
            yield i, end, period
            done = skip = end
            tried.clear()


def _end(tokens: NDArray[np.int64], begin: int, period: int) -> int:
    """Return how far each token from ``begin`` + period on is that of one period before."""
    size = 64
    while begin + period < len(tokens):
        after = tokens[begin + period : begin + period + size]
        other = after != tokens[begin : begin + len(after)]
        if other.any():
            return begin + int(other.argmax()) + period
        begin, size = begin + len(after), 4 * size
    return len(tokens)


def _equal_before(tokens: NDArray[np.int64], window: int) -> NDArray[np.int64]:
    """Return for each window the last one before it with the same tokens, -1 where there is none."""
    n = len(tokens) - window + 1
    code = np.zeros(n, np.uint64)
    letters = tokens.astype(np.uint64) + np.uint64(1)
    for k in range(window):
        code *= np.uint64(0x9E3779B97F4A7C15)
        code += letters[k : k + n]
        code ^= code >> np.uint64(29)
    order = np.argsort(code, kind="stable")
    same = code[order[1:]] == code[order[:-1]]
    before = np.full(n, -1)
    before[order[1:][same]] = order[:-1][same]
    return before


def _phase(items: Sequence[Entry], operands: NDArray[np.int64], start: int, end: int, period: int) -> int:
    """Return where to cut a run, from 0 to the period - 1: where the fewest values cross."""
    if period == 1:
        return 0
    middle = start + ((end - start) // period // 2) * period
    low, high = max(start, middle - period), min(end, middle + period)
    where = {s: q for q in range(low, high) for s in _statements(items[q])}
    last: dict[int, int] = {}
    for q, values in zip(where.values(), operands[list(where)].tolist(), strict=True):
        for value in values:
            made = where.get(value, q)
            if made < q < made + period:
                last[made] = max(last.get(made, 0), q)
    cost = [0] * period
    for made, q in last.items():
        for cut in range(made + 1, q + 1):
            cost[(cut - start) % period] += 1
    return min(range(period), key=lambda phase: (cost[phase], phase))


def _statements(item: Entry) -> Iterator[int]:
    if type(item) is IterationRun:
        for iteration in item.iterations:
            for inner in iteration:
                yield from _statements(inner)
    else:
        assert type(item) is int
        yield item
