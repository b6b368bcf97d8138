"""How values that must be fixed before a run are refused: by the names in them, later by their formulas.

Each function returns code, message and details; ``culprit`` is what changes.
"""

from __future__ import annotations

from mechc.lang.diagnostics import Details

Refusal = tuple[str, str, Details]


def parameter_changes(name: str, culprit: str) -> Refusal:
    """Refuse the value of a parameter."""
    help = "a parameter is fixed during a run; write 'let' for what changes, or 'input' in a component"
    message = f"parameter '{name}' must not depend on '{culprit}', which changes"
    return "E0810", message, {"caption": f"this depends on '{culprit}'", "help": help}


def input_changes(name: str, culprit: str) -> Refusal:
    """Refuse the default of an input, which may use time too."""
    help = "a default may use parameters and time; write 'let' for what follows from the motion"
    message = f"the default of the input '{name}' must not depend on '{culprit}'"
    return "E0811", message, {"caption": f"this depends on '{culprit}'", "help": help}


def first_value_changes(name: str, culprit: str) -> Refusal:
    """Refuse the first value of a discrete variable, which is known before the state is."""
    help = f"give it a number, and its value at the start by 'when initial() then {name} := ...; end when;'"
    message = f"the first value of the discrete variable '{name}' must not depend on '{culprit}'"
    return "E0811", message, {"caption": f"this depends on '{culprit}'", "help": help}


def setting_changes(culprit: str) -> Refusal:
    """Refuse what an experiment sets."""
    help = (
        "an experiment sets fixed values, which may use parameters; a course in time is the default of an 'input' in "
        "the model, or a table (--input NAME=FILE.csv)"
    )
    message = f"what an experiment sets must not depend on '{culprit}', which changes"
    return "E0812", message, {"caption": f"this depends on '{culprit}'", "help": help}
