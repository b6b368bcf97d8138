"""The words of the language by what they begin. The grammar says where each may be a name; some never may."""

from __future__ import annotations

STATEMENTS = (
    "parameter", "structural", "coordinate", "state", "discrete", "input", "output", "let",
    "frame", "point", "cut", "kinetic", "potential", "lagrangian", "dissipation", "gravity", "mass",
    "inertia", "force", "torque", "damping", "friction", "constraint", "holonomic", "nonholonomic",
    "drive", "contact", "shape", "place", "closure", "initial", "final", "equation", "exact", "assert",
    "experiment", "study", "dimensionless", "independent", "stationary", "draw", "extends", "when", "for", "if",
)  # fmt: skip
"""Words that begin a statement of a model."""

DEFINITIONS = ("import", "model", "partial", "function", "type")
"""Words that begin an item of a file."""

STEPS = ("let", "var", "for", "if", "return")
"""Words that begin a step in the body of a function."""

ACTIONS = ("reinit", "terminate", "impulse", "release", "engage", "assert")
"""Words that begin an action of ``when``."""

CLAUSES = (
    "typeof", "by", "at", "on", "from", "in", "static", "forward", "backward", "along", "restitution", "friction", "with", "to", "unit",
    "then", "else", "elseif", "elsewhen", "loop", "end", "for", "if", "when",
)  # fmt: skip
"""Words inside a statement or at the end of a block."""

EXPRESSIONS = ("time", "der", "pre", "true", "false", "and", "or", "not")
"""Words of expressions."""

KEYWORDS = frozenset((*STATEMENTS, *DEFINITIONS, *STEPS, *ACTIONS, *CLAUSES, *EXPRESSIONS))

RESERVED = frozenset((*EXPRESSIONS, "if", "then", "else", "elseif", "for", "loop", "end", "model"))
"""Words that can name nothing anywhere, because an expression or the end of a block could not tell."""
