"""Rules of the standard for the structure of a model: outputs, derivatives, initial unknowns."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator
from xml.etree.ElementTree import Element

from .read_description import Described, Finding


def structure_findings(root: Element, variables: list[Described], version: int) -> Iterator[Finding]:
    """Yield what is wrong with the lists of outputs, derivatives and initial unknowns."""
    by_key = {v.key: v for v in variables}
    titles = (
        ("Outputs/Unknown", "Derivatives/Unknown", "InitialUnknowns/Unknown")
        if version == 2
        else ("Output", "ContinuousStateDerivative", "InitialUnknown")
    )
    key = "index" if version == 2 else "valueReference"
    outputs, derivatives, unknowns = (
        [e.get(key, "") for e in root.findall(f"ModelStructure/{title}")] for title in titles
    )
    for keys, title in ((outputs, "outputs"), (derivatives, "derivatives"), (unknowns, "initial unknowns")):
        for k, count in Counter(keys).items():
            if count > 1:
                yield Finding(f"duplicate in {title}", f"the {title} name variable {k} {count} times")
            if k not in by_key:
                yield Finding(f"unknown in {title}", f"the {title} name variable {k}, which does not exist")
    wanted = {v.key for v in variables if v.causality == "output"}
    yield from _compare(by_key, set(outputs), wanted, "outputs")
    states: set[str] = set()
    for k in derivatives:
        if k in by_key:
            of = by_key[k].derivative
            if of is None:
                yield Finding("no derivative", f"'{by_key[k].name}' is listed as a derivative and is none")
            else:
                states.add(of)
    for v in variables:
        if v.derivative is None:
            continue
        state = by_key.get(v.derivative)
        if state is None:
            text = f"'{v.name}' is the derivative of variable {v.derivative}, which does not exist"
            yield Finding("derivative of", text)
        elif (
            state.key == v.key
            or state.variability != "continuous"
            or state.causality not in ("local", "output")
        ):
            yield Finding(
                "derivative of", f"'{v.name}' is the derivative of '{state.name}', which is not a state"
            )
    if len(states) < len([k for k in derivatives if k in by_key and by_key[k].derivative is not None]):
        yield Finding("derivative of", "two derivatives belong to one state")
    for k in derivatives:
        yield from _rate_name(by_key, k)
    involved = set(outputs) | set(derivatives) | states
    initial = {
        v.key
        for v in variables
        if v.initial in ("calculated", "approx")
        and (v.causality in ("output", "calculatedParameter") or v.key in involved)
    }
    ticking = {
        v.key for v in variables if v.type == "Clock" or v.clocked
    }  # these have no values before the first tick
    yield from _compare(by_key, set(unknowns) - ticking, initial - ticking, "initial unknowns")


def _rate_name(by_key: dict[str, Described], key: str) -> Iterator[Finding]:
    """A derivative named der(x) belongs to x."""
    v = by_key.get(key)
    state = by_key.get(v.derivative or "") if v else None
    if v is None or state is None:
        return
    found = re.fullmatch(r"der\((.*?)(?:,(\d+))?\)", v.name)
    if not found:
        return
    order = int(found[2] or 1)
    of = found[1] if order == 1 else f"der({found[1]})" if order == 2 else f"der({found[1]},{order - 1})"
    if state.name != of:
        yield Finding("derivative of", f"'{v.name}' is declared as the derivative of '{state.name}'")


def _compare(
    by_key: dict[str, Described], found: set[str], wanted: set[str], title: str
) -> Iterator[Finding]:
    for k in sorted(wanted - found):
        yield Finding(f"missing in {title}", f"'{by_key[k].name}' is missing from the {title}")
    for k in sorted(found - wanted):
        if k in by_key:
            yield Finding(f"superfluous in {title}", f"'{by_key[k].name}' does not belong to the {title}")
