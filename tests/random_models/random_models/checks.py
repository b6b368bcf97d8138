"""What each random model must fulfil; a disagreement is a value, with what is needed to see it again."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from random import Random
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from msgspec import structs

from mechc.compiler.program.series import without_series
from random_models.another_library import another_library
from random_models.carried import (
    assembled_alike,
    begins_alike,
    carried,
    closes_elsewhere,
    hides_its_start,
    momenta_differ,
)
from random_models.compiled import Compiled, NoMotion, Refused, Values, compiled, differences, shaken
from random_models.components import grouped
from random_models.composing import as_people_compose
from random_models.counted import lost
from random_models.definition import (
    UNTIL,
    along,
    before_a_hit,
    begins_otherwise,
    edged,
    edges_along,
    ends_rightly,
    ignored,
    is_nearest,
    moved,
    turned_alike,
    undone,
)
from random_models.dimensionless import dimensionless
from random_models.exact import badly_known, exact, untold
from random_models.exports import exported
from random_models.from_outside import differs_from_text
from random_models.hidden import misjudged
from random_models.lists import element_by_element
from random_models.meaning import Meaning
from random_models.members import members_differ, sweep_differs
from random_models.modes import MODES
from random_models.motions import Edged, by_another_method, difference, doubts, ended, errors, run
from random_models.narrow import is_marked
from random_models.nesting import NESTED, by_element
from random_models.python_functions import load_python
from random_models.rolled import in_loops
from random_models.said_otherwise import along_motions, at_states
from random_models.settings import settings
from random_models.sizes import sized
from random_models.spelled_out import said_plainly
from random_models.structure import STRUCTURES
from random_models.tabled import meant, tables
from random_models.tree import Model
from random_models.twins import TWINS, Twin, renamed_name
from random_models.wording import other_words


@dataclass(frozen=True)
class Disagreement:
    """``check``: which comparison; ``key``: what two disagreements of one cause have in common."""

    check: str
    key: str
    text: str


@dataclass
class Report:
    """What became of one model."""

    refused: tuple[str, ...] = ()
    checks: tuple[str, ...] = ()
    disagreements: tuple[Disagreement, ...] = ()


def crash(error: BaseException) -> Disagreement:
    """Describe an error without words."""
    where = error.__traceback__
    while where is not None and where.tb_next is not None:
        where = where.tb_next
    name = where.tb_frame.f_code.co_name if where is not None else "?"
    return Disagreement(
        "crash",
        f"{type(error).__name__} in {name}",
        "\n".join((repr(error)[:300], *getattr(error, "__notes__", ()))),
    )


def examined(
    model: Model, seed: int, only: str = "", without: tuple[str, ...] = (), mode: str = "mixed"
) -> Report:
    """Compile a model and compare it with its meaning and its twins; ``only``, ``without``: names of checks."""
    chosen = MODES[mode]
    try:
        base = compiled(model.text(), quick=chosen.quick)
    except Refused as refused:
        return Report(refused.codes)
    except Exception as error:
        return Report(disagreements=(crash(error),))
    done: list[str] = []
    wrong: list[Disagreement] = []
    for name, check in (*CHECKS, *UNITS) if not only else (*CHECKS, *UNITS, *SINGLE, *ALONE):
        if name in without or (name != only if only else not chosen.wants(name, seed, base)):
            continue
        base.z = None
        try:
            found = check(model, base, seed)
        except Refused as refused:
            found = [Disagreement(name, "refused " + ",".join(refused.codes), refused.text)]
        except Exception as error:
            found = [crash(error)]
        if found is None:
            continue
        done.append(name)
        wrong += found
    return Report((), tuple(done), tuple(wrong))


Check = Callable[[Model, Compiled, int], list[Disagreement] | None]


def _values(model: Model, base: Compiled, seed: int) -> list[Disagreement]:
    """Compare parameters and initial values with those of the model's own text."""
    there = base.parameters() | base.start()
    mine = _spread(Meaning(model).values(guesses=not base.constrained), there)
    fixed = _structural(base) | {
        s.name for s in model.statements() if str(s.parts[0]).startswith("structural")
    }
    missing = [n for n in mine if n not in there and n.partition("[")[0] not in fixed]
    if base.constrained:  # where a joint closes a loop, what it says of its start is a condition
        missing = [n for n in missing if "." not in n]
    wrong = [
        f"{n}: {mine[n]:.12g} expected, {there[n]:.12g} found"
        for n in mine
        if n in there and not abs(mine[n] - there[n]) <= 1e-9 * (1 + abs(mine[n]))
    ]
    found = [Disagreement("values", "value", w) for w in wrong]
    return found + [Disagreement("values", "missing", n) for n in missing if not n.startswith("der(")]


