"""Build the site into build/website/site: ``make docs``, or ``python docs/website/build.py [--no-live] [EXAMPLE ...]``.

The pages of the repository, one for each example with its source beside a page on which it moves, one for each message,
the names of the Python interface, all by MkDocs, and the playground; it opens from the file system and asks no server for anything.
Those whose model and mechc have not changed are kept.
"""

from __future__ import annotations

import argparse
import gc
import hashlib
import html
import os
import pydoc
import re
import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from pathlib import Path
from typing import Any

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
BUILD = ROOT / "build" / "website"
PAGES, LIVE, DRAWN, NAMED = BUILD / "pages", BUILD / "live", BUILD / "diagrams", BUILD / "named"

sys.path.insert(0, str(HERE.parent))
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # as the command line does: a second thread only waits

import diagrams  # noqa: E402
import figures  # noqa: E402
from own_installation import require_own_installation  # noqa: E402

import mechc  # noqa: E402
from mechc.presentation.curve_plots import save_curve  # noqa: E402
from mechc.runtime.native.libtcc import find_libtcc  # noqa: E402
from mechc.web.page import run_for_page  # noqa: E402
from website.links import moved  # noqa: E402
from website.playground import Mismatch, write_playground  # noqa: E402
from website.shared import shared_by, write_live  # noqa: E402
from website.thumbnails import write_thumbnail  # noqa: E402

HOME = "double_pendulum"
"""The example that moves on the first page, in place of its film."""

NAMES = """# Names of the Python interface

::: mechc.api.load

::: mechc.api.loads

::: mechc.api.Model

::: mechc.solution.Solution

::: mechc.requests.parse_values.UsageMistake

::: mechc.lang.diagnostics.CompileError

::: mechc.runtime.outcome.SimulationError
"""


def places() -> dict[str, str]:
    """Return, for each path in the repository that the site has, the path there."""
    found = {"README.md": "index.md", "CHANGELOG.md": "changes.md", "ARCHITECTURE.md": "architecture.md"}
    found["CITATION.cff"] = "CITATION.cff"
    found |= {
        "CONTRIBUTING.md": "contributing.md",
        "SECURITY.md": "security.md",
        "bench/report/README.md": "figures.md",
    }
    found |= {f"mechc/errors/{page.name}": f"errors/{page.name}" for page in errors()}
    for path in tracked("docs", "bench/report"):
        if path.suffix in (".md", ".png", ".svg", ".gif"):
            name = path.as_posix()
            found.setdefault(name, name.removeprefix("docs/").replace("bench/report/", "figures/"))
    for path in tracked("examples"):
        if path.suffix == ".mech":
            found[path.as_posix()] = f"gallery/{example_name(path)}.md"
    found["docs/decisions"] = "decisions/README.md"
    return found


def tracked(*folders: str) -> list[Path]:
    """Return the files of folders that are kept in the repository (all of them where it has no history)."""
    listed = subprocess.run(
        ["git", "ls-files", *folders], cwd=ROOT, capture_output=True, text=True, check=False
    ).stdout
    if listed:
        return [Path(line) for line in listed.splitlines()]
    return sorted(p.relative_to(ROOT) for f in folders for p in (ROOT / f).rglob("*") if p.is_file())


def errors() -> list[Path]:
    return sorted((ROOT / "mechc" / "errors").glob("[A-Z][0-9]*.md"))


def example_name(path: Path) -> str:
    """Name an example's page; those in folders carry the folder's name, too."""
    return "_".join(path.with_suffix("").parts[1:])


def write_pages(live: Mapping[str, Path], drawn: Mapping[str, Path] | None = None) -> None:
    """Write all pages; ``live`` has the moving page of each example that has one, ``drawn`` the diagrams of parts."""
    drawn = drawn or {}
    shutil.rmtree(PAGES, ignore_errors=True)
    known = places()
    for source, place in known.items():
        path, target = ROOT / source, PAGES / place
        target.parent.mkdir(parents=True, exist_ok=True)
        if path.suffix == ".md":
            text = moved(path.read_text(encoding="utf-8"), source, known)
            if source == "docs/library.md":
                text = diagrams.illustrated(text, drawn, "diagrams")
            if source == "docs/gallery.md" and live:
                text = gallery(live)
            if source == "README.md" and HOME in live:
                text = re.sub(
                    r"^!\[.*\]\(.*moving_double_pendulum.gif\)$", frame(HOME, "live"), text, flags=re.M
                )
            target.write_text(text, encoding="utf-8")
        elif path.suffix == ".mech":
            target.write_text(example_page(path, live), encoding="utf-8")
        elif path.is_file():
            shutil.copyfile(path, target)
    (PAGES / "names.md").write_text(NAMES, encoding="utf-8")
    write_named()
    (PAGES / "decisions" / "README.md").write_text(decisions(), encoding="utf-8")
    for name in ("website.css", "tables.js", "worker.js"):
        shutil.copyfile(HERE / name, PAGES / name)
    (PAGES / "diagrams").mkdir()
    for name, path in drawn.items():
        shutil.copyfile(path, PAGES / "diagrams" / f"{name}.svg")
    (PAGES / "live").mkdir()
    shared: set[str] = set()
    for name, page in live.items():
        target = PAGES / "live" / f"{name}{page.suffix}"
        for picture in thumbnails(page):
            shutil.copyfile(picture, target.with_suffix(picture.suffix))
        shutil.copyfile(page, target)
        if page.suffix == ".html":
            shared |= shared_by(page.read_text(encoding="utf-8"))
    for script in shared:
        shutil.copyfile(LIVE / script, PAGES / "live" / script)


