"""A question about many members as the workers of a cluster get it: the model as frozen stages, nothing of its files."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING

from msgspec import Struct
from msgspec.structs import replace

from .compiler.compilation import Compilation, Request
from .model import CompiledModel
from .requests.parse_values import Given
from .requests.request import Asked

if TYPE_CHECKING:
    from .runtime.ensembles.recipe import Recipe
    from .runtime.studies.study import Study

NOT_SENT = ("vary", "cluster", "workers", "store")
"""Settings that a worker has no use for, or that live here."""


class SentQuestion(Struct, frozen=True):
    """Gives the recipe of a question when it is called, wherever it is. ``form``: a function of a module, which forms it."""

    builds: Mapping[Request, dict[str, bytes]]
    """The model first, then what is made of it: their stages."""
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
        compilations = dict.fromkeys(one.compilation for one in (model, *builds))
        stages = {
            replace(one.request, search=(), remembered=False): one.stages(alone=True) for one in compilations
        }
        return SentQuestion(stages, model.stated, alone, replace(question, **here), form)

    def __call__(self) -> Recipe:
        arrived = {request: Compilation(request, stored=stages) for request, stages in self.builds.items()}
        for one in arrived.values():
            one.variants = arrived
        return self.form(
            CompiledModel(next(iter(arrived.values())), self.settings), self.asked, self.question
        )
