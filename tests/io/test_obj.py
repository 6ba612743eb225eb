"""OBJ: every spelling of a face, groups as parts, polygons, faults with their line."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from oracles_mesh_io import same_surface, tetrahedron

from patchwright.models import Assembly, CorruptFile, Part
from patchwright.models.io import read, write

VERTICES = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n"


def given(tmp_path: Path, text: str) -> Assembly:
    (tmp_path / "craft.obj").write_text(text)
    return read(tmp_path / "craft.obj")


@pytest.mark.parametrize(
    "faces",
    [
        "f 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n",
        "f 1/1 3/1 2/1\nf 1/9 2/9 4/9\nf 2/1 3/1 4/1\nf 3/1 1/1 4/1\n",
        "f 1//7 3//7 2//7\nf 1//1 2//1 4//1\nf 2//1 3//1 4//1\nf 3//1 1//1 4//1\n",
        "f 1/1/1 3/-1/-1 2/2/2\nf 1/1/1 2/1/1 4/1/1\nf 2/1/1 3/1/1 4/1/1\nf 3/1/1 1/1/1 4/1/1\n",
        "f -4 -2 -3\nf -4 -3 -1\nf -3 -2 -1\nf -2 -4 -1\n",
        "f 1 \\\n 3 2\nf 1\\\r\n 2 4\n f\t2 3 4 # note\r\nf 3 1 4",
        "s 1\nusemtl steel\nvt 0 0\nvn 0 0 1\nf 1 3 2\nl 1 2\np 3\nf 1 2 4\nf 2 3 4\nf 3 1 4\n# C:\\new\\",
    ],
)
def test_every_spelling_of_a_face(tmp_path: Path, faces: str) -> None:
    assembly = given(tmp_path, VERTICES + faces)
    assert assembly.names == ("craft",)
    assert same_surface(assembly.triangulation, tetrahedron())


def test_a_comment_that_ends_in_a_backslash_does_not_swallow_the_next_line(tmp_path: Path) -> None:
    assembly = given(tmp_path, "# C:\\models\\\n" + VERTICES + "f 1 2 3\n")
    assert np.array_equal(assembly.triangulation.corners[0], [[0, 0, 0], [1, 0, 0], [0, 1, 0]])


def test_negative_indices_count_from_the_vertices_so_far(tmp_path: Path) -> None:
    assembly = given(tmp_path, "v 0 0 0\nv 1 0 0\nv 0 1 0\nf -3 -2 -1\nv 5 0 0 0.1 0.2 0.3\nf -4 -3 -1\n")
    assert assembly.triangulation.corners[1].tolist() == [[0, 0, 0], [1, 0, 0], [5, 0, 0]]


def test_objects_and_groups_name_the_parts_and_a_name_met_again_goes_on(tmp_path: Path) -> None:
    text = VERTICES + "f 1 3 2\ng a b\nf 1 2 4\no car\ng wheel\nf 2 3 4\ng a b\no\nf 3 1 4\n"
    assembly = given(tmp_path, text)
    assert assembly.names == ("craft", "a b", "car/wheel")
    assert [len(p.triangulation) for p in assembly.parts] == [1, 2, 1]
    assert [len(p.triangulation.vertices) for p in assembly.parts] == [3, 4, 3]


def test_polygons_are_cut_and_equal_vertices_merged(tmp_path: Path) -> None:
    text = "v 0 0 0\nv 2 0 0\nv 2 2 0\nv 0 2 0\nv 2 0 -0.0\nv 3 1 0\nv 2.0 2 0\nf 1 2 3 4\nf 5 6 7\nf 1 2\nf\n"
    surface = given(tmp_path, text).triangulation
    assert len(surface) == 3
    assert len(surface.vertices) == 5
    assert surface.areas.sum() == pytest.approx(5.0)


def test_round_trip_with_names(tmp_path: Path) -> None:
    craft = Assembly((Part("wing", tetrahedron(1 / 3)), Part("tail", tetrahedron(np.pi, 1e-9))))
    for name in ("a.obj", "a.obj.gz"):
        write(tmp_path / name, craft)
        back = read(tmp_path / name)
        assert back.names == craft.names
        assert same_surface(back.triangulation, craft.triangulation)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (VERTICES + "f 1 2 5\n", "line 5 has a face that uses vertex 5, but the file has 4"),
        (VERTICES + "f 1 2 3\nf -5 1 2\n", "line 6 has a face that uses vertex 0|line 6 .*-"),
        (VERTICES + "f 0 1 2\n", "line 5 has '0' as a vertex index, but they count from 1"),
        (VERTICES + "f 1 two 3\n", "line 5 has 'two'"),
        (VERTICES + "f 1 2 99999999999999999999\n", "line 5 has '9999"),
        (VERTICES + "f 1.5 2 3\n", "line 5 has '1.5'"),
        ("v 0 0\nv 1 0 0\n", "line 2 has 'v'|line 1"),
        ("v 0 0 z\n", "line 1 has 'z'"),
        (VERTICES.replace("1", "nan", 1) + "f 1 2 3\n", "vertex 2 has a coordinate that is not finite"),
        (VERTICES, "no triangle"),
        ("hello\n", "no triangle"),
        ("v 1", "line 1"),
    ],
)
def test_faults_are_told_with_their_line(tmp_path: Path, text: str, expected: str) -> None:
    with pytest.raises(CorruptFile, match=expected):
        given(tmp_path, text)


def test_vtk_opens_what_is_written(tmp_path: Path) -> None:
    pyvista = pytest.importorskip("pyvista")
    write(tmp_path / "a.obj", Assembly((Part("wing", tetrahedron()), Part("tail", tetrahedron(2.0, 5.0)))))
    mesh = pyvista.read(tmp_path / "a.obj")
    assert mesh.n_cells == 8
    assert mesh.volume == pytest.approx(9.0 / 6.0, rel=1e-6)
