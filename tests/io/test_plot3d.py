"""Plot3D: every layout is recognised by its length alone, every option is read back, faces of blocks close up."""

from __future__ import annotations

from collections.abc import Callable
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from oracles_mesh_io import plot3d_binary, tetrahedron

from patchwright.models import CorruptFile, RepairWarning, StructuredGrid, UnsupportedFormat
from patchwright.models.io import read, read_grid, write
from patchwright.models.io.merge import merged
from patchwright.models.io.plot3d import INVENTED
from patchwright.models.io.plot3d_layout import binary_layouts


def block(ni: int, nj: int, nk: int, shift: float = 0.0) -> np.ndarray:
    """A bent block, right-handed, whose coordinates are float32 numbers."""
    i, j, k = np.meshgrid(np.arange(ni), np.arange(nj), np.arange(nk), indexing="ij")
    points = np.stack([i + 0.25 * j * k + shift, j + 0.125 * i * i, k + 0.0625 * i * j], axis=-1)
    return points.astype(np.float32).astype(np.float64)


def equal(a: StructuredGrid, b: StructuredGrid) -> bool:
    return len(a.blocks) == len(b.blocks) and all(np.array_equal(x, y) for x, y in zip(a.blocks, b.blocks, strict=True))


GRID = StructuredGrid((block(3, 4, 1), block(2, 3, 1, 9.0), block(5, 2, 1, 20.0)))


@pytest.mark.parametrize(
    ("order", "width", "records", "blanked"), list(product("<>", (4, 8), (True, False), (True, False)))
)
@pytest.mark.parametrize("many", [True, False])
@pytest.mark.parametrize("dimensions", [3, 2])
def test_every_binary_layout_is_recognised(
    tmp_path: Path, order: str, width: int, records: bool, blanked: bool, many: bool, dimensions: int
) -> None:
    blocks = [block(3, 4, 2 if dimensions == 3 else 1), block(2, 5, 1, 9.0)][: 2 if many else 1]
    iblank = [np.arange(b[..., 0].size).reshape(b.shape[:3]) % 5 + 1 for b in blocks] if blanked else None
    path = tmp_path / "a.xyz"
    path.write_bytes(
        plot3d_binary(
            blocks, order=order, width=width, records=records, many=many, iblank=iblank, dimensions=dimensions
        )
    )
    grid = read_grid(path)
    expected = [b * [1.0, 1.0, dimensions == 3] for b in blocks]
    assert equal(grid, StructuredGrid(tuple(expected)))
    assert len(grid.invented) == (len(blocks) if blanked else 0)


@given(st.lists(st.tuples(*[st.integers(1, 9)] * 3), min_size=1, max_size=4), st.booleans(), st.booleans())
@settings(deadline=None, max_examples=60)
def test_no_fortran_file_fits_two_layouts(sizes: list[tuple[int, int, int]], wide: bool, blanked: bool) -> None:
    blocks = [np.zeros((*size, 3)) for size in sizes]
    iblank = [np.ones(size, dtype=int) for size in sizes] if blanked else None
    content = plot3d_binary(blocks, width=8 if wide else 4, iblank=iblank)
    fitting = [
        x for x in binary_layouts(np.frombuffer(content, dtype=np.uint8)) if x.length == len(content) and x.marker == 4
    ]
    assert len(fitting) == 1
    assert (fitting[0].sizes, fitting[0].width, fitting[0].blanked) == (tuple(sizes), 8 if wide else 4, blanked)


@pytest.mark.parametrize(
    "options", [{}, {"ascii": True}, {"fortran": False}, {"big_endian": True}, {"single": True}, {"iblank": True}]
)
@pytest.mark.parametrize("name", ["a.xyz", "a.p3d", "a.fmt", "a.xyz.gz"])
def test_every_option_reads_back(tmp_path: Path, name: str, options: dict[str, bool]) -> None:
    write(tmp_path / name, GRID, **options)
    assert equal(read_grid(tmp_path / name), GRID)
    if name == "a.fmt":
        assert (tmp_path / name).read_text().split()[:4] == ["3", "3", "4", "1"]


def test_the_written_bytes_are_the_definitions(tmp_path: Path) -> None:
    write(tmp_path / "a.xyz", GRID)
    assert (tmp_path / "a.xyz").read_bytes() == plot3d_binary(list(GRID.blocks))
    one = StructuredGrid((block(3, 2, 4),), (), (np.arange(24).reshape(3, 2, 4) % 2,))
    write(tmp_path / "b.xyz", one, multi_block=False, big_endian=True, iblank=True, fortran=False, single=True)
    mark = [np.where(one.invented[0] == 1, INVENTED, 1)]
    expected = plot3d_binary(list(one.blocks), order=">", width=4, records=False, many=False, iblank=mark)
    assert (tmp_path / "b.xyz").read_bytes() == expected


