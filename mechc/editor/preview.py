"""A model beside its text: its page, the report of its run, and, while the text is wrong, why there is none."""

from __future__ import annotations

from pathlib import Path

from msgspec import Struct


class Preview(Struct, frozen=True):
    """``page`` and ``report`` are empty where ``message`` says what is wrong."""

    page: str = ""
    report: str = ""
    message: str = ""


def preview(path: Path, text: str, model: str | None = None) -> Preview:
    """Run a model of a text that may not be saved, and return its page."""
    from ..api import Model
    from ..exporting import refuse_driving_inputs
    from ..lang.diagnostics import CompileError
    from ..lang.source import SourceFile
    from ..model import model_of
    from ..presentation.report import report
    from ..requests.parse_values import UsageMistake
    from ..runtime.native.build import BuildError
    from ..runtime.outcome import SimulationError
    from ..web.page import page_of
    from ..web.run_facts import facts_of

    try:
        asked = model_of(Model, SourceFile(str(path), text), path.parent, model, {}, ("scene",))
        refuse_driving_inputs(asked, "a page")
        facts = facts_of(asked, {}, None, {})
        return Preview(page_of(facts), report(facts.solution))
    except CompileError as error:
        return Preview(message="\n\n".join(map(str, error.diagnostics)))
    except (SimulationError, UsageMistake, BuildError) as error:
        return Preview(message=str(error))
