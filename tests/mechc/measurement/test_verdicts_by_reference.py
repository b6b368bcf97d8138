"""Verdicts of ``mechc stress``, repeated by true motions that share no code with mechc: of five models whose equations are written by hand, and
of 40 random machines. ``MECHC_VERDICTS=all``: of all machines every row instead of that of the run and those of targets, and of C programs
and FMUs of all models instead of a few.

What is right must be off by less than a hundred times its claim, what is inaccurate must say so, what is wrong must be; what is refused must
have no motion, or none that the form can follow; twins must move as the model does, and starts must count as much as the table says.
"""

from __future__ import annotations

import itertools
import math
import os
import shutil
from collections import Counter
from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import true_motions
from msgspec import Struct, structs
from numpy.typing import NDArray
from random_models.machines import Machine, machine

from mechc.api import Model
from mechc.compiler.metamorphic.reversal import is_rate
from mechc.compiler.metamorphic.table import TWINS
from mechc.fmu import documents
from mechc.lang.units import parse_unit
from mechc.measurement import stress, stress_targets
from mechc.measurement.extremes import TARGET, Extreme, extremes
from mechc.measurement.metamorphic import Base, beside, run_twin, twin_of
from mechc.measurement.stress import LINEAR, ROUGH, UNDERSTATED, Subject, adaptive_methods, worker
from mechc.measurement.stress_table import STATED, TWIN, StressRow
from mechc.measurement.stress_targets import TARGETS, Answer, answer_of
from mechc.measurement.truth import BESIDE, ROUNDING
from mechc.requests.request import asked
from mechc.runtime.native.compiler import Compiler
from mechc.runtime.studies.kinds.motion import Simulate
from mechc.session import plan

Array = NDArray[np.float64]
Values = Mapping[str, float]
Motion = dict[str, Array]

ALL = os.environ.get("MECHC_VERDICTS") == "all"
SECONDS = 3.0 if ALL else 1.0
"""How long a run of the stress may take."""
BUILT = ("c", "fmu")
"""Targets that a compiler of C builds: gcc takes seconds for each, tcc a fifth of one."""
WHOLE = 8
"""Machines of which every row is looked at."""
TCC = shutil.which("tcc")
"""Builds C programs of machines in the sample, where it is installed."""
POINTS = 17
CLEAR = 0.2
"""Share of what a row may be off by up to which the reference may be in doubt."""
MOST = 1_000_000 if ALL else 10_000
"""Evaluations after which there is no reference of a machine."""
ENOUGH = 1_000_000
"""Evaluations that tell whether a refused machine moves: on its way to infinity it takes more than most motions do."""
FINE, COARSE = 1e-18, 1e-15
"""Tolerances of the references; what both differ by is the doubt."""
MACHINES = {1e-10: 0.1, 1e-12: 0.05, 1e-13: 0.02}
"""Tolerances of the references of machines, with the longest steps: each is compared with the one before, until the doubt is small."""


class Case(Struct, frozen=True):
    """A model, its true motion, the values that it states, and whether values let it move: ``target`` names what runs it."""

    text: str
    motion: Callable[[Values, Array, float], Motion]
    values: Values
    stop: float
    moves: Callable[[Values, str, str], bool]
    ladder: tuple[float, ...] = (COARSE, FINE)
    guessed: tuple[str, ...] = ()
    """Coordinates of which a guess decides between mirror images: the start of the run tells which."""


# ---------------------------------------------------------------- what has a motion


def _cart(v: Values, method: str, target: str) -> bool:
    return v["M"] != 0 and v["m"] != 0 and v["r"] != 0


def _kite(v: Values, method: str, target: str) -> bool:
    if v["m"] == 0 or true_motions.kite_start(v) is None:
        return False
    if target == "python":  # it follows no mechanism that comes to where a meets b, however late
        long = 20 * math.sqrt(v["l"] / v["g"])
        half = true_motions.kite(v, np.linspace(0, long, 200), COARSE)["half"]
        return bool((half > 0).all() or (half < 0).all())
    return True