def test_text_keeps_all_bits(tmp_path: Path) -> None:
    grid = StructuredGrid((np.random.default_rng(5).normal(size=(4, 3, 2, 3)) / 3.0,))
    for many in (True, False):
        write(tmp_path / "a.fmt", grid, multi_block=many)
        assert equal(read_grid(tmp_path / "a.fmt"), grid)


def test_fortran_repeats_and_2d_text(tmp_path: Path) -> None:
    (tmp_path / "a.fmt").write_text("1\n2 3\n 3*0.0, 3*1.5D0\n2*0 2*1 2*2\n")
    points = read_grid(tmp_path / "a.fmt").blocks[0]
    assert points.shape == (2, 3, 1, 3)
    assert points[1, 2, 0].tolist() == [1.5, 2.0, 0.0]


def test_invented_marks_survive_and_hide_nothing(tmp_path: Path) -> None:
    marks = tuple((np.arange(b[..., 0].size).reshape(b.shape[:3]) % 3 == 0).astype(int) for b in GRID.blocks)
    grid = StructuredGrid(GRID.blocks, (), marks)
    for name in ("a.xyz", "a.fmt"):
        write(tmp_path / name, grid, iblank=True)
        back = read_grid(tmp_path / name)
        assert all(np.array_equal(x, y) for x, y in zip(back.invented, marks, strict=True))
        assert len(read(tmp_path / name).triangulation) == 2 * (2 * 3 + 1 * 2 + 4 * 1)


def test_what_is_lost_is_told(tmp_path: Path) -> None:
    with pytest.warns(RepairWarning, match="names of 3 blocks"):
        write(tmp_path / "a.xyz", StructuredGrid(GRID.blocks, ("a", "b", "c")))
    with pytest.warns(RepairWarning, match="iblank=True"):
        write(
            tmp_path / "a.xyz", StructuredGrid(GRID.blocks, (), tuple(np.ones(b.shape[:3], int) for b in GRID.blocks))
        )
    holes = [np.ones(b.shape[:3], dtype=int) for b in GRID.blocks]
    holes[0][1, 1, 0] = 0
    (tmp_path / "a.xyz").write_bytes(plot3d_binary(list(GRID.blocks), iblank=holes))
    with pytest.warns(RepairWarning, match="1 blanked nodes"):
        read_grid(tmp_path / "a.xyz")
    # the four cells round the blanked node are a hole
    assert len(read(tmp_path / "a.xyz").triangulation) == 2 * (2 * 3 + 1 * 2 + 4 * 1 - 4)


def test_surface_blocks_are_parts_that_face_along_i_cross_j(tmp_path: Path) -> None:
    write(tmp_path / "a.xyz", GRID)
    assembly = read(tmp_path / "a.xyz", unit="m")
    assert assembly.names == ("block1", "block2", "block3")
    assert assembly.unit == "m"
    assert all((p.triangulation.normals[:, 2] > 0.0).all() for p in assembly.parts)


@pytest.mark.parametrize("thin", [0, 1, 2])
def test_a_surface_may_be_thin_in_any_direction(tmp_path: Path, thin: int) -> None:
    points = np.moveaxis(block(4, 3, 1), 2, thin)
    (tmp_path / "a.xyz").write_bytes(plot3d_binary([points]))
    surface = read(tmp_path / "a.xyz").triangulation
    assert len(surface) == 2 * 3 * 2
    assert surface.areas.sum() == pytest.approx(6.0 + 0.01, abs=0.1)


@pytest.mark.parametrize("mirror", [1.0, -1.0])
def test_the_faces_of_a_volume_block_close_it_and_point_outwards(tmp_path: Path, mirror: float) -> None:
    i, j, k = np.meshgrid(np.linspace(0, 2, 3), np.linspace(0, 3, 4), np.linspace(0, mirror * 5, 6), indexing="ij")
    (tmp_path / "a.xyz").write_bytes(plot3d_binary([np.stack([i, j, k], axis=-1) + 7.0]))
    assembly = read(tmp_path / "a.xyz")
    assert assembly.names == tuple(f"block1-{axis}{end}" for axis in "ijk" for end in ("min", "max"))
    assert merged(assembly.triangulation).volume == pytest.approx(30.0, rel=1e-12)
    for part, normal in zip(
        assembly.parts, np.repeat(np.eye(3), 2, axis=0) * np.tile([-1, 1], 3)[:, None], strict=True
    ):
        assert part.triangulation.normals @ (normal * [1, 1, mirror]) == pytest.approx(1.0)


