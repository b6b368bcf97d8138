"""Make docs/words.md, the index of the field's words: ``python docs/words.py``.

For each word it looks where the examples, the studies, the pages and the exercises say it.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent

WORDS = {
    "action": (r"\baction (?:of|is|variable)|the action\b", "action period"),
    "basin of attraction": (r"\bbasins?\b|three magnets", "ensemble"),
    "bifurcation": (r"\bbifurcat|\bforks?\b|\bfolds?\b", "equilibria diagram orbit"),
    "calculus of variations": (r"calculus of variations|Euler-Lagrange|fastest descent", "curves"),
    "canonical transformation": (
        r"\bcanonical(?: transformation)?\b(?! layout| form)|exchange of q and p",
        "brackets",
    ),
    "chain of bodies": (r"\bchain\b", "modes"),
    "chaos": (r"\bchao(?:s|tic)\b", "lyapunov section diagram"),
    "conservation law, Noether": (r"\bconserved\b|Noether", "symmetries invariants"),
    "constraint force, multiplier": (
        r"\bmultiplier of\b|\bwith (?:its|two) multipliers?\b|\bmultiplier\(",
        "",
    ),
    "constraint, nonholonomic": (r"\bnonholonomic\b|knife edge|velocity constraint", ""),
    "Coriolis force": (r"\bCoriolis\b", ""),
    "drag": (r"\bdrag\b", "dimensions"),
    "dry friction": (r"\bdry friction\b", "threshold"),
    "equilibrium": (r"\bequilibri(?:um|a)\b", "equilibria steady"),
    "Euler angles": (r"\bEuler angles\b", "kinematics"),
    "flexible body": (r"\bflexible\b|\belastic (?:hinges|rod|shaft)\b|hingeless", "modes response"),
    "Floquet multiplier": (r"\bFloquet\b|\bmultiplier leaves|unstable between", "floquet orbit"),
    "frequency response": (r"\bfrequency response\b", "response linearize"),
    "grazing": (r"\bgraz(?:es|ing)\b|just touch|in the motion that meets the plate", "diagram threshold"),
    "gyroscope": (r"\bgyroscop|\bspinning wheel\b|\bprecess", "steady modes"),
    "Hamilton's equations": (r"\bHamilton's (?:equations|function)\b|\bH = ", "hamilton brackets"),
    "hysteresis, foldover": (r"\bhysteresis\b|\bfold-?over\b|swept (?:up|down)wards", "hysteresis diagram"),
    "impact": (r"\bimpacts?\b|\bbounces?\b", "diagram orbit"),
    "inertia tensor": (r"\binertia tensor\b|\bprincipal (?:moments|axes)\b", "inertia"),
    "inverse dynamics": (r"\b[Ii]nverse dynamics\b|[Mm]easured motion to forces|torque needed", ""),
    "Kepler's problem": (r"\bKepler\b", "period symmetries"),
    "limit cycle": (r"\blimit cycle\b", "orbit floquet"),
    "linkage": (r"\b(?:linkage|four-bar|slider-crank)\b", "linearize equilibria"),
    "Lyapunov exponent": (r"\bLyapunov\b|\blargest exponent\b", "lyapunov"),
    "normal modes": (r"\bnormal modes\b|\bshapes of small motions\b", "modes"),
    "parametric resonance": (r"\bparametric resonance\b|Mathieu|shaken up and down", "floquet hysteresis"),
    "period doubling": (r"\bperiod doubl|\bdoubled at\b|begin to take two periods", "orbit diagram"),
    "phase portrait": (r"\bseparatri(?:x|ces)\b|phase portrait", "portrait energy"),
    "Poincaré section": (r"\bPoincar[eé] section\b|\bthrough a surface\b|passes q1 = 0|Henon", "section"),
    "resonance": (r"\bresonance\b|natural frequency", "response spectrum"),
    "rolling": (r"\brolls?\b|\brolling\b", ""),
    "scattering": (r"\bscatter(?:s|ed|ing)\b", "scattering"),
    "sensitivity": (r"\bsensitivit(?:y|ies)\b", "gradient"),
    "stability": (r"\b(?:un)?stable\b", "linearize equilibria floquet"),
    "stick-slip": (r"\bstick-slip\b|\bsticks\b.*\bslips\b|\bslips\b.*\bsticks\b", "diagram orbit"),
    "superharmonic, combination tones": (r"three times that|sum and difference", "spectrum"),
    "symmetry": (r"\bsymmetr(?:y|ies)\b", "symmetries invariants"),
    "virial theorem": (r"\bvirial\b", "virial"),
}
"""What the index lists: how it is said, and the studies that ask about it."""

MOST = 4
"""Examples and pages that are named for a word."""

HEAD = """# The field's words

