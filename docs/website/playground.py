"""Build the playground into a folder of the site: ``playground.html``, and beside it Python (Pyodide) and mechc as data.

The data stand in scripts, not in files that a page would have to fetch: so it works from every host, and from the file system.
Pyodide and msgspec are fetched by npm and pip, of one version each, and compared with their checksums.
"""

from __future__ import annotations

import base64
import gzip
import hashlib
import io
import json
import re
import subprocess
import sys
import tarfile
import zipfile
from collections.abc import Iterator, Mapping
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
SOURCE = HERE / "playground"

sys.path.insert(0, str(HERE.parent))

from mechc.editor.completion import COMMON_UNITS  # noqa: E402
from mechc.lang.builtins import BUILTINS  # noqa: E402
from mechc.lang.grammar import keywords, tables  # noqa: E402
from mechc.lang.units import UNIT_NAMES  # noqa: E402
from mechc.web.page import page_text  # noqa: E402

PYODIDE = "314.0.7"
PYODIDE_SHA512 = "0YvXxEhfEdpLfb/XkM2BFAeMROq0iMUX2bzzH9pOttyMcWkwq+HbE5uyuGD82LN7y2q+SNvi/6V5JEsOlD2R1A=="
MSGSPEC = "0.22.0"
MSGSPEC_SHA256 = "a66b1766311e42371e509c996c3933b161c7ae0eabdf361af5316dec197e1022"
PLATFORM = ("--platform", "pyemscripten_2026_0_wasm32", "--python-version", "314", "--abi", "cp314")
"""Of wheels for this Pyodide."""

OF_PYODIDE = ("pyodide.mjs", "pyodide.asm.mjs", "pyodide.asm.wasm", "python_stdlib.zip")

PACKED = {
    "mechc": "mechc",
    "lang": "mechc/lang",
    "compiler": "mechc/compiler",
    "runtime": "mechc/runtime",
    "stdlib": "mechc/stdlib",
}
"""Folders of the repository and where they stand in the browser."""

STAND_IN = SOURCE / "stand_in"
"""Modules instead of libraries that have no wheel for Pyodide among those that pip finds."""

LEFT_OUT = (
    "mechc/errors",
    "mechc/fmu",
    "mechc/measurement",
    "mechc/cli",
    "mechc/runtime/kernel",
    "mechc/compiler/symbolic",
)

EXAMPLES = (
    *(
        "double_pendulum",
        "bouncing_ball",
        "four_bar",
        "pendulum",
        "lagrange_top",
        "newtons_cradle",
        "kepler",
        "rolling_coin",
    ),
    *(
        "slider_crank",
        "pleiades",
        "cart_pendulum",
        "dzhanibekov",
        "squeezing_mechanism",
        "stick_slip_belt",
        "string_pendulum",
    ),
    *("cone", "van_der_pol", "lorenz", "thermostat"),
)
"""To start from."""


class Mismatch(Exception):
    """What was fetched is not what it should be."""


def write_playground(folder: Path, downloads: Path) -> None:
    """Write all files of the playground into a folder. Raises Mismatch, OSError, CalledProcessError."""
    folder.mkdir(parents=True, exist_ok=True)
    pyodide, msgspec_wheel = fetched(downloads)
    (folder / "python.js").write_text(_script("python", _python(pyodide)), encoding="utf-8")
    data = {"mechc": _packed(archive()), "msgspec": _packed(msgspec_wheel)}
    (folder / "mechc.js").write_text(
        _script("mechc", {"data": data, "examples": examples()}), encoding="utf-8"
    )
    (folder / "playground.html").write_text(page(), encoding="utf-8")


