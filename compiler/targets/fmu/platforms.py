"""Platforms of FMU binaries: what FMI calls them, and how zig's C compiler builds for them."""

from __future__ import annotations

import importlib.util
import platform
import struct
import sys
from collections.abc import Iterable, Mapping, Sequence

from msgspec import Struct

from mechc.lang.diagnostics import Reporter
from mechc.runtime.native.build import LIBRARY_SUFFIX, build_shared, kernel_flags
from mechc.runtime.native.compiler import Compiler
from mechc.suggest import closest

HOST = "host"
ALL = "all"


class Platform(Struct, frozen=True):
    """One platform. ``name``: the tuple of FMI 3; ``short``: the folder of FMI 2, where it has another name.

    ``triple``: what zig calls it, with the oldest C library that the binary runs on.
    """

    name: str
    triple: str
    suffix: str
    short: str = ""
    flags: tuple[str, ...] = ("-fPIC",)
    link: tuple[str, ...] = ("-shared", "-s", "-lm")

    def folder(self, fmi: int) -> str:
        return self.short if fmi == 2 and self.short else self.name


PLATFORMS: Mapping[str, Platform] = {
    p.name: p
    for p in (
        Platform("x86_64-linux", "x86_64-linux-gnu.2.17", ".so", "linux64"),
        Platform("aarch64-linux", "aarch64-linux-gnu.2.17", ".so"),
        # a library of Windows is position-independent as it is; its C runtime holds the mathematics
        Platform("x86_64-windows", "x86_64-windows-gnu", ".dll", "win64", (), ("-shared", "-s")),
        Platform("aarch64-windows", "aarch64-windows-gnu", ".dll", "", (), ("-shared", "-s")),
        Platform("x86_64-darwin", "x86_64-macos.11.0", ".dylib", "darwin64"),
        Platform("aarch64-darwin", "aarch64-macos.11.0", ".dylib"),
    )
}
_SYSTEMS = {"linux": "linux", "darwin": "darwin", "win32": "windows"}
_MACHINES = {"x86_64": "x86_64", "amd64": "x86_64", "aarch64": "aarch64", "arm64": "aarch64"}
_CPU = {"x86_64-darwin": (0x01000007, 3), "aarch64-darwin": (0x0100000C, 0)}
"""Type and subtype of the processor in a universal file (mach/machine.h)."""


def chosen_platforms(names: Sequence[str]) -> tuple[str, ...]:
    """Return names of the table, ``host`` among them as such. Raises CompileError: E0903 to E0905."""
    known = [HOST, *PLATFORMS, ALL]
    for name in names:
        if name not in known:
            near = closest(name, known)
            raise Reporter().fail(
                "E0904",
                f"there is no platform '{name}'",
                None,
                help=(f"did you mean '{near}'? " if near else "") + f"platforms are {', '.join(known)}",
            )
    chosen = tuple(dict.fromkeys(p for name in names for p in (PLATFORMS if name == ALL else (name,))))
    if set(chosen) != {HOST} and importlib.util.find_spec("ziglang") is None:
        raise Reporter().fail(
            "E0903",
            f"a binary for {next(p for p in chosen if p != HOST)} needs zig's C compiler, which is not installed",
            None,
            help="pip install ziglang; --platform host takes the compiler of this machine",
        )
    if HOST in chosen:
        host_name()
    return chosen


def host_name() -> str:
    """Return the name of this machine's platform. Raises CompileError: E0905."""
    machine = _MACHINES.get(platform.machine().lower())
    system = _SYSTEMS.get(sys.platform)
    if machine is None or system is None:
        raise Reporter().fail(
            "E0905",
            f"FMI has no name for this platform ({platform.machine()})",
            None,
            help=f"--platform builds for another one ({', '.join(PLATFORMS)}), --sources-only for none",
        )
    return f"{machine}-{system}"


def binaries(
    sources: Mapping[str, str], platforms: Iterable[str], fmi: int, identifier: str
) -> dict[str, bytes]:
    """Build a library for each platform; return their bytes by path in the FMU.

    Raises BuildError, CompilerMissing, CompileError.
    """
    built = {name: _build(sources, name, identifier) for name in platforms}
    files: dict[str, bytes] = {}
    for name, data in built.items():
        own = PLATFORMS[host_name() if name == HOST else name]
        files[f"binaries/{own.folder(fmi)}/{identifier}{own.suffix}"] = data
    slices = {name: built[name] for name in _CPU if name in built}
    if fmi == 2 and len(slices) > 1:
        # importers of FMI 2 look into darwin64 on either processor
        files[f"binaries/darwin64/{identifier}.dylib"] = universal(slices)
    return files


def _build(sources: Mapping[str, str], name: str, identifier: str) -> bytes:
    reproducible = kernel_flags(reproducible=True)
    if name == HOST:
        file = f"{identifier}{LIBRARY_SUFFIX}"
        return build_shared(sources, reproducible, name="fmu", file=file).read_bytes()
    chosen = PLATFORMS[name]
    command = (sys.executable, "-m", "ziglang", "cc", "-target", chosen.triple)
    flags = (*(flag for flag in reproducible if flag != "-fPIC"), *chosen.flags)
    library = build_shared(
        sources,
        flags,
        name="fmu",
        compiler=Compiler(command, _zig_version()),
        file=f"{identifier}{chosen.suffix}",
        link=chosen.link,
    )
    data = library.read_bytes()
    return without_time(data) if chosen.suffix == ".dll" else data


def _zig_version() -> str:
    from importlib.metadata import version

    return f"ziglang {version('ziglang')}"


def without_time(library: bytes) -> bytes:
    """Clear the time of the build in a library of Windows, so that the same sources give the same bytes.

    The header of COFF begins after the four bytes "PE"; the time stands after machine and number of sections.
    """
    (header,) = struct.unpack_from("<I", library, 0x3C)
    if library[header : header + 4] != b"PE\0\0":
        raise ValueError("the library is in no format of Windows")
    return library[: header + 8] + bytes(4) + library[header + 12 :]


def universal(slices: Mapping[str, bytes]) -> bytes:
    """Join libraries of macOS for several processors into one universal file (mach-o/fat.h)."""
    alignment = 14  # a power of two: the page of arm64
    size = 1 << alignment
    header = struct.pack(">II", 0xCAFEBABE, len(slices))
    body = b""
    offset = size
    for name, data in slices.items():
        header += struct.pack(">IIIII", *_CPU[name], offset, len(data), alignment)
        body += data + bytes(-len(data) % size)
        offset = size + len(body)
    return header.ljust(size, b"\0") + body
