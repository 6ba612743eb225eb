"""VTK files, written only: legacy .vtk, and the XML forms .vtp (triangles), .vts (a block) and .vtm (several pieces).

Triangles carry the cell array "tag" (which part) and the field array "tag_names"; a grid the point array "invented".
A .vtm file keeps its pieces, named by part or block, in a folder beside it that has the file's name without the suffix.
"""

from __future__ import annotations

from pathlib import Path
from typing import IO
from xml.sax.saxutils import quoteattr

import numpy as np

from patchwright.models.arrays import Array, IntArray
from patchwright.models.errors import ParameterError, UnsupportedFormat
from patchwright.models.io.atomic import writing
from patchwright.models.io.parts import solids, unique_names
from patchwright.models.io.vtk_xml import data_array, footer, header, section, string_array
from patchwright.models.structured_grid import StructuredGrid
from patchwright.models.triangulation import Triangulation


def write(path: Path, thing: object) -> None:
    """Writes an assembly, a triangulation or a grid; coordinates keep their float64 bits.

    Raises
    ------
    UnsupportedFormat : triangles as .vts, a grid as .vtp, several blocks as .vts or .vtk, nothing to write.
    ParameterError : the file cannot be written.
    """
    suffix = path.suffix.lower()
    if suffix == ".vtm":
        _write_pieces(path, thing)
    elif isinstance(thing, StructuredGrid):
        if suffix == ".vtp" or len(thing.blocks) != 1:
            raise UnsupportedFormat(
                f"{path}: {suffix} cannot hold a grid of {len(thing.blocks)} blocks; write it as .vtm"
            )
        with writing(path) as out:
            (_write_vts if suffix == ".vts" else _write_legacy_grid)(out, thing.blocks[0], _marks(thing, 0))
    elif suffix == ".vts":
        raise UnsupportedFormat(f"{path}: .vts holds a structured grid, not a {type(thing).__name__}; write it as .vtp")
    else:
        whole, _ = solids(path, thing, "VTK")
        with writing(path) as out:
            (_write_vtp if suffix == ".vtp" else _write_legacy_triangles)(out, whole)


def _marks(grid: StructuredGrid, block: int) -> IntArray | None:
    """(n,) a block's marks in the order of its points in the file, i fastest; None when the grid has none."""
    return grid.invented[block].transpose(2, 1, 0).ravel() if grid.invented else None


def _write_pieces(path: Path, thing: object) -> None:
    """A .vtm file and its pieces; the pieces come first, so that the index never names a missing one."""
    folder = path.with_suffix("")
    if isinstance(thing, StructuredGrid):
        names = unique_names(thing.names or [f"block{k + 1}" for k in range(len(thing.blocks))])
        suffix = ".vts"
    else:
        whole, names = solids(path, thing, "VTK")
        tags = whole.tags if whole.tags is not None else np.zeros(len(whole), dtype=np.int64)
        suffix = ".vtp"
    if not names:
        raise UnsupportedFormat(f"{path}: there is no block to write")
    try:
        folder.mkdir(exist_ok=True)
    except OSError as error:
        raise ParameterError(f"{folder}: the folder of the pieces cannot be made ({error.strerror})") from error
    files = [f"{k}{suffix}" for k in range(len(names))]
    for k, file in enumerate(files):
        with writing(folder / file) as out:
            if isinstance(thing, StructuredGrid):
                _write_vts(out, thing.blocks[k], _marks(thing, k))
            else:
                piece = whole.take(np.flatnonzero(tags == k)).compact()
                _write_vtp(out, Triangulation(piece.vertices, piece.triangles, tags=None, tag_names=(names[k],)))
    with writing(path) as out:
        out.write(header("vtkMultiBlockDataSet"))
        for k, (name, file) in enumerate(zip(names, files, strict=True)):
            place = quoteattr(f"{folder.name}/{file}")
            out.write(f'<DataSet index="{k}" name={quoteattr(name)} file={place}/>\n'.encode())
        out.write(footer("vtkMultiBlockDataSet"))


