"""Programs and libraries in C++ of bench/peers, compiled with the headers that the package pin ships (bench/peers/README.md)."""

from __future__ import annotations

import os
import subprocess
import tempfile
from pathlib import Path

PEERS = Path(__file__).parent / "peers"
_LIMITS = (
    "-DBOOST_FUSION_INVOKE_MAX_ARITY=12",
    "-DBOOST_MPL_LIMIT_LIST_SIZE=30",
    "-DBOOST_MPL_LIMIT_VECTOR_SIZE=30",
    "-DBOOST_MPL_CFG_NO_PREPROCESSED_HEADERS",
)


def packages(python: str) -> Path:
    """Where the packages of an interpreter are."""
    code = "import sysconfig; print(sysconfig.get_paths()['purelib'])"
    done = subprocess.run([python, "-c", code], capture_output=True, text=True, check=True)
    return Path(done.stdout.strip())


def built(python: str, name: str, *flags: str, link: bool = True, casadi: bool = False) -> Path:
    """Compile ``name``.cpp, which takes a minute or two, unless ``MECHC_NAME`` says where it is compiled already.

    ``link``: with Pinocchio's own library, which is built for any processor; without it all comes from the headers, and may be
    compiled for this one.
    """
    given = os.environ.get(f"MECHC_{name.upper()}")
    if given:
        return Path(given)
    site = packages(python)
    prefix, out = site / "cmeel.prefix", Path(tempfile.mkdtemp(), name)
    includes = [prefix / "include", prefix / "include/eigen3", Path("/usr/include/eigen3")]
    libraries = []
    if link:
        libraries += [f"-L{prefix}/lib", f"-Wl,-rpath,{prefix}/lib", "-lpinocchio_default"]
    if casadi:
        includes.append(site / "casadi/include")
        libraries += [f"-L{site}/casadi", f"-Wl,-rpath,{site}/casadi", "-lcasadi"]
    paths = [f"-I{path}" for path in includes]
    source = str(PEERS / f"{name}.cpp")
    words = [
        "g++",
        "-std=c++17",
        "-w",
        "-DNDEBUG",
        *flags,
        *_LIMITS,
        *paths,
        source,
        "-o",
        str(out),
        *libraries,
    ]
    subprocess.run(words, check=True)
    return out