def _spread(values: Values, there: Values) -> Values:
    """Give a number that stands for a whole array to each of its elements."""
    spread: Values = {}
    for name, x in values.items():
        stem, tail = (name[:-1], ")") if name.startswith("der(") else (name, "")
        elements = [n for n in there if n.startswith(f"{stem}[") and n.endswith(f"]{tail}")]
        spread.update(dict.fromkeys(elements, x) if name not in there and elements else {name: x})
    return spread


def _structural(base: Compiled) -> set[str]:
    driven = {d.target.name for d in base.model.compilation.flat.drives if hasattr(d.target, "name")}
    return driven | set(base.model.compilation.flat.structural)


def composed(model: Model, random: Random) -> Twin | None:
    """Say a model otherwise in several ways at once."""
    whole = Twin("composed", model)
    for make in TWINS:
        if random.random() < 0.25:
            continue
        twin = make(whole.model, random)
        if twin is not None:
            whole = Twin("composed", twin.model, whole.ignored + twin.ignored)
    return None if whole.model is model else whole


def composed_of(model: Model, seed: int) -> Twin | None:
    """Return the twin of a seed."""
    random = Random(seed + 1)
    return None if random.random() < 0.4 else composed(model, random)


def _composed(model: Model, base: Compiled, seed: int) -> list[Disagreement] | None:
    """Compare with several twins in one; where that disagrees, find out which of them does."""
    whole = composed_of(model, seed)
    if whole is None:
        return None
    try:
        found = compare_twin(base, whole, seed)
    except Refused as refused:
        if closes_elsewhere(refused, base):
            return None
        found = [
            Disagreement("composed", "refused " + ",".join(refused.codes), refused.text + whole.model.text())
        ]
    if not found:
        return found
    alone: list[Disagreement] = []
    for name, check in SINGLE:
        try:
            alone += check(model, base, seed) or []
        except Refused as refused:
            if closes_elsewhere(refused, base):
                continue
            alone.append(Disagreement(name, "refused " + ",".join(refused.codes), refused.text))
    return alone or found


def _twin(make: Callable[[Model, Random], Twin | None]) -> Check:
    def check(model: Model, base: Compiled, seed: int) -> list[Disagreement] | None:
        twin = make(model, Random(seed))
        return None if twin is None else compare_twin(base, twin, seed)

    return check


def _elsewhere_closed(make: Callable[[Model, Random], Twin | None]) -> Check:
    """Compare with a twin of which other joints may close the loops."""
    check = _twin(make)

    def compared(model: Model, base: Compiled, seed: int) -> list[Disagreement] | None:
        try:
            return check(model, base, seed)
        except Refused as refused:
            if closes_elsewhere(refused, base):
                return None
            raise

    return compared


