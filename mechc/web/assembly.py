"""A model and what it needs of the kernel as WebAssembly, by zig's C compiler."""

from __future__ import annotations

import importlib.util
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

from mechc.compiler.program.model import Program
from mechc.compiler.targets.alone import check_stands_alone, standing_alone
from mechc.compiler.targets.c import emit_c
from mechc.compiler.targets.description import make_problem
from mechc.compiler.targets.kernel_files import needed_kernel
from mechc.lang.diagnostics import Reporter
from mechc.runtime.methods import with_components
from mechc.runtime.native.build import build_shared
from mechc.runtime.native.compiler import Compiler
from mechc.runtime.nominal import sizes_of

FLAGS = (
    "-std=c11",
    "-Os",
    "-ffunction-sections",
    "-fdata-sections",
    "-g0",
    "-ffp-contract=off",
    "-fno-math-errno",
)
LINK = (
    "-mexec-model=reactor",
    "-Wl,--gc-sections",
    "-Wl,--strip-all",
    "-Wl,-z,stack-size=1048576",
    "-lm",
)
HERE = Path(__file__).parent
ARRAYS = ("p", "y", "u")
"""Of settings, by the numbers of ``web.c``."""
ARGUMENTS = "mech_real t, const mech_real *y, const mech_real *u, const mech_real *z, const mech_real *p, mech_real *out"


def has_zig() -> bool:
    return importlib.util.find_spec("ziglang") is not None


def webassembly(program: Program, method: str, experiment: str | None) -> bytes:
    """Return the bytes of a module without imports that exports what ``web.c`` says; ``experiment``: None for none.

    Raises CompileError (E0908) where zig is not installed, BuildError.
    """
    if not has_zig():
        raise Reporter().fail(
            "E0908",
            "a live page needs zig's C compiler, which is not installed",
            None,
            help="pip install ziglang; --recorded writes a page that shows one motion without it",
        )
    command = (sys.executable, "-m", "ziglang", "cc", "-target", "wasm32-wasi")
    return build_shared(
        sources(program, method, experiment),
        FLAGS,
        name="web",
        compiler=Compiler(command, _zig_version()),
        file="model.wasm",
        link=LINK,
    ).read_bytes()


def sources(program: Program, method: str, experiment: str | None = None) -> Mapping[str, str]:
    """Return the C files by name: the model, its picture, the functions for the page, and what they need."""
    check_stands_alone(program.hybrid)
    program = standing_alone(program)
    own = {
        "web_model.c": emit_c(program),
        "web.c": (HERE / "web.c").read_text(encoding="utf-8"),
        "web_model.h": f"{_scene(program)}\n{_quantities(program)}\n{_experiment(program, experiment)}",
    }
    needed = needed_kernel(program, methods(method), own)
    needed.pop("clock.c", None)  # the page has its own
    return {**own, **needed}


def methods(method: str) -> tuple[str, ...]:
    """Return the methods that the module holds: nominal values may need a first run by dop853."""
    return tuple(dict.fromkeys((*with_components(method), "dop853")))


def _quantities(program: Program) -> str:
    """Return what nominal values are made from (start.h)."""
    sizes = sizes_of(make_problem(program))
    kinds = {"": "MECH_PLAIN", "account": "MECH_ACCOUNT", "rotation": "MECH_ROTATION_ENTRY"}
    groups = sizes.groups or [0] * len(sizes.units)
    rows = zip(sizes.units, sizes.kinds, sizes.pure, sizes.nominal, sizes.ranges, groups, strict=True)
    quantities = [
        f"{{{u}, {kinds[k]}, {int(pure)}, {n!r}, {size!r}, {g}}}" for u, k, pure, n, size, g in rows
    ]

    def array(kind: str, name: str, values: Sequence[object]) -> str:
        return f"static const {kind} {name}[] = {{{', '.join(map(str, values)) or '0'}}};"

    return "\n".join(
        [
            array("mech_quantity", "web_states", quantities or ["{0, MECH_PLAIN, 0, 0, 0, 0}"]),
            array("int", "web_partner", sizes.partner),
            array("int", "web_units", sizes.parameter_units),
            array("int", "web_energies", sizes.energies),
            "static const mech_sizes web_quantities = "
            f"{{web_states, web_partner, web_units, {len(sizes.energies)}, web_energies}};\n",
        ]
    )


def _scene(program: Program) -> str:
    """Return the header that calls the functions of the picture, of which there may be none."""
    scene = program.scene
    assert scene is not None, "the program was made with a scene"
    calls = [name for name in ("scene_still", "scene") if program.function(name)]
    lines = [
        f"enum {{ WEB_STILL = {scene.n_still}, WEB_MOVING = {scene.n_moving} }};",
        *(f"mech_function {name};" for name in calls),
        f"static void web_scene({ARGUMENTS})",
        "{",
        "    (void)t, (void)y, (void)u, (void)z, (void)p, (void)out;",
        *(f"    {name}(t, y, u, z, p, out{' + WEB_STILL' if name == 'scene' else ''});" for name in calls),
        "}",
    ]
    return "\n".join(lines) + "\n"


def _experiment(program: Program, name: str | None) -> str:
    """Return what the page evaluates of an experiment: its numbers and settings, which may depend on parameters."""
    plan = next((e for e in program.experiments if e.name == name), None)
    settings = plan.settings if plan else ()
    rows = [f"{{{ARRAYS.index(s.array)}, {s.index}, {int(s.guess)}}}" for s in settings]
    call = f"{plan.function}(t, y, u, z, p, out)" if plan else ""
    return "\n".join(
        [
            f"enum {{ WEB_EXPERIMENT = {int(plan is not None)}, WEB_SETTINGS = {len(settings)}, "
            f"WEB_NUMBERS = {len(plan.options) if plan else 0} }};",
            f"static const int web_settings[][3] = {{{', '.join(rows) or '{0}'}}};",
            *([f"mech_function {plan.function};"] if plan else []),
            f"static void web_experiment({ARGUMENTS})",
            "{",
            "    (void)t, (void)y, (void)u, (void)z, (void)p, (void)out;",
            f"    {call};",
            "}\n",
        ]
    )


def _zig_version() -> str:
    from importlib.metadata import version

    return f"ziglang {version('ziglang')}"
