"""Models, motions and answers as notebooks show them: text for every place, HTML with formulas, LaTeX, pictures."""

from __future__ import annotations

import base64
from collections.abc import Iterable, Mapping, Sequence
from html import escape
from io import BytesIO
from typing import TYPE_CHECKING, Any

from ..compiler.graph.evaluate import evaluate
from ..compiler.symbolic.layouts import equations_html, write_equations
from ..display import Display, factor
from . import answers, plots
from .numbers import number

if TYPE_CHECKING:
    from mechc.runtime.interface import Quantity

    from ..model import CompiledModel
    from ..runtime.studies.findings import Findings
    from ..solution import Solution

Bundle = dict[str, Any]
"""What is shown by MIME type."""


def model_bundle(model: CompiledModel) -> Bundle:
    """Show a model: what it is called and does, its quantities with units and values, its equations."""
    equations = model.compilation.equations
    tables = [
        _table("parameters", equations.parameters, parameter_values(model)),
        _table("coordinates", [e for e in equations.states if e.kind == "coordinate"]),
        _table("states", [e for e in equations.states if e.kind == "state"]),
        _table("inputs", equations.inputs),
        _table("outputs", [e for e in equations.outputs if e.kind == "output"]),
    ]
    system = model.compilation.system
    head = f"<h3>{escape(model.name)}</h3>" + (f"<p>{escape(model.doc)}</p>" if model.doc else "")
    return {
        "text/plain": repr(model),
        "text/html": f"<div>{head}{''.join(tables)}{equations_html(system)}</div>",
        "text/latex": write_equations(system, "latex"),
    }


def parameter_values(model: CompiledModel) -> dict[str, float]:
    """Return the values of the parameters in SI: those that were set, else the model's own."""
    equations = model.compilation.equations
    graph, names = equations.graph, [entry.name for entry in equations.parameters]
    nodes = {slot.index: node for node, slot in equations.layout.items() if slot.array == "p"}
    settings = model.settings
    known: dict[Any, float] = {
        nodes[k]: settings[n] for k, n in enumerate(names) if n in settings and k in nodes
    }
    values = {n: settings[n] for n in names if n in settings}
    for rule in equations.parameter_rules:
        name = names[rule.index]
        if name in values:
            continue
        if all(n in known for n in graph.support(rule.value)):
            (value,) = evaluate(graph, [rule.value], known)
            values[name] = float(value)
            if rule.index in nodes:
                known[nodes[rule.index]] = values[name]
    return values


def solution_bundle(solution: Solution) -> Bundle:
    """Show a motion: its report, and its picture."""
    text = str(solution)
    return {
        "text/plain": text,
        "text/html": f"<div>{_picture(plots.figure(solution))}{_preformatted(text)}</div>",
    }


def findings_bundle(found: Findings) -> Bundle:
    """Show the answer to a study: what it found, and its picture if it has one."""
    text = answers.text(found)
    picture = _picture(answers.figure(found)) if found.panels else ""
    return {"text/plain": text, "text/html": f"<div>{picture}{_preformatted(text)}</div>"}


def _preformatted(text: str) -> str:
    return f'<pre style="font-family: monospace; line-height: 1.2">{escape(text)}</pre>'


def _picture(figure: Any) -> str:
    file = BytesIO()
    figure.savefig(file, format="png", metadata={"Software": None})
    return f'<img src="data:image/png;base64,{base64.b64encode(file.getvalue()).decode()}">'


def _table(title: str, entries: Iterable[Quantity], values: Mapping[str, float] | None = None) -> str:
    """Return an HTML table of quantities: name, value where there is one, unit, description; empty if there are none."""
    rows = [_row(entry, values) for entry in entries]
    if not rows:
        return ""
    head = [title, *["value"] * (values is not None), "unit", ""]
    lines = [_cells(head, "th"), *(_cells(row, "td") for row in rows)]
    return f"<table>{''.join(f'<tr>{line}</tr>' for line in lines)}</table>"


def _row(entry: Quantity, values: Mapping[str, float] | None) -> list[str]:
    unit = Display().unit(entry.unit, entry.display)
    row = [entry.name]
    if values is not None:
        value = values.get(entry.name)
        row.append("" if value is None else number(value * factor(entry.unit) / factor(unit)))
    return [*row, unit, entry.doc]


def _cells(texts: Sequence[str], tag: str) -> str:
    return "".join(f'<{tag} style="text-align: left">{escape(text)}</{tag}>' for text in texts)
