"""How every command and every option is said to a small model: what ``test_one_path.py`` goes through."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import click
from small_models import MODELS, Small

from mechc.cli.main import mechc

Path = tuple[str, ...]
Words = tuple[str, ...]

COMMANDS: dict[str, Words] = {
    "run": ("MODEL",),
    "bench": ("MODEL", "--methods", "dop853", "--tolerances", "1e-6", "--stop", "0.1"),
    "stress": ("MODEL", "--only", "tolerances", "--seconds", "5"),
    "check": ("MODEL",),
    "fmt": ("--check", "MODEL"),
    "new": ("swing",),
    "import": ("robot.urdf", "-o", "robot.mech"),
    "init": ("MODEL",),
    "equations": ("MODEL",),
    "explain": ("MODEL",),
    "show": ("program", "MODEL"),
    "report": ("MODEL", "-o", "report.html"),
    "view": ("MODEL", "--no-open", "--recorded", "-o", "page.html"),
    "compile": ("MODEL", "--target", "python", "-o", "out"),
    "fit": ("MODEL", "DATA", "--vary", "PARAMETER"),
    "fmu check": ("unit.fmu",),
    "fmu run": ("unit.fmu",),
    "lsp": ("--stdio",),
    "doctor": (),
    "cache clear": (),
    "cache show": (),
    "study sweep": ("MODEL", "--set", "PARAMETER=VALUES"),
    "study ensemble": ("MODEL", "--vary", "PARAMETER = LOW .. HIGH, 3", "--keep", "final(COORDINATE)"),
    "study task": (
        "MODEL",
        "--observe",
        "COORDINATE/COORDINATE",
        "--reward",
        "1",
        "--every",
        "0.1",
        "--stop",
        "0.5",
    ),
    "study along": ("MODEL", "--every", "0.25"),
    "study equilibria": ("MODEL", "--guesses", "3"),
    "study fit": ("MODEL", "DATA", "--vary", "PARAMETER"),
    "study virial": ("MODEL", "--of", "COORDINATE"),
    "study orbit": ("MODEL", "--stop", "2"),
    "study floquet": ("MODEL", "--period", "0.2"),
    "study scattering": ("MODEL", "--over", "COORDINATE = LOW .. HIGH, 3"),
    "study gradient": ("MODEL", "--goal", "COORDINATE", "--to", "PARAMETER"),
    "study optimum": ("MODEL", "--vary", "PARAMETER", "--goal", "COORDINATE"),
    "study spectrum": ("MODEL", "--of", "COORDINATE"),
    "study rainflow": ("MODEL", "--of", "COORDINATE"),
    "study dimensions": ("MODEL", "--of", "COORDINATE"),
    "study diagram": ("MODEL", "--over", "PARAMETER = LOW .. HIGH, 3", "--hold", "0.1"),
    "study hysteresis": ("MODEL", "--over", "PARAMETER = LOW .. HIGH, 3", "--hold", "0.1"),
    "study threshold": ("MODEL", "--over", "PARAMETER = LOW .. HIGH, 3", "--reaches", "COORDINATE = 0.1"),
    "study lyapunov": ("MODEL", "--time", "1"),
    "study section": ("MODEL", "--where", "COORDINATE = 0.1", "--count", "2"),
    "study invariants": ("MODEL", "--degree", "2"),
    "study brackets": ("MODEL", "--of", "COORDINATE, der(COORDINATE)"),
    "study kinematics": ("MODEL", "--of", "COORDINATE"),
    "study energy": ("MODEL", "--energy", "1"),
    "study portrait": ("MODEL", "--paths", "2"),
}
"""What follows each command at least; a study that is not listed is asked with its model alone."""

ONCE = {"new", "import", "lsp", "doctor", "cache clear", "cache show", "fmu check", "fmu run"}
"""What is asked of no model of these, so once."""

OPTIONS: dict[str, Words] = {
    "--model": ("--model", "NAME"),
    "--experiment": ("--experiment", "later"),
    "--set": ("--set", "PARAMETER=VALUE"),
    "--input": ("--input", "INPUT=TABLE"),
    "--columns": ("--input", "INPUT=TABLE", "--columns", "1 = time"),
    "--skip": ("--input", "INPUT=TABLE", "--skip", "0"),
    "--separator": ("--input", "INPUT=TABLE", "--separator", ","),
    "--decimal": ("--input", "INPUT=TABLE", "--decimal", "."),
    "--stop": ("--stop", "0.4 s"),
    "--start": ("--start", "0.1 s"),
    "--every": ("--every", "0.05 s"),
    "--smooth": ("--smooth", "INPUT"),
    "--step": ("--step", "0.01", "--method", "rk4"),
    "--tolerance": ("--tolerance", "1e-6"),
    "--method": ("--method", "radau5"),
    "--output": ("--output", "answer.json"),
    "--pade": ("--pade", "2"),
    "--streamed": ("--streamed", "--output", "rows.csv"),
    "--sensitivity": ("--sensitivity", "PARAMETER"),
    "--condition": ("--condition",),
    "--constants": ("--constants",),
    "--outputs": ("--outputs", "COORDINATE"),
    "--plot": ("--plot", "picture.svg"),
    "--animate": ("--animate", "moving.gif"),
    "--snapshot": ("--snapshot", "0.1,0.2"),
    "--display": ("--display", "deg,mm"),
    "--no-error-estimate": ("--no-error-estimate",),
    "--estimate-error": ("--no-estimate-error",),
    "--all": ("--all",),
    "--reproducible": ("--reproducible",),
    "--target": ("--target", "python"),
    "--vary": ("--vary", "PARAMETER = LOW .. HIGH, 3"),
    "--keep": ("--keep", "final(COORDINATE)", "--vary", "PARAMETER = LOW .. HIGH, 3"),
    "--samples": ("--samples", "3", "--vary", "PARAMETER ~ uniform(LOW, HIGH)"),
    "--seed": ("--seed", "2", "--samples", "3", "--vary", "PARAMETER ~ uniform(LOW, HIGH)"),
    "--sampling": ("--sampling", "sobol", "--samples", "4", "--vary", "PARAMETER ~ uniform(LOW, HIGH)"),
    "--covariance": ("--covariance", "{{1}}", "--samples", "3", "--vary", "PARAMETER ~ normal(LOW, HIGH)"),
    "--errors": ("--errors", "all", "--vary", "PARAMETER = LOW .. HIGH, 3"),
    "--threads": ("--threads", "2", "--vary", "PARAMETER = LOW .. HIGH, 3"),
    "--lanes": ("--lanes", "1", "--vary", "PARAMETER = LOW .. HIGH, 3"),
    "--device": ("--device", "no such device", "--vary", "PARAMETER = LOW .. HIGH, 3"),
    "--time-limit": ("--time-limit", "10 s", "--vary", "PARAMETER = LOW .. HIGH, 3"),
    "--workers": ("--workers", "1", "--vary", "PARAMETER = LOW .. HIGH, 3"),
    "--cluster": ("--cluster", "nowhere", "--vary", "PARAMETER = LOW .. HIGH, 3"),
    "--store": ("--store", "runs.npz"),
    "--resume": ("--resume", "--output", "runs.npz", "--vary", "PARAMETER = LOW .. HIGH, 3"),
    "--keep-all": ("--keep-all",),
    "--verify": ("--verify",),
    "--quiet": ("--quiet",),
    "--json": ("--json",),
    "--at": ("--at", "COORDINATE=0.1"),
    "--inputs": ("--inputs", "INPUT"),
    "--sample": ("--sample", "0.01"),
    "--frequencies": ("--frequencies", "1 .. 10, 3"),
    "--hertz": ("--hertz",),
    "--decibel": ("--decibel",),
    "--over": ("--over", "PARAMETER = LOW .. HIGH, 3"),
    "--prove": ("--prove",),
    "--guesses": ("--guesses", "2"),
    "--noise": ("--noise", "COORDINATE=0.01"),
    "--shared": ("--shared", "PARAMETER"),
    "--loss": ("--loss", "huber"),
    "--starts": ("--starts", "2"),
    "--of": ("--of", "COORDINATE"),
    "--period": ("--period", "0.3"),
    "--energy": ("--energy", "0.5"),
    "--goal": ("--goal", "COORDINATE"),
    "--to": ("--to", "PARAMETER"),
    "--integral": ("--integral",),
    "--least": ("--least",),
    "--when": ("--when", "highest"),
    "--hold": ("--hold", "0.1"),
    "--reaches": ("--reaches", "COORDINATE = 0.2"),
    "--time": ("--time", "0.5"),
    "--count": ("--count", "1"),
    "--where": ("--where", "COORDINATE = 0.1"),
    "--direction": ("--direction", "both"),
    "--degree": ("--degree", "1"),
    "--observe": ("--observe", "1"),
    "--reward": ("--reward", "2"),
    "--terminate": ("--terminate", "time > 0.3 s"),
    "--actions": ("--actions", "INPUT"),
    "--substeps": ("--substeps", "2", "--method", "rk4"),
    "--episodes": ("--episodes", "2"),
    "--canonical": ("--canonical", "COORDINATE"),
    "--radius": ("--radius", "0.1"),
    "--about": ("--about", "0, 0, 0"),
    "--settling": ("--settling", "0.1"),
    "--window": ("--window", "hann"),
    "--power": ("--power",),
    "--classes": ("--classes", "3"),
    "--weighting": ("--weighting", "ISO2631-Wk"),
    "--order": ("--order", "both"),
    "--paths": ("--paths", "1"),
    "--methods": ("--methods", "dop853,rk4"),
    "--tolerances": ("--tolerances", "1e-5"),
    "--against": ("--against", "dop853"),
    "--seconds": ("--seconds", "5"),
    "--quick": ("--quick",),
    "--only": ("--only", "tolerances"),
    "--structure": ("--structure",),
    "--check": ("--check",),
    "--diff": ("--diff",),
    "--explain": ("--explain",),
    "--format": ("--format", "latex"),
    "--recorded": ("--recorded",),
    "--no-open": ("--no-open",),
    "--fmi": ("--fmi", "2"),
    "--kind": ("--kind", "me"),
    "--package": ("--package", "."),
    "--floating": ("--floating",),
    "--meshes": ("--meshes", "none"),
    "--platform": ("--platform", "x86_64-linux"),
    "--fmi3-arrays": ("--fmi3-arrays", "off"),
    "--sources-only": ("--sources-only",),
    "--run": ("--run",),
    "--memory": ("--memory", "512 MB"),
    "--stdio": ("--stdio",),
}
"""What an option is followed by, with what it is about."""

OWN: dict[tuple[str, str], Words] = {
    ("bench", "--json"): ("--json", "bench.json"),
    ("stress", "--json"): ("--json", "stress.json"),
    ("equations", "--output"): ("--output", "equations.txt"),
    ("compile", "--target"): ("--target", "c", "--output", "out"),
    ("compile", "--input"): ("--input", "INPUT=TABLE", "--target", "web", "--output", "page.html"),
    ("report", "--output"): ("--output", "other.html"),
    ("view", "--output"): ("--output", "other.html"),
    ("fmu run", "--set"): ("--set", "a=2"),
    ("fmu run", "--output"): ("--output", "rows.csv"),
    ("fmu run", "--plot"): ("--plot", "picture.svg"),
    ("study sweep", "--output"): ("--output", "answer.json"),
    ("study curves", "--over"): ("--over", "PARAMETER = LOW .. HIGH"),
    ("study ensemble", "--resume"): ("--resume", "--store", "runs.npz"),
    ("study rainflow", "--least"): ("--least", "0.1"),
    ("study dimensions", "--among"): ("--among", "PARAMETER"),
    ("study diagram", "--at"): ("--at", "minima"),
    ("study diagram", "--starts"): ("--starts", "COORDINATE = {0.1, 0.2}"),
    ("study field", "--vary"): ("--vary", "COORDINATE"),
    ("study steady", "--vary"): ("--vary", "COORDINATE"),
    ("study portrait", "--over"): ("--over", "COORDINATE = -1 .. 1"),
    ("study energy", "--over"): ("--over", "COORDINATE = -1 .. 1"),
}
"""Where an option means something else to one command."""

TOGETHER: tuple[Words, ...] = (
    ("--sensitivity", "PARAMETER", "--condition"),
    ("--sensitivity", "PARAMETER", "--constants"),
    ("--condition", "--constants"),
    ("--sensitivity", "PARAMETER", "--condition", "--constants"),
)
"""Questions to a run that are asked at once."""


class Cell(NamedTuple):
    """One call: a command, what follows it, and the model that it is put to (empty: none)."""

    command: str
    words: Words
    model: str

    def __str__(self) -> str:
        return f"{self.command} {' '.join(self.words)} on {self.model or 'nothing'}"


def commands() -> Iterator[tuple[str, click.Command]]:
    """Yield all commands with their names, those of groups too, from the table of commands."""

    def walk(command: click.Command, path: Path) -> Iterator[tuple[str, click.Command]]:
        context = click.Context(command)
        if not isinstance(command, click.Group):
            yield " ".join(path), command
            return
        for name in command.list_commands(context):
            found = command.get_command(context, name)
            assert found is not None
            yield from walk(found, (*path, name))

    yield from walk(mechc, ())


def options(command: click.Command) -> list[str]:
    """List the long names of the options of a command."""
    return [max(p.opts, key=len) for p in command.params if isinstance(p, click.Option)]


BY_KIND: dict[str, str] = {
    "TIME": "0.2",
    "NUMBER": "0.5",
    "N": "3",
    "A,B": "COORDINATE",
    "FORMULA": "COORDINATE",
}
"""What is said to options of studies that stand in no table, by what their help says that they take."""


def words_of(command: str, option: str) -> Words | None:
    """Give an option as it is said: as the tables have it, else, of a study, by its kind."""
    found = OWN.get((command, option), OPTIONS.get(option))
    if found is not None or not command.startswith("study "):
        return found
    (made,) = (p for name, c in commands() if name == command for p in c.params if option in p.opts)
    assert isinstance(made, click.Option)
    if made.is_flag:
        return (option,)
    return (option, BY_KIND[made.metavar]) if made.metavar in BY_KIND else None


def unsaid() -> list[str]:
    """List commands and options that stand in no table here."""
    found = [name for name, _ in commands() if name not in COMMANDS and not name.startswith("study ")]
    for name, command in commands():
        found += [f"{name} {option}" for option in options(command) if words_of(name, option) is None]
    return found


def spelled(words: Words, small: Small, name: str) -> list[str]:
    """Give words as they are said of a model, whose own names stand instead of capitals."""
    low, high = ("0.3", "0.6") if small.parameter == "a" else ("1", "2")
    places = {
        "PARAMETER": small.parameter,
        "COORDINATE": small.coordinate,
        "INPUT": small.input or "u",
        "VALUES": "{0.3, 0.5}",
        "VALUE": "0.5",
        "LOW": low,
        "HIGH": high,
        "TABLE": "table.csv",
        "MODEL": "model.mech",
        "DATA": "data.csv",
        "NAME": name.capitalize(),
    }
    found = []
    for word in words:
        for place, text in places.items():
            word = word.replace(place, text)
        found.append(word)
    return found


def cells(models: list[str] | None = None, *, each: bool = False) -> list[Cell]:
    """List all calls. ``each``: options of studies and of what builds, too, of each model; else of one after another."""
    names = models or list(MODELS)
    found, turn = [], 0
    for command, made in commands():
        bare = COMMANDS.get(command, ("MODEL",))
        if command in ONCE:
            found += [Cell(command, (*bare, *_more(command, o, bare)), "") for o in (None, *options(made))]
            continue
        found += [Cell(command, bare, name) for name in names]
        for option in options(made):
            more = _more(command, option, bare)
            if command == "run" or each:
                found += [Cell(command, (*bare, *more), name) for name in names]
            else:
                found.append(Cell(command, (*bare, *more), names[turn % len(names)]))
                turn += 1
    found += [Cell("run", ("MODEL", *several), name) for several in TOGETHER for name in names]
    return list(dict.fromkeys(found))


def _more(command: str, option: str | None, bare: Words) -> Words:
    """What an option adds: nothing where the command is never without it."""
    if option is None:
        return ()
    words = words_of(command, option)
    assert words is not None
    kept: list[str] = []
    k = 0
    while k < len(words):  # an option that stands there already is not said twice
        size = 2 if k + 1 < len(words) and not words[k + 1].startswith("-") else 1
        if words[k] not in bare:
            kept += words[k : k + size]
        k += size
    return tuple(kept)
