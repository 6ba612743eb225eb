"""Wavefront OBJ, plain or gzipped: polygons in named objects and groups.

Faces "v", "v/vt", "v//vn", "v/vt/vn", negative indices, joined lines. A face's part is named by the object ("o") and
group ("g") it stands under, "object/group" when both are given; lines that come back to a name go on with that part.
Not supported: free-form curves and surfaces, texture coordinates, normals, materials, points and lines (all skipped).
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from patchwright.models.arrays import IntArray
from patchwright.models.assembly import Assembly
from patchwright.models.errors import CorruptFile
from patchwright.models.io._text import integer_lines, number_lines, settle
from patchwright.models.io.atomic import writing
from patchwright.models.io.opening import Bytes, line_of, source, token_at
from patchwright.models.io.parts import assembly_of, refuse_bad_points, solids
from patchwright.models.io.polygons import triangulated


def read(path: Path, unit: str | None = None) -> Assembly:
    """The objects and groups of an OBJ file, one part each, in order of first use; polygons are cut into triangles.

    Raises
    ------
    CorruptFile : a line that cannot be read, an index out of range, a coordinate that is not finite, no face.
    UnsupportedEntity : a polygon with too many corners to cut.
    """
    from patchwright.models.io import _obj_kernel as kernel

    with source(path) as file:
        data = file.read_text()
    # the shortest lines: "v 0 0 0", "f 1 2 3", each with its newline
    coordinates = np.empty(3 * (len(data) // 7 + 1), dtype=np.float64)
    corners = np.empty(len(data) // 2 + 1, dtype=np.int64)
    offsets = np.empty(len(data) // 2 + 2, dtype=np.int64)
    places = np.empty(len(data) // 2 + 1, dtype=np.int64)
    status, position, count, faces, names, slow = kernel.scan(data, coordinates, corners, offsets, places)
    if status != kernel.WHOLE:
        wanted = {
            kernel.BAD_NUMBER: "where a coordinate was expected",
            kernel.BAD_INDEX: "where a vertex index was expected",
            kernel.ZERO_INDEX: "as a vertex index, but they count from 1",
        }[status]
        raise CorruptFile(
            f"{path}: line {line_of(data, position)} has {token_at(data, position)!r} {wanted}; correct it or "
            "export the file again"
        )
    settle(data, slow, coordinates)
    points = coordinates[:count].reshape(-1, 3).copy()
    refuse_bad_points(path, points)
    offsets = offsets[: faces + 1]
    corners = corners[: offsets[-1]]
    wrong = np.flatnonzero((corners < 0) | (corners >= len(points)))
    if wrong.size:
        face = int(np.searchsorted(offsets, wrong[0], side="right")) - 1
        raise CorruptFile(
            f"{path}: line {line_of(data, int(places[face]))} has a face that uses vertex "
            f"{corners[wrong[0]] + 1}, but the file "
            f"has {len(points)} vertices; export it again"
        )
    triangles, polygons = triangulated(path, points, corners, offsets)
    labels, part_of_face = _parts(data, names, faces)
    owners = None if len(labels) == 1 else part_of_face[polygons]
    return assembly_of(path, points, triangles, owners, labels, unit)


def _parts(data: Bytes, names: IntArray, faces: int) -> tuple[list[str], IntArray]:
    """The different names in order of first use, and which of them each face has."""
    label = {"": 0}
    starts, which = [0], [0]
    current = ["", ""]
    for key, begin, end in names.tolist():
        kind, before = divmod(key, 1 << 32)
        current[kind] = " ".join(data[begin:end].tobytes().decode("utf-8", "replace").split())
        own = "/".join(dict.fromkeys(name for name in current if name))
        starts.append(before)
        which.append(label.setdefault(own, len(label)))
    part_of_face = np.repeat(np.array(which), np.diff([*starts, faces]))
    if not (part_of_face == 0).any() and len(label) > 1:
        return list(label)[1:], part_of_face - 1
    return list(label), part_of_face


def write(path: Path, thing: object) -> None:
    """Writes an assembly (a group per part) or a triangulation (a group per tag); coordinates read back the same.

    Raises
    ------
    UnsupportedFormat : not triangles, or none.
    ParameterError : the file cannot be written.
    """
    whole, names = solids(path, thing, "OBJ")
    tags = whole.tags if whole.tags is not None else np.zeros(len(whole), dtype=np.int64)
    with writing(path) as out:
        out.write(number_lines(whole.vertices, "v "))
        for k, name in enumerate(names):
            out.write(f"g {name}\n".encode())
            out.write(integer_lines(whole.triangles[tags == k] + 1, "f "))