def _tide(v: Values, method: str, target: str) -> bool:
    """A fall to within rounding of the Sun has no end in numbers of 53 bits."""
    x, y, r0 = v.get("x", v["r0"]), v.get("y", 0.0), v["r0"]
    far = math.hypot(x, y)
    if v["mu"] == 0 or r0 == 0 or far == 0:
        return False
    spin = x * v.get("der(y)", math.sqrt(v["GM"] / r0)) - y * v.get("der(x)", 0.0)
    nearest = spin**2 / (2 * v["GM"]) if v["GM"] else far
    return nearest > 1e-8 * far


def _sensor(v: Values, method: str, target: str) -> bool:
    return v["M"] != 0 and v["m"] != 0


def _ball(v: Values, method: str, target: str) -> bool:
    return v["m"] != 0 and target != "python" and method != "taylor"


CASES = {
    "cart": Case(
        """
        model CartSpring
          parameter M = 2 kg; parameter m = 1 kg; parameter k = 60 N/m; parameter l = 1 m; parameter g = 9.81 m/s^2;
          parameter K = 20 N/m;
          coordinate X = 0.3 m; coordinate r = 1.4 m; coordinate th = 2 rad;
          let px = X + r*sin(th);
          let py = -r*cos(th);
          kinetic 1/2*M*der(X)^2 + 1/2*m*(der(px)^2 + der(py)^2);
          potential m*g*py + 1/2*k*(r - l)^2 + 1/2*K*X^2;
          output place[2] = {px, py};
          experiment(stop = 20 s);
        end CartSpring;
        """,
        true_motions.cart_spring,
        {"M": 2, "m": 1, "k": 60, "l": 1, "g": 9.81, "K": 20, "X": 0.3, "r": 1.4, "th": 2},
        20,
        _cart,
    ),
    "kite": Case(
        """
        model Kite
          parameter m = 1 kg; parameter g = 9.81 m/s^2; parameter l = 1 m; parameter s = 0.7 m;
          coordinate Length a[2] ~ {-0.6, -0.8} m;
          coordinate Length b[2] ~ {0.6, -0.8} m;
          coordinate Length c[2] ~ {0.1, -1.2} m;
          initial a[1] = -0.3 m;
          initial b[1] = 0.8 m;
          kinetic 1/2*m*(dot(der(a), der(a)) + dot(der(b), der(b)) + dot(der(c), der(c)));
          potential m*g*(a[2] + b[2] + c[2]);
          constraint oa: dot(a, a) = l^2;
          constraint ob: dot(b, b) = l^2;
          constraint ac: dot(a - c, a - c) = s^2;
          constraint bc: dot(b - c, b - c) = s^2;
          output pull = multiplier(oa);
          experiment(stop = 5 s);
        end Kite;
        """,
        true_motions.kite,
        {"m": 1, "g": 9.81, "l": 1, "s": 0.7, "a[1]": -0.3, "b[1]": 0.8},
        5,
        _kite,
        guessed=("c[1]", "c[2]"),
    ),
    "tide": Case(
        """
        model Tide
          parameter GM = 1.32712440018e20 m^3/s^2; parameter r0 = 1.5e11 m; parameter mu = 1 kg; parameter w = 2e-6 rad/s;
          coordinate x = r0; coordinate Length y = 0 m; initial der(y) = sqrt(GM/r0);
          coordinate u = 1 nm;
          let r = sqrt(x^2 + y^2);
          kinetic 1/2*mu*(der(x)^2 + der(y)^2);
          potential -GM*mu/r;
          kinetic 1/2*1e-9 kg*der(u)^2;
          potential 1/2*1e-9 kg*w^2*u^2;
          force -1e-9 kg*GM/r^3*u on u;
          output exact_u = 1 nm*cos(sqrt(w^2 + GM/r0^3)*time);
          output off = u - exact_u;
          experiment(stop = 3e7 s);
        end Tide;
        """,
        true_motions.tide,
        {"GM": 1.32712440018e20, "r0": 1.5e11, "mu": 1, "w": 2e-6, "u": 1e-9},
        3e7,
        _tide,
    ),
    "sensor": Case(
        """
        model Sensor
          parameter M = 1000 kg; parameter m = 1 g; parameter K = 40 kN/m; parameter C = 50 N.s/m; parameter k = 1e9 N/m;
          parameter c = 2e3 N.s/m;
          coordinate x = 10 mm "frame"; coordinate y = 11 mm "sensor";
          kinetic 1/2*M*der(x)^2 + 1/2*m*der(y)^2;
          potential 1/2*K*x^2 + 1/2*k*(y - x)^2;
          dissipation 1/2*C*der(x)^2 + 1/2*c*(der(y) - der(x))^2;
          output squeeze = y - x;
          experiment(stop = 10 s);
        end Sensor;
        """,
        true_motions.sensor,
        {"M": 1000, "m": 1e-3, "K": 4e4, "C": 50, "k": 1e9, "c": 2e3, "x": 0.01, "y": 0.011},
        10,
        _sensor,
    ),
    "ball": Case(
        """
        model Juggle
          parameter m = 0.1 kg; parameter a = 2 cm; parameter w = 20 rad/s; parameter g = 9.81 m/s^2; parameter cd = 0.01 kg/m;
          gravity {0, -g};
          coordinate Length y = 0.5 m;
          mass m at world*{0 m, y};
          force -cd*der(y)*abs(der(y)) on y;
          contact paddle: y - a*sin(w*time) restitution 0.8;
          experiment(stop = 5 s);
        end Juggle;
        """,
        true_motions.juggle,
        {"m": 0.1, "a": 0.02, "w": 20, "g": 9.81, "cd": 0.01, "y": 0.5},
        5,
        _ball,
    ),
}


