"""Files that cannot be read and places that cannot be written: one sentence, quickly, whatever the format."""

from __future__ import annotations

import gzip
import os
import resource
import time
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from oracles_mesh_io import ascii_stl, tetrahedron

from patchwright.models import CorruptFile, GeometryError, ParameterError, UnsupportedFormat
from patchwright.models.io import FORMATS, read, write
from patchwright.models.io.atomic import replacing, writing
from patchwright.models.io.parts import unique_names

MESHES = [e for e in FORMATS if e.reads and e.name not in ("STEP", "IGES")]
SUFFIXES = [suffix for entry in MESHES for suffix in entry.suffixes]


def refusal(path: Path) -> str:
    with pytest.raises(GeometryError) as caught:
        read(path)
    sentence = str(caught.value)
    assert str(path) in sentence
    assert "\n" not in sentence
    return sentence


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_missing_empty_and_directory(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"a{suffix}"
    assert "no such file" in refusal(path)
    path.touch()
    assert "is empty" in refusal(path)
    path.unlink()
    path.mkdir()
    assert "is a directory" in refusal(path)


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_garbage_and_text(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"a{suffix}"
    for content in (
        np.random.default_rng(0).bytes(5000),
        b"Dear reader,\nthis is a letter.\n" * 9,
        b"\0",
        b"\n\n\n",
        b"1",
    ):
        path.write_bytes(content)
        refusal(path)
        path.write_bytes(gzip.compress(content))
        refusal(path)


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_two_gigabytes_of_zeros_are_refused_at_once(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"a{suffix}"
    with path.open("wb") as out:
        out.truncate(2 << 30)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    start = time.perf_counter()
    refusal(path)
    assert time.perf_counter() - start < 5.0
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 200_000  # kB


def test_broken_gzip(tmp_path: Path) -> None:
    path = tmp_path / "a.stl.gz"
    noise = np.random.default_rng(1).normal(size=(2000, 3, 3))
    whole = gzip.compress(ascii_stl([("a", noise)]).encode())
    path.write_bytes(whole[: len(whole) // 2])
    assert "gzip data ends too early" in refusal(path)
    path.write_bytes(whole[:100] + bytes([whole[100] ^ 255]) + whole[101:])
    assert "gzip data" in refusal(path)
    path.write_bytes(whole[:5])
    assert "gzip data ends too early" in refusal(path)
    path.write_bytes(gzip.compress(b""))
    assert "holds nothing" in refusal(path)


def test_unknown_suffix_and_write_only_format(tmp_path: Path) -> None:
    for name in ("a.xyzzy", "a", "a.gz"):
        (tmp_path / name).write_text("solid")
        with pytest.raises(UnsupportedFormat, match=r"known are .*\.stl"):
            read(tmp_path / name)
        with pytest.raises(UnsupportedFormat, match=r"known are .*\.stl"):
            write(tmp_path / name, tetrahedron())
    (tmp_path / "a.vtk").write_text("solid")
    with pytest.raises(UnsupportedFormat, match="written but not read"):
        read(tmp_path / "a.vtk")


def test_no_permission(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "a.stl"
    write(path, tetrahedron())
    path.chmod(0)
    if os.geteuid() == 0:  # nothing is forbidden to root: forbid it here

        def forbidden(*_: object, **__: object) -> None:
            raise PermissionError(13, "Permission denied")

        monkeypatch.setattr(Path, "open", forbidden)
    assert "no permission" in refusal(path)


def test_a_path_no_file_can_have() -> None:
    with pytest.raises(CorruptFile):
        read("a\0b.stl")
    with pytest.raises(CorruptFile):
        read("a" * 5000 + ".stl")


def test_a_device_is_not_read(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "a.stl")
    assert "not a regular file" in refusal(tmp_path / "a.stl")


def test_writing_to_impossible_places(tmp_path: Path) -> None:
    with pytest.raises(ParameterError, match="does not exist"):
        write(tmp_path / "missing" / "a.stl", tetrahedron())
    (tmp_path / "a.stl").mkdir()
    with pytest.raises(ParameterError, match="is a directory"):
        write(tmp_path / "a.stl", tetrahedron())


def test_a_failed_write_leaves_the_old_file_and_nothing_else(tmp_path: Path) -> None:
    path = tmp_path / "a.stl"
    path.write_text("old")

    def fail_half_way() -> None:
        with writing(path) as out:
            out.write(b"half")
            raise RuntimeError

    with pytest.raises(RuntimeError):
        fail_half_way()
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


def test_writing_keeps_mode_and_follows_links(tmp_path: Path) -> None:
    (tmp_path / "real.stl").write_text("old")
    (tmp_path / "real.stl").chmod(0o640)
    (tmp_path / "link.stl").symlink_to("real.stl")
    write(tmp_path / "link.stl", tetrahedron())
    assert (tmp_path / "link.stl").is_symlink()
    assert (tmp_path / "real.stl").stat().st_mode & 0o777 == 0o640
    assert len(read(tmp_path / "real.stl").triangulation) == 4
    umask = os.umask(0)
    os.umask(umask)
    write(tmp_path / "new.stl", tetrahedron())
    assert (tmp_path / "new.stl").stat().st_mode & 0o777 == 0o666 & ~umask


def test_the_place_beside_keeps_the_suffix(tmp_path: Path) -> None:
    with replacing(tmp_path / "a.step") as beside:
        assert beside.parent == tmp_path
        assert beside.suffix == ".step"
        beside.write_text("new")
    assert (tmp_path / "a.step").read_text() == "new"


@given(st.lists(st.sampled_from(["a", "a-2", "a-3", "b", ""]), max_size=12))
def test_names_become_unique_and_first_ones_stay(names: list[str]) -> None:
    unique = unique_names(names)
    assert len(set(unique)) == len(names)
    for i, name in enumerate(names):
        assert unique[i] == name if name not in names[:i] else unique[i].startswith(f"{name}-")
