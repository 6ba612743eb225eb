"""Plot3D grids: text and binary, Fortran records or a stream, single and double precision, one block or many.

The layout is found by `plot3d_layout`. Plot3D has no names and no unit. Not supported: unformatted solution and
function files, the "planes" form, 1-D grids.

IBLANK as written here is 1 for a node on the input's surface and `INVENTED` for one on surface that gap filling
invented. Readers blank a node only where IBLANK is 0, so the marks hide nothing.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any

import numpy as np
import numpy.typing as npt

from patchwright.models.arrays import Array, IntArray
from patchwright.models.assembly import Assembly
from patchwright.models.errors import CorruptFile, RepairWarning, UnsupportedFormat
from patchwright.models.io._text import integer_lines, number_lines, read_numbers
from patchwright.models.io.atomic import writing
from patchwright.models.io.block_faces import block_faces
from patchwright.models.io.opening import Bytes, Source, source
from patchwright.models.io.parts import assembly_of
from patchwright.models.io.plot3d_layout import Layout, binary_layouts, marks, text_layouts
from patchwright.models.structured_grid import StructuredGrid

INVENTED = 9  # IBLANK of a node on invented surface; PLOT3D itself gives a meaning to 0, 1, 2 and negative values
HEADER = 1 << 22  # bytes in which a binary file's table of blocks must lie: 350,000 blocks
TEXT_SUFFIXES = (".fmt", ".p3dfmt")
PER_LINE = 4  # numbers in a line of text


@dataclass(frozen=True, slots=True, eq=False)
class _Contents:
    """Blocks as `StructuredGrid` has them, and each block's IBLANK (empty when the file has none)."""

    blocks: tuple[Array, ...]
    iblank: tuple[Array | IntArray, ...]


def read_grid(path: Path) -> StructuredGrid:
    """The blocks; `invented` is set where IBLANK is `INVENTED`; a 2-D grid gets z = 0.

    Raises
    ------
    CorruptFile : no layout accounts for the file's length, or a coordinate is not finite.

    Warns
    -----
    RepairWarning : blanked nodes (IBLANK 0), which become ordinary ones.
    """
    contents = _contents(path)
    blanked = sum(int(np.count_nonzero(m == 0)) for m in contents.iblank)
    if blanked:
        warnings.warn(f"{path}: {blanked} blanked nodes are kept as ordinary ones", RepairWarning, stacklevel=3)
    return StructuredGrid(contents.blocks, (), tuple((m == INVENTED).astype(np.int64) for m in contents.iblank))


def read(path: Path, unit: str | None = None) -> Assembly:
    """The grid as triangles: a part "block1" per surface block, six parts "block1-imin" … "block1-kmax" per volume
    block.

    Two triangles a cell, those with two equal corners left out, and cells with a blanked node (IBLANK 0) too. A
    surface block faces along i × j, a volume block's faces point outwards.

    Raises
    ------
    CorruptFile : as `read_grid`, or no cell at all.
    """
    contents = _contents(path)
    points, triangles, names = [], [], []
    begin = 0
    for k, block in enumerate(contents.blocks):
        visible = contents.iblank[k] != 0 if contents.iblank else np.ones(block.shape[:3], dtype=np.bool_)
        for label, corners in block_faces(path, block, visible):
            triangles.append(corners + begin)
            names.append(f"block{k + 1}{label}")
        points.append(block.reshape(-1, 3))
        begin += block[..., 0].size
    if not triangles:
        raise CorruptFile(
            f"{path}: none of its {len(contents.blocks)} blocks has a surface cell; give each two directions of nodes"
        )
    owners = np.repeat(np.arange(len(names)), [len(corners) for corners in triangles])
    return assembly_of(path, np.concatenate(points), np.concatenate(triangles), owners, names, unit)


def _contents(path: Path) -> _Contents:
    with source(path) as file:
        contents = _text(path, file.read_text()) if file.is_text else _binary(file)
    for k, block in enumerate(contents.blocks):
        bad = ~np.isfinite(block).all(axis=-1)
        if bad.any():
            i, j, m = (int(n) + 1 for n in np.argwhere(bad)[0])
            raise CorruptFile(
                f"{path}: block {k + 1} has a node that is not finite at i, j, k = {i}, {j}, {m} "
                f"({int(bad.sum())} in all); "
                "export it again"
            )
    return contents


def _text(path: Path, data: Bytes) -> _Contents:
    values, _ = read_numbers(path, data)
    first_line = (data[:HEADER].tobytes().lstrip().splitlines() or [b""])[0]
    layouts = list(text_layouts(values, alone=len(first_line.replace(b",", b" ").split()) == 1))
    for layout in layouts:
        if layout.length == len(values):
            contents = _cut(layout, values)
            if all((m == np.floor(m)).all() for m in contents.iblank):
                return contents
    raise _no_fit(path, layouts, len(values), "numbers")


def _binary(file: Source) -> _Contents:
    layouts = list(binary_layouts(file.read(HEADER)))
    if file.size is not None and all(layout.length != file.size for layout in layouts):
        raise _no_fit(file.path, layouts, file.size, "bytes")
    data = file.read()
    for layout in layouts:
        if layout.length == len(data) and all(
            marks(data, start, layout.record(k), layout.marker, layout.order)
            for k, start in enumerate(layout.starts())
            if layout.marker
        ):
            return _cut(layout, data)
    raise _no_fit(file.path, layouts, len(data), "bytes")


