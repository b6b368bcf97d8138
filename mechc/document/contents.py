"""What stands in the report of a model: result and how to repeat it, largest forces, accuracy, pictures, studies, equations, text."""

from __future__ import annotations

import datetime
import platform
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from msgspec import Struct

from .. import __version__
from ..presentation import answers
from ..presentation.animation import snapshot
from ..presentation.numbers import number, with_unit
from ..presentation.painting import GAUGES
from ..presentation.report import report
from ..requests.parse_values import UsageMistake, unknown_name
from ..runtime.outcome import Outcome, SimulationError
from ..runtime.studies.flow.crossings import turns
from ..runtime.studies.table import STUDIES
from .blocks import Block, Document, Heading, MovingPage, Paragraph, Picture, Preformatted, Rows

if TYPE_CHECKING:
    from ..api import Model
    from ..solution import Solution

FORCES = ("N", "N.m")
MOST_STATES, MOST_LINES = 12, 60
"""Up to which the equations of motion are written; of more they take pages, and of many states minutes."""
PLACES = 4
"""Positions in the picture of the motion."""


class Load(Struct, frozen=True):
    """A force or a torque: where it acts, its largest size in the unit that it is shown in, and when that is."""

    place: str
    quantity: str
    largest: float
    unit: str
    time: float


def contents(
    model: Model, command: str, studies: Sequence[str] = (), **settings: Any
) -> tuple[Document, str]:
    """Run the model, answer its studies (those named; all that the file states), and say what came of it; give the outcome of the run too.

    ``settings``: those of ``Model.simulate``. Raises what it raises, and UsageMistake for curves and models that sweep.
    """
    if model.is_curve or model.sweeps(settings.get("experiment")):
        what = "is a curve" if model.is_curve else "makes many runs of this experiment"
        raise UsageMistake(
            f"'{model.name}' {what}: a report is about one motion", "'mechc run' and 'mechc study' tell of it"
        )
    known = (*model.studies, *STUDIES)
    if unknown := [name for name in studies if name not in known]:
        raise unknown_name("study", unknown[0], known)
    chosen = model.for_experiment(settings.get("experiment"))
    solution = chosen.keeping({"scene"}).simulate(**settings)
    solution.angles = chosen.angles
    loads = [] if solution.failure is not None else _loads(chosen, settings)
    blocks: list[Block] = [Heading("Result"), *_result(solution, loads, command), *_forces(solution, loads)]
    blocks += [Heading("Accuracy and checks"), Preformatted(report(solution))]
    if solution.failure is None:
        blocks += [Heading("Motion"), *_pictures(solution), *_page(model, settings)]
    for name in studies or model.studies:
        blocks += _study(model, name)
    blocks += _equations(chosen)
    source = model.compilation.source
    blocks += [
        Heading("Model"),
        Paragraph(f"The text of {Path(source.name).name}:"),
        Preformatted(source.text.rstrip()),
    ]
    day = datetime.datetime.now(datetime.UTC).strftime("%Y-%m-%d %H:%M UTC")
    document = Document(model.name, ", ".join(filter(None, (model.doc, day))), tuple(blocks))
    return document, solution.outcome.value


def _reactions(model: Model) -> dict[str, tuple[str, str, str]]:
    """Return formulas of the reactions of all joints: by name the place, the word for it and the formula."""
    flat = model.compilation.flat
    found: dict[str, tuple[str, str, str]] = {}
    for k, joint in enumerate(flat.joints):
        moment = f"abs(moment({joint.name}))" if flat.space == 2 else f"norm(moment({joint.name}))"
        found[f"reaction_of_joint_{k}"] = joint.name, "reaction", f"norm(reaction({joint.name}))"
        found[f"moment_of_joint_{k}"] = joint.name, "moment", moment
    names = [one.name for one in flat.contacts] + [one.name for one in flat.frictions]
    for k, name in enumerate(names):
        if name:
            found[f"load_of_contact_{k}"] = name, "load", f"multiplier({name})"
    return found


def _loads(model: Model, settings: Mapping[str, Any]) -> list[Load]:
    """Return all forces and torques by the size of their largest values, but for those that stay zero."""
    reactions = _reactions(model)
    told = model.with_formulas({name: formula for name, (_, _, formula) in reactions.items()})
    solution = told.simulate(**settings, estimate_error=False)
    entries = [q for q in solution.problem.outputs if q.unit in FORCES]
    found: list[tuple[str, float, Load]] = []
    for entry in entries:
        times, values = turns(solution, entry.name)
        k = int(np.nanargmax(np.abs(values)))
        place, what, _ = reactions.get(entry.name, (entry.name, entry.doc or "output", ""))
        unit, factor = solution.shown_unit(entry.name)
        if values[k]:
            load = Load(place, what, float(values[k]) * factor, unit, float(times[k]))
            found.append((entry.unit, -abs(float(values[k])), load))
    return [load for _, _, load in sorted(found, key=lambda one: one[:2])]