Where a subject is: examples that run as they are, the studies that ask about it, pages, and exercises with their solutions.
`python docs/words.py` makes this page from the words of the examples and pages themselves.

| word | examples | studies | pages | exercises |
|---|---|---|---|---|
"""


def sections(path: Path) -> Iterator[tuple[str, str, str]]:
    """Give heading, anchor and text of each section of a page; the first is the page itself."""
    parts = re.split(r"^(#{1,3}) (.+)$", path.read_text(encoding="utf-8"), flags=re.M)
    for k in range(1, len(parts), 3):
        heading = re.sub(r"`|\[([^]]*)\]\([^)]*\)", r"\1", parts[k + 1])
        anchor = re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-")
        yield (
            heading,
            "" if parts[k] == "#" else f"#{anchor}",
            re.sub(r"^```.*?^```", "", parts[k + 2], flags=re.S | re.M),
        )


def examples() -> dict[str, str]:
    """Give the names of examples with what they say of themselves: the strings and comments of their texts."""
    found = {}
    for path in sorted([*(ROOT / "examples").glob("*.mech"), *(ROOT / "examples" / "curves").glob("*.mech")]):
        text = path.read_text(encoding="utf-8")
        name = path.relative_to(ROOT / "examples").with_suffix("").as_posix()
        strings = re.findall(r'^(?:model \w+\s+)"([^"\n]*)"|^(//.*)$', text, re.M)
        found[name] = " ".join(part for pair in strings for part in pair if part)
    return found


def page() -> str:
    """Return the text of words.md."""
    said = examples()
    exercises = [s for s in sections(HERE / "how_to" / "exercises.md") if s[1]]
    pages = sorted(
        [
            *(HERE / "how_to").glob("*.md"),
            *(HERE / "explanation").glob("*.md"),
            HERE / "events.md",
            HERE / "tutorial.md",
        ]
    )
    pages = [p for p in pages if p.name not in ("README.md", "exercises.md")]
    lines = []
    for word, (pattern, asked) in WORDS.items():
        says = re.compile(pattern)
        files = [
            f"[{n.rpartition('/')[2]}](../examples/{n}.mech)" for n, text in said.items() if says.search(text)
        ]
        kinds = [f"[{name}](studies.md#{name})" for name in asked.split()]
        found = []
        for path in pages:
            parts = list(sections(path))
            hits = [(len(says.findall(h)) * 10 + len(says.findall(text)), h, a) for h, a, text in parts]
            if hits and max(hits)[0] > 1:
                count, heading, anchor = max(hits, key=lambda hit: hit[0])
                found.append((count, f"[{heading}]({path.relative_to(HERE).as_posix()}{anchor})"))
        named = [text for _, text in sorted(found, key=lambda one: -one[0])]
        tasks = [
            f"[{h}](how_to/exercises.md{a})"
            for h, a, text in exercises
            if says.search(h + " " + text) or h.lower() in word.lower()
        ]
        cells = (word, *(", ".join(c[:MOST]) for c in (files, kinds, named)), ", ".join(tasks))
        lines.append(f"| {' | '.join(cells)} |\n")
    return HEAD + "".join(lines)


if __name__ == "__main__":
    (HERE / "words.md").write_text(page(), encoding="utf-8")
