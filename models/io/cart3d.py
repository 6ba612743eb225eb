"""Cart3D .tri: triangles with a component number each, as text or as Fortran records of either byte order.

Text: "vertices triangles", the coordinates, the indices from 1, the component numbers (which may be missing);
further values of .triq files are not supported. Records: the two counts, the coordinates (float32 or float64), the
indices, the components.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from patchwright.models.arrays import Array, IntArray
from patchwright.models.assembly import Assembly
from patchwright.models.errors import CorruptFile
from patchwright.models.io._text import read_numbers
from patchwright.models.io.opening import Bytes, source
from patchwright.models.io.parts import assembly_of, refuse_bad_indices, refuse_bad_points
from patchwright.models.io.plot3d_layout import marks


def read(path: Path, unit: str | None = None) -> Assembly:
    """The components, one part each, named "component1" and so on in rising order; one part when there are no numbers.

    Raises
    ------
    CorruptFile : counts that do not fit the size, an index out of range, a coordinate that is not finite, no triangle.
    """
    with source(path) as file:
        if file.is_text:
            points, corners, components = _text(path, file.read_text())
        else:
            endian = _byte_order(file.head)
            if endian is None:
                raise CorruptFile(
                    f"{path}: is neither text nor Fortran records with two counts first; check its suffix"
                )
            points, corners, components = _records(path, file.read(), endian)
    refuse_bad_points(path, points)
    refuse_bad_indices(path, corners, len(points), "triangle")
    if components is None:
        return assembly_of(path, points, corners, None, [""], unit)
    numbers, owners = np.unique(components, return_inverse=True)
    return assembly_of(path, points, corners, owners.reshape(-1), [f"component{k}" for k in numbers.tolist()], unit)


def _text(path: Path, data: Bytes) -> tuple[Array, IntArray, IntArray | None]:
    counts, start = read_numbers(path, data, most=2)
    if len(counts) < 2 or (counts != np.floor(np.abs(counts))).any() or counts.max() > len(data):
        raise CorruptFile(
            f"{path}: does not begin with the numbers of vertices and triangles but with {counts.tolist()}; "
            "check its suffix"
        )
    n, m = (int(count) for count in counts)
    values, _ = read_numbers(path, data, start)
    if len(values) not in (3 * n + 3 * m, 3 * n + 4 * m):
        raise CorruptFile(
            f"{path}: {n} vertices and {m} triangles need {3 * n + 3 * m} numbers, or {3 * n + 4 * m} with "
            "components, but "
            f"{len(values)} follow; the file was cut off or holds more than triangles"
        )
    whole = values[3 * n :]
    if not (np.abs(whole) < 2.0**31).all() or (whole != np.floor(whole)).any():
        raise CorruptFile(f"{path}: a vertex index or component is not a whole number; export it again")
    corners = whole[: 3 * m].astype(np.int64).reshape(-1, 3) - 1
    components = whole[3 * m :].astype(np.int64) if len(values) > 3 * n + 3 * m else None
    return values[: 3 * n].reshape(-1, 3), corners, components


def _byte_order(head: bytes) -> str | None:
    """The byte order in which the file begins with a record of two 4-byte counts."""
    marks = {">": (8).to_bytes(4, "big"), "<": (8).to_bytes(4, "little")}
    return next((order for order, mark in marks.items() if head[:4] == mark == head[12:16]), None)


def _records(path: Path, data: Bytes, endian: str) -> tuple[Array, IntArray, IntArray | None]:
    n, m = np.frombuffer(data, dtype=endian + "i4", count=2, offset=4).tolist()
    for width, parts in ((4, 3), (4, 2), (8, 3), (8, 2)):
        lengths = [3 * n * width, 12 * m, 4 * m][:parts]
        if n < 0 or m < 0 or len(data) != 16 + sum(length + 8 for length in lengths):
            continue
        starts = [16 + sum(lengths[:k]) + 8 * k for k in range(parts)]
        if all(marks(data, a + 4, b, 4, endian) for a, b in zip(starts, lengths, strict=True)):
            pieces = [data[a + 4 : a + 4 + b] for a, b in zip(starts, lengths, strict=True)]
            points = pieces[0].view(f"{endian}f{width}").astype(np.float64).reshape(-1, 3)
            corners = pieces[1].view(endian + "i4").astype(np.int64).reshape(-1, 3) - 1
            return points, corners, pieces[2].view(endian + "i4").astype(np.int64) if parts == 3 else None
    raise CorruptFile(
        f"{path}: the header says {n} vertices and {m} triangles, but the records in its {len(data)} bytes do "
        "not fit them; "
        "the file was cut off, fetch it again"
    )