def _result(solution: Solution, loads: Sequence[Load], command: str) -> Iterator[Block]:
    time = with_unit(solution.problem.time.unit)
    rows = [("outcome", f"{solution.outcome.value} at {number(float(solution.time[-1]))}{time}")]
    if solution.outcome is not Outcome.COMPLETED:
        rows.append(("reason", solution.message))
    if loads:
        first = loads[0]
        size = f"{number(first.largest)} {first.unit}, {first.place} ({first.quantity})"
        rows.append(("largest load", f"{size}, at {number(first.time)}{time}"))
    accuracy = solution.accuracy
    if accuracy.error is not None:
        worst = accuracy.error.largest
        rows.append(
            ("estimated error", f"{worst:.1e} of nominal + |value|, the largest of all states and times")
        )
    elif accuracy.remark:
        rows.append(("estimated error", accuracy.remark))
    if accuracy.energy is not None:
        rows.append(("balance of energy", f"holds to {accuracy.energy.relative:.1e} of the energies"))
    rows += [("doubtful", doubt.text()) for doubt in accuracy.contradictions]
    system = f"{platform.system()} {platform.machine()}"
    rows.append(("made by", f"mechc {__version__}, Python {platform.python_version()}, {system}"))
    yield Rows((), tuple(rows))
    yield Paragraph("This command repeats it:")
    yield Preformatted(command)


def _forces(solution: Solution, loads: Sequence[Load]) -> Iterator[Block]:
    if not loads:
        return
    yield Heading("Largest forces and torques")
    head = ("where", "what", "largest", "at")
    time = with_unit(solution.problem.time.unit)
    rows = tuple(
        (one.place, one.quantity, f"{number(one.largest)} {one.unit}", f"{number(one.time)}{time}")
        for one in loads
    )
    yield Rows(head, rows)
    yield Paragraph(
        "Reactions and moments of joints are sizes; a moment about an axis that is free is zero and not listed."
    )


def _png(draw: Any) -> bytes:
    """Return the PNG that ``draw`` writes to a path."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "picture.png"
        draw(path)
        return path.read_bytes()


def _pictures(solution: Solution) -> Iterator[Block]:
    begin, end = float(solution.time[0]), float(solution.time[-1])
    staged = solution.staged()
    if staged is not None and any(shape.kind not in GAUGES for shape in staged[0].shapes) and end > begin:
        times = np.linspace(begin, end, PLACES)
        yield Picture(
            _png(lambda path: snapshot(solution, path, list(times))), "positions, earlier ones paler"
        )
    yield Picture(_png(lambda path: answers.plotted(solution, path)), "the motion")


def _page(model: Model, settings: Mapping[str, Any]) -> Iterator[Block]:
    from ..web.write import write_page

    with tempfile.TemporaryDirectory() as folder:
        try:
            given = {name: settings[name] for name in ("experiment", "inputs") if settings.get(name)}
            path = write_page(model.keeping({"scene"}), Path(folder) / "page.html", **given)
        except (UsageMistake, SimulationError) as mistake:
            yield Paragraph(f"The model has no page that moves: {mistake}")
            return
        yield MovingPage(path.read_text(encoding="utf-8"))


def _study(model: Model, name: str) -> Iterator[Block]:
    answer = model.study(name)
    stated = model.studies.get(name)
    yield Heading(f"Study {name}" + (f": {stated.doc}" if stated is not None and stated.doc else ""))
    yield Preformatted(answers.text(answer))
    try:
        yield Picture(_png(lambda path: answers.plotted(answer, path)), name)
    except SimulationError:  # numbers and formulas alone
        return


def _equations(model: Model) -> Iterator[Block]:
    from ..compiler.symbolic.layouts import write_equations

    yield Heading("Equations of motion")
    text = ""
    if len(model.states) <= MOST_STATES:
        text = write_equations(model.compilation.system, "text")
    if text and len(text.splitlines()) <= MOST_LINES:
        yield Preformatted(text)
    else:
        yield Paragraph(
            f"They are long; this prints them: mechc equations {Path(model.compilation.source.name).name}"
        )