def case_of(made: Machine) -> Case:
    """Return a random machine as a case; its references are SciPy's, between all instants where something bends."""
    n = len(made.m)
    kept = [e.name for e in made.elements if e.remembers]
    names = [*(f"x{i}" for i in range(n)), *(f"der(x{i})" for i in range(n)), *kept]

    def moved(values: Values) -> Machine:
        return replace(
            made,
            x0=[values[f"x{i}"] for i in range(n)],
            v0=[values[f"der(x{i})"] for i in range(n)],
            elements=[replace(e, z0=values[e.name]) if e.remembers else e for e in made.elements],
        )

    def motion(values: Values, times: Array, tolerance: float) -> Motion:
        try:
            rows = moved(values).motion(times, tolerance, MACHINES[tolerance], most=MOST)
        except (TimeoutError, OverflowError):
            rows = np.full((times.size, len(names)), np.nan)
        return dict(zip(names, rows.T, strict=True))

    start = [*made.x0, *made.v0, *(e.z0 for e in made.elements if e.remembers)]
    switches = any(form == 2 for *_, form in made.laws)
    switches = switches or any(e.kind in ("rubbing", "jenkins") for e in made.elements)

    def moves(values: Values, method: str, target: str) -> bool:
        """Whether it moves, and by this form: slides jump whose force is larger than their friction, and motions may go to infinity."""
        late = bool(made.late or any(delay for *_, delay in made.noises))
        if target == "python":
            return not (switches or late)
        for e in made.elements:
            pull = e.pull(values[f"x{e.a}"], values[f"x{e.b}"] if e.b >= 0 else 0.0, values.get(e.name, 0.0))
            if e.kind == "jenkins" and not -e.backward <= pull <= e.forward:
                return False
        try:
            moved(values).motion(np.array([values["stop"]]), 1e-6, 0.1, most=ENOUGH)
        except OverflowError:
            return False
        except TimeoutError:
            return method != "taylor" or not (late or switches)
        return not (method == "taylor" and (late or switches))

    return Case(made.text(), motion, dict(zip(names, start, strict=True)), 3.0, moves, tuple(MACHINES))


# ---------------------------------------------------------------- the judge


class Judged(Struct, frozen=True):
    """A verdict, repeated or not; ``unfounded`` says why it is, ``share`` the largest true error over its claim."""

    row: StressRow
    repeated: bool
    unfounded: str = ""
    share: float = 0.0
    error: float = 0.0


