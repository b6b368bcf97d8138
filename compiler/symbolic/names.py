"""How the symbols of a model are written in text and in LaTeX."""

from __future__ import annotations

import re

import sympy as sp

from ..graph import Node
from ..mechanics.system import MechanicalSystem

_LETTERS = """alpha beta gamma delta epsilon zeta eta theta iota kappa lambda mu nu xi pi rho sigma tau upsilon phi
chi psi omega Gamma Delta Theta Lambda Xi Pi Sigma Upsilon Phi Psi Omega"""

GREEK = frozenset(_LETTERS.split())
"""Names that LaTeX has letters for."""


def latex_name(name: str) -> str:
    """Return a name as LaTeX: Greek words as letters, trailing digits, indices and parts of a path as subscripts."""
    match = re.fullmatch(r"(.*?)\[([\d,]+)\]", name)
    if match:
        return _subscript(latex_name(match[1]), match[2])
    if "." in name:
        owner, last = name.rsplit(".", 1)
        return _subscript(latex_name(last), rf"\mathrm{{{_plain(owner)}}}")
    match = re.fullmatch(r"([A-Za-z]+?)_?(\d+)", name)
    if match:
        return _subscript(latex_name(match[1]), match[2])
    if name in GREEK:
        return rf"\{name}"
    if len(name) > 1 and "_" in name:
        head, tail = name.split("_", 1)
        return _subscript(latex_name(head), rf"\mathrm{{{_plain(tail)}}}")
    return name if len(name) == 1 else rf"\mathrm{{{_plain(name)}}}"


def _plain(text: str) -> str:
    return text.replace("_", r"\_").replace("[", r"\,").replace("]", "")


def _subscript(base: str, index: str) -> str:
    if base.endswith("}") and "_{" in base:
        return f"{base[:-1]},{index}}}"
    return f"{base}_{{{index}}}"


def symbols_of(system: MechanicalSystem, latex: bool) -> dict[Node, sp.Symbol]:
    """Return the SymPy symbol of each symbol of a system; rates carry dots in LaTeX and primes in text."""

    def base(name: str) -> str:
        return latex_name(name) if latex else name

    def rate(name: str, order: int) -> str:
        if not latex:
            return name + "'" * order
        dots = rf"\{'d' * order}ot"
        head, _, index = base(name).partition("_")
        return f"{dots}{{{head}}}" + (f"_{index}" if index else "")

    result: dict[Node, sp.Symbol] = {system.symbols.time: sp.Symbol("t")}
    for coordinate in system.symbols.coordinates:
        for s in coordinate.q:
            result[s.node] = sp.Symbol(base(s.name))
        name = coordinate.variable.name
        for k, (s, a) in enumerate(zip(coordinate.v, coordinate.a, strict=True)):
            if coordinate.is_rotation:
                spin = latex_name(f"omega[{k + 1}]") if latex else f"omega_{name}[{k + 1}]"
                result[s.node] = sp.Symbol(spin)
                dotted = rf"\dot{{\omega}}_{{{k + 1}}}" if latex else f"omega_{name}[{k + 1}]'"
                result[a] = sp.Symbol(dotted)
            else:
                result[s.node] = sp.Symbol(rate(s.of, 1))
                result[a] = sp.Symbol(rate(s.of, 2))
    groups = (
        system.symbols.states,
        system.symbols.inputs,
        system.symbols.discretes,
        system.symbols.parameters,
    )
    for scalars in groups:
        result |= {s.node: sp.Symbol(base(s.name)) for s in scalars}
    for s in system.symbols.states:
        result[system.rate(s.node)] = sp.Symbol(rate(s.name, 1))
    return result
