"""What moving pages have in common, once for all pages of a folder: their code is one script, each kernel another.

A page of ``mechc view`` is whole: 100 kB and more, of which a few are the model's. On the site it holds what is its own.
"""

from __future__ import annotations

import hashlib
import json
import re
from functools import cache
from pathlib import Path

from mechc.web.kernels import WebKernel, loaded
from mechc.web.packed import packed, unpacked
from mechc.web.page import equations_of, joined, module_of_run
from mechc.web.run_facts import RunFacts

LIVE = re.compile(
    r"<script>\n(?P<head>async function unpack.*?)</script>\n<script>\nbegin\((?P<parts>\{.*?\})\);\n",
    re.DOTALL,
)
POLICY = "script-src 'unsafe-inline'"

CODE = """add(@TEXTS@);
const whole = unpack;
unpack = async part => {
  if (typeof part === 'string') return whole(part);
  const {own, pieces} = part;
  const from = [new Uint8Array(await whole(KERNEL)), new Uint8Array(await whole(own))];
  return new Blob(pieces.map(([which, at, end]) => from[which].subarray(at, end))).arrayBuffer();
};
"""
"""The scripts of a page by their names: the text of the engine is asked for, since a worker is made of it."""


def write_live(facts: RunFacts, target: Path) -> None:
    """Write the page of a model that was run into a folder, and beside it what it shares with others."""
    own, pieces = taken_apart(module_of_run(facts).module, facts.kernel)
    module = {"own": packed(own), "pieces": pieces}
    text = joined(facts, facts.told(recorded=False), {"wasm": module, **equations_of(facts)})
    live = LIVE.search(text)
    assert live is not None, target.name
    parts = json.loads(live["parts"])
    scripts = (_code(live["head"], parts.pop("scripts")), _kernel(facts.kernel))
    for name, script in scripts:
        if not (target.parent / name).exists():
            (target.parent / name).write_text(script, encoding="utf-8", newline="\n")
    asked = "".join(f'<script src="{name}"></script>\n' for name, _ in scripts)
    own_text = f"{asked}<script>\nbegin({json.dumps(parts, separators=(',', ':'))});\n"
    text = text[: live.start()] + own_text + text[live.end() :]
    target.write_text(text.replace(POLICY, f"{POLICY} 'self' file:", 1), encoding="utf-8", newline="\n")


def shared_by(text: str) -> set[str]:
    """Return the names of the files that a page needs beside it."""
    return set(re.findall(r'^<script src="([^"]+)"', text, re.MULTILINE))


@cache
def _code(head: str, scripts: str) -> tuple[str, str]:
    """Return the name and the text of the script of pages."""
    code = head + CODE.replace("@TEXTS@", unpacked(scripts).decode())
    return f"code-{hashlib.sha256(code.encode()).hexdigest()[:8]}.js", code


@cache
def _kernel(kernel: WebKernel) -> tuple[str, str]:
    """Return the name and the text of the script with a kernel."""
    return f"kernel-{kernel.name}.js", f'const KERNEL = "{packed(kernel.file.read_bytes())}";\n'


def taken_apart(module: bytes, kernel: WebKernel) -> tuple[bytes, list[tuple[int, int, int]]]:
    """Return what a module has beside its kernel, and the pieces of both in order: which (the kernel is 0), begin, end."""
    bodies = [body[5:] for body in loaded(kernel).parts.values()]  # after the number of items
    alone = kernel.file.read_bytes()
    own, pieces, done = b"", [], 0
    for at, body in sorted((module.index(body), body) for body in bodies if len(body) > 100):
        begin = alone.index(body)
        pieces += [(1, len(own), len(own) + at - done), (0, begin, begin + len(body))]
        own += module[done:at]
        done = at + len(body)
    pieces.append((1, len(own), len(own) + len(module) - done))
    return own + module[done:], pieces