class Judge:
    """Repeats the runs of one model, and compares them with its true motion."""

    def __init__(self, case: Case, folder: Path, seconds: float = SECONDS) -> None:
        file = folder / "model.mech"
        file.write_text(case.text, encoding="utf-8")
        self.case = case
        self.subject = Subject(str(file), None, {}, None, seconds)
        self.model = self.subject.load()
        self.known: dict[Any, Motion] = {}
        stated = stress._stated(self.model, structs.replace(self.subject, seconds=10 * seconds))
        assert isinstance(stated, Base)
        self.base = stated
        self.plan = plan(self.model, asked(Simulate, {}))
        self.answers: dict[Any, Answer] = {}

    def answer(self, target: str, model: Model, names: list[str], seconds: float) -> Answer:
        """Ask a target once."""
        key = (target, tuple(sorted(model.settings.items())))
        if key not in self.answers:
            self.answers[key] = answer_of(target, model, names, seconds)
        return self.answers[key]

    def extremes(self, targets: Iterable[str]) -> list[Extreme]:
        made = extremes(self.plan, adaptive_methods(), full=False, targets=tuple(targets))
        return [*made.runs, *(Extreme(TWIN, name) for name in TWINS)]

    def values(self, extreme: Extreme, start: Values) -> dict[str, float]:
        guessed = {n: start[n] for n in self.case.guessed if n in start}
        stop = extreme.options.get("stop", self.case.stop)
        return {**self.case.values, **guessed, **extreme.values, "stop": stop}

    def truth(self, values: Values, times: Array, tolerance: float | None = None) -> Motion:
        tolerance = tolerance or self.case.ladder[-1]
        key = (tuple(sorted(values.items())), times.tobytes(), tolerance)
        if key not in self.known:
            with np.errstate(all="ignore"):
                self.known[key] = self.case.motion(values, times, tolerance)
        return self.known[key]

    def off(
        self, values: Values, times: Array, got: Motion, allowed: Values, nominal: Values
    ) -> tuple[dict[str, float], Motion] | None:
        """Give the largest error of each state over nominal + |value|, up to where the reference is in doubt, and the reference, or None."""
        order = np.argsort(times)
        times, got = times[order], {n: x[order] for n, x in got.items()}
        for tolerances in itertools.pairwise(self.case.ladder):
            coarse, fine = (self.truth(values, times, tolerance) for tolerance in tolerances)
            free = np.ones(times.size, dtype=bool)
            for instant in (*fine.get("happened", ()), *coarse.get("happened", ())):
                free &= np.abs(times - instant) > 3 * BESIDE * values["stop"]
            names = [n for n in got if n in fine and n in allowed]
            doubt = np.zeros(times.size)
            for n in names:
                apart = np.abs(fine[n] - coarse[n]) / (nominal[n] + np.abs(fine[n]))
                doubt = np.maximum(doubt, np.where(free, apart / allowed[n], 0.0))
            unclear = np.flatnonzero(~(doubt <= CLEAR))
            if not unclear.size:
                break
        free[int(unclear[0]) if unclear.size else times.size :] = False
        if not free.any() or not names:
            return None
        found = {}
        for n in names:
            off = np.abs(got[n] - fine[n])[free] / (nominal[n] + np.abs(fine[n][free]))
            found[n] = float(np.where(np.isfinite(off), off, np.inf).max())
        return found, fine

    # ------------------------------------------------------------ rows

    def judged(self, extreme: Extreme, row: StressRow) -> Judged:
        if row.kind in ("hung", "crashed", "unlike"):
            return Judged(row, True, row.reason)
        if row.kind == "refused":
            target = extreme.text.partition(":")[0] if extreme.group == TARGET else ""
            values = self.values(extreme, {})
            moves = self.case.moves(values, str(extreme.options.get("method", "")), target)
            return Judged(row, True, f"it moves: {row.reason}" if moves else "")
        if extreme.group == TWIN:
            return self._shaken(row) if extreme.text == "start perturbed" else self._twin(row, extreme.text)
        if row.kind in ("long", "none", "open"):
            return Judged(row, False)
        return self._target(extreme, row) if extreme.group == TARGET else self._run(extreme, row)

    def _run(self, extreme: Extreme, row: StressRow) -> Judged:
        solution = self.model.with_values(extreme.values).simulate(**extreme.options)
        estimate = solution.accuracy.error
        if estimate is None:
            return Judged(row, False)
        start = {n: float(solution[n][0]) for n in self.case.guessed}
        rows = np.unique(np.linspace(0, solution.time.size - 1, POINTS).round().astype(int))
        rows = rows[1:] if rows.size > 1 else rows
        claims = {n: max(c, ROUNDING) for n, c in estimate.by_state.items()}
        allowed = {n: UNDERSTATED * c for n, c in claims.items()}
        got = {n: solution[n][rows] for n in claims}
        values = self.values(extreme, start)
        compared = self.off(values, solution.time[rows], got, allowed, estimate.nominal)
        if compared is None:
            return Judged(row, False)
        found, truth = compared
        share, error = max(found[n] / claims[n] for n in found), max(found.values())
        claim = max(estimate.by_state.values())
        why = ""
        if row.kind == "right":
            if share > UNDERSTATED or error >= ROUGH:
                why = f"it is off by {error:.1e}, {share:.2g} times its claim"
            why = why or self._lost(truth, solution, found, estimate.nominal)
        elif row.kind == "rough":
            if share > UNDERSTATED:
                why = f"it is off by {share:.2g} times its claim"
            elif max(error, claim) < ROUGH / 2 and not self._lost(truth, solution, found, estimate.nominal):
                why = f"it is off by {error:.1e} only, and claims {claim:.1e}"
        elif row.kind == "wrong" and share <= UNDERSTATED:
            why = f"it is off by {share:.2g} times its claim only"
        elif row.kind == "doubtful" and share <= 1:
            why = f"it is off by {error:.1e}, which it claims"
        return Judged(row, True, why, share, error)

    def _lost(self, truth: Motion, solution: Any, found: Values, nominal: Values) -> str:
        """Say which coordinate is not known by its own range."""
        reached = {n: float(np.abs(truth[n]).max()) for n in found}
        for n, share in found.items():
            alike = max(x for m, x in reached.items() if solution.unit(m) == solution.unit(n))
            off = share * (nominal[n] + reached[n])
            if not n.startswith("energy.") and 1e-15 * alike < reached[n] < off:
                return f"{n} stays within {reached[n]:.1e} and is off by up to {off:.1e}"
        return ""

    def _target(self, extreme: Extreme, row: StressRow) -> Judged:
        if row.kind not in ("right", "rough", "wrong"):
            return Judged(row, False)
        changed = self.model.with_values(extreme.values)
        run = changed.simulate()
        estimate = run.accuracy.error
        assert estimate is not None
        names = list(estimate.nominal)
        answer = self.answer(row.method, changed, names, 60.0)
        time = answer["time"]
        rows = np.unique(np.linspace(0, time.size - 1, POINTS).round().astype(int))[1:]
        tolerance = run.motion.columns.case.tolerance
        claims = {n: max(c, tolerance) for n, c in estimate.by_state.items()}
        allowed = {n: UNDERSTATED * c for n, c in claims.items()}
        start = {n: float(run[n][0]) for n in self.case.guessed}
        got = {n: answer[n][rows] for n in names if n in answer}
        compared = self.off(self.values(extreme, start), time[rows], got, allowed, estimate.nominal)
        if compared is None:
            return Judged(row, False)
        found = compared[0]
        share, error = max(found[n] / claims[n] for n in found), max(found.values())
        wrong = share > UNDERSTATED
        words = f"it is off by {error:.1e}, {share:.2g} times the claim of the run"
        return Judged(row, True, words if wrong is not (row.kind == "wrong") else "", share, error)

    def _twin(self, row: StressRow, name: str) -> Judged:
        if row.kind not in ("same", "other", "rough"):
            return Judged(row, False)
        limit = self.base.request.progress
        assert isinstance(limit, stress._Limit)
        limit.begin()
        twin = twin_of(name, self.base)
        base = beside(twin, self.base)
        made = run_twin(twin, base)
        mine, theirs = base.solution.accuracy.error, made.solution.accuracy.error
        assert mine is not None and theirs is not None
        other = made.solution
        second = twin.factor(parse_unit(base.plan.case.problem.time.unit or "1").dimension)
        rows = np.unique(np.linspace(0, other.time.size - 1, POINTS).round().astype(int))
        times = other.time[rows] / second
        if twin.backwards:
            times = base.solution.time[-1] - times
        keep = times > 0
        units = {q.name: q.unit for q in base.plan.case.problem.states}
        got, allowed = {}, {}
        largest = max(*mine.by_state.values(), *theirs.by_state.values(), ROUNDING)
        for n in mine.by_state:
            called = twin.names.get(n, n)
            if not twin.means(n) or called not in other or n.startswith("energy."):
                continue
            sign = -1.0 if twin.backwards and is_rate(n, set()) else 1.0
            by = twin.factor(parse_unit(units[n] or "1").dimension)
            got[n] = (sign * other[called][rows] / by)[keep]
            allowed[n] = max(UNDERSTATED * largest, row.claim or 0.0)
        start = {n: float(self.base.solution[n][0]) for n in self.case.guessed}
        values = self.values(Extreme(TWIN, name), start)
        compared = self.off(values, times[keep], got, allowed, mine.nominal)
        if compared is None:
            return Judged(row, False)
        found = compared[0]
        off, error = max(found[n] / allowed[n] for n in found), max(found.values())
        same = off <= 1
        words = f"it is off by {error:.1e}, {off:.2g} of what it may"
        return Judged(row, True, words if same is not (row.kind != "other") else "", off * UNDERSTATED, error)

    def _shaken(self, row: StressRow) -> Judged:
        """Move the start of the true motion by two sizes: what becomes of it grows with them, and is small or not."""
        if row.kind not in ("same", "rough", "parted", "tied"):
            return Judged(row, False)
        estimate = self.base.solution.accuracy.error
        assert estimate is not None
        start = {n: float(self.base.solution[n][0]) for n in self.case.guessed}
        values = self.values(Extreme(TWIN, "start perturbed"), start)
        times = np.linspace(0, values["stop"], POINTS)[1:]
        still = self.truth(values, times)
        apart = []
        for size in (1e-8, 1e-6):
            moved = dict(values)
            for k, n in enumerate(n for n in self.case.values if n in estimate.nominal):
                moved[n] += (-1) ** k * size * estimate.nominal[n]
            there = self.truth(moved, times)
            apart.append(
                max(float(np.abs(there[n] - still[n]).max()) / estimate.nominal[n]
                    for n in still if n in estimate.nominal and n[:4] not in ("der(", "ener"))
            )  # fmt: skip
        kind = (
            "parted"
            if apart[1] < 3 * apart[0] and apart[0] > LINEAR
            else "rough"
            if apart[0] > ROUGH
            else "same"
        )
        unfounded = kind != row.kind and not (row.kind == "tied" and kind == "parted")
        return Judged(row, True, f"it comes {apart[0]:.1e} and {apart[1]:.1e} apart" if unfounded else "")