def write_named() -> None:
    """Write the modules of what names.md names, and of its bases, alone: mkdocstrings reads all of the package that it is given."""
    shutil.rmtree(NAMED, ignore_errors=True)
    found = [pydoc.locate(name) for name in re.findall(r"^::: (\S+)$", NAMES, re.M)]
    classes = [one for of in found for one in (of.__mro__ if isinstance(of, type) else (of,))]
    modules = {one.__module__ for one in classes if one.__module__.startswith("mechc.")}
    for module in sorted(modules):
        place = Path(*module.split("."))
        for file in (*(folder / "__init__.py" for folder in place.parents[:-1]), place.with_suffix(".py")):
            (NAMED / file).parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(ROOT / file, NAMED / file)


def add_playground() -> None:
    """Write the playground among the pages, or say why there is none."""
    try:
        write_playground(PAGES / "playground", BUILD / "downloads")
    except (OSError, subprocess.CalledProcessError, Mismatch) as error:  # npm or the network may be missing
        print(f"no playground: {error}")


def decisions() -> str:
    lines = ["# Decisions", ""]
    for path in sorted((ROOT / "docs" / "decisions").glob("*.md")):
        title = path.read_text(encoding="utf-8").partition("\n")[0].removeprefix("# ")
        lines.append(f"- [{title}]({path.name})")
    return "\n".join(lines) + "\n"


def thumbnails(page: Path) -> list[Path]:
    """Return the moving picture of an example beside its page, and the one that stands still."""
    return [
        p
        for p in (page.with_suffix(".webp"), page.with_suffix(".png"))
        if page.suffix == ".html" and p.exists()
    ]


def gallery(live: Mapping[str, Path]) -> str:
    """Return the gallery of the site: all examples by subject, each with its moving picture, of a curve its picture."""
    groups: dict[str, list[str]] = {
        name: [] for name in (*(s.name for s in figures.SUBJECTS), "Curves", figures.FURTHER)
    }
    for row in figures.ROWS:
        groups[figures.subject(row)].append(row.example)
    groups = {name: examples for name, examples in groups.items() if examples}
    lines = [
        "# Gallery",
        "",
        "Systems with known answers, which the tests of mechc compare with their runs. A click opens the page on which one moves, with sliders.",
        "[The field's words](words.md) lead from subjects to examples, studies and exercises; [what the sources ask](sources.md) lists answers.",
        "",
    ]
    for name, examples in groups.items():
        lines += [f"## {name}", "", '<div class="cards">']
        lines += [card(example, live) for example in examples]
        lines += ["</div>", ""]
    return "\n".join(lines)


def card(example: str, live: Mapping[str, Path]) -> str:
    """Return an example of the gallery: its picture, its name and what it says of itself."""
    name = example.replace("/", "_")
    page = live.get(name)
    picture = ""
    if page is not None and page.suffix == ".png":
        picture = f'<img src="live/{name}.png" alt="" loading="lazy">'
    elif page is not None and len(thumbnails(page)) == 2:
        picture = (
            f'<picture><source media="(prefers-reduced-motion: reduce)" srcset="live/{name}.png">'
            f'<img src="live/{name}.webp" alt="" width="240" height="180" loading="lazy"></picture>'
        )
    title = example.rpartition("/")[2].replace("_", " ")
    said = html.escape(figures.description(example).replace("\\|", "|"))
    return f'<a class="card" href="gallery/{name}.html">{picture}<b>{title}</b><span>{said}</span></a>'


def frame(name: str, folder: str) -> str:
    return f'<iframe class="live" src="{folder}/{name}.html" title="{name}, moving" loading="lazy"></iframe>'


def example_page(path: Path, live: Mapping[str, Path]) -> str:
    """Return the page of an example: what it is, how it moves, its text, where its answer is tested."""
    name, text = example_name(path.relative_to(ROOT)), path.read_text(encoding="utf-8")
    listed = path.relative_to(ROOT / "examples").with_suffix("").as_posix()
    row = next((r for r in figures.ROWS if r.example == listed), None)
    lines = [f"# {name.replace('_', ' ')}", ""]
    if row is not None:
        test = row.test.removeprefix("../") if "/" in row.test else f"physics/{row.test}"
        lines += [
            figures.description(row.example) + ".",
            "",
            f"Its known answer is checked in `tests/{test}`.",
            "",
        ]
    if name in live and live[name].suffix == ".png":
        lines += [f"![{name}](../live/{name}.png)", ""]
    elif name in live:
        lines += [
            frame(name, "../live"),
            "",
            f"[On a page of its own](../live/{name}.html)",
            "",
        ]
    return "\n".join([*lines, f'```mech title="{path.name}"', text.rstrip("\n"), "```", ""])


