"""``python -m bench.planted [--only WORD]``: plant faults, one at a time, and see what runs and stress say of them;
``--as-it-was``: run the models of former faults in the mechc that had them, and judge these runs by the rule of today."""

from __future__ import annotations

import argparse
import sys

from . import as_it_was, main

if __name__ == "__main__":
    given = argparse.ArgumentParser(prog="python -m bench.planted", description=__doc__)
    given.add_argument("--only", default="", metavar="WORD", help="faults whose words hold this")
    given.add_argument("--as-it-was", action="store_true", help="run the mechc that had the former faults")
    chosen = given.parse_args()
    sys.exit(as_it_was.main() if chosen.as_it_was else main(only=chosen.only))
