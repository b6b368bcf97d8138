"""Files need each other one way only: what imports what, imports for types and inside functions counted too."""

from __future__ import annotations

import ast
from collections.abc import Iterator, Mapping
from functools import cache
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
TOPS = ("lang", "compiler", "runtime", "stdlib")
BIG = {"mechc.lang", "mechc.compiler", "mechc.runtime", "mechc.compiler.flat", "mechc.compiler.mechanics"}
BIG |= {"mechc.compiler.equations", "mechc.compiler.graph", "mechc.compiler.targets", "mechc"}
"""Folders that have rooms: what lies in them directly is a room of its own."""

Arrows = Mapping[str, frozenset[str]]


@cache
def modules() -> Mapping[str, Path]:
    """Every module of the product by its dotted name, those seen through the links in ``mechc`` once."""
    found: dict[str, Path] = {}
    for top in (*TOPS, "mechc"):
        for path in sorted((ROOT / top).rglob("*.py")):
            parts = path.relative_to(ROOT).with_suffix("").parts
            if parts[0] == "mechc" and len(parts) > 1 and parts[1] in TOPS:
                continue
            name = ".".join(parts if parts[0] == "mechc" else ("mechc", *parts))
            found[name.removesuffix(".__init__")] = path
    return found


def imported(name: str, path: Path, known: Mapping[str, Path]) -> Iterator[str]:
    """Every module that a file imports, wherever in the file it says so."""
    package = name if path.name == "__init__.py" else name.rpartition(".")[0]
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names if alias.name in known)
        elif isinstance(node, ast.ImportFrom):
            base = package.split(".")[: len(package.split(".")) - node.level + 1] if node.level else []
            source = ".".join([*base, *([node.module] if node.module else [])])
            for alias in node.names:
                inner = f"{source}.{alias.name}"
                if inner in known:
                    yield inner
                elif source in known:
                    yield source


@cache
def arrows() -> Arrows:
    known = modules()
    return {name: frozenset(imported(name, path, known)) - {name} for name, path in known.items()}


def circles(graph: Arrows) -> list[frozenset[str]]:
    """Strongly connected parts of more than one node (Tarjan 1972, by two searches: Kosaraju)."""
    order: list[str] = []
    seen: set[str] = set()
    for root in graph:
        stack: list[tuple[str, bool]] = [(root, False)]
        while stack:
            node, done = stack.pop()
            if done:
                order.append(node)
            elif node not in seen:
                seen.add(node)
                stack.append((node, True))
                stack.extend((other, False) for other in sorted(graph[node]))
    back: dict[str, set[str]] = {node: set() for node in graph}
    for node, others in graph.items():
        for other in others:
            back[other].add(node)
    found, placed = [], set[str]()
    for root in reversed(order):
        part, pending = set[str](), [root]
        while pending:
            node = pending.pop()
            if node not in placed:
                placed.add(node)
                part.add(node)
                pending.extend(back[node])
        if len(part) > 1:
            found.append(frozenset(part))
    return found


def room(name: str, known: Mapping[str, Path]) -> str:
    """The folder of a file, or the file itself where it lies in a folder that has rooms."""
    package = name if known[name].name == "__init__.py" else name.rpartition(".")[0]
    return name if package in BIG else package


def test_a_circle_is_found() -> None:
    graph = {"a": frozenset("b"), "b": frozenset("c"), "c": frozenset("a"), "d": frozenset("a")}
    assert circles(graph) == [frozenset("abc")]


def test_no_circle_of_more_than_two_files() -> None:
    assert [sorted(part) for part in circles(arrows()) if len(part) > 2] == []


def test_no_circle_between_files_of_different_rooms() -> None:
    known = modules()
    mixed = [sorted(part) for part in circles(arrows()) if len({room(name, known) for name in part}) > 1]
    assert mixed == []


def test_arrows_between_rooms_go_one_way() -> None:
    known, graph = modules(), arrows()
    between: dict[str, set[str]] = {room(name, known): set() for name in graph}
    for name, others in graph.items():
        here = room(name, known)
        between[here] |= {room(other, known) for other in others} - {here}
    assert [sorted(part) for part in circles({k: frozenset(v) for k, v in between.items()})] == []
