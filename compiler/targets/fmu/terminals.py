"""Terminals of an FMU (FMI 3.0, section 2.4.9): what is connected together stands together.

Inputs and outputs of one component make a terminal of matching rule ``bus``; the elements of one array, such as the
position of a point or a force with components, one of rule ``sequence``. Energies are for reports, not for connections.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from xml.etree.ElementTree import Element, SubElement

from msgspec import Struct

from .arrays import Group
from .elements import text_of
from .variables import VariableTable

SIDE = "100.0"
_ELEMENT = re.compile(r"(?P<base>[\w.]+)\[(?P<member>[\d,]+)\]")
_MEMBER = re.compile(r"(?P<base>[\w.]+)\.(?P<member>\w+)")


class Terminal(Struct, frozen=True):
    """``members``: name within the terminal, name of the variable."""

    name: str
    rule: str
    members: tuple[tuple[str, str], ...]


def terminals(groups: Sequence[Group], table: VariableTable) -> tuple[Terminal, ...]:
    """Return the terminals of at least two variables, in the order of the variables; an array needs none."""
    members_of: dict[tuple[str, str], list[tuple[str, str]]] = {}
    for group in groups:
        v = table.at(group.members[0])
        if v.causality not in ("input", "output") or v.entry.kind not in ("input", "output"):
            continue
        for pattern, rule in ((_ELEMENT, "sequence"), (_MEMBER, "bus")):
            if found := pattern.fullmatch(group.name):
                members_of.setdefault((found["base"], rule), []).append((found["member"], group.name))
                break
    taken: set[str] = set()
    result = []
    for (name, rule), members in members_of.items():
        if len(members) > 1 and name not in taken:
            taken.add(name)
            result.append(Terminal(name, rule, tuple(members)))
    return tuple(result)


def write(groups: Sequence[Group], table: VariableTable, *, icon: bool) -> str:
    """Return the text of ``terminalsAndIcons/terminalsAndIcons.xml``; an icon fills the square of the model."""
    root = Element("fmiTerminalsAndIcons", fmiVersion="3.0")
    if icon:
        drawn = SubElement(root, "GraphicalRepresentation")
        corners = {"x1": f"-{SIDE}", "y1": f"-{SIDE}", "x2": SIDE, "y2": SIDE}
        SubElement(drawn, "CoordinateSystem", {**corners, "suggestedScalingFactorTo_mm": "0.1"})
        SubElement(drawn, "Icon", corners)
    found = terminals(groups, table)
    if found:
        top = SubElement(root, "Terminals")
        for terminal in found:
            element = SubElement(top, "Terminal", name=terminal.name, matchingRule=terminal.rule)
            for member, name in terminal.members:
                attributes = {"variableKind": "signal", "memberName": member, "variableName": name}
                SubElement(element, "TerminalMemberVariable", attributes)
    return text_of(root)
