"""What the kernel of pages (``mechc/web/kernel/web.c``) knows of a model: ``web_plan``."""

from __future__ import annotations

from typing import Final

from mechc.runtime.native.contract import Contract, QuantityStruct, SizesStruct, fields
from mechc.runtime.nominal import KINDS, sizes_of

from ...program import Program
from ..model_data import ArrayPointer, FunctionPointer, StructArray, StructPointer, model_data

ARRAYS: Final = ("p", "y", "u")
"""Of settings, by the numbers of ``web.c``."""


class SettingStruct(Contract):
    c_name = "web_setting"
    _fields_ = fields("int array, index, guess")


class PlanStruct(Contract):
    c_name = "web_plan"
    _fields_ = fields(
        "pointer model, sizes; int n_still, n_moving; pointer still, moving; int n_settings, n_numbers; "
        "pointer experiment, settings"
    )


def web_plan(program: Program, experiment: str | None) -> StructPointer:
    """Return the plan of a program and of one of its experiments; None for none."""
    scene = program.scene
    plan = next((e for e in program.experiments if e.name == experiment), None)
    settings = [(ARRAYS.index(s.array), s.index, int(s.guess)) for s in plan.settings] if plan else []
    return StructPointer(
        "plan",
        PlanStruct,
        {
            "model": model_data(program, expanded=False),
            "sizes": _sizes(program),
            "n_still": scene.n_still if scene else 0,
            "n_moving": scene.n_moving if scene else 0,
            "still": FunctionPointer("scene_still") if program.function("scene_still") else None,
            "moving": FunctionPointer("scene") if program.function("scene") else None,
            "n_settings": len(settings),
            "n_numbers": len(plan.options) if plan else 0,
            "experiment": FunctionPointer(plan.function) if plan else None,
            "settings": StructArray("settings", SettingStruct, settings),
        },
    )


def _sizes(program: Program) -> StructPointer:
    """Return what nominal values are made from (``start.h``)."""
    sizes = sizes_of(program)
    groups = sizes.groups or [0] * len(sizes.units)
    rows = zip(sizes.units, sizes.kinds, sizes.pure, sizes.nominal, sizes.ranges, groups, strict=True)
    states = [(unit, KINDS[kind], int(pure), *numbers) for unit, kind, pure, *numbers in rows]
    return StructPointer(
        "sizes",
        SizesStruct,
        {
            "states": StructArray("states", QuantityStruct, states),
            "partner": ArrayPointer("partner", "int", sizes.partner),
            "units": ArrayPointer("units", "int", sizes.parameter_units),
            "n_energies": len(sizes.energies),
            "energies": ArrayPointer("energies", "int", sizes.energies),
        },
    )
