"""Words that mean nothing to a call are mistakes, wherever it takes words."""

from __future__ import annotations

from typing import Any

import pytest

import mechc
from mechc.requests.parse_values import UsageMistake

TEXT = "coordinate x = 1 m; kinetic 1/2*1 kg*der(x)^2; experiment(stop = 1 s);"
MODEL = mechc.loads(TEXT)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"target": "python"}, "there is no option 'target'"),
        ({"inputs": "push.csv"}, "'inputs' are tables or functions by the names of inputs, not 'push.csv'"),
        (
            {"inputs": {"push": 3.0}},
            "the input 'push' comes from a table or a function of the time, not from 3.0",
        ),
        ({"progress": "yes"}, "'progress' is called with the fraction done"),
        ({"experiment": 3}, "'experiment' is a name, not 3"),
        ({"set": "x"}, "'set' holds values by their names, not 'x'"),
        ({"estimate_error": "no"}, "'estimate_error' is True or False, not 'no'"),
    ],
)
@pytest.mark.parametrize("call", ["simulate", "sweep", "study"])
def test_words_of_a_study(call: str, given: dict[str, Any], words: str) -> None:
    with pytest.raises(UsageMistake) as caught:
        MODEL.study("virial", **given) if call == "study" else getattr(MODEL, call)(**given)
    said = str(caught.value)
    assert words in said or (call == "study" and "estimate_error" in said)


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: MODEL.problem(parts=("jacobain",)), "there is no part 'jacobain'; did you mean 'jacobian'?"),
        (lambda: MODEL.keeping({"other"}), "there is no part 'other'"),
        (lambda: mechc.loads(TEXT, keep={"other"}), "there is no part 'other'"),
        (
            lambda: mechc.loads(TEXT, keep="jacobian"),
            "parts are a collection of names, not the text 'jacobian'",
        ),
        (lambda: MODEL.compile("other"), "there is no target 'other'"),
    ],
)
def test_words_of_a_model(call: Any, words: str) -> None:
    with pytest.raises(UsageMistake) as caught:
        call()
    assert words in str(caught.value)


def test_words_that_mean_something_are_taken() -> None:
    assert mechc.loads(TEXT, keep={"compliance", "jacobian"}).simulate()["x"][-1] == 1
