"""A process beside the language server that answers what takes long, one question after another; it ends where the answer is
not wanted any more."""

from __future__ import annotations

import asyncio
import pickle
import sys
from asyncio.subprocess import PIPE, Process
from contextlib import suppress
from typing import Any

LONGEST = 60.0
"""Seconds after which a question is given up."""


class WorkerProcess:
    """The process of ``mechc.editor.worker_main``, begun when it is first asked, and again where it was ended.

    ``longest``: seconds after which an answer is given up; ``patient``: an answer that is not wanted any more is awaited all the
    same, where that takes less than to begin again.
    """

    def __init__(self, longest: float = LONGEST, *, patient: bool = False) -> None:
        self.longest = longest
        self.patient = patient
        self._process: Process | None = None
        self._ended: list[Process] = []
        self._turn = asyncio.Lock()

    async def ask(self, question: str, *arguments: object, **named: object) -> Any:
        """Return the answer of the process, None where it has none or takes too long."""
        answer = asyncio.ensure_future(self._ask(pickle.dumps((question, arguments, named))))
        try:
            return await asyncio.shield(answer)
        except asyncio.CancelledError:
            if not self.patient:
                answer.cancel()
            raise

    async def _ask(self, data: bytes) -> Any:
        async with self._turn:
            try:
                process = await self._running()
                assert process.stdin is not None
                process.stdin.write(data)
                await process.stdin.drain()
                async with asyncio.timeout(self.longest):
                    return pickle.loads(await _read(process))
            except (TimeoutError, OSError, EOFError):
                self.end()
                return None
            except BaseException:
                self.end()
                raise

    async def _running(self) -> Process:
        """Begin the process, and wait until it can answer; that is not a part of the time of an answer."""
        if self._process is None or self._process.returncode is not None:
            self._process = await asyncio.create_subprocess_exec(
                sys.executable, "-m", "mechc.editor.worker_main", stdin=PIPE, stdout=PIPE, limit=2**24
            )
            async with asyncio.timeout(LONGEST):
                await _read(self._process)
        return self._process

    def end(self) -> None:
        """End the process."""
        process, self._process = self._process, None
        if process is not None and process.returncode is None:
            with suppress(ProcessLookupError):
                process.kill()
            self._ended = [p for p in (*self._ended, process) if p.returncode is None]

    async def close(self) -> None:
        """End the process, and wait until it is gone."""
        self.end()
        for process in self._ended:
            await process.wait()


async def _read(process: Process) -> bytes:
    """Return what the process has written, without its length."""
    assert process.stdout is not None
    return await process.stdout.readexactly(int.from_bytes(await process.stdout.readexactly(8), "big"))
