"""What moving pages have in common, once for all pages of a folder: their code is one script, each kernel another.

A page of ``mechc view`` is whole: 100 kB and more, of which a few are the model's. On the site it holds what is its own.
"""

from __future__ import annotations

import hashlib
import json
import re
from pathlib import Path

from mechc.web.kernels import KERNELS, WebKernel, loaded
from mechc.web.packed import packed, unpacked

LIVE = re.compile(
    r"<script>\n(?P<head>const DIGITS.*?)</script>\n<script>\nbegin\((?P<parts>\{.*?\})\);\n",
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


def write_live(page: Path, target: Path) -> None:
    """Write a page into a folder, and beside it what it shares with others."""
    text = page.read_text(encoding="utf-8")
    live = LIVE.search(text)
    assert live is not None, page.name
    parts = json.loads(live["parts"])
    code = live["head"] + CODE.replace("@TEXTS@", unpacked(parts.pop("scripts")).decode())
    scripts = [f"code-{hashlib.sha256(code.encode()).hexdigest()[:8]}.js"]
    _write_once(target.parent / scripts[0], code)
    kernel, own, pieces = taken_apart(unpacked(parts["wasm"]))
    scripts.append(f"kernel-{kernel.name}.js")
    _write_once(target.parent / scripts[1], f"const KERNEL = '{packed(kernel.file.read_bytes())}';\n")
    asked = "".join(f'<script src="{name}"></script>\n' for name in scripts)
    shared = json.dumps(parts | {"wasm": {"own": packed(own), "pieces": pieces}}, separators=(",", ":"))
    own_text = f"{asked}<script>\nbegin({shared});\n"
    text = text[: live.start()] + own_text + text[live.end() :]
    target.write_text(text.replace(POLICY, f"{POLICY} 'self' file:", 1), encoding="utf-8", newline="\n")


def taken_apart(module: bytes) -> tuple[WebKernel, bytes, list[tuple[int, int, int]]]:
    """Return the kernel of a module, what else is in it, and the pieces of both in order: which (the kernel is 0), begin, end."""
    for kernel in KERNELS:
        bodies = [body[5:] for body in loaded(kernel).parts.values()]  # after the number of items
        if all(body in module for body in bodies):
            break
    else:
        raise AssertionError("a module without a kernel")
    alone = kernel.file.read_bytes()
    own, pieces, done = b"", [], 0
    for at, body in sorted((module.index(body), body) for body in bodies if len(body) > 100):
        begin = alone.index(body)
        pieces += [(1, len(own), len(own) + at - done), (0, begin, begin + len(body))]
        own += module[done:at]
        done = at + len(body)
    pieces.append((1, len(own), len(own) + len(module) - done))
    return kernel, own + module[done:], pieces


def _write_once(path: Path, text: str) -> None:
    if not path.exists():
        path.write_text(text, encoding="utf-8", newline="\n")
