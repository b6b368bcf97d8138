"""C sources to a shared library, by a C compiler of this machine or the one that comes along, kept in the cache by content.

The key of an entry holds the sources, the flags, the compiler with its version, and, for code of this
processor only, the processor. A build goes to a folder of its own and what it made is renamed at its end, so that two
processes may build the same entry at once.
"""

from __future__ import annotations

import functools
import os
import re
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext
from pathlib import Path

from .cache import prune_when_due
from .compiler import LIBTCC, NAMES, NATIVE, Compiler, cache_key, compiler_by_its_file
from .kept_files import build_folder, find_entry, keep_entry
from .libtcc import compile_in_process, find_libtcc

_COMMON = ("-std=c11", "-fno-math-errno", "-fno-trapping-math", "-fPIC", "-fvisibility=hidden")
_FAST = (NATIVE, "-ffp-contract=fast", "-fexpensive-optimizations")
# without the last, gcc fuses no products with sums below -O2; clang does, and warns that it does not know it
# without -frounding-math, gcc rounds functions of constants in its own way, not as the C library does
_SIMD = ("-DMECH_SIMD", "-fopenmp-simd")
_UNORDERED = ("-DMECH_UNORDERED", "-fopenmp-simd")
"""Long sums in loops are summed in parts side by side, where neither other machines nor Python must have the same bits."""
_REPRODUCIBLE = ("-ffp-contract=off", "-frounding-math")

_INCLUDE = re.compile(r'^[ \t]*#[ \t]*include[ \t]*"([^"]+)"', re.M)

LIBRARY_SUFFIX = {"win32": ".dll", "darwin": ".dylib"}.get(sys.platform, ".so")
LINK = ("-shared",) if sys.platform == "win32" else ("-shared", "-lm")


class BuildError(Exception):
    """The C compiler failed. ``output`` is what it said; the sources are kept in ``folder``."""

    def __init__(self, command: Sequence[str], output: str, folder: Path) -> None:
        import shlex

        super().__init__(
            f"the C compiler failed: {shlex.join(command)}\n{output.rstrip()}\nthe sources are kept in {folder}"
        )
        self.command = tuple(command)
        self.output = output
        self.folder = folder

    def __reduce__(self) -> tuple[type[BuildError], tuple[object, ...]]:
        """Pickle with all that it was made of: it may be raised in another process."""
        return BuildError, (self.command, self.output, self.folder)


class CompilerMissing(Exception):
    """No C compiler was found."""


def kernel_flags(reproducible: bool = False) -> tuple[str, ...]:
    return ("-O2", *_COMMON, *(_REPRODUCIBLE if reproducible else (*_FAST, *_SIMD)))


_STRAIGHT = ("-O1",)
"""Straight-line code gains nothing from -O2, and compiles in half the time."""

_LOOPS = ("-O3", "-fno-tree-slp-vectorize", "-funroll-loops")
"""Loops run an eighth faster by it, those of long chains a twentieth more where they are unrolled, and are compiled in no time; what
is apart is done side by side, in vectors. Vectors across statements only cost."""


def model_flags(reproducible: bool = False, loops: bool = False) -> tuple[str, ...]:
    """``loops``: long functions are loops."""
    unordered = _UNORDERED if loops and not reproducible else ()
    return (
        *(_LOOPS if loops else _STRAIGHT),
        *_COMMON,
        *(_REPRODUCIBLE if reproducible else _FAST),
        *unordered,
    )


def lane_flags() -> tuple[str, ...]:
    """What is fused stands in the text of lanes: the compiler adds nothing, so that all widths give the same bits."""
    return ("-O3", *_COMMON, NATIVE, "-ffp-contract=off")


def find_compiler() -> Compiler | None:
    """Find a C compiler: environment ``CC``, then cc, gcc, clang, then ziglang's, then the one that comes with mechc.

    Raises ``CompilerMissing`` if ``CC`` is set and does not answer.
    """
    found = _find_compiler(os.environ.get("CC", ""), os.environ.get("PATH", ""))
    return _assumed or found if found is None or found.in_process else found


def known_compiler() -> Compiler | None:
    """Give the compiler that is found, by its file alone where that is enough: what it has made need not ask it.

    Raises ``CompilerMissing`` if ``CC`` is set and does not answer.
    """
    return compiler_by_its_file() or find_compiler()


def find_quick_compiler() -> Compiler | None:
    """Find libtcc where models have another compiler, whose code is better but ready later; None where ``CC`` chooses one."""
    return None if os.environ.get("CC") or compiler_by_its_file() is None else find_libtcc()


_assumed: Compiler | None = None


def assume_compiler(compiler: Compiler | None) -> None:
    """Let a process without a compiler of its machine find what this one has compiled elsewhere, for the same machine."""
    global _assumed
    _assumed = compiler


@functools.cache
def _find_compiler(chosen: str, path: str) -> Compiler | None:
    if chosen:
        import shlex

        try:
            command_line = (*shlex.split(chosen),)
        except ValueError as error:
            raise CompilerMissing(
                f"the environment says CC={chosen}, which is not a command: {error}"
            ) from None
        if command_line == LIBTCC:
            found = find_libtcc()
        else:
            found = _ask(command_line) if command_line else None
        if found is None:
            raise CompilerMissing(f"the environment says CC={chosen}, which cannot be run")
        return found
    import importlib.util
    import shutil

    for name in NAMES:
        command = shutil.which(name, path=path)
        if command and (found := _ask((command,))):
            return found
    if importlib.util.find_spec("ziglang"):
        return _ask((sys.executable, "-m", "ziglang", "cc"))
    return find_libtcc()


