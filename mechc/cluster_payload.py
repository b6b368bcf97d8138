"""A question about many members as the workers of a cluster get it: the model as frozen stages, nothing of its files."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from msgspec import Struct
from msgspec.structs import replace

from .compiled import Code, Exact
from .compiler.compilation import StoredCompilation, stages_of
from .lang.source import SourceFile
from .model import CompiledModel
from .requests.parse_values import Given
from .requests.request import Asked

if TYPE_CHECKING:
    from .runtime.ensembles.recipe import Recipe
    from .runtime.studies.study import Study

NOT_SENT = ("vary", "cluster", "workers", "store")
"""Settings that a worker has no use for, or that live here."""


class Frozen(Struct, frozen=True):
    """A compilation as bytes, and those with other parts and with formulas that a question takes beside it."""

    name: str
    text: str
    model: str | None
    structural: dict[str, Exact]
    keep: frozenset[str]
    formulas: tuple[tuple[str, str], ...]
    stages: dict[str, bytes]
    kept: dict[frozenset[str], Frozen]
    asked: dict[tuple[tuple[str, str], ...], Frozen]

    @staticmethod
    def of(code: Code, *besides: Code) -> Frozen:
        """Freeze a compilation with those of ``besides`` that are made of it."""

        def chosen(made: dict[Any, Code]) -> dict[Any, Frozen]:
            return {key: Frozen.of(one, *besides) for key, one in made.items() if one in besides}

        return Frozen(
            code.source.name,
            code.source.text,
            code.model,
            code.structural,
            code.keep,
            code.formulas,
            stages_of(code.compilation),
            chosen(code.kept),
            chosen(code.asked),
        )

    def thawed(self) -> Code:
        """Return the compilation. Raises OtherVersion where another version of the compiler made it."""
        source = SourceFile(self.name, self.text)
        compilation = StoredCompilation(source, self.stages, self.keep)
        code = Code(
            source, Path(), self.model, self.structural, compilation, self.keep, formulas=self.formulas
        )
        code.kept.update({parts: one.thawed() for parts, one in self.kept.items()})
        code.asked.update({formulas: one.thawed() for formulas, one in self.asked.items()})
        return code


class SentQuestion(Struct, frozen=True):
    """Gives the recipe of a question when it is called, wherever it is. ``form``: a function of a module, which forms it."""

    code: Frozen
    settings: dict[str, Given]
    asked: Asked
    question: Study
    form: Callable[[CompiledModel, Asked, Study], Recipe]

    @staticmethod
    def of(
        model: CompiledModel,
        builds: Sequence[CompiledModel],
        asked: Asked,
        question: Study,
        form: Callable[[CompiledModel, Asked, Study], Recipe],
    ) -> SentQuestion:
        """Freeze a model with those of its ``builds`` that the question takes."""
        given = {name: what for name, what in asked.given.items() if name not in NOT_SENT}
        alone = replace(asked, given=given, inputs={}, progress=None)
        here = {
            "vary": (),
            "others": (),
            "make_lanes": None,
            "make_items": None,
            "send": None,
            "progress": None,
            "cluster": None,
        }
        frozen = Frozen.of(model.code, *(build.code for build in builds))
        return SentQuestion(frozen, model.stated, alone, replace(question, **here), form)

    def __call__(self) -> Recipe:
        return self.form(CompiledModel(self.code.thawed(), self.settings), self.asked, self.question)