def compare_twin(base: Compiled, twin: Twin, seed: int) -> list[Disagreement] | None:
    """Compare a model with a twin at random states."""
    quick = not base.switches or base.problem.quick
    other = compiled(twin.model.text(), quick=quick)
    if twin.base is not None:
        base = compiled(twin.base.text(), quick=quick)
    mine = {renamed_name(twin, n): v for n, v in base.parameters().items()}
    wrong = differences(mine, other.parameters(), relative=1e-12)
    if assembled_alike(twin, base, other):
        mine = {renamed_name(twin, n): v for n, v in base.start().items()}
        off = differences(mine, turned_alike(mine, other.start()))
        wrong += [] if off and is_nearest(other, mine) and is_nearest(other, other.start()) else off
    if wrong:
        return [Disagreement(twin.name, "given", _lines(wrong) + twin.model.text())]
    if momenta_differ(twin, base, other):
        return None
    rng = np.random.default_rng(seed)
    for k, state in enumerate(base.random_states(rng, 3)):
        there = carried(twin, base, other, state)
        if there is None:
            if k:
                break
            there = other.start()  # of a joint that turns freely: only the start can be the same
            both = {renamed_name(twin, n): v for n, v in state.items() if renamed_name(twin, n) in there}
            if base.constrained != other.constrained or differences(both, there):  # begins by other guesses
                break
            if hides_its_start(twin, base, other, there):
                break
        try:
            state, there = base.settle(state), other.settle(there)
        except NoMotion:
            continue
        there = _paired_integrals(base, state, other, there)
        mine = {renamed_name(twin, n): v for n, v in base.everything(state).items()}
        near = [
            {renamed_name(twin, n): v for n, v in base.everything(shaken(state, rng)).items()}
            for _ in range(2)
        ]
        wrong = differences(
            _numbered(mine),
            _numbered(other.everything(there)),
            [_numbered(n) for n in near],
            twin.ignored,
            base.relative,
        )
        edge = edged(base, state) if wrong else None
        if wrong and (edge or (edge is None and _for_an_instant(twin, base, state, other, there))):
            continue
        if wrong:
            return [Disagreement(twin.name, _kind(base, wrong[0][0]), _lines(wrong) + twin.model.text())]
    return []


LATER = 1e-7
"""Seconds behind an instant at which a law of time may change."""


def _for_an_instant(twin: Twin, base: Compiled, state: Values, other: Compiled, there: Values) -> bool:
    """Whether twins that differ at an instant agree right behind it, as a pulse may begin at it or behind it."""
    state, there = ({**at, "time": at["time"] + LATER} for at in (state, there))
    try:
        state, there = base.settle(state), other.settle(there)
    except NoMotion:
        return False
    mine = {renamed_name(twin, n): v for n, v in base.everything(state).items()}
    return not differences(
        _numbered(mine), _numbered(other.everything(there)), (), twin.ignored, base.relative
    )


def _paired_integrals(base: Compiled, state: Values, other: Compiled, there: Values) -> Values:
    """Give each integral over time of a twin the value of that which adds up the same, as their numbers are those of the text."""

    def by_rate(of: Compiled, at: Values) -> list[str]:
        rates = {n: v for n, v in of.everything(at).items() if n.startswith("d integral[")}
        return [n[2:] for n in sorted(rates, key=rates.__getitem__)]

    if not any(n.startswith("integral[") for n in there):
        return there
    return there | {
        n: state[m] for m, n in zip(by_rate(base, state), by_rate(other, there), strict=False) if m in state
    }


def _numbered(values: Values) -> Values:
    """Name the integrals over time by the size of what they add up, as their numbers are those of the text."""
    integrals = sorted(v for n, v in values.items() if n.startswith("d integral["))
    rest = {n: v for n, v in values.items() if not n.startswith("d integral[")}
    return rest | {f"d integral of rank {k}": v for k, v in enumerate(integrals)}


def _lines(wrong: list[tuple[str, float, float]]) -> str:
    return "".join(f"{n}: {x:.12g}, twin {y:.12g}\n" for n, x, y in wrong[:6])


def _kind(base: Compiled, name: str) -> str:
    return "state" if name.startswith("d ") else "output"


def _targets(model: Model, base: Compiled, seed: int) -> list[Disagreement] | None:
    """Compare the compiled functions with their statements in Python."""
    program = without_series(base.model.compilation.program)
    if program.switching is not None and program.switching.crowd is not None:
        return None  # the forces of many contacts are found by the kernel
    functions, _ = load_python(program)
    own = {name: functions[name] for name in ("rhs", "outputs") if name in functions}
    one, two = base, replace(base, functions=structs.replace(base.functions, **own))
    rng = np.random.default_rng(seed)
    found: list[Disagreement] = []
    for state in base.random_states(rng, 5):
        try:
            state = one.settle(state)
        except NoMotion:
            continue
        two.z = one.z
        near = [one.everything(shaken(state, rng)) for _ in range(2)]
        wrong = differences(one.everything(state), two.everything(state), near)
        if wrong:
            found.append(Disagreement("targets", "value", str(wrong[:3])))
            break
    return found


