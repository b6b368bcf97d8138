"""A page says how a run failed in the words of native runs."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest
from browsers import Opened, needs_browser

import mechc
from mechc.web.failures import failure_texts
from mechc.web.page import page

FAILING = {
    "restitution": """
model A
  parameter e = 1.5;
  coordinate x = 1 m;
  kinetic 1/2*1 kg*der(x)^2;
  potential 9.81 N*x;
  contact floor: x restitution e;
  experiment(stop = 2 s);
end A;
""",
    "a wall of infinite potential": """
model B
  coordinate x = 1 m;
  initial der(x) = -1 m/s;
  kinetic 1/2*1 kg*der(x)^2;
  force 1 N*sqrt(x/1 m - 0.5) on x;
  experiment(stop = 2 s);
end B;
""",
    "an assertion": """
model C
  coordinate x = 0 m;
  coordinate z = 0 m;
  initial der(x) = 1 m/s;
  kinetic 1/2*1 kg*(der(x)^2 + der(z)^2);
  assert z > -1 m, "too low";
  assert x < 0.5 m, "too far";
  experiment(stop = 2 s);
end C;
""",
    "of two contacts the second is penetrated": """
model D
  coordinate x = 1 m;
  coordinate z = -0.25 m;
  kinetic 1/2*1 kg*(der(x)^2 + der(z)^2);
  contact floor: x;
  contact wall: z;
  experiment(stop = 2 s);
end D;
""",
    "a branch asserts": """
model E
  coordinate x = 1 m;
  kinetic 1/2*1 kg*der(x)^2;
  potential 9.81 N*x;
  when x < 0.75 m then
    assert der(x) > 0 m/s, "falls";
  end when;
  when x < 0.5 m then
    assert der(x) > 0 m/s, "falls still";
  end when;
  experiment(stop = 2 s);
end E;
""",
}


@pytest.mark.parametrize("text", FAILING.values(), ids=FAILING)
def test_one_text_is_that_of_the_native_run_but_for_its_blanks(text: str) -> None:
    solution = mechc.loads(text).simulate()
    assert solution.failure is not None
    said = [t for t in failure_texts(solution.problem).values() if _fits(t, solution.failure.message)]
    assert len(said) == 1


def _fits(text: str, message: str) -> bool:
    pattern = re.sub(r"@\w+@", r"\\S+", re.escape(text).replace("'@name@'", r"'[^']+'"))
    return re.fullmatch(pattern, message) is not None


@needs_browser
def test_a_page_fills_the_blanks(browser: Any, tmp_path: Path) -> None:
    """Of many states the last acceleration is that of its coordinate, as the native run says it."""
    text = """
    structural parameter Integer n = 60;
    parameter h = 0.5;
    coordinate x[n] = {1 m for i in 1:n};
    initial der(x[n]) = -1 m/s;
    for i in 1:n loop kinetic 1/2*1 kg*der(x[i])^2; end for;
    force 1 N*sqrt(x[n]/1 m - h) on x[n];
    experiment(stop = 2 s);
    """
    model = mechc.loads(text)
    failure = model.simulate().failure
    assert failure is not None and "acceleration of 'x[60]'" in failure.message
    path = tmp_path / "page.html"
    path.write_text(page(model))
    tab = Opened(browser, path)
    shown = tab.ask("document.getElementById('failure').textContent")
    numbers = re.compile(r"\d+\.\d+(e-\d+)?")
    assert numbers.sub("#", shown) == numbers.sub("#", failure.message)
    assert tab.said == []
