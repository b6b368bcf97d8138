"""The nearest known word to a misspelt one, for the messages of all floors: it imports nothing of them."""

from __future__ import annotations

from collections.abc import Iterable


def edit_distance(a: str, b: str) -> int:
    """Count the insertions, deletions, replacements and swaps of neighbours that turn ``a`` into ``b``.

    Optimal string alignment distance (Damerau 1964): no piece is edited twice.
    """
    before: list[int] = []
    previous = list(range(len(b) + 1))
    for i, x in enumerate(a, start=1):
        current = [i]
        for j, y in enumerate(b, start=1):
            cost = min(previous[j] + 1, current[j - 1] + 1, previous[j - 1] + (x != y))
            if i > 1 and j > 1 and x == b[j - 2] and a[i - 2] == y:
                cost = min(cost, before[j - 2] + 1)
            current.append(cost)
        before, previous = previous, current
    return previous[-1]


def closest(name: str, candidates: Iterable[str]) -> str | None:
    """Return the candidate most like ``name``, or None where none is near enough.

    A candidate that differs only in case wins; otherwise one edit is allowed for every three
    letters, at least one, at most three, and words of one letter are never guessed. Ties go to the
    candidate with the same first letter, then to the earlier one.
    """
    words = [c for c in candidates if c != name]
    folded = name.casefold()
    for word in words:
        if word.casefold() == folded:
            return word
    if len(name) < 2:
        return None
    allowed = min(max(len(name) // 3, 1), 3)
    best: tuple[int, bool] | None = None
    found: str | None = None
    for word in words:
        if abs(len(word) - len(name)) > allowed or len(word) < 2:
            continue
        distance = edit_distance(folded, word.casefold())
        rank = (distance, word[:1].casefold() != folded[0])
        if distance <= allowed and (best is None or rank < best):
            best, found = rank, word
    return found


_SETTINGS = {
    "stop": (
        "stoptime",
        "tstop",
        "tend",
        "tfinal",
        "endtime",
        "end",
        "duration",
        "until",
        "tmax",
        "finaltime",
    ),
    "start": ("starttime", "tstart", "t0", "begin"),
    "every": ("interval", "outputinterval", "dtout", "sampling", "numberofintervals"),
    "step": ("dt", "h", "stepsize", "timestep", "fixedstep"),
    "tolerance": ("tol", "rtol", "reltol", "atol", "abstol", "eps", "accuracy", "precision"),
    "method": ("solver", "integrator", "scheme"),
}


def setting_meant(name: str) -> str | None:
    """Return the setting of a run that is called ``name`` elsewhere: ``StopTime``, ``t_end``, ``rtol``."""
    plain = name.replace("_", "").casefold()
    return next((setting for setting, others in _SETTINGS.items() if plain in others), None)


def suggest(name: str, candidates: Iterable[str]) -> str:
    """Return ``; did you mean '...'?`` for the end of a sentence, or nothing where no candidate is near."""
    near = closest(name, candidates)
    return f"; did you mean '{near}'?" if near else ""