def _loops(model: Model, base: Compiled, seed: int) -> list[Disagreement] | None:
    """Compare with C code that has loops for what repeats itself."""
    other = in_loops(model.text())
    found = (
        [Disagreement("loops", "start", str(wrong[:3]))]
        if (wrong := differences(base.start(), other.start()))
        else []
    )
    rng = np.random.default_rng(seed)
    for state in base.random_states(rng, 3):
        try:
            state = base.settle(state)
        except NoMotion:
            continue
        other.z = base.z
        near = [base.everything(shaken(state, rng)) for _ in range(2)]
        if wrong := differences(base.everything(state), other.everything(state), near):
            return [*found, Disagreement("loops", "value", str(wrong[:3]))]
    return found


def still(check: str, key: str, seed: int, mode: str = "mixed") -> Callable[[Model], bool]:
    """Return whether a model disagrees in the same way."""

    def fails(model: Model) -> bool:
        report = examined(model, seed, "" if check == "crash" else check, mode=mode)
        return any(d.check == check and d.key == key for d in report.disagreements)

    return fails


def structured(model: Model, random: Random) -> Twin | None:
    """Say a model with heirs, components, blocks, functions, one after the other."""
    whole = Twin("structured", model)
    first = random.random() < 0.6
    if first:
        twin = grouped(model, random)
        whole = twin if twin is not None else whole
    for make in random.sample((*STRUCTURES, *NESTED), random.choice((1, 2, 3))):
        if first and make.__name__ == "by_experiment":
            continue
        twin = make(whole.model, random)
        whole = replace(whole, model=twin.model) if twin is not None else whole
    return None if whole.model is model else replace(whole, name="structured")


def structured_of(model: Model, seed: int) -> Twin | None:
    """Return the twin of a seed: arrays by element, structured texts, settings and another library, each now and then."""
    random, own = Random(seed), Random(f"elements of {seed}")
    twin = by_element(model, own) if own.random() < 0.5 else None
    if random.random() >= 0.4:
        twin = structured(model if twin is None else twin.model, random) or twin
    for what, share, make in (("settings", 0.4, settings), ("library", 0.7, another_library)):
        own = Random(f"{what} of {seed}")
        if own.random() >= share:
            continue
        last = make(model if twin is None else twin.model, own)
        if last is not None:
            twin = (
                last if twin is None else replace(twin, model=last.model, ignored=twin.ignored + last.ignored)
            )
    return twin


def _structured(model: Model, base: Compiled, seed: int) -> list[Disagreement] | None:
    """Compare with one to three structured texts of the same, one after the other."""
    whole = structured_of(model, seed)
    if whole is None:
        return None
    try:
        return compare_twin(base, whole, seed)
    except Refused as refused:
        if closes_elsewhere(refused, base):
            return None
        return [
            Disagreement(
                "structured", "refused " + ",".join(refused.codes), refused.text + whole.model.text()
            )
        ]


def _oracle(model: Model, base: Compiled, seed: int) -> list[Disagreement] | None:
    """Compare with the definition at states; those at random are far outside of what is small."""
    if is_marked(model, "sized"):
        return None
    return [Disagreement("oracle", kind, said) for kind, said in undone(base, seed, 2, ignored(model))]


def _counted(model: Model, base: Compiled, seed: int) -> list[Disagreement] | None:
    """Look whether every number of the text is there when the model is flat."""
    return [Disagreement("counted", "lost", said) for said in lost(model, base.model.compilation.flat)]


def _followers(model: Model, base: Compiled, seed: int) -> list[Disagreement]:
    """Look at what is said of states on which the motion does not depend."""
    return [Disagreement("followers", "misjudged", said) for said in misjudged(model, base, seed)]


def _integrals(model: Model, base: Compiled, seed: int) -> list[Disagreement] | None:
    """Look at what a model says of its integrals."""
    found = [Disagreement("integrals", "untold", said) for said in untold(model, base)]
    if exact(model):
        found += [Disagreement("integrals", "badly known", said) for said in badly_known(model, base, seed)]
    return found


def _touches_in_six_digits(message: str) -> bool:
    """Whether what is to touch at the start is said to overlap by no more than lengths in unusual units are rounded by."""
    gap = re.search(r"is penetrated at .* its gap is (\S+)", message)
    return gap is not None and float(gap[1]) > -1e-6


VAGUE = 1e-4
"""What a run that looks at what is narrow may be off by: without a look its companion, which steps otherwise, may tell of one."""


