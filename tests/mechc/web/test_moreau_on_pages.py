"""Steps of Moreau and Jean on pages, in ensembles and piece by piece: all move as the run does."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from browsers import Opened, needs_browser, off

import mechc
from mechc.web.page import page

CUBE = """\
model Cube
  parameter mu = 0.4;
  coordinate x = 0 m;
  coordinate y = 0.05 m;
  initial der(x) = 2 m/s;
  kinetic 1 kg*(der(x)^2 + der(y)^2)/2;
  potential 1 kg*(9.81 m/s^2)*y;
  contact floor: y restitution 0.5 friction mu along der(x);
  experiment(stop = 1 s, method = "moreau", step = 1 ms);
end Cube;
"""


@needs_browser
def test_a_page_steps_as_the_run_does(browser: Any, tmp_path: Path) -> None:
    model = mechc.loads(CUBE)
    path = tmp_path / "page.html"
    path.write_text(page(model), encoding="utf-8")
    shown = Opened(browser, path)
    assert off(shown, model.simulate()) < 1e-9
    shown.set("mu", 0.2)
    assert off(shown, model.simulate(set={"mu": 0.2})) < 1e-9
    assert shown.said == []


def test_members_and_pieces_of_a_run_have_its_values() -> None:
    model = mechc.loads(CUBE)
    many = model.ensemble(vary={"mu": [0.2, 0.3, 0.5]}, keep="final(x)")
    single = [model.simulate(set={"mu": mu})["x"][-1] for mu in (0.2, 0.3, 0.5)]
    np.testing.assert_allclose(np.asarray(many["final(x)"]).ravel(), single, rtol=1e-12)
    env = model.env(0.01, method="moreau", substeps=10)
    for _ in range(100):
        env.step()
    np.testing.assert_allclose(env.q, [model.simulate()[name][-1] for name in ("x", "y")], atol=1e-12)