def _no_fit(path: Path, layouts: list[Layout], length: int, what: str) -> CorruptFile:
    """The sentence for a file no layout accounts for; the layout that needs least beyond the file is named."""
    others = (layout for layout in layouts if layout.length != length)
    likely = min(others, key=lambda layout: abs(layout.length - length), default=None)
    if likely is None:
        return CorruptFile(
            f"{path}: does not begin with the numbers of blocks and nodes of a Plot3D grid; check its suffix"
        )
    sizes = ", ".join("×".join(map(str, size)) for size in likely.sizes[:3]) + (", …" if len(likely.sizes) > 3 else "")
    return CorruptFile(
        f"{path}: its header, read as {len(likely.sizes)} blocks of {sizes} nodes, needs {likely.length} "
        f"{what}, but the file has "
        f"{length}; it was cut off or is no Plot3D grid, fetch or export it again"
    )


def _cut(layout: Layout, data: Array | Bytes) -> _Contents:
    """The blocks out of the whole file, `data` being its bytes or its numbers."""
    blocks: list[Array] = []
    iblank: list[Array | IntArray] = []
    for size, start in zip(layout.sizes, layout.starts(), strict=True):
        nodes, dimensions = int(np.prod(size)), len(size)
        ni, nj, nk = (*size, 1)[:3]
        end = start + nodes * dimensions * layout.width
        raw = data[start:end]
        with np.errstate(invalid="ignore"):
            values = (raw.view(f"{layout.order}f{layout.width}") if layout.order else raw).astype(np.float64)
        block = np.zeros((ni, nj, nk, 3))
        block[..., :dimensions] = values.reshape(dimensions, nk, nj, ni).transpose(3, 2, 1, 0)
        blocks.append(block)
        if layout.blanked:
            raw = data[end : end + nodes * layout.integer]
            marks_of_nodes = raw.view(layout.order + "i4").astype(np.int64) if layout.order else raw.astype(np.float64)
            iblank.append(marks_of_nodes.reshape(nk, nj, ni).transpose(2, 1, 0))
    return _Contents(tuple(blocks), tuple(iblank))


def write(
    path: Path,
    thing: object,
    *,
    ascii: bool | None = None,  # noqa: A002
    fortran: bool = True,
    single: bool = False,
    big_endian: bool = False,
    iblank: bool = False,
    multi_block: bool = True,
) -> None:
    """Writes a grid in three dimensions, "whole" form.

    Parameters
    ----------
    thing : a StructuredGrid
    ascii : text; None: for the suffixes .fmt and .p3dfmt
    fortran : records with their length before and after, else a plain stream of bytes
    single : float32 instead of float64 (binary only; text always reads back the same float64)
    big_endian : byte order of the binary forms
    iblank : also write IBLANK: 1, and `INVENTED` where `invented` is set
    multi_block : begin with the number of blocks, which one block alone may go without

    Raises
    ------
    UnsupportedFormat : not a grid, no block, more than one block with multi_block=False, a record beyond 2 GiB.
    ParameterError : the file cannot be written.

    Warns
    -----
    RepairWarning : block names, or marks of invented nodes with iblank=False, which are not written.
    """
    if not isinstance(thing, StructuredGrid):
        raise UnsupportedFormat(
            f"{path}: Plot3D holds a structured grid, not a {type(thing).__name__}; write it as .stl or .step"
        )
    if not thing.blocks or (len(thing.blocks) > 1 and not multi_block):
        raise UnsupportedFormat(
            f"{path}: a Plot3D file with multi_block={multi_block} cannot hold {len(thing.blocks)} blocks"
        )
    if thing.names:
        warnings.warn(f"{path}: Plot3D loses the names of {len(thing.names)} blocks", RepairWarning, stacklevel=3)
    if not iblank and any(m.any() for m in thing.invented):
        warnings.warn(
            f"{path}: the marks of nodes on invented surface are not written; keep them with iblank=True",
            RepairWarning,
            stacklevel=3,
        )
    text = ascii if ascii is not None else path.name.lower().removesuffix(".gz").endswith(TEXT_SUFFIXES)
    order = ">" if big_endian else "<"
    width = 4 if single else 8
    largest = max(b[..., 0].size for b in thing.blocks) * (3 * width + 4 * iblank)
    if fortran and not text and largest >= 2**31:
        raise UnsupportedFormat(
            f"{path}: a block needs {largest} bytes, a Fortran record holds 2^31 − 1; write it with fortran=False"
        )
    with writing(path) as out:
        sizes = np.array([b.shape[:3] for b in thing.blocks], dtype=np.int64)
        head = [np.array([len(sizes)])] if multi_block else []
        for table in [*head, sizes.ravel()]:
            _put(out, [table.astype(order + "i4")], text, fortran)
        for k, block in enumerate(thing.blocks):
            coordinates = block.transpose(3, 2, 1, 0).ravel()
            record: list[npt.NDArray[Any]] = [coordinates if text else coordinates.astype(f"{order}f{width}")]
            if iblank:
                mark = thing.invented[k] if thing.invented else np.zeros(block.shape[:3], dtype=np.int64)
                record.append(np.where(mark != 0, INVENTED, 1).transpose(2, 1, 0).ravel().astype(order + "i4"))
            _put(out, record, text, fortran)


def _put(out: IO[bytes], record: list[npt.NDArray[Any]], text: bool, fortran: bool) -> None:
    """One record: as lines, or as bytes with their count around them, or plain."""
    if text:
        for values in record:
            lines = integer_lines if values.dtype.kind == "i" else number_lines
            whole = len(values) - len(values) % PER_LINE
            out.write(lines(values[:whole].reshape(-1, PER_LINE)))
            if whole < len(values):
                out.write(lines(values[whole:].reshape(1, -1)))
        return
    body = b"".join(values.tobytes() for values in record)
    order = record[0].dtype.str[0]
    mark = np.array(len(body), dtype=order + "i4").tobytes() if fortran else b""
    out.write(mark + body + mark)