def fetched(downloads: Path) -> tuple[bytes, bytes]:
    """Return Pyodide's package and msgspec's wheel, fetched once."""
    downloads.mkdir(parents=True, exist_ok=True)
    package = downloads / f"pyodide-{PYODIDE}.tgz"
    if not package.exists():
        subprocess.run(
            ["npm", "pack", "--silent", f"pyodide@{PYODIDE}"],
            cwd=downloads,
            check=True,
            stdout=subprocess.DEVNULL,
        )
    wheel = downloads / f"msgspec-{MSGSPEC}-cp314-cp314-pyemscripten_2026_0_wasm32.whl"
    if not wheel.exists():
        pip = [sys.executable, "-m", "pip", "download", "--quiet", "--disable-pip-version-check"]
        asked = [
            f"msgspec=={MSGSPEC}",
            "--no-deps",
            "--only-binary=:all:",
            *PLATFORM,
            "--dest",
            str(downloads),
        ]
        subprocess.run([*pip, *asked], check=True)
    found = package.read_bytes(), wheel.read_bytes()
    sums = base64.b64encode(hashlib.sha512(found[0]).digest()).decode(), hashlib.sha256(found[1]).hexdigest()
    for path, is_, should in ((package, sums[0], PYODIDE_SHA512), (wheel, sums[1], MSGSPEC_SHA256)):
        if is_ != should:
            raise Mismatch(f"{path.name} has the checksum {is_}, not {should}")
    return found


def _python(package: bytes) -> dict[str, str]:
    read: dict[str, bytes] = {}
    with tarfile.open(fileobj=io.BytesIO(package)) as files:
        for name in (*OF_PYODIDE, "pyodide-lock.json"):
            file = files.extractfile(f"package/{name}")
            assert file is not None, name
            read[name] = file.read()
    lock = json.loads(read.pop("pyodide-lock.json"))
    return {
        **{name: _packed(data) for name, data in read.items()},
        "lock": json.dumps({"info": lock["info"], "packages": {}}),
    }


def archive() -> bytes:
    """Return mechc's sources, with the parser's tables, as a zip without compression."""
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w") as written:
        for name, data in sorted(_sources()):
            written.writestr(zipfile.ZipInfo(name), data)
    return file.getvalue()


def _sources() -> Iterator[tuple[str, bytes]]:
    for folder, place in PACKED.items():
        for path in (ROOT / folder).rglob("*"):
            name = f"{place}/{path.relative_to(ROOT / folder).as_posix()}"
            links = folder == "mechc" and any(
                name.startswith(f"{p}/") for p in PACKED.values() if p != "mechc"
            )
            if (
                path.suffix in (".py", ".mech", ".lark", ".js", ".css", ".html", ".wasm")
                and not links
                and not name.startswith(LEFT_OUT)
            ):
                yield name, path.read_bytes()
    yield from ((p.relative_to(STAND_IN).as_posix(), p.read_bytes()) for p in STAND_IN.rglob("*.py"))
    yield from ((f"mechc/lang/grammar/{name}", data) for name, data in tables.kept_tables().items())


def page() -> str:
    """Return the text of the playground."""
    texts = {
        "STYLE": _text("playground.css"),
        "ENGINE": page_text("engine.js"),
        "WORKER": _text("worker.js"),
        "WORDS": json.dumps(words()),
        "CODE": _text("playground.js"),
    }
    return re.sub(r"@([A-Z]+)@", lambda m: texts[m[1]], _text("playground.html"))


def words() -> dict[str, list[str]]:
    """Return what is coloured, by kind."""
    lists = (
        keywords.CLAUSES,
        keywords.ACTIONS,
        keywords.STEPS,
        keywords.STATEMENTS,
        keywords.DEFINITIONS,
        keywords.EXPRESSIONS,
    )
    return {
        "keywords": sorted({word for listed in lists for word in listed}),
        "functions": sorted(BUILTINS),
        "units": sorted({*UNIT_NAMES, *(unit for unit in COMMON_UNITS if unit.isalpha())}),
    }


def examples() -> dict[str, str]:
    return {name: (ROOT / "examples" / f"{name}.mech").read_text(encoding="utf-8") for name in EXAMPLES}


def _text(name: str) -> str:
    return (SOURCE / name).read_text(encoding="utf-8")


def _packed(data: bytes) -> str:
    return base64.b64encode(gzip.compress(data, 6, mtime=0)).decode()


def _script(name: str, data: Mapping[str, object]) -> str:
    return f"playgroundData({json.dumps(name)}, {json.dumps(data)});\n"
