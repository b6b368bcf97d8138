"""One file that shows a model move: its picture, curves and sliders, with the model itself as WebAssembly inside."""

from __future__ import annotations

import html
import json
import math
import re
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mechc.compiler.pipeline import program_with
from mechc.compiler.targets.wasm.link import Linked, linked
from mechc.exporting import refuse_driving_inputs, with_own_sizes
from mechc.requests.parse_values import UsageMistake
from mechc.runtime.methods import parts_for

from .facts import PageFacts
from .kernels import loaded
from .packed import packed

if TYPE_CHECKING:
    from mechc.compiler.program.model import Program
    from mechc.model import CompiledModel
    from mechc.requests.parse_values import Given

    from .run_facts import RunFacts

HERE = Path(__file__).parent
MARK = "<!-- a page of mechc -->"
"""Stands at the beginning of every page."""

PARTS = {2: ("plane.js",), 3: ("math.js", "meshes.js", "space.js")}


def page(
    model: CompiledModel,
    *,
    recorded: bool = False,
    set: Mapping[str, Given] | None = None,
    experiment: str | None = None,
    options: Mapping[str, Any] | None = None,
) -> str:
    """Return the text of a page. ``recorded``: with the motion in it instead of the model. ``options``: those of the
    run (``api.Options``).

    Raises SimulationError where the run cannot begin, BuildError, UsageMistake for a curve and for an input that drives without a table.
    """
    given = {"estimate_error": recorded, **(options or {})}  # live pages estimate their own errors
    return page_of(run_for_page(model, set or {}, experiment, given), recorded=recorded)


def run_for_page(
    model: CompiledModel, set: Mapping[str, Given], experiment: str | None, options: Mapping[str, Any]
) -> RunFacts:
    """Run a model for its page. Raises what ``page`` raises."""
    from .run_facts import facts_of  # it brings NumPy

    refuse_curve(model)
    refuse_driving_inputs(model, "a page", options.get("inputs") or ())
    return facts_of(model.keeping({*model.compilation.parts, "scene"}), set, experiment, options)


def refuse_curve(model: CompiledModel) -> None:
    """Refuse what does not move. Raises UsageMistake."""
    if model.compilation.equations.curve is not None:
        raise UsageMistake(
            f"'{model.name}' is a curve and does not move: a page shows motions",
            "'mechc run' with --plot curve.png draws it",
        )


def page_of(facts: RunFacts, *, recorded: bool = False) -> str:
    """Return the text of the page of a model that was run. Raises what ``page`` raises."""
    info = facts.told(recorded=recorded)
    if recorded:
        return joined(facts, info, {"rows": packed(facts.rows()), **equations_of(facts)})
    return joined(facts, info, {"wasm": packed(module_of_run(facts).module), **equations_of(facts)})


def module_of_run(facts: RunFacts) -> Linked:
    """Return the module that a page runs, with the sizes of a native run."""
    return module_of(facts, with_own_sizes(program_of(facts), facts.solution))


def program_of(facts: PageFacts) -> Program:
    """Return the program of a model with what its method works on."""
    compilation = facts.model.compilation
    return program_with(compilation, {*compilation.parts, *parts_for(facts.method)})


def module_of(facts: PageFacts, program: Program) -> Linked:
    """Return the module that a page runs."""
    name = facts.experiment.name if facts.experiment else None
    return linked(program, loaded(facts.kernel), name)


MOST_OPERATIONS, MOST_SIGNS = 500, 60_000
"""Of all functions of a model whose equations a page shows, and of these: nobody reads larger ones, and they take long to be printed."""