def _motion(model: Model, base: Compiled, seed: int) -> list[Disagreement] | None:
    """Compare motions of several methods, and one of them with the definition along it."""
    first = run(model.text())
    found = [Disagreement("motion", kind, said) for kind, said in doubts(first)]
    if str(first.outcome) == "Outcome.FAILED":
        told = "the motion slides along it" in first.message or ends_rightly(base, first)
        told = told or _touches_in_six_digits(first.message)
        return None if told else [Disagreement("motion", "failed", first.message)]
    narrow, sharp = is_marked(model, "narrow"), is_marked(model, "sharp", "sized")
    own = sized(model)
    if narrow:  # what other methods do not look for
        if max(errors(first).values(), default=0.0) > VAGUE:
            found.append(Disagreement("motion", "vague", f"errors {errors(first)}"))
    else:
        if said := difference(first, run(model.text(), "radau5"), sizes=own):
            found.append(Disagreement("motion", "method", said))
        if said := by_another_method(model.text(), first, Random(f"method of {seed}"), sharp):
            found.append(Disagreement("motion", "another method", said))
    if seed % 4 == 1 and not base.switches:  # others are compared with their events
        short = run(model.text(), stop=base.case.begin + UNTIL, begin=base.case.begin)
        found += [Disagreement("motion", f"by definition: {k}", said) for k, said in moved(base, short, own)]
    said_along = along(base, first, ignored(model))
    return found + [Disagreement("motion", f"definition of {kind}", said) for kind, said in said_along]


def _motions_of_twins(model: Model, base: Compiled, seed: int) -> list[Disagreement] | None:
    """Compare a motion with those of four twins."""
    first, own, random = run(model.text()), sized(model), Random(seed)
    if str(first.outcome) == "Outcome.FAILED":
        return None
    found = []
    for make in (composed, structured, element_by_element, as_people_compose):
        twin = make(model, random)
        if twin is None or twin.base is not None:
            continue
        try:
            if base.constrained and not begins_alike(twin, base, compiled(twin.model.text())):
                continue
        except Refused as refused:
            if closes_elsewhere(refused, base):
                continue
            raise
        if said := difference(first, run(twin.model.text()), twin, edges_along(base, first), own):
            found.append(Disagreement("motions of twins", make.__name__, said + "\n" + twin.model.text()))
    return found


def _events(model: Model, base: Compiled, seed: int) -> list[Disagreement] | None:
    """Compare a short motion with events with that by definition."""
    if not base.switches:
        return None
    begin = base.case.begin
    solution = run(model.text(), stop=begin + UNTIL, begin=begin)
    found = [Disagreement("events", kind, said) for kind, said in doubts(solution)]
    if ended(solution):
        found += [Disagreement("events", kind, said) for kind, said in moved(base, solution, sized(model))]
    return found + _hits(model, base, seed)


def _hits(model: Model, base: Compiled, seed: int) -> list[Disagreement]:
    """Compare a motion that begins right before a contact touches; elsewhere at random, which is far outside of what is small."""
    if (
        is_marked(model, "sized")
        or not base.model.compilation.flat.contacts
        or base.constrained
        or base.rotations
    ):
        return []
    values = before_a_hit(base, seed)
    if not values:
        return []
    try:
        begin = base.case.begin
        solution = run(model.text(), stop=begin + UNTIL, values=values, begin=begin)
    except Refused:
        return []
    if solution.time[0] != begin:  # what is told begins behind the hit
        return []
    told = doubts(solution) + (moved(base, solution, sized(model)) if ended(solution) else [])
    return [Disagreement("events", f"{kind} of a hit", said) for kind, said in told]


def _tabled(model: Model, base: Compiled, seed: int) -> list[Disagreement] | None:
    """Compare outputs along a motion whose inputs are tables with the definition."""
    if not base.problem.inputs:
        return None
    with TemporaryDirectory() as folder:
        paths = tables(base, Path(folder), Random(seed))
        solution = run(model.text(), inputs=paths)
        given = meant(base, paths)
    if str(solution.outcome) == "Outcome.FAILED":
        return []
    said = begins_otherwise(base, solution, given)
    found = [Disagreement("tabled", "start", said)] if said else []
    return found + [
        Disagreement("tabled", kind, said) for kind, said in along(base, solution, ignored(model), given)
    ]


