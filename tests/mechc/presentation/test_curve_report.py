"""The report of curves holds all that the model gives as an output."""

from __future__ import annotations

import mechc
from mechc.presentation.curve_report import curve_report

LINE = """model Line
  independent x from 0 m to b;
  parameter b = 1 m;
  coordinate y ~ x;
  initial y = 0 m;
  final y = 2 m;
  stationary integral(1/2*der(y)^2);
  output z[7] = {i*integral(der(y)) for i in 1:7};
  experiment two(b in {1, 2} m);
end Line;
"""


def test_the_table_of_several_curves_has_all_outputs_with_their_units() -> None:
    """The integral of the slope is the rise, 2 m."""
    rows = curve_report(mechc.loads(LINE).solve(experiment="two")).splitlines()
    assert rows[2].split()[5:] == [part for i in range(1, 8) for part in (f"z[{i}]", "[m]")]
    for row in rows[3:]:
        assert row.split()[-7:] == [str(2 * i) for i in range(1, 8)]