def equations_of(facts: PageFacts) -> dict[str, str]:
    """Return the part of a page that holds the equations of motion and what they keep constant, typeset; none of large models."""
    compilation, problem = facts.model.compilation, facts.problem
    if compilation.summary.operations > MOST_OPERATIONS:
        return {}
    from mechc.compiler.symbolic.layouts import sections_html  # it brings SymPy

    sections = sections_html(compilation.system, "h4")
    if len(sections) > MOST_SIGNS:
        return {}
    total, *changes = problem.energy_balance or (-1, -1)
    constant = dict.fromkeys((*problem.conserved, *((total,) if total >= 0 and set(changes) == {-1} else ())))
    kept = ", ".join(problem.outputs[k].name for k in constant)
    told = f"<p>Constant along every motion: {html.escape(kept)}.</p>" if kept else ""
    return {"equations": packed(f"{sections}{told}".encode())}


def joined(facts: PageFacts, info: dict[str, object], parts: Mapping[str, object]) -> str:
    """Return the text of a page that holds ``parts``."""
    size = facts.scene.size if facts.scene.shapes else 2
    held = {"scripts": _scripts(size), "info": packed(as_json(info).encode())}
    texts = {
        "TITLE": html.escape(facts.model.name),
        "DOC": html.escape(facts.model.doc),
        "PARTS": json.dumps({**held, **parts}),
    }
    return re.sub(r"@([A-Z]+)@", lambda m: texts[m[1]], _frame_of_page())


@cache
def _frame_of_page() -> str:
    """Return the text of a page around what it holds, its first script as short as those that are packed."""
    return SCRIPT.sub(lambda found: squeezed(COMMENTS.sub("", found[0])), page_text("page.html"), count=1)


@cache
def _scripts(size: int) -> str:
    """Return the controls, the style and the scripts of pages of a plane or space, packed; workers are made of the text of the engine."""
    code = "\n".join(page_text(name) for name in ("links.js", "plot.js", *PARTS[size], "hand.js", "page.js"))
    texts = {"style": page_text("page.css"), "engine": page_text("engine.js"), "code": code}
    short = {name: squeezed(COMMENTS.sub("", text), style=name == "style") for name, text in texts.items()}
    return packed(json.dumps({"controls": page_text("controls.html"), **short}).encode())


COMMENTS = re.compile(r"^ *(//[^\n]*\n|/\*\*.*?\*/\n|)|  // [^\n'\"`]*$", re.MULTILINE | re.DOTALL)
"""Those that have their lines to themselves, those at ends of lines, and what lines begin with."""

SPACES = re.compile(
    r"""^.*/[\[`].*$"""
    r"""|('(?:[^'\\\n]|\\.)*'|"(?:[^"\\\n]|\\.)*"|`(?:[^`$]|\$(?!\{)|\$\{(?:[^`{}]|\{[^`{}]*\}|`[^`]*`)*\})*`)"""
    r"""| ?([=*<>?:,;{}()&|]+) ?|(?<=[\w)\]]) ([-+/]) (?=[\w(\[])""",
    re.MULTILINE,
)
"""Beside signs; texts and templates stay as they are, and so do lines with a search for brackets or marks of templates."""
SPACES_OF_STYLE = re.compile(r" ?([{}]) ?|([:;,]) ")

LINE_ENDS = re.compile(r"(?<=[;{,(\[])\n|(?<=[}\]])\n(?=[}\])])")
"""Where no statement can end."""

SCRIPT = re.compile(r"(?<=<script>)\n.*?(?=</script>)", re.DOTALL)


def squeezed(text: str, *, style: bool = False) -> str:
    """Return a script without comments, or a style, without spaces and signs that it does not need."""
    if style:
        return SPACES_OF_STYLE.sub(r"\1\2", text).replace("}\n", "}").replace(";}", "}")
    short = SPACES.sub(lambda found: found[2] or found[3] or found[0], text)
    return LINE_ENDS.sub("", short).replace(";}", "}").replace("const ", "let ")


def page_text(name: str) -> str:
    """Return a file of the page."""
    return (HERE / name).read_text(encoding="utf-8")


def as_json(info: dict[str, object]) -> str:
    """Return data as JSON: what is not a number is null."""
    return json.dumps(_finite(info), ensure_ascii=False, separators=(",", ":"), allow_nan=False)


def _finite(value: object) -> object:
    if isinstance(value, dict):
        return {name: _finite(x) for name, x in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(x) for x in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
