"""STL, ascii and binary, plain or gzipped: triangles, and in ascii files named solids.

The two forms are told apart by content: a file whose size is 84 + 50·count is binary even when it begins with "solid".
STL stores every triangle's corners, no unit, no connectivity: equal corners of a solid become one vertex when read.
Stored normals are ignored, the order of the corners counts. Not supported: colours in the attribute bytes (ignored).
"""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import IO, TypeAlias

import numpy as np
import numpy.typing as npt

from patchwright.models.arrays import Array, IntArray
from patchwright.models.assembly import Assembly
from patchwright.models.errors import CorruptFile, RepairWarning, UnsupportedFormat
from patchwright.models.io._text import number_lines, settle
from patchwright.models.io.atomic import writing
from patchwright.models.io.merge import merge_points
from patchwright.models.io.opening import CHUNK, LARGEST, Bytes, Source, line_of, source, token_at
from patchwright.models.io.parts import assembly_of, refuse_bad_points, solids
from patchwright.models.triangulation import Triangulation

Singles: TypeAlias = npt.NDArray[np.float32]
RECORD = np.dtype([("normal", "<f4", (3,)), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
PREAMBLE = 84  # bytes: 80 of free text and the count
BANNER = "patchwright: "  # begins the free text of our binary files; the solid's name follows
AT_ONCE = 100_000  # triangles formatted in one go
WORDS = tuple(
    np.frombuffer(word, dtype=np.uint8)
    for word in (b"solid", b"facet", b"outer", b"vertex", b"endloop", b"endfacet", b"endsolid", b"loop")
)
FACET = tuple(
    np.frombuffer(text, dtype=np.uint8) for text in (b" facet normal", b"\n  outer loop\n", b"  endloop\n endfacet\n")
)


def read(path: Path, unit: str | None = None) -> Assembly:
    """The solids of an STL file, one part each, in the file's order.

    Coordinates are the file's own (float32 values for a binary file). A solid without a name takes the file's;
    doubles are numbered.

    Raises
    ------
    CorruptFile : cut off, not STL, no triangle, a coordinate that is not finite; the text says where.
    """
    with source(path) as file:
        if _is_binary(file):
            return _read_binary(file, unit)
        if file.head.lstrip(b"\xef\xbb\xbf \t\r\n")[:5].lower() == b"solid" and file.is_text:
            return _read_ascii(path, file.read_text(), unit)
        if file.is_text:
            raise CorruptFile(
                f"{path}: is text but not STL, it begins with {_printable(file.head)!r} instead of 'solid'; "
                "check its suffix"
            )
        raise _miscounted(file)


def _is_binary(file: Source) -> bool:
    """True when the header's count fits the size (fewer bytes than a triangle may trail); packed: when it is no
    text."""
    if len(file.head) < PREAMBLE:
        return False
    if file.size is None:
        return not file.is_text
    return _count(file) > 0 and 0 <= file.size - PREAMBLE - RECORD.itemsize * _count(file) < RECORD.itemsize


def _count(file: Source) -> int:
    return int.from_bytes(file.head[80:PREAMBLE], "little")


def _miscounted(file: Source, length: int | None = None) -> CorruptFile:
    """The sentence for a binary file whose header and size disagree."""
    size = length if length is not None else file.size or len(file.head)
    if size < PREAMBLE:
        return CorruptFile(
            f"{file.path}: {size} bytes are too few for a binary STL and it is no ascii STL; export it again"
        )
    held = (size - PREAMBLE) // RECORD.itemsize
    if size == PREAMBLE and _count(file) == 0:
        return CorruptFile(f"{file.path}: holds no triangle; export the surface as triangles")
    return CorruptFile(
        f"{file.path}: the header says {_count(file)} triangles, but the {size - PREAMBLE} bytes that follow "
        f"hold {held}; "
        "the file was cut off or is no binary STL, fetch or export it again"
    )


def _read_binary(file: Source, unit: str | None) -> Assembly:
    count = _count(file)
    length = PREAMBLE + RECORD.itemsize * count
    if length > LARGEST:
        raise CorruptFile(
            f"{file.path}: the header says {count} triangles, more than {LARGEST >> 30} GiB; split the file"
        )
    data = file.read(length + CHUNK)
    if count == 0 or not 0 <= len(data) - length < RECORD.itemsize:
        raise _miscounted(file, len(data))
    points = data[PREAMBLE:length].view(RECORD)["corners"].reshape(-1, 3)
    _refuse_bad_corners(file.path, points)
    text = file.head[:80].split(b"\0")[0].decode("utf-8", "replace").strip()
    name = text.removeprefix(BANNER) if text.startswith(BANNER) else ""
    return assembly_of(file.path, points, np.arange(3 * count).reshape(-1, 3), None, [name], unit)


def _read_ascii(path: Path, data: Bytes, unit: str | None) -> Assembly:
    from patchwright.models.io import _stl_kernel as kernel

    start = 3 if data[:3].tobytes() == b"\xef\xbb\xbf" else 0
    data = data[start:]
    # the shortest corner is "vertex 0 0 0" and a newline
    out = np.empty(3 * (len(data) // 13 + 1), dtype=np.float64)
    status, position, count, names, slow = kernel.scan(data, out, WORDS)
    if status != kernel.WHOLE:
        where = f"{path}: line {line_of(data, position)}"
        word = token_at(data, position)
        raise CorruptFile(
            {
                kernel.UNKNOWN_WORD: f"{where} has {word!r} where ascii STL cannot have it; the file is "
                "damaged, export it again",
                kernel.BAD_NUMBER: f"{where} has {word!r} where a coordinate was expected; correct it or export again",
                kernel.WRONG_CORNERS: f"{where}: a facet does not have exactly three corners; export triangles only",
                kernel.OPEN_FACET: f"{where}: the file ends inside facet {count // 9 + 1}; it was cut off, "
                "fetch it again",
                kernel.OPEN_SOLID: f"{where}: the file ends without 'endsolid' after {count // 9} triangles; "
                "it was cut off, "
                "or add that line if it is whole",
            }[status]
        )
    settle(data, slow, out)
    points = out[:count].reshape(-1, 3)
    _refuse_bad_corners(path, points)
    labels = [data[a:b].tobytes().decode("utf-8", "replace").strip() for a, b, _ in names.tolist()]
    starts = np.append(names[:, 2], count // 9)
    if len(labels) < 2:
        return assembly_of(path, points, np.arange(count // 3).reshape(-1, 3), None, labels or [""], unit)
    owners = np.repeat(np.arange(len(labels)), np.diff(starts))
    return assembly_of(path, points, np.arange(count // 3).reshape(-1, 3), owners, labels, unit)


def _refuse_bad_corners(path: Path, points: Singles | Array) -> None:
    """CorruptFile when a corner of (3m, 3) `points` is not finite, naming the triangle."""
    if not np.isfinite(points).all():
        refuse_bad_points(path, points.reshape(-1, 9), "triangle")


def _printable(head: bytes) -> str:
    return " ".join(head[:200].decode("utf-8", "replace").split())[:30]


def write(path: Path, thing: object, *, ascii: bool | None = None) -> None:  # noqa: A002
    """Writes an assembly (a solid per part) or a triangulation (a solid per tag).

    Parameters
    ----------
    path : ends in ".stl" or ".stl.gz"
    thing : the assembly or triangulation
    ascii : True writes text: every solid by name, every coordinate with the digits that read back as the same
        float64, so that shared vertices stay shared. False writes binary: float32 coordinates and no solids. None
        writes binary when that loses nothing (one solid, all coordinates float32 numbers) and ascii otherwise.

    Raises
    ------
    UnsupportedFormat : not triangles, none, or (binary) a coordinate beyond float32.
    ParameterError : the file cannot be written.

    Warns
    -----
    RepairWarning : binary asked for, and names or the difference between close vertices were lost.
    """
    whole, names = solids(path, thing, "STL")
    with np.errstate(over="ignore"):
        single = whole.vertices.astype(np.float32)
    if ascii is None:
        ascii = len(names) > 1 or not np.array_equal(single, whole.vertices)  # noqa: A001
    if ascii:
        with writing(path) as out:
            _write_ascii(out, whole, names)
        return
    if not np.isfinite(single).all():
        raise UnsupportedFormat(
            f"{path}: a coordinate is beyond what binary STL's float32 holds; write it with ascii=True"
        )
    _warn_of_losses(path, whole, single, names)
    with writing(path) as out:
        _write_binary(out, whole, single, names[0] if len(names) == 1 else "")


def _warn_of_losses(path: Path, whole: Triangulation, single: Singles, names: tuple[str, ...]) -> None:
    lost = []
    if len(names) > 1:
        lost.append(f"the names of its {len(names)} solids")
    before, after = (len(merge_points(points)[0]) for points in (whole.vertices, single))
    if after < before:
        lost.append(f"the difference between {before - after} vertices and others next to them")
    if lost:
        warnings.warn(
            f"{path}: binary STL loses {' and '.join(lost)}; write it with ascii=True", RepairWarning, stacklevel=4
        )


def _write_binary(out: IO[bytes], whole: Triangulation, single: Singles, name: str) -> None:
    banner = (BANNER + name).encode()
    out.write((banner if len(banner) <= 80 else BANNER.encode()).ljust(80, b"\0"))
    out.write(len(whole).to_bytes(4, "little"))
    for begin in range(0, len(whole), AT_ONCE):
        piece = whole.take(np.arange(begin, min(begin + AT_ONCE, len(whole))))
        records = np.zeros(len(piece), dtype=RECORD)
        records["normal"] = piece.normals
        records["corners"] = single[piece.triangles]
        out.write(records.tobytes())


def _write_ascii(out: IO[bytes], whole: Triangulation, names: tuple[str, ...]) -> None:
    from patchwright.models.io._stl_kernel import facets

    lines = np.frombuffer(number_lines(whole.vertices, "   vertex "), dtype=np.uint8)
    offsets = np.concatenate([[0], np.flatnonzero(lines == 10) + 1])
    lengths = np.diff(offsets)
    fixed = sum(map(len, FACET)) + 3 * len(" -0.0000000")
    tags = whole.tags if whole.tags is not None else np.zeros(len(whole), dtype=np.int64)
    order: IntArray = np.argsort(tags, kind="stable")
    bounds = np.searchsorted(tags[order], np.arange(len(names) + 1))
    for k, name in enumerate(names):
        out.write(f"solid {name}\n".encode())
        for begin in range(int(bounds[k]), int(bounds[k + 1]), AT_ONCE):
            piece = whole.take(order[begin : min(begin + AT_ONCE, int(bounds[k + 1]))])
            normals = np.rint(piece.normals * 1e7).astype(np.int64)
            room = np.empty(fixed * len(piece) + int(lengths[piece.triangles].sum()), dtype=np.uint8)
            length = facets(np.ascontiguousarray(piece.triangles), normals, lines, offsets, FACET, room)
            out.write(room[:length].data)
        out.write(f"endsolid {name}\n".encode())