def _members(model: Model, base: Compiled, seed: int) -> list[Disagreement] | None:
    """Compare an ensemble and a sweep with single runs."""
    if is_marked(model, "narrow", "sized"):
        return None
    told = ("member", members_differ(base, seed)), ("sweep", sweep_differs(base, seed))
    return [Disagreement("members", kind, said) for kind, said in told if said]


def _exports(model: Model, base: Compiled, seed: int) -> list[Disagreement] | None:
    """Compare the exported Python module and C program with the run; what is narrow, these do not look for."""
    if is_marked(model, "narrow"):
        return None

    def edges(native: Any) -> Edged:
        return edges_along(base, native)

    return [
        Disagreement("exports", what, said)
        for what, said in exported(model.text(), units=False, edges=edges, sizes=sized(model))
    ]


def _units(model: Model, base: Compiled, seed: int) -> list[Disagreement] | None:
    """Compare FMUs of both versions and kinds with the run; what is narrow, these do not look for."""
    if is_marked(model, "narrow"):
        return None
    return [
        Disagreement("units", what, said)
        for what, said in exported(model.text(), units=True, sizes=sized(model))
    ]


def _given(model: Model, base: Compiled, seed: int) -> list[Disagreement] | None:
    """Compare with a text that says the parameters that a run is given."""
    found = differs_from_text(model, base, seed)
    return None if found is None else [Disagreement("given", key, said) for key, said in found]


_ARRAYS = {"p": "parameters", "y": "states", "u": "inputs", "z": "discretes"}


def _sweeps(model: Model, base: Compiled, seed: int) -> list[Disagreement] | None:
    """Compare what experiments sweep with what their texts say."""
    said = Counter(s.data["sweep"] for s in model.statements() if s.data and "sweep" in s.data)
    if not said:
        return None
    names = {a: [q.name for q in getattr(base.problem, kind)] for a, kind in _ARRAYS.items()}
    swept = [(names[to.array][to.index], tuple(float(f"{v:.12g}") for v in values)) for e in base.problem.experiments for to, values in e.sweeps]  # fmt: skip
    wrong = said - Counter(swept)
    return [Disagreement("sweeps", "target", f"{sorted(wrong)} expected, {swept} found")] if wrong else []


def _said_otherwise(model: Model, base: Compiled, seed: int) -> list[Disagreement] | None:
    """Compare with a twin that mechc makes itself."""
    found = at_states(base, seed)
    return None if found is None else [Disagreement("said otherwise", name, said) for name, said in found]


def _twins(model: Model, base: Compiled, seed: int) -> list[Disagreement] | None:
    """Compare a motion with those of twins that mechc makes itself."""
    if is_marked(model, "sized"):  # shakes are shares of one
        return None
    found = along_motions(base, seed)
    return None if found is None else [Disagreement("twins", name, said) for name, said in found]


SINGLE: tuple[tuple[str, Check], ...] = tuple(
    (make.__name__.replace("_", " "), _twin(make)) for make in TWINS
)
ALONE: tuple[tuple[str, Check], ...] = (("another library", _twin(another_library)),)
CHECKS: tuple[tuple[str, Check], ...] = (
    ("values", _values),
    ("oracle", _oracle),
    ("followers", _followers),
    ("integrals", _integrals),
    ("counted", _counted),
    ("sweeps", _sweeps),
    ("structured", _structured),
    ("spelled out", _twin(said_plainly)),
    ("by element", _twin(element_by_element)),
    ("other words", _twin(other_words)),
    ("dimensionless", _twin(dimensionless)),
    ("as people compose", _elsewhere_closed(as_people_compose)),
    ("composed", _composed),
    ("said otherwise", _said_otherwise),
    ("given", _given),
    ("targets", _targets),
    ("loops", _loops),
    ("motion", _motion),
    ("motions of twins", _motions_of_twins),
    ("twins", _twins),
    ("events", _events),
    ("tabled", _tabled),
    ("members", _members),
    ("exports", _exports),
)
UNITS: tuple[tuple[str, Check], ...] = (("units", _units),)


__all__ = ["CHECKS", "MODES", "Disagreement", "Report", "Values", "compare_twin", "examined", "still"]