# ---------------------------------------------------------------- the tests


def examine(
    case: Case, folder: Path, built: bool, monkeypatch: pytest.MonkeyPatch, groups: Collection[str] = ()
) -> list[Judged]:
    """Judge rows of a model, all or those of some groups, with those of targets that gcc builds or without; fail where a verdict is
    unfounded."""
    judge = Judge(case, folder)
    monkeypatch.setattr(stress, "answer_of", judge.answer)
    monkeypatch.setattr(documents, "documents", lambda *_: {})  # of FMUs, which nothing here reads
    made = worker(judge.subject)
    targets = [t for t in TARGETS if built or t not in BUILT]
    wanted = [e for e in judge.extremes(targets) if not groups or e.group in groups]
    found = [judge.judged(extreme, made(extreme)) for extreme in wanted]
    counts = Counter(j.row.kind for j in found)
    print(
        {k: f"{n}, repeated {sum(j.repeated for j in found if j.row.kind == k)}" for k, n in counts.items()}
    )
    unfounded = [(j.row.group, j.row.text, j.row.kind, j.unfounded) for j in found if j.unfounded]
    assert not unfounded, unfounded
    return found


@pytest.mark.skipif(
    bool(np.finfo(np.longdouble).eps > 1e-18), reason="its long doubles are too short for references"
)
@pytest.mark.slow
@pytest.mark.parametrize("name", CASES)
def test_no_verdict_on_a_model_is_unfounded(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    found = examine(CASES[name], tmp_path, ALL or name == "tide", monkeypatch)
    assert sum(j.repeated for j in found) > 30


@pytest.mark.slow
@pytest.mark.parametrize(
    "seed",
    range(40),
)
def test_no_verdict_on_a_machine_is_unfounded(
    seed: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole = ALL or seed < WHOLE
    groups = () if whole else (STATED, TARGET)
    quick = TCC is not None and not ALL
    if TCC is not None and quick:
        compiler = Compiler((TCC,), "tcc")
        monkeypatch.setattr(stress_targets, "find_compiler", lambda: compiler)
    found = examine(case_of(machine(seed)), tmp_path, ALL or quick or seed % 5 == 0, monkeypatch, groups)
    assert sum(j.repeated for j in found) > (15 if whole else 1)  # on a busy machine rows may take too long