def _write_vtp(out: IO[bytes], whole: Triangulation) -> None:
    m = len(whole)
    tags = whole.tags if whole.tags is not None else np.zeros(m, dtype=np.int64)
    out.write(header("PolyData"))
    section(out, "FieldData", [string_array("tag_names", whole.tag_names)])
    out.write(f'<Piece NumberOfPoints="{len(whole.vertices)}" NumberOfPolys="{m}">\n'.encode())
    section(out, "CellData", [data_array("tag", tags)])
    section(out, "Points", [data_array("Points", whole.vertices)])
    offsets = np.arange(3, 3 * m + 1, 3, dtype=np.int64)
    section(out, "Polys", [data_array("connectivity", whole.triangles.ravel()), data_array("offsets", offsets)])
    out.write(b"</Piece>\n" + footer("PolyData"))


def _write_vts(out: IO[bytes], block: Array, marks: IntArray | None) -> None:
    extent = " ".join(f"0 {n - 1}" for n in block.shape[:3])
    out.write(
        header("StructuredGrid").replace(b"<StructuredGrid>", f'<StructuredGrid WholeExtent="{extent}">'.encode())
    )
    out.write(f'<Piece Extent="{extent}">\n'.encode())
    section(out, "PointData", [] if marks is None else [data_array("invented", marks)])
    section(out, "Points", [data_array("Points", _i_fastest(block))])
    out.write(b"</Piece>\n" + footer("StructuredGrid"))


def _i_fastest(block: Array) -> Array:
    """(n, 3) the points of (ni, nj, nk, 3) with i running fastest, VTK's order."""
    return np.ascontiguousarray(block.transpose(2, 1, 0, 3)).reshape(-1, 3)


# https://docs.vtk.org/en/latest/vtk_file_formats/vtk_legacy_file_format.html; the binary data is big-endian
_LEGACY = "# vtk DataFile Version 3.0\nwritten by patchwright\nBINARY\nDATASET {kind}\n"


def _write_legacy_triangles(out: IO[bytes], whole: Triangulation) -> None:
    m = len(whole)
    tags = whole.tags if whole.tags is not None else np.zeros(m, dtype=np.int64)
    out.write(_LEGACY.format(kind="POLYDATA").encode())
    out.write(f"FIELD FieldData 1\ntag_names 1 {len(whole.tag_names)} string\n".encode())
    out.write(b"".join(map(_legacy_string, whole.tag_names)) + b"\n")
    out.write(f"POINTS {len(whole.vertices)} double\n".encode() + whole.vertices.astype(">f8").tobytes())
    polygons = np.column_stack([np.full(m, 3), whole.triangles]).astype(">i4")
    out.write(f"\nPOLYGONS {m} {4 * m}\n".encode() + polygons.tobytes())
    out.write(
        f"\nCELL_DATA {m}\nSCALARS tag int 1\nLOOKUP_TABLE default\n".encode() + tags.astype(">i4").tobytes() + b"\n"
    )


def _legacy_string(name: str) -> bytes:
    """A string after its length in one, two or four bytes, whose first two bits tell how many (11, 10, 01)."""
    text = name.encode()
    for width, bits in ((1, 0xC0), (2, 0x80 << 8), (4, 0x40 << 24)):
        if len(text) < 1 << (8 * width - 2):
            return (bits | len(text)).to_bytes(width, "big") + text
    raise UnsupportedFormat(f"a name of {len(text)} bytes is too long for VTK's legacy form; write it as .vtp")


def _write_legacy_grid(out: IO[bytes], block: Array, marks: IntArray | None) -> None:
    n = block[..., 0].size
    out.write(_LEGACY.format(kind="STRUCTURED_GRID").encode())
    out.write("DIMENSIONS {} {} {}\n".format(*block.shape[:3]).encode())
    out.write(f"POINTS {n} double\n".encode() + _i_fastest(block).astype(">f8").tobytes() + b"\n")
    if marks is not None:
        out.write(
            f"POINT_DATA {n}\nSCALARS invented int 1\nLOOKUP_TABLE default\n".encode()
            + marks.astype(">i4").tobytes()
            + b"\n"
        )