Each = Callable[[Callable[..., Any], Sequence[Any]], Iterator[Any]]
"""A function of each of some arguments, in their order."""


@contextmanager
def workers() -> Iterator[Each]:
    """Work in as many processes as there are processors; the first argument is for this one, so that they find all imported."""
    pools: list[ProcessPoolExecutor] = []

    def each(work: Callable[..., Any], arguments: Sequence[Any]) -> Iterator[Any]:
        for argument in arguments[:1]:
            yield work(argument)
        if not pools:
            gc.disable()  # a tenth of the time; what the examples leave is some 100 MB in each process
            pools.append(ProcessPoolExecutor(os.cpu_count()))
        yield from pools[0].map(work, arguments[1:])

    try:
        yield each
    finally:
        for pool in pools:
            pool.shutdown()


def make_live(examples: Sequence[Path], each: Each) -> dict[str, Path]:
    """Return the moving page of each example, of a curve its picture, made where it is not there yet."""
    LIVE.mkdir(parents=True, exist_ok=True)
    state = hashlib.sha256(b"".join(p.read_bytes() for p in sorted(_sources()))).digest()
    keys = [hashlib.sha256(state + example.read_bytes()).hexdigest()[:16] for example in examples]
    names = [example_name(example.relative_to(ROOT)) for example in examples]
    pages = [LIVE / f"{name}-{key}.html" for name, key in zip(names, keys, strict=True)]
    made: dict[str, Path] = {}
    if find_libtcc() is not None:  # the run after a page is over before better code pays
        os.environ.setdefault("CC", "libtcc")
    for name, (page, said) in zip(names, each(_made, [*zip(examples, pages, strict=True)]), strict=True):
        if page is None:
            print(f"no moving page of {name}: {said}")
        else:
            made[name] = page
    return made


def make_diagrams(each: Each) -> dict[str, Path]:
    """Return the diagram of each part of the library, made where it is not there yet."""
    DRAWN.mkdir(parents=True, exist_ok=True)
    by = [*_sources(), HERE.parent / "diagrams.py", *(ROOT / "mechc" / "presentation").glob("*.py")]
    key = hashlib.sha256(b"".join(p.read_bytes() for p in sorted(by))).hexdigest()[:16]
    made = {name: DRAWN / f"{name}-{key}.svg" for name in diagrams.parts()}
    missing = [name for name, path in made.items() if not path.exists()]
    for name, svg in zip(missing, each(diagrams.drawn, missing), strict=True):
        made[name].write_text(svg, encoding="utf-8", newline="\n")
    return made


def _made(asked: tuple[Path, Path]) -> tuple[Path | None, str]:
    """Write the page of an example, or the picture of a curve, which does not move; return it, or why there is none."""
    example, page = asked
    picture = page.with_suffix(".png")
    if page.exists() or picture.exists():
        return (page if page.exists() else picture), ""
    model = mechc.load(example, keep={"scene"})
    try:
        if model.is_curve:
            save_curve(model.solve(), picture)
            return picture, ""
        facts = run_for_page(model, {}, None, {"estimate_error": False})
        write_thumbnail(facts.solution, page.with_suffix(".webp"))
        write_live(facts, page)
        return page, ""
    except (mechc.UsageMistake, mechc.SimulationError) as error:
        return None, str(error)


def _sources() -> list[Path]:
    """Return what a page is made by: a change in it makes all of them again."""
    folders = ("lang", "compiler", "runtime", "stdlib", "mechc/web", "docs/website")
    return [
        p
        for f in folders
        for p in (ROOT / f).rglob("*")
        if p.suffix in (".py", ".c", ".h", ".js", ".html", ".mech", ".lark", ".wasm")
    ]


def main(arguments: Sequence[str]) -> int:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument(
        "--no-live", action="store_true", help="leave out the moving pages, the diagrams and the playground"
    )
    parser.add_argument("examples", nargs="*", help="moving pages of these alone")
    asked = parser.parse_args(arguments)
    require_own_installation()
    begun = time.monotonic()
    examples = [ROOT / p for p in tracked("examples") if p.suffix == ".mech"]
    chosen = [] if asked.no_live else [e for e in examples if not asked.examples or e.stem in asked.examples]
    with workers() as each:
        write_pages(make_live(chosen, each), {} if asked.no_live else make_diagrams(each))
    if not asked.no_live:
        add_playground()
    print(f"pages written after {time.monotonic() - begun:.0f} s")
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--quiet", "-f", str(HERE / "mkdocs.yml")]
    done = subprocess.run(command, check=False)
    size = sum(p.stat().st_size for p in (BUILD / "site").rglob("*") if p.is_file())
    print(f"{BUILD / 'site' / 'index.html'}: {size / 1e6:.1f} MB, {time.monotonic() - begun:.0f} s")
    return done.returncode


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
