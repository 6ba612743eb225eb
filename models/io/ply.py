"""PLY, plain or gzipped: text, little-endian and big-endian binary; polygons, any further elements and properties
skipped.

PLY has no names: the surface is one part. Not supported: triangle strips.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from patchwright.models.arrays import Array, IntArray
from patchwright.models.assembly import Assembly
from patchwright.models.errors import CorruptFile, RepairWarning, UnsupportedEntity
from patchwright.models.io._text import integer_lines, number_lines, read_numbers
from patchwright.models.io.atomic import writing
from patchwright.models.io.opening import Bytes, source
from patchwright.models.io.parts import assembly_of, refuse_bad_indices, refuse_bad_points, solids
from patchwright.models.io.ply_header import Element, Header, parse_header
from patchwright.models.io.polygons import triangulated


@dataclass(slots=True)
class _Cursor:
    """What follows the header, and how far it was read: in bytes, or in numbers for a text file."""

    path: Path
    header: Header
    data: Bytes
    values: Array | None
    position: int

    def cut_off(self, element: Element, rows: int) -> CorruptFile:
        return CorruptFile(
            f"{self.path}: the header says {element.rows} rows of {element.name}, but the file ends after "
            f"{rows}; it was cut off, "
            "fetch it again"
        )


def read(path: Path, unit: str | None = None) -> Assembly:
    """The file's polygons, cut into triangles, as one part named by the file; float32 coordinates are kept exactly.

    Raises
    ------
    CorruptFile : not PLY, cut off, an index out of range, a coordinate that is not finite, no vertex or face.
    UnsupportedEntity : triangle strips, a polygon with too many corners to cut.
    """
    with source(path) as file:
        header = parse_header(path, file.head)
        data = file.read()
    values = read_numbers(path, data, header.length)[0] if not header.order else None
    cursor = _Cursor(path, header, data, values, header.length if values is None else 0)
    points: Array | None = None
    polygons: tuple[IntArray, IntArray] | None = None
    for element in header.elements:
        if element.name == "vertex" and points is None:
            points = _points(cursor, element)
        elif element.name == "face" and polygons is None:
            polygons = _lists(cursor, element, element.find("vertex_indices", "vertex_index"))
        elif element.name == "tristrips":
            raise UnsupportedEntity(f"{path}: holds triangle strips, which are not read; export single faces")
        else:
            _lists(cursor, element, -1)
        if points is not None and polygons is not None:
            break
    if points is None or polygons is None or not len(polygons[1]):
        raise CorruptFile(f"{path}: holds no {'vertex' if points is None else 'face'}; export the surface as triangles")
    refuse_bad_points(path, points)
    offsets, corners = polygons
    faces = np.repeat(np.arange(len(offsets) - 1), np.diff(offsets))
    wrong = np.flatnonzero((corners < 0) | (corners >= len(points)))
    if wrong.size:
        at = int(wrong[0])
        raise CorruptFile(
            f"{path}: face {faces[at] + 1} uses vertex {corners[at]} (counted from 0), but the file has "
            f"{len(points)} vertices; "
            "export it again"
        )
    triangles, _ = triangulated(path, points, corners, offsets)
    refuse_bad_indices(path, triangles, len(points))
    return assembly_of(path, points, triangles, None, [""], unit)


def _points(cursor: _Cursor, element: Element) -> Array:
    """(n, 3) the vertices' coordinates."""
    columns = [element.find(name) for name in "xyz"]
    if min(columns) < 0 or any(p.count for p in element.properties):
        raise CorruptFile(f"{cursor.path}: its vertices do not have plain properties x, y and z; export it again")
    n, k = element.rows, len(element.properties)
    if cursor.values is not None:
        block = cursor.values[cursor.position : cursor.position + n * k]
        if len(block) < n * k:
            raise cursor.cut_off(element, len(block) // k)
        cursor.position += n * k
        return np.ascontiguousarray(block.reshape(n, k)[:, columns])
    row = np.dtype([(f"p{i}", cursor.header.order + p.item) for i, p in enumerate(element.properties)])
    if n * row.itemsize > len(cursor.data) - cursor.position:
        raise cursor.cut_off(element, max(0, len(cursor.data) - cursor.position) // row.itemsize)
    rows = cursor.data[cursor.position : cursor.position + n * row.itemsize].view(row)
    cursor.position += n * row.itemsize
    with np.errstate(invalid="ignore"):  # a signalling NaN is found later, with its vertex
        return np.stack([rows[f"p{i}"].astype(np.float64) for i in columns], axis=1)


def _lists(cursor: _Cursor, element: Element, target: int) -> tuple[IntArray, IntArray]:
    """The lists of property `target` of an element's rows, as (offsets, items); −1 only walks over the rows."""
    from patchwright.models.io import _ply_kernel as kernel

    if element.name == "face" and (
        target < 0 or not element.properties[target].count or element.properties[target].item[0] == "f"
    ):
        raise CorruptFile(
            f"{cursor.path}: its faces have no list of whole numbers named vertex_indices; export it again"
        )
    layout = element.layout
    left = (len(cursor.data) if cursor.values is None else len(cursor.values)) - cursor.position
    least = (
        len(layout) if cursor.values is not None else int(np.where(layout[:, 0] == 1, layout[:, 1], layout[:, 3]).sum())
    )
    if element.rows * least > max(left, 0) or (least == 0 and element.rows > 0):
        raise cursor.cut_off(element, left // max(least, 1))
    offsets = np.zeros(element.rows + 1, dtype=np.int64)
    width = int(layout[target, 3]) if cursor.values is None else 1
    items = np.empty(left // width if target >= 0 else 0, dtype=np.int64)
    if cursor.values is None:
        big = cursor.header.order == ">"
        status, position, rows = kernel.walk_bytes(
            cursor.data, cursor.position, element.rows, layout, target, big, offsets, items
        )
    else:
        status, position, rows = kernel.walk_numbers(
            cursor.values, cursor.position, element.rows, layout, target, offsets, items
        )
    if status == kernel.CUT_OFF:
        raise cursor.cut_off(element, rows)
    if status == kernel.NOT_COUNT:
        raise CorruptFile(
            f"{cursor.path}: row {rows + 1} of {element.name} has a list of no sensible length; export it again"
        )
    cursor.position = position
    return offsets, items[: offsets[-1]].copy()


def write(path: Path, thing: object, *, ascii: bool = False) -> None:  # noqa: A002
    """Writes an assembly or a triangulation as one surface, float64 coordinates, little-endian binary or text.

    Raises
    ------
    UnsupportedFormat : not triangles, or none.
    ParameterError : the file cannot be written.

    Warns
    -----
    RepairWarning : more than one name; PLY has none.
    """
    whole, names = solids(path, thing, "PLY")
    if len(names) > 1:
        warnings.warn(
            f"{path}: PLY loses the names of {len(names)} parts; write .stl or .obj", RepairWarning, stacklevel=3
        )
    with writing(path) as out:
        out.write(
            f"ply\nformat {'ascii' if ascii else 'binary_little_endian'} 1.0\nelement vertex {len(whole.vertices)}\n"
            "property double x\nproperty double y\nproperty double z\n"
            f"element face {len(whole)}\nproperty list uchar int vertex_indices\nend_header\n".encode()
        )
        if ascii:
            out.write(number_lines(whole.vertices))
            out.write(integer_lines(whole.triangles, "3 "))
            return
        out.write(whole.vertices.astype("<f8").tobytes())
        rows = np.zeros(len(whole), dtype=[("count", "u1"), ("corners", "<i4", (3,))])
        rows["count"], rows["corners"] = 3, whole.triangles
        out.write(rows.tobytes())
