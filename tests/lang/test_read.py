"""Files to text, and the cache of the parser's tables."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable
from functools import cache
from pathlib import Path

import pytest
from msgspec import msgpack

from mechc.lang.diagnostics import CompileError
from mechc.lang.grammar import tables
from mechc.lang.read import LARGEST, decode, read_source


def message(path: Path) -> str:
    with pytest.raises(CompileError) as caught:
        read_source(path)
    (problem,) = caught.value.diagnostics
    assert problem.code == "E0101"
    return problem.message.replace(str(path), "FILE")


def test_line_ends_and_byte_order_mark(tmp_path: Path) -> None:
    path = tmp_path / "a.mech"
    path.write_bytes(b"\xef\xbb\xbflet a = 1;\r\nlet b = 2;\rlet c = 3;\n")
    source = read_source(path)
    assert source.text == "let a = 1;\nlet b = 2;\nlet c = 3;\n"
    assert source.name == str(path)


def test_files_that_are_no_model(tmp_path: Path) -> None:
    path = tmp_path / "a.mech"
    assert message(path) == "cannot read 'FILE': there is no such file"
    assert message(tmp_path) == "cannot read 'FILE': it is a folder"
    path.write_bytes(b"")
    assert message(path) == "'FILE' is empty"
    path.write_bytes(b" \n\t\n")
    assert message(path) == "'FILE' is empty"
    path.write_bytes(b"\x7fELF\0\0")
    assert message(path) == "'FILE' is binary, not text"
    path.write_bytes(b"let a = 1;\nlet b = \xff;\n")
    assert message(path) == "'FILE' is not UTF-8: byte 0xff in line 2"
    with path.open("wb") as file:
        file.truncate(LARGEST + 1)
    assert message(path) == "'FILE' is too large: more than 10 MB"


@pytest.mark.skipif(not Path("/dev/zero").exists(), reason="no devices")
def test_a_device_without_end() -> None:
    assert message(Path("/dev/zero")) == "'FILE' is too large: more than 10 MB"


@pytest.mark.skipif(os.name == "nt" or os.geteuid() == 0, reason="everything is readable here")
def test_unreadable_file(tmp_path: Path) -> None:
    path = tmp_path / "a.mech"
    path.write_text("let a = 1;")
    path.chmod(0)
    assert message(path) == "cannot read 'FILE': you are not allowed to"


def test_text_that_did_not_come_from_a_file() -> None:
    from mechc.lang.diagnostics import Reporter

    assert decode("x", b"a\r\n", Reporter()).text == "a\n"


built = cache(tables.build_tables)
"""Tables are built once, which takes a second; here it counts when they are asked for."""


@pytest.fixture
def cache_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    folder = tmp_path / "cache"
    monkeypatch.setattr(tables, "build_tables", built)
    monkeypatch.setattr(tables, "_cache_folder", lambda: folder)
    return folder


def test_tables_are_kept_and_found_again(cache_folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    made = tables.load_tables.__wrapped__()
    (kept,) = cache_folder.iterdir()
    assert kept.suffix == ".msgpack"
    monkeypatch.setattr(tables, "build_tables", lambda grammar: pytest.fail("made again"))
    assert tables.load_tables.__wrapped__() == made


def test_an_installation_makes_none(
    cache_folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """They lie beside the grammar, as a wheel has them, unless they are of another one."""
    monkeypatch.setattr(tables, "_INSTALLED", tmp_path)
    tables.lay_beside_the_grammar()
    (laid,) = tmp_path.glob("grammar-*.msgpack")
    monkeypatch.setattr(tables, "build_tables", lambda grammar: pytest.fail("made again"))
    assert tables.load_tables.__wrapped__() == built(tables.grammar_text())
    assert not cache_folder.exists()
    monkeypatch.setattr(tables, "build_tables", built)
    laid.rename(tmp_path / "grammar-0.msgpack")
    tables.load_tables.__wrapped__()
    assert cache_folder.exists()


def with_checksum(data: bytes) -> bytes:
    return hashlib.sha256(data).digest() + data


@pytest.mark.parametrize(
    "damage",
    [
        lambda kept: b"",
        lambda kept: kept[:-1],
        lambda kept: kept[:200] + bytes([kept[200] ^ 1]) + kept[201:],
        lambda kept: with_checksum(b"cos\nsystem\n(S'exit 1'\ntR."),
        lambda kept: with_checksum(msgpack.encode({"moves": []})),
    ],
)
def test_a_damaged_cache_is_made_anew(cache_folder: Path, damage: Callable[[bytes], bytes]) -> None:
    made = tables.load_tables.__wrapped__()
    (kept,) = cache_folder.iterdir()
    whole = kept.read_bytes()
    kept.write_bytes(damage(whole))
    assert tables.load_tables.__wrapped__() == made
    assert kept.read_bytes() == whole


def test_no_place_for_a_cache_is_no_error(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    blocked = tmp_path / "file"
    blocked.write_text("in the way")
    monkeypatch.setattr(tables, "build_tables", built)
    monkeypatch.setattr(tables, "_cache_folder", lambda: blocked / "below")
    assert tables.load_tables.__wrapped__().keywords["model"] == "MODEL"
