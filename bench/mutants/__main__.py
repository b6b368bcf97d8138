"""``python -m bench.mutants [--only WORD]``: apply faults, one at a time, and see what runs and stress say of them."""

from __future__ import annotations

import argparse
import sys

from . import main

if __name__ == "__main__":
    given = argparse.ArgumentParser(prog="python -m bench.mutants", description=__doc__)
    given.add_argument("--only", default="", metavar="WORD", help="faults whose words hold this")
    sys.exit(main(only=given.parse_args().only))
