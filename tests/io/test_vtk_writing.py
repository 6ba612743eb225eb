"""VTK files: VTK itself reads back the same points, cells, tags and names."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from oracles_mesh_io import tetrahedron

from patchwright.models import Assembly, Part, StructuredGrid, Triangulation, UnsupportedFormat
from patchwright.models.io import write

CRAFT = Assembly((Part('wing "a" & <b>', tetrahedron(1 / 3)), Part("tail " * 20, tetrahedron(np.pi, 0.1))))
BLOCK = np.random.default_rng(3).normal(size=(3, 4, 5, 3))


@pytest.fixture
def vtk() -> Any:
    return pytest.importorskip("pyvista")


@pytest.mark.parametrize("suffix", [".vtp", ".vtk"])
def test_triangles_tags_and_names(tmp_path: Path, vtk: Any, suffix: str) -> None:
    write(tmp_path / f"a{suffix}", CRAFT)
    mesh = vtk.read(tmp_path / f"a{suffix}")
    assert mesh.points.dtype == np.float64
    assert np.array_equal(mesh.points[mesh.faces.reshape(-1, 4)[:, 1:]], CRAFT.triangulation.corners)
    assert mesh.cell_data["tag"].tolist() == [0] * 4 + [1] * 4
    assert [str(name) for name in mesh.field_data["tag_names"]] == [CRAFT.names[0], CRAFT.names[1].strip()]


def test_pieces_keep_their_names(tmp_path: Path, vtk: Any) -> None:
    write(tmp_path / "a.vtm", CRAFT)
    pieces = vtk.read(tmp_path / "a.vtm")
    assert pieces.keys() == [CRAFT.names[0], CRAFT.names[1].strip()]
    for piece, part in zip(pieces, CRAFT.parts, strict=True):
        assert piece.n_points == 4
        assert np.array_equal(piece.points[piece.faces.reshape(-1, 4)[:, 1:]], part.triangulation.corners)
    assert sorted(p.name for p in tmp_path.rglob("*")) == ["0.vtp", "1.vtp", "a", "a.vtm"]


@pytest.mark.parametrize("suffix", [".vts", ".vtk"])
def test_a_block_with_marks(tmp_path: Path, vtk: Any, suffix: str) -> None:
    marks = np.arange(60).reshape(3, 4, 5) % 2
    write(tmp_path / f"a{suffix}", StructuredGrid((BLOCK,), (), (marks,)))
    mesh = vtk.read(tmp_path / f"a{suffix}")
    assert tuple(mesh.dimensions) == (3, 4, 5)
    assert np.array_equal(np.stack([mesh.x, mesh.y, mesh.z], axis=-1), BLOCK)
    assert np.array_equal(mesh.point_data["invented"].reshape(5, 4, 3).transpose(2, 1, 0), marks)


def test_many_blocks(tmp_path: Path, vtk: Any) -> None:
    grid = StructuredGrid((BLOCK, BLOCK[:, :, :1]), ("nose", "nose"))
    write(tmp_path / "a.vtm", grid)
    blocks = vtk.read(tmp_path / "a.vtm")
    assert blocks.keys() == ["nose", "nose-2"]
    assert tuple(blocks[1].dimensions) == (3, 4, 1)
    assert np.array_equal(np.stack([blocks[0].x, blocks[0].y, blocks[0].z], axis=-1), BLOCK)


@pytest.mark.parametrize(
    ("name", "thing", "expected"),
    [
        ("a.vts", tetrahedron(), "structured grid, not a Triangulation"),
        ("a.vtp", StructuredGrid((BLOCK,)), "grid of 1 blocks; write it as .vtm"),
        ("a.vts", StructuredGrid((BLOCK, BLOCK)), "grid of 2 blocks"),
        ("a.vtm", StructuredGrid(()), "no block"),
        ("a.vtp", Triangulation(np.zeros((0, 3)), np.zeros((0, 3))), "no triangle"),
        ("a.vtp", 5, "not a int"),
    ],
)
def test_what_a_form_cannot_hold_is_refused(tmp_path: Path, name: str, thing: object, expected: str) -> None:
    with pytest.raises(UnsupportedFormat, match=expected):
        write(tmp_path / name, thing)
    assert not list(tmp_path.iterdir())
