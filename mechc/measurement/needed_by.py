"""The line of a model that needs what its equations hold: of several the first."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING

from ..compiler.flat.model import Kind, Role

if TYPE_CHECKING:
    from ..compiler.equations.model import Equations
    from ..compiler.flat.model import FlatModel, Origin

SWITCHES = re.compile(r"\b(if|when|contact|friction|abs|sign|min|max|floor|ceil|mod|clamp)\b")


def lines(flat: FlatModel) -> dict[str, str]:
    """Return for each fact of a model (``equations/needs.py``) the line that needs it, with its number, as far as one can be named."""
    found = {}
    for fact, origins in _statements(flat):
        first = next(iter(origins), None)
        if first is not None:
            found[fact] = told(first, flat)
    return found


def derived_lines(equations: Equations) -> dict[str, str]:
    """Return the same of what follows from the equations: assertions, and motions that move no mass."""
    rows = [(a.message, a.origin) for a in equations.assertions if a.origin is not None]
    weightless = [origin for message, origin in rows if "moves no mass" in message]
    found = {"assertions": [origin for _, origin in rows], "massless": weightless}
    return {fact: f"line {o.line}: {o.text.strip()}" for fact, origins in found.items() for o in origins[:1]}


def resting(flat: FlatModel) -> dict[str, str]:
    """Return for each part that may be built or not the line that decides, where one line does."""
    asked = [told(experiment.origin, flat) for experiment in flat.experiments]
    found = dict.fromkeys(("jacobian", "momenta", "series", "contact_steps"), asked)
    found["structure"] = [line for fact, line in lines(flat).items() if fact == "inertia"]
    found["constants"] = [told(v.origin, flat) for v in flat.variables if v.role is Role.PARAMETER]
    return {part: rows[0] for part, rows in found.items() if rows}


def line_of(flat: FlatModel, state: str) -> str | None:
    """Return the line that declares a state, or the coordinate whose rate it is."""
    name = re.split(r"[\[(]", state.removeprefix("der("))[0].rstrip(")")
    return next((told(v.origin, flat) for v in flat.variables if v.name.partition("[")[0] == name), None)


def told(origin: Origin, flat: FlatModel) -> str:
    """Say where a statement stands, and its first line: in the model, not inside a library; of another file also its name."""
    span, own = origin.shown, flat.origin.span.file
    number, _ = span.file.position(span.start)
    elsewhere = f" of {span.file.name}" if span.file != own else ""
    return f"line {number}{elsewhere}: {span.file.line(number).strip()}"


def extent(flat: FlatModel) -> str:
    """Say where the whole model stands: what it lacks is in none of its lines."""
    span = flat.origin.span
    (first, _), (last, _) = span.file.position(span.start), span.file.position(span.end)
    return f"lines {first} to {last}" if last > first else f"line {first}"


def _statements(flat: FlatModel) -> Iterator[tuple[str, Iterable[Origin]]]:
    """Yield the statements that may need each fact, the most telling ones first."""
    variables = {role: [v.origin for v in flat.variables if v.role is role] for role in Role}
    loads = [load.origin for load in flat.loads]
    drives = [drive.origin for drive in flat.drives]
    rubbing = [friction.origin for friction in flat.frictions]
    resisting = [*(damping.origin for damping in flat.dampings), *rubbing]
    resisting += [e.origin for e in flat.energies if e.kind == "dissipation"]
    hitting = [*(contact.origin for contact in flat.contacts), *rubbing]
    joints = [joint.origin for joint in flat.joints]
    closing = [o for o in joints if o.shown.text.startswith("cut")] or joints[::-1]
    happening = [event.origin for event in flat.events]
    every = [
        *(d.origin for d in flat.definitions),
        *(e.origin for e in flat.energies),
        *(m.origin for m in flat.masses),
        *(i.origin for i in flat.inertias),
        *(damping.origin for damping in flat.dampings),
        *loads,
        *drives,
        *(c.origin for c in flat.constraints),
        *(e.origin for e in flat.equations),
        *hitting,
        *happening,
        *variables[Role.INPUT],
    ]

    def saying(words: re.Pattern[str]) -> list[Origin]:
        return [o for o in every if words.search(o.shown.text) or words.search(o.span.text)]

    yield "space", [*joints, *(m.origin for m in flat.masses), *variables[Role.COORDINATE]]
    yield (
        "inertia",
        [
            *(e.origin for e in flat.energies if e.kind in ("kinetic", "lagrangian")),
            *(m.origin for m in flat.masses),
            *(i.origin for i in flat.inertias),
        ],
    )
    yield "coordinates", variables[Role.COORDINATE]
    yield "rotations", [*(v.origin for v in flat.variables if v.type.kind is Kind.ROTATION), *joints]
    yield "constraints", [*(c.origin for c in flat.constraints), *closing, *hitting]
    yield "events", [*happening, *hitting, *saying(SWITCHES)]
    yield "delays", saying(re.compile(r"\bdelay\b"))
    yield "modes", [*hitting, *(c.origin for c in flat.constraints)]
    yield "inputs", variables[Role.INPUT]
    yield "tables", saying(re.compile(r"\btable\b"))
    yield "discrete", [*variables[Role.DISCRETE], *happening, *hitting, *saying(SWITCHES)]
    yield (
        "time",
        [
            *saying(re.compile(rf"\b{re.escape(flat.independent or 'time')}\b")),
            *saying(re.compile(r"\btime\b")),
        ],
    )
    yield "drives", drives
    yield "gravity", [m.origin for m in flat.masses if m.gravity is not None]
    yield "dissipation", [*resisting, *loads, *hitting]
    yield "supply", [*drives, *loads, *saying(re.compile(r"\btime\b"))]
    yield "states", [*(e.origin for e in flat.equations), *variables[Role.STATE]]
    yield "assertions", [a.origin for a in flat.assertions]
