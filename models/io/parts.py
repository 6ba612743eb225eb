"""From arrays to a named `Assembly` and back: what every mesh format shares."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np
import numpy.typing as npt

from patchwright.models.arrays import Array, IntArray
from patchwright.models.assembly import Assembly, Part
from patchwright.models.errors import CorruptFile, UnsupportedFormat
from patchwright.models.io.merge import merge_points
from patchwright.models.structured_grid import StructuredGrid
from patchwright.models.triangulation import Triangulation

UNKNOWN_UNIT = "unknown"


def stem(path: Path) -> str:
    """The file's name without its suffix (and without ".gz")."""
    name = path.name[:-3] if path.name.lower().endswith(".gz") else path.name
    return Path(name).stem


def unique_names(names: Iterable[str]) -> tuple[str, ...]:
    """The names in order, a later double numbered: "wing", "wing-2"; numbers skip names already in use."""
    wanted = list(names)
    taken = set(wanted)
    seen: set[str] = set()
    latest: dict[str, int] = {}
    unique = []
    for name in wanted:
        own = name
        if own in seen:
            k = latest.get(name, 1) + 1
            while f"{name}-{k}" in taken:
                k += 1
            latest[name] = k
            own = f"{name}-{k}"
            taken.add(own)
        seen.add(own)
        unique.append(own)
    return tuple(unique)


def assembly_of(
    path: Path,
    points: npt.NDArray[np.float32] | Array,
    triangles: IntArray,
    owners: IntArray | None,
    names: Sequence[str],
    unit: str | None,
) -> Assembly:
    """One part per name that has triangles: equal points merged, each part over its own vertices.

    Parameters
    ----------
    points : (n, 3) as stored in the file, finite, float32 or float64
    triangles : (m, 3) indices into `points`, in range
    owners : (m,) index into `names` of each triangle's part; None when there is one part
    names : the parts' names; an empty one becomes the file's stem, doubles are numbered

    Raises
    ------
    CorruptFile : no triangle at all.
    """
    if not len(triangles):
        raise CorruptFile(f"{path}: holds no triangle; export the surface as triangles")
    first, index = merge_points(points)
    vertices = (points[first] + 0.0).astype(np.float64)
    corners = index[triangles]
    groups = [np.arange(0)] * len(names) if owners is not None else []
    if owners is not None:
        order = np.argsort(owners, kind="stable")
        groups = np.split(order, np.searchsorted(owners[order], np.arange(1, len(names))))
    labels = unique_names([name or stem(path) for name in names])
    used = [k for k in range(len(names)) if owners is None or len(groups[k])]
    parts = [Part(labels[k], _own(vertices, corners if owners is None else corners[groups[k]])) for k in used]
    return Assembly(tuple(parts), unit=unit or UNKNOWN_UNIT, source=str(path))


def _own(vertices: Array, triangles: IntArray) -> Triangulation:
    """A part's triangles over the vertices they use, in the order of `vertices`."""
    if 8 * triangles.size < len(vertices):
        used, inverse = np.unique(triangles, return_inverse=True)
        vertices, triangles = vertices[used], inverse.reshape(-1, 3)
    else:
        mask = np.zeros(len(vertices), dtype=np.bool_)
        mask[triangles.ravel()] = True
        if not mask.all():
            renumber = np.cumsum(mask) - 1
            vertices, triangles = vertices[mask], renumber[triangles]
    for array in (vertices, triangles):  # own arrays: frozen here so that the value need not copy them
        array.flags.writeable = False
    return Triangulation(vertices, triangles)


def refuse_bad_points(path: Path, points: npt.NDArray[np.float32] | Array, what: str = "vertex") -> None:
    """Checks (n, 3) points.

    Raises
    ------
    CorruptFile : a coordinate that is NaN or infinite; the text has its number, counted from 1.
    """
    if np.isfinite(points).all():
        return
    bad = np.flatnonzero(~np.isfinite(points).all(axis=1))
    raise CorruptFile(
        f"{path}: {what} {bad[0] + 1} has a coordinate that is not finite, {points[bad[0]].tolist()} ({len(bad)} of "
        f"{len(points)} are bad); repair or drop it in the program that wrote the file"
    )


def refuse_bad_indices(path: Path, corners: IntArray, count: int, owner: str = "face") -> None:
    """Checks (m, 3) vertex indices counted from 0 against the number of vertices.

    Raises
    ------
    CorruptFile : an index out of range; the text has the first one's face, both counted from 1.
    """
    if corners.size and (corners.min() < 0 or corners.max() >= count):
        bad = int(np.flatnonzero(((corners < 0) | (corners >= count)).any(axis=1))[0])
        raise CorruptFile(
            f"{path}: {owner} {bad + 1} uses vertices {(corners[bad] + 1).tolist()} (counted from 1), but the "
            f"file has {count} "
            "vertices; export it again"
        )


def solids(path: Path, thing: object, format_name: str) -> tuple[Triangulation, tuple[str, ...]]:
    """What is to be written: all triangles, tagged, and the unique name of each tag that has triangles.

    An assembly gives one solid a part; one part with tags of its own, and a bare triangulation, one solid a tag.

    Raises
    ------
    UnsupportedFormat : anything but an assembly or a triangulation, or no triangle in it.
    """
    if isinstance(thing, StructuredGrid):
        raise UnsupportedFormat(
            f"{path}: {format_name} holds triangles, not a structured grid; write it as .xyz, .vts or .vtm"
        )
    if isinstance(thing, Assembly):
        whole = thing.triangulation
        if len(thing.parts) == 1 and len(np.unique(_tags(thing.parts[0].triangulation))) > 1:
            whole = thing.parts[0].triangulation
    elif isinstance(thing, Triangulation):
        whole = thing
    else:
        raise UnsupportedFormat(
            f"{path}: {format_name} holds triangles, not a {type(thing).__name__}; tessellate it first"
        )
    if not len(whole):
        raise UnsupportedFormat(
            f"{path}: there is no triangle to write to {format_name}; tessellate the surfaces first"
        )
    used, tags = np.unique(_tags(whole), return_inverse=True)
    own = [" ".join(whole.tag_names[k].split()) if 0 <= k < len(whole.tag_names) else "" for k in used.tolist()]
    names = unique_names([name or (stem(path) if len(used) == 1 else f"solid{i + 1}") for i, name in enumerate(own)])
    tagged = Triangulation(whole.vertices, whole.triangles, tags=tags.reshape(-1), tag_names=names)
    return tagged, names


def _tags(triangulation: Triangulation) -> IntArray:
    """(m,) the tags, zero where there are none."""
    return np.zeros(len(triangulation), dtype=np.int64) if triangulation.tags is None else triangulation.tags
