"""How many random models end as doubtful: ``python -m random_models.doubts 0 2000``.

Each is run once, by the method and at the tolerance that a user gets. As the same models agree with the definition of the
language, a run that contradicts its own estimate is a false alarm, unless the estimate is wrong.
"""

from __future__ import annotations

import os
import sys
import warnings
from collections import Counter

import mechc
from mechc.runtime.native.cache import prune_cache
from random_models.campaign import FOLDER
from random_models.generator import generate
from random_models.limits import TooLong, limited

STOP = 1.0
_SECONDS = 30
_KEPT = 50_000_000


def outcome(seed: int) -> tuple[str, str]:
    """Run the model of a seed; say how it ended, and in which words."""
    try:
        with limited(_SECONDS), warnings.catch_warnings():
            warnings.simplefilter("ignore")
            run = mechc.loads(generate(seed).text()).simulate(stop=STOP)
    except TooLong:
        return "too long", ""
    except (mechc.CompileError, mechc.SimulationError, mechc.UsageMistake) as error:
        return "refused", str(error).splitlines()[0]
    checked = run.accuracy.error is not None
    return (
        run.outcome.value if checked or run.outcome.value == "failed" else "without an estimate",
        run.message,
    )


def main(first: int, last: int) -> int:
    """Count how runs end; print what is doubtful. The exit code is 1 if more than one in a thousand is."""
    os.environ.setdefault("MECHC_CACHE", str(FOLDER / "doubts_cache"))
    counts: Counter[str] = Counter()
    for seed in range(first, last):
        how, words = outcome(seed)
        counts[how] += 1
        if how == "doubtful":
            print(f"{seed}: {words}", flush=True)
        if seed % 100 == 99:
            prune_cache(_KEPT)
            print(f"{seed + 1}: {dict(counts)}", flush=True)
    judged = counts["completed"] + counts["terminated"] + counts["doubtful"]
    print(f"{counts['doubtful']} of {judged} runs that ended are doubtful; {dict(counts)}")
    return int(counts["doubtful"] > judged / 1000)


if __name__ == "__main__":
    sys.exit(main(int(sys.argv[1]), int(sys.argv[2])))
