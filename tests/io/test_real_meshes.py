"""Real files: as many triangles as their index says, names kept, VTK agrees, and what is written reads back the
same."""

from __future__ import annotations

import csv
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from patchwright.models.io import read, read_grid, write

FILES = [
    "c172_wing.stl",
    "featuretype.stl",
    "motor.stl",
    "dtc_hull.stl.gz",
    "dtc_rudder.stl.gz",
    "wigley_hull.stl.gz",
    "multiregion_heater.stl.gz",
    "truck.obj",
    "drivaer_body.obj.gz",
    "of_propeller.obj.gz",
    "cycloidal.ply",
    "boeing.off",
    "cgal_blade.off",
    "mech_holes.off",
    "three_plugs.a.tri",
    "m6_surface.fmt",
]
Find = Callable[[str], Path]


def counted(index: Path, name: str) -> int:
    """Triangles by the index, two for each quad of a structured surface."""
    with index.open() as table:
        size, kind = next(row["size"].split() for row in csv.DictReader(table) if row["file"] == name)
    return int(size) * {"triangles": 1, "quads": 2}[kind]


@pytest.mark.parametrize("name", FILES)
def test_the_number_of_triangles_and_an_exact_round_trip(data: Find, tmp_path: Path, name: str) -> None:
    assembly = read(data(name))
    whole = assembly.triangulation
    assert len(whole) == counted(data("index.csv"), name)
    assert assembly.source.endswith(name)
    assert assembly.unit == "unknown"
    write(tmp_path / "a.stl", assembly)
    back = read(tmp_path / "a.stl")
    assert back.names == tuple(" ".join(n.split()) for n in assembly.names)
    assert np.array_equal(back.triangulation.corners, whole.corners)
    assert len(back.triangulation.vertices) == len(whole.vertices)


@pytest.mark.parametrize(
    ("name", "vertices", "closed"),
    [
        ("dtc_hull.stl.gz", 58033, True),
        ("boeing.off", 1264, True),
        ("drivaer_body.obj.gz", 125446, True),
        ("cgal_blade.off", 8231, False),
    ],
)
def test_equal_vertices_are_merged_so_that_closed_surfaces_close(
    data: Find, name: str, vertices: int, closed: bool
) -> None:
    surface = read(data(name)).parts[0].triangulation
    assert len(surface.vertices) == vertices
    edges = np.sort(surface.triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    _, uses = np.unique(edges @ [len(surface.vertices), 1], return_counts=True)
    assert bool(uses.min() > 1) == closed


def test_names_of_regions(data: Find) -> None:
    assert read(data("multiregion_heater.stl.gz")).names == (
        "topAir_to_heater",
        "leftSolid_to_topAir",
        "rightSolid_to_topAir",
        "leftSolid_to_heater",
        "rightSolid_to_heater",
        "leftSolid_to_bottomAir",
        "rightSolid_to_bottomAir",
        "heater_to_bottomAir",
    )
    assert read(data("of_propeller.obj.gz")).names == ("propellerStem", "propellerTip")
    plugs = read(data("three_plugs.a.tri"))
    assert plugs.names == ("component1", "component2", "component3")
    assert all(part.triangulation.volume > 0.0 for part in plugs.parts)


@pytest.mark.parametrize("name", ["c172_wing.stl", "featuretype.stl", "truck.obj", "cycloidal.ply"])
def test_vtk_reads_the_same_corners(data: Find, name: str) -> None:
    pyvista = pytest.importorskip("pyvista")
    mesh = pyvista.read(data(name))
    theirs = np.asarray(mesh.points)[mesh.faces.reshape(-1, 4)[:, 1:]]
    ours = read(data(name)).triangulation.corners
    assert ours.shape == theirs.shape
    assert np.array_equal(ours.astype(np.float32), theirs.astype(np.float32))


def test_the_nine_blocks_vtk_mistakes_for_one(data: Find) -> None:
    grid = read_grid(data("m6_surface.fmt"))
    sizes = [(65, 17), (73, 65), (17, 65), (65, 73), (73, 17), (17, 73), (17, 17), (17, 17), (73, 17)]
    assert [b.shape[:3] for b in grid.blocks] == [(*size, 1) for size in sizes]
    assert np.ptp(grid.bounds, axis=0) == pytest.approx([1.14396, 0.0788588, 1.21639], rel=1e-5)


def test_binary_blocks_in_fortran_records(data: Find) -> None:
    grid = read_grid(data("multi_bin.xyz"))
    assert [b.shape for b in grid.blocks] == [(8, 12, 12, 3), (8, 12, 12, 3)]
    assert len(read(data("multi_bin.xyz")).triangulation) == 2 * 4 * (11 * 11 + 2 * 7 * 11)
