"""The structs of the contract in Python against the headers of C: every field, in order, of the same kind."""

from __future__ import annotations

import ctypes
import re
from ctypes import c_double, c_int
from pathlib import Path
from typing import Any

import pytest

import mechc.runtime
import mechc.web
from mechc.compiler.targets.wasm.plan import PlanStruct, SettingStruct
from mechc.runtime.native import contract
from mechc.runtime.native.contract import Contract

KERNEL = Path(mechc.runtime.__file__).parent / "kernel"
HEADERS = (
    KERNEL / "model.h",
    KERNEL / "start" / "start.h",
    Path(mechc.web.__file__).parent / "kernel" / "web_plan.h",
)
OURS = (
    *(
        s
        for s in vars(contract).values()
        if isinstance(s, type) and issubclass(s, Contract) and s is not Contract
    ),
    PlanStruct,
    SettingStruct,
)


def fields_in_c(name: str) -> list[tuple[str, str]]:
    """Return name and kind (int, mech_real, pointer) of each field of a struct."""
    for header in HEADERS:
        text = re.sub(r"/\*.*?\*/", "", header.read_text(encoding="utf-8"), flags=re.S)
        found = re.search(rf"typedef struct {name} \{{(.*?)\}} {name};", text, re.S)
        if found:
            return [field for line in found[1].split(";") if line.strip() for field in _declared(line)]
    raise AssertionError(f"no header has a struct {name}")


def _declared(line: str) -> list[tuple[str, str]]:
    function = re.search(r"\(\*(\w+)\)\(", line)
    if function:
        return [(function[1], "pointer")]
    found = re.fullmatch(r"\s*(?:const )?(unsigned char|\w+)\s+(.*)", line, re.S)
    assert found is not None
    kind, names = found.groups()
    return [(part.strip(" *\n"), "pointer" if "*" in part else kind) for part in names.split(",")]


def fields_in_python(struct: type[Contract]) -> list[tuple[str, str]]:
    kinds: dict[Any, str] = {c_int: "int", c_double: "mech_real"}
    return [(field[0], kinds.get(field[1], "pointer")) for field in struct._fields_]


@pytest.mark.parametrize("struct", OURS, ids=lambda s: s.c_name)
def test_fields_are_those_of_the_header(struct: type[Contract]) -> None:
    assert fields_in_python(struct) == fields_in_c(struct.c_name)


def test_a_header_is_read() -> None:
    """Several fields in a line, arrays, a pointer to a function of another type."""
    assert fields_in_c("mech_series") == [
        *(("n_slots", "int"), ("n_kept", "int"), ("start", "pointer"), ("next", "pointer")),
        ("expand", "pointer"),
    ]
    assert ("parameters", "pointer") in fields_in_c("mech_model")
    assert ("known", "pointer") in fields_in_c("mech_start")


def test_the_version_is_that_of_the_header() -> None:
    text = (KERNEL / "model.h").read_text(encoding="utf-8")
    assert f"#define MECH_MODEL_VERSION {contract.MODEL_VERSION}\n" in text
    assert ctypes.sizeof(c_int) == 4
