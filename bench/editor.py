"""What an editor waits for: processor time of messages after a keystroke, and of hover and completion meanwhile."""

from __future__ import annotations

import gc
import tempfile
import threading
import time
from collections.abc import Callable
from pathlib import Path

from mechc.editor.completion import completions
from mechc.editor.document import Document
from mechc.editor.hover import hover
from mechc.editor.models import read

from .machine import table, write

GOALS = {500: 150, 5000: 1000}
"""Milliseconds after a keystroke, by lines."""
ANSWER = 50
"""Milliseconds of an answer."""


def chain(lines: int) -> str:
    """Write a model of bars one after another, all of it one model: each bar has five lines."""
    bars = (lines - 8) // 5
    text = ["import mech.planar.*;", 'model Long "a chain"', "  parameter Length l = 0.1 m;"]
    text += ["  parameter Mass m = 0.2 kg;", "  gravity {0, -9.81} m/s^2;"]
    for k in range(bars):
        before = f"bar{k - 1}.b" if k else "world"
        text += [
            f'  parameter Mass m{k} = {1 + k % 7} kg "of bar {k}";',
            f"  Bar bar{k}(m = m{k}, l = l);",
            f"  Revolute pin{k}({before} -> bar{k}.a, angle = {k % 50} deg);",
            f"  damping 0.1 N.m.s/rad on pin{k}.angle;",
            f"  output e{k} = 1/2*m{k}*l^2*der(pin{k}.angle)^2 + m*l*9.81 m/s^2*sin(pin{k}.angle);",
        ]
    return "\n".join([*text, "  experiment(stop = 5 s);", "end Long;", ""])


def many(lines: int) -> str:
    """Write a file of many spatial models of 25 lines each."""
    text = ["import mech.spatial.*;"]
    for k in range(lines // 25):
        text += [f"model Part{k}", f"  parameter Length l = {1 + k % 3} m;", "  gravity {0, 0, -9.81} m/s^2;"]
        text += ["  Body one(m = 2 kg);", "  Body two(m = 3 kg);"]
        text += ["  Revolute a(world -> one.a, axis = {0, 1, 0}, angle = 20 deg);"]
        text += ["  Revolute b(one.a * trans({l, 0, 0}) -> two.a, axis = {1, 0, 0});"]
        text += [f"  output o{j} = pos(two.a)[{1 + j % 3}] + l*sin(a.angle)*{j + 1};" for j in range(15)]
        text += ["  experiment(stop = 1 s);", f"end Part{k};", ""]
    return "\n".join(text) + "\n"


def keystrokes(text: str, count: int) -> list[float]:
    """Processor time of reading a text and looking at it after each of some keystrokes in a number."""
    document = Document(Path(tempfile.gettempdir()) / "long.mech", text)
    document.at_once()
    at = (
        text.index(" l = ", len(text) // 2)
        if " l = " in text[len(text) // 2 :]
        else text.index("sin", len(text) // 2)
    )
    at = text.index(";", at)
    taken = []
    for k in range(count):
        gc.collect()  # the server looks for garbage at idle moments
        new = text[:at] + f" // {k}\n " + text[at:] if k % 2 else text[:at] + " " * (k + 1) + text[at:]
        begun = time.process_time()
        document.change(new)
        document.at_once()
        taken.append(1e3 * (time.process_time() - begun))
    return taken


def answers(text: str, count: int, *, busy: bool) -> dict[str, list[float]]:
    """Processor time of the thread that answers; ``busy``: while another one reads and looks at the text."""
    document = Document(Path(tempfile.gettempdir()) / "long.mech", text)
    document.at_once()
    done = threading.Event()

    def look() -> None:
        while not done.is_set():
            document.look(read(document.source))

    thread = threading.Thread(target=look)
    if busy:
        thread.start()
    places = [text.index("\n", len(text) * k // (count + 1)) - 5 for k in range(1, count + 1)]
    taken: dict[str, list[float]] = {}
    asked: dict[str, Callable[[Document, int], object]] = {"hover": hover, "completion": completions}
    try:
        for name, ask in asked.items():
            taken[name] = []
            for place in places:
                begun = time.thread_time()
                ask(document, place)
                taken[name].append(1e3 * (time.thread_time() - begun))
    finally:
        done.set()
        if busy:
            thread.join()
    return taken


def row(what: str, taken: list[float], goal: int) -> list[str]:
    """Return a row of the table: the middle, 95 of 100, the longest."""
    ordered = sorted(taken)
    shown = (
        ordered[len(ordered) // 2],
        ordered[min(len(ordered) - 1, len(ordered) * 95 // 100)],
        ordered[-1],
    )
    return [what, *(f"{t:.1f}" for t in shown), str(goal)]


def main(quick: bool = False) -> None:
    count = 10 if quick else 30
    rows = []
    gc.disable()  # as the server does
    for lines, goal in GOALS.items():
        for name, text in (("one model", chain(lines)), ("models of 25 lines", many(lines))):
            rows.append(row(f"messages, {lines} lines, {name}", keystrokes(text, count), goal))
    for lines in GOALS:
        for busy in (False, True):
            for name, taken in answers(chain(lines), 5 * count, busy=busy).items():
                while_ = ", while messages are made" if busy else ""
                rows.append(row(f"{name}, {lines} lines{while_}", taken, ANSWER))
    gc.enable()
    text = (
        "Milliseconds of processor time: from a keystroke in the middle of a text to the messages about text, names, types and "
        "units, and of an answer. What the whole compiler says follows when nothing has changed for a moment, from a process of "
        "its own."
    )
    head = ["what", "median, ms", "95 of 100, ms", "longest, ms", "goal, ms"]
    write("editor", "Editors", [text, table(head, rows)])