def test_a_collapsed_edge_gives_one_triangle_a_cell(tmp_path: Path) -> None:
    points = block(3, 3, 1)
    points[:, 0] = points[0, 0]  # a pole
    (tmp_path / "a.xyz").write_bytes(plot3d_binary([points]))
    surface = read(tmp_path / "a.xyz").triangulation
    assert len(surface) == 2 + 4
    assert surface.areas.min() > 0.0


WHOLE = plot3d_binary(list(GRID.blocks))


@pytest.mark.parametrize(
    ("content", "expected"),
    [
        (b"hello\n", "'hello'"),
        (b"\0" * 500, "does not begin with the numbers of blocks"),
        (b"\x07" * 500, "does not begin with|needs"),
        (
            WHOLE[:-5],
            f"3 blocks of 3×4×1, 2×3×1, 5×2×1 nodes, needs {len(WHOLE)} bytes, but the file has {len(WHOLE) - 5}",
        ),
        (WHOLE + b"\0", f"but the file has {len(WHOLE) + 1}"),
        (b"1\n2 2 1\n1 2 3 4 1 2 3 4 .1 .2 .3\n", "1 blocks of 2×2×1 nodes, needs 16 numbers, but the file has 15"),
        (b"1\n2 2 1\n1 2 3 4 1 nan 3 4 1 2 3 4\n", "block 1 has a node that is not finite at i, j, k = 2, 1, 1"),
        (b"1\n2 1 1\n1 2 1 2 1 2\n", "none of its 1 blocks has a surface cell"),
    ],
)
def test_faults_are_told_with_numbers(tmp_path: Path, content: bytes, expected: str) -> None:
    path = tmp_path / "a.xyz"
    path.write_bytes(content)
    with pytest.raises(CorruptFile, match=expected):
        read(path)


def test_what_the_format_cannot_hold_is_refused(tmp_path: Path) -> None:
    with pytest.raises(UnsupportedFormat, match="structured grid, not a Triangulation"):
        write(tmp_path / "a.xyz", tetrahedron())
    with pytest.raises(UnsupportedFormat, match="cannot hold 3 blocks"):
        write(tmp_path / "a.xyz", GRID, multi_block=False)
    with pytest.raises(UnsupportedFormat, match="cannot hold 0 blocks"):
        write(tmp_path / "a.xyz", StructuredGrid(()))
    with pytest.raises(UnsupportedFormat, match="no option colour; it has ascii, big_endian"):
        write(tmp_path / "a.xyz", GRID, colour=1)
    write(tmp_path / "b.stl", tetrahedron())
    with pytest.raises(UnsupportedFormat, match="no structured grid"):
        read_grid(tmp_path / "b.stl")


@pytest.mark.parametrize("options", [{}, {"big_endian": True, "fortran": False}, {"ascii": True}, {"iblank": True}])
def test_vtk_reads_the_same_grid_when_told_the_layout(tmp_path: Path, options: dict[str, bool]) -> None:
    grid = StructuredGrid((block(3, 4, 2), block(2, 3, 5, 9.0)))
    write(tmp_path / "a.xyz", grid, **options)
    assert equal(by_vtk(tmp_path / "a.xyz", **options), grid)


def test_vtk_reads_the_same_real_file(data: Callable[[str], Path]) -> None:
    assert equal(by_vtk(data("multi_bin.xyz")), read_grid(data("multi_bin.xyz")))


def by_vtk(path: Path, **options: bool) -> StructuredGrid:
    """What VTK makes of a multi-block, double precision file of a given layout."""
    reader = pytest.importorskip("vtkmodules.vtkIOParallel").vtkMultiBlockPLOT3DReader()
    numpy_of = pytest.importorskip("vtkmodules.util.numpy_support").vtk_to_numpy
    reader.SetFileName(str(path))
    reader.AutoDetectFormatOff()
    reader.SetMultiGrid(1)
    reader.SetBinaryFile(0 if options.get("ascii") else 1)
    reader.SetHasByteCount(1 if options.get("fortran", True) and not options.get("ascii") else 0)
    reader.SetByteOrder(0 if options.get("big_endian") else 1)
    reader.SetIBlanking(1 if options.get("iblank") else 0)
    reader.SetDoublePrecision(1)
    reader.Update()
    blocks = [reader.GetOutput().GetBlock(k) for k in range(reader.GetOutput().GetNumberOfBlocks())]
    result = []
    for b in blocks:
        sizes = [0, 0, 0]
        b.GetDimensions(sizes)
        result.append(numpy_of(b.GetPoints().GetData()).reshape(*sizes[::-1], 3).transpose(2, 1, 0, 3))
    return StructuredGrid(tuple(result))
