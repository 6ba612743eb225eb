"""OFF, plain or gzipped, as text: vertices and polygons.

The header word may carry any of ST, C, N (texture, colour and normal, skipped) and may be missing; the counts may
stand on its line; "#" begins a comment. Every vertex and every polygon has its own line. Not supported: the binary
form and 4 or n dimensions.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from patchwright.models.assembly import Assembly
from patchwright.models.errors import CorruptFile, UnsupportedEntity
from patchwright.models.io._text import settle
from patchwright.models.io.opening import line_of, source, token_at
from patchwright.models.io.parts import assembly_of, refuse_bad_points
from patchwright.models.io.polygons import triangulated

HEADER = re.compile(rb"(?:\s|#[^\r\n]*[\r\n])*(?P<word>[A-Za-z0-9]*OFF)?(?P<binary>[ \t]+BINARY)?(?=[\s#])")


def read(path: Path, unit: str | None = None) -> Assembly:
    """The file's polygons, cut into triangles, as one part named by the file.

    Raises
    ------
    CorruptFile : counts that do not fit the lines, an index out of range, a coordinate that is not finite, no face.
    UnsupportedEntity : the binary form, other than three dimensions, a polygon with too many corners to cut.
    """
    from patchwright.models.io import _lines_kernel as kernel

    with source(path) as file:
        header = HEADER.match(file.head) or re.match(b"", file.head)
        word = (header and header.groupdict().get("word")) or b""
        if word.startswith((b"4", b"n")) or (header and header.groupdict().get("binary")):
            raise UnsupportedEntity(
                f"{path}: is {word.decode()} in binary or not three-dimensional; save it as plain text OFF"
            )
        data = file.read_text()
    start = header.end() if header and word else 0
    counts = np.empty((1, 3), dtype=np.float64)
    status, position, rows, _ = kernel.rows(data, start, counts, 2)
    if status == kernel.WHOLE and (counts[0, :2] != np.floor(np.abs(counts[0, :2]))).any():
        status = kernel.BAD
    if status != kernel.WHOLE:
        raise CorruptFile(
            f"{path}: begins with {token_at(data, 0)!r} instead of OFF and the numbers of vertices and faces; "
            "check its suffix"
        )
    n, m = (int(min(count, 1e18)) for count in counts[0, :2])
    if 6 * n + 2 * m > len(data) - position:  # the shortest lines: "0 0 0" and "0", each with its newline
        raise CorruptFile(
            f"{path}: the header says {n} vertices and {m} faces, but only {len(data) - position} bytes "
            "follow; it was cut off"
        )
    points = np.empty((n, 3), dtype=np.float64)
    status, position, rows, slow = kernel.rows(data, position, points, 3)
    what, told = "vertices", n
    if status == kernel.WHOLE:
        settle(data, slow, points.reshape(-1))
        refuse_bad_points(path, points)
        offsets = np.empty(m + 1, dtype=np.int64)
        corners = np.empty((len(data) - position) // 2 + 1, dtype=np.int64)
        status, position, rows = kernel.polygons(data, position, n, offsets, corners)
        what, told = "faces", m
    if status == kernel.CUT_OFF:
        raise CorruptFile(
            f"{path}: the header says {told} {what}, but the file ends after {rows}; it was cut off, fetch it again"
        )
    if status == kernel.OUT_OF_RANGE:
        raise CorruptFile(
            f"{path}: line {line_of(data, position)} has a face that uses vertex {token_at(data, position)} "
            "(counted from 0), but "
            f"the file has {n} vertices; export it again"
        )
    if status == kernel.BAD:
        raise CorruptFile(
            f"{path}: line {line_of(data, position)} has {token_at(data, position)!r} where {what} were "
            "expected; export it again"
        )
    triangles, _ = triangulated(path, points, corners[: offsets[-1]], offsets)
    return assembly_of(path, points, triangles, None, [""], unit)
