"""The command line: one module for each command, imported when it is asked for."""

from __future__ import annotations

import gc
import os
import signal
import sys
from collections.abc import Sequence

INTERRUPTED = 130
FEW_COLLECTIONS = 100_000
"""Objects after which Python looks for cycles: imports make many and leave none, and to look took a tenth of a short run."""


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line and leave the process with its exit code; Ctrl-C shows no traceback, however early."""
    gc.set_threshold(FEW_COLLECTIONS)
    try:
        if signal.getsignal(signal.SIGTERM) is signal.SIG_DFL:  # ends as Ctrl-C does: what exists is kept
            signal.signal(signal.SIGTERM, signal.default_int_handler)
        _open_missing_streams()
        from .main import run

        # read by NumPy when it is imported: on matrices as small as ours threads only wait for each other
        os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
        code = run(arguments)
    except KeyboardInterrupt:
        _ignore_signals()
        print("interrupted", file=sys.stderr)
        code = INTERRUPTED
    _ignore_signals()
    gc.freeze()  # on the way out nobody looks for cycles in what goes with the process
    sys.exit(code)


def _ignore_signals() -> None:
    """Let nothing interrupt the way out."""
    for one in (signal.SIGINT, signal.SIGTERM):
        signal.signal(one, signal.SIG_IGN)


def _open_missing_streams() -> None:
    """Let streams that whoever called has closed go nowhere, before a file that is opened takes their place."""
    for number, name, mode in ((0, "stdin", "r"), (1, "stdout", "w"), (2, "stderr", "w")):
        try:
            os.fstat(number)
        except OSError:
            descriptor = os.open(os.devnull, os.O_RDWR)
            if descriptor != number:
                os.dup2(descriptor, number)
                os.close(descriptor)
        if getattr(sys, name) is None:
            setattr(sys, name, open(number, mode, encoding="utf-8", closefd=False))  # noqa: SIM115


__all__ = ["main"]