def _ask(command: tuple[str, ...]) -> Compiler | None:
    import subprocess

    try:
        answer = subprocess.run((*command, "--version"), capture_output=True, text=True, timeout=60)
    except (OSError, subprocess.TimeoutExpired):
        return None
    return Compiler(command, answer.stdout.strip()) if answer.returncode == 0 else None


_around: Callable[[str], AbstractContextManager[object]] = nullcontext


@contextmanager
def around_builds(told: Callable[[str], AbstractContextManager[object]]) -> Iterator[None]:
    """Let ``told(name)`` be entered while something is compiled, and left after it: so that people know why they wait."""
    global _around
    before, _around = _around, told
    try:
        yield
    finally:
        _around = before


_BUILT = f"built{LIBRARY_SUFFIX}"
"""The name that the linker gives a library: some formats hold it."""


def build_shared(
    sources: Mapping[str, str],
    flags: Sequence[str],
    key: str = "",
    *,
    name: str = "model",
    compiler: Compiler | None = None,
    file: str = _BUILT,
    link: Sequence[str] = LINK,
    chosen: Callable[[], Mapping[str, str]] | None = None,
) -> Path:
    """Give the shared library made of ``sources`` (text by file name, headers among them).

    ``key`` is further text on which the result depends. ``chosen`` gives what is compiled instead of the sources, which
    follows from these and the key: it is asked when something is compiled. ``compiler``: None for the one that is found; ``file`` is
    the name that the linker gives the library, ``link`` what it is told. Raises ``BuildError`` and ``CompilerMissing``.
    """
    compiler = compiler or find_compiler()
    if compiler is None:
        raise CompilerMissing("no C compiler was found")
    digest = cache_key(sources, (*flags, file, *link), key, compiler)
    stem, suffix = f"{name}-{digest}", Path(file).suffix
    library = find_entry(stem, suffix)
    if library is None:
        sources = sources if chosen is None else chosen()
        with _around(name), build_folder(kept_after=BuildError) as folder:
            for source, text in sources.items():
                (folder / source).write_text(text, encoding="utf-8", newline="\n")
            if compiler.in_process:
                _compile_in_process(sources, flags, folder / file)
            else:
                _compile(compiler, sources, flags, folder, ("-o", file, *link))
            library = keep_entry(folder / file, stem, suffix)
        prune_when_due()
    return library


def built_once(
    known: Mapping[str, str],
    flags: Sequence[str],
    build: Callable[[], Path],
    compiler: Compiler | None = None,
) -> Path:
    """Give what ``build`` gives, from the cache under the name of what is ``known`` of it beforehand.

    So that sources need not be written or read to look for what was compiled of them, nor the compiler asked: one library under
    two names, where the system knows such. Raises what ``build`` raises.
    """
    compiler = compiler or known_compiler()
    if compiler is None:
        return build()
    stem = f"known-{cache_key(known, flags, '', compiler)}"
    found = find_entry(stem, LIBRARY_SUFFIX)
    if found is None:
        built = build()
        with build_folder() as folder:
            copy = folder / built.name
            try:
                os.link(built, copy)
            except OSError:  # of another owner, or on a disk that has no links
                import shutil

                shutil.copyfile(built, copy)
            found = keep_entry(copy, stem, LIBRARY_SUFFIX)
    return found


def _compile_in_process(sources: Mapping[str, str], flags: Sequence[str], library: Path) -> None:
    files = [library.parent / name for name in sources if name.endswith(".c")]
    said = compile_in_process(files, flags, library)
    if said:
        raise BuildError((*LIBTCC, *flags), said, library.parent)


def _compile(
    compiler: Compiler, sources: Mapping[str, str], flags: Sequence[str], folder: Path, link: Sequence[str]
) -> None:
    """Compile and link what lies in ``folder``. Files of the kernel are the same in many libraries: objects are kept."""
    extra = ("-fno-sanitize=all",) if "ziglang" in compiler.command else ()
    quad = ("-lquadmath",) if "-DMECH_QUAD" in flags else ()
    files = [s for s in sources if s.endswith(".c")]
    # zig compiles the files of one command side by side itself, and takes long to begin
    if len(files) == 1 or "ziglang" in compiler.command:
        _run((*compiler.command, *flags, *extra, *files, *link, *quad), folder)
        return

    import shutil
    from concurrent.futures import ThreadPoolExecutor

    from .children import ended_with_us

    def make(file: str) -> None:
        needed = {name: sources[name] for name in _with_headers(file, sources)}
        stem = f"object-{cache_key(needed, flags, file, compiler)}"
        kept = find_entry(stem, ".o")
        if kept is None:
            _run((*compiler.command, *flags, *extra, "-c", file, "-o", f"{file}.o"), folder)
            kept = keep_entry(folder / f"{file}.o", stem, ".o")
        shutil.copyfile(kept, folder / f"{file}.o")

    with ThreadPoolExecutor(max_workers=max(2, os.cpu_count() or 2)) as pool, ended_with_us():
        list(pool.map(make, files))
    _run((*compiler.command, *extra, *(f"{file}.o" for file in files), *link, *quad), folder)


def _with_headers(file: str, sources: Mapping[str, str]) -> tuple[str, ...]:
    """Return the names of a file and of all it includes, directly or not, that are among the sources."""
    found, pending = [file], [file]
    while pending:
        for name in _INCLUDE.findall(sources[pending.pop()]):
            if name in sources and name not in found:
                found.append(name)
                pending.append(name)
    return tuple(found)


def _run(command: Sequence[str], folder: Path) -> None:
    from .children import run

    code, output = run(command, folder)
    if code != 0:
        raise BuildError(command, output, folder)
